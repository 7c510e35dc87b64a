//! Values of the command line that have a syntax of their own.

use std::str::FromStr;

use domelight::bsdf::{MaterialSpec, ParseMaterialError};
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
        let expected = "a size such as 800x600, each from 1 to 65536, of 2^28 pixels at the most";
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

/// A material in the notation of `--material`, and the text that it was given as.
#[derive(Clone, Debug)]
pub(crate) struct NamedMaterial {
    pub(crate) text: String,
    pub(crate) spec: MaterialSpec,
}

impl FromStr for NamedMaterial {
    type Err = ParseMaterialError;

    fn from_str(s: &str) -> Result<Self, ParseMaterialError> {
        Ok(Self { text: s.to_owned(), spec: s.parse()? })
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

/// A finite number that is not negative.
pub(crate) fn not_negative(s: &str) -> Result<f32, BadValue> {
    match s.parse::<f32>() {
        Ok(x) if x.is_finite() && x >= 0.0 => Ok(x),
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
        assert_eq!("3:1".parse(), Ok(Split { environment: 3, brdf: 1 }));
        assert!(["0:0", "1", "-1:2", "1:2:3"].iter().all(|s| s.parse::<Split>().is_err()));
    }
}
