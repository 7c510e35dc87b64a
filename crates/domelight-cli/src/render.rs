//! `domelight render`: from files to a picture.

use std::str::FromStr as _;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result};
use domelight::picture::tone::ToneMapping;
use domelight::render::{
    Film, Layers, RenderSettings, Rendering, automatic_exposure, pilot_points,
};
use domelight::scene::{Camera, Scene};
use domelight::strategy::{Portal, PreparedStrategy};

use crate::args::render::{OutputArguments, ProgressKind, RenderArguments};
use crate::clock;
use crate::error::{Interrupted, UsageError, status, warn};
use crate::interrupt;
use crate::job;
use crate::memory;
use crate::output::{self, PicturePath, print_progress, require_one_on_standard_output};
use crate::preview;
use crate::progress::RenderProgress;
use crate::render_run::TryWriting;
use crate::report::{RenderReport, Settings, StopReason, Timings};
use crate::scene::{load, start_threads};
use crate::strategy::{RenderTask, acceptance};
use crate::terminal::Terminal;
use crate::tone::Shown;
use crate::turntable::{Frame, Turntable};
use domelight_lab::black;
use domelight_lab::denoise::Denoiser;
use domelight_lab::display::Display;
use domelight_lab::job::value::{Rotation, Size, Text};
use domelight_lab::job::{Job, PortalList, Sampling};
use domelight_lab::names::file_name;
use domelight_lab::scene::PreparedScene;
use domelight_lab::{Stopwatch, refuse_repeating_points, warn_of_rare_acceptance};

/// Runs the subcommand.
pub(crate) fn run(arguments: &RenderArguments, quiet: bool) -> Result<()> {
    let openjd = arguments.output.progress == ProgressKind::Openjd;
    render(arguments, quiet).inspect_err(|error| {
        if openjd {
            print_progress(&format!("openjd_fail: {error:#}"));
        }
    })
}

fn render(arguments: &RenderArguments, quiet: bool) -> Result<()> {
    let job = job::resolve(&arguments.job, &arguments.given, quiet)?;
    let settings = job.settings();
    let spec = job.sampling.strategy.0.spec;
    refuse_repeating_points(spec, settings.n_samples)?;
    let outputs = arguments.output.paths()?;
    let turntable = arguments.turntable.turntable(&outputs)?;
    let outputs = turntable.as_ref().map_or(outputs, Turntable::outputs);
    arguments.render_run.check(&outputs)?;
    outputs.iter().try_for_each(PicturePath::declare)?;
    if !arguments.render_run.is_part() {
        // Check the memory before loading. `render_run` checks again, with what it saves.
        memory::allow_picture(settings.width, settings.height, Film::MEMORY_PER_PIXEL)?;
    }
    start_threads(arguments.threads.threads)?;
    // Before the work that would be in vain.
    let denoiser = arguments.output.denoise.then(Denoiser::load).transpose()?;
    let display = arguments.output.display.as_deref();
    let display = display.map(|address| connect(address, &job)).transpose()?;
    let interrupted = interrupt::flag();
    let loading = interrupt::nothing_to_keep(arguments.render_run.code_of_an_early_end());
    let mut watch = Stopwatch::start();

    let mut scene_settings = job.scene_settings();
    scene_settings.view.all_around = turntable.is_some();
    let loaded = load(&scene_settings, quiet)?;
    let load = watch.lap();

    let view = &loaded.build(&Terminal { quiet })?;
    let PreparedScene { scene, camera, environment, probe, report, .. } = view;
    let settings = &settings;
    let spec = spec.for_picture(scene, camera, environment, settings);
    memory::allow(&format!("the tables of {spec}"), PreparedStrategy::memory(spec, environment))?;
    if settings.target_error.is_some() && spec.draws_from_the_bsdf_alone() {
        let text = "samples drawn from the BSDF alone may all miss a small light: tiles that do stop too early and too dark. \
                    Use product, mis or environment with --target-error";
        warn(quiet, text);
    }
    let strategy = &PreparedStrategy::new(spec, environment).with_context(|| probe.clone())?;
    let automatic = automatic_exposure(scene, camera, environment, settings);
    let mut made = job.clone();
    made.sampling.strategy.0 = spec.into();
    // Only OpenEXR holds the job; its inputs are read once more for their fingerprints.
    let keeps_job = arguments.render_run.saves() || outputs.iter().any(PicturePath::has_all_layers);
    let attributes = || job::attributes(&made, &arguments.job.scene);
    let described = Settings {
        job: keeps_job.then(attributes).unwrap_or_default(),
        scene: report.clone(),
        sampling: Sampling { adaptive: settings.adapts(strategy), ..made.sampling.clone() },
        pixel: made.pixel.clone(),
        threads: rayon::current_num_threads(),
        automatic_exposure: automatic.stops,
    };
    let render_run = &arguments.render_run;
    let render_run = render_run.render_run(view, settings, &made, &described, &outputs, quiet)?;
    let build = watch.lap();
    drop(loading);

    let shown_as = job.output.of_picture(|| automatic.stops);
    if arguments.output.preview {
        preview::write(view, settings, strategy, &outputs, &shown_as, interrupted)?;
    }

    let n_pixels = (settings.width * settings.height) as u64;
    let total = n_pixels * u64::from(settings.n_samples);
    let openjd = arguments.output.progress == ProgressKind::Openjd;
    let progress = RenderProgress::new("", total, quiet, interrupted).openjd(openjd);
    let progress = progress.pictures(turntable.as_ref().map_or(1, Turntable::len));
    let progress = &progress.profiled(arguments.output.profile).displayed(display);
    let attributes = described.provenance(settings);
    let try_writing = &|layers: &Layers| {
        output::time_to_write(&outputs, layers, &shown_as, report.hide_env, &attributes)
    };
    let running = Some((&render_run, try_writing as TryWriting));
    let render = |camera: &Camera| {
        RenderTask { scene, camera, environment, settings, progress, render_run: running }
            .render(strategy)
    };
    let pictures =
        Pictures { described: &described, settings, denoiser: denoiser.as_ref(), shown_as };
    let mut denoised = None;
    let rendering = match &turntable {
        None => render(camera)?,
        Some(turntable) => turntable.render(view, render, |rendering, frame| {
            denoised = pictures.write(rendering, Some(frame), &frame.outputs)?;
            Ok(())
        })?,
    };
    progress.finish();
    let stopped = match () {
        () if rendering.complete => None,
        () if interrupted.load(Ordering::Relaxed) => Some(StopReason::Interrupted),
        () => Some(StopReason::Time),
    };
    let saved = render_run.saved();
    if rendering.counts.camera_rays == 0 && saved.is_none() {
        let text = "ended before the first sample; nothing was written".to_owned();
        return Err(Interrupted(text).into());
    }
    let render = watch.lap();
    let rare = warn_of_rare_acceptance(spec, &rendering.counts);
    // A part may be one of the background.
    let is_whole = !arguments.render_run.is_part();
    let unseen = || is_whole.then(|| black::unseen(&rendering.layers)).flatten();
    let reason = || black::reason(&rendering.layers).or_else(unseen).map(str::to_owned);
    if let Some(text) = rare.or_else(reason) {
        warn(quiet, &text);
    }

    if turntable.is_none()
        && !arguments.render_run.is_part()
        && let Some(error) = progress.display(&rendering.layers)
    {
        warn(quiet, &format!("--display: the viewer did not take the whole picture: {error}"));
    }
    // A part is its own checkpoint, and written.
    if turntable.is_none() && !arguments.render_run.is_part() {
        denoised = pictures.write(&rendering, None, &outputs)?;
    }
    let total = clock::elapsed().as_secs_f64();
    let stages = Timings { load, build, render, write: watch.lap(), total };
    let points = || pilot_points(scene, camera, settings);
    let rejection = acceptance(spec, points, environment, settings.seed)?;
    let rotate = described.scene.environment.rotate();
    let earlier = render_run.earlier_counts();
    let mut report =
        RenderReport::new(described, &rendering, &earlier, stages, rejection, &outputs, stopped);
    report.profile = progress.profile();
    report.denoised = denoised;
    if outputs.iter().any(PicturePath::is_png) {
        report.png = Some(Shown::new(&job.output, &shown_as).metered(automatic.basis));
    }
    if arguments.output.json {
        report.found_portals = portal_text(&rendering.found_portals, scene);
        report.print_json()?;
    } else if !quiet {
        report.print_summary();
        if job.light.rotate == Some(Text(Rotation::Auto)) {
            status(&format!("--env-rotate auto turned the environment by {rotate:.2} degrees"));
        }
    }
    report.check(saved, arguments.render_run.is_part(), quiet)
}

/// The viewer that listens at an address.
fn connect(address: &str, job: &Job) -> Result<Display> {
    let Text(Size { width, height }) = job.view.size;
    let name = file_name(&job.scene);
    Display::connect(address, &name, [width, height]).with_context(|| {
        format!("--display: no viewer listens at {address}; start tev or HDRView first")
    })
}

/// How pictures are written.
struct Pictures<'a> {
    described: &'a Settings,
    settings: &'a RenderSettings,
    denoiser: Option<&'a Denoiser>,
    shown_as: ToneMapping,
}

impl Pictures<'_> {
    /// Writes a picture, or the picture of a frame, to all `outputs`; returns what denoised it.
    fn write(
        &self,
        rendering: &Rendering,
        frame: Option<&Frame>,
        outputs: &[PicturePath],
    ) -> Result<Option<String>> {
        let layers = &rendering.layers;
        let denoised = self.denoiser.map(|d| d.denoise_layers(layers)).transpose()?;
        let (color, by) = denoised.unzip();
        let mut attributes = self.described.provenance(self.settings);
        // If not, the layer of sample counts states how many there are.
        attributes.push(("domelight.complete".into(), rendering.complete.to_string()));
        if let Some(Frame { index, n_frames, .. }) = frame {
            attributes.push(("domelight.frame".into(), format!("{index} of {n_frames}")));
        }
        let hide_env = self.described.scene.hide_env;
        // A full disk under one file must not cost the others.
        let write = |path: &PicturePath| {
            path.write_layers(layers, color.as_ref(), &self.shown_as, hide_env, &attributes)
        };
        outputs.iter().map(write).fold(Ok(()), Result::and)?;
        Ok(by)
    }
}

impl OutputArguments {
    fn paths(&self) -> Result<Vec<PicturePath>> {
        let paths: Vec<_> = if self.output.is_empty() {
            ["domelight.exr", "domelight.png"]
                .map(PicturePath::from_str)
                .into_iter()
                .flatten()
                .collect()
        } else {
            self.output.clone()
        };
        let all: Vec<_> = paths.iter().map(Some).collect();
        let lines = self.json || self.progress == ProgressKind::Openjd;
        require_one_on_standard_output(&all, lines)?;
        if self.json && self.progress == ProgressKind::Openjd {
            let text = "--json and --progress openjd both write to standard output";
            return Err(UsageError(text.into()).into());
        }
        Ok(paths)
    }
}

/// Portals that a render found, in the notation of `--portal`.
fn portal_text(found: &[Portal], scene: &Scene) -> Option<String> {
    (!found.is_empty()).then(|| PortalList::of(found, scene).to_string())
}
