//! Keywords that are options of a job.

use domelight_lab::job::value::Count;
use domelight_lab::job::{self, Job};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use serde_json::Value;

use crate::error::{bad_value, from_source};

/// The options of jobs as JSON: the field, name, default and help of each.
#[pyfunction]
pub(crate) fn job_options() -> PyResult<String> {
    serde_json::to_string(&job::options()).map_err(|e| from_source(&e))
}

/// The job that keywords describe.
pub(crate) fn job(keywords: &Bound<'_, PyDict>) -> PyResult<Job> {
    let known = job::options();
    let mut job = Job::default();
    for (name, value) in keywords {
        let name: String = name.extract()?;
        let option = known.iter().find(|option| option.name == name);
        let option = option.ok_or_else(|| PyTypeError::new_err(format!("jobs have no {name}")))?;
        let set = job.set(&option.field, json(&value)?);
        set.map_err(|error| bad_value(format!("{name}: {error}")))?;
    }
    Ok(job)
}

/// The job that keywords describe, with one camera sample per pixel.
pub(crate) fn job_of_one_sample(keywords: &Bound<'_, PyDict>) -> PyResult<Job> {
    let mut job = job(keywords)?;
    job.sampling.spp = Count::new(1);
    Ok(job)
}

/// A value by its text. Several stand for their texts separated by commas.
fn json(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(flag) = value.extract() {
        return Ok(Value::Bool(flag));
    }
    if value.is_instance_of::<PyString>() || value.len().is_err() {
        return Ok(value.str()?.extract::<String>()?.into());
    }
    let texts: PyResult<Vec<String>> = value.try_iter()?.map(|one| one?.str()?.extract()).collect();
    Ok(texts?.join(",").into())
}
