//! Light rigs.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use domelight::environment::mapping::{Mapping, from_lat_long};
use domelight::environment::{self, Orientation};
use domelight::picture::png::Depth;
use domelight::picture::tone::ToneMapping;
use domelight::picture::write_atomically;
use domelight::rig::export::{Dome, DomePicture, Format, RigExport};
use domelight::rig::{
    self, Extraction, ExtractionSettings, Method, Region, RigLight, ShadingReference,
    SphericalHarmonics, TexelRect, extract,
};
use domelight::{Rgb, RgbImage};
use domelight_lab::names::file_name;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyType};

use crate::arrays::{Floats, array, hashable, indices, rows};
use crate::engine::{parallel, parallel_on};
use crate::environment::{Environment, up_axis};
use crate::error::{bad_value, from_source, to_python};
use crate::notebook::balls;
use crate::picture::{Format as PictureFormat, depth, to_png, tone, write_image};

/// Directional lights that replace an environment, and its residual. Returned by `lights`.
///
/// Compact sources come first; each kind is sorted by decreasing luminance.
#[pyclass(frozen, module = "domelight")]
#[derive(Clone)]
pub(crate) struct Rig {
    inner: rig::Rig,
    residual: Option<Arc<environment::Environment>>,
    orientation: Orientation,
    name: String,
}

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

impl Rig {
    /// Lights whose residual is not kept.
    pub(crate) fn without_residual(
        inner: rig::Rig,
        orientation: Orientation,
        name: String,
    ) -> Self {
        Self { inner, residual: None, orientation, name }
    }

    fn numbers<'py>(
        &self,
        py: Python<'py>,
        get: impl Fn(&RigLight) -> f32,
    ) -> PyResult<FloatArray<'py>> {
        array(py, self.inner.lights.iter().map(get).collect(), &[self.inner.lights.len()])
    }

    fn vectors<'py>(
        &self,
        py: Python<'py>,
        get: impl Fn(&RigLight) -> [f32; 3],
    ) -> PyResult<FloatArray<'py>> {
        rows(py, self.inner.lights.iter().map(get).collect(), &[self.inner.lights.len()])
    }

    fn export<'a>(&'a self, dome: Option<Dome<'a>>) -> RigExport<'a> {
        RigExport {
            probe: &self.name,
            orientation: self.orientation,
            lights: &self.inner.lights,
            dome,
        }
    }

    /// Writes the picture of the residual to which a format refers, and returns its name.
    fn write_dome(&self, path: &Path, format: Format) -> Result<Option<String>, domelight::Error> {
        let Some((residual, picture)) = self.residual.as_ref().zip(format.dome_picture()) else {
            return Ok(None);
        };
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = match picture {
            DomePicture::LatLong | DomePicture::LatLongExrOrHdr => format!("{stem}_dome.exr"),
            DomePicture::LatLongHdr => format!("{stem}_dome.hdr"),
            DomePicture::Octahedral => format!("{stem}_dome_octahedral.exr"),
        };
        let format = match picture {
            DomePicture::LatLongHdr => PictureFormat::Hdr,
            DomePicture::LatLong | DomePicture::LatLongExrOrHdr | DomePicture::Octahedral => {
                PictureFormat::Exr
            }
        };
        let map = residual.radiance_map();
        let mapping = picture.mapping();
        let converted: Option<RgbImage> = (mapping != Mapping::LatLong)
            .then(|| from_lat_long(&map, mapping, mapping.size_of([map.width, map.height])));
        let tone = ToneMapping::default();
        let map = converted.as_ref().unwrap_or(&map);
        write_image(&path.with_file_name(&name), format, map, None, &tone, Depth::default())?;
        Ok(Some(name))
    }
}

#[pymethods]
impl Rig {
    fn __len__(&self) -> usize {
        self.inner.lights.len()
    }

    /// ndarray, shape (N, 3): unit vectors toward the lights, in the world.
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.vectors(py, |light| light.direction.to_array())
    }

    /// ndarray, shape (N, 3): irradiance of a surface that faces the light [W m^-2].
    #[getter]
    fn irradiance<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.vectors(py, |light| light.irradiance.to_array())
    }

    /// ndarray, shape (N,): angular radius of a uniform disc with the same variance [rad].
    #[getter]
    fn angular_radius<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.numbers(py, |light| light.angular_radius)
    }

    /// ndarray, shape (N,): fraction of the map's luminance, in [0, 1].
    #[getter]
    fn share<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.numbers(py, |light| light.share)
    }

    /// ndarray, shape (N,): solid angle of the region behind the light [sr].
    #[getter]
    fn solid_angle<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        self.numbers(py, |light| light.solid_angle)
    }

    /// list of str: a name for each light: 'sun', 'lamp_1', ..., 'light_1', ....
    #[getter]
    fn names(&self) -> Vec<String> {
        self.export(None).names()
    }

    /// ndarray of uint32, shape (H, W): index of the light of each texel; 4294967295 for texels without a light.
    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u32>>> {
        array(py, self.inner.labels.clone(), &[self.inner.height, self.inner.width])
    }

    /// Environment or None: the rest of the environment; None if the lights take all of it.
    #[getter]
    fn residual(&self) -> Option<Environment> {
        let residual = self.residual.clone()?;
        Some(Environment { inner: residual, name: format!("{} (residual)", self.name) })
    }

    /// Compute the shading error of the rig with its residual.
    ///
    /// Parameters
    /// ----------
    /// environment : Environment
    ///     The environment that the rig replaces.
    ///
    /// Returns
    /// -------
    /// dict
    ///     'diffuse' and 'glossy': RMS error of a matte surface and of a lobe cos^20 over all normals, relative to the
    ///     shading by the map; 0.01 is one percent. Shadows are ignored.
    fn shading_error<'py>(
        &self,
        environment: &Bound<'py, Environment>,
    ) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let py = environment.py();
        let environment = environment.get().inner.clone();
        let error = parallel(py, || {
            let reference = ShadingReference::new(&environment);
            match &self.residual {
                Some(dome) => reference.error_beside(&self.inner, &ShadingReference::new(dome)),
                None => reference.error(&self.inner),
            }
        })?;
        let values = pyo3::types::PyDict::new(py);
        values.set_item("diffuse", error.diffuse)?;
        values.set_item("glossy", error.glossy)?;
        Ok(values)
    }

    /// Write the rig for another program.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file; if its format refers to a picture of the residual, that is written beside it as `<name>_dome`.
    /// format : str, optional
    ///     'json', 'csv', 'gltf', 'glb', 'usd', 'blender', 'mitsuba', 'pbrt', 'three', 'radiance', 'sibl', 'godot',
    ///     'unreal', 'unity', 'bevy' or 'babylon'; by default by the extension (.json, .csv, .gltf, .glb, .usda, .py, .xml,
    ///     .pbrt, .js, .rad, .ibl, .tscn, .unreal.py, .cs, .rs, .babylon.js).
    ///
    /// Raises
    /// ------
    /// OSError, ValueError
    ///     If a file cannot be written, or the format is unknown.
    #[pyo3(signature = (path, *, format = None))]
    fn save(&self, py: Python<'_>, path: PathBuf, format: Option<&str>) -> PyResult<()> {
        let file_name = path.file_name().and_then(|name| name.to_str());
        let format = match format {
            Some(name) => name.parse().map_err(|e| from_source(&e))?,
            None => file_name.and_then(Format::of_file_name).ok_or_else(|| {
                let known = Format::ALL.map(|f| format!(".{}", f.extensions()[0])).join(", ");
                bad_value(format!(
                    "{}: its name must end in one of {known}, or give format",
                    path.display()
                ))
            })?,
        };
        parallel(py, || {
            let file = self.write_dome(&path, format).map_err(to_python)?;
            let dome = self.residual.as_ref().map(|environment| Dome {
                environment,
                harmonics: SphericalHarmonics::project(environment),
                file: file.as_deref(),
            });
            let bytes = format.encode(&self.export(dome)).map_err(|e| from_source(&e))?;
            write_atomically(&path, |out| out.write_all(&bytes)).map_err(to_python)
        })?
    }

    /// Matte balls in the light of the rig; if there is a residual, also in its light and in that of both.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = parallel(py, || {
            let (picture, alpha) = balls(&self.inner, self.residual.as_deref());
            let tone = tone(&picture, Some(&alpha), None, "agx")?;
            to_png(&picture, Some(&alpha), &tone, depth(8)?).map_err(|e| from_source(&e))
        })??;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            let map = |rig: &Self| rig.residual.as_ref().map(|e| e.radiance_map().into_owned());
            self.inner == other.inner
                && self.orientation == other.orientation
                && map(self) == map(other)
        })
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.inner.labels.hash(&mut hasher);
        for light in &self.inner.lights {
            light.irradiance.to_array().map(hashable).hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let rest = if self.residual.is_some() { ", with a residual" } else { "" };
        format!("<Rig of {:?}: {} lights{rest}>", self.name, self.inner.lights.len())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let py = slf.py();
        let this = slf.get();
        let number = |light: &RigLight| [light.angular_radius, light.share, light.solid_angle];
        let regions = this.inner.lights.iter().map(|light| match light.region {
            Region::Sun => [0; 5],
            Region::Lamp => [1, 0, 0, 0, 0],
            Region::Cell => [2, 0, 0, 0, 0],
            Region::Rectangle(TexelRect { x0, x1, y0, y1 }) => [3, x0, x1, y0, y1],
        });
        let values = (
            this.directions(py)?,
            this.irradiance(py)?,
            rows(py, this.inner.lights.iter().map(number).collect(), &[this.inner.lights.len()])?,
            regions.collect(),
            this.labels(py)?,
            this.residual(),
            (this.orientation.rotation, this.orientation.up.name()),
            this.name.clone(),
        );
        Ok((slf.get_type().getattr("_restore")?, values))
    }

    #[classmethod]
    fn _restore(
        _cls: &Bound<'_, PyType>,
        directions: &Bound<'_, PyAny>,
        irradiance: &Bound<'_, PyAny>,
        sizes: &Bound<'_, PyAny>,
        regions: Vec<[usize; 5]>,
        labels: &Bound<'_, PyAny>,
        residual: Option<Bound<'_, Environment>>,
        orientation: (f32, String),
        name: String,
    ) -> PyResult<Self> {
        let (rotation, up) = orientation;
        let directions = Floats::new("directions", directions)?;
        let irradiance = Floats::new("irradiance", irradiance)?;
        let sizes = Floats::new("sizes", sizes)?;
        let (labels, shape) = indices("labels", labels, u32::MAX as usize + 1)?;
        let &[height, width] = &shape[..] else {
            return Err(bad_value("the pickled labels are no map"));
        };
        let all = directions.rows::<3>()?.0.iter().zip(irradiance.rows::<3>()?.0);
        let all = all.zip(sizes.rows::<3>()?.0).zip(regions);
        let lights =
            all.map(|(((&d, &e), &[angular_radius, share, solid_angle]), region)| RigLight {
                direction: d.into(),
                irradiance: Rgb::from(e),
                angular_radius,
                share,
                solid_angle,
                region: match region {
                    [0, ..] => Region::Sun,
                    [1, ..] => Region::Lamp,
                    [2, ..] => Region::Cell,
                    [_, x0, x1, y0, y1] => Region::Rectangle(TexelRect { x0, x1, y0, y1 }),
                },
            });
        let rig = rig::Rig { lights: lights.collect(), width, height, labels };
        let residual = residual.map(|residual| residual.get().inner.clone());
        Ok(Self {
            inner: rig,
            residual,
            orientation: Orientation { up: up_axis(&up)?, rotation },
            name,
        })
    }
}

/// The parts of a pickled rig.
type Pickled<'py> = (
    FloatArray<'py>,
    FloatArray<'py>,
    FloatArray<'py>,
    Vec<[usize; 5]>,
    Bound<'py, PyArrayDyn<u32>>,
    Option<Environment>,
    (f32, &'static str),
    String,
);

/// Convert an environment to directional lights.
///
/// Parameters
/// ----------
/// env : Environment
///     The light.
/// n : int or None, default 64
///     Total number of lights, including compact sources; with None, everything that `sun` and `lamps` do not take is
///     the rig's residual.
/// method : {'variance-minimization', 'variance-minimization:2009', 'median-cut'}, default 'variance-minimization'
///     The method that divides the map: regions of small variance on the sphere, the rule of Viriyothai & Debevec 2009
///     on the map, or regions of equal energy.
/// sun : bool, default False
///     First extract the sun as one light.
/// lamps : int, default 0
///     Number of other compact sources to extract.
/// min_share : float, optional
///     Lights with a smaller fraction of the luminance, in [0, 1], stay in the residual.
/// threads : int, optional
///     By default the cores available to the process. The lights do not depend on it.
///
/// Returns
/// -------
/// Rig
///     Lights and residual, which add up to the environment in every channel.
///
/// Raises
/// ------
/// ValueError
///     If the map is black, has no sun or lamp when only those are requested, or has fewer lit texels than lights.
#[pyfunction]
#[pyo3(signature = (env, n = Some(64), *, method = "variance-minimization", sun = false, lamps = 0, min_share = None,
    threads = None),
    text_signature = "(env, n=64, *, method='variance-minimization', sun=False, lamps=0, min_share=None, threads=None)")]
pub(crate) fn lights(
    env: &Bound<'_, Environment>,
    n: Option<usize>,
    method: &str,
    sun: bool,
    lamps: usize,
    min_share: Option<f32>,
    threads: Option<usize>,
) -> PyResult<Rig> {
    const MOST: usize = 1 << 20;
    let py = env.py();
    let method: Method = method.parse().map_err(|e| bad_value(format!("method: {e}")))?;
    if let Some(n) = n.filter(|n| !(1..=MOST).contains(n)) {
        return Err(bad_value(format!("n is {n}; it must be from 1 to {MOST}, or None")));
    }
    if lamps > MOST {
        return Err(bad_value(format!("lamps is {lamps}; it must be at most {MOST}")));
    }
    if let Some(share) = min_share.filter(|s| !(0.0..=1.0).contains(s)) {
        return Err(bad_value(format!("min_share is {share}; it must be in [0, 1]")));
    }
    let Environment { inner, name } = env.get();
    let settings = ExtractionSettings { sun, n_lamps: lamps, n_lights: n, method, min_share };
    let Extraction { rig, residual } =
        parallel_on(py, threads, || extract(inner, settings))?.map_err(to_python)?;
    let residual = residual.map(Arc::new);
    Ok(Rig { inner: rig, residual, orientation: inner.orientation(), name: file_name(name) })
}
