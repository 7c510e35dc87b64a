//! Viriyothai & Debevec 2009, "Variance Minimization Light Probe Sampling".
//!
//! Cut regions such that the light in each lies close together: the variance of a region is
//! ∫ L d² dω, d the distance to its energy centroid. It is not the variance of the texels' values.
//!
//! The poster measures d on the map and takes the cut whose worse half is best. The default here
//! measures chords on the sphere, where the variance is W − |R|²/W with W = ∫ L dω and
//! R = ∫ L ω dω and no pole or seam matters; it takes the cut whose halves sum to the least, cuts
//! the worst region first, and then lets the lights move (Lloyd's refinement), which ends
//! rectangles. Each of these steps lowers the error.

use super::cells::{Pieces, assign};
use super::regions::{Metric, SummedArea};
use super::split::{Criterion, split};
use super::texels::{Texels, unit};
use super::{Order, Region, RegionSums, Rig, RigError, TexelRect, fill};
use crate::environment::Environment;
use crate::math::Vec3;

/// Pieces that move as a whole in the refinement, at the most.
const MAX_PIECES: usize = 1 << 21;

/// What a cut minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// The greater of the two halves' variances; distance in texels of the map, where the seam
    /// divides. The poster's.
    Poster,
    /// The sum of the two halves' variances; distance on the sphere. The first cut starts
    /// opposite the map's centre of light, so turning the map turns the rig.
    #[default]
    Spherical,
}

/// Settings of [`variance_minimization`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VarianceMinimization {
    /// What a cut minimises.
    pub rule: Rule,
    /// Which region is cut next.
    pub order: Order,
    /// Steps of Lloyd's refinement on the sphere; at 0 regions stay rectangles.
    pub lloyd_steps: u32,
}

impl Default for VarianceMinimization {
    fn default() -> Self {
        Self { rule: Rule::Spherical, order: Order::WorstFirst, lloyd_steps: 15 }
    }
}

impl VarianceMinimization {
    /// The poster's own: planar distance, level by level, rectangles.
    pub fn poster() -> Self {
        Self { rule: Rule::Poster, order: Order::Levels, lloyd_steps: 0 }
    }
}

/// `n_lights` lights with as little spread of energy around them as can be found.
///
/// In rare cases refinement leaves a light without energy; it is dropped.
///
/// # Errors
/// [`RigError::NoLights`] for `n_lights` = 0, [`RigError::Black`] for a map without light, and
/// [`RigError::TooFewTexels`] if fewer than `n_lights` texels are lit.
pub fn variance_minimization(
    environment: &Environment,
    n_lights: usize,
    settings: &VarianceMinimization,
) -> Result<Rig, RigError> {
    let texels = Texels::new(environment);
    let regions = rectangles(&texels, n_lights, settings)?;
    if settings.lloyd_steps == 0 {
        return Ok(Rig::from_rectangles(&texels, &regions));
    }
    let labels = fill(&regions, texels.width(), texels.height());
    let sums = RegionSums::of(&texels, &labels, regions.len());
    let mut lights: Vec<Vec3> =
        regions.iter().zip(&sums).map(|(r, s)| position(&texels, r, s)).collect();
    Pieces::new(&texels, MAX_PIECES).refine(&mut lights, settings.lloyd_steps);
    Ok(cells(&texels, lights))
}

fn rectangles(
    texels: &Texels,
    n_lights: usize,
    settings: &VarianceMinimization,
) -> Result<Vec<TexelRect>, RigError> {
    let (metric, criterion) = match settings.rule {
        Rule::Poster => (Metric::Plane, Criterion::MinMaxVariance),
        Rule::Spherical => (Metric::Sphere, Criterion::MinSumVariance),
    };
    let table = SummedArea::new(texels, metric);
    let total = table.total();
    RigError::check(n_lights, total.lit as usize)?;
    let x0 = match settings.rule {
        Rule::Poster => 0,
        Rule::Spherical => table.darkest_column(&total),
    };
    let root = TexelRect { x0, x1: x0 + texels.width(), y0: 0, y1: texels.height() };
    Ok(split(&table, root, criterion, settings.order, n_lights))
}

/// The energy centroid of a rectangle, or its middle if light comes from all around.
fn position(texels: &Texels, r: &TexelRect, sums: &RegionSums) -> Vec3 {
    let middle = || texels.direction(0.5 * (r.x0 + r.x1) as f64, 0.5 * (r.y0 + r.y1) as f64);
    unit(sums.moment).or_else(|| unit(middle())).unwrap_or(Vec3::Y)
}

/// One light for each nearest-light cell that has energy.
fn cells(texels: &Texels, mut lights: Vec<Vec3>) -> Rig {
    loop {
        let labels = assign(texels, &lights);
        let sums = RegionSums::of(texels, &labels, lights.len());
        if sums.iter().all(|s| s.energy > 0.0) {
            return Rig::new(texels, labels, &sums, &vec![Region::Cell; lights.len()]);
        }
        // The texels of a dark cell go to its neighbours.
        let lit = lights.iter().zip(&sums).filter(|(_, s)| s.energy > 0.0);
        lights = lit.map(|(l, _)| *l).collect();
    }
}
