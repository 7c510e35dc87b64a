//! Strategy, samples and point sets.

use clap::Args;
use domelight::render::{Filter, Passes, RenderSettings};
use domelight::sampling::SamplerKind;
use domelight::strategy::{StrategyDeclaration, StrategyKind, StrategyParameter};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
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
    #[schemars(schema_with = "strategy_schema")]
    pub strategy: Text<NamedStrategy>,
    /// Camera samples per pixel; with product the average: noisy pixels get more, others fewer
    #[arg(id = "sampling.spp", long = "spp", value_name = "N", default_value = "32")]
    pub spp: Count<1, 16_777_216>,
    /// With product, take more camera samples in noisy pixels and fewer in others
    #[arg(id = "sampling.adaptive", long = "no-adaptive", action = clap::ArgAction::SetFalse, help =
          "With product, take the same number of camera samples in every pixel, but for the second sets of the variance layer")]
    pub adaptive: bool,
    /// Look for the windows of a room where the scene names no portals; product looks through them for light first
    #[arg(id = "sampling.find_portals", long = "no-find-portals", action = clap::ArgAction::SetFalse, help =
          "Do not look for the windows of a room, through which product looks for light first where the scene names no portals")]
    pub find_portals: bool,
    /// How the camera samples are divided into passes over the picture; only product depends on it
    #[arg(
        id = "sampling.passes",
        long = "passes",
        value_name = "HOW",
        default_value = "efficient",
        conflicts_with = "sampling.target_error"
    )]
    pub passes: Choice<Passes>,
    /// Stop each tile when two independent sets of its samples indicate at most this error (relMSE), such as 1e-3, but
    /// not before 16 samples
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
            find_portals: self.find_portals,
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

/// Strategies and their parameters, for `--help`.
fn strategy_help() -> String {
    let parameter = |parameter: &StrategyParameter| {
        let StrategyParameter { help, default, .. } = parameter;
        let default = if default.is_empty() { "" } else { &format!(" [default: {default}]") };
        format!("    {}: {help}{default}\n", parameter.notation())
    };
    let strategy = |kind: StrategyKind| {
        let StrategyDeclaration { name, summary, parameters, .. } = kind.declaration();
        format!("- {name}: {summary}\n{}", parameters.iter().map(parameter).collect::<String>())
    };
    format!(
        "Sampling strategy, optionally with numbers and options as in mis:3:1, sir:15/800, product:8 or \
         rejection:16:proposal=brdf\n\nStrategies, and their options, each after a colon:\n{}",
        StrategyKind::ALL.into_iter().map(strategy).collect::<String>()
    )
}

/// A text that begins with the name of a strategy.
fn strategy_schema(_: &mut SchemaGenerator) -> Schema {
    let names = |kind: StrategyKind| [&[kind.name()], kind.aliases()].concat();
    let names: Vec<&str> = StrategyKind::ALL.into_iter().flat_map(names).collect();
    json_schema!({ "type": "string", "pattern": format!("^({})(:.*)?$", names.join("|")) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of options in docs/strategies.md is that of the declarations.
    #[test]
    fn the_manual_lists_what_strategies_declare() {
        let page = include_str!("../../../../docs/strategies.md");
        let row = |kind: StrategyKind, parameter: &StrategyParameter| {
            let StrategyParameter { help, default, .. } = parameter;
            let notation = parameter.notation().replace('|', "\\|");
            format!("| `{}` | `{notation}` | {help} | {default} |\n", kind.name())
        };
        let rows = StrategyKind::ALL.into_iter().flat_map(|kind| {
            kind.declaration().parameters.iter().map(move |parameter| row(kind, parameter))
        });
        let head = "| strategy | option | what it is | default |\n|---|---|---|---|\n";
        let table = rows.fold(head.to_owned(), |table, row| table + &row);
        assert!(page.contains(&table), "docs/strategies.md must hold\n{table}");
    }
}
