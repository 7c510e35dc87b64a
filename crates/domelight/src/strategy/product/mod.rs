//! Product sampling: rays follow light times reflectance, and visibility is learned on the way.
//!
//! Once for an environment its map is cut into some hundred `cells` along Hilbert's curve. Each pass draws
//! `light_samples`, a pool of directions, in every cell. Then, pixel by pixel, all its camera hits together:
//!
//! 1. A `table` gives each cell its light times what the pixel reflects of it.
//! 2. `candidates`: strata along the curve, each with one direction of the pool, and samples of the
//!    material where the table does not know it well, weighed by the balance heuristic.
//! 3. The tile's pixels come in [levels](super::levels). Those of the first, *pilots*, trace all their candidates.
//!    From the rays of each level the tile learns the `visibility` V̂ of each cell and the brightness of its pixels.
//! 4. What the next levels reflect of light that is seen through V̂ is known but for its details: the integral of
//!    a `control_variate` h over all cells. `systematic` sampling traces those candidates whose visibility matters:
//!
//! ```text
//! base = Σ_c V̂_c ∫ h L + Σ_j V̂_j (W_j − h_j L_j/p_j) − Σ_chosen (W_j/π_j) V̂_j        rays: weight W_j/π_j
//! ```
//!
//!    For diffuse pixels, where the control variate is exact, the density is proportional to the uncertainty of
//!    visibility.
//!
//! The expectation is ∫ f L V dω for every V̂, brightness and pool, given that they do not depend on
//! the numbers that strata, samples and choice are drawn with: V̂ and brightness come from pixels of lower levels,
//! and each pixel and pass has a sampler of its own. V̂ has the pool in common with the candidates. That does
//! no harm: given the pool, strata draw nothing else, and the expectation of their part is a sum over the pool
//! whatever V̂ and the density made of it are. Samples of the material do not come from the pool, so where there are any
//! the density depends on the pixel's hits alone.
//!
//! Related: Clarberg & Akenine-Möller 2008, "Practical Product Importance Sampling for Direct
//! Illumination", multiplies trees of BRDF and map; Atanasov et al. 2018, "Adaptive Environment
//! Sampling on CPU and GPU", learns visibility for the density.

mod brdf_samples;
mod candidate;
mod candidates;
mod cells;
mod control_variate;
mod estimator;
mod hits;
mod light_samples;
mod rays;
mod strata;
mod systematic;
mod table;
#[cfg(test)]
mod test_support;
mod visibility;

pub use light_samples::LightSamplePool;

use std::borrow::Cow;

use super::levels::N_LEVELS;
use super::{Contributions, PixelPoints, Strategy, TileShading};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::functions;
use crate::sampling::Sampler;
use crate::simd::{InstructionSet, dispatch};
use candidates::Candidates;
use cells::Cells;
use control_variate::ControlVariate;
use estimator::TileEstimator;
use hits::Groups;
use light_samples::PassLength;
use strata::{CandidateIndex, Counts};
use table::Table;
use visibility::{VisibilityEstimate, VisibilityStats};

/// Camera samples of a pass: strata that one random offset spreads over all of them are worth more
/// than the same number in two sets.
const SAMPLES_PER_PASS: u32 = 64;

/// A pilot of a short pass has as many times the candidates of other pixels: it has no control variate, and it
/// teaches.
const PILOT: usize = 2;

/// Candidates of a pixel in a pass, for the sake of memory.
const MAX_CANDIDATES: u32 = 1 << 14;

/// One candidate in this many comes from the material where the table approximates it badly: where normals spread or
/// the view is oblique, and for lobes narrower than most cells.
const BRDF_SHARE: [usize; 2] = [8, 4];

/// The roughness below which a lobe is narrower than most cells.
const NARROW: f32 = 0.1;

/// The error of a candidate that does not matter, as a share of the pixel's brightness over the
/// number of candidates: of a diffuse pixel, where nothing else is left to chance, and of a glossy one.
const TOLERANCE: [f32; 2] = [0.15, 0.35];

/// Pixels darker than this share of the environment's mean are not held to their own brightness.
const DARK: f32 = 0.15;

/// Product sampling: up to N rays for each camera sample, in proportion to light, reflectance and learned visibility.
#[derive(Clone, Debug)]
pub struct ProductSampling<'a> {
    /// The environment with texels about as wide as high, so that cells are.
    environment: Cow<'a, Environment>,
    /// The cells of short passes and of long ones; none under a black sky.
    cells: Option<[Cells; 2]>,
    /// Luminance below which brightness does not count.
    dark: f32,
    n_rays: u32,
    instruction_set: InstructionSet,
}

impl<'a> ProductSampling<'a> {
    /// Product sampling with at most `n_rays` ≥ 1 shadow rays for each camera sample that hits, and twice as many in
    /// pilots (one pixel of 16). This is the number of candidates; those that cannot change the pixel visibly are not
    /// traced.
    pub fn new(environment: &'a Environment, n_rays: u32) -> Self {
        let mean = environment.power() / (4.0 * std::f64::consts::PI);
        let environment = environment.reshaped().map_or(Cow::Borrowed(environment), Cow::Owned);
        Self {
            cells: Cells::new(
                &environment,
                [PassLength::Short, PassLength::Long].map(PassLength::rows),
            ),
            dark: (f64::from(DARK) * mean) as f32,
            n_rays: n_rays.max(1),
            instruction_set: InstructionSet::best(),
            environment,
        }
    }

    /// The same with another instruction set; `None` if this processor lacks it. All give the same bits:
    /// this is for comparing them.
    #[must_use]
    pub fn with_instruction_set(mut self, instruction_set: InstructionSet) -> Option<Self> {
        self.instruction_set = instruction_set;
        instruction_set.is_available().then_some(self)
    }

    /// How many candidates the hits of a pixel have together.
    fn counts(&self, groups: &Groups, n_hits: usize, pilot: bool) -> Counts {
        let times = if pilot && PassLength::new(n_hits) == PassLength::Short { PILOT } else { 1 };
        let all = self.n_rays as usize * n_hits * times;
        let brdf = match groups.narrowest() {
            Some(width) if width < NARROW => all.div_ceil(BRDF_SHARE[1]),
            Some(width) if !groups.is_well_tabulated(width) => all.div_ceil(BRDF_SHARE[0]),
            _ => 0,
        };
        Counts { light: all - brdf, brdf }
    }

    /// The cells of a pass.
    fn cells(&self, length: PassLength) -> Option<&Cells> {
        let [of_short, of_long] = self.cells.as_ref()?;
        Some(match length {
            PassLength::Short => of_short,
            PassLength::Long => of_long,
        })
    }

    /// The brightness of a pixel that its error is measured by.
    fn brightness(&self, luminance: f32) -> f32 {
        functions::hypot(luminance, self.dark)
    }
}

/// Memory of [`ProductSampling`].
#[derive(Clone, Debug, Default)]
pub struct ProductScratch {
    groups: Groups,
    table: Table,
    control_variate: ControlVariate,
    candidates: Candidates,
    /// The chosen strata's candidates.
    chosen: Vec<CandidateIndex>,
    visibility: VisibilityEstimate,
    /// The slot of the cell that each ray of the round goes to.
    targets: Vec<u16>,
    /// The pixels of the round that have hits.
    sampled_pixels: Vec<usize>,
    visibility_stats: VisibilityStats,
}

impl Strategy for ProductSampling<'_> {
    type Pass = LightSamplePool;
    type Scratch = ProductScratch;

    fn n_rounds(&self) -> u32 {
        N_LEVELS
    }

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        self.n_rays
    }

    fn samples_per_pass(&self) -> Option<u32> {
        Some((MAX_CANDIDATES / self.n_rays).clamp(1, SAMPLES_PER_PASS))
    }

    fn begin_pass(&self, sampler: Sampler, n_samples: u32) -> LightSamplePool {
        let length = PassLength::new(n_samples as usize);
        let draw = |cells| LightSamplePool::draw(cells, &self.environment, sampler, length);
        self.cells(length).map_or_else(LightSamplePool::empty, draw)
    }

    fn push(
        &self,
        pool: &LightSamplePool,
        tile: &TileShading,
        round: u32,
        scratch: &mut ProductScratch,
        out: &mut Contributions,
    ) {
        let Some(cells) = self.cells(pool.length) else { return };
        if round == 0 {
            scratch.visibility_stats.reset(tile.blocks(), tile.pixels.len());
        }
        if tile.points.is_empty() {
            scratch.sampled_pixels.clear();
            return;
        }
        let pilots = round == 0;
        let estimator = TileEstimator { strategy: self, cells, pool, tile, pilots, scratch, out };
        dispatch(self.instruction_set, estimator);
    }

    fn learn(
        &self,
        tile: &TileShading,
        pushed: &Contributions,
        visibility: &[f32],
        scratch: &mut ProductScratch,
    ) {
        let blocks = tile.blocks();
        let ProductScratch { visibility_stats, sampled_pixels, targets, .. } = scratch;
        let mut ray = 0;
        for &i in &*sampled_pixels {
            let PixelPoints { points, n_samples, .. } = &tile.pixels[i];
            let block = blocks.of(i % tile.width, i / tile.width);
            let mut sum: Rgb = pushed.base[points.clone()].iter().copied().sum();
            while pushed.point.get(ray).is_some_and(|&point| (point as usize) < points.end) {
                let v = visibility[ray];
                visibility_stats.count(block, usize::from(targets[ray]), v);
                sum += if v > 0.0 { pushed.weight[ray] * v } else { Rgb::BLACK };
                ray += 1;
            }
            visibility_stats.set_luminance(i, sum.luminance().max(0.0) / *n_samples as f32);
        }
    }
}
