//! Computes the cost of a target error from errors at increasing budgets.

use serde::{Deserialize, Serialize};

/// A picture's cost in seconds and its error.
pub(super) type Point = (f64, f64);

/// What an error costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cost {
    pub(super) seconds: f64,
    pub(super) fit: Fit,
}

/// How a cost was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Fit {
    /// Between two budgets whose errors lie on either side.
    Interpolated,
    /// Beyond the largest budget.
    Extrapolated,
    /// The least budget is good enough: an upper bound.
    AtMost,
}

/// The largest factor between the least error that was measured and one that is extrapolated.
const FARTHEST: f64 = 10.0;

/// The exponents of error over time that an extrapolation may have: never worse than N^-½, nor better
/// than N^-2.
const EXPONENTS: (f64, f64) = (-2.0, -0.5);

/// The cost of an error, along straight lines between the logarithms of `points`, which are in the order of
/// their budgets. `None` far beyond them.
pub(super) fn cost_of(error: f64, points: &[Point]) -> Option<Cost> {
    let (&first, &last) = (points.first()?, points.last()?);
    if first.1 <= error {
        return Some(Cost { seconds: first.0, fit: Fit::AtMost });
    }
    if let Some(pair) = points.windows(2).find(|pair| pair[1].1 <= error) {
        let seconds = along(pair[0], exponent(pair[0], pair[1]), error);
        return Some(Cost { seconds, fit: Fit::Interpolated });
    }
    if last.1 > FARTHEST * error {
        return None;
    }
    let steepness = match points {
        [.., before, last] => exponent(*before, *last),
        _ => -1.0,
    };
    // Noise may even let the error rise.
    let steepness = if steepness.is_finite() { steepness } else { -1.0 };
    let seconds = along(last, steepness.clamp(EXPONENTS.0, EXPONENTS.1), error);
    Some(Cost { seconds, fit: Fit::Extrapolated })
}

/// p of error ∝ seconds^p through two points.
fn exponent(a: Point, b: Point) -> f64 {
    (b.1 / a.1).ln() / (b.0 / a.0).ln()
}

/// Where that line has the error.
fn along(from: Point, exponent: f64, error: f64) -> f64 {
    from.0 * (error / from.1).powf(1.0 / exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(points: &[Point], error: f64, seconds: f64, fit: Fit) {
        let cost = cost_of(error, points).expect("a cost");
        assert!((cost.seconds / seconds - 1.0).abs() < 1e-9, "{cost:?}");
        assert_eq!(cost.fit, fit);
    }

    #[test]
    fn straight_lines_between_logarithms() {
        // error = 1e-2 / seconds, then 1e-2 / seconds².
        let points = [(1.0, 1e-2), (4.0, 2.5e-3), (8.0, 6.25e-4)];
        check(&points, 5e-3, 2.0, Fit::Interpolated);
        check(&points, 2.5e-3, 4.0, Fit::Interpolated);
        check(&points, 1.25e-3, 32f64.sqrt(), Fit::Interpolated);
        check(&points, 6.25e-4, 8.0, Fit::Interpolated);
    }

    #[test]
    fn what_was_not_measured_is_marked() {
        let points = [(1.0, 1e-2), (4.0, 2.5e-3)];
        check(&points, 2e-2, 1.0, Fit::AtMost);
        check(&points, 1.25e-3, 8.0, Fit::Extrapolated);
        check(&points[..1], 5e-3, 2.0, Fit::Extrapolated);
        assert!(cost_of(1e-4, &points).is_none(), "25 times less");
        assert!(cost_of(1e-4, &[]).is_none());
    }

    #[test]
    fn extrapolations_are_neither_steep_nor_flat() {
        check(&[(1.0, 1e-1), (2.0, 1e-3)], 2.5e-4, 4.0, Fit::Extrapolated);
        check(&[(1.0, 1.0), (2.0, 1.0)], 0.5, 8.0, Fit::Extrapolated);
        check(&[(1.0, 1.0), (2.0, 1.1)], 0.55, 8.0, Fit::Extrapolated);
        check(&[(1.0, 1.0), (1.0, 1.0)], 0.5, 2.0, Fit::Extrapolated);
    }

    #[test]
    fn the_first_crossing_counts() {
        let points = [(1.0, 4.0), (2.0, 1.0), (4.0, 2.0), (8.0, 0.5)];
        check(&points, 1.0, 2.0, Fit::Interpolated);
    }
}
