//! What shadow rays have taught about a tile: how visible each light cell is from each block of
//! pixels, and how bright the pixels are.
//!
//! With n rays to a cell, k of them free, counted in a block and 0.35 times in its four neighbours,
//!
//! ```text
//! V̂ = (k + p)/(n + 1)        p = (K + v₀)/(N + 1)
//! ```
//!
//! p is the same of the whole tile, K of N rays to the cell, and v₀ that of all cells.
//!
//! V̂ serves as a control variate: the pixel's estimate is Σ W V̂ + Σ W (V − V̂)/π, whose expectation
//! does not depend on V̂ as long as V̂ does not depend on the numbers that the second sum is drawn
//! with. So V̂ comes from other pixels alone: the pilots.

use super::cells::MAX_CELLS;

/// Pixels along the side of a block.
pub(super) const BLOCK: usize = 4;
/// What a ray of a neighbouring block counts.
const NEIGHBOR: f32 = 0.35;

/// What is known of a tile.
#[derive(Clone, Debug, Default)]
pub(super) struct Learned {
    /// Rays traced from each block to each cell.
    rays: Vec<f32>,
    /// Those that were free.
    free: Vec<f32>,
    /// The luminance of each pixel that is known.
    luminance: Vec<Option<f32>>,
}

/// A tile cut into blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Blocks {
    /// Of a tile of pixels.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width: width.div_ceil(BLOCK), height: height.div_ceil(BLOCK) }
    }

    pub(super) fn len(self) -> usize {
        self.width * self.height
    }

    /// The block of the pixel at (`x`, `y`) of the tile.
    pub(super) fn of(self, x: usize, y: usize) -> usize {
        y / BLOCK * self.width + x / BLOCK
    }

    /// The blocks that share an edge.
    fn neighbors(self, block: usize) -> impl Iterator<Item = usize> {
        let (x, y) = (block % self.width, block / self.width);
        let left = (x > 0).then(|| block - 1);
        let right = (x + 1 < self.width).then(|| block + 1);
        let above = (y > 0).then(|| block - self.width);
        let below = (y + 1 < self.height).then(|| block + self.width);
        [left, right, above, below].into_iter().flatten()
    }
}

impl Learned {
    /// Forgets all.
    pub(super) fn reset(&mut self, blocks: Blocks, n_pixels: usize) {
        for counts in [&mut self.rays, &mut self.free] {
            counts.clear();
            counts.resize(blocks.len() * MAX_CELLS, 0.0);
        }
        self.luminance.clear();
        self.luminance.resize(n_pixels, None);
    }

    /// Counts a ray from a block to a cell.
    #[inline(always)]
    pub(super) fn count(&mut self, block: usize, cell: usize, free: bool) {
        let i = block * MAX_CELLS + cell;
        self.rays[i] += 1.0;
        self.free[i] += if free { 1.0 } else { 0.0 };
    }

    /// Sets the mean luminance of a pixel.
    pub(super) fn set_luminance(&mut self, pixel: usize, luminance: f32) {
        self.luminance[pixel] = Some(luminance);
    }

    /// The mean luminance of a pixel, if it is known.
    pub(super) fn luminance(&self, pixel: usize) -> Option<f32> {
        self.luminance.get(pixel).copied().flatten()
    }
}

/// V̂ of each block and cell.
#[derive(Clone, Debug, Default)]
pub(super) struct Visibility {
    visible: Vec<f32>,
    /// √(V̂(1 − V̂) + 0.02): the standard deviation of a ray about V̂, and what V̂ itself may be wrong
    /// by.
    doubt: Vec<f32>,
}

impl Visibility {
    /// Estimates all.
    #[inline(always)]
    pub(super) fn estimate(&mut self, learned: &Learned, blocks: Blocks) {
        let [mut n_tile, mut k_tile] = [[0.0; MAX_CELLS]; 2];
        let counts = learned.rays.chunks(MAX_CELLS).zip(learned.free.chunks(MAX_CELLS));
        for (rays, free) in counts {
            for c in 0..MAX_CELLS {
                n_tile[c] += rays[c];
                k_tile[c] += free[c];
            }
        }
        let all = (k_tile.iter().sum::<f32>() + 1.0) / (n_tile.iter().sum::<f32>() + 2.0);
        let mut prior = [0.0; MAX_CELLS];
        for c in 0..MAX_CELLS {
            prior[c] = (k_tile[c] + all) / (n_tile[c] + 1.0);
        }
        self.visible.resize(blocks.len() * MAX_CELLS, 0.0);
        self.doubt.resize(blocks.len() * MAX_CELLS, 0.0);
        for block in 0..blocks.len() {
            let [mut n, mut k] = [[0.0; MAX_CELLS]; 2];
            let mut add = |block: usize, weight: f32| {
                let cells = block * MAX_CELLS..(block + 1) * MAX_CELLS;
                let (rays, free) = (&learned.rays[cells.clone()], &learned.free[cells]);
                for c in 0..MAX_CELLS {
                    n[c] += weight * rays[c];
                    k[c] += weight * free[c];
                }
            };
            add(block, 1.0);
            blocks.neighbors(block).for_each(|neighbor| add(neighbor, NEIGHBOR));
            let cells = block * MAX_CELLS..(block + 1) * MAX_CELLS;
            let (visible, doubt) = (&mut self.visible[cells.clone()], &mut self.doubt[cells]);
            for c in 0..MAX_CELLS {
                let v = ((k[c] + prior[c]) / (n[c] + 1.0)).min(1.0);
                visible[c] = v;
                doubt[c] = (v * (1.0 - v) + 0.02).sqrt();
            }
        }
    }

    /// V̂ of the cells from a block, and their doubts.
    pub(super) fn of(&self, block: usize) -> (&[f32], &[f32]) {
        let cells = block * MAX_CELLS..(block + 1) * MAX_CELLS;
        (&self.visible[cells.clone()], &self.doubt[cells])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Pcg32;

    #[test]
    fn estimates_are_probabilities_and_follow_the_counts() {
        let blocks = Blocks::new(13, 6);
        assert_eq!((blocks.width, blocks.height, blocks.of(12, 5)), (4, 2, 7));
        let mut learned = Learned::default();
        learned.reset(blocks, 13 * 6);
        let mut visibility = Visibility::default();
        visibility.estimate(&learned, blocks);
        assert!(visibility.visible.iter().all(|&v| v == 0.5));

        let mut pcg = Pcg32::new(1, 1);
        for _ in 0..200_000 {
            let (block, cell) = (pcg.next_u32() as usize % 8, pcg.next_u32() as usize % 100);
            // Cell c is free c times of 100.
            learned.count(block, cell, pcg.next_f32() * 100.0 < cell as f32);
        }
        visibility.estimate(&learned, blocks);
        for block in 0..blocks.len() {
            let (visible, doubt) = visibility.of(block);
            assert!(visible.iter().all(|v| (0.0..=1.0).contains(v)));
            assert!(doubt.iter().all(|d| (0.14..0.73).contains(d)));
            for cell in 0..100 {
                assert!((visible[cell] - cell as f32 / 100.0).abs() < 0.15);
            }
        }
    }
}
