//! `domelight render`: from files to a picture.

use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use anyhow::{Context as _, Result};
use clap::{Args, ValueEnum};
use domelight::bsdf::MaterialSpec;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::mapping::Mapping;
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::Vec3;
use domelight::picture::tone::ToneCurve;
use domelight::render::{Background, Filter, RenderSettings, Rendering, render};
use domelight::sampling::{Heuristic, SamplerKind};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, EnvironmentSettings, Projection, Scene, SceneDescription, load,
};
use domelight::strategy::{
    BrdfSampling, EnvironmentSampling, LightTable, MultipleImportanceSampling, Strategy,
};

use crate::interrupt;
use crate::output::{Destination, PngSettings, write_all};
use crate::progress::RenderProgress;
use crate::report::{RenderReport, Settings, Stages};
use crate::usage::Stopwatch;
use crate::values::{Size, Split, Triple, finite, not_negative};
use crate::{Globals, usage_error};

/// Renders a scene lit by an HDR environment.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  domelight render
      the built-in statue under the built-in sky, into domelight.exr and domelight.png
  domelight render bunny.ply --env studio.hdr --material ggx:0.2 --ground -o bunny.png
      your mesh under your HDRI
  domelight render scene.toml --strategy mis --split 3:1 --spp 256 -o out.exr -o out.png
      a scene file, three environment samples for each BRDF sample
  domelight render spheres --env cathedral --strategy brdf --rays 4 --json > stats.json
      another built-in scene, its statistics as JSON")]
pub(crate) struct RenderArgs {
    /// A built-in scene (statue, spheres, material-ball, sphere, …), a mesh (.ply, .obj, .gltf,
    /// .glb) or a scene file (.toml)
    #[arg(default_value = "statue")]
    scene: String,

    #[command(flatten)]
    environment: EnvironmentArgs,
    #[command(flatten)]
    sampling: SamplingArgs,
    #[command(flatten)]
    camera: CameraArgs,
    #[command(flatten)]
    stage: StageArgs,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Environment")]
struct EnvironmentArgs {
    /// A built-in probe (sky, studio, cathedral, constant) or a file (.hdr, .exr, .pfm; - reads
    /// standard input) [default: the scene's, else sky]
    #[arg(long, value_name = "PROBE")]
    env: Option<String>,
    /// Turn the environment about the up axis, counter-clockwise seen from above [degrees]
    #[arg(long, value_name = "DEG", value_parser = finite, allow_negative_numbers = true)]
    env_rotate: Option<f32>,
    /// Multiply the environment's radiance
    #[arg(long, value_name = "X", value_parser = not_negative)]
    env_scale: Option<f32>,
    /// Multiply the environment's radiance by 2^EV
    #[arg(long, value_name = "EV", value_parser = finite, allow_negative_numbers = true)]
    env_exposure: Option<f32>,
    /// The world axis that the top of the map points to
    #[arg(long, value_enum, value_name = "AXIS")]
    env_up: Option<Up>,
    /// The map's layout, where shape and attributes do not tell it rightly
    #[arg(long, value_name = "MAPPING")]
    env_mapping: Option<Mapping>,
    /// The layer of an OpenEXR map
    #[arg(long, value_name = "NAME")]
    env_layer: Option<String>,
    /// Rows of a built-in probe
    #[arg(long, value_name = "ROWS", default_value_t = 1024,
          value_parser = clap::value_parser!(u32).range(1..=16_384))]
    env_rows: u32,
    /// Repair negative, NaN and infinite texels instead of refusing them
    #[arg(long)]
    sanitize: bool,
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Sampling")]
struct SamplingArgs {
    /// How directions are chosen
    #[arg(long, value_enum, default_value_t = StrategyName::Mis)]
    strategy: StrategyName,
    /// Camera samples of each pixel
    #[arg(long, value_name = "N", default_value_t = 64,
          value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: u32,
    /// Shadow rays of each camera sample [default: 1, with mis 2]
    #[arg(long, value_name = "N", conflicts_with = "split",
          value_parser = clap::value_parser!(u32).range(1..=65_536))]
    rays: Option<u32>,
    /// Environment and BRDF samples of each camera sample, with mis [default: half of --rays each]
    #[arg(long, value_name = "M:N")]
    split: Option<Split>,
    /// How mis weighs its samples
    #[arg(long, value_enum, default_value_t = HeuristicName::Balance)]
    heuristic: HeuristicName,
    /// Leave what is dimmer than the mean to the BRDF samples, with mis
    #[arg(long)]
    compensation: bool,
    /// Which points: Owen-scrambled Sobol' or independent random numbers
    #[arg(long, value_enum, default_value_t = SamplerName::Sobol)]
    sampler: SamplerName,
    /// Pixel filter: box, tent, gaussian, blackman-harris
    #[arg(long, default_value = "gaussian")]
    filter: Filter,
    /// Names the random numbers; the same seed gives the same picture
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    threads: Option<u32>,
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Camera")]
struct CameraArgs {
    /// Size of the picture
    #[arg(long, value_name = "WxH", default_value = "720x720")]
    size: Size,
    /// Where the camera is [default: framed to the scene]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    origin: Option<Triple>,
    /// What it looks at
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    target: Option<Triple>,
    /// The direction that is up in the picture
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    up: Option<Triple>,
    /// Vertical field of view [degrees]
    #[arg(long, value_name = "DEG", value_parser = not_negative, conflicts_with = "ortho")]
    fov: Option<f32>,
    /// Orthographic, with this height of the picture in the world
    #[arg(long, value_name = "HEIGHT", value_parser = not_negative)]
    ortho: Option<f32>,
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Scene")]
struct StageArgs {
    /// Material of the subject: diffuse:0.8, phong:50:1:0.5, ward:0.15:0.5, ggx:0.2, mix, …
    #[arg(long, value_name = "M")]
    material: Option<MaterialSpec>,
    /// Move and scale the scene: centre of the bounds to 0, longest half-extent to 1
    #[arg(long)]
    normalize: bool,
    /// Put a diffuse disk (reflectance 0.5) under the scene
    #[arg(long)]
    ground: bool,
    /// Leave the background out: transparent where nothing is
    #[arg(long)]
    hide_env: bool,
}

#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Where to: .exr (all layers), .png, .hdr or .pfm; several times for several files; - writes
    /// OpenEXR to standard output [default: domelight.exr and domelight.png]
    #[arg(short, long = "output", value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Brightness of PNG output in stops
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = finite,
          allow_negative_numbers = true)]
    exposure: f32,
    /// Tone curve of PNG output: srgb, reinhard, aces, agx, neutral
    #[arg(long, value_name = "CURVE", default_value = "agx")]
    tone: ToneCurve,
    /// Print settings, times and counts as JSON on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum StrategyName {
    /// From the reflectance alone
    Brdf,
    /// From the environment's table alone
    #[value(alias = "env", alias = "em")]
    Environment,
    /// Both, by multiple importance sampling
    Mis,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum HeuristicName {
    /// wᵢ = nᵢpᵢ / Σ nₖpₖ
    Balance,
    /// The same with squares
    Power,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplerName {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// Independent pseudo-random points
    Independent,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Up {
    /// +Y
    Y,
    /// +Z
    Z,
}

impl From<Up> for UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::Y => Self::Y,
            Up::Z => Self::Z,
        }
    }
}

/// How many samples of each kind a camera sample takes.
#[derive(Clone, Copy, Debug)]
enum Plan {
    Brdf { n: u32 },
    Environment { n: u32 },
    Mis { split: Split, heuristic: Heuristic, compensation: bool },
}

impl SamplingArgs {
    /// Checks what the flags say together.
    fn plan(&self) -> Result<Plan> {
        let heuristic = match self.heuristic {
            HeuristicName::Balance => Heuristic::Balance,
            HeuristicName::Power => Heuristic::Power,
        };
        let only_mis = [(self.split.is_some(), "--split"), (self.compensation, "--compensation")];
        let n = self.rays.unwrap_or(1);
        match self.strategy {
            StrategyName::Mis => {
                let split = match (self.split, self.rays.unwrap_or(2)) {
                    (Some(split), _) => split,
                    (None, 1) => {
                        return usage_error(
                            "--strategy mis takes one sample of each kind at least: use --rays 2, \
                             or --split 1:0 or 0:1 for one kind alone",
                        );
                    }
                    (None, n) => Split { environment: n.div_ceil(2), brdf: n / 2 },
                };
                if self.compensation && split.brdf == 0 {
                    return usage_error("--compensation needs BRDF samples: --split M:N with N > 0");
                }
                Ok(Plan::Mis { split, heuristic, compensation: self.compensation })
            }
            _ if only_mis.iter().any(|(given, _)| *given) => {
                let names: Vec<_> =
                    only_mis.iter().filter(|(given, _)| *given).map(|(_, name)| *name).collect();
                usage_error(format!("{} goes with --strategy mis", names.join(" and ")))
            }
            StrategyName::Brdf => Ok(Plan::Brdf { n }),
            StrategyName::Environment => Ok(Plan::Environment { n }),
        }
    }
}

/// Runs the subcommand.
pub(crate) fn run(args: &RenderArgs, globals: &Globals) -> Result<()> {
    let plan = args.sampling.plan()?;
    let destinations = args.output.destinations()?;
    if let Some(threads) = args.sampling.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build_global()
            .context("cannot start the threads")?;
    }
    let interrupted = interrupt::flag();
    let mut watch = Stopwatch::start();

    // Load.
    let mut description = load_scene(&args.scene, globals)?;
    let light = args.environment.settings(description.environment.take());
    let map = args.environment.load(&light, globals)?;
    let load = watch.lap();

    // Build.
    let aspect = args.camera.size.width as f32 / args.camera.size.height as f32;
    let bounds = args.stage.apply(&mut description, light.up.vector());
    let camera = args.camera.settings(description.camera.as_ref(), || {
        CameraSettings::framing(&bounds, aspect, light.up.vector())
    });
    let Size { width, height } = args.camera.size;
    let camera = Camera::new(&camera, width, height)?;
    let scene = Scene::new(description).with_context(|| args.scene.clone())?;
    let orientation = Orientation { up: light.up, rotation: light.rotation };
    let environment = Environment::new(map, orientation, light.scale)
        .with_context(|| light.probe.clone())?;
    let table = matches!(plan, Plan::Mis { compensation: true, .. })
        .then(|| CompensatedTable::new(&environment));
    let build = watch.lap();

    // Render.
    let settings = args.render_settings();
    let job = Job { scene: &scene, camera: &camera, environment: &environment, settings: &settings };
    let n_camera_rays = (width * height) as u64 * u64::from(settings.n_samples);
    let progress = RenderProgress::new(n_camera_rays, globals.quiet, interrupted);
    let rendering = job.run(plan, table.as_ref(), &progress)?;
    progress.finish();
    let render = watch.lap();

    // Write.
    let png = PngSettings { exposure: args.output.exposure, tone: args.output.tone };
    let opaque = settings.background == Background::Shown;
    write_all(&destinations, &rendering.layers, &png, opaque, &attributes)?;
    let report = RenderReport::new(
        Settings::new(&args.scene, &light.probe, &scene, &environment, plan.describe(), &settings),
        &rendering,
        Stages { load, build, render, write: watch.lap() },
        &destinations,
    );
    if args.output.json {
        report.print_json()?;
    } else if !globals.quiet {
        report.print_summary();
    }
    report.check()
}

impl Plan {
    /// The name and the samples, for the report.
    fn describe(self) -> String {
        match self {
            Self::Brdf { n } => format!("brdf, {n} a camera sample"),
            Self::Environment { n } => format!("environment, {n} a camera sample"),
            Self::Mis { split, heuristic, compensation } => format!(
                "mis {}:{}, {} heuristic{}",
                split.environment,
                split.brdf,
                if heuristic == Heuristic::Power { "power" } else { "balance" },
                if compensation { ", compensated" } else { "" }
            ),
        }
    }
}

/// A scene ready to be rendered.
struct Job<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    environment: &'a Environment,
    settings: &'a RenderSettings,
}

impl Job<'_> {
    fn run(
        &self,
        plan: Plan,
        table: Option<&CompensatedTable>,
        progress: &RenderProgress,
    ) -> Result<Rendering> {
        let environment = self.environment;
        Ok(match plan {
            Plan::Brdf { n } => self.with(&BrdfSampling { environment, n_samples: n }, progress),
            Plan::Environment { n } => {
                self.with(&EnvironmentSampling { environment, n_samples: n }, progress)
            }
            Plan::Mis { split: Split { environment: m, brdf: n }, heuristic, .. } => {
                let table = table.map_or(LightTable::Full, LightTable::Compensated);
                let mis = MultipleImportanceSampling::new(environment, table, heuristic, m, n)?;
                self.with(&mis, progress)
            }
        })
    }

    fn with<S: Strategy>(&self, strategy: &S, progress: &RenderProgress) -> Rendering {
        render(self.scene, self.camera, self.environment, strategy, self.settings, progress)
    }
}

impl RenderArgs {
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
fn load_scene(name: &str, globals: &Globals) -> Result<SceneDescription> {
    if let Ok(builtin) = BuiltinScene::from_str(name) {
        return Ok(builtin.description());
    }
    let loaded = load(Path::new(name))?;
    for warning in &loaded.warnings {
        globals.warn(warning);
    }
    Ok(loaded.description)
}

impl EnvironmentArgs {
    /// The scene's own settings with the flags over them.
    fn settings(&self, of_scene: Option<EnvironmentSettings>) -> EnvironmentSettings {
        let mut settings = of_scene.unwrap_or_default();
        if let Some(probe) = &self.env {
            // Another probe brings none of the first one's adjustments with it.
            let up = settings.up;
            settings = EnvironmentSettings { probe: probe.clone(), up, ..Default::default() };
        }
        if let Some(rotation) = self.env_rotate {
            settings.rotation = rotation;
        }
        if let Some(scale) = self.env_scale {
            settings.scale = scale;
        }
        if let Some(up) = self.env_up {
            settings.up = up.into();
        }
        settings.scale *= self.env_exposure.unwrap_or(0.0).exp2();
        settings
    }

    fn load(&self, light: &EnvironmentSettings, globals: &Globals) -> Result<domelight::RgbImage> {
        if let Ok(builtin) = BuiltinProbe::from_str(&light.probe) {
            return Ok(builtin.image(self.env_rows as usize));
        }
        let options = ProbeOptions {
            mapping: self.env_mapping,
            layer: self.env_layer.clone(),
            sanitize: self.sanitize,
        };
        let loaded = load_probe(Path::new(&light.probe), &options)?;
        if !loaded.sanitized.is_clean() {
            globals.warn(format!("{}: {}", light.probe, loaded.sanitized));
        }
        Ok(loaded.image)
    }
}

impl StageArgs {
    /// Changes the scene as the flags say; returns the bounds of what the camera should frame.
    fn apply(&self, scene: &mut SceneDescription, up: Vec3) -> domelight::geometry::Aabb {
        if self.normalize {
            scene.normalize();
        }
        if let Some(material) = &self.material {
            scene.set_subject_material(material.material());
        }
        let bounds = scene.subject_bounds();
        if self.ground {
            scene.add_ground(up);
        }
        bounds
    }
}

impl CameraArgs {
    /// The flags over the scene's own camera, or over one framed to the scene.
    fn settings(
        &self,
        of_scene: Option<&CameraSettings>,
        framed: impl FnOnce() -> CameraSettings,
    ) -> CameraSettings {
        let mut camera = of_scene.cloned().unwrap_or_else(framed);
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

impl OutputArgs {
    fn destinations(&self) -> Result<Vec<Destination>> {
        let defaults = ["domelight.exr", "domelight.png"].map(PathBuf::from);
        let paths = if self.output.is_empty() { &defaults[..] } else { &self.output };
        if self.json && paths.iter().any(|p| p == Path::new("-")) {
            return usage_error("--json and -o - would both write to standard output");
        }
        paths.iter().map(|path| Destination::new(path)).collect()
    }
}
