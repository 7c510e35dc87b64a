//! Writes OpenEXR: layers in one part.
//!
//! Blender, Nuke and OpenImageIO show one part with dotted channel names as layers. Several parts were rejected,
//! because Blender and older viewers show only the first.

use crate::environment::mapping::EnvmapKind;
use crate::picture::{PictureErrorKind, checked_area};
use crate::{Rgb, RgbImage};
use ::exr::block;
use ::exr::meta::attribute::EnvironmentMap;
use ::exr::meta::header::Header;
use ::exr::prelude::{AttributeValue, ImageAttributes, IntegerBounds, LayerAttributes, Text, Vec2};
use std::io::Cursor;

/// Channels that belong together, such as `albedo` with R, G and B.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// The name before the dot in the file; empty for the picture itself.
    pub name: String,
    /// The channels: a name (R, G, B, A, X, Y, Z …) and one value per texel, row by row.
    pub channels: Vec<(String, Plane)>,
}

/// The values of a channel, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Plane {
    /// 32-bit floats.
    Float(Vec<f32>),
    /// Counts, or bits that only their writer interprets.
    Uint(Vec<u32>),
}

impl Plane {
    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Uint(values) => values.len(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The lossless compression of a file: speed or size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Deflate, for smaller files.
    #[default]
    Zip,
    /// Run-length encoding, which is several times as fast.
    Rle,
}

impl From<Vec<f32>> for Plane {
    fn from(values: Vec<f32>) -> Self {
        Self::Float(values)
    }
}

impl From<Vec<u32>> for Plane {
    fn from(values: Vec<u32>) -> Self {
        Self::Uint(values)
    }
}

/// Layers of the same size, written as one part: `R`, `G`, `B`, `A` for the picture itself and `layer.R` … for
/// others, the naming that Blender, Nuke and OpenImageIO show as layers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExrLayers {
    /// The number of columns.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The position of the first column and row in the whole picture: the corner of the data window.
    pub origin: (usize, usize),
    /// Columns and rows of the whole picture, the display window; by default the data window.
    pub whole: Option<(usize, usize)>,
    /// The layers, in any order; the file sorts channels by name.
    pub layers: Vec<Layer>,
    /// String attributes (name, value), for provenance.
    pub attributes: Vec<(String, String)>,
    /// The `envmap` attribute.
    pub envmap: Option<EnvmapKind>,
    /// The compression of the file; not kept by [`ExrLayers::decode`].
    pub compression: Compression,
}

impl ExrLayers {
    /// Creates a file without layers.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Creates a file with one picture, with alpha if given.
    pub fn from_image(image: &RgbImage, alpha: Option<&[f32]>) -> Self {
        let mut layers = Self::new(image.width, image.height);
        layers.push_rgb("", image, alpha);
        layers
    }

    /// Adds a layer with R, G, B and optionally A.
    pub fn push_rgb(&mut self, name: &str, image: &RgbImage, alpha: Option<&[f32]>) {
        let plane = |f: fn(&Rgb) -> f32| Plane::Float(image.pixels.iter().map(f).collect());
        let mut channels = vec![
            ("R".to_owned(), plane(|c| c.r)),
            ("G".to_owned(), plane(|c| c.g)),
            ("B".to_owned(), plane(|c| c.b)),
        ];
        channels.extend(alpha.map(|alpha| ("A".to_owned(), alpha.to_vec().into())));
        self.layers.push(Layer { name: name.to_owned(), channels });
    }

    /// Adds a layer with X, Y and Z, such as normals.
    pub fn push_xyz(&mut self, name: &str, vectors: &[crate::math::Vec3]) {
        let plane = |axis: usize| Plane::Float(vectors.iter().map(|v| v[axis]).collect());
        let channels = ["X", "Y", "Z"].iter().enumerate().map(|(i, n)| ((*n).to_owned(), plane(i)));
        self.layers.push(Layer { name: name.to_owned(), channels: channels.collect() });
    }

    /// Adds a layer with one channel, such as `depth.Z`.
    pub fn push_channel(&mut self, name: &str, channel: &str, values: impl Into<Plane>) {
        let channels = vec![(channel.to_owned(), values.into())];
        self.layers.push(Layer { name: name.to_owned(), channels });
    }

    /// The channels by their full names, in the order of a file: by name.
    pub(super) fn sorted_planes(&self) -> Result<Vec<(String, &Plane)>, PictureErrorKind> {
        let area = checked_area(self.width, self.height)?;
        let full_name = |(layer, channel, values): (&str, &String, _)| {
            let name =
                if layer.is_empty() { channel.clone() } else { format!("{layer}.{channel}") };
            (name, values)
        };
        let mut planes: Vec<(String, &Plane)> = self.planes().map(full_name).collect();
        planes.sort_by(|a, b| a.0.cmp(&b.0));
        let refuse =
            |channel: &str, why| Err(PictureErrorKind::Channel { channel: channel.into(), why });
        for (name, values) in &planes {
            if !name.is_ascii() || name.is_empty() || name.len() > 255 {
                return refuse(name, "its name must be ASCII and 1 to 255 characters long");
            } else if values.len() != area {
                return refuse(name, "it does not have one value per texel");
            }
        }
        if let Some(pair) = planes.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return refuse(&pair[0].0, "another channel has the same name");
        }
        if planes.is_empty() {
            return Err(PictureErrorKind::NoColor { present: Vec::new() });
        }
        Ok(planes)
    }

    fn planes(&self) -> impl Iterator<Item = (&str, &String, &Plane)> {
        self.layers.iter().flat_map(|Layer { name, channels }| {
            channels.iter().map(move |(channel, values)| (name.as_str(), channel, values))
        })
    }

    /// The size of the whole picture, of which `self` may be a band.
    pub(super) fn image_attributes(&self, height: usize) -> ImageAttributes {
        let whole = self.whole.unwrap_or((self.width, height));
        ImageAttributes::new(IntegerBounds::from_dimensions(whole))
    }

    pub(super) fn layer_attributes(&self) -> LayerAttributes {
        let text = |text: &str| Text::from_slice_unchecked(text.as_bytes());
        let mut attributes = LayerAttributes {
            software_name: Some(text("domelight")),
            layer_position: Vec2(self.origin.0 as i32, self.origin.1 as i32),
            environment_map: self.envmap.map(|kind| match kind {
                EnvmapKind::LatLong => EnvironmentMap::LatitudeLongitude,
                EnvmapKind::Cube => EnvironmentMap::Cube,
            }),
            ..LayerAttributes::default()
        };
        for (name, value) in self.attributes.iter().filter(|(name, _)| !name.is_empty()) {
            attributes.other.insert(text(name), AttributeValue::Text(text(value)));
        }
        attributes
    }
}

/// Puts the header's attributes in the order of their names, as OpenEXR itself does: the encoder keeps some in a hash
/// map, whose order changes from run to run, and the same picture should give the same bytes.
pub(super) fn sort_attributes(bytes: &mut [u8]) {
    const MAGIC_AND_VERSION: usize = 8;
    let mut attributes = Vec::new();
    let mut rest = bytes.get(MAGIC_AND_VERSION..).unwrap_or_default();
    while let Some((attribute, after)) = split_attribute(rest) {
        attributes.push(attribute);
        rest = after;
    }
    attributes.sort_unstable();
    let sorted = attributes.concat();
    bytes[MAGIC_AND_VERSION..][..sorted.len()].copy_from_slice(&sorted);
}

/// The first attribute (name, 0, type, 0, size, value) and what follows; none at the 0 that ends the header.
fn split_attribute(header: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = |text: &[u8]| text.iter().position(|&byte| byte == 0);
    let name = end(header).filter(|&length| length > 0)?;
    let size = name + 1 + end(&header[name + 1..])? + 1;
    let value = size + 4;
    let length = u32::from_le_bytes(header.get(size..value)?.try_into().ok()?);
    header.split_at_checked(value + length as usize)
}

/// Reads the string attributes of the first part, as written from [`ExrLayers::attributes`].
///
/// # Errors
/// If the file's headers are damaged.
pub fn text_attributes(bytes: &[u8]) -> Result<Vec<(String, String)>, PictureErrorKind> {
    let reader = block::read(Cursor::new(bytes), false).map_err(PictureErrorKind::Exr)?;
    Ok(reader.headers().first().map(string_attributes).unwrap_or_default())
}

/// Reads the text and number attributes of the first part, by name. Numbers become text.
///
/// # Errors
/// If the bytes are not OpenEXR.
pub fn plain_attributes(bytes: &[u8]) -> Result<Vec<(String, String)>, PictureErrorKind> {
    let reader = block::read(Cursor::new(bytes), false).map_err(PictureErrorKind::Exr)?;
    let Some(header) = reader.headers().first() else { return Ok(Vec::new()) };
    let number = |value: &AttributeValue| match value {
        AttributeValue::F32(value) => Some(value.to_string()),
        AttributeValue::F64(value) => Some(value.to_string()),
        AttributeValue::I32(value) => Some(value.to_string()),
        _ => None,
    };
    let other = header.own_attributes.other.iter();
    let numbers = other.filter_map(|(name, value)| {
        Some((String::from_utf8_lossy(name.as_slice()).into_owned(), number(value)?))
    });
    Ok(string_attributes(header).into_iter().chain(numbers).collect())
}

/// The string attributes of a part, by name.
pub(super) fn string_attributes(header: &Header) -> Vec<(String, String)> {
    let utf8 = |text: &Text| String::from_utf8_lossy(text.as_slice()).into_owned();
    let text = |(name, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(value) => Some((utf8(name), utf8(value))),
        _ => None,
    };
    let mut texts: Vec<_> = header.own_attributes.other.iter().filter_map(text).collect();
    texts.sort();
    texts
}
