//! Summed-area tables of luminance and its position, which measure rectangles.
//!
//! Sums are in double precision. Tables of one entry per texel would take 40 bytes each, more than a
//! gigabyte for 8192×4096, so on large maps an entry is a block of texels. Large regions are then
//! cut between blocks. Small ones are summed texel by texel, which costs less than cutting a large
//! one.

use crate::math::functions;
use std::f64::consts::TAU;
use std::ops::{Add, AddAssign, Range, Sub};

use super::TexelRect;
use super::texels::Texels;
use crate::parallel::bands;

/// Entries of a table at the most.
const MAX_BLOCKS: usize = 1 << 21;
/// Texels of a region that is summed directly on maps with blocks.
const SMALL: usize = 64 * 64;

/// How far apart light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Metric {
    /// Chords of the unit sphere.
    Sphere,
    /// Texels of the map, from its middle.
    Plane,
}

/// Luminance in a region, and where it lies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moments {
    /// W = ∫ L dω.
    pub(super) energy: f64,
    /// On the sphere ∫ L ω dω. In the plane ∫ L x dω, ∫ L y dω and ∫ L (x² + y²) dω.
    pub(super) first: [f64; 3],
    /// How many texels are not black; whole numbers, so sums and differences are exact.
    pub(super) lit: f64,
}

impl Metric {
    /// ∫ L d² dω, d the distance to the centroid: S₂ − |S₁|²/W. On the sphere S₂ = W.
    pub(super) fn variance(self, m: &Moments) -> f64 {
        if m.energy <= 0.0 {
            return 0.0;
        }
        let [a, b, c] = m.first;
        let variance = match self {
            Self::Sphere => m.energy - (a * a + b * b + c * c) / m.energy,
            Self::Plane => c - (a * a + b * b) / m.energy,
        };
        variance.max(0.0)
    }
}

impl Add for Moments {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let first = std::array::from_fn(|i| self.first[i] + o.first[i]);
        Self { energy: self.energy + o.energy, first, lit: self.lit + o.lit }
    }
}

impl AddAssign for Moments {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Sub for Moments {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        let first = std::array::from_fn(|i| self.first[i] - o.first[i]);
        Self { energy: self.energy - o.energy, first, lit: self.lit - o.lit }
    }
}

/// A grid of blocks of `step` × `step` texels; the last of a row or column may be smaller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    pub(super) step: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    width: usize,
    height: usize,
}

impl Blocks {
    /// The blocks of a summed-area table: texels, but on large maps.
    pub(super) fn of(texels: &Texels) -> Self {
        Self::at_most(MAX_BLOCKS, texels.width(), texels.height())
    }

    /// Blocks as small as `max` of them allow, a power of two wide.
    pub(super) fn at_most(max: usize, width: usize, height: usize) -> Self {
        let mut step = 1;
        while width.div_ceil(step) * height.div_ceil(step) > max {
            step *= 2;
        }
        let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
        Self { step, columns, rows, width, height }
    }

    /// The first texel column of block column `b`, which may run on across the seam.
    pub(super) fn x(&self, b: usize) -> usize {
        if b <= self.columns {
            (b * self.step).min(self.width)
        } else {
            self.width + ((b - self.columns) * self.step).min(self.width)
        }
    }

    /// The first texel row of block row `b`.
    pub(super) fn y(&self, b: usize) -> usize {
        (b * self.step).min(self.height)
    }

    /// The block column that starts at or after texel column `x`.
    fn column(&self, x: usize) -> usize {
        if x <= self.width {
            x.div_ceil(self.step)
        } else {
            self.columns + (x - self.width).div_ceil(self.step)
        }
    }

    fn row(&self, y: usize) -> usize {
        y.div_ceil(self.step)
    }

    /// The edges of `r` lie between blocks.
    fn aligned(&self, r: &TexelRect) -> bool {
        [r.x0, r.x1].iter().all(|&x| self.x(self.column(x)) == x)
            && [r.y0, r.y1].iter().all(|&y| self.y(self.row(y)) == y)
    }

    /// The moments of each block.
    pub(super) fn moments(&self, texels: &Texels, metric: Metric) -> Vec<Moments> {
        let columns = column_terms(texels, metric, 0..self.width);
        let mut moments = vec![Moments::default(); self.columns * self.rows];
        bands(&mut moments, self.columns, |row, moments| {
            for y in self.y(row)..self.y(row + 1) {
                let radiance = texels.row(y).chunks(self.step);
                let terms = columns.chunks(self.step);
                for ((m, radiance), terms) in moments.iter_mut().zip(radiance).zip(terms) {
                    let mut sums = [0.0; 4];
                    for (le, t) in radiance.iter().zip(terms) {
                        add_texel(&mut sums, f64::from(le.luminance()), t);
                    }
                    *m += combine(texels, metric, y, sums);
                }
            }
        });
        moments
    }
}

/// What columns contribute to [`Moments::first`], times the row's part.
fn column_terms(texels: &Texels, metric: Metric, columns: Range<usize>) -> Vec<[f64; 2]> {
    let middle = 0.5 * texels.width() as f64;
    let term = |x: usize| match metric {
        Metric::Sphere => texels.columns[x % texels.width()],
        Metric::Plane => {
            let x = x as f64 + 0.5 - middle;
            [x, x * x]
        }
    };
    columns.map(term).collect()
}

/// Σ L, Σ L · terms, and the number of lit texels.
fn add_texel(sums: &mut [f64; 4], luminance: f64, terms: &[f64; 2]) {
    sums[0] += luminance;
    sums[1] += luminance * terms[0];
    sums[2] += luminance * terms[1];
    sums[3] += f64::from(u8::from(luminance > 0.0));
}

/// Sums over texels of row `y` as moments.
fn combine(texels: &Texels, metric: Metric, y: usize, [l, a, b, lit]: [f64; 4]) -> Moments {
    let row = &texels.rows[y];
    let energy = l * row.solid_angle;
    let first = match metric {
        Metric::Sphere => [a * row.horizontal, l * row.vertical, b * row.horizontal],
        Metric::Plane => {
            let v = y as f64 + 0.5 - 0.5 * texels.height() as f64;
            [a * row.solid_angle, energy * v, b * row.solid_angle + energy * v * v]
        }
    };
    Moments { energy, first, lit }
}

/// Where a region can be cut along an axis: the texel column or row after the first part, and the
/// moments of that part, rising. The last entry is the whole region.
pub(super) type Profile = Vec<(usize, Moments)>;

/// A summed-area table: the moments of any rectangle of blocks by four look-ups.
pub(super) struct SummedArea<'a> {
    texels: &'a Texels<'a>,
    metric: Metric,
    blocks: Blocks,
    /// The sum over all blocks above and left of, and with, each.
    sums: Vec<Moments>,
}

impl<'a> SummedArea<'a> {
    pub(super) fn new(texels: &'a Texels<'a>, metric: Metric) -> Self {
        let blocks = Blocks::of(texels);
        Self::from_moments(texels, metric, blocks, blocks.moments(texels, metric))
    }

    /// From the moments of each block.
    pub(super) fn from_moments(
        texels: &'a Texels<'a>,
        metric: Metric,
        blocks: Blocks,
        mut sums: Vec<Moments>,
    ) -> Self {
        bands(&mut sums, blocks.columns, |_, row| {
            let mut sum = Moments::default();
            for m in row {
                sum += *m;
                *m = sum;
            }
        });
        for row in 1..blocks.rows {
            let (above, below) = sums.split_at_mut(row * blocks.columns);
            let above = &above[(row - 1) * blocks.columns..];
            below.iter_mut().zip(above).for_each(|(m, a)| *m += *a);
        }
        Self { texels, metric, blocks, sums }
    }

    pub(super) fn texels(&self) -> &'a Texels<'a> {
        self.texels
    }

    pub(super) fn metric(&self) -> Metric {
        self.metric
    }

    pub(super) fn blocks(&self) -> Blocks {
        self.blocks
    }

    /// The moments of a rectangle of blocks.
    pub(super) fn block_sum(&self, columns: &Range<usize>, rows: &Range<usize>) -> Moments {
        let strip = |c| self.corner(c, rows.end) - self.corner(c, rows.start);
        strip(columns.end) - strip(columns.start)
    }

    /// The moments of any rectangle.
    pub(super) fn measure(&self, r: &TexelRect) -> Moments {
        let [_, rows] = self.profiles(r);
        rows.last().map_or(Moments::default(), |(_, m)| *m)
    }

    /// The whole map's.
    pub(super) fn total(&self) -> Moments {
        self.corner(self.blocks.columns, self.blocks.rows)
    }

    /// The block column that starts opposite the center of light, as seen from above: a seam there
    /// turns with the map.
    pub(super) fn darkest_column(&self) -> usize {
        let [x, _, z] = self.total().first;
        let share = (functions::atan2(x, -z) / TAU).rem_euclid(1.0);
        // Light that is symmetric about a texel's middle or edge does not fall on a tie.
        let block = (share * self.blocks.columns as f64 + 0.25) as usize % self.blocks.columns;
        self.blocks.x(block)
    }

    /// The sum over the first `column` and `row` blocks, columns running on across the seam.
    fn corner(&self, column: usize, row: usize) -> Moments {
        let columns = self.blocks.columns;
        if column > columns {
            return self.corner(columns, row) + self.corner(column - columns, row);
        }
        if column == 0 || row == 0 {
            return Moments::default();
        }
        self.sums[(row - 1) * columns + column - 1]
    }

    /// Where the region can be cut along either axis: between blocks where it is large.
    pub(super) fn profiles(&self, r: &TexelRect) -> [Profile; 2] {
        let by_blocks = self.blocks.step == 1 || (r.area() > SMALL && self.blocks.aligned(r));
        if by_blocks { self.block_profiles(r) } else { self.texel_profiles(r) }
    }

    fn block_profiles(&self, r: &TexelRect) -> [Profile; 2] {
        let b = &self.blocks;
        let (left, right) = (b.column(r.x0), b.column(r.x1));
        let (top, bottom) = (b.row(r.y0), b.row(r.y1));
        let strip = |column| self.corner(column, bottom) - self.corner(column, top);
        let (start, level) = (strip(left), |row| self.corner(right, row) - self.corner(left, row));
        let above = level(top);
        [
            (left + 1..=right).map(|c| (b.x(c), strip(c) - start)).collect(),
            (top + 1..=bottom).map(|row| (b.y(row), level(row) - above)).collect(),
        ]
    }

    /// Cuts between texels, at a cost in proportion to the area.
    pub(super) fn texel_profiles(&self, r: &TexelRect) -> [Profile; 2] {
        let texels = self.texels;
        let terms = column_terms(texels, self.metric, r.x0..r.x1);
        let mut columns = vec![Moments::default(); r.x1 - r.x0];
        let mut rows = Vec::with_capacity(r.y1 - r.y0);
        let mut above = Moments::default();
        for y in r.y0..r.y1 {
            let mut row = Moments::default();
            let ranges = r.columns(texels.width());
            let radiance = ranges.iter().flat_map(|range| &texels.row(y)[range.clone()]);
            for ((column, le), t) in columns.iter_mut().zip(radiance).zip(&terms) {
                let mut sums = [0.0; 4];
                add_texel(&mut sums, f64::from(le.luminance()), t);
                let m = combine(texels, self.metric, y, sums);
                *column += m;
                row += m;
            }
            above += row;
            rows.push((y + 1, above));
        }
        let mut left = Moments::default();
        let sum = |(i, m)| {
            left += m;
            (r.x0 + i + 1, left)
        };
        [columns.into_iter().enumerate().map(sum).collect(), rows]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, Orientation};
    use crate::sampling::Pcg32;
    use crate::{Rgb, RgbImage};

    fn noise(width: usize, height: usize) -> Environment {
        let mut pcg = Pcg32::new(1, 9);
        let map = RgbImage::from_fn(width, height, |_, _| {
            let v = pcg.next_f32();
            if v < 0.3 { Rgb::BLACK } else { Rgb::splat((8.0 * v).exp()) }
        });
        Environment::new(map, Orientation::default(), 1.0).unwrap()
    }

    fn assert_close(a: &Moments, b: &Moments, scale: f64) {
        assert_eq!(a.lit, b.lit);
        assert!((a.energy - b.energy).abs() <= 1e-12 * scale, "{a:?} {b:?}");
        assert!((0..3).all(|i| (a.first[i] - b.first[i]).abs() <= 1e-12 * scale), "{a:?} {b:?}");
    }

    /// Profiles by the table, of texels or of blocks, are those by summing texels, across the seam
    /// as well.
    #[test]
    fn profiles_agree_with_sums() {
        let env = noise(150, 77);
        let texels = Texels::new(&env);
        for metric in [Metric::Sphere, Metric::Plane] {
            for max in [usize::MAX, 4000, 300] {
                let blocks = Blocks::at_most(max, 150, 77);
                let moments = blocks.moments(&texels, metric);
                let table = SummedArea::from_moments(&texels, metric, blocks, moments);
                let total = table.total();
                let scale = total.energy * if metric == Metric::Plane { 5000.0 } else { 1.0 };
                // Planar moments of a rectangle that runs across the seam are not defined.
                let x0 = if metric == Metric::Plane { 0 } else { blocks.x(blocks.columns / 2) };
                let whole = TexelRect { x0, x1: x0 + 150, y0: 0, y1: 77 };
                let part = TexelRect {
                    y0: blocks.y(1),
                    y1: 77,
                    x1: blocks.x(blocks.column(x0) + 5),
                    ..whole
                };
                for r in [whole, part] {
                    let direct = table.texel_profiles(&r);
                    for (axis, by_blocks) in table.block_profiles(&r).into_iter().enumerate() {
                        for (at, m) in by_blocks {
                            let sum = direct[axis].iter().find(|(a, _)| *a == at).unwrap().1;
                            assert_close(&m, &sum, scale);
                        }
                    }
                }
                assert_close(&table.measure(&whole), &total, scale);
            }
        }
    }

    #[test]
    fn variance_is_the_mean_square_distance_to_the_centroid() {
        let env = noise(31, 16);
        let texels = Texels::new(&env);
        let table = SummedArea::new(&texels, Metric::Plane);
        let m = table.total();
        let centroid = [m.first[0] / m.energy, m.first[1] / m.energy];
        let sum = (0..31 * 16).map(|i| {
            let (x, y) = ((i % 31) as f64 - 15.0, (i / 31) as f64 - 7.5);
            let weight =
                texels.rows[i / 31].solid_angle * f64::from(env.map().pixels[i].luminance());
            weight * ((x - centroid[0]).powi(2) + (y - centroid[1]).powi(2))
        });
        let sum: f64 = sum.sum();
        assert!((Metric::Plane.variance(&m) / sum - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_black_region_has_no_lit_texels_beside_a_sun() {
        let mut map = RgbImage::filled(64, 32, Rgb::splat(1e-9));
        map.pixels[70] = Rgb::splat(1e9);
        map.pixels[1000..1020].fill(Rgb::BLACK);
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let texels = Texels::new(&env);
        let table = SummedArea::new(&texels, Metric::Sphere);
        assert_eq!(table.measure(&TexelRect { x0: 42, x1: 60, y0: 15, y1: 16 }).lit, 0.0);
    }
}
