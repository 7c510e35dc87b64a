//! Strategy, samples and point sets.

use clap::Args;
use domelight::render::{Filter, Passes, RenderSettings};
use domelight::sampling::SamplerKind;
use domelight::strategy::StrategyKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::defaults;
use super::value::{Choice, Count, Positive, Seed, Text};
use crate::strategy::NamedStrategy;

/// The strategy and the number of camera samples.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Sampling")]
#[serde(default, deny_unknown_fields)]
pub struct Sampling {
    /// Sampling strategy: brdf, environment, mis, product, rejection, sir, median-cut or
    /// variance-minimization, optionally with numbers and options as in mis:3:1, sir:15/800 or product:8
    #[arg(id = "sampling.strategy", long = "strategy", value_name = "NAME[:OPTIONS]", default_value = "product",
          long_help = strategy_help())]
    pub strategy: Text<NamedStrategy>,
    /// Camera samples per pixel; with product the average: noisy pixels get more, others fewer
    #[arg(id = "sampling.spp", long = "spp", value_name = "N", default_value = "32")]
    pub spp: Count<1, 16_777_216>,
    /// With product, take the same number of camera samples in every pixel, but for the second sets of the variance layer
    #[arg(id = "sampling.adaptive", long = "no-adaptive", action = clap::ArgAction::SetFalse)]
    pub adaptive: bool,
    /// How the camera samples are divided into passes over the picture
    #[arg(
        id = "sampling.passes",
        long = "passes",
        value_name = "HOW",
        default_value = "efficient",
        conflicts_with = "sampling.target_error"
    )]
    pub passes: Choice<Passes>,
    /// Stop each tile when two independent sets of its samples indicate an error (relMSE) of at most E, such as 1e-3,
    /// but not before 16 samples
    #[arg(id = "sampling.target_error", long = "target-error", value_name = "E")]
    pub target_error: Option<Positive>,
}

impl Default for Sampling {
    fn default() -> Self {
        defaults()
    }
}

/// Point sets and the pixel filter.
#[derive(Args, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[command(next_help_heading = "Sampling")]
#[serde(default, deny_unknown_fields)]
pub struct Pixel {
    /// Point sets: Owen-scrambled Sobol' or independent random numbers
    #[arg(id = "pixel.sampler", long = "sampler", value_name = "SAMPLER", default_value = "sobol")]
    pub sampler: Choice<SamplerKind>,
    /// Pixel filter
    #[arg(id = "pixel.filter", long = "filter", value_name = "FILTER", default_value = "gaussian")]
    pub filter: Choice<Filter>,
    /// Seed of the random numbers; the same seed gives the same picture
    #[arg(id = "pixel.seed", long = "seed", value_name = "N", default_value = "0")]
    pub seed: Seed,
}

impl Default for Pixel {
    fn default() -> Self {
        defaults()
    }
}

impl Sampling {
    /// These settings in place of those of `others`.
    pub fn settings(&self, others: RenderSettings) -> RenderSettings {
        RenderSettings {
            n_samples: self.spp.get(),
            adaptive: self.adaptive,
            target_error: self.target_error.map(Positive::get),
            passes: self.passes.0,
            ..others
        }
    }
}

impl Pixel {
    /// These settings in place of those of `others`.
    pub fn settings(&self, others: RenderSettings) -> RenderSettings {
        let Self { sampler: Choice(sampler), filter: Choice(filter), seed: Seed(seed) } = *self;
        RenderSettings { sampler, filter, seed, ..others }
    }
}

/// The options of strategies, for `--help`.
const OPTIONS: &str = "\
- rays=N: shadow rays per camera sample; with product the most, with rejection the samples to accept
- split=M/N: environment and BRDF samples of mis
- heuristic=power|balance, no-compensation: of mis
- candidates=M, from=mixture|environment|brdf, resampling=sorted|systematic|multinomial|reservoir: of sir
- tries=M, proposal=tighter|environment|brdf: of rejection
- lights=N: of median-cut and variance-minimization";

/// One line per strategy, for `--help`.
fn strategy_help() -> String {
    let line = |kind: StrategyKind| format!("- {}: {}", kind.name(), kind.summary());
    let lines: Vec<String> = StrategyKind::ALL.into_iter().map(line).collect();
    format!(
        "Sampling strategy, optionally with numbers and options as in mis:3:1, sir:15/800, product:8 or \
         rejection:16:proposal=brdf\n\nStrategies:\n{}\n\nOptions, each after a colon:\n{OPTIONS}\n",
        lines.join("\n")
    )
}
