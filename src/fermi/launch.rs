//! Launches of kernels: what each thread does.

use super::cut::Cut;
use super::kernel::Kernel;
use super::occupancy::Demand;
use super::simt::LANES;
use crate::trace::StepTrace;

/// What the rays did, and the tree they did it in.
#[derive(Clone, Copy, Debug)]
pub struct Workload<'a> {
    /// Steps of each ray.
    pub trace: &'a StepTrace,
    /// Child links of each node.
    pub children: &'a [[u32; 2]],
    /// Number of triangles.
    pub triangles: usize,
    /// Where the tree is cut into subtrees, if it is.
    pub cut: Option<&'a Cut<'a>>,
}

/// A ray's stay at a multiprocessor: from a queue to the next, or to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// The ray.
    pub ray: u32,
    /// The subtree in whose queue it was.
    pub subtree: u32,
    /// Its steps, counted from the ray's first.
    pub steps: (u32, u32),
}

/// What the threads of a launch do.
#[derive(Clone, Copy, Debug)]
pub enum Work<'a> {
    /// Thread `i` takes ray `i` through the whole tree.
    Rays,
    /// As `Rays`, but a warp takes the next 32 rays when it is done: multiprocessors are full from the start.
    Persistent,
    /// Thread `i` takes ray `i` through the top tree to its first subtree.
    Schedule,
    /// Block `b` goes through entries `blocks[b]..blocks[b + 1]` of the queue, its threads in turn.
    Visits {
        /// Entries in order.
        queue: &'a [Visit],
        /// First entry of each block, and the end.
        blocks: &'a [u32],
        /// Whether queues and the walk of the top tree cost something.
        charged: bool,
    },
    /// A pass of the counting sort that makes queues.
    Sort(super::sort::Pass<'a>),
}

/// One launch of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct Launch<'a> {
    /// The kernel.
    pub kernel: &'a Kernel,
    /// The tree and the rays.
    pub workload: Workload<'a>,
    /// What its threads do.
    pub work: Work<'a>,
    /// Whether each subtree has a first-level cache of its own, as large as the real one (Zhu and Deng 2013,
    /// section IV.B).
    pub virtual_caches: bool,
    /// What it is part of, for the result.
    pub stage: Stage,
}

/// Stages of a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// The first walk of the top tree.
    Schedule,
    /// Making queues.
    Queue,
    /// Traversal: of the whole tree, or of subtrees with walks of the top tree in between.
    Traverse,
}

impl Launch<'_> {
    /// What a block asks of a multiprocessor.
    pub fn demand(&self) -> Demand {
        match self.work {
            Work::Sort(pass) => Demand { threads: pass.block_threads() as u32, ..self.kernel.demand() },
            _ => self.kernel.demand(),
        }
    }

    /// Threads that are given a multiprocessor together.
    pub fn block_threads(&self) -> usize {
        match self.work {
            Work::Persistent => LANES,
            Work::Sort(pass) => pass.block_threads(),
            _ => self.kernel.threads as usize,
        }
    }

    /// Blocks that find room on a multiprocessor with room for `blocks` of the kernel's.
    pub fn slots(&self, blocks: u32) -> usize {
        let threads = blocks as usize * (self.demand().threads as usize).next_multiple_of(LANES);
        threads / self.block_threads().next_multiple_of(LANES)
    }

    /// Threads of the launch that have something to do, where a thread does one thing.
    fn threads(&self) -> usize {
        match self.work {
            Work::Rays | Work::Persistent | Work::Schedule => self.workload.trace.rays(),
            Work::Visits { blocks, .. } => (blocks.len() - 1) * self.block_threads(),
            Work::Sort(pass) => pass.threads(),
        }
    }

    /// Blocks.
    pub fn blocks(&self) -> usize {
        self.threads().div_ceil(self.block_threads())
    }

    /// Warps of block `block`, those without anything to do left out.
    pub fn warps_of(&self, block: usize) -> usize {
        let first = block * self.block_threads();
        let threads = (self.threads() - first).min(self.block_threads());
        let busy = match self.work {
            Work::Visits { blocks, charged: false, .. } => threads.min((blocks[block + 1] - blocks[block]) as usize),
            _ => threads,
        };
        busy.div_ceil(LANES)
    }

    /// Rays that the launch is about.
    pub fn rays(&self) -> usize {
        self.workload.trace.rays()
    }

    /// First-level caches of a multiprocessor.
    pub fn caches(&self) -> u32 {
        let subtrees = self.workload.cut.map_or(0, |cut| cut.subtrees().len() as u32);
        if self.virtual_caches { subtrees + 1 } else { 1 }
    }
}
