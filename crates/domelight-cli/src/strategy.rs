//! From the flags to a strategy.

use anyhow::Result;
use domelight::environment::{CompensatedTable, Environment};
use domelight::render::{RenderSettings, Rendering, Session, render};
use domelight::rig::{MedianCut, Rig, VarianceMinimization, median_cut, variance_minimization};
use domelight::sampling::Heuristic;
use domelight::scene::{Camera, Scene};
use domelight::strategy::{
    BrdfSampling, Candidates, EnvironmentSampling, LightSet, LightTable,
    MultipleImportanceSampling, ProductSampling, Proposal, RAY_COST, RejectionSampling, Resampling,
    SamplingImportanceResampling, ShadingPoint, Stop, Strategy, optimal_candidates,
};

use crate::acceptance::{Acceptance, count_tries};
use crate::args::sampling::{
    HeuristicName, ProposalName, ResamplingName, SourceName, StrategyArguments, StrategyName,
};
use crate::course::Course;
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

impl StrategyArguments {
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

    /// What rejection would accept at those points; none of other strategies.
    ///
    /// # Errors
    /// If the plan has a stopping rule without an estimate.
    pub(crate) fn acceptance(
        self,
        points: impl FnOnce() -> Vec<ShadingPoint>,
        environment: &Environment,
        seed: u64,
    ) -> Result<Option<Acceptance>> {
        let Self::Rejection { proposal, stop } = self else { return Ok(None) };
        let rejection = RejectionSampling::new(environment, proposal, stop)?;
        Ok(Some(Acceptance::of(&count_tries(&rejection, &points(), seed))))
    }

    /// The points of a pixel are numbered by 32 bits; beyond that they would repeat.
    pub(crate) fn refuse_repeating_points(self, spp: u32) -> Result<()> {
        let n_points = match self {
            Self::Brdf { n }
            | Self::Environment { n }
            | Self::Product { n }
            | Self::Rejection { stop: Stop::Tries(n), .. } => n,
            Self::Mis { split, .. } => split.environment.max(split.brdf),
            Self::Sir { n_candidates, n, .. } => n_candidates.unwrap_or(n),
            // Independent numbers, and none at all.
            Self::Rejection { stop: Stop::Accepted { .. }, .. }
            | Self::MedianCut { .. }
            | Self::VarianceMinimization { .. } => 1,
        };
        if u64::from(spp) * u64::from(n_points) > 1 << 32 {
            return usage(format!(
                "{spp} camera samples of {n_points} directions are more points than a pixel has \
                 (2^32): lower --spp, or render several seeds and average them"
            ));
        }
        Ok(())
    }

    /// The expected value of the picture is the truth.
    pub(crate) fn is_unbiased(self) -> bool {
        !matches!(self, Self::MedianCut { .. } | Self::VarianceMinimization { .. })
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

/// A scene ready to be rendered.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) camera: &'a Camera,
    pub(crate) environment: &'a Environment,
    pub(crate) settings: &'a RenderSettings,
    pub(crate) progress: &'a RenderProgress,
    /// From the first sample to the last, unless it says otherwise.
    pub(crate) course: Option<&'a Course>,
}

impl Job<'_> {
    fn render<S: Strategy>(&self, strategy: &S) -> Result<Rendering> {
        let Self { scene, camera, environment, settings, progress, course } = *self;
        match course {
            Some(course) => {
                let session = Session::new(scene, camera, environment, strategy, settings);
                course.run(session, settings, progress)
            }
            None => Ok(render(scene, camera, environment, strategy, settings, progress)),
        }
    }
}

/// Renders jobs with a plan, whose tables and lights are made.
pub(crate) type Renderer<'e> = Box<dyn Fn(&Job) -> Result<Rendering> + 'e>;

impl Plan {
    /// Makes of the environment what serves all pictures.
    pub(crate) fn prepare(self, environment: &Environment) -> Result<Renderer<'_>> {
        Ok(match self {
            Self::Brdf { n } => {
                let brdf = BrdfSampling { environment, n_samples: n };
                Box::new(move |job| job.render(&brdf))
            }
            Self::Environment { n } => {
                let light = EnvironmentSampling { environment, n_samples: n };
                Box::new(move |job| job.render(&light))
            }
            Self::Mis { split: Split { environment: m, brdf: n }, heuristic, compensation } => {
                let table = compensation.then(|| CompensatedTable::new(environment));
                Box::new(move |job| {
                    let table = table.as_ref().map_or(LightTable::Full, LightTable::Compensated);
                    let mis = MultipleImportanceSampling::new(environment, table, heuristic, m, n)?;
                    job.render(&mis)
                })
            }
            Self::Product { n } => {
                let product = ProductSampling::new(environment, n);
                Box::new(move |job| job.render(&product))
            }
            Self::Rejection { proposal, stop } => {
                let rejection = RejectionSampling::new(environment, proposal, stop)?;
                Box::new(move |job| job.render(&rejection))
            }
            Self::Sir { n_candidates, n, candidates, resampling } => {
                let sir = SamplingImportanceResampling {
                    environment,
                    n_candidates: n_candidates.unwrap_or(n),
                    n_samples: n,
                    candidates,
                    resampling,
                };
                Box::new(move |job| job.render(&sir))
            }
            Self::MedianCut { n_lights } => {
                lights(median_cut(environment, n_lights, MedianCut::default())?)
            }
            Self::VarianceMinimization { n_lights } => {
                let settings = VarianceMinimization::default();
                lights(variance_minimization(environment, n_lights, settings)?)
            }
        })
    }
}

fn lights<'e>(rig: Rig) -> Renderer<'e> {
    Box::new(move |job| job.render(&LightSet { rig: &rig }))
}
