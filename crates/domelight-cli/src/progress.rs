//! The progress bar of a render.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use domelight::render::{Counts, Observer};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shows camera samples done, passes, rays a second and the time left on standard error, if that is
/// a terminal and nobody asked for quiet; passes the interrupt flag on to the renderer.
pub(crate) struct RenderProgress {
    bar: ProgressBar,
    interrupted: &'static AtomicBool,
    rays: AtomicU64,
    started: Instant,
}

impl RenderProgress {
    /// A bar over `n_camera_rays`.
    pub(crate) fn new(n_camera_rays: u64, quiet: bool, interrupted: &'static AtomicBool) -> Self {
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
        Self { bar, interrupted, rays: AtomicU64::new(0), started: Instant::now() }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for RenderProgress {
    fn pass_started(&self, samples: Range<u32>) {
        self.bar.set_prefix(format!("samples {}–{}", samples.start + 1, samples.end));
    }

    fn tile_finished(&self, counts: &Counts) {
        let rays = counts.camera_rays + counts.shadow_rays;
        let rays = self.rays.fetch_add(rays, Ordering::Relaxed) + rays;
        let rate = rays as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
        self.bar.set_message(format!("{}  {:.1} Mrays/s", self.bar.prefix(), rate * 1e-6));
        self.bar.inc(counts.camera_rays);
    }

    fn cancelled(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}
