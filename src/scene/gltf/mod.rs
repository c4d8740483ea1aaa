//! glTF 2.0 files to scenes.
//!
//! The `gltf` crate parses the JSON (`gltf::json`). Its accessors to the parsed document panic or read
//! out of bounds on malformed files, so they are not used: everything is checked here, object by object,
//! and bytes are read through [`accessor::Accessors`].

mod accessor;
mod buffers;
mod camera;
mod container;
mod extensions;
mod flatten;
mod instances;
mod json;
mod light;
mod load;
mod material;
mod nodes;
mod references;
mod remarks;
mod source;
mod texture;
mod topology;
mod uri;
mod wide_index;

pub use load::{load, load_slice};
