//! A pyramid of radiance × solid angle over the texels of a map.
//!
//! A node holds the light of a block of texels as moments about the light's centroid, so that a small sun in a large
//! block is as concentrated as it is.

use super::geometry::{Division, Patch, Shape, meridian};
use crate::RgbImage;
use crate::math::{Vec3, functions};
use crate::parallel::in_order;

/// The maximum number of blocks of the finest level.
const MOST_BLOCKS: usize = 1 << 17;

/// The light of a block of texels, in the map's frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    /// The centroid of the light of all channels, a unit vector.
    pub(super) direction: Vec3,
    pub(super) shape: Shape,
    /// W = ∫ L dω of each channel.
    pub(super) energy: [f32; 3],
    /// ∫ L (ω − centroid) dω of each channel.
    pub(super) first: [[f32; 3]; 3],
    /// (xx, yy, zz, 2xy, 2yz, 2xz) of ∫ L (ω − centroid)(ω − centroid)ᵀ dω of each channel.
    pub(super) second: [[f32; 6]; 3],
}

/// A block of a level, or a texel or part of one.
#[derive(Clone, Copy)]
pub(super) enum Place {
    Block { level: usize, x: usize, y: usize },
    Texel { depth: usize, x: usize, y: usize },
}

impl Place {
    /// The four parts of a texel or of a part of one.
    #[inline(always)]
    pub(super) fn parts(depth: usize, x: usize, y: usize) -> [Self; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| Self::Texel {
            depth: depth + 1,
            x: 2 * x + dx,
            y: 2 * y + dy,
        })
    }
}

/// The nodes of one level, row by row.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) nodes: Vec<Node>,
}

/// Levels of blocks, each of 2 × 2 blocks of the level before; below them texels and parts of texels.
#[derive(Clone, Debug)]
pub(super) struct Pyramid<'a> {
    pub(super) map: &'a RgbImage,
    /// Columns and rows of texels in a block of the first level.
    pub(super) block: usize,
    /// From the finest level to a single node.
    pub(super) levels: Vec<Level>,
    /// The map's texels, then their halves, quarters, …
    pub(super) divisions: Vec<Division>,
    /// ∫ L dω / 4π of each channel.
    pub(super) mean: [f32; 3],
}

impl<'a> Pyramid<'a> {
    /// Adds the parts of a block to the places to visit.
    #[inline(always)]
    pub(super) fn open_block(&self, level: usize, x: usize, y: usize, places: &mut Vec<Place>) {
        if let Some(below) = level.checked_sub(1) {
            let finer = &self.levels[below];
            for y in 2 * y..finer.rows.min(2 * y + 2) {
                for x in 2 * x..finer.columns.min(2 * x + 2) {
                    places.push(Place::Block { level: below, x, y });
                }
            }
            return;
        }
        let (block, map) = (self.block, self.map);
        for y in y * block..map.height.min((y + 1) * block) {
            for x in x * block..map.width.min((x + 1) * block) {
                places.push(Place::Texel { depth: 0, x, y });
            }
        }
    }

    /// Texels are divided until their parts are about as small as `finest` \[rad\].
    pub(super) fn new(map: &'a RgbImage, finest: f64) -> Self {
        let RgbImage { width, height, .. } = *map;
        let mut block = 2;
        while width.div_ceil(block) * height.div_ceil(block) > MOST_BLOCKS {
            block *= 2;
        }
        let mut clusters = block_clusters(map, block);
        let (mut columns, mut rows) = (width.div_ceil(block), height.div_ceil(block));
        let mut levels = vec![level(columns, rows, &clusters)];
        while columns * rows > 1 {
            clusters = coarser(columns, rows, &clusters);
            (columns, rows) = (columns.div_ceil(2), rows.div_ceil(2));
            levels.push(level(columns, rows, &clusters));
        }
        let mean = clusters[0].energy.map(|e| (e / (4.0 * std::f64::consts::PI)) as f32);
        let n = divisions(height.min(width.div_ceil(2)), finest);
        let divisions = (0..n).map(|depth| Division::new(width << depth, height << depth));
        Self { map, block, levels, divisions: divisions.collect(), mean }
    }

    /// The index of the texel in (column, row) of a division.
    #[inline(always)]
    pub(super) fn radiance(&self, depth: usize, x: usize, y: usize) -> [f32; 3] {
        self.map.pixels[(y >> depth) * self.map.width + (x >> depth)].to_array()
    }
}

/// How many times, plus one, texels of `height` rows are halved.
fn divisions(height: usize, finest: f64) -> usize {
    /// The size of the parts that the horizon may divide \[rad\].
    const AT_HORIZON: f64 = 4e-4;
    const FEWEST: f64 = 2.0;
    const MOST: f64 = 10.0;
    let finest = finest.min(AT_HORIZON);
    let texel = std::f64::consts::PI / height as f64;
    1 + functions::log2(texel / finest).ceil().clamp(FEWEST, MOST) as usize
}

fn level(columns: usize, rows: usize, clusters: &[Cluster]) -> Level {
    Level { columns, rows, nodes: clusters.iter().map(Cluster::node).collect() }
}

/// The blocks of `block` × `block` texels, row by row.
fn block_clusters(map: &RgbImage, block: usize) -> Vec<Cluster> {
    let RgbImage { width, height, .. } = *map;
    let meridians: Vec<[f64; 2]> = (0..width).map(|x| meridian(x, width)).collect();
    let rows = in_order(height.div_ceil(block), |row| {
        let ys = row * block..height.min((row + 1) * block);
        let patches: Vec<Patch> = ys.clone().map(|y| Patch::new(y, width, height)).collect();
        let mut texels = Vec::with_capacity(block * block);
        let cluster = |column: usize| {
            texels.clear();
            for (y, patch) in ys.clone().zip(&patches) {
                for x in column * block..width.min((column + 1) * block) {
                    let radiance = map.pixels[y * width + x].to_array();
                    texels.push(Cluster::of_texel(patch, meridians[x], radiance));
                }
            }
            Cluster::merged(&texels)
        };
        (0..width.div_ceil(block)).map(cluster).collect::<Vec<_>>()
    });
    rows.concat()
}

/// Blocks of 2 × 2 clusters.
fn coarser(columns: usize, rows: usize, clusters: &[Cluster]) -> Vec<Cluster> {
    let merged = |row: usize, column: usize| {
        let ys = 2 * row..rows.min(2 * row + 2);
        let xs = 2 * column..columns.min(2 * column + 2);
        let parts: Vec<Cluster> =
            ys.flat_map(|y| xs.clone().map(move |x| clusters[y * columns + x])).collect();
        Cluster::merged(&parts)
    };
    let row = |row: usize| (0..columns.div_ceil(2)).map(|x| merged(row, x)).collect::<Vec<_>>();
    in_order(rows.div_ceil(2), row).concat()
}

/// A [`Node`] in double precision.
#[derive(Clone, Copy, Debug, Default)]
struct Cluster {
    direction: [f64; 3],
    radius: f64,
    spread: f64,
    solid_angle: f64,
    energy: [f64; 3],
    first: [[f64; 3]; 3],
    /// (xx, yy, zz, xy, yz, xz).
    second: [[f64; 6]; 3],
}

impl Cluster {
    fn of_texel(patch: &Patch, [x, z]: [f64; 2], radiance: [f32; 3]) -> Self {
        let in_map = |[h, v]: [f64; 2]| [h * x, v, h * z];
        let [hh, hv, vv, pp] = patch.second;
        // p = (−z, 0, x).
        let second = [
            hh * x * x + pp * z * z,
            vv,
            hh * z * z + pp * x * x,
            hv * x,
            hv * z,
            (hh - pp) * x * z,
        ];
        let radiance = radiance.map(f64::from);
        Self {
            direction: in_map(patch.centroid),
            radius: patch.radius,
            spread: patch.spread,
            solid_angle: patch.solid_angle,
            energy: radiance.map(|l| l * patch.solid_angle),
            first: radiance.map(|l| in_map(patch.first).map(|m| l * m)),
            second: radiance.map(|l| second.map(|m| l * m)),
        }
    }

    fn is_black(&self) -> bool {
        self.energy == [0.0; 3]
    }

    /// All light of the parts about its common centroid.
    fn merged(parts: &[Self]) -> Self {
        let mut whole =
            Self { solid_angle: parts.iter().map(|p| p.solid_angle).sum(), ..Self::default() };
        let lit = || parts.iter().filter(|part| !part.is_black());
        let Some(some) = lit().next() else { return whole };
        let mut moment = [0.0; 3];
        for part in lit() {
            for c in 0..3 {
                whole.energy[c] += part.energy[c];
                let along = |i: usize| part.energy[c] * part.direction[i] + part.first[c][i];
                (0..3).for_each(|i| moment[i] += along(i));
            }
        }
        let length = norm(moment);
        let has_direction = length > 1e-6 * whole.energy.iter().sum::<f64>();
        whole.direction = if has_direction { moment.map(|m| m / length) } else { some.direction };
        let mut cubes = [0.0; 3];
        for part in lit() {
            let shift = std::array::from_fn(|i| part.direction[i] - whole.direction[i]);
            let distance = norm(shift);
            let angle = 2.0 * functions::asin((0.5 * distance).min(1.0));
            whole.radius = whole.radius.max(angle + part.radius);
            // Minkowski's inequality.
            let cube = functions::powi(part.spread + distance, 3);
            for c in 0..3 {
                whole.add_shifted(part, c, shift);
                cubes[c] += part.energy[c] * cube;
            }
        }
        let mean = |c: usize| if whole.energy[c] > 0.0 { cubes[c] / whole.energy[c] } else { 0.0 };
        whole.spread = functions::cbrt((0..3).map(mean).fold(0.0, f64::max));
        whole
    }

    /// Adds the moments of channel `c` of a part whose centroid is `shift` from this one's.
    fn add_shifted(&mut self, part: &Self, c: usize, shift: [f64; 3]) {
        const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]];
        let (energy, first) = (part.energy[c], part.first[c]);
        for i in 0..3 {
            self.first[c][i] += first[i] + energy * shift[i];
        }
        for (k, [i, j]) in PAIRS.into_iter().enumerate() {
            let cross = first[i] * shift[j] + shift[i] * first[j];
            self.second[c][k] += part.second[c][k] + cross + energy * shift[i] * shift[j];
        }
    }

    fn node(&self) -> Node {
        let [x, y, z] = self.direction.map(|d| d as f32);
        let twice = |[xx, yy, zz, xy, yz, xz]: [f64; 6]| {
            [xx, yy, zz, 2.0 * xy, 2.0 * yz, 2.0 * xz].map(|m| m as f32)
        };
        Node {
            direction: Vec3::new(x, y, z),
            shape: Shape::new(self.radius, self.spread, self.solid_angle),
            energy: self.energy.map(|e| e as f32),
            first: self.first.map(|first| first.map(|m| m as f32)),
            second: self.second.map(twice),
        }
    }
}

fn norm(v: [f64; 3]) -> f64 {
    v.map(|c| c * c).iter().sum::<f64>().sqrt()
}
