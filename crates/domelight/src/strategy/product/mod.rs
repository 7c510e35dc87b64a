//! Product sampling: rays follow light times reflectance, and visibility is learned during the render.
//!
//! Once per environment, the map is divided into a few hundred `cells` along a Hilbert curve. Each pass draws
//! `light_samples`, a pool of directions in every cell. Then each pixel is processed, with all its camera hits
//! together:
//!
//! 1. A `table` holds the light times the reflectance of each cell.
//! 2. `candidates` are strata along the curve, each with one direction from the pool, BRDF samples where the table
//!    approximates the BRDF badly (`lobe_share`), and points on portals if the scene has any (`portal_light`), weighted by
//!    the balance heuristic.
//! 3. The tile's pixels are processed in [levels](super::levels). Pixels of the first level, the *pilots*, trace all
//!    their candidates. From the rays of each level, the tile learns the `visibility` V̂ of each cell and the
//!    brightness of its pixels. Scouts have begun to learn it before.
//! 4. In the next levels, the integral of a `control_variate` h over all cells, seen through V̂, approximates the
//!    reflected light. `systematic` sampling traces the candidates whose visibility matters:
//!
//! ```text
//! base = Σ_c V̂_c ∫ h L + Σ_j V̂_j (W_j − h_j L_j/p_j) − Σ_chosen (W_j/π_j) V̂_j        rays: weight W_j/π_j
//! ```
//!
//!    The density of strata is proportional to light, reflectance and the uncertainty of visibility.
//!
//! The expectation is ∫ f L V dω for every V̂, brightness and pool, provided that they do not depend on the random
//! numbers of strata, BRDF samples, portals and selection. V̂ and brightness come from pixels of lower levels and from
//! scouts (`briefing`), and each pixel, pass and scout has its own sampler. V̂ and the candidates share the pool, which
//! does no harm: given the pool, strata draw only from it, and the expectation of their part is a sum over the pool for
//! any V̂ and any density derived from it. BRDF samples and points on portals do not come from the pool, so the weights that divide the light between them
//! and strata depend only on the pixel's hits and on scouts, which have a pool of their own.
//!
//! Related: Clarberg & Akenine-Möller 2008, "Practical Product Importance Sampling for Direct
//! Illumination", multiplies trees of BRDF and map; Atanasov et al. 2018, "Adaptive Environment
//! Sampling on CPU and GPU", learns visibility for the density.

mod brdf_samples;
mod briefing;
mod candidate;
mod candidates;
mod cells;
mod control_variate;
mod estimator;
mod hits;
mod light_samples;
mod lobe_share;
mod portal_light;
mod prior;
mod rays;
mod strata;
mod systematic;
mod table;
#[cfg(test)]
mod test_support;
mod visibility;

pub use briefing::Findings;

use std::borrow::Cow;

use super::levels::N_LEVELS;
use super::{Contributions, PixelPoints, Strategy, TileShading};
use crate::Rgb;
use crate::environment::Environment;
use crate::math::Vec3;
use crate::sampling::Sampler;
use crate::simd::{InstructionSet, dispatch};
use briefing::{Briefing, Scouted};
use candidates::Candidates;
use cells::Cells;
use control_variate::ControlVariate;
use estimator::TileEstimator;
use hits::Groups;
use light_samples::{LightSamplePool, PassLength};
use lobe_share::LobeShare;
use portal_light::StrataShare;
use strata::{CandidateIndex, Counts};
use table::Table;
use visibility::{VisibilityEstimate, VisibilityStats};

/// Camera samples per pass. Strata that share one random offset over all camera samples are worth more
/// than the same number in two sets.
const SAMPLES_PER_PASS: u32 = 64;

/// The factor on the number of candidates of pilots in short passes, because pilots have no control variate and other
/// pixels learn from them.
const PILOT: usize = 2;

/// The maximum number of candidates per pixel and pass, which limits memory.
const MAX_CANDIDATES: u32 = 1 << 14;

/// At least one candidate in this many is a BRDF sample where the table approximates the BRDF badly: if normals vary or
/// the view is oblique, and for lobes narrower than most cells.
const BRDF_SHARE: [usize; 2] = [8, 4];

/// One candidate in this many is a point on a portal if there are portals.
const PORTAL_SHARE: usize = 2;

/// The roughness below which a lobe is narrower than most cells.
const NARROW: f32 = 0.1;

/// The tolerated error of a candidate, as a fraction of the pixel's brightness over the number of candidates: for a
/// diffuse pixel, where nothing else is random, and for a glossy pixel.
const TOLERANCE: [f32; 2] = [0.15, 0.35];

/// For pixels darker than this fraction of the environment's mean, the tolerated error stops shrinking.
const DARK: f32 = 0.15;

/// The same as a fraction of the mean of the picture's surfaces, for pictures darker than the environment: rooms.
const DARK_IN_PICTURE: f32 = 0.5;

/// Product sampling: up to N rays per camera sample, in proportion to light, reflectance and learned visibility.
#[derive(Clone, Debug)]
pub struct ProductSampling<'a> {
    /// The environment with about square texels, so that cells are about square too.
    environment: Cow<'a, Environment>,
    /// The cells of short passes and of long ones; empty under a black sky.
    cells: Option<[Cells; 2]>,
    /// The luminance below which brightness is ignored, unless the picture is darker.
    dark: f32,
    n_rays: u32,
    instruction_set: InstructionSet,
}

impl<'a> ProductSampling<'a> {
    /// Creates the strategy with at most `n_rays` ≥ 1 shadow rays per camera sample that hits, and twice as many in
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

    /// The same strategy with another instruction set, for comparisons; `None` if this processor lacks it. All give the
    /// same bits.
    #[must_use]
    pub fn with_instruction_set(mut self, instruction_set: InstructionSet) -> Option<Self> {
        self.instruction_set = instruction_set;
        instruction_set.is_available().then_some(self)
    }

    /// The total number of candidates over the hits of a pixel.
    fn counts(&self, groups: &Groups, n_hits: usize, pilot: bool, has_portals: bool) -> Counts {
        let times = if pilot && PassLength::new(n_hits) == PassLength::Short { PILOT } else { 1 };
        let all = self.n_rays as usize * n_hits * times;
        let share = match groups.narrowest() {
            Some(width) if width < NARROW => BRDF_SHARE[1],
            Some(width) if !groups.is_well_tabulated(width) => BRDF_SHARE[0],
            _ if !has_portals => return Counts { light: all, brdf: 0, portal: 0 },
            _ => usize::MAX,
        };
        // Strata correct the control variate, so there must be one beside another sample.
        let all = all.max(2);
        let brdf = if share < usize::MAX { all.div_ceil(share) } else { 0 };
        let portal = if has_portals { (all - brdf) / PORTAL_SHARE } else { 0 };
        Counts { light: all - brdf - portal, brdf, portal }
    }

    /// The cells of a pass.
    fn cells(&self, length: PassLength) -> Option<&Cells> {
        let [of_short, of_long] = self.cells.as_ref()?;
        Some(match length {
            PassLength::Short => of_short,
            PassLength::Long => of_long,
        })
    }

    /// The luminance in a picture below which brightness is ignored.
    fn dark(&self, tile: &TileShading) -> f32 {
        tile.brightness.map_or(self.dark, |mean| self.dark.min(DARK_IN_PICTURE * mean))
    }
}

/// Scratch memory of [`ProductSampling`].
#[derive(Clone, Debug, Default)]
pub struct ProductScratch {
    groups: Groups,
    table: Table,
    control_variate: ControlVariate,
    candidates: Candidates,
    /// The candidates of the chosen strata.
    chosen: Vec<CandidateIndex>,
    strata_share: StrataShare,
    lobe_share: LobeShare,
    visibility: VisibilityEstimate,
    /// The slot of each ray's cell in this round.
    targets: Vec<u16>,
    /// The pixels of the round that have hits.
    sampled_pixels: Vec<usize>,
    visibility_stats: VisibilityStats,
    briefing: Briefing,
    /// The first point of each pixel of the tile that has any: their sum and number.
    positions: (Vec3, usize),
}

/// What the tiles of a pass share.
#[derive(Clone, Debug)]
pub struct ProductPass {
    pool: LightSamplePool,
    scouted: Scouted,
}

impl Strategy for ProductSampling<'_> {
    type Pass = ProductPass;
    type Scratch = ProductScratch;
    type Findings = Findings;

    fn n_rounds(&self) -> u32 {
        N_LEVELS
    }

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        self.n_rays
    }

    fn samples_portals(&self) -> bool {
        true
    }

    fn samples_per_pass(&self) -> Option<u32> {
        Some((MAX_CANDIDATES / self.n_rays).clamp(1, SAMPLES_PER_PASS))
    }

    fn begin_pass(&self, sampler: Sampler, n_samples: u32) -> ProductPass {
        let length = PassLength::new(n_samples as usize);
        let draw = |cells| LightSamplePool::draw(cells, &self.environment, sampler, length);
        let pool = self.cells(length).map_or_else(LightSamplePool::empty, draw);
        ProductPass { pool, scouted: Scouted::default() }
    }

    fn push(
        &self,
        ProductPass { pool, scouted }: &ProductPass,
        tile: &TileShading,
        round: u32,
        scratch: &mut ProductScratch,
        out: &mut Contributions,
    ) {
        let Some(cells) = self.cells(pool.length) else { return };
        if round == 0 {
            scratch.visibility_stats.reset(tile.blocks(), tile.pixels.len());
            scratch.positions = (Vec3::ZERO, 0);
        }
        if tile.points.is_empty() {
            scratch.sampled_pixels.clear();
            return;
        }
        if scratch.positions.1 == 0 {
            let mean =
                tile.points.iter().map(|at| at.position).sum::<Vec3>() / tile.points.len() as f32;
            scratch.briefing.prepare(self.instruction_set, cells, scouted, mean);
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
        let ProductScratch { visibility_stats, sampled_pixels, targets, positions, .. } = scratch;
        let mut ray = 0;
        for &i in &*sampled_pixels {
            let PixelPoints { points, n_samples, .. } = &tile.pixels[i];
            let block = blocks.of(i % tile.width, i / tile.width);
            positions.0 += tile.points[points.start].position;
            positions.1 += 1;
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

    fn findings(&self, scratch: &ProductScratch) -> Findings {
        Findings::new(&scratch.visibility_stats, scratch.positions)
    }

    fn brief(&self, pass: &mut ProductPass, findings: Vec<Findings>) {
        pass.scouted = Scouted::new(findings);
    }
}
