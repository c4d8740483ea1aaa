//! `vk::Result` and allocation failures as [`Error::Device`], with a remedy for each.

use ash::vk;
use gpu_allocator::AllocationError;

use crate::Error;

const SMALLER: &str = "use a smaller scene or image, or another device (--device)";

/// For `map_err`: the driver's answer to `call` while `stage` ran.
pub(super) fn failed(stage: &str, call: &'static str) -> impl Fn(vk::Result) -> Error {
    let stage = stage.to_owned();
    move |result| {
        let (problem, remedy) = match result {
            vk::Result::ERROR_DEVICE_LOST => (
                "the device was lost (a time-out of the driver, or a fault in a kernel)".to_owned(),
                "try a smaller image, see the kernel's log, and run once with --validate".to_owned(),
            ),
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => (format!("{call}: out of device memory"), SMALLER.to_owned()),
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => (format!("{call}: out of host memory"), SMALLER.to_owned()),
            other => (
                format!("{call} failed: {other} ({})", other.as_raw()),
                "update the Vulkan driver, or try another device (--device)".to_owned(),
            ),
        };
        Error::device(&stage, problem, remedy)
    }
}

/// An allocation of `bytes` for the buffer `label` that the allocator refused.
pub(super) fn allocation(label: &str, bytes: u64, error: &AllocationError) -> Error {
    Error::device(format!("allocate {label}"), format!("{bytes} bytes: {error}"), SMALLER)
}

/// An allocation of `bytes` for the buffer `label` that is not tried at all.
pub(super) fn too_large(label: &str, bytes: u64, limit: &str, limit_bytes: u64) -> Error {
    let problem = format!("{bytes} bytes are more than {limit} ({limit_bytes} bytes)");
    Error::device(format!("allocate {label}"), problem, SMALLER)
}
