//! Twin of `texture.glsl`: bilinear base-colour textures.

use glam::Vec3;

use crate::layout::Texture;
use crate::scene::tables::Tables;
use crate::shared::{NO_TEXTURE, WRAP_CLAMP, WRAP_MIRROR};

fn reduced(u: f32, mode: u32) -> f32 {
    if mode == WRAP_CLAMP { u.clamp(-1.0, 2.0) } else { u - 2.0 * (u * 0.5).floor() }
}

fn wrapped(i: i32, size: i32, mode: u32) -> u32 {
    if mode == WRAP_CLAMP {
        return i.clamp(0, size - 1) as u32;
    }
    let period = if mode == WRAP_MIRROR { 2 * size } else { size };
    let k = (i + period) % period;
    (if k < size { k } else { period - 1 - k }) as u32
}

fn texel(tables: &Tables, t: &Texture, x: i32, y: i32) -> Vec3 {
    let column = wrapped(x, t.width as i32, t.wrap & 3);
    let row = wrapped(y, t.height as i32, t.wrap >> 2);
    let packed = tables.texels[(t.first + row * t.width + column) as usize];
    let linear = |shift: u32| tables.srgb[(packed >> shift & 255) as usize];
    Vec3::new(linear(0), linear(8), linear(16))
}

/// Colour of texture `index` at a point of primitive `prim`; white without one.
pub fn texture_color(tables: &Tables, index: u32, prim: u32, weights: Vec3) -> Vec3 {
    if index == NO_TEXTURE {
        return Vec3::ONE;
    }
    let t = &tables.textures[index as usize];
    let [a, b, c] = tables.uvs[prim as usize];
    let uv = (a * weights.x + b * weights.y) + c * weights.z;
    let px = reduced(uv.x, t.wrap & 3) * t.width as f32 - 0.5;
    let py = reduced(uv.y, t.wrap >> 2) * t.height as f32 - 0.5;
    let (cx, cy) = (px.floor(), py.floor());
    let (fx, fy) = (px - cx, py - cy);
    let (x, y) = (cx as i32, cy as i32);
    let top = texel(tables, t, x, y) * (1.0 - fx) + texel(tables, t, x + 1, y) * fx;
    let bottom = texel(tables, t, x, y + 1) * (1.0 - fx) + texel(tables, t, x + 1, y + 1) * fx;
    top * (1.0 - fy) + bottom * fy
}
