//! MIS compensation: Karlík et al. 2019, "MIS Compensation: Optimizing Sampling Techniques in
//! Multiple Importance Sampling".

use super::{Environment, EnvironmentSample};
use crate::Rgb;
use crate::math::{Vec2, Vec3};
use crate::sampling::Table2d;

/// A table over max(L − mean L, 0): it leaves the dim parts of the map to another technique.
///
/// Its density is zero where the map is not, so alone it would be biased. It is a type of its own
/// that only multiple importance sampling with BRDF samples accepts.
#[derive(Clone, Debug)]
pub struct CompensatedTable {
    /// None where nothing exceeds the mean, on a constant or black map: all is left to the BRDF.
    table: Option<Table2d>,
}

impl CompensatedTable {
    /// The table of an environment; the mean is over solid angle.
    pub fn new(environment: &Environment) -> Self {
        let mean = environment.power() / (4.0 * std::f64::consts::PI);
        // The mean of a constant map may round to just below it.
        let floor = mean * (1.0 + 1e-6);
        let importance = |le: Rgb| (f64::from(le.luminance()) - floor).max(0.0);
        Self { table: environment.grid.table(&environment.map, importance).ok() }
    }

    /// Draws a direction; none where nothing exceeds the mean.
    pub fn sample(&self, environment: &Environment, u: Vec2) -> Option<EnvironmentSample> {
        self.table.as_ref().and_then(|table| environment.sample_table(table, u))
    }

    /// Radiance, and the density of [`CompensatedTable::sample`] at `wi` \[sr⁻¹\].
    pub fn le_pdf(&self, environment: &Environment, wi: Vec3) -> (Rgb, f32) {
        let t = environment.texel(wi);
        let pdf = self.table.as_ref().map_or(0.0, |table| environment.density(table, t));
        (environment.map.get(t.column, t.row), pdf)
    }
}
