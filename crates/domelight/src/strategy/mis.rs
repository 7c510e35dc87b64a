//! Sampling both the environment and the BRDF, combined by multiple importance sampling: Veach &
//! Guibas 1995, equation 10 (the multi-sample model; the weights sum to one for each direction).

use super::multi_sample::{Count, MultiSample, point_strategy_of_samples};
use crate::environment::{CompensatedTable, Environment};
use crate::sampling::Heuristic;

/// The density from which directions toward the light are sampled.
#[derive(Clone, Debug)]
pub enum LightTable {
    /// A density proportional to luminance.
    Full,
    /// A density proportional to the luminance above the mean. It must be combined with BRDF samples.
    Compensated(CompensatedTable),
}

/// M environment samples and N BRDF samples at each point, and, if asked for, Q points on the portals of the scene (see
/// [`Portal`](super::Portal)), sampled in proportion to area.
#[derive(Clone, Debug)]
pub struct MultipleImportanceSampling<'a> {
    environment: &'a Environment,
    table: LightTable,
    heuristic: Heuristic,
    n_environment: u32,
    n_brdf: u32,
    n_portal: u32,
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
        Ok(Self { environment, table, heuristic, n_environment, n_brdf, n_portal: 0 })
    }

    /// The same strategy with samples of portals beside the others, in scenes that have any.
    #[must_use]
    pub fn with_portal_samples(self, n_portal: u32) -> Self {
        Self { n_portal, ..self }
    }

    fn samples(&self) -> MultiSample<'_> {
        let light = match &self.table {
            LightTable::Full => self.environment.light_density(),
            LightTable::Compensated(table) => table.light_density(),
        };
        MultiSample {
            environment: self.environment,
            light,
            n_light: Count::fixed(self.n_environment),
            n_brdf: Count::fixed(self.n_brdf),
            n_portal: Count::fixed(self.n_portal),
            heuristic: self.heuristic,
        }
    }
}

point_strategy_of_samples!(MultipleImportanceSampling);
