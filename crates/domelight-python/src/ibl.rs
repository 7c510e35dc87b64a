//! Prefiltered light for engines.

use std::path::PathBuf;

use domelight::picture::texture::{TexelFormat, Texture, dds, ktx2};
use domelight::picture::write_atomically;
use domelight::rig::ibl::{
    self, BrdfTable, Cube, Engine, IblSettings, TableTerms, prefilter as prefiltered,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{array, rows};
use crate::engine::{parallel, parallel_on};
use crate::environment::Environment;
use crate::error::{bad_value, from_source, to_python, warn};

/// The number of columns of a face of the irradiance cube, and of the table.
const IRRADIANCE_SIZE: usize = 32;
const TABLE_SIZE: usize = 128;

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

/// An environment filtered for an engine. Returned by `prefilter`.
///
/// Cubes have their faces in the order +X, -X, +Y, -Y, +Z, -Z and in the orientation in which OpenGL, Vulkan, Direct3D,
/// Metal and WebGPU look up a direction.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct PrefilteredLight {
    inner: ibl::PrefilteredLight,
    settings: IblSettings,
    terms: TableTerms,
    name: String,
}

fn cube<'py>(py: Python<'py>, cube: &Cube) -> PyResult<FloatArray<'py>> {
    let texels = cube.texels.iter().map(|texel| texel.to_array()).collect();
    rows(py, texels, &[6, cube.size, cube.size])
}

impl PrefilteredLight {
    /// What a file holds, with a sentence if it lacks light.
    fn texture(&self, content: &str, texels: &str) -> PyResult<(Texture, Option<String>)> {
        let format = match texels {
            "rgb9e5" => TexelFormat::SharedExponent,
            "half" => TexelFormat::Half,
            _ => {
                return Err(bad_value(format!(
                    "texels is {texels:?}; it must be 'rgb9e5' or 'half'"
                )));
            }
        };
        let levels = match content {
            "radiance" => &self.inner.levels[..],
            "irradiance" => std::slice::from_ref(&self.inner.irradiance),
            "brdf" => return Ok((Texture::table(&BrdfTable::new(TABLE_SIZE, self.terms)), None)),
            _ => {
                return Err(bad_value(format!(
                    "content is {content:?}; it must be 'radiance', 'irradiance' or 'brdf'"
                )));
            }
        };
        let (texture, clipped) = Texture::cube(levels, format);
        let loss = (clipped.texels > 0).then(|| {
            format!(
                "{}: {} texels are brighter than {}, the most that the format holds, and are clipped: level 0 loses {:.2} % of \
                 its light",
                self.name,
                clipped.texels,
                format.largest(),
                100.0 * clipped.lost
            )
        });
        Ok((texture, loss))
    }
}

#[pymethods]
impl PrefilteredLight {
    /// list of ndarray, shape (6, S, S, 3): the radiance of each level, the first as a mirror shows it [W m^-2 sr^-1].
    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> PyResult<Vec<FloatArray<'py>>> {
        self.inner.levels.iter().map(|level| cube(py, level)).collect()
    }

    /// list of float: the perceptual roughness of each level, in [0, 1].
    #[getter]
    fn roughness(&self) -> Vec<f32> {
        self.settings.roughness.clone()
    }

    /// ndarray, shape (6, S, S, 3): irradiance over pi, the radiance of a white diffuse surface [W m^-2 sr^-1]. S is 32, or
    /// less if the cube is smaller.
    #[getter]
    fn irradiance<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        cube(py, &self.inner.irradiance)
    }

    /// ndarray, shape (9, 3): the radiance's real spherical harmonics up to degree 2, in the frame of the cubes.
    #[getter]
    fn harmonics<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        let coefficients = self.inner.harmonics.coefficients;
        rows(py, coefficients.iter().map(|c| c.to_array()).collect(), &[9])
    }

    /// ndarray, shape (3, 3): the world directions that the cubes show at +X, +Y and +Z.
    #[getter]
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        rows(py, self.settings.axes.world.map(|axis| axis.to_array()).to_vec(), &[3])
    }

    /// Compute the table of the BRDF, the second factor of the split sum.
    ///
    /// Parameters
    /// ----------
    /// size : int, default 128
    ///     Number of columns and rows, from 1 to 4096.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (size, size, 2)
    ///     The engine's two terms; cosine to the viewer to the right, roughness downward.
    #[pyo3(signature = (size = 128), text_signature = "($self, size=128)")]
    fn brdf<'py>(&self, py: Python<'py>, size: usize) -> PyResult<FloatArray<'py>> {
        if !(1..=IblSettings::MAX_SIZE).contains(&size) {
            return Err(bad_value(format!(
                "size is {size}; it must be from 1 to {}",
                IblSettings::MAX_SIZE
            )));
        }
        let table = parallel(py, || BrdfTable::new(size, self.terms))?;
        array(py, table.texels.into_flattened(), &[size, size, 2])
    }

    /// Write a cube or the table of the BRDF as a texture, as `domelight ibl` does.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file; its name ends in .ktx2 or .dds.
    /// content : {'radiance', 'irradiance', 'brdf'}, default 'radiance'
    ///     All levels, irradiance over pi, or the table of the BRDF.
    /// texels : {'rgb9e5', 'half'}, default 'rgb9e5'
    ///     The format of a cube's texels, 4 or 8 bytes.
    ///
    /// Raises
    /// ------
    /// OSError, ValueError
    ///     If the file cannot be written, or an argument is unknown.
    #[pyo3(signature = (path, content = "radiance", *, texels = "rgb9e5"),
        text_signature = "($self, path, content='radiance', *, texels='rgb9e5')")]
    fn save(&self, py: Python<'_>, path: PathBuf, content: &str, texels: &str) -> PyResult<()> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let encode = match extension.as_deref() {
            Some("ktx2") => ktx2::encode,
            Some("dds") => dds::encode,
            _ => {
                let path = path.display();
                return Err(bad_value(format!("{path}: its name must end in .ktx2 or .dds")));
            }
        };
        let (texture, loss) = parallel(py, || self.texture(content, texels))??;
        warn(py, loss.as_slice())?;
        parallel(py, || write_atomically(&path, |out| encode(&texture, out)).map_err(to_python))?
    }

    fn __repr__(&self) -> String {
        let IblSettings { size, roughness, .. } = &self.settings;
        format!("<PrefilteredLight of {:?}: {size} columns, {} levels>", self.name, roughness.len())
    }
}

/// Prefilter an environment for image-based lighting by a split sum, as `domelight ibl` does.
///
/// Every texel is the integral over the whole map, so a small sun leaves neither fireflies nor rings. To light a scene by
/// the sun itself, prefilter `lights(env, None, sun=True).residual`.
///
/// Parameters
/// ----------
/// env : Environment
///     The light.
/// size : int, default 256
///     Columns of a face of the first level, from 1 to 4096. Each level halves them.
/// engine : {'three', 'filament', 'babylon', 'godot', 'bevy', 'unreal'}, optional
///     Decides how the cubes stand, the roughness of each level and the terms of the table. By default, cubes are looked up with
///     the world direction, and the roughness is level / (levels - 1).
/// threads : int, optional
///     By default the cores available to the process. The light does not depend on it.
///
/// Returns
/// -------
/// PrefilteredLight
///     Cubes, harmonics and table, as arrays and files.
///
/// Raises
/// ------
/// ValueError
///     If the map is black, the size is out of range, or the engine is unknown.
#[pyfunction]
#[pyo3(signature = (env, size = 256, *, engine = None, threads = None),
    text_signature = "(env, size=256, *, engine=None, threads=None)")]
pub(crate) fn prefilter(
    env: &Bound<'_, Environment>,
    size: usize,
    engine: Option<&str>,
    threads: Option<usize>,
) -> PyResult<PrefilteredLight> {
    let engine: Option<Engine> = engine.map(str::parse).transpose().map_err(|e| from_source(&e))?;
    let linear = IblSettings::linear(size);
    let settings = match engine {
        None => linear,
        Some(engine) => {
            IblSettings { roughness: engine.roughness(size), axes: engine.axes(), ..linear }
        }
    };
    let settings = IblSettings { irradiance_size: IRRADIANCE_SIZE.min(size), ..settings };
    let Environment { inner, name } = env.get();
    let light = parallel_on(env.py(), threads, || prefiltered(inner, &settings))?;
    let inner = light.map_err(|e| from_source(&e))?;
    let terms = engine.map_or(TableTerms::ScaleAndBias, Engine::table);
    Ok(PrefilteredLight { inner, settings, terms, name: name.clone() })
}
