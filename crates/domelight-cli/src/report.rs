//! The report of a render, as JSON or as two lines of text.

use anyhow::Result;
use domelight::render::{Counts, Layers, Provenance, RenderSettings, Rendering};
use domelight::strategy::StrategySpec;
use domelight_lab::job::{Pixel, Sampling};
use domelight_lab::report::SceneReport;
use domelight_lab::{Acceptance, Host as _, Seconds, peak_memory};
use serde::Serialize;
use std::path::Path;

use crate::error::{Interrupted, InterruptedAndSaved, status, status_lines};
use crate::output::{self, PicturePath};
use crate::profile::{self, StageSeconds};
use crate::terminal::Terminal;
use crate::tone::{Shown, denoised_line};

/// The settings of the render, enough to make the same picture again.
#[derive(Serialize)]
pub(crate) struct Settings {
    #[serde(flatten)]
    pub(crate) scene: SceneReport,
    /// With the pilot's choices; `adaptive` only if the strategy adapts.
    #[serde(flatten)]
    pub(crate) sampling: Sampling,
    #[serde(flatten)]
    pub(crate) pixel: Pixel,
    pub(crate) threads: usize,
    /// The exposure by the light \[stops\].
    pub(crate) automatic_exposure: f32,
    /// The attributes from which the same picture can be rendered again.
    #[serde(skip)]
    pub(crate) job: Vec<(String, String)>,
}

impl Settings {
    fn strategy(&self) -> StrategySpec {
        self.sampling.strategy.0.spec
    }

    /// The provenance stored in OpenEXR files.
    pub(crate) fn provenance(&self, settings: &RenderSettings) -> Vec<(String, String)> {
        let provenance = Provenance {
            scene: &self.scene.scene,
            environment: self.scene.environment.probe(),
            strategy: &self.strategy().description(),
            settings,
            exposure: self.automatic_exposure,
        };
        provenance.attributes().into_iter().chain(self.job.clone()).collect()
    }
}

/// Where the time went.
#[derive(Serialize)]
pub(crate) struct Timings {
    /// Reading or creating the scene and the probe.
    pub(crate) load: Seconds,
    /// The BVH and the environment's table.
    pub(crate) build: Seconds,
    pub(crate) render: Seconds,
    /// Encoding and writing pictures.
    pub(crate) write: Seconds,
    /// The wall-clock time since the program began.
    pub(crate) total: f64,
}

/// What ended a render before all samples were there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum StopReason {
    Interrupted,
    Time,
}

/// The output of `--json`.
#[derive(Serialize)]
pub(crate) struct RenderReport {
    version: &'static str,
    settings: Settings,
    seconds: Timings,
    /// Camera samples of a pixel, as counted; the mean over those that have any.
    samples_per_pixel: f64,
    camera_rays: u64,
    shading_points: u64,
    shadow_rays: u64,
    /// Those that this run sent ahead of the picture, to find portals and by scouts.
    rays_ahead: u64,
    rays_per_second: f64,
    peak_memory_bytes: Option<u64>,
    non_finite_samples: u64,
    /// The acceptance of the strategy rejection, at the centers of pixels spread over the picture.
    rejection: Option<Acceptance>,
    /// Portals that were found, because the scene names none, in the notation of `--portal`.
    pub(crate) found_portals: Option<String>,
    complete: bool,
    stopped: Option<StopReason>,
    outputs: Vec<String>,
    /// How PNG output is developed, if there is any.
    pub(crate) png: Option<Shown>,
    /// How output was denoised, if it was.
    pub(crate) denoised: Option<String>,
    /// CPU seconds by stage of the render, if requested.
    pub(crate) profile: Option<Vec<StageSeconds>>,
}

/// The names, of many the first and the last.
fn listed(names: &[String]) -> String {
    match names {
        [first, second, .., last] if names.len() > 6 => format!("{first}, {second} … {last}"),
        _ => names.join(", "),
    }
}

/// The mean number of camera samples of pixels that have any.
fn mean_samples(layers: &Layers) -> f64 {
    let counts = || layers.n_samples.iter().filter(|&&n| n > 0);
    let sum: u64 = counts().map(|&n| u64::from(n)).sum();
    sum as f64 / counts().count().max(1) as f64
}

impl RenderReport {
    /// The report of a run that continues the work of `earlier` ones, whose rays do not count as its speed.
    pub(crate) fn new(
        settings: Settings,
        rendering: &Rendering,
        earlier: &Counts,
        seconds: Timings,
        rejection: Option<Acceptance>,
        outputs: &[PicturePath],
        stopped: Option<StopReason>,
    ) -> Self {
        let counts = rendering.counts;
        let n_rays = |counts: &Counts| counts.camera_rays + counts.shadow_rays;
        let rays = n_rays(&counts).saturating_sub(n_rays(earlier)) as f64;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            settings,
            rays_per_second: rays / seconds.render.wall.max(1e-9),
            seconds,
            samples_per_pixel: mean_samples(&rendering.layers),
            camera_rays: counts.camera_rays,
            shading_points: counts.shading_points,
            shadow_rays: counts.shadow_rays,
            rays_ahead: rendering.rays_ahead,
            peak_memory_bytes: peak_memory(),
            non_finite_samples: counts.non_finite,
            rejection,
            found_portals: None,
            complete: rendering.complete,
            stopped,
            outputs: outputs.iter().map(ToString::to_string).collect(),
            png: None,
            denoised: None,
            profile: None,
        }
    }

    pub(crate) fn print_json(&self) -> Result<()> {
        output::print_json(self)
    }

    /// Two lines on standard error.
    pub(crate) fn print_summary(&self) {
        let Settings { scene, sampling, .. } = &self.settings;
        let Sampling { spp, target_error, adaptive, .. } = sampling;
        let strategy = self.settings.strategy().description();
        let SceneReport { scene, environment, size: [w, h], .. } = scene;
        let environment = environment.probe();
        let Timings { load, build, render, write, total } = &self.seconds;
        let up_to = if target_error.is_some() { "up to " } else { "" };
        let cpu = render.cpu.map_or(String::new(), |cpu| format!(" ({cpu:.2} CPU-s)"));
        let taken = if *adaptive || target_error.is_some() {
            format!(" ({:.1} taken)", self.samples_per_pixel)
        } else {
            String::new()
        };
        status(&format!(
            "{scene} under {environment}: {w}x{h}, {up_to}{spp} samples per pixel{taken}, {strategy}"
        ));
        let png = self.png.map_or(String::new(), |shown| format!(" (PNG at {shown})"));
        status(&format!(
            "loaded in {:.2} s, built in {:.2} s, rendered in {:.2} s{cpu}, {:.1} Mrays/s -> {}{png}",
            load.wall,
            build.wall,
            render.wall,
            self.rays_per_second * 1e-6,
            listed(&self.outputs)
        ));
        if self.stopped == Some(StopReason::Time) {
            status(&format!(
                "ended by --time after {total:.2} s, of which {:.2} s loading and building, {:.2} s writing",
                load.wall + build.wall,
                write.wall
            ));
        }
        if let Some(by) = &self.denoised {
            status(&denoised_line(by));
        }
        if let Some(profile) = &self.profile {
            status_lines(&profile::lines(profile));
        }
    }

    /// Warns about what the picture lacks.
    ///
    /// # Errors
    /// If the render was interrupted, or time ended it before a part was whole.
    pub(crate) fn check(&self, saved: Option<&Path>, is_part: bool, quiet: bool) -> Result<()> {
        Terminal { quiet }.warn_of_non_finite("", self.non_finite_samples);
        match (self.stopped, saved) {
            (Some(StopReason::Interrupted), None) => Err(Interrupted(format!(
                "interrupted; the picture so far is in {}",
                self.outputs.join(", ")
            ))
            .into()),
            (Some(StopReason::Interrupted), Some(saved)) => Err(InterruptedAndSaved(format!(
                "interrupted; {} holds the state to resume from",
                saved.display()
            ))
            .into()),
            (Some(StopReason::Time), Some(part)) if is_part => Err(InterruptedAndSaved(format!(
                "the time is up; {} holds the state to resume from",
                part.display()
            ))
            .into()),
            (Some(StopReason::Time) | None, _) => Ok(()),
        }
    }
}
