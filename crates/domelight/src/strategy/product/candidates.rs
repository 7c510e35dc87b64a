//! The candidates of a pixel: directions from the product table, from the BRDF and to portals, weighted by the balance
//! heuristic.
//!
//! The n camera hits of the pixel share M strata of the table, N BRDF samples and Q points on portals:
//! stratum k belongs to hit (k − r) mod n with one random r, so every hit gets each stratum with
//! probability 1/n. A candidate stands for
//!
//! ```text
//! W = f(ω) L(ω) m(ω) / (M p_table(ω))       of a stratum         p_table = width(c)/total · L/W(c)
//! W = f(ω) L(ω)/q(ω)                         of another           m = M p₀/q     q = M p₀ + N p_brdf + Q p_portal
//! ```
//!
//! where f, p_brdf and p_portal are those of its hit, and p₀ is p_table without visibility. Σ W is an unbiased estimate of the mean
//! over the hits of ∫ f L dω: for each hit, it is the multi-sample estimator of Veach & Guibas 1995 with expected counts
//! M/n, N/n and Q/n. Its weights sum to 1 for any p_table. They must not follow V̂, because V̂ was learned from the pool: the
//! strata's part would then be a mean over the pool, the other part one over the map, of weights that hang together.

use super::super::ShadingPoint;
use super::brdf_samples::{BesideStrata, BrdfSampleBatch};
use super::candidate::{Candidate, CandidateBlock};
use super::cells::Cells;
use super::control_variate::ControlVariate;
use super::hits::Hits;
use super::light_samples::{LightSamplePool, LightSamples};
use super::strata::{Counts, PixelSamples, Strata, StratumAssignment};
use super::table::Table;
use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::environment::Environment;
use crate::simd::{LANES, Simd, SimdF32x8, SimdFloat, SimdI32x8, Vectors};
use crate::strategy::portal::Portals;

/// The candidates of a pixel.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    /// Candidates from the table, with the same number of blocks for each hit.
    pub(super) lights: Vec<CandidateBlock>,
    /// Candidates from the BRDF and from portals.
    pub(super) others: Vec<Candidate>,
    /// The assignment of strata to hits.
    pub(super) assignment: StratumAssignment,
    /// The slot of each stratum, where `lights` has its candidate.
    slots: Vec<[i32; LANES]>,
    /// Scratch memory of [`Table::assign_strata`].
    cell_starts: Vec<i32>,
    /// The texels that BRDF samples look up.
    drawn: Vec<BrdfSampleBatch>,
}

/// The sources of candidates.
pub(super) struct Sources<'a> {
    pub(super) environment: &'a Environment,
    pub(super) cells: &'a Cells,
    pub(super) pool: &'a LightSamplePool,
    pub(super) table: &'a Table,
    pub(super) portals: Portals<'a>,
    /// `None` if visibility is unknown.
    pub(super) control_variate: Option<&'a ControlVariate>,
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
        let assignment =
            StratumAssignment::new(n_strata, hits.points.len(), numbers.strata_shift());
        let strata = Strata::new(n_strata, numbers.strata, total);
        let per = |total: f32| if n_strata > 0 { n_strata as f32 / total } else { 0.0 };
        let (scale, product_scale) = (per(total), per(self.table.product_total()));
        candidates.assignment = assignment;
        // Begin with the BRDF samples, because their texels take long to arrive.
        let drawn = &mut candidates.drawn;
        drawn.clear();
        let portals = (self.portals, counts.portal);
        BrdfSampleBatch::draw(simd, self.environment, hits, numbers, counts.brdf, portals, drawn);
        BrdfSampleBatch::draw_portals(simd, self.environment, hits, numbers, portals, drawn);
        candidates.lights.clear();
        if n_strata > 0 {
            let Candidates { slots, cell_starts, .. } = &mut *candidates;
            self.table.assign_strata(simd, self.cells, &strata, assignment, cell_starts, slots);
        }
        for (hit, at) in hits.points.iter().enumerate() {
            let (bsdf, diffuse) = (hits.bsdf(hit), diffuse[hit]);
            let [n_brdf, n_portal] = [counts.brdf, counts.portal].map(|n| n as f32);
            let of_hit = HitContext { at, bsdf, diffuse, scale, product_scale, n_brdf, n_portal };
            for block in 0..assignment.blocks() {
                let first = assignment.first(hit) + block * LANES * assignment.n_hits;
                let positions = strata.positions(simd, first, assignment.n_hits);
                let n = n_strata.saturating_sub(first).div_ceil(assignment.n_hits);
                let slots = simd.load_i32(&candidates.slots[hit * assignment.blocks() + block]);
                candidates.lights.push(self.draw_lights(simd, &of_hit, slots, positions, n));
            }
        }
        candidates.others.clear();
        let Self { environment, cells, table, .. } = *self;
        let n_brdf = counts.brdf as f32;
        let beside = BesideStrata { environment, cells, table, strata: product_scale, n_brdf };
        for drawn in &candidates.drawn {
            drawn.weigh(simd, &beside, &mut candidates.others);
        }
    }

    /// The first `n` lanes of a block of strata at `positions`.
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
        let product = one(of_hit.product_scale) * self.table.products(slots) * density;
        let density = one(of_hit.scale) * self.table.widths(slots) * density;
        let mut weight = one(1.0) / density;
        if of_hit.n_brdf + of_hit.n_portal > 0.0 {
            let mut all = product + one(of_hit.n_brdf) * pdf;
            if of_hit.n_portal > 0.0 {
                let from = Vectors::splat(pdf, of_hit.at.position);
                all = all + one(of_hit.n_portal) * self.portals.pdf(from, wi);
            }
            weight = weight * (product / all);
        }
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

/// A hit for which candidates are drawn.
struct HitContext<'a> {
    at: &'a ShadingPoint,
    bsdf: &'a Bsdf,
    /// Its diffuse albedo.
    diffuse: Rgb,
    /// M divided by the total of the table.
    scale: f32,
    /// M divided by the total without visibility.
    product_scale: f32,
    /// N.
    n_brdf: f32,
    /// Q.
    n_portal: f32,
}
