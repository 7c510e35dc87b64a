//! Strategies written in Python.

use domelight::Rgb;
use domelight::bsdf::Lobe;
use domelight::math::{Vec2, Vec3};
use domelight::sampling::{Dimension, Sampler};
use domelight::strategy::{Contributions, SampleIndex, ShadingPoint, Strategy, TileShading};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{Floats, array, indices, rows, shape_text};
use crate::engine::alone;
use crate::error::bad_value;
use crate::failure::or_report;
use crate::lobe::{PythonLobe, colors};

/// The shading points of a tile, passed to strategies written in Python.
///
/// Directions are unit vectors in world space; `wo` points toward the viewer, `wi` toward the light.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct ShadingPoints {
    points: Vec<ShadingPoint>,
    numbers: Vec<SampleIndex>,
    lobes: Vec<&'static PythonLobe>,
}

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

/// Directions, values and densities.
type Drawn = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<f32>);

/// Values and densities of directions at points.
type Evaluated = (Vec<[f32; 3]>, Vec<f32>);

impl ShadingPoints {
    fn column<'py>(
        &self,
        py: Python<'py>,
        get: impl Fn(&ShadingPoint) -> Vec3,
    ) -> PyResult<FloatArray<'py>> {
        rows(py, self.points.iter().map(|p| get(p).to_array()).collect(), &[self.points.len()])
    }

    /// The point of each row: from `index`, otherwise with equally many consecutive rows per point.
    fn points_of(&self, index: Option<&Bound<'_, PyAny>>, lead: &[usize]) -> PyResult<Vec<u32>> {
        let n: usize = lead.iter().product();
        let Some(index) = index else {
            let each = match lead {
                [points, rest @ ..] if *points == self.points.len() => {
                    rest.iter().product::<usize>()
                }
                _ => {
                    let (found, points) = (shape_text(lead), self.points.len());
                    return Err(bad_value(format!(
                        "there are rows {found} for {points} points; give them for each point ({points}, …), or the \
                         points' indices as index"
                    )));
                }
            };
            return Ok((0..n).map(|i| (i / each.max(1)) as u32).collect());
        };
        let (index, shape) = indices("index", index, self.points.len())?;
        if shape != lead {
            return Err(bad_value(format!(
                "index has shape {}; it must be {}, an index for each row",
                shape_text(&shape),
                shape_text(lead)
            )));
        }
        Ok(index)
    }

    /// The Python lobe of a point, if any.
    fn python_lobe(&self, point: &ShadingPoint) -> Option<&'static PythonLobe> {
        if self.lobes.is_empty() {
            return None;
        }
        let (_, lobe) = point.bsdf.lobes().next()?;
        let Lobe::Custom(custom) = lobe else { return None };
        self.lobes.iter().copied().find(|known| known.is(custom))
    }

    /// Values and densities; points with Python BSDFs are evaluated all at once.
    fn evaluate(&self, py: Python<'_>, index: &[u32], wi: &[[f32; 3]]) -> PyResult<Evaluated> {
        let (mut values, mut densities): (Vec<[f32; 3]>, Vec<f32>) = alone(py, || {
            let one = |(&i, &wi): (&u32, &[f32; 3])| {
                let point = &self.points[i as usize];
                if self.python_lobe(point).is_some() {
                    return ([0.0; 3], 0.0);
                }
                let (value, pdf) = point.eval_pdf(wi.into());
                (value.to_array(), pdf)
            };
            index.iter().zip(wi).map(one).unzip()
        })?;
        for &lobe in &self.lobes {
            let is_of_lobe = |&row: &usize| {
                let point = &self.points[index[row] as usize];
                point.ng.dot(wi[row].into()) > 0.0
                    && self.python_lobe(point).is_some_and(|found| std::ptr::eq(found, lobe))
            };
            let of_lobe: Vec<usize> = (0..index.len()).filter(is_of_lobe).collect();
            let point = |row: usize| &self.points[index[row] as usize];
            let local_wo: Vec<_> = of_lobe.iter().map(|&row| point(row).wo.to_array()).collect();
            let to_local = |&row: &usize| point(row).frame.to_local(wi[row].into()).to_array();
            let local_wi: Vec<_> = of_lobe.iter().map(to_local).collect();
            let (found, pdf) = lobe.eval_pdf_rows(py, &local_wo, &local_wi)?;
            for ((&row, value), pdf) in of_lobe.iter().zip(found).zip(pdf) {
                (values[row], densities[row]) = (value.to_array(), pdf);
            }
        }
        Ok((values, densities))
    }
}

#[pymethods]
impl ShadingPoints {
    fn __len__(&self) -> usize {
        self.points.len()
    }

    /// ndarray, shape (N, 3): world-space positions.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.column(py, |p| p.position)
    }

    /// ndarray, shape (N, 3): shading normals, toward the viewer's side.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.column(py, |p| p.frame.z)
    }

    /// ndarray, shape (N, 3): geometric normals, toward the viewer's side.
    #[getter]
    fn geometric_normal<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.column(py, |p| p.ng)
    }

    /// ndarray, shape (N, 3): directions toward the viewer.
    #[getter]
    fn wo<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.column(py, |p| p.frame.to_world(p.wo))
    }

    /// ndarray, shape (N, 3): approximate reflected fraction of uniform light.
    #[getter]
    fn albedo<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        rows(
            py,
            self.points.iter().map(|p| p.bsdf.albedo().to_array()).collect(),
            &[self.points.len()],
        )
    }

    /// Draw uniform numbers for each point; those of a pixel form one well-distributed sequence.
    ///
    /// Parameters
    /// ----------
    /// n : int, default 1
    ///     The number of samples per point.
    /// purpose : {'environment', 'brdf', 'resampling'}, default 'environment'
    ///     Sequences of different purposes are independent.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (N, n, 4)
    ///     In [0, 1): two for a direction, one to choose a lobe or technique, one to decide whether to keep a sample.
    #[pyo3(signature = (n = 1, purpose = "environment"))]
    fn random<'py>(&self, py: Python<'py>, n: u32, purpose: &str) -> PyResult<FloatArray<'py>> {
        let dimension = match purpose {
            "environment" => Dimension::Environment,
            "brdf" => Dimension::Brdf,
            "resampling" => Dimension::Resampling,
            _ => {
                return Err(bad_value(format!(
                    "purpose is {purpose:?}; it must be 'environment', 'brdf' or 'resampling'"
                )));
            }
        };
        if !(1..=1 << 16).contains(&n) {
            return Err(bad_value(format!("n is {n}; it must be from 1 to 65536")));
        }
        let numbers = alone(py, || {
            let of_point = |at: &SampleIndex| {
                let at = *at;
                (0..n).map(move |j| at.get(dimension, j, n).0)
            };
            self.numbers.iter().flat_map(of_point).collect::<Vec<_>>()
        })?;
        rows(py, numbers, &[self.points.len(), n as usize])
    }

    /// Evaluate the reflectance toward the viewer.
    ///
    /// Parameters
    /// ----------
    /// wi : array_like, shape (N, ..., 3), or (M, 3) with `index`
    ///     Directions toward the light.
    /// index : array_like of int, optional
    ///     The point of each direction, in the shape of `wi` without the last axis.
    ///
    /// Returns
    /// -------
    /// ndarray, in the shape of `wi`
    ///     f_r * cos(theta_i) [sr^-1]; 0 below the geometric surface.
    #[pyo3(signature = (wi, index = None))]
    fn eval<'py>(
        &self,
        wi: &Bound<'py, PyAny>,
        index: Option<Bound<'py, PyAny>>,
    ) -> PyResult<FloatArray<'py>> {
        Ok(self.eval_pdf(wi, index)?.0)
    }

    /// `eval`, and the density of `sample` [sr^-1].
    ///
    /// Returns
    /// -------
    /// value : ndarray, in the shape of `wi`
    /// pdf : ndarray, in the shape of `wi` without the last axis
    #[pyo3(signature = (wi, index = None))]
    fn eval_pdf<'py>(
        &self,
        wi: &Bound<'py, PyAny>,
        index: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(FloatArray<'py>, FloatArray<'py>)> {
        let py = wi.py();
        let wi = Floats::new("wi", wi)?;
        let (directions, lead) = wi.finite::<3>()?;
        let points = self.points_of(index.as_ref(), lead)?;
        let (values, densities) = self.evaluate(py, &points, directions)?;
        Ok((rows(py, values, lead)?, array(py, densities, lead)?))
    }

    /// Sample directions from the BSDFs.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (N, ..., 3) or (N, ..., 4)
    ///     Uniform numbers: two for the direction, the third to choose a lobe.
    /// index : array_like of int, optional
    ///     The point of each direction.
    ///
    /// Returns
    /// -------
    /// wi : ndarray, shape (N, ..., 3)
    ///     Directions toward the light.
    /// value : ndarray, shape (N, ..., 3)
    ///     f_r * cos(theta_i) [sr^-1].
    /// pdf : ndarray, shape (N, ...)
    ///     Density [sr^-1]. If there is no sample, all three are 0; it still counts as a sample with value 0.
    #[pyo3(signature = (u, index = None))]
    fn sample<'py>(
        &self,
        u: &Bound<'py, PyAny>,
        index: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(FloatArray<'py>, FloatArray<'py>, FloatArray<'py>)> {
        let py = u.py();
        let u = Floats::uniform_numbers("u", u)?;
        let (numbers, lead) = if u.shape().last() == Some(&4) {
            let (numbers, lead) = u.uniform::<4>()?;
            (numbers.iter().map(|&[x, y, z, _]| [x, y, z]).collect::<Vec<_>>(), lead)
        } else {
            let (numbers, lead) = u.uniform::<3>()?;
            (numbers.to_vec(), lead)
        };
        let points = self.points_of(index.as_ref(), lead)?;
        let (wi, value, pdf) = self.draw(py, &points, &numbers)?;
        Ok((rows(py, wi, lead)?, rows(py, value, lead)?, array(py, pdf, lead)?))
    }

    fn __repr__(&self) -> String {
        format!("<ShadingPoints: {}>", self.points.len())
    }
}

impl ShadingPoints {
    /// Directions, values and densities; zeros where there is no sample.
    fn draw(&self, py: Python<'_>, index: &[u32], u: &[[f32; 3]]) -> PyResult<Drawn> {
        let mut drawn: Vec<([f32; 3], [f32; 3], f32)> = alone(py, || {
            let one = |(&i, &[x, y, u_lobe]): (&u32, &[f32; 3])| {
                let point = &self.points[i as usize];
                let builtin = self.python_lobe(point).is_none();
                let sample = builtin.then(|| point.sample(u_lobe, Vec2::new(x, y))).flatten();
                sample.map_or(([0.0; 3], [0.0; 3], 0.0), |s| {
                    (s.wi.to_array(), s.value.to_array(), s.pdf)
                })
            };
            index.iter().zip(u).map(one).collect()
        })?;
        for &lobe in &self.lobes {
            let point = |row: usize| &self.points[index[row] as usize];
            let is_of_lobe =
                |&row: &usize| self.python_lobe(point(row)).is_some_and(|f| std::ptr::eq(f, lobe));
            let of_lobe: Vec<usize> = (0..index.len()).filter(is_of_lobe).collect();
            let wo: Vec<_> = of_lobe.iter().map(|&row| point(row).wo.to_array()).collect();
            let numbers: Vec<_> = of_lobe.iter().map(|&row| u[row]).collect();
            let local = lobe.sample_rows(py, &wo, &numbers)?;
            let (values, densities) = lobe.eval_pdf_rows(py, &wo, &local)?;
            for (i, &row) in of_lobe.iter().enumerate() {
                let wi = point(row).frame.to_world(local[i].into());
                let pdf = densities[i];
                if pdf > 0.0 && pdf.is_finite() && point(row).ng.dot(wi) > 0.0 {
                    drawn[row] = (wi.to_array(), values[i].to_array(), pdf);
                }
            }
        }
        let (wi, rest): (Vec<_>, Vec<_>) = drawn.into_iter().map(|(w, v, p)| (w, (v, p))).unzip();
        let (value, pdf) = rest.into_iter().unzip();
        Ok((wi, value, pdf))
    }
}

/// A function of [`ShadingPoints`] that returns (index, wi, weight).
pub(crate) struct PythonStrategy {
    function: Py<PyAny>,
    n_rays: u32,
    lobes: Vec<&'static PythonLobe>,
}

impl PythonStrategy {
    /// # Errors
    /// If it is not callable, or its attribute `n_rays` is not a valid number of rays.
    pub(crate) fn new(
        function: Bound<'_, PyAny>,
        lobes: Vec<&'static PythonLobe>,
    ) -> PyResult<Self> {
        const MOST: u32 = 1 << 16;
        let n_rays = match function.getattr_opt("n_rays")? {
            None => 1,
            Some(n) => {
                n.extract::<u32>().ok().filter(|n| (1..=MOST).contains(n)).ok_or_else(|| {
                    let found = n.repr().map_or_else(|_| "?".to_owned(), |r| r.to_string());
                    bad_value(format!(
                        "the strategy's n_rays is {found}; it must be from 1 to {MOST}"
                    ))
                })?
            }
        };
        Ok(Self { function: function.unbind(), n_rays, lobes })
    }

    /// Calls the function and converts its result.
    fn call(&self, py: Python<'_>, tile: &TileShading, out: &mut Contributions) -> PyResult<()> {
        let numbers = tile.pixels.iter().flat_map(|pixel| {
            let number = |i| (i, SampleIndex { sampler: pixel.sampler, sample: tile.samples[i] });
            pixel.points.clone().map(number)
        });
        let mut numbers: Vec<(usize, SampleIndex)> = numbers.collect();
        numbers.sort_by_key(|(i, _)| *i);
        let points = ShadingPoints {
            points: tile.points.to_vec(),
            numbers: numbers.into_iter().map(|(_, number)| number).collect(),
            lobes: self.lobes.clone(),
        };
        let result = self.function.bind(py).call1((Bound::new(py, points)?,))?;
        let (index, wi, weight): (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>) =
            result.extract().map_err(|_| {
                let found = result.get_type();
                bad_value(format!(
                    "the strategy returned {found}; it must return (index, wi, weight)"
                ))
            })?;
        let (index, shape) = indices("the strategy's index", &index, tile.points.len())?;
        let wi = Floats::new("the strategy's wi", &wi)?;
        let (directions, lead) = wi.rows::<3>()?;
        if shape != lead {
            return Err(
                wi.bad_shape(&format!("(…, 3) with … = {}, that of index", shape_text(&shape)))
            );
        }
        let weights = weights(&weight, lead)?;
        let mut order: Vec<u32> = (0..index.len() as u32).collect();
        if !index.is_sorted() {
            order.sort_by_key(|&row| index[row as usize]);
        }
        let mut n_of_point = vec![0; tile.points.len()];
        for row in order {
            let row = row as usize;
            let (point, wi, weight) = (index[row], Vec3::from(directions[row]), weights[row]);
            if weight.is_black() {
                continue;
            }
            let n = &mut n_of_point[point as usize];
            *n += 1;
            if *n > self.n_rays {
                return Err(bad_value(format!(
                    "the strategy returned rays for point {point} beyond its n_rays, {}; set its attribute n_rays to \
                     the maximum number of rays per point",
                    self.n_rays
                )));
            }
            let is_unit = (wi.length_squared() - 1.0).abs() < 1e-3;
            if !is_unit {
                return Err(bad_value(format!(
                    "the strategy's wi[{row}] is ({}, {}, {}); it must be a unit vector",
                    wi.x, wi.y, wi.z
                )));
            }
            // The surface is opaque, so directions below it need no ray.
            if tile.points[point as usize].ng.dot(wi) > 0.0 {
                out.push(point, wi, weight);
            }
        }
        Ok(())
    }
}

/// A weight for each row, one number or three.
fn weights(weight: &Bound<'_, PyAny>, lead: &[usize]) -> PyResult<Vec<Rgb>> {
    let floats = Floats::new("the strategy's weight", weight)?;
    let n = lead.iter().product();
    match floats.shape() {
        shape if shape == lead => Ok(floats.values()?.iter().map(|&x| Rgb::splat(x)).collect()),
        [first @ .., 3] if first == lead => {
            Ok(floats.values()?.as_chunks::<3>().0.iter().map(|&c| Rgb::from(c)).collect())
        }
        _ if lead.len() == 1 => colors("the strategy's weight", weight, n),
        _ => Err(floats.bad_shape(&format!("{0} or {0} and 3", shape_text(lead)))),
    }
}

impl Strategy for PythonStrategy {
    type Pass = ();
    type Scratch = ();
    type Findings = ();

    fn n_rays(&self) -> u32 {
        self.n_rays
    }

    fn begin_pass(&self, _: Sampler, _: u32) {}

    fn push(&self, (): &(), tile: &TileShading, _round: u32, (): &mut (), out: &mut Contributions) {
        if tile.points.is_empty() {
            return;
        }
        if or_report(|py| self.call(py, tile, out)).is_none() {
            out.reset(tile.points.len());
        }
    }

    fn findings(&self, (): &()) {}
}
