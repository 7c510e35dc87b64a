//! Nearest-light cells on the sphere, and Lloyd's refinement of lights.
//!
//! Refinement alternates two steps: every piece of the map is assigned to the nearest light, and every
//! light moves to the energy centroid of its pieces (Lloyd 1982, "Least Squares Quantization in PCM"; on unit
//! vectors Dhillon & Modha 2001, "Concept Decompositions"). Σ (W − |R|) over cells never grows.
//! Cells do not depend on poles or the seam, so a sun divided by the first cuts becomes whole again.
//!
//! The nearest light is found for whole tiles of the map at a time. Only lights whose distance from the
//! tile's center is within the nearest light's distance plus the tile's diameter can be nearest in it. A
//! tile with one such light is done; others are divided into four. The result is the same as testing
//! every light at every texel.

use std::ops::Range;

use super::regions::{Blocks, Moments, SummedArea};
use super::texels::{Texels, unit};
use crate::math::{PI, Vec3, functions};
use crate::parallel::{bands, in_order};

/// Rows of a band, which one thread does at a time, and columns of its first tiles.
const TILE: usize = 64;
/// Tiles of this size are not quartered again.
const LEAF: usize = 4;
/// What rounding may do to the length of a chord.
const SLACK: f32 = 2e-6;

/// Columns and rows of a grid of pieces.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    pub(super) columns: Range<usize>,
    pub(super) rows: Range<usize>,
}

/// The grid whose pieces go to the nearest of the lights: blocks of texels, or texels.
struct Search<'a> {
    texels: &'a Texels<'a>,
    blocks: Blocks,
    lights: &'a [Vec3],
}

impl Search<'_> {
    fn n_bands(&self) -> usize {
        self.blocks.rows.div_ceil(TILE)
    }

    /// Calls `leaf` for tiles that partition a band, each with the lights that can be nearest in
    /// it: one, unless the tile is small.
    fn band(&self, band: usize, leaf: &mut impl FnMut(&Tile, &[u32])) {
        let rows = band * TILE..((band + 1) * TILE).min(self.blocks.rows);
        let mut candidates: Vec<u32> = (0..self.lights.len() as u32).collect();
        for left in (0..self.blocks.columns).step_by(TILE) {
            let columns = left..(left + TILE).min(self.blocks.columns);
            self.descend(&Tile { columns, rows: rows.clone() }, 0, &mut candidates, leaf);
        }
    }

    /// `stack[from..]` are the lights that can be nearest in the tile around this one.
    fn descend(
        &self,
        tile: &Tile,
        from: usize,
        stack: &mut Vec<u32>,
        leaf: &mut impl FnMut(&Tile, &[u32]),
    ) {
        let to = stack.len();
        if to - from > 1 {
            self.narrow(tile, from, stack);
        } else {
            stack.push(stack[from]);
        }
        let Tile { columns, rows } = tile;
        if stack.len() - to == 1 || (columns.len() <= LEAF && rows.len() <= LEAF) {
            leaf(tile, &stack[to..]);
        } else {
            for rows in halves(rows) {
                for columns in halves(columns) {
                    self.descend(&Tile { columns, rows: rows.clone() }, to, stack, leaf);
                }
            }
        }
        stack.truncate(to);
    }

    /// Pushes those of `stack[from..]` that can be nearest somewhere in the tile.
    fn narrow(&self, tile: &Tile, from: usize, stack: &mut Vec<u32>) {
        let b = &self.blocks;
        let columns = b.x(tile.columns.start)..b.x(tile.columns.end);
        let rows = b.y(tile.rows.start)..b.y(tile.rows.end);
        let (middle, radius) = self.texels.cone(&columns, &rows);
        let chord_squared = |i: u32| middle.distance_squared(self.lights[i as usize]);
        let to = stack.len();
        let nearest = stack[from..].iter().map(|&i| chord_squared(i)).fold(4.0, f32::min);
        let angle = 2.0 * functions::asin((0.5 * nearest.sqrt() + SLACK).min(1.0)) + 2.0 * radius;
        let reach = 2.0 * functions::sin(0.5 * angle.min(PI)) + SLACK;
        for k in from..to {
            if chord_squared(stack[k]) <= reach * reach {
                stack.push(stack[k]);
            }
        }
    }

    /// The nearest of some lights; the first if several are.
    fn nearest(&self, candidates: &[u32], direction: Vec3) -> u32 {
        let mut best = (f32::INFINITY, candidates[0]);
        for &i in candidates {
            // A chord resolves small angles that a cosine in single precision cannot.
            let d = self.lights[i as usize].distance_squared(direction);
            if d < best.0 {
                best = (d, i);
            }
        }
        best.1
    }
}

fn halves(range: &Range<usize>) -> impl Iterator<Item = Range<usize>> + use<> {
    let middle = range.start.midpoint(range.end);
    [range.start..middle, middle..range.end].into_iter().filter(|r| !r.is_empty())
}

/// The nearest light of each texel's middle, row by row; lights are unit vectors in the map's frame.
pub(super) fn assign(texels: &Texels, lights: &[Vec3]) -> Vec<u32> {
    let (width, height) = (texels.width(), texels.height());
    let blocks = Blocks::at_most(usize::MAX, width, height);
    let search = Search { texels, blocks, lights };
    let mut labels = vec![0; width * height];
    bands(&mut labels, width * TILE, |band, labels| {
        search.band(band, &mut |tile, candidates| {
            for y in tile.rows.clone() {
                let row = &mut labels[(y - band * TILE) * width..][..width];
                if let [only] = candidates {
                    row[tile.columns.clone()].fill(*only);
                    continue;
                }
                for x in tile.columns.clone() {
                    row[x] = search.nearest(candidates, texels.center(x, y));
                }
            }
        });
    });
    labels
}

/// The energy of a block of the map, which goes to a light as a whole, as a vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// The unit vector of R = ∫ L ω dω.
    direction: Vec3,
    /// |R|; zero for a black block.
    weight: f32,
}

impl Piece {
    pub(super) fn new(m: &Moments) -> Self {
        let length = m.first.map(|c| c * c).iter().sum::<f64>().sqrt();
        Self { direction: unit(m.first).unwrap_or(Vec3::Y), weight: length as f32 }
    }

    fn moments(&self) -> Moments {
        let r = (self.direction * self.weight).as_dvec3();
        let lit = f64::from(u8::from(self.weight > 0.0));
        Moments { first: [r.x, r.y, r.z], lit, ..Moments::default() }
    }
}

/// Moves the lights by `steps` of Lloyd's at the most; a light without energy stays.
///
/// `pieces` are the blocks of `table`, row by row.
pub(super) fn refine(table: &SummedArea, pieces: &[Piece], lights: &mut [Vec3], steps: u32) {
    for _ in 0..steps {
        let cells = measure_cells(table, pieces, lights);
        let mut moved = false;
        for (light, cell) in lights.iter_mut().zip(cells) {
            // Differences of a table's sums may leave a residue where all is black.
            let centroid = if cell.lit > 0.0 { unit(cell.first) } else { None };
            let centroid = centroid.unwrap_or(*light);
            moved |= centroid != *light;
            *light = centroid;
        }
        if !moved {
            break;
        }
    }
}

/// R of the cell of each light: by the table where tiles are whole, by pieces along the borders.
fn measure_cells(table: &SummedArea, pieces: &[Piece], lights: &[Vec3]) -> Vec<Moments> {
    let blocks = table.blocks();
    let search = Search { texels: table.texels(), blocks, lights };
    let parts = in_order(search.n_bands(), |band| {
        let mut sums = vec![Moments::default(); lights.len()];
        search.band(band, &mut |tile, candidates| {
            if let [only] = candidates {
                sums[*only as usize] += table.block_sum(&tile.columns, &tile.rows);
                return;
            }
            for y in tile.rows.clone() {
                for p in &pieces[y * blocks.columns..][tile.columns.clone()] {
                    sums[search.nearest(candidates, p.direction) as usize] += p.moments();
                }
            }
        });
        sums
    });
    let mut sums = vec![Moments::default(); lights.len()];
    for part in parts {
        sums.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, Orientation};
    use crate::math::from_spherical;
    use crate::rig::regions::Metric;
    use crate::sampling::Pcg32;
    use crate::{Rgb, RgbImage};

    fn lights(n: usize, spread: f32) -> Vec<Vec3> {
        let mut pcg = Pcg32::new(n as u64, 2);
        let random =
            |pcg: &mut Pcg32| from_spherical(2.0 * pcg.next_f32() - 1.0, 7.0 * pcg.next_f32());
        let center = random(&mut pcg);
        (0..n).map(|_| (center + spread * random(&mut pcg)).normalize()).collect()
    }

    fn env(width: usize, height: usize) -> Environment {
        let mut pcg = Pcg32::new(3, 3);
        let map = RgbImage::from_fn(width, height, |_, _| Rgb::splat(pcg.next_f32()));
        Environment::new(map, Orientation::default(), 1.0).unwrap()
    }

    /// The tiles leave out no light that wins: the same as trying all, ties included.
    #[test]
    fn the_nearest_of_all() {
        for (width, height) in [(200, 100), (1, 1), (3, 70), (70, 2), (129, 64)] {
            let env = env(width, height);
            let texels = Texels::new(&env);
            for (n, spread) in [(1, 1.0), (2, 1.0), (50, 3.0), (300, 0.05), (100, 1e-3)] {
                let mut lights = lights(n, spread);
                lights.push(lights[0]);
                let blocks = Blocks::at_most(usize::MAX, width, height);
                let search = Search { texels: &texels, blocks, lights: &lights };
                let all: Vec<u32> = (0..lights.len() as u32).collect();
                for (i, label) in assign(&texels, &lights).into_iter().enumerate() {
                    let expected = search.nearest(&all, texels.center(i % width, i / width));
                    assert_eq!(label, expected, "{width}x{height}, {n} lights, texel {i}");
                }
            }
        }
    }

    /// Σ (W − |R|) over the cells never grows from one step to the next.
    #[test]
    fn refinement_lowers_the_spread() {
        let env = env(160, 80);
        let texels = Texels::new(&env);
        let blocks = Blocks::of(&texels);
        let moments = blocks.moments(&texels, Metric::Sphere);
        let pieces: Vec<Piece> = moments.iter().map(Piece::new).collect();
        let table = SummedArea::from_moments(&texels, Metric::Sphere, blocks, moments);
        let mut lights = lights(30, 5.0);
        let mut last = f64::NEG_INFINITY;
        for _ in 0..12 {
            let cells = measure_cells(&table, &pieces, &lights);
            let lit: f64 = cells.iter().map(|c| c.lit).sum();
            assert_eq!(lit, table.total().lit);
            let sum: f64 =
                cells.iter().map(|c| c.first.map(|x| x * x).iter().sum::<f64>().sqrt()).sum();
            // Pieces are in single precision.
            assert!(sum >= last * (1.0 - 1e-6), "{sum} after {last}");
            last = sum;
            refine(&table, &pieces, &mut lights, 1);
        }
    }
}
