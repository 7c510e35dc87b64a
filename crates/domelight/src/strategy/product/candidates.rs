//! The candidates of a pixel: directions from the product table and from the material, weighed by the
//! balance heuristic.
//!
//! M strata of the table and N samples of the material are shared by the n camera hits of the pixel:
//! stratum k belongs to hit (k − r) mod n with one random r, so every hit has each stratum with
//! probability 1/n. A candidate stands for
//!
//! ```text
//! W = f(ω) L(ω) / (M p_table(ω) + N p_brdf(ω))        p_table = width(c)/total · L/W(c)
//! ```
//!
//! f and p_brdf those of its hit, and Σ W is an unbiased estimate of the mean over the hits of
//! ∫ f L dω: of each hit it is the multi-sample estimator of Veach & Guibas 1995 with counts M/n and
//! N/n in expectation.

use super::super::ShadingPoint;
use super::brdf_samples::BrdfSampleBatch;
use super::cells::Cells;
use super::control_variate::ControlVariate;
use super::light_samples::{LightSamplePool, LightSamples};
use super::table::Table;
use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::{Dimension, Sampler};
use crate::simd::{LANES, Lanes, Simd, SimdF32x8, SimdFloat, SimdI32x8};

/// A direction that may become a shadow ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// World direction.
    pub(super) wi: Vec3,
    /// W.
    pub(super) value: Rgb,
    /// Its luminance.
    pub(super) luminance: f32,
    /// The slot of the cell where its light is.
    pub(super) slot: u32,
    /// Which hit of the pixel.
    pub(super) hit: u32,
    /// π, as [`choose`](super::systematic) has it.
    pub(super) selection_probability: u32,
}

/// Candidates of one hit side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateBlock {
    pub(super) wi: [Lanes; 3],
    /// Black in a lane without a candidate.
    pub(super) value: [Lanes; 3],
    /// W without what the control variate knows of it.
    pub(super) residual: [Lanes; 3],
    pub(super) luminance: Lanes,
    pub(super) slots: [i32; LANES],
    /// π of each.
    pub(super) selection_probabilities: [i32; LANES],
}

impl CandidateBlock {
    /// One of them, of hit `hit`.
    #[inline(always)]
    pub(super) fn get(&self, lane: usize, hit: u32) -> Candidate {
        Candidate {
            wi: Vec3::from(self.wi.map(|c| c[lane])),
            value: Rgb::from(self.value.map(|c| c[lane])),
            luminance: self.luminance[lane],
            slot: self.slots[lane] as u32,
            hit,
            selection_probability: self.selection_probabilities[lane] as u32,
        }
    }
}

/// The candidates of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    /// From the table: as many blocks for each hit.
    pub(super) lights: Vec<CandidateBlock>,
    /// From the material.
    pub(super) brdf: Vec<Candidate>,
    /// Which hit each stratum is assigned to.
    pub(super) assignment: StratumAssignment,
    /// The slot of each stratum, where its candidate is in `lights`.
    slots: Vec<[i32; LANES]>,
    /// Memory of [`Table::assign_strata`].
    cell_starts: Vec<i32>,
    /// What those from the material look at.
    drawn: Vec<BrdfSampleBatch>,
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
    /// Of M strata to n hits, shifted by a number in [0, 1).
    pub(super) fn new(n_strata: usize, n_hits: usize, shift: f32) -> Self {
        Self { n_strata, n_hits, shift: (shift * n_hits as f32) as usize % n_hits.max(1) }
    }

    /// Blocks of each hit.
    pub(super) fn blocks(self) -> usize {
        self.n_strata.div_ceil(self.n_hits.max(1)).div_ceil(LANES)
    }

    /// The first stratum of a hit; every n-th follows.
    #[inline(always)]
    fn first(self, hit: usize) -> usize {
        let k = hit + self.shift;
        if k < self.n_hits { k } else { k - self.n_hits }
    }

    /// The places of strata 0 to M − 1 in blocks of hits that follow each other.
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

/// Where a stratum's candidate is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CandidateIndex {
    pub(super) hit: usize,
    /// Counted through all blocks.
    pub(super) lane: usize,
}

/// Strata of a table that share one random offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strata {
    /// M.
    pub(super) n: usize,
    /// ξ in [0, 1).
    pub(super) offset: f32,
    /// Their width in the running sum.
    pub(super) width: f32,
    /// What none may reach.
    total: f32,
}

impl Strata {
    /// `n` strata of a table of the given total.
    pub(super) fn new(n: usize, offset: f32, total: f32) -> Self {
        Self { n, offset, width: total / n as f32, total }
    }

    /// Where strata `first`, `first` + `step`, … fall in the running sum.
    #[inline(always)]
    pub(super) fn positions<S: Simd>(&self, simd: S, first: usize, step: usize) -> S::F32x8 {
        let k = simd.iota().to_f32() * simd.splat(step as f32) + simd.splat(first as f32);
        let last = simd.splat(self.total * (1.0 - f32::EPSILON));
        ((k + simd.splat(self.offset)) * simd.splat(self.width)).min(last)
    }
}

/// How many candidates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Strata of the table.
    pub(super) light: usize,
    /// Samples of the material.
    pub(super) brdf: usize,
}

/// Where candidates come from.
pub(super) struct Sources<'a> {
    pub(super) environment: &'a Environment,
    pub(super) cells: &'a Cells,
    pub(super) pool: &'a LightSamplePool,
    pub(super) table: &'a Table,
    /// None if visibility is not known.
    pub(super) control_variate: Option<&'a ControlVariate>,
}

/// The random numbers of a pixel in a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelSamples {
    /// The offset of all strata.
    pub(super) strata: f32,
    /// The offset of the choice of rays.
    pub(super) choice: f32,
    /// Shifts of the hits against the strata and against the samples of the material.
    shift: [f32; 2],
    pub(super) sampler: Sampler,
}

impl PixelSamples {
    /// From a sampler that serves this pixel in this pass alone.
    pub(super) fn new(sampler: Sampler) -> Self {
        let [strata, choice, a, b] = sampler.numbers(Dimension::Resampling, 0).0;
        Self { strata, choice, shift: [a, b], sampler }
    }

    /// The hit of sample `j` of the material, of `n` hits.
    pub(super) fn brdf_hit(&self, j: usize, n: usize) -> usize {
        (j + (self.shift[1] * n as f32) as usize) % n
    }
}

impl Sources<'_> {
    /// Draws all candidates. Some are black.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &self,
        simd: S,
        hits: Hits,
        diffuse: &[Rgb],
        counts: Counts,
        numbers: &PixelSamples,
        candidates: &mut Candidates,
    ) {
        let total = self.table.total();
        let n_strata = if total > 0.0 { counts.light } else { 0 };
        let assignment = StratumAssignment::new(n_strata, hits.points.len(), numbers.shift[0]);
        let strata = Strata::new(n_strata, numbers.strata, total);
        let scale = if n_strata > 0 { n_strata as f32 / total } else { 0.0 };
        candidates.assignment = assignment;
        // First, for what they look at comes from far.
        self.draw_samples(simd, hits, numbers, counts.brdf, &mut candidates.drawn);
        candidates.lights.clear();
        if n_strata > 0 {
            let Candidates { slots, cell_starts, .. } = &mut *candidates;
            self.table.assign_strata(simd, self.cells, &strata, assignment, cell_starts, slots);
        }
        for (hit, at) in hits.points.iter().enumerate() {
            let (bsdf, diffuse) = (hits.bsdf(hit), diffuse[hit]);
            let of_hit = HitContext { at, bsdf, diffuse, scale, n_brdf: counts.brdf as f32 };
            for block in 0..assignment.blocks() {
                let first = assignment.first(hit) + block * LANES * assignment.n_hits;
                let positions = strata.positions(simd, first, assignment.n_hits);
                let n = n_strata.saturating_sub(first).div_ceil(assignment.n_hits);
                let slots = simd.load_i32(&candidates.slots[hit * assignment.blocks() + block]);
                candidates.lights.push(self.draw_lights(simd, &of_hit, slots, positions, n));
            }
        }
        candidates.brdf.clear();
        for drawn in &candidates.drawn {
            let counts = [scale, counts.brdf as f32];
            self.weigh_samples(simd, drawn, counts, &mut candidates.brdf);
        }
    }

    /// The first `n` lanes of a block of strata that fall at `positions`.
    #[inline(always)]
    fn draw_lights<S: Simd>(
        &self,
        simd: S,
        of_hit: &HitContext,
        slots: S::I32x8,
        positions: S::F32x8,
        n: usize,
    ) -> CandidateBlock {
        let one = |x| simd.splat(x);
        let inside = self.table.inside(slots, positions);
        let LightSamples { wi, le, density } = self.pool.get(simd, slots, inside);
        let (f, pdf) = of_hit.at.eval_lanes(of_hit.bsdf, wi);
        let density = one(of_hit.scale) * self.table.widths(slots) * density;
        let weight = one(1.0) / (density + one(of_hit.n_brdf) * pdf);
        let there = simd.iota().to_f32().lt(one(n as f32));
        let weight = SimdFloat::select(there, weight, one(0.0));
        let value = f.zip(le, |f, le| f * le).scaled(weight);
        let residual = match self.control_variate {
            Some(control_variate) => {
                let cosine = wi.dot(of_hit.at.frame.z);
                let h = control_variate.eval(slots, wi, cosine, of_hit.diffuse);
                let weight = SimdFloat::select(there, one(1.0) / density, one(0.0));
                let known = h.zip(le, |h, le| h * le).scaled(weight);
                value.zip(known, |value, known| value - known)
            }
            None => value,
        };
        CandidateBlock {
            wi: wi.store(),
            value: value.store(),
            residual: residual.store(),
            luminance: value.luminance().store(),
            slots: slots.store(),
            selection_probabilities: [0; LANES],
        }
    }
}

/// The camera hits of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Hits<'a> {
    pub(super) points: &'a [ShadingPoint],
    /// The material of the first is that of all.
    pub(super) one_material: bool,
}

impl<'a> Hits<'a> {
    /// The material that a hit is sampled by.
    pub(super) fn bsdf(self, hit: usize) -> &'a Bsdf {
        &self.points[if self.one_material { 0 } else { hit }].bsdf
    }
}

/// A hit whose candidates are drawn.
struct HitContext<'a> {
    at: &'a ShadingPoint,
    bsdf: &'a Bsdf,
    /// What it reflects by the cosine.
    diffuse: Rgb,
    /// M over the total of the table.
    scale: f32,
    /// N.
    n_brdf: f32,
}
