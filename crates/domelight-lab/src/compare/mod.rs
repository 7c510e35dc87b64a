//! Compares strategies on one scene at equal samples, rays or time.

mod budget;
mod calibrated;
mod page;
mod pictures;
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
use domelight::strategy::Strategy;

pub use budget::{BadBudget, Budget};
pub use calibrated::CalibratedComparison;
pub use pictures::{OtherPicture, read_pictures};
pub use report::{CompareReport, ResultReport, StrategyReport};
pub use strategy_run::{ConvergencePoint, MeanAndDeviation};

use crate::measure::Source;
use crate::measure::render::Picturing;
use crate::scene::PreparedSceneRef;
use crate::strategy::NamedStrategy;
use crate::{Error, Host};
use strategy_run::StrategyMeasurement;

/// The relMSE of the reference should be at most this part of the least that is measured against it.
const CONVERGED: f64 = 0.1;

/// How far a strategy may miss its budget without a warning.
const TOLERANCE: f64 = 0.1;

/// The settings common to all strategies of a comparison.
#[derive(Clone, Debug)]
pub struct ComparisonSettings {
    /// Settings of each picture, except for the number of samples.
    pub render: RenderSettings,
    /// The budget of each picture.
    pub budget: Budget,
    /// The number of pictures per strategy, with seeds from that of `render` on.
    pub n_seeds: u32,
    /// The exposure for ꟻLIP and of the page when it opens; automatic is [`automatic_exposure`].
    pub exposure: Exposure,
    /// The tone curve for ꟻLIP and of the page when it opens.
    pub tone: ToneCurve,
    /// The number of camera samples per pixel of a rendered reference, at least 2.
    pub reference_spp: u32,
    /// The maximum number of camera samples per pixel of the reference, which gets more samples until its relMSE is
    /// at most a tenth of the smallest error expected of a strategy.
    pub most_reference_spp: u32,
    /// The command that makes the report again, for readers.
    pub command: String,
}

impl Default for ComparisonSettings {
    fn default() -> Self {
        Self {
            render: RenderSettings::default(),
            budget: Budget::Rays(32.0),
            n_seeds: 4,
            exposure: Exposure::Auto,
            tone: ToneCurve::Agx,
            reference_spp: 64,
            most_reference_spp: 1024,
            command: String::new(),
        }
    }
}

/// Strategies on one scene at equal samples, rays or time, before any of them has rendered.
pub struct Comparison<'a> {
    view: PreparedSceneRef<'a>,
    settings: ComparisonSettings,
    competitors: Vec<Competitor<'a>>,
}

/// Who takes part.
enum Competitor<'a> {
    Named(NamedStrategy),
    Own { name: String, strategy: &'a dyn Picturing },
    Pictures(OtherPicture),
}

impl Competitor<'_> {
    fn name(&self) -> &str {
        match self {
            Self::Named(NamedStrategy { text, .. }) => text,
            Self::Own { name, .. } | Self::Pictures(OtherPicture { name, .. }) => name,
        }
    }
}

/// The results of a comparison.
#[derive(Debug)]
pub struct ComparisonResult {
    /// All numbers.
    pub report: CompareReport,
    /// The first seed's picture of each strategy and its errors; `None` for strategies that were left out.
    pub pictures: Vec<Option<Picture>>,
    /// The reference of the errors.
    pub reference: RgbImage,
}

/// A picture and its errors.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Radiance.
    pub image: RgbImage,
    /// |I − R| / √(R² + 0.01), averaged over the channels, row by row.
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
    /// Creates a comparison without strategies.
    pub fn new(view: PreparedSceneRef<'a>, settings: ComparisonSettings) -> Self {
        Self { view, settings, competitors: Vec::new() }
    }

    /// Adds a built-in strategy.
    ///
    /// # Errors
    /// If one of that name does already.
    pub fn add_named(&mut self, strategy: NamedStrategy) -> Result<(), Error> {
        self.add_competitor(Competitor::Named(strategy))
    }

    /// Adds a strategy of any type. It counts as unbiased; the report has a warning if it is not.
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

    /// Adds a picture by another renderer.
    ///
    /// # Errors
    /// If it has another size than the comparison, or one of that name takes part already.
    pub fn add_picture(&mut self, picture: OtherPicture) -> Result<(), Error> {
        let RenderSettings { width, height, .. } = self.settings.render;
        let OtherPicture { name, image, seconds } = &picture;
        if [image.width, image.height] != [width, height] {
            let (w, h) = (image.width, image.height);
            let why = format!(
                "the picture {name} is {w}x{h}, but the comparison renders {width}x{height}: all \
                 must have the same size; give --size {w}x{h}, or the picture of {name} in \
                 {width}x{height}"
            );
            return Err(Error::Usage(why));
        }
        if !(*seconds > 0.0 && seconds.is_finite()) {
            let why = format!("the picture {name} took {seconds} s; a time must be above 0");
            return Err(Error::Usage(why));
        }
        self.add_competitor(Competitor::Pictures(picture))
    }

    fn add_competitor(&mut self, competitor: Competitor<'a>) -> Result<(), Error> {
        let name = competitor.name();
        if self.competitors.iter().any(|other| other.name() == name) {
            let why = format!("'{name}' takes part twice: remove one, or rename it");
            return Err(Error::Usage(why));
        }
        self.competitors.push(competitor);
        Ok(())
    }

    /// Prepares all strategies and determines with pilot pictures how many samples of each the budget allows.
    ///
    /// # Errors
    /// If a strategy does not suit the environment, the scene is not in sight, or the host ended the work.
    pub fn calibrate<'c>(
        &'c self,
        host: &'c dyn Host,
    ) -> Result<CalibratedComparison<'c, 'a>, Error> {
        CalibratedComparison::new(self, host)
    }

    /// The same for all pictures \[stops\].
    fn exposure(&self) -> f32 {
        match self.settings.exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => {
                let PreparedSceneRef { scene, camera, environment, .. } = self.view;
                automatic_exposure(scene, camera, environment, &self.settings.render).stops
            }
        }
    }
}

fn picture(image: &RgbImage, reference: &RgbImage, tone: ToneMapping) -> Result<Picture, Error> {
    let shown = |image: &RgbImage| {
        let pixels = image.pixels.iter().map(|&p| tone.apply(p)).collect();
        RgbImage { pixels, ..*image }
    };
    Ok(Picture {
        relative_error: relative_error_map(image, reference)?,
        flip: ldr_flip(&shown(reference), &shown(image), PIXELS_PER_DEGREE)?,
        image: image.clone(),
    })
}

impl Picture {
    fn mean_flip(&self) -> f64 {
        self.flip.iter().map(|&e| f64::from(e)).sum::<f64>() / self.flip.len() as f64
    }
}

impl ResultReport {
    fn of_strategy(measured: &StrategyMeasurement, picture: &Picture) -> Option<Self> {
        let last = measured.steps.last()?;
        Some(Self {
            spp: Some(last.spp),
            camera_samples: Some(last.camera_samples),
            rays: Some(last.rays),
            cpu_seconds: last.cpu_seconds,
            rel_mse: last.rel_mse,
            flip: picture.mean_flip(),
            bias: measured.bias.map(|bias| bias.mean),
            bias_interval: measured.bias.map(|bias| bias.interval),
            efficiency: 1.0 / (last.rel_mse.mean * last.cpu_seconds.mean),
            error_ratio_to_mis: None,
            efficiency_ratio_to_mis: None,
            non_finite_samples: measured.non_finite,
            convergence: measured.steps.clone(),
        })
    }

    fn of_picture(seconds: f64, rel_mse: f64, picture: &Picture, n_non_finite: u64) -> Self {
        Self {
            spp: None,
            camera_samples: None,
            rays: None,
            cpu_seconds: MeanAndDeviation::single(seconds),
            rel_mse: MeanAndDeviation::single(rel_mse),
            flip: picture.mean_flip(),
            bias: None,
            bias_interval: None,
            efficiency: 1.0 / (rel_mse * seconds),
            error_ratio_to_mis: None,
            efficiency_ratio_to_mis: None,
            non_finite_samples: n_non_finite,
            convergence: Vec::new(),
        }
    }
}

/// Fills in the ratios to the strategy of that index.
fn compare_with(of_mis: Option<usize>, strategies: &mut [StrategyReport]) {
    let mis = of_mis.and_then(|i| strategies[i].result.as_ref());
    let Some((error, efficiency)) = mis.map(|mis| (mis.rel_mse.mean, mis.efficiency)) else {
        return;
    };
    for result in strategies.iter_mut().filter_map(|s| s.result.as_mut()) {
        // Strategies without error have no ratio.
        let ratio = |x: f64| Some(x).filter(|x| x.is_finite());
        result.error_ratio_to_mis = ratio(error / result.rel_mse.mean);
        result.efficiency_ratio_to_mis = ratio(result.efficiency / efficiency);
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
            let n = result.non_finite_samples;
            match unbiased {
                Some(_) => host.warn_of_non_finite(&format!("{name}: "), n),
                None if n > 0 => {
                    host.warn(&format!(
                        "{name}: {n} values are NaN or infinite and count as black"
                    ));
                }
                None => {}
            }
            // Noise makes the estimate uncertain, never that much.
            let is_off = result.bias.is_some_and(|bias| bias > 0.5 * result.rel_mse.mean);
            if *unbiased == Some(true) && is_off && self.reference.source == Source::File {
                host.warn(&format!(
                    "{name} is unbiased, but the mean of its pictures differs from the reference: \
                     does the reference show another scene, light or filter, or is it noisy?"
                ));
            }
        }
        let results = self.strategies.iter().filter_map(|s| s.result.as_ref());
        let least = results.map(|r| r.rel_mse.mean).fold(f64::INFINITY, f64::min);
        if let Some(noise) = self.reference.rel_mse.filter(|&noise| noise > CONVERGED * least) {
            host.warn(&format!(
                "the reference's own error (relMSE {noise:.1e}) is part of the least one \
                     measured ({least:.1e}); give a larger --reference-spp"
            ));
        }
    }

    /// The difference of a result's cost from the budget \[%\], if it is large.
    fn miss(&self, result: &ResultReport) -> Option<(String, f64)> {
        // The samples of another renderer's picture are unknown.
        let spp = result.spp?;
        let (spent, budget, unit) = match self.budget {
            Budget::Samples(_) => return None,
            Budget::Rays(rays) => (result.rays?, rays, "shadow rays"),
            Budget::Time(seconds) => (result.cpu_seconds.mean, seconds, "CPU seconds"),
        };
        let off = spent / budget - 1.0;
        let what = format!("{spent:.3} {unit} with {spp} camera samples per pixel");
        (off.abs() > TOLERANCE).then_some((what, 100.0 * off))
    }

    /// One line per strategy.
    pub fn summary(&self) -> Vec<String> {
        let width = self.strategies.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        let line = |StrategyReport { name, result, unbiased, .. }: &StrategyReport| {
            let r = result.as_ref()?;
            let sd = r.rel_mse.sd.map_or(String::new(), |sd| format!(" ± {sd:.0e}"));
            let bias = if *unbiased == Some(false) { ", biased" } else { "" };
            let ratio = r.efficiency_ratio_to_mis;
            let ratio = ratio.map_or(String::new(), |x| format!(", efficiency {x:.2} of mis"));
            let spp = r.spp.map_or("–".to_owned(), |spp| spp.to_string());
            let rays = r.rays.map_or("–".to_owned(), |rays| format!("{rays:.1}"));
            Some(format!(
                "{name:width$}  {spp:>6} spp  {rays:>7} rays  {:>7.3} CPU-s  relMSE {:.2e}{sd}{ratio}{bias}",
                r.cpu_seconds.mean, r.rel_mse.mean
            ))
        };
        self.strategies.iter().filter_map(line).collect()
    }
}
