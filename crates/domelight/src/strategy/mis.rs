//! Sampling both the environment and the BRDF, combined by multiple importance sampling: Veach &
//! Guibas 1995, equation 10 (the multi-sample model; the weights sum to one for each direction).

use super::{PointStrategy, SampleIndex, ShadingPoint};
use crate::Rgb;
use crate::environment::{CompensatedTable, Environment, EnvironmentSample};
use crate::math::{Vec2, Vec3};
use crate::sampling::{Dimension, Heuristic};

/// The density from which directions toward the light are sampled.
#[derive(Clone, Debug)]
pub enum LightTable {
    /// A density proportional to luminance.
    Full,
    /// A density proportional to the luminance above the mean. It must be combined with BRDF samples.
    Compensated(CompensatedTable),
}

/// M environment samples and N BRDF samples at each point.
#[derive(Clone, Debug)]
pub struct MultipleImportanceSampling<'a> {
    environment: &'a Environment,
    table: LightTable,
    heuristic: Heuristic,
    n_environment: u32,
    n_brdf: u32,
}

/// A compensated table without BRDF samples would lose the dim light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "MIS compensation needs at least one BRDF sample: a compensated table alone omits all dim light"
)]
pub struct CompensationNeedsBrdf;

impl<'a> MultipleImportanceSampling<'a> {
    /// Takes `n_environment` and `n_brdf` samples at each point; either may be zero.
    ///
    /// # Errors
    /// A compensated table with `n_brdf` = 0.
    pub fn new(
        environment: &'a Environment,
        table: LightTable,
        heuristic: Heuristic,
        n_environment: u32,
        n_brdf: u32,
    ) -> Result<Self, CompensationNeedsBrdf> {
        if matches!(table, LightTable::Compensated(_)) && n_brdf == 0 {
            return Err(CompensationNeedsBrdf);
        }
        Ok(Self { environment, table, heuristic, n_environment, n_brdf })
    }

    fn sample_light(&self, u: Vec2) -> Option<EnvironmentSample> {
        match &self.table {
            LightTable::Full => self.environment.sample(u),
            LightTable::Compensated(table) => table.sample(self.environment, u),
        }
    }

    fn le_pdf(&self, wi: Vec3) -> (Rgb, f32) {
        match &self.table {
            LightTable::Full => self.environment.le_pdf(wi),
            LightTable::Compensated(table) => table.le_pdf(self.environment, wi),
        }
    }
}

impl PointStrategy for MultipleImportanceSampling<'_> {
    type Scratch = ();

    const UNBIASED: bool = true;

    fn unit(&self) -> f64 {
        self.environment.unit()
    }

    fn n_rays(&self) -> u32 {
        self.n_environment + self.n_brdf
    }

    fn sample(
        &self,
        at: &ShadingPoint,
        sample_index: SampleIndex,
        (): &mut (),
        mut push: impl FnMut(Vec3, Rgb),
    ) {
        let (m, n) = (self.n_environment, self.n_brdf);
        for j in 0..m {
            let u = sample_index.get(Dimension::Environment, j, m);
            let Some(s) = self.sample_light(u.u()) else { continue };
            let (value, pdf_brdf) = at.eval_pdf(s.wi);
            let w = self.heuristic.weight(m as f32 * s.pdf, n as f32 * pdf_brdf);
            push(s.wi, value * s.le * (w / (m as f32 * s.pdf)));
        }
        for j in 0..n {
            let u = sample_index.get(Dimension::Brdf, j, n);
            let Some(s) = at.sample(u.u_lobe(), u.u()) else { continue };
            let (le, pdf_light) = self.le_pdf(s.wi);
            let w = self.heuristic.weight(n as f32 * s.pdf, m as f32 * pdf_light);
            push(s.wi, s.value * le * (w / (n as f32 * s.pdf)));
        }
    }
}
