//! Where pictures go: the format by the name's extension, every file whole or not there.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Result;
use domelight::RgbImage;
use domelight::picture::png::Depth;
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::picture::{Problem, hdr, pfm, png, write_atomically};
use domelight::render::Layers;

use crate::usage_error;

/// A file format that pictures are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Exr,
    Hdr,
    Pfm,
    Png,
}

/// A file to write, or standard output.
#[derive(Clone, Debug)]
pub(crate) struct Destination {
    path: PathBuf,
    format: Format,
}

impl Destination {
    /// The format follows from the extension; standard output gets OpenEXR.
    ///
    /// # Errors
    /// An extension that no format has.
    pub(crate) fn new(path: &Path) -> Result<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        let format = match extension.as_deref() {
            Some("exr") => Format::Exr,
            Some("hdr" | "pic" | "rgbe") => Format::Hdr,
            Some("pfm") => Format::Pfm,
            Some("png") => Format::Png,
            None if path == Path::new("-") => Format::Exr,
            _ => {
                return usage_error(format!(
                    "{}: cannot tell the format; end the name in .exr, .hdr, .pfm or .png",
                    path.display()
                ));
            }
        };
        Ok(Self { path: path.to_owned(), format })
    }

    /// Writes a picture without layers; `alpha` goes where the format has it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(crate) fn write_image(
        &self,
        image: &RgbImage,
        alpha: Option<&[f32]>,
        tone: &ToneMapping,
    ) -> Result<()> {
        let exr = || domelight::picture::exr::ExrLayers::from_image(image, alpha).encode();
        self.write(image, alpha, tone, exr)
    }

    fn write(
        &self,
        image: &RgbImage,
        alpha: Option<&[f32]>,
        tone: &ToneMapping,
        exr: impl FnOnce() -> Result<Vec<u8>, Problem>,
    ) -> Result<()> {
        let bytes = match self.format {
            Format::Exr => exr().map_err(|problem| problem.in_file(&self.to_string()))?,
            Format::Hdr => hdr::encode(image),
            Format::Pfm => pfm::encode(image),
            Format::Png => {
                let mut bytes = Vec::new();
                png::encode(image, alpha, tone, Depth::Eight, &mut bytes)?;
                bytes
            }
        };
        Ok(write_atomically(&self.path, |out| out.write_all(&bytes))?)
    }
}

impl fmt::Display for Destination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path.display().fmt(f)
    }
}

/// How PNG pictures are tone-mapped.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PngSettings {
    pub(crate) exposure: f32,
    pub(crate) tone: ToneCurve,
}

/// Writes a rendering to every destination.
///
/// # Errors
/// The first file that cannot be written.
pub(crate) fn write_all(
    destinations: &[Destination],
    layers: &Layers,
    png: &PngSettings,
    opaque: bool,
    attributes: &[(String, String)],
) -> Result<()> {
    let tone = ToneMapping { exposure: png.exposure, curve: png.tone };
    let alpha = (!opaque).then_some(&layers.alpha[..]);
    for destination in destinations {
        let exr = || layers.to_exr(attributes.to_vec()).encode();
        destination.write(&layers.color, alpha, &tone, exr)?;
    }
    Ok(())
}
