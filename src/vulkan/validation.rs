//! The Khronos validation layer: core and synchronization validation, messages collected.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use crate::{Error, Result};

/// Name of the layer.
pub(super) const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What to check on top of the layer's defaults.
pub(super) const CHECKS: [vk::ValidationFeatureEnableEXT; 1] =
    [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];

/// Messages of the layer, in order of arrival.
#[derive(Clone, Default)]
pub(super) struct Messages(Arc<Mutex<Vec<String>>>);

impl Messages {
    /// All messages so far.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Warnings and errors of the layer go to `self`, which must outlive whatever is created with
    /// the result. General messages are left out: they are the loader's remarks about drivers and
    /// layers of the machine, not about this program.
    pub fn messenger(&self) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
        use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
        vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::WARNING | Severity::ERROR)
            .message_type(Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(collect))
            .user_data(Arc::as_ptr(&self.0).cast_mut().cast())
    }
}

/// Refuses with the package's name when the layer is not installed.
pub(super) fn require_layer(entry: &ash::Entry) -> Result<()> {
    // SAFETY: `entry` holds a loaded Vulkan loader; the call has no other precondition.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
    if layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(LAYER)) {
        return Ok(());
    }
    Err(Error::device(
        "open device",
        "validation was asked for, but the layer VK_LAYER_KHRONOS_validation is not installed",
        "install it (Debian, Ubuntu: apt-get install vulkan-validationlayers) or run without --validate",
    ))
}

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid structure whose message is null or a C string.
    let text = unsafe { data.as_ref().and_then(|data| data.message_as_c_str()) };
    let text = text.map_or_else(String::new, |text| text.to_string_lossy().into_owned());
    tracing::warn!("{text}");
    // SAFETY: `messenger` passed a pointer into the Arc that outlives the messenger.
    let messages = unsafe { &*messages.cast::<Mutex<Vec<String>>>() };
    messages.lock().unwrap_or_else(PoisonError::into_inner).push(text);
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use ash::vk;

    use crate::vulkan::{Place, gpu};

    /// What [`Gpu`] itself does is tested in tests/vulkan.rs to leave no message.
    #[test]
    fn misuse_and_hazards_leave_a_message() {
        let Some(gpu) = gpu::for_test(true) else { return };
        assert_eq!(gpu.validation_messages(), Vec::<String>::new());

        let empty = vk::BufferCreateInfo::default().usage(vk::BufferUsageFlags::STORAGE_BUFFER);
        // SAFETY: invalid on purpose (no size); the layer reports it and the result is destroyed.
        unsafe {
            if let Ok(buffer) = gpu.context.device.create_buffer(&empty, None) {
                gpu.context.device.destroy_buffer(buffer, None);
            }
        }
        let messages = gpu.validation_messages();
        assert!(messages.iter().any(|m| m.contains("VUID-VkBufferCreateInfo-size")), "{messages:?}");

        let buffer = gpu.buffer("hazard", 64, Place::Device).unwrap();
        let mut recorder = gpu.recorder("hazard").unwrap();
        recorder.fill(&buffer, 1).unwrap();
        recorder.fill(&buffer, 2).unwrap(); // no barrier between
        recorder.submit().unwrap();
        let messages = gpu.validation_messages();
        assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD-WRITE-AFTER-WRITE")), "{messages:?}");
    }
}
