//! What shadow rays have taught about a tile: how visible each light cell is from each block of
//! pixels, and how bright the pixels are.
//!
//! With n rays to a cell, k of them free, counted in a block, 0.35 times in its four neighbours, and
//! 0.25 times to the two cells beside it along the curve,
//!
//! ```text
//! V̂ = (k + p)/(n + 1)        p = (K + v₀)/(N + 1)
//! g² = V̂(1 − V̂) + (p(1 − p)/2 + 0.005)/(n + 1) + 0.0003
//! ```
//!
//! p is the same of the whole tile, K of N rays to the cell, and v₀ that of all cells. g is the standard
//! deviation of a ray about V̂, and what V̂ itself may be wrong by: much, where rays of the tile to the cell differ.
//!
//! V̂ serves as a control variate: the pixel's estimate is what it reflects of light seen through V̂, and
//! Σ W (V − V̂)/π, whose expectation does not depend on V̂ as long as V̂ does not depend on the numbers that strata
//! and choice are drawn with. So V̂ comes from pixels of lower levels alone.

use super::cells::{Cells, MAX_ROWS, NO_SLOTS, Slots, at_mut};
use crate::simd::{Floats, LANES, Real, Simd};

/// Pixels along the side of a block.
pub(super) const BLOCK: usize = 4;
/// What a ray of a neighbouring block counts.
const NEIGHBOR: f32 = 0.35;
/// What a ray to a neighbouring cell counts.
const BESIDE: f32 = 0.25;

/// What is known of a tile.
#[derive(Clone, Debug, Default)]
pub(super) struct Learned {
    /// Rays traced from each block to each cell.
    rays: Vec<Slots>,
    /// Those that were free.
    free: Vec<Slots>,
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

    /// The blocks that share an edge; itself where there is none.
    fn neighbors(self, block: usize) -> [usize; 4] {
        let (x, y) = (block % self.width, block / self.width);
        [
            if x > 0 { block - 1 } else { block },
            if x + 1 < self.width { block + 1 } else { block },
            if y > 0 { block - self.width } else { block },
            if y + 1 < self.height { block + self.width } else { block },
        ]
    }
}

impl Learned {
    /// Forgets all.
    pub(super) fn reset(&mut self, blocks: Blocks, n_pixels: usize) {
        for counts in [&mut self.rays, &mut self.free] {
            counts.clear();
            counts.resize(blocks.len(), NO_SLOTS);
        }
        self.luminance.clear();
        self.luminance.resize(n_pixels, None);
    }

    /// Counts a ray from a block to the cell in a slot, and its visibility in [0, 1].
    #[inline(always)]
    pub(super) fn count(&mut self, block: usize, slot: usize, visibility: f32) {
        *at_mut(&mut self.rays[block], slot) += 1.0;
        *at_mut(&mut self.free[block], slot) += visibility;
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
    visible: Vec<Slots>,
    /// g.
    doubt: Vec<Slots>,
}

impl Visibility {
    /// Estimates all.
    #[inline(always)]
    pub(super) fn estimate<S: Simd>(
        &mut self,
        simd: S,
        cells: &Cells,
        learned: &Learned,
        blocks: Blocks,
    ) {
        let one = simd.splat(1.0);
        let Learned { rays, free, .. } = learned;
        let n_rows = cells.rows().end;
        let (mut n, mut k) = (simd.splat(0.0), simd.splat(0.0));
        let mut tile = [[[0.0; LANES]; 2]; MAX_ROWS];
        for (row, [n_cells, k_cells]) in cells.rows().zip(&mut tile) {
            let [n_row, k_row] = [sum(simd, rays, row), sum(simd, free, row)];
            (n, k) = (n + n_row, k + k_row);
            (*n_cells, *k_cells) = (n_row.store(), k_row.store());
        }
        let all = simd.splat((k.sum() + 1.0) / (n.sum() + 2.0));
        let mut prior = [[0.0; LANES]; MAX_ROWS];
        for row in cells.rows() {
            let [n, k] = &tile[row];
            prior[row] = ((simd.load(k) + all) / (simd.load(n) + one)).store();
        }
        self.visible.resize(blocks.len(), NO_SLOTS);
        self.doubt.resize(blocks.len(), NO_SLOTS);
        for block in 0..blocks.len() {
            let neighbors = blocks.neighbors(block);
            let (visible, doubt) = (&mut self.visible[block], &mut self.doubt[block]);
            for row in cells.rows() {
                let n = around(simd, rays, block, &neighbors, row, n_rows);
                let k = around(simd, free, block, &neighbors, row, n_rows);
                let p = simd.load(&prior[row]);
                let v = ((k + p) / (n + one)).min(one);
                visible[row] = v.store();
                let differ = simd.splat(0.5) * p * (one - p) + simd.splat(0.005);
                let unsure = simd.splat(0.0003) + differ / (n + one);
                doubt[row] = (v * (one - v) + unsure).sqrt().store();
            }
        }
    }

    /// V̂ of the cells from a block, and their doubts, by slot.
    pub(super) fn of(&self, block: usize) -> (&Slots, &Slots) {
        (&self.visible[block], &self.doubt[block])
    }
}

/// The sum of a row's counts over blocks.
#[inline(always)]
fn sum<S: Simd>(simd: S, counts: &[Slots], row: usize) -> S::Floats {
    let mut sum = simd.splat(0.0);
    for count in counts {
        sum = sum + simd.load(&count[row]);
    }
    sum
}

/// A row's counts in a block and, less, about it. Rows follow each other along the curve.
#[inline(always)]
fn around<S: Simd>(
    simd: S,
    counts: &[Slots],
    block: usize,
    neighbors: &[usize; 4],
    row: usize,
    n_rows: usize,
) -> S::Floats {
    let mut sum = simd.load(&counts[block][row]);
    let beside = simd.splat(BESIDE);
    if row > 0 {
        sum = sum + beside * simd.load(&counts[block][row - 1]);
    }
    if row + 1 < n_rows {
        sum = sum + beside * simd.load(&counts[block][row + 1]);
    }
    for &neighbor in neighbors {
        // A block without a neighbour on a side is its own there, and counts nothing.
        let share = simd.splat(if neighbor == block { 0.0 } else { NEIGHBOR });
        sum = sum + share * simd.load(&counts[neighbor][row]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::cells::at;
    use super::super::test_support::sky;
    use super::*;
    use crate::sampling::Pcg32;
    use crate::simd::{InstructionSet, Kernel, dispatch};

    struct Estimate<'a>(&'a Cells, &'a Learned, Blocks);

    impl Kernel for Estimate<'_> {
        type Output = Visibility;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Visibility {
            let mut visibility = Visibility::default();
            visibility.estimate(simd, self.0, self.1, self.2);
            visibility
        }
    }

    #[test]
    fn estimates_are_probabilities_and_follow_the_counts() {
        const ROWS: usize = 32;
        let [cells] = Cells::new(&sky(), [ROWS]).unwrap();
        let estimate = |learned: &Learned, blocks| {
            dispatch(InstructionSet::best(), Estimate(&cells, learned, blocks))
        };
        let blocks = Blocks::new(13, 6);
        assert_eq!((blocks.width, blocks.height, blocks.of(12, 5)), (4, 2, 7));
        let mut learned = Learned::default();
        learned.reset(blocks, 13 * 6);
        let visibility = estimate(&learned, blocks);
        assert!(visibility.visible.iter().all(|v| v[..ROWS] == [[0.5; LANES]; ROWS]));

        let mut pcg = Pcg32::new(1, 1);
        for _ in 0..200_000 {
            let (block, cell) = (pcg.next_u32() as usize % 8, pcg.next_u32() as usize % 100);
            // Cell c is free c times of 100.
            let is_free = pcg.next_f32() * 100.0 < cell as f32;
            learned.count(block, cell, if is_free { 1.0 } else { 0.0 });
        }
        let visibility = estimate(&learned, blocks);
        for block in 0..blocks.len() {
            let (visible, doubt) = visibility.of(block);
            assert!(visible[..ROWS].iter().flatten().all(|v| (0.0..=1.0).contains(v)));
            assert!(doubt[..ROWS].iter().flatten().all(|d| (0.017..0.62).contains(d)));
            for cell in 0..100 {
                assert!((at(visible, cell) - cell as f32 / 100.0).abs() < 0.15);
            }
        }
    }
}
