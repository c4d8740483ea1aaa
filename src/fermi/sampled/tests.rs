//! Intervals judged by the full replay.

use std::fmt::Write;

use super::*;
use crate::bvh::Bvh;
use crate::fermi::kernel::Kernel;
use crate::fermi::launch::{Stage, Work, Workload};
use crate::layout::Ray;
use crate::render::rays::{RayKind, twin_rays};
use crate::render::settings::Settings;
use crate::report::experiment::{Traceable, Traversal};
use crate::scene::tables::Tables;
use crate::scene::{self, Scene, builtin, procedural};

/// Rays of a scene.
struct Case {
    name: String,
    kind: RayKind,
    bvh: Bvh,
    children: Vec<[u32; 2]>,
    rays: Vec<Ray>,
}

impl Case {
    fn new(name: &str, scene: &Scene, kind: RayKind, (width, height): (u32, u32)) -> Case {
        let bvh = Bvh::build(&scene.positions, Default::default()).unwrap();
        let camera = scene::select_camera(scene, None).unwrap();
        let settings = Settings {
            width,
            height,
            max_depth: 0,
            ao_radius: Settings::default_ao_radius(bvh.bounds),
            ..Settings::default()
        };
        let rays = twin_rays(&bvh, &Tables::new(scene), &settings.frame(&camera), kind);
        let children = bvh.nodes.iter().map(|node| node.child).collect();
        Case { name: name.to_owned(), kind, bvh, children, rays }
    }

    fn source(&self) -> Traceable<'_> {
        Traceable {
            traversal: Traversal::Scene(&self.bvh, self.kind.query()),
            children: &self.children,
            rays: &self.rays,
        }
    }
}

fn scenes() -> Vec<(String, Scene)> {
    let builtin = |name: &str| (name.to_owned(), scene::load_slice(name, builtin::builtin(name).unwrap()).unwrap());
    let procedural = |name: &str| (name.to_owned(), procedural::build(name, 20_000, 1).unwrap());
    let mut all: Vec<_> = ["cornell", "courtyard", "gallery"].map(builtin).into();
    all.extend(["room", "forest", "blob"].map(procedural));
    all
}

/// A GTX 480 with a smaller L2, so that it does not hold small scenes.
fn machine() -> Machine {
    Machine::named("gtx480", &["l2.slice_kib=32".to_owned()]).unwrap()
}

fn request(tolerance: f64, seed: u64) -> Request {
    Request { tolerance, time_limit: None, seed }
}

fn launch<'a>(kernel: &'a Kernel, workload: Workload<'a>) -> Launch<'a> {
    Launch { kernel, workload, work: Work::Rays, virtual_caches: false, stage: Stage::Traverse }
}

fn truth(machine: &Machine, kernel: &Kernel, case: &Case) -> Prediction {
    let (source, trace) = (case.source(), case.source().record(kernel.loops));
    full(machine, &launch(kernel, source.workload(&trace)), &request(1.0, 1), Spent::default()).unwrap()
}

fn sampled(machine: &Machine, kernel: &Kernel, case: &Case, request: &Request) -> Prediction {
    let (source, trace) = (case.source(), case.source().record(kernel.loops));
    predict(machine, &launch(kernel, source.workload(&trace)), 0.0, request).unwrap()
}

#[test]
fn intervals_hold_the_full_replay() {
    const SEEDS: u64 = 17;
    let (machine, kernel) = (machine(), Kernel::named("while-while", &[]).unwrap());
    let (mut held, mut naively, mut all, mut text) = ([0; 3], 0, 0, String::new());
    for (name, scene) in &scenes() {
        for kind in [RayKind::Primary, RayKind::Diffuse] {
            let case = Case::new(name, scene, kind, (448, 336));
            let truth = truth(&machine, &kernel, &case);
            let truth = [truth.cycles as f64, truth.l1.miss_rate, truth.l2.miss_rate];
            let (mut bias, mut half) = ([0.0; 3], [0.0; 3]);
            let (source, trace) = (case.source(), case.source().record(kernel.loops));
            let launch = launch(&kernel, source.workload(&trace));
            let work = work::of(&machine, &launch);
            let slots = launch.slots(launchable(&machine, &launch).unwrap().blocks);
            for seed in 0..SEEDS {
                let design = Design::new(work.clone(), (machine.sms as usize, slots), seed);
                let mut sample = Sample::default();
                sample.extend(&machine, &launch, &design, design.first_sms()).unwrap();
                sample.look(&machine, &launch, &design, GLIMPSES).unwrap();
                let e = Estimates::new(&design, &sample).unwrap();
                for (k, (e, truth)) in [e.cycles, e.l1, e.l2].iter().zip(truth).enumerate() {
                    held[k] += usize::from(e.holds(truth));
                    bias[k] += (e.value / truth - 1.0) / SEEDS as f64;
                    half[k] += e.relative_error() / SEEDS as f64;
                }
                // Blocks as if they were independent, and nothing else uncertain.
                let naive = Estimates::with_clusters(&design, &sample, 1).unwrap();
                naively += usize::from((naive.cycles.value / truth[0] - 1.0).abs() <= naive.parts.blocks);
                all += 1;
            }
            let _ = writeln!(text, "{} {}: bias {bias:.3?}, half interval {half:.3?}", case.name, kind.name());
        }
    }
    println!("{text}held {held:?} of {all}, {naively} if blocks were independent");
    assert!(all >= 200);
    for held in held {
        let share = held as f64 / f64::from(all);
        assert!((0.9..=0.99).contains(&share), "cycles, L1, L2 held {held} of {all}\n{text}");
    }
    assert!(
        (naively as f64) < 0.85 * f64::from(all),
        "blocks at work together are not independent: {naively} of {all}"
    );
}

#[test]
fn a_tolerance_out_of_reach_of_samples_ends_in_the_full_replay() {
    let (machine, kernel) = (machine(), Kernel::named("while-while", &[]).unwrap());
    let (name, scene) = &scenes()[0];
    let case = Case::new(name, scene, RayKind::Primary, (128, 96));
    let exact = truth(&machine, &kernel, &case);
    let tight = sampled(&machine, &kernel, &case, &request(1e-6, 1));
    assert_eq!((tight.cycles, tight.l1, tight.l2), (exact.cycles, exact.l1, exact.l2));
    let effort = tight.tolerance.unwrap();
    assert!(effort.met && effort.reached == 0.0 && effort.sampled_warps == effort.warps);
    assert_eq!(tight.interval, Some([exact.cycles as f64; 2]));
}

#[test]
fn a_launch_that_glimpses_would_see_most_of_is_replayed_whole() {
    let (machine, kernel) = (machine(), Kernel::named("while-while", &[]).unwrap());
    let (name, scene) = &scenes()[0];
    let case = Case::new(name, scene, RayKind::Primary, (256, 192));
    let (source, trace) = (case.source(), case.source().record(kernel.loops));
    let launch = launch(&kernel, source.workload(&trace));
    let slots = launch.slots(launchable(&machine, &launch).unwrap().blocks);
    let design = Design::new(work::of(&machine, &launch), (machine.sms as usize, slots), 1);
    let mut sample = Sample::default();
    sample.extend(&machine, &launch, &design, 1).unwrap();
    assert!(design.most_sms() > 0 && !sample.worth_looking(&machine, GLIMPSES));
    let loose = sampled(&machine, &kernel, &case, &request(1.0, 1));
    assert_eq!(loose.cycles, truth(&machine, &kernel, &case).cycles);
}

#[test]
fn a_loose_tolerance_replays_less_and_a_time_limit_stops_the_climb() {
    let (machine, kernel) = (machine(), Kernel::named("while-while", &[]).unwrap());
    let (name, scene) = &scenes()[0];
    let case = Case::new(name, scene, RayKind::Diffuse, (640, 480));
    let loose = sampled(&machine, &kernel, &case, &request(1.0, 1));
    let effort = loose.tolerance.unwrap();
    assert!(effort.met && effort.sampled_warps < effort.warps && effort.saving_estimated > 1.0, "{effort:?}");
    let hurried = Request { time_limit: Some(1e-9), ..request(1e-3, 1) };
    let effort = sampled(&machine, &kernel, &case, &hurried).tolerance.unwrap();
    assert!(!effort.met && effort.reached > 1e-3, "{effort:?}");
}
