//! From the flags to a strategy.

use anyhow::Result;
use domelight::environment::{CompensatedTable, Environment};
use domelight::render::{RenderSettings, Rendering, render};
use domelight::rig::{MedianCut, Rig, VarianceMinimization, median_cut, variance_minimization};
use domelight::sampling::Heuristic;
use domelight::scene::{Camera, Scene};
use domelight::strategy::{
    BrdfSampling, Candidates, EnvironmentSampling, LightSet, LightTable,
    MultipleImportanceSampling, ProductSampling, Proposal, RAY_COST, RejectionSampling, Resampling,
    SamplingImportanceResampling, ShadingPoint, Stop, Strategy, optimal_candidates,
};

use crate::args::render::{
    HeuristicName, ProposalName, ResamplingName, SamplingArguments, SourceName, StrategyName,
};
use crate::failure::UsageError;
use crate::progress::RenderProgress;
use crate::values::Split;

/// What the sampling flags say together.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Plan {
    Brdf { n: u32 },
    Environment { n: u32 },
    Mis { split: Split, heuristic: Heuristic, compensation: bool },
    Product { n: u32 },
    Rejection { proposal: Proposal, stop: Stop },
    Sir { n_candidates: Option<u32>, n: u32, candidates: Candidates, resampling: Resampling },
    MedianCut { n_lights: usize },
    VarianceMinimization { n_lights: usize },
}

impl SamplingArguments {
    /// Checks what the flags say together.
    pub(crate) fn plan(&self) -> Result<Plan> {
        use StrategyName as S;
        let is = |names: &[StrategyName]| names.contains(&self.strategy);
        let is_rig = is(&[S::MedianCut, S::VarianceMinimization]);
        let (mis, sir, rejection) = (is(&[S::Mis]), is(&[S::Sir]), is(&[S::Rejection]));
        refuse("--heuristic", self.heuristic.is_some() && !mis, "--strategy mis")?;
        refuse("--split", self.split.is_some() && !mis, "--strategy mis")?;
        refuse("--no-compensation", self.no_compensation && !mis, "--strategy mis")?;
        refuse("--candidates", self.candidates.is_some() && !sir, "--strategy sir")?;
        refuse("--from", self.from.is_some() && !sir, "--strategy sir")?;
        refuse("--resampling", self.resampling.is_some() && !sir, "--strategy sir")?;
        refuse("--tries", self.tries.is_some() && !rejection, "--strategy rejection")?;
        refuse("--proposal", self.proposal.is_some() && !rejection, "--strategy rejection")?;
        let rigs = "--strategy median-cut or variance-minimization";
        refuse("--lights", self.lights.is_some() && !is_rig, rigs)?;
        refuse("--rays", self.rays.is_some() && is_rig, "other strategies; use --lights")?;
        let n = self.rays.unwrap_or(1);
        let n_lights = self.lights.unwrap_or(64) as usize;
        self.refuse_repeating_points()?;
        Ok(match self.strategy {
            S::Brdf => Plan::Brdf { n },
            S::Environment => Plan::Environment { n },
            S::Mis => self.mis()?,
            S::Product => Plan::Product { n: self.rays.unwrap_or(8) },
            S::Rejection => self.rejection()?,
            S::Sir => self.sir(n)?,
            S::MedianCut => Plan::MedianCut { n_lights },
            S::VarianceMinimization => Plan::VarianceMinimization { n_lights },
        })
    }

    /// The points of a pixel are numbered by 32 bits; beyond that they would repeat.
    fn refuse_repeating_points(&self) -> Result<()> {
        let split = self.split.map_or(0, |s| s.environment.max(s.brdf));
        let counts = [self.rays, self.candidates, self.tries, Some(split)];
        let most = counts.into_iter().flatten().max().unwrap_or(1).max(1);
        if u64::from(self.spp) * u64::from(most) > 1 << 32 {
            return usage(format!(
                "{} camera samples of {most} directions are more points than a pixel has (2^32): \
                 lower --spp, or render several seeds and average them",
                self.spp
            ));
        }
        Ok(())
    }

    fn rejection(&self) -> Result<Plan> {
        let proposal = match self.proposal.unwrap_or(ProposalName::Tighter) {
            ProposalName::Environment => Proposal::Environment,
            ProposalName::Brdf => Proposal::Brdf,
            ProposalName::Tighter => Proposal::Tighter,
        };
        let stop = match (self.rays, self.tries) {
            (None, tries) => Stop::Tries(tries.unwrap_or(16)),
            (Some(1), _) => {
                return usage(
                    "--strategy rejection estimates from two accepted samples at least: use --rays 2 or more, or --tries M for a fixed number of tries",
                );
            }
            (Some(n), tries) => {
                Stop::Accepted { n, max_tries: tries.unwrap_or(n.saturating_mul(64)) }
            }
        };
        Ok(Plan::Rejection { proposal, stop })
    }

    fn sir(&self, n: u32) -> Result<Plan> {
        if self.candidates.is_some_and(|m| m < n) {
            return usage("--candidates M must not be below --rays N");
        }
        let candidates = match self.from.unwrap_or(SourceName::Mixture) {
            SourceName::Environment => Candidates::Environment,
            SourceName::Brdf => Candidates::Brdf,
            SourceName::Mixture => Candidates::Mixture,
        };
        let resampling = match self.resampling.unwrap_or(ResamplingName::Sorted) {
            ResamplingName::Multinomial => Resampling::Multinomial,
            ResamplingName::Systematic => Resampling::Systematic,
            ResamplingName::Sorted => Resampling::SystematicSorted,
            ResamplingName::Reservoir => Resampling::Reservoir,
        };
        Ok(Plan::Sir { n_candidates: self.candidates, n, candidates, resampling })
    }

    fn mis(&self) -> Result<Plan> {
        let split = match (self.split, self.rays.unwrap_or(2)) {
            (Some(split), _) => split,
            (None, 1) => {
                return usage(
                    "--strategy mis takes one sample of each kind at least: use --rays 2, or \
                     --split 1:0 or 0:1 for one kind alone",
                );
            }
            (None, n) => Split { environment: n.div_ceil(2), brdf: n / 2 },
        };
        let heuristic = match self.heuristic.unwrap_or(HeuristicName::Power) {
            HeuristicName::Balance => Heuristic::Balance,
            HeuristicName::Power => Heuristic::Power,
        };
        // Without BRDF samples nothing would catch the dim light.
        let compensation = !self.no_compensation && split.brdf > 0;
        Ok(Plan::Mis { split, heuristic, compensation })
    }
}

/// A usage error if a flag is given that does not apply.
fn refuse(flag: &str, misplaced: bool, goes_with: &str) -> Result<()> {
    if misplaced { usage(format!("{flag} goes with {goes_with}")) } else { Ok(()) }
}

fn usage<T>(text: impl Into<String>) -> Result<T> {
    Err(UsageError(text.into()).into())
}

/// The name of a variant, in lower case.
fn lower(variant: impl std::fmt::Debug) -> String {
    format!("{variant:?}").to_lowercase()
}

impl Plan {
    /// Fills in what depends on the scene: the number of candidates with the least error for its
    /// cost, by a pilot over some of its points.
    pub(crate) fn for_scene(
        self,
        points: impl FnOnce() -> Vec<ShadingPoint>,
        environment: &Environment,
        seed: u64,
    ) -> Self {
        match self {
            Self::Sir { n_candidates: None, n, candidates, resampling } => {
                let variance = candidates.relative_variance(environment, &points(), seed);
                let n_candidates = Some(optimal_candidates(n, variance, RAY_COST));
                Self::Sir { n_candidates, n, candidates, resampling }
            }
            plan => plan,
        }
    }

    /// The name and the samples, for the report.
    pub(crate) fn describe(self) -> String {
        match self {
            Self::Brdf { n } => format!("brdf, {n} a camera sample"),
            Self::Environment { n } => format!("environment, {n} a camera sample"),
            Self::Mis { split, heuristic, compensation } => format!(
                "mis {}:{}, {} heuristic{}",
                split.environment,
                split.brdf,
                if heuristic == Heuristic::Power { "power" } else { "balance" },
                if compensation { ", compensated" } else { "" }
            ),
            Self::Product { n } => format!("product, up to {n} a camera sample"),
            Self::Rejection { proposal, stop } => {
                let stop = match stop {
                    Stop::Tries(m) => format!("{m} tries"),
                    Stop::Accepted { n, max_tries } => {
                        format!("until {n} are accepted or {max_tries} tried")
                    }
                };
                format!("rejection from {}, {stop}", lower(proposal))
            }
            Self::Sir { n_candidates, n, candidates, resampling } => format!(
                "sir {n}/{}, {} candidates, {} resampling",
                n_candidates.unwrap_or(n),
                lower(candidates),
                lower(resampling)
            ),
            Self::MedianCut { n_lights } => format!("median-cut, {n_lights} lights"),
            Self::VarianceMinimization { n_lights } => {
                format!("variance-minimization, {n_lights} lights")
            }
        }
    }
}

/// A plan with what it needs of the environment.
pub(crate) enum Prepared<'a> {
    Brdf { n: u32 },
    Environment { n: u32 },
    Mis { split: Split, heuristic: Heuristic, table: Option<CompensatedTable> },
    Product(Box<ProductSampling<'a>>),
    Rejection { proposal: Proposal, stop: Stop },
    Sir { n_candidates: u32, n: u32, candidates: Candidates, resampling: Resampling },
    Lights(Rig),
}

impl<'a> Prepared<'a> {
    pub(crate) fn new(plan: Plan, environment: &'a Environment) -> Result<Self> {
        Ok(match plan {
            Plan::Brdf { n } => Self::Brdf { n },
            Plan::Environment { n } => Self::Environment { n },
            Plan::Mis { split, heuristic, compensation } => {
                let table = compensation.then(|| CompensatedTable::new(environment));
                Self::Mis { split, heuristic, table }
            }
            Plan::Product { n } => Self::Product(Box::new(ProductSampling::new(environment, n))),
            Plan::Rejection { proposal, stop } => Self::Rejection { proposal, stop },
            Plan::Sir { n_candidates, n, candidates, resampling } => {
                Self::Sir { n_candidates: n_candidates.unwrap_or(n), n, candidates, resampling }
            }
            Plan::MedianCut { n_lights } => {
                Self::Lights(median_cut(environment, n_lights, MedianCut::default())?)
            }
            Plan::VarianceMinimization { n_lights } => {
                let settings = VarianceMinimization::default();
                Self::Lights(variance_minimization(environment, n_lights, settings)?)
            }
        })
    }
}

/// A scene ready to be rendered.
pub(crate) struct Job<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) camera: &'a Camera,
    pub(crate) environment: &'a Environment,
    pub(crate) settings: &'a RenderSettings,
}

impl Job<'_> {
    /// Renders with the strategy that was planned.
    pub(crate) fn run(&self, prepared: &Prepared, progress: &RenderProgress) -> Result<Rendering> {
        let environment = self.environment;
        Ok(match prepared {
            &Prepared::Brdf { n } => {
                self.with(&BrdfSampling { environment, n_samples: n }, progress)
            }
            &Prepared::Environment { n } => {
                self.with(&EnvironmentSampling { environment, n_samples: n }, progress)
            }
            Prepared::Mis { split, heuristic, table } => {
                let &Split { environment: m, brdf: n } = split;
                let table = table.as_ref().map_or(LightTable::Full, LightTable::Compensated);
                let mis = MultipleImportanceSampling::new(environment, table, *heuristic, m, n)?;
                self.with(&mis, progress)
            }
            Prepared::Product(product) => self.with(&**product, progress),
            &Prepared::Rejection { proposal, stop } => {
                self.with(&RejectionSampling::new(environment, proposal, stop)?, progress)
            }
            &Prepared::Sir { n_candidates, n, candidates, resampling } => {
                let sir = SamplingImportanceResampling {
                    environment,
                    n_candidates,
                    n_samples: n,
                    candidates,
                    resampling,
                };
                self.with(&sir, progress)
            }
            Prepared::Lights(rig) => self.with(&LightSet { rig }, progress),
        })
    }

    fn with<S: Strategy>(&self, strategy: &S, progress: &RenderProgress) -> Rendering {
        render(self.scene, self.camera, self.environment, strategy, self.settings, progress)
    }
}
