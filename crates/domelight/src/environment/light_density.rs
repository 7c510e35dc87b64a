//! Densities over directions that follow the light: proportional to luminance, or to luminance above a floor.

use super::{Environment, EnvironmentSample};
use crate::math::Vec2;
use crate::sampling::HierarchicalTable;
use crate::simd::{Colors, SimdFloat, Vectors};

/// A density of max(L − floor, 0) over the texels of an environment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightDensity<'a> {
    /// `None` where no texel exceeds the floor.
    pub(super) table: Option<&'a HierarchicalTable>,
    /// The value subtracted from the luminance.
    pub(super) floor: f32,
    /// The reciprocal of the table's total; 0 without a table.
    pub(super) inverse_total: f32,
}

/// Directions sampled from an environment, one per lane.
pub(crate) struct LightSampleLanes<F: SimdFloat> {
    pub(crate) wi: Vectors<F>,
    pub(crate) le: Colors<F>,
    /// The density, 0 where there is no sample.
    pub(crate) pdf: F,
}

impl LightDensity<'_> {
    /// The density \[sr⁻¹\] at texels of this radiance: their probability divided by their solid angle, which cancels.
    #[inline(always)]
    pub(crate) fn pdf<F: SimdFloat>(self, le: Colors<F>) -> F {
        let luminance = le.luminance();
        let above = (luminance - luminance.splat(self.floor)).max(luminance.splat(0.0));
        above * luminance.splat(self.inverse_total)
    }

    /// Samples one direction or several side by side; `None` if no texel exceeds the floor.
    #[inline(always)]
    pub(crate) fn sample_lanes<F: SimdFloat>(
        self,
        environment: &Environment,
        u: [F; 2],
    ) -> Option<LightSampleLanes<F>> {
        let drawn = self.table?.sample_lanes(u);
        let (column, row) = (drawn.column, drawn.row);
        let inside = environment.grid.directions_inside(column, row, drawn.inside);
        let wi = environment.orientation.up.to_world_lanes(inside);
        let le = Colors(F::each([column, row], |[column, row]| {
            environment.map.get(column as u32 as usize, row as u32 as usize).to_array()
        }));
        Some(LightSampleLanes { wi, le, pdf: self.pdf(le) })
    }

    /// Samples a direction; `None` if no texel exceeds the floor.
    #[inline]
    pub(super) fn sample(self, environment: &Environment, u: Vec2) -> Option<EnvironmentSample> {
        let LightSampleLanes { wi, le, pdf } = self.sample_lanes(environment, u.to_array())?;
        (pdf > 0.0).then_some(EnvironmentSample { wi: wi.into(), le: le.single(), pdf })
    }
}
