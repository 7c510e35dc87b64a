//! Nearest-light cells on the sphere, and Lloyd's refinement of lights by them.
//!
//! Refinement alternates: every piece of the map goes to the nearest light, every light moves to
//! the energy centroid of its pieces (Lloyd 1982, "Least Squares Quantization in PCM"; on unit
//! vectors Dhillon & Modha 2001, "Concept Decompositions"). Σ (W − |R|) over cells never grows.
//! Cells know neither poles nor seam, so a sun that the first cuts divided becomes whole.
//!
//! Which light is nearest is found for whole tiles of the map at a time: only lights that are
//! within the nearest one's distance plus the tile's diameter of its middle can win in it. A tile
//! with one such light is done; others are quartered. The result is that of trying every light at
//! every texel.

use std::ops::Range;

use super::regions::{Blocks, Metric};
use super::texels::{Texels, bands, in_order, unit};
use crate::math::Vec3;

/// Rows of a band, which one thread does at a time, and columns of its first tiles.
const TILE: usize = 64;
/// Tiles of this size are not quartered again.
const LEAF: usize = 4;
/// What rounding may do to the length of a chord.
const SLACK: f64 = 1e-6;

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
        // No wider than a quarter of a turn, or a tile is not inside the cone around its middle.
        let width = TILE.min(self.blocks.columns.div_ceil(4));
        let mut candidates: Vec<u32> = (0..self.lights.len() as u32).collect();
        for left in (0..self.blocks.columns).step_by(width) {
            let columns = left..(left + width).min(self.blocks.columns);
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
        let (middle, radius) = self.cone(tile);
        let chord = |i: u32| f64::from(middle.distance(self.lights[i as usize]));
        let to = stack.len();
        let nearest = stack[from..].iter().map(|&i| chord(i)).fold(f64::INFINITY, f64::min);
        let angle = 2.0 * (0.5 * nearest + SLACK).min(1.0).asin() + 2.0 * radius;
        let reach = 2.0 * (0.5 * angle.min(std::f64::consts::PI)).sin() + SLACK;
        for k in from..to {
            if chord(stack[k]) <= reach {
                stack.push(stack[k]);
            }
        }
    }

    /// The middle of a tile and the angle from it to its farthest point: one of its corners.
    fn cone(&self, tile: &Tile) -> (Vec3, f64) {
        let b = &self.blocks;
        let (x0, x1) = (b.x(tile.columns.start) as f64, b.x(tile.columns.end) as f64);
        let (y0, y1) = (b.y(tile.rows.start) as f64, b.y(tile.rows.end) as f64);
        let to_vec3 = |[x, y, z]: [f64; 3]| Vec3::new(x as f32, y as f32, z as f32);
        let middle = to_vec3(self.texels.direction(0.5 * (x0 + x1), 0.5 * (y0 + y1)));
        // Left and right are the same distance away.
        let chord = [y0, y1].map(|y| to_vec3(self.texels.direction(x0, y)).distance(middle));
        let chord = f64::from(chord[0].max(chord[1]));
        (middle, 2.0 * (0.5 * chord + SLACK).min(1.0).asin())
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
                    row[x] = search.nearest(candidates, texels.centre(x, y));
                }
            }
        });
    });
    labels
}

/// The energy of a block as a vector.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// The unit vector of ∫ L ω dω.
    direction: Vec3,
    /// Its length.
    weight: f32,
}

/// Blocks of the map that go to a light as a whole.
pub(super) struct Pieces<'a> {
    texels: &'a Texels<'a>,
    blocks: Blocks,
    pieces: Vec<Piece>,
}

impl<'a> Pieces<'a> {
    /// Texels, or on maps of more than `max` as many blocks.
    pub(super) fn new(texels: &'a Texels<'a>, max: usize) -> Self {
        let blocks = Blocks::at_most(max, texels.width(), texels.height());
        let piece = |first: [f64; 3]| {
            let length = first.map(|c| c * c).iter().sum::<f64>().sqrt();
            let direction = unit(first).unwrap_or(Vec3::Y);
            Piece { direction, weight: length as f32 }
        };
        let moments = blocks.moments(texels, Metric::Sphere);
        let pieces = moments.iter().map(|m| piece(m.first)).collect();
        Self { texels, blocks, pieces }
    }

    /// Moves the lights by `steps` of Lloyd's at the most; a light without energy stays.
    pub(super) fn refine(&self, lights: &mut [Vec3], steps: u32) {
        for _ in 0..steps {
            let centroids = self.centroids(lights);
            let mut moved = false;
            for (light, centroid) in lights.iter_mut().zip(centroids) {
                let centroid = unit(centroid).unwrap_or(*light);
                moved |= centroid != *light;
                *light = centroid;
            }
            if !moved {
                break;
            }
        }
    }

    /// ∫ L ω dω over the cell of each light.
    fn centroids(&self, lights: &[Vec3]) -> Vec<[f64; 3]> {
        let search = Search { texels: self.texels, blocks: self.blocks, lights };
        let parts = in_order(search.n_bands(), |band| {
            let mut sums = vec![[0.0; 3]; lights.len()];
            search.band(band, &mut |tile, candidates| {
                for y in tile.rows.clone() {
                    let row = &self.pieces[y * self.blocks.columns..][..self.blocks.columns];
                    self.gather(&search, candidates, &row[tile.columns.clone()], &mut sums);
                }
            });
            sums
        });
        let mut sums = vec![[0.0; 3]; lights.len()];
        for part in parts {
            for (s, p) in sums.iter_mut().zip(part) {
                (0..3).for_each(|c| s[c] += p[c]);
            }
        }
        sums
    }

    fn gather(
        &self,
        search: &Search,
        candidates: &[u32],
        pieces: &[Piece],
        sums: &mut [[f64; 3]],
    ) {
        for p in pieces {
            let light = search.nearest(candidates, p.direction) as usize;
            let r = (p.direction * p.weight).as_dvec3();
            let sum = &mut sums[light];
            sum[0] += r.x;
            sum[1] += r.y;
            sum[2] += r.z;
        }
    }
}
