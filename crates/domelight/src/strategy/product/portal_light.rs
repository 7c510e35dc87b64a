//! Portals in the product strategy: a third source of candidates, beside strata of the table and BRDF samples.
//!
//! Points on portals are sampled in proportion to area, whatever the map shows behind them. The balance heuristic leaves
//! small bright lights to the strata, whose density there is higher. The visibility of portal samples is learned apart
//! from that of cells, in slots of its own, because a cell at the frame of a window is half visible, but a portal sample
//! in it is not.

use super::cells::{CellArray, Cells, TABLE_ROWS};
use super::control_variate::ControlVariate;
use super::table::{Table, center};
use crate::math::Vec3;
use crate::simd::{LANES, Simd, SimdFloat, Vectors};
use crate::strategy::portal::{Portal, Portals};

/// The row with the slots of portals, beyond those of cells.
pub(super) const PORTAL_ROW: usize = TABLE_ROWS - 1;

/// The slot in which the visibility of samples of portal `index` is learned. Many portals share slots.
pub(super) fn portal_slot(index: usize) -> usize {
    PORTAL_ROW * LANES + index % LANES
}

/// The least cosine of a cell's center to the normal of a portal for which the cell's extent on the portal is computed.
const LEAST_COSINE: f32 = 0.1;
/// The cosine to the normal of a portal below which a direction is parallel to the portal.
const PARALLEL: f32 = 1e-6;
/// The least angle between the center of a cell and its border \[rad\], which slots without a cell have.
const LEAST_ANGLE: f32 = 1e-6;
/// The least part of the light behind a portal for which strata are drawn.
const LEAST_SHARE: f32 = 0.1;

/// What the balance heuristic leaves to strata of the light of each cell.
#[derive(Clone, Debug, Default)]
pub(super) struct StrataShare {
    /// The root mean square of M p₀/(M p₀ + Q p_portal) over the cell.
    rms: CellArray,
    /// 1 for cells without a direction through a portal, otherwise 0.
    whole: CellArray,
    /// Scratch memory of [`StrataShare::fill`].
    seen: Vec<SeenPortal>,
}

/// A portal as seen from a point.
#[derive(Clone, Copy, Debug)]
struct SeenPortal {
    normal: Vec3,
    /// The height of its plane above the point, along the normal.
    height: f32,
    axes: [PortalAxis; 2],
}

/// A coordinate on a portal, from 0 to 1 inside.
#[derive(Clone, Copy, Debug)]
struct PortalAxis {
    /// Its gradient.
    dual: Vec3,
    /// The length of the gradient.
    length: f32,
    /// The gradient times the vector from the point to the corner.
    corner: f32,
}

impl SeenPortal {
    fn new(portal: &Portal, position: Vec3) -> Self {
        let (to_corner, normal) = (portal.corner() - position, portal.normal());
        let axis =
            |dual: Vec3| PortalAxis { dual, length: dual.length(), corner: dual.dot(to_corner) };
        Self { normal, height: to_corner.dot(normal), axes: portal.dual().map(axis) }
    }
}

impl StrataShare {
    /// Computes the shares as seen from `position`, for `n_portal` = Q. `strata` is M over the total of the product.
    ///
    /// The part of a cell within the portal has one share, that at the center; the part beside it is left to strata as a
    /// whole. Strata must not become rare there, because the light may be seen beside the portal.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &mut self,
        simd: S,
        cells: &Cells,
        table: &Table,
        (portals, n_portal): (Portals, usize),
        strata: f32,
        position: Vec3,
    ) {
        let one = |x| simd.splat_f32x16(x);
        self.seen.clear();
        self.seen.extend(portals.iter().map(|portal| SeenPortal::new(portal, position)));
        for pair in cells.pairs() {
            let center = center(simd, cells, pair);
            let angle = cells.bounding_angle.pair(simd, pair).max(one(LEAST_ANGLE));
            let (mut density, mut within, mut whole) = (one(0.0), one(0.0), one(1.0));
            for portal in &self.seen {
                let cosine = center.dot(portal.normal);
                let slant = cosine.abs();
                // The distance to the plane along the center of the cell, large in directions along the plane.
                let away = S::F32x16::select(slant.lt(one(PARALLEL)), one(PARALLEL), cosine);
                let distance = one(portal.height) / away;
                let reach = angle * distance.abs() / slant.max(one(LEAST_COSINE));
                let (mut passes, mut inside) = (one(0.0).lt(distance), one(1.0));
                for axis in &portal.axes {
                    let at = Vectors::dot(center, axis.dual) * distance - one(axis.corner);
                    let reach = (reach * one(axis.length)).max(one(f32::MIN_POSITIVE));
                    passes = passes & (one(0.0) - reach).le(at) & at.le(one(1.0) + reach);
                    let covered = (at + reach).min(one(1.0)) - (at - reach).max(one(0.0));
                    inside = inside * (covered / (reach + reach)).max(one(0.0)).min(one(1.0));
                }
                let inside = S::F32x16::select(passes, inside, one(0.0));
                let pdf = distance.squared() / (slant.max(one(LEAST_COSINE)) * one(portals.area()));
                density = density + pdf.min(one(f32::MAX)) * inside;
                within = within + inside;
                // Along the plane, any cell may show the portal.
                whole = S::F32x16::select(passes | slant.lt(angle), one(0.0), whole);
            }
            let within = within.min(one(1.0));
            let area = cells.inverse_radiance.pair(simd, pair) * cells.mass.pair(simd, pair);
            let of_strata = one(strata) * table.product_of(simd, pair);
            let others = one(n_portal as f32) * density * area;
            let share = of_strata / (of_strata + others).max(one(f32::MIN_POSITIVE));
            let beside = one(1.0) - within;
            let rms = (beside + within * share.max(one(LEAST_SHARE)).squared()).sqrt();
            self.rms.set_pair(pair, rms);
            self.whole.set_pair(pair, whole);
        }
    }

    /// Leaves the light behind portals to candidates alone, with fewer strata.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        cells: &Cells,
        table: &mut Table,
        control_variate: &mut ControlVariate,
    ) {
        for pair in cells.pairs() {
            control_variate.scale(simd, pair, self.whole.pair(simd, pair));
            table.scale(simd, pair, self.rms.pair(simd, pair));
        }
    }
}
