//! Fills in the background behind a source: radiance continued from its rim, in value and slope.
//!
//! The smoothest continuation of the rim's values is the harmonic one, a membrane. Within a circle, it is
//! Poisson's integral, the mean of the values with weights 1/d² for distance d. This holds on the sphere
//! as in the plane, because stereographic projection preserves circles and harmonic functions. The same
//! mean is used within other outlines, where it approximates the membrane: it is continuous at the rim
//! and never leaves the range of the rim's values.
//!
//! A membrane alone would truncate the glow around a source to a flat top. By Almansi's theorem, the
//! biharmonic continuation, a thin plate, is the membrane plus (R² − r²)/2R times the continuation of the
//! slope toward the source. Since (R² − r²)/2R = π / ∫ ds/d², the same weights give it. (The effect of
//! the membrane's own slope is neglected; it vanishes for a uniform rim.)

use std::f32::consts::PI;

use super::grid::Grid;
use crate::Rgb;
use crate::math::Vec3;
use crate::parallel::in_order;

/// A cell of the rim.
struct RimCell {
    direction: Vec3,
    /// The length of the rim in the cell.
    length: f32,
    radiance: Rgb,
    /// By how much luminance rises toward the source \[per radian\].
    slope: f32,
}

/// Radiance of each of `cells`, continued from the cells of their `rim`; black if there is none.
/// `is_outside` selects cells that belong neither to a source nor to the rim.
pub(super) fn continue_rim(
    grid: &Grid,
    cells: &[u32],
    rim: &[u32],
    is_outside: impl Fn(usize) -> bool,
) -> Vec<Rgb> {
    let rim: Vec<RimCell> =
        rim.iter().map(|&c| RimCell::new(grid, c as usize, &is_outside)).collect();
    in_order(cells.len(), |i| thin_plate(grid.direction(cells[i] as usize), &rim))
}

impl RimCell {
    fn new(grid: &Grid, cell: usize, is_outside: impl Fn(usize) -> bool) -> Self {
        let (direction, radiance) = (grid.direction(cell), grid.mean(cell));
        let (mut rise, mut distance) = (0.0, 0.0);
        for n in grid.neighbors(cell).into_iter().filter(|&n| is_outside(n)) {
            rise += grid.luminance[cell] - grid.luminance[n];
            distance += direction.distance(grid.direction(n));
        }
        let slope = if distance > 0.0 { rise / distance } else { 0.0 };
        Self { direction, length: grid.solid_angle(cell).sqrt() as f32, radiance, slope }
    }
}

/// Σ s L / d² over Σ s / d², s the length of the rim in a cell, and the like of slopes.
fn thin_plate(at: Vec3, rim: &[RimCell]) -> Rgb {
    let (mut radiance, mut slope, mut weights) = (Rgb::BLACK, 0.0, 0.0);
    for cell in rim {
        let weight = cell.length / at.distance_squared(cell.direction);
        radiance += cell.radiance * weight;
        slope += cell.slope * weight;
        weights += weight;
    }
    if weights == 0.0 {
        return Rgb::BLACK;
    }
    let membrane = radiance / weights;
    let bulge = slope * (PI / (weights * weights));
    // The glow has the membrane's color. At 1/r², the steepest that is not the source's, it doubles
    // in the middle. Where nothing rises, or all is black, there is none.
    let share = bulge / membrane.luminance();
    if share > 0.0 { membrane * (1.0 + share.min(1.0)) } else { membrane }
}
