//! Divides a picture into tiles, and tiles into shards.

use std::fmt;
use std::ops::Range;

use super::{Passes, RenderSettings};
use crate::strategy::Strategy;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The first column.
    pub x: usize,
    /// The first row.
    pub y: usize,
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
}

impl Window {
    /// The number of pixels.
    pub fn area(&self) -> usize {
        self.width * self.height
    }

    /// The non-empty quarters.
    pub(super) fn quarters(self) -> impl Iterator<Item = Self> {
        let halves = |start: usize, n: usize| [(start, n / 2), (start + n / 2, n - n / 2)];
        let rows = halves(self.y, self.height);
        let windows = rows.into_iter().flat_map(move |(y, height)| {
            let columns = halves(self.x, self.width).into_iter();
            columns.map(move |(x, width)| Self { x, y, width, height })
        });
        windows.filter(|window| window.area() > 0)
    }

    /// Whether the window contains a pixel of the picture.
    pub(super) fn contains(&self, x: usize, y: usize) -> bool {
        (self.x..self.x + self.width).contains(&x) && (self.y..self.y + self.height).contains(&y)
    }

    /// The index, row by row, of a pixel of the picture in the window.
    pub(super) fn index(&self, x: usize, y: usize) -> usize {
        (y - self.y) * self.width + x - self.x
    }
}

/// Formats as `640x16+0+32`: columns, rows, and the corner.
impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}+{}+{}", self.width, self.height, self.x, self.y)
    }
}

/// One of two independent sets of a pixel's samples. Most pixels have only the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum SampleSet {
    #[default]
    First,
    Second,
}

/// The tiles of a picture, in row order. Tiles at the right and lower border may be smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiling {
    width: usize,
    height: usize,
    size: usize,
}

/// The number of shadow rays of a tile and pass that fit in the caches.
const RAYS_PER_TILE: usize = 1 << 15;

impl Tiling {
    /// The tiles of a render with a strategy that requests up to `n_rays` shadow rays per point. Tiles are
    /// smaller than set if one sample per pixel requests too many rays.
    ///
    /// # Panics
    /// If width, height or tile size are zero.
    pub fn new(settings: &RenderSettings, n_rays: u32) -> Self {
        let &RenderSettings { width, height, tile_size, .. } = settings;
        assert!(width > 0 && height > 0 && tile_size > 0, "an empty picture or tile");
        let most = (RAYS_PER_TILE / n_rays.max(1) as usize).isqrt().max(1);
        Self { width, height, size: tile_size.min(most) }
    }

    /// The number of tiles.
    pub fn n_tiles(&self) -> usize {
        self.across() * self.height.div_ceil(self.size)
    }

    /// The tiles of shard `k` of `n`. Shards are consecutive ranges whose lengths differ by at most one tile.
    ///
    /// # Panics
    /// Unless k < n.
    pub fn shard(&self, k: usize, n: usize) -> Range<usize> {
        assert!(k < n, "shard {k} of {n}");
        let start = |k: usize| (k as u128 * self.n_tiles() as u128 / n as u128) as usize;
        start(k)..start(k + 1)
    }

    /// The pixels of a tile.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn tile(&self, index: usize) -> Window {
        assert!(index < self.n_tiles(), "tile {index} of {}", self.n_tiles());
        let (x, y) = (index % self.across() * self.size, index / self.across() * self.size);
        let width = self.size.min(self.width - x);
        Window { x, y, width, height: self.size.min(self.height - y) }
    }

    /// The smallest rectangle around a range of tiles. For an empty range, the first pixel, because a file needs one.
    ///
    /// # Panics
    /// If there are no such tiles.
    pub fn window(&self, tiles: &Range<usize>) -> Window {
        if tiles.is_empty() {
            return Window { x: 0, y: 0, width: 1, height: 1 };
        }
        let (first, last) = (self.tile(tiles.start), self.tile(tiles.end - 1));
        let height = last.y + last.height - first.y;
        if first.y == last.y {
            Window { width: last.x + last.width - first.x, height, ..first }
        } else {
            Window { x: 0, y: first.y, width: self.width, height }
        }
    }

    /// The camera samples of the pass that begins at sample `start`: the number requested by the strategy, or as many
    /// as before, limited so that a tile's rays fit in the caches, and at most `left`.
    pub(super) fn pass(
        &self,
        strategy: &impl Strategy,
        passes: Passes,
        start: u32,
        left: u32,
    ) -> Range<u32> {
        let count = match (strategy.samples_per_pass(), passes) {
            (Some(count), Passes::Efficient) => count,
            (Some(count), Passes::Doubling) => start.clamp(1, count),
            (None, _) => {
                let rays = self.size * self.size * strategy.n_rays().max(1) as usize;
                start.clamp(1, (RAYS_PER_TILE / rays).clamp(1, 64) as u32)
            }
        };
        start..start + count.clamp(1, left.max(1))
    }

    fn across(&self) -> usize {
        self.width.div_ceil(self.size)
    }
}

/// The pass that begins at sample `start` of a render with a target error, and its set. Passes come in pairs of equal
/// length, one per set; later ones have a quarter of the samples up to the last power of two, so that a tile ends near
/// its target.
pub(super) fn paired_pass(start: u32, n_samples: u32) -> (Range<u32>, SampleSet) {
    /// The minimum length of a pass.
    const SHORTEST: u32 = 4;
    const FIRST: u32 = 8;
    const LONGEST: u32 = 64;
    let mut pair = 0;
    loop {
        let length = match u32::checked_ilog2(pair) {
            None => FIRST,
            Some(log) => ((1 << log) / 4).clamp(SHORTEST, LONGEST),
        };
        let length = length.min(n_samples.saturating_sub(pair).div_ceil(2)).max(1);
        let middle = pair.saturating_add(length);
        if start < middle {
            return (start..middle, SampleSet::First);
        }
        let end = middle.saturating_add(length).min(n_samples.max(start + 1));
        if start < end {
            return (start..end, SampleSet::Second);
        }
        pair = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::environment::Environment;
    use crate::strategy::{BrdfSampling, ProductSampling};

    fn tiling(width: usize, height: usize, tile_size: usize) -> Tiling {
        Tiling::new(&RenderSettings { width, height, tile_size, ..Default::default() }, 1)
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        let tiling = tiling(37, 21, 16);
        let mut covered = [0; 37 * 21];
        for tile in (0..tiling.n_tiles()).map(|t| tiling.tile(t)) {
            for y in tile.y..tile.y + tile.height {
                covered[y * 37 + tile.x..][..tile.width].iter_mut().for_each(|c| *c += 1);
            }
        }
        assert!(covered.iter().all(|&c| c == 1));
    }

    #[test]
    fn shards_cover_every_tile_once_and_windows_hold_their_tiles() {
        let tiling = tiling(100, 70, 16);
        for n in [1, 2, 3, 8, 35, 64] {
            let mut next = 0;
            for k in 0..n {
                let shard = tiling.shard(k, n);
                assert_eq!(shard.start, next);
                next = shard.end;
                let window = tiling.window(&shard);
                for tile in shard.map(|t| tiling.tile(t)) {
                    assert!(tile.x >= window.x && tile.y >= window.y);
                    assert!(tile.x + tile.width <= window.x + window.width);
                    assert!(tile.y + tile.height <= window.y + window.height);
                }
            }
            assert_eq!(next, tiling.n_tiles());
        }
    }

    #[test]
    fn passes_cover_every_sample_once() {
        let environment = Environment::constant(Rgb::WHITE).expect("a light");
        let environment = &environment;
        let tiling = tiling(64, 64, 16);
        for n_samples in [1, 2, 3, 7, 64, 1000] {
            for n in [1, 2, 15, 1000] {
                cover(&tiling, &BrdfSampling { environment, n_samples: n }, n_samples);
                cover(&tiling, &ProductSampling::new(environment, n), n_samples);
            }
        }
    }

    #[test]
    fn doubling_passes_begin_with_one_sample() {
        let environment = Environment::constant(Rgb::WHITE).expect("a light");
        let product = ProductSampling::new(&environment, 8);
        let end = |start| tiling(64, 64, 16).pass(&product, Passes::Doubling, start, 99).end;
        assert_eq!([0, 1, 2, 4, 8].map(end), [1, 2, 4, 8, 16]);
    }

    #[test]
    fn sets_have_equal_passes() {
        for n_samples in [1, 2, 3, 16, 20, 64, 1000] {
            let (mut next, mut sums) = (0, [0; 2]);
            while next < n_samples {
                let (pass, set) = paired_pass(next, n_samples);
                assert_eq!(pass.start, next);
                assert!(pass.end > next && pass.end <= n_samples, "{pass:?} of {n_samples}");
                sums[usize::from(set == SampleSet::Second)] += pass.len() as u32;
                next = pass.end;
                if set == SampleSet::Second && next < n_samples {
                    assert_eq!(sums[0], sums[1], "{next} of {n_samples}");
                }
            }
            assert!(sums[0] - sums[1] <= 1, "{sums:?}");
        }
        assert_eq!([0, 8, 16, 20, 24].map(|s| paired_pass(s, 99).0.end), [8, 16, 20, 24, 28]);
    }

    fn cover(tiling: &Tiling, strategy: &impl Strategy, n_samples: u32) {
        for passes in [Passes::Efficient, Passes::Doubling] {
            let mut next = 0;
            while next < n_samples {
                let pass = tiling.pass(strategy, passes, next, n_samples - next);
                assert_eq!(pass.start, next);
                assert!(pass.end > pass.start);
                next = pass.end;
            }
            assert_eq!(next, n_samples);
        }
    }
}
