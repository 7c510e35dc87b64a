//! The grid of a lat-long map, with the solid angles of its rows and texels.
//!
//! In the plane of longitude and cos θ, areas equal solid angles (Archimedes), and texels are rectangles.

use crate::math::functions;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Columns uniform in longitude and rows uniform in the polar angle θ, from θ = 0 at the upper edge of the first row
/// to π.
#[derive(Clone, Debug)]
pub struct LatLongGrid {
    width: usize,
    height: usize,
    /// cos θ of the upper edge of each row, and of the lower edge of the last: falling from 1 to −1.
    cos_edges: Vec<f64>,
}

impl LatLongGrid {
    /// Creates a grid of `width` × `height` texels, neither zero.
    pub fn new(width: usize, height: usize) -> Self {
        let edge = |row: usize| functions::cos(PI * row as f64 / height as f64);
        Self { width, height, cos_edges: (0..=height).map(edge).collect() }
    }

    /// The number of columns.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The width of a column in longitude \[rad\].
    pub fn column_angle(&self) -> f64 {
        TAU / self.width as f64
    }

    /// cos θ of the upper edge of a row; for row [`LatLongGrid::height`], of the lower edge of the last row.
    ///
    /// # Panics
    /// If there is no such row.
    #[inline]
    pub fn cos_edge(&self, row: usize) -> f64 {
        self.cos_edges[row]
    }

    /// The extent of a band of rows in cos θ; 2 for all rows.
    ///
    /// # Panics
    /// If there is no such row.
    #[inline]
    pub fn band(&self, rows: Range<usize>) -> f64 {
        self.cos_edges[rows.start] - self.cos_edges[rows.end]
    }

    /// The solid angle of a texel in row `row` \[sr\].
    ///
    /// # Panics
    /// If there is no such row.
    #[inline]
    pub fn solid_angle(&self, row: usize) -> f64 {
        self.band(row..row + 1) * TAU / self.width as f64
    }

    /// cos θ at a place between the rows' edges, in rows from the first; linear in solid angle within a row.
    pub(crate) fn cos_theta(&self, row: f64) -> f64 {
        let texel = (row as usize).min(self.height - 1);
        let [top, bottom] = [self.cos_edges[texel], self.cos_edges[texel + 1]];
        top + (row - texel as f64) * (bottom - top)
    }

    /// The row in which cos θ is `cos_theta`.
    pub(crate) fn row(&self, cos_theta: f64) -> usize {
        let theta = functions::acos(cos_theta.clamp(-1.0, 1.0));
        let row = (theta / PI * self.height as f64) as usize;
        self.row_near(row.min(self.height - 1), cos_theta)
    }

    /// The row in which cos θ is `cos_theta`, searched for from `row` on.
    pub(crate) fn row_near(&self, mut row: usize, cos_theta: f64) -> usize {
        while row > 0 && cos_theta > self.cos_edges[row] {
            row -= 1;
        }
        while row + 1 < self.height && cos_theta < self.cos_edges[row + 1] {
            row += 1;
        }
        row
    }
}

/// [`LatLongGrid::band`] of one of `height` rows as a product, which loses no digits beside a pole however many rows
/// there are.
pub(crate) fn narrow_band(row: usize, height: usize) -> f64 {
    let step = PI / height as f64;
    2.0 * functions::sin(step * (row as f64 + 0.5)) * functions::sin(0.5 * step)
}

/// Integrals over one texel of a row; those over φ are [`column_integrals`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowIntegrals {
    /// ∫∫ sin θ dθ dφ \[sr\].
    pub(crate) solid_angle: f64,
    /// ∫∫ cos θ sin θ dθ dφ: the vertical part of ∫ ω dω.
    pub(crate) vertical: f64,
    /// ∫ sin² θ dθ: times the column's integrals, the horizontal part of ∫ ω dω.
    pub(crate) horizontal: f64,
}

impl RowIntegrals {
    pub(crate) fn new(y: usize, width: usize, height: usize) -> Self {
        let (top, bottom) = (PI * y as f64 / height as f64, PI * (y + 1) as f64 / height as f64);
        let step = TAU / width as f64;
        let half = 0.5 * (bottom - top);
        let middle = top + half;
        // Differences of cos θ, sin² θ / 2 and (2θ − sin 2θ) / 4 as products.
        let band = 2.0 * functions::sin(middle) * functions::sin(half);
        Self {
            solid_angle: step * band,
            vertical: step * 0.5 * functions::sin(2.0 * middle) * functions::sin(2.0 * half),
            horizontal: half - 0.5 * functions::cos(2.0 * middle) * functions::sin(2.0 * half),
        }
    }
}

/// ∫ sin φ dφ and −∫ cos φ dφ over column `x` of `width`; φ is 0 in the middle of the map.
pub(crate) fn column_integrals(x: usize, width: usize) -> [f64; 2] {
    // ∫ sin φ = 2 sin φ_c sin(Δ/2) without the cancellation of cos φ0 − cos φ1.
    let (sin, cos) = functions::sin_cos(TAU * ((x as f64 + 0.5) / width as f64 - 0.5));
    let chord = 2.0 * functions::sin(PI / width as f64);
    [sin * chord, -cos * chord]
}

/// The angular radius of the even disc of as much angular variance as light has \[rad\]; `moment` is ∫ L ω dω, and `energy`
/// is ∫ L dω. 0 without light.
pub(crate) fn even_disc_radius(moment: [f64; 3], energy: f64) -> f64 {
    // An even disc of angular radius r has a mean direction of length (1 + cos r) / 2.
    let length = moment.map(|m| m * m).iter().sum::<f64>().sqrt();
    let concentration = (length / energy).min(1.0);
    functions::acos(2.0 * concentration - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_partition_the_sphere() {
        for (width, height) in [(1, 1), (7, 3), (64, 32), (1, 9)] {
            let grid = LatLongGrid::new(width, height);
            let sphere: f64 = (0..height).map(|y| grid.solid_angle(y) * width as f64).sum();
            assert!((sphere - 4.0 * PI).abs() < 1e-12);
            for row in 0..height {
                assert!((grid.band(row..row + 1) - narrow_band(row, height)).abs() < 1e-15);
                assert_eq!(grid.row(grid.cos_theta(row as f64 + 0.5)), row);
            }
        }
    }
}
