//! Reads everything that [`ExrLayers::encode`] writes.

use super::attributes::envmap;
use super::read::{for_each_block, guarded, open};
use super::write::string_attributes;
use super::{Compression, ExrLayers, Layer, Plane};
use crate::picture::{PictureErrorKind, allocate};
use ::exr::block::lines::LineRef;
use ::exr::prelude::SampleType;

impl ExrLayers {
    /// Decodes all channels and strings of the first part, to the bit: the inverse of [`ExrLayers::encode`].
    ///
    /// # Errors
    /// If the file is damaged or incomplete, or has channels that [`ExrLayers::encode`] does not write: half floats,
    /// subsampled or deep ones.
    pub fn decode(bytes: &[u8]) -> Result<Self, PictureErrorKind> {
        guarded(|| decode_unguarded(bytes))
    }
}

fn decode_unguarded(bytes: &[u8]) -> Result<ExrLayers, PictureErrorKind> {
    let reader = open(bytes)?;
    let header = reader.headers()[0].clone();
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    let whole = header.shared_attributes.display_window.size;
    let corner = header.own_attributes.layer_position;
    let (Ok(x), Ok(y)) = (usize::try_from(corner.0), usize::try_from(corner.1)) else {
        return Err(PictureErrorKind::ExrUnsupported("a data window with a negative corner"));
    };
    let list = &header.channels.list;
    if header.deep || list.iter().any(|c| (c.sampling.0, c.sampling.1) != (1, 1)) {
        return Err(PictureErrorKind::ExrUnsupported("deep or subsampled channels"));
    }
    let mut planes: Vec<Plane> = Vec::new();
    for_each_block(reader, 0, |block| {
        if planes.is_empty() {
            let plane =
                |c: &::exr::prelude::ChannelDescription| empty(c.sample_type, width, height);
            planes = list.iter().map(plane).collect::<Result<_, _>>()?;
        }
        for line in block.lines(&header.channels) {
            let place = line.location;
            let start = place.position.1 * width + place.position.0;
            planes[place.channel].put(start, line)?;
        }
        Ok(())
    })?;
    let mut layers = ExrLayers {
        width,
        height,
        origin: (x, y),
        whole: ((whole.0, whole.1) != (width, height)).then_some((whole.0, whole.1)),
        layers: Vec::new(),
        attributes: string_attributes(&header),
        envmap: envmap(&header),
        compression: Compression::default(),
    };
    for (channel, plane) in list.iter().zip(planes) {
        let name = channel.name.to_string();
        let (layer, channel) = name.rsplit_once('.').unwrap_or(("", &name));
        let channel = (channel.to_owned(), plane);
        match layers.layers.iter_mut().find(|l| l.name == layer) {
            Some(layer) => layer.channels.push(channel),
            None => layers.layers.push(Layer { name: layer.to_owned(), channels: vec![channel] }),
        }
    }
    Ok(layers)
}

/// Zeros; memory is taken when the first block has turned out to be whole.
fn empty(kind: SampleType, width: usize, height: usize) -> Result<Plane, PictureErrorKind> {
    match kind {
        SampleType::F32 => allocate(0.0, width, height).map(Plane::Float),
        SampleType::U32 => allocate(0, width, height).map(Plane::Uint),
        SampleType::F16 => {
            Err(PictureErrorKind::ExrUnsupported("half floats where 32 bits are needed"))
        }
    }
}

impl Plane {
    fn put(&mut self, start: usize, line: LineRef<'_>) -> Result<(), PictureErrorKind> {
        let range = start..start + line.location.sample_count;
        let outside = PictureErrorKind::ExrUnsupported("a block outside the data window");
        match self {
            Self::Float(values) => {
                line.read_samples_into_slice(values.get_mut(range).ok_or(outside)?)
            }
            Self::Uint(values) => {
                line.read_samples_into_slice(values.get_mut(range).ok_or(outside)?)
            }
        }
        .map_err(PictureErrorKind::Exr)
    }
}
