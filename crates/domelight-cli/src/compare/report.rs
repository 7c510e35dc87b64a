//! The numbers of a comparison, as `--json` gives them and the page shows them.

use serde::{Serialize, Serializer};

use super::budget::Budget;
use super::strategy_run::{ConvergencePoint, MeanAndDeviation};
use crate::measure::reference::ReferenceReport;
use crate::report::SceneReport;

/// All numbers.
#[derive(Serialize)]
pub(super) struct CompareReport {
    pub(super) version: &'static str,
    /// As it was typed.
    pub(super) command: String,
    /// As it may be typed.
    #[serde(serialize_with = "as_text")]
    pub(super) budget: Budget,
    pub(super) scene: SceneReport,
    pub(super) sampler: String,
    pub(super) filter: &'static str,
    pub(super) seed: u64,
    pub(super) seeds: u32,
    pub(super) threads: usize,
    /// At which ꟻLIP saw the pictures \[stops\].
    pub(super) exposure: f32,
    pub(super) reference: ReferenceReport,
    pub(super) strategies: Vec<StrategyReport>,
}

/// The numbers of a strategy.
#[derive(Serialize)]
pub(super) struct StrategyReport {
    /// As it was given.
    pub(super) name: String,
    /// In full.
    pub(super) settings: String,
    /// If false, its error does not fall to 0.
    pub(super) unbiased: bool,
    /// CPU seconds for tables and lights, once for all pictures.
    pub(super) setup_seconds: f64,
    /// Why it was left out; null if it was not, and then there is a result.
    pub(super) left_out: Option<String>,
    pub(super) result: Option<ResultReport>,
}

/// What a strategy did with the budget.
#[derive(Serialize)]
pub(super) struct ResultReport {
    /// As asked for.
    pub(super) spp: u32,
    /// Camera samples of a pixel, as counted; the mean over seeds.
    pub(super) camera_samples: f64,
    /// Shadow rays of a pixel that the scene covers, as counted; the mean over seeds.
    pub(super) rays: f64,
    pub(super) cpu_seconds: MeanAndDeviation,
    pub(super) rel_mse: MeanAndDeviation,
    /// Mean ꟻLIP of the first seed's picture.
    pub(super) flip: f64,
    /// The part of relMSE that more samples do not take away: an estimate, which may be below 0, without the reference's
    /// own error where that is known; null for a single seed.
    pub(super) bias: Option<f64>,
    /// The 95 % interval of `bias`.
    pub(super) bias_interval: Option<[f64; 2]>,
    /// 1 / (relMSE · CPU seconds).
    pub(super) efficiency: f64,
    /// relMSE of mis over this one's: above 1 is better than mis. Null without mis in the list.
    pub(super) error_ratio_to_mis: Option<f64>,
    /// Efficiency over that of mis; null without mis in the list.
    pub(super) efficiency_ratio_to_mis: Option<f64>,
    /// Camera samples that were NaN or infinite, over all seeds.
    pub(super) non_finite_samples: u64,
    pub(super) convergence: Vec<ConvergencePoint>,
}

fn as_text<S: Serializer>(budget: &Budget, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(budget)
}
