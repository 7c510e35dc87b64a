//! What scouts tell a tile about the visibility of cells, before it has traced a ray.
//!
//! Scouts are windows of pixels, spread over the picture, that are rendered before the pass, with a pool and random
//! numbers of their own. The counts of the nearest windows, with weights that fall with the distance d of their surfaces,
//!
//! ```text
//! w = 1/(1 + d²/(0.3 r)²)³        r: the root mean square distance of all windows from their center
//! ```
//!
//! are added to those of the tile, up to 16 rays to each cell. What scouts say about a cell does not depend on the pass's
//! pool. So it may enter the weights that divide the light between strata, BRDF samples and portals, unlike what the tile
//! learns itself.

use super::cells::{CellArray, Cells, TABLE_ROWS, ZERO_CELLS};
use super::prior::for_each_prior;
use super::table::{BLIND, LEFT_OF_GLOSSY};
use super::visibility::VisibilityStats;
use crate::math::Vec3;
use crate::simd::{InstructionSet, Kernel, LANES, Simd, SimdF32x8, SimdFloat, dispatch};

/// The number of windows that a tile asks.
const WINDOWS: usize = 8;
/// The distance at which a window counts an eighth, over the extent of all windows.
const RADIUS: f32 = 0.3;
/// The number of rays to a cell beyond which scouts say no more.
const MOST_RAYS: f32 = 16.0;

/// What a window of scouts has found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The mean position of its surfaces; `None` if it has seen none.
    position: Option<Vec3>,
    counts: Box<[CellArray; 2]>,
}

impl Findings {
    /// The rays of a window, with the sum of its positions and their number.
    pub(super) fn new(stats: &VisibilityStats, (sum, n): (Vec3, usize)) -> Self {
        let mut counts = Box::new([ZERO_CELLS; 2]);
        for (sums, blocks) in counts.iter_mut().zip([&stats.rays, &stats.free]) {
            for block in blocks {
                add(sums, block);
            }
        }
        Self { position: (n > 0).then(|| sum / n as f32), counts }
    }
}

/// What all scouts have found.
#[derive(Clone, Debug)]
pub(super) struct Scouted {
    positions: Vec<Vec3>,
    /// The numbers of rays to each cell, and of the unoccluded ones.
    counts: Vec<Box<[CellArray; 2]>>,
    /// (0.3 r)².
    squared_radius: f32,
    /// The visibility of each cell from all windows together.
    everywhere: CellArray,
}

impl Default for Scouted {
    fn default() -> Self {
        Self::new(Vec::new())
    }
}

impl Scouted {
    pub(super) fn new(findings: Vec<Findings>) -> Self {
        let seeing = findings.into_iter().filter_map(|f| Some((f.position?, f.counts)));
        let (positions, counts): (Vec<_>, Vec<_>) = seeing.unzip();
        let n = positions.len().max(1) as f32;
        let center = positions.iter().sum::<Vec3>() / n;
        let squares = positions.iter().map(|p| (p - center).length_squared());
        let squared_radius = RADIUS * RADIUS * squares.sum::<f32>() / n;
        let squared_radius = squared_radius.max(f32::MIN_POSITIVE);
        let everywhere = everywhere(&counts);
        Self { positions, counts, squared_radius, everywhere }
    }

    /// The nearest windows, each with its squared distance.
    fn nearest(&self, position: Vec3) -> impl Iterator<Item = (f32, &[CellArray; 2])> {
        let mut nearest = [(f32::INFINITY, 0); WINDOWS];
        for (i, window) in self.positions.iter().enumerate() {
            let distance = (window - position).length_squared();
            if distance < nearest[WINDOWS - 1].0 {
                // Insert it; of equal ones, the first comes first.
                let at = nearest.partition_point(|n| n.0 <= distance);
                nearest.copy_within(at..WINDOWS - 1, at + 1);
                nearest[at] = (distance, i);
            }
        }
        let found = nearest.into_iter().take_while(|n| n.0 < f32::INFINITY);
        found.map(|(distance, i)| (distance, &*self.counts[i]))
    }
}

/// What a tile is told.
#[derive(Clone, Debug)]
pub(super) struct Briefing {
    /// The numbers of rays to each cell, and of the unoccluded ones.
    pub(super) counts: [CellArray; 2],
    /// The visibility of each cell from all windows; `None` if nothing is known.
    pub(super) everywhere: Option<Box<CellArray>>,
    /// The root mean square of what a candidate adds, over its light; 1 if nothing is known.
    pub(super) rms: CellArray,
}

impl Default for Briefing {
    fn default() -> Self {
        let mut rms = ZERO_CELLS;
        rms.fill([1.0; LANES]);
        Self { counts: [ZERO_CELLS; 2], everywhere: None, rms }
    }
}

impl Briefing {
    /// Asks the scouts that are nearest to `position`.
    pub(super) fn prepare(
        &mut self,
        instruction_set: InstructionSet,
        cells: &Cells,
        scouted: &Scouted,
        position: Vec3,
    ) {
        if scouted.positions.is_empty() {
            *self = Self::default();
        } else {
            let briefing = self;
            dispatch(instruction_set, Prepare { briefing, cells, scouted, position });
        }
    }
}

struct Prepare<'a> {
    briefing: &'a mut Briefing,
    cells: &'a Cells,
    scouted: &'a Scouted,
    position: Vec3,
}

impl Kernel for Prepare<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { briefing: Briefing { counts, everywhere, rms }, cells, scouted, position } =
            self;
        // Add the counts of the nearest windows.
        *counts = [ZERO_CELLS; 2];
        for (distance, of_window) in scouted.nearest(position) {
            let fall_off = 1.0 / (1.0 + distance / scouted.squared_radius);
            let weight = simd.splat(fall_off * fall_off * fall_off);
            for (sums, of_window) in counts.iter_mut().zip(of_window) {
                for row in cells.rows() {
                    let sum = simd.load(&sums[row]) + weight * simd.load(&of_window[row]);
                    sums[row] = sum.store();
                }
            }
        }
        // Limit them, because the tile may see what scouts do not.
        let mut limited = [[[0.0; LANES]; 2]; TABLE_ROWS];
        let most = simd.splat(MOST_RAYS);
        for row in cells.rows() {
            let n = simd.load(&counts[0][row]);
            let factor = most / n.max(most);
            for (i, count) in counts.iter_mut().enumerate() {
                let sum = simd.load(&count[row]) * factor;
                (count[row], limited[row][i]) = (sum.store(), sum.store());
            }
        }
        // Estimate the root mean square.
        let (mut with, mut without) = (simd.splat(0.0), simd.splat(0.0));
        let of_all = &scouted.everywhere;
        **everywhere.get_or_insert_with(|| Box::new(ZERO_CELLS)) = *of_all;
        let of_all = |row| simd.load(&of_all[row]);
        for_each_prior(simd, &limited[cells.rows()], of_all, |row, prior| {
            let p = simd.load(&prior.visible);
            let light = simd.splat(LEFT_OF_GLOSSY) * p.squared();
            let root = (prior.variance(simd, simd.load(&limited[row][0]), p) + light).sqrt();
            let mass = simd.load(&cells.mass[row]);
            (with, without) = (with + mass * root, without + mass);
            rms[row] = root.store();
        });
        let blind = simd.splat(BLIND * with.sum() / without.sum().max(f32::MIN_POSITIVE));
        for row in cells.rows() {
            rms[row] = (simd.load(&rms[row]) + blind).store();
        }
    }
}

/// The visibility of each cell from all windows together.
fn everywhere(counts: &[Box<[CellArray; 2]>]) -> CellArray {
    let mut sums = [ZERO_CELLS; 2];
    for counts in counts {
        for (sums, counts) in sums.iter_mut().zip(&**counts) {
            add(sums, counts);
        }
    }
    let total = |sums: &CellArray| sums.iter().flatten().sum::<f32>();
    let of_all = (total(&sums[1]) + 1.0) / (total(&sums[0]) + 2.0);
    let [n, k] = sums;
    let mut visible = ZERO_CELLS;
    for (v, (n, k)) in visible.iter_mut().flatten().zip(n.iter().flatten().zip(k.iter().flatten()))
    {
        *v = (k + of_all) / (n + 1.0);
    }
    visible
}

/// Adds the numbers of all cells.
fn add(sums: &mut CellArray, counts: &CellArray) {
    for (sum, count) in sums.iter_mut().flatten().zip(counts.iter().flatten()) {
        *sum += count;
    }
}
