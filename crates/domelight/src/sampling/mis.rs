//! Weights that combine sampling techniques: Veach & Guibas 1995, "Optimally Combining Sampling
//! Techniques for Monte Carlo Rendering".
//!
//! The multi-sample estimator is Σᵢ (1/nᵢ) Σⱼ wᵢ(xᵢⱼ) f(xᵢⱼ) / pᵢ(xᵢⱼ) with Σᵢ wᵢ = 1. Weights that
//! sum to one must not be combined with a common factor 1/(M + N): two techniques with M = N samples
//! would then give exactly half the result.

use crate::simd::SimdFloat;

/// The heuristic that computes a sample's weight from the densities of the techniques.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// wᵢ = nᵢ pᵢ / Σₖ nₖ pₖ.
    #[default]
    Balance,
    /// wᵢ = (nᵢ pᵢ)² / Σₖ (nₖ pₖ)².
    Power,
}

impl Heuristic {
    /// The weight in [0, 1] of a sample from one technique. `n_pdf` is its count times its density, and
    /// `other` the same for the other technique; both are non-negative and in the same measure.
    ///
    /// A technique with an infinite density gets weight 1, and an impossible sample gets 0.
    pub fn weight(self, n_pdf: f32, other: f32) -> f32 {
        self.weight_lanes(n_pdf, other)
    }

    /// The `other` of [`Heuristic::weight`] that stands for two further techniques with these n pdf.
    #[inline(always)]
    pub(crate) fn together<F: SimdFloat>(self, [a, b]: [F; 2]) -> F {
        match self {
            Self::Balance => a + b,
            Self::Power => {
                // The ratio keeps the squares in range.
                let zero = a.splat(0.0);
                let (most, least) = (a.max(b), a.min(b));
                let ratio = F::select(least.lt(most), least / most, a.splat(1.0));
                F::select(zero.lt(most), most * (a.splat(1.0) + ratio * ratio).sqrt(), zero)
            }
        }
    }

    /// [`Heuristic::weight`] of one sample or of several side by side.
    #[inline(always)]
    pub(crate) fn weight_lanes<F: SimdFloat>(self, n_pdf: F, other: F) -> F {
        let (zero, one, infinity) =
            (other.splat(0.0), other.splat(1.0), other.splat(f32::INFINITY));
        // The ratio keeps the squares in range: neither ∞² nor ∞ / ∞ can come up.
        let are_infinite = infinity.le(n_pdf) & infinity.le(other);
        let ratio = F::select(are_infinite, one, other / n_pdf);
        let term = match self {
            Self::Balance => ratio,
            Self::Power => ratio * ratio,
        };
        F::select(zero.lt(n_pdf), one / (one + term), zero)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_two_techniques_sum_to_one() {
        for h in [Heuristic::Balance, Heuristic::Power] {
            for (a, b) in [(1.0, 2.0), (1e-30, 1e30), (3e38, 3e38), (1e-20, 0.0), (5.0, 1e-38)] {
                assert!((h.weight(a, b) + h.weight(b, a) - 1.0).abs() < 1e-6, "{h:?} {a} {b}");
            }
            assert_eq!(h.weight(0.0, 0.0), 0.0);
            assert_eq!(h.weight(f32::INFINITY, 1.0), 1.0);
            assert_eq!(h.weight(1.0, f32::INFINITY), 0.0);
            assert_eq!(h.weight(f32::INFINITY, f32::INFINITY), 0.5);
        }
    }
}
