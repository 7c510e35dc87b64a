//! Rendering: settings from Python, a render that signals can end, and its film.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::{Duration, Instant};

use domelight::environment;
use domelight::inspect::{InspectError, Inspector};
use domelight::render::{
    Background, Counts, Observer, Passes, Provenance, RenderSettings, Renderer, TileView, Window,
    automatic_exposure,
};
use domelight::scene::{self, CameraSettings, EnvironmentSettings, EnvironmentSource};
use domelight::strategy::{PreparedStrategy, Strategy, StrategyError, StrategyKind, StrategySpec};
use domelight_lab::display::{self, Display};
use domelight_lab::job::{Job, Light};
use domelight_lab::names::file_name;
use domelight_lab::refuse_repeating_points;
use domelight_lab::report::{CameraReport, EnvironmentReport, SceneReport};
use domelight_lab::scene::PreparedSceneRef;
use pyo3::exceptions::{PyConnectionError, PyMemoryError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;

use crate::bsdf::MaterialLike;
use crate::camera::CameraLike;
use crate::engine::{caught, n_threads, pool, wait};
use crate::environment::Environment;
use crate::error::{RenderInterrupted, bad_value, from_source, to_python, warn};
use crate::failure::Failure;
use crate::film::{Film, Making, automatic_exposure_of};
use crate::lobe::PythonLobe;
use crate::options;
use crate::scene::{Scene, SceneData};
use crate::strategy::PythonStrategy;

/// The strategy: built-in or a Python function.
pub(crate) enum Choice {
    Builtin(StrategySpec),
    Python(PythonStrategy),
}

/// Everything that a render needs.
pub(crate) struct RenderSetup {
    scene: Arc<SceneData>,
    environment: Arc<environment::Environment>,
    camera: scene::Camera,
    /// The camera, in the scene's own units.
    camera_settings: CameraSettings,
    /// The name of the environment.
    probe: String,
    settings: RenderSettings,
    strategy: Choice,
    n_threads: usize,
    /// The built-in strategy with the pilot's choices.
    chosen: OnceLock<StrategySpec>,
    /// The exposure of all films [stops].
    exposure: OnceLock<f32>,
    /// The exception of a Python function, if any.
    failure: Arc<Failure>,
}

/// What a caller gives beside scene and light.
pub(crate) struct Arguments<'py> {
    pub(crate) job: Job,
    pub(crate) strategy: Bound<'py, PyAny>,
    pub(crate) threads: Option<usize>,
    pub(crate) camera: Option<CameraLike>,
    pub(crate) tile_size: Option<usize>,
}

/// Pixels along the edge of a tile of a strategy written in Python: large enough that calls cost little.
const PYTHON_TILE_SIZE: usize = 64;

impl RenderSetup {
    /// Checks the settings before any work.
    pub(crate) fn new(
        py: Python<'_>,
        scene: &Scene,
        environment: Option<&Bound<'_, Environment>>,
        arguments: Arguments<'_>,
    ) -> PyResult<Self> {
        let Arguments { job, strategy, threads, camera, tile_size } = arguments;
        if let Some(tile) = tile_size.filter(|n| !(1..=1024).contains(n)) {
            return Err(bad_value(format!("tile_size is {tile}; it must be from 1 to 1024")));
        }
        let settings = job.settings();
        let RenderSettings { width, height, .. } = settings;
        let n_threads = n_threads(threads)?;
        let choice = choose(&strategy, settings.n_samples, &scene.inner.lobes)?;
        require_memory(width, height)?;

        let (environment, probe) = if let Some(environment) = environment {
            (environment.get().inner.clone(), environment.get().name.clone())
        } else {
            let of_scene = scene.lit_by(py, Light::default())?;
            (of_scene.inner, of_scene.name)
        };
        let up = environment.orientation().up.vector();
        let (camera, camera_settings) = scene.inner.camera(camera.as_ref(), (width, height), up)?;
        let default_tile = match choice {
            Choice::Builtin(_) => settings.tile_size,
            Choice::Python(_) => PYTHON_TILE_SIZE,
        };
        let settings = RenderSettings { tile_size: tile_size.unwrap_or(default_tile), ..settings };
        Ok(Self {
            scene: scene.inner.clone(),
            environment,
            camera,
            camera_settings,
            probe,
            settings,
            strategy: choice,
            n_threads,
            chosen: OnceLock::new(),
            exposure: OnceLock::new(),
            failure: Arc::default(),
        })
    }

    /// Passes a renderer to the visitor, on the calling thread's pool.
    pub(crate) fn with_renderer<V: Visitor>(&self, visitor: V) -> PyResult<V::Output> {
        let Self { scene, environment, camera, settings, .. } = self;
        // The pilot would call Python's BSDFs direction by direction.
        if scene.lobes.is_empty() {
            let found = || automatic_exposure(&scene.scene, camera, environment, settings).stops;
            self.exposure.get_or_init(found);
        }
        let scene = &scene.scene;
        match &self.strategy {
            Choice::Builtin(spec) => {
                let spec = *self.chosen.get_or_init(|| self.for_picture(*spec));
                let strategy = &PreparedStrategy::new(spec, environment).map_err(to_python)?;
                let renderer =
                    Renderer::with_strategy(scene, camera, environment, strategy, *settings);
                Ok(visitor.visit(renderer))
            }
            Choice::Python(strategy) => {
                let renderer =
                    Renderer::with_strategy(scene, camera, environment, strategy, *settings);
                Ok(visitor.visit(renderer))
            }
        }
    }

    /// The film of a renderer so far.
    pub(crate) fn film<S: Strategy>(&self, renderer: &Renderer<S>) -> Film {
        // A coarse picture would call Python direction by direction, for minutes.
        let is_quick = self.scene.lobes.is_empty();
        let sums = if is_quick { renderer.whole_film() } else { renderer.film() };
        let exposure = *self.exposure.get_or_init(|| automatic_exposure_of(&sums.layers()));
        let (strategy, description) = match (&self.strategy, self.chosen.get()) {
            (Choice::Builtin(spec), None) | (_, Some(spec)) => {
                (spec.to_string(), spec.description())
            }
            (Choice::Python(_), None) => ("python".to_owned(), "python".to_owned()),
        };
        let provenance = Provenance {
            scene: &file_name(&self.scene.name),
            environment: &file_name(&self.probe),
            strategy: &description,
            settings: &self.settings,
            exposure,
        };
        let making = Making {
            n_samples: self.settings.n_samples,
            strategy,
            provenance: provenance.attributes(),
            hidden: self.settings.background == Background::Hidden,
        };
        Film::new(sums, renderer.counts(), renderer.is_complete(), making)
    }

    /// An inspector for a pixel.
    pub(crate) fn inspector(&self, pixel: [usize; 2]) -> Result<Inspector<'_>, InspectError> {
        let Self { scene, environment, camera, settings, .. } = self;
        Inspector::new(&scene.scene, camera, environment, settings, pixel)
    }

    /// A strategy with the pilot's choices.
    pub(crate) fn for_picture(&self, spec: StrategySpec) -> StrategySpec {
        let Self { scene, environment, camera, settings, .. } = self;
        spec.for_picture(&scene.scene, camera, environment, settings)
    }

    /// The settings of each picture.
    pub(crate) fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// The scene under its light, with a report on it.
    pub(crate) fn view<'a>(&'a self, report: &'a SceneReport) -> PreparedSceneRef<'a> {
        let Self { scene, camera, environment, .. } = self;
        PreparedSceneRef { scene: &scene.scene, camera, environment, report }
    }

    /// A report on the scene.
    pub(crate) fn scene_report(&self) -> SceneReport {
        let Self { scene, environment, settings, camera_settings, probe, .. } = self;
        let orientation = environment.orientation();
        let changes = scene.changes();
        let light = EnvironmentSettings {
            rotate_degrees: orientation.rotation,
            ..EnvironmentSettings::new(EnvironmentSource::Builtin(probe.clone()), orientation.up)
        };
        SceneReport {
            scene: scene.name.clone(),
            triangles: scene.scene.triangle_count(),
            warnings: Vec::new(),
            material: changes.material.as_ref().and_then(MaterialLike::text),
            normalize: changes.subject.normalize,
            ground: changes.subject.ground.map(|ground| ground.0),
            hide_env: settings.background == Background::Hidden,
            environment: EnvironmentReport::new(probe.clone(), &light, environment),
            camera: CameraReport::new(camera_settings, scene.offset, None),
            size: [settings.width, settings.height],
        }
    }

    /// The light.
    pub(crate) fn environment(&self) -> &environment::Environment {
        &self.environment
    }

    /// Opens the picture in a viewer.
    fn connect(&self, py: Python<'_>, address: &str) -> PyResult<Display> {
        let RenderSettings { width, height, .. } = self.settings;
        let name = file_name(&self.scene.name);
        py.detach(|| Display::connect(address, &name, [width, height])).map_err(|error| {
            PyConnectionError::new_err(format!(
                "display: no viewer listens at {address}; start tev or HDRView first ({error})"
            ))
        })
    }

    /// The threads that render.
    pub(crate) fn pool(&self) -> PyResult<ThreadPool> {
        pool(self.n_threads, &self.failure)
    }

    /// The number of camera samples of all pixels.
    fn total_samples(&self) -> u64 {
        let RenderSettings { width, height, n_samples, .. } = self.settings;
        width as u64 * height as u64 * u64::from(n_samples)
    }

    /// The finished fraction, in [0, 1].
    pub(crate) fn share(&self, done: &AtomicU64) -> f64 {
        (done.load(Ordering::Relaxed) as f64 / self.total_samples().max(1) as f64).min(1.0)
    }

    /// Whether a progressive render joins passes until its samples have doubled. Passes of strategies with many rays are
    /// short. Those of product sampling are worth a film each, and a target error has passes of its own.
    pub(crate) fn joins_passes(&self) -> bool {
        let kind = match &self.strategy {
            Choice::Builtin(spec) => Some(spec.kind()),
            Choice::Python(_) => None,
        };
        self.settings.passes == Passes::Doubling
            && self.settings.target_error.is_none()
            && kind != Some(StrategyKind::Product)
    }

    /// Whether the strategy or a BSDF is a Python function.
    pub(crate) fn calls_python(&self) -> bool {
        !self.scene.lobes.is_empty() || matches!(self.strategy, Choice::Python(_))
    }

    /// What has failed, if anything.
    pub(crate) fn failure(&self) -> &Failure {
        &self.failure
    }
}

/// The candidates of SIR for each ray if BSDFs are written in Python and no number is given.
const CANDIDATES_PER_RAY: u32 = 16;

/// The strategy from Python, by name or as a function.
pub(crate) fn choose(
    strategy: &Bound<'_, PyAny>,
    spp: u32,
    lobes: &[&'static PythonLobe],
) -> PyResult<Choice> {
    let Ok(text) = strategy.extract::<String>() else {
        if !strategy.is_callable() {
            return Err(bad_value(format!(
                "strategy is {}; it must be a text such as 'product:8' or callable",
                strategy.repr()?
            )));
        }
        return Ok(Choice::Python(PythonStrategy::new(strategy.clone(), lobes.to_vec())?));
    };
    let mut spec: StrategySpec = text.parse().map_err(|e: StrategyError| to_python(e))?;
    // A pilot would call Python's BSDFs direction by direction, for a minute, before the render can be interrupted.
    if let (StrategySpec::Sir { n_candidates, n_samples, .. }, [_, ..]) = (&mut spec, lobes) {
        n_candidates.get_or_insert(*n_samples * CANDIDATES_PER_RAY);
    }
    refuse_repeating_points(spec, spp).map_err(|e| from_source(&e))?;
    if spec.kind() == StrategyKind::Rejection && lobes.iter().any(|lobe| !lobe.has_bound()) {
        return Err(bad_value("rejection needs the max_eval of a BSDF of one's own"));
    }
    Ok(Choice::Builtin(spec))
}

/// Rejects a picture that does not fit into memory, before the allocator ends the process.
fn require_memory(width: usize, height: usize) -> PyResult<()> {
    let bytes = width
        .saturating_mul(height)
        .saturating_mul(domelight::render::Film::MEMORY_PER_PIXEL as usize);
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| {
        let text = format!("size is ({width}, {height}): {bytes} bytes of memory are not there");
        PyMemoryError::new_err(text)
    })
}

/// An operation on a renderer with any strategy.
pub(crate) trait Visitor {
    /// The result.
    type Output;

    /// Performs the operation.
    fn visit<S: Strategy>(self, renderer: Renderer<S>) -> Self::Output;
}

/// Ends a render that is canceled, fails or runs out of time, and counts its samples.
pub(crate) struct Watch<'a> {
    pub(crate) setup: &'a RenderSetup,
    pub(crate) done: &'a AtomicU64,
    /// The end of the time limit; started tiles are finished.
    pub(crate) end: Option<Instant>,
    /// The viewer in which the picture is shown.
    pub(crate) display: Option<&'a Display>,
}

impl Observer for Watch<'_> {
    fn tile_started(&self, window: Window) {
        if let Some(display) = self.display {
            display.outline(window);
        }
    }

    fn tile_rendered(&self, tile: &TileView) {
        if let Some(display) = self.display {
            display.show(tile);
        }
    }

    fn tile_finished(&self, counts: &Counts) {
        self.done.fetch_add(counts.camera_rays, Ordering::Relaxed);
    }

    fn canceled(&self) -> bool {
        let is_late = || self.end.is_some_and(|end| Instant::now() >= end);
        self.setup.failure().is_over() || (self.done.load(Ordering::Relaxed) > 0 && is_late())
    }

    fn may_cut_short(&self) -> bool {
        self.setup.calls_python()
    }

    fn has_cut_short(&self) -> bool {
        self.setup.failure().has_cut_short()
    }
}

/// Renders until it is finished, canceled, or out of time.
struct ToTheEnd<'a> {
    setup: &'a RenderSetup,
    watch: Watch<'a>,
    time: Option<Duration>,
}

impl Visitor for ToTheEnd<'_> {
    type Output = Film;

    fn visit<S: Strategy>(self, mut renderer: Renderer<S>) -> Film {
        let end = self.time.map(|time| Instant::now() + time);
        renderer.run(&Watch { end, ..self.watch });
        self.setup.film(&renderer)
    }
}

/// The samples so far as an exception: `RenderInterrupted` if a signal's handler raised `KeyboardInterrupt`.
pub(crate) fn interrupted(py: Python<'_>, error: PyErr, film: Film) -> PyResult<PyErr> {
    if !error.is_instance_of::<pyo3::exceptions::PyKeyboardInterrupt>(py) {
        return Ok(error);
    }
    let interrupted =
        RenderInterrupted::new_err("the render was interrupted; its film is in the attribute film");
    interrupted.value(py).setattr("film", film)?;
    interrupted.set_cause(py, Some(error));
    Ok(interrupted)
}

/// Warns of problems in a film.
pub(crate) fn warn_of(py: Python<'_>, film: &Film) -> PyResult<()> {
    match film.counts.non_finite {
        0 => Ok(()),
        n => warn(py, &[format!("{n} camera samples were NaN or infinite and count as black")]),
    }
}

/// The viewer in which a render is shown.
#[derive(FromPyObject)]
pub(crate) enum Viewer {
    /// Whether at the usual address.
    Usual(bool),
    At(String),
}

impl Viewer {
    fn address(&self) -> Option<&str> {
        match self {
            Self::Usual(true) => Some(display::ADDRESS),
            Self::Usual(false) => None,
            Self::At(address) => Some(address),
        }
    }
}

/// A film; `domelight.render` documents it.
#[pyfunction]
pub(crate) fn render<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    env: Option<&Bound<'py, Environment>>,
    strategy: Bound<'py, PyAny>,
    options: &Bound<'py, PyDict>,
    threads: Option<usize>,
    camera: Option<CameraLike>,
    tile_size: Option<usize>,
    time: Option<f64>,
    progress: Option<Py<PyAny>>,
    display: Viewer,
) -> PyResult<Film> {
    let time = time.map(duration).transpose()?;
    let arguments = Arguments { job: options::job(options)?, strategy, threads, camera, tile_size };
    let setup = &RenderSetup::new(py, scene.get(), env, arguments)?;
    let display = display.address().map(|address| setup.connect(py, address)).transpose()?;
    let display = display.as_ref();
    let done = &AtomicU64::new(0);
    let report = |py: Python<'_>| match &progress {
        Some(progress) => progress.bind(py).call1((setup.share(done),)).map(drop),
        None => Ok(()),
    };
    let (result, stopped) = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, results) = mpsc::channel();
            scope.spawn(move || {
                let rendered = setup.pool().and_then(|pool| {
                    let watch = Watch { setup, done, end: None, display };
                    let visitor = ToTheEnd { setup, watch, time };
                    caught(|| pool.install(|| setup.with_renderer(visitor)))?
                });
                // The receiver is still waiting.
                let _ = sender.send(rendered);
            });
            wait(&results, setup.failure().canceled(), &report)
        })
    })?;
    if let Some(error) = setup.failure().take() {
        return Err(error);
    }
    let film = result?;
    if let Some(display) = display
        && let Err(error) = py.detach(|| display.finish(film.layers()))
    {
        warn(py, &[format!("display: the viewer did not take the whole picture: {error}")])?;
    }
    if let Some(error) = stopped {
        return Err(interrupted(py, error, film)?);
    }
    if film.complete {
        done.store(setup.total_samples(), Ordering::Relaxed);
        report(py)?;
    }
    warn_of(py, &film)?;
    Ok(film)
}

/// Converts Python's seconds.
fn duration(seconds: f64) -> PyResult<Duration> {
    let time = Duration::try_from_secs_f64(seconds).ok();
    // The clock may not reach beyond a year.
    time.filter(|time| !time.is_zero() && *time <= Duration::from_secs(1 << 25)).ok_or_else(|| {
        bad_value(format!(
            "time is {seconds}; it must be a positive number of seconds, up to a year"
        ))
    })
}

/// List the built-in strategies with a one-line description of each.
#[pyfunction]
pub(crate) fn strategy_names() -> Vec<(&'static str, &'static str)> {
    StrategyKind::ALL.into_iter().map(|kind| (kind.name(), kind.summary())).collect()
}
