//! What made an object, so that another process can make it again.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

/// A constructor and its arguments.
pub(crate) struct Recipe {
    /// The name of a class method; the class itself if there is none.
    method: Option<&'static str>,
    arguments: Py<PyTuple>,
    keywords: Py<PyDict>,
}

impl Recipe {
    pub(crate) fn new(
        method: Option<&'static str>,
        arguments: &Bound<'_, PyTuple>,
        keywords: &Bound<'_, PyDict>,
    ) -> Self {
        let (arguments, keywords) = (arguments.clone().unbind(), keywords.clone().unbind());
        Self { method, arguments, keywords }
    }

    /// What `__reduce__` returns: a call without arguments.
    pub(crate) fn reduce<'py>(
        &self,
        class: &Bound<'py, PyType>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let py = class.py();
        let constructor = match self.method {
            Some(method) => class.getattr(method)?,
            None => class.clone().into_any(),
        };
        let partial = py.import("functools")?.getattr("partial")?;
        let mut arguments = vec![constructor];
        arguments.extend(self.arguments.bind(py).iter());
        let arguments = PyTuple::new(py, arguments)?;
        Ok((partial.call(arguments, Some(self.keywords.bind(py)))?, PyTuple::empty(py)))
    }
}

/// The keywords that were given: options, and others.
pub(crate) fn keywords<'py>(
    py: Python<'py>,
    options: Option<&Bound<'py, PyDict>>,
    given: impl IntoIterator<Item = (&'static str, Option<Bound<'py, PyAny>>)>,
) -> PyResult<Bound<'py, PyDict>> {
    let keywords = match options {
        Some(options) => options.copy()?,
        None => PyDict::new(py),
    };
    for (name, value) in given {
        if let Some(value) = value {
            keywords.set_item(name, value)?;
        }
    }
    Ok(keywords)
}
