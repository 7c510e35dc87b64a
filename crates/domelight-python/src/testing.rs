//! The statistical tests of the engine, for users' samplers.

use std::cell::RefCell;

use numpy::PyArrayMethods as _;
use pyo3::exceptions::PyAssertionError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use testkit::{Chi2, Pcg, Suite, ZTest};

use crate::arrays::{Floats, rows, shape_text, vector};
use crate::engine::caught;
use crate::error::bad_value;

/// The significance and the number of tests that share it.
fn suite(tests: usize, significance: f64) -> PyResult<Suite> {
    if tests == 0 || !(significance > 0.0 && significance < 1.0) {
        return Err(bad_value(format!(
            "tests is {tests} and significance {significance}; they must be at least 1 and in (0, 1)"
        )));
    }
    Ok(Suite { tests, significance })
}

/// A chi-squared test of a sampler of directions against its density; `domelight.testing.chi2` documents it.
#[pyfunction]
pub(crate) fn chi2<'py>(
    py: Python<'py>,
    name: &str,
    sample: &Bound<'py, PyAny>,
    pdf: &Bound<'py, PyAny>,
    samples: usize,
    cells: [usize; 2],
    axis: &Bound<'py, PyAny>,
    seed: u64,
    tests: usize,
    significance: f64,
) -> PyResult<Bound<'py, PyDict>> {
    if !(1000..=1 << 26).contains(&samples) {
        return Err(bad_value(format!("samples is {samples}; it must be from 1000 to 67108864")));
    }
    if cells.iter().any(|n| !(2..=1024).contains(n)) {
        return Err(bad_value(format!("cells is {cells:?}; both must be from 2 to 1024")));
    }
    let axis = vector("axis", axis)?;
    if !(axis.is_finite() && axis.length() > 0.0) {
        return Err(bad_value(format!("axis is {axis}; it must be a direction")));
    }
    let test = Chi2 {
        samples,
        cells,
        axis: axis.normalize().to_array(),
        seed,
        suite: suite(tests, significance)?,
        save_tables: false,
        ..Chi2::default()
    };

    // Draw all samples at once, from the numbers that the test harness will draw.
    let mut rng = Pcg::new(seed);
    let numbers: Vec<[f32; 3]> = (0..samples)
        .map(|_| {
            let ([x, y], z) = (rng.next_2d(), rng.next_f32());
            [x, y, z]
        })
        .collect();
    let drawn = sample.call1((rows(py, numbers, &[samples])?,))?;
    let drawn = Floats::new("the result of sample", &drawn)?;
    let (directions, lead) = drawn.rows::<3>()?;
    if lead != [samples] {
        return Err(drawn.bad_shape(&shape_text(&[samples, 3])));
    }
    for (row, &[x, y, z]) in directions.iter().enumerate() {
        let squared = x * x + y * y + z * z;
        let is_unit = (squared - 1.0).abs() < 1e-3;
        if squared != 0.0 && !is_unit {
            return Err(bad_value(format!(
                "the result of sample has the row {row} ({x}, {y}, {z}); it must be a unit vector, or zeros for a \
                 rejected sample"
            )));
        }
    }
    let mut drawn = directions.iter().map(|&w| (w != [0.0; 3]).then_some(w));

    // Stop at the first exception.
    let failure = RefCell::new(None);
    let density = |w: &[[f32; 3]]| -> Vec<f64> {
        let ask = || {
            let result = pdf.call1((rows(py, w.to_vec(), &[w.len()])?,))?;
            let result = Floats::new("the result of pdf", &result)?;
            if result.shape() != [w.len()] {
                return Err(result.bad_shape(&shape_text(&[w.len()])));
            }
            Ok(result.values()?.iter().map(|&p| f64::from(p)).collect())
        };
        if failure.borrow().is_some() {
            return vec![0.0; w.len()];
        }
        ask().unwrap_or_else(|error: PyErr| {
            *failure.borrow_mut() = Some(error);
            vec![0.0; w.len()]
        })
    };
    let report = caught(|| test.sphere_batched(name, |_, _| drawn.next().flatten(), density))?;
    if let Some(error) = failure.into_inner() {
        return Err(error);
    }
    let report = report.map_err(|failed| PyAssertionError::new_err(failed.to_string()))?;
    let values = PyDict::new(py);
    values.set_item("statistic", report.statistic)?;
    values.set_item("degrees_of_freedom", report.degrees_of_freedom)?;
    values.set_item("p_value", report.p_value)?;
    values.set_item("mass", report.mass)?;
    values.set_item("lost", report.lost)?;
    Ok(values)
}

/// A t-test of batch means (batches, channels) against references; `domelight.testing.z_test` documents it.
#[pyfunction]
pub(crate) fn z_test(
    name: &str,
    batches: &Bound<'_, numpy::PyArray2<f64>>,
    reference: Vec<f64>,
    standard_error: Vec<f64>,
    tests: usize,
    significance: f64,
    rounding: f64,
) -> PyResult<f64> {
    let batches = batches.try_readonly()?;
    let batches = batches.as_array();
    let (n, channels) = batches.dim();
    if n < 30 {
        return Err(bad_value(format!("there are {n} batches; a test needs at least 30")));
    }
    if reference.len() != channels || standard_error.len() != channels {
        return Err(bad_value(format!(
            "there are {} references for {channels} channels",
            reference.len()
        )));
    }
    let errors = standard_error.iter().map(|&error| ("standard_error", error));
    for (name, value) in errors.chain([("rounding", rounding)]) {
        if !(value.is_finite() && value >= 0.0) {
            return Err(bad_value(format!(
                "{name} is {value}; it must be finite and not negative"
            )));
        }
    }
    let test = ZTest { suite: suite(tests, significance)?.times(channels), rounding };
    let mut least = 1.0f64;
    for (channel, column) in batches.columns().into_iter().enumerate() {
        let column: Vec<[f64; 1]> = column.iter().map(|&x| [x]).collect();
        let reference = testkit::z_test::Reference {
            value: [reference[channel]],
            standard_error: [standard_error[channel]],
        };
        let p = caught(|| test.against(&format!("{name}[{channel}]"), &column, reference))?;
        least = least.min(p.map_err(|failed| PyAssertionError::new_err(failed.to_string()))?);
    }
    Ok(least)
}
