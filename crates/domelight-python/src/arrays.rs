//! NumPy arrays in and out: anything array-like becomes C-contiguous `float32`, without a copy if it already is.

use domelight::math::{Vec3, vec3};
use numpy::{
    Element, IntoPyArray as _, PyArrayDyn, PyArrayMethods as _, PyReadonlyArrayDyn,
    PyUntypedArrayMethods as _,
};
use pyo3::basic::CompareOp;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::bad_value;

/// A borrowed array of `float32`.
pub(crate) struct Floats<'py> {
    name: &'static str,
    array: PyReadonlyArrayDyn<'py, f32>,
}

impl<'py> Floats<'py> {
    /// Converts anything that `numpy.asarray` turns into real numbers.
    pub(crate) fn new(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = as_array(name, value, "float32", "fiub", "real numbers")?;
        Ok(Self { name, array: array.cast_into::<PyArrayDyn<f32>>()?.try_readonly()? })
    }

    /// Like [`Self::new`], for uniform numbers: those below 1 that single precision would round to 1 become the largest
    /// number below 1.
    pub(crate) fn uniform_numbers(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let floats = Self::new(name, value)?;
        if !floats.values()?.contains(&1.0) {
            return Ok(floats);
        }
        let is_below = given_array(name, value, "real numbers")?.rich_compare(1, CompareOp::Lt)?;
        let is_below = Self::new(name, &is_below)?;
        let below = |(&x, &is_below): (&f32, &f32)| {
            if is_below == 1.0 { x.min(1f32.next_down()) } else { x }
        };
        let values = floats.values()?.iter().zip(is_below.values()?).map(below).collect();
        let array = array(value.py(), values, floats.shape())?.try_readonly()?;
        Ok(Self { name, array })
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    pub(crate) fn values(&self) -> PyResult<&[f32]> {
        Ok(self.array.as_slice()?)
    }

    /// The shape in Python notation.
    pub(crate) fn shape_text(&self) -> String {
        shape_text(self.shape())
    }

    /// An error that names the array, its shape and the expected shape.
    pub(crate) fn bad_shape(&self, expected: &str) -> PyErr {
        bad_value(format!("{} has shape {}; it must be {expected}", self.name, self.shape_text()))
    }

    /// The rows of an array (…, K), and the shape without K. An empty list has no rows.
    pub(crate) fn rows<const K: usize>(&self) -> PyResult<(&[[f32; K]], &[usize])> {
        match self.shape().split_last() {
            Some((0, [])) => Ok((&[], self.shape())),
            Some((&k, lead)) if k == K => Ok((self.values()?.as_chunks().0, lead)),
            _ => Err(self.bad_shape(&format!("(…, {K})"))),
        }
    }

    /// The rows of finite numbers.
    pub(crate) fn finite<const K: usize>(&self) -> PyResult<(&[[f32; K]], &[usize])> {
        let rows = self.rows::<K>()?;
        self.require_finite()?;
        Ok(rows)
    }

    /// The rows of uniform numbers, each in [0, 1).
    pub(crate) fn uniform<const K: usize>(&self) -> PyResult<(&[[f32; K]], &[usize])> {
        let rows = self.rows::<K>()?;
        self.require(|x| (0.0..1.0).contains(&x), "uniform numbers lie in [0, 1)")?;
        Ok(rows)
    }

    /// Refuses NaN and infinities.
    pub(crate) fn require_finite(&self) -> PyResult<()> {
        self.require(f32::is_finite, "it must be finite")
    }

    fn require(&self, is_good: impl Fn(f32) -> bool, rule: &str) -> PyResult<()> {
        let Some(i) = self.values()?.iter().position(|&x| !is_good(x)) else { return Ok(()) };
        let mut index = Vec::new();
        let mut rest = i;
        for &n in self.shape().iter().rev() {
            index.push((rest % n).to_string());
            rest /= n;
        }
        index.reverse();
        let value = self.values()?[i];
        Err(bad_value(format!("{}[{}] is {value}; {rule}", self.name, index.join(", "))))
    }

    /// A color: one number or three.
    pub(crate) fn color(&self) -> PyResult<domelight::Rgb> {
        match *self.values()? {
            [gray] => Ok(domelight::Rgb::splat(gray)),
            [r, g, b] => Ok(domelight::Rgb::new(r, g, b)),
            _ => Err(self.bad_shape("a number or three")),
        }
    }
}

/// `numpy.asarray`, also for objects that only export DLPack.
fn given_array<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    let only_dlpack = value.hasattr("__dlpack__")?
        && !value.hasattr("__array__")?
        && !value.hasattr("__array_interface__")?;
    let array = if only_dlpack {
        numpy.call_method1("from_dlpack", (value,))
    } else {
        numpy.call_method1("asarray", (value,))
    };
    array.map_err(|error| {
        let wrong = bad_value(format!("{name} is no array of {what}: {error}"));
        wrong.set_cause(py, Some(error));
        wrong
    })
}

/// `numpy.asarray` in C order, for numbers of the given kinds.
fn as_array<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    dtype: &str,
    kinds: &str,
    what: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let array = given_array(name, value, what)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    // NumPy converts an empty list to an array of doubles.
    let is_empty = array.getattr("size")?.extract::<usize>()? == 0;
    let is_known = kinds.contains(&kind) || (is_empty && kind == "f");
    if !is_known {
        let found = array.getattr("dtype")?.str()?;
        return Err(bad_value(format!("{name} has dtype {found}; it must be {what}")));
    }
    let arguments = PyDict::new(py);
    arguments.set_item("dtype", dtype)?;
    arguments.set_item("order", "C")?;
    py.import("numpy")?.call_method("asarray", (array,), Some(&arguments))
}

/// Indices, each below `end`, and their shape.
pub(crate) fn indices(
    name: &'static str,
    value: &Bound<'_, PyAny>,
    end: usize,
) -> PyResult<(Vec<u32>, Vec<usize>)> {
    let array = as_array(name, value, "int64", "iu", "whole numbers")?;
    let array = array.cast_into::<PyArrayDyn<i64>>()?.try_readonly()?;
    let is_bad = |&&i: &&i64| !usize::try_from(i).is_ok_and(|i| i < end);
    if let Some(bad) = array.as_slice()?.iter().find(is_bad) {
        return Err(bad_value(format!(
            "{name} holds {bad}; it must be from 0 to {} (there are {end})",
            end as i64 - 1
        )));
    }
    Ok((array.as_slice()?.iter().map(|&i| i as u32).collect(), array.shape().to_vec()))
}

/// A shape in Python notation.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [one] => format!("({one},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Pairs of finite rows from two arrays; one of them may be a single row for all.
pub(crate) struct Pairs<'a, const A: usize, const B: usize> {
    a: &'a [[f32; A]],
    b: &'a [[f32; B]],
    /// The shape of the result, except for its last axis.
    pub(crate) lead: Vec<usize>,
}

impl<'a, const A: usize, const B: usize> Pairs<'a, A, B> {
    pub(crate) fn new(a: &'a Floats<'_>, b: &'a Floats<'_>) -> PyResult<Self> {
        let ((a_rows, a_lead), (b_rows, b_lead)) = (a.finite::<A>()?, b.finite::<B>()?);
        let lead = match () {
            () if a_lead == b_lead || b_lead.is_empty() => a_lead,
            () if a_lead.is_empty() => b_lead,
            () => {
                return Err(bad_value(format!(
                    "{} has shape {} and {} has shape {}; they must be alike but for the last axis, or one of them a \
                     single row",
                    a.name,
                    a.shape_text(),
                    b.name,
                    b.shape_text()
                )));
            }
        };
        Ok(Self { a: a_rows, b: b_rows, lead: lead.to_vec() })
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = ([f32; A], [f32; B])> {
        let n: usize = self.lead.iter().product();
        let at = |len: usize, i: usize| if len == 1 { 0 } else { i };
        (0..n).map(move |i| (self.a[at(self.a.len(), i)], self.b[at(self.b.len(), i)]))
    }
}

/// The bits of a number, the same for both zeros, which are equal.
pub(crate) fn hashable(x: f32) -> u32 {
    (x + 0.0).to_bits()
}

/// An array of any shape.
pub(crate) fn array<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    values.into_pyarray(py).reshape(shape)
}

/// An array of rows.
pub(crate) fn rows<'py, const K: usize>(
    py: Python<'py>,
    rows: Vec<[f32; K]>,
    lead: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let shape: Vec<usize> = lead.iter().copied().chain([K]).collect();
    array(py, rows.into_flattened(), &shape)
}

/// Converts an array (height, width, 3) to the library's picture.
pub(crate) fn image(floats: &Floats<'_>) -> PyResult<domelight::RgbImage> {
    let (rows, lead) = floats.rows::<3>().map_err(|_| floats.bad_shape("(height, width, 3)"))?;
    let &[height, width] = lead else { return Err(floats.bad_shape("(height, width, 3)")) };
    let pixels = rows.iter().map(|&c| domelight::Rgb::from(c)).collect();
    Ok(domelight::RgbImage::new(width, height, pixels))
}

/// Converts the library's picture to an array (height, width, 3).
pub(crate) fn from_image<'py>(
    py: Python<'py>,
    image: &domelight::RgbImage,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let pixels = image.pixels.iter().map(|p| p.to_array()).collect();
    rows(py, pixels, &[image.height, image.width])
}

/// A vector of three finite numbers.
pub(crate) fn vector(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Vec3> {
    let floats = Floats::new(name, value)?;
    match *floats.values()? {
        [x, y, z] => Ok(vec3(x, y, z)),
        _ => Err(floats.bad_shape("(3,)")),
    }
}
