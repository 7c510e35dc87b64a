//! The estimator of product sampling, step by step.
//!
//! For a pixel with hits x and cells c of the map (in the notation of [`super`]):
//!
//! ```text
//! pilot    I = Σ_j W_j V_j                                                               all candidates traced
//! others   I = Σ_c V̂_c ∫_c h L + Σ_j V̂_j (W_j − h_j L_j/p_j) + Σ_chosen (W_j/π_j) (V_j − V̂_j)
//! ```
//!
//! Only the terms with V are rays; all others form the pixel's base.

use super::candidates::Sources;
use super::cells::Cells;
use super::hits::Hits;
use super::rays::Rays;
use super::strata::{Counts, PixelSamples};
use super::systematic::SystematicSampler;
use super::visibility::{Blocks, VisibilityStats};
use super::{LightSamplePool, ProductSampling, ProductScratch, TOLERANCE};
use crate::Rgb;
use crate::math::{Vec3, functions};
use crate::simd::{Kernel, Simd};
use crate::strategy::levels::coarser;
use crate::strategy::portal::Portals;
use crate::strategy::{Contributions, PixelPoints, ShadingPoint, TileShading};

/// Estimates a tile in one round.
pub(super) struct TileEstimator<'a, 'e> {
    pub(super) strategy: &'a ProductSampling<'e>,
    pub(super) cells: &'a Cells,
    pub(super) pool: &'a LightSamplePool,
    pub(super) tile: &'a TileShading<'a>,
    /// Whether this is the first level, where visibility is unknown.
    pub(super) pilots: bool,
    pub(super) scratch: &'a mut ProductScratch,
    pub(super) out: &'a mut Contributions,
}

impl Kernel for TileEstimator<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let Self { tile, pilots, .. } = self;
        let blocks = tile.blocks();
        if !pilots {
            let ProductScratch { visibility, visibility_stats, briefing, .. } = &mut *self.scratch;
            let has_portals = !tile.portals.is_empty();
            let scouts = (&briefing.counts, briefing.everywhere.as_deref());
            visibility.estimate(simd, self.cells, visibility_stats, scouts, blocks, has_portals);
        }
        self.scratch.targets.clear();
        self.scratch.sampled_pixels.clear();
        for (i, pixel) in tile.pixels.iter().enumerate() {
            if !pixel.points.is_empty() {
                let block = blocks.of(i % tile.width, i / tile.width);
                self.sample_pixel(simd, i, pixel, block);
            }
        }
    }
}

// In WebAssembly, the whole module has the vector instructions, and browsers compile short functions better.
impl TileEstimator<'_, '_> {
    /// Chooses the rays of a pixel, and sets the part of its points that needs no rays.
    #[inline(always)]
    fn sample_pixel<S: Simd>(&mut self, simd: S, i: usize, pixel: &PixelPoints, block: usize) {
        let tile = self.tile;
        let points = &tile.points[pixel.points.clone()];
        let hits = Hits { points, one_material: pixel.one_material };
        self.scratch.sampled_pixels.push(i);
        // Group the hits by surface and normal.
        self.scratch.groups.cluster(hits);
        let has_portals = !tile.portals.is_empty();
        let counts =
            self.strategy.counts(&self.scratch.groups, points.len(), self.pilots, has_portals);
        // Tabulate light times reflectance over the cells (Clarberg & Akenine-Möller 2008, section 3), and divide it
        // between strata and BRDF samples.
        let counts = self.tabulate_product(simd, block, counts, points);
        // Draw candidates from the table and from the BRDF, weighted by the balance heuristic (Veach 1997, eq. 9.8).
        let numbers = self.pixel_numbers(pixel);
        self.draw_candidates(simd, hits, counts, &numbers);
        if self.pilots {
            // Trace all candidates.
            let ProductScratch { candidates, targets, .. } = &mut *self.scratch;
            Rays { pixel, out: self.out, targets }.push_all(candidates);
            return;
        }
        // Integrate the control variate through the estimated visibility.
        let known = self.integrate_control_variate(simd, pixel, points, block);
        // Choose the candidates whose visibility matters, and correct the estimate with them (Horvitz & Thompson 1952).
        let importance = self.importance(i, pixel, known, counts);
        self.choose_rays(simd, pixel, block, importance, numbers.choice);
    }

    /// Fills the table and, except for pilots, the control variate. Returns the numbers of candidates.
    ///
    /// Strata follow the light times the uncertainty of visibility, but the balance heuristic weights them by the product
    /// and what scouts have seen, because BRDF samples do not come from the pool from which the tile has learned.
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn tabulate_product<S: Simd>(
        &mut self,
        simd: S,
        block: usize,
        counts: Counts,
        points: &[ShadingPoint],
    ) -> Counts {
        let cells = self.cells;
        let ProductScratch {
            groups,
            table,
            control_variate,
            visibility,
            briefing,
            strata_share,
            lobe_share,
            ..
        } = &mut *self.scratch;
        let rms = &briefing.rms;
        if self.pilots {
            table.fill::<S, false>(simd, cells, &groups.all, control_variate);
        } else {
            table.fill::<S, true>(simd, cells, &groups.all, control_variate);
        }
        let counts = lobe_share.divide(simd, cells, (table, rms), groups, counts);
        lobe_share.apply(simd, cells, table, control_variate);
        table.keep_product(simd, cells, rms);
        if self.pilots {
            for pair in cells.pairs() {
                table.scale(simd, pair, rms.pair(simd, pair));
            }
            table.accumulate(simd, cells);
            return counts;
        }
        if counts.portal > 0 {
            let strata = counts.light as f32 / table.product_total().max(f32::MIN_POSITIVE);
            let portals = (Portals::new(self.tile.portals), counts.portal);
            let position = points.iter().map(|p| p.position).sum::<Vec3>() / points.len() as f32;
            strata_share.fill(simd, cells, table, portals, strata, position);
            strata_share.apply(simd, cells, table, control_variate);
        }
        let (above, is_glossy) = (&control_variate.above, groups.is_glossy());
        table.weight_by_visibility(simd, cells, above, visibility.of(block), is_glossy);
        table.accumulate(simd, cells);
        let brdf_share = groups.brdf_share(counts, table.product_total());
        control_variate.balance(simd, cells, rms, brdf_share);
        counts
    }

    /// The random numbers of a pixel in the pass.
    fn pixel_numbers(&self, pixel: &PixelPoints) -> PixelSamples {
        // The first camera sample that hits distinguishes passes.
        PixelSamples::new(pixel.sampler.part(self.tile.samples[pixel.points.start]))
    }

    /// Draws strata along the curve, each with a direction from the pool, and BRDF samples.
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn draw_candidates<S: Simd>(
        &mut self,
        simd: S,
        hits: Hits,
        counts: Counts,
        numbers: &PixelSamples,
    ) {
        let (environment, cells, pool) = (&*self.strategy.environment, self.cells, self.pool);
        let ProductScratch { groups, table, control_variate, candidates, .. } = &mut *self.scratch;
        let control_variate = (!self.pilots).then_some(&*control_variate);
        let portals = Portals::new(self.tile.portals);
        let sources = Sources { environment, cells, pool, table, portals, control_variate };
        sources.draw(simd, hits, &groups.diffuse, counts, numbers, candidates);
    }

    /// Adds Σ_c V̂_c ∫_c h L to each point. Returns the mean luminance over the points.
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn integrate_control_variate<S: Simd>(
        &mut self,
        simd: S,
        pixel: &PixelPoints,
        points: &[ShadingPoint],
        block: usize,
    ) -> f32 {
        let ProductScratch { groups, control_variate, visibility, targets, .. } =
            &mut *self.scratch;
        let mut rays = Rays { pixel, out: self.out, targets };
        let integral =
            control_variate.integral(simd, self.cells, self.pool, visibility.of(block).0);
        let mut known = Rgb::BLACK;
        for (hit, (at, &diffuse)) in points.iter().zip(&groups.diffuse).enumerate() {
            let of_hit = integral.eval(at.frame.z, diffuse);
            *rays.base(hit as u32) += of_hit;
            known += of_hit;
        }
        known.luminance().max(0.0) / points.len() as f32
    }

    /// The factor from a candidate's standard deviation to its selection probability π: the reciprocal of the error
    /// that the pixel's brightness tolerates.
    fn importance(&self, i: usize, pixel: &PixelPoints, known: f32, counts: Counts) -> f32 {
        let Self { strategy, tile, .. } = *self;
        let n_points = pixel.points.len() as f32;
        // Limit the brightness by the pixel's own estimate, because it may lie in a shadow or next to a highlight.
        let brightness = strategy.expected_brightness(tile, &self.scratch.visibility_stats, i);
        let brightness = brightness.min(functions::hypot(known, strategy.dark(tile)));
        let n = counts.total() as f32;
        let tolerance = TOLERANCE[usize::from(self.scratch.groups.is_glossy())];
        let covered = n_points / pixel.n_samples as f32;
        covered * n / (tolerance * brightness)
    }

    /// Adds Σ_j V̂_j (W_j − h_j L_j/p_j) − Σ_chosen (W_j/π_j) V̂_j to each point, and traces the chosen candidates.
    #[cfg_attr(target_family = "wasm", inline(never))]
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    fn choose_rays<S: Simd>(
        &mut self,
        simd: S,
        pixel: &PixelPoints,
        block: usize,
        importance: f32,
        choice: f32,
    ) {
        let ProductScratch { candidates, chosen, visibility, targets, .. } = &mut *self.scratch;
        let visibility = visibility.of(block);
        let mut rays = Rays { pixel, out: self.out, targets };
        rays.weigh_candidates(simd, candidates, visibility, importance);
        rays.push_chosen(candidates, visibility.0, SystematicSampler::new(choice), chosen);
    }
}

impl TileShading<'_> {
    /// The blocks of pixels that learn visibility together.
    pub(super) fn blocks(&self) -> Blocks {
        Blocks::new(self.width, self.pixels.len() / self.width.max(1))
    }
}

impl ProductSampling<'_> {
    /// The predicted brightness of a pixel: the harmonic mean over its neighbors of lower levels, because a dark
    /// neighbor marks the edge of a shadow.
    fn expected_brightness(
        &self,
        tile: &TileShading,
        visibility_stats: &VisibilityStats,
        pixel: usize,
    ) -> f32 {
        let around = coarser(pixel, tile.width, tile.pixels.len());
        let known = around.filter_map(|i| visibility_stats.luminance(i));
        let dark = self.dark(tile);
        let add = |(n, sum), luminance| (n + 1.0, sum + 1.0 / functions::hypot(luminance, dark));
        let (n, sum) = known.fold((0.0, 0.0), add);
        if n > 0.0 { n / sum } else { dark }
    }
}
