//! Output: pictures by file extension, reports to standard output.

use crate::error::UsageError;
use crate::files;
use crate::interrupt;
use domelight::RgbImage;
use domelight::environment::mapping::Mapping;
use domelight::picture::exr::ExrLayers;
use domelight::picture::exr::bands::{self, BAND_ROWS};
use domelight::picture::png::Depth;
use domelight::picture::tone::ToneMapping;
use domelight::picture::{PictureErrorKind, hdr, pfm, png};
use domelight::quote::{Code, Shell, terminal};
use domelight::render::Layers;
use domelight_lab::denoise::write_exr;
use serde::Serialize;
use std::fmt;
use std::io::{self, Cursor, IsTerminal as _, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// A picture file to write; `-` is standard output.
#[derive(Clone, Debug)]
pub(crate) struct PicturePath {
    pub(crate) path: PathBuf,
    /// `None` for `-`: the command's default.
    format: Option<PictureFormat>,
}

/// The formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Exr,
    Hdr,
    Pfm,
    Png,
}

impl PicturePath {
    /// A PNG file.
    pub(crate) fn is_png(&self) -> bool {
        self.format == Some(PictureFormat::Png)
    }
}

impl FromStr for PicturePath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let format = match extension.as_deref() {
            _ if text == "-" => None,
            Some("exr") => Some(PictureFormat::Exr),
            Some("hdr" | "pic" | "rgbe") => Some(PictureFormat::Hdr),
            Some("pfm") => Some(PictureFormat::Pfm),
            Some("png") => Some(PictureFormat::Png),
            _ => return Err("its name must end in .exr, .hdr, .pfm or .png, or be -".into()),
        };
        Ok(Self { path, format })
    }
}

impl PicturePath {
    pub(crate) fn is_standard_output(&self) -> bool {
        self.path == Path::new("-")
    }

    /// The format of the extension; `None` for standard output.
    pub(crate) fn format(&self) -> Option<PictureFormat> {
        self.format
    }

    /// The picture of a frame: its number, of four digits or more, before the extension.
    pub(crate) fn numbered(&self, frame: u32) -> Self {
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        let path = self.path.with_extension(format!("{frame:04}.{extension}"));
        Self { path, format: self.format }
    }

    /// Declares it as a result before the work.
    pub(crate) fn declare(&self) -> anyhow::Result<()> {
        files::writes(&self.path)
    }

    /// Writes the picture. Only PNG uses the tone curve.
    pub(crate) fn write(
        &self,
        image: &RgbImage,
        tone: ToneMapping,
        for_standard_output: PictureFormat,
        mapping: Option<Mapping>,
    ) -> anyhow::Result<()> {
        let format = self.format.unwrap_or(for_standard_output);
        self.write_as(format, image, None, &tone, mapping)
    }

    fn write_exr(&self, image: &RgbImage, mapping: Option<Mapping>) -> anyhow::Result<()> {
        let envmap = mapping.and_then(Mapping::envmap);
        let height = image.height;
        self.write_bands(height, |y| {
            let rows = band(image, y..height.min(y + BAND_ROWS));
            Ok(ExrLayers { envmap, ..ExrLayers::from_image(&rows, None) })
        })
    }

    fn write_as(
        &self,
        format: PictureFormat,
        image: &RgbImage,
        alpha: Option<&[f32]>,
        tone: &ToneMapping,
        mapping: Option<Mapping>,
    ) -> anyhow::Result<()> {
        let path = &self.path;
        match format {
            PictureFormat::Exr => self.write_exr(image, mapping),
            PictureFormat::Hdr => files::write(path, |out| hdr::encode(image, out)),
            PictureFormat::Pfm => files::write(path, |out| pfm::encode(image, out)),
            PictureFormat::Png => {
                files::write(path, |out| png::encode(image, alpha, tone, Depth::Eight, out))
            }
        }
    }

    /// Writes a rendering: OpenEXR, also to standard output, gets all its layers and `attributes`.
    /// PNG gets alpha if the background is `hidden`. What a denoiser made of it is a layer of OpenEXR, and takes the place
    /// of color in other formats.
    pub(crate) fn write_layers(
        &self,
        layers: &Layers,
        denoised: Option<&RgbImage>,
        tone: &ToneMapping,
        hidden: bool,
        attributes: &[(String, String)],
    ) -> anyhow::Result<()> {
        if !self.has_all_layers() {
            let color = denoised.unwrap_or(&layers.color);
            return self.write_color(color, hidden.then_some(&layers.alpha[..]), tone);
        }
        files::write_seeking(&self.path, |out| {
            let written = match denoised {
                Some(denoised) => write_exr(layers, denoised, attributes, out),
                None => layers.write_exr(attributes, out),
            };
            written.map_err(into_io)
        })
    }

    /// Writes OpenEXR from bands of rows, as [`bands::write`] does; no file is there if one fails.
    pub(crate) fn write_bands(
        &self,
        height: usize,
        band: impl FnMut(usize) -> anyhow::Result<ExrLayers>,
    ) -> anyhow::Result<()> {
        let mut failed = None;
        let written = files::write_seeking(&self.path, |out| {
            bands::write(height, out, band).map_err(|error| match error.downcast() {
                Ok(kind) => into_io(kind),
                Err(error) => {
                    failed = Some(error);
                    io::Error::other("a band is missing")
                }
            })
        });
        failed.map_or(Ok(()), Err)?;
        written
    }

    /// A rendering goes there with all its layers, into OpenEXR.
    pub(crate) fn has_all_layers(&self) -> bool {
        self.format.unwrap_or(PictureFormat::Exr) == PictureFormat::Exr
    }

    /// Writes only color, and alpha to PNG if there is any.
    pub(crate) fn write_color(
        &self,
        color: &RgbImage,
        alpha: Option<&[f32]>,
        tone: &ToneMapping,
    ) -> anyhow::Result<()> {
        let format = self.format.unwrap_or(PictureFormat::Exr);
        self.write_as(format, color, alpha, tone, None)
    }
}

impl fmt::Display for PicturePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_standard_output() {
            return f.write_str("standard output");
        }
        self.path.display().fmt(f)
    }
}

/// About how long it takes to write a rendering: by a band of it, which is encoded and not written.
pub(crate) fn time_to_write(
    outputs: &[PicturePath],
    layers: &Layers,
    tone: &ToneMapping,
    hidden: bool,
    attributes: &[(String, String)],
) -> anyhow::Result<Duration> {
    let n_rows = layers.height().min(BAND_ROWS);
    let first = (layers.height() - n_rows) / 2;
    let band = layers.rows(first..first + n_rows);
    let start = Instant::now();
    for output in outputs {
        let alpha = hidden.then_some(&band.alpha[..]);
        let mut bytes = Vec::new();
        match output.format.unwrap_or(PictureFormat::Exr) {
            PictureFormat::Exr => band.write_exr(attributes, &mut Cursor::new(bytes))?,
            PictureFormat::Hdr => hdr::encode(&band.color, &mut bytes)?,
            PictureFormat::Pfm => pfm::encode(&band.color, &mut bytes)?,
            PictureFormat::Png => {
                png::encode(&band.color, alpha, tone, Depth::Eight, &mut bytes)?;
            }
        }
    }
    Ok(start.elapsed().mul_f64(layers.height() as f64 / n_rows as f64))
}

/// Some rows of a picture.
fn band(image: &RgbImage, rows: Range<usize>) -> RgbImage {
    let (width, height) = (image.width, rows.len());
    RgbImage::new(width, height, image.pixels[rows.start * width..rows.end * width].to_vec())
}

/// Keep I/O errors as they are.
pub(crate) fn into_io(kind: PictureErrorKind) -> io::Error {
    match kind {
        PictureErrorKind::Io(error) => error,
        kind => io::Error::other(kind),
    }
}

/// Rejects two results on standard output.
pub(crate) fn require_one_on_standard_output(
    pictures: &[Option<&PicturePath>],
    json: bool,
) -> Result<(), UsageError> {
    let n = pictures.iter().flatten().filter(|p| p.is_standard_output()).count();
    if n + usize::from(json) > 1 {
        return Err(UsageError(
            "only one result can go to standard output; give a file name".into(),
        ));
    }
    Ok(())
}

/// The reader of a report is gone. (For a picture, that is an error.)
#[derive(Debug, thiserror::Error)]
#[error("nobody reads the report")]
pub(crate) struct NobodyReads;

/// Prints a report with terminal control characters escaped.
///
/// # Errors
/// [`NobodyReads`] if the reader is gone, or an I/O error.
pub(crate) fn print(report: &str) -> anyhow::Result<()> {
    let _waiting = interrupt::while_waiting();
    print_raw(&terminal::lines(report))
}

/// Prints a line while the work goes on, which an interruption must not end without saving.
pub(crate) fn print_progress(line: &str) {
    let _ = print_raw(&terminal::line(line));
}

/// Prints a report as JSON with terminal control characters escaped.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_json(report: &impl Serialize) -> anyhow::Result<()> {
    let _waiting = interrupt::while_waiting();
    print_raw(&terminal::json(&serde_json::to_string_pretty(report)?))
}

/// Prints what a shell may be given.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_code(command: &Code<Shell>) -> anyhow::Result<()> {
    // What is invisible in it was quoted for the shell, which would not find the file under another name.
    if io::stdout().is_terminal() { print(command.as_str()) } else { print_raw(command.as_str()) }
}

fn print_raw(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    let printed = writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush());
    printed.map_err(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => NobodyReads.into(),
        _ => anyhow::Error::new(error).context("standard output"),
    })
}
