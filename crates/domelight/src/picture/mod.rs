//! Picture files: Radiance `.hdr`, OpenEXR, `.pfm`, PNG, JPEG and cubes in KTX2 and DDS (read only); exposure and tone curves.
//!
//! The format is recognized by the first bytes, never by the name. Decoded pictures are linear Rec. 709, top row first.
//! A header that promises more texels than the file can hold is rejected before memory is allocated. Truncated and
//! corrupt files give a [`PictureError`] that names the file, the place and the value.
//!
//! Writers produce bytes ([`hdr::encode`], [`exr::ExrLayers::encode`], [`pfm::encode`], [`png::encode`]);
//! [`write_atomically`] writes them to a file that is always either the old or the complete new one.

mod agx;
pub mod compare;
#[cfg(feature = "io")]
mod display;
mod error;
pub mod exposure;
pub mod exr;
pub mod flip;
pub mod hdr;
pub mod pfm;
#[cfg(feature = "io")]
pub mod png;
mod primaries;
mod reduced;
mod reduction;
pub mod texture;
pub mod tone;

#[cfg(feature = "io")]
pub use crate::files::{WriteSeek, require_writable, write_atomically, write_atomically_seeking};
pub use error::{PictureError, PictureErrorKind};
pub use reduced::{read_reduced, reduced_size};

use crate::environment::mapping::{EnvmapKind, Fisheye};
use crate::memory;
use crate::{Rgb, RgbImage};
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use texture::Container;

/// The maximum number of texels of a picture that is read (2²⁹: 32768 × 16384).
pub const MAX_TEXELS: usize = 1 << 29;

/// The file formats that [`read`] supports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Radiance RGBE or XYZE.
    Hdr,
    /// OpenEXR.
    Exr,
    /// Portable float map.
    Pfm,
    /// PNG, interpreted as sRGB.
    Png,
    /// JPEG, interpreted as sRGB.
    Jpeg,
    /// A cube in a KTX 2.0 file.
    Ktx2,
    /// A cube in a DDS file.
    Dds,
}

/// The position of OpenEXR's data window, which is the picture, in the display window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataWindow {
    /// The position of its top left texel relative to that of the display window, right and down \[texels\].
    pub position: (i64, i64),
    /// The width and height of the display window \[texels\].
    pub display: (usize, usize),
}

/// A picture read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Linear Rec. 709, premultiplied by alpha if there is any.
    pub image: RgbImage,
    /// The coverage in \[0, 1\], one value per texel, if the file has it.
    pub alpha: Option<Vec<f32>>,
    /// The value of OpenEXR's `envmap` attribute.
    pub envmap: Option<EnvmapKind>,
    /// The view of a Radiance picture, if it is a fisheye.
    pub fisheye: Option<Fisheye>,
    /// The position of the picture in OpenEXR's display window, if the two differ.
    pub window: Option<DataWindow>,
    /// Set if OpenEXR's layers do not show which of them is the picture, and none was requested.
    pub guessed_layer: Option<GuessedLayer>,
    /// The format of the file.
    pub format: Format,
    /// OpenEXR's text attributes, by name.
    pub attributes: Vec<(String, String)>,
    /// Whether a JPEG has a gain map (Ultra HDR, ISO 21496-1), which is not read.
    pub has_gain_map: bool,
    /// What the header asked for and was applied, one phrase each.
    pub notes: Vec<String>,
    /// What the header asked for and was ignored, one sentence each.
    pub warnings: Vec<String>,
}

/// An OpenEXR layer that was read because it is the first of several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuessedLayer {
    /// Its name.
    pub name: String,
    /// The names of the other layers with colors.
    pub others: Vec<String>,
}

/// States what was read.
impl fmt::Display for GuessedLayer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, others } = self;
        write!(f, "the layer '{name}' is read; the file also has {}", others.join(", "))
    }
}

impl Picture {
    fn opaque(image: RgbImage, format: Format) -> Self {
        let (attributes, notes, warnings) = Default::default();
        let (alpha, envmap, fisheye, window, guessed_layer) = (None, None, None, None, None);
        let has_gain_map = false;
        Self {
            image,
            alpha,
            envmap,
            fisheye,
            window,
            guessed_layer,
            format,
            attributes,
            has_gain_map,
            notes,
            warnings,
        }
    }

    /// The picture in OpenEXR's display window: black and transparent outside its data window, and cropped to it.
    ///
    /// # Errors
    /// If the display window is too large.
    pub fn in_display_window(&self) -> Result<Self, PictureErrorKind> {
        let Some(window) = self.window else { return Ok(self.clone()) };
        let (width, height) = window.display;
        checked_area(width, height)?;
        let size = self.image.width;
        let mut image = RgbImage::new(width, height, allocate(Rgb::BLACK, width, height)?);
        place(&self.image.pixels, size, &mut image.pixels, window);
        let alpha = match &self.alpha {
            Some(alpha) => {
                let mut framed = allocate(0.0, width, height)?;
                place(alpha, size, &mut framed, window);
                Some(framed)
            }
            None => None,
        };
        let Self { guessed_layer, attributes, notes, warnings, .. } = self;
        Ok(Self {
            image,
            alpha,
            window: None,
            guessed_layer: guessed_layer.clone(),
            attributes: attributes.clone(),
            notes: notes.clone(),
            warnings: warnings.clone(),
            ..*self
        })
    }
}

/// Copies the texels of a data window of `width` columns that lie in the display window.
fn place<T: Copy>(texels: &[T], width: usize, framed: &mut [T], window: DataWindow) {
    let (columns, rows) = window.display;
    let at = |i: usize, origin: i64, size: usize| {
        usize::try_from(i as i64 + origin).ok().filter(|&i| i < size)
    };
    for (y, row) in texels.chunks_exact(width).enumerate() {
        let Some(to) = at(y, window.position.1, rows) else { continue };
        for (x, &texel) in row.iter().enumerate() {
            if let Some(x) = at(x, window.position.0, columns) {
                framed[to * columns + x] = texel;
            }
        }
    }
}

/// Options for reading a picture file.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// The OpenEXR layer; by default the unnamed R, G, B channels, or else the layer named after the whole picture, or
    /// else the first that has them.
    pub layer: Option<String>,
    /// The maximum memory \[bytes\] for the file and the picture; unlimited by default.
    pub max_memory: Option<u64>,
}

/// Reads the picture in a file, or on standard input if `path` is `-`.
///
/// # Errors
/// If the file cannot be read or is not a complete, valid picture in one of the known formats.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Picture, PictureError> {
    let bytes = read_file(path, options.max_memory)?;
    read_bytes(&bytes, &display_name(path), options)
}

/// Reads the bytes of a file, or of standard input if `path` is `-`, up to `max_memory`.
///
/// # Errors
/// If the file cannot be read or is larger.
pub fn read_file(path: &Path, max_memory: Option<u64>) -> Result<Vec<u8>, PictureError> {
    read_all(path, max_memory).map_err(|kind| kind.in_file(&display_name(path)))
}

/// Decodes the picture in `bytes`; `name` is for messages.
///
/// # Errors
/// If the bytes are not a complete, valid picture in one of the known formats.
pub fn read_bytes(
    bytes: &[u8],
    name: &str,
    options: &ReadOptions,
) -> Result<Picture, PictureError> {
    let allowed = || match options.max_memory {
        Some(_) => Ok(memory::require(memory_to_read(bytes)?, options.max_memory)?),
        None => Ok(()),
    };
    allowed().map_err(|kind: PictureErrorKind| kind.in_file(name))?;
    let decoded = match format_of(bytes) {
        Some(Format::Hdr) => hdr::decode(bytes),
        Some(Format::Exr) => exr::decode(bytes, options.layer.as_deref()),
        Some(Format::Pfm) => pfm::decode(bytes).map(|image| Picture::opaque(image, Format::Pfm)),
        Some(Format::Ktx2) => texture::decode(bytes, Container::Ktx2),
        Some(Format::Dds) => texture::decode(bytes, Container::Dds),
        #[cfg(feature = "io")]
        Some(format @ (Format::Png | Format::Jpeg)) => {
            png::decode_within(bytes, format, options.max_memory)
        }
        #[cfg(not(feature = "io"))]
        Some(format @ (Format::Png | Format::Jpeg)) => Err(PictureErrorKind::LeftOut(format)),
        None if bytes.is_empty() => Err(PictureErrorKind::NoBytes),
        None => Err(PictureErrorKind::UnknownFormat),
    };
    decoded.map_err(|kind| kind.in_file(name))
}

/// An estimate of the memory that the file and its picture need during reading \[bytes\], from the header alone.
///
/// # Errors
/// If the header is damaged.
pub fn memory_to_read(bytes: &[u8]) -> Result<u64, PictureErrorKind> {
    // Bytes for a texel: what the decoder makes, and the picture made of it.
    let (texels, per_texel) = match format_of(bytes) {
        Some(Format::Hdr) => (hdr::texels(bytes)?, 24),
        Some(Format::Exr) => (exr::texels(bytes)?, 24),
        Some(Format::Pfm) => (pfm::texels(bytes)?, 12),
        Some(Format::Ktx2) => (texture::texels(bytes, Container::Ktx2)?, 12),
        Some(Format::Dds) => (texture::texels(bytes, Container::Dds)?, 12),
        #[cfg(feature = "io")]
        Some(format @ (Format::Png | Format::Jpeg)) => (png::texels(bytes, format)?, 40),
        #[cfg(not(feature = "io"))]
        Some(Format::Png | Format::Jpeg) => (0, 0),
        None => (0, 0),
    };
    Ok(bytes.len() as u64 + texels as u64 * per_texel)
}

/// The format according to the first bytes.
pub fn format_of(bytes: &[u8]) -> Option<Format> {
    match bytes {
        [b'#', b'?', ..] => Some(Format::Hdr),
        [0x76, 0x2f, 0x31, 0x01, ..] => Some(Format::Exr),
        [b'P', b'F' | b'f', b' ' | b'\t' | b'\r' | b'\n', ..] => Some(Format::Pfm),
        [0x89, b'P', b'N', b'G', ..] => Some(Format::Png),
        [0xff, 0xd8, 0xff, ..] => Some(Format::Jpeg),
        [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, ..] => Some(Format::Ktx2),
        [b'D', b'D', b'S', b' ', ..] => Some(Format::Dds),
        _ => None,
    }
}

fn display_name(path: &Path) -> String {
    if path == Path::new("-") { "standard input".into() } else { path.display().to_string() }
}

/// All bytes; of a pipe or device, which might never end, no more than are allowed.
fn read_all(path: &Path, max_memory: Option<u64>) -> Result<Vec<u8>, PictureErrorKind> {
    if path == Path::new("-") {
        return read_to_end(io::stdin().lock(), max_memory);
    }
    let file = File::open(path).map_err(PictureErrorKind::Io)?;
    let length = file.metadata().map_err(PictureErrorKind::Io)?.len();
    memory::require(length, max_memory)?;
    read_to_end(file, max_memory)
}

fn read_to_end(from: impl Read, max_memory: Option<u64>) -> Result<Vec<u8>, PictureErrorKind> {
    let limit = max_memory.unwrap_or(u64::MAX);
    let mut bytes = Vec::new();
    from.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(PictureErrorKind::Io)?;
    memory::require(bytes.len() as u64, max_memory)?;
    Ok(bytes)
}

/// The number of texels of a size that is neither empty nor beyond [`MAX_TEXELS`].
pub(crate) fn checked_area(width: usize, height: usize) -> Result<usize, PictureErrorKind> {
    match width.checked_mul(height) {
        Some(0) => Err(PictureErrorKind::Empty { width, height }),
        Some(area) if area <= MAX_TEXELS => Ok(area),
        _ => Err(PictureErrorKind::TooLarge { width, height }),
    }
}

/// `n` copies of `value`, or an error where the memory is not there.
pub(crate) fn allocate<T: Clone>(
    value: T,
    width: usize,
    height: usize,
) -> Result<Vec<T>, PictureErrorKind> {
    let n = width * height;
    let mut values = Vec::new();
    values.try_reserve_exact(n).map_err(|_| PictureErrorKind::TooLarge { width, height })?;
    values.resize(n, value);
    Ok(values)
}
