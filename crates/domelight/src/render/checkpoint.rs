//! Checkpoints and parts: a render's sums in an OpenEXR file that other programs can open.
//!
//! R, G, B, A hold the picture so far. The layers below `state` hold the exact bits of the sums, from which all
//! other layers are computed. The attributes identify the render. A fingerprint over both reveals a damaged
//! file.

use std::ops::Range;

use super::sums::PixelSums;
use super::{Counts, Film, Window};
use crate::fingerprint::Fingerprinter;
use crate::picture::PictureErrorKind;
use crate::picture::exr::{Compression, ExrLayers, Plane};

/// The state of a render, or of a shard of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Everything that decides the picture except the number of samples: names and values, sorted by name. Only a
    /// render with an equal identity may continue from this checkpoint.
    pub identity: Vec<(String, String)>,
    /// Provenance of the finished picture: further attributes, sorted by name.
    pub provenance: Vec<(String, String)>,
    /// The tiles.
    pub tiles: Range<usize>,
    /// The number of tiles of the whole picture.
    pub n_tiles: usize,
    /// The target number of camera samples per pixel.
    pub n_samples: u32,
    /// Whether all tiles are finished.
    pub complete: bool,
    /// Counts of the work done so far.
    pub counts: Counts,
    /// The sums.
    pub film: Film,
}

/// An error in reading a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file is not a complete OpenEXR file.
    #[error(transparent)]
    Picture(#[from] PictureErrorKind),
    /// The file is some other picture.
    #[error("it is not a checkpoint or part of a render by domelight")]
    Foreign,
    /// Another version of the program wrote it.
    #[error("it is a checkpoint of format {found}; this program reads format {FORMAT}")]
    Format {
        /// The format of the file.
        found: String,
    },
    /// The content was altered after it was written.
    #[error("it is damaged: {0}")]
    Damaged(&'static str),
}

/// The version of the format, which changes with the layout and with the names of the identity.
const FORMAT: &str = "3";

/// The prefix of identity attributes.
const IDENTITY: &str = "domelight.render.";

/// The prefix of bit planes.
const STATE: &str = "state.";

impl Checkpoint {
    /// Encodes the checkpoint as a file. Equal states give equal bytes.
    ///
    /// # Errors
    /// If the picture is too large, or a name of the provenance is not a valid OpenEXR name.
    pub fn encode(&self) -> Result<Vec<u8>, PictureErrorKind> {
        let Film { width, height, window, .. } = self.film;
        let (color, alpha) = self.film.picture();
        let mut exr = ExrLayers::from_image(&color, Some(&alpha));
        exr.attributes = self.attributes();
        // The bits are random, so deflate would take five times as long to save a third.
        exr.compression = Compression::Rle;
        exr.origin = (window.x, window.y);
        exr.whole = Some((width, height));
        let mut digest = digest(&exr.attributes);
        for (name, words) in self.film.words() {
            digest.words(words.iter().copied());
            let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
            exr.push_channel(&format!("{STATE}{layer}"), channel, words);
        }
        exr.attributes.push(("domelight.digest".into(), digest.finish().to_string()));
        exr.encode()
    }

    /// An estimate of the memory that [`Checkpoint::decode`] needs \[bytes\], including `bytes` itself.
    ///
    /// # Errors
    /// If `bytes` is not an OpenEXR file.
    pub fn memory_to_decode(bytes: &[u8]) -> Result<u64, CheckpointError> {
        // The decoded channels and the resulting sums.
        let pixel = 4 * (4 + PixelSums::WORDS.len()) + size_of::<PixelSums>();
        Ok(bytes.len() as u64 + crate::picture::exr::texels(bytes)? as u64 * pixel as u64)
    }

    /// Decodes the bytes from [`Checkpoint::encode`].
    ///
    /// # Errors
    /// If `bytes` is anything else, incomplete or damaged.
    pub fn decode(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let exr = ExrLayers::decode(bytes)?;
        let mut attributes = exr.attributes.clone();
        let mut take = |name: &str| {
            let place = attributes.iter().position(|(n, _)| n == name);
            place.map(|place| attributes.remove(place).1)
        };
        let found = take("domelight.checkpoint").ok_or(CheckpointError::Foreign)?;
        if found != FORMAT {
            return Err(CheckpointError::Format { found });
        }
        let written = take("domelight.digest").ok_or(CheckpointError::Damaged("no digest"))?;
        let window =
            Window { x: exr.origin.0, y: exr.origin.1, width: exr.width, height: exr.height };
        let (width, height) = exr.whole.unwrap_or((exr.width, exr.height));
        let inside = window.x + window.width <= width && window.y + window.height <= height;
        let film = Film::from_words(width, height, window, |name| plane(&exr, name))
            .filter(|_| inside)
            .ok_or(CheckpointError::Damaged("a channel of the state is missing"))?;

        let unsigned: Vec<_> =
            exr.attributes.iter().filter(|(n, _)| n != "domelight.digest").cloned().collect();
        let mut digest = digest(&unsigned);
        let planes = PixelSums::WORDS.iter().filter_map(|name| plane(&exr, name));
        planes.for_each(|words| digest.words(words.iter().copied()));
        if digest.finish().to_string() != written {
            return Err(CheckpointError::Damaged("its digest does not match its content"));
        }

        let missing = || CheckpointError::Damaged("an attribute is missing or not a number");
        let mut number = |name: &str| take(name).and_then(|text| text.parse().ok());
        let mut count = |name: &str| number(name).ok_or_else(missing);
        let tiles = count("domelight.state.first-tile")? as usize
            ..count("domelight.state.end-tile")? as usize;
        let n_tiles = count("domelight.state.tiles")? as usize;
        let n_samples = u32::try_from(count("domelight.state.samples")?).map_err(|_| missing())?;
        let complete = count("domelight.state.complete")? == 1;
        let counts = Counts {
            camera_rays: count("domelight.state.camera-rays")?,
            shading_points: count("domelight.state.shading-points")?,
            shadow_rays: count("domelight.state.shadow-rays")?,
            non_finite: count("domelight.state.non-finite")?,
        };
        let (identity, provenance) =
            attributes.into_iter().partition::<Vec<_>, _>(|(name, _)| name.starts_with(IDENTITY));
        let strip = |(name, value): (String, String)| (name[IDENTITY.len()..].to_owned(), value);
        let identity = identity.into_iter().map(strip).collect();
        Ok(Self { identity, provenance, tiles, n_tiles, n_samples, complete, counts, film })
    }

    /// The first entry that differs between this checkpoint's identity and `identity`.
    pub fn difference<'a>(&'a self, identity: &'a [(String, String)]) -> Option<Difference<'a>> {
        let get = |of: &'a [(String, String)], name: &str| {
            of.iter().find(|(n, _)| n == name).map_or("", |(_, value)| value)
        };
        // Compare the size first, because a camera that frames the scene depends on it.
        let all = self.identity.iter().chain(identity).map(|(name, _)| name.as_str());
        let names = std::iter::once("size").chain(all);
        names
            .map(|name| Difference {
                name,
                here: get(&self.identity, name),
                there: get(identity, name),
            })
            .find(|d| d.here != d.there)
    }

    fn attributes(&self) -> Vec<(String, String)> {
        let Counts { camera_rays, shading_points, shadow_rays, non_finite } = self.counts;
        let numbers = [
            ("first-tile", self.tiles.start as u64),
            ("end-tile", self.tiles.end as u64),
            ("tiles", self.n_tiles as u64),
            ("samples", u64::from(self.n_samples)),
            ("complete", u64::from(self.complete)),
            ("camera-rays", camera_rays),
            ("shading-points", shading_points),
            ("shadow-rays", shadow_rays),
            ("non-finite", non_finite),
        ];
        let numbers = numbers.map(|(name, n)| (format!("domelight.state.{name}"), n.to_string()));
        let identity = self.identity.iter().map(|(n, v)| (format!("{IDENTITY}{n}"), v.clone()));
        let format = ("domelight.checkpoint".to_owned(), FORMAT.to_owned());
        let all = self.provenance.iter().cloned().chain([format]).chain(numbers).chain(identity);
        let mut all: Vec<_> = all.collect();
        all.sort();
        all
    }
}

/// An entry of the identity that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its value in the checkpoint; empty if there is none.
    pub here: &'a str,
    /// Its value in the other identity.
    pub there: &'a str,
}

/// A digest of the attributes, to be continued with the words.
fn digest(attributes: &[(String, String)]) -> Fingerprinter {
    let mut digest = Fingerprinter::default();
    for (name, value) in attributes {
        digest.text(name);
        digest.text(value);
    }
    digest
}

fn plane<'a>(exr: &'a ExrLayers, name: &str) -> Option<&'a [u32]> {
    let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
    let layer = exr.layers.iter().find(|l| l.name.strip_prefix(STATE) == Some(layer))?;
    match layer.channels.iter().find(|(name, _)| name == channel)? {
        (_, Plane::Uint(words)) => Some(words),
        (_, Plane::Float(_)) => None,
    }
}
