//! A strategy prepared for an environment: a [`StrategySpec`] with its tables and lights.

use super::{
    BrdfSampling, CandidatePilot, CompensationNeedsBrdf, Contributions, EnvironmentSampling,
    LightSet, LightTable, MultipleImportanceSampling, ProductSampling, RejectionError,
    RejectionSampling, SampleScratch, SamplingImportanceResampling, ShadingPoint, Strategy,
    StrategySpec, TileShading, product, rejection, sir,
};
use crate::environment::{CompensatedTable, Environment};
use crate::math::Vec3;
use crate::rig::{
    MedianCut, RigError, Rule, VarianceMinimization, median_cut, variance_minimization,
};
use crate::sampling::Sampler;
use crate::simd::InstructionSet;

/// A strategy prepared for an environment. The set is closed, so that dispatch costs one branch per tile.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "there is one for each picture")]
pub enum PreparedStrategy<'e> {
    /// BRDF sampling.
    Brdf(BrdfSampling<'e>),
    /// Environment sampling.
    Environment(EnvironmentSampling<'e>),
    /// Multiple importance sampling.
    Mis(MultipleImportanceSampling<'e>),
    /// Product sampling.
    Product(ProductSampling<'e>),
    /// Rejection sampling.
    Rejection(RejectionSampling<'e>),
    /// Sampling importance resampling.
    Sir(SamplingImportanceResampling<'e>),
    /// The directional lights of a rig.
    Lights(LightSet),
}

/// An error in preparing a strategy for an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// Rejection with a stopping rule that has no estimate.
    #[error(transparent)]
    Rejection(#[from] RejectionError),
    /// MIS compensation without BRDF samples.
    #[error(transparent)]
    Compensation(#[from] CompensationNeedsBrdf),
    /// Lights that cannot be extracted.
    #[error(transparent)]
    Lights(#[from] RigError),
}

impl StrategySpec {
    /// Sets the parameters that were left open, with a pilot at some points of the scene: the number of SIR candidates
    /// with the least error for its cost ([`CandidatePilot`]). `points` is called only if needed. `visibility`
    /// returns V in [0, 1] for a point and a direction.
    #[must_use]
    pub fn for_scene(
        self,
        points: impl FnOnce() -> Vec<ShadingPoint>,
        visibility: impl Fn(&ShadingPoint, Vec3) -> f32,
        environment: &Environment,
        seed: u64,
    ) -> Self {
        match self {
            Self::Sir { n_candidates: None, n_samples, candidates, resampling } => {
                let points = &points();
                let pilot = CandidatePilot::new(environment, points, visibility, seed);
                let sir = SamplingImportanceResampling {
                    environment,
                    n_candidates: n_samples,
                    n_samples,
                    candidates,
                    resampling,
                };
                let n_candidates = Some(pilot.optimal_number(&sir));
                Self::Sir { n_candidates, n_samples, candidates, resampling }
            }
            Self::Sir { n_candidates: Some(_), .. }
            | Self::Brdf { .. }
            | Self::Environment { .. }
            | Self::Mis { .. }
            | Self::Product { .. }
            | Self::Rejection { .. }
            | Self::MedianCut { .. }
            | Self::VarianceMinimization { .. } => self,
        }
    }
}

impl<'e> PreparedStrategy<'e> {
    /// An estimate of the memory that [`PreparedStrategy::new`] needs \[bytes\] beyond
    /// [`Environment::MEMORY_PER_TEXEL`]. Product sampling divides the texels of maps that are much wider or narrower
    /// than 2:1.
    pub fn memory(spec: StrategySpec, environment: &Environment) -> u64 {
        match spec {
            StrategySpec::Product { .. } => environment.memory_to_reshape(),
            StrategySpec::Brdf { .. }
            | StrategySpec::Environment { .. }
            | StrategySpec::Mis { .. }
            | StrategySpec::Rejection { .. }
            | StrategySpec::Sir { .. }
            | StrategySpec::MedianCut { .. }
            | StrategySpec::VarianceMinimization { .. } => 0,
        }
    }

    /// Builds the tables and lights that all pictures under the environment share. If the number of SIR candidates was
    /// left open ([`StrategySpec::for_scene`]), it equals the number of rays.
    ///
    /// # Errors
    /// If the environment or the counts do not suit the strategy.
    pub fn new(spec: StrategySpec, environment: &'e Environment) -> Result<Self, PrepareError> {
        Ok(match spec {
            StrategySpec::Brdf { n_samples } => Self::Brdf(BrdfSampling { environment, n_samples }),
            StrategySpec::Environment { n_samples } => {
                Self::Environment(EnvironmentSampling { environment, n_samples })
            }
            StrategySpec::Mis { n_environment, n_brdf, n_portal, heuristic, compensation } => {
                let table = if compensation {
                    LightTable::Compensated(CompensatedTable::new(environment))
                } else {
                    LightTable::Full
                };
                let mis = MultipleImportanceSampling::new(
                    environment,
                    table,
                    heuristic,
                    n_environment,
                    n_brdf,
                )?;
                Self::Mis(mis.with_portal_samples(n_portal))
            }
            StrategySpec::Product { n_rays } => {
                Self::Product(ProductSampling::new(environment, n_rays))
            }
            StrategySpec::Rejection { proposal, stop } => {
                Self::Rejection(RejectionSampling::new(environment, proposal, stop)?)
            }
            StrategySpec::Sir { n_candidates, n_samples, candidates, resampling } => {
                Self::Sir(SamplingImportanceResampling {
                    environment,
                    n_candidates: n_candidates.unwrap_or(n_samples),
                    n_samples,
                    candidates,
                    resampling,
                })
            }
            StrategySpec::MedianCut { n_lights } => {
                let rig = |environment: &Environment| {
                    median_cut(environment, n_lights as usize, MedianCut::default())
                };
                Self::Lights(LightSet::of(environment, rig)?)
            }
            StrategySpec::VarianceMinimization { n_lights, rule } => {
                let settings = match rule {
                    Rule::Spherical => VarianceMinimization::default(),
                    Rule::Poster => VarianceMinimization::poster(),
                };
                let rig = |environment: &Environment| {
                    variance_minimization(environment, n_lights as usize, settings)
                };
                Self::Lights(LightSet::of(environment, rig)?)
            }
        })
    }
}

impl PreparedStrategy<'_> {
    /// The same strategy computed with another instruction set, if it has a choice; `None` if this processor lacks
    /// the instruction set. The pictures are the same.
    #[must_use]
    pub fn with_instruction_set(self, instruction_set: InstructionSet) -> Option<Self> {
        match self {
            Self::Product(product) => {
                product.with_instruction_set(instruction_set).map(Self::Product)
            }
            Self::Brdf(_)
            | Self::Environment(_)
            | Self::Mis(_)
            | Self::Rejection(_)
            | Self::Sir(_)
            | Self::Lights(_) => instruction_set.is_available().then_some(self),
        }
    }
}

/// Evaluates the same expression for every strategy.
macro_rules! each {
    ($strategy:expr, $s:ident => $body:expr) => {
        match $strategy {
            PreparedStrategy::Brdf($s) => $body,
            PreparedStrategy::Environment($s) => $body,
            PreparedStrategy::Mis($s) => $body,
            PreparedStrategy::Product($s) => $body,
            PreparedStrategy::Rejection($s) => $body,
            PreparedStrategy::Sir($s) => $body,
            PreparedStrategy::Lights($s) => $body,
        }
    };
}

/// Scratch memory of [`PreparedStrategy`]. Only the part of the running strategy is allocated.
#[derive(Debug, Default)]
pub struct PreparedScratch {
    samples: SampleScratch,
    product: product::ProductScratch,
    rejection: rejection::RejectionScratch,
    sir: sir::SirScratch,
}

impl Strategy for PreparedStrategy<'_> {
    /// What `product` shares; the other strategies share nothing.
    type Pass = Option<product::ProductPass>;
    type Scratch = PreparedScratch;
    type Findings = Option<product::Findings>;

    fn n_rounds(&self) -> u32 {
        each!(self, s => s.n_rounds())
    }

    fn is_unbiased(&self) -> bool {
        each!(self, s => s.is_unbiased())
    }

    fn unit(&self) -> f64 {
        each!(self, s => Strategy::unit(s))
    }

    fn n_rays(&self) -> u32 {
        each!(self, s => Strategy::n_rays(s))
    }

    fn samples_portals(&self) -> bool {
        each!(self, s => Strategy::samples_portals(s))
    }

    fn samples_per_pass(&self) -> Option<u32> {
        each!(self, s => s.samples_per_pass())
    }

    fn begin_pass(&self, sampler: Sampler, n_samples: u32) -> Self::Pass {
        match self {
            Self::Product(product) => Some(product.begin_pass(sampler, n_samples)),
            Self::Brdf(_)
            | Self::Environment(_)
            | Self::Mis(_)
            | Self::Rejection(_)
            | Self::Sir(_)
            | Self::Lights(_) => None,
        }
    }

    fn push(
        &self,
        pass: &Self::Pass,
        tile: &TileShading,
        round: u32,
        scratch: &mut PreparedScratch,
        out: &mut Contributions,
    ) {
        match self {
            Self::Brdf(s) => s.push(&(), tile, round, &mut scratch.samples, out),
            Self::Environment(s) => s.push(&(), tile, round, &mut scratch.samples, out),
            Self::Mis(s) => s.push(&(), tile, round, &mut scratch.samples, out),
            Self::Product(s) => {
                let pass = pass.as_ref().expect("product prepares each pass");
                s.push(pass, tile, round, &mut scratch.product, out);
            }
            Self::Rejection(s) => s.push(&(), tile, round, &mut scratch.rejection, out),
            Self::Sir(s) => s.push(&(), tile, round, &mut scratch.sir, out),
            Self::Lights(s) => s.push(&(), tile, round, &mut (), out),
        }
    }

    fn learn(
        &self,
        tile: &TileShading,
        pushed: &Contributions,
        visibility: &[f32],
        scratch: &mut PreparedScratch,
    ) {
        match self {
            Self::Product(product) => product.learn(tile, pushed, visibility, &mut scratch.product),
            Self::Brdf(_)
            | Self::Environment(_)
            | Self::Mis(_)
            | Self::Rejection(_)
            | Self::Sir(_)
            | Self::Lights(_) => {}
        }
    }

    fn findings(&self, scratch: &PreparedScratch) -> Self::Findings {
        match self {
            Self::Product(product) => Some(product.findings(&scratch.product)),
            Self::Brdf(_)
            | Self::Environment(_)
            | Self::Mis(_)
            | Self::Rejection(_)
            | Self::Sir(_)
            | Self::Lights(_) => None,
        }
    }

    fn brief(&self, pass: &mut Self::Pass, findings: Vec<Self::Findings>) {
        if let (Self::Product(product), Some(pass)) = (self, pass) {
            product.brief(pass, findings.into_iter().flatten().collect());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Orientation;
    use crate::{Rgb, RgbImage};

    #[test]
    fn a_rule_of_variance_minimization_has_its_lights() {
        let texel = |x: usize, y: usize| Rgb::splat(1.0 + ((x * 7 + y * 13) % 11) as f32);
        let map = RgbImage::from_fn(32, 16, texel);
        let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let directions = |rig: &crate::rig::Rig| -> Vec<Vec3> {
            rig.lights.iter().map(|light| light.direction).collect()
        };
        let of = |text: &str| {
            let prepared = PreparedStrategy::new(text.parse().unwrap(), &environment).unwrap();
            let PreparedStrategy::Lights(set) = prepared else { panic!("{text} has no lights") };
            directions(&set.rig)
        };
        for (text, settings) in [
            ("variance-minimization:8", VarianceMinimization::default()),
            ("variance-minimization:8:rule=2009", VarianceMinimization::poster()),
        ] {
            let expected = directions(&variance_minimization(&environment, 8, settings).unwrap());
            let found = of(text);
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(&expected).all(|(a, b)| a.abs_diff_eq(*b, 1e-5)), "{text}");
        }
        assert_ne!(of("variance-minimization:8"), of("variance-minimization:8:rule=2009"));
    }
}
