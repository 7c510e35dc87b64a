//! What a render did: as JSON or as two lines for people.

use anyhow::{Result, bail};
use domelight::environment::Environment;
use domelight::render::{RenderSettings, Rendering};
use domelight::scene::Scene;
use serde::Serialize;

use crate::failure::{tell, warn};
use crate::output::{self, PicturePath};
use crate::usage::{Seconds, peak_memory};

/// What was rendered, and how.
#[derive(Serialize)]
pub(crate) struct Settings {
    scene: String,
    triangles: usize,
    environment: String,
    environment_size: [usize; 2],
    strategy: String,
    size: [usize; 2],
    spp: u32,
    sampler: String,
    filter: &'static str,
    seed: u64,
    threads: usize,
}

impl Settings {
    pub(crate) fn new(
        scene_name: &str,
        probe: &str,
        scene: &Scene,
        environment: &Environment,
        strategy: String,
        settings: &RenderSettings,
    ) -> Self {
        Self {
            scene: scene_name.to_owned(),
            triangles: scene.triangle_count(),
            environment: probe.to_owned(),
            environment_size: [environment.map().width, environment.map().height],
            strategy,
            size: [settings.width, settings.height],
            spp: settings.n_samples,
            sampler: format!("{:?}", settings.sampler).to_lowercase(),
            filter: settings.filter.name(),
            seed: settings.seed,
            threads: rayon::current_num_threads(),
        }
    }
}

impl Settings {
    /// What OpenEXR files tell of their making.
    pub(crate) fn provenance(&self, complete: bool) -> Vec<(String, String)> {
        let mut attributes =
            vec![("domelight.version".to_owned(), env!("CARGO_PKG_VERSION").to_owned())];
        let settings = [
            ("scene", self.scene.clone()),
            ("environment", self.environment.clone()),
            ("strategy", self.strategy.clone()),
            ("samples", self.spp.to_string()),
            // If not, the layer of sample counts tells how many there are.
            ("complete", complete.to_string()),
            ("sampler", self.sampler.clone()),
            ("filter", self.filter.to_owned()),
            ("seed", self.seed.to_string()),
        ];
        let named = settings.map(|(name, value)| (format!("domelight.{name}"), value));
        attributes.extend(named);
        attributes
    }
}

/// Where the time went.
#[derive(Serialize)]
pub(crate) struct Stages {
    /// Reading or making scene and probe.
    pub(crate) load: Seconds,
    /// The BVH and the environment's table.
    pub(crate) build: Seconds,
    pub(crate) render: Seconds,
    /// Encoding and writing pictures.
    pub(crate) write: Seconds,
}

/// All that `--json` prints.
#[derive(Serialize)]
pub(crate) struct RenderReport {
    version: &'static str,
    settings: Settings,
    seconds: Stages,
    camera_rays: u64,
    shading_points: u64,
    shadow_rays: u64,
    rays_per_second: f64,
    peak_memory_bytes: Option<u64>,
    non_finite_samples: u64,
    complete: bool,
    outputs: Vec<String>,
}

impl RenderReport {
    pub(crate) fn new(
        settings: Settings,
        rendering: &Rendering,
        seconds: Stages,
        outputs: &[PicturePath],
    ) -> Self {
        let counts = rendering.counts;
        let rays = (counts.camera_rays + counts.shadow_rays) as f64;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            settings,
            rays_per_second: rays / seconds.render.wall.max(1e-9),
            seconds,
            camera_rays: counts.camera_rays,
            shading_points: counts.shading_points,
            shadow_rays: counts.shadow_rays,
            peak_memory_bytes: peak_memory(),
            non_finite_samples: counts.non_finite,
            complete: rendering.complete,
            outputs: outputs.iter().map(ToString::to_string).collect(),
        }
    }

    pub(crate) fn print_json(&self) -> Result<()> {
        Ok(output::print(&serde_json::to_string_pretty(self)?)?)
    }

    /// Two lines on standard error.
    pub(crate) fn print_summary(&self) {
        let Settings { scene, environment, strategy, size: [w, h], spp, .. } = &self.settings;
        let Stages { load, build, render, .. } = &self.seconds;
        let cpu = render.cpu.map_or(String::new(), |cpu| format!(" ({cpu:.2} CPU-s)"));
        tell(&format!(
            "{scene} under {environment}: {w}x{h}, {spp} samples a pixel, {strategy}\n\
             loaded in {:.2} s, built in {:.2} s, rendered in {:.2} s{cpu}, {:.1} Mrays/s -> {}",
            load.wall,
            build.wall,
            render.wall,
            self.rays_per_second * 1e-6,
            self.outputs.join(", ")
        ));
    }

    /// Complains about what the picture does not show.
    ///
    /// # Errors
    /// If the render was interrupted.
    pub(crate) fn check(&self, quiet: bool) -> Result<()> {
        if self.non_finite_samples > 0 {
            let n = self.non_finite_samples;
            warn(quiet, &format!("{n} camera samples were NaN or infinite and count as black"));
        }
        if !self.complete {
            bail!("interrupted; what was done so far is in {}", self.outputs.join(", "));
        }
        Ok(())
    }
}
