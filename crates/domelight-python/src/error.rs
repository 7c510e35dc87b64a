//! The library's errors and warnings as Python's.

use std::error::Error as StdError;
use std::ffi::CString;
use std::io;

use domelight::picture::PictureErrorKind;
use pyo3::exceptions::{
    PyFileNotFoundError, PyKeyboardInterrupt, PyOSError, PyPermissionError, PyRuntimeError,
    PyUserWarning, PyValueError,
};
use pyo3::prelude::*;

pyo3::create_exception!(
    domelight,
    DomelightWarning,
    PyUserWarning,
    "A picture or map lacks something, or was repaired."
);
pyo3::create_exception!(
    domelight,
    RenderInterrupted,
    PyKeyboardInterrupt,
    "A render was interrupted; the attribute `film` holds the samples so far."
);

/// Converts an error of the library to `OSError` for system errors, otherwise to `ValueError`.
pub(crate) fn to_python(error: impl Into<domelight::Error>) -> PyErr {
    from_source(&error.into())
}

/// Like [`to_python`], for any error.
pub(crate) fn from_source(error: &(dyn StdError + 'static)) -> PyErr {
    let text = in_python(&error.to_string());
    let mut source = Some(error);
    while let Some(error) = source {
        let of_picture = match error.downcast_ref() {
            Some(PictureErrorKind::Io(error)) => Some(error),
            _ => None,
        };
        if let Some(error) = error.downcast_ref::<io::Error>().or(of_picture) {
            return match error.kind() {
                io::ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
                io::ErrorKind::PermissionDenied => PyPermissionError::new_err(text),
                _ => PyOSError::new_err(text),
            };
        }
        source = error.source();
    }
    PyValueError::new_err(text)
}

/// A message of the laboratory with options as keywords: `spp` for `--spp`, `scale` for `--env-scale`.
pub(crate) fn in_python(text: &str) -> String {
    let mut parts = text.split(" --");
    let mut spelled = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(part.len());
        let (option, rest) = part.split_at(end);
        // Another character belongs to the name of a file.
        if rest.is_empty() || rest.starts_with([' ', ',', ';', ':', ')']) {
            spelled.push(' ');
            spelled += &option.trim_start_matches("env-").replace('-', "_");
        } else {
            spelled += " --";
            spelled += option;
        }
        spelled += rest;
    }
    spelled
}

/// A `ValueError`.
pub(crate) fn bad_value(text: impl Into<String>) -> PyErr {
    PyValueError::new_err(text.into())
}

/// A panic of the engine, which is a bug, as a `RuntimeError`.
pub(crate) fn from_panic(panic: &(dyn std::any::Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    PyRuntimeError::new_err(format!("internal error of domelight, please report it: {text}"))
}

/// Issues warnings that point at the caller's line; they may raise exceptions.
pub(crate) fn warn(py: Python<'_>, warnings: &[String]) -> PyResult<()> {
    if warnings.is_empty() {
        return Ok(());
    }
    let level = frames_of_package(py)? + 1;
    for text in warnings {
        let text = CString::new(text.replace('\0', "\u{fffd}"))?;
        PyErr::warn(py, &py.get_type::<DomelightWarning>(), &text, level)?;
    }
    Ok(())
}

/// The number of innermost frames that belong to this package. Functions in Rust have none.
fn frames_of_package(py: Python<'_>) -> PyResult<i32> {
    let Ok(mut frame) = py.import("sys")?.call_method0("_getframe") else { return Ok(0) };
    let mut n = 0;
    while !frame.is_none() {
        let name = frame.getattr("f_globals")?.call_method1("get", ("__name__", ""))?;
        let name: String = name.extract().unwrap_or_default();
        if name != "domelight" && !name.starts_with("domelight.") {
            return Ok(n);
        }
        n += 1;
        frame = frame.getattr("f_back")?;
    }
    Ok(0)
}
