//! One picture and what it cost.

use anyhow::{Result, bail};
use domelight::render::{Counts, Layers, RenderSettings};
use domelight::strategy::PreparedStrategy;

use crate::interrupt;
use crate::progress::RenderProgress;
use crate::scene::PreparedScene;
use crate::strategy::Job;
use crate::usage::{Seconds, Stopwatch};

/// What all renders of a strategy share.
#[derive(Clone, Copy)]
pub(crate) struct RenderSetup<'a> {
    pub(crate) view: &'a PreparedScene,
    /// But for the number of samples and the seed.
    pub(crate) settings: RenderSettings,
    pub(crate) strategy: &'a PreparedStrategy<'a>,
    pub(crate) quiet: bool,
}

/// A picture and what it cost.
pub(crate) struct Render {
    pub(crate) layers: Layers,
    pub(crate) counts: Counts,
    /// Of rendering alone.
    pub(crate) time: Seconds,
}

impl Render {
    /// CPU seconds of rendering; wall-clock seconds where the system does not tell.
    pub(crate) fn seconds(&self) -> f64 {
        self.time.cpu.unwrap_or(self.time.wall)
    }

    /// Shadow rays of a pixel that the scene covers.
    pub(crate) fn rays(&self) -> f64 {
        self.counts.shadow_rays as f64 / self.layers.covered_pixels()
    }

    /// Camera samples of a pixel, which not all strategies have as many of as asked for.
    pub(crate) fn camera_samples(&self) -> f64 {
        self.counts.camera_rays as f64 / self.layers.n_samples.len() as f64
    }
}

impl RenderSetup<'_> {
    /// Renders with so many camera samples a pixel; an error if interrupted.
    pub(crate) fn render(&self, label: &str, n_samples: u32, seed: u64) -> Result<Render> {
        let PreparedScene { scene, camera, environment, .. } = self.view;
        let settings = &RenderSettings { n_samples, seed, ..self.settings };
        let n_camera_rays = (settings.width * settings.height) as u64 * u64::from(n_samples);
        let interrupted = interrupt::flag();
        let progress = &RenderProgress::new(label, n_camera_rays, self.quiet, interrupted);
        let mut watch = Stopwatch::start();
        let render_run = None;
        let job = Job { scene, camera, environment, settings, progress, render_run };
        let rendering = job.render(self.strategy)?;
        let time = watch.lap();
        progress.finish();
        if !rendering.complete {
            bail!("interrupted; no report was written");
        }
        if rendering.counts.shading_points == 0 {
            bail!("the camera sees nothing of the scene: there is nothing to compare");
        }
        Ok(Render { layers: rendering.layers, counts: rendering.counts, time })
    }
}
