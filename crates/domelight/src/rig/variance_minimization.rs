//! Viriyothai & Debevec 2009, "Variance Minimization Light Probe Sampling".
//!
//! Cut regions so that the light in each is close together: the variance of a region is ∫ L d² dω, where
//! d is the distance to its energy centroid. It is not the variance of the texels' values.
//!
//! The poster measures d on the map and minimizes the variance of the worse half. The default here
//! measures chords on the sphere, where the variance is W − |R|²/W with W = ∫ L dω and R = ∫ L ω dω,
//! independent of poles and the seam. It minimizes the sum of both halves' variances and cuts the worst
//! region first. Then it abandons rectangles: it makes twice as many parts as lights, merges parts that
//! belong together, and moves the lights (Lloyd's refinement).

use super::cells::{Piece, assign, refine};
use super::merge::merge;
use super::regions::{Blocks, Metric, Moments, SummedArea};
use super::split::{Criterion, split};
use super::texels::{Texels, unit};
use super::{Order, Region, RegionSums, Rig, RigError, TexelRect};
use crate::environment::Environment;
use crate::math::Vec3;

/// The number of parts per light into which the map is cut, before parts are merged and refined.
const PARTS_PER_LIGHT: usize = 2;
/// Lights above which no parts are joined: joining takes time in proportion to their square.
const MAX_JOINED: usize = 4096;

/// What a cut minimizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// The larger of the two halves' variances, with distances in texels of the map, divided at the
    /// seam, as in the poster.
    Poster,
    /// The sum of the two halves' variances, with distances on the sphere. The first cut starts
    /// opposite the map's center of light, so rotating the map rotates the rig.
    #[default]
    Spherical,
}

impl Rule {
    fn metric(self) -> Metric {
        match self {
            Self::Poster => Metric::Plane,
            Self::Spherical => Metric::Sphere,
        }
    }
}

/// Settings of [`variance_minimization`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VarianceMinimization {
    /// What a cut minimizes.
    pub rule: Rule,
    /// The order in which regions are cut.
    pub order: Order,
    /// The number of steps of Lloyd's refinement on the sphere; with 0, regions stay rectangles.
    pub lloyd_steps: u32,
}

impl Default for VarianceMinimization {
    fn default() -> Self {
        Self { rule: Rule::Spherical, order: Order::WorstFirst, lloyd_steps: 15 }
    }
}

impl VarianceMinimization {
    /// The settings of the poster: planar distance, level by level, rectangles.
    pub fn poster() -> Self {
        Self { rule: Rule::Poster, order: Order::Levels, lloyd_steps: 0 }
    }
}

/// Divides the environment into `n_lights` lights with as little variance of the light around each as possible.
///
/// If all steps of the refinement would leave a light without energy, fewer steps are taken. If even
/// zero steps would, regions stay rectangles.
///
/// # Errors
/// [`RigError::NoLights`] for `n_lights` = 0, [`RigError::Black`] for a map without light, and
/// [`RigError::TooFewTexels`] if fewer than `n_lights` texels are lit.
pub fn variance_minimization(
    environment: &Environment,
    n_lights: usize,
    settings: VarianceMinimization,
) -> Result<Rig, RigError> {
    let texels = Texels::new(environment);
    if settings.lloyd_steps > 0 {
        return refined(&texels, n_lights, settings);
    }
    let table = SummedArea::new(&texels, settings.rule.metric());
    RigError::check(n_lights, table.total().lit as usize)?;
    let regions = divide(&table, n_lights, settings);
    drop(table);
    Ok(Rig::from_rectangles(&texels, &regions))
}

/// Rectangles of the whole map.
fn divide(table: &SummedArea, n: usize, settings: VarianceMinimization) -> Vec<TexelRect> {
    let (width, height) = (table.texels().width(), table.texels().height());
    let (x0, criterion) = match settings.rule {
        Rule::Poster => (0, Criterion::MinMaxVariance),
        Rule::Spherical => (table.darkest_column(), Criterion::MinSumVariance),
    };
    let root = TexelRect { x0, x1: x0 + width, y0: 0, y1: height };
    split(table, root, criterion, settings.order, n)
}

/// Nearest-light cells after Lloyd's refinement.
fn refined(
    texels: &Texels,
    n_lights: usize,
    settings: VarianceMinimization,
) -> Result<Rig, RigError> {
    let blocks = Blocks::of(texels);
    let moments = blocks.moments(texels, Metric::Sphere);
    let pieces: Vec<Piece> = moments.iter().map(Piece::new).collect();
    let table = SummedArea::from_moments(texels, Metric::Sphere, blocks, moments);
    let lit = table.total().lit as usize;
    RigError::check(n_lights, lit)?;
    let n_parts = if n_lights > MAX_JOINED { n_lights } else { PARTS_PER_LIGHT * n_lights };
    let start = start(&table, n_parts.min(lit), n_lights, settings);
    let mut steps = settings.lloyd_steps;
    loop {
        let mut lights = start.clone();
        refine(&table, &pieces, &mut lights, steps);
        let labels = assign(texels, &lights);
        let sums = RegionSums::of(texels, &labels, n_lights);
        if sums.iter().all(|s| s.energy > 0.0) {
            return Ok(Rig::new(texels, labels, &sums, &vec![Region::Cell; n_lights]));
        }
        if steps == 0 {
            let rectangles = VarianceMinimization { lloyd_steps: 0, ..settings };
            return variance_minimization(texels.environment(), n_lights, rectangles);
        }
        // A light that lost all its texels is rare; with fewer steps it may keep some.
        steps /= 2;
    }
}

/// Directions of `n_lights` lights: the map in `n_parts` rectangles, joined.
fn start(
    table: &SummedArea,
    n_parts: usize,
    n_lights: usize,
    settings: VarianceMinimization,
) -> Vec<Vec3> {
    let parts = match settings.rule {
        Rule::Spherical => divide(table, n_parts, settings),
        Rule::Poster => divide(&SummedArea::new(table.texels(), Metric::Plane), n_parts, settings),
    };
    let parts: Vec<Moments> = parts.iter().map(|r| table.measure(r)).collect();
    let joined = merge(&parts, n_lights);
    joined.into_iter().map(|r| unit(r).unwrap_or(Vec3::Y)).collect()
}
