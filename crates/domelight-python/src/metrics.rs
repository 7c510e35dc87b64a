//! Error metrics of pictures.

use domelight::RgbImage;
use domelight::picture::compare::{self, Comparison, SizeMismatch};
use domelight::picture::flip as flip_metric;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Floats, array, image};
use crate::engine::parallel;
use crate::error::{bad_value, from_source};

fn pair(test: &Bound<'_, PyAny>, reference: &Bound<'_, PyAny>) -> PyResult<(RgbImage, RgbImage)> {
    let test = image(&Floats::new("test", test)?)?;
    Ok((test, image(&Floats::new("reference", reference)?)?))
}

fn mismatch(error: SizeMismatch) -> PyErr {
    from_source(&error)
}

/// All errors of a picture against its reference, by name; `mask` selects the pixels.
#[pyfunction]
#[pyo3(signature = (test, reference, mask = None))]
pub(crate) fn compare_pictures<'py>(
    test: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    mask: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let py = test.py();
    let (test, reference) = pair(test, reference)?;
    let mask = match mask {
        None => None,
        Some(mask) => {
            let floats = Floats::new("mask", &mask)?;
            if floats.shape() != [test.height, test.width] {
                let expected = format!("({}, {})", test.height, test.width);
                return Err(floats.bad_shape(&expected));
            }
            Some(floats.values()?.iter().map(|&x| x != 0.0).collect::<Vec<_>>())
        }
    };
    let compared = parallel(py, || compare::compare(&test, &reference, mask.as_deref()))?;
    let c: Comparison = compared.map_err(mismatch)?;
    let values = PyDict::new(py);
    values.set_item("n_pixels", c.n_pixels)?;
    values.set_item("mse", c.mse)?;
    values.set_item("rel_mse", c.rel_mse)?;
    values.set_item("rel_mse_trimmed", c.rel_mse_trimmed)?;
    values.set_item("psnr", c.psnr)?;
    values.set_item("mean", c.mean)?;
    values.set_item("mean_reference", c.mean_reference)?;
    values.set_item("mean_ratio", c.mean_ratio)?;
    values.set_item("n_non_finite", c.n_non_finite)?;
    Ok(values)
}

/// The error of each pixel, relative or absolute.
#[pyfunction]
pub(crate) fn error_map<'py>(
    test: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    relative: bool,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = test.py();
    let (test, reference) = pair(test, reference)?;
    let map = parallel(py, || {
        let map = if relative { compare::relative_error_map } else { compare::absolute_error_map };
        map(&test, &reference)
    })?;
    array(py, map.map_err(mismatch)?, &[reference.height, reference.width])
}

fn resolution(pixels_per_degree: Option<f32>) -> PyResult<f32> {
    match pixels_per_degree.unwrap_or(flip_metric::PIXELS_PER_DEGREE) {
        p if flip_metric::RESOLUTIONS.contains(&p) => Ok(p),
        p => {
            let [least, most] = [flip_metric::RESOLUTIONS.start(), flip_metric::RESOLUTIONS.end()];
            Err(bad_value(format!("pixels_per_degree is {p}; it must be from {least} to {most}")))
        }
    }
}

/// LDR-FLIP of each pixel, for linear display light in [0, 1].
#[pyfunction]
#[pyo3(signature = (test, reference, pixels_per_degree = None))]
pub(crate) fn flip<'py>(
    test: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    pixels_per_degree: Option<f32>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = test.py();
    let (test, reference) = pair(test, reference)?;
    let resolution = resolution(pixels_per_degree)?;
    let map = parallel(py, || flip_metric::ldr_flip(&reference, &test, resolution))?;
    array(py, map.map_err(|e| from_source(&e))?, &[reference.height, reference.width])
}

/// HDR-FLIP of each pixel, for linear radiance.
#[pyfunction]
#[pyo3(signature = (test, reference, pixels_per_degree = None))]
pub(crate) fn hdr_flip<'py>(
    test: &Bound<'py, PyAny>,
    reference: &Bound<'py, PyAny>,
    pixels_per_degree: Option<f32>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = test.py();
    let (test, reference) = pair(test, reference)?;
    let resolution = resolution(pixels_per_degree)?;
    let found = parallel(py, || flip_metric::hdr_flip(&reference, &test, resolution))?;
    array(py, found.map_err(|e| from_source(&e))?.map, &[reference.height, reference.width])
}
