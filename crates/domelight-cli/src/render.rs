//! `domelight render`: from files to a picture.

use std::path::Path;
use std::str::FromStr as _;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, bail};
use domelight::bsdf::Material;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::geometry::Aabb;
use domelight::math::Vec3;
use domelight::picture::tone::ToneCurve;
use domelight::render::{Background, RenderSettings, survey};
use domelight::sampling::SamplerKind;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, EnvironmentSettings, EnvironmentSource, Projection, Scene,
    SceneDescription, load,
};

use crate::args::render::{
    CameraArguments, EnvironmentArguments, OutputArguments, RenderArguments, SamplerName,
    StageArguments,
};
use crate::failure::warn;
use crate::interrupt;
use crate::output::{PicturePath, require_one_on_standard_output};
use crate::progress::RenderProgress;
use crate::report::{CameraReport, EnvironmentReport, RenderReport, Settings, Stages};
use crate::strategy::{Job, Prepared};
use crate::usage::Stopwatch;
use crate::values::{Size, Triple};

/// Runs the subcommand.
pub(crate) fn run(arguments: &RenderArguments, quiet: bool) -> Result<()> {
    let plan = arguments.sampling.plan()?;
    let outputs = arguments.output.paths()?;
    outputs.iter().try_for_each(PicturePath::require_writable)?;
    if let Some(threads) = arguments.sampling.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads as usize);
        pool.build_global().context("cannot start the threads")?;
    }
    let interrupted = interrupt::flag();
    let mut watch = Stopwatch::start();

    let mut description = load_scene(&arguments.scene, quiet)?;
    let light = arguments.environment.settings(&description);
    let map = arguments.environment.load(&light, quiet)?;
    let load = watch.lap();

    let view = arguments.stage(&mut description, light.up.vector());
    let Size { width, height } = arguments.camera.size;
    let camera = Camera::new(&view, width, height)?;
    let scene = Scene::new(description).with_context(|| arguments.scene.clone())?;
    let orientation = Orientation { up: light.up, rotation: light.rotate_degrees };
    let scale = light.scale * light.exposure.exp2();
    let probe = probe_name(&light.source);
    let environment = Environment::new(map, orientation, scale).with_context(|| probe.clone())?;
    let render_settings = arguments.render_settings();
    let seed = render_settings.seed;
    let points = || survey(&scene, &camera, &render_settings);
    let plan = plan.for_scene(points, &environment, seed);
    let prepared = Prepared::new(plan, &environment).with_context(|| probe.clone())?;
    let build = watch.lap();
    if interrupted.load(Ordering::Relaxed) {
        bail!("interrupted before the first sample; nothing was written");
    }

    let job = Job {
        scene: &scene,
        camera: &camera,
        environment: &environment,
        settings: &render_settings,
    };
    let n_pixels = (render_settings.width * render_settings.height) as u64;
    let progress =
        RenderProgress::new(n_pixels * u64::from(render_settings.n_samples), quiet, interrupted);
    let rendering = job.run(&prepared, &progress)?;
    progress.finish();
    if rendering.counts.camera_rays == 0 {
        bail!("interrupted before the first sample; nothing was written");
    }
    let render = watch.lap();

    let stage = &arguments.stage;
    let settings = Settings {
        scene: arguments.scene.clone(),
        triangles: scene.triangle_count(),
        material: stage.material.as_ref().map(|m| m.text.clone()),
        normalize: stage.normalize,
        ground: stage.ground,
        hide_env: stage.hide_env,
        environment: EnvironmentReport::new(probe, &light, &environment),
        camera: CameraReport::new(&view),
        strategy: plan.describe(),
        size: [width, height],
        spp: render_settings.n_samples,
        sampler: format!("{:?}", render_settings.sampler).to_lowercase(),
        filter: render_settings.filter.name(),
        seed,
        threads: rayon::current_num_threads(),
    };
    let tone = arguments.output.tone.mapping(ToneCurve::Agx);
    // A full disk under one file must not cost the others.
    let write = |path: &PicturePath| {
        let attributes = settings.provenance(rendering.complete);
        path.write_layers(&rendering.layers, &tone, stage.hide_env, attributes)
    };
    outputs.iter().map(write).fold(Ok(()), Result::and)?;
    let stages = Stages { load, build, render, write: watch.lap() };
    let rejection = plan.acceptance(points, &environment, seed)?;
    let report = RenderReport::new(settings, &rendering, stages, rejection, &outputs);
    if arguments.output.json {
        report.print_json()?;
    } else if !quiet {
        report.print_summary();
    }
    report.check(quiet)
}

impl RenderArguments {
    /// Changes the scene as the flags say; the camera frames what is not scenery.
    fn stage(&self, scene: &mut SceneDescription, up: Vec3) -> CameraSettings {
        let Size { width, height } = self.camera.size;
        let bounds = self.stage.apply(scene, up);
        self.camera.settings(scene.camera.as_ref(), || {
            CameraSettings::framing(&bounds, width as f32 / height as f32, up)
        })
    }

    fn render_settings(&self) -> RenderSettings {
        RenderSettings {
            width: self.camera.size.width,
            height: self.camera.size.height,
            n_samples: self.sampling.spp,
            seed: self.sampling.seed,
            filter: self.sampling.filter,
            sampler: match self.sampling.sampler {
                SamplerName::Sobol => SamplerKind::Sobol,
                SamplerName::Independent => SamplerKind::Independent,
            },
            background: if self.stage.hide_env { Background::Hidden } else { Background::Shown },
            ..RenderSettings::default()
        }
    }
}

/// A built-in scene by its name, else a file.
pub(crate) fn load_scene(name: &str, quiet: bool) -> Result<SceneDescription> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok(builtin.description());
    }
    let loaded = load(Path::new(name))?;
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

    pub(crate) fn load(
        &self,
        light: &EnvironmentSettings,
        quiet: bool,
    ) -> Result<domelight::RgbImage> {
        let path = match &light.source {
            EnvironmentSource::Builtin(name) => {
                return Ok(BuiltinProbe::from_str(name)?.image(self.env_rows as usize));
            }
            EnvironmentSource::File(path) => path,
        };
        let options = ProbeOptions {
            mapping: self.env_mapping,
            layer: self.env_layer.clone(),
            sanitize: self.sanitize,
        };
        let loaded = load_probe(path, &options)?;
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
        require_one_on_standard_output(&all, self.json)?;
        Ok(paths)
    }
}
