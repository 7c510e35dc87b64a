//! One who takes pictures of a case at rising budgets: a strategy of this program, or another program.

use std::cell::RefCell;

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::compare::compare;
use domelight::render::survey;
use domelight::strategy::{PreparedStrategy, StrategySpec};
use serde::{Deserialize, Serialize};

use super::bound::Bound;
use super::cases::Built;
use super::ladder::{Cost, How, Point, cost_of};
use super::mitsuba::Mitsuba;
use crate::measure::reference::Reference;
use crate::measure::shot::Studio;
use crate::strategy::NamedStrategy;
use crate::strategy::refuse_repeating_points;
use crate::usage::{Seconds, Stopwatch};

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
pub(super) struct Judge {
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

impl Judge {
    pub(super) fn new(reference: Reference) -> Self {
        let covered = reference.picture.covered().unwrap_or_default();
        let touched = reference.picture.touched().unwrap_or_default();
        Self { reference, touched, covered }
    }

    fn errors(&self, image: &RgbImage) -> Result<Errors> {
        let report = &self.reference.report;
        Ok(Errors {
            all: self.error(image, &self.touched, report.rel_mse)?,
            covered: self.error(image, &self.covered, report.rel_mse_covered)?,
        })
    }

    /// relMSE over some pixels. Of independent pictures I and R it is that of I and that of R added,
    /// so the latter is taken off.
    fn error(&self, image: &RgbImage, mask: &[bool], noise: Option<f64>) -> Result<f64> {
        let measured = compare(image, &self.reference.picture.image, Some(mask))?.rel_mse;
        Ok((measured - noise.unwrap_or(0.0)).max(LEAST_PART * measured))
    }

    pub(super) fn covered_pixels(&self) -> usize {
        self.covered.iter().filter(|covered| **covered).count()
    }
}

/// A plan and what it made of the environment.
pub(super) struct Prepared<'e> {
    name: String,
    spec: StrategySpec,
    strategy: PreparedStrategy<'e>,
    setup: Seconds,
}

impl<'e> Prepared<'e> {
    pub(super) fn new(strategy: &NamedStrategy, built: &'e Built, seed: u64) -> Result<Self> {
        let Built { view, settings, .. } = built;
        let mut watch = Stopwatch::start();
        let points = || survey(&view.scene, &view.camera, settings);
        let spec = strategy.spec.for_scene(points, &view.environment, seed);
        let prepared = PreparedStrategy::new(spec, &view.environment)?;
        let name = strategy.text.clone();
        Ok(Self { name, spec, strategy: prepared, setup: watch.lap() })
    }
}

/// One who takes pictures.
pub(super) struct Contestant<'a> {
    source: Source<'a>,
    judge: &'a Judge,
    /// Camera samples of the least budget, and the factor from one to the next.
    first: u32,
    growth: u32,
    /// Rising numbers of camera samples, and the pictures with each.
    rungs: Vec<Rung>,
}

enum Source<'a> {
    Ours { prepared: &'a Prepared<'a>, studio: Studio<'a> },
    Mitsuba(&'a RefCell<Mitsuba>),
}

/// All pictures with a number of camera samples a pixel; one value a seed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Rung {
    pub(super) spp: u32,
    /// Of rendering alone; wall-clock seconds where the system does not tell.
    pub(super) cpu_seconds: Vec<f64>,
    pub(super) wall_seconds: Vec<f64>,
    /// Over the pixels that show any of the scene, without that of the reference.
    pub(super) rel_mse: Vec<f64>,
    /// Over the pixels that the scene fills.
    pub(super) rel_mse_covered: Vec<f64>,
    /// Camera samples of a pixel, as counted; null where a program does not tell.
    pub(super) camera_samples: Option<f64>,
    /// Of a pixel that the scene covers; null where a program does not tell.
    pub(super) shadow_rays: Option<f64>,
    /// Camera and shadow rays a CPU second.
    pub(super) rays_per_cpu_second: Option<f64>,
}

impl Rung {
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
struct Taken {
    cpu: f64,
    wall: f64,
    errors: Errors,
    camera_samples: Option<f64>,
    shadow_rays: Option<f64>,
    rays: Option<u64>,
}

/// Which budgets are worth measuring.
pub(super) struct Limits {
    /// The least and the greatest error that is wanted.
    pub(super) errors: (f64, f64),
    /// CPU seconds of all pictures of a budget.
    pub(super) most: f64,
    pub(super) n_seeds: u32,
}

impl<'a> Contestant<'a> {
    pub(super) fn ours(
        prepared: &'a Prepared<'a>,
        built: &'a Built,
        judge: &'a Judge,
    ) -> Contestant<'a> {
        let Built { view, settings, .. } = built;
        let settings = *settings;
        let studio = Studio { view, settings, strategy: &prepared.strategy, quiet: true };
        let source = Source::Ours { prepared, studio };
        Contestant { source, judge, first: 1, growth: 2, rungs: Vec::new() }
    }

    /// Its correlated points are made for square numbers.
    pub(super) fn mitsuba(mitsuba: &'a RefCell<Mitsuba>, judge: &'a Judge) -> Contestant<'a> {
        let source = Source::Mitsuba(mitsuba);
        Contestant { source, judge, first: 4, growth: 4, rungs: Vec::new() }
    }

    fn take(&self, n_samples: u32, seed: u64) -> Result<Taken> {
        Ok(match &self.source {
            Source::Ours { studio, prepared } => {
                let shot = studio.shoot(&prepared.name, n_samples, seed)?;
                Taken {
                    cpu: shot.seconds(),
                    wall: shot.time.wall,
                    errors: self.judge.errors(&shot.layers.color)?,
                    camera_samples: Some(shot.camera_samples()),
                    shadow_rays: Some(shot.rays()),
                    rays: Some(shot.counts.camera_rays + shot.counts.shadow_rays),
                }
            }
            Source::Mitsuba(mitsuba) => {
                let (picture, time) = mitsuba.borrow_mut().render(n_samples, seed)?;
                Taken {
                    cpu: time.cpu.unwrap_or(time.wall),
                    wall: time.wall,
                    errors: self.judge.errors(&picture.image)?,
                    camera_samples: None,
                    shadow_rays: None,
                    rays: None,
                }
            }
        })
    }

    /// The mean error over seeds at a number of camera samples.
    pub(super) fn error_at(&self, n_samples: u32, seeds: impl Iterator<Item = u64>) -> Result<f64> {
        let errors = seeds.map(|seed| Ok(self.take(n_samples, seed)?.errors.all));
        let errors = errors.collect::<Result<Vec<_>>>()?;
        Ok(errors.iter().sum::<f64>() / errors.len() as f64)
    }

    /// Chooses the budgets by a picture each: from the last with more than the greatest error to the first
    /// with less than the least, as far as time allows.
    pub(super) fn choose_budgets(&mut self, limits: &Limits) -> Result<()> {
        let (least, greatest) = limits.errors;
        let mut tried: Vec<(u32, f64)> = Vec::new();
        let mut n = self.first;
        // Warms caches; other programs compile what they run.
        self.take(n, PILOT_SEED)?;
        loop {
            let taken = self.take(n, PILOT_SEED)?;
            let error = taken.errors.all;
            tried.push((n, error));
            let near = least <= HEADLINE && (HEADLINE..NEAR * HEADLINE).contains(&error);
            let most = limits.most * if near { MORE } else { 1.0 };
            let next = n.saturating_mul(self.growth);
            let seconds = taken.cpu * f64::from(self.growth * limits.n_seeds);
            if error < least / MARGIN || seconds > most || !self.may(next) {
                break;
            }
            n = next;
        }
        let above = tried.iter().take_while(|(_, error)| *error > greatest * MARGIN).count();
        let tried = &tried[above.saturating_sub(1)..];
        self.rungs = tried.iter().map(|&(spp, _)| Rung { spp, ..Rung::default() }).collect();
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
    pub(super) fn take_all(&mut self, seed: u64) -> Result<()> {
        for i in 0..self.rungs.len() {
            let taken = self.take(self.rungs[i].spp, seed)?;
            let rung = &mut self.rungs[i];
            rung.cpu_seconds.push(taken.cpu);
            rung.wall_seconds.push(taken.wall);
            rung.rel_mse.push(taken.errors.all);
            rung.rel_mse_covered.push(taken.errors.covered);
            rung.camera_samples = taken.camera_samples;
            rung.shadow_rays = taken.shadow_rays;
            rung.rays_per_cpu_second = taken.rays.map(|rays| rays as f64 / rung.seconds());
        }
        Ok(())
    }

    /// What was measured.
    pub(super) fn entry(self, errors: &[f64], bound: Option<Bound>) -> Entry {
        let rungs = self.rungs;
        let reached = errors.iter().map(|&error| Reached::new(error, &rungs, None)).collect();
        let of_covered: Vec<Rung> = rungs.iter().map(Rung::of_covered).collect();
        let reached_covered =
            errors.iter().map(|&error| Reached::new(error, &of_covered, bound)).collect();
        let (name, settings, setup) = match self.source {
            Source::Ours { prepared, .. } => {
                (prepared.name.clone(), prepared.spec.description(), prepared.setup)
            }
            Source::Mitsuba(mitsuba) => {
                let mitsuba = mitsuba.borrow();
                ("mitsuba".to_owned(), mitsuba.describe(), mitsuba.setup())
            }
        };
        Entry { name, settings, setup, reached, reached_covered, rungs }
    }
}

/// A strategy's pictures of a case.
#[derive(Serialize, Deserialize)]
pub(super) struct Entry {
    /// As it was given.
    pub(super) name: String,
    /// In full.
    settings: String,
    /// For tables of its own.
    setup: Seconds,
    /// One for each error that was wanted.
    pub(super) reached: Vec<Option<Reached>>,
    /// The same over the pixels that the scene fills, as tables had it before silhouettes counted.
    pub(super) reached_covered: Vec<Option<Reached>>,
    pub(super) rungs: Vec<Rung>,
}

/// What an error costs.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Reached {
    pub(super) rel_mse: f64,
    pub(super) cpu_seconds: f64,
    pub(super) how: How,
    /// The least and the greatest over the seeds' own errors.
    pub(super) range: Option<(f64, f64)>,
    pub(super) wall_seconds: f64,
    /// 1 / (relMSE · CPU seconds).
    pub(super) efficiency: f64,
    /// That over the efficiency of perfect product sampling at the ray kernel's rate; null for other programs
    /// and where nothing is hidden, as it then is 0. Of the pixels that the scene fills alone.
    pub(super) efficiency_of_bound: Option<f64>,
}

impl Reached {
    /// `None` where the error is far from all that was measured.
    fn new(rel_mse: f64, rungs: &[Rung], bound: Option<Bound>) -> Option<Self> {
        let line = |error: &dyn Fn(&Rung) -> f64, seconds: &dyn Fn(&Rung) -> f64| -> Option<Cost> {
            let points: Vec<Point> = rungs.iter().map(|r| (seconds(r), error(r))).collect();
            cost_of(rel_mse, &points)
        };
        let Cost { seconds: cpu_seconds, how } = line(&Rung::error, &Rung::seconds)?;
        let wall = line(&Rung::error, &|rung| median(&rung.wall_seconds))?;
        let n_seeds = rungs.first().map_or(0, |rung| rung.rel_mse.len());
        let of_seeds = (0..n_seeds).filter_map(|s| line(&|rung| rung.rel_mse[s], &Rung::seconds));
        let range = of_seeds.map(|cost| (cost.seconds, cost.seconds));
        let range = range.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let efficiency = 1.0 / (rel_mse * cpu_seconds);
        Some(Self {
            rel_mse,
            cpu_seconds,
            how,
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

    fn rung(spp: u32, seconds: f64, errors: [f64; 2]) -> Rung {
        Rung {
            spp,
            cpu_seconds: vec![seconds; 2],
            wall_seconds: vec![0.5 * seconds; 2],
            rel_mse: errors.to_vec(),
            ..Rung::default()
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
        let rungs = [rung(1, 1.0, [8e-3, 8e-3]), rung(8, 8.0, [0.5e-3, 1.5e-3])];
        let reached = Reached::new(2e-3, &rungs, None).unwrap();
        assert!((reached.cpu_seconds - 4.0).abs() < 1e-9);
        assert!((reached.wall_seconds - 2.0).abs() < 1e-9);
        let (low, high) = reached.range.unwrap();
        assert!(low < 4.0 && 4.0 < high, "{low} {high}");
        assert!((reached.efficiency - 125.0).abs() < 1e-6);
        assert!(Reached::new(1e-5, &rungs, None).is_none());
    }
}
