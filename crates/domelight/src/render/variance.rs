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

use crate::math::functions;

/// Sums over pixels from which their variance is estimated. They hold whole numbers, so that the sums of parts of a
/// picture add up to those of the whole in any order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VarianceSums {
    sets: [i128; 2],
    halves: [i128; 2],
}

/// A pixel's contribution to [`VarianceSums`], summed over channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Contrast {
    /// Two independent sets: s²/n, and the variance from their difference.
    Sets([f64; 2]),
    /// One sequence: s²/N of its longest prefix of N = 2^k samples, and D² of the halves of this prefix.
    Halves([f64; 2]),
}

impl VarianceSums {
    /// Adds the pixels of another part of the picture.
    pub fn add(&mut self, other: &Self) {
        let sums = self.sets.iter_mut().chain(&mut self.halves);
        let others = other.sets.iter().chain(&other.halves);
        sums.zip(others).for_each(|(sum, x)| *sum = sum.saturating_add(*x));
    }

    /// Sums the contributions of some pixels.
    pub(super) fn of(contrasts: impl Iterator<Item = Contrast>) -> Self {
        let mut sums = Self::default();
        for contrast in contrasts {
            let mut of_pixel = Self::default();
            match contrast {
                Contrast::Sets(sets) => of_pixel.sets = sets.map(fixed),
                Contrast::Halves(halves) => of_pixel.halves = halves.map(fixed),
            }
            sums.add(&of_pixel);
        }
        sums
    }

    /// The ratio of the variance of the mean of `n` samples to s²/n.
    pub(super) fn scale(&self, n: u32) -> f64 {
        let [independent, measured] = self.sets.map(|sum| sum as f64);
        if independent > 0.0 {
            return measured / independent;
        }
        let [independent, halves] = self.halves.map(|sum| sum as f64);
        if independent > 0.0 { of_mean(n, halves / independent) } else { 1.0 }
    }
}

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
        };
        let (mut a, mut b) = (part(0.1), part(1e-9));
        a.add(&part(1e-9));
        b.add(&part(0.1));
        assert_eq!(a, b);
        assert!((a.scale(8) - 0.3).abs() < 1e-9);
        assert_eq!(VarianceSums::default().scale(8), 1.0);
    }
}
