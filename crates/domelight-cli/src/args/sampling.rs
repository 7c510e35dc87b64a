//! Sampling arguments: strategies, samples and point sets.

use std::str::FromStr;

use clap::{Args, ValueEnum};
use domelight::render::{Filter, Passes};
use domelight::sampling::{Heuristic, SamplerKind};
use domelight::strategy::{
    Candidates, Proposal, Resampling, StrategyError, StrategyKind, StrategyOptions,
};

use super::{one_of, positive};
use crate::parse::Split;

/// A strategy's name and options, parsed from one string.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrategyText {
    pub(crate) kind: StrategyKind,
    pub(crate) options: StrategyOptions,
}

impl FromStr for StrategyText {
    type Err = StrategyError;

    fn from_str(text: &str) -> Result<Self, StrategyError> {
        let (kind, options) = StrategyOptions::parse(text)?;
        Ok(Self { kind, options })
    }
}

/// A strategy and its options.
#[derive(Args, Debug)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct StrategyArguments {
    /// Sampling strategy: brdf, environment, mis, product, rejection, sir, median-cut or
    /// variance-minimization, optionally with numbers and options as in mis:3:1, sir:15/800 or product:8
    #[arg(long, value_name = "NAME[:OPTIONS]", default_value = "product",
          long_help = strategy_help())]
    pub(crate) strategy: StrategyText,
    /// Shadow rays per camera sample; with product the maximum, with rejection the number of samples to
    /// accept [default: 8 with product, 2 with mis, otherwise 1]
    #[arg(long, value_name = "N", conflicts_with = "split",
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) rays: Option<u32>,
    /// Environment and BRDF samples per camera sample, with mis [default: half of --rays each]
    #[arg(long, value_name = "M:N")]
    pub(crate) split: Option<Split>,
    /// Lights that replace the probe, with median-cut and variance-minimization [default: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) lights: Option<u32>,
    /// Candidates per camera sample, with sir [default: chosen by a pilot for the least error per time]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) candidates: Option<u32>,
    /// Density from which sir draws its candidates [default: mixture]
    #[arg(long, value_enum, value_name = "SOURCE")]
    pub(crate) from: Option<SourceName>,
    /// How sir picks rays from its candidates [default: sorted]
    #[arg(long, value_enum, value_name = "HOW")]
    pub(crate) resampling: Option<ResamplingName>,
    /// Tries per camera sample, with rejection; with --rays the maximum number of tries [default: 16;
    /// 64 N with --rays N]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) tries: Option<u32>,
    /// Factor of the product from which rejection draws its tries [default: tighter]
    #[arg(long, value_enum, value_name = "SOURCE")]
    pub(crate) proposal: Option<ProposalName>,
    /// Heuristic for the MIS weights [default: power]
    #[arg(long, value_enum)]
    pub(crate) heuristic: Option<HeuristicName>,
    /// With mis, sample the whole environment; by default, radiance below the mean is left to the
    /// BRDF samples
    #[arg(long)]
    pub(crate) no_compensation: bool,
}

/// The number of camera samples.
#[derive(Args, Debug)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct SampleArguments {
    /// Camera samples per pixel; with product the average: noisy pixels get more, others fewer
    #[arg(long, value_name = "N", default_value_t = 32,
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub(crate) spp: u32,
    /// With product, take the same number of camera samples in every pixel, but for the second sets of the variance layer
    #[arg(long)]
    pub(crate) no_adaptive: bool,
    /// How the camera samples are divided into passes over the picture
    #[arg(long, value_enum, value_name = "HOW", default_value_t = PassesName::Efficient,
          conflicts_with = "target_error")]
    pub(crate) passes: PassesName,
    /// Stop each tile when two independent sets of its samples indicate an error (relMSE) of at most E, such as 1e-3,
    /// but not before 16 samples
    #[arg(long, value_name = "E", value_parser = positive)]
    pub(crate) target_error: Option<f32>,
}

/// Point sets, the pixel filter, and threads.
#[derive(Args, Debug)]
#[command(next_help_heading = "Sampling")]
pub(crate) struct PixelArguments {
    /// Point sets: Owen-scrambled Sobol' or independent random numbers
    #[arg(long, value_enum, default_value_t = SamplerName::Sobol)]
    pub(crate) sampler: SamplerName,
    /// Pixel filter
    #[arg(long, default_value = "gaussian", value_parser = one_of::<Filter>(Filter::ALL.map(Filter::name)))]
    pub(crate) filter: Filter,
    /// Seed of the random numbers; the same seed gives the same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Number of threads [default: SLURM_CPUS_PER_TASK, otherwise the cores available to the process]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SourceName {
    /// The environment
    Environment,
    /// The reflectance
    Brdf,
    /// Half from each
    Mixture,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ResamplingName {
    /// An independent random number for each ray
    Multinomial,
    /// Equally spaced picks
    Systematic,
    /// Equally spaced picks from candidates sorted in space
    Sorted,
    /// Streaming reservoirs, which need no memory for candidates
    Reservoir,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ProposalName {
    /// The environment, with a bound on the reflectance
    Environment,
    /// The reflectance, with a bound on the light
    Brdf,
    /// Whichever bound is tighter at the point
    Tighter,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum HeuristicName {
    /// wᵢ = nᵢpᵢ / Σ nₖpₖ
    Balance,
    /// The same with squares
    Power,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum PassesName {
    /// Passes of the length that suits the strategy best
    Efficient,
    /// Passes of 1, 1, 2, 4, … samples, as in the browser edition; with product, this gives a different picture
    Doubling,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SamplerName {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// Independent pseudo-random points
    Independent,
}

/// One line per strategy, for `--help`.
fn strategy_help() -> String {
    let line = |kind: StrategyKind| format!("- {}: {}", kind.name(), kind.summary());
    let lines: Vec<String> = StrategyKind::ALL.into_iter().map(line).collect();
    format!(
        "Sampling strategy, optionally with numbers and options as in mis:3:1, sir:15/800, product:8 or \
         rejection:16:proposal=brdf\n\nStrategies:\n{}\n",
        lines.join("\n")
    )
}

impl From<SourceName> for Candidates {
    fn from(name: SourceName) -> Self {
        match name {
            SourceName::Environment => Self::Environment,
            SourceName::Brdf => Self::Brdf,
            SourceName::Mixture => Self::Mixture,
        }
    }
}

impl From<ResamplingName> for Resampling {
    fn from(name: ResamplingName) -> Self {
        match name {
            ResamplingName::Multinomial => Self::Multinomial,
            ResamplingName::Systematic => Self::Systematic,
            ResamplingName::Sorted => Self::SystematicSorted,
            ResamplingName::Reservoir => Self::Reservoir,
        }
    }
}

impl From<ProposalName> for Proposal {
    fn from(name: ProposalName) -> Self {
        match name {
            ProposalName::Environment => Self::Environment,
            ProposalName::Brdf => Self::Brdf,
            ProposalName::Tighter => Self::Tighter,
        }
    }
}

impl From<HeuristicName> for Heuristic {
    fn from(name: HeuristicName) -> Self {
        match name {
            HeuristicName::Balance => Self::Balance,
            HeuristicName::Power => Self::Power,
        }
    }
}

impl From<PassesName> for Passes {
    fn from(name: PassesName) -> Self {
        match name {
            PassesName::Efficient => Self::Efficient,
            PassesName::Doubling => Self::Doubling,
        }
    }
}

impl From<SamplerName> for SamplerKind {
    fn from(name: SamplerName) -> Self {
        match name {
            SamplerName::Sobol => Self::Sobol,
            SamplerName::Independent => Self::Independent,
        }
    }
}
