//! From numbers to places on an axis, and the ticks between them.

use super::Axis;

/// Part of a logarithmic axis that is kept for zero, which has no logarithm.
const ZERO_SHARE: f64 = 0.08;

/// Part of the range that is added at each end, so that markers stay inside.
const MARGIN: f64 = 0.04;

/// A tick of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Place, 0 at the axis' begin and 1 at its end.
    pub at: f64,
    /// The number; empty for a small tick between others.
    pub label: String,
}

/// The range of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Ends; of a logarithmic axis their decimal logarithms.
    low: f64,
    high: f64,
    log: bool,
    /// Whether a logarithmic axis also shows zero.
    zero: bool,
}

impl Scale {
    /// The range that shows all `values`, which must be finite, and not negative for a logarithmic axis.
    pub fn of(axis: &Axis, values: impl Iterator<Item = f64> + Clone) -> Scale {
        if axis.log {
            let zero = values.clone().any(|v| v <= 0.0);
            let (low, high) = extent(values.filter(|v| *v > 0.0).map(f64::log10)).unwrap_or((0.0, 1.0));
            let margin = if low < high { MARGIN * (high - low) } else { 0.5 };
            return Scale { low: low - margin, high: high + margin, log: true, zero };
        }
        let (low, high) = extent(values).unwrap_or((0.0, 1.0));
        let margin = if low < high { MARGIN * (high - low) } else { (0.1 * low.abs()).max(0.5) };
        // An axis that nearly reaches zero begins there: lengths can be compared then.
        let floor = if (0.0..=0.4 * high).contains(&low) { 0.0 } else { low - margin };
        Scale { low: floor, high: high + margin, log: false, zero: false }
    }

    /// Place of a number: 0 at the axis' begin, 1 at its end.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.zero { ZERO_SHARE } else { 0.0 };
        match self.log {
            true if value <= 0.0 => 0.5 * share,
            true => share + (1.0 - share) * (value.log10() - self.low) / (self.high - self.low),
            false => (value - self.low) / (self.high - self.low),
        }
    }

    /// Place where the axis is broken between zero and the rest.
    pub fn zero_break(&self) -> Option<f64> {
        (self.log && self.zero).then_some(ZERO_SHARE)
    }

    /// Ticks, at most about `most` of them with numbers.
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        let tick = |value: f64, label: String| Tick { at: self.at(value), label };
        let mut ticks: Vec<Tick> = if self.log {
            let label = |value: f64, step: Option<f64>| step.map_or(String::new(), |step| number(value, step));
            self.log_values(most).into_iter().map(|(value, step)| tick(value, label(value, step))).collect()
        } else {
            let step = nice_step(self.high - self.low, most);
            steps(self.low, self.high, step).map(|value| tick(value, number(value, step))).collect()
        };
        if self.zero {
            ticks.push(tick(0.0, "0".to_owned()));
        }
        ticks
    }

    /// Powers of ten, with 2 and 5 times these or even linear steps where the range is short; and of those that
    /// get numbers, the distance to the next that the number must tell.
    fn log_values(&self, most: usize) -> Vec<(f64, Option<f64>)> {
        let (low, high) = (10f64.powf(self.low), 10f64.powf(self.high));
        let (first, last) = (self.low.ceil() as i32, self.high.floor() as i32);
        if last - first >= 2 {
            let stride = ((last - first + 1) as usize).div_ceil(most.max(1)) as i32;
            let step = |e: i32| (e.rem_euclid(stride) == 0).then(|| decimal(1.0, e));
            return (first..=last).map(|e| (decimal(1.0, e), step(e))).collect();
        }
        let few = (first - 1..=last).flat_map(|e| [1.0, 2.0, 5.0].map(|m| (decimal(m, e), Some(decimal(1.0, e)))));
        let few: Vec<_> = few.filter(|(value, _)| (low..=high).contains(value)).collect();
        if few.len() >= 3 {
            return few;
        }
        let step = nice_step(high - low, most.min(5));
        steps(low, high, step).map(|value| (value, Some(step))).collect()
    }
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |extent, v| Some(extent.map_or((v, v), |(low, high): (f64, f64)| (low.min(v), high.max(v)))))
}

/// `mantissa` times ten to the `exponent`, as the nearest number to its decimal form.
fn decimal(mantissa: f64, exponent: i32) -> f64 {
    if exponent < 0 { mantissa / 10f64.powi(-exponent) } else { mantissa * 10f64.powi(exponent) }
}

/// 1, 2 or 5 times a power of ten, for at most `most` steps in `range`.
fn nice_step(range: f64, most: usize) -> f64 {
    let least = range / most.max(1) as f64;
    let exponent = least.log10().floor() as i32;
    let fits = |m: &f64| decimal(*m, exponent) >= least;
    decimal([1.0, 2.0, 5.0].into_iter().find(fits).unwrap_or(10.0), exponent)
}

/// Multiples of `step` from `low` to `high`.
fn steps(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = ((low / step).ceil(), (high / step + 1e-9).floor());
    (0..=(last - first).max(0.0) as usize).map(move |k| (first + k as f64) * step)
}

/// A tick's number, with as many digits as tell it from the next at distance `step`.
fn number(value: f64, step: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    // A hair more, for powers of ten that are not exact.
    let exponent = |v: f64| (v.abs().log10() + 1e-9).floor() as i32;
    let (e, digits) = (exponent(value), exponent(value) - exponent(step));
    if (-3..5).contains(&e) || (-3..7).contains(&e) && digits > 3 {
        return format!("{value:.*}", (-exponent(step)).max(0) as usize);
    }
    let mantissa = format!("{:.*}", digits.max(0) as usize, value / 10f64.powi(e));
    match mantissa.as_str() {
        "1" => format!("10{}", superscript(e)),
        _ => format!("{mantissa}×10{}", superscript(e)),
    }
}

fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    exponent.to_string().chars().map(|c| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])).collect()
}
