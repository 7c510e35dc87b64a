//! A two-dimensional table sampled from coarse to fine: hierarchical sample warping
//! (Clarberg et al. 2005, "Wavelet Importance Sampling", section 4.2; McCool & Harwood 1997).
//!
//! Each level holds the sums of 2 × 2 cells of the level below. A point of the unit square descends the
//! levels: its y chooses the upper or lower half of four cells, its x chooses the left or right cell, and
//! both are rescaled to the chosen cell. Inverting a row marginal and a column conditional
//! ([`super::Table2d`]) shears strata into strips along rows. In contrast, this warp keeps nearby points
//! close and square regions roughly square, so stratified points stay stratified over the map. On a sky
//! with a sun and windows, with 64 Owen-scrambled points, the variance of a diffuse estimate is 1.8 times
//! lower.
//!
//! The four sums of one choice are adjacent in memory, so a level costs one cache line. Sums are in
//! single precision, because only ratios of neighbors matter. The relative difference between a cell's
//! probability and its weight over the total is about 10⁻⁶.

use super::ONE_MINUS_EPSILON;
use super::table::{TableError, TableSample};
use crate::math::Vec2;
use crate::simd::SimdFloat;

/// Four cells: upper left, upper right, lower left, lower right.
type Quad = [f32; 4];

/// A piecewise-constant density over rows and columns of any size.
#[derive(Clone, Debug)]
pub struct HierarchicalTable {
    width: usize,
    height: usize,
    /// From the finest level to the coarsest, which is a single quad.
    levels: Vec<Level>,
    total: f64,
}

#[derive(Clone, Debug)]
struct Level {
    /// Quads in a row.
    width: usize,
    quads: Vec<Quad>,
}

impl HierarchicalTable {
    /// Creates a hierarchy from `width · height` weights; `weight(row, out)` writes the weights of one row.
    ///
    /// Rows are independent, and are filled in parallel with the feature `render`.
    ///
    /// # Errors
    /// See [`TableError`]; the index of a bad weight is row · width + column.
    pub fn from_rows(
        width: usize,
        height: usize,
        weights: impl Fn(usize, &mut [f32]) + Sync,
    ) -> Result<Self, TableError> {
        if width == 0 || height == 0 {
            return Err(TableError::Empty);
        }
        let (finest, total) = Level::finest(width, height, weights)?;
        if total <= 0.0 {
            return Err(TableError::AllZero);
        }
        let mut levels = vec![finest];
        while levels[levels.len() - 1].quads.len() > 1 {
            levels.push(levels[levels.len() - 1].coarser());
        }
        Ok(Self { width, height, levels, total })
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The number of levels from the whole table to a cell: a square of 2^`depth` cells at the upper
    /// left contains the table.
    pub fn depth(&self) -> usize {
        self.levels.len()
    }

    /// The weights of the quarters of a square of 2^`size` cells, by row: upper left, upper right,
    /// lower left, lower right. `column` and `row` count such squares.
    ///
    /// # Panics
    /// If `size` is not in 1..=[`HierarchicalTable::depth`], or the square lies beyond the table.
    pub fn quarters(&self, size: usize, column: usize, row: usize) -> [f32; 4] {
        let level = &self.levels[size - 1];
        level.quads[row * level.width + column]
    }

    /// The probability of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn pmf(&self, column: usize, row: usize) -> f64 {
        assert!(column < self.width && row < self.height, "cell ({column}, {row})");
        let finest = &self.levels[0];
        let quad = finest.quads[row / 2 * finest.width + column / 2];
        f64::from(quad[row % 2 * 2 + column % 2]) / self.total
    }

    /// Samples a cell, and a position in it, with a point in [0, 1)². A cell with weight zero is never
    /// sampled.
    pub fn sample(&self, u: Vec2) -> TableSample {
        let CellLanes { column, row, inside, weight } = self.sample_lanes(u.to_array());
        let pmf = f64::from(weight) / self.total;
        TableSample { column: column as usize, row: row as usize, inside: inside.into(), pmf }
    }

    /// [`HierarchicalTable::sample`] with one point or several side by side.
    #[inline(always)]
    pub(crate) fn sample_lanes<F: SimdFloat>(&self, [mut x, mut y]: [F; 2]) -> CellLanes<F> {
        let (zero, one) = (x.splat(0.0), x.splat(1.0));
        let (mut column, mut row, mut weight) = (zero, zero, zero);
        for level in self.levels.iter().rev() {
            let quad = |[column, row]: [f32; 2]| {
                level.quads[row as u32 as usize * level.width + column as u32 as usize]
            };
            let [a, b, c, d] = F::each([column, row], quad);
            let (lower, within) = split(y, a + b, c + d);
            let (left, right) = (F::select(lower, c, a), F::select(lower, d, b));
            y = within;
            let (later, within) = split(x, left, right);
            x = within;
            weight = F::select(later, right, left);
            column = column + column + F::select(later, one, zero);
            row = row + row + F::select(lower, one, zero);
        }
        CellLanes { column, row, inside: [x, y], weight }
    }
}

/// Sampled cells, one per lane. Columns and rows are whole numbers below 2²⁴.
pub(crate) struct CellLanes<F> {
    pub(crate) column: F,
    pub(crate) row: F,
    /// The position in the cell, in [0, 1)².
    pub(crate) inside: [F; 2],
    weight: F,
}

/// Whether `u` falls into the second of two parts, not both of weight zero, and its position in that part, in [0, 1).
#[inline(always)]
fn split<F: SimdFloat>(u: F, first: F, second: F) -> (F::Mask, F) {
    let zero = u.splat(0.0);
    let at = u * (first + second);
    let beyond = first.le(at) & zero.lt(second);
    let stretched = F::select(beyond, at - first, at) / F::select(beyond, second, first);
    (beyond, stretched.min(u.splat(ONE_MINUS_EPSILON)))
}

impl Level {
    /// The weights themselves, padded with zeros to whole quads, and their sum.
    fn finest(
        width: usize,
        height: usize,
        weights: impl Fn(usize, &mut [f32]) + Sync,
    ) -> Result<(Self, f64), TableError> {
        let quads_wide = width.div_ceil(2);
        let mut quads = vec![[0.0; 4]; quads_wide * height.div_ceil(2)];
        let fill = |(quad_row, quads): (usize, &mut [Quad])| -> Result<f64, TableError> {
            let mut line = vec![0.0; width];
            let mut sum = 0.0;
            for half in 0..2.min(height - 2 * quad_row) {
                let row = 2 * quad_row + half;
                weights(row, &mut line);
                for (column, &w) in line.iter().enumerate() {
                    if !w.is_finite() || w < 0.0 {
                        return Err(TableError::BadWeight {
                            index: row * width + column,
                            value: w,
                        });
                    }
                    quads[column / 2][2 * half + column % 2] = w;
                    sum += f64::from(w);
                }
            }
            Ok(sum)
        };
        #[cfg(feature = "render")]
        let sums: Result<Vec<f64>, _> = {
            use rayon::prelude::*;
            quads.par_chunks_mut(quads_wide).enumerate().map(fill).collect()
        };
        #[cfg(not(feature = "render"))]
        let sums: Result<Vec<f64>, _> =
            quads.chunks_mut(quads_wide).enumerate().map(fill).collect();
        Ok((Self { width: quads_wide, quads }, sums?.iter().sum()))
    }

    /// The sums of this level's quads, again in quads.
    fn coarser(&self) -> Self {
        let height = self.quads.len() / self.width;
        let width = self.width.div_ceil(2);
        let mut quads = vec![[0.0; 4]; width * height.div_ceil(2)];
        for (i, [a, b, c, d]) in self.quads.iter().enumerate() {
            let (column, row) = (i % self.width, i / self.width);
            quads[row / 2 * width + column / 2][row % 2 * 2 + column % 2] = (a + b) + (c + d);
        }
        Self { width, quads }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec2;
    use crate::sampling::Pcg32;

    fn table(width: usize, weights: &[f32]) -> Result<HierarchicalTable, TableError> {
        HierarchicalTable::from_rows(width, weights.len() / width, |row, out| {
            out.copy_from_slice(&weights[row * width..(row + 1) * width]);
        })
    }

    #[test]
    fn pmf_is_the_weight_over_the_sum() {
        let t = table(3, &[1.0, 3.0, 0.0, 4.0, 0.0, 8.0]).unwrap();
        assert_eq!(t.total(), 16.0);
        assert_eq!((t.pmf(1, 0), t.pmf(0, 1), t.pmf(2, 1)), (3.0 / 16.0, 0.25, 0.5));
    }

    /// A fine grid over the unit square lands in each cell as often as its weight says.
    #[test]
    fn areas_of_the_unit_square_follow_the_weights() {
        for (width, height) in [(1, 1), (1, 7), (5, 1), (3, 5), (8, 4), (13, 6)] {
            let mut pcg = Pcg32::new(width as u64, height as u64);
            let mut weights: Vec<f32> = (0..width * height).map(|_| pcg.next_f32()).collect();
            weights[0] = if weights.len() > 1 { 0.0 } else { 1.0 };
            let t = table(width, &weights).unwrap();
            let n = 1024;
            let mut counts = vec![0u32; weights.len()];
            for i in 0..n * n {
                let u = vec2((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                let s = t.sample(u);
                counts[s.row * width + s.column] += 1;
                assert_eq!(s.pmf, t.pmf(s.column, s.row));
            }
            for (i, &count) in counts.iter().enumerate() {
                let share = f64::from(count) / f64::from((n * n) as u32);
                let pmf = t.pmf(i % width, i / width);
                // A cell's border passes through no more than 4 n of the grid's squares.
                assert!((share - pmf).abs() < 4.0 / n as f64, "{width}x{height} {i}");
            }
        }
    }

    #[test]
    fn the_ends_of_the_unit_square_stay_inside_and_zeros_are_never_drawn() {
        let mut pcg = Pcg32::new(3, 0);
        let mut weights: Vec<f32> = (0..15 * 9)
            .map(|_| if pcg.next_f32() < 0.5 { 0.0 } else { (60.0 * pcg.next_f32() - 30.0).exp() })
            .collect();
        weights[15 * 9 - 1] = 0.0;
        let t = table(15, &weights).unwrap();
        let ends = [0.0, f32::MIN_POSITIVE, 0.5, ONE_MINUS_EPSILON];
        let corners = ends.iter().flat_map(|&x| ends.map(|y| vec2(x, y)));
        let random = (0..50_000).map(|_| vec2(pcg.next_f32(), pcg.next_f32()));
        for u in corners.chain(random) {
            let s = t.sample(u);
            assert!(s.column < 15 && s.row < 9);
            assert!(weights[s.row * 15 + s.column] > 0.0, "{u}");
            assert!((0.0..1.0).contains(&s.inside.x) && (0.0..1.0).contains(&s.inside.y));
        }
    }

    #[test]
    fn bad_weights_are_named() {
        assert_eq!(table(1, &[]).unwrap_err(), TableError::Empty);
        assert_eq!(table(2, &[0.0; 6]).unwrap_err(), TableError::AllZero);
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            let error = table(2, &[1.0, 1.0, 1.0, bad]).unwrap_err();
            assert!(matches!(error, TableError::BadWeight { index: 3, .. }), "{error}");
        }
    }
}
