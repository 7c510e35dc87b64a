//! From the flags to a scene under its light, seen by a camera.

use std::path::Path;
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use domelight::RgbImage;
use domelight::bsdf::Bsdf;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::geometry::Aabb;
use domelight::math::Vec3;
use domelight::render::{Background, RenderSettings};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    AnimationTime, Camera, CameraSettings, EnvironmentSettings, EnvironmentSource, LoadOptions,
    NamedCamera, Projection, Scene, SceneDescription, load_with,
};

use crate::args::sampling::PixelArguments;
use crate::args::scene::{
    CameraArguments, EnvironmentArguments, FileArguments, SceneArguments, SubjectArguments,
};
use crate::error::{UsageError, warn};
use crate::files;
use crate::interrupt;
use crate::memory;
use crate::parse::{Size, Triple};
use crate::report::{CameraReport, EnvironmentReport, SceneReport};

/// What was read, changed as the flags say; nothing is built yet.
pub(crate) struct LoadedScene {
    pub(crate) description: SceneDescription,
    pub(crate) light: EnvironmentSettings,
    pub(crate) map: RgbImage,
    pub(crate) view: CameraSettings,
    pub(crate) warnings: Vec<String>,
}

/// A scene under its light, seen by a camera.
pub(crate) struct PreparedScene {
    pub(crate) scene: Scene,
    pub(crate) camera: Camera,
    pub(crate) camera_settings: CameraSettings,
    pub(crate) environment: Environment,
    /// What a user would call the probe.
    pub(crate) probe: String,
    pub(crate) report: SceneReport,
}

impl SceneArguments {
    /// Declares what is read where the scene is rendered later.
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
        let is_builtin = BuiltinScene::from_str(&self.scene);
        let (mut description, light, map, warnings) = if let Ok(scene) = is_builtin {
            self.file.check_builtin(&self.scene)?;
            // It takes no memory to speak of, so that its light may be read meanwhile.
            let environment = Some(scene.environment());
            let of_scene = SceneDescription { environment, ..SceneDescription::default() };
            let light = self.environment.settings(&of_scene);
            let map = || self.environment.load(&light, quiet);
            let (description, map) = rayon::join(|| scene.description(), map);
            (description, light, map?, Vec::new())
        } else {
            let (description, warnings) =
                load_scene(&self.scene, &self.file, self.environment.strict, quiet)?;
            let light = self.environment.settings(&description);
            let map = self.environment.load(&light, quiet)?;
            (description, light, map, warnings)
        };
        self.camera.choose(&self.scene, &mut description)?;
        let view = self.subject(&mut description, light.up.vector())?;
        Ok(LoadedScene { description, light, map, view, warnings })
    }

    /// Builds what was loaded.
    pub(crate) fn build(&self, loaded: LoadedScene) -> Result<PreparedScene> {
        let LoadedScene { mut description, light, map, mut view, warnings } = loaded;
        let Size { width, height } = self.camera.size;
        let camera_report = CameraReport::new(&view);
        description.rescale(&mut view);
        let camera = Camera::new(&view, width, height)?;
        let n_triangles: usize = description.parts.iter().map(|p| p.mesh.triangles.len()).sum();
        memory::allow(
            &format!("{}: a tree over {n_triangles} triangles", self.scene),
            memory::TRIANGLE * n_triangles as u64,
        )?;
        memory::keep(memory::TRIANGLE * n_triangles as u64);
        let scene = Scene::new(description).with_context(|| self.scene.clone())?;
        let orientation = Orientation { up: light.up, rotation: light.rotate_degrees };
        let scale = light.factor();
        let probe = probe_name(&light.source);
        let environment =
            Environment::new(map, orientation, scale).with_context(|| probe.clone())?;
        let report = SceneReport {
            scene: self.scene.clone(),
            triangles: scene.triangle_count(),
            warnings,
            material: self.subject.material.as_ref().map(|m| m.text.clone()),
            normalize: self.subject.normalize,
            ground: self.subject.ground,
            hide_env: self.subject.hide_env,
            environment: EnvironmentReport::new(probe.clone(), &light, &environment),
            camera: camera_report,
            size: [width, height],
        };
        Ok(PreparedScene { scene, camera, camera_settings: view, environment, probe, report })
    }

    /// Changes the scene as the flags say; the camera frames what is not scenery.
    fn subject(&self, scene: &mut SceneDescription, up: Vec3) -> Result<CameraSettings> {
        let Size { width, height } = self.camera.size;
        let bounds = self.subject.apply(scene, up);
        // Squares of lengths must be finite.
        let extent = bounds.size().max_element();
        if extent > 1e18 || extent > 0.0 && extent < 1e-18 {
            let how = if extent < 1.0 { "small" } else { "large" };
            let text = format!("{}: the scene is too {how}: {extent:e} across", self.scene);
            return Err(UsageError(text).into());
        }
        Ok(self.camera.settings(scene.camera.as_ref(), || {
            CameraSettings::framing(&bounds, width as f32 / height as f32, up)
        }))
    }

    /// With so many camera samples a pixel.
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

/// Starts as many threads as asked for.
pub(crate) fn start_threads(asked: Option<u32>) -> Result<()> {
    // Slurm grants threads that only some of its set-ups enforce.
    let granted = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let granted = granted.and_then(|n| n.parse::<u32>().ok()).filter(|&n| n > 0);
    // More threads than cores win nothing, and too many end the process.
    let cores = std::thread::available_parallelism().map_or(1024, |n| n.get() as u32);
    if let Some(threads) = asked.or(granted.map(|n| n.min(cores))) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
        pool.build_global().context("cannot start the threads")?;
    }
    Ok(())
}

/// The scene's own camera, or one framed to it.
pub(crate) fn view_of(description: &SceneDescription, aspect: f32, up: Vec3) -> CameraSettings {
    let framed = || CameraSettings::framing(&description.subject_bounds(), aspect, up);
    description.camera.unwrap_or_else(framed)
}

/// That view, moved until the scene just fits.
pub(crate) fn close_up(description: &SceneDescription, aspect: f32, up: Vec3) -> CameraSettings {
    const FOV: f32 = 26.0;
    let view = view_of(description, aspect, up);
    let bounds = description.bounds();
    let (center, size) = (bounds.center(), bounds.size());
    let toward = (view.origin - view.target).normalize_or(Vec3::Z);
    let height = size.abs().dot(up.abs());
    // The widest side, whichever way it is turned.
    let width = (size - up.abs() * height).max_element();
    let extent = height.max(width / aspect) * 1.08;
    let distance = 0.5 * extent / (0.5 * FOV.to_radians()).tan() + 0.5 * width;
    CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: FOV },
        origin: center + toward * distance,
        target: center,
        up: view.up,
    }
}

/// A built-in scene by its name, else a file, and what of it is not shown.
pub(crate) fn load_scene(
    name: &str,
    file: &FileArguments,
    strict: bool,
    quiet: bool,
) -> Result<(SceneDescription, Vec<String>)> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok((builtin.description(), Vec::new()));
    }
    files::reads(Path::new(name))?;
    let options = LoadOptions {
        max_memory: memory::left(),
        strict,
        scene: file.scene.clone(),
        animation: file.animation.clone().map(|name| AnimationTime { name, seconds: file.at }),
        ..LoadOptions::default()
    };
    let loaded = load_with(Path::new(name), &options)?;
    loaded.files.iter().try_for_each(|file| files::reads(file))?;
    memory::keep(loaded.memory);
    for warning in &loaded.warnings {
        warn(quiet, warning);
    }
    Ok((loaded.description, loaded.warnings))
}

impl FileArguments {
    /// Refuses what a built-in scene does not have.
    fn check_builtin(&self, scene: &str) -> Result<(), UsageError> {
        match (&self.scene, &self.animation) {
            (None, None) => Ok(()),
            _ => Err(UsageError(format!(
                "--scene and --animation choose in a glTF file; {scene} is built in"
            ))),
        }
    }
}

/// What a user would call the probe.
pub(crate) fn probe_name(source: &EnvironmentSource) -> String {
    match source {
        EnvironmentSource::File(path) => path.display().to_string(),
        EnvironmentSource::Builtin(name) => name.clone(),
    }
}

impl EnvironmentArguments {
    /// The scene's own settings with the flags over them.
    pub(crate) fn settings(&self, scene: &SceneDescription) -> EnvironmentSettings {
        let source = |name: &str| match BuiltinProbe::from_str(name) {
            Ok(probe) => EnvironmentSource::Builtin(probe.name().to_owned()),
            Err(_) => EnvironmentSource::File(name.into()),
        };
        let plain = |source| EnvironmentSettings {
            source,
            rotate_degrees: 0.0,
            scale: 1.0,
            exposure: 0.0,
            up: scene.up.unwrap_or_default(),
        };
        let mut settings = match (&self.env, &scene.environment) {
            // Another probe takes none of the first one's adjustments over.
            (Some(name), _) => plain(source(name)),
            (None, Some(of_scene)) => of_scene.clone(),
            (None, None) => plain(source(BuiltinProbe::Sky.name())),
        };
        settings.rotate_degrees = self.env_rotate.unwrap_or(settings.rotate_degrees);
        settings.scale = self.env_scale.unwrap_or(settings.scale);
        settings.exposure = self.env_exposure.unwrap_or(settings.exposure);
        settings.up = self.env_up.map_or(settings.up, UpAxis::from);
        settings
    }

    pub(crate) fn load(&self, light: &EnvironmentSettings, quiet: bool) -> Result<RgbImage> {
        let path = match &light.source {
            EnvironmentSource::Builtin(name) => {
                let rows = u64::from(self.env_rows);
                allow_environment(&format!("{name} with {rows} rows"), 2 * rows * rows)?;
                return Ok(BuiltinProbe::from_str(name)?.image(self.env_rows as usize));
            }
            EnvironmentSource::File(path) => path,
        };
        let options = ProbeOptions {
            mapping: self.env_mapping,
            layer: self.env_layer.clone(),
            strict: self.strict && !self.sanitize,
            max_memory: memory::left(),
        };
        files::reads(path)?;
        let loaded = if files::waits(path) {
            let (pipe, name) = (path.clone(), path.display().to_string());
            interrupt::unless_interrupted(&name, move || load_probe(&pipe, &options))??
        } else {
            load_probe(path, &options)?
        };
        let texels = loaded.image.pixels.len() as u64;
        allow_environment(&path.display().to_string(), texels)?;
        loaded.warnings.iter().for_each(|warning| warn(quiet, warning));
        Ok(loaded.image)
    }
}

/// Refuses an environment of too many texels, else counts it.
fn allow_environment(name: &str, texels: u64) -> Result<()> {
    let bytes = memory::ENVIRONMENT_TEXEL * texels;
    memory::allow(name, bytes)?;
    memory::keep(bytes);
    Ok(())
}

impl SubjectArguments {
    /// Changes the scene as the flags say; returns the bounds of what the camera should frame.
    fn apply(&self, scene: &mut SceneDescription, up: Vec3) -> Aabb {
        if self.normalize {
            scene.normalize();
        }
        if let Some(material) = &self.material {
            scene.set_subject_material(Bsdf::from(material.spec));
        }
        let bounds = scene.subject_bounds();
        if self.ground {
            scene.add_ground(up);
        }
        bounds
    }
}

impl CameraArguments {
    /// Makes the camera that was asked for the scene's.
    fn choose(&self, name: &str, scene: &mut SceneDescription) -> Result<(), UsageError> {
        let Some(asked) = &self.camera else { return Ok(()) };
        let cameras = &scene.cameras;
        let by_name = cameras.iter().find(|camera| camera.name == *asked);
        let by_number = || asked.parse().ok().and_then(|i: usize| cameras.get(i));
        if let Some(NamedCamera { settings, .. }) = by_name.or_else(by_number) {
            scene.camera = Some(*settings);
            return Ok(());
        }
        let names: Vec<_> =
            cameras.iter().enumerate().map(|(i, c)| format!("{i} '{}'", c.name)).collect();
        let known = match names.len() {
            0 => "has no camera to choose".to_owned(),
            _ => format!("has no camera '{asked}'; there are {}", names.join(", ")),
        };
        Err(UsageError(format!("{name} {known}")))
    }

    /// The flags over the scene's own camera, or over one framed to the scene.
    fn settings(
        &self,
        of_scene: Option<&CameraSettings>,
        framed: impl FnOnce() -> CameraSettings,
    ) -> CameraSettings {
        let mut camera = of_scene.copied().unwrap_or_else(framed);
        if let Some(Triple(origin)) = self.origin {
            camera.origin = origin;
        }
        if let Some(Triple(target)) = self.target {
            camera.target = target;
        }
        if let Some(Triple(up)) = self.up {
            camera.up = up;
        }
        if let Some(fov_y_degrees) = self.fov {
            camera.projection = Projection::Perspective { fov_y_degrees };
        }
        if let Some(height) = self.ortho {
            camera.projection = Projection::Orthographic { height };
        }
        camera
    }
}
