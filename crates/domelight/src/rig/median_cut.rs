//! Debevec 2005, "A Median Cut Algorithm for Light Probe Sampling".
//!
//! Cut each region along its longest dimension so that its light energy is divided evenly. After
//! k levels, place a light in each of the 2ᵏ regions. Cuts lie between texels; the one nearest to
//! an even division is used.

use super::regions::{Metric, SummedArea};
use super::split::{Criterion, split};
use super::texels::Texels;
use super::{Order, Region, Rig, RigError, TexelRect};
use crate::environment::Environment;

/// The position of a light in its region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightPosition {
    /// The direction of ∫ L ω dω, as the method requires.
    #[default]
    EnergyCentroid,
    /// The center of the rectangle on the map, a common mistake with an error several times as large.
    GeometricCenter,
}

/// Settings of [`median_cut`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MedianCut {
    /// Scale widths by the cosine of the inclination before comparing them with heights, as in the
    /// paper. Otherwise regions near the poles are cut as if the map were flat.
    pub scale_width: bool,
    /// The position of each light in its region.
    pub position: LightPosition,
    /// The order in which regions are cut; [`Order::Levels`] in the paper.
    pub order: Order,
}

impl Default for MedianCut {
    fn default() -> Self {
        let position = LightPosition::EnergyCentroid;
        Self { scale_width: true, position, order: Order::Levels }
    }
}

/// Divides the environment into `n_lights` lights of about equal energy.
///
/// # Errors
/// [`RigError::NoLights`] for `n_lights` = 0, [`RigError::Black`] for a map without light, and
/// [`RigError::TooFewTexels`] if fewer than `n_lights` texels are lit.
pub fn median_cut(
    environment: &Environment,
    n_lights: usize,
    settings: MedianCut,
) -> Result<Rig, RigError> {
    let texels = Texels::new(environment);
    let (width, height) = (texels.width(), texels.height());
    let table = SummedArea::new(&texels, Metric::Sphere);
    RigError::check(n_lights, table.total().lit as usize)?;
    let root = TexelRect { x0: 0, x1: width, y0: 0, y1: height };
    let criterion = Criterion::EvenEnergy { scale_width: settings.scale_width };
    let regions = split(&table, root, criterion, settings.order, n_lights);
    drop(table);
    let mut rig = Rig::from_rectangles(&texels, &regions);
    if settings.position == LightPosition::GeometricCenter {
        for light in &mut rig.lights {
            if let Region::Rectangle(r) = light.region {
                let (x, y) = (0.5 * (r.x0 + r.x1) as f64, 0.5 * (r.y0 + r.y1) as f64);
                light.direction = texels.to_world(texels.direction(x, y));
            }
        }
    }
    Ok(rig)
}
