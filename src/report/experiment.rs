//! Rays recorded in a tree, and what a described machine would do with them under each strategy.

use std::time::Instant;

use serde::{Serialize, Serializer};

use glam::Vec3;

use crate::bvh::partition::Hierarchy;
use crate::bvh::{Bvh, Owners, Partition, Policy};
use crate::fermi;
use crate::fermi::cut::Cut;
use crate::fermi::kernel::{Kernel, Loops};
use crate::fermi::launch::{Launch, Stage, Work, Workload};
use crate::fermi::machine::Machine;
use crate::fermi::needs;
use crate::fermi::plan::{FreeVisits, Grouping, Kernels, Migration};
use crate::fermi::result::{Accounting, Fidelity, Prediction};
use crate::fermi::sampled::{self, Request, Skipped};
use crate::layout::{Node, Ray, Triangle};
use crate::trace::exchange::{Tree, record_reference};
use crate::trace::speculative::record_speculative;
use crate::trace::steps::steps_of;
use crate::trace::{Query, StepTrace, Strategy};
use crate::{Error, Result};

/// What the rays did, and the tree they did it in.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'a> {
    /// Steps of each ray.
    pub trace: &'a StepTrace,
    /// Child links of each node.
    pub children: &'a [[u32; 2]],
    /// Number of triangles.
    pub triangles: usize,
}

/// The same, with what it borrows.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Steps of each ray.
    pub trace: StepTrace,
    /// Child links of each node.
    pub children: Vec<[u32; 2]>,
    /// Number of triangles.
    pub triangles: usize,
    /// The tree's nodes, if it is to be cut; else none.
    pub nodes: Vec<Node>,
    /// Low and high corner of the scene.
    pub bounds: (Vec3, Vec3),
}

impl Recording {
    /// Borrowed.
    pub fn recorded(&self) -> Recorded<'_> {
        Recorded { trace: &self.trace, children: &self.children, triangles: self.triangles }
    }

    /// The tree as it can be cut.
    ///
    /// # Errors
    /// [`Error::Usage`] if it was not recorded with its nodes.
    pub fn hierarchy(&self) -> Result<Hierarchy<'_>> {
        match self.nodes.is_empty() {
            true => Err(Error::usage("strategy migrate", "record the rays together with the tree's nodes")),
            false => Ok(Hierarchy { nodes: &self.nodes, bounds: self.bounds }),
        }
    }

    /// Bytes of the nodes and triangles.
    pub fn bytes(&self) -> usize {
        self.children.len() * size_of::<Node>() + self.triangles * size_of::<Triangle>()
    }
}

/// A tree, and how rays go through it.
#[derive(Clone, Copy, Debug)]
pub enum Traversal<'a> {
    /// A scene's, as the kernels of this project go.
    Scene(&'a Bvh, Query),
    /// One from a file, as the reference kernel goes.
    Exchanged(&'a Tree),
}

/// Rays not traced yet, and the tree to trace them in.
#[derive(Clone, Copy, Debug)]
pub struct Traceable<'a> {
    /// The tree, and what is asked of it.
    pub traversal: Traversal<'a>,
    /// Child links of each node.
    pub children: &'a [[u32; 2]],
    /// The rays.
    pub rays: &'a [Ray],
}

impl Traceable<'_> {
    /// Steps of all rays in a kernel with these loops.
    pub fn record(&self, loops: Loops) -> StepTrace {
        match self.traversal {
            Traversal::Scene(bvh, query) if loops == Loops::SpeculativeWhileWhile => {
                record_speculative(bvh, self.rays, query).1
            }
            Traversal::Scene(bvh, query) => steps_of(bvh, self.rays, query),
            Traversal::Exchanged(tree) => record_reference(tree, self.rays).1,
        }
    }

    /// The rays that `trace` has.
    pub fn workload<'a>(&'a self, trace: &'a StepTrace) -> Workload<'a> {
        let triangles = match self.traversal {
            Traversal::Scene(bvh, _) => bvh.references(),
            Traversal::Exchanged(tree) => tree.triangles.len(),
        };
        Workload { trace, children: self.children, triangles, cut: None }
    }
}

/// A machine and the kernels that it runs.
#[derive(Clone, Debug, Serialize)]
pub struct Model {
    /// The machine, by its name in reports.
    #[serde(serialize_with = "machine_name")]
    pub machine: Machine,
    /// Kernel of strategies `direct` and `persistent`, and of the paper's traversal stage.
    #[serde(serialize_with = "kernel_name")]
    pub kernel: Kernel,
    /// Kernels of strategy `migrate`.
    #[serde(skip)]
    pub migrate: Kernels,
    /// How exactly time is modelled.
    pub fidelity: Fidelity,
}

fn machine_name<S: Serializer>(machine: &Machine, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(&machine.name)
}

fn kernel_name<S: Serializer>(kernel: &Kernel, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_str(&kernel.name)
}

fn policy_text<S: Serializer>(policy: &Policy, serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_str(policy)
}

/// How rays migrate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Migrate {
    /// Where the tree is cut.
    #[serde(serialize_with = "policy_text")]
    pub partition: Policy,
    /// Which multiprocessor gets which subtree.
    pub owners: Owners,
    /// What is charged.
    pub accounting: Accounting,
    /// Which rays run together in the paper's accounting.
    pub grouping: Grouping,
}

/// Settings of a kernel begin with one of these, those of the machine with none.
const PREFIXES: [&str; 4] = ["kernel.", "schedule.", "subtree.", "queue."];

impl Model {
    /// Machine `machine` with kernel `kernel`, changed by `settings` of the form `key=value`: the machine's as
    /// they are, the kernels' behind `kernel.`, `schedule.`, `subtree.` or `queue.`.
    ///
    /// # Errors
    /// Of unknown names and impossible values.
    pub fn new(machine: &str, kernel: &str, settings: &[String], fidelity: Fidelity) -> Result<Model> {
        let of = |prefix: &str| -> Vec<String> {
            settings.iter().filter_map(|setting| setting.strip_prefix(prefix).map(str::to_owned)).collect()
        };
        let of_machine = |setting: &&String| !PREFIXES.iter().any(|prefix| setting.starts_with(prefix));
        let of_machine: Vec<String> = settings.iter().filter(of_machine).cloned().collect();
        let of_rays = Kernel::named(kernel, &of("kernel."))?;
        if !matches!(of_rays.loops, Loops::WhileWhile | Loops::SpeculativeWhileWhile) {
            return Err(Error::usage(
                format!("--kernel {kernel}"),
                "it is a part of strategy migrate, which has all it needs: name while-while or speculative-while-while",
            ));
        }
        Ok(Model {
            machine: Machine::named(machine, &of_machine)?,
            kernel: of_rays,
            migrate: Kernels {
                schedule: Kernel::named("migrate-schedule", &of("schedule."))?,
                subtree: Kernel::named("migrate-subtree", &of("subtree."))?,
                queue: Kernel::named("migrate-queue", &of("queue."))?,
            },
            fidelity,
        })
    }

    /// Loops that rays are recorded in. Queues mix the rays of warps, so that a migrating ray never goes on because
    /// another's leaf waits.
    pub fn loops(&self, migrates: bool) -> Loops {
        if migrates { Loops::WhileWhile } else { self.kernel.loops }
    }

    /// Any strategy.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if a kernel does not fit the machine, or for `migrate` in a tree recorded without nodes.
    pub fn predict(&self, recording: &Recording, strategy: Strategy, migrate: &Migrate) -> Result<Prediction> {
        match strategy {
            Strategy::Migrate => self.migrated(&recording.recorded(), recording.hierarchy()?, migrate),
            _ => self.whole(&recording.recorded(), strategy),
        }
    }

    /// Strategies without subtrees.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if the kernel does not fit the machine.
    pub fn whole(&self, recorded: &Recorded, strategy: Strategy) -> Result<Prediction> {
        let work = if strategy == Strategy::Persistent { Work::Persistent } else { Work::Rays };
        let launch = self.launch(recorded.workload(None), work, false);
        fermi::predict(&self.machine, &[launch], self.fidelity, Accounting::Full)
    }

    /// Strategy `migrate` in `tree`, cut for this machine.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if a kernel does not fit the machine.
    pub fn migrated(&self, recorded: &Recorded, tree: Hierarchy, migrate: &Migrate) -> Result<Prediction> {
        let partition = Partition::of(tree, migrate.partition, migrate.owners, self.machine.sms)?;
        let cut = Cut::new(&partition, recorded.children, recorded.triangles);
        let workload = recorded.workload(Some(&cut));
        let predict = |launches: &[Launch]| fermi::predict(&self.machine, launches, self.fidelity, migrate.accounting);
        match (migrate.accounting, migrate.grouping) {
            (Accounting::Full, _) => {
                let migration = Migration::of(&workload, &cut, true);
                predict(&migration.launches(workload, &self.migrate))
            }
            (Accounting::Paper, Grouping::Launched) => predict(&[self.launch(workload, Work::Rays, true)]),
            (Accounting::Paper, grouping) => {
                let visits = FreeVisits::of(&workload, &cut, grouping, self.kernel.threads);
                predict(&[visits.launch(workload, &self.kernel)])
            }
        }
    }

    /// Strategy `direct` with no more than the tolerance needs: without the caches that hold all that the rays can touch,
    /// else from the replay of a sample of them.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if the kernel does not fit the machine.
    pub fn sampled(&self, rays: &Traceable, request: &Request) -> Result<Prediction> {
        let start = Instant::now();
        let trace = rays.record(self.loops(false));
        let seconds = start.elapsed().as_secs_f64();
        let launch = self.launch(rays.workload(&trace), Work::Rays, false);
        match needs::predict(&self.machine, &launch, seconds, request)? {
            Some(prediction) => Ok(prediction),
            None => sampled::predict(&self.machine, &launch, seconds, request),
        }
    }

    /// A pass over `rays` that a picture does not have.
    ///
    /// # Errors
    /// As of [`Model::sampled`].
    pub fn left_out(&self, rays: &Traceable, request: &Request, why: Skipped) -> Result<Prediction> {
        let trace = StepTrace { starts: vec![0], steps: Vec::new() };
        let launch = self.launch(rays.workload(&trace), Work::Rays, false);
        needs::left_out(&self.machine, &launch, rays.rays.len(), request, why)
    }

    fn launch<'a>(&'a self, workload: Workload<'a>, work: Work<'a>, virtual_caches: bool) -> Launch<'a> {
        Launch { kernel: &self.kernel, workload, work, virtual_caches, stage: Stage::Traverse }
    }
}

impl<'a> Recorded<'a> {
    fn workload(&self, cut: Option<&'a Cut<'a>>) -> Workload<'a> {
        Workload { trace: self.trace, children: self.children, triangles: self.triangles, cut }
    }
}
