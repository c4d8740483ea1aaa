//! Proves on a device that `exact.glsl` is exact: every mantissa, compared with the host bit for bit.

use rayon::prelude::*;
use serde::Serialize;

use super::tracer::exactness;
use crate::Result;
use crate::shared::*;
use crate::twin::exact::{exact_rcp, exact_sqrt, product_error};
use crate::vulkan::{Buffer, Gpu, Kernel, Pipeline, Place};

/// Numbers of one binade, and cases of a dispatch.
const MANTISSAS: u32 = 1 << 23;

/// Biased exponents at which all reciprocals are compared: the ends of the range in which number and
/// reciprocal are normal numbers whatever the mantissa (2^-125 and 2^124), and around 1.
const RCP_EXPONENTS: [u32; 5] = [2, 126, 127, 128, 251];

/// Likewise for square roots, in pairs because the root's mantissa depends on the exponent's parity:
/// [`SQRT_FLOOR`], around 1, and the largest.
const SQRT_EXPONENTS: [u32; 6] = [49, 50, 126, 127, 253, 254];

/// Comparison of one thing on a device and on the twin.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Verdict {
    /// What was compared.
    pub what: String,
    /// How many.
    pub cases: u64,
    /// How many of them differ in any bit.
    pub mismatches: u64,
    /// Digest of the device's hits, where it is about hits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
}

/// Compares reciprocals and square roots of all mantissas, and the rounding errors of random products:
/// along the paths that this device takes, and along the corrected ones where it can take them.
///
/// # Errors
/// [`crate::Error::Device`] if the driver fails.
pub fn verify_arithmetic(gpu: &Gpu) -> Result<Vec<Verdict>> {
    let mut bench = Bench::new(gpu)?;
    bench.device_path()?;
    if gpu.probe().fma_fused {
        bench.corrected_path()?;
    }
    bench.unfused_path()?;
    Ok(bench.verdicts)
}

struct Bench<'g> {
    gpu: &'g Gpu,
    factors: Vec<[f32; 2]>,
    factor_buffer: Buffer,
    answers: Buffer,
    verdicts: Vec<Verdict>,
}

impl<'g> Bench<'g> {
    fn new(gpu: &'g Gpu) -> Result<Self> {
        let factors: Vec<[f32; 2]> = (0..MANTISSAS).into_par_iter().map(factors).collect();
        let factor_buffer = gpu.upload("factors", &factors)?;
        let answers = gpu.buffer("answers", u64::from(MANTISSAS) * 4, Place::Device)?;
        Ok(Bench { gpu, factors, factor_buffer, answers, verdicts: Vec::new() })
    }

    fn device_path(&mut self) -> Result<()> {
        let pipeline = self.gpu.pipeline(Kernel::VerifyExact, &exactness(self.gpu.probe()))?;
        self.reciprocals("exact_rcp, this device's path", &pipeline)?;
        self.square_roots("exact_sqrt, this device's path", &pipeline)?;
        self.product_errors("product_error, this device's path", &pipeline)
    }

    /// As if the driver's own results could not be relied on.
    fn corrected_path(&mut self) -> Result<()> {
        let spec = [(SPEC_RCP_EXACT, 0), (SPEC_SQRT_EXACT, 0), (SPEC_FMA_FUSED, 1)];
        let pipeline = self.gpu.pipeline(Kernel::VerifyExact, &spec)?;
        self.reciprocals("exact_rcp, corrected", &pipeline)?;
        self.square_roots("exact_sqrt, corrected", &pipeline)
    }

    /// As if `fma` rounded twice.
    fn unfused_path(&mut self) -> Result<()> {
        let spec = [(SPEC_RCP_EXACT, 1), (SPEC_SQRT_EXACT, 1), (SPEC_FMA_FUSED, 0)];
        let pipeline = self.gpu.pipeline(Kernel::VerifyExact, &spec)?;
        self.product_errors("product_error, without fma", &pipeline)
    }

    fn reciprocals(&mut self, name: &'static str, pipeline: &Pipeline) -> Result<()> {
        let firsts = RCP_EXPONENTS.into_iter().flat_map(|e| [e << 23, 1 << 31 | e << 23]);
        self.compare(name, pipeline, VERIFY_RCP, firsts, |first, i| exact_rcp(f32::from_bits(first + i)))
    }

    fn square_roots(&mut self, name: &'static str, pipeline: &Pipeline) -> Result<()> {
        let firsts = SQRT_EXPONENTS.into_iter().map(|e| e << 23);
        self.compare(name, pipeline, VERIFY_SQRT, firsts, |first, i| exact_sqrt(f32::from_bits(first + i)))
    }

    fn product_errors(&mut self, name: &'static str, pipeline: &Pipeline) -> Result<()> {
        let factors = std::mem::take(&mut self.factors);
        let result = self.compare(name, pipeline, VERIFY_PRODUCT_ERROR, [0].into_iter(), |_, i| {
            let [a, b] = factors[i as usize];
            product_error(a, b, a * b)
        });
        self.factors = factors;
        result
    }

    /// Runs `operation` from each of `firsts` on and counts what differs from `host(first, i)`.
    fn compare(
        &mut self,
        name: &'static str,
        pipeline: &Pipeline,
        operation: u32,
        firsts: impl Iterator<Item = u32>,
        host: impl Fn(u32, u32) -> f32 + Sync,
    ) -> Result<()> {
        let mut verdict = Verdict { what: name.to_owned(), cases: 0, mismatches: 0, digest: None };
        for first in firsts {
            let groups = MANTISSAS.div_ceil(pipeline.kernel().interface().local_size);
            let mut recorder = self.gpu.recorder("verify arithmetic")?;
            let buffers = [&self.factor_buffer, &self.answers];
            recorder.dispatch(pipeline, &buffers, bytemuck::bytes_of(&[operation, first]), groups)?;
            recorder.submit()?;
            let answers = self.gpu.download::<u32>(&self.answers, 0..MANTISSAS as usize)?;
            let differs = |&(i, &answer): &(u32, &u32)| !same(host(first, i), answer);
            verdict.mismatches += (0..MANTISSAS).into_par_iter().zip(&answers).filter(differs).count() as u64;
            verdict.cases += u64::from(MANTISSAS);
        }
        self.verdicts.push(verdict);
        Ok(())
    }
}

/// Equal in all bits but the sign of zero, which no kernel looks at.
fn same(host: f32, device: u32) -> bool {
    host.to_bits() == device || (host == 0.0 && f32::from_bits(device) == 0.0)
}

/// Two factors in the range of sheared coordinates, from 2^-103 (see [`SHEAR_FLOOR`]) to 2^61, with a product
/// from [`PRODUCT_FLOOR`] up; one pair in four is at its low end, where rounding errors are smallest.
fn factors(i: u32) -> [f32; 2] {
    let exponent = |x: f32| (x.to_bits() >> 23) as i32 - 127;
    let (lowest, highest) = (exponent(SHEAR_FLOOR * COORDINATE_FLOOR) - 23, 61);
    // Finaliser of MurmurHash3.
    let mix = |x: u32| {
        let x = (x ^ x >> 16).wrapping_mul(0x85eb_ca6b);
        let x = (x ^ x >> 13).wrapping_mul(0xc2b2_ae35);
        x ^ x >> 16
    };
    // Mantissa and exponent are independent.
    let number = |n: u32, low: i32, high: i32| {
        let exponent = low + (mix(n ^ 0x9e37_79b9) % (high - low) as u32) as i32;
        f32::from_bits(mix(n) & 0x807f_ffff | ((exponent + 127) as u32) << 23)
    };
    let a = number(2 * i, lowest, highest);
    let least = lowest.max(exponent(PRODUCT_FLOOR) - exponent(a.abs()));
    [a, number(2 * i + 1, least, if i.is_multiple_of(4) { least + 4 } else { highest })]
}
