//! MIS compensation: Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in
//! Multiple Importance Sampling".

use super::{Environment, EnvironmentSample, LightDensity};
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::sampling::HierarchicalTable;
use crate::simd::Colors;

/// A table of max(L − mean L, 0), which leaves the dim parts of the map to another technique.
///
/// Its density is zero where the map is not, so alone it would be biased. It is a separate type
/// that only multiple importance sampling with BRDF samples accepts.
#[derive(Clone, Debug)]
pub struct CompensatedTable {
    /// `None` if nothing exceeds the mean, on a constant or black map; everything is left to the BRDF.
    table: Option<HierarchicalTable>,
    /// The value subtracted from the luminance.
    floor: f32,
    /// The reciprocal of the table's total; 0 without a table.
    inverse_total: f32,
}

impl CompensatedTable {
    /// Creates the table of an environment. The mean is over solid angle.
    pub fn new(environment: &Environment) -> Self {
        let mean = environment.power() / (4.0 * std::f64::consts::PI);
        // The mean of a constant map may round to just below it.
        let floor = (mean * (1.0 + 1e-6)) as f32;
        let importance = |le: Rgb| (le.luminance() - floor).max(0.0);
        let table = environment.grid.table(&environment.map, importance).ok();
        let inverse_total = table.as_ref().map_or(0.0, |t| (1.0 / t.total()) as f32);
        Self { table, floor, inverse_total }
    }

    /// Samples a direction; `None` if nothing exceeds the mean.
    pub fn sample(&self, environment: &Environment, u: Vec2) -> Option<EnvironmentSample> {
        self.light_density().sample(environment, u)
    }

    /// The radiance from `wi`, and the density of [`CompensatedTable::sample`] \[sr⁻¹\].
    pub fn le_pdf(&self, environment: &Environment, wi: Vec3) -> (Rgb, f32) {
        let le = environment.le(wi);
        (le, self.density(le))
    }

    /// The table; `None` if nothing exceeds the mean.
    pub(crate) fn table(&self) -> Option<&HierarchicalTable> {
        self.table.as_ref()
    }

    /// The density \[sr⁻¹\] at a texel of this radiance.
    pub(crate) fn density(&self, le: Rgb) -> f32 {
        self.light_density().pdf(Colors::from(le))
    }

    /// The density that the table samples.
    #[inline]
    pub(crate) fn light_density(&self) -> LightDensity<'_> {
        let Self { ref table, floor, inverse_total } = *self;
        LightDensity { table: table.as_ref(), floor, inverse_total }
    }
}
