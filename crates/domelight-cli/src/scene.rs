//! From the flags to a scene under its light, seen by a camera.

use std::path::Path;
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use domelight::RgbImage;
use domelight::bsdf::Material;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::geometry::Aabb;
use domelight::math::Vec3;
use domelight::render::{Background, RenderSettings};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, EnvironmentSettings, EnvironmentSource, Projection, Scene,
    SceneDescription, load_within,
};

use crate::args::sampling::PixelArguments;
use crate::args::scene::{CameraArguments, EnvironmentArguments, SceneArguments, StageArguments};
use crate::failure::{UsageError, warn};
use crate::memory;
use crate::report::{CameraReport, EnvironmentReport, SceneReport};
use crate::values::{Size, Triple};

/// What was read, changed as the flags say; nothing is built yet.
pub(crate) struct LoadedScene {
    pub(crate) description: SceneDescription,
    pub(crate) light: EnvironmentSettings,
    pub(crate) map: RgbImage,
    pub(crate) view: CameraSettings,
}

/// A scene under its light, seen by a camera.
pub(crate) struct View {
    pub(crate) scene: Scene,
    pub(crate) camera: Camera,
    pub(crate) camera_settings: CameraSettings,
    pub(crate) environment: Environment,
    /// What a user would call the probe.
    pub(crate) probe: String,
    pub(crate) report: SceneReport,
}

impl SceneArguments {
    /// Reads scene and probe.
    pub(crate) fn load(&self, quiet: bool) -> Result<LoadedScene> {
        let (mut description, light, map) = if let Ok(scene) = BuiltinScene::from_str(&self.scene) {
            // It takes no memory to speak of, so that its light may be read meanwhile.
            let environment = Some(scene.environment());
            let of_scene = SceneDescription { environment, ..SceneDescription::default() };
            let light = self.environment.settings(&of_scene);
            let map = || self.environment.load(&light, quiet);
            let (description, map) = rayon::join(|| scene.description(), map);
            (description, light, map?)
        } else {
            let description = load_scene(&self.scene, quiet)?;
            let light = self.environment.settings(&description);
            let map = self.environment.load(&light, quiet)?;
            (description, light, map)
        };
        let view = self.stage(&mut description, light.up.vector())?;
        Ok(LoadedScene { description, light, map, view })
    }

    /// Builds what was loaded.
    pub(crate) fn build(&self, loaded: LoadedScene) -> Result<View> {
        let LoadedScene { description, light, map, view } = loaded;
        let Size { width, height } = self.camera.size;
        let camera = Camera::new(&view, width, height)?;
        let n_triangles: usize = description.parts.iter().map(|p| p.mesh.triangles.len()).sum();
        memory::allow(
            &format!("{}: a tree over {n_triangles} triangles", self.scene),
            memory::TRIANGLE * n_triangles as u64,
        )?;
        memory::keep(memory::TRIANGLE * n_triangles as u64);
        let scene = Scene::new(description).with_context(|| self.scene.clone())?;
        let orientation = Orientation { up: light.up, rotation: light.rotate_degrees };
        let scale = light.scale * light.exposure.exp2();
        let probe = probe_name(&light.source);
        let environment =
            Environment::new(map, orientation, scale).with_context(|| probe.clone())?;
        let report = SceneReport {
            scene: self.scene.clone(),
            triangles: scene.triangle_count(),
            material: self.stage.material.as_ref().map(|m| m.text.clone()),
            normalize: self.stage.normalize,
            ground: self.stage.ground,
            hide_env: self.stage.hide_env,
            environment: EnvironmentReport::new(probe.clone(), &light, &environment),
            camera: CameraReport::new(&view),
            size: [width, height],
        };
        Ok(View { scene, camera, camera_settings: view, environment, probe, report })
    }

    /// Changes the scene as the flags say; the camera frames what is not scenery.
    fn stage(&self, scene: &mut SceneDescription, up: Vec3) -> Result<CameraSettings> {
        let Size { width, height } = self.camera.size;
        let bounds = self.stage.apply(scene, up);
        // Squares of lengths must be finite.
        let extent = bounds.size().max_element();
        if extent > 1e18 {
            let text = format!("{}: the scene is too large: {extent:e} across", self.scene);
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
            background: if self.stage.hide_env { Background::Hidden } else { Background::Shown },
            ..RenderSettings::default()
        }
    }
}

/// Starts as many threads as asked for.
pub(crate) fn start_threads(asked: Option<u32>) -> Result<()> {
    // Slurm grants threads that only some of its set-ups enforce.
    let granted = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let granted = granted.and_then(|n| n.parse().ok()).filter(|&n| n > 0);
    if let Some(threads) = asked.or(granted) {
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

/// A built-in scene by its name, else a file.
pub(crate) fn load_scene(name: &str, quiet: bool) -> Result<SceneDescription> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok(builtin.description());
    }
    let loaded = load_within(Path::new(name), memory::left())?;
    memory::keep(loaded.memory);
    for warning in &loaded.warnings {
        warn(quiet, warning);
    }
    Ok(loaded.description)
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
            sanitize: self.sanitize,
            max_memory: memory::left(),
        };
        let loaded = load_probe(path, &options)?;
        let texels = loaded.image.pixels.len() as u64;
        allow_environment(&path.display().to_string(), texels)?;
        let repaired = loaded.sanitized;
        if repaired.negative + repaired.non_finite > 0 {
            warn(
                quiet,
                &format!(
                    "{}: repaired {} negative and {} non-finite values",
                    path.display(),
                    repaired.negative,
                    repaired.non_finite
                ),
            );
        }
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

impl StageArguments {
    /// Changes the scene as the flags say; returns the bounds of what the camera should frame.
    fn apply(&self, scene: &mut SceneDescription, up: Vec3) -> Aabb {
        if self.normalize {
            scene.normalize();
        }
        if let Some(material) = &self.material {
            scene.set_subject_material(Material::from(material.spec));
        }
        let bounds = scene.subject_bounds();
        if self.ground {
            scene.add_ground(up);
        }
        bounds
    }
}

impl CameraArguments {
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
