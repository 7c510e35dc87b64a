//! Measures one renderer at increasing sample counts: a strategy of this program, or another program.

use std::cell::RefCell;

use domelight::RgbImage;
use domelight::picture::compare::compare;
use domelight::render::RenderSettings;
use domelight::strategy::{PreparedStrategy, StrategySpec};
use serde::{Deserialize, Serialize};

use super::bound::Bound;
use super::cases::BuiltCase;
use super::fit::{Cost, Fit, Point, cost_of};
use super::mitsuba::Mitsuba;
use crate::measure::Reference;
use crate::measure::render::{RenderSetup, Shown};
use crate::strategy::{NamedStrategy, refuse_repeating_points};
use crate::usage::{Seconds, Stopwatch};
use crate::{Error, Host};

/// The error that most comparisons of renderers are made at.
pub(super) const HEADLINE: f64 = 1e-3;
/// How near to it an error must be for more time to be spent.
const NEAR: f64 = 8.0;
/// How much more.
const MORE: f64 = 4.0;
/// How far beyond the errors that are wanted a single picture's error must be for those of other seeds to
/// lie on the same side.
const MARGIN: f64 = 1.3;
/// The part of a measured error that remains at least when the reference's own is taken off.
const LEAST_PART: f64 = 0.1;
/// The seed of pilots, which no picture has.
const PILOT_SEED: u64 = 0x7069_6c6f_7473;
/// The most camera samples of a pixel.
const MOST_SAMPLES: u32 = 1 << 16;

/// What pictures are measured against.
pub(super) struct ErrorMetric {
    pub(super) reference: Reference,
    /// Pixels that show any of the scene; all others are exact.
    touched: Vec<bool>,
    /// Pixels that the scene fills.
    pub(super) covered: Vec<bool>,
}

/// relMSE of a picture.
struct Errors {
    /// Over the pixels that show any of the scene.
    all: f64,
    /// Over those that it fills.
    covered: f64,
}

impl ErrorMetric {
    pub(super) fn new(reference: Reference) -> Self {
        let covered = reference.picture.covered().unwrap_or_default();
        let touched = reference.picture.touched().unwrap_or_default();
        Self { reference, touched, covered }
    }

    fn errors(&self, image: &RgbImage) -> Result<Errors, Error> {
        let report = &self.reference.report;
        Ok(Errors {
            all: self.error(image, &self.touched, report.rel_mse)?,
            covered: self.error(image, &self.covered, report.rel_mse_covered)?,
        })
    }

    /// relMSE over some pixels. Of independent pictures I and R it is that of I and that of R added,
    /// so the latter is taken off.
    fn error(&self, image: &RgbImage, mask: &[bool], noise: Option<f64>) -> Result<f64, Error> {
        let measured = compare(image, &self.reference.picture.image, Some(mask))?.rel_mse;
        Ok((measured - noise.unwrap_or(0.0)).max(LEAST_PART * measured))
    }

    pub(super) fn covered_pixels(&self) -> usize {
        self.covered.iter().filter(|covered| **covered).count()
    }
}

/// A strategy and what it made of the environment.
pub(super) struct BenchStrategy<'e> {
    name: String,
    spec: StrategySpec,
    strategy: PreparedStrategy<'e>,
    setup: Seconds,
}

impl<'e> BenchStrategy<'e> {
    pub(super) fn new(
        strategy: &NamedStrategy,
        built: &'e BuiltCase,
        seed: u64,
    ) -> Result<Self, Error> {
        let BuiltCase { view, settings, .. } = built;
        let mut watch = Stopwatch::start();
        let settings = &RenderSettings { seed, ..*settings };
        let spec =
            strategy.spec.for_picture(&view.scene, &view.camera, &view.environment, settings);
        let prepared = PreparedStrategy::new(spec, &view.environment)?;
        let name = strategy.text.clone();
        Ok(Self { name, spec, strategy: prepared, setup: watch.lap() })
    }
}

/// Measures one renderer at increasing sample counts.
pub(super) struct BenchRun<'a> {
    source: Source<'a>,
    metric: &'a ErrorMetric,
    /// Camera samples of the least budget, and the factor from one to the next.
    first: u32,
    growth: u32,
    /// Rising numbers of camera samples, and the pictures with each.
    budget_points: Vec<BudgetPoint>,
}

enum Source<'a> {
    Ours { prepared: &'a BenchStrategy<'a>, render_setup: RenderSetup<'a> },
    Mitsuba(&'a RefCell<Mitsuba>),
}

/// All pictures with a number of camera samples per pixel; one value a seed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct BudgetPoint {
    pub(super) spp: u32,
    /// CPU seconds of rendering alone; wall-clock seconds where the system does not report them.
    pub(super) cpu_seconds: Vec<f64>,
    pub(super) wall_seconds: Vec<f64>,
    /// Over the pixels that show any of the scene, without that of the reference.
    pub(super) rel_mse: Vec<f64>,
    /// Over the pixels that the scene fills; files of before had these alone, as `rel_mse`.
    #[serde(default)]
    pub(super) rel_mse_covered: Vec<f64>,
    /// Camera samples of a pixel, as counted; null where a program does not report them.
    pub(super) camera_samples: Option<f64>,
    /// Shadow rays of a pixel that the scene covers; null where a program does not report them.
    pub(super) shadow_rays: Option<f64>,
    /// Camera and shadow rays a CPU second.
    pub(super) rays_per_cpu_second: Option<f64>,
}

impl BudgetPoint {
    /// With the errors over the pixels that the scene fills.
    fn of_covered(&self) -> Self {
        Self { rel_mse: self.rel_mse_covered.clone(), ..self.clone() }
    }

    /// The median: other work on the machine only adds.
    pub(super) fn seconds(&self) -> f64 {
        median(&self.cpu_seconds)
    }

    /// The mean, of which outliers are a part.
    pub(super) fn error(&self) -> f64 {
        self.rel_mse.iter().sum::<f64>() / self.rel_mse.len() as f64
    }
}

pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// A picture's cost and error.
struct Measurement {
    cpu: f64,
    wall: f64,
    errors: Errors,
    camera_samples: Option<f64>,
    shadow_rays: Option<f64>,
    rays: Option<u64>,
}

/// Which budgets are worth measuring.
pub(super) struct Limits {
    /// The least and the largest error that is wanted.
    pub(super) errors: (f64, f64),
    /// CPU seconds of all pictures of a budget.
    pub(super) most: f64,
    pub(super) n_seeds: u32,
}

impl<'a> BenchRun<'a> {
    pub(super) fn ours(
        prepared: &'a BenchStrategy<'a>,
        built: &'a BuiltCase,
        metric: &'a ErrorMetric,
        host: &'a dyn Host,
    ) -> BenchRun<'a> {
        let BuiltCase { view, settings, .. } = built;
        let (view, settings, strategy) = (view.view(), *settings, &prepared.strategy);
        let render_setup = RenderSetup { view, settings, strategy, host, shown: Shown::Unseen };
        let source = Source::Ours { prepared, render_setup };
        BenchRun { source, metric, first: 1, growth: 2, budget_points: Vec::new() }
    }

    /// Its correlated points are made for square numbers.
    pub(super) fn mitsuba(mitsuba: &'a RefCell<Mitsuba>, metric: &'a ErrorMetric) -> BenchRun<'a> {
        let source = Source::Mitsuba(mitsuba);
        BenchRun { source, metric, first: 4, growth: 4, budget_points: Vec::new() }
    }

    fn measure(&self, n_samples: u32, seed: u64) -> Result<Measurement, Error> {
        Ok(match &self.source {
            Source::Ours { render_setup, prepared } => {
                let render = render_setup.render(&prepared.name, n_samples, seed)?;
                Measurement {
                    cpu: render.seconds(),
                    wall: render.time.wall,
                    errors: self.metric.errors(&render.layers.color)?,
                    camera_samples: Some(render.camera_samples()),
                    shadow_rays: Some(render.rays()),
                    rays: Some(render.counts.camera_rays + render.counts.shadow_rays),
                }
            }
            Source::Mitsuba(mitsuba) => {
                let (picture, time) = mitsuba.borrow_mut().render(n_samples, seed)?;
                Measurement {
                    cpu: time.cpu.unwrap_or(time.wall),
                    wall: time.wall,
                    errors: self.metric.errors(&picture.image)?,
                    camera_samples: None,
                    shadow_rays: None,
                    rays: None,
                }
            }
        })
    }

    /// The mean error over seeds at a number of camera samples.
    pub(super) fn error_at(
        &self,
        n_samples: u32,
        seeds: impl Iterator<Item = u64>,
    ) -> Result<f64, Error> {
        let errors = seeds.map(|seed| Ok(self.measure(n_samples, seed)?.errors.all));
        let errors = errors.collect::<Result<Vec<_>, Error>>()?;
        Ok(errors.iter().sum::<f64>() / errors.len() as f64)
    }

    /// Chooses the budgets by a picture each: from the last with more than the largest error to the first
    /// with less than the least, as far as time allows.
    pub(super) fn choose_budgets(&mut self, limits: &Limits) -> Result<(), Error> {
        let (least, greatest) = limits.errors;
        let mut tried: Vec<(u32, f64)> = Vec::new();
        let mut n = self.first;
        // Warms caches; other programs compile what they run.
        self.measure(n, PILOT_SEED)?;
        loop {
            let measurement = self.measure(n, PILOT_SEED)?;
            let error = measurement.errors.all;
            tried.push((n, error));
            let near = least <= HEADLINE && (HEADLINE..NEAR * HEADLINE).contains(&error);
            let most = limits.most * if near { MORE } else { 1.0 };
            let next = n.saturating_mul(self.growth);
            let seconds = measurement.cpu * f64::from(self.growth * limits.n_seeds);
            if error < least / MARGIN || seconds > most || !self.may(next) {
                break;
            }
            n = next;
        }
        let above = tried.iter().take_while(|(_, error)| *error > greatest * MARGIN).count();
        let tried = &tried[above.saturating_sub(1)..];
        self.budget_points =
            tried.iter().map(|&(spp, _)| BudgetPoint { spp, ..BudgetPoint::default() }).collect();
        Ok(())
    }

    fn may(&self, n_samples: u32) -> bool {
        let fits = match &self.source {
            Source::Ours { prepared, .. } => {
                refuse_repeating_points(prepared.spec, n_samples).is_ok()
            }
            Source::Mitsuba(_) => true,
        };
        fits && n_samples <= MOST_SAMPLES
    }

    /// A picture at each budget.
    pub(super) fn measure_all(&mut self, seed: u64) -> Result<(), Error> {
        for i in 0..self.budget_points.len() {
            let measurement = self.measure(self.budget_points[i].spp, seed)?;
            let budget_point = &mut self.budget_points[i];
            budget_point.cpu_seconds.push(measurement.cpu);
            budget_point.wall_seconds.push(measurement.wall);
            budget_point.rel_mse.push(measurement.errors.all);
            budget_point.rel_mse_covered.push(measurement.errors.covered);
            budget_point.camera_samples = measurement.camera_samples;
            budget_point.shadow_rays = measurement.shadow_rays;
            budget_point.rays_per_cpu_second =
                measurement.rays.map(|rays| rays as f64 / budget_point.seconds());
        }
        Ok(())
    }

    /// What was measured.
    pub(super) fn entry(self, errors: &[f64], bound: Option<Bound>) -> StrategyEntry {
        let budget_points = self.budget_points;
        let reached =
            errors.iter().map(|&error| CostAtError::new(error, &budget_points, None)).collect();
        let of_covered: Vec<BudgetPoint> =
            budget_points.iter().map(BudgetPoint::of_covered).collect();
        let reached_covered =
            errors.iter().map(|&error| CostAtError::new(error, &of_covered, bound)).collect();
        let (name, settings, setup) = match self.source {
            Source::Ours { prepared, .. } => {
                (prepared.name.clone(), prepared.spec.description(), prepared.setup)
            }
            Source::Mitsuba(mitsuba) => {
                let mitsuba = mitsuba.borrow();
                ("mitsuba".to_owned(), mitsuba.describe(), mitsuba.setup())
            }
        };
        StrategyEntry { name, settings, setup, reached, reached_covered, budget_points }
    }
}

/// A strategy's pictures of a case.
#[derive(Serialize, Deserialize)]
pub(super) struct StrategyEntry {
    /// As it was given.
    pub(super) name: String,
    /// In full.
    settings: String,
    /// For tables of its own.
    setup: Seconds,
    /// One for each error that was wanted.
    pub(super) reached: Vec<Option<CostAtError>>,
    /// The same over the pixels that the scene fills; files of before had these alone, as `reached`.
    #[serde(default)]
    pub(super) reached_covered: Vec<Option<CostAtError>>,
    pub(super) budget_points: Vec<BudgetPoint>,
}

/// What an error costs.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct CostAtError {
    pub(super) rel_mse: f64,
    pub(super) cpu_seconds: f64,
    pub(super) fit: Fit,
    /// The least and the largest over the seeds' own errors.
    pub(super) range: Option<(f64, f64)>,
    pub(super) wall_seconds: f64,
    /// 1 / (relMSE · CPU seconds).
    pub(super) efficiency: f64,
    /// That over the efficiency of perfect product sampling at the ray kernel's rate; null for other programs
    /// and where nothing is hidden, as it then is 0. Of the pixels that the scene fills alone.
    pub(super) efficiency_of_bound: Option<f64>,
}

impl CostAtError {
    /// `None` where the error is far from all that was measured.
    fn new(rel_mse: f64, budget_points: &[BudgetPoint], bound: Option<Bound>) -> Option<Self> {
        let line = |error: &dyn Fn(&BudgetPoint) -> f64,
                    seconds: &dyn Fn(&BudgetPoint) -> f64|
         -> Option<Cost> {
            let points: Vec<Point> = budget_points.iter().map(|r| (seconds(r), error(r))).collect();
            cost_of(rel_mse, &points)
        };
        let Cost { seconds: cpu_seconds, fit } = line(&BudgetPoint::error, &BudgetPoint::seconds)?;
        let wall = line(&BudgetPoint::error, &|budget_point| median(&budget_point.wall_seconds))?;
        let n_seeds = budget_points.first().map_or(0, |budget_point| budget_point.rel_mse.len());
        let of_seeds = (0..n_seeds)
            .filter_map(|s| line(&|budget_point| budget_point.rel_mse[s], &BudgetPoint::seconds));
        let range = of_seeds.map(|cost| (cost.seconds, cost.seconds));
        let range = range.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let efficiency = 1.0 / (rel_mse * cpu_seconds);
        Some(Self {
            rel_mse,
            cpu_seconds,
            fit,
            range: range.filter(|_| n_seeds > 1),
            wall_seconds: wall.seconds,
            efficiency,
            efficiency_of_bound: bound
                .filter(|bound| bound.rel_mse_seconds > 0.0)
                .map(|bound| efficiency * bound.rel_mse_seconds),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget_point(spp: u32, seconds: f64, errors: [f64; 2]) -> BudgetPoint {
        BudgetPoint {
            spp,
            cpu_seconds: vec![seconds; 2],
            wall_seconds: vec![0.5 * seconds; 2],
            rel_mse: errors.to_vec(),
            ..BudgetPoint::default()
        }
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn seeds_make_a_range_around_the_mean() {
        let budget_points =
            [budget_point(1, 1.0, [8e-3, 8e-3]), budget_point(8, 8.0, [0.5e-3, 1.5e-3])];
        let reached = CostAtError::new(2e-3, &budget_points, None).unwrap();
        assert!((reached.cpu_seconds - 4.0).abs() < 1e-9);
        assert!((reached.wall_seconds - 2.0).abs() < 1e-9);
        let (low, high) = reached.range.unwrap();
        assert!(low < 4.0 && 4.0 < high, "{low} {high}");
        assert!((reached.efficiency - 125.0).abs() < 1e-6);
        assert!(CostAtError::new(1e-5, &budget_points, None).is_none());
    }
}
