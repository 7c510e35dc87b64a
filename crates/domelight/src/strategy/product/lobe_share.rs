//! What strata leave to BRDF samples: the light that narrow lobes reflect from wide cells.
//!
//! A table knows a lobe that is narrower than a cell only as a mean over the cell, and the pool has few directions there,
//! the same for all pixels. BRDF samples follow the lobe, but not the light. If strata have the part s of the light of a cell
//! with radiance L and BRDF samples the rest, the variances of M samples of each are about
//!
//! ```text
//! strata   Σ s² L F T v/M                          v = (r/α)², the part of the variance left in a cell of angular radius r
//! BRDF     (Σ (1 − s)² L̂ L F A − B²)/M             B = Σ (1 − s) L F, what BRDF samples have of the light
//!          F = ∫ f dω over the cell      A = ∫ f dω      T = Σ L F      L̂ = ∫ L² dω/∫ L dω
//! ```
//!
//! for a lobe of roughness α. Their sum is smallest for s = (A L̂ − B)/(A L̂ + T v), where that is positive: BRDF samples alone
//! have no variance where the light is even. The density of strata, which the balance heuristic compares with that of BRDF
//! samples, is multiplied by s, and the number of BRDF samples follows the light that strata leave. Light that scouts have
//! not seen counts less: L is multiplied by its factor beside that of the cell that is seen best. This is MIS compensation
//! (Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in Multiple Importance Sampling"), whose constant
//! B/A follows from the division.

use super::cells::{CellArray, Cells};
use super::control_variate::ControlVariate;
use super::hits::Groups;
use super::strata::Counts;
use super::table::Table;
use crate::math::sqr;
use crate::simd::{Simd, SimdF32x16 as _, SimdFloat as _};

/// The maximum fraction of the candidates that are BRDF samples.
const MOST: f32 = 0.9;

/// The roughness from which lobes are wide enough for strata alone.
const WIDE: f32 = 0.15;

/// Narrower lobes count as having this roughness.
const LEAST_WIDTH: f32 = 1e-3;

/// How often s and B are computed in turns (docs/experiments.md).
const ROUNDS: usize = 4;

/// The factor of the cell that is seen best is at least this.
const LEAST_SEEN: f32 = 1e-3;

/// The factors on the density of strata.
#[derive(Clone, Debug, Default)]
pub(super) struct LobeShare {
    /// s.
    of_strata: CellArray,
    /// Whether BRDF samples have a part; without one, s = 1 in all cells, whatever `of_strata` says.
    is_divided: bool,
}

impl LobeShare {
    /// Divides the light between strata and BRDF samples, for a filled table whose light is multiplied by `seen`. Returns
    /// the numbers of candidates, with more BRDF samples where these have more of the light.
    #[inline(always)]
    pub(super) fn divide<S: Simd>(
        &mut self,
        simd: S,
        cells: &Cells,
        (table, seen): (&Table, &CellArray),
        groups: &Groups,
        counts: Counts,
    ) -> Counts {
        let Some(width) = groups.narrowest().filter(|&width| width < WIDE) else {
            self.is_divided = false;
            return counts;
        };
        let one = |x| simd.splat_f32x16(x);
        let diffuse = one(groups.diffuse_albedo());
        let (mut of_lobes, mut of_all, mut most_seen) = (one(0.0), one(0.0), one(0.0));
        for pair in cells.pairs() {
            let seen = seen.pair(simd, pair);
            let light = cells.mass.pair(simd, pair) * seen;
            let [lobes, all] = table.reflectance(simd, pair, diffuse);
            (of_lobes, of_all) = (of_lobes + lobes * light, of_all + all * light);
            most_seen = most_seen.max(seen);
        }
        let albedo = groups.albedo().max(f32::MIN_POSITIVE);
        let most_seen = most_seen.store().as_flattened().iter().copied().fold(LEAST_SEEN, f32::max);
        let most_seen = sqr(most_seen);
        let scale = one(of_lobes.sum() / (albedo * sqr(width.max(LEAST_WIDTH)) * most_seen));
        // B/A, at first for strata alone.
        let mut even = 0.0;
        let mut left = one(0.0);
        for _ in 0..ROUNDS {
            let mut left_of_lobes = one(0.0);
            left = one(0.0);
            for pair in cells.pairs() {
                let [lobes, all] = table.reflectance(simd, pair, diffuse);
                let seen = seen.pair(simd, pair);
                let of_lobes = lobes / all.max(one(f32::MIN_POSITIVE));
                let variance = cells.radius.pair(simd, pair).squared() * of_lobes;
                let dimness = cells.inverse_brightness.pair(simd, pair) * seen;
                let above = (one(1.0) - one(even) * dimness).max(one(0.0));
                let of_strata = above / (one(1.0) + scale * variance * dimness);
                self.of_strata.set_pair(pair, of_strata);
                let light = (one(1.0) - of_strata) * cells.mass.pair(simd, pair) * seen;
                left = left + light * all;
                left_of_lobes = left_of_lobes + light * lobes;
            }
            even = left_of_lobes.sum() / (albedo * most_seen);
        }
        let left = left.sum() / of_all.sum().max(f32::MIN_POSITIVE);
        let counts = counts.with_brdf_share(MOST * left);
        self.is_divided = counts.brdf > 0;
        counts
    }

    /// Multiplies the density of strata and their control variate, which approximates such lobes as badly as the table.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        cells: &Cells,
        table: &mut Table,
        control_variate: &mut ControlVariate,
    ) {
        if !self.is_divided {
            return;
        }
        for pair in cells.pairs() {
            let of_strata = self.of_strata.pair(simd, pair);
            table.scale(simd, pair, of_strata);
            control_variate.scale(simd, pair, of_strata);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::briefing::Briefing;
    use super::super::cells::{MAX_ROWS, get};
    use super::super::hits::Hits;
    use super::super::test_support::{hit, sky};
    use super::*;
    use crate::math::Vec3;
    use crate::simd::{InstructionSet, Kernel, dispatch};

    struct Divide<'a> {
        cells: &'a Cells,
        material: &'a str,
    }

    impl Kernel for Divide<'_> {
        type Output = (LobeShare, Counts);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let (mut groups, mut table) = (Groups::default(), Table::default());
            let points = [hit(self.material, Vec3::Y)];
            groups.cluster(Hits { points: &points, one_material: true });
            let mut share = LobeShare::default();
            table.fill::<S, false>(simd, self.cells, &groups.all, &mut ControlVariate::default());
            let seen = &Briefing::default().rms;
            let counts = Counts { light: 60, brdf: 0, portal: 4 };
            let counts = share.divide(simd, self.cells, (&table, seen), &groups, counts);
            (share, counts)
        }
    }

    /// BRDF samples get what a narrow lobe reflects of wide cells, and strata keep the sun and wide lobes.
    #[test]
    fn narrow_lobes_leave_wide_cells_to_brdf_samples() {
        let [cells] = Cells::new(&sky(), [MAX_ROWS]).unwrap();
        let divide =
            |material| dispatch(InstructionSet::best(), Divide { cells: &cells, material });
        for material in ["diffuse:0.8", "ggx:0.2", "gltf:0.9,0.6,0.3:0.5:0.5"] {
            let (share, counts) = divide(material);
            assert!(!share.is_divided, "{material}");
            assert_eq!(counts, Counts { light: 60, brdf: 0, portal: 4 }, "{material}");
        }
        let slots = || (0..cells.len()).map(|cell| cells.slot(cell));
        let brightest = |a: &usize, b: &usize| {
            let [a, b] = [a, b].map(|&slot| get(&cells.inverse_brightness, slot));
            b.total_cmp(&a)
        };
        let sun = slots().max_by(brightest).unwrap();
        let mut before = 0;
        for material in ["ggx:0.1", "ggx:0.05", "ggx:0.02"] {
            let (share, counts) = divide(material);
            assert_eq!((counts.light + counts.brdf, counts.portal), (60, 4), "{material}");
            assert!(counts.brdf > before && counts.light > 0, "{material}: {counts:?}");
            before = counts.brdf;
            let of_strata = |slot| get(&share.of_strata, slot);
            assert!(slots().all(|slot| (0.0..=1.0).contains(&of_strata(slot))), "{material}");
            assert!(of_strata(sun) > 0.99, "{material}: {}", of_strata(sun));
        }
    }
}
