//! The selection of rays: each candidate j is traced with its own probability π_j and weighted by 1/π_j
//! (Horvitz & Thompson 1952).
//!
//! ```text
//! π_j = min(1, W_j g_j / τ)
//! ```
//!
//! W_j is the candidate's contribution to the pixel, g_j the uncertainty of its visibility, and τ the
//! tolerated error. τ is proportional to the brightness of the pixel *with* shadows; the brightness
//! without shadows would make it far too coarse in shadow.
//!
//! The selection is systematic (Madow 1949): a running sum of the π_j along the curve, from one random
//! offset, selects a candidate whenever it passes an integer. Each is selected with probability exactly
//! π_j, and the selected candidates are spread over the sky.

use crate::simd::{LANES, Simd, SimdF32x8, SimdFloat, SimdI32x8};

/// π = 1: probabilities are multiples of 2⁻²⁴, so that their running sum is exact.
const ONE: u32 = 1 << 24;

/// π of a candidate with size W_j g_j/τ: positive if the size is.
#[inline(always)]
pub(super) fn probability(size: f32) -> u32 {
    let rounded = (size.min(1.0) * (ONE - 1) as f32) as u32;
    if size > 0.0 { rounded + 1 } else { 0 }
}

/// [`probability`] of several candidates.
#[inline(always)]
pub(super) fn probabilities<S: Simd>(simd: S, size: S::F32x8) -> [i32; LANES] {
    let rounded = (size.min(simd.splat(1.0)) * simd.splat((ONE - 1) as f32)).to_i32();
    let positive = simd.splat(0.0).lt(size);
    SimdI32x8::select(positive, rounded + simd.splat_i32(1), simd.splat_i32(0)).store()
}

/// 1/π.
#[inline(always)]
pub(super) fn weight(probability: u32) -> f32 {
    ONE as f32 / probability as f32
}

/// A systematic sample in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct SystematicSampler {
    /// Modulo 2⁸ selections.
    sum: u32,
}

impl SystematicSampler {
    /// Starts at an offset in [0, 1).
    pub(super) fn new(offset: f32) -> Self {
        Self { sum: (offset * ONE as f32) as u32 }
    }

    /// Whether a candidate of the given probability is chosen.
    #[inline(always)]
    pub(super) fn select(&mut self, probability: u32) -> bool {
        let before = self.sum;
        self.sum = before.wrapping_add(probability);
        (before ^ self.sum) >= ONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;
    use testkit::ZTest;

    /// The expected sum of x/π over the chosen candidates is the sum of x over all, for any x.
    #[test]
    fn systematic_sampling_is_unbiased() {
        let mut pcg = Pcg32::new(3, 4);
        let sizes: Vec<f32> = (0..40).map(|_| (6.0 * pcg.next_f32() - 3.0).exp()).collect();
        let values: Vec<f32> = (0..40).map(|_| pcg.next_f32()).collect();
        let expected: f64 = values.iter().map(|&v| f64::from(v)).sum();
        let mut offsets = Pcg32::new(7, 8);
        let test = ZTest::in_suite_of(3);
        for threshold in [0.1, 1.0, 30.0] {
            let batches = testkit::batches(40, 500, || {
                let mut sampler = SystematicSampler::new(offsets.next_f32());
                let chosen = sizes.iter().zip(&values).filter_map(|(&size, &value)| {
                    let p = probability(size / threshold);
                    sampler.select(p).then(|| f64::from(weight(p) * value))
                });
                [chosen.sum()]
            });
            test.against(&format!("τ = {threshold}"), &batches, [expected]).unwrap();
        }
    }

    /// Of n candidates with π = p, n p are chosen, up to a difference of one.
    #[test]
    fn the_choice_is_systematic() {
        let mut sampler = SystematicSampler::new(0.3);
        let chosen: Vec<usize> = (0..16).filter(|_| sampler.select(probability(0.25))).collect();
        assert_eq!(chosen, [2, 6, 10, 14]);
        let mut sampler = SystematicSampler::new(0.0);
        assert!((0..1000).all(|_| sampler.select(probability(2.0))));
        assert!((0..1000).all(|_| !sampler.select(probability(0.0))));
        assert_eq!((probability(1.0), weight(ONE)), (ONE, 1.0));
        assert_eq!(probability(1e-30), 1);
    }
}
