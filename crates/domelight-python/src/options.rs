//! Keywords that are options of a job.

use domelight_lab::job::value::{Count, Rotation, Text};
use domelight_lab::job::{self, Job, JobOption, Light};
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
    described("jobs", keywords, |option, name| option.name == name)
}

/// The job that keywords describe, with one camera sample per pixel.
pub(crate) fn job_of_one_sample(keywords: &Bound<'_, PyDict>) -> PyResult<Job> {
    let mut job = job(keywords)?;
    job.sampling.spp = Count::new(1);
    Ok(job)
}

/// The job that a scene's keywords describe, which takes the options of these fields.
pub(crate) fn scene_job(keywords: Option<&Bound<'_, PyDict>>, fields: &[&str]) -> PyResult<Job> {
    let Some(keywords) = keywords else { return Ok(Job::default()) };
    let takes = |option: &JobOption, name: &str| {
        option.name == name && fields.contains(&option.field.as_str())
    };
    described("scenes", keywords, takes)
}

/// The light that an environment's keywords describe: those of the program without `env`, and `rotation` as the attribute.
pub(crate) fn light(keywords: Option<&Bound<'_, PyDict>>, fields: &[&str]) -> PyResult<Light> {
    let Some(keywords) = keywords else { return Ok(Light::default()) };
    let takes = |option: &JobOption, name: &str| {
        let field = if name == "rotation" { "rotate" } else { name };
        let is_it = option.field.strip_prefix("light.") == Some(field);
        is_it && fields.contains(&field) && name != "rotate"
    };
    let Job { light, .. } = described("environments", keywords, takes)?;
    match light.rotate {
        Some(Text(Rotation::Auto)) => Err(bad_value("rotation is auto; it must be degrees")),
        Some(Text(Rotation::Degrees(_))) | None => Ok(light),
    }
}

/// A job with the options that keywords set; `is_named` finds an option by its keyword.
fn described(
    whose: &str,
    keywords: &Bound<'_, PyDict>,
    is_named: impl Fn(&JobOption, &str) -> bool,
) -> PyResult<Job> {
    let known = job::options();
    let mut job = Job::default();
    for (name, value) in keywords {
        let name: String = name.extract()?;
        let option = known.iter().find(|option| is_named(option, &name));
        let option = option
            .ok_or_else(|| PyTypeError::new_err(format!("{whose} have no argument '{name}'")))?;
        let value = match (&option.field[..], json(&value)?) {
            // As the flag alone.
            ("subject.ground", Value::Bool(ground)) => ground.then_some("plate").into(),
            (_, value) => value,
        };
        let set = job.set(&option.field, value);
        set.map_err(|error| bad_value(format!("{name}: {error}")))?;
    }
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
