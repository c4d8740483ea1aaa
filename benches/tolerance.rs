//! Cost and error of fidelity `sampled` beside the full replay of `caches`, with recording, in CPU seconds and in seconds
//! passed (the full replay has one thread, samples have many):
//! `cargo bench --bench tolerance -- TOLERANCE WIDTH HEIGHT SCENE...`. A scene is a file or the name of a procedural one.
#![allow(clippy::unwrap_used, reason = "a benchmark stops at what it cannot do")]

use std::path::Path;
use std::time::Instant;

use caribou::bvh::Bvh;
use caribou::fermi::result::Fidelity;
use caribou::fermi::sampled::Request;
use caribou::render::rays::RayKind;
use caribou::report::experiment::{Model, Traceable, Traversal};
use caribou::report::study::Subject;
use caribou::scene::{self, procedural};
use caribou::trace::Strategy;
use cpu_time::ProcessTime;

/// Triangles of procedural scenes.
const TRIANGLES: usize = 200_000;
const SEED: u64 = 1;

/// What `work` gives, and its seconds: of the processor, and passed.
fn timed<T>(work: impl FnOnce() -> T) -> (T, [f64; 2]) {
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let result = work();
    (result, [cpu.elapsed().as_secs_f64(), wall.elapsed().as_secs_f64()])
}

fn main() {
    // `cargo bench` adds an option of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let [tolerance, width, height, scenes @ ..] = &arguments[..] else {
        println!("usage: cargo bench --bench tolerance -- TOLERANCE WIDTH HEIGHT SCENE...");
        return;
    };
    let tolerance: f64 = tolerance.parse().unwrap();
    let size: (u32, u32) = (width.parse().unwrap(), height.parse().unwrap());
    let model = |fidelity| Model::new("gtx480", "while-while", &[], fidelity).unwrap();
    let (sampled, caches) = (model(Fidelity::Sampled), model(Fidelity::Caches));
    println!(
        "scene rays | warps replayed | CPU s full, sampled, ratio | s passed, the same | interval +- % | error % | held | L1 error %"
    );
    let (mut pairs, mut near, mut held) = (0, 0, 0);
    for name in scenes {
        let path = Path::new(name);
        let scene = if path.exists() { scene::load(path) } else { procedural::build(name, TRIANGLES, SEED) }.unwrap();
        let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
        let subject = Subject::new(name, scene, bvh).unwrap();
        let children: Vec<[u32; 2]> = subject.bvh.nodes.iter().map(|node| node.child).collect();
        for kind in RayKind::ALL {
            let rays = subject.rays(size, kind).unwrap();
            let ((recording, _), recorded_in) = timed(|| subject.record(&rays, kind));
            let (truth, full) = timed(|| caches.whole(&recording.recorded(), Strategy::Direct).unwrap());
            let full = [0, 1].map(|of| full[of] + recorded_in[of]);
            let rays =
                Traceable { traversal: Traversal::Scene(&subject.bvh, kind.query()), children: &children, rays: &rays };
            let request = Request { tolerance, time_limit: None, seed: SEED };
            let (estimate, cost) = timed(|| sampled.sampled(&rays, &request).unwrap());
            let effort = estimate.tolerance.as_ref().unwrap();
            let error = estimate.cycles as f64 / truth.cycles as f64 - 1.0;
            let holds = (effort.interval[0]..=effort.interval[1]).contains(&(truth.cycles as f64));
            println!(
                "{} {} | {} of {} | {:.2} {:.2} {:.3} | {:.2} {:.2} {:.3} | {:.2} | {:+.2} | {holds} | {:+.2}",
                subject.name,
                kind.name(),
                effort.sampled_warps,
                effort.warps,
                full[0],
                cost[0],
                cost[0] / full[0],
                full[1],
                cost[1],
                cost[1] / full[1],
                100.0 * effort.reached,
                100.0 * error,
                100.0 * (estimate.l1.miss_rate / truth.l1.miss_rate - 1.0),
            );
            pairs += 1;
            near += usize::from(error.abs() <= tolerance);
            held += usize::from(holds);
        }
    }
    println!("{near} of {pairs} within the tolerance, {held} intervals hold the full replay");
}
