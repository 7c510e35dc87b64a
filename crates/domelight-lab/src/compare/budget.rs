//! The budget of the strategies in a comparison.

use std::fmt;
use std::str::FromStr;

/// The budget of each picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Camera samples per pixel.
    Samples(u32),
    /// Shadow rays traced per pixel that the scene covers.
    Rays(f64),
    /// CPU seconds of rendering.
    Time(f64),
}

/// A text that is not a valid budget.
#[derive(Debug, thiserror::Error)]
#[error("'{0}' is not rays:N, time:T (such as 2s, 500ms, 1m) or spp:N, all above 0")]
pub struct BadBudget(String);

/// The most camera samples of a pixel.
pub(super) const MOST_SAMPLES: u32 = 1 << 24;

impl FromStr for Budget {
    type Err = BadBudget;

    fn from_str(text: &str) -> Result<Self, BadBudget> {
        let budget = text.split_once(':').and_then(|(kind, value)| match kind {
            "spp" => {
                value.parse().ok().filter(|n| (1..=MOST_SAMPLES).contains(n)).map(Self::Samples)
            }
            "rays" => positive(value, 1.0).map(Self::Rays),
            "time" => seconds(value).map(Self::Time),
            _ => None,
        });
        budget.ok_or_else(|| BadBudget(text.to_owned()))
    }
}

/// A duration with its unit; bare numbers are seconds.
pub(super) fn seconds(text: &str) -> Option<f64> {
    let units = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("", 1.0)];
    units.iter().find_map(|(unit, scale)| positive(text.strip_suffix(unit)?, *scale))
}

fn positive(text: &str, scale: f64) -> Option<f64> {
    let value = text.parse::<f64>().ok()? * scale;
    (value > 0.0 && value <= 1e9).then_some(value)
}

impl fmt::Display for Budget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Samples(n) => write!(f, "spp:{n}"),
            Self::Rays(n) => write!(f, "rays:{n}"),
            Self::Time(seconds) => write!(f, "time:{seconds}s"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_and_bad_budgets() {
        for (text, budget) in [
            ("spp:16", Budget::Samples(16)),
            ("rays:64", Budget::Rays(64.0)),
            ("rays:2.5", Budget::Rays(2.5)),
            ("time:2s", Budget::Time(2.0)),
            ("time:2", Budget::Time(2.0)),
            ("time:500ms", Budget::Time(0.5)),
            ("time:1.5m", Budget::Time(90.0)),
        ] {
            assert_eq!(text.parse::<Budget>().ok(), Some(budget), "{text}");
        }
        for text in [
            "",
            "64",
            "rays",
            "rays:",
            "rays:0",
            "rays:-1",
            "rays:nan",
            "rays:inf",
            "spp:1.5",
            "spp:0",
            "spp:16777217",
            "time:s",
            "time:2 s",
            "time:2d",
            "lights:4",
        ] {
            assert!(text.parse::<Budget>().is_err(), "{text}");
        }
    }
}
