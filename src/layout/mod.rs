//! Structs shared with the kernels, one for one with `glsl/include/types.glsl` and the kernels' push constants.
//! `tests/layout.rs` compares names and offsets with the compiled SPIR-V.

/// Makes structs with the kernels' layout, and a list of them.
macro_rules! shared {
    ($($(#[$about:meta])* struct $name:ident { $($(#[$field_about:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$about])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
            pub struct $name { $($(#[$field_about])* pub $field: $kind,)* }
        )*

        /// The structs of this file.
        pub(super) const STRUCTS: &[super::SharedStruct] = &[$(super::SharedStruct {
            name: stringify!($name),
            bytes: size_of::<$name>(),
            fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
        },)*];
    };
}

mod migration;
mod picture;
mod rays;
mod scene;
mod tree;
mod virtual_l1;

pub use migration::{Batch, MigratePush, QueueEntry, QueuePush, Round, Travel, Visit};
pub use picture::{AovPixel, Contribution, Frame, Path, StagePush};
pub use rays::{Hit, Ray, RayCounters, TracePush};
pub use scene::{Light, Material, Texture};
pub use tree::{Node, QuantisedNode, Subtree, Triangle};
pub use virtual_l1::{AccessCounts, VirtualPush, WarpSlot};

/// A struct as the host has it.
#[derive(Clone, Copy, Debug)]
pub struct SharedStruct {
    /// Its name in GLSL.
    pub name: &'static str,
    /// Size of it.
    pub bytes: usize,
    /// Name and byte offset of each field.
    pub fields: &'static [(&'static str, usize)],
}

/// Every shared struct.
pub fn shared_structs() -> impl Iterator<Item = &'static SharedStruct> {
    [rays::STRUCTS, tree::STRUCTS, migration::STRUCTS, virtual_l1::STRUCTS, scene::STRUCTS, picture::STRUCTS]
        .into_iter()
        .flatten()
}
