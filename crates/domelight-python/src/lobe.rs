//! Reflectance written in Python.

use domelight::Rgb;
use domelight::bsdf::{Bxdf, CustomLobe};
use domelight::math::{FRAC_1_PI, Vec2, Vec3};
use domelight::sampling::warp::cosine_hemisphere;
use pyo3::prelude::*;

use crate::arrays::{Floats, rows, shape_text};
use crate::error::bad_value;
use crate::failure::or_report;

/// A lobe with Python functions, which take and return arrays with one row per pair of directions.
#[derive(Debug)]
pub(crate) struct PythonLobe {
    eval: Py<PyAny>,
    /// The density and the sampler; cosine-weighted if `None`.
    sampling: Option<(Py<PyAny>, Py<PyAny>)>,
    albedo: Rgb,
    max_eval: Option<f32>,
    roughness: Option<f32>,
}

impl PythonLobe {
    /// Keeps a lobe until the program ends, as the library requires of custom lobes.
    pub(crate) fn leak(
        eval: Py<PyAny>,
        sampling: Option<(Py<PyAny>, Py<PyAny>)>,
        albedo: Rgb,
        max_eval: Option<f32>,
        roughness: Option<f32>,
    ) -> &'static Self {
        Box::leak(Box::new(Self { eval, sampling, albedo, max_eval, roughness }))
    }

    /// Whether a lobe of the library is this one.
    pub(crate) fn is(&self, lobe: &CustomLobe) -> bool {
        std::ptr::addr_eq(lobe.bxdf(), self)
    }

    /// Whether its values have an upper bound.
    pub(crate) fn has_bound(&self) -> bool {
        self.max_eval.is_some()
    }

    /// Values f_r · cos θ_i and densities of pairs of local directions; zero below the surface.
    pub(crate) fn eval_pdf_rows(
        &self,
        py: Python<'_>,
        wo: &[[f32; 3]],
        wi: &[[f32; 3]],
    ) -> PyResult<(Vec<Rgb>, Vec<f32>)> {
        let n = wo.len();
        if n == 0 {
            return Ok((Vec::new(), Vec::new()));
        }
        let arguments =
            || Ok::<_, PyErr>((rows(py, wo.to_vec(), &[n])?, rows(py, wi.to_vec(), &[n])?));
        let values = self.eval.bind(py).call1(arguments()?)?;
        let mut values = colors("the result of eval", &values, n)?;
        let mut densities = match &self.sampling {
            Some((pdf, _)) => numbers("the result of pdf", &pdf.bind(py).call1(arguments()?)?, n)?,
            None => wi.iter().map(|w| w[2] * FRAC_1_PI).collect(),
        };
        for (i, (wo, wi)) in wo.iter().zip(wi).enumerate() {
            if !(wo[2] > HORIZON && wi[2] > HORIZON) {
                (values[i], densities[i]) = (Rgb::BLACK, 0.0);
            }
        }
        Ok((values, densities))
    }

    /// Local directions sampled from numbers (u, v, u_lobe); below the surface if there is no sample.
    pub(crate) fn sample_rows(
        &self,
        py: Python<'_>,
        wo: &[[f32; 3]],
        u: &[[f32; 3]],
    ) -> PyResult<Vec<[f32; 3]>> {
        let n = wo.len();
        let Some((_, sample)) = self.sampling.as_ref().filter(|_| n > 0) else {
            return Ok(u
                .iter()
                .map(|u| cosine_hemisphere(Vec2::new(u[0], u[1])).to_array())
                .collect());
        };
        let drawn =
            sample.bind(py).call1((rows(py, wo.to_vec(), &[n])?, rows(py, u.to_vec(), &[n])?))?;
        let drawn = Floats::new("the result of sample", &drawn)?;
        let (directions, lead) = drawn.rows::<3>()?;
        if lead != [n] {
            return Err(drawn.bad_shape(&shape_text(&[n, 3])));
        }
        Ok(directions.to_vec())
    }
}

/// The cosine below which a direction is at the surface, as in the library.
const HORIZON: f32 = 1e-7;

/// A color for each of n rows, from (n, 3) or (n,).
pub(crate) fn colors(name: &'static str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<Rgb>> {
    let floats = Floats::new(name, value)?;
    let values: Vec<Rgb> = match *floats.shape() {
        [rows, 3] if rows == n => {
            floats.values()?.as_chunks::<3>().0.iter().map(|&c| Rgb::from(c)).collect()
        }
        [rows] if rows == n => floats.values()?.iter().map(|&x| Rgb::splat(x)).collect(),
        _ => return Err(floats.bad_shape(&format!("({n}, 3) or ({n},)"))),
    };
    Ok(values)
}

/// A number for each of n rows.
fn numbers(name: &'static str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f32>> {
    let floats = Floats::new(name, value)?;
    if floats.shape() != [n] {
        return Err(floats.bad_shape(&shape_text(&[n])));
    }
    if let Some(bad) = floats.values()?.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
        return Err(bad_value(format!(
            "{name} holds {bad}; densities are finite and not negative"
        )));
    }
    Ok(floats.values()?.to_vec())
}

impl Bxdf for PythonLobe {
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let result = or_report(|py| {
            let (values, densities) = self.eval_pdf_rows(py, &[wo.to_array()], &[wi.to_array()])?;
            Ok((values[0], densities[0]))
        });
        result.unwrap_or((Rgb::BLACK, 0.0))
    }

    fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Vec3> {
        if self.sampling.is_none() {
            return Some(cosine_hemisphere(u));
        }
        or_report(|py| {
            let drawn = self.sample_rows(py, &[wo.to_array()], &[[u.x, u.y, u_lobe]])?;
            Ok(drawn[0].into())
        })
    }

    fn max_eval(&self, _wo: Vec3) -> f32 {
        self.max_eval.unwrap_or(f32::INFINITY)
    }

    fn albedo(&self, _cos_theta_o: f32) -> Rgb {
        self.albedo
    }

    fn roughness(&self) -> Option<f32> {
        self.roughness
    }
}
