//! What a driver does that its properties do not say: found out by running kernels when it is opened.

use bytemuck::{Pod, Zeroable};
use serde::Serialize;

use super::buffer::Place;
use super::cases::{Operands, cases};
use super::gpu::Gpu;
use super::kernels::Kernel;
use crate::{Error, Result};

/// Iterations that an unlimited loop is expected to run; more than the 65,535 of Mesa 22's lavapipe.
const LOOP_STEPS: u32 = 70_000;

/// What a device was found to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Probe {
    /// Iterations after which every loop of an invocation silently stops; `None`: none up to 70,000.
    pub loop_limit: Option<u32>,
    /// `fma` rounds once.
    pub fma_fused: bool,
    /// Sum and product of normal numbers are correctly rounded.
    pub exact_add_multiply: bool,
    /// `a / b` is correctly rounded for normal operands and results.
    pub exact_division: bool,
    /// Largest error of `a / b` in units of the last place.
    pub division_ulp: u32,
    /// `1 / b` is correctly rounded for normal operands and results.
    pub exact_reciprocal: bool,
    /// Largest error of `1 / b` in units of the last place.
    pub reciprocal_ulp: u32,
    /// `sqrt` is correctly rounded for normal operands.
    pub exact_sqrt: bool,
    /// Largest error of `sqrt` in units of the last place.
    pub sqrt_ulp: u32,
    /// Denormal operands and results of sum and product are not flushed to zero.
    pub denormals_preserved: bool,
    /// 1 / 0 is infinite with the right sign, and 0 times that is NaN.
    pub infinities: bool,
}

impl Probe {
    /// Whether hits equal those of other devices bit for bit: what the driver rounds as it likes must be
    /// correctable by a fused multiply-add (`glsl/include/exact.glsl`).
    pub fn bit_identical(&self) -> bool {
        self.exact_add_multiply && (self.fma_fused || (self.exact_reciprocal && self.exact_sqrt))
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Results {
    quotient: f32,
    reciprocal: f32,
    root: f32,
    fused: f32,
    product: f32,
    sum: f32,
}

/// Runs the probe kernels.
pub(super) fn run(gpu: &Gpu) -> Result<Probe> {
    Ok(Probe { loop_limit: loop_limit(gpu)?, ..arithmetic(gpu)? })
}

fn loop_limit(gpu: &Gpu) -> Result<Option<u32>> {
    let steps = gpu.upload("probe steps", &[LOOP_STEPS])?;
    let states = gpu.buffer("probe states", 4 * 32, Place::Device)?;
    let mut recorder = gpu.recorder("probe loops")?;
    recorder.dispatch(&gpu.pipeline(Kernel::ProbeLoop, &[])?, &[&steps, &states], &[], 1)?;
    recorder.submit()?;
    let state = gpu.download::<u32>(&states, 0..1)?[0];
    // The generator's period is 2^32, so the state tells the number of steps.
    let next = |state: &u32| Some(state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    match (0..=LOOP_STEPS).zip(std::iter::successors(Some(0), next)).find(|&(_, expected)| expected == state) {
        Some((LOOP_STEPS, _)) => Ok(None),
        Some((done, _)) => Ok(Some(done)),
        None => Err(Error::device(
            "probe loops",
            format!("a loop of integer arithmetic gave {state:#x}, which no number of its steps gives"),
            "update the Vulkan driver, or try another device (--device)",
        )),
    }
}

fn arithmetic(gpu: &Gpu) -> Result<Probe> {
    // A denormal c comes from a product at the end of the range.
    let judged: Vec<Operands> = cases().into_iter().filter(|x| x.c == 0.0 || x.c.is_normal()).collect();
    let tiny = f32::MIN_POSITIVE;
    // A denormal result and operand of the product, operand and result of the sum; then 1 / 0, 1 / -0,
    // and 0 times infinity.
    let special = [[tiny, 0.5, 0.0], [tiny / 8.0, 4.0, 0.0], [tiny, 1.0, -tiny / 2.0]]
        .into_iter()
        .chain([[1.0, 0.0, 0.0], [1.0, -0.0, 0.0], [f32::INFINITY, 0.0, 0.0]])
        .map(|[a, b, c]| Operands { a, b, c });
    let all: Vec<Operands> = judged.iter().copied().chain(special).collect();
    let results = evaluate(gpu, &all)?;
    let (results, special) = results.split_at(judged.len());

    let mut probe = Probe { fma_fused: true, exact_add_multiply: true, ..Probe::default() };
    for (x, y) in judged.iter().zip(results) {
        probe.exact_add_multiply &= differ(x.a * x.b, y.product) == 0 && differ(x.a + x.c, y.sum) == 0;
        probe.fma_fused &= differ(x.a.mul_add(x.b, x.c), y.fused) == 0;
        // Beyond 2^126 the Vulkan specification (Precision of Individual Operations) bounds no error.
        if x.b.abs() <= 2f32.powi(126) {
            probe.division_ulp = probe.division_ulp.max(differ(x.a / x.b, y.quotient));
            probe.reciprocal_ulp = probe.reciprocal_ulp.max(differ(1.0 / x.b, y.reciprocal));
        }
        if x.a > 0.0 {
            probe.sqrt_ulp = probe.sqrt_ulp.max(differ(x.a.sqrt(), y.root));
        }
    }
    probe.exact_division = probe.division_ulp == 0;
    probe.exact_reciprocal = probe.reciprocal_ulp == 0;
    probe.exact_sqrt = probe.sqrt_ulp == 0;
    let [half, half_product, half_sum, plus, minus, nan] = special else { unreachable!("as many results as operands") };
    probe.denormals_preserved =
        half.product == tiny / 2.0 && half_product.product == tiny / 2.0 && half_sum.sum == tiny / 2.0;
    probe.infinities = plus.quotient == f32::INFINITY && minus.quotient == f32::NEG_INFINITY && nan.product.is_nan();
    Ok(probe)
}

fn evaluate(gpu: &Gpu, operands: &[Operands]) -> Result<Vec<Results>> {
    let count = operands.len();
    let input = gpu.upload("probe operands", operands)?;
    let output = gpu.buffer("probe results", (count * size_of::<Results>()) as u64, Place::Device)?;
    let groups = (count as u32).div_ceil(Kernel::ProbeArithmetic.interface().local_size);
    let mut recorder = gpu.recorder("probe arithmetic")?;
    recorder.dispatch(&gpu.pipeline(Kernel::ProbeArithmetic, &[])?, &[&input, &output], &[], groups)?;
    recorder.submit()?;
    gpu.download(&output, 0..count)
}

/// Difference in units of the last place; none where a denormal, infinite or NaN result is expected.
/// The smallest binade counts as denormal: a device may flush before it rounds.
fn differ(expected: f32, found: f32) -> u32 {
    let judged = expected.is_normal() && expected.abs() >= 2.0 * f32::MIN_POSITIVE;
    if !judged || expected.to_bits() == found.to_bits() {
        return 0;
    }
    let ordered = |x: f32| i64::from(x.abs().to_bits()) * if x.is_sign_negative() { -1 } else { 1 };
    u32::try_from(ordered(expected).abs_diff(ordered(found))).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::Probe;

    #[test]
    fn a_device_without_exact_results_or_fma_is_not_bit_identical() {
        let exact = Probe { exact_add_multiply: true, exact_reciprocal: true, exact_sqrt: true, ..Probe::default() };
        assert!(exact.bit_identical());
        assert!(!Probe { exact_sqrt: false, ..exact }.bit_identical());
        assert!(!Probe { exact_reciprocal: false, ..exact }.bit_identical());
        assert!(!Probe { exact_add_multiply: false, ..exact }.bit_identical());
        let corrected = Probe { exact_add_multiply: true, fma_fused: true, ..Probe::default() };
        assert!(corrected.bit_identical());
    }
}
