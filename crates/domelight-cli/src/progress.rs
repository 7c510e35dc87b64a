//! The progress bars of a render, and of work of many renders.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use domelight::quote::terminal;
use domelight::render::{Counts, Layers, Observer, Stage, TileView, Window};
use domelight_lab::WorkProgress;
use domelight_lab::display::Display;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output::print_progress;
use crate::profile::{Profile, StageSeconds};

/// Shows camera samples done, passes, rays per second and the time left on standard error, if that is
/// a terminal and nobody asked for quiet, or tells a farm on standard output; passes the interrupt flag
/// on to the renderer.
pub(crate) struct RenderProgress {
    bar: ProgressBar,
    openjd: bool,
    /// What is rendered; empty where that is plain.
    label: String,
    interrupted: &'static AtomicBool,
    /// Pictures to render, and those begun.
    n_pictures: u64,
    begun: AtomicU64,
    rays: AtomicU64,
    /// Whole percent told last.
    told: Mutex<Option<u64>>,
    started: Instant,
    profile: Option<Profile>,
    /// The viewer that shows the picture while it is made.
    display: Option<Display>,
}

impl RenderProgress {
    /// A bar over `n_camera_rays`.
    pub(crate) fn new(
        label: &str,
        n_camera_rays: u64,
        quiet: bool,
        interrupted: &'static AtomicBool,
    ) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(n_camera_rays), target);
        let template = "{bar:30.cyan/blue} {percent:>3} %  {msg}  {elapsed} elapsed, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━━╌"));
        }
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let label = if label.is_empty() { String::new() } else { terminal::line(label) + "  " };
        let (rays, told) = (AtomicU64::new(0), Mutex::new(None));
        Self {
            bar,
            label,
            openjd: false,
            interrupted,
            n_pictures: 1,
            begun: AtomicU64::new(0),
            rays,
            told,
            started: Instant::now(),
            profile: None,
            display: None,
        }
    }

    /// The lines of Open Job Description on standard output instead of the bar, if `on`.
    pub(crate) fn openjd(mut self, on: bool) -> Self {
        if on {
            self.bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        self.openjd = on;
        self
    }

    /// Of `n` pictures, one after the other.
    pub(crate) fn pictures(mut self, n: u64) -> Self {
        self.n_pictures = n.max(1);
        self
    }

    /// Measures which stages the time goes to, if `on`.
    pub(crate) fn profiled(mut self, on: bool) -> Self {
        self.profile = on.then(Profile::default);
        self
    }

    /// Shows the picture in a viewer, too.
    pub(crate) fn displayed(mut self, display: Option<Display>) -> Self {
        self.display = display;
        self
    }

    /// Shows the finished picture in the viewer, if there is one; returns why that failed.
    pub(crate) fn display(&self, layers: &Layers) -> Option<std::io::Error> {
        self.display.as_ref()?.finish(layers).err()
    }

    /// What each stage took, if that was measured.
    pub(crate) fn profile(&self) -> Option<Vec<StageSeconds>> {
        self.profile.as_ref().map(Profile::seconds)
    }

    /// Begins a picture: sets the bar to `done` of its `total` camera rays, behind the pictures before it.
    pub(crate) fn begin(&self, total: u64, done: u64) {
        let before = self.begun.fetch_add(1, Ordering::Relaxed);
        self.bar.set_length(total * self.n_pictures.max(before + 1));
        self.bar.set_position(total * before + done);
        if before == 0 {
            self.bar.reset_eta();
        }
        self.tell_farm();
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }

    /// Says on standard output, at each whole percent, how much is done; nobody may be listening.
    fn tell_farm(&self) {
        if !self.openjd {
            return;
        }
        // Counted and printed under one lock: the lines of several threads come in rising order.
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let percent = 100 * self.bar.position() / self.bar.length().unwrap_or(1).max(1);
        if *told < Some(percent) {
            *told = Some(percent);
            print_progress(&format!("openjd_progress: {percent}"));
        }
    }
}

impl Drop for RenderProgress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Observer for RenderProgress {
    fn pass_started(&self, samples: Range<u32>) {
        let samples = format!("samples {}–{}", samples.start + 1, samples.end);
        let samples = match self.n_pictures {
            1 => samples,
            n => format!("frame {} of {n}, {samples}", self.begun.load(Ordering::Relaxed)),
        };
        if self.openjd {
            print_progress(&format!("openjd_status: {samples}"));
        }
        self.bar.set_prefix(samples);
    }

    fn tile_started(&self, window: Window) {
        if let Some(display) = &self.display {
            display.outline(window);
        }
    }

    fn stage_started(&self, stage: Stage) {
        if let Some(profile) = &self.profile {
            profile.begin(Some(stage));
        }
    }

    fn tile_rendered(&self, tile: &TileView) {
        if let Some(display) = &self.display {
            display.show(tile);
        }
    }

    fn tile_finished(&self, counts: &Counts) {
        if let Some(profile) = &self.profile {
            profile.begin(None);
        }
        let rays = counts.camera_rays + counts.shadow_rays;
        let rays = self.rays.fetch_add(rays, Ordering::Relaxed) + rays;
        let rate = rays as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
        self.bar.set_message(format!(
            "{}{}  {:.1} Mrays/s",
            self.label,
            self.bar.prefix(),
            rate * 1e-6
        ));
        self.bar.inc(counts.camera_rays);
        self.tell_farm();
    }

    fn canceled(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

/// Shows the progress of work of many renders on standard error, if that is a terminal and nobody asked for quiet.
pub(crate) struct WorkBar(ProgressBar);

impl WorkBar {
    /// Steps of the whole bar.
    const STEPS: u64 = 1000;

    /// A bar at its beginning.
    pub(crate) fn new(quiet: bool) -> Self {
        let target =
            if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(Self::STEPS), target);
        let template = "{bar:30.cyan/blue} {percent:>3} %  {elapsed} elapsed, {prefix} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━━╌"));
        }
        Self(bar)
    }
}

impl WorkProgress for WorkBar {
    fn advance(&self, share: f64, seconds_left: f64, label: &str) {
        if self.0.is_hidden() {
            return;
        }
        let left = Duration::from_secs(seconds_left.clamp(0.0, 1e9).ceil() as u64);
        self.0.set_prefix(HumanDuration(left).to_string());
        self.0.set_message(terminal::line(label));
        self.0.set_position((share * Self::STEPS as f64) as u64);
    }
}

impl Drop for WorkBar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
