//! The grid on which sources are searched: texels, or blocks of texels on a large map.

use std::f64::consts::{PI, TAU};

use crate::environment::LatLongGrid;
use crate::math::{Vec3, functions, vec3};
use crate::parallel::bands;
use crate::{Rgb, RgbImage};

/// Cells at the most.
const MAX_CELLS: usize = 1 << 19;

/// Cells of `step` × `step` texels of a lat-long map, the last of a row or column maybe smaller.
pub(super) struct Grid<'a> {
    map: &'a RgbImage,
    pub(super) step: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    lat_long: LatLongGrid,
    /// Mean luminance over the solid angle of each cell, row by row.
    pub(super) luminance: Vec<f32>,
}

impl<'a> Grid<'a> {
    pub(super) fn new(map: &'a RgbImage) -> Self {
        let mut step = 1;
        while map.width.div_ceil(step) * map.height.div_ceil(step) > MAX_CELLS {
            step *= 2;
        }
        let (columns, rows) = (map.width.div_ceil(step), map.height.div_ceil(step));
        let lat_long = LatLongGrid::new(map.width, map.height);
        let mut grid = Self { map, step, columns, rows, lat_long, luminance: Vec::new() };
        let mut luminance = vec![0.0; columns * rows];
        bands(&mut luminance, columns, |row, out| {
            for (column, out) in out.iter_mut().enumerate() {
                *out = grid.mean(row * columns + column).luminance();
            }
        });
        grid.luminance = luminance;
        grid
    }

    /// ∫ luminance dω over the map.
    pub(super) fn total(&self) -> f64 {
        let energy = |(i, &l): (usize, &f32)| f64::from(l) * self.solid_angle(i);
        self.luminance.iter().enumerate().map(energy).sum()
    }

    /// Columns and rows of texels of a cell.
    pub(super) fn texels(&self, cell: usize) -> [std::ops::Range<usize>; 2] {
        let (x, y) = (cell % self.columns * self.step, cell / self.columns * self.step);
        [x..(x + self.step).min(self.map.width), y..(y + self.step).min(self.map.height)]
    }

    /// The mean over the solid angle of a cell.
    pub(super) fn mean(&self, cell: usize) -> Rgb {
        let [columns, rows] = self.texels(cell);
        if self.step == 1 {
            return self.map.row(rows.start)[columns.start];
        }
        let mut sum = [0.0; 3];
        let mut weight = 0.0;
        for y in rows {
            let band = self.lat_long.band(y..y + 1);
            weight += band * columns.len() as f64;
            for texel in &self.map.row(y)[columns.clone()] {
                let le = texel.to_array();
                (0..3).for_each(|c| sum[c] += band * f64::from(le[c]));
            }
        }
        Rgb::from(sum.map(|s| (s / weight) as f32))
    }

    /// Solid angle of a cell \[sr\].
    pub(super) fn solid_angle(&self, cell: usize) -> f64 {
        let [columns, rows] = self.texels(cell);
        let turn = TAU * columns.len() as f64 / self.map.width as f64;
        turn * self.lat_long.band(rows)
    }

    /// Solid angle of a cell on the horizon \[sr\].
    pub(super) fn widest_solid_angle(&self) -> f64 {
        TAU * PI * (self.step * self.step) as f64 / (self.map.width * self.map.height) as f64
    }

    /// The middle of a cell, unit vector in the map's frame.
    pub(super) fn direction(&self, cell: usize) -> Vec3 {
        let [columns, rows] = self.texels(cell);
        let middle = |r: &std::ops::Range<usize>| 0.5 * (r.start + r.end) as f64;
        let (sin_phi, cos_phi) =
            functions::sin_cos(TAU * (middle(&columns) / self.map.width as f64));
        let (sin_theta, cos_theta) =
            functions::sin_cos(PI * middle(&rows) / self.map.height as f64);
        // φ counts from the map's left edge, which is toward +Z.
        let [x, y, z] = [-sin_phi * sin_theta, cos_theta, cos_phi * sin_theta];
        vec3(x as f32, y as f32, z as f32)
    }

    /// The cells around a cell, sides and corners, across the seam and over the poles; on narrow
    /// maps some twice, or the cell itself.
    pub(super) fn neighbors(&self, cell: usize) -> [usize; 8] {
        let (columns, last) = (self.columns, self.rows - 1);
        let (x, y) = (cell % columns, cell / columns);
        let left = if x == 0 { columns - 1 } else { x - 1 };
        let right = if x + 1 == columns { 0 } else { x + 1 };
        let opposite = y * columns + (x + columns / 2) % columns;
        let row = |y: usize| [left, x, right].map(|x| y * columns + x);
        let [a, b, c] = if y == 0 { [opposite; 3] } else { row(y - 1) };
        let [d, e, f] = if y == last { [opposite; 3] } else { row(y + 1) };
        [a, b, c, y * columns + left, y * columns + right, d, e, f]
    }

    /// The cells with which a cell is connected if both are bright: its neighbors, and those behind a gap of one cell. A wire
    /// or a bar before a source does not divide it.
    pub(super) fn connected(&self, cell: usize) -> [usize; 12] {
        let near = self.neighbors(cell);
        let [_, up, _, left, right, _, down, _] = near;
        let beyond = [
            self.neighbors(up)[1],
            self.neighbors(left)[3],
            self.neighbors(right)[4],
            self.neighbors(down)[6],
        ];
        let mut connected = [0; 12];
        connected[..8].copy_from_slice(&near);
        connected[8..].copy_from_slice(&beyond);
        connected
    }
}
