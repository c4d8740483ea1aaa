//! From scene-linear radiance to the eight bits of a screen.

/// Scales by `exposure`, compresses highlights and encodes as sRGB.
///
/// The curve is the Khronos PBR Neutral Tone Mapper (Khronos Group 2024, the glTF ecosystem's own): it
/// leaves base colours up to 0.8 as they are, less the 4 % that a dielectric reflects, so mid-tones
/// look like the material's texture; only highlights are compressed, towards white.
pub fn display(linear: [f32; 3], exposure: f32) -> [u8; 3] {
    pbr_neutral(linear.map(|value| (value * exposure).clamp(0.0, f32::MAX))).map(srgb)
}

/// Names and constants of the specification; its order of operations.
fn pbr_neutral(color: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04;
    const START_COMPRESSION: f32 = 0.8 - F90;
    const DESATURATION: f32 = 0.15;

    let lowest = color[0].min(color[1]).min(color[2]);
    let offset = if lowest <= 2.0 * F90 { lowest - lowest * lowest / (4.0 * F90) } else { F90 };
    let color = color.map(|value| value - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak <= START_COMPRESSION {
        return color;
    }
    let room = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - room * room / (peak + room - START_COMPRESSION);
    let keep = 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|value| value * (new_peak / peak) * keep + new_peak * (1.0 - keep))
}

/// The transfer function of IEC 61966-2-1, rounded to 8 bits. Values outside 0..1 are clamped, NaN is 0.
pub fn srgb(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_has_its_published_points() {
        assert_eq!([0.0, 1.0, 0.215_861, 0.5, -1.0, 9.0, f32::NAN].map(srgb), [0, 255, 128, 188, 0, 255, 0]);
    }

    #[test]
    fn base_colors_pass_unchanged_but_for_the_reflection_of_a_dielectric() {
        for value in [0.1, 0.18, 0.5, 0.8] {
            let [mapped, ..] = pbr_neutral([value; 3]);
            assert!((mapped - (value - 0.04)).abs() < 1e-6, "{value} became {mapped}");
        }
    }

    #[test]
    fn the_curve_is_continuous_monotonic_and_below_white() {
        let mut last = -1.0;
        for step in 0..50_000 {
            let [mapped, ..] = pbr_neutral([step as f32 * 1e-4; 3]);
            assert!(mapped > last && mapped - last.max(0.0) < 2e-4 && mapped < 1.0, "at {step}: {last} to {mapped}");
            last = mapped;
        }
    }

    #[test]
    fn extremes_stay_in_range() {
        assert_eq!(display([0.0; 3], 1.0), [0; 3]);
        assert_eq!(display([-1.0, f32::NAN, -0.0], 1.0), [0; 3]);
        assert_eq!(display([f32::MAX; 3], 2.0), [255; 3]);
        let [r, g, b] = display([1000.0, 0.0, 0.0], 1.0);
        assert!(r > 250 && g == b && g > 200, "bright red turns white, got {r} {g} {b}");
    }

    #[test]
    fn exposure_scales_before_the_curve() {
        assert_eq!(display([0.2, 0.1, 0.4], 2.0), display([0.4, 0.2, 0.8], 1.0));
    }
}
