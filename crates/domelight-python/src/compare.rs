//! Comparisons of strategies at equal samples, rays or time.

use std::sync::mpsc;
use std::sync::{Mutex, PoisonError};

use domelight::RgbImage;
use domelight::render::RenderSettings;
use domelight_lab::compare::{Budget, Comparison, ComparisonResult, ComparisonSettings};
use domelight_lab::{Error, Host, NamedStrategy, WorkProgress};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{array, from_image};
use crate::camera::CameraLike;
use crate::engine::{caught, wait};
use crate::environment::Environment;
use crate::error::{bad_value, from_source, in_python, warn};
use crate::options;
use crate::render::{Arguments, Choice, RenderSetup, choose};
use crate::scene::Scene;

/// Ends the work on a signal or after a Python function has raised, and keeps the warnings.
struct PythonHost<'a> {
    setup: &'a RenderSetup,
    warnings: Mutex<Vec<String>>,
    /// The finished fraction, in [0, 1], and the current step.
    state: Mutex<(f64, String)>,
}

impl PythonHost<'_> {
    fn state(&self) -> (f64, String) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Records the progress.
struct Progress<'a>(&'a PythonHost<'a>);

impl WorkProgress for Progress<'_> {
    fn advance(&self, share: f64, _seconds_left: f64, label: &str) {
        *self.0.state.lock().unwrap_or_else(PoisonError::into_inner) = (share, label.to_owned());
    }
}

impl Host for PythonHost<'_> {
    fn warn(&self, text: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(in_python(text));
    }

    fn work_progress<'a>(&'a self) -> Option<Box<dyn WorkProgress + 'a>> {
        Some(Box::new(Progress(self)))
    }

    fn canceled(&self) -> bool {
        self.setup.failure().is_over()
    }
}

/// A comparison as a dictionary; `domelight.compare` documents it and converts it to a `Comparison`.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    scene: &Bound<'py, Scene>,
    env: Option<&Bound<'py, Environment>>,
    strategies: Vec<(String, Bound<'py, PyAny>)>,
    budget: &str,
    seeds: u32,
    reference_spp: u32,
    options: &Bound<'py, PyDict>,
    threads: Option<usize>,
    camera: Option<CameraLike>,
    tile_size: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let Some((_, first)) = strategies.first() else {
        return Err(bad_value("there is no strategy to compare"));
    };
    let budget: Budget = budget.parse().map_err(|e| from_source(&e))?;
    let arguments = Arguments {
        job: options::job_of_one_sample(options)?,
        strategy: first.clone(),
        threads,
        camera,
        tile_size: Some(tile_size.unwrap_or(RenderSettings::default().tile_size)),
    };
    let setup = &RenderSetup::new(py, scene.get(), env, arguments)?;
    let lobes = &scene.get().inner.lobes;
    let choices = &strategies
        .into_iter()
        .map(|(name, strategy)| Ok((name, choose(&strategy, 1, lobes)?)))
        .collect::<PyResult<Vec<_>>>()?;
    let report = &setup.scene_report();
    let host = &PythonHost {
        setup,
        warnings: Mutex::new(Vec::new()),
        state: Mutex::new((0.0, String::new())),
    };
    let report_progress = |py: Python<'_>| match &progress {
        Some(progress) => progress.bind(py).call1(host.state()).map(drop),
        None => Ok(()),
    };
    let run = || -> Result<ComparisonResult, Error> {
        let view = setup.view(report);
        let render = *setup.settings();
        let settings = ComparisonSettings {
            render,
            budget,
            n_seeds: seeds,
            reference_spp,
            most_reference_spp: reference_spp,
            ..Default::default()
        };
        let mut comparison = Comparison::new(view, settings);
        for (name, choice) in choices {
            match choice {
                Choice::Builtin(spec) => {
                    comparison.add_named(NamedStrategy { text: name.clone(), spec: *spec })?;
                }
                Choice::Python(strategy) => comparison.add(name, strategy)?,
            }
        }
        let calibrated = comparison.calibrate(host)?;
        let reference = calibrated.reference(None)?;
        calibrated.run(&reference)
    };
    let (result, stopped) = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, results) = mpsc::channel();
            scope.spawn(move || {
                let compared = setup.pool().and_then(|pool| caught(|| pool.install(run)));
                // The receiver is still waiting.
                let _ = sender.send(compared);
            });
            wait(&results, setup.failure().canceled(), &report_progress)
        })
    })?;
    if let Some(error) = setup.failure().take().or(stopped) {
        return Err(error);
    }
    let result = result?.map_err(|e| from_source(&e))?;
    warn(py, &host.warnings.lock().unwrap_or_else(PoisonError::into_inner))?;
    into_dict(py, &result, choices)
}

fn into_dict<'py>(
    py: Python<'py>,
    result: &ComparisonResult,
    choices: &[(String, Choice)],
) -> PyResult<Bound<'py, PyDict>> {
    let page = result.page().map_err(|e| from_source(&e))?;
    let report = serde_json::to_string(&result.report).map_err(|e| from_source(&e))?;
    let found = PyDict::new(py);
    found.set_item("report", py.import("json")?.call_method1("loads", (report,))?)?;
    found.set_item("page", page.as_str())?;
    found.set_item("reference", from_image(py, &result.reference)?)?;
    let RgbImage { width, height, .. } = result.reference;
    let [pictures, errors, flips] = [(); 3].map(|()| PyDict::new(py));
    for ((name, _), picture) in choices.iter().zip(&result.pictures) {
        if let Some(picture) = picture {
            pictures.set_item(name, from_image(py, &picture.image)?)?;
            errors.set_item(name, array(py, picture.relative_error.clone(), &[height, width])?)?;
            flips.set_item(name, array(py, picture.flip.clone(), &[height, width])?)?;
        }
    }
    found.set_item("pictures", pictures)?;
    found.set_item("errors", errors)?;
    found.set_item("flip", flips)?;
    Ok(found)
}
