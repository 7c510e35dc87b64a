//! Writes rendered pictures as OpenEXR layers and as PNG.

use std::io::{Seek, Write};
use std::path::Path;

use super::{Film, LAYERS, LayerValues, Layers};
use crate::picture::exposure::Exposure;
use crate::picture::exr::ExrLayers;
use crate::picture::exr::bands::{self, BAND_ROWS};
use crate::picture::png::{self, Depth};
use crate::picture::tone::{ToneCurve, ToneMapping};
use crate::picture::{PictureErrorKind, write_atomically, write_atomically_seeking};
use crate::{Error, RgbImage};

/// A film developed for display.
#[derive(Clone, Debug)]
pub struct Developed {
    color: RgbImage,
    alpha: Option<Vec<f32>>,
    tone: ToneMapping,
}

impl Developed {
    /// The exposure \[stops\] and the tone curve that were used.
    pub fn tone(&self) -> ToneMapping {
        self.tone
    }

    /// Writes an 8-bit PNG file; `-` is standard output.
    ///
    /// # Errors
    /// If the file cannot be written. No incomplete file is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let alpha = self.alpha.as_deref();
        let write =
            |out: &mut dyn Write| png::encode(&self.color, alpha, &self.tone, Depth::Eight, out);
        Ok(write_atomically(path.as_ref(), |out| write(out))?)
    }

    /// Encodes an 8-bit PNG file.
    ///
    /// # Errors
    /// If the picture is empty.
    pub fn to_png(&self) -> Result<Vec<u8>, std::io::Error> {
        let mut bytes = Vec::new();
        png::encode(&self.color, self.alpha.as_deref(), &self.tone, Depth::Eight, &mut bytes)?;
        Ok(bytes)
    }
}

impl Film {
    /// Writes an OpenEXR file with all layers ([`Layers::to_exr`]); `-` is standard output.
    ///
    /// # Errors
    /// If the file cannot be written. No incomplete file is left behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let layers = self.layers();
        Ok(write_atomically_seeking(path.as_ref(), |out| {
            layers.write_exr(&[], out).map_err(std::io::Error::other)
        })?)
    }

    /// Develops the picture for display. Automatic exposure uses the pixels that the scene covers. If the background is
    /// hidden, the picture has alpha.
    pub fn develop(&self, exposure: Exposure, curve: ToneCurve) -> Developed {
        let Layers { color, alpha, n_hits, .. } = self.layers();
        let coverage: Vec<f32> = n_hits.iter().map(|&n| n as f32).collect();
        let alpha = alpha.iter().any(|&a| a < 1.0).then_some(alpha);
        let tone = ToneMapping { exposure: exposure.stops(&color, Some(&coverage)), curve };
        Developed { color, alpha, tone }
    }
}

impl Layers {
    /// All layers that files have, in one part, with the names in [`LAYERS`]: the picture itself as R, G, B, A, and
    /// others such as `depth.Z`. Counts become floats.
    ///
    /// `attributes` are written as strings, for provenance.
    pub fn to_exr(&self, attributes: Vec<(String, String)>) -> ExrLayers {
        let mut exr = ExrLayers { attributes, ..ExrLayers::new(self.width(), self.height()) };
        for layer in LAYERS {
            let Some(name) = layer.file_layer else { continue };
            match (layer.values)(self) {
                LayerValues::Colors(image) => exr.push_rgb(name, image, None),
                LayerValues::Vectors(vectors) => exr.push_xyz(name, vectors),
                LayerValues::Numbers(values) => {
                    exr.push_channel(name, layer.channels[0], values.to_vec());
                }
                LayerValues::Counts(counts) => {
                    let values: Vec<f32> = counts.iter().map(|&n| n as f32).collect();
                    exr.push_channel(name, layer.channels[0], values);
                }
            }
        }
        exr
    }

    /// Writes the bytes of [`Layers::to_exr`] without a copy of all layers.
    ///
    /// # Errors
    /// If writing to `out` fails, or the name of an attribute is not a valid OpenEXR name.
    pub fn write_exr(
        &self,
        attributes: &[(String, String)],
        out: &mut (impl Write + Seek + ?Sized),
    ) -> Result<(), PictureErrorKind> {
        bands::write(self.height(), out, |y| {
            let rows = y..self.height().min(y + BAND_ROWS);
            Ok(self.rows(rows).to_exr(attributes.to_vec()))
        })
    }
}
