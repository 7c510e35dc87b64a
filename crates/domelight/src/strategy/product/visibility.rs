//! The visibility learned from a tile's shadow rays: the visibility of each light cell from each block of
//! pixels, and the brightness of the pixels.
//!
//! With n rays to a cell, k of them unoccluded, where rays in the block count 1, rays in its four
//! neighbors 0.35, and rays to the two neighboring cells along the curve 0.25,
//!
//! ```text
//! V̂ = (k + p)/(n + 1)        p = (K + q)/(N + 1)        q = (K' + v₀)/(N' + 1)
//! g² = V̂(1 − V̂) + (p(1 − p)/2 + 0.005 s)/(n + 1) + 0.0003 s        s = max(p, q, v₀)/0.1 within [0.003, 1]
//! ```
//!
//! p is the visibility of the cell over the whole tile, with K of N rays unoccluded, those of scouts (`briefing`)
//! among them; q that of the other cells in its group along the curve, and v₀ that of the cell from all scouts of the
//! picture. g is the standard deviation of a ray around V̂ combined with the uncertainty of V̂ itself, which is large if
//! the tile's rays to the cell differ, and small where nobody has ever seen the light: behind the walls of a room.
//! Without scouts, v₀ and q are the visibility of all cells, and s is 1.
//!
//! V̂ is a control variate: the pixel's estimate is the light seen through V̂ that it reflects, plus Σ W (V − V̂)/π.
//! Its expectation does not depend on V̂, provided that V̂ does not depend on the random numbers of strata and
//! selection. For that reason, V̂ comes only from pixels of lower levels.

use super::cells::{CellArray, Cells, MAX_ROWS, ZERO_CELLS, get_mut};
use super::portal_light::PORTAL_ROW;
use super::prior::{Prior, for_each_prior};
use crate::simd::{LANES, Simd, SimdF32x8, SimdFloat};

/// The number of pixels along the side of a block.
pub(super) const BLOCK: usize = 4;
/// The weight of a ray from a neighboring block.
const NEIGHBOR: f32 = 0.35;
/// The weight of a ray to a neighboring cell.
const BESIDE: f32 = 0.25;

/// The statistics of a tile.
#[derive(Clone, Debug, Default)]
pub(super) struct VisibilityStats {
    /// The number of rays traced from each block to each cell.
    pub(super) rays: Vec<CellArray>,
    /// The number of unoccluded rays.
    pub(super) free: Vec<CellArray>,
    /// The luminance of each known pixel.
    luminance: Vec<Option<f32>>,
}

/// A tile divided into blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    pub(super) width: usize,
    pub(super) height: usize,
}

impl Blocks {
    /// The blocks of a tile of this size \[pixels\].
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

    /// The blocks that share an edge with a block; the block itself stands in for missing ones.
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

impl VisibilityStats {
    /// Clears the statistics.
    pub(super) fn reset(&mut self, blocks: Blocks, n_pixels: usize) {
        for counts in [&mut self.rays, &mut self.free] {
            counts.clear();
            counts.resize(blocks.len(), ZERO_CELLS);
        }
        self.luminance.clear();
        self.luminance.resize(n_pixels, None);
    }

    /// Counts a ray from a block to the cell in a slot, and its visibility in [0, 1].
    #[inline(always)]
    pub(super) fn count(&mut self, block: usize, slot: usize, visibility: f32) {
        *get_mut(&mut self.rays[block], slot) += 1.0;
        *get_mut(&mut self.free[block], slot) += visibility;
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
pub(super) struct VisibilityEstimate {
    visible: Vec<CellArray>,
    /// g.
    std_dev: Vec<CellArray>,
}

impl VisibilityEstimate {
    /// Computes the estimates, from the tile's rays, those of scouts near it, and the visibility from all scouts.
    #[inline(always)]
    pub(super) fn estimate<S: Simd>(
        &mut self,
        simd: S,
        cells: &Cells,
        visibility_stats: &VisibilityStats,
        (of_scouts, everywhere): (&[CellArray; 2], Option<&CellArray>),
        blocks: Blocks,
        has_portals: bool,
    ) {
        let portals = has_portals.then_some(PORTAL_ROW);
        let one = simd.splat(1.0);
        let VisibilityStats { rays, free, .. } = visibility_stats;
        let n_rows = cells.rows().end;
        let (mut n, mut k) = (simd.splat(0.0), simd.splat(0.0));
        let mut tile = [[[0.0; LANES]; 2]; MAX_ROWS];
        for (row, [n_cells, k_cells]) in cells.rows().zip(&mut tile) {
            let n_row = sum(simd, rays, row) + simd.load(&of_scouts[0][row]);
            let k_row = sum(simd, free, row) + simd.load(&of_scouts[1][row]);
            (n, k) = (n + n_row, k + k_row);
            (*n_cells, *k_cells) = (n_row.store(), k_row.store());
        }
        let all = simd.splat((k.sum() + 1.0) / (n.sum() + 2.0));
        let mut priors = [Prior::PORTAL; MAX_ROWS];
        let mut of_row = |row, prior| priors[row] = prior;
        match everywhere {
            Some(visible) => {
                let everywhere = |row: usize| simd.load(&visible[row]);
                for_each_prior(simd, &tile[..n_rows], everywhere, &mut of_row);
            }
            None => {
                // Nobody but the tile's own rays knows more than the mean of all cells.
                for (row, [n, k]) in tile[..n_rows].iter().enumerate() {
                    let p = (simd.load(k) + all) / (simd.load(n) + one);
                    of_row(row, Prior { visible: p.store(), ..Prior::PORTAL });
                }
            }
        }
        let mut of_portals = Prior::PORTAL;
        if let Some(row) = portals {
            let [n, k] = [sum(simd, rays, row), sum(simd, free, row)];
            of_portals.visible = ((k + one) / (n + one)).store();
        }
        self.visible.resize(blocks.len(), ZERO_CELLS);
        self.std_dev.resize(blocks.len(), ZERO_CELLS);
        for block in 0..blocks.len() {
            let neighbors = blocks.neighbors(block);
            let (visible, std_dev) = (&mut self.visible[block], &mut self.std_dev[block]);
            for row in cells.rows().chain(portals) {
                let n = around(simd, rays, block, &neighbors, row, n_rows);
                let k = around(simd, free, block, &neighbors, row, n_rows);
                let prior = priors.get(row).unwrap_or(&of_portals);
                let v = ((k + simd.load(&prior.visible)) / (n + one)).min(one);
                visible[row] = v.store();
                std_dev[row] = prior.variance(simd, n, v).sqrt().store();
            }
        }
    }

    /// V̂ of the cells from a block, and their standard deviations, by slot.
    pub(super) fn of(&self, block: usize) -> (&CellArray, &CellArray) {
        (&self.visible[block], &self.std_dev[block])
    }
}

/// The sum of a row's counts over blocks.
#[inline(always)]
fn sum<S: Simd>(simd: S, counts: &[CellArray], row: usize) -> S::F32x8 {
    let mut sum = simd.splat(0.0);
    for count in counts {
        sum = sum + simd.load(&count[row]);
    }
    sum
}

/// A row's counts in a block and, with lower weight, around it. Rows follow each other along the curve.
#[inline(always)]
fn around<S: Simd>(
    simd: S,
    counts: &[CellArray],
    block: usize,
    neighbors: &[usize; 4],
    row: usize,
    n_rows: usize,
) -> S::F32x8 {
    let mut sum = simd.load(&counts[block][row]);
    let beside = simd.splat(BESIDE);
    if row > 0 {
        sum = sum + beside * simd.load(&counts[block][row - 1]);
    }
    if row + 1 < n_rows {
        sum = sum + beside * simd.load(&counts[block][row + 1]);
    }
    for &neighbor in neighbors {
        // A block without a neighbor on a side refers to itself there; do not count it again.
        let share = simd.splat(if neighbor == block { 0.0 } else { NEIGHBOR });
        sum = sum + share * simd.load(&counts[neighbor][row]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::cells::get;
    use super::super::test_support::sky;
    use super::*;
    use crate::sampling::Pcg32;
    use crate::simd::{InstructionSet, Kernel, dispatch};

    struct Estimate<'a>(&'a Cells, &'a VisibilityStats, Blocks);

    impl Kernel for Estimate<'_> {
        type Output = VisibilityEstimate;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> VisibilityEstimate {
            let mut visibility = VisibilityEstimate::default();
            let no_scouts = (&[ZERO_CELLS; 2], None);
            visibility.estimate(simd, self.0, self.1, no_scouts, self.2, false);
            visibility
        }
    }

    #[test]
    fn estimates_are_probabilities_and_follow_the_counts() {
        const ROWS: usize = 32;
        let [cells] = Cells::new(&sky(), [ROWS]).unwrap();
        let estimate = |visibility_stats: &VisibilityStats, blocks| {
            dispatch(InstructionSet::best(), Estimate(&cells, visibility_stats, blocks))
        };
        let blocks = Blocks::new(13, 6);
        assert_eq!((blocks.width, blocks.height, blocks.of(12, 5)), (4, 2, 7));
        let mut visibility_stats = VisibilityStats::default();
        visibility_stats.reset(blocks, 13 * 6);
        let visibility = estimate(&visibility_stats, blocks);
        assert!(visibility.visible.iter().all(|v| v[..ROWS] == [[0.5; LANES]; ROWS]));

        let mut pcg = Pcg32::new(1, 1);
        for _ in 0..200_000 {
            let (block, cell) = (pcg.next_u32() as usize % 8, pcg.next_u32() as usize % 100);
            // Cell c is unoccluded with probability c/100.
            let is_free = pcg.next_f32() * 100.0 < cell as f32;
            visibility_stats.count(block, cell, if is_free { 1.0 } else { 0.0 });
        }
        let visibility = estimate(&visibility_stats, blocks);
        for block in 0..blocks.len() {
            let (visible, std_dev) = visibility.of(block);
            assert!(visible[..ROWS].iter().flatten().all(|v| (0.0..=1.0).contains(v)));
            assert!(std_dev[..ROWS].iter().flatten().all(|d| (0.017..0.62).contains(d)));
            for cell in 0..100 {
                assert!((get(visible, cell) - cell as f32 / 100.0).abs() < 0.15);
            }
        }
    }
}
