//! Converts scene-linear radiance for display: exposure, tone curve, sRGB encoding.

use super::agx::{self, rows};
use crate::Rgb;
use crate::math::{Vec3, functions};
use std::str::FromStr;

/// A curve that maps radiance to the range of a display. All curves map linear Rec. 709 to linear Rec. 709.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneCurve {
    /// No curve: values outside \[0, 1\] are clipped, and others are unchanged, so that pictures can be compared.
    /// Blender's view Standard.
    #[default]
    Standard,
    /// c / (1 + Y), where Y is the luminance: Reinhard et al. 2002, "Photographic Tone Reproduction for Digital
    /// Images", equation 3, without the key, which the exposure replaces.
    Reinhard,
    /// The ACES 1.0 reference and sRGB output transforms as fitted by Stephen Hill (2016, in "BakingLab" of Pettineo
    /// and Neubelt).
    Aces,
    /// AgX with the base look, as in Blender since version 4.0.
    Agx,
    /// Khronos PBR Neutral (2024): keeps colors up to 0.8, for true-to-life base colors.
    Neutral,
}

/// No tone curve has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown tone curve {name:?}; known are {}", ToneCurve::ALL.map(ToneCurve::name).join(", "))]
pub struct UnknownToneCurve {
    /// The given name.
    pub name: String,
}

impl ToneCurve {
    /// All curves.
    pub const ALL: [Self; 5] =
        [Self::Standard, Self::Reinhard, Self::Aces, Self::Agx, Self::Neutral];

    /// The name that [`FromStr`] parses.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Reinhard => "reinhard",
            Self::Aces => "aces",
            Self::Agx => "agx",
            Self::Neutral => "neutral",
        }
    }

    /// An alternative name that [`FromStr`] parses.
    pub const fn alias(self) -> Option<&'static str> {
        match self {
            Self::Standard => Some("srgb"),
            Self::Reinhard | Self::Aces | Self::Agx | Self::Neutral => None,
        }
    }

    /// Maps exposed radiance to linear display light in \[0, 1\]. Negative and NaN values count as 0.
    pub fn apply(self, radiance: Rgb) -> Rgb {
        self.apply_with(radiance, agx::shaped)
    }

    /// As [`Self::apply`]; `shape` is [`agx::shaped`], or quicker and nearly the same.
    pub(super) fn apply_with(self, radiance: Rgb, shape: impl Fn(f32) -> f32) -> Rgb {
        let c = radiance.map(|c| f32::min(c.max(0.0), 1e30));
        let shown = match self {
            Self::Standard => c,
            Self::Reinhard => c / (1.0 + c.luminance()),
            Self::Aces => aces(c),
            Self::Agx => agx::agx(c, shape),
            Self::Neutral => neutral(c),
        };
        shown.map(|c| c.clamp(0.0, 1.0))
    }
}

impl FromStr for ToneCurve {
    type Err = UnknownToneCurve;

    fn from_str(name: &str) -> Result<Self, UnknownToneCurve> {
        let found =
            Self::ALL.into_iter().find(|curve| curve.name() == name || curve.alias() == Some(name));
        found.ok_or_else(|| UnknownToneCurve { name: name.to_owned() })
    }
}

impl std::fmt::Display for ToneCurve {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

/// An exposure followed by a tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToneMapping {
    /// The exposure \[stops\]: radiance is multiplied by 2^exposure.
    pub exposure: f32,
    /// The curve, applied after the exposure.
    pub curve: ToneCurve,
}

impl ToneMapping {
    /// Maps radiance to linear display light in \[0, 1\].
    pub fn apply(&self, radiance: Rgb) -> Rgb {
        self.curve.apply(radiance * functions::exp2(self.exposure))
    }
}

/// The sRGB encoding of linear light in \[0, 1\] (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * functions::powf(linear, 1.0 / 2.4) - 0.055
    }
}

/// The linear light of an sRGB value in \[0, 1\].
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        functions::powf((encoded + 0.055) / 1.055, 2.4)
    }
}

fn aces(c: Rgb) -> Rgb {
    let to_ap1_with_saturation =
        rows([0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]);
    let to_rec709 = rows(
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    );
    // The fit is a quotient of squares: beyond this it is constant to f32.
    let v = to_ap1_with_saturation * Vec3::from(c.to_array()).min(Vec3::splat(1e9));
    let numerator = v * (v + 0.024_578_6) - 0.000_090_537;
    let denominator = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    Rgb::from((to_rec709 * (numerator / denominator)).to_array())
}

fn neutral(c: Rgb) -> Rgb {
    let (start, desaturation) = (0.8 - 0.04, 0.15);
    // Fresnel reflection of 4 % off dielectrics is taken out.
    let least = c.min_component();
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let c = c - Rgb::splat(offset);
    let peak = c.max_component();
    if peak < start {
        return c;
    }
    let room = 1.0 - start;
    let new_peak = 1.0 - room * room / (peak + room - start);
    let toward_white = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    (c * (new_peak / peak)).lerp(Rgb::splat(new_peak), toward_white)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_stay_on_the_screen_and_rise() {
        for curve in ToneCurve::ALL {
            assert_eq!(curve.name().parse(), Ok(curve));
            let mut last = 0.0;
            for stop in -80..=80 {
                let shown = curve.apply(Rgb::splat(f32::exp2(stop as f32 * 0.25)));
                assert!(
                    shown.is_finite()
                        && shown.min_component() >= 0.0
                        && shown.max_component() <= 1.0
                );
                // Rounding in the matrices may take a part in a million back.
                assert!(shown.g >= last - 2e-6, "{curve} falls at {stop}: {last} {}", shown.g);
                last = shown.g;
            }
            assert!(last > 0.95, "{curve} ends at {last}");
            for odd in [f32::NAN, -1.0, f32::INFINITY, f32::MAX] {
                assert!(curve.apply(Rgb::new(odd, 0.5, 0.0)).is_finite(), "{curve} of {odd}");
            }
        }
        assert!("Filmic".parse::<ToneCurve>().is_err());
        assert_eq!("srgb".parse(), Ok(ToneCurve::Standard));
    }

    #[test]
    fn published_values() {
        // PBR Neutral: base colors pass through with the reflection of 4 % added.
        let neutral = ToneCurve::Neutral.apply(Rgb::new(0.54, 0.34, 0.14));
        assert!((neutral - Rgb::new(0.5, 0.3, 0.1)).map(f32::abs).max_component() < 1e-6);
        // Middle gray of AgX stays middle gray.
        let gray = ToneCurve::Agx.apply(Rgb::splat(0.18));
        assert!((gray - Rgb::splat(0.18)).map(f32::abs).max_component() < 1e-6, "{gray:?}");
        assert_eq!(ToneCurve::Reinhard.apply(Rgb::splat(1.0)).g, 0.5);
    }

    #[test]
    fn srgb_encoding_is_the_inverse_of_decoding() {
        for byte in 0..=255u8 {
            let encoded = f32::from(byte) / 255.0;
            let again = srgb_from_linear(linear_from_srgb(encoded));
            assert_eq!((again * 255.0).round() as u8, byte);
        }
        let two_stops = ToneMapping { exposure: 2.0, curve: ToneCurve::Standard };
        assert_eq!(two_stops.apply(Rgb::splat(0.125)).r, 0.5);
    }
}
