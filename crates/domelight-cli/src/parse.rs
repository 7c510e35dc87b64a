//! Values of the command line that have a syntax of their own.

use std::str::FromStr;
use std::time::Duration;

use domelight::math::{Vec3, vec3};

/// A value that could not be read, and what it should look like.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not {expected}")]
pub(crate) struct BadValue {
    text: String,
    expected: &'static str,
}

fn bad(text: &str, expected: &'static str) -> BadValue {
    BadValue { text: text.to_owned(), expected }
}

/// A picture's size, `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Size {
    /// The longest edge of a picture.
    const MOST: usize = 65_536;

    /// The most pixels of a picture, whose sums take some 120 bytes each.
    const MOST_PIXELS: usize = 1 << 28;
}

impl FromStr for Size {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let expected = "a size such as 800x600, each from 1 to 65536, with at most 2^28 pixels";
        let (w, h) = s.split_once(['x', 'X']).ok_or_else(|| bad(s, expected))?;
        match (w.parse(), h.parse()) {
            (Ok(width), Ok(height))
                if (1..=Self::MOST).contains(&width)
                    && (1..=Self::MOST).contains(&height)
                    && width * height <= Self::MOST_PIXELS =>
            {
                Ok(Self { width, height })
            }
            _ => Err(bad(s, expected)),
        }
    }
}

/// A point or a direction, `X,Y,Z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Triple(pub(crate) Vec3);

impl FromStr for Triple {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let expected = "three numbers such as 0,1.5,-4";
        let numbers: Result<Vec<f32>, _> = s.split(',').map(|x| x.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => {
                Ok(Self(vec3(x, y, z)))
            }
            _ => Err(bad(s, expected)),
        }
    }
}

/// How an environment is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rotation {
    /// So that its key light falls on what the camera sees.
    Auto,
    /// By an angle.
    Degrees(f32),
}

impl Rotation {
    /// The angle, if one was given.
    pub(crate) fn degrees(self) -> Option<f32> {
        match self {
            Self::Auto => None,
            Self::Degrees(degrees) => Some(degrees),
        }
    }
}

impl FromStr for Rotation {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        if s == "auto" {
            return Ok(Self::Auto);
        }
        match s.parse::<f32>() {
            Ok(degrees) if degrees.is_finite() => Ok(Self::Degrees(degrees)),
            _ => Err(bad(s, "an angle in degrees or auto")),
        }
    }
}

/// Samples of the environment and of the BRDF, `M:N`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Split {
    pub(crate) environment: u32,
    pub(crate) brdf: u32,
}

impl FromStr for Split {
    type Err = BadValue;

    fn from_str(s: &str) -> Result<Self, BadValue> {
        let expected = "a split such as 3:1 (environment:BRDF samples, not both zero, up to 65536)";
        let parts = s.split_once(':').and_then(|(m, n)| Some((m.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((environment, brdf)) if (1..=65_536u32).contains(&u32::max(environment, brdf)) => {
                Ok(Self { environment, brdf })
            }
            _ => Err(bad(s, expected)),
        }
    }
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

/// A finite number that is not negative.
pub(crate) fn not_negative(s: &str) -> Result<f32, BadValue> {
    match s.parse::<f32>() {
        Ok(x) if x.is_finite() && x >= 0.0 => Ok(x),
        Ok(x) if x == f32::INFINITY => Err(bad(s, "a number up to 3.4e38")),
        _ => Err(bad(s, "a number that is not negative")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_and_bad_values() {
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
        assert!(
            ["", "640", "0x1", "1x65537", "ax3", "65536x65536"]
                .iter()
                .all(|s| s.parse::<Size>().is_err())
        );
        assert_eq!("1, -2,3e1".parse(), Ok(Triple(vec3(1.0, -2.0, 30.0))));
        assert!(["1,2", "1,2,nan", "a,b,c"].iter().all(|s| s.parse::<Triple>().is_err()));
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
        assert_eq!("auto".parse(), Ok(Rotation::Auto));
        assert_eq!("-30".parse(), Ok(Rotation::Degrees(-30.0)));
        assert!(["", "x", "inf"].iter().all(|s| s.parse::<Rotation>().is_err()));
        assert_eq!("3:1".parse(), Ok(Split { environment: 3, brdf: 1 }));
        assert!(["0:0", "1", "-1:2", "1:2:3"].iter().all(|s| s.parse::<Split>().is_err()));
    }
}
