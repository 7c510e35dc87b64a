//! The ticks of an axis and their labels.

/// A tick on an axis; minor ticks have no label.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: Option<String>,
}

/// Multiples of 1, 2 or 5 times a power of ten within [min, max], about `n` of them.
pub(super) fn linear(min: f64, max: f64, n: usize) -> Vec<Tick> {
    let raw = (max - min) / n.max(1) as f64;
    if !raw.is_finite() || raw <= 0.0 {
        return Vec::new();
    }
    let power = 10f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= raw * 0.999).unwrap_or(10.0);
    let step = factor * power;
    let digits = (-step.log10().floor()).max(0.0) as usize;
    // Allow a thousandth of a step for rounding.
    let (first, last) = ((min / step - 1e-3).ceil() as i64, (max / step + 1e-3).floor() as i64);
    let tick = |i: i64| {
        let value = i as f64 * step;
        Tick { value, label: Some(minus(&format!("{value:.digits$}"))) }
    };
    (first..=last).map(tick).collect()
}

/// Powers of ten within [min, max], both positive, with minor ticks at their multiples. If fewer than two powers fit,
/// the multiples 2 and 5 also have labels.
pub(super) fn logarithmic(min: f64, max: f64) -> Vec<Tick> {
    if !(min > 0.0 && max.is_finite() && min <= max) {
        return Vec::new();
    }
    let (first, last) = (min.log10().floor() as i32, max.log10().ceil() as i32);
    let inside = |value: f64| value >= min * 0.9999 && value <= max * 1.0001;
    let n_powers = (first..=last).filter(|&k| inside(10f64.powi(k))).count();
    // Many decades do not all fit.
    let every = (last - first) as usize / 8 + 1;
    let plain = first >= -3 && last <= 4;
    let mut ticks = Vec::new();
    for k in first..=last {
        for digit in 1..10 {
            let value = f64::from(digit) * 10f64.powi(k);
            let labeled = match digit {
                1 => k.rem_euclid(every as i32) == 0,
                2 | 5 => n_powers < 2,
                _ => false,
            };
            if inside(value) && (digit == 1 || last - first <= 8) {
                ticks.push(Tick { value, label: labeled.then(|| power(digit, k, plain)) });
            }
        }
    }
    ticks
}

/// Formats digit · 10ᵏ, written out or as a power.
fn power(digit: i32, k: i32, plain: bool) -> String {
    if plain {
        let digits = (-k).max(0) as usize;
        return format!("{:.digits$}", f64::from(digit) * 10f64.powi(k));
    }
    let exponent = superscript(k);
    if digit == 1 { format!("10{exponent}") } else { format!("{digit}·10{exponent}") }
}

/// An integer in superscript digits.
pub fn superscript(k: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    };
    k.to_string().chars().map(raised).collect()
}

/// Replaces hyphens by true minus signs.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: Vec<Tick>) -> Vec<String> {
        ticks.into_iter().filter_map(|t| t.label).collect()
    }

    #[test]
    fn linear_marks_are_round_and_inside() {
        assert_eq!(labels(linear(0.0, 1.0, 5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(linear(-90.0, 90.0, 4)), ["−50", "0", "50"]);
        assert_eq!(labels(linear(0.0, 7.3, 4)), ["0", "2", "4", "6"]);
        assert_eq!(labels(linear(0.0, 0.03, 3)), ["0.00", "0.01", "0.02", "0.03"]);
        for n in 1..12 {
            for max in [1e-9, 0.77, 3.0, 1234.5, 1e12] {
                let ticks = linear(0.0, max, n);
                assert!(ticks.len() <= n + 1 && !ticks.is_empty(), "{n} {max}: {ticks:?}");
            }
        }
    }

    #[test]
    fn axes_without_a_length_have_no_marks() {
        assert!(linear(1.0, 1.0, 5).is_empty() && linear(0.0, f64::NAN, 5).is_empty());
        assert!(logarithmic(0.0, 1.0).is_empty() && logarithmic(1.0, f64::INFINITY).is_empty());
    }

    #[test]
    fn logarithmic_marks_are_powers_and_their_multiples() {
        assert_eq!(labels(logarithmic(0.01, 10.0)), ["0.01", "0.1", "1", "10"]);
        assert_eq!(labels(logarithmic(1.5, 60.0)), ["2", "5", "10", "20", "50"]);
        assert_eq!(labels(logarithmic(1e-5, 1e-3)), ["10⁻⁵", "10⁻⁴", "10⁻³"]);
        assert_eq!(logarithmic(1.0, 100.0).len(), 19);
        assert!(labels(logarithmic(1e-30, 1e30)).len() <= 9);
    }
}
