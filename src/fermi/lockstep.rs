//! The L1 without time: warps take turns in a fixed order, so that a kernel can count the same accesses, hits and
//! misses (`glsl/virtual_l1.comp`) and stand witness for `simt` and `cache`.

use super::cache::{Cache, Lookup};
use super::kernel::Kernel;
use super::launch::{Launch, Stage, Work, Workload};
use super::machine::{LINE, Mapping};
use super::simt::{Access, Batch, LANES, Layout, Warp};
use crate::Result;
use crate::layout::AccessCounts;
use crate::shared::{ACCESS_KINDS, ACCESS_LOAD, ACCESS_POP, ACCESS_PUSH, ACCESS_STORE};
use crate::trace::virtual_l1::{CountsBySm, FirstLines, VirtualSms};

/// Counts the accesses of `workload`, run while-while, to the L1 of each SM of `machine`.
///
/// An SM goes through its warps in turn, one batch with memory instructions each. Loads, and pops from the stack,
/// allocate; pushes write a line that is there; stores to global memory pass it by, and evict nothing, because the
/// kernel loads nothing that it stores.
///
/// # Errors
/// None that can happen: the kernel is embedded.
pub fn count(machine: &VirtualSms, workload: &Workload) -> Result<CountsBySm> {
    let kernel = Kernel::named("while-while", &[])?;
    let (work, stage) = (Work::Persistent, Stage::Traverse);
    let launch = Launch { kernel: &kernel, workload: *workload, work, virtual_caches: false, stage };
    Ok((0..machine.sms).map(|sm| Sm::new(machine, &launch, sm).run()).collect())
}

/// Where [`Layout`] puts things.
pub fn first_lines(workload: &Workload) -> FirstLines {
    let layout = Layout::new(workload, 0);
    let line = |address: u64| (address / LINE) as u32;
    FirstLines {
        nodes: line(layout.node(0)),
        triangles: line(layout.triangle(0)),
        rays: line(layout.ray(0)),
        hits: line(layout.hit(0)),
        stacks: line(layout.stack(0, 0)),
    }
}

/// An SM and the warps that it holds.
struct Sm<'a> {
    machine: &'a VirtualSms,
    launch: &'a Launch<'a>,
    layout: Layout,
    cache: Cache,
    slots: Vec<Slot<'a>>,
    now: u64,
    counts: [AccessCounts; ACCESS_KINDS as usize],
}

/// A warp, its number in the launch, and that of the slot among all of the machine's.
struct Slot<'a> {
    run: Warp<'a>,
    warp: usize,
    place: usize,
}

impl<'a> Sm<'a> {
    fn new(machine: &'a VirtualSms, launch: &'a Launch<'a>, sm: u32) -> Sm<'a> {
        let mapping = if machine.hashed { Mapping::Hashed } else { Mapping::Linear };
        let threads = u64::from(machine.sms * machine.warps) * LANES as u64;
        let mut this = Sm {
            machine,
            launch,
            layout: Layout::new(&launch.workload, threads),
            cache: Cache::new(machine.sets.into(), machine.ways.into(), mapping),
            slots: Vec::new(),
            now: 0,
            counts: Default::default(),
        };
        let places = (0..machine.warps).map(|slot| (sm + slot * machine.sms) as usize);
        this.slots = places.map(|place| Slot { run: this.warp(place, place), warp: place, place }).collect();
        this
    }

    fn warp(&self, warp: usize, place: usize) -> Warp<'a> {
        Warp::new(self.launch, self.layout, warp, 0, (place * LANES) as u64)
    }

    fn run(mut self) -> [AccessCounts; ACCESS_KINDS as usize] {
        let warps = self.launch.workload.trace.rays().div_ceil(LANES);
        let mut batch = Batch::default();
        while self.slots.iter().any(|slot| slot.warp < warps) {
            for at in 0..self.slots.len() {
                self.turn(at, warps, &mut batch);
            }
        }
        self.counts
    }

    /// The next batch of a slot that has memory instructions, if the slot has any warp left.
    fn turn(&mut self, at: usize, warps: usize, batch: &mut Batch) {
        while self.slots[at].warp < warps {
            self.slots[at].run.advance(batch);
            if batch.segments.is_empty() {
                let Slot { warp, place, .. } = self.slots[at];
                let warp = warp + (self.machine.sms * self.machine.warps) as usize;
                self.slots[at] = Slot { run: self.warp(warp, place), warp, place };
            } else if !batch.memory.is_empty() {
                return self.access(batch);
            }
        }
    }

    fn access(&mut self, batch: &Batch) {
        for segment in &batch.segments {
            for op in &batch.memory[segment.memory.0 as usize..segment.memory.1 as usize] {
                let kind = kind(op.access);
                self.counts[kind].instructions += 1;
                self.counts[kind].lanes += u32::from(segment.lanes);
                for &line in &batch.lines[op.lines.0 as usize..op.lines.1 as usize] {
                    self.look_up(op.access, line);
                }
            }
        }
    }

    fn look_up(&mut self, access: Access, line: u64) {
        self.now += 1;
        let counts = &mut self.counts[kind(access)];
        counts.accesses += 1;
        match self.cache.look(line) {
            Lookup::Hit(way) if access != Access::Store => {
                self.cache.touch(way, self.now);
                if access == Access::Push {
                    self.cache.dirty(way);
                }
                return;
            }
            Lookup::Miss(way) if !access.writes() => {
                counts.write_backs += u32::from(self.cache.reserve(way, line, self.now).is_some());
                self.cache.fill(way);
            }
            _ => {}
        }
        counts.misses += 1;
    }
}

fn kind(access: Access) -> usize {
    let kind = match access {
        Access::Load | Access::Texture => ACCESS_LOAD,
        Access::Store => ACCESS_STORE,
        Access::Pop => ACCESS_POP,
        Access::Push => ACCESS_PUSH,
    };
    kind as usize
}
