//! Prefiltered light for engines.

use std::path::{Path, PathBuf};

use domelight::picture::texture::{Container, EncodingLoss, RadianceFile, TexelFormat, Texture};
use domelight::picture::write_atomically;
use domelight::rig::ibl::{
    self, BrdfTable, Engine, FilteredMap, IblSettings, Layout, SunTreatment,
    prefilter as prefiltered,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{array, rows};
use crate::engine::{parallel, parallel_on};
use crate::environment::Environment;
use crate::error::{bad_value, from_source, to_python, warn};
use crate::rig::Rig;

type FloatArray<'py> = Bound<'py, PyArrayDyn<f32>>;

/// An environment filtered for an engine. Returned by `prefilter`.
///
/// Cubes have their faces in the order +X, -X, +Y, -Y, +Z, -Z and in the orientation in which OpenGL, Vulkan, Direct3D,
/// Metal and WebGPU look up a direction. Octahedral maps have +Y at their center and texels of equal areas.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct PrefilteredLight {
    inner: ibl::PrefilteredLight,
    settings: IblSettings,
    engine: Option<Engine>,
    sun: Option<Rig>,
    name: String,
}

fn texels<'py>(py: Python<'py>, map: &FilteredMap) -> PyResult<FloatArray<'py>> {
    let FilteredMap { layout, size, ref texels } = *map;
    let texels = texels.iter().map(|texel| texel.to_array()).collect();
    match layout {
        Layout::Cube => rows(py, texels, &[6, size, size]),
        Layout::Octahedral => rows(py, texels, &[size, size]),
    }
}

impl PrefilteredLight {
    /// A sentence if a file changes the light.
    fn loss(&self, loss: EncodingLoss) -> Option<String> {
        loss.warning().map(|text| format!("{}: {text}", self.name))
    }

    /// Writes the radiance, and says what the file lacks.
    fn save_radiance(&self, path: &Path, texels: TexelFormat) -> PyResult<Option<String>> {
        let known = "its name must end in .ktx2, .dds, .ktx or .env";
        let file = RadianceFile::of_extension(&extension(path), texels)
            .ok_or_else(|| bad_value(format!("{}: {known}", path.display())))?;
        file.check(self.settings.layout, self.settings.size).map_err(|e| from_source(&e))?;
        if let Some(engine) = file.engine().filter(|&engine| self.engine != Some(engine)) {
            let (path, name) = (path.display(), engine.name());
            let text = format!("{path}: such files are for {name}; prefilter with engine='{name}'");
            return Err(bad_value(text));
        }
        write_atomically(path, |out| file.encode(&self.inner, out)).map_err(to_python)?;
        Ok(self.loss(file.loss(&self.inner)))
    }

    /// Writes a texture, and says what it lacks.
    fn save_texture(
        &self,
        path: &Path,
        content: &str,
        texels: TexelFormat,
    ) -> PyResult<Option<String>> {
        let container = Container::of_extension(&extension(path)).ok_or_else(|| {
            bad_value(format!("{}: its name must end in .ktx2 or .dds", path.display()))
        })?;
        let (texture, loss) = match content {
            "irradiance" => {
                let (texture, loss) =
                    Texture::light(std::slice::from_ref(&self.inner.irradiance), texels);
                (texture, self.loss(loss))
            }
            "brdf" => {
                let table = BrdfTable::new(BrdfTable::SIZE, Engine::terms(self.engine));
                (Texture::table(&table), None)
            }
            _ => {
                return Err(bad_value(format!(
                    "content is {content:?}; it must be 'radiance', 'irradiance' or 'brdf'"
                )));
            }
        };
        write_atomically(path, |out| container.encode(&texture, out)).map_err(to_python)?;
        Ok(loss)
    }
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().into_owned()
}

fn texel_format(texels: &str) -> PyResult<TexelFormat> {
    texels.parse().map_err(|e| bad_value(format!("texels: {e}")))
}

#[pymethods]
impl PrefilteredLight {
    /// list of ndarray, shape (6, S, S, 3): the radiance of each level, the first as a mirror shows it [W m^-2 sr^-1].
    /// Octahedral maps have shape (S, S, 3).
    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> PyResult<Vec<FloatArray<'py>>> {
        self.inner.levels.iter().map(|level| texels(py, level)).collect()
    }

    /// list of float: the perceptual roughness of each level, in [0, 1].
    #[getter]
    fn roughness(&self) -> Vec<f32> {
        self.settings.roughness.clone()
    }

    /// ndarray, shape (6, S, S, 3): irradiance over pi, the radiance of a white diffuse surface [W m^-2 sr^-1]. S is 32, or
    /// less if the first level is smaller. Octahedral maps have shape (S, S, 3).
    #[getter]
    fn irradiance<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        texels(py, &self.inner.irradiance)
    }

    /// ndarray, shape (9, 3): the radiance's real spherical harmonics up to degree 2, in the frame of the maps.
    #[getter]
    fn harmonics<'py>(&self, py: Python<'py>) -> PyResult<FloatArray<'py>> {
        let coefficients = self.inner.harmonics.coefficients;
        rows(py, coefficients.iter().map(|c| c.to_array()).collect(), &[9])
    }

    /// float: the weight of degrees 1 and 2 in the window that the harmonics went through, in [0, 1]; 1 without a window.
    #[getter]
    fn harmonics_window(&self) -> f32 {
        self.inner.harmonics_window
    }

    /// Rig or None: the sun that was taken out of the map.
    #[getter]
    fn sun(&self) -> Option<Rig> {
        self.sun.clone()
    }

    /// str: how the texels cover the sphere, 'cube' or 'octahedral'.
    #[getter]
    fn layout(&self) -> &'static str {
        self.settings.layout.name()
    }

    /// ndarray, shape (3, 3): the world directions that the maps show at +X, +Y and +Z.
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
        let table = parallel(py, || BrdfTable::new(size, Engine::terms(self.engine)))?;
        array(py, table.texels.into_flattened(), &[size, size, 2])
    }

    /// Write a map or the table of the BRDF as a texture, as `domelight ibl` does.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file; its name ends in .ktx2 or .dds. Radiance prefiltered for 'filament' may also become a .ktx file, and that
    ///     for 'babylon' an .env file, which have a format of texels of their own and hold the irradiance, too.
    /// content : {'radiance', 'irradiance', 'brdf'}, default 'radiance'
    ///     All levels, irradiance over pi, or the table of the BRDF.
    /// texels : {'rgb9e5', 'half'}, default 'rgb9e5'
    ///     The format of a map's texels, 4 or 8 bytes.
    ///
    /// Raises
    /// ------
    /// OSError, ValueError
    ///     If the file cannot be written, or an argument is unknown.
    #[pyo3(signature = (path, content = "radiance", *, texels = "rgb9e5"),
        text_signature = "($self, path, content='radiance', *, texels='rgb9e5')")]
    fn save(&self, py: Python<'_>, path: PathBuf, content: &str, texels: &str) -> PyResult<()> {
        let texels = texel_format(texels)?;
        let loss = parallel(py, || match content {
            "radiance" => self.save_radiance(&path, texels),
            _ => self.save_texture(&path, content, texels),
        })??;
        warn(py, loss.as_slice())
    }

    fn __repr__(&self) -> String {
        let IblSettings { size, roughness, .. } = &self.settings;
        format!("<PrefilteredLight of {:?}: {size} columns, {} levels>", self.name, roughness.len())
    }
}

/// Prefilter an environment for image-based lighting by a split sum, as `domelight ibl` does.
///
/// Every texel is the integral over the whole map, so a small sun leaves neither fireflies nor rings.
///
/// Parameters
/// ----------
/// env : Environment
///     The light.
/// size : int, default 256
///     Columns of a face of the first level, from 1 to 4096. Each level halves them. An octahedral map is a single face.
/// engine : {'three', 'filament', 'babylon', 'godot', 'bevy', 'unreal', 'playcanvas'}, optional
///     Decides how the maps stand, the roughness of each level and the terms of the table. By default, maps are looked up with
///     the world direction, and the roughness is level / (levels - 1).
/// sun : str, default 'keep'
///     'keep', 'remove' or 'clamp:X'. A sun that is removed is `PrefilteredLight.sun`, for an engine that lights the scene by
///     it. 'clamp:100' scales every texel until its brightest channel is at most 100.
/// layout : {'cube', 'octahedral'}, default 'cube'
///     Six faces, or one square of equal areas with +Y at its center.
/// sh_window : bool, default True
///     Remove the rings of the harmonics by a window where their irradiance would be negative, opposite to small bright lights.
/// threads : int, optional
///     By default the cores available to the process. The light does not depend on it.
///
/// Returns
/// -------
/// PrefilteredLight
///     Maps, harmonics and table, as arrays and files.
///
/// Raises
/// ------
/// ValueError
///     If the map is black or has no sun to remove, the size is out of range, or the engine or the layout is unknown.
#[pyfunction]
#[pyo3(signature = (env, size = 256, *, engine = None, sun = "keep", layout = "cube", sh_window = true, threads = None),
    text_signature = "(env, size=256, *, engine=None, sun='keep', layout='cube', sh_window=True, threads=None)")]
pub(crate) fn prefilter(
    env: &Bound<'_, Environment>,
    size: usize,
    engine: Option<&str>,
    sun: &str,
    layout: &str,
    sh_window: bool,
    threads: Option<usize>,
) -> PyResult<PrefilteredLight> {
    let engine: Option<Engine> = engine.map(str::parse).transpose().map_err(|e| from_source(&e))?;
    let sun: SunTreatment = sun.parse().map_err(|e| from_source(&e))?;
    let layout: Layout = layout.parse().map_err(|e| from_source(&e))?;
    let settings = IblSettings {
        layout,
        harmonics_window: sh_window,
        ..IblSettings::for_engine(engine, size)
    };
    let Environment { inner, name } = env.get();
    let (inner, clamped, sun) = parallel_on(env.py(), threads, || {
        let treated = sun.apply(inner).map_err(|e| from_source(&e))?;
        let light = prefiltered(&treated.environment, &settings).map_err(|e| from_source(&e))?;
        let of = |sun| Rig::without_residual(sun, inner.orientation(), name.clone());
        PyResult::Ok((light, treated.clamped, treated.sun.map(of)))
    })??;
    if clamped > 0.0 {
        let text = format!("{name}: clamping takes {:.2} % of the light", 100.0 * clamped);
        warn(env.py(), &[text])?;
    }
    Ok(PrefilteredLight { inner, settings, engine, sun, name: name.clone() })
}
