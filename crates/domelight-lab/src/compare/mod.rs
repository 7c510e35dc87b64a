//! Strategies on one scene at equal samples, rays or time.

mod budget;
mod page;
mod pixels;
mod plots;
mod report;
mod strategy_run;

use domelight::RgbImage;
use domelight::picture::compare::relative_error_map;
use domelight::picture::exposure::Exposure;
use domelight::picture::flip::{PIXELS_PER_DEGREE, ldr_flip};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::quote::{Code, Html};
use domelight::render::{RenderSettings, automatic_exposure};
use domelight::strategy::{Strategy, StrategyKind, StrategySpec};

pub use budget::{BadBudget, Budget};
pub use report::{CompareReport, ResultReport, StrategyReport};
pub use strategy_run::{ConvergencePoint, MeanAndDeviation};

use crate::measure::render::{Picturing, RenderSetup};
use crate::measure::{Cache, Goal, PRODUCT, Reference, Source};
use crate::scene::PreparedSceneRef;
use crate::strategy::{NamedStrategy, refuse_repeating_points};
use crate::usage::Stopwatch;
use crate::{At as _, Error, Host};
use strategy_run::{SampleCount, StrategyMeasurement, StrategyRun};

/// The relMSE of the reference should be this far below the least that is measured against it.
const CONVERGED: f64 = 0.2;

/// How far beside its budget a strategy may be without a word.
const TOLERANCE: f64 = 0.1;

/// What all strategies of a comparison have in common.
#[derive(Clone, Debug)]
pub struct ComparisonSettings {
    /// Settings of each picture, except for the number of samples.
    pub render: RenderSettings,
    /// What each picture may cost.
    pub budget: Budget,
    /// Pictures of each strategy, from the seed of `render` on.
    pub n_seeds: u32,
    /// At which ꟻLIP sees the pictures, and the page opens; automatic is [`automatic_exposure`].
    pub exposure: Exposure,
    /// Camera samples of each pixel of a rendered reference.
    pub reference_spp: u32,
    /// What makes the report again; for people.
    pub command: String,
}

impl Default for ComparisonSettings {
    fn default() -> Self {
        Self {
            render: RenderSettings::default(),
            budget: Budget::Rays(32.0),
            n_seeds: 4,
            exposure: Exposure::Auto,
            reference_spp: 64,
            command: String::new(),
        }
    }
}

/// Strategies on one scene at equal samples, rays or time.
pub struct Comparison<'a> {
    view: PreparedSceneRef<'a>,
    settings: ComparisonSettings,
    strategies: Vec<Competitor<'a>>,
}

/// Who takes part.
enum Competitor<'a> {
    Named(NamedStrategy),
    Own { name: String, strategy: &'a dyn Picturing },
}

impl Competitor<'_> {
    fn name(&self) -> &str {
        match self {
            Self::Named(NamedStrategy { text, .. }) => text,
            Self::Own { name, .. } => name,
        }
    }
}

/// What a comparison found.
#[derive(Debug)]
pub struct ComparisonResult {
    /// All numbers.
    pub report: CompareReport,
    /// The first seed's picture of each strategy and its errors; none of those that were left out.
    pub pictures: Vec<Option<Picture>>,
    /// What they were measured against.
    pub reference: RgbImage,
}

/// A picture and its errors.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Radiance.
    pub image: RgbImage,
    /// |I − R| / √(R² + 0.01), the mean of the channels, row by row.
    pub relative_error: Vec<f32>,
    /// ꟻLIP of each pixel, in \[0, 1\].
    pub flip: Vec<f32>,
}

impl ComparisonResult {
    /// The report as one page of HTML that needs nothing else.
    ///
    /// # Errors
    /// If a picture cannot be compressed.
    pub fn page(&self) -> Result<Code<Html>, Error> {
        page::page(&self.report, &self.pictures, &self.reference)
    }
}

impl<'a> Comparison<'a> {
    /// A comparison without strategies yet.
    pub fn new(view: PreparedSceneRef<'a>, settings: ComparisonSettings) -> Self {
        Self { view, settings, strategies: Vec::new() }
    }

    /// One of the library's strategies takes part.
    ///
    /// # Errors
    /// If one of that name does already.
    pub fn add_named(&mut self, strategy: NamedStrategy) -> Result<(), Error> {
        self.add_competitor(Competitor::Named(strategy))
    }

    /// A strategy of any type takes part. It counts as unbiased: the report complains if it turns out not to be.
    ///
    /// # Errors
    /// If one of that name does already.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        strategy: &'a impl Strategy,
    ) -> Result<(), Error> {
        self.add_competitor(Competitor::Own { name: name.into(), strategy })
    }

    fn add_competitor(&mut self, competitor: Competitor<'a>) -> Result<(), Error> {
        let name = competitor.name();
        if self.strategies.iter().any(|other| other.name() == name) {
            return Err(Error::Usage(format!("--strategies has '{name}' twice")));
        }
        self.strategies.push(competitor);
        Ok(())
    }

    /// The converged picture of the view, from the cache if it has it, else rendered.
    ///
    /// # Errors
    /// If the scene is not in sight, or the host ended the work.
    pub fn reference(&self, cache: Option<&Cache>, host: &dyn Host) -> Result<Reference, Error> {
        let goal = Goal::Samples(self.settings.reference_spp);
        Reference::of_view(cache, self.view, PRODUCT, self.settings.render, goal, host)
    }

    /// Measures all strategies.
    ///
    /// # Errors
    /// If a strategy does not suit the environment, the sizes differ, or the host ended the work.
    pub fn run(&self, reference: &Reference, host: &dyn Host) -> Result<ComparisonResult, Error> {
        let exposure = self.exposure();
        let mut strategies = Vec::new();
        let mut pictures = Vec::new();
        for competitor in &self.strategies {
            let measured = self.measure(competitor, reference, exposure, host);
            let (report, picture) = measured.at(format_args!("strategy {}", competitor.name()))?;
            strategies.push(report);
            pictures.push(picture);
        }
        let is_mis = |competitor: &Competitor| matches!(competitor, Competitor::Named(s) if s.spec.kind() == StrategyKind::Mis);
        compare_with(self.strategies.iter().position(is_mis), &mut strategies);
        let settings = &self.settings.render;
        let report = CompareReport {
            version: env!("CARGO_PKG_VERSION"),
            command: self.settings.command.clone(),
            budget: self.settings.budget,
            scene: self.view.report.clone(),
            sampler: format!("{:?}", settings.sampler).to_lowercase(),
            filter: settings.filter.name(),
            seed: settings.seed,
            seeds: self.settings.n_seeds,
            threads: rayon::current_num_threads(),
            exposure,
            reference: reference.report.clone(),
            strategies,
        };
        report.warn(host);
        Ok(ComparisonResult { report, pictures, reference: reference.picture.image.clone() })
    }

    fn measure(
        &self,
        competitor: &Competitor,
        reference: &Reference,
        exposure: f32,
        host: &dyn Host,
    ) -> Result<(StrategyReport, Option<Picture>), Error> {
        let PreparedSceneRef { scene, camera, environment, .. } = self.view;
        let mut watch = Stopwatch::start();
        let prepared;
        let (spec, strategy): (_, &dyn Picturing) = match competitor {
            Competitor::Named(NamedStrategy { spec, .. }) => {
                let spec = spec.for_picture(scene, camera, environment, &self.settings.render);
                prepared = host.prepare(spec, environment)?;
                (Some(spec), &prepared)
            }
            Competitor::Own { strategy, .. } => (None, *strategy),
        };
        let setup = watch.lap();
        let run = StrategyRun {
            render_setup: RenderSetup {
                view: self.view,
                settings: self.settings.render,
                strategy,
                host,
                shown: true,
            },
            label: competitor.name().to_owned(),
            reference: &reference.picture.image,
            reference_noise: reference.report.rel_mse.unwrap_or(0.0),
            n_seeds: self.settings.n_seeds,
        };
        let mut report = StrategyReport {
            name: competitor.name().to_owned(),
            settings: spec
                .map_or("a strategy of the caller's".to_owned(), StrategySpec::description),
            unbiased: spec.is_none_or(StrategySpec::is_unbiased),
            setup_seconds: setup.cpu.unwrap_or(setup.wall),
            left_out: None,
            result: None,
        };
        match run.calibrate(self.settings.budget)? {
            SampleCount::OverBudget(why) => {
                report.left_out = Some(why);
                Ok((report, None))
            }
            SampleCount::Samples(n) => {
                spec.map_or(Ok(()), |spec| refuse_repeating_points(spec, n))?;
                let measured = run.measure(n)?;
                let picture = picture(&measured, &reference.picture.image, exposure)?;
                report.result = ResultReport::new(&measured, &picture.flip);
                Ok((report, Some(picture)))
            }
        }
    }

    /// The same for all pictures \[stops\].
    fn exposure(&self) -> f32 {
        match self.settings.exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => {
                let PreparedSceneRef { scene, camera, environment, .. } = self.view;
                automatic_exposure(scene, camera, environment, &self.settings.render)
            }
        }
    }
}

fn picture(
    measured: &StrategyMeasurement,
    reference: &RgbImage,
    exposure: f32,
) -> Result<Picture, Error> {
    let tone = ToneMapping { exposure, curve: ToneCurve::Standard };
    let shown = |image: &RgbImage| {
        let pixels = image.pixels.iter().map(|&p| tone.apply(p)).collect();
        RgbImage { pixels, ..*image }
    };
    let image = measured.image.clone();
    Ok(Picture {
        relative_error: relative_error_map(&image, reference)?,
        flip: ldr_flip(&shown(reference), &shown(&image), PIXELS_PER_DEGREE)?,
        image,
    })
}

impl ResultReport {
    fn new(measured: &StrategyMeasurement, flip: &[f32]) -> Option<Self> {
        let last = measured.steps.last()?;
        Some(Self {
            spp: last.spp,
            camera_samples: last.camera_samples,
            rays: last.rays,
            cpu_seconds: last.cpu_seconds,
            rel_mse: last.rel_mse,
            flip: flip.iter().map(|&e| f64::from(e)).sum::<f64>() / flip.len() as f64,
            bias: measured.bias.map(|bias| bias.mean),
            bias_interval: measured.bias.map(|bias| bias.interval),
            efficiency: 1.0 / (last.rel_mse.mean * last.cpu_seconds.mean),
            error_ratio_to_mis: None,
            efficiency_ratio_to_mis: None,
            non_finite_samples: measured.non_finite,
            convergence: measured.steps.clone(),
        })
    }
}

/// Fills in the ratios to the strategy of that index.
fn compare_with(of_mis: Option<usize>, strategies: &mut [StrategyReport]) {
    let mis = of_mis.and_then(|i| strategies[i].result.as_ref());
    let Some((error, efficiency)) = mis.map(|mis| (mis.rel_mse.mean, mis.efficiency)) else {
        return;
    };
    for result in strategies.iter_mut().filter_map(|s| s.result.as_mut()) {
        result.error_ratio_to_mis = Some(error / result.rel_mse.mean);
        result.efficiency_ratio_to_mis = Some(result.efficiency / efficiency);
    }
}

impl CompareReport {
    /// Complains about what the numbers do not show.
    fn warn(&self, host: &dyn Host) {
        for StrategyReport { name, left_out, result, unbiased, .. } in &self.strategies {
            if let Some(why) = left_out {
                host.warn(&format!("{name} is left out: {why}"));
            }
            let Some(result) = result else { continue };
            if let Some((what, off)) = self.miss(result) {
                host.warn(&format!("{name} misses the budget by {off:+.0} %: {what}"));
            }
            host.warn_of_non_finite(&format!("{name}: "), result.non_finite_samples);
            // Noise makes the estimate uncertain, never that much.
            let is_off = result.bias.is_some_and(|bias| bias > 0.5 * result.rel_mse.mean);
            if *unbiased && is_off && self.reference.source == Source::File {
                host.warn(&format!(
                    "{name} is unbiased, but the mean of its pictures differs from the \
                         reference: is that of another scene, light or filter, or noisy?"
                ));
            }
        }
        let results = self.strategies.iter().filter_map(|s| s.result.as_ref());
        let least = results.map(|r| r.rel_mse.mean).fold(f64::INFINITY, f64::min);
        if let Some(noise) = self.reference.rel_mse.filter(|&noise| noise > CONVERGED * least) {
            host.warn(&format!(
                "the reference's own error (relMSE {noise:.1e}) is part of the least one \
                     measured ({least:.1e}); raise --reference-spp"
            ));
        }
    }

    /// By how many percent a result is beside the budget, if that is much.
    fn miss(&self, result: &ResultReport) -> Option<(String, f64)> {
        let (spent, budget, unit) = match self.budget {
            Budget::Samples(_) => return None,
            Budget::Rays(rays) => (result.rays, rays, "shadow rays"),
            Budget::Time(seconds) => (result.cpu_seconds.mean, seconds, "CPU seconds"),
        };
        let off = spent / budget - 1.0;
        let what = format!("{spent:.3} {unit} with {} camera samples a pixel", result.spp);
        (off.abs() > TOLERANCE).then_some((what, 100.0 * off))
    }

    /// A line for each strategy that took part.
    pub fn summary(&self) -> Vec<String> {
        let width = self.strategies.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let line = |StrategyReport { name, result, unbiased, .. }: &StrategyReport| {
            let r = result.as_ref()?;
            let sd = r.rel_mse.sd.map_or(String::new(), |sd| format!(" ± {sd:.0e}"));
            let bias = if *unbiased { "" } else { ", biased" };
            let ratio = r.efficiency_ratio_to_mis;
            let ratio = ratio.map_or(String::new(), |x| format!(", efficiency {x:.2} of mis"));
            Some(format!(
                "{name:width$}  {:>6} spp  {:>7.1} rays  {:>7.3} CPU-s  relMSE {:.2e}{sd}{ratio}{bias}",
                r.spp, r.rays, r.cpu_seconds.mean, r.rel_mse.mean
            ))
        };
        self.strategies.iter().filter_map(line).collect()
    }
}
