//! Errors of picture files.

use super::texture::TextureErrorKind;
use crate::memory::OverLimit;
use std::io;

/// An error in reading or writing a picture file.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {kind}")]
pub struct PictureError {
    /// The file name as given by the user.
    pub file: String,
    /// The kind of error.
    #[source]
    pub kind: PictureErrorKind,
}

/// The kinds of errors of picture files. Offsets are in bytes from the start of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureErrorKind {
    /// An I/O error.
    #[error("{0}")]
    Io(io::Error),
    /// The file is empty.
    #[error("the file is empty")]
    NoBytes,
    /// The first bytes belong to no known format.
    #[error(
        "not a picture in a known format (Radiance HDR, OpenEXR, PFM, PNG, JPEG, KTX2, DDS), by its first bytes"
    )]
    UnknownFormat,
    /// A format that the library reads with the feature `io` alone.
    #[error("{0:?} is read with the feature io of the library, which this program does without")]
    LeftOut(super::Format),
    /// An invalid header line.
    #[error("header line {line}: {found:?} is not {expected}")]
    Header {
        /// Counted from 1.
        line: usize,
        /// What stands there.
        found: String,
        /// What should.
        expected: &'static str,
    },
    /// The picture has no texels.
    #[error("the picture is {width}x{height}: it has no texels")]
    Empty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A picture that cannot be read at a fraction of its size.
    #[error(
        "the picture is {width}x{height}: only lat-long maps twice as wide as high, whose size {factor} divides, can be reduced by it"
    )]
    NotReducible {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// The factor.
        factor: usize,
    },
    /// A format that cannot be read in parts.
    #[error("only .hdr and .exr files can be reduced while they are read")]
    OnlyWhole,
    /// More texels than are ever read, or than there is memory for.
    #[error(
        "the picture is {width}x{height}: larger than can be read ({} texels at most, memory permitting)",
        super::MAX_TEXELS
    )]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The header promises more texels than the file can hold.
    #[error(
        "the header promises {width}x{height} texels, which take at least {needed} bytes; the file holds {held}: it is truncated or corrupt"
    )]
    Promises {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Least number of bytes of such a picture.
        needed: u64,
        /// Bytes there.
        held: u64,
    },
    /// The file ends too early.
    #[error("the file ends at byte {offset} in {place}: it is truncated")]
    Truncated {
        /// What was being read, with its number.
        place: String,
        /// Where the file ends.
        offset: usize,
    },
    /// An invalid run in a Radiance file.
    #[error("scanline {scanline}, byte {offset}: {what}")]
    Scanline {
        /// Counted from 0 in the file's order.
        scanline: usize,
        /// Where in the file.
        offset: usize,
        /// What is wrong there.
        what: &'static str,
    },
    /// The OpenEXR decoder refused the file.
    #[error("OpenEXR: {0}")]
    Exr(::exr::error::Error),
    /// The OpenEXR decoder hit an inconsistency that it does not report as an error.
    #[error("OpenEXR: the file is corrupt ({message})")]
    ExrPanic {
        /// Its own words.
        message: String,
    },
    /// The table of an OpenEXR file names one block twice, so that another is missing.
    #[error("OpenEXR: blocks of the picture are missing: the file is corrupt")]
    MissingBlocks,
    /// The values of a PNG are encoded for HDR displays.
    #[error("PNG: values encoded by {0} are not supported; convert the picture to OpenEXR")]
    PngTransfer(&'static str),
    /// An OpenEXR feature that is not supported.
    #[error("OpenEXR: {0} are not supported")]
    ExrUnsupported(&'static str),
    /// The requested layer does not exist.
    #[error("there is no layer {asked:?} with color channels; the file has {}", list(.present))]
    NoSuchLayer {
        /// Its name.
        asked: String,
        /// The layers there are.
        present: Vec<String>,
    },
    /// No layer has R, G and B, or Y.
    #[error("there are no color channels (R, G, B or Y); the file has {}", list(.present))]
    NoColor {
        /// The channels there are.
        present: Vec<String>,
    },
    /// The picture needs more memory than [`super::ReadOptions::max_memory`] allows.
    #[error("{0}")]
    Memory(#[from] OverLimit),
    /// A texture that is no cube of radiance, or damaged.
    #[error("{0}")]
    Texture(#[from] TextureErrorKind),
    /// A decoder of the `image` crate refused the file.
    #[cfg(feature = "io")]
    #[error("{0}")]
    Image(image::ImageError),
    /// The layers cannot be written as one OpenEXR part.
    #[error("channel {channel:?} cannot be written: {why}")]
    Channel {
        /// Its full name.
        channel: String,
        /// The reason.
        why: &'static str,
    },
}

impl PictureErrorKind {
    /// Adds the name of the file.
    pub fn in_file(self, file: &str) -> PictureError {
        PictureError { file: file.to_owned(), kind: self }
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
