//! One picture and what it cost.

use anyhow::{Result, bail};
use domelight::RgbImage;
use domelight::render::RenderSettings;

use crate::interrupt;
use crate::progress::RenderProgress;
use crate::scene::View;
use crate::strategy::{Job, Renderer};
use crate::usage::Stopwatch;

/// Where a strategy's pictures are taken.
#[derive(Clone, Copy)]
pub(super) struct Studio<'a> {
    pub(super) view: &'a View,
    /// But for the number of samples and the seed.
    pub(super) settings: RenderSettings,
    pub(super) renderer: &'a Renderer<'a>,
    pub(super) quiet: bool,
}

/// A picture and what it cost.
pub(super) struct Shot {
    pub(super) image: RgbImage,
    /// Shadow rays of a pixel that the scene covers.
    pub(super) rays: f64,
    /// CPU seconds of rendering; wall-clock seconds where the system does not tell.
    pub(super) seconds: f64,
    /// Camera samples whose value was NaN or infinite.
    pub(super) non_finite: u64,
}

impl Studio<'_> {
    /// Renders with so many camera samples a pixel; an error if interrupted.
    pub(super) fn shoot(&self, label: &str, n_samples: u32, seed: u64) -> Result<Shot> {
        let View { scene, camera, environment, .. } = self.view;
        let settings = &RenderSettings { n_samples, seed, ..self.settings };
        let n_camera_rays = (settings.width * settings.height) as u64 * u64::from(n_samples);
        let interrupted = interrupt::flag();
        let progress = &RenderProgress::new(label, n_camera_rays, self.quiet, interrupted);
        let mut watch = Stopwatch::start();
        let course = None;
        let job = Job { scene, camera, environment, settings, progress, course };
        let rendering = (self.renderer)(&job)?;
        let time = watch.lap();
        progress.finish();
        if !rendering.complete {
            bail!("interrupted; no report was written");
        }
        let counts = rendering.counts;
        if counts.shading_points == 0 {
            bail!("the camera sees nothing of the scene: there is nothing to compare");
        }
        let points_of_a_sample = counts.shading_points as f64 / f64::from(n_samples);
        Ok(Shot {
            image: rendering.layers.color,
            rays: counts.shadow_rays as f64 / points_of_a_sample,
            seconds: time.cpu.unwrap_or(time.wall),
            non_finite: counts.non_finite,
        })
    }
}
