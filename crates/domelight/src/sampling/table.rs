//! Tabulated densities in one and two dimensions, sampled by inversion of the cumulative sum.
//!
//! Prefix sums are stored in double precision and not normalized. The probability of a cell *is* the
//! difference of its two prefix sums over the total, so [`Table2d::sample`] and [`Table2d::pmf`] agree
//! exactly on maps of any size. Inversion preserves the order of the uniform numbers, so stratified points
//! stay stratified (an alias table would be faster but lose the strata). A guide table (the cutpoints of
//! Chen & Asau 1974) gives the start of the search.

use super::ONE_MINUS_EPSILON;
use crate::math::{Vec2, vec2};

/// An error in the weights of a table.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// There are no weights.
    #[error("a table needs at least one weight")]
    Empty,
    /// A weight that is negative, NaN or infinite.
    #[error("weight {index} is {value}; weights must be finite and not negative")]
    BadWeight {
        /// Which weight.
        index: usize,
        /// Its value.
        value: f32,
    },
    /// All weights are zero.
    #[error("all weights are zero")]
    AllZero,
}

/// The sum of some weights after checking each.
pub(super) fn check_weights(weights: &[f32]) -> Result<f64, TableError> {
    if weights.is_empty() {
        return Err(TableError::Empty);
    }
    match weights.iter().position(|w| !w.is_finite() || *w < 0.0) {
        Some(index) => Err(TableError::BadWeight { index, value: weights[index] }),
        None => Ok(weights.iter().map(|&w| f64::from(w)).sum()),
    }
}

/// Cells of a running sum that share an entry of its guide.
const CELLS_PER_CUT: usize = 4;

/// Entries of the guide of a running sum of `n` cells: one more than there are cuts.
const fn guide_len(n: usize) -> usize {
    n.div_ceil(CELLS_PER_CUT) + 1
}

/// Fills the guide: entry k is the cell that the k-th of equally spaced cuts through the sum falls
/// into. Two or three cells lie between cuts on average, so a search ends in a cache line or two.
fn fill_guide(sums: &[f64], guide: &mut [u32]) {
    let n_cuts = guide.len() - 1;
    let total = sums[sums.len() - 1];
    let mut cell = 0;
    for (k, g) in guide.iter_mut().enumerate() {
        let cut = total * (k as f64 / n_cuts as f64);
        while cell + 1 < sums.len() && sums[cell] <= cut {
            cell += 1;
        }
        *g = cell as u32;
    }
}

/// The cell of a running sum that `u` of its total falls into, and where in it: both `u` and the
/// rest are in [0, 1).
///
/// `sums[i]` is the sum up to and including cell i. A cell of no width is never found.
fn invert(sums: &[f64], guide: &[u32], u: f32) -> (usize, f32) {
    let x = f64::from(u) * sums[sums.len() - 1];
    let k = (f64::from(u) * (guide.len() - 1) as f64) as usize;
    // Rounding may put x a step across the cut: look one cell further on both sides.
    let low = (guide[k] as usize).saturating_sub(1);
    let high = (guide[k + 1] as usize + 2).min(sums.len());
    let i = low + sums[low..high].partition_point(|&s| s <= x);
    let i = i.min(sums.len() - 1);
    let start = if i == 0 { 0.0 } else { sums[i - 1] };
    let rest = ((x - start) / (sums[i] - start)) as f32;
    (i, rest.clamp(0.0, ONE_MINUS_EPSILON))
}

/// The width of cell `i` of a running sum.
fn width(sums: &[f64], i: usize) -> f64 {
    if i == 0 { sums[0] } else { sums[i] - sums[i - 1] }
}

/// A piecewise-constant density over n cells.
#[derive(Clone, Debug)]
pub struct Table1d {
    sums: Vec<f64>,
    guide: Vec<u32>,
}

impl Table1d {
    /// Creates a table from non-negative finite weights, not all zero.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn new(weights: &[f32]) -> Result<Self, TableError> {
        check_weights(weights)?;
        let mut sum = 0.0;
        Self::from_sums(
            weights
                .iter()
                .map(|&w| {
                    sum += f64::from(w);
                    sum
                })
                .collect(),
        )
    }

    fn from_sums(sums: Vec<f64>) -> Result<Self, TableError> {
        match sums.last() {
            None => Err(TableError::Empty),
            Some(&total) if total <= 0.0 => Err(TableError::AllZero),
            Some(_) => {
                let mut guide = vec![0; guide_len(sums.len())];
                fill_guide(&sums, &mut guide);
                Ok(Self { sums, guide })
            }
        }
    }

    /// The number of cells.
    pub fn len(&self) -> usize {
        self.sums.len()
    }

    /// Always false: a table has at least one cell.
    pub fn is_empty(&self) -> bool {
        self.sums.is_empty()
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// The probability of cell `i`.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn pmf(&self, i: usize) -> f64 {
        width(&self.sums, i) / self.total()
    }

    /// Samples a cell. Also returns the remainder of `u` in [0, 1), the position inside the cell.
    pub fn sample(&self, u: f32) -> (usize, f32) {
        invert(&self.sums, &self.guide, u)
    }
}

/// A cell sampled from a [`Table2d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableSample {
    /// The column of the cell.
    pub column: usize,
    /// The row of the cell.
    pub row: usize,
    /// The position inside the cell, in [0, 1)².
    pub inside: Vec2,
    /// The probability of the cell.
    pub pmf: f64,
}

/// A piecewise-constant density over rows and columns: p(row) · p(column | row).
#[derive(Clone, Debug)]
pub struct Table2d {
    width: usize,
    rows: Table1d,
    /// Running sums of each row, row by row.
    columns: Vec<f64>,
    /// Their guides.
    guides: Vec<u32>,
}

impl Table2d {
    /// Creates a table from `width · height` weights; `weight(row, out)` writes the weights of one row.
    ///
    /// Rows are independent, and are filled in parallel with the feature `render`.
    ///
    /// # Errors
    /// See [`TableError`]; the index of a bad weight is row · width + column.
    pub fn from_rows(
        width: usize,
        height: usize,
        weights: impl Fn(usize, &mut [f64]) + Sync,
    ) -> Result<Self, TableError> {
        if width == 0 || height == 0 {
            return Err(TableError::Empty);
        }
        let mut columns = vec![0.0; width * height];
        let mut guides = vec![0; guide_len(width) * height];
        let fill = |(row, (sums, guide)): (usize, (&mut [f64], &mut [u32]))| {
            weights(row, sums);
            let mut sum = 0.0f64;
            for (column, s) in sums.iter_mut().enumerate() {
                if !s.is_finite() || *s < 0.0 {
                    let index = row * width + column;
                    return Err(TableError::BadWeight { index, value: *s as f32 });
                }
                sum += *s;
                *s = sum;
            }
            fill_guide(sums, guide);
            Ok(sum)
        };
        #[cfg(feature = "render")]
        let row_sums: Result<Vec<f64>, _> = {
            use rayon::prelude::*;
            let guides = guides.par_chunks_mut(guide_len(width));
            columns.par_chunks_mut(width).zip(guides).enumerate().map(fill).collect()
        };
        #[cfg(not(feature = "render"))]
        let row_sums: Result<Vec<f64>, _> = {
            let guides = guides.chunks_mut(guide_len(width));
            columns.chunks_mut(width).zip(guides).enumerate().map(fill).collect()
        };
        let mut sums = row_sums?;
        let mut total = 0.0;
        for s in &mut sums {
            total += *s;
            *s = total;
        }
        Ok(Self { width, rows: Table1d::from_sums(sums)?, columns, guides })
    }

    /// Creates a table from weights, row by row.
    ///
    /// # Errors
    /// See [`TableError`].
    ///
    /// # Panics
    /// If `weights` is not a whole number of rows.
    pub fn new(width: usize, weights: &[f32]) -> Result<Self, TableError> {
        check_weights(weights)?;
        assert!(width > 0 && weights.len().is_multiple_of(width), "whole rows of {width}");
        Self::from_rows(width, weights.len() / width, |row, out| {
            for (o, &w) in out.iter_mut().zip(&weights[row * width..]) {
                *o = f64::from(w);
            }
        })
    }

    /// The number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> usize {
        self.rows.len()
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.rows.total()
    }

    /// The marginal over rows.
    pub fn rows(&self) -> &Table1d {
        &self.rows
    }

    /// The probability of a column given its row; zero in a row without weight.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn conditional_pmf(&self, column: usize, row: usize) -> f64 {
        let sums = self.row_sums(row);
        let total = sums[self.width - 1];
        if total > 0.0 { width(sums, column) / total } else { 0.0 }
    }

    /// The probability of a cell.
    ///
    /// # Panics
    /// If there is no such cell.
    pub fn pmf(&self, column: usize, row: usize) -> f64 {
        self.rows.pmf(row) * self.conditional_pmf(column, row)
    }

    /// Samples a row with `u.y`, then a column with `u.x`.
    pub fn sample(&self, u: Vec2) -> TableSample {
        let (row, y) = self.rows.sample(u.y);
        let n = guide_len(self.width);
        let guide = &self.guides[row * n..(row + 1) * n];
        let (column, x) = invert(self.row_sums(row), guide, u.x);
        TableSample { column, row, inside: vec2(x, y), pmf: self.pmf(column, row) }
    }

    fn row_sums(&self, row: usize) -> &[f64] {
        &self.columns[row * self.width..(row + 1) * self.width]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    #[test]
    fn pmf_is_the_weight_over_the_sum() {
        let table = Table1d::new(&[1.0, 0.0, 3.0, 4.0]).unwrap();
        assert_eq!([0, 1, 2, 3].map(|i| table.pmf(i)), [0.125, 0.0, 0.375, 0.5]);
        let table = Table2d::new(2, &[1.0, 3.0, 0.0, 4.0]).unwrap();
        assert_eq!(table.pmf(0, 0), 0.125);
        assert_eq!(table.pmf(1, 1), 0.5);
        assert_eq!(table.conditional_pmf(1, 0), 0.75);
    }

    #[test]
    fn the_ends_of_the_unit_interval_stay_inside() {
        for weights in [vec![1.0], vec![0.0, 1.0, 0.0], vec![1e-30, 1.0, 1e-30], vec![0.1; 1000]] {
            let table = Table1d::new(&weights).unwrap();
            for u in [0.0, f32::MIN_POSITIVE, 0.5, ONE_MINUS_EPSILON] {
                let (i, rest) = table.sample(u);
                assert!(weights[i] > 0.0 && (0.0..1.0).contains(&rest), "{u} {i} {rest}");
            }
        }
    }

    #[test]
    fn the_guide_finds_what_a_search_of_all_finds() {
        let mut pcg = Pcg32::new(9, 0);
        for n in [1, 2, 3, 7, 64, 1000] {
            let mut weight =
                || (pcg.next_f32() * 40.0 - 38.0).exp() * f32::from(pcg.next_f32() > 0.3);
            let mut weights: Vec<f32> = (0..n).map(|_| weight()).collect();
            weights[n / 2] = 1.0;
            let table = Table1d::new(&weights).unwrap();
            for k in 0..20_000 {
                let u = k as f32 / 20_000.0;
                let x = f64::from(u) * table.total();
                let expected = table.sums.partition_point(|&s| s <= x);
                assert_eq!(table.sample(u).0, expected.min(n - 1), "{n} cells, {u}");
            }
        }
    }

    #[test]
    fn a_weight_of_zero_is_never_drawn() {
        let mut pcg = Pcg32::new(1, 0);
        let weights: Vec<f32> =
            (0..64).map(|i| if i % 3 == 0 { 0.0 } else { pcg.next_f32() * 1e-3 }).collect();
        let table = Table2d::new(8, &weights).unwrap();
        for _ in 0..100_000 {
            let s = table.sample(vec2(pcg.next_f32(), pcg.next_f32()));
            assert!(weights[s.row * 8 + s.column] > 0.0);
            assert_eq!(s.pmf, table.pmf(s.column, s.row));
        }
    }

    #[test]
    fn one_bright_texel_among_millions_keeps_its_neighbors_right() {
        // Sums in single precision would lose the dim cells behind the bright one.
        let mut weights = vec![1e-6f32; 1 << 20];
        weights[7] = 1e6;
        let table = Table1d::new(&weights).unwrap();
        let expected = f64::from(1e-6f32) / (1e6 + f64::from(1e-6f32) * ((1 << 20) as f64 - 1.0));
        // The spacing of doubles near 10⁶ bounds the error of the difference.
        assert!((table.pmf(1_000_000) - expected).abs() < 2e-16);
    }

    #[test]
    fn one_row_one_column_and_bad_weights() {
        assert_eq!(
            Table2d::new(4, &[0.0, 0.0, 1.0, 0.0]).unwrap().sample(vec2(0.3, 0.9)).column,
            2
        );
        assert_eq!(Table2d::new(1, &[0.0, 2.0, 0.0]).unwrap().sample(vec2(0.3, 0.9)).row, 1);
        assert_eq!(Table1d::new(&[]).unwrap_err(), TableError::Empty);
        assert_eq!(Table1d::new(&[0.0; 3]).unwrap_err(), TableError::AllZero);
        assert!(matches!(Table1d::new(&[1.0, -1.0]), Err(TableError::BadWeight { index: 1, .. })));
        assert!(Table2d::new(2, &[1.0, f32::NAN]).is_err());
    }
}
