//! The strata of a pixel's table: their number, their assignment to hits, and their random offsets.

use crate::sampling::{Dimension, Sampler};
use crate::simd::{LANES, Simd, SimdFloat, SimdI32x8};

/// The numbers of candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Strata of the table.
    pub(super) light: usize,
    /// BRDF samples.
    pub(super) brdf: usize,
    /// Points on portals.
    pub(super) portal: usize,
}

impl Counts {
    pub(super) fn total(self) -> usize {
        self.light + self.brdf + self.portal
    }

    /// The same number of candidates, with BRDF samples in at least `share` of the places of strata and BRDF samples; one
    /// stratum remains.
    pub(super) fn with_brdf_share(self, share: f32) -> Self {
        let all = self.light + self.brdf;
        let brdf = self.brdf.max((share * all as f32) as usize).min(all - 1);
        Self { light: all - brdf, brdf, ..self }
    }
}

/// The assignment of strata to hits: stratum k belongs to hit (k − r) mod n.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StratumAssignment {
    /// M.
    n_strata: usize,
    /// n.
    pub(super) n_hits: usize,
    /// r.
    shift: usize,
}

impl StratumAssignment {
    /// Assigns M strata to n hits; `shift` in [0, 1) determines r.
    pub(super) fn new(n_strata: usize, n_hits: usize, shift: f32) -> Self {
        Self { n_strata, n_hits, shift: (shift * n_hits as f32) as usize % n_hits.max(1) }
    }

    /// The number of blocks per hit.
    pub(super) fn blocks(self) -> usize {
        self.n_strata.div_ceil(self.n_hits.max(1)).div_ceil(LANES)
    }

    /// The first stratum of a hit; every n-th follows.
    #[inline(always)]
    pub(super) fn first(self, hit: usize) -> usize {
        let k = hit + self.shift;
        if k < self.n_hits { k } else { k - self.n_hits }
    }

    /// The positions of strata 0 to M − 1 in consecutive blocks of hits.
    #[inline(always)]
    pub(super) fn indices(self) -> impl Iterator<Item = CandidateIndex> {
        let (n, stride) = (self.n_hits, self.blocks() * LANES);
        let start = if self.shift == 0 { 0 } else { n - self.shift };
        let mut next = CandidateIndex { hit: start, lane: start * stride };
        let mut left = n;
        (0..self.n_strata).map(move |_| {
            let index = next;
            next.hit += 1;
            next.lane += stride;
            if next.hit == n {
                next = CandidateIndex { hit: 0, lane: next.lane - n * stride };
            }
            left -= 1;
            if left == 0 {
                next.lane += 1;
                left = n;
            }
            index
        })
    }
}

/// The position of a stratum's candidate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CandidateIndex {
    pub(super) hit: usize,
    /// The lane, counted over all blocks.
    pub(super) lane: usize,
}

/// Strata of a table that share one random offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strata {
    /// M.
    pub(super) n: usize,
    /// ξ in [0, 1).
    pub(super) offset: f32,
    /// The width of a stratum in the running sum.
    pub(super) width: f32,
    /// The exclusive upper bound of positions.
    total: f32,
}

impl Strata {
    /// Creates `n` strata of a table with the given total.
    pub(super) fn new(n: usize, offset: f32, total: f32) -> Self {
        Self { n, offset, width: total / n as f32, total }
    }

    /// The positions of strata `first`, `first` + `step`, … in the running sum.
    #[inline(always)]
    pub(super) fn positions<S: Simd>(&self, simd: S, first: usize, step: usize) -> S::F32x8 {
        let k = simd.iota().to_f32() * simd.splat(step as f32) + simd.splat(first as f32);
        let last = simd.splat(self.total * (1.0 - f32::EPSILON));
        ((k + simd.splat(self.offset)) * simd.splat(self.width)).min(last)
    }
}

/// The random numbers of a pixel in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelSamples {
    /// The offset of all strata.
    pub(super) strata: f32,
    /// The offset of the selection of rays.
    pub(super) choice: f32,
    /// Shifts of the hits relative to the strata and to the BRDF samples.
    shift: [f32; 2],
    pub(super) sampler: Sampler,
}

impl PixelSamples {
    /// Draws the numbers from a sampler used only by this pixel in this pass.
    pub(super) fn new(sampler: Sampler) -> Self {
        let [strata, choice, a, b] = sampler.numbers(Dimension::Resampling, 0).0;
        Self { strata, choice, shift: [a, b], sampler }
    }

    /// The hit of BRDF sample or portal sample `j`, of `n` hits.
    pub(super) fn hit_of_sample(&self, j: usize, n: usize) -> usize {
        (j + (self.shift[1] * n as f32) as usize) % n
    }

    /// The shift of the hits relative to the strata, in [0, 1).
    pub(super) fn strata_shift(&self) -> f32 {
        self.shift[0]
    }
}
