//! What shading reads of a scene.

shared! {
    /// Material as the kernels read it.
    struct Material {
        /// Linear base colour.
        base_color: [f32; 3],
        /// 0 dielectric .. 1 metal.
        metallic: f32,
        /// Emitted radiance.
        emissive: [f32; 3],
        /// Perceptual roughness.
        roughness: f32,
        /// Transmission factor.
        transmission: f32,
        /// Index of refraction.
        ior: f32,
        /// Index of the base-colour texture or [`crate::shared::NO_TEXTURE`].
        texture: u32,
        /// `MATERIAL_*` in [`crate::shared`].
        flags: u32,
    }

    /// Where a texture's texels are.
    struct Texture {
        /// Index of the first texel.
        first: u32,
        /// Texels across.
        width: u32,
        /// Texels down.
        height: u32,
        /// `WRAP_*` of u in bits 0-1, of v in bits 2-3.
        wrap: u32,
    }

    /// Punctual light as the kernels read it.
    struct Light {
        /// World position (point, spot).
        position: [f32; 3],
        /// `LIGHT_*` in [`crate::shared`].
        kind: u32,
        /// Unit direction in which it shines (directional, spot).
        direction: [f32; 3],
        /// 1 / range, 0 if unlimited.
        inverse_range: f32,
        /// Linear intensity.
        intensity: [f32; 3],
        /// Spot cone: fades as `clamp(cos * angle_scale + angle_offset, 0, 1)` squared.
        angle_scale: f32,
        /// See `angle_scale`.
        angle_offset: f32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
        /// Zero.
        pad2: u32,
    }
}
