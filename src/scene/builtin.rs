//! Scenes embedded in the binary, so that the first picture needs no file.

use crate::{Error, Result};

/// A scene in the binary.
#[derive(Clone, Copy, Debug)]
pub struct Builtin {
    /// What follows `builtin:` on the command line.
    pub name: &'static str,
    /// One line for a list of scenes.
    pub description: &'static str,
    /// The .glb file.
    pub glb: &'static [u8],
}

/// The scene that is rendered if none is named.
pub const DEFAULT: &str = "cornell";

/// All built-in scenes.
pub const BUILTINS: &[Builtin] = &[
    Builtin {
        name: "cornell",
        description: "a Cornell-like room with a mirror, a glass sphere and a copper one",
        glb: include_bytes!("../../scenes/cornell.glb"),
    },
    Builtin {
        name: "courtyard",
        description: "a sunny courtyard with an arcade and a fountain",
        glb: include_bytes!("../../scenes/courtyard.glb"),
    },
    Builtin {
        name: "gallery",
        description: "a row of spheres that shows the materials, with textures and a spot light",
        glb: include_bytes!("../../scenes/gallery.glb"),
    },
];

/// The .glb file of the built-in scene `name`. Fails with [`Error::Usage`] for an unknown name.
pub fn builtin(name: &str) -> Result<&'static [u8]> {
    BUILTINS.iter().find(|builtin| builtin.name == name).map(|builtin| builtin.glb).ok_or_else(|| {
        let known: Vec<&str> = BUILTINS.iter().map(|builtin| builtin.name).collect();
        Error::usage(format!("unknown built-in scene \"{name}\""), format!("known scenes: {}", known.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_known_and_every_file_valid() {
        assert!(builtin(DEFAULT).is_ok());
        for entry in BUILTINS {
            let file = gltf::Gltf::from_slice(builtin(entry.name).unwrap()).unwrap();
            assert!(file.blob.is_some() && file.cameras().any(|camera| camera.name() == Some("main")));
        }
    }

    #[test]
    fn unknown_names_are_usage_errors() {
        let error = builtin("kitchen").unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert_eq!(error.to_string(), "unknown built-in scene \"kitchen\"; known scenes: cornell, courtyard, gallery");
    }
}
