//! Values of the command line that have a syntax of their own.

use std::str::FromStr;
use std::time::Duration;

use domelight_lab::job::value::BadValue;

fn bad(text: &str, expected: &'static str) -> BadValue {
    BadValue::new(text, expected)
}

/// A span of time: `90`, `30s`, `500ms`, `5m` or `2h`.
pub(crate) fn duration(s: &str) -> Result<Duration, BadValue> {
    let digits = s.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(s.len());
    let (number, unit) = s.split_at(digits);
    let unit = match unit {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => f64::NAN,
    };
    let seconds = number.trim().parse::<f64>().unwrap_or(f64::NAN) * unit;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() => Ok(duration),
        _ => Err(bad(s, "a duration such as 30s, 500ms, 5m or 2h")),
    }
}

/// Shard k of n, `K/N` with K from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) k: usize,
    pub(crate) n: usize,
}

impl FromStr for Shard {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let parts = s.split_once('/').and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((k, n)) if k < n => Ok(Self { k, n }),
            _ => Err(bad(s, "a shard such as 0/8: K/N with K from 0 to N - 1")),
        }
    }
}

/// Tiles from the first to the last, `A-B` or `A`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tiles {
    pub(crate) first: usize,
    pub(crate) last: usize,
}

impl FromStr for Tiles {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let (first, last) = s.split_once('-').unwrap_or((s, s));
        match (first.parse(), last.parse()) {
            (Ok(first), Ok(last)) if first <= last => Ok(Self { first, last }),
            _ => Err(bad(s, "tiles such as 0-15, first and last, counted from 0")),
        }
    }
}

/// Frames from the first to the last, `A-B` or `A`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frames {
    pub(crate) first: u32,
    pub(crate) last: u32,
}

impl FromStr for Frames {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let (first, last) = s.split_once('-').unwrap_or((s, s));
        match (first.parse(), last.parse()) {
            (Ok(first), Ok(last)) if first <= last => Ok(Self { first, last }),
            (Ok(first), Ok(last)) if first > last => {
                Err(bad(s, "frames in rising order, such as 0-11"))
            }
            _ => Err(bad(s, "frames such as 0-11, first and last, counted from 0")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_and_bad_values() {
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("500ms"), duration("0.5"));
        assert!(
            ["", "s", "0s", "-1s", "3 d", "nan", "1e999h"].iter().all(|s| duration(s).is_err())
        );
        assert_eq!("0/8".parse(), Ok(Shard { k: 0, n: 8 }));
        assert!(["8/8", "1", "-1/8", "0/0"].iter().all(|s| s.parse::<Shard>().is_err()));
        assert_eq!("3-5".parse(), Ok(Tiles { first: 3, last: 5 }));
        assert_eq!("7".parse(), Ok(Tiles { first: 7, last: 7 }));
        assert!(["5-3", "-", "a-b"].iter().all(|s| s.parse::<Tiles>().is_err()));
        assert_eq!("3-5".parse(), Ok(Frames { first: 3, last: 5 }));
        assert!(["5-3", "-1", "a"].iter().all(|s| s.parse::<Frames>().is_err()));
    }
}
