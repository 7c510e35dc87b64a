//! Estimates the variance of a render's samples relative to independent samples.
//!
//! The mean of n independent samples with variance s² has the variance s²/n. Stratified samples have less, but their
//! sample variance does not show by how much. Two measurements do:
//!
//! - **A second set** of samples in some pixels, independent of the first. The squared difference of the two means is
//!   the sum of their variances in expectation, however the samples within a set depend on each other. Strategies that
//!   place all the rays of a pixel together use it in one pixel of 64, and renders with a target error in all pixels.
//! - **Halves of a sequence.** Let the mean of the first 2ʲ samples and that of the next 2ʲ differ by Dⱼ. The Dⱼ are
//!   the details of a Haar expansion over the index. They are assumed to be uncorrelated under Owen scrambling (Owen
//!   1997, "Monte Carlo variance of scrambled net quadrature"), and the mean of Dⱼ² over many pixels is assumed to be
//!   proportional to rʲ. Then
//!
//! ```text
//! Var(mean of n) = Σⱼ E[Dⱼ²]/4 · (min(x, 2ʲ⁺¹ − x) / n)²        x = n mod 2ʲ⁺¹
//! ```
//!
//!   r is ½ for independent samples, whose D₀² is 2 s², and follows from s² and the largest j available.
//!
//! Both are too noisy in a single pixel. So the ratio of this variance to s²/n, both summed over all pixels of the
//! picture, scales the s²/n of each pixel.
//!
//! At silhouettes against a hidden background, s² is mostly the variance of the coverage α, α(1 − α) m², where m is the mean of
//! what is seen. Stratified camera samples reduce this part by more than strategies reduce the rest, so it has its own ratio.
//! It is known from few pixels with second sets, and begins with the ratio that edges have on average.

use crate::math::functions;

/// Sums over pixels from which their variance is estimated. They hold whole numbers, so that the sums of parts of a
/// picture add up to those of the whole in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VarianceSums {
    sets: [i128; 2],
    edges: [i128; 4],
    n_edges: u64,
    halves: [i128; 2],
}

/// A pixel's contribution to [`VarianceSums`], summed over channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contrast {
    /// Two independent sets: s²/n, and the variance from their difference.
    Sets([f64; 2]),
    /// Two independent sets at an edge: s²/n without the part of the coverage, this part, what edges usually leave of it,
    /// and the variance from the difference.
    Edge([f64; 4]),
    /// One sequence: s²/N of its longest prefix of N = 2^k samples, and D² of the halves of this prefix.
    Halves([f64; 2]),
}

impl VarianceSums {
    /// Adds the pixels of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        let sums = self.sets.iter_mut().chain(&mut self.edges).chain(&mut self.halves);
        let others = other.sets.iter().chain(&other.edges).chain(&other.halves);
        sums.zip(others).for_each(|(sum, x)| *sum = sum.saturating_add(*x));
        self.n_edges += other.n_edges;
    }

    /// Sums the contributions of some pixels.
    pub(super) fn of(contrasts: impl Iterator<Item = Contrast>) -> Self {
        let mut sums = Self::default();
        for contrast in contrasts {
            let mut of_pixel = Self::default();
            match contrast {
                Contrast::Sets(sets) => of_pixel.sets = sets.map(fixed),
                Contrast::Edge(edge) => {
                    (of_pixel.edges, of_pixel.n_edges) = (edge.map(fixed), 1);
                }
                Contrast::Halves(halves) => of_pixel.halves = halves.map(fixed),
            }
            sums.add(&of_pixel);
        }
        sums
    }

    /// The ratios of the variance of the mean of `n` samples to s²/n.
    pub(super) fn scale(&self, n: u32) -> Scale {
        let [independent, measured] = self.sets.map(|sum| sum as f64);
        let [within, coverage, usual, at_edges] = self.edges.map(|sum| sum as f64);
        if independent > 0.0 || coverage > 0.0 {
            // If all surfaces seen are at edges, both parts have one ratio.
            let inside = if independent > 0.0 {
                measured / independent
            } else {
                at_edges / (within + coverage)
            };
            if coverage <= 0.0 {
                return Scale { inside, coverage: Some(inside.min(usual_at_edges(n))) };
            }
            // A few pixels of the usual ratio, each with the mean variance of the coverage.
            let pixels = PRIOR_PIXELS / self.n_edges as f64;
            let found = (at_edges - inside * within + pixels * usual) / (coverage * (1.0 + pixels));
            let least = LEAST_OF_USUAL * usual / coverage;
            return Scale { inside, coverage: Some(found.max(least)) };
        }
        let [independent, halves] = self.halves.map(|sum| sum as f64);
        let inside = if independent > 0.0 { of_mean(n, halves / independent) } else { 1.0 };
        Scale { inside, coverage: None }
    }
}

/// The scales of pixels one after the other. Neighbors often have the same number of samples and share one, because it costs a
/// power.
pub(super) struct Scales<'a> {
    sums: &'a VarianceSums,
    last: (u32, Scale),
}

impl<'a> Scales<'a> {
    pub(super) fn new(sums: &'a VarianceSums) -> Self {
        Self { sums, last: (0, sums.scale(0)) }
    }

    /// That of the mean of `n` samples.
    pub(super) fn of(&mut self, n: u32) -> Scale {
        if self.last.0 != n {
            self.last = (n, self.sums.scale(n));
        }
        self.last.1
    }
}

/// The ratios of the variance of a mean to that of independent samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// That of what surfaces send.
    pub(super) inside: f64,
    /// That of the coverage, if it has its own.
    pub(super) coverage: Option<f64>,
}

/// The ratio that the coverage of an edge has with n stratified samples: the variance of the area on one side of a line
/// falls like n^(−3/2). The factor was measured on three scenes.
pub(super) fn usual_at_edges(n: u32) -> f64 {
    0.5 / f64::from(n.max(1)).sqrt()
}

/// The weight of the usual ratio, in pixels with second sets.
const PRIOR_PIXELS: f64 = 4.0;

/// A noisy ratio is not taken for less than this fraction of the usual one.
const LEAST_OF_USUAL: f64 = 0.1;

/// Converts to units of 2⁻⁶⁴.
fn fixed(x: f64) -> i128 {
    (x * functions::powi(2f64, 64)) as i128
}

/// The ratio of the variance of the mean of n samples to s²/n, given the ratio of D² of the halves of the first N to
/// s²/N.
fn of_mean(n: u32, halves: f64) -> f64 {
    let last = n.max(2).ilog2() as i32 - 1;
    let prefix = functions::powi(2f64, last + 1);
    // D² of independent samples is 4 s²/N.
    let r = 0.5 * functions::powf(0.25 * halves, 1.0 / f64::from(last.max(1)));
    let r = if last > 0 { r.clamp(0.125, 0.5) } else { 0.5 };
    let weight = |j: i32| {
        let (block, n) = (2u64 << j, u64::from(n));
        let unbalanced = (n % block).min(block - n % block) as f64 / n as f64;
        unbalanced * unbalanced
    };
    let inside: f64 = (0..=last).map(|j| weight(j) * functions::powi(r, j - last)).sum();
    let (mut sum, mut ratio, mut detail) = (inside, r, 1.0);
    for j in last + 1..=LAST {
        ratio += RISE * (0.5 - ratio);
        detail *= ratio;
        sum += weight(j) * detail;
    }
    0.25 * halves * sum * f64::from(n) / prefix
}

/// Beyond the samples, the ratio of successive details approaches ½ by this fraction of the remaining distance from one
/// to the next, because rough pixels remain. Measured on three scenes.
const RISE: f64 = 0.0625;

/// The last detail. Each detail beyond the samples is at most half the previous one.
const LAST: i32 = 60;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_samples_have_the_variance_of_independent_samples() {
        for n in [2, 3, 5, 8, 13, 16, 24, 100, 1000, 1 << 20, u32::MAX] {
            let scale = of_mean(n, 4.0);
            assert!((scale - 1.0).abs() < 1e-6, "{n}: {scale}");
        }
    }

    #[test]
    fn smooth_integrands_err_less_than_independent_samples() {
        for n in [8, 24, 64] {
            let scales = [0.1, 0.5, 1.0, 2.0, 4.0].map(|halves| of_mean(n, halves));
            assert!(scales.is_sorted() && scales[0] > 0.0 && scales[4] < 1.0 + 1e-9, "{scales:?}");
        }
    }

    #[test]
    fn parts_add_up_in_any_order() {
        let part = |x: f64| VarianceSums {
            sets: [fixed(x), fixed(0.3 * x)],
            halves: [fixed(x), fixed(2.0 * x)],
            ..VarianceSums::default()
        };
        let (mut a, mut b) = (part(0.1), part(1e-9));
        a.add(&part(1e-9));
        b.add(&part(0.1));
        assert_eq!(a, b);
        assert!((a.scale(8).inside - 0.3).abs() < 1e-9);
        assert_eq!(VarianceSums::default().scale(8), Scale { inside: 1.0, coverage: None });
    }

    /// Many edges show their own ratio, one shows little.
    #[test]
    fn edges_have_their_own_ratio() {
        let inside = VarianceSums { sets: [fixed(1.0), fixed(0.4)], ..VarianceSums::default() };
        let scale = |n_edges: u64, coverage: f64| {
            let mut sums = inside;
            let usual = usual_at_edges(16);
            // What surfaces send at edges varies as inside.
            let edge = Contrast::Edge([1.0, 2.0, 2.0 * usual, 0.4 + 2.0 * coverage]);
            sums.add(&VarianceSums::of((0..n_edges).map(|_| edge)));
            sums.scale(16)
        };
        assert!((scale(1000, 0.02).coverage.unwrap() - 0.02).abs() < 1e-3);
        assert!((scale(1, 0.02).coverage.unwrap() - 0.104).abs() < 1e-6);
        assert!((scale(1, 0.02).inside - 0.4).abs() < 1e-6);
        // No edge varies less than a tenth of what is usual.
        assert!((scale(1000, -1.0).coverage.unwrap() - 0.0125).abs() < 1e-6);
        assert_eq!(inside.scale(16).coverage, Some(0.125));
    }
}
