//! The error of a picture against its reference, as numbers and as a false-color picture.
//!
//! All sums are in f64 over linear radiance. relMSE divides by R² + 0.01, the regularizer that most
//! papers on sampling use, so that dark pixels do not dominate. The trimmed relMSE omits the worst
//! 0.1 % of the pixels, so that a few fireflies do not dominate either.

use super::tone::linear_from_srgb;
use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::functions;

/// Added to R² in the denominator of the relative error.
pub const REGULARIZER: f64 = crate::color::REGULARIZER;
/// Part of the pixels that the trimmed error keeps.
const KEPT: f64 = 0.999;

/// Two pictures cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the pictures differ in size: {}x{} against {}x{} of the reference",
    test.0, test.1, reference.0, reference.1
)]
pub struct SizeMismatch {
    /// The width and height of the picture.
    pub test: (usize, usize),
    /// The width and height of its reference.
    pub reference: (usize, usize),
}

/// The error of a picture I against its reference R.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The number of pixels compared.
    pub n_pixels: usize,
    /// Mean over pixels and channels of (I − R)².
    pub mse: f64,
    /// Mean over pixels and channels of (I − R)² / (R² + 0.01).
    pub rel_mse: f64,
    /// [`rel_mse`](Self::rel_mse) without the worst 0.1 % of the pixels.
    pub rel_mse_trimmed: f64,
    /// 10 log₁₀(peak² / MSE) \[dB\]; the peak is the largest channel value of the reference, not a
    /// screen's white. Infinite for equal pictures.
    pub psnr: f64,
    /// Mean of I.
    pub mean: [f64; 3],
    /// Mean of R.
    pub mean_reference: [f64; 3],
    /// Mean of I over mean of R, per channel; NaN where both are 0.
    pub mean_ratio: [f64; 3],
    /// Pixels with a NaN or an infinity in I or R. They make the errors above NaN or infinite.
    pub n_non_finite: usize,
}

/// Compares `test` with `reference` over the pixels where `mask` is true, or over all.
///
/// Without any pixel to compare, the means are NaN.
///
/// # Errors
/// If the pictures differ in size.
///
/// # Panics
/// If the mask does not have one value per pixel.
pub fn compare(
    test: &RgbImage,
    reference: &RgbImage,
    mask: Option<&[bool]>,
) -> Result<Comparison, SizeMismatch> {
    check_sizes(test, reference)?;
    assert!(mask.is_none_or(|m| m.len() == test.pixels.len()), "a mask of another size");
    let compared: Vec<(Rgb, Rgb)> = (0..test.pixels.len())
        .filter(|&i| mask.is_none_or(|m| m[i]))
        .map(|i| (test.pixels[i], reference.pixels[i]))
        .collect();
    let n = compared.len() as f64;
    let mse = compared.iter().map(|&(i, r)| squared_error(i, r)).sum::<f64>() / n;
    let mut relative: Vec<f64> = compared.iter().map(|&(i, r)| relative_error(i, r)).collect();
    let rel_mse = relative.iter().sum::<f64>() / n;
    relative.sort_unstable_by(f64::total_cmp);
    relative.truncate(((n * KEPT) as usize).max(1));
    let peak = compared.iter().map(|(_, r)| r.max_component()).fold(0.0, f32::max) as f64;
    let mean = channel_means(compared.iter().map(|p| p.0));
    let mean_reference = channel_means(compared.iter().map(|p| p.1));
    // A black reference has no peak.
    let psnr = if mse == 0.0 { f64::INFINITY } else { 10.0 * functions::log10(peak * peak / mse) };
    Ok(Comparison {
        n_pixels: compared.len(),
        mse,
        rel_mse,
        rel_mse_trimmed: relative.iter().sum::<f64>() / relative.len() as f64,
        psnr,
        mean,
        mean_reference,
        mean_ratio: [0, 1, 2].map(|c| mean[c] / mean_reference[c]),
        n_non_finite: compared.iter().filter(|(i, r)| !(i.is_finite() && r.is_finite())).count(),
    })
}

pub(super) fn check_sizes(test: &RgbImage, reference: &RgbImage) -> Result<(), SizeMismatch> {
    let [test, reference] = [test, reference].map(|p| (p.width, p.height));
    if test == reference { Ok(()) } else { Err(SizeMismatch { test, reference }) }
}

/// Mean over the channels of (I − R)².
fn squared_error(i: Rgb, r: Rgb) -> f64 {
    mean_over_channels(i, r, |i, r| functions::powi(i - r, 2))
}

/// Mean over the channels of (I − R)² / (R² + 0.01).
fn relative_error(i: Rgb, r: Rgb) -> f64 {
    mean_over_channels(i, r, |i, r| functions::powi(i - r, 2) / (r * r + REGULARIZER))
}

fn mean_over_channels(i: Rgb, r: Rgb, f: impl Fn(f64, f64) -> f64) -> f64 {
    i.to_array().into_iter().zip(r.to_array()).map(|(i, r)| f(i.into(), r.into())).sum::<f64>()
        / 3.0
}

fn channel_means(pixels: impl ExactSizeIterator<Item = Rgb>) -> [f64; 3] {
    let n = pixels.len() as f64;
    let sum =
        pixels.fold([0.0; 3], |s, p| [s[0] + p.r as f64, s[1] + p.g as f64, s[2] + p.b as f64]);
    sum.map(|s| s / n)
}

/// √ of the mean over the channels of (I − R)² / (R² + 0.01) for each pixel: 0.1 is an error of 10 %.
///
/// # Errors
/// If the pictures differ in size.
pub fn relative_error_map(test: &RgbImage, reference: &RgbImage) -> Result<Vec<f32>, SizeMismatch> {
    error_map(test, reference, relative_error)
}

/// √ of the mean over the channels of (I − R)² for each pixel, in units of radiance.
///
/// # Errors
/// If the pictures differ in size.
pub fn absolute_error_map(test: &RgbImage, reference: &RgbImage) -> Result<Vec<f32>, SizeMismatch> {
    error_map(test, reference, squared_error)
}

fn error_map(
    test: &RgbImage,
    reference: &RgbImage,
    error: impl Fn(Rgb, Rgb) -> f64,
) -> Result<Vec<f32>, SizeMismatch> {
    check_sizes(test, reference)?;
    let pairs = test.pixels.iter().zip(&reference.pixels);
    Ok(pairs.map(|(&i, &r)| error(i, r).sqrt() as f32).collect())
}

/// A perceptually uniform color scale: equal steps look equal, and lightness increases monotonically.
///
/// Van der Walt and Smith 2015, matplotlib's default color maps (their tables are CC0), here as lines
/// between every fifth entry, off by at most 0.004. Rainbow scales, which show false
/// edges, are not offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorScale {
    /// From violet over green to yellow.
    Viridis,
    /// From black over purple and orange to pale yellow, as in the ꟻLIP papers.
    Magma,
}

impl ColorScale {
    /// The linear color at `t`, clamped to \[0, 1\]; NaN is cyan, which no scale contains.
    pub fn color(self, t: f32) -> Rgb {
        if t.is_nan() {
            return Rgb::new(0.0, 1.0, 1.0);
        }
        let table = match self {
            Self::Viridis => &VIRIDIS,
            Self::Magma => &MAGMA,
        };
        let at = t.clamp(0.0, 1.0) * (table.len() - 1) as f32;
        let i = (at as usize).min(table.len() - 2);
        srgb(table[i]).lerp(srgb(table[i + 1]), at - i as f32).map(linear_from_srgb)
    }

    /// The picture of `values`, where `white` is the value at the upper end of the scale.
    ///
    /// # Panics
    /// If there are not `width` · `height` values.
    pub fn picture(self, values: &[f32], width: usize, height: usize, white: f32) -> RgbImage {
        let shown = |&v: &f32| self.color(if white > 0.0 { v / white } else { v });
        RgbImage::new(width, height, values.iter().map(shown).collect())
    }
}

/// The channels of 0xRRGGBB in \[0, 1\].
fn srgb(code: u32) -> Rgb {
    let [_, r, g, b] = code.to_be_bytes();
    Rgb::new(r.into(), g.into(), b.into()) / 255.0
}

/// Every fifth of the 256 entries of matplotlib's table, sRGB as 0xRRGGBB.
const VIRIDIS: [u32; 52] = [
    0x440154, 0x46085c, 0x471063, 0x481769, 0x481d6f, 0x482475, 0x472a7a, 0x46307e, 0x453781,
    0x433d84, 0x414287, 0x3f4889, 0x3d4e8a, 0x3a538b, 0x38598c, 0x355e8d, 0x33638d, 0x31688e,
    0x2e6d8e, 0x2c718e, 0x2a768e, 0x297b8e, 0x27808e, 0x25848e, 0x23898e, 0x218e8d, 0x20928c,
    0x1f978b, 0x1e9c89, 0x1fa188, 0x21a585, 0x24aa83, 0x28ae80, 0x2eb37c, 0x35b779, 0x3dbc74,
    0x46c06f, 0x50c46a, 0x5ac864, 0x65cb5e, 0x70cf57, 0x7cd250, 0x89d548, 0x95d840, 0xa2da37,
    0xb0dd2f, 0xbddf26, 0xcae11f, 0xd8e219, 0xe5e419, 0xf1e51d, 0xfde725,
];

/// As [`VIRIDIS`].
const MAGMA: [u32; 52] = [
    0x000004, 0x02020b, 0x050416, 0x090720, 0x0e0b2b, 0x140e36, 0x1a1042, 0x21114e, 0x29115a,
    0x311165, 0x390f6e, 0x420f75, 0x4a1079, 0x52137c, 0x5a167e, 0x621980, 0x6a1c81, 0x721f81,
    0x792282, 0x812581, 0x892881, 0x912b81, 0x992d80, 0xa1307e, 0xaa337d, 0xb2357b, 0xba3878,
    0xc23b75, 0xca3e72, 0xd2426f, 0xd9466b, 0xe04c67, 0xe75263, 0xec5860, 0xf1605d, 0xf4695c,
    0xf7725c, 0xf97b5d, 0xfb8560, 0xfc8e64, 0xfd9869, 0xfea16e, 0xfeaa74, 0xfeb47b, 0xfebd82,
    0xfec68a, 0xfecf92, 0xfed89a, 0xfde2a3, 0xfdebac, 0xfcf4b6, 0xfcfdbf,
];

#[cfg(test)]
mod tests {
    use super::super::tone::srgb_from_linear;
    use super::*;

    #[test]
    fn equal_pictures_have_no_error() {
        let picture = RgbImage::from_fn(5, 4, |x, y| Rgb::new(x as f32, y as f32, 1.0));
        let c = compare(&picture, &picture, None).unwrap();
        assert_eq!((c.mse, c.rel_mse, c.rel_mse_trimmed, c.psnr), (0.0, 0.0, 0.0, f64::INFINITY));
        let black = RgbImage::filled(2, 2, Rgb::BLACK);
        assert_eq!(compare(&black, &black, None).unwrap().psnr, f64::INFINITY);
        assert_eq!((c.mean_ratio, c.n_non_finite), ([1.0; 3], 0));
    }

    #[test]
    fn the_formulas_by_hand() {
        let test = RgbImage::new(2, 1, vec![Rgb::new(1.0, 2.0, 3.0), Rgb::splat(4.0)]);
        let reference = RgbImage::new(2, 1, vec![Rgb::new(1.0, 1.0, 1.0), Rgb::splat(2.0)]);
        let c = compare(&test, &reference, None).unwrap();
        assert!((c.mse - (1.0 + 4.0 + 12.0) / 6.0).abs() < 1e-12);
        assert!((c.rel_mse - (5.0 / 1.01 + 12.0 / 4.01) / 6.0).abs() < 1e-12);
        assert!((c.psnr - 10.0 * (4.0 / c.mse).log10()).abs() < 1e-12);
        assert_eq!(c.mean_ratio, [5.0 / 3.0, 2.0, 7.0 / 3.0]);
        // One of two pixels remains: the better one, in relative terms.
        assert!((c.rel_mse_trimmed - 4.0 / 4.01).abs() < 1e-12);
        let masked = compare(&test, &reference, Some(&[false, true])).unwrap();
        assert_eq!((masked.n_pixels, masked.mse), (1, 4.0));
    }

    #[test]
    fn trimming_drops_a_firefly() {
        let reference = RgbImage::filled(50, 40, Rgb::WHITE);
        let mut test = RgbImage::filled(50, 40, Rgb::splat(1.1));
        test.pixels[777] = Rgb::splat(1e4);
        let c = compare(&test, &reference, None).unwrap();
        assert!(c.rel_mse > 1e4 && (c.rel_mse_trimmed - 0.01 / 1.01).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_not_hidden() {
        let reference = RgbImage::filled(3, 1, Rgb::WHITE);
        let mut test = reference.clone();
        test.pixels[1].g = f32::NAN;
        let c = compare(&test, &reference, None).unwrap();
        assert!(c.n_non_finite == 1 && c.mse.is_nan());
    }

    #[test]
    fn other_sizes_are_refused() {
        let error =
            compare(&RgbImage::filled(2, 3, Rgb::BLACK), &RgbImage::filled(3, 2, Rgb::BLACK), None);
        let message = error.unwrap_err().to_string();
        assert!(message.contains("2x3") && message.contains("3x2"), "{message}");
    }

    #[test]
    fn the_scales_rise_from_end_to_end() {
        // First, middle and last entry of the published tables.
        let ends = [
            (
                ColorScale::Viridis,
                [[0.267, 0.005, 0.329], [0.128, 0.565, 0.551], [0.993, 0.906, 0.144]],
            ),
            (
                ColorScale::Magma,
                [[0.001, 0.000, 0.014], [0.713, 0.214, 0.476], [0.987, 0.991, 0.750]],
            ),
        ];
        for (scale, table) in ends {
            for (t, expected) in [0.0, 0.5, 1.0].into_iter().zip(table) {
                let color = scale.color(t).map(srgb_from_linear).to_array();
                assert!(
                    color.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.005),
                    "{scale:?} {t}: {color:?}"
                );
            }
            let luminance = |i: usize| scale.color(i as f32 / 64.0).luminance();
            assert!((0..64).all(|i| luminance(i + 1) > luminance(i)), "{scale:?}");
        }
    }
}
