//! The numbers of a comparison, which `--json` prints and the page shows.

use serde::{Serialize, Serializer};

use super::budget::Budget;
use super::strategy_run::{ConvergencePoint, MeanAndDeviation};
use crate::measure::ReferenceReport;
use crate::report::SceneReport;

/// All numbers.
#[derive(Clone, Debug, Serialize)]
pub struct CompareReport {
    /// Version of domelight.
    pub version: &'static str,
    /// The command line.
    pub command: String,
    /// The budget, in the notation of the command line.
    #[serde(serialize_with = "as_text")]
    pub budget: Budget,
    /// What was rendered.
    pub scene: SceneReport,
    /// The point set of a pixel.
    pub sampler: &'static str,
    /// The pixel filter.
    pub filter: &'static str,
    /// The first seed.
    pub seed: u64,
    /// The number of pictures per strategy.
    pub seeds: u32,
    /// The number of threads.
    pub threads: usize,
    /// The exposure of the page when it opens, also used for ꟻLIP \[stops\].
    pub exposure: f32,
    /// The tone curve of both.
    pub tone: &'static str,
    /// The reference of the errors.
    pub reference: ReferenceReport,
    /// The strategies in the given order.
    pub strategies: Vec<StrategyReport>,
}

/// The numbers of a strategy.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyReport {
    /// The name as given.
    pub name: String,
    /// The settings in full.
    pub settings: String,
    /// Whether its error falls to 0; null for another renderer's picture, about which nothing is known.
    pub unbiased: Option<bool>,
    /// CPU seconds for tables and lights, once for all pictures.
    pub setup_seconds: f64,
    /// Why it was left out; null if there is a result.
    pub left_out: Option<String>,
    /// `None` if it was left out.
    pub result: Option<ResultReport>,
}

/// What a strategy did with the budget.
#[derive(Clone, Debug, Serialize)]
pub struct ResultReport {
    /// As asked for; null of another renderer's picture.
    pub spp: Option<u32>,
    /// Camera samples of a pixel, as counted; the mean over seeds. Null of another renderer's picture.
    pub camera_samples: Option<f64>,
    /// Shadow rays of a pixel that the scene covers, as counted; the mean over seeds. Null of another renderer's picture.
    pub rays: Option<f64>,
    /// CPU seconds of rendering alone; for another renderer's picture, as stated.
    pub cpu_seconds: MeanAndDeviation,
    /// Against the reference, over all pixels.
    pub rel_mse: MeanAndDeviation,
    /// Mean ꟻLIP of the first seed's picture.
    pub flip: f64,
    /// The estimated part of relMSE that more samples do not remove. It may be negative, excludes the reference's own
    /// error if known, and is null for a single seed.
    pub bias: Option<f64>,
    /// The 95 % interval of `bias`.
    pub bias_interval: Option<[f64; 2]>,
    /// 1 / (relMSE · CPU seconds).
    pub efficiency: f64,
    /// relMSE of mis over this one's: above 1 is better than mis. Null without mis in the list.
    pub error_ratio_to_mis: Option<f64>,
    /// Efficiency over that of mis; null without mis in the list.
    pub efficiency_ratio_to_mis: Option<f64>,
    /// Camera samples that were NaN or infinite, over all seeds.
    pub non_finite_samples: u64,
    /// The points on the way to the budget; empty for another renderer's picture.
    pub convergence: Vec<ConvergencePoint>,
}

fn as_text<S: Serializer>(budget: &Budget, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(budget)
}
