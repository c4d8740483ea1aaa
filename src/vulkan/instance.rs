//! The loader and the instance.

use ash::{ext, vk};

use super::error::failed;
use super::validation::{self, Messages};
use crate::{Error, Result};

/// Oldest Vulkan this program runs on: buffer device addresses are core from here on.
pub(super) const API_VERSION: u32 = vk::API_VERSION_1_2;

const STAGE: &str = "open device";
const INSTALL: &str = "install a driver: Debian, Ubuntu: apt-get install libvulkan1 and the GPU's Vulkan driver, or \
                       mesa-vulkan-drivers for software rendering; VK_DRIVER_FILES may name one";

/// A Vulkan instance, destroyed on drop. Keeps the loader in memory.
pub(super) struct Instance {
    pub raw: ash::Instance,
    pub messages: Messages,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    _entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan; with `validate`, under the validation layer.
    pub fn new(validate: bool) -> Result<Self> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which are trusted.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|error| Error::device(STAGE, format!("no Vulkan loader ({error})"), INSTALL))?;
        // SAFETY: the loader is loaded; the call has no other precondition.
        let version = unsafe { entry.try_enumerate_instance_version() }
            .map_err(failed(STAGE, "vkEnumerateInstanceVersion"))?
            .unwrap_or(vk::API_VERSION_1_0);
        if version < API_VERSION {
            return Err(Error::device(STAGE, "the Vulkan loader is older than 1.2", "update libvulkan1"));
        }
        if validate {
            validation::require_layer(&entry)?;
        }

        let messages = Messages::default();
        let application = vk::ApplicationInfo::default()
            .application_name(c"caribou")
            .engine_name(c"caribou")
            .api_version(API_VERSION);
        let layers = [validation::LAYER.as_ptr()];
        let extensions = [ext::debug_utils::NAME.as_ptr(), ext::validation_features::NAME.as_ptr()];
        let used = usize::from(validate);
        let mut checks = vk::ValidationFeaturesEXT::default().enabled_validation_features(&validation::CHECKS);
        // Chained to the instance too, so that its creation and destruction are checked.
        let mut messenger_info = messages.messenger();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers[..used])
            .enabled_extension_names(&extensions[..2 * used]);
        if validate {
            info = info.push_next(&mut checks).push_next(&mut messenger_info);
        }
        // SAFETY: `info` and everything it points to live until the call returns; the messages live
        // as long as the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::device(STAGE, "no Vulkan driver found", INSTALL),
            other => failed(STAGE, "vkCreateInstance")(other),
        })?;
        let mut instance = Self { raw, messages, messenger: None, _entry: entry };
        if validate {
            let debug = ext::debug_utils::Instance::new(&instance._entry, &instance.raw);
            // SAFETY: the extension is enabled; the messages live as long as the instance.
            let messenger = unsafe { debug.create_debug_utils_messenger(&instance.messages.messenger(), None) }
                .map_err(failed(STAGE, "vkCreateDebugUtilsMessengerEXT"))?;
            instance.messenger = Some((debug, messenger));
        }
        Ok(instance)
    }

    /// The error for a machine whose loader works but offers no device.
    pub fn no_device() -> Error {
        Error::device(STAGE, "no Vulkan device found", INSTALL)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance is gone: the context drops it last.
        unsafe {
            if let Some((debug, messenger)) = self.messenger.take() {
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}
