//! Twin of `material.glsl`: how a surface passes light on.

use glam::Vec3;

use super::exact::{exact_rcp, exact_sqrt};
use super::surface::Surface;
use super::vec::{dot3, normalize3};
use crate::layout::Material;
use crate::shared::MATERIAL_UNLIT;

/// Whether the material shows its colour as it is.
pub fn is_unlit(m: &Material) -> bool {
    m.flags & MATERIAL_UNLIT != 0
}

/// Share of the light that the Lambertian part reflects.
pub fn diffuse_color(s: &Surface) -> Vec3 {
    if is_unlit(&s.material) {
        return Vec3::ZERO;
    }
    s.color * ((1.0 - s.material.metallic) * (1.0 - s.material.transmission))
}

/// Mirror direction.
pub fn reflected(d: Vec3, n: Vec3) -> Vec3 {
    d - n * (2.0 * dot3(d, n))
}

/// Schlick 1994.
pub fn schlick(f0: Vec3, cosine: f32) -> Vec3 {
    let m = (1.0 - cosine).max(0.0);
    let m2 = m * m;
    f0 + (Vec3::ONE - f0) * (m2 * m2 * m)
}

/// Fresnel reflectance between dielectrics; 1 where all is reflected.
pub fn dielectric(cosine: f32, eta: f32) -> f32 {
    let sine2 = eta * eta * (1.0 - cosine * cosine);
    if sine2 >= 1.0 {
        return 1.0;
    }
    let inner = exact_sqrt(1.0 - sine2);
    let s = (eta * cosine - inner) * exact_rcp(eta * cosine + inner);
    let p = (cosine - eta * inner) * exact_rcp(cosine + eta * inner);
    (s * s + p * p) * 0.5
}

/// Snell's direction; only where [`dielectric`] is below 1.
pub fn refracted(d: Vec3, n: Vec3, cosine: f32, eta: f32) -> Vec3 {
    let inner = exact_sqrt((1.0 - eta * eta * (1.0 - cosine * cosine)).max(0.0));
    normalize3(d * eta + n * (eta * cosine - inner))
}
