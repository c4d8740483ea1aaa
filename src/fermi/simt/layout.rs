//! Where things lie in memory.

use std::ops::Range;

use super::LANES;
use crate::fermi::cache::Places;
use crate::fermi::cut::Home;
use crate::fermi::launch::Workload;
use crate::fermi::machine::LINE;
use crate::layout::{Hit, Node, QueueEntry, Ray, Subtree, Travel, Triangle};

/// Bytes of one load instruction of a lane.
pub(super) const LOAD: u64 = 16;
/// Bytes of a stack entry, and of any other word.
pub(super) const WORD: u64 = 4;

/// Bytes of `T` in memory: of this project and, for nodes, triangles, rays and hits, of the reference kernel.
pub(super) const fn bytes<T>() -> u64 {
    size_of::<T>() as u64
}

/// Lines that hold bytes `bytes`.
fn lines(bytes: Range<u64>) -> Range<u64> {
    bytes.start / LINE..bytes.end.div_ceil(LINE)
}

/// Where things lie in memory: one allocation after the other, each on a multiple of 256 bytes, as a device
/// allocator makes them.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    nodes: u64,
    triangles: u64,
    rays: u64,
    hits: u64,
    top: u64,
    subtrees: u64,
    travels: u64,
    queues: [u64; 2],
    counts: u64,
    stacks: u64,
    /// Bytes from one stack entry of a thread to its next: entries of all resident threads lie side by side.
    stride: u64,
    /// Bytes of the words that lanes side by side ask for in one request.
    pub(super) request: u64,
}

impl Layout {
    /// Lays out `workload` for `threads` resident threads on the whole machine.
    pub fn new(workload: &Workload, threads: u64) -> Layout {
        let mut at = 0x8000_0000;
        let mut place = |bytes: u64| {
            let start = at;
            at += bytes.next_multiple_of(256);
            start
        };
        let rays = workload.trace.rays() as u64;
        let (top, subtrees) = workload.cut.map_or((0, 0), |cut| (cut.top().len() as u64, cut.subtrees().len() as u64));
        Layout {
            nodes: place(workload.children.len() as u64 * bytes::<Node>()),
            triangles: place(workload.triangles as u64 * bytes::<Triangle>()),
            rays: place(rays * bytes::<Ray>()),
            hits: place(rays * bytes::<Hit>()),
            top: place(top * bytes::<Node>()),
            subtrees: place(subtrees * bytes::<Subtree>()),
            travels: place(rays * bytes::<Travel>()),
            queues: [place(rays * bytes::<QueueEntry>()), place(rays * bytes::<QueueEntry>())],
            counts: place(0),
            stacks: 0x1000_0000,
            stride: threads * WORD,
            request: LANES as u64 * LOAD,
        }
    }

    /// The same where a request is of `bytes`, not of all lanes.
    pub fn requests_of(self, bytes: u64) -> Layout {
        Layout { request: bytes, ..self }
    }

    pub(in crate::fermi) fn node(&self, index: u32) -> u64 {
        self.nodes + u64::from(index) * bytes::<Node>()
    }

    pub(in crate::fermi) fn triangle(&self, index: u32) -> u64 {
        self.triangles + u64::from(index) * bytes::<Triangle>()
    }

    pub(in crate::fermi) fn ray(&self, index: usize) -> u64 {
        self.rays + index as u64 * bytes::<Ray>()
    }

    pub(in crate::fermi) fn hit(&self, index: usize) -> u64 {
        self.hits + index as u64 * bytes::<Hit>()
    }

    pub(super) fn top(&self, index: u32) -> u64 {
        self.top + u64::from(index) * bytes::<Node>()
    }

    pub(super) fn subtree(&self, index: u32) -> u64 {
        self.subtrees + u64::from(index) * bytes::<Subtree>()
    }

    pub(super) fn travel(&self, ray: usize) -> u64 {
        self.travels + ray as u64 * bytes::<Travel>()
    }

    /// Entry `at` of the queue, or with `parity` 1 of the one that it is sorted into.
    pub(super) fn queue(&self, parity: usize, at: usize) -> u64 {
        self.queues[parity] + at as u64 * bytes::<QueueEntry>()
    }

    pub(super) fn count(&self, index: usize) -> u64 {
        self.counts + index as u64 * WORD
    }

    /// Entry `depth` of the stack of thread number `thread` among those resident.
    pub(in crate::fermi) fn stack(&self, thread: u64, depth: u32) -> u64 {
        self.stacks + thread * WORD + u64::from(depth) * self.stride
    }

    /// Lines of nodes and triangles.
    pub fn tree_lines(&self) -> Range<u64> {
        lines(self.nodes..self.rays)
    }

    /// Lines of rays and hits, which are asked for once.
    pub fn streamed_lines(&self) -> Range<u64> {
        lines(self.rays..self.top)
    }

    /// Lines of everything but stacks.
    pub fn data_lines(&self) -> Range<u64> {
        lines(self.nodes..self.counts)
    }

    /// A place for each line, with stacks of `entries` entries.
    pub fn places(&self, entries: u32) -> Places {
        let (data, stack) = (self.data_lines(), lines(self.stacks..self.stack(0, entries)));
        Places { data: (data.start, data.end - data.start), stack: (stack.start, stack.end - stack.start) }
    }

    /// Virtual cache of a line: that of the subtree whose node or triangle it begins with, 0 for all else.
    pub fn virtual_cache(&self, workload: &Workload, line: u64) -> u32 {
        let (address, Some(cut)) = (line * LINE, workload.cut) else { return 0 };
        let home = if (self.nodes..self.triangles).contains(&address) {
            cut.of_node(((address - self.nodes) / bytes::<Node>()) as usize)
        } else if (self.triangles..self.rays).contains(&address) {
            Home::Subtree(cut.of_triangle(((address - self.triangles) / bytes::<Triangle>()) as usize))
        } else {
            return 0;
        };
        match home {
            Home::Subtree(subtree) => subtree + 1,
            Home::Top(_) => 0,
        }
    }
}
