//! The exposure of pictures for display.

use crate::RgbImage;
use crate::math::functions;
use std::str::FromStr;

/// The luminance to which automatic exposure maps the median.
pub const MIDDLE_GRAY: f32 = 0.18;

/// An exposure, or the rule that chooses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Maps the median luminance over the covered pixels to [`MIDDLE_GRAY`].
    Auto,
    /// A number of stops: radiance times 2^stops.
    Stops(f32),
}

/// Not `auto` and not a number of stops.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is neither auto nor a finite number of stops")]
pub struct BadExposure {
    /// The given text.
    pub text: String,
}

impl Exposure {
    /// The exposure of a picture \[stops\], rounded to hundredths if it is automatic, so that it can be typed.
    ///
    /// `coverage` has one value per pixel, and pixels with a value above 0 count. All pixels count if it is `None` or
    /// nothing is covered. Black and non-finite pixels do not count; if there are no others, the exposure is 0.
    ///
    /// # Panics
    /// If `coverage` has fewer values than the picture has pixels.
    pub fn stops(self, image: &RgbImage, coverage: Option<&[f32]>) -> f32 {
        if let Self::Stops(stops) = self {
            return stops;
        }
        let coverage = coverage.filter(|coverage| coverage.iter().any(|&c| c > 0.0));
        let counts = |i: usize| coverage.is_none_or(|coverage| coverage[i] > 0.0);
        let counted = image.pixels.iter().enumerate().filter(|(i, _)| counts(*i));
        let mut luminances: Vec<f32> = counted.map(|(_, pixel)| pixel.luminance()).collect();
        luminances.retain(|luminance| luminance.is_finite() && *luminance > 0.0);
        if luminances.is_empty() {
            return 0.0;
        }
        let middle = luminances.len() / 2;
        let (_, median, _) = luminances.select_nth_unstable_by(middle, f32::total_cmp);
        rounded(functions::log2(MIDDLE_GRAY / *median))
    }
}

/// An exposure \[stops\] in hundredths, so that it can be typed, and within ±30.
pub(crate) fn rounded(stops: f32) -> f32 {
    const RANGE: f32 = 30.0;
    // No minus before a zero.
    (stops.clamp(-RANGE, RANGE) * 100.0).round() / 100.0 + 0.0
}

impl FromStr for Exposure {
    type Err = BadExposure;

    fn from_str(text: &str) -> Result<Self, BadExposure> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let stops = text.parse().ok().filter(|stops: &f32| stops.is_finite());
        stops.map(Self::Stops).ok_or_else(|| BadExposure { text: text.to_owned() })
    }
}

impl std::fmt::Display for Exposure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.pad("auto"),
            Self::Stops(stops) => write!(f, "{stops}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;

    fn row(luminances: &[f32]) -> RgbImage {
        let pixels = luminances.iter().map(|&y| Rgb::splat(y)).collect();
        RgbImage::new(luminances.len(), 1, pixels)
    }

    #[test]
    fn the_median_becomes_middle_gray() {
        let sun = row(&[0.09, 0.09, 0.09, 1e6, 0.0, f32::NAN, f32::INFINITY]);
        assert_eq!(Exposure::Auto.stops(&sun, None), 1.0);
        assert_eq!(Exposure::Stops(-2.5).stops(&sun, None), -2.5);
        let covered = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0];
        assert_eq!(Exposure::Auto.stops(&sun, Some(&covered)), -22.41);
        // Nothing covered: all of it.
        assert_eq!(Exposure::Auto.stops(&sun, Some(&[0.0; 7])), 1.0);
        assert_eq!(Exposure::Auto.stops(&row(&[0.0, f32::NAN]), None), 0.0);
        assert_eq!(Exposure::Auto.stops(&row(&[1e-30]), None), 30.0);
        let black: RgbImage = row(&[0.0]);
        assert!(Exposure::Auto.stops(&black, None).is_sign_positive());
    }

    #[test]
    fn what_is_written_can_be_read() {
        for exposure in [Exposure::Auto, Exposure::Stops(-1.25), Exposure::Stops(0.0)] {
            assert_eq!(exposure.to_string().parse(), Ok(exposure));
        }
        for bad in ["", "Auto", "nan", "inf", "1 EV"] {
            assert!(bad.parse::<Exposure>().is_err(), "{bad}");
        }
    }
}
