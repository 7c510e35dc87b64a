//! Environments and densities over them.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use domelight::environment::{self, EnvironmentDensity, EnvironmentSample, Orientation, UpAxis};
use domelight::rig::SphericalGaussians;
use domelight::rig::tables::{ShaderLanguage, ShaderTables, TableSettings};
use domelight::scene::{EnvironmentSettings, EnvironmentSource};
use domelight::{Rgb, RgbImage};
use domelight_lab::job::{Light, probe_name};
use domelight_lab::{At as _, Error, Host};
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyType};

use crate::arrays::{Floats, array, from_image, hashable, image, rows};
use crate::engine::{abandonable, alone, parallel, parallel_on};
use crate::error::{bad_value, from_source, in_python, to_python, warn};
use crate::options;
use crate::picture::{depth, to_png, tone};

/// Parses the name of an axis.
pub(crate) fn up_axis(text: &str) -> PyResult<UpAxis> {
    text.parse().map_err(|_| bad_value(format!("up is {text:?}; it must be 'y' or 'z'")))
}

/// The radiance from every direction, with sampling in proportion to luminance.
///
/// Parameters
/// ----------
/// map : array_like, shape (H, W, 3)
///     Radiance of a latitude-longitude map, linear Rec. 709 [W m^-2 sr^-1], finite and nonnegative. The first row
///     faces the up axis; the center column faces -Z (or +Y if z is up), and columns go to the right as seen from
///     inside.
/// rotation : float, default 0
///     Rotation about the up axis [degrees], counterclockwise seen from above.
/// scale : float, default 1
///     Factor on the radiance, nonnegative.
/// up : {'y', 'z'}, default 'y'
///     The world axis that the first row faces.
/// name : str, optional
///     The name of the environment in files and messages.
///
/// Raises
/// ------
/// ValueError
///     If the map is empty, has another shape, or a texel is negative or not finite; the message names it.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Environment {
    pub(crate) inner: Arc<environment::Environment>,
    pub(crate) name: String,
}

impl Environment {
    /// The light of a map that is loaded or built in; issues its warnings.
    pub(crate) fn of(
        py: Python<'_>,
        light: Light,
        settings: EnvironmentSettings,
    ) -> PyResult<Self> {
        let name = probe_name(&settings.source);
        let environment = with_warnings(py, move |host| {
            let map = light.load(&settings, host)?;
            settings.environment(map).at(probe_name(&settings.source))
        })?;
        Ok(Self { inner: Arc::new(environment), name })
    }

    /// Converts radiance from the map's unit to watts.
    fn watts(&self, radiance: Rgb) -> [f32; 3] {
        watts(&self.inner, radiance)
    }
}

/// Converts radiance from the map's unit to watts.
fn watts(environment: &environment::Environment, radiance: Rgb) -> [f32; 3] {
    match environment.unit() {
        1.0 => radiance.to_array(),
        unit => radiance.to_array().map(|c| (f64::from(c) * unit) as f32),
    }
}

/// The options of maps from files.
const OF_FILES: [&str; 10] = [
    "rotate",
    "scale",
    "exposure",
    "up",
    "convention",
    "mapping",
    "faces",
    "window",
    "layer",
    "strict",
];

/// The options of built-in maps.
const OF_BUILTIN: [&str; 5] = ["rotate", "scale", "exposure", "up", "rows"];

/// Keeps the warnings.
#[derive(Default)]
struct KeptWarnings(Mutex<Vec<String>>);

impl Host for KeptWarnings {
    fn warn(&self, text: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(in_python(text));
    }
}

/// Runs a function of the laboratory without the interpreter, and issues its warnings.
pub(crate) fn with_warnings<T: Send + 'static>(
    py: Python<'_>,
    f: impl FnOnce(&dyn Host) -> Result<T, Error> + Send + 'static,
) -> PyResult<T> {
    let made = abandonable(py, move || {
        let kept = KeptWarnings::default();
        Ok::<_, Error>((f(&kept)?, kept.0.into_inner()))
    });
    let (made, warnings) = made?.map_err(|e| from_source(&e))?;
    warn(py, &warnings.unwrap_or_else(PoisonError::into_inner))?;
    Ok(made)
}

#[pymethods]
impl Environment {
    #[new]
    #[pyo3(signature = (map, *, rotation = 0.0, scale = 1.0, up = "y", name = "array"))]
    fn new(
        map: &Bound<'_, PyAny>,
        rotation: f32,
        scale: f32,
        up: &str,
        name: &str,
    ) -> PyResult<Self> {
        let py = map.py();
        let orientation = Orientation { up: up_axis(up)?, rotation };
        let map = image(&Floats::new("map", map)?)?;
        let made = abandonable(py, move || environment::Environment::new(map, orientation, scale))?;
        Ok(Self { inner: Arc::new(made.map_err(to_python)?), name: name.to_owned() })
    }

    /// Load a light probe of any known format and layout.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     A picture: .hdr, .exr, .pfm, .ktx2, .dds, .png or .jpg.
    /// rotation, scale, up
    ///     As in the class.
    /// exposure : float, default 0
    ///     A further factor on the radiance, in stops.
    /// convention : str, optional
    ///     The program that the scene comes from, such as 'blender'; the map is oriented as in that program.
    /// mapping : str, optional
    ///     The layout, such as 'lat-long', 'angular' or 'cross-vertical'; guessed by default.
    /// faces : str, optional
    ///     The faces of a cross or strip in the order in which they stand, such as 'F,R,B180,L,U,D'; a number is the
    ///     degrees by which a face is turned clockwise.
    /// window : {'data', 'display'}, optional
    ///     The window of an OpenEXR file that is the map; by default the data window if it has the shape of a map.
    /// layer : str, optional
    ///     The OpenEXR layer.
    /// strict : bool, default False
    ///     Refuse negative and non-finite texels instead of repairing them with a warning.
    ///
    /// Returns
    /// -------
    /// Environment
    ///
    /// Raises
    /// ------
    /// OSError
    ///     If the file cannot be read.
    /// ValueError
    ///     If it is damaged or not a light probe.
    ///
    /// Warns
    /// -----
    /// DomelightWarning
    ///     If texels were repaired, or the format cannot store values above white.
    #[classmethod]
    #[pyo3(signature = (path, **options),
        text_signature = "(path, *, rotation=0.0, scale=1.0, exposure=0.0, up='y', convention=None, mapping=None, faces=None, window=None, layer=None, strict=False)")]
    fn load(
        cls: &Bound<'_, PyType>,
        path: PathBuf,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let light = options::light(options, &OF_FILES)?;
        let map = EnvironmentSettings::new(EnvironmentSource::File(path), UpAxis::default());
        let settings = light.over_settings(map);
        Self::of(cls.py(), light, settings)
    }

    /// Create a built-in probe: 'sky', 'studio', 'cathedral' or 'constant'.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     The name of the probe.
    /// rows : int, default 1024
    ///     Rows of the map, which has twice as many columns.
    /// rotation, scale, exposure, up
    ///     As in `load`.
    #[classmethod]
    #[pyo3(signature = (name, **options),
        text_signature = "(name, *, rows=1024, rotation=0.0, scale=1.0, exposure=0.0, up='y')")]
    fn builtin(
        cls: &Bound<'_, PyType>,
        name: String,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let light = options::light(options, &OF_BUILTIN)?;
        let map = EnvironmentSettings::new(EnvironmentSource::Builtin(name), UpAxis::default());
        let settings = light.over_settings(map);
        Self::of(cls.py(), light, settings)
    }

    /// Convert a Mitsuba 3 emitter, or a picture in its layout.
    ///
    /// Parameters
    /// ----------
    /// source : mitsuba.Emitter or mitsuba.Bitmap
    ///     An `envmap` or `constant` of an RGB variant, or a latitude-longitude picture whose first column faces -Z.
    ///
    /// Returns
    /// -------
    /// Environment
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     If Mitsuba is not installed.
    /// ValueError
    ///     If it is another emitter, or rotated about an axis other than +Y, or +Z with the first row up.
    #[classmethod]
    fn from_mitsuba<'py>(
        cls: &Bound<'py, PyType>,
        source: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let interop = cls.py().import("domelight._interop")?;
        interop.call_method1("environment_from_mitsuba", (source,))
    }

    /// Describe the environment for `mitsuba.load_dict`.
    ///
    /// Returns
    /// -------
    /// dict
    ///     An `envmap` with the map, in single precision, and its rotation.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     If Mitsuba is not installed.
    fn to_mitsuba<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("domelight._interop")?.call_method1("environment_to_mitsuba", (slf,))
    }

    /// ndarray, shape (H, W, 3): a copy of each texel's radiance [W m^-2 sr^-1].
    #[getter]
    fn map<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        from_image(py, &self.inner.radiance_map())
    }

    /// ndarray, shape (H,): exact solid angle of a texel in each row [sr].
    #[getter]
    fn solid_angles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.inner.map().height;
        array(py, (0..n).map(|row| self.inner.texel_solid_angle(row)).collect(), &[n])
    }

    /// (int, int): rows and columns of the map.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let map = self.inner.map();
        (map.height, map.width)
    }

    /// float: rotation about the up axis [degrees].
    #[getter]
    fn rotation(&self) -> f32 {
        self.inner.orientation().rotation
    }

    /// str: the axis that the first row faces, 'y' or 'z'.
    #[getter]
    fn up(&self) -> &'static str {
        self.inner.orientation().up.name()
    }

    /// str: the name of the environment.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// float: integral of luminance over the sphere [W m^-2].
    #[getter]
    fn power(&self) -> f64 {
        self.inner.power() * self.inner.unit()
    }

    /// Return the environment rotated further about its up axis.
    ///
    /// Parameters
    /// ----------
    /// degrees : float
    ///     Counterclockwise seen from above.
    fn rotated(&self, py: Python<'_>, degrees: f32) -> PyResult<Self> {
        let inner = self.inner.clone();
        let inner = parallel(py, || (*inner).clone().rotated(degrees))?.map_err(to_python)?;
        Ok(Self { inner: Arc::new(inner), name: self.name.clone() })
    }

    /// Return the environment with its radiance multiplied by a factor.
    ///
    /// Parameters
    /// ----------
    /// factor : float
    ///     Finite and nonnegative.
    fn scaled(&self, py: Python<'_>, factor: f32) -> PyResult<Self> {
        let inner = self.inner.clone();
        let inner = parallel(py, || (*inner).clone().scaled(factor))?.map_err(to_python)?;
        Ok(Self { inner: Arc::new(inner), name: self.name.clone() })
    }

    /// Sample directions in proportion to luminance.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (..., 2)
    ///     Uniform numbers in [0, 1).
    ///
    /// Returns
    /// -------
    /// wi : ndarray, shape (..., 3)
    ///     Unit vectors toward the light, in the world.
    /// radiance : ndarray, shape (..., 3)
    ///     Radiance from these directions [W m^-2 sr^-1].
    /// pdf : ndarray, shape (...)
    ///     Density [sr^-1], bit-identical to `pdf(wi)`. All three are 0 if there is no sample, as for a black map.
    fn sample<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Samples<'py>> {
        let draw = |u: [f32; 2]| self.inner.sample(u.into());
        samples(&self.inner, u, draw)
    }

    /// Look up the radiance from directions, constant over each texel.
    ///
    /// Parameters
    /// ----------
    /// wi : array_like, shape (..., 3)
    ///     Unit vectors toward the light, in the world.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (..., 3)
    ///     Radiance [W m^-2 sr^-1].
    fn radiance<'py>(&self, wi: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let py = wi.py();
        let wi = Floats::new("wi", wi)?;
        let (directions, lead) = wi.finite::<3>()?;
        let values = alone(py, || {
            directions.iter().map(|&w| self.watts(self.inner.le(w.into()))).collect()
        })?;
        rows(py, values, lead)
    }

    /// Density of `sample` at directions.
    ///
    /// Parameters
    /// ----------
    /// wi : array_like, shape (..., 3)
    ///     Unit vectors toward the light, in the world.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (...)
    ///     Density [sr^-1].
    fn pdf<'py>(&self, wi: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        densities(wi, |w| self.inner.pdf(w.into()))
    }

    /// Convert points on the map to directions.
    ///
    /// Parameters
    /// ----------
    /// uv : array_like, shape (..., 2)
    ///     Points in [0, 1] across and down; (0, 0) is the corner of the first texel.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (..., 3)
    ///     Unit vectors in the world.
    fn directions<'py>(&self, uv: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let py = uv.py();
        let uv = Floats::new("uv", uv)?;
        let (points, lead) = uv.finite::<2>()?;
        let values = alone(py, || {
            points.iter().map(|&p| self.inner.direction(p.into()).to_array()).collect()
        })?;
        rows(py, values, lead)
    }

    /// Convert directions to points on the map: the inverse of `directions`.
    ///
    /// Parameters
    /// ----------
    /// wi : array_like, shape (..., 3)
    ///     Unit vectors in the world.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (..., 2)
    ///     Points in [0, 1] across and down.
    fn uv<'py>(&self, wi: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let py = wi.py();
        let wi = Floats::new("wi", wi)?;
        let (directions, lead) = wi.finite::<3>()?;
        let values =
            alone(py, || directions.iter().map(|&w| self.inner.uv(w.into()).to_array()).collect())?;
        rows(py, values, lead)
    }

    /// Make tables that a renderer on a graphics card samples with the code of `shader_code`.
    ///
    /// Parameters
    /// ----------
    /// texels : int, default 524288
    ///     A map that has more is averaged, with the same light; at most 33554432.
    /// mis_compensation : bool, default False
    ///     Sample only what is brighter than the mean, for renderers that also sample the BSDF.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (rows, columns, 4)
    ///     A texture of RGBA32F, or a buffer of its rows, as `domelight tables` writes it.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the map is black, or if `mis_compensation` leaves nothing to sample.
    #[pyo3(signature = (*, texels = 524_288, mis_compensation = false),
        text_signature = "($self, *, texels=524288, mis_compensation=False)")]
    fn shader_tables<'py>(
        &self,
        py: Python<'py>,
        texels: usize,
        mis_compensation: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let settings = TableSettings { texels, compensated: mis_compensation };
        let tables = parallel(py, || ShaderTables::new(&self.inner, settings))?;
        let tables = tables.map_err(|e| from_source(&e))?;
        let (width, groups) = (tables.texture_width(), tables.texture());
        let shape = [groups.len() / width, width, 4];
        array(py, groups.into_flattened(), &shape)
    }

    /// Fit spherical Gaussians to the light: radiance from w is the sum of amplitude * exp(sharpness * (axis . w - 1)).
    ///
    /// The fit minimizes the squared error of radiance over the sphere, and keeps the flux of each channel. The sun is a
    /// lobe of its own, the first; the others follow in descending order of flux. With the map as Mitsuba looks it up
    /// (`rotation=180`), axes are those of PhySG.
    ///
    /// Parameters
    /// ----------
    /// n : int, default 128
    ///     Number of lobes, from 1 to 1024. There are fewer if the sun is all of the light.
    /// threads : int, optional
    ///     By default the cores available to the process. The lobes do not depend on it.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, 7)
    ///     Axis x, y, z in the world, sharpness, amplitude red, green, blue [W m^-2 sr^-1], as `domelight lights --sg` writes it.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the map is black, has fewer lit texels than lobes, or n is out of range.
    #[pyo3(signature = (n = 128, *, threads = None), text_signature = "($self, n=128, *, threads=None)")]
    fn spherical_gaussians<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let fitted = parallel_on(py, threads, || SphericalGaussians::fit(&self.inner, n))?;
        let rows = fitted.map_err(to_python)?.rows();
        let shape = [rows.len(), 7];
        array(py, rows.into_flattened(), &shape)
    }

    fn __repr__(&self) -> String {
        let map = self.inner.map();
        let Orientation { up, rotation } = self.inner.orientation();
        format!(
            "<Environment {:?}: {} x {} texels, rotation {rotation}, {} up>",
            self.name,
            map.width,
            map.height,
            up.name()
        )
    }

    /// The map, developed; at most 512 columns of it.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        const MOST_COLUMNS: usize = 512;
        let map = self.inner.radiance_map();
        let step = map.width.div_ceil(MOST_COLUMNS);
        let bytes = parallel(py, || {
            let small = reduced(&map, step);
            to_png(&small, None, &tone(&small, None, None, "agx")?, depth(8)?)
                .map_err(|e| from_source(&e))
        })??;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let py = slf.py();
        let this = slf.get();
        let restore = slf.get_type().getattr("_restore")?;
        let map = from_image(py, this.inner.map())?;
        let Orientation { up, rotation } = this.inner.orientation();
        Ok((restore, (map, rotation, this.inner.unit(), up.name(), this.name.clone())))
    }

    #[classmethod]
    fn _restore(
        cls: &Bound<'_, PyType>,
        map: &Bound<'_, PyAny>,
        rotation: f32,
        unit: f64,
        up: &str,
        name: String,
    ) -> PyResult<Self> {
        let orientation = Orientation { up: up_axis(up)?, rotation };
        let map = image(&Floats::new("map", map)?)?;
        let inner =
            parallel(cls.py(), || environment::Environment::from_units(map, orientation, unit))?;
        Ok(Self { inner: Arc::new(inner.map_err(to_python)?), name })
    }
}

/// The means of `step` × `step` texels; at the right and lower borders of as many as there are.
fn reduced(map: &RgbImage, step: usize) -> RgbImage {
    RgbImage::from_fn(map.width.div_ceil(step), map.height.div_ceil(step), |x, y| {
        let across = step * x..map.width.min(step * (x + 1));
        let down = step * y..map.height.min(step * (y + 1));
        let n = (across.len() * down.len()) as f32;
        let texels = down.flat_map(|y| across.clone().map(move |x| (x, y)));
        texels.fold(Rgb::BLACK, |sum, (x, y)| sum + map.get(x, y) * (1.0 / n))
    })
}

/// The parts of a pickled environment: map, rotation, unit, axis and name.
type Pickled<'py> = (Bound<'py, PyArrayDyn<f32>>, f32, f64, &'static str, String);

/// The parts of a pickled density: environment and weights.
type PickledDensity<'py> = (Bound<'py, Environment>, Bound<'py, PyArrayDyn<f32>>);

/// Directions, radiance and densities.
type Samples<'py> =
    (Bound<'py, PyArrayDyn<f32>>, Bound<'py, PyArrayDyn<f32>>, Bound<'py, PyArrayDyn<f32>>);

/// Draws one sample per pair of uniform numbers.
fn samples<'py>(
    environment: &environment::Environment,
    u: &Bound<'py, PyAny>,
    draw: impl Fn([f32; 2]) -> Option<EnvironmentSample> + Send + Sync,
) -> PyResult<Samples<'py>> {
    let py = u.py();
    let u = Floats::uniform_numbers("u", u)?;
    let (points, lead) = u.uniform::<2>()?;
    let (wi, (le, pdf)): (Vec<_>, (Vec<_>, Vec<_>)) = alone(py, || {
        let drawn = points.iter().map(|&u| match draw(u) {
            Some(s) => (s.wi.to_array(), (watts(environment, s.le), s.pdf)),
            None => ([0.0; 3], ([0.0; 3], 0.0)),
        });
        drawn.unzip()
    })?;
    Ok((rows(py, wi, lead)?, rows(py, le, lead)?, array(py, pdf, lead)?))
}

/// The density of each direction.
fn densities<'py>(
    wi: &Bound<'py, PyAny>,
    pdf: impl Fn([f32; 3]) -> f32 + Send + Sync,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = wi.py();
    let wi = Floats::new("wi", wi)?;
    let (directions, lead) = wi.finite::<3>()?;
    let values = alone(py, || directions.iter().map(|&w| pdf(w)).collect())?;
    array(py, values, lead)
}

/// A custom density over the texels of an environment.
///
/// Parameters
/// ----------
/// environment : Environment
///     The environment.
/// weights : array_like, shape (H, W)
///     Density of each texel per solid angle, up to a common factor; finite, nonnegative, not all zero.
///
/// Notes
/// -----
/// If a weight is 0 but the radiance is not, this density alone is biased; combine it with another density.
/// Densities can be pickled, and they are equal if maps, orientations and weights are.
///
/// Raises
/// ------
/// ValueError
///     If the shape is not that of the map, or a weight is negative or not finite; the message names it.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Density {
    environment: Arc<environment::Environment>,
    /// The name of the environment.
    name: String,
    weights: Vec<f32>,
    inner: EnvironmentDensity,
}

#[pymethods]
impl Density {
    #[new]
    fn new(environment: &Bound<'_, Environment>, weights: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = weights.py();
        let Environment { inner: environment, name } = environment.get();
        let weights = Floats::new("weights", weights)?;
        let map = environment.map();
        if weights.shape() != [map.height, map.width] {
            let expected = format!("({}, {}), that of the map", map.height, map.width);
            return Err(weights.bad_shape(&expected));
        }
        let weights = weights.values()?.to_vec();
        let inner = parallel(py, || EnvironmentDensity::new(environment, weights.clone()))?;
        let inner = inner.map_err(|e| from_source(&e))?;
        Ok(Self { environment: environment.clone(), name: name.clone(), weights, inner })
    }

    /// Sample directions from the density.
    ///
    /// Parameters
    /// ----------
    /// u : array_like, shape (..., 2)
    ///     Uniform numbers in [0, 1).
    ///
    /// Returns
    /// -------
    /// wi, radiance, pdf
    ///     As in `Environment.sample`.
    fn sample<'py>(&self, u: &Bound<'py, PyAny>) -> PyResult<Samples<'py>> {
        let draw = |u: [f32; 2]| self.inner.sample(&self.environment, u.into());
        samples(&self.environment, u, draw)
    }

    /// Density of `sample` at directions.
    ///
    /// Parameters
    /// ----------
    /// wi : array_like, shape (..., 3)
    ///     Unit vectors toward the light, in the world.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (...)
    ///     Density [sr^-1].
    fn pdf<'py>(&self, wi: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        densities(wi, |w| self.inner.pdf(&self.environment, w.into()))
    }

    fn __repr__(&self) -> String {
        let map = self.environment.map();
        format!("<Density over {} x {} texels>", map.width, map.height)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let Self { environment: ours, weights, .. } = self;
            let Self { environment: theirs, weights: their_weights, .. } = other.get();
            let is_same = Arc::ptr_eq(ours, theirs)
                || ours.map() == theirs.map()
                    && ours.orientation() == theirs.orientation()
                    && ours.unit() == theirs.unit();
            is_same && weights == their_weights
        })
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.weights.iter().for_each(|&weight| hashable(weight).hash(&mut hasher));
        hasher.finish()
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, PickledDensity<'py>)> {
        let py = slf.py();
        let Self { environment, name, weights, .. } = slf.get();
        let map = environment.map();
        let weights = array(py, weights.clone(), &[map.height, map.width])?;
        let environment = Environment { inner: environment.clone(), name: name.clone() };
        Ok((slf.get_type().into_any(), (Bound::new(py, environment)?, weights)))
    }
}

/// The code that samples `Environment.shader_tables`.
///
/// Parameters
/// ----------
/// language : {'wgsl', 'glsl', 'hlsl', 'slang', 'cuda', 'metal'}
///     The language of the shader.
///
/// Returns
/// -------
/// str
///     At most 60 lines with the functions `domelight_sample`, `domelight_pdf` and `domelight_look_up`.
#[pyfunction]
pub(crate) fn shader_code(language: &str) -> PyResult<String> {
    let language: ShaderLanguage = language.parse().map_err(|e| from_source(&e))?;
    Ok(language.snippet())
}
