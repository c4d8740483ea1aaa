//! TODO(vulkan)
