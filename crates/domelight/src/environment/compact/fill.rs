//! What is behind a source: radiance continued from its rim.
//!
//! The smoothest continuation is the harmonic one, a membrane spanned over the rim. Within a circle
//! it is Poisson's integral, the mean of the rim's values with weights 1/d², d the distance; on the
//! sphere as in the plane, for stereographic projection keeps circles and harmonic functions. The
//! same mean is taken within other outlines, where it is near to the membrane: it passes
//! continuously into the rim and never leaves the range of its values.

use super::grid::Grid;
use crate::Rgb;
use crate::math::Vec3;
use crate::parallel::in_order;

/// A cell of the rim: direction, the rim's length in it, and its radiance.
type RimCell = (Vec3, f32, Rgb);

/// Radiance of each of `cells`, continued from the cells of their `rim`; black if there is none.
pub(super) fn continue_rim(grid: &Grid, cells: &[u32], rim: &[u32]) -> Vec<Rgb> {
    let rim_cell = |&c: &u32| {
        let c = c as usize;
        (grid.direction(c), grid.solid_angle(c).sqrt() as f32, grid.mean(c))
    };
    let rim: Vec<RimCell> = rim.iter().map(rim_cell).collect();
    in_order(cells.len(), |i| poisson(grid.direction(cells[i] as usize), &rim))
}

/// Σ s L / d² over Σ s / d², s the length of the rim in a cell.
fn poisson(at: Vec3, rim: &[RimCell]) -> Rgb {
    let (mut sum, mut weights) = (Rgb::BLACK, 0.0);
    for &(direction, length, radiance) in rim {
        let weight = length / at.distance_squared(direction);
        sum += radiance * weight;
        weights += weight;
    }
    if weights > 0.0 { sum / weights } else { Rgb::BLACK }
}
