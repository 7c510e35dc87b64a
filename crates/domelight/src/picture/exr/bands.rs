//! Writes OpenEXR band by band, with only one band of rows in memory.

use super::write::sort_attributes;
use super::{Compression, ExrLayers, Plane};
use crate::parallel::in_order;
use crate::picture::PictureErrorKind;
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{self, BlockIndex, UncompressedBlock};
use ::exr::error::Error;
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, Headers};
use ::exr::prelude::{ChannelDescription, LineOrder, SampleType, SmallVec, Text, Vec2};
use std::borrow::Borrow;
use std::io::{Cursor, Seek, SeekFrom, Write};

/// The number of rows of every band except the last: whole blocks, enough for several cores.
pub const BAND_ROWS: usize = 4 * BLOCK_ROWS;

/// Rows of a deflated block; other compressions have a divisor of it.
const BLOCK_ROWS: usize = 16;

/// Blocks compressed together: enough for all cores, few enough to need little memory.
const BATCH: usize = 32;

/// Writes a picture with `height` rows from bands. `band(y)` returns the rows from `y` on, [`BAND_ROWS`] of them or a
/// multiple, except at the end. All bands have the same width and channels; other attributes come from the first.
/// The bytes are those of [`ExrLayers::encode`].
///
/// # Errors
/// Those of [`ExrLayers::encode`], or if writing to `out` or `band` fails.
pub fn write<B: Borrow<ExrLayers>, E: From<PictureErrorKind>>(
    height: usize,
    out: &mut (impl Write + Seek + ?Sized),
    mut band: impl FnMut(usize) -> Result<B, E>,
) -> Result<(), E> {
    let first = band(0)?;
    let headers = Headers::from_iter([header(first.borrow(), height)?]);
    let mut failed = None;
    let written = block::write(&mut *out, headers.clone(), true, |meta, writer| {
        let (mut first, mut y) = (Some(first), 0);
        while y < height {
            let rows = first.take().map_or_else(|| band(y), Ok);
            let put = rows.and_then(|rows| {
                let blocks = write_rows(rows.borrow(), y, &meta.headers, writer);
                blocks.map(|()| rows.borrow().height).map_err(E::from)
            });
            match put {
                Ok(n_rows) => y += n_rows,
                Err(error) => {
                    failed = Some(error);
                    return Err(Error::Aborted);
                }
            }
        }
        Ok(())
    });
    match failed {
        Some(error) => return Err(error),
        None => written.map_err(error_kind)?,
    }
    rewrite_header(headers, out).map_err(error_kind)?;
    Ok(())
}

impl ExrLayers {
    /// Encodes the layers as a file with scanlines and 32 bits per sample.
    ///
    /// # Errors
    /// If there are no texels or no channels, two channels have the same name, a name is not ASCII or too long, or a
    /// channel does not have `width · height` values.
    pub fn encode(&self) -> Result<Vec<u8>, PictureErrorKind> {
        let mut bytes = Cursor::new(Vec::new());
        write(self.height, &mut bytes, |_| Ok::<_, PictureErrorKind>(self))?;
        Ok(bytes.into_inner())
    }
}

fn error_kind(error: Error) -> PictureErrorKind {
    match error {
        Error::Io(error) => PictureErrorKind::Io(error),
        error => PictureErrorKind::Exr(error),
    }
}

fn header(band: &ExrLayers, height: usize) -> Result<Header, PictureErrorKind> {
    let channel = |(name, plane): (String, &Plane)| {
        let kind = match plane {
            Plane::Float(_) => SampleType::F32,
            Plane::Uint(_) => SampleType::U32,
        };
        ChannelDescription::named(Text::from(name.as_str()), kind)
    };
    let channels: SmallVec<_> = band.sorted_planes()?.into_iter().map(channel).collect();
    let compression = match band.compression {
        Compression::Zip => ::exr::prelude::Compression::ZIP16,
        Compression::Rle => ::exr::prelude::Compression::RLE,
    };
    Ok(Header::new(Text::default(), (band.width, height), channels)
        .with_encoding(compression, BlockDescription::ScanLines, LineOrder::Increasing)
        .with_attributes(band.layer_attributes())
        .with_shared_attributes(band.image_attributes(height)))
}

/// Compresses the rows of a band that begins at row `y` of the picture, and writes them.
fn write_rows(
    band: &ExrLayers,
    y: usize,
    headers: &[Header],
    writer: &mut impl ChunksWriter,
) -> Result<(), PictureErrorKind> {
    let planes = band.sorted_planes()?;
    let names = headers[0].channels.list.iter().map(|channel| channel.name.to_string());
    if !names.eq(planes.iter().map(|(name, _)| name.as_str())) {
        let channel = planes[0].0.clone();
        return Err(PictureErrorKind::Channel {
            channel,
            why: "the bands have different channels",
        });
    }
    let rows = headers[0].max_block_pixel_size().height();
    let compress = |start: usize| {
        let end = (start + rows).min(band.height);
        let mut data = Vec::with_capacity((end - start) * band.width * 4 * planes.len());
        for row in start..end {
            for (_, plane) in &planes {
                plane.add_row(row, band.width, &mut data);
            }
        }
        let index = BlockIndex {
            layer: 0,
            pixel_position: Vec2(0, y + start),
            pixel_size: Vec2(band.width, end - start),
            level: Vec2(0, 0),
        };
        UncompressedBlock { index, data }.compress_to_chunk(headers).map_err(error_kind)
    };
    let starts: Vec<usize> = (0..band.height).step_by(rows).collect();
    for batch in starts.chunks(BATCH) {
        let chunks = in_order(batch.len(), |i| compress(batch[i]));
        for (&start, chunk) in batch.iter().zip(chunks) {
            writer.write_chunk((y + start) / rows, chunk?).map_err(error_kind)?;
        }
    }
    Ok(())
}

impl Plane {
    /// The values of a row as the encoder wants them.
    fn add_row(&self, row: usize, width: usize, data: &mut Vec<u8>) {
        let range = row * width..(row + 1) * width;
        match self {
            Self::Float(values) => {
                data.extend(values[range].iter().flat_map(|value| value.to_ne_bytes()));
            }
            Self::Uint(values) => {
                data.extend(values[range].iter().flat_map(|value| value.to_ne_bytes()));
            }
        }
    }
}

/// Puts the header over the one that was written, its attributes in their order.
fn rewrite_header(headers: Headers, out: &mut (impl Write + Seek + ?Sized)) -> Result<(), Error> {
    const OFFSET_BYTES: usize = 8;
    let offsets = OFFSET_BYTES * headers[0].chunk_count;
    let mut start = Cursor::new(Vec::new());
    match block::write(&mut start, headers, true, |_, _| Err(Error::Aborted)) {
        Err(Error::Aborted) | Ok(()) => {}
        Err(error) => return Err(error),
    }
    let mut start = start.into_inner();
    // What follows, the table of the blocks' places, is still empty here.
    start.truncate(start.len() - offsets);
    sort_attributes(&mut start);
    out.seek(SeekFrom::Start(0))?;
    out.write_all(&start)?;
    Ok(out.flush()?)
}
