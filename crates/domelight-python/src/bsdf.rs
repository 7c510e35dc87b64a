//! BSDFs and materials.

use domelight::Rgb;
use domelight::bsdf::{self, Brdf as _, BrdfSample, CustomLobe};
use domelight::math::{Vec2, Vec3};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyType};

use crate::arrays::{Floats, Pairs, array, rows};
use crate::engine::alone;
use crate::error::{bad_value, to_python};
use crate::lobe::PythonLobe;
use crate::notebook::lobe_svg;

/// A sum of reflectance lobes in the local frame, whose z axis is the shading normal.
///
/// `wo` points toward the viewer, `wi` toward the light; both are unit vectors away from the surface. Values are
/// f_r * cos(theta_i), including the cosine, and densities are per solid angle [sr^-1]; both are 0 for directions at or
/// below the surface.
///
/// Created by `Bsdf.parse` and `Bsdf.custom`.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Bsdf {
    pub(crate) inner: bsdf::Bsdf,
    text: Option<String>,
    pub(crate) lobe: Option<&'static PythonLobe>,
}

impl Bsdf {
    pub(crate) fn from_text(text: &str) -> PyResult<Self> {
        let inner = text.parse().map_err(|e: bsdf::ParseMaterialError| to_python(e))?;
        Ok(Self { inner, text: Some(text.to_owned()), lobe: None })
    }

    /// Values and densities of pairs of directions.
    fn evaluate(
        &self,
        py: Python<'_>,
        pairs: &Pairs<'_, 3, 3>,
    ) -> PyResult<(Vec<[f32; 3]>, Vec<f32>)> {
        if let Some(lobe) = self.lobe {
            let (wo, wi): (Vec<_>, Vec<_>) = pairs.iter().unzip();
            let (values, densities) = lobe.eval_pdf_rows(py, &wo, &wi)?;
            return Ok((values.iter().map(|v| v.to_array()).collect(), densities));
        }
        alone(py, || {
            let pair = |(wo, wi): ([f32; 3], [f32; 3])| {
                let (wo, wi) = (Vec3::from(wo), Vec3::from(wi));
                let (value, pdf) = self.inner.for_view(wo).eval_pdf(wo, wi);
                (value.to_array(), pdf)
            };
            pairs.iter().map(pair).unzip()
        })
    }
}

/// A direction, its weight and its density.
type Drawn = ([f32; 3], [f32; 3], f32);

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

#[pymethods]
impl Bsdf {
    /// Parse a BSDF from a text such as 'diffuse:0.8', 'phong:50:1:0.5', 'ggx:0.2:gold' or 'gltf:1,0.8,0.6:0:0.5'.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the text is invalid; the message lists what is allowed.
    #[classmethod]
    fn parse(_cls: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Self::from_text(text)
    }

    /// Create a custom BSDF from functions of arrays.
    ///
    /// Parameters
    /// ----------
    /// eval : callable
    ///     `eval(wo, wi)` takes two arrays (N, 3) of local directions above the surface and returns f_r * cos(theta_i)
    ///     [sr^-1], nonnegative, as (N, 3) or (N,).
    /// pdf : callable, optional
    ///     `pdf(wo, wi)` returns the density of `sample` [sr^-1], (N,), finite, and positive wherever the value is.
    /// sample : callable, optional
    ///     `sample(wo, u)` takes uniform numbers (N, 3) and returns directions (N, 3); directions below the surface are
    ///     samples with value 0. Without `pdf` and `sample`, directions are cosine-weighted.
    /// albedo : float or array_like, shape (3,), default 0.5
    ///     The approximate reflected fraction of uniform light.
    /// max_eval : float, optional
    ///     An upper bound of the values, required by the strategy 'rejection'.
    /// roughness : float, optional
    ///     The GGX alpha of a lobe of similar width about the mirror direction; it guides 'product'.
    ///
    /// Notes
    /// -----
    /// Strategies written in Python evaluate such a BSDF for all points of a tile at once; built-in strategies call it
    /// for one direction at a time, which is slow. For that reason, 'sir' without a number of candidates draws 16 for
    /// each ray instead of measuring which number is best. The functions are kept until the program ends.
    #[classmethod]
    #[pyo3(signature = (eval, pdf = None, sample = None, *, albedo = None, max_eval = None, roughness = None))]
    fn custom(
        cls: &Bound<'_, PyType>,
        eval: Py<PyAny>,
        pdf: Option<Py<PyAny>>,
        sample: Option<Py<PyAny>>,
        albedo: Option<Bound<'_, PyAny>>,
        max_eval: Option<f32>,
        roughness: Option<f32>,
    ) -> PyResult<Self> {
        let py = cls.py();
        for (name, function) in
            [("eval", Some(&eval)), ("pdf", pdf.as_ref()), ("sample", sample.as_ref())]
        {
            if let Some(function) = function.filter(|f| !f.bind(py).is_callable()) {
                return Err(bad_value(format!(
                    "{name} is {}; it must be callable",
                    function.bind(py).repr()?
                )));
            }
        }
        let sampling = match (pdf, sample) {
            (Some(pdf), Some(sample)) => Some((pdf, sample)),
            (None, None) => None,
            _ => return Err(bad_value("pdf and sample belong together; give both or neither")),
        };
        let albedo = match albedo {
            Some(albedo) => {
                let floats = Floats::new("albedo", &albedo)?;
                floats.require_finite()?;
                floats.color()?
            }
            None => Rgb::splat(0.5),
        };
        if albedo.min_component() < 0.0 || albedo.max_component() > 1.0 {
            return Err(bad_value(format!(
                "albedo is {:?}; it must lie in [0, 1]",
                albedo.to_array()
            )));
        }
        for (name, value) in [("max_eval", max_eval), ("roughness", roughness)] {
            if let Some(value) = value.filter(|x| !(x.is_finite() && *x > 0.0)) {
                return Err(bad_value(format!(
                    "{name} is {value}; it must be positive and finite"
                )));
            }
        }
        let lobe = PythonLobe::leak(eval, sampling, albedo, max_eval, roughness);
        let inner = bsdf::Bsdf::single(CustomLobe::new(lobe));
        Ok(Self { inner, text: None, lobe: Some(lobe) })
    }

    /// Evaluate pairs of directions.
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like, shape (..., 3)
    ///     Local unit vectors; one of them may be a single vector for all.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (..., 3)
    ///     f_r * cos(theta_i) [sr^-1].
    fn eval<'py>(
        &self,
        wo: &Bound<'py, PyAny>,
        wi: &Bound<'py, PyAny>,
    ) -> PyResult<FloatArray<'py>> {
        Ok(self.eval_pdf(wo, wi)?.0)
    }

    /// Density of `sample` for pairs of directions.
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like, shape (..., 3)
    ///     Local unit vectors; one of them may be a single vector for all.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (...)
    ///     Density of wi [sr^-1]; it may integrate to less than 1, the rest being the probability of no sample.
    fn pdf<'py>(
        &self,
        wo: &Bound<'py, PyAny>,
        wi: &Bound<'py, PyAny>,
    ) -> PyResult<FloatArray<'py>> {
        Ok(self.eval_pdf(wo, wi)?.1)
    }

    /// `eval` and `pdf` at once.
    fn eval_pdf<'py>(
        &self,
        wo: &Bound<'py, PyAny>,
        wi: &Bound<'py, PyAny>,
    ) -> PyResult<(FloatArray<'py>, FloatArray<'py>)> {
        let py = wo.py();
        let (wo, wi) = (Floats::new("wo", wo)?, Floats::new("wi", wi)?);
        let pairs = Pairs::<3, 3>::new(&wo, &wi)?;
        let (values, densities) = self.evaluate(py, &pairs)?;
        Ok((rows(py, values, &pairs.lead)?, array(py, densities, &pairs.lead)?))
    }

    /// Sample directions toward the light.
    ///
    /// Parameters
    /// ----------
    /// wo : array_like, shape (..., 3)
    ///     Local unit vectors toward the viewer.
    /// u : array_like, shape (..., 3)
    ///     Uniform numbers in [0, 1): two for the direction, the third to choose a lobe. BSDFs with a single lobe also
    ///     take (..., 2).
    ///
    /// Returns
    /// -------
    /// wi : ndarray, shape (..., 3)
    ///     Local unit vectors.
    /// weight : ndarray, shape (..., 3)
    ///     f_r * cos(theta_i) / pdf.
    /// pdf : ndarray, shape (...)
    ///     Density [sr^-1]. If there is no sample, all three are 0; it still counts as a sample with value 0.
    fn sample<'py>(
        &self,
        wo: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<(FloatArray<'py>, FloatArray<'py>, FloatArray<'py>)> {
        let py = wo.py();
        let (wo, u) = (Floats::new("wo", wo)?, Floats::uniform_numbers("u", u)?);
        let (directions, numbers, lead) = if u.shape().last() == Some(&2) {
            if self.inner.lobes().count() > 1 {
                return Err(u.bad_shape("(…, 3): the third number chooses among the lobes"));
            }
            u.uniform::<2>()?;
            let pairs = Pairs::<3, 2>::new(&wo, &u)?;
            let (a, b): (Vec<_>, Vec<_>) =
                pairs.iter().map(|(wo, [x, y])| (wo, [x, y, 0.0])).unzip();
            (a, b, pairs.lead)
        } else {
            u.uniform::<3>()?;
            let pairs = Pairs::<3, 3>::new(&wo, &u)?;
            let (a, b): (Vec<_>, Vec<_>) = pairs.iter().unzip();
            (a, b, pairs.lead)
        };
        let drawn = self.draw(py, &directions, &numbers)?;
        let (wi, rest): (Vec<_>, Vec<_>) = drawn.into_iter().map(|(wi, w, p)| (wi, (w, p))).unzip();
        let (weight, pdf): (Vec<_>, Vec<_>) = rest.into_iter().unzip();
        Ok((rows(py, wi, &lead)?, rows(py, weight, &lead)?, array(py, pdf, &lead)?))
    }

    /// ndarray, shape (3,): approximate reflected fraction of uniform light.
    #[getter]
    fn albedo<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        array(py, self.inner.albedo().to_array().to_vec(), &[3])
    }

    fn __repr__(&self) -> String {
        match &self.text {
            Some(text) => format!("Bsdf.parse({text:?})"),
            None => "<Bsdf of functions>".to_owned(),
        }
    }

    /// Its lobe in the plane of incidence.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.plot(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        match &slf.get().text {
            Some(text) => Ok((slf.get_type().getattr("parse")?, (text.clone(),))),
            None => Err(PyTypeError::new_err("a BSDF of functions cannot be pickled")),
        }
    }
}

impl Bsdf {
    /// A plot of the lobe in the plane of incidence.
    fn plot(&self, py: Python<'_>) -> PyResult<String> {
        let title = self.text.as_deref().unwrap_or("BSDF of functions");
        lobe_svg(title, |wo, wi| {
            if let Some(lobe) = self.lobe {
                return Ok(lobe.eval_pdf_rows(py, &vec![wo; wi.len()], wi)?.0);
            }
            let bsdf = self.inner.for_view(wo.into());
            Ok(wi.iter().map(|&wi| bsdf.eval(wo.into(), wi.into())).collect())
        })
    }

    /// Directions, weights and densities; zeros where there is no sample.
    fn draw(&self, py: Python<'_>, wo: &[[f32; 3]], u: &[[f32; 3]]) -> PyResult<Vec<Drawn>> {
        let weighed = |wi: [f32; 3], value: Rgb, pdf: f32| {
            let is_sample = pdf > 0.0 && pdf.is_finite();
            if is_sample { (wi, (value / pdf).to_array(), pdf) } else { ([0.0; 3], [0.0; 3], 0.0) }
        };
        if let Some(lobe) = self.lobe {
            let wi = lobe.sample_rows(py, wo, u)?;
            let (values, densities) = lobe.eval_pdf_rows(py, wo, &wi)?;
            let all = wi.into_iter().zip(values).zip(densities);
            return Ok(all.map(|((wi, value), pdf)| weighed(wi, value, pdf)).collect());
        }
        alone(py, || {
            let draw = |(&wo, &[x, y, u_lobe]): (&[f32; 3], &[f32; 3])| {
                let wo = Vec3::from(wo);
                let sample = self.inner.for_view(wo).sample(wo, u_lobe, Vec2::new(x, y));
                sample.map_or(([0.0; 3], [0.0; 3], 0.0), |BrdfSample { wi, value, pdf }| {
                    weighed(wi.to_array(), value, pdf)
                })
            };
            wo.iter().zip(u).map(draw).collect()
        })
    }
}

/// The material of a mesh: the same BSDF everywhere.
///
/// Parameters
/// ----------
/// bsdf : Bsdf or str
///     The reflectance, or a text as in `Bsdf.parse`.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Material {
    #[pyo3(get)]
    pub(crate) bsdf: Py<Bsdf>,
}

/// A BSDF, a material or the text of one.
pub(crate) enum MaterialLike {
    Text(String),
    Bsdf(Py<Bsdf>),
    Material(Py<Material>),
}

impl<'py> FromPyObject<'_, 'py> for MaterialLike {
    type Error = PyErr;

    fn extract(value: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(text) = value.extract() {
            return Ok(Self::Text(text));
        }
        if let Ok(bsdf) = value.cast::<Bsdf>() {
            return Ok(Self::Bsdf(bsdf.to_owned().unbind()));
        }
        if let Ok(material) = value.cast::<Material>() {
            return Ok(Self::Material(material.to_owned().unbind()));
        }
        Err(PyTypeError::new_err(format!(
            "{} is no material; give a text such as 'diffuse:0.5', a Bsdf or a Material",
            value.repr()?
        )))
    }
}

impl MaterialLike {
    /// What was given.
    pub(crate) fn object<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        match self {
            Self::Text(text) => PyString::new(py, text).into_any(),
            Self::Bsdf(bsdf) => bsdf.bind(py).clone().into_any(),
            Self::Material(material) => material.bind(py).clone().into_any(),
        }
    }

    /// Its text, if it has one.
    pub(crate) fn text(&self) -> Option<String> {
        match self {
            Self::Text(text) => Some(text.clone()),
            Self::Bsdf(bsdf) => bsdf.get().text.clone(),
            Self::Material(material) => material.get().bsdf.get().text.clone(),
        }
    }

    pub(crate) fn bsdf(
        &self,
        py: Python<'_>,
    ) -> PyResult<(bsdf::Bsdf, Option<&'static PythonLobe>)> {
        let of = |bsdf: &Py<Bsdf>| (bsdf.get().inner, bsdf.get().lobe);
        let _ = py;
        Ok(match self {
            Self::Text(text) => (Bsdf::from_text(text)?.inner, None),
            Self::Bsdf(bsdf) => of(bsdf),
            Self::Material(material) => of(&material.get().bsdf),
        })
    }
}

#[pymethods]
impl Material {
    #[new]
    fn new(py: Python<'_>, bsdf: MaterialLike) -> PyResult<Self> {
        let bsdf = match bsdf {
            MaterialLike::Text(text) => Py::new(py, Bsdf::from_text(&text)?)?,
            MaterialLike::Bsdf(bsdf) => bsdf,
            MaterialLike::Material(material) => material.get().bsdf.clone_ref(py),
        };
        Ok(Self { bsdf })
    }

    /// Parse a material from the text of its BSDF; see `Bsdf.parse`.
    #[classmethod]
    fn parse(cls: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        Self::new(cls.py(), MaterialLike::Text(text.to_owned()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Material({})", self.bsdf.bind(py).repr()?))
    }

    /// Its lobe in the plane of incidence.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.bsdf.get().plot(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyType>, (Py<Bsdf>,)) {
        (slf.get_type(), (slf.get().bsdf.clone_ref(slf.py()),))
    }
}
