//! Picture files, and tone mapping.

use std::io::Write;
use std::path::{Path, PathBuf};

use domelight::RgbImage;
use domelight::picture::exposure::Exposure;
use domelight::picture::exr::ExrLayers;
use domelight::picture::exr::bands::{self, BAND_ROWS};
use domelight::picture::png::{self, Depth};
use domelight::picture::tone::{ToneCurve, ToneMapping, srgb_from_linear};
use domelight::picture::{
    self, PictureError, PictureErrorKind, ReadOptions, hdr, pfm, write_atomically,
    write_atomically_seeking,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::arrays::{Floats, from_image, image};
use crate::engine::parallel;
use crate::error::{bad_value, from_source, to_python};

/// The writable formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Exr,
    Hdr,
    Pfm,
    Png,
}

impl Format {
    /// The format of a file name's extension.
    pub(crate) fn of(path: &Path) -> PyResult<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("hdr" | "pic" | "rgbe") => Ok(Self::Hdr),
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png),
            _ => Err(bad_value(format!(
                "{}: its name must end in .exr, .hdr, .pfm or .png",
                path.display()
            ))),
        }
    }
}

/// Converts Python's exposure: a number of stops, or `None` for the automatic exposure.
pub(crate) fn tone(
    image: &RgbImage,
    alpha: Option<&[f32]>,
    exposure: Option<f32>,
    curve: &str,
) -> PyResult<ToneMapping> {
    let curve: ToneCurve = curve.parse().map_err(|e| from_source(&e))?;
    if let Some(stops) = exposure.filter(|stops| !stops.is_finite()) {
        return Err(bad_value(format!("exposure is {stops}; it must be finite")));
    }
    let exposure = exposure.map_or(Exposure::Auto, Exposure::Stops);
    Ok(ToneMapping { exposure: exposure.stops(image, alpha), curve })
}

/// Bits per channel of PNG.
pub(crate) fn depth(bits: i64) -> PyResult<Depth> {
    match bits {
        8 => Ok(Depth::Eight),
        16 => Ok(Depth::Sixteen),
        _ => Err(bad_value(format!("bits is {bits}; it must be 8 or 16"))),
    }
}

/// Writes only color, for PNG also alpha if given.
pub(crate) fn write_image(
    path: &Path,
    format: Format,
    image: &RgbImage,
    alpha: Option<&[f32]>,
    tone: &ToneMapping,
    depth: Depth,
) -> Result<(), PictureError> {
    match format {
        Format::Exr => write_bands(path, image.height, |y| {
            let RgbImage { width, height, ref pixels } = *image;
            let end = height.min(y + BAND_ROWS);
            let rows = RgbImage::new(width, end - y, pixels[y * width..end * width].to_vec());
            ExrLayers::from_image(&rows, None)
        }),
        Format::Hdr => write_atomically(path, |out| hdr::encode(image, out)),
        Format::Pfm => write_atomically(path, |out| pfm::encode(image, out)),
        Format::Png => write_atomically(path, |out| png::encode(image, alpha, tone, depth, out)),
    }
}

/// Writes OpenEXR from bands of rows.
fn write_bands(
    path: &Path,
    height: usize,
    band: impl Fn(usize) -> ExrLayers,
) -> Result<(), PictureError> {
    write_atomically_seeking(path, |out| {
        bands::write(height, out, |y| Ok::<_, PictureErrorKind>(band(y))).map_err(into_io)
    })
}

/// Keeps errors of the system unchanged.
pub(crate) fn into_io(kind: PictureErrorKind) -> std::io::Error {
    match kind {
        PictureErrorKind::Io(error) => error,
        kind => std::io::Error::other(kind),
    }
}

/// Read a picture: OpenEXR, Radiance .hdr, PFM, PNG or JPEG.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     The file.
/// layer : str, optional
///     The OpenEXR layer.
///
/// Returns
/// -------
/// ndarray, shape (H, W, 3)
///     Linear Rec. 709, top row first.
///
/// Raises
/// ------
/// OSError, ValueError
///     If the file cannot be read or is damaged.
#[pyfunction]
#[pyo3(signature = (path, *, layer = None))]
pub(crate) fn read(
    py: Python<'_>,
    path: PathBuf,
    layer: Option<String>,
) -> PyResult<Bound<'_, PyArrayDyn<f32>>> {
    let options = ReadOptions { layer, max_memory: None };
    let picture = parallel(py, || picture::read(&path, &options))?.map_err(to_python)?;
    from_image(py, &picture.image)
}

/// Write a picture as OpenEXR, Radiance .hdr, PFM or PNG, according to the file name's extension.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     The file. Writing is atomic: no incomplete file is left.
/// picture : array_like, shape (H, W, 3)
///     Linear Rec. 709, top row first.
/// exposure : float or None, default None
///     Exposure of PNG [stops]; None maps the median to middle gray, 0 leaves radiance unchanged.
/// curve : {'standard', 'reinhard', 'aces', 'agx', 'neutral'}, default 'agx'
///     The tone curve of PNG.
/// bits : {8, 16}, default 8
///     Bits per channel of PNG.
///
/// Raises
/// ------
/// OSError, ValueError
///     If the file cannot be written, or the shape, the name or a setting is invalid.
#[pyfunction]
#[pyo3(signature = (path, picture, *, exposure = None, curve = "agx", bits = 8))]
pub(crate) fn write(
    path: PathBuf,
    picture: &Bound<'_, PyAny>,
    exposure: Option<f32>,
    curve: &str,
    bits: i64,
) -> PyResult<()> {
    let py = picture.py();
    let format = Format::of(&path)?;
    let depth = depth(bits)?;
    let floats = Floats::new("picture", picture)?;
    let image = image(&floats)?;
    if image.pixels.is_empty() {
        return Err(floats.bad_shape("(height, width, 3) with at least one pixel"));
    }
    let tone = tone(&image, None, exposure, curve)?;
    parallel(py, || write_image(&path, format, &image, None, &tone, depth))?.map_err(to_python)
}

/// Tone-map linear light for display.
///
/// Parameters
/// ----------
/// picture : array_like, shape (H, W, 3)
///     Linear Rec. 709.
/// exposure : float or None, default None
///     In stops; None maps the median to middle gray.
/// curve : {'standard', 'reinhard', 'aces', 'agx', 'neutral'}, default 'agx'
///     The tone curve.
///
/// Returns
/// -------
/// ndarray, shape (H, W, 3)
///     sRGB-encoded, in [0, 1], as expected by `matplotlib.pyplot.imshow`.
#[pyfunction]
#[pyo3(signature = (picture, *, exposure = None, curve = "agx"))]
pub(crate) fn tone_map<'py>(
    picture: &Bound<'py, PyAny>,
    exposure: Option<f32>,
    curve: &str,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = picture.py();
    let mut image = image(&Floats::new("picture", picture)?)?;
    let tone = tone(&image, None, exposure, curve)?;
    parallel(py, || {
        image.pixels.iter_mut().for_each(|p| {
            *p = tone.apply(*p).map(srgb_from_linear);
        });
    })?;
    from_image(py, &image)
}

/// The bytes of a PNG file.
pub(crate) fn to_png(
    image: &RgbImage,
    alpha: Option<&[f32]>,
    tone: &ToneMapping,
    depth: Depth,
) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let out: &mut dyn Write = &mut bytes;
    png::encode(image, alpha, tone, depth, out)?;
    Ok(bytes)
}
