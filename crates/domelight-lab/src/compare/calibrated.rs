//! A comparison with prepared and calibrated strategies: renders the reference and the pictures.

use domelight::environment::Environment;
use domelight::picture::compare::compare;
use domelight::picture::tone::ToneMapping;
use domelight::strategy::{PreparedStrategy, StrategyKind, StrategySpec};
use domelight::{Rgb, RgbImage};

use super::report::{CompareReport, ResultReport, StrategyReport};
use super::strategy_run::{Calibration, Pilot, SampleCount, StrategyRun, samples_to_measure};
use super::{
    Budget, CONVERGED, Comparison, ComparisonResult, Competitor, OtherPicture, Picture,
    compare_with, picture,
};
use crate::measure::render::{Picturing, RenderSetup, Shown};
use crate::measure::work::{Work, WorkStage};
use crate::measure::{Cache, Goal, PRODUCT, Reference, ReferenceRun};
use crate::strategy::{NamedStrategy, refuse_repeating_points};
use crate::usage::Stopwatch;
use crate::{At as _, Error, Host};

/// Samples of the calibrating pictures, in multiples of the budget's, as planned.
const PILOTS: f64 = 2.0;

/// A mean of another renderer's picture may differ by this part of the reference's without a word.
const MEAN_TOLERANCE: f64 = 0.02;

/// A comparison in which the number of samples of each strategy is known.
pub struct CalibratedComparison<'c, 'a> {
    comparison: &'c Comparison<'a>,
    host: &'c dyn Host,
    work: Work<'c>,
    /// In the order of the competitors; none of pictures.
    strategies: Vec<Option<CalibratedStrategy<'a>>>,
}

/// A strategy that is ready to render as many samples as the budget buys.
struct CalibratedStrategy<'a> {
    spec: Option<StrategySpec>,
    strategy: Held<'a>,
    setup_seconds: f64,
    calibration: Calibration,
}

/// A strategy that was made for the comparison, or one of the caller's.
enum Held<'a> {
    Prepared(Box<PreparedStrategy<'a>>),
    Lent(&'a dyn Picturing),
}

impl<'a> Held<'a> {
    fn get(&self) -> &dyn Picturing {
        match self {
            Self::Prepared(strategy) => &**strategy,
            Self::Lent(strategy) => *strategy,
        }
    }

    fn of_spec(
        spec: StrategySpec,
        environment: &'a Environment,
        host: &dyn Host,
    ) -> Result<Self, Error> {
        Ok(Self::Prepared(Box::new(host.prepare(spec, environment)?)))
    }
}

impl<'c, 'a> CalibratedComparison<'c, 'a> {
    pub(super) fn new(comparison: &'c Comparison<'a>, host: &'c dyn Host) -> Result<Self, Error> {
        let n_competitors = comparison.competitors.len();
        let work = Work::new(host, n_competitors + 1, &comparison.settings.render);
        let mut calibrated = Self { comparison, host, work, strategies: Vec::new() };
        calibrated.plan();
        for (i, competitor) in comparison.competitors.iter().enumerate() {
            let strategy = calibrated.calibrate(i, competitor);
            let strategy = strategy.at(format_args!("strategy {}", competitor.name()))?;
            calibrated.strategies.push(strategy);
        }
        Ok(calibrated)
    }

    /// Plans what is known before anything was rendered.
    fn plan(&self) {
        let settings = &self.comparison.settings;
        // Most strategies continue.
        let n_pictures = PILOTS + samples_to_measure(settings.n_seeds, true);
        for (i, competitor) in self.comparison.competitors.iter().enumerate() {
            let each = match settings.budget {
                _ if matches!(competitor, Competitor::Pictures(_)) => 0.0,
                Budget::Samples(n) => f64::from(n) * units_per_sample(competitor),
                Budget::Rays(rays) => rays,
                Budget::Time(seconds) => self.work.units_of(seconds),
            };
            self.work.plan(i, n_pictures * each);
        }
        self.plan_reference(settings.reference_spp);
    }

    fn plan_reference(&self, spp: u32) {
        let stage = self.reference_stage();
        self.work.plan(stage.stage, f64::from(spp) * stage.units_per_sample);
    }

    fn reference_stage(&self) -> WorkStage<'_> {
        let units_per_sample = f64::from(PRODUCT.points_per_sample());
        WorkStage { work: &self.work, stage: self.comparison.competitors.len(), units_per_sample }
    }

    /// Prepares a strategy and finds how many samples its budget buys; none of pictures.
    fn calibrate(
        &self,
        index: usize,
        competitor: &'c Competitor<'a>,
    ) -> Result<Option<CalibratedStrategy<'a>>, Error> {
        let Comparison { view, settings, .. } = self.comparison;
        let mut watch = Stopwatch::start();
        let (spec, strategy) = match competitor {
            Competitor::Named(NamedStrategy { spec, .. }) => {
                let (scene, camera) = (view.scene, view.camera);
                let spec = spec.for_picture(scene, camera, view.environment, &settings.render);
                (Some(spec), Held::of_spec(spec, view.environment, self.host)?)
            }
            Competitor::Own { strategy, .. } => (None, Held::Lent(*strategy)),
            Competitor::Pictures(_) => return Ok(None),
        };
        let setup = watch.lap();
        let run = self.strategy_run(index, competitor, &strategy);
        let calibration = run.calibrate(settings.budget)?;
        let left = match &calibration.samples {
            SampleCount::Samples(n) => {
                spec.map_or(Ok(()), |spec| refuse_repeating_points(spec, *n))?;
                let n_pictures = samples_to_measure(settings.n_seeds, run.render_setup.continues());
                f64::from(*n) * units_per_sample(competitor) * n_pictures
            }
            SampleCount::OverBudget(_) => 0.0,
        };
        self.work.plan(index, left);
        let setup_seconds = setup.cpu.unwrap_or(setup.wall);
        Ok(Some(CalibratedStrategy { spec, strategy, setup_seconds, calibration }))
    }

    fn strategy_run<'s>(
        &'s self,
        stage: usize,
        competitor: &'s Competitor,
        strategy: &'s Held,
    ) -> StrategyRun<'s> {
        let units_per_sample = units_per_sample(competitor);
        StrategyRun {
            render_setup: RenderSetup {
                view: self.comparison.view,
                settings: self.comparison.settings.render,
                strategy: strategy.get(),
                host: self.host,
                shown: Shown::PartOf(WorkStage { work: &self.work, stage, units_per_sample }),
            },
            label: competitor.name().to_owned(),
            n_seeds: self.comparison.settings.n_seeds,
        }
    }

    /// The converged picture of the view, from the cache if available, otherwise rendered with more samples until its
    /// error is at most a tenth of the smallest error expected of a strategy, as far as the settings allow.
    ///
    /// # Errors
    /// If the camera does not see the scene, or the host ended the work.
    pub fn reference(&self, cache: Option<&Cache>) -> Result<Reference, Error> {
        let settings = &self.comparison.settings;
        let mut spp = settings.reference_spp;
        loop {
            self.plan_reference(spp);
            let reference = self.reference_of(spp, cache)?;
            self.plan_reference(0);
            let noise = reference.report.rel_mse.unwrap_or(0.0);
            let least = self.least_expected(&reference)?;
            let next = grown(spp, noise, least, settings.most_reference_spp);
            if next <= spp {
                return Ok(reference);
            }
            spp = next;
        }
    }

    fn reference_of(&self, spp: u32, cache: Option<&Cache>) -> Result<Reference, Error> {
        let run = ReferenceRun {
            cache,
            view: self.comparison.view,
            strategy: PRODUCT,
            settings: self.comparison.settings.render,
            shown: Shown::PartOf(self.reference_stage()),
            host: self.host,
        };
        run.reach(Goal::Samples(spp))
    }

    /// The least relMSE that a competitor's picture will have, by the pilots; infinite where there are none.
    fn least_expected(&self, reference: &Reference) -> Result<f64, Error> {
        let image = &reference.picture.image;
        let noise = reference.report.rel_mse.unwrap_or(0.0);
        let mut least = f64::INFINITY;
        for (competitor, strategy) in self.comparison.competitors.iter().zip(&self.strategies) {
            let error = match (competitor, strategy) {
                (Competitor::Pictures(other), _) => {
                    Pilot::new(1, other.image.clone()).error_at(1, image, noise)?
                }
                (_, Some(CalibratedStrategy { calibration, .. })) => {
                    match (&calibration.samples, &calibration.pilot) {
                        (SampleCount::Samples(n), Some(pilot)) => {
                            pilot.error_at(*n, image, noise)?
                        }
                        _ => continue,
                    }
                }
                _ => continue,
            };
            // A picture that is wrong everywhere asks for nothing.
            least = if error.is_finite() { least.min(error) } else { least };
        }
        Ok(least)
    }

    /// Measures all competitors against a reference.
    ///
    /// # Errors
    /// If the sizes differ, or the host ended the work.
    pub fn run(&self, reference: &Reference) -> Result<ComparisonResult, Error> {
        let Comparison { view, settings, competitors } = self.comparison;
        let (exposure, curve) = (self.comparison.exposure(), settings.tone);
        let tone = ToneMapping { exposure, curve };
        let (mut strategies, mut pictures) = (Vec::new(), Vec::new());
        for (i, competitor) in competitors.iter().enumerate() {
            let measured = match (competitor, &self.strategies[i]) {
                (Competitor::Pictures(other), _) => self.measure_picture(other, reference, tone),
                (_, Some(strategy)) => self.measure(i, strategy, reference, tone),
                (_, None) => continue,
            };
            let (report, picture) = measured.at(format_args!("strategy {}", competitor.name()))?;
            strategies.push(report);
            pictures.push(picture);
        }
        let is_mis = |competitor: &Competitor| matches!(competitor, Competitor::Named(s) if s.spec.kind() == StrategyKind::Mis);
        compare_with(competitors.iter().position(is_mis), &mut strategies);
        let report = CompareReport {
            version: env!("CARGO_PKG_VERSION"),
            command: settings.command.clone(),
            budget: settings.budget,
            scene: view.report.clone(),
            sampler: settings.render.sampler.name(),
            filter: settings.render.filter.name(),
            seed: settings.render.seed,
            seeds: settings.n_seeds,
            threads: rayon::current_num_threads(),
            exposure,
            tone: curve.name(),
            reference: reference.report.clone(),
            strategies,
        };
        report.warn(self.host);
        Ok(ComparisonResult { report, pictures, reference: reference.picture.image.clone() })
    }

    fn measure(
        &self,
        index: usize,
        strategy: &CalibratedStrategy,
        reference: &Reference,
        tone: ToneMapping,
    ) -> Result<(StrategyReport, Option<Picture>), Error> {
        let competitor = &self.comparison.competitors[index];
        let CalibratedStrategy { spec, strategy, setup_seconds, calibration } = strategy;
        let mut report = StrategyReport {
            name: competitor.name().to_owned(),
            settings: spec.map_or("a custom strategy".to_owned(), StrategySpec::description),
            unbiased: Some(spec.is_none_or(StrategySpec::is_unbiased)),
            setup_seconds: *setup_seconds,
            left_out: None,
            result: None,
        };
        match &calibration.samples {
            SampleCount::OverBudget(why) => {
                report.left_out = Some(why.clone());
                Ok((report, None))
            }
            SampleCount::Samples(n) => {
                let run = self.strategy_run(index, competitor, strategy);
                let measured = run.measure(*n, reference)?;
                let picture = picture(&measured.image, &reference.picture.image, tone)?;
                report.result = ResultReport::of_strategy(&measured, &picture);
                Ok((report, Some(picture)))
            }
        }
    }

    fn measure_picture(
        &self,
        other: &OtherPicture,
        reference: &Reference,
        tone: ToneMapping,
    ) -> Result<(StrategyReport, Option<Picture>), Error> {
        let reference = &reference.picture.image;
        let (image, n_non_finite) = without_non_finite(&other.image);
        let compared = compare(&image, reference, None)?;
        self.warn_of_brightness(&other.name, &image, reference);
        let picture = picture(&image, reference, tone)?;
        let (rel_mse, seconds) = (compared.rel_mse, other.seconds);
        let report = StrategyReport {
            name: other.name.clone(),
            settings: format!("a picture by another renderer, {seconds} s as stated"),
            unbiased: None,
            setup_seconds: 0.0,
            left_out: None,
            result: Some(ResultReport::of_picture(seconds, rel_mse, &picture, n_non_finite)),
        };
        Ok((report, Some(picture)))
    }

    /// Complains about a picture that is brighter or darker than the reference as a whole.
    fn warn_of_brightness(&self, name: &str, image: &RgbImage, reference: &RgbImage) {
        let sum = |image: &RgbImage| -> f64 {
            image.pixels.iter().map(|pixel| f64::from(pixel.luminance())).sum()
        };
        let off = sum(image) / sum(reference) - 1.0;
        if off.abs() > MEAN_TOLERANCE {
            self.host.warn(&format!(
                "the picture {name} differs from the reference by {:+.1} % in brightness: part of \
                 its error comes from another light, exposure or material",
                100.0 * off
            ));
        }
    }
}

/// What a camera sample of each pixel counts as in the work: its shadow rays.
fn units_per_sample(competitor: &Competitor) -> f64 {
    match competitor {
        Competitor::Named(strategy) => f64::from(strategy.spec.points_per_sample()),
        Competitor::Own { .. } | Competitor::Pictures(_) => 1.0,
    }
}

/// Camera samples of a reference whose error is small beside `least`, if `spp` samples leave `noise`: a power of two
/// times as many, up to `most`; `spp` where that is enough.
fn grown(spp: u32, noise: f64, least: f64, most: u32) -> u32 {
    /// Errors are estimates.
    const MARGIN: f64 = 1.2;
    let ratio = noise / (CONVERGED * least);
    if ratio.is_nan() || ratio <= 1.0 {
        return spp;
    }
    let doublings = (MARGIN * ratio).log2().ceil().clamp(1.0, 24.0);
    (f64::from(spp) * doublings.exp2()).min(f64::from(most.max(spp))) as u32
}

/// The picture with black pixels instead of those that are NaN or infinite, and their number.
fn without_non_finite(image: &RgbImage) -> (RgbImage, u64) {
    let finite = |pixel: &Rgb| if pixel.is_finite() { *pixel } else { Rgb::BLACK };
    let pixels: Vec<Rgb> = image.pixels.iter().map(finite).collect();
    let n = image.pixels.iter().filter(|pixel| !pixel.is_finite()).count() as u64;
    (RgbImage { pixels, ..*image }, n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_grow_until_they_are_good_enough() {
        assert_eq!(grown(64, 1e-5, 1e-3, 1024), 64);
        assert_eq!(grown(64, 1e-5, f64::INFINITY, 1024), 64);
        assert_eq!(grown(64, 1.5e-4, 1e-3, 1024), 128);
        assert_eq!(grown(64, 4e-4, 1e-3, 1024), 512);
        assert_eq!(grown(64, 1e-2, 1e-3, 1024), 1024);
        assert_eq!(grown(64, 1e-2, 0.0, 1024), 1024);
        // Settings that allow no more.
        assert_eq!(grown(64, 1e-2, 1e-3, 64), 64);
        assert_eq!(grown(64, 1e-2, 1e-3, 16), 64);
        assert_eq!(grown(64, f64::NAN, 1e-3, 1024), 64);
    }

    #[test]
    fn pixels_that_are_no_numbers_are_black() {
        let mut image = RgbImage::filled(2, 1, Rgb::WHITE);
        image.pixels[1].g = f32::NAN;
        let (finite, n) = without_non_finite(&image);
        assert_eq!((finite.pixels, n), (vec![Rgb::WHITE, Rgb::BLACK], 1));
    }
}
