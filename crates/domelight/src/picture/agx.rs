//! AgX as in Blender since version 4.0: the base look of Sobotka 2022 in the Rec. 2020 form of Chow 2023.
//!
//! A matrix (the inset) moves colors toward gray, a sigmoid over 16.5 stops shapes each channel, part of the hue shift
//! that this causes is reverted, and a second matrix (the outset) restores purity. Colors outside Rec. 709 are mapped
//! into it at nearly constant luminance. Blender tabulates this in a cube of 57³ values; here the formulas are
//! evaluated directly.

use crate::Rgb;
use crate::math::{Mat3, Vec3, functions};

/// Stops below and above middle gray that the sigmoid shows.
const DARKEST: f32 = -10.0;
const BRIGHTEST: f32 = 6.5;
const MIDDLE_GRAY: f32 = 0.18;

/// Exponent of the encoding in which the sigmoid works.
const GAMMA: f32 = 2.4;

/// The sigmoid's slope at middle gray.
const SLOPE: f32 = 2.4;

/// The sigmoid's scale below and above middle gray: what lets it end at (0, 0) and (1, 1) with exponents of 1.5.
const TOE: f32 = 0.565_675_6;
const SHOULDER: f32 = 0.715_198_3;

/// The part of a channel-wise curve's hue shift that stays; without any, bright fire would turn pink.
const HUE_SHIFT: f32 = 0.4;

/// The CIE 2015 luminance of Rec. 709's primaries.
const LUMINANCE: Vec3 = Vec3::new(0.206_773_8, 0.658_129_8, 0.135_096_4);

/// Linear light on the screen, in \[0, 1\] but for rounding, of light that is neither negative nor NaN; `shape` is
/// [`shaped`], or quicker and nearly the same.
pub(super) fn agx(light: Rgb, shape: impl Fn(f32) -> f32) -> Rgb {
    // From Rec. 709 to Rec. 2020, then the inset.
    let toward_gray = rows(
        [0.544_814_75, 0.373_787_4, 0.081_397_855],
        [0.140_416_95, 0.754_137_56, 0.105_445_5],
        [0.088_810_42, 0.178_871_76, 0.732_317_8],
    );
    // The inverse of a similar inset, then from Rec. 2020 to Rec. 709.
    let from_gray = rows(
        [1.964_887_4, -0.855_988_5, -0.108_898_92],
        [-0.299_313_37, 1.326_398, -0.027_084_6],
        [-0.164_352_74, -0.238_183_97, 1.402_536_7],
    );
    let inside = toward_gray * Vec3::from(light.to_array());
    let formed = with_hue_of(inside.map(shape), inside);
    Rgb::from(into_gamut(from_gray * formed).to_array())
}

/// The matrix with these rows.
pub(super) fn rows(r: [f32; 3], g: [f32; 3], b: [f32; 3]) -> Mat3 {
    Mat3::from_cols(r.into(), g.into(), b.into()).transpose()
}

/// The curve of one channel, from light to light on the screen.
pub(super) fn shaped(light: f32) -> f32 {
    let stops = functions::log2(light.max(1e-10) / MIDDLE_GRAY).clamp(DARKEST, BRIGHTEST);
    let pivot = -DARKEST / (BRIGHTEST - DARKEST);
    let from_pivot = SLOPE * ((stops - DARKEST) / (BRIGHTEST - DARKEST) - pivot);
    let scale = if from_pivot < 0.0 { -TOE } else { SHOULDER };
    let u = from_pivot / scale;
    let bent = u / functions::powf(1.0 + u * u.sqrt(), 1.0 / 1.5);
    let encoded = scale * bent + functions::powf(MIDDLE_GRAY, 1.0 / GAMMA);
    functions::powf(encoded.max(0.0), GAMMA)
}

/// Least and largest light that [`shaped`] distinguishes from black and white.
#[cfg(feature = "io")]
pub(super) fn range() -> (f32, f32) {
    (MIDDLE_GRAY * functions::exp2(DARKEST), MIDDLE_GRAY * functions::exp2(BRIGHTEST))
}

/// Takes part of the way back to the hue before the curve. The curve rises, so the order of the channels, and with it
/// the sextant of the hue, is the same before and after: the hue is where the middle channel lies between the others.
fn with_hue_of(formed: Vec3, before: Vec3) -> Vec3 {
    let [least, greatest] = [before.min_element(), before.max_element()];
    let [formed_least, formed_greatest] = [formed.min_element(), formed.max_element()];
    let (range, formed_range) = (greatest - least, formed_greatest - formed_least);
    // Gray has no hue.
    if range <= 0.0 || formed_range <= 0.0 {
        return formed;
    }
    // At the ends both are 0 or both 1, so that the outer channels stay.
    let hue = (before - least) / range;
    let formed_hue = (formed - formed_least) / formed_range;
    formed_least + formed_range * hue.lerp(formed_hue, HUE_SHIFT)
}

/// Adds gray until no channel is negative, and dims the sum to about the luminance of the color before.
fn into_gamut(color: Vec3) -> Vec3 {
    let below = -color.min_element();
    if below <= 0.0 {
        return color;
    }
    let luminance = LUMINANCE.dot(color).max(0.0);
    let raised = luminance + below;
    // Dark colors count by their purity as well, which the offset takes.
    let purity = |luminance: f32| 1.0 - functions::powf(luminance, 0.08).min(1.0);
    let wanted = luminance + purity(luminance) * raised;
    let found = raised + purity(raised) * raised;
    (color + below) * (wanted / found).min(1.0)
}
