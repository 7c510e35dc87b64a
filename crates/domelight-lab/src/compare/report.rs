//! The numbers of a comparison, as `--json` gives them and the page shows them.

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
    /// As it was typed.
    pub command: String,
    /// As it may be typed.
    #[serde(serialize_with = "as_text")]
    pub budget: Budget,
    /// What was rendered.
    pub scene: SceneReport,
    /// Which points a pixel has.
    pub sampler: &'static str,
    /// The pixel filter.
    pub filter: &'static str,
    /// The first one.
    pub seed: u64,
    /// How many pictures of each strategy there are.
    pub seeds: u32,
    /// How many worked.
    pub threads: usize,
    /// At which the page opens and ꟻLIP saw the pictures \[stops\].
    pub exposure: f32,
    /// The tone curve of both.
    pub tone: &'static str,
    /// What the pictures were measured against.
    pub reference: ReferenceReport,
    /// In the order in which they were given.
    pub strategies: Vec<StrategyReport>,
}

/// The numbers of a strategy.
#[derive(Clone, Debug, Serialize)]
pub struct StrategyReport {
    /// As it was given.
    pub name: String,
    /// In full.
    pub settings: String,
    /// If false, its error does not fall to 0; null of another renderer's picture, of which nothing is known.
    pub unbiased: Option<bool>,
    /// CPU seconds for tables and lights, once for all pictures.
    pub setup_seconds: f64,
    /// Why it was left out; null if it was not, and then there is a result.
    pub left_out: Option<String>,
    /// None of what was left out.
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
    /// The part of relMSE that more samples do not take away: an estimate, which may be below 0, without the reference's
    /// own error where that is known; null for a single seed.
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
    /// On the way to the budget; empty of another renderer's picture.
    pub convergence: Vec<ConvergencePoint>,
}

fn as_text<S: Serializer>(budget: &Budget, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(budget)
}
