//! Reciprocal, square root and product error are exact on the device, on every path through them.

mod common;

#[test]
fn gpu_arithmetic_is_exact() -> caribou::Result<()> {
    let Some(gpu) = common::gpu() else { return Ok(()) };
    assert!(gpu.probe().bit_identical(), "{:?}", gpu.probe());
    let verdicts = caribou::trace::verify_arithmetic(&gpu)?;
    println!("{verdicts:#?}");
    for verdict in verdicts {
        assert!(verdict.cases > 0 && verdict.mismatches == 0, "{verdict:?}");
    }
    Ok(())
}
