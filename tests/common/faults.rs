//! Devices whose kernels have a fault planted in their source.

#[path = "../../build/kernels.rs"]
mod kernels;

use std::path::Path;

use caribou::vulkan::GpuOptions;
use tempfile::TempDir;

use super::{Validated, gpu_with};

/// A text of a file under `glsl/`, which has it once, and what is to stand there.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    pub file: &'static str,
    pub original: &'static str,
    pub planted: &'static str,
}

/// A device, and the folder from which it takes `kernels`; the others are the built-in ones.
pub fn gpu_with_fault(kernels: &[&str], fault: Fault) -> Option<(Validated, TempDir)> {
    let folder = tempfile::tempdir().unwrap();
    copy_sources(folder.path(), fault);
    for name in kernels {
        let [source, compiled] = ["comp", "spv"].map(|extension| folder.path().join(name).with_extension(extension));
        kernels::compile(&source, &folder.path().join("include"), &compiled);
    }
    let options = GpuOptions { kernels: Some(folder.path().to_owned()), ..GpuOptions::default() };
    Some((gpu_with(&options)?, folder))
}

fn copy_sources(folder: &Path, Fault { file, original, planted }: Fault) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    std::fs::create_dir(folder.join("include")).unwrap();
    for from in [source.clone(), source.join("include")] {
        for path in std::fs::read_dir(&from).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
            let mut text = std::fs::read_to_string(&path).unwrap();
            let name = path.strip_prefix(&source).unwrap();
            if name == Path::new(file) {
                assert_eq!(text.matches(original).count(), 1, "{file} has once: {original}");
                text = text.replace(original, planted);
            }
            std::fs::write(folder.join(name), text).unwrap();
        }
    }
}
