//! Films: rendered pictures in layers.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use domelight::RgbImage;
use domelight::math::Vec3;
use domelight::picture::exposure::Exposure;
use domelight::picture::tone::ToneMapping;
use domelight::picture::{PictureError, write_atomically_seeking};
use domelight::render::{
    self, Checkpoint, Counts, LAYERS, LayerInfo, LayerValues, Layers, kept_exposure,
};
use domelight_lab::denoise::{Denoiser, LIBRARY_VARIABLE, write_exr};
use numpy::PyArrayDyn;
use pyo3::exceptions::{PyImportError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyType};

use crate::arrays::{array, from_image, hashable, rows};
use crate::engine::parallel;
use crate::error::{bad_value, from_source, to_python};
use crate::picture::{Format, depth, into_io, to_png, tone, write_image};

/// The values of a layer as a new array.
fn layer<'py>(py: Python<'py>, layers: &Layers, layer: &LayerInfo) -> PyResult<Bound<'py, PyAny>> {
    let size = [layers.height(), layers.width()];
    Ok(match (layer.values)(layers) {
        LayerValues::Colors(image) => from_image(py, image)?.into_any(),
        LayerValues::Vectors(vectors) => {
            rows(py, vectors.iter().map(Vec3::to_array).collect(), &size)?.into_any()
        }
        LayerValues::Numbers(values) => array(py, values.to_vec(), &size)?.into_any(),
        LayerValues::Counts(counts) => array(py, counts.to_vec(), &size)?.into_any(),
        _ => unreachable!("a kind of layer that this package does not know"),
    })
}

/// The exposure [stops] that maps the median of the covered pixels to middle gray.
pub(crate) fn automatic_exposure_of(layers: &Layers) -> f32 {
    let coverage: Vec<f32> = layers.n_hits.iter().map(|&n| n as f32).collect();
    Exposure::Auto.stops(&layers.color, Some(&coverage))
}

/// A rendered picture in layers, returned by `render` and `progressive`.
///
/// `film[name]` is a new array with a layer:
///
/// ============  =========  =========================================================================
/// name          shape      content
/// ============  =========  =========================================================================
/// 'color'       (H, W, 3)  direct light and any visible background [W m^-2 sr^-1], premultiplied by alpha
/// 'alpha'       (H, W)     the fraction of camera samples that hit the scene; 1 where the background is shown
/// 'unoccluded'  (H, W, 3)  like color, but with every shadow ray unoccluded
/// 'shadow'      (H, W, 3)  the fraction of the background that shadows remove on a shadow catcher
/// 'albedo'      (H, W, 3)  reflectance of the visible surfaces
/// 'normal'      (H, W, 3)  mean world-space shading normal, not normalized; 0 without hits
/// 'depth'       (H, W)     mean distance from the camera plane over the samples that hit
/// 'variance'    (H, W, 3)  estimated variance of each pixel's mean
/// 'samples'     (H, W)     number of camera samples (uint32)
/// 'hits'        (H, W)     number of camera samples that hit the scene (uint32)
/// ============  =========  =========================================================================
///
/// Arrays are float32, except for the counts; row 0 is the top. Films can be pickled and compared: they are equal if
/// their underlying sums are bit-identical.
#[pyclass(frozen, module = "domelight")]
pub(crate) struct Film {
    sums: render::Film,
    pub(crate) counts: Counts,
    pub(crate) complete: bool,
    /// The target number of camera samples per pixel.
    n_samples: u32,
    /// The strategy's text, with the pilot's choices.
    strategy: String,
    /// How the picture was made: names and values.
    provenance: Vec<(String, String)>,
    /// Whether the background is hidden.
    hidden: bool,
    layers: OnceLock<Layers>,
}

/// How a film was made.
pub(crate) struct Making {
    pub(crate) n_samples: u32,
    pub(crate) strategy: String,
    pub(crate) provenance: Vec<(String, String)>,
    pub(crate) hidden: bool,
}

impl Film {
    pub(crate) fn new(sums: render::Film, counts: Counts, complete: bool, making: Making) -> Self {
        let Making { n_samples, strategy, provenance, hidden } = making;
        let layers = OnceLock::new();
        Self { sums, counts, complete, n_samples, strategy, provenance, hidden, layers }
    }

    pub(crate) fn layers(&self) -> &Layers {
        self.layers.get_or_init(|| self.sums.layers())
    }

    fn alpha_to_show(&self) -> Option<&[f32]> {
        self.hidden.then(|| &self.layers().alpha[..])
    }

    /// The tone mapping at an exposure, by default the automatic exposure.
    fn tone(&self, exposure: Option<f32>, curve: &str) -> PyResult<ToneMapping> {
        tone(&self.layers().color, None, exposure.or_else(|| Some(self.exposure())), curve)
    }

    /// Denoised color, computed without holding the interpreter.
    fn denoised(&self, py: Python<'_>) -> PyResult<RgbImage> {
        // The package's library, unless the user names another.
        let file: Option<PathBuf> =
            match std::env::var_os(LIBRARY_VARIABLE).filter(|path| !path.is_empty()) {
                Some(_) => None,
                None => py.import("domelight._interop")?.call_method0("oidn_library")?.extract()?,
            };
        let layers = self.layers();
        parallel(py, || {
            let denoiser = file.map_or_else(Denoiser::load, Denoiser::load_file);
            let denoiser = denoiser.map_err(|e| PyImportError::new_err(e.to_string()))?;
            let (color, _) = denoiser.denoise_layers(layers).map_err(|e| from_source(&e))?;
            Ok(color)
        })?
    }

    /// Writes all layers, including a denoised one if given.
    fn write_exr(&self, path: &Path, denoised: Option<&RgbImage>) -> Result<(), PictureError> {
        let mut attributes = self.provenance.clone();
        attributes.push(("domelight.complete".into(), self.complete.to_string()));
        write_atomically_seeking(path, |out| {
            let written = match denoised {
                Some(denoised) => write_exr(self.layers(), denoised, &attributes, out),
                None => self.layers().write_exr(&attributes, out),
            };
            written.map_err(into_io)
        })
    }

    fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            identity: vec![
                ("background".into(), if self.hidden { "hidden" } else { "shown" }.into()),
                ("strategy".into(), self.strategy.clone()),
            ],
            provenance: self.provenance.clone(),
            tiles: 0..1,
            n_tiles: 1,
            n_samples: self.n_samples,
            complete: self.complete,
            counts: self.counts,
            film: self.sums.clone(),
        }
    }
}

#[pymethods]
#[expect(clippy::unused_self, reason = "Python's methods have it")]
impl Film {
    /// ndarray, shape (H, W, 3): direct light and any visible background [W m^-2 sr^-1].
    #[getter]
    fn color<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        from_image(py, &self.layers().color)
    }

    /// ndarray, shape (H, W): coverage in [0, 1].
    #[getter]
    fn alpha<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.__getitem__(py, "alpha")
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(info) = LAYERS.iter().find(|layer| layer.name == name) else {
            let text =
                format!("a film has no layer {name:?}; its layers are {}", Self::keys().join(", "));
            return Err(PyKeyError::new_err(text));
        };
        layer(py, self.layers(), info)
    }

    fn __contains__(&self, name: &str) -> bool {
        LAYERS.iter().any(|layer| layer.name == name)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::keys().into_pyobject(py)?.call_method0("__iter__")
    }

    /// The names of the layers.
    #[staticmethod]
    fn keys() -> Vec<&'static str> {
        LAYERS.iter().map(|layer| layer.name).collect()
    }

    /// (int, int): rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.sums.height, self.sums.width)
    }

    /// bool: whether all samples of all pixels were taken.
    #[getter]
    fn complete(&self) -> bool {
        self.complete
    }

    /// str: the strategy, as accepted by `render`; 'python' for a function.
    #[getter]
    fn strategy(&self) -> &str {
        &self.strategy
    }

    /// float: the automatic exposure [stops], by the light on the scene; 0 leaves
    /// radiance unchanged. The program's renders of the same scene, light and view have the same exposure.
    #[getter]
    fn exposure(&self) -> f32 {
        kept_exposure(&self.provenance).unwrap_or_else(|| automatic_exposure_of(self.layers()))
    }

    /// int: camera rays, including those known to hit nothing.
    #[getter]
    fn camera_rays(&self) -> u64 {
        self.counts.camera_rays
    }

    /// int: camera rays that hit the scene.
    #[getter]
    fn shading_points(&self) -> u64 {
        self.counts.shading_points
    }

    /// int: shadow rays traced.
    #[getter]
    fn shadow_rays(&self) -> u64 {
        self.counts.shadow_rays
    }

    /// int: camera samples whose value was NaN or infinite; they count as black.
    #[getter]
    fn non_finite(&self) -> u64 {
        self.counts.non_finite
    }

    /// Write the film in the format of the file name's extension.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     .exr gets all layers, .hdr and .pfm only color, .png the tone-mapped picture, with alpha if the background
    ///     is hidden. Writing is atomic: no incomplete file is left.
    /// exposure : float or None, default None
    ///     Exposure of PNG [stops]; None is the film's `exposure`, 0 leaves radiance unchanged.
    /// curve : {'standard', 'reinhard', 'aces', 'agx', 'neutral'}, default 'agx'
    ///     The tone curve of PNG.
    /// bits : {8, 16}, default 8
    ///     Bits per channel of PNG.
    /// denoise : bool, default False
    ///     As `--denoise` of the program: .exr gets one more layer, other formats `denoise()` instead of color.
    ///
    /// Raises
    /// ------
    /// OSError, ValueError
    ///     If the file cannot be written, its extension is unknown, or a setting is invalid.
    /// ImportError
    ///     If there is no denoiser.
    #[pyo3(signature = (path, *, exposure = None, curve = "agx", bits = 8, denoise = false))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        exposure: Option<f32>,
        curve: &str,
        bits: i64,
        denoise: bool,
    ) -> PyResult<()> {
        let format = Format::of(&path)?;
        let (tone, depth) = (self.tone(exposure, curve)?, depth(bits)?);
        let denoised = denoise.then(|| self.denoised(py)).transpose()?;
        let color = denoised.as_ref().unwrap_or(&self.layers().color);
        let written = parallel(py, || match format {
            Format::Exr => self.write_exr(&path, denoised.as_ref()),
            Format::Hdr | Format::Pfm | Format::Png => {
                write_image(&path, format, color, self.alpha_to_show(), &tone, depth)
            }
        })?;
        written.map_err(to_python)
    }

    /// Denoise the color with Intel's Open Image Denoise, guided by albedo and normals.
    ///
    /// A denoised picture is for viewing, not for measurement: the filter trades noise for bias. The library is the
    /// file named by the environment variable OIDN_LIBRARY, otherwise that of the package pyoidn, otherwise the
    /// system's.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (H, W, 3)
    ///     Like `color`.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     If there is no such library; `pip install pyoidn` installs it.
    fn denoise<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        from_image(py, &self.denoised(py)?)
    }

    /// Encode the tone-mapped picture as PNG.
    ///
    /// Parameters
    /// ----------
    /// exposure : float or None, default None
    ///     In stops; None is the film's `exposure`, 0 leaves radiance unchanged.
    /// curve : {'standard', 'reinhard', 'aces', 'agx', 'neutral'}, default 'agx'
    ///     The tone curve.
    /// bits : {8, 16}, default 8
    ///     Bits per channel.
    ///
    /// Returns
    /// -------
    /// bytes
    ///     The PNG file, with alpha if the background is hidden.
    #[pyo3(signature = (*, exposure = None, curve = "agx", bits = 8))]
    fn to_png<'py>(
        &self,
        py: Python<'py>,
        exposure: Option<f32>,
        curve: &str,
        bits: i64,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (tone, depth) = (self.tone(exposure, curve)?, depth(bits)?);
        let color = &self.layers().color;
        let bytes = parallel(py, || to_png(color, self.alpha_to_show(), &tone, depth))?;
        Ok(PyBytes::new(py, &bytes.map_err(|e| from_source(&e))?))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.to_png(py, None, "agx", 8)
    }

    /// Convert the film to an `xarray.Dataset` with the dimensions y, x and channel; requires the package xarray.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("domelight._interop")?.call_method1("film_to_xarray", (slf,))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| {
            let other = other.get();
            self.sums == other.sums
                && self.hidden == other.hidden
                && self.complete == other.complete
                && self.n_samples == other.n_samples
        })
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.shape(), self.n_samples).hash(&mut hasher);
        for color in &self.layers().color.pixels {
            color.to_array().map(hashable).hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let (height, width) = self.shape();
        let counts = &self.layers().n_samples;
        let taken: u64 = counts.iter().map(|&n| u64::from(n)).sum();
        let taken = taken as f64 / counts.len().max(1) as f64;
        let state = if self.complete { "" } else { ", not complete" };
        // One decimal, unless there are whole samples.
        let taken = if taken.fract() == 0.0 { format!("{taken}") } else { format!("{taken:.1}") };
        let asked = match self.n_samples.to_string() {
            asked if asked == taken => String::new(),
            asked => format!(" of {asked}"),
        };
        format!("<Film {width} x {height}: {}, {taken}{asked} samples{state}>", self.strategy)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let py = slf.py();
        let this = slf.get();
        let bytes = parallel(py, || this.checkpoint().encode())?.map_err(|e| from_source(&e))?;
        Ok((slf.get_type().getattr("_restore")?, (PyBytes::new(py, &bytes),)))
    }

    #[classmethod]
    fn _restore(cls: &Bound<'_, PyType>, bytes: &[u8]) -> PyResult<Self> {
        let read = parallel(cls.py(), || Checkpoint::decode(bytes))?;
        let state = read.map_err(|error| bad_value(format!("the pickled film: {error}")))?;
        let of = |key: &str| state.identity.iter().find(|(name, _)| name == key);
        let making = Making {
            n_samples: state.n_samples,
            strategy: of("strategy").map_or(String::new(), |(_, value)| value.clone()),
            hidden: of("background").is_some_and(|(_, value)| value == "hidden"),
            provenance: state.provenance,
        };
        Ok(Self::new(state.film, state.counts, state.complete, making))
    }
}
