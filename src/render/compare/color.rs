//! The colour spaces of FLIP: from the eight bits of a screen to opponent colours and CIELAB.

use glam::{DMat3, DVec3};

/// Chromaticities x, y of Rec. 709's primaries and of D65, of which sRGB is made (IEC 61966-2-1).
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
const WHITE: [f64; 2] = [0.3127, 0.3290];

/// Linear RGB to CIE XYZ and back, with Y of white = 1.
pub struct Spaces {
    xyz_of_rgb: DMat3,
    rgb_of_xyz: DMat3,
    white: DVec3,
}

impl Spaces {
    /// From the chromaticities (Pascale 2003, A Review of RGB Color Spaces, section 5).
    pub fn new() -> Spaces {
        let direction = |[x, y]: [f64; 2]| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let [r, g, b] = PRIMARIES.map(direction);
        let white = direction(WHITE);
        let primaries = DMat3::from_cols(r, g, b);
        let xyz_of_rgb = primaries * DMat3::from_diagonal(primaries.inverse() * white);
        Spaces { xyz_of_rgb, rgb_of_xyz: xyz_of_rgb.inverse(), white }
    }

    /// Opponent colours Y, Cx, Cz (Flohr et al. 1993), in which the eye's sharpness is known.
    pub fn opponent(&self, srgb: [u8; 3]) -> [f64; 3] {
        let [x, y, z] = (self.xyz_of_rgb * DVec3::from(srgb.map(linear)) / self.white).to_array();
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// Linear RGB of opponent colours, clamped to what a screen shows.
    pub fn displayable(&self, [y, cx, cz]: [f64; 3]) -> DVec3 {
        let y = (y + 16.0) / 116.0;
        let xyz = DVec3::new(y + cx / 500.0, y, y - cz / 200.0) * self.white;
        (self.rgb_of_xyz * xyz).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// CIELAB with its chroma scaled by lightness, since dark colours look less colourful (Hunt 1952), as
    /// Andersson et al. 2020 do in section 4.1.
    pub fn hunt_lab(&self, rgb: DVec3) -> [f64; 3] {
        let [x, y, z] = (self.xyz_of_rgb * rgb / self.white).to_array().map(compressed);
        let lightness = 116.0 * y - 16.0;
        [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
    }
}

/// Distance of two colours that may be far apart: city-block in lightness, Euclidean in chroma (Abasi, Amani
/// Tehran and Fairchild 2020).
pub fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Inverse of sRGB's transfer function (IEC 61966-2-1).
fn linear(encoded: u8) -> f64 {
    let encoded = f64::from(encoded) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// CIELAB's cube root with its linear part near black (ISO/CIE 11664-4).
fn compressed(t: f64) -> f64 {
    const DELTA: f64 = 6.0 / 29.0;
    if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_black_and_the_primaries_are_where_the_standards_have_them() {
        let spaces = Spaces::new();
        let close = |found: [f64; 3], expected: [f64; 3]| {
            assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 2e-3), "{found:?} is not {expected:?}");
        };
        // IEC 61966-2-1 gives the matrix to four digits.
        close(spaces.xyz_of_rgb.x_axis.to_array(), [0.4124, 0.2126, 0.0193]);
        close(spaces.xyz_of_rgb.y_axis.to_array(), [0.3576, 0.7152, 0.1192]);
        close(spaces.opponent([255; 3]), [100.0, 0.0, 0.0]);
        close(spaces.opponent([0; 3]), [-16.0, 0.0, 0.0]);
        close(spaces.hunt_lab(DVec3::ONE), [100.0, 0.0, 0.0]);
        close(spaces.hunt_lab(DVec3::ZERO), [0.0; 3]);
        // Lindbloom's calculator: L* = 87.735, a* = -86.183, b* = 83.180 for sRGB's green, here by L* / 100.
        let green = spaces.hunt_lab(DVec3::Y);
        assert!((green[0] - 87.735).abs() < 0.02 && (green[1] + 75.612).abs() < 0.05, "{green:?}");
    }

    #[test]
    fn opponent_colors_come_back() {
        let spaces = Spaces::new();
        for rgb in [[0, 128, 255], [17, 3, 99], [255, 255, 0]] {
            let back = spaces.displayable(spaces.opponent(rgb));
            let expected = DVec3::from(rgb.map(linear));
            assert!(back.distance(expected) < 1e-12, "{back} is not {expected}");
        }
    }
}
