//! `--tolerance` and `--time-limit`: no more work than an answer of that quality needs.

use crate::fermi::result::Fidelity;
use crate::fermi::sampled::{Effort, Request};
use crate::{Error, Result};

/// Tolerance of fidelity `sampled` where none is asked for.
const DEFAULT: f64 = 0.02;

/// Draws repeat.
const SEED: u64 = 1;

/// What is asked of fidelity `sampled`; none for the others.
///
/// # Errors
/// [`Error::Usage`] for a tolerance that another fidelity would ignore.
pub fn request(fidelity: Fidelity, tolerance: Option<f64>, time_limit: Option<f64>) -> Result<Option<Request>> {
    match (fidelity, tolerance) {
        (Fidelity::Sampled, _) => Ok(Some(Request { tolerance: tolerance.unwrap_or(DEFAULT), time_limit, seed: SEED })),
        (_, Some(_)) => Err(Error::usage("--tolerance", "it goes with --fidelity sampled alone")),
        _ => Ok(None),
    }
}

/// A part of the whole: above 0, at most 1.
pub fn fraction(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && *value <= 1.0);
    value.ok_or_else(|| "give a number above 0 and at most 1, such as 0.02".to_owned())
}

/// A time.
pub fn seconds(text: &str) -> std::result::Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "give seconds above 0".to_owned())
}

/// An error if the tolerance was not met.
pub fn check(effort: Option<&Effort>) -> Result<()> {
    match effort.filter(|effort| !effort.met) {
        Some(effort) => Err(Error::Check(format!(
            "the time limit came first: the answer is within {:.2} %, not {:.2} %",
            100.0 * effort.reached,
            100.0 * effort.asked
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_above_0_and_at_most_1() {
        assert_eq!(fraction("0.02"), Ok(0.02));
        assert_eq!(fraction("1"), Ok(1.0));
        for bad in ["0", "-0.1", "1.01", "NaN", "inf", "", "2%"] {
            assert!(fraction(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-1", "NaN", "inf"] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
    }
}
