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
//! | `variance-minimization:64:rule=2009` | the lights of the poster's rule |
//!
//! Numbers are optional. Each strategy [declares](StrategyDeclaration) its name and its parameters. [`StrategySpec`]
//! displays as the shortest such text, which parses to the same value.

use std::fmt;
use std::str::FromStr;

use super::{Candidates, Proposal, Resampling, StoppingRule};
use crate::rig::Rule;
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
        /// Samples of points on portals per camera sample, up to 65,536, in scenes that have any.
        n_portal: u32,
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
        /// The rule of the cuts. With the poster's, regions are also cut level by level and stay rectangles.
        rule: Rule,
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

/// The names of an enum's values, the default first.
struct Names<T: 'static> {
    names: &'static [&'static str],
    values: &'static [T],
}

impl<T: Copy + PartialEq> Names<T> {
    fn name(&self, value: T) -> &'static str {
        let found = self.values.iter().position(|&v| v == value);
        found.map_or("", |i| self.names[i])
    }

    fn value(&self, name: &str) -> Option<T> {
        self.names.iter().position(|&n| n == name).map(|i| self.values[i])
    }
}

const HEURISTICS: Names<Heuristic> =
    Names { names: &["power", "balance"], values: &[Heuristic::Power, Heuristic::Balance] };

const PROPOSALS: Names<Proposal> = Names {
    names: &["tighter", "environment", "brdf"],
    values: &[Proposal::Tighter, Proposal::Environment, Proposal::Brdf],
};

const SOURCES: Names<Candidates> = Names {
    names: &["mixture", "environment", "brdf"],
    values: &[Candidates::Mixture, Candidates::Environment, Candidates::Brdf],
};

const RESAMPLINGS: Names<Resampling> = Names {
    names: &["sorted", "systematic", "multinomial", "reservoir"],
    values: &[
        Resampling::SystematicSorted,
        Resampling::Systematic,
        Resampling::Multinomial,
        Resampling::Reservoir,
    ],
};

const RULES: Names<Rule> =
    Names { names: &["sphere", "2009"], values: &[Rule::Spherical, Rule::Poster] };

/// What a strategy is called and takes. Its text form, its help and the manual's table are made from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StrategyDeclaration {
    /// The name in text form, such as `median-cut`.
    pub name: &'static str,
    /// Alternative names.
    pub aliases: &'static [&'static str],
    /// A one-line description.
    pub summary: &'static str,
    /// The parameters, `NAME=VALUE` in text form.
    pub parameters: &'static [StrategyParameter],
    /// The parameters that one number after the name sets, and two.
    numbers: [&'static [&'static str]; 2],
}

/// A parameter of a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StrategyParameter {
    /// The name in text form, such as `rays`.
    pub name: &'static str,
    /// What it may be.
    pub values: ParameterValues,
    /// The default in text form, or in words; empty if the parameter is usually left out.
    pub default: &'static str,
    /// What it is, in a few words.
    pub help: &'static str,
}

/// The values of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterValues {
    /// A whole number from 1 to this one.
    Count(u32),
    /// Numbers of environment and BRDF samples, M/N, up to this one and not both zero.
    Split(u32),
    /// One of these names.
    Names(&'static [&'static str]),
    /// None; the parameter is its name alone.
    Flag,
}

impl StrategyParameter {
    /// A number of shadow rays.
    const fn rays(default: &'static str, help: &'static str) -> Self {
        Self { name: "rays", values: ParameterValues::Count(MAX_RAYS), default, help }
    }

    /// A number of candidates, tries or lights.
    const fn count(name: &'static str, default: &'static str, help: &'static str) -> Self {
        Self { name, values: ParameterValues::Count(MAX_CANDIDATES), default, help }
    }

    /// One of several values, by default the first.
    const fn named<T>(name: &'static str, names: &Names<T>, help: &'static str) -> Self {
        Self { name, values: ParameterValues::Names(names.names), default: names.names[0], help }
    }

    /// How it is written, such as `rays=N` or `heuristic=power|balance`.
    pub fn notation(&self) -> String {
        let name = self.name;
        match self.values {
            ParameterValues::Count(_) => format!("{name}=N"),
            ParameterValues::Split(_) => format!("{name}=M/N"),
            ParameterValues::Names(names) => format!("{name}={}", names.join("|")),
            ParameterValues::Flag => name.to_owned(),
        }
    }

    /// Rejects a text that is none of its values.
    fn check(&self, text: &str) -> Result<(), StrategyError> {
        let is_valid = match self.values {
            ParameterValues::Count(most) => {
                text.parse().is_ok_and(|n: u32| (1..=most).contains(&n))
            }
            ParameterValues::Split(most) => {
                split(text).is_some_and(|[m, n]| m <= most && n <= most && m | n != 0)
            }
            ParameterValues::Names(names) => names.contains(&text),
            ParameterValues::Flag => text.is_empty(),
        };
        let (option, value) = (self.name, text.to_owned());
        let error = || StrategyError::BadValue { option, value, expected: self.values.to_string() };
        is_valid.then_some(()).ok_or_else(error)
    }
}

/// Says what a value must be.
impl fmt::Display for ParameterValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(most) => write!(f, "a whole number from 1 to {most}"),
            Self::Split(most) => {
                write!(f, "environment and BRDF samples such as 3/1, not both zero, up to {most}")
            }
            Self::Names(names) => write!(f, "one of {}", names.join(", ")),
            Self::Flag => f.write_str("the name alone"),
        }
    }
}

const BRDF: StrategyDeclaration = StrategyDeclaration {
    name: "brdf",
    aliases: &[],
    summary: "samples the BRDF",
    parameters: &[StrategyParameter::rays("1", "shadow rays per camera sample")],
    numbers: [&["rays"], &[]],
};

const ENVIRONMENT: StrategyDeclaration = StrategyDeclaration {
    name: "environment",
    aliases: &["env", "em"],
    summary: "samples the environment's radiance",
    parameters: &[StrategyParameter::rays("1", "shadow rays per camera sample")],
    numbers: [&["rays"], &[]],
};

const MIS: StrategyDeclaration = StrategyDeclaration {
    name: "mis",
    aliases: &[],
    summary: "samples both and weights them by multiple importance sampling",
    parameters: &[
        StrategyParameter::rays("2", "shadow rays per camera sample, half of them of each kind"),
        StrategyParameter {
            name: "split",
            values: ParameterValues::Split(MAX_RAYS),
            default: "",
            help: "environment and BRDF samples, in place of rays",
        },
        StrategyParameter::named("heuristic", &HEURISTICS, "how samples are weighted"),
        StrategyParameter {
            name: "portals",
            values: ParameterValues::Count(MAX_RAYS),
            default: "",
            help: "samples of points on portals beside the others, in scenes that have any",
        },
        StrategyParameter {
            name: "no-compensation",
            values: ParameterValues::Flag,
            default: "",
            help: "samples the whole environment; otherwise, radiance below the mean is left to BRDF samples \
                   (Karlík et al. 2019)",
        },
    ],
    numbers: [&["rays"], &["split"]],
};

const PRODUCT: StrategyDeclaration = StrategyDeclaration {
    name: "product",
    aliases: &[],
    summary: "samples the product of both from a table for each pixel, with learned visibility; traces rays \
              where they matter",
    parameters: &[StrategyParameter::rays("8", "the most shadow rays per camera sample")],
    numbers: [&["rays"], &[]],
};

const REJECTION: StrategyDeclaration = StrategyDeclaration {
    name: "rejection",
    aliases: &[],
    summary: "samples the product by rejection from one factor with a bound on the other",
    parameters: &[
        StrategyParameter::count(
            "tries",
            "16",
            "tries per camera sample; with rays the most, 64 times the rays if not given",
        ),
        StrategyParameter::rays("", "samples to accept per camera sample, at least 2"),
        StrategyParameter::named("proposal", &PROPOSALS, "the factor that tries are drawn from"),
    ],
    numbers: [&["tries"], &[]],
};

const SIR: StrategyDeclaration = StrategyDeclaration {
    name: "sir",
    aliases: &[],
    summary: "samples the product by resampling candidates to rays",
    parameters: &[
        StrategyParameter::rays("1", "shadow rays per camera sample"),
        StrategyParameter::count(
            "candidates",
            "chosen by a pilot for the least error per time",
            "candidates per camera sample, at least as many as rays",
        ),
        StrategyParameter::named("from", &SOURCES, "the density that candidates are drawn from"),
        StrategyParameter::named("resampling", &RESAMPLINGS, "how rays are picked"),
    ],
    numbers: [&["rays"], &["rays", "candidates"]],
};

const MEDIAN_CUT: StrategyDeclaration = StrategyDeclaration {
    name: "median-cut",
    aliases: &[],
    summary: "directional lights by median cut: noise-free, but biased",
    parameters: &[StrategyParameter::count("lights", "64", "lights in place of the environment")],
    numbers: [&["lights"], &[]],
};

const VARIANCE_MINIMIZATION: StrategyDeclaration = StrategyDeclaration {
    name: "variance-minimization",
    aliases: &[],
    summary: "directional lights by variance minimization: noise-free, but biased",
    parameters: &[
        StrategyParameter::count("lights", "64", "lights in place of the environment"),
        StrategyParameter::named(
            "rule",
            &RULES,
            "how the map is divided: on the sphere, or as by Viriyothai & Debevec 2009",
        ),
    ],
    numbers: [&["lights"], &[]],
};

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

    /// What the strategy is called and takes.
    pub fn declaration(self) -> &'static StrategyDeclaration {
        match self {
            Self::Brdf => &BRDF,
            Self::Environment => &ENVIRONMENT,
            Self::Mis => &MIS,
            Self::Product => &PRODUCT,
            Self::Rejection => &REJECTION,
            Self::Sir => &SIR,
            Self::MedianCut => &MEDIAN_CUT,
            Self::VarianceMinimization => &VARIANCE_MINIMIZATION,
        }
    }

    /// The name in text form, such as `median-cut`.
    pub fn name(self) -> &'static str {
        self.declaration().name
    }

    /// A one-line description of the strategy.
    pub fn summary(self) -> &'static str {
        self.declaration().summary
    }

    /// Alternative names.
    pub fn aliases(self) -> &'static [&'static str] {
        self.declaration().aliases
    }

    /// The strategies with a parameter of that name, in a list.
    fn with(parameter: &str) -> String {
        let has = |kind: &Self| kind.declaration().parameters.iter().any(|p| p.name == parameter);
        Self::ALL.into_iter().filter(has).map(Self::name).collect::<Vec<_>>().join(", ")
    }
}

/// An invalid strategy text.
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
        option: String,
        /// The strategies that accept it.
        strategies: String,
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

/// The parameters that a text gives.
struct Given {
    kind: StrategyKind,
    values: Vec<(&'static str, String)>,
}

impl Given {
    /// Splits `NAME[:PARAMETER]…` into the strategy and its parameters.
    fn parse(text: &str) -> Result<Self, StrategyError> {
        let mut parts = text.trim().split(':').map(str::trim).peekable();
        let kind = parts.next().unwrap_or_default().parse()?;
        let mut given = Self { kind, values: Vec::new() };
        if let Some(first) = parts.next_if(|part| is_number(part)) {
            given.set_numbers(first, parts.next_if(|part| is_number(part)))?;
        }
        for part in parts {
            match part.split_once('=') {
                Some((name, value)) => given.set(name.trim(), value.trim())?,
                None => given.set(part, "")?,
            }
        }
        Ok(given)
    }

    /// Sets the parameters given by the numbers after a strategy's name.
    fn set_numbers(&mut self, first: &str, second: Option<&str>) -> Result<(), StrategyError> {
        let [one, two] = self.kind.declaration().numbers;
        let (first, second) = match (first.split_once('/'), second) {
            (None, None) => return one.iter().try_for_each(|name| self.set(name, first)),
            (Some(pair), None) => pair,
            (None, Some(second)) => (first, second),
            (Some(_), Some(_)) => return Err(StrategyError::TwoNumbers),
        };
        match two {
            [] => Err(StrategyError::TwoNumbers),
            [both] => self.set(both, &format!("{first}/{second}")),
            names => names.iter().zip([first, second]).try_for_each(|(name, n)| self.set(name, n)),
        }
    }

    /// Sets one parameter by its name.
    fn set(&mut self, name: &str, value: &str) -> Result<(), StrategyError> {
        let parameters = self.kind.declaration().parameters;
        let Some(parameter) = parameters.iter().find(|parameter| parameter.name == name) else {
            let (option, strategies) = (name.to_owned(), StrategyKind::with(name));
            return Err(match &strategies[..] {
                "" => StrategyError::UnknownOption(option),
                _ => StrategyError::Misplaced { option, strategies },
            });
        };
        parameter.check(value)?;
        self.values.push((parameter.name, value.to_owned()));
        Ok(())
    }

    /// The text of a parameter, if it is given.
    fn get(&self, name: &str) -> Option<&str> {
        let last = self.values.iter().rev().find(|(given, _)| *given == name);
        last.map(|(_, value)| &value[..])
    }

    /// A number that is given.
    fn number(&self, name: &str) -> Option<u32> {
        self.get(name)?.parse().ok()
    }

    /// A number, or its default.
    fn number_or_default(&self, name: &str) -> u32 {
        let parameters = self.kind.declaration().parameters.iter();
        let default = parameters.filter(|p| p.name == name).find_map(|p| p.default.parse().ok());
        self.number(name).or(default).expect("the declaration has a default")
    }

    /// One of several values, or the default.
    fn named<T: Copy + PartialEq>(&self, name: &str, names: &Names<T>) -> T {
        let given = self.get(name).and_then(|value| names.value(value));
        given.unwrap_or(names.values[0])
    }
}

fn is_number(part: &str) -> bool {
    part.starts_with(|c: char| c.is_ascii_digit()) && !part.contains('=')
}

/// Environment and BRDF samples.
fn split(text: &str) -> Option<[u32; 2]> {
    let (m, n) = text.split_once('/')?;
    Some([m.parse().ok()?, n.parse().ok()?])
}

impl StrategySpec {
    /// Whether all directions are drawn from the BSDF. Light that it finds rarely is then missing from the samples as well as
    /// from their variance.
    pub fn draws_from_the_bsdf_alone(&self) -> bool {
        match self {
            Self::Brdf { .. } | Self::Mis { n_environment: 0, n_portal: 0, .. } => true,
            Self::Rejection { proposal, .. } => *proposal == Proposal::Brdf,
            Self::Sir { candidates, .. } => *candidates == Candidates::Brdf,
            Self::Mis { .. }
            | Self::Environment { .. }
            | Self::Product { .. }
            | Self::MedianCut { .. }
            | Self::VarianceMinimization { .. } => false,
        }
    }

    fn new(given: &Given) -> Result<Self, StrategyError> {
        use StrategyKind as K;
        let n_samples = || given.number_or_default("rays");
        let n_lights = || given.number_or_default("lights");
        Ok(match given.kind {
            K::Brdf => Self::Brdf { n_samples: n_samples() },
            K::Environment => Self::Environment { n_samples: n_samples() },
            K::Mis => Self::mis(given)?,
            K::Product => Self::Product { n_rays: n_samples() },
            K::Rejection => Self::rejection(given)?,
            K::Sir => Self::sir(given)?,
            K::MedianCut => Self::MedianCut { n_lights: n_lights() },
            K::VarianceMinimization => Self::VarianceMinimization {
                n_lights: n_lights(),
                rule: given.named("rule", &RULES),
            },
        })
    }

    fn mis(given: &Given) -> Result<Self, StrategyError> {
        let [n_environment, n_brdf] = match (
            given.get("split").and_then(split),
            given.number("rays"),
        ) {
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
            (None, _) => {
                let n = given.number_or_default("rays");
                [n.div_ceil(2), n / 2]
            }
        };
        Ok(Self::Mis {
            n_environment,
            n_brdf,
            n_portal: given.number("portals").unwrap_or(0),
            heuristic: given.named("heuristic", &HEURISTICS),
            // Without BRDF samples, the dim light would be lost.
            compensation: given.get("no-compensation").is_none() && n_brdf > 0,
        })
    }

    fn rejection(given: &Given) -> Result<Self, StrategyError> {
        /// The tries at most, for each sample to accept.
        const TRIES_PER_RAY: u32 = 64;
        let stop = match (given.number("rays"), given.number("tries")) {
            (None, _) => StoppingRule::Tries(given.number_or_default("tries")),
            (Some(1), _) => {
                return Err(StrategyError::Contradiction(
                    "rejection estimates from at least two accepted samples: use 2 rays or more, or tries for \
                     a fixed number of tries",
                ));
            }
            (Some(n), tries) => {
                StoppingRule::Accepted { n, max_tries: tries.unwrap_or(TRIES_PER_RAY * n) }
            }
        };
        Ok(Self::Rejection { proposal: given.named("proposal", &PROPOSALS), stop })
    }

    fn sir(given: &Given) -> Result<Self, StrategyError> {
        let (n_samples, n_candidates) =
            (given.number_or_default("rays"), given.number("candidates"));
        if n_candidates.is_some_and(|m| m < n_samples) {
            return Err(StrategyError::Contradiction("candidates must not be fewer than rays"));
        }
        Ok(Self::Sir {
            n_candidates,
            n_samples,
            candidates: given.named("from", &SOURCES),
            resampling: given.named("resampling", &RESAMPLINGS),
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
            Self::Mis { n_environment, n_brdf, n_portal, .. } => {
                n_environment.max(n_brdf).max(n_portal)
            }
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
            Self::Mis { n_environment, n_brdf, n_portal, heuristic, compensation } => {
                let portals = match n_portal {
                    0 => String::new(),
                    n => format!(", {n} of portals"),
                };
                let heuristic = HEURISTICS.name(heuristic);
                let compensated = if compensation { ", compensated" } else { "" };
                format!("mis {n_environment}:{n_brdf}{portals}, {heuristic} heuristic{compensated}")
            }
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
            Self::VarianceMinimization { n_lights, rule } => {
                let by = match rule {
                    Rule::Spherical => "",
                    Rule::Poster => " by the rule of 2009",
                };
                format!("variance minimization{by}, {n_lights} lights")
            }
        }
    }
}

impl FromStr for StrategySpec {
    type Err = StrategyError;

    fn from_str(text: &str) -> Result<Self, StrategyError> {
        Self::new(&Given::parse(text)?)
    }
}

/// The shortest text that parses to the same value.
impl fmt::Display for StrategySpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind().name())?;
        match *self {
            Self::Brdf { n_samples } | Self::Environment { n_samples } => write!(f, ":{n_samples}"),
            Self::Product { n_rays } => write!(f, ":{n_rays}"),
            Self::MedianCut { n_lights } => write!(f, ":{n_lights}"),
            Self::VarianceMinimization { n_lights, rule } => {
                write!(f, ":{n_lights}")?;
                if rule == Rule::default() {
                    return Ok(());
                }
                write!(f, ":rule={}", RULES.name(rule))
            }
            Self::Mis { n_environment, n_brdf, n_portal, heuristic, compensation } => {
                write!(f, ":{n_environment}:{n_brdf}")?;
                if n_portal > 0 {
                    write!(f, ":portals={n_portal}")?;
                }
                if heuristic != Heuristic::Power {
                    write!(f, ":heuristic={}", HEURISTICS.name(heuristic))?;
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
                write!(f, ":proposal={}", PROPOSALS.name(proposal))
            }
            Self::Sir { n_candidates, n_samples, candidates, resampling } => {
                match n_candidates {
                    Some(m) => write!(f, ":{n_samples}/{m}")?,
                    None => write!(f, ":{n_samples}")?,
                }
                if candidates != Candidates::default() {
                    write!(f, ":from={}", SOURCES.name(candidates))?;
                }
                if resampling != Resampling::default() {
                    write!(f, ":resampling={}", RESAMPLINGS.name(resampling))?;
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
            ("mis:3:portals=4", "mis:2:1:portals=4"),
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
            ("variance-minimization:rule=sphere", "variance-minimization:64"),
            ("variance-minimization:16:rule=2009", "variance-minimization:16:rule=2009"),
        ] {
            assert_eq!(displayed(text), canonical, "{text}");
        }
    }

    /// A random member of the set of valid strategies.
    fn random(pcg: &mut Pcg) -> StrategySpec {
        fn pick<T: Copy>(pcg: &mut Pcg, names: &Names<T>) -> T {
            names.values[(pcg.next_f64() * names.values.len() as f64) as usize]
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
                n_portal: if coin { n } else { 0 },
                heuristic: pick(pcg, &HEURISTICS),
                compensation: coin,
            },
            StrategyKind::Product => StrategySpec::Product { n_rays: n },
            StrategyKind::Rejection => StrategySpec::Rejection {
                proposal: pick(pcg, &PROPOSALS),
                stop: if coin {
                    StoppingRule::Tries(tries)
                } else {
                    StoppingRule::Accepted { n: n.max(2), max_tries: tries }
                },
            },
            StrategyKind::Sir => StrategySpec::Sir {
                n_candidates: coin.then_some(m.max(n)),
                n_samples: n,
                candidates: pick(pcg, &SOURCES),
                resampling: pick(pcg, &RESAMPLINGS),
            },
            StrategyKind::MedianCut => StrategySpec::MedianCut { n_lights: m },
            StrategyKind::VarianceMinimization => {
                StrategySpec::VarianceMinimization { n_lights: m, rule: pick(pcg, &RULES) }
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
            ("mis:split=3", "such as 3/1"),
            ("mis:no-compensation=1", "the name alone"),
            ("mis:color=red", "'color'"),
            ("mis:strategy=brdf", "'strategy'"),
            ("mis:heuristic=best", "one of power, balance"),
            ("mis:1", "at least one sample of each"),
            ("rejection:rays=1", "at least two"),
            ("variance-minimization:rule=2010", "one of sphere, 2009"),
        ] {
            let error = text.parse::<StrategySpec>().expect_err(text).to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    /// What is left out has the value that the declaration says.
    #[test]
    fn defaults_are_as_declared() {
        for kind in StrategyKind::ALL {
            let declaration = kind.declaration();
            let usual: StrategySpec = declaration.name.parse().unwrap();
            let is_value =
                |p: &&StrategyParameter| !p.default.is_empty() && !p.default.contains(' ');
            for parameter in declaration.parameters.iter().filter(is_value) {
                let text = format!("{}:{}={}", declaration.name, parameter.name, parameter.default);
                assert_eq!(text.parse(), Ok(usual), "{text}");
            }
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
        assert_eq!(
            described("variance-minimization:9:rule=2009"),
            "variance minimization by the rule of 2009, 9 lights"
        );
    }
}
