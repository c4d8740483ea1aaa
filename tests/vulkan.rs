//! What `caribou::vulkan` promises, on whatever driver `VK_DRIVER_FILES` gives.
//!
//! Without a driver the tests skip aloud; with `CARIBOU_REQUIRE_VULKAN=1` they fail instead.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;

use caribou::Error;
use caribou::vulkan::{Buffer, Gpu, GpuOptions, Kernel, Place, list_devices};

/// Input and output of [`Kernel::ProbeLoop`].
fn loop_buffers(gpu: &Gpu, steps: u32, groups: u32) -> (Buffer, Buffer) {
    let input = gpu.upload("steps", &[steps]).unwrap();
    let output = gpu.buffer("states", u64::from(groups) * 32 * 4, Place::Device).unwrap();
    (input, output)
}

/// The state of `probe_loop.comp` after so many steps from 0.
fn stepped(steps: u32) -> u32 {
    (0..steps).fold(0, |state: u32, _| state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223))
}

fn device_error(result: caribou::Result<()>) -> String {
    match result {
        Err(error @ Error::Device { .. }) => error.to_string(),
        other => panic!("a device error was due, not {other:?}"),
    }
}

fn check_error(result: caribou::Result<()>) -> String {
    match result {
        Err(error @ Error::Check(_)) => error.to_string(),
        other => panic!("a failed check was due, not {other:?}"),
    }
}

#[test]
fn what_is_uploaded_comes_back() {
    let Some(gpu) = common::gpu() else { return };
    // 0, 1, and more than the 64 MiB of a staging buffer, not a multiple of anything.
    for count in [0usize, 1, 17_000_003] {
        let data: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
        let buffer = gpu.upload("data", &data).unwrap();
        assert!(buffer.bytes() >= 4 * count as u64 && buffer.bytes() >= 4);
        assert_eq!(gpu.download::<u32>(&buffer, 0..count).unwrap(), data);
        if count > 100 {
            assert_eq!(gpu.download::<u32>(&buffer, 77..99).unwrap(), data[77..99]);
        }
    }
}

#[test]
fn a_range_outside_the_buffer_is_refused() {
    let Some(gpu) = common::gpu() else { return };
    let buffer = gpu.upload("sixteen", &[0u8; 16]).unwrap();
    check_error(gpu.download::<u32>(&buffer, 3..5).map(drop));
    check_error(gpu.download::<u32>(&buffer, usize::MAX - 1..usize::MAX).map(drop));
    // Refused before memory is taken for the answer.
    check_error(gpu.download::<u8>(&buffer, 0..isize::MAX as usize).map(drop));
    check_error(gpu.write(&buffer, 1, &[0u64; 2]));
    check_error(gpu.write(&buffer, usize::MAX, &[0u64; 2]));
    let other = gpu.upload("other", &[0u8; 16]).unwrap();
    let mut recorder = gpu.recorder("ranges").unwrap();
    check_error(recorder.copy(&buffer, 8, &other, 0, 9));
    check_error(recorder.copy(&buffer, 0, &other, u64::MAX, 1));
    check_error(recorder.copy(&buffer, 0, &buffer, 8, 4));
}

#[test]
fn kernels_run_in_order_and_are_timed() {
    let Some(gpu) = common::gpu() else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 1);
    let copy = gpu.buffer("copy", 32 * 4, Place::Readback).unwrap();
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = gpu.recorder("order").unwrap();
    recorder.timestamp("first").unwrap();
    recorder.fill(&states, 7).unwrap();
    recorder.barrier();
    recorder.copy(&states, 0, &copy, 0, 64).unwrap();
    recorder.timestamp("second").unwrap();
    recorder.barrier();
    recorder.dispatch(&kernel, &[&steps, &states], &[], 1).unwrap();
    recorder.barrier();
    recorder.copy(&states, 64, &copy, 64, 64).unwrap();
    let timings = recorder.submit().unwrap();
    let expected = [[7; 16], [stepped(3); 16]].concat();
    assert_eq!(gpu.download::<u32>(&copy, 0..32).unwrap(), expected);
    if gpu.info().limits.timestamp_period > 0.0 {
        let labels: Vec<_> = timings.spans.iter().map(|span| span.label.as_str()).collect();
        assert_eq!(labels, ["first", "second"]);
        assert!(timings.spans.iter().all(|span| span.seconds >= 0.0 && span.seconds <= timings.wall), "{timings:?}");
        assert_eq!(timings.seconds("second"), timings.spans[1].seconds);
    }
}

#[test]
fn an_indirect_dispatch_reads_its_count_from_the_device() {
    let Some(gpu) = common::gpu() else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 4);
    let counts = gpu.upload("counts", &[9u32, 2, 1, 1]).unwrap();
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = gpu.recorder("indirect").unwrap();
    recorder.fill(&states, 0).unwrap();
    recorder.barrier();
    recorder.dispatch_indirect(&kernel, &[&steps, &states], &[], &counts, 4).unwrap();
    check_error(recorder.dispatch_indirect(&kernel, &[&steps, &states], &[], &counts, 2));
    check_error(recorder.dispatch_indirect(&kernel, &[&steps, &states], &[], &counts, 8));
    recorder.submit().unwrap();
    let expected = [[stepped(3); 64], [0; 64]].concat();
    assert_eq!(gpu.download::<u32>(&states, 0..128).unwrap(), expected);
}

/// More dispatches and timestamps than one pool of either holds.
#[test]
fn a_recorder_holds_hundreds_of_dispatches() {
    let Some(gpu) = common::gpu() else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 1);
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = gpu.recorder("many").unwrap();
    for i in 0..300 {
        recorder.timestamp(&i.to_string()).unwrap();
        recorder.dispatch(&kernel, &[&steps, &states], &[], 1).unwrap();
        recorder.barrier();
    }
    drop((steps, kernel)); // the recorder holds them
    let timings = recorder.submit().unwrap();
    assert_eq!(gpu.download::<u32>(&states, 0..1).unwrap(), [stepped(3)]);
    if gpu.info().limits.timestamp_period > 0.0 {
        let labels: Vec<_> = timings.spans.iter().map(|span| span.label.clone()).collect();
        assert_eq!(labels, Vec::from_iter((0..300).map(|i| i.to_string())));
    }
}

#[test]
fn a_dispatch_is_compared_with_the_kernel_and_the_limits() {
    let Some(gpu) = common::gpu() else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 1);
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = gpu.recorder("misuse").unwrap();
    let message = check_error(recorder.dispatch(&kernel, &[&steps], &[], 1));
    assert!(message.contains("probe_loop takes 2 buffers, not 1"), "{message}");
    let message = check_error(recorder.dispatch(&kernel, &[&steps, &states], &[0; 4], 1));
    assert!(message.contains("0 bytes of push constants, not 4"), "{message}");

    let limits = gpu.info().limits;
    if let Some(groups) = limits.groups.checked_add(1) {
        let message = device_error(recorder.dispatch(&kernel, &[&steps, &states], &[], groups));
        assert!(message.contains("misuse") && message.contains(&limits.groups.to_string()), "{message}");
    }
    // Where the limit is too large to allocate beyond, there is nothing to test.
    if limits.storage_buffer_range < 1 << 30 {
        let large = gpu.buffer("too large to bind", limits.storage_buffer_range + 4, Place::Device).unwrap();
        let message = device_error(recorder.dispatch(&kernel, &[&steps, &large], &[], 1));
        assert!(message.contains("too large to bind"), "{message}");
        assert!(message.contains(&limits.storage_buffer_range.to_string()), "{message}");
    }
}

#[test]
fn a_buffer_beyond_the_memory_is_refused() {
    let Some(gpu) = common::gpu() else { return };
    let memory = gpu.info().heaps.iter().map(|heap| heap.bytes).max().unwrap();
    for bytes in [memory + 1, gpu.info().limits.allocation.saturating_add(1), u64::MAX] {
        let message = device_error(gpu.buffer("everything", bytes, Place::Device).map(drop));
        assert!(message.starts_with("allocate everything"), "{message}");
    }
    assert_eq!(gpu.buffer("nothing", 0, Place::Device).unwrap().bytes(), 16);
}

#[test]
fn buffers_of_another_device_are_refused() {
    let (Some(gpu), Some(other)) = (common::gpu(), common::gpu()) else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 1);
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = other.recorder("mixed").unwrap();
    check_error(recorder.fill(&states, 0));
    check_error(recorder.dispatch(&kernel, &[&steps, &states], &[], 1));
}

#[test]
fn devices_are_found_by_index_and_by_part_of_the_name() {
    let Some(default) = common::gpu() else { return };
    let devices = list_devices().unwrap();
    let usable = devices.iter().filter(|device| device.unusable.is_none());
    assert_eq!(default.info().kind, usable.map(|device| device.kind).min().unwrap());
    let info = default.info();
    for wanted in [info.index.to_string(), info.name.to_uppercase(), info.name[1..].to_owned()] {
        let options = GpuOptions { device: Some(wanted.clone()), ..GpuOptions::default() };
        assert_eq!(Gpu::open(&options).unwrap().info().name, info.name, "{wanted}");
    }
    for wanted in ["999", "no such device"] {
        let options = GpuOptions { device: Some(wanted.to_owned()), ..GpuOptions::default() };
        match Gpu::open(&options).map(drop) {
            Err(error @ Error::Usage { .. }) => {
                let text = error.to_string();
                assert!(devices.iter().all(|device| text.contains(&device.name)) && text.contains(wanted), "{text}");
            }
            other => panic!("{wanted}: {other:?}"),
        }
    }
}

#[test]
fn addresses_lie_within_no_other_buffer() {
    let Some(gpu) = common::gpu() else { return };
    let buffers: Vec<_> = (0..20).map(|i| gpu.buffer("part", 1000 * i, Place::Device).unwrap()).collect();
    let mut spans: Vec<_> = buffers.iter().map(|b| (b.address(), b.bytes())).collect();
    spans.sort_unstable();
    assert!(spans[0].0 > 0 && spans.windows(2).all(|pair| pair[0].0 + pair[0].1 <= pair[1].0), "{spans:?}");
}

/// Every kind of command in one submission, and buffers dropped before it.
#[test]
fn the_validation_layer_has_nothing_to_say() {
    let Some(gpu) = common::gpu() else { return };
    let (steps, states) = loop_buffers(&gpu, 3, 2);
    let counts = gpu.upload("counts", &[2u32, 1, 1]).unwrap();
    let back = gpu.buffer("back", 256, Place::Readback).unwrap();
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let mut recorder = gpu.recorder("validated").unwrap();
    for label in ["one", "two"] {
        recorder.timestamp(label).unwrap();
        recorder.fill(&states, 0).unwrap();
        recorder.barrier();
        recorder.dispatch(&kernel, &[&steps, &states], &[], 2).unwrap();
        recorder.barrier();
        recorder.dispatch_indirect(&kernel, &[&steps, &states], &[], &counts, 0).unwrap();
        recorder.barrier();
        recorder.copy(&states, 0, &back, 0, 256).unwrap();
        recorder.barrier();
    }
    drop((steps, counts)); // the recorder holds them
    recorder.submit().unwrap();
    assert_eq!(gpu.download::<u32>(&back, 0..64).unwrap(), [stepped(3); 64]);
    drop(gpu.recorder("never submitted").unwrap());
}

/// The drivers whose behaviour is known; on others this prints what was found.
#[test]
fn the_probe_finds_what_is_known_of_the_driver() {
    let Some(gpu) = common::gpu() else { return };
    let (info, probe) = (gpu.info(), gpu.probe());
    println!("{} ({}): {probe:?}", info.name, info.driver_version);
    assert!(probe.exact_add_multiply, "the Vulkan specification asks for it");
    assert_eq!(probe.exact_division, probe.division_ulp == 0);
    if info.driver_version.starts_with("Mesa 22.") && info.driver == "llvmpipe" {
        assert_eq!(probe.loop_limit, Some(65_535));
    }
    if info.driver_version.starts_with("Mesa 25.") && info.driver == "llvmpipe" {
        assert_eq!(probe.loop_limit, None);
    }
}

#[test]
fn the_driver_counts_the_invocations_that_were_asked_for() {
    let Some(gpu) = common::gpu() else { return };
    if !gpu.info().driver_counters.pipeline_statistics {
        eprintln!("SKIPPED: this driver has no pipeline statistics");
        return;
    }
    let kernel = gpu.pipeline(Kernel::ProbeLoop, &[]).unwrap();
    let (input, output) = loop_buffers(&gpu, 10, 7);
    let counted = |counting: bool| {
        let mut recorder = gpu.recorder("counted").unwrap();
        if counting {
            recorder.count_invocations().unwrap();
        }
        for groups in [3, 4] {
            recorder.dispatch(&kernel, &[&input, &output], &[], groups).unwrap();
            recorder.barrier();
        }
        recorder.submit().unwrap().invocations
    };
    assert_eq!(counted(true), Some(7 * u64::from(kernel.kernel().interface().local_size)));
    assert_eq!(counted(false), None);
}
