//! Which glTF extensions are supported.

use gltf::json::Root;

use super::remarks::Remarks;
use super::source::Source;
use crate::Result;

/// Extensions that are read and used.
const SUPPORTED: [&str; 6] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
];

/// A scene may not be shown without the extensions that it requires.
pub(super) fn check_required(source: &Source, required: &[String]) -> Result<()> {
    match required.iter().find(|name| !SUPPORTED.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => Err(source.fault(
            "extensionsRequired",
            format!("{name:?} is not supported"),
            format!("export the scene without it; supported are {}", SUPPORTED.join(", ")),
        )),
    }
}

/// What is used but not required is left out, and said.
pub(super) fn remark_unsupported(root: &Root, remarks: &mut Remarks) {
    for name in root.extensions_used.iter().filter(|name| !SUPPORTED.contains(&name.as_str())) {
        remarks.add(format!("The extension {name} is used but not supported and left out"));
    }
}
