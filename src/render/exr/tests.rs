//! Round trips through the `exr` crate and through OpenImageIO, which shares no code with it.

use std::process::Command;

use exr::prelude::read_all_flat_layers_from_file;
use glam::Vec3;

use super::*;

/// 17 x 33 pixels: odd sizes, and more rows than two ZIP blocks of 16.
fn picture() -> Image {
    let (width, height) = (17, 33);
    let ramp = |scale: f32| (0..width * height).map(|i| i as f32 * scale).collect::<Vec<f32>>();
    let mut image = Image::new(width, height).unwrap();
    image.push("R", Samples::Half(ramp(0.25))).unwrap();
    image.push("G", Samples::Half(vec![0.1; width * height])).unwrap();
    image.push("B", Samples::Float(ramp(1e-3))).unwrap();
    image.push("A", Samples::Half(vec![1.0; width * height])).unwrap();
    image.push("N.X", Samples::Float(ramp(-1.0))).unwrap();
    image.push("primId", Samples::Uint((0..(width * height) as u32).map(|i| i ^ u32::MAX).collect())).unwrap();
    image
}

fn metadata() -> Metadata {
    Metadata {
        scene: "Höhle 洞.glb".into(),
        world_to_camera: Mat4::from_translation(Vec3::new(1.0, 2.0, 3.0)),
        world_to_ndc: Mat4::from_cols_array(&std::array::from_fn(|i| i as f32)),
        seed: u64::MAX,
        spp: 4,
        device: "llvmpipe".into(),
        render_seconds: 1.5,
        statistics: BTreeMap::from([
            ("rays.primary".to_owned(), "561".to_owned()),
            ("a name that is longer than the 31 bytes of old readers".to_owned(), "x".to_owned()),
        ]),
    }
}

#[test]
fn samples_come_back_as_they_went() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    assert_eq!(write(&path, picture(), &metadata()).unwrap(), Written { clamped: 0 });

    let file = read_all_flat_layers_from_file(&path).unwrap();
    assert_eq!(file.layer_data.len(), 1);
    let layer = &file.layer_data[0];
    assert_eq!((layer.size.0, layer.size.1), (17, 33));
    assert_eq!(layer.encoding.compression, Compression::ZIP16);
    let image = picture();
    assert_eq!(layer.channel_data.list.len(), image.channels().len());
    for channel in &layer.channel_data.list {
        match (image.channel(&channel.name.to_string()).unwrap(), &channel.sample_data) {
            (Samples::Half(a), FlatSamples::F16(b)) => {
                assert!(a.iter().zip(b).all(|(a, b)| f16::from_f32(*a) == *b))
            }
            (Samples::Float(a), FlatSamples::F32(b)) => assert_eq!(a, b),
            (Samples::Uint(a), FlatSamples::U32(b)) => assert_eq!(a, b),
            other => panic!("channel {} changed its kind: {other:?}", channel.name),
        }
    }
}

#[test]
fn the_header_tells_how_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let metadata = metadata();
    write(&path, picture(), &metadata).unwrap();

    let file = read_all_flat_layers_from_file(&path).unwrap();
    let found = &file.layer_data[0].attributes;
    assert_eq!(found.software_name, Some(text(concat!("caribou ", env!("CARGO_PKG_VERSION")))));
    // Row vectors, so the translation is the last row.
    assert_eq!(found.world_to_camera.unwrap()[12..], [1.0, 2.0, 3.0, 1.0]);
    assert_eq!(found.world_to_normalized_device.unwrap(), metadata.world_to_ndc.to_cols_array());
    assert_eq!(found.other[&text("renderTime")], AttributeValue::F32(1.5));
    for (name, value) in [
        ("scene", "Höhle 洞.glb"),
        ("seed", "18446744073709551615"),
        ("spp", "4"),
        ("device", "llvmpipe"),
        ("caribou:rays.primary", "561"),
        ("caribou:a name that is longer than the 31 bytes of old readers", "x"),
    ] {
        assert_eq!(found.other[&text(name)], AttributeValue::Text(text(value)), "{name}");
    }
}

#[test]
fn values_beyond_half_are_clamped_and_counted() {
    let mut clamped = 0;
    for (value, expected) in [(1e30, 65504.0), (-7e4, -65504.0), (65504.0, 65504.0), (65519.0, 65504.0), (1e-9, 0.0)] {
        assert_eq!(to_half(value, &mut clamped).to_f32(), expected);
    }
    assert_eq!(clamped, 3);
    let folder = tempfile::tempdir().unwrap();
    let mut image = Image::new(2, 1).unwrap();
    image.push("Y", Samples::Half(vec![1e9, 1.0])).unwrap();
    image.push("Z", Samples::Float(vec![1e9, 1.0])).unwrap();
    assert_eq!(write(&folder.path().join("a.exr"), image, &Metadata::default()).unwrap().clamped, 1);
}

#[test]
fn a_picture_with_nan_or_infinity_is_an_error_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for depth in [Samples::Half, Samples::Float] {
            let mut image = Image::new(3, 2).unwrap();
            image.push("Z", depth(vec![0.0, 0.0, 0.0, 0.0, bad, bad])).unwrap();
            let error = write(&path, image, &metadata()).unwrap_err();
            assert_eq!(error.exit_code(), 1);
            let message = error.to_string();
            assert!(message.contains("2 samples") && message.contains("channel Z at pixel (1, 1)"), "{message}");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        }
    }
}

#[test]
fn an_independent_reader_agrees() {
    let Ok(version) = Command::new("oiiotool").arg("--version").output() else {
        eprintln!("SKIPPED: oiiotool (package openimageio-tools) is not installed");
        return;
    };
    assert!(version.status.success());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, picture(), &metadata()).unwrap();
    let output = Command::new("oiiotool").args(["--info", "-v", "--stats"]).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    for promise in [
        "17 x   33, 6 channel",
        "R (half), G (half), B (float), A (half), primId (uint), N.X (float)",
        "Stats NanCount: 0 0 0 0 0 0",
        "Stats InfCount: 0 0 0 0 0 0",
        "compression: \"zip\"",
        "software: \"caribou ",
        "scene: \"Höhle 洞.glb\"",
        "worldToCamera: 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1",
        "renderTime: 1.5",
        "caribou:rays.primary: \"561\"",
        "31 bytes of old readers: \"x\"",
    ] {
        assert!(said.contains(promise), "no '{promise}' in\n{said}");
    }
}

#[test]
fn what_was_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, picture(), &metadata()).unwrap();
    assert_eq!(read::extent(&path).unwrap(), read::Extent { width: 17, height: 33, channels: 6 });
    let (found, expected) = (read::read(&path).unwrap(), picture());
    for name in ["B", "N.X", "primId"] {
        assert_eq!(found.channel(name), expected.channel(name), "{name}");
    }
    assert_eq!(found.floats("R").unwrap()[4], 1.0);
    assert_eq!(found.channels().len(), 6);
}

#[test]
fn several_parts_are_read_under_their_names() {
    use exr::prelude::{ImageAttributes, IntegerBounds};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parts.exr");
    let part = |name: &str, size: (usize, usize)| {
        let samples = FlatSamples::F32(vec![1.0; size.0 * size.1]);
        let channels = AnyChannels::sort([AnyChannel::new("R", samples)].into_iter().collect());
        Layer::new(size, LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let write = |sizes: [(usize, usize); 2]| {
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((3, 2)));
        let parts = vec![part("left", sizes[0]), part("right", sizes[1])];
        ExrImage::from_layers(attributes, parts).write().to_file(&path).unwrap();
        read::read(&path)
    };
    let names: Vec<String> = write([(3, 2); 2]).unwrap().channels().iter().map(|c| c.name.clone()).collect();
    assert_eq!(names, ["left.R", "right.R"]);
    let error = write([(3, 2), (2, 2)]).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("differ in size"), "{error}");
}

#[test]
fn damaged_files_are_refused_and_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&path, picture(), &metadata()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let read_bytes = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        read::read(&path)
    };
    for cut in (0..whole.len()).step_by(97) {
        assert_eq!(read_bytes(&whole[..cut]).unwrap_err().exit_code(), 2, "cut at {cut}");
    }
    for at in (0..whole.len()).step_by(13) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x5A;
        if let Err(error) = read_bytes(&bytes) {
            assert_eq!(error.exit_code(), 2, "byte {at}: {error}");
        }
    }
    assert_eq!(read::read(&folder.path().join("none.exr")).unwrap_err().exit_code(), 2);
}
