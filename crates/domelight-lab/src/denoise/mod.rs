//! Denoising with Intel's Open Image Denoise, if its library is installed.
//!
//! A denoised picture is biased: the filter may mistake texture for noise, and invented detail may be wrong. The
//! picture itself does not reveal by how much, so denoised pictures are for viewing, not for measurement.

mod oidn;

use std::env;
use std::ffi::{CStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};

use domelight::picture::exr::bands::{self, BAND_ROWS};
use domelight::picture::{PictureErrorKind, WriteSeek};
use domelight::render::Layers;
use domelight::{Rgb, RgbImage};

use crate::Error;
use oidn::Device;

/// The environment variable that names the library's file; without it, the system's loader searches for it.
pub const LIBRARY_VARIABLE: &str = "OIDN_LIBRARY";

const HOW_TO_GET: &str = "install Open Image Denoise 2 (openimagedenoise.org, or a package of your system), or: pip \
     download --no-deps pyoidn && unzip pyoidn-*.whl 'pyoidn/oidn/*', then set OIDN_LIBRARY to \
     pyoidn/oidn/lib/libOpenImageDenoise.so.2";

/// What the library is called, best first.
const NAMES: &[&str] = if cfg!(target_os = "windows") {
    &["OpenImageDenoise.dll"]
} else if cfg!(target_os = "macos") {
    &["libOpenImageDenoise.2.dylib", "libOpenImageDenoise.dylib"]
} else {
    &["libOpenImageDenoise.so.2", "libOpenImageDenoise.so"]
};

/// Open Image Denoise 2, loaded.
pub struct Denoiser {
    device: Device,
}

/// The features of a picture's surfaces. All images have the size of the picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Features<'a> {
    /// Reflectance in \[0, 1\], premultiplied by coverage.
    pub albedo: Option<&'a RgbImage>,
    /// World normals as red, green and blue in \[−1, 1\], premultiplied by coverage.
    pub normal: Option<&'a RgbImage>,
}

impl Features<'_> {
    /// The features in words.
    pub fn description(&self) -> &'static str {
        match (self.albedo, self.normal) {
            (Some(_), Some(_)) => "from color, albedo and normals",
            (Some(_), None) => "from color and albedo",
            _ => "from color alone",
        }
    }
}

impl Denoiser {
    /// Loads the library that the environment variable [`LIBRARY_VARIABLE`] names, else the system's.
    ///
    /// # Errors
    /// If there is none of version 2 or later.
    pub fn load() -> Result<Self, Error> {
        match env::var_os(LIBRARY_VARIABLE).filter(|path| !path.is_empty()) {
            Some(path) => Self::load_first(&[path]),
            None => Self::load_first(&NAMES.iter().map(OsString::from).collect::<Vec<_>>()),
        }
    }

    /// Loads the library in a file.
    ///
    /// # Errors
    /// If it is not Open Image Denoise of version 2 or later.
    pub fn load_file(path: impl Into<PathBuf>) -> Result<Self, Error> {
        Self::load_first(&[path.into().into_os_string()])
    }

    fn load_first(names: &[OsString]) -> Result<Self, Error> {
        let mut reasons = Vec::new();
        for name in names {
            // A pipe might never end.
            let is_path = Path::new(name).components().count() > 1;
            if is_path && fs::metadata(name).is_ok_and(|there| !there.is_file()) {
                reasons.push(format!("{}: not a regular file", name.to_string_lossy()));
                continue;
            }
            match Device::load(name, rayon::current_num_threads()) {
                Ok(device) => return Ok(Self { device }),
                Err(why) => reasons.push(format!("{}: {why}", name.to_string_lossy())),
            }
        }
        let reasons = reasons.join("; ");
        Err(Error::Usage(format!("no denoiser ({reasons}); to get one: {HOW_TO_GET}")))
    }

    /// Name and version of the library.
    pub fn name(&self) -> String {
        let [major, minor, patch] = self.device.version();
        format!("Open Image Denoise {major}.{minor}.{patch}")
    }

    /// Denoises HDR radiance, which may be premultiplied by coverage. The library cannot use normals without albedo.
    /// Pixels without a normal show no surface and are unchanged.
    ///
    /// # Errors
    /// If sizes differ, or the library fails.
    pub fn denoise(&self, color: &RgbImage, features: Features) -> Result<RgbImage, Error> {
        let mut images: Vec<(&CStr, &RgbImage)> = Vec::new();
        if let Some(albedo) = features.albedo {
            images.push((c"albedo", albedo));
            images.extend(features.normal.map(|normal| (c"normal", normal)));
        }
        let filtered = self.device.filter(color, &images);
        let mut filtered = filtered.map_err(|why| Error::Failed(format!("denoising: {why}")))?;
        if let Some(normal) = features.normal {
            let pixels = filtered.pixels.iter_mut().zip(&color.pixels).zip(&normal.pixels);
            for ((filtered, color), _) in pixels.filter(|(_, normal)| normal.is_black()) {
                *filtered = *color;
            }
        }
        Ok(filtered)
    }

    /// Denoises a render's color with its albedo and normals. Also returns a description.
    ///
    /// # Errors
    /// If the library fails.
    pub fn denoise_layers(&self, layers: &Layers) -> Result<(RgbImage, String), Error> {
        let normals = layers.normal.iter().map(|n| Rgb::from(n.to_array())).collect();
        let normal = &RgbImage::new(layers.width(), layers.height(), normals);
        let features = Features { albedo: Some(&layers.albedo), normal: Some(normal) };
        let by = format!("{} {}", self.name(), features.description());
        Ok((self.denoise(&layers.color, features)?, by))
    }
}

/// Writes a render's OpenEXR file with the denoised color as an additional layer, `denoised`.
///
/// # Errors
/// If `out` does not take it, or a name of an attribute cannot be one of OpenEXR.
pub fn write_exr(
    layers: &Layers,
    denoised: &RgbImage,
    attributes: &[(String, String)],
    out: &mut dyn WriteSeek,
) -> Result<(), PictureErrorKind> {
    let width = layers.width();
    bands::write(layers.height(), out, |y| {
        let rows = y..layers.height().min(y + BAND_ROWS);
        let pixels = denoised.pixels[rows.start * width..rows.end * width].to_vec();
        let denoised = RgbImage::new(width, rows.len(), pixels);
        let mut exr = layers.rows(rows).to_exr(attributes.to_vec());
        exr.push_rgb("denoised", &denoised, None);
        Ok(exr)
    })
}
