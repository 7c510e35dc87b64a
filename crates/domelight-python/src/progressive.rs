//! Progressive renders: a film after each pass.

use std::sync::atomic::AtomicU64;
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use domelight::render::{Observer as _, Renderer};
use domelight::strategy::Strategy;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::camera::CameraLike;
use crate::engine::{caught, wait};
use crate::environment::Environment;
use crate::film::Film;
use crate::options;
use crate::render::{Arguments, RenderSetup, Visitor, Watch, interrupted, warn_of};
use crate::scene::Scene;

/// The film after a pass; `None` if nothing was left to render.
type Step = PyResult<Option<Film>>;

/// A progressive render: each `next` renders a pass and returns a film of all samples so far.
///
/// It runs on its own thread and is idle between calls. After an interruption, the next call continues; after an
/// exception of a strategy or BSDF, there are no more films.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Progressive {
    setup: Arc<RenderSetup>,
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
    setup: &'a RenderSetup,
    done: &'a AtomicU64,
    questions: Receiver<()>,
    answers: Sender<Step>,
}

impl Visitor for Steps<'_> {
    type Output = ();

    fn visit<S: Strategy>(self, mut renderer: Renderer<S>) {
        let Self { setup, done, questions, answers } = self;
        let watch = Watch { setup, done, end: None, display: None };
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
                while setup.joins_passes() && !is_due(&renderer) && !watch.canceled() {
                    renderer.step_with(&watch);
                }
                Some(setup.film(&renderer))
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
        if self.setup.failure().has_failed() {
            return Ok(None);
        }
        let (result, stopped) = py.detach(|| {
            let answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
            self.setup.failure().resume();
            // If the thread has ended, its answer will be missing.
            let _ = self.questions.send(());
            wait(&answers, self.setup.failure().canceled(), &|py| {
                self.report(py, self.setup.share(&self.done))
            })
        })?;
        // Any error ends the render.
        let failure = self.setup.failure();
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

/// A progressive render; `domelight.progressive` documents it.
#[pyfunction]
pub(crate) fn progressive<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    env: Option<&Bound<'py, Environment>>,
    strategy: Bound<'py, PyAny>,
    options: &Bound<'py, PyDict>,
    threads: Option<usize>,
    camera: Option<CameraLike>,
    tile_size: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Progressive> {
    let arguments = Arguments { job: options::job(options)?, strategy, threads, camera, tile_size };
    let setup = Arc::new(RenderSetup::new(py, scene.get(), env, arguments)?);
    let done = Arc::new(AtomicU64::new(0));
    let (ask, questions) = mpsc::channel();
    let (answers, answered) = mpsc::channel();
    let on_thread = (setup.clone(), done.clone());
    let body = move || {
        let (setup, done) = (&*on_thread.0, &*on_thread.1);
        let steps = Steps { setup, done, questions, answers: answers.clone() };
        let served =
            setup.pool().and_then(|pool| caught(|| pool.install(|| setup.with_renderer(steps)))?);
        if let Err(error) = served {
            let _ = answers.send(Err(error));
        }
    };
    let started = thread::Builder::new().name("domelight".into()).spawn(body);
    started.map_err(|e| PyRuntimeError::new_err(format!("cannot start a thread: {e}")))?;
    let (answers, last) = (Mutex::new(answered), Mutex::new(None));
    let process = std::process::id();
    Ok(Progressive { setup, done, progress, questions: ask, answers, last, process })
}
