//! Positions and labels of ticks.

use super::Scale;
use super::text::{LOWER, RAISE};

/// The ticks of an axis, in the coordinate in which the axis is even.
#[derive(Debug, Clone, Default)]
pub(super) struct Ticks {
    /// Position and label of each.
    pub major: Vec<(f64, String)>,
    /// Positions without labels, between the others.
    pub minor: Vec<f64>,
}

impl Ticks {
    /// At most about `count` ticks in a range given in the even coordinate.
    pub(super) fn new(scale: Scale, range: (f64, f64), count: usize) -> Self {
        match scale {
            Scale::Linear => linear(range, count),
            Scale::Logarithmic => logarithmic(range, count),
        }
    }
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear((low, high): (f64, f64), count: usize) -> Ticks {
    let (multiples, step) = multiples(low, high, count);
    let values: Vec<f64> = multiples.iter().map(|&k| round_product(k, step)).collect();
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let exponent = leading(largest);
    // Beyond these bounds zeros would outnumber the digits.
    let scientific = !(-4..6).contains(&exponent);
    let label = |value: f64| {
        if value == 0.0 {
            "0".to_owned()
        } else if scientific {
            let decimals = (exponent - step.exponent).max(0) as usize;
            let mantissa = value / power(exponent);
            format!("{}×{}", number(mantissa, decimals), power_label(exponent))
        } else {
            number(value, (-step.exponent).max(0) as usize)
        }
    };
    Ticks { major: values.iter().map(|&v| (v, label(v))).collect(), minor: Vec::new() }
}

/// Powers of ten; 1, 2, 5 between them where fewer than two would fit; else even steps.
fn logarithmic((low, high): (f64, f64), count: usize) -> Ticks {
    // Rounding of log10 must not lose a tick at the very end.
    let slack = 1e-9;
    let first = (low - slack).ceil() as i32;
    let last = (high + slack).floor() as i32;
    if last > first {
        let decades = (last - first) as usize + 1;
        let stride = decades.div_ceil(count.max(2)).max(1);
        let major: Vec<(f64, String)> = (first..=last)
            .filter(|k| k.rem_euclid(stride as i32) == 0 || (stride == 1))
            .map(|k| (f64::from(k), power_label(k)))
            .collect();
        let minor = if stride > 1 {
            (first..=last).map(f64::from).collect()
        } else if decades <= 10 {
            between(first, last, low - slack, high + slack, &[2, 3, 4, 5, 6, 7, 8, 9])
                .map(|(position, _, _)| position)
                .collect()
        } else {
            Vec::new()
        };
        if major.len() > 1 {
            return Ticks { major, minor };
        }
    }
    let label = |digit: i32, k: i32| match k {
        -3..=-1 => number(f64::from(digit) * power(k), k.unsigned_abs() as usize),
        0..=4 => number(f64::from(digit) * power(k), 0),
        _ if digit == 1 => power_label(k),
        _ => format!("{digit}×{}", power_label(k)),
    };
    let major: Vec<(f64, String)> = between(first, last, low - slack, high + slack, &[1, 2, 5])
        .map(|(position, digit, k)| (position, label(digit, k)))
        .collect();
    if (3..=count.max(3)).contains(&major.len()) {
        let all = [2, 3, 4, 5, 6, 7, 8, 9];
        let minor = between(first, last, low - slack, high + slack, &all).map(|(p, _, _)| p);
        return Ticks { major, minor: minor.collect() };
    }
    let mut even = linear((10f64.powf(low), 10f64.powf(high)), count);
    even.major.retain(|(value, _)| *value > 0.0);
    for (position, _) in &mut even.major {
        *position = position.log10();
    }
    even
}

/// Multiples of powers of ten in a logarithmic range: position, digit, exponent.
fn between(first: i32, last: i32, low: f64, high: f64, digits: &[i32]) -> impl Iterator<Item = (f64, i32, i32)> {
    (first - 1..=last)
        .flat_map(move |k| digits.iter().map(move |&digit| (digit, k)))
        .map(|(digit, k)| (f64::from(digit).log10() + f64::from(k), digit, k))
        .filter(move |(position, _, _)| (low..=high).contains(position))
}

/// A step: `digit` · 10^`exponent`.
#[derive(Debug, Clone, Copy)]
struct Step {
    digit: f64,
    exponent: i32,
}

/// The integers k with k·step in the range, for the smallest step that gives at most `count`.
fn multiples(low: f64, high: f64, count: usize) -> (Vec<f64>, Step) {
    let count = count.max(2);
    let mut exponent = leading((high - low) / count as f64);
    loop {
        for digit in [1.0, 2.0, 5.0] {
            let size = digit * power(exponent);
            // A tick within a thousandth of a step of the end belongs to the range.
            let first = (low / size - 1e-3).ceil();
            let last = (high / size + 1e-3).floor();
            if last - first < count as f64 {
                let ticks = (last - first).max(0.0) as usize + 1;
                let multiples = (0..ticks).map(|k| first + k as f64).collect();
                return (multiples, Step { digit, exponent });
            }
        }
        exponent += 1;
    }
}

/// k·step with one rounding only, so that 3 · 0.1 is 0.3.
fn round_product(multiple: f64, step: Step) -> f64 {
    let integer = multiple * step.digit;
    if (-22..0).contains(&step.exponent) {
        // Powers of ten up to 10²² are exact, negative ones are not: divide.
        integer / power(-step.exponent)
    } else {
        integer * power(step.exponent)
    }
}

/// Exponent of the leading decimal digit; 0 for zero.
fn leading(value: f64) -> i32 {
    if value > 0.0 { (value.log10() + 1e-12).floor() as i32 } else { 0 }
}

fn power(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

/// A number with a true minus sign.
fn number(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "−")
}

/// 10 with a raised exponent.
fn power_label(exponent: i32) -> String {
    let exponent = number(f64::from(exponent), 0);
    format!("10{RAISE}{exponent}{LOWER}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, low: f64, high: f64, count: usize) -> Vec<String> {
        let ticks = Ticks::new(scale, (low, high), count);
        ticks.major.into_iter().map(|(_, label)| label.replace(RAISE, "^").replace(LOWER, "")).collect()
    }

    #[test]
    fn linear_ticks_read_as_people_write_them() {
        let ticks = |low, high| labels(Scale::Linear, low, high, 6);
        assert_eq!(ticks(0.0, 0.5), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(ticks(-1.1, 1.1), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(ticks(0.0, 2.5e-7)[1], "0.5×10^−7");
        assert_eq!(ticks(0.0, 4e6)[1], "1×10^6");
        assert_eq!(ticks(1.0001, 1.0003).len(), 5);
        for (low, high) in [(0.0, 1e-300), (-1e300, 1e300), (1e8, 1e8 + 1.0)] {
            assert!(ticks(low, high).len() >= 2, "{low} {high}");
        }
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        let ticks = |low: f64, high: f64| labels(Scale::Logarithmic, low, high, 6);
        assert_eq!(ticks(-3.2, 0.1), ["10^−3", "10^−2", "10^−1", "10^0"]);
        assert_eq!(ticks(-12.0, 0.0), ["10^−12", "10^−9", "10^−6", "10^−3", "10^0"]);
        assert_eq!(ticks(0.9, 1.8), ["10", "20", "50"]);
        assert_eq!(ticks(-4.8, -3.9), ["2×10^−5", "5×10^−5", "10^−4"]);
        assert_eq!(ticks(0.0, 0.1), ["1.00", "1.05", "1.10", "1.15", "1.20", "1.25"]);
    }
}
