//! `domelight compare`: strategies on one scene at equal samples, rays or time.

mod budget;
mod page;
mod pixels;
mod plots;
mod report;
mod strategy_run;

use std::path::Path;

use anyhow::{Context as _, Result};
use domelight::RgbImage;
use domelight::picture::compare::relative_error_map;
use domelight::picture::flip::{PIXELS_PER_DEGREE, ldr_flip};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::render::RenderSettings;
use domelight::strategy::{PreparedStrategy, StrategyKind};

pub(crate) use budget::Budget;

use crate::args::compare::CompareArguments;
use crate::command_line;
use crate::error::{UsageError, status, warn, warn_of_non_finite};
use crate::files;
use crate::interrupt;
use crate::measure::cache::Cache;
use crate::measure::reference::{Goal, Reference, Source};
use crate::measure::render::RenderSetup;
use crate::memory;
use crate::output::print_json;
use crate::parse::Size;
use crate::scene::{PreparedScene, start_threads};
use crate::strategy::{NamedStrategy, refuse_repeating_points};
use crate::usage::Stopwatch;
use report::{CompareReport, ResultReport, StrategyReport};
use strategy_run::{SampleCount, StrategyMeasurement, StrategyRun};

/// The relMSE of the reference should be this far below the least that is measured against it.
const CONVERGED: f64 = 0.2;

/// How far beside its budget a strategy may be without a word.
const TOLERANCE: f64 = 0.1;

/// Runs the subcommand.
pub(crate) fn run(arguments: &CompareArguments, quiet: bool) -> Result<()> {
    check(arguments)?;
    for path in [Some(&arguments.output), arguments.json.as_ref()].into_iter().flatten() {
        files::writes(path)?;
    }
    let Size { width, height } = arguments.scene.camera.size;
    memory::allow_picture(width, height, memory::COMPARED_PIXEL)?;
    start_threads(arguments.pixel.threads)?;
    interrupt::flag();
    let loading = interrupt::nothing_to_keep(interrupt::ENDED);
    let given = arguments.reference.as_deref();
    let given = given.map(|path| Reference::read(path, [width, height])).transpose()?;
    let view = arguments.scene.build(arguments.scene.load(quiet)?)?;
    drop(loading);
    let reference = match given {
        Some(reference) => reference,
        None => converged(arguments, &view, quiet)?,
    };
    let comparison = Comparison { arguments, view: &view, reference: &reference, quiet };
    let (report, pictures) = comparison.run()?;
    report.warn(quiet);
    write(arguments, &report, &pictures, &reference.picture.image)?;
    if !quiet {
        report.summarize(&arguments.output);
    }
    Ok(())
}

/// The reference that the cache may have.
fn converged(arguments: &CompareArguments, view: &PreparedScene, quiet: bool) -> Result<Reference> {
    let cache = Cache::unless(arguments.no_cache, arguments.cache.as_deref(), quiet);
    let settings = arguments.scene.render_settings(&arguments.pixel, 1);
    let goal = Goal::Samples(arguments.reference_spp);
    Reference::of_view(cache.as_ref(), view, settings, goal, quiet)
}

/// Refuses what does not go together.
fn check(arguments: &CompareArguments) -> Result<(), UsageError> {
    let standard_output = Path::new("-");
    if arguments.output == standard_output && arguments.json.as_deref() == Some(standard_output) {
        let why = "only one result can go to standard output; use -o FILE or --json=FILE";
        return Err(UsageError(why.into()));
    }
    let names: Vec<&str> = arguments.strategies.iter().map(|s| s.text.as_str()).collect();
    match names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)) {
        Some((_, name)) => Err(UsageError(format!("--strategies has '{name}' twice"))),
        None => Ok(()),
    }
}

fn write(
    arguments: &CompareArguments,
    report: &CompareReport,
    pictures: &[Option<Picture>],
    reference: &RgbImage,
) -> Result<()> {
    let page = page::page(report, pictures, reference)?;
    files::write(&arguments.output, |out| out.write_all(page.as_str().as_bytes()))?;
    let Some(path) = &arguments.json else { return Ok(()) };
    if path == Path::new("-") {
        return print_json(report);
    }
    let json = serde_json::to_string_pretty(report)?;
    files::write(path, |out| writeln!(out, "{json}"))
}

/// What the page shows of a strategy.
struct Picture {
    image: RgbImage,
    relative_error: Vec<f32>,
    flip: Vec<f32>,
}

/// All that the strategies share.
struct Comparison<'a> {
    arguments: &'a CompareArguments,
    view: &'a PreparedScene,
    reference: &'a Reference,
    quiet: bool,
}

impl Comparison<'_> {
    /// Measures all strategies; a picture for each that took part.
    fn run(&self) -> Result<(CompareReport, Vec<Option<Picture>>)> {
        let arguments = self.arguments;
        let settings = arguments.scene.render_settings(&arguments.pixel, 1);
        let mut strategies = Vec::new();
        let mut pictures = Vec::new();
        for strategy in &arguments.strategies {
            let (report, picture) = self
                .measure(strategy, settings)
                .with_context(|| format!("strategy {}", strategy.text))?;
            strategies.push(report);
            pictures.push(picture);
        }
        let of_mis = arguments.strategies.iter().position(|s| s.spec.kind() == StrategyKind::Mis);
        compare_with(of_mis, &mut strategies);
        let report = CompareReport {
            version: env!("CARGO_PKG_VERSION"),
            command: command_line::command(),
            budget: arguments.budget,
            scene: self.view.report.clone(),
            sampler: format!("{:?}", settings.sampler).to_lowercase(),
            filter: settings.filter.name(),
            seed: settings.seed,
            seeds: arguments.seeds,
            threads: rayon::current_num_threads(),
            exposure: arguments.exposure,
            reference: self.reference.report.clone(),
            strategies,
        };
        Ok((report, pictures))
    }

    fn measure(
        &self,
        strategy: &NamedStrategy,
        settings: RenderSettings,
    ) -> Result<(StrategyReport, Option<Picture>)> {
        let PreparedScene { scene, camera, environment, .. } = self.view;
        let mut watch = Stopwatch::start();
        let spec = strategy.spec.for_picture(scene, camera, environment, &settings);
        let prepared = PreparedStrategy::new(spec, environment)?;
        let setup = watch.lap();
        let render_setup =
            RenderSetup { view: self.view, settings, strategy: &prepared, quiet: self.quiet };
        let run = StrategyRun {
            render_setup,
            label: strategy.text.clone(),
            reference: &self.reference.picture.image,
            reference_noise: self.reference.report.rel_mse.unwrap_or(0.0),
            n_seeds: self.arguments.seeds,
        };
        let mut report = StrategyReport {
            name: strategy.text.clone(),
            settings: spec.description(),
            unbiased: spec.is_unbiased(),
            setup_seconds: setup.cpu.unwrap_or(setup.wall),
            left_out: None,
            result: None,
        };
        match run.calibrate(self.arguments.budget)? {
            SampleCount::OverBudget(why) => {
                report.left_out = Some(why);
                Ok((report, None))
            }
            SampleCount::Samples(n) => {
                refuse_repeating_points(spec, n)?;
                let measured = run.measure(n)?;
                let picture = self.picture(&measured)?;
                report.result = ResultReport::new(&measured, &picture.flip);
                Ok((report, Some(picture)))
            }
        }
    }

    fn picture(&self, measured: &StrategyMeasurement) -> Result<Picture> {
        let reference = &self.reference.picture.image;
        let tone = ToneMapping { exposure: self.arguments.exposure, curve: ToneCurve::Srgb };
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
    fn warn(&self, quiet: bool) {
        for StrategyReport { name, left_out, result, unbiased, .. } in &self.strategies {
            if let Some(why) = left_out {
                warn(quiet, &format!("{name} is left out: {why}"));
            }
            let Some(result) = result else { continue };
            if let Some((what, off)) = self.miss(result) {
                warn(quiet, &format!("{name} misses the budget by {off:+.0} %: {what}"));
            }
            warn_of_non_finite(quiet, &format!("{name}: "), result.non_finite_samples);
            // Noise makes the estimate uncertain, never that much.
            let is_off = result.bias.is_some_and(|bias| bias > 0.5 * result.rel_mse.mean);
            if *unbiased && is_off && self.reference.source == Source::File {
                warn(
                    quiet,
                    &format!(
                        "{name} is unbiased, but the mean of its pictures differs from the \
                         reference: is that of another scene, light or filter, or noisy?"
                    ),
                );
            }
        }
        let results = self.strategies.iter().filter_map(|s| s.result.as_ref());
        let least = results.map(|r| r.rel_mse.mean).fold(f64::INFINITY, f64::min);
        if let Some(noise) = self.reference.rel_mse.filter(|&noise| noise > CONVERGED * least) {
            warn(
                quiet,
                &format!(
                    "the reference's own error (relMSE {noise:.1e}) is part of the least one \
                     measured ({least:.1e}); raise --reference-spp"
                ),
            );
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

    /// A line a strategy on standard error.
    fn summarize(&self, output: &Path) {
        let width = self.strategies.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        for StrategyReport { name, result, unbiased, .. } in &self.strategies {
            let Some(r) = result else { continue };
            let sd = r.rel_mse.sd.map_or(String::new(), |sd| format!(" ± {sd:.0e}"));
            let bias = if *unbiased { "" } else { ", biased" };
            let ratio = r.efficiency_ratio_to_mis;
            let ratio = ratio.map_or(String::new(), |x| format!(", efficiency {x:.2} of mis"));
            status(&format!(
                "{name:width$}  {:>6} spp  {:>7.1} rays  {:>7.3} CPU-s  relMSE {:.2e}{sd}{ratio}{bias}",
                r.spp, r.rays, r.cpu_seconds.mean, r.rel_mse.mean
            ));
        }
        status(&format!("-> {}", output.display()));
    }
}
