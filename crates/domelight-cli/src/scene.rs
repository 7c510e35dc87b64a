//! Converts the flags to a scene with its light and a camera.

use std::path::Path;
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use domelight::environment::builtin::BuiltinProbe;
use domelight::render::{Background, RenderSettings};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{AnimationTime, Projection};
use domelight_lab::scene::{
    FileSettings, Ground, LightSettings, LoadedScene, SceneSettings, SubjectSettings, ViewSettings,
};

use crate::args::sampling::PixelArguments;
use crate::args::scene::{
    CameraArguments, EnvironmentArguments, FileArguments, GroundName, SceneArguments,
    SubjectArguments,
};
use crate::error::UsageError;
use crate::files;
use crate::parse::{Rotation, Size, Triple};
use crate::terminal::Terminal;

impl SceneArguments {
    /// Declares the files that a later render of the scene reads.
    pub(crate) fn declare(&self) -> Result<()> {
        if BuiltinScene::from_str(&self.scene).is_err() {
            files::reads(Path::new(&self.scene))?;
        }
        if let Some(probe) = &self.environment.env
            && BuiltinProbe::from_str(probe).is_err()
        {
            files::reads(Path::new(probe))?;
        }
        Ok(())
    }

    /// Reads scene and probe.
    pub(crate) fn load(&self, quiet: bool) -> Result<LoadedScene> {
        self.load_for(quiet, false)
    }

    /// Reads scene and probe; a framed camera keeps the subject in the picture `all_around` it.
    pub(crate) fn load_for(&self, quiet: bool, all_around: bool) -> Result<LoadedScene> {
        let settings = SceneSettings {
            scene: self.scene.clone(),
            file: self.file.settings(),
            environment: self.environment.settings(),
            view: ViewSettings { all_around, ..self.camera.settings() },
            subject: self.subject.settings(),
        };
        Ok(settings.load(&Terminal { quiet })?)
    }

    /// With so many camera samples per pixel.
    pub(crate) fn render_settings(&self, pixel: &PixelArguments, n_samples: u32) -> RenderSettings {
        RenderSettings {
            width: self.camera.size.width,
            height: self.camera.size.height,
            n_samples,
            seed: pixel.seed,
            filter: pixel.filter,
            sampler: pixel.sampler.into(),
            background: if self.subject.hide_env { Background::Hidden } else { Background::Shown },
            ..RenderSettings::default()
        }
    }
}

impl FileArguments {
    fn settings(&self) -> FileSettings {
        let animation = self.animation.clone();
        FileSettings {
            scene: self.scene.clone(),
            animation: animation.map(|name| AnimationTime { name, seconds: self.at }),
        }
    }
}

impl EnvironmentArguments {
    /// Converts them to the lab's settings.
    pub(crate) fn settings(&self) -> LightSettings {
        LightSettings {
            probe: self.env.clone(),
            rotate: self.env_rotate.and_then(Rotation::degrees),
            rotate_to_camera: self.env_rotate == Some(Rotation::Auto),
            scale: self.env_scale,
            exposure: self.env_exposure,
            up: self.env_up.map(Into::into),
            mapping: self.env_mapping,
            layer: self.env_layer.clone(),
            rows: self.env_rows,
            strict_scene: self.strict,
            strict_map: self.strict && !self.sanitize,
        }
    }
}

impl EnvironmentArguments {
    /// The same for commands that have no camera, or several.
    pub(crate) fn settings_without_camera(&self) -> Result<LightSettings> {
        if self.env_rotate == Some(Rotation::Auto) {
            let text = "--env-rotate auto needs a camera, and this command has none; give degrees";
            return Err(UsageError(text.into()).into());
        }
        Ok(self.settings())
    }
}

impl CameraArguments {
    fn settings(&self) -> ViewSettings {
        let Size { width, height } = self.size;
        let point = |triple: Option<Triple>| triple.map(|Triple(point)| point);
        let perspective = self.fov.map(|fov_y_degrees| Projection::Perspective { fov_y_degrees });
        let orthographic = self.ortho.map(|height| Projection::Orthographic { height });
        ViewSettings {
            size: [width, height],
            camera: self.camera.clone(),
            view: self.view,
            all_around: false,
            depth_of_field: self.dof,
            origin: point(self.origin),
            target: point(self.target),
            up: point(self.up),
            projection: orthographic.or(perspective),
        }
    }
}

impl SubjectArguments {
    fn settings(&self) -> SubjectSettings {
        let Self { ref material, normalize, ground, hide_env } = *self;
        let ground = ground.map(|ground| match ground {
            GroundName::Plate => Ground::Plate,
            GroundName::Shadow => Ground::Shadow,
        });
        SubjectSettings { material: material.clone(), normalize, ground, hide_env }
    }
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
