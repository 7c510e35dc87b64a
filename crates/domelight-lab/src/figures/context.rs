//! Shared by all figures: the light, the scene, and code that renders and measures pictures.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::str::FromStr as _;

use domelight::RgbImage;
use domelight::bsdf::Bsdf;
use domelight::code;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::mapping::{Mapping, to_lat_long};
use domelight::environment::{Environment, LatLongGrid};
use domelight::math::{Vec3, vec2};
use domelight::picture::compare::compare;
use domelight::picture::exposure::Exposure;
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::quote::{Code, Shell, shell};
use domelight::render::{Layers, RenderSettings, Renderer};
use domelight::sampling::{Heuristic, SamplerKind};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, EnvironmentSettings, EnvironmentSource, Scene, SceneDescription};
use domelight::strategy::{PreparedStrategy, StrategySpec};

use super::FigureSettings;
use crate::job::{FilePart, Job, load_scene, probe_name};
use crate::names::shared_word;
use crate::scene::{close_up, view_of};
use crate::usage::Stopwatch;
use crate::{At as _, Error, Host};

/// Rows of the displayed map.
const SHOWN_ROWS: usize = 240;

/// The light, scene and settings of a run.
pub struct FigureContext<'a> {
    pub(crate) environment: Environment,
    /// The map, downsampled for display.
    pub(crate) map: RgbImage,
    /// The arguments common to all figures of this run, for the commands on the page.
    pub(crate) arguments: Code<Shell>,
    pub(crate) probe: String,
    pub(crate) scene: String,
    pub(crate) quick: bool,
    pub(crate) seed: u64,
    description: SceneDescription,
    up: Vec3,
    pub(crate) host: &'a dyn Host,
    references: RefCell<HashMap<String, Rc<Layers>>>,
}

/// What the camera sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject<'a> {
    /// The whole scene, unchanged.
    Scene,
    /// The scene's main object in one material, without floor or plinth: the lecture's statue.
    Alone(&'a str),
    /// A white matte sphere that fills an orthographic picture.
    Sphere,
}

impl<'a> FigureContext<'a> {
    /// Loads scene and probe.
    ///
    /// # Errors
    /// If the scene or the probe cannot be used, or the map is black.
    pub fn load(settings: &FigureSettings, host: &'a dyn Host) -> Result<Self, Error> {
        let (mut description, _) = load_scene(&settings.scene, &FilePart::default(), false, host)?;
        let is_builtin = BuiltinScene::from_str(&settings.scene).is_ok();
        if is_builtin || description.environment.is_none() {
            let source = EnvironmentSource::Builtin(BuiltinProbe::Cathedral.name().to_owned());
            let up = description.up.unwrap_or_default();
            description.environment = Some(EnvironmentSettings::new(source, up));
        }
        let light = settings.environment.over(&description);
        let map = settings.environment.load(&light, host)?;
        let probe = probe_name(&light.source);
        let environment = light.environment(map).at(&probe)?;
        if environment.power() == 0.0 {
            let why = format!("{probe}: the map is black; there is nothing to show");
            return Err(Error::Failed(why));
        }
        let shown = SHOWN_ROWS.min(environment.map().height);
        Ok(Self {
            map: to_lat_long(environment.map(), Mapping::LatLong, shown),
            environment,
            arguments: common_arguments(settings),
            probe,
            scene: settings.scene.clone(),
            quick: settings.quick,
            seed: settings.seed,
            up: light.up.vector(),
            description,
            host,
            references: RefCell::default(),
        })
    }

    /// Returns `full`, or `quick` in a quick run.
    pub(crate) fn choose<T>(&self, full: T, quick: T) -> T {
        if self.quick { quick } else { full }
    }

    /// The map's tone mapping, with the usual automatic exposure.
    pub(crate) fn map_tone(&self) -> ToneMapping {
        exposed(Exposure::Auto.stops(&self.map, None))
    }

    /// The direction of the map's brightest texel.
    pub(crate) fn brightest(&self) -> Vec3 {
        let map = self.environment.map();
        let brightest = (0..map.pixels.len())
            .max_by(|&a, &b| map.pixels[a].luminance().total_cmp(&map.pixels[b].luminance()))
            .unwrap_or(0);
        let (x, y) = (brightest % map.width, brightest / map.width);
        let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        self.environment.direction(vec2(at(x, map.width), at(y, map.height)))
    }

    /// The centers of the displayed map's texels in world space, with their solid angles [sr].
    pub(crate) fn directions(&self) -> impl Iterator<Item = (Vec3, f64)> + '_ {
        let (width, height) = (self.map.width, self.map.height);
        let grid = LatLongGrid::new(width, height);
        (0..width * height).map(move |i| {
            let (x, y) = (i % width, i / width);
            let uv = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            (self.environment.direction(uv), grid.solid_angle(y))
        })
    }

    /// Sets up the camera.
    pub(crate) fn scene(
        &self,
        subject: Subject,
        width: usize,
        height: usize,
    ) -> Result<FigureScene<'_>, Error> {
        let mut description = match subject {
            Subject::Sphere => BuiltinScene::SphereOrthographic.description(),
            _ => self.description.clone(),
        };
        let aspect = width as f32 / height as f32;
        let view = if let Subject::Alone(material) = subject {
            let text = material;
            let bsdf: Bsdf = text.parse().at(format_args!("material {text}"))?;
            description.set_subject_material(bsdf);
            description.remove_scenery();
            close_up(&description, aspect, self.up)
        } else {
            view_of(&description, aspect, self.up)
        };
        Ok(FigureScene {
            context: self,
            name: format!("{subject:?} {width}x{height}"),
            reference: match subject {
                Subject::Alone(_) => self.choose(split(1024, 1024), split(64, 64)),
                // Mostly matte.
                Subject::Scene | Subject::Sphere => self.choose(split(1536, 128), split(64, 16)),
            },
            camera: Camera::new(&view, width, height)?,
            scene: Scene::new(description).at(&self.scene)?,
            settings: RenderSettings {
                width,
                height,
                n_samples: 1,
                seed: self.seed,
                ..RenderSettings::default()
            },
        })
    }
}

/// The options shared by all commands on the page, with a space before each.
fn common_arguments(settings: &FigureSettings) -> Code<Shell> {
    let mut words = Vec::new();
    if settings.scene != BuiltinScene::Statue.name() {
        words.push(format!("--scene={}", settings.scene));
    }
    let light = settings.environment.clone();
    words.extend(Job { light, ..Job::default() }.arguments());
    if settings.seed != 0 {
        words.push(format!("--seed={}", settings.seed));
    }
    if settings.quick {
        words.push("--quick".to_owned());
    }
    let mut text = Code::default();
    for word in words {
        text += code!(Shell, " {word}", word = shell::word(&shared_word(&word)));
    }
    text
}

/// A scene in front of a camera. For one seed, all of its pictures share the same camera rays, one per pixel; they
/// differ only in the lighting estimate.
pub(crate) struct FigureScene<'a> {
    context: &'a FigureContext<'a>,
    /// Describes the view, not the sampling.
    name: String,
    /// Samples per technique in each pixel of the converged picture.
    reference: Split,
    pub(crate) scene: Scene,
    pub(crate) camera: Camera,
    pub(crate) settings: RenderSettings,
}

/// A picture and its cost.
pub(crate) struct FigureRender {
    pub(crate) layers: Layers,
    /// A description of the strategy.
    pub(crate) strategy: String,
    pub(crate) shadow_rays: u64,
    pub(crate) points: u64,
    /// CPU seconds of all threads; wall-clock seconds where the system does not report them.
    pub(crate) seconds: f64,
}

/// A picture and its error against the converged one.
pub(crate) struct FigureMeasurement {
    pub(crate) render: FigureRender,
    /// The mean of (I − R)² / (R² + 0.01) over the pixels that show the scene.
    pub(crate) rel_mse: f64,
}

impl FigureScene<'_> {
    /// Sets the number of camera samples per pixel.
    pub(crate) fn samples(mut self, n_samples: u32) -> Self {
        self.settings.n_samples = n_samples;
        self
    }

    /// Fills in the parts of a specification that depend on the scene.
    pub(crate) fn complete(&self, spec: StrategySpec) -> StrategySpec {
        spec.for_picture(&self.scene, &self.camera, &self.context.environment, &self.settings)
    }

    /// Renders the picture.
    pub(crate) fn render(&self, spec: StrategySpec) -> Result<FigureRender, Error> {
        self.render_with(spec, self.settings.seed, SamplerKind::Sobol)
    }

    /// Renders the picture with another seed or sampler.
    pub(crate) fn render_with(
        &self,
        spec: StrategySpec,
        seed: u64,
        sampler: SamplerKind,
    ) -> Result<FigureRender, Error> {
        let FigureContext { environment, host, .. } = self.context;
        let settings = RenderSettings { seed, sampler, ..self.settings };
        let spec = self.complete(spec);
        let strategy = PreparedStrategy::new(spec, environment)?;
        let mut watch = Stopwatch::start();
        let Self { scene, camera, .. } = self;
        let mut renderer = Renderer::with_strategy(scene, camera, environment, &strategy, settings);
        renderer.run(&*host.progress("", &settings));
        let rendering = renderer.rendering();
        let seconds = watch.lap();
        host.check_canceled()?;
        Ok(FigureRender {
            layers: rendering.layers,
            strategy: spec.description(),
            shadow_rays: rendering.counts.shadow_rays,
            points: rendering.counts.shading_points,
            seconds: seconds.cpu.unwrap_or(seconds.wall),
        })
    }

    /// Renders the picture and compares it with the converged one.
    pub(crate) fn measure(&self, spec: StrategySpec) -> Result<FigureMeasurement, Error> {
        self.measure_with(spec, self.settings.seed, SamplerKind::Sobol)
    }

    /// Like [`FigureScene::measure`], with another seed or sampler.
    pub(crate) fn measure_with(
        &self,
        spec: StrategySpec,
        seed: u64,
        sampler: SamplerKind,
    ) -> Result<FigureMeasurement, Error> {
        let reference = self.reference(seed, sampler)?;
        let render = self.render_with(spec, seed, sampler)?;
        let covered: Vec<bool> = reference.depth.iter().map(|&d| d > 0.0).collect();
        let error = compare(&render.layers.color, &reference.color, Some(&covered))?;
        Ok(FigureMeasurement { render, rel_mse: error.rel_mse })
    }

    /// The converged picture with the camera rays of that seed: many samples of both techniques, combined by multiple
    /// importance sampling. Rendered once per run.
    pub(crate) fn reference(&self, seed: u64, sampler: SamplerKind) -> Result<Rc<Layers>, Error> {
        let n_samples = self.settings.n_samples;
        let key = format!("{} {n_samples} {seed} {sampler:?}", self.name);
        if let Some(made) = self.context.references.borrow().get(&key) {
            return Ok(made.clone());
        }
        let Split { environment, brdf } = self.reference;
        let spec = StrategySpec::Mis {
            n_environment: environment.div_ceil(n_samples),
            n_brdf: brdf.div_ceil(n_samples),
            n_portal: 0,
            heuristic: Heuristic::Power,
            compensation: true,
        };
        let made = Rc::new(self.render_with(spec, seed, sampler)?.layers);
        self.context.references.borrow_mut().insert(key, made.clone());
        Ok(made)
    }

    /// The tone mapping of this scene's pictures: the automatic exposure that `render` would choose for the reference.
    pub(crate) fn tone(&self) -> Result<ToneMapping, Error> {
        let reference = self.reference(self.settings.seed, SamplerKind::Sobol)?;
        Ok(exposed(Exposure::Auto.stops(&reference.color, Some(&reference.alpha))))
    }
}

/// Environment samples and BRDF samples.
#[derive(Clone, Copy, Debug)]
struct Split {
    environment: u32,
    brdf: u32,
}

fn split(environment: u32, brdf: u32) -> Split {
    Split { environment, brdf }
}

/// Blender's curve at that exposure.
fn exposed(exposure: f32) -> ToneMapping {
    ToneMapping { exposure, curve: ToneCurve::Agx }
}
