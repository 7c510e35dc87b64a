//! ꟻLIP: the perceived difference of two pictures when flipping between them.
//!
//! - LDR: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild 2020, "ꟻLIP: A Difference
//!   Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2).
//! - HDR: Andersson, Nilsson, Shirley, Akenine-Möller 2021, "Visualizing Errors in Rendered High
//!   Dynamic Range Images", Eurographics short papers: the maximum LDR difference over a range of
//!   exposures determined by the reference alone.
//!
//! The filters are sums of Gaussians and their derivatives, so all are applied to rows, then columns. This
//! is exact, also at the border, which repeats the outermost pixels.
//!
//! SSIM was rejected: it is older and better known, but far too strict on Monte Carlo noise in dark areas,
//! and it ignores color.

use super::compare::{SizeMismatch, check_sizes};
use crate::color::Rgb;
use crate::image::RgbImage;
use crate::math::functions;
use crate::parallel::{bands, in_order};
use std::ops::RangeInclusive;

/// Pixels per degree of a 0.7 m wide 4K screen seen from 0.7 m: 3840 π / 180.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// The pixels per degree at which the filters are defined. With fewer, those of features lie between the pixels.
pub const RESOLUTIONS: RangeInclusive<f32> = 2.0..=1e4;

/// Exponent of the color difference.
const Q_COLOR: f32 = 0.7;
/// Exponent of the feature difference.
const Q_FEATURE: f32 = 0.5;
/// Color differences up to this part of the largest ...
const P_COLOR: f32 = 0.4;
/// ... are spread over this part of the scale.
const P_TOP: f32 = 0.95;
/// Distance from peak to trough of the edge detector of the eye \[°\].
const FEATURE_WIDTH: f32 = 0.082;

/// The white of the reference illuminant D65, X Y Z of linear RGB (1, 1, 1).
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

/// Two pictures have no ꟻLIP.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FlipError {
    /// The pictures differ in size.
    #[error(transparent)]
    Size(#[from] SizeMismatch),
    /// The number of pixels per degree is not in [`RESOLUTIONS`].
    #[error(
        "ꟻLIP is not defined at {0} pixels per degree; there must be from {least} to {most}",
        least = RESOLUTIONS.start(), most = RESOLUTIONS.end()
    )]
    Resolution(f32),
}

/// The HDR difference and the exposures behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct HdrFlip {
    /// The difference of each pixel, in \[0, 1\].
    pub map: Vec<f32>,
    /// The lowest exposure \[stops\].
    pub start_exposure: f32,
    /// The highest exposure \[stops\].
    pub stop_exposure: f32,
    /// The number of exposures from the lowest to the highest, inclusive.
    pub n_exposures: u32,
}

/// LDR-ꟻLIP of each pixel, in \[0, 1\], of two pictures of linear light on the screen in \[0, 1\] (that is,
/// after the tone curve, before the sRGB encoding). Values outside are clamped; NaN counts as 0.
///
/// `pixels_per_degree` is the resolution at the eye, see [`PIXELS_PER_DEGREE`].
///
/// # Errors
/// If the pictures differ in size, or the resolution is not in [`RESOLUTIONS`].
pub fn ldr_flip(
    reference: &RgbImage,
    test: &RgbImage,
    pixels_per_degree: f32,
) -> Result<Vec<f32>, FlipError> {
    check(reference, test, pixels_per_degree)?;
    if reference.pixels.is_empty() {
        return Ok(Vec::new());
    }
    let eye = Eye::new(pixels_per_degree);
    let (reference, test) = (eye.see(reference), eye.see(test));
    let c_max =
        functions::powf(hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])), Q_COLOR);
    let difference = |i: usize| {
        let color =
            redistribute(functions::powf(hyab(reference.lab[i], test.lab[i]), Q_COLOR), c_max);
        let edge = (reference.edge[i] - test.edge[i]).abs();
        let point = (reference.point[i] - test.point[i]).abs();
        let feature = functions::powf(edge.max(point) * std::f32::consts::FRAC_1_SQRT_2, Q_FEATURE);
        functions::powf(color, 1.0 - feature)
    };
    Ok(in_order(reference.lab.len(), difference))
}

/// Whether the pictures have a ꟻLIP.
fn check(reference: &RgbImage, test: &RgbImage, pixels_per_degree: f32) -> Result<(), FlipError> {
    check_sizes(test, reference)?;
    if !RESOLUTIONS.contains(&pixels_per_degree) {
        return Err(FlipError::Resolution(pixels_per_degree));
    }
    Ok(())
}

/// HDR-ꟻLIP of two pictures of linear radiance, as the authors' program flip-evaluator 1.7 computes it; NaN counts as 0,
/// and infinity as white at every exposure.
///
/// Negative values pass through the tone curve unchanged, which shows values below −0.02 as *bright*. Repair them first
/// if that is not wanted.
///
/// # Errors
/// If the pictures differ in size, or the resolution is not in [`RESOLUTIONS`].
pub fn hdr_flip(
    reference: &RgbImage,
    test: &RgbImage,
    pixels_per_degree: f32,
) -> Result<HdrFlip, FlipError> {
    check(reference, test, pixels_per_degree)?;
    let (start, stop) = exposure_range(reference);
    let n = (stop - start).ceil().max(2.0) as u32;
    let mut map = vec![0.0f32; reference.pixels.len()];
    for i in 0..n {
        let exposure = start + (stop - start) * i as f32 / (n - 1) as f32;
        let shown = |picture: &RgbImage| {
            let pixel = |i: usize| tone_map(picture.pixels[i] * functions::exp2(exposure));
            RgbImage { pixels: in_order(picture.pixels.len(), pixel), ..*picture }
        };
        let at_exposure = ldr_flip(&shown(reference), &shown(test), pixels_per_degree)?;
        map.iter_mut().zip(at_exposure).for_each(|(m, e)| *m = m.max(e));
    }
    Ok(HdrFlip { map, start_exposure: start, stop_exposure: stop, n_exposures: n })
}

/// Coefficients (k0 x² + k1 x) / (k3 x² + k4 x + k5) of Narkowicz's fit of the ACES curve with its
/// pre-exposure of 0.6 undone (Andersson et al. 2021, equation 1 and table 1).
const ACES: [f32; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn tone_map(radiance: Rgb) -> Rgb {
    let [k0, k1, k3, k4, k5] = ACES;
    radiance.map(|c| {
        // Squares stay finite; NaN is shown as black.
        let x = if c.is_nan() { 0.0 } else { c.clamp(-1e15, 1e15) };
        ((k0 * x + k1) * x / ((k3 * x + k4) * x + k5)).clamp(0.0, 1.0)
    })
}

/// From where the largest to where the median luminance is shown at 85 % \[stops\].
///
/// The median is at least [`f32::EPSILON`], as in the authors' program: where most of the picture is black it is shown
/// at up to 24 stops. A picture without any light is shown as it is.
fn exposure_range(reference: &RgbImage) -> (f32, f32) {
    const SHOWN: f32 = 0.85;
    let [k0, k1, k3, k4, k5] = ACES;
    let (a, b, c) = (k0 - SHOWN * k3, k1 - SHOWN * k4, -SHOWN * k5);
    let x = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let finite = |l: f32| if l.is_finite() { l } else { 0.0 };
    let mut luminance: Vec<f32> = reference.pixels.iter().map(|p| finite(p.luminance())).collect();
    luminance.sort_unstable_by(f32::total_cmp);
    let Some(&greatest) = luminance.last().filter(|&&l| l > 0.0) else { return (0.0, 0.0) };
    // The upper median; a picture dimmer than the least median is shown at one exposure.
    let median = luminance[luminance.len() / 2].max(f32::EPSILON).min(greatest);
    (functions::log2(x / greatest), functions::log2(x / median))
}

/// What arrives of a picture behind the eye.
struct Seen {
    /// Filtered, in L*a*b* after Hunt's adjustment.
    lab: Vec<[f32; 3]>,
    /// Strength of edges.
    edge: Vec<f32>,
    /// Strength of points.
    point: Vec<f32>,
}

/// The filters of the eye at one resolution.
struct Eye {
    /// Contrast sensitivity of the channels Y, Cx, Cz as weighted Gaussians.
    sensitivity: [Vec<Separable>; 3],
    edge: Separable,
    point: Separable,
}

/// A filter kernel, the product of one over x and one over y.
struct Separable {
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Separable {
    fn transposed(&self) -> Self {
        Self { x: self.y.clone(), y: self.x.clone() }
    }
}

impl Eye {
    fn new(pixels_per_degree: f32) -> Self {
        // Table 1 of the paper: a √(π/b) exp(−π² r² / b), summed over the pairs (a, b).
        let gaussians: [&[(f32, f32)]; 3] =
            [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
        let sensitivity = gaussians.map(|pairs| sensitivity(pairs, pixels_per_degree));
        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let bell =
            sampled((3.0 * sigma).ceil(), |x| functions::exp(-x * x / (2.0 * sigma * sigma)));
        let derivative = |f: &dyn Fn(f32) -> f32| {
            let kernel =
                bell.iter().zip(sampled((3.0 * sigma).ceil(), f)).map(|(g, f)| g * f).collect();
            Separable { x: balanced(kernel), y: scaled(&bell, 1.0 / bell.iter().sum::<f32>()) }
        };
        Self {
            sensitivity,
            edge: derivative(&|x| -x),
            point: derivative(&|x| x * x / (sigma * sigma) - 1.0),
        }
    }

    fn see(&self, picture: &RgbImage) -> Seen {
        let width = picture.width;
        let opponent = in_order(picture.pixels.len(), |i| opponent_of_rgb(picture.pixels[i]));
        let plane = |channel: usize| -> Vec<f32> { opponent.iter().map(|c| c[channel]).collect() };
        let planes = [plane(0), plane(1), plane(2)];
        let filtered = [0, 1, 2].map(|c| {
            let parts = self.sensitivity[c].iter().map(|kernel| filter(&planes[c], width, kernel));
            parts.reduce(|a, b| a.iter().zip(b).map(|(a, b)| a + b).collect()).unwrap_or_default()
        });
        let lab = in_order(opponent.len(), |i| {
            hunt_lab(rgb_of_opponent([0, 1, 2].map(|c| filtered[c][i])))
        });
        let achromatic: Vec<f32> = planes[0].iter().map(|y| (y + 16.0) / 116.0).collect();
        let strength = |kernel: &Separable| -> Vec<f32> {
            let along_x = filter(&achromatic, width, kernel);
            let along_y = filter(&achromatic, width, &kernel.transposed());
            along_x.iter().zip(along_y).map(|(&x, y)| functions::hypot(x, y)).collect()
        };
        Seen { lab, edge: strength(&self.edge), point: strength(&self.point) }
    }
}

/// The Gaussians of one channel, their sum over all pixels 1.
fn sensitivity(pairs: &[(f32, f32)], pixels_per_degree: f32) -> Vec<Separable> {
    use std::f32::consts::PI;
    // Three standard deviations of the widest Gaussian of all channels.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil();
    let bell = |b: f32| {
        sampled(radius, |x| {
            functions::exp(-PI * PI * functions::powi(x / pixels_per_degree, 2) / b)
        })
    };
    let weight = |(a, b): (f32, f32)| a * (PI / b).sqrt();
    let total: f32 =
        pairs.iter().map(|&p| weight(p) * functions::powi(bell(p.1).iter().sum::<f32>(), 2)).sum();
    pairs
        .iter()
        .map(|&p| Separable { x: scaled(&bell(p.1), weight(p) / total), y: bell(p.1) })
        .collect()
}

/// `f` at the integers of ± `radius`.
fn sampled(radius: f32, f: impl Fn(f32) -> f32) -> Vec<f32> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| f(x as f32)).collect()
}

fn scaled(kernel: &[f32], by: f32) -> Vec<f32> {
    kernel.iter().map(|k| k * by).collect()
}

/// Positive weights that sum to 1, negative ones to −1.
fn balanced(kernel: Vec<f32>) -> Vec<f32> {
    let positive: f32 = kernel.iter().filter(|&&k| k > 0.0).sum();
    let negative: f32 = -kernel.iter().filter(|&&k| k < 0.0).sum::<f32>();
    kernel.into_iter().map(|k| if k < 0.0 { k / negative } else { k / positive }).collect()
}

/// Correlates a plane with a kernel, rows first; the border is repeated outward.
fn filter(plane: &[f32], width: usize, kernel: &Separable) -> Vec<f32> {
    let mut rows = vec![0.0f32; plane.len()];
    let radius = kernel.x.len() / 2;
    bands(&mut rows, width, |y, out| {
        let row = &plane[y * width..(y + 1) * width];
        let (first, last) = (row[0], row[width - 1]);
        let ends = std::iter::repeat_n(first, radius).chain(row.iter().copied());
        let padded: Vec<f32> = ends.chain(std::iter::repeat_n(last, radius)).collect();
        for (k, &weight) in kernel.x.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(o, v)| *o += weight * v);
        }
    });
    let height = plane.len() / width;
    let radius = kernel.y.len() / 2;
    let mut columns = vec![0.0f32; plane.len()];
    bands(&mut columns, width, |y, out| {
        for (k, &weight) in kernel.y.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1);
            let row = &rows[from * width..(from + 1) * width];
            out.iter_mut().zip(row).for_each(|(o, v)| *o += weight * v);
        }
    });
    columns
}

/// X Y Z of linear sRGB over [`WHITE`], from the primaries' exact fractions.
fn relative_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (10135552.0 * r + 8788810.0 * g + 4435075.0 * b) / 24577794.0 / WHITE[0],
        (2613072.0 * r + 8788810.0 * g + 887015.0 * b) / 12288897.0 / WHITE[1],
        (1425312.0 * r + 8788810.0 * g + 70074185.0 * b) / 73733382.0 / WHITE[2],
    ]
}

/// The linear opponent space YCxCz.
fn opponent_of_rgb(color: Rgb) -> [f32; 3] {
    let on_screen = color.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) });
    let [x, y, z] = relative_xyz(on_screen.to_array());
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Linear sRGB of YCxCz, clamped to what a screen can show.
fn rgb_of_opponent([l, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (l + 16.0) / 116.0;
    let (x, z) = ((y + cx / 500.0) * WHITE[0], (y - cz / 200.0) * WHITE[2]);
    [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
    .map(|c| c.clamp(0.0, 1.0))
}

/// CIE L*a*b*, the chroma scaled by 0.01 L* (Hunt 1952: colors fade in the dark).
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb).map(|t| {
        if t > DELTA * DELTA * DELTA {
            functions::cbrt(t)
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let l = 116.0 * y - 16.0;
    [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
}

/// Distance of large color differences: |ΔL| + √(Δa² + Δb²) (Abasi et al. 2020).
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + functions::hypot(p[1] - q[1], p[2] - q[2])
}

/// Spreads small differences over most of \[0, 1\].
fn redistribute(difference: f32, greatest: f32) -> f32 {
    let knee = P_COLOR * greatest;
    if difference < knee {
        P_TOP / knee * difference
    } else {
        P_TOP + (difference - knee) / (greatest - knee) * (1.0 - P_TOP)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_pictures_do_not_differ() {
        for (width, height) in [(0, 0), (0, 3), (3, 0)] {
            let empty = RgbImage::new(width, height, Vec::new());
            assert_eq!(hdr_flip(&empty, &empty, PIXELS_PER_DEGREE).map(|f| f.map), Ok(Vec::new()));
        }
    }

    /// A gradient with a bright disc and a grid: smooth, edges and points, at full range.
    fn pattern(width: usize, height: usize) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
            let disc = if (u - 0.4).hypot(v - 0.5) < 0.2 { 0.75 } else { 0.25 };
            let grid = if x % 16 == 0 || y % 16 == 0 { 0.5 } else { 0.0 };
            Rgb::new(0.8 * u + 0.2 * disc, 0.5 * disc + 0.5 * grid, 0.6 * v + 0.25 * disc)
        })
    }

    fn mean(map: &[f32]) -> f64 {
        map.iter().map(|&e| f64::from(e)).sum::<f64>() / map.len() as f64
    }

    fn flip(reference: &RgbImage, test: &RgbImage) -> f64 {
        mean(&ldr_flip(reference, test, PIXELS_PER_DEGREE).unwrap())
    }

    #[test]
    fn equal_pictures_do_not_differ() {
        let picture = pattern(40, 30);
        assert!(ldr_flip(&picture, &picture, PIXELS_PER_DEGREE).unwrap().iter().all(|&e| e == 0.0));
        assert!(
            hdr_flip(&picture, &picture, PIXELS_PER_DEGREE).unwrap().map.iter().all(|&e| e == 0.0)
        );
    }

    #[test]
    fn the_ldr_difference_is_symmetric() {
        let (a, b) = (pattern(40, 30), RgbImage::filled(40, 30, Rgb::splat(0.3)));
        let (ab, ba) = (ldr_flip(&a, &b, PIXELS_PER_DEGREE), ldr_flip(&b, &a, PIXELS_PER_DEGREE));
        assert_eq!(ab, ba);
    }

    /// Uniform noise in [0, 1): a multiplicative hash of the pixel's index.
    fn noise(i: usize) -> f32 {
        ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0
    }

    fn with_noise(picture: &RgbImage, f: impl Fn(Rgb, f32) -> Rgb) -> RgbImage {
        let pixels = picture.pixels.iter().enumerate().map(|(i, &p)| f(p, noise(i))).collect();
        RgbImage { pixels, ..*picture }
    }

    /// Means of the maps that flip-evaluator 1.7, the authors' program, gives for the same pictures.
    #[test]
    fn agrees_with_the_authors_program() {
        let a = pattern(96, 64);
        let shifted = RgbImage::from_fn(96, 64, |x, y| a.get((x + 3) % 96, y));
        let noisy = with_noise(&a, |p, n| p.map(|c| (c + 0.3 * (n - 0.5)).clamp(0.0, 1.0)));
        let (black, white) =
            (RgbImage::filled(32, 32, Rgb::BLACK), RgbImage::filled(32, 32, Rgb::WHITE));
        for (name, reference, test, expected) in [
            ("shifted", &a, &shifted, 0.233_826_9),
            ("noisy", &a, &noisy, 0.097_417_1),
            ("black and white", &black, &white, 0.967_388_3),
        ] {
            let ours = flip(reference, test);
            println!("{name}: {ours:.7} {expected}");
            assert!((ours - expected).abs() < 1e-5, "{name}: {ours}");
        }
        let bright = with_noise(&a, |p, _| p * p * p * 20.0);
        let test = with_noise(&bright, |p, n| p * (0.8 + 0.4 * n));
        let hdr = hdr_flip(&bright, &test, PIXELS_PER_DEGREE).unwrap();
        println!(
            "hdr: {:.7} {hdr:?}",
            mean(&hdr.map),
            hdr = (hdr.start_exposure, hdr.stop_exposure)
        );
        assert!((mean(&hdr.map) - 0.039_361_4).abs() < 1e-5);
        assert_eq!(hdr.n_exposures, 3);
        assert!(
            (hdr.start_exposure + 1.148_618).abs() < 1e-4
                && (hdr.stop_exposure - 1.136_892).abs() < 1e-4
        );
    }

    /// As above, of pictures that are mostly black or have negative pixels: also the exposures that it takes.
    #[test]
    fn agrees_with_the_authors_program_on_black_and_negative_pixels() {
        let bright = with_noise(&pattern(96, 64), |p, _| p * p * p * 20.0);
        let disc = RgbImage::from_fn(96, 64, |x, y| {
            let (u, v) = (x as f32 / 96.0, y as f32 / 64.0);
            if (u - 0.4).hypot(v - 0.5) < 0.3 { bright.get(x, y) } else { Rgb::BLACK }
        });
        let noisy = with_noise(&disc, |p, n| p * (0.8 + 0.4 * n));
        let lifted = with_noise(&disc, |p, n| p * (0.8 + 0.4 * n) + Rgb::splat(0.001 * n));
        let negative = with_noise(&bright, |p, n| p + Rgb::splat(4.0 * (n - 0.5)));
        for (name, reference, test, expected, stop, n) in [
            ("a lit disc", &disc, &noisy, 0.015_866_4, 24.083_298, 26),
            ("noise on black", &disc, &lifted, 0.752_156_4, 24.083_298, 26),
            ("negative test", &bright, &negative, 0.903_493_5, 1.136_892, 3),
            ("negative reference", &negative, &bright, 0.902_597_2, 1.023_542, 3),
        ] {
            let hdr = hdr_flip(reference, test, PIXELS_PER_DEGREE).unwrap();
            let ours = mean(&hdr.map);
            println!("{name}: {ours:.7} {expected}");
            assert!((ours - expected).abs() < 1e-5, "{name}: {ours}");
            assert!((hdr.stop_exposure - stop).abs() < 1e-4, "{name}: {}", hdr.stop_exposure);
            assert_eq!(hdr.n_exposures, n, "{name}");
        }
    }

    #[test]
    fn one_pixel_and_thin_pictures_work() {
        for (width, height) in [(1, 1), (1, 9), (30, 1)] {
            let black = RgbImage::filled(width, height, Rgb::BLACK);
            let gray = RgbImage::filled(width, height, Rgb::splat(0.5));
            let map = ldr_flip(&gray, &black, PIXELS_PER_DEGREE).unwrap();
            assert!(map.iter().all(|e| (0.5..=1.0).contains(e)));
        }
    }

    #[test]
    fn filters_are_defined_at_all_resolutions() {
        let (a, b) = (pattern(24, 16), RgbImage::filled(24, 16, Rgb::splat(0.3)));
        for resolution in [*RESOLUTIONS.start(), 2.5, 5.0, 300.0] {
            let ldr = ldr_flip(&a, &b, resolution).unwrap();
            let hdr = hdr_flip(&a, &b, resolution).unwrap().map;
            for map in [ldr, hdr] {
                assert!(map.iter().all(|e| (0.0..=1.0).contains(e)), "{resolution}");
                assert!(mean(&map) > 0.1, "{resolution}");
            }
        }
        for resolution in [1.0, 0.0, -3.0, 2e4, f32::NAN] {
            let error = ldr_flip(&a, &b, resolution).unwrap_err();
            assert!(error.to_string().contains("pixels per degree"), "{error}");
            assert!(hdr_flip(&a, &b, resolution).is_err());
        }
    }

    #[test]
    fn nan_is_black_and_infinity_is_white() {
        let uniform = |value: f32| RgbImage::filled(8, 8, Rgb::splat(value));
        let gray = uniform(0.3);
        for (odd, usual) in [(f32::NAN, 0.0), (f32::INFINITY, 1.0), (f32::NEG_INFINITY, 0.0)] {
            let [odd, usual] = [odd, usual]
                .map(|value| ldr_flip(&gray, &uniform(value), PIXELS_PER_DEGREE).unwrap());
            assert_eq!(odd, usual);
        }
        for (odd, usual) in [(f32::NAN, 0.0), (f32::INFINITY, 1e30)] {
            let [odd, usual] = [odd, usual]
                .map(|value| hdr_flip(&gray, &uniform(value), PIXELS_PER_DEGREE).unwrap());
            assert_eq!(odd, usual);
        }
    }

    #[test]
    fn pictures_of_other_size_are_refused() {
        let error = ldr_flip(&pattern(4, 4), &pattern(4, 5), PIXELS_PER_DEGREE).unwrap_err();
        assert!(error.to_string().contains("4x5"), "{error}");
    }

    #[test]
    fn a_mostly_black_reference_has_a_finite_exposure_range() {
        let mut picture = RgbImage::filled(8, 8, Rgb::BLACK);
        picture.pixels[20] = Rgb::splat(3.0);
        let flip =
            hdr_flip(&picture, &RgbImage::filled(8, 8, Rgb::BLACK), PIXELS_PER_DEGREE).unwrap();
        assert!(flip.start_exposure.is_finite() && flip.stop_exposure.is_finite());
        assert!(flip.map[20] > 0.0);
        // Dimmer than the least median, and no light at all.
        for light in [1e-9, 0.0, -1.0] {
            let dim = RgbImage::filled(8, 8, Rgb::splat(light));
            let flip = hdr_flip(&dim, &picture, PIXELS_PER_DEGREE).unwrap();
            assert!(flip.start_exposure.is_finite() && flip.n_exposures == 2, "{light}");
            assert!(flip.map.iter().all(|e| (0.0..=1.0).contains(e)), "{light}");
        }
    }
}
