//! Strategies by name: a closed set with a text form, `NAME[:NUMBERS][:KEY=VALUE]…`.
//!
//! | text | strategy |
//! |---|---|
//! | `brdf:4`, `environment:4` | 4 samples of one density |
//! | `mis:3:1` | multiple importance sampling with 3 environment samples and 1 BRDF sample |
//! | `product:8` | product sampling with at most 8 shadow rays |
//! | `rejection:16`, `rejection:rays=4:tries=256` | 16 tries; until 4 of at most 256 tries are accepted |
//! | `sir:15/800`, `sir:15` | 15 of 800 candidates; a pilot chooses the number of candidates |
//! | `median-cut:64`, `variance-minimization:64` | 64 directional lights |
//!
//! Numbers are optional. Further keys are `heuristic=balance|power` and `no-compensation` of `mis`,
//! `proposal=environment|brdf|tighter` of `rejection`, and `from=environment|brdf|mixture` and
//! `resampling=multinomial|systematic|sorted|reservoir` of `sir`. [`StrategySpec`] displays as the shortest
//! such text, which parses to the same value.

use std::fmt;
use std::str::FromStr;

use super::{Candidates, Proposal, Resampling, StoppingRule};
use crate::sampling::Heuristic;

/// A strategy with its parameters, independent of scene and environment.
///
/// [`PreparedStrategy::new`](super::PreparedStrategy::new) prepares it for an environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum StrategySpec {
    /// BRDF sampling.
    Brdf {
        /// Shadow rays per camera sample, 1 to 65,536.
        n_samples: u32,
    },
    /// Environment sampling.
    Environment {
        /// Shadow rays per camera sample, 1 to 65,536.
        n_samples: u32,
    },
    /// Multiple importance sampling of environment and BRDF.
    Mis {
        /// Environment samples per camera sample, up to 65,536. The two counts must not both be zero.
        n_environment: u32,
        /// BRDF samples per camera sample, up to 65,536.
        n_brdf: u32,
        /// The heuristic for the MIS weights.
        heuristic: Heuristic,
        /// Whether radiance below the mean is left to the BRDF samples, which requires at least one.
        compensation: bool,
    },
    /// Product sampling with learned visibility.
    Product {
        /// The maximum number of shadow rays per camera sample, 1 to 65,536.
        n_rays: u32,
    },
    /// Rejection sampling of the product.
    Rejection {
        /// The factor of the product from which tries are drawn.
        proposal: Proposal,
        /// The rule that ends the tries at a point.
        stop: StoppingRule,
    },
    /// Sampling importance resampling of the product.
    Sir {
        /// Candidates per camera sample, 1 to 1,048,576; with `None`, a pilot chooses.
        n_candidates: Option<u32>,
        /// Shadow rays per camera sample, 1 to 65,536, at most the number of candidates.
        n_samples: u32,
        /// The density from which candidates are drawn.
        candidates: Candidates,
        /// How rays are picked from candidates.
        resampling: Resampling,
    },
    /// The directional lights of median cut; biased.
    MedianCut {
        /// The number of lights, 1 to 1,048,576.
        n_lights: u32,
    },
    /// The directional lights of variance minimization; biased.
    VarianceMinimization {
        /// The number of lights, 1 to 1,048,576.
        n_lights: u32,
    },
}

impl Default for StrategySpec {
    /// `product:8`.
    fn default() -> Self {
        Self::Product { n_rays: 8 }
    }
}

/// The strategies of [`StrategySpec`] without their parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrategyKind {
    /// See [`StrategySpec::Brdf`].
    Brdf,
    /// See [`StrategySpec::Environment`].
    Environment,
    /// See [`StrategySpec::Mis`].
    Mis,
    /// See [`StrategySpec::Product`].
    Product,
    /// See [`StrategySpec::Rejection`].
    Rejection,
    /// See [`StrategySpec::Sir`].
    Sir,
    /// See [`StrategySpec::MedianCut`].
    MedianCut,
    /// See [`StrategySpec::VarianceMinimization`].
    VarianceMinimization,
}

/// The maximum number of shadow rays per camera sample.
const MAX_RAYS: u32 = 1 << 16;

/// The maximum number of candidates, tries or lights.
const MAX_CANDIDATES: u32 = 1 << 20;

/// The values of one option by name; names of a value other than the first are aliases.
type Names<T> = &'static [(&'static str, T)];

const HEURISTICS: Names<Heuristic> =
    &[("balance", Heuristic::Balance), ("power", Heuristic::Power)];

const PROPOSALS: Names<Proposal> = &[
    ("environment", Proposal::Environment),
    ("brdf", Proposal::Brdf),
    ("tighter", Proposal::Tighter),
];

const SOURCES: Names<Candidates> = &[
    ("environment", Candidates::Environment),
    ("brdf", Candidates::Brdf),
    ("mixture", Candidates::Mixture),
];

const RESAMPLINGS: Names<Resampling> = &[
    ("multinomial", Resampling::Multinomial),
    ("systematic", Resampling::Systematic),
    ("sorted", Resampling::SystematicSorted),
    ("reservoir", Resampling::Reservoir),
];

/// The name of a value in its table.
fn name_of<T: PartialEq>(names: Names<T>, value: &T) -> &'static str {
    names.iter().find(|(_, v)| v == value).map_or("", |(name, _)| name)
}

impl StrategyKind {
    /// All strategies.
    pub const ALL: [Self; 8] = [
        Self::Brdf,
        Self::Environment,
        Self::Mis,
        Self::Product,
        Self::Rejection,
        Self::Sir,
        Self::MedianCut,
        Self::VarianceMinimization,
    ];

    /// The name in text form, such as `median-cut`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brdf => "brdf",
            Self::Environment => "environment",
            Self::Mis => "mis",
            Self::Product => "product",
            Self::Rejection => "rejection",
            Self::Sir => "sir",
            Self::MedianCut => "median-cut",
            Self::VarianceMinimization => "variance-minimization",
        }
    }

    /// A one-line description of the strategy.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Brdf => "samples the BRDF",
            Self::Environment => "samples the environment's radiance",
            Self::Mis => "samples both and weights them by multiple importance sampling",
            Self::Product => {
                "samples the product of both from a table for each pixel, with learned \
                 visibility; traces rays where they matter"
            }
            Self::Rejection => {
                "samples the product by rejection from one factor with a bound on the other"
            }
            Self::Sir => "samples the product by resampling candidates to rays",
            Self::MedianCut => "directional lights by median cut: noise-free, but biased",
            Self::VarianceMinimization => {
                "directional lights by variance minimization: noise-free, but biased"
            }
        }
    }

    /// Alternative names.
    pub fn aliases(self) -> &'static [&'static str] {
        match self {
            Self::Environment => &["env", "em"],
            Self::Brdf
            | Self::Mis
            | Self::Product
            | Self::Rejection
            | Self::Sir
            | Self::MedianCut
            | Self::VarianceMinimization => &[],
        }
    }
}

/// The options of a strategy; `None` stands for the default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StrategyOptions {
    /// Shadow rays per camera sample; for rejection, samples to accept.
    pub rays: Option<u32>,
    /// Environment and BRDF samples of `mis`.
    pub split: Option<[u32; 2]>,
    /// Directional lights of median cut and variance minimization.
    pub lights: Option<u32>,
    /// Candidates of `sir`.
    pub candidates: Option<u32>,
    /// The density from which `sir` draws candidates.
    pub from: Option<Candidates>,
    /// How `sir` picks rays from its candidates.
    pub resampling: Option<Resampling>,
    /// Tries of rejection.
    pub tries: Option<u32>,
    /// The density from which rejection draws its tries.
    pub proposal: Option<Proposal>,
    /// The heuristic for the weights of `mis`.
    pub heuristic: Option<Heuristic>,
    /// Whether `mis` samples the whole environment, without compensation.
    pub no_compensation: bool,
}

/// An invalid strategy text or set of options.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StrategyError {
    /// No strategy has that name.
    #[error("there is no strategy '{0}'; the strategies are {names}", names = StrategyNames)]
    UnknownName(String),
    /// No option has that name.
    #[error("there is no option '{0}' of strategies")]
    UnknownOption(String),
    /// An invalid value of an option.
    #[error("{option} is '{value}'; it must be {expected}")]
    BadValue {
        /// The option.
        option: &'static str,
        /// The value given.
        value: String,
        /// What it must be.
        expected: String,
    },
    /// Two numbers for a strategy that takes one.
    #[error("only mis:M:N and sir:N/M take two numbers")]
    TwoNumbers,
    /// An option of another strategy.
    #[error("{option} applies only to {strategies}")]
    Misplaced {
        /// The option.
        option: &'static str,
        /// The strategies that accept it.
        strategies: &'static str,
    },
    /// Contradictory numbers.
    #[error("{0}")]
    Contradiction(&'static str),
}

/// Displays as the names of all strategies.
struct StrategyNames;

impl fmt::Display for StrategyNames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&StrategyKind::ALL.map(StrategyKind::name).join(", "))
    }
}

impl FromStr for StrategyKind {
    type Err = StrategyError;

    fn from_str(text: &str) -> Result<Self, StrategyError> {
        let is = |kind: &Self| kind.name() == text || kind.aliases().contains(&text);
        Self::ALL.into_iter().find(is).ok_or_else(|| StrategyError::UnknownName(text.to_owned()))
    }
}

impl StrategyOptions {
    /// The names of all options.
    pub const NAMES: [&str; 10] = [
        "rays",
        "split",
        "lights",
        "candidates",
        "from",
        "resampling",
        "tries",
        "proposal",
        "heuristic",
        "no-compensation",
    ];

    /// Splits `NAME[:OPTION]…` into the strategy and its options.
    ///
    /// # Errors
    /// If the name or an option is unknown or a value is out of range.
    pub fn parse(text: &str) -> Result<(StrategyKind, Self), StrategyError> {
        let mut parts = text.trim().split(':').map(str::trim).peekable();
        let kind: StrategyKind = parts.next().unwrap_or_default().parse()?;
        let mut options = Self::default();
        if let Some(first) = parts.next_if(|part| is_number(part)) {
            let second = parts.next_if(|part| is_number(part));
            options.set_numbers(kind, first, second)?;
        }
        for part in parts {
            match part.split_once('=') {
                Some((key, value)) => options.set(key.trim(), value.trim())?,
                None if part == "no-compensation" => options.no_compensation = true,
                None => return Err(StrategyError::UnknownOption(part.to_owned())),
            }
        }
        Ok((kind, options))
    }

    /// Sets the options given by the numbers after a strategy's name.
    fn set_numbers(
        &mut self,
        kind: StrategyKind,
        first: &str,
        second: Option<&str>,
    ) -> Result<(), StrategyError> {
        use StrategyKind as K;
        let two = first.split_once('/').or(second.map(|second| (first, second)));
        if first.contains('/') && second.is_some() {
            return Err(StrategyError::TwoNumbers);
        }
        match (kind, two) {
            (K::Mis, Some((m, n))) => self.split = Some(split(m, n)?),
            (K::Sir, Some((n, m))) => {
                self.rays = Some(number("rays", n, MAX_RAYS)?);
                self.candidates = Some(number("candidates", m, MAX_CANDIDATES)?);
            }
            (
                K::Brdf
                | K::Environment
                | K::Product
                | K::Rejection
                | K::MedianCut
                | K::VarianceMinimization,
                Some(_),
            ) => return Err(StrategyError::TwoNumbers),
            (K::Rejection, None) => self.tries = Some(number("tries", first, MAX_CANDIDATES)?),
            (K::MedianCut | K::VarianceMinimization, None) => {
                self.lights = Some(number("lights", first, MAX_CANDIDATES)?);
            }
            (K::Brdf | K::Environment | K::Mis | K::Product | K::Sir, None) => {
                self.rays = Some(number("rays", first, MAX_RAYS)?);
            }
        }
        Ok(())
    }

    /// Sets one option by its name.
    fn set(&mut self, key: &str, value: &str) -> Result<(), StrategyError> {
        match key {
            "rays" => self.rays = Some(number("rays", value, MAX_RAYS)?),
            "split" => {
                let (m, n) = value.split_once('/').unwrap_or((value, ""));
                self.split = Some(split(m, n)?);
            }
            "lights" => self.lights = Some(number("lights", value, MAX_CANDIDATES)?),
            "candidates" => self.candidates = Some(number("candidates", value, MAX_CANDIDATES)?),
            "tries" => self.tries = Some(number("tries", value, MAX_CANDIDATES)?),
            "from" => self.from = Some(named("from", SOURCES, value)?),
            "resampling" => self.resampling = Some(named("resampling", RESAMPLINGS, value)?),
            "proposal" => self.proposal = Some(named("proposal", PROPOSALS, value)?),
            "heuristic" => self.heuristic = Some(named("heuristic", HEURISTICS, value)?),
            _ => return Err(StrategyError::UnknownOption(key.to_owned())),
        }
        Ok(())
    }

    /// Fills missing options from `other`. Rays and split replace each other, because one follows from the other.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            rays: self.rays.or(other.rays.filter(|_| self.split.is_none())),
            split: self.split.or(other.split.filter(|_| self.rays.is_none())),
            lights: self.lights.or(other.lights),
            candidates: self.candidates.or(other.candidates),
            from: self.from.or(other.from),
            resampling: self.resampling.or(other.resampling),
            tries: self.tries.or(other.tries),
            proposal: self.proposal.or(other.proposal),
            heuristic: self.heuristic.or(other.heuristic),
            no_compensation: self.no_compensation || other.no_compensation,
        }
    }

    /// Rejects options of other strategies.
    fn check(&self, kind: StrategyKind) -> Result<(), StrategyError> {
        use StrategyKind as K;
        let is_rig = matches!(kind, K::MedianCut | K::VarianceMinimization);
        let misplaced = [
            ("heuristic", self.heuristic.is_some(), kind == K::Mis, "mis"),
            ("split", self.split.is_some(), kind == K::Mis, "mis"),
            ("no-compensation", self.no_compensation, kind == K::Mis, "mis"),
            ("candidates", self.candidates.is_some(), kind == K::Sir, "sir"),
            ("from", self.from.is_some(), kind == K::Sir, "sir"),
            ("resampling", self.resampling.is_some(), kind == K::Sir, "sir"),
            ("tries", self.tries.is_some(), kind == K::Rejection, "rejection"),
            ("proposal", self.proposal.is_some(), kind == K::Rejection, "rejection"),
            ("lights", self.lights.is_some(), is_rig, "median-cut and variance-minimization"),
            ("rays", self.rays.is_some(), !is_rig, "strategies without lights"),
        ];
        match misplaced.into_iter().find(|&(_, is_given, applies, _)| is_given && !applies) {
            Some((option, _, _, strategies)) => {
                Err(StrategyError::Misplaced { option, strategies })
            }
            None => Ok(()),
        }
    }
}

fn is_number(part: &str) -> bool {
    part.starts_with(|c: char| c.is_ascii_digit()) && !part.contains('=')
}

/// A count from 1 to `most`.
fn number(option: &'static str, text: &str, most: u32) -> Result<u32, StrategyError> {
    text.parse().ok().filter(|n| (1..=most).contains(n)).ok_or_else(|| StrategyError::BadValue {
        option,
        value: text.to_owned(),
        expected: format!("a whole number from 1 to {most}"),
    })
}

/// Environment and BRDF samples.
fn split(m: &str, n: &str) -> Result<[u32; 2], StrategyError> {
    let count = |text: &str| text.parse().ok().filter(|n| *n <= MAX_RAYS);
    let counts = count(m).zip(count(n)).map(|(m, n)| [m, n]).filter(|counts| *counts != [0, 0]);
    counts.ok_or_else(|| StrategyError::BadValue {
        option: "split",
        value: format!("{m}:{n}"),
        expected: format!(
            "environment and BRDF samples such as 3:1, not both zero, up to {MAX_RAYS}"
        ),
    })
}

fn named<T: Copy>(option: &'static str, names: Names<T>, text: &str) -> Result<T, StrategyError> {
    names.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
        let list: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
        StrategyError::BadValue {
            option,
            value: text.to_owned(),
            expected: format!("one of {}", list.join(", ")),
        }
    })
}

impl StrategySpec {
    /// Whether all directions are drawn from the BSDF. Light that it finds rarely is then missing from the samples as well as
    /// from their variance.
    pub fn draws_from_the_bsdf_alone(&self) -> bool {
        match self {
            Self::Brdf { .. } | Self::Mis { n_environment: 0, .. } => true,
            Self::Rejection { proposal, .. } => *proposal == Proposal::Brdf,
            Self::Sir { candidates, .. } => *candidates == Candidates::Brdf,
            _ => false,
        }
    }

    /// Creates the strategy with these options. The defaults are 1 ray, 1:1 for `mis`, 8 rays for `product`, 16 tries
    /// and 64 lights.
    ///
    /// # Errors
    /// If an option belongs to another strategy, or options contradict each other.
    pub fn new(kind: StrategyKind, options: &StrategyOptions) -> Result<Self, StrategyError> {
        use StrategyKind as K;
        options.check(kind)?;
        let rays = options.rays.unwrap_or(1);
        let n_lights = options.lights.unwrap_or(64);
        Ok(match kind {
            K::Brdf => Self::Brdf { n_samples: rays },
            K::Environment => Self::Environment { n_samples: rays },
            K::Mis => Self::mis(options)?,
            K::Product => Self::Product { n_rays: options.rays.unwrap_or(8) },
            K::Rejection => Self::rejection(options)?,
            K::Sir => Self::sir(rays, options)?,
            K::MedianCut => Self::MedianCut { n_lights },
            K::VarianceMinimization => Self::VarianceMinimization { n_lights },
        })
    }

    fn mis(options: &StrategyOptions) -> Result<Self, StrategyError> {
        let [n_environment, n_brdf] = match (options.split, options.rays) {
            (Some(_), Some(_)) => {
                return Err(StrategyError::Contradiction("give split or rays, not both"));
            }
            (Some(split), None) => split,
            (None, Some(1)) => {
                return Err(StrategyError::Contradiction(
                    "mis takes at least one sample of each kind: use 2 rays or more, or split 1:0 or 0:1 \
                     for one kind only",
                ));
            }
            (None, rays) => {
                let n = rays.unwrap_or(2);
                [n.div_ceil(2), n / 2]
            }
        };
        Ok(Self::Mis {
            n_environment,
            n_brdf,
            heuristic: options.heuristic.unwrap_or(Heuristic::Power),
            // Without BRDF samples, the dim light would be lost.
            compensation: !options.no_compensation && n_brdf > 0,
        })
    }

    fn rejection(options: &StrategyOptions) -> Result<Self, StrategyError> {
        let stop = match (options.rays, options.tries) {
            (None, tries) => StoppingRule::Tries(tries.unwrap_or(16)),
            (Some(1), _) => {
                return Err(StrategyError::Contradiction(
                    "rejection estimates from at least two accepted samples: use 2 rays or more, or tries for \
                     a fixed number of tries",
                ));
            }
            (Some(n), tries) => StoppingRule::Accepted { n, max_tries: tries.unwrap_or(64 * n) },
        };
        Ok(Self::Rejection { proposal: options.proposal.unwrap_or_default(), stop })
    }

    fn sir(n_samples: u32, options: &StrategyOptions) -> Result<Self, StrategyError> {
        if options.candidates.is_some_and(|m| m < n_samples) {
            return Err(StrategyError::Contradiction("candidates must not be fewer than rays"));
        }
        Ok(Self::Sir {
            n_candidates: options.candidates,
            n_samples,
            candidates: options.from.unwrap_or_default(),
            resampling: options.resampling.unwrap_or_default(),
        })
    }

    /// The strategy without its parameters.
    pub fn kind(self) -> StrategyKind {
        match self {
            Self::Brdf { .. } => StrategyKind::Brdf,
            Self::Environment { .. } => StrategyKind::Environment,
            Self::Mis { .. } => StrategyKind::Mis,
            Self::Product { .. } => StrategyKind::Product,
            Self::Rejection { .. } => StrategyKind::Rejection,
            Self::Sir { .. } => StrategyKind::Sir,
            Self::MedianCut { .. } => StrategyKind::MedianCut,
            Self::VarianceMinimization { .. } => StrategyKind::VarianceMinimization,
        }
    }

    /// Whether the expected value of the picture is the integral.
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Self::MedianCut { .. } | Self::VarianceMinimization { .. })
    }

    /// The maximum number of points that one camera sample takes from the pixel's sequence of 2³² points.
    pub fn points_per_sample(self) -> u32 {
        match self {
            Self::Brdf { n_samples } | Self::Environment { n_samples } => n_samples,
            Self::Product { n_rays } => n_rays,
            Self::Rejection { stop: StoppingRule::Tries(n), .. } => n,
            Self::Mis { n_environment, n_brdf, .. } => n_environment.max(n_brdf),
            Self::Sir { n_candidates, n_samples, .. } => n_candidates.unwrap_or(n_samples),
            // These use independent random numbers, or none.
            Self::Rejection { stop: StoppingRule::Accepted { .. }, .. }
            | Self::MedianCut { .. }
            | Self::VarianceMinimization { .. } => 1,
        }
    }

    /// A description for reports.
    pub fn description(self) -> String {
        match self {
            Self::Brdf { n_samples } => format!("brdf, {n_samples} per camera sample"),
            Self::Environment { n_samples } => {
                format!("environment, {n_samples} per camera sample")
            }
            Self::Mis { n_environment, n_brdf, heuristic, compensation } => format!(
                "mis {n_environment}:{n_brdf}, {} heuristic{}",
                name_of(HEURISTICS, &heuristic),
                if compensation { ", compensated" } else { "" }
            ),
            Self::Product { n_rays } => format!("product, up to {n_rays} per camera sample"),
            Self::Rejection { proposal, stop } => {
                let from = match proposal {
                    Proposal::Environment => "the environment",
                    Proposal::Brdf => "the BRDF",
                    Proposal::Tighter => "the tighter envelope",
                };
                match stop {
                    StoppingRule::Tries(m) => format!("rejection from {from}, {m} tries"),
                    StoppingRule::Accepted { n, max_tries } => format!(
                        "rejection from {from}, until {n} are accepted or {max_tries} tried"
                    ),
                }
            }
            Self::Sir { n_candidates, n_samples, candidates, resampling } => {
                let m = n_candidates.unwrap_or(n_samples);
                let from = match candidates {
                    Candidates::Environment => "environment candidates",
                    Candidates::Brdf => "BRDF candidates",
                    Candidates::Mixture => "mixture candidates",
                };
                let how = match resampling {
                    Resampling::Multinomial => "multinomial resampling",
                    Resampling::Systematic => "systematic resampling",
                    Resampling::SystematicSorted => "sorted systematic resampling",
                    Resampling::Reservoir => "reservoir resampling",
                };
                format!("sir {n_samples}/{m}, {from}, {how}")
            }
            Self::MedianCut { n_lights } => format!("median cut, {n_lights} lights"),
            Self::VarianceMinimization { n_lights } => {
                format!("variance minimization, {n_lights} lights")
            }
        }
    }
}

impl FromStr for StrategySpec {
    type Err = StrategyError;

    fn from_str(text: &str) -> Result<Self, StrategyError> {
        let (kind, options) = StrategyOptions::parse(text)?;
        Self::new(kind, &options)
    }
}

/// The shortest text that parses to the same value.
impl fmt::Display for StrategySpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind().name())?;
        match *self {
            Self::Brdf { n_samples } | Self::Environment { n_samples } => write!(f, ":{n_samples}"),
            Self::Product { n_rays } => write!(f, ":{n_rays}"),
            Self::MedianCut { n_lights } | Self::VarianceMinimization { n_lights } => {
                write!(f, ":{n_lights}")
            }
            Self::Mis { n_environment, n_brdf, heuristic, compensation } => {
                write!(f, ":{n_environment}:{n_brdf}")?;
                if heuristic != Heuristic::Power {
                    write!(f, ":heuristic={}", name_of(HEURISTICS, &heuristic))?;
                }
                f.write_str(if compensation || n_brdf == 0 { "" } else { ":no-compensation" })
            }
            Self::Rejection { proposal, stop } => {
                match stop {
                    StoppingRule::Tries(m) => write!(f, ":{m}")?,
                    StoppingRule::Accepted { n, max_tries } => {
                        write!(f, ":rays={n}:tries={max_tries}")?;
                    }
                }
                if proposal == Proposal::default() {
                    return Ok(());
                }
                write!(f, ":proposal={}", name_of(PROPOSALS, &proposal))
            }
            Self::Sir { n_candidates, n_samples, candidates, resampling } => {
                match n_candidates {
                    Some(m) => write!(f, ":{n_samples}/{m}")?,
                    None => write!(f, ":{n_samples}")?,
                }
                if candidates != Candidates::default() {
                    write!(f, ":from={}", name_of(SOURCES, &candidates))?;
                }
                if resampling != Resampling::default() {
                    write!(f, ":resampling={}", name_of(RESAMPLINGS, &resampling))?;
                }
                Ok(())
            }
        }
    }
}

#[cfg(feature = "io")]
impl serde::Serialize for StrategySpec {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

#[cfg(feature = "io")]
impl<'de> serde::Deserialize<'de> for StrategySpec {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::Pcg;

    fn displayed(text: &str) -> String {
        text.parse::<StrategySpec>().expect(text).to_string()
    }

    #[test]
    fn numbers_and_options_mean_the_same() {
        for (text, canonical) in [
            ("brdf:4", "brdf:4"),
            ("env", "environment:1"),
            ("mis", "mis:1:1"),
            ("mis:3", "mis:2:1"),
            ("mis:3/1:heuristic=balance", "mis:3:1:heuristic=balance"),
            ("mis:split=3/1:heuristic=balance", "mis:3:1:heuristic=balance"),
            ("mis:1:1:no-compensation", "mis:1:1:no-compensation"),
            ("mis:1:0", "mis:1:0"),
            ("product", "product:8"),
            ("sir:rays=15:candidates=800", "sir:15/800"),
            ("sir:15:800", "sir:15/800"),
            ("sir:from=brdf:resampling=sorted", "sir:1:from=brdf"),
            ("rejection:proposal=environment", "rejection:16:proposal=environment"),
            ("rejection:rays=4", "rejection:rays=4:tries=256"),
            ("median-cut:64", "median-cut:64"),
        ] {
            assert_eq!(displayed(text), canonical, "{text}");
        }
    }

    /// A random member of the set of valid strategies.
    fn random(pcg: &mut Pcg) -> StrategySpec {
        fn pick<T: Copy>(pcg: &mut Pcg, names: Names<T>) -> T {
            names[(pcg.next_f64() * names.len() as f64) as usize].1
        }
        let mut count = |most: u32| 1 + (pcg.next_f64().powi(4) * f64::from(most - 1)) as u32;
        let (n, m, tries) = (count(MAX_RAYS), count(MAX_CANDIDATES), count(MAX_CANDIDATES));
        let kind = StrategyKind::ALL[(pcg.next_f64() * 8.0) as usize];
        let coin = pcg.next_f64() < 0.5;
        match kind {
            StrategyKind::Brdf => StrategySpec::Brdf { n_samples: n },
            StrategyKind::Environment => StrategySpec::Environment { n_samples: n },
            StrategyKind::Mis => StrategySpec::Mis {
                n_environment: n - 1,
                n_brdf: n,
                heuristic: pick(pcg, HEURISTICS),
                compensation: coin,
            },
            StrategyKind::Product => StrategySpec::Product { n_rays: n },
            StrategyKind::Rejection => StrategySpec::Rejection {
                proposal: pick(pcg, PROPOSALS),
                stop: if coin {
                    StoppingRule::Tries(tries)
                } else {
                    StoppingRule::Accepted { n: n.max(2), max_tries: tries }
                },
            },
            StrategyKind::Sir => StrategySpec::Sir {
                n_candidates: coin.then_some(m.max(n)),
                n_samples: n,
                candidates: pick(pcg, SOURCES),
                resampling: pick(pcg, RESAMPLINGS),
            },
            StrategyKind::MedianCut => StrategySpec::MedianCut { n_lights: m },
            StrategyKind::VarianceMinimization => {
                StrategySpec::VarianceMinimization { n_lights: m }
            }
        }
    }

    #[test]
    fn text_and_value_are_a_bijection() {
        let mut pcg = Pcg::new(7);
        for _ in 0..20_000 {
            let spec = random(&mut pcg);
            let text = spec.to_string();
            assert_eq!(text.parse(), Ok(spec), "{text}");
        }
    }

    #[test]
    fn errors_say_what_is_wrong() {
        for (text, words) in [
            ("velvet", "velvet"),
            ("", "the strategies are brdf"),
            ("brdf:0", "from 1 to 65536"),
            ("brdf:3/4", "two numbers"),
            ("brdf:3:4", "two numbers"),
            ("brdf:lights=4", "lights applies only to"),
            ("median-cut:rays=4", "rays applies only to"),
            ("sir:9/8", "candidates must not"),
            ("sir:9/8/7", "candidates is '8/7'"),
            ("mis:0:0", "not both zero"),
            ("mis:color=red", "'color'"),
            ("mis:strategy=brdf", "'strategy'"),
            ("mis:heuristic=best", "one of balance, power"),
            ("mis:1", "at least one sample of each"),
            ("rejection:rays=1", "at least two"),
        ] {
            let error = text.parse::<StrategySpec>().expect_err(text).to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn descriptions_are_for_readers() {
        let described = |text: &str| text.parse::<StrategySpec>().unwrap().description();
        assert_eq!(
            described("mis:3/1:heuristic=balance"),
            "mis 3:1, balance heuristic, compensated"
        );
        assert_eq!(
            described("sir:15/800"),
            "sir 15/800, mixture candidates, sorted systematic resampling"
        );
        assert_eq!(described("rejection"), "rejection from the tighter envelope, 16 tries");
    }
}
