//! The visibility that a tile expects of each cell: p and s in [`visibility`](super::visibility).

use crate::simd::{LANES, Lanes, Simd, SimdF32x8, SimdFloat};

/// The number of cells along the curve that know about each other's visibility.
const GROUP: usize = 16;
/// The visibility below which cells are known to be dark.
const DARK: f32 = 0.1;
/// s of cells that nobody has seen.
const LEAST_DOUBT: f32 = 0.003;

/// What the rays of a whole tile and its scouts say about the visibility of a row of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    /// p.
    pub(super) visible: Lanes,
    /// s.
    pub(super) doubt: Lanes,
}

impl Prior {
    /// That of portals, which are meant to be seen, and s where nothing is known.
    pub(super) const PORTAL: Self = Self { visible: [1.0; LANES], doubt: [1.0; LANES] };

    /// g² of cells with visibility `v` by `n` rays.
    #[inline(always)]
    pub(super) fn variance<S: Simd>(&self, simd: S, n: S::F32x8, v: S::F32x8) -> S::F32x8 {
        let one = simd.splat(1.0);
        let (p, s) = (simd.load(&self.visible), simd.load(&self.doubt));
        let differ = simd.splat(0.5) * p * (one - p) + simd.splat(0.005) * s;
        v * (one - v) + (differ / (n + one) + simd.splat(0.0003) * s)
    }
}

/// Calls `of_row` for each row of cells, with [N, K] in `counts`. `everywhere` has the v₀ of a row.
#[inline(always)]
pub(super) fn for_each_prior<S: Simd>(
    simd: S,
    counts: &[[Lanes; 2]],
    everywhere: impl Fn(usize) -> S::F32x8,
    mut of_row: impl FnMut(usize, Prior),
) {
    let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
    for (group, rows) in counts.chunks(GROUP).enumerate() {
        let (mut n_group, mut k_group) = (zero, zero);
        for [n, k] in rows {
            (n_group, k_group) = (n_group + simd.load(n), k_group + simd.load(k));
        }
        for (i, [n, k]) in rows.iter().enumerate() {
            let (n, k, all) = (simd.load(n), simd.load(k), everywhere(group * GROUP + i));
            let others = ((k_group - k).max(zero) + all) / ((n_group - n).max(zero) + one);
            let p = ((k + others) / (n + one)).min(one);
            let doubt =
                (others.max(p).max(all) * simd.splat(1.0 / DARK)).max(simd.splat(LEAST_DOUBT));
            let doubt = doubt.min(one).store();
            of_row(group * GROUP + i, Prior { visible: p.store(), doubt });
        }
    }
}
