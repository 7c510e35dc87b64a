//! Progressive renders: a film after each pass.

use std::sync::atomic::AtomicU64;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use domelight::render::{Observer as _, Renderer};
use domelight::strategy::Strategy;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::engine::{caught, wait};
use crate::environment::Environment;
use crate::film::Film;
use crate::render::{Job, Keywords, Visitor, Watch, interrupted, warn_of};
use crate::scene::{CameraLike, Scene};

/// The film after a pass; `None` if nothing was left to render.
type Step = PyResult<Option<Film>>;

/// A progressive render: each `next` renders a pass and returns a film of all samples so far.
///
/// It runs on its own thread and is idle between calls. After an interruption, the next call continues; after an
/// exception of a strategy or BSDF, there are no more films.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Progressive {
    job: Arc<Job>,
    /// Camera samples so far.
    done: Arc<AtomicU64>,
    progress: Option<Py<PyAny>>,
    /// Requests a step from the render's thread.
    questions: Sender<()>,
    /// The answers of the render's thread.
    answers: Mutex<Receiver<Step>>,
    last: Mutex<Option<Py<Film>>>,
    /// The process that the thread belongs to.
    process: u32,
}

/// Answers each request with the next pass.
struct Steps<'a> {
    job: &'a Job,
    done: &'a AtomicU64,
    questions: Receiver<()>,
    answers: Sender<Step>,
}

impl Visitor for Steps<'_> {
    type Output = ();

    fn visit<S: Strategy>(self, mut renderer: Renderer<S>) {
        let Self { job, done, questions, answers } = self;
        let watch = Watch { job, done, end: None };
        while questions.recv().is_ok() {
            if renderer.is_complete() {
                let _ = answers.send(Ok(None));
                continue;
            }
            let step = caught(|| {
                renderer.step_with(&watch);
                let is_due = |renderer: &Renderer<S>| {
                    renderer.least_samples().is_power_of_two() || renderer.is_complete()
                };
                while job.joins_passes() && !is_due(&renderer) && !watch.canceled() {
                    renderer.step_with(&watch);
                }
                Some(job.film(&renderer))
            });
            let _ = answers.send(step);
        }
    }
}

impl Progressive {
    fn report(&self, py: Python<'_>, share: f64) -> PyResult<()> {
        self.progress.as_ref().map_or(Ok(()), |f| f.bind(py).call1((share,)).map(drop))
    }
}

#[pymethods]
impl Progressive {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Py<Film>>> {
        if std::process::id() != self.process {
            return Err(PyRuntimeError::new_err(
                "this render was begun before the process was forked",
            ));
        }
        if self.job.failure().has_failed() {
            return Ok(None);
        }
        let (result, stopped) = py.detach(|| {
            let answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
            self.job.failure().resume();
            // If the thread has ended, its answer will be missing.
            let _ = self.questions.send(());
            wait(&answers, self.job.failure().canceled(), &|py| {
                self.report(py, self.job.share(&self.done))
            })
        })?;
        // Any error ends the render.
        let failure = self.job.failure();
        let film = result.map_err(|error| failure.report(error)).ok().flatten();
        if let Some(error) = failure.take() {
            return Err(error);
        }
        let Some(film) = film.filter(|_| !failure.has_failed()) else { return Ok(None) };
        if let Some(error) = stopped {
            return Err(interrupted(py, error, film)?);
        }
        if film.complete {
            self.report(py, 1.0)?;
            warn_of(py, &film)?;
        }
        let film = Py::new(py, film)?;
        *self.last.lock().unwrap_or_else(PoisonError::into_inner) = Some(film.clone_ref(py));
        Ok(Some(film))
    }

    /// Film or None: the last film.
    #[getter]
    fn film(&self, py: Python<'_>) -> Option<Py<Film>> {
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.as_ref().map(|film| film.clone_ref(py))
    }
}

/// Render pass by pass: an iterator over films with more and more samples.
///
/// Parameters
/// ----------
/// scene, env, strategy, spp, size, seed, threads, camera, filter, sampler, hide_env, adaptive, target_error, tile_size
///     As in `render`.
/// passes : {'doubling', 'efficient'}, default 'doubling'
///     As in `render`: films after 1, 2, 4, 8, … samples, with 'product' at least every 64 samples; or after the passes
///     that suit the strategy best, as always with `target_error`.
/// progress : bool or callable, default False
///     As in `render`; the fraction refers to all samples.
///
/// Yields
/// ------
/// Film
///     All samples so far; the last film is complete and bit-identical to that of `render` with the same `passes`.
///
/// Raises
/// ------
/// RenderInterrupted
///     A `KeyboardInterrupt` whose attribute `film` holds the samples so far; a later `next` continues from there.
#[pyfunction(name = "_progressive")]
#[pyo3(signature = (scene, env = None, strategy = None, *, spp = 32, size = [640, 640], seed = 0, threads = None,
    camera = None, filter = "gaussian", sampler = "sobol", hide_env = false, adaptive = true, target_error = None,
    tile_size = None, passes = "doubling", progress = None),
    text_signature = "(scene, env=None, strategy=None, *, spp=32, size=(640, 640), seed=0, threads=None, camera=None, filter='gaussian', sampler='sobol', hide_env=False, adaptive=True, target_error=None, tile_size=None, passes='doubling', progress=None)")]
pub(crate) fn progressive<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    env: Option<&Bound<'py, Environment>>,
    strategy: Option<Bound<'py, PyAny>>,
    spp: u32,
    size: [i64; 2],
    seed: u64,
    threads: Option<usize>,
    camera: Option<CameraLike>,
    filter: &str,
    sampler: &str,
    hide_env: bool,
    adaptive: bool,
    target_error: Option<f32>,
    tile_size: Option<usize>,
    passes: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Progressive> {
    let strategy = strategy.unwrap_or_else(|| pyo3::types::PyString::new(py, "product").into_any());
    let keywords = Keywords {
        strategy,
        spp,
        size,
        seed,
        threads,
        camera,
        filter,
        sampler,
        hide_env,
        adaptive,
        target_error,
        tile_size,
        passes,
    };
    let job = Arc::new(Job::new(py, scene.get(), env, keywords)?);
    let done = Arc::new(AtomicU64::new(0));
    let (ask, questions) = mpsc::channel();
    let (answers, answered) = mpsc::channel();
    let on_thread = (job.clone(), done.clone());
    let body = move || {
        let (job, done) = (&*on_thread.0, &*on_thread.1);
        let steps = Steps { job, done, questions, answers: answers.clone() };
        let served =
            job.pool().and_then(|pool| caught(|| pool.install(|| job.with_renderer(steps)))?);
        if let Err(error) = served {
            let _ = answers.send(Err(error));
        }
    };
    let started = thread::Builder::new().name("domelight".into()).spawn(body);
    started.map_err(|e| PyRuntimeError::new_err(format!("cannot start a thread: {e}")))?;
    let (answers, last) = (Mutex::new(answered), Mutex::new(None));
    let process = std::process::id();
    Ok(Progressive { job, done, progress, questions: ask, answers, last, process })
}
