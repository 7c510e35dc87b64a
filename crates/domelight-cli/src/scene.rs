//! From the command line to a job, and from its scene to what is rendered.

use std::path::Path;
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use domelight::environment::builtin::BuiltinProbe;
use domelight::render::RenderSettings;
use domelight::scene::builtin::BuiltinScene;
use domelight_lab::job::value::{Rotation, Text};
use domelight_lab::job::{Light, Pixel, SceneSettings};
use domelight_lab::scene::LoadedScene;

use crate::error::UsageError;
use crate::files;
use crate::terminal::Terminal;

/// Declares the files that a later render of the scene reads.
pub(crate) fn declare(scene: &str, light: &Light) -> Result<()> {
    if BuiltinScene::from_str(scene).is_err() {
        files::reads(Path::new(scene))?;
    }
    if let Some(map) = &light.map
        && BuiltinProbe::from_str(map).is_err()
    {
        files::reads(Path::new(map))?;
    }
    Ok(())
}

/// Reads scene and probe.
pub(crate) fn load(scene: &SceneSettings, quiet: bool) -> Result<LoadedScene> {
    Ok(scene.clone().load(&Terminal { quiet })?)
}

/// The settings of a picture of the scene, with one camera sample per pixel.
pub(crate) fn one_sample(scene: &SceneSettings, pixel: &Pixel) -> RenderSettings {
    let one = RenderSettings { n_samples: 1, ..RenderSettings::default() };
    scene.settings(pixel.settings(one))
}

/// The light of a command that has no camera, or several.
pub(crate) fn without_camera(light: &Light) -> Result<&Light> {
    if light.rotate == Some(Text(Rotation::Auto)) {
        let text = "--env-rotate auto needs a camera, and this command has none; give degrees";
        return Err(UsageError(text.into()).into());
    }
    Ok(light)
}

/// Starts the requested number of threads.
pub(crate) fn start_threads(asked: Option<u32>) -> Result<()> {
    // Slurm grants threads that only some of its set-ups enforce.
    let granted = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let granted = granted.and_then(|n| n.parse::<u32>().ok()).filter(|&n| n > 0);
    // More threads than cores gain nothing, and too many end the process.
    let cores = std::thread::available_parallelism().map_or(1024, |n| n.get() as u32);
    if let Some(threads) = asked.or(granted.map(|n| n.min(cores))) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
        pool.build_global().context("cannot start the threads")?;
    }
    Ok(())
}
