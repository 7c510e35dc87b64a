//! Luminance and chroma: OpenEXR's Y at every texel, RY and BY usually at every second texel of every second line.
//!
//! RY = (R − Y) / Y and BY = (B − Y) / Y, with Y from the weights of the file's primaries ("Technical Introduction to
//! OpenEXR", Luminance/Chroma Images). Chroma is interpolated bilinearly; OpenEXR's own reader uses a wider filter.
//!
//! The `exr` crate decompresses subsampled channels but rejects their headers, so this module reads the table of
//! blocks itself.

use super::attributes::{envmap, primaries, to_rec709, window};
use super::write::string_attributes;
use crate::picture::primaries::{Primaries, is_light, to_light};
use crate::picture::{Format, Picture, PictureErrorKind, allocate, checked_area};
use crate::{Rgb, RgbImage};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType};
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::Compression;
use half::f16;
use std::collections::HashSet;
use std::io::Cursor;

/// One part with Y, RY and BY, and where its table of blocks begins.
pub(super) struct LuminanceChroma {
    header: Header,
    table: usize,
}

/// A channel's samples.
struct Plane {
    sampling: [usize; 2],
    width: usize,
    values: Vec<f32>,
}

impl LuminanceChroma {
    /// The file's part, if it is such a file: of one part, of scanlines, without other colors.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let mut cursor = Cursor::new(bytes);
        let mut meta = MetaData::read_from_buffered(&mut cursor, false).ok()?;
        let is_one = meta.headers.len() == 1 && !meta.requirements.is_multilayer();
        let header = meta.headers.pop().filter(|_| is_one)?;
        let is_flat = !header.deep && header.blocks == BlockDescription::ScanLines;
        let has = |name: &str| header.channels.list.iter().any(|c| c.name.to_string() == name);
        let has_colors = ["R", "G", "B"].into_iter().any(has);
        let fits = is_flat && !has_colors && ["Y", "RY", "BY"].into_iter().all(has);
        fits.then_some(Self { header, table: cursor.position() as usize })
    }

    pub(super) fn texels(&self) -> Result<usize, PictureErrorKind> {
        checked_area(self.header.layer_size.0, self.header.layer_size.1)
    }

    pub(super) fn decode(self, bytes: &[u8]) -> Result<Picture, PictureErrorKind> {
        let (width, height) = (self.header.layer_size.0, self.header.layer_size.1);
        self.texels()?;
        // The crate's decoder of B44 miscounts subsampled blocks, and DWA's is not checked for its promises here.
        let is_read = matches!(
            self.header.compression,
            Compression::Uncompressed
                | Compression::RLE
                | Compression::ZIP1
                | Compression::ZIP16
                | Compression::PIZ
                | Compression::PXR24
        );
        if !is_read {
            return Err(PictureErrorKind::ExrUnsupported(
                "luminance and chroma compressed by B44, DWA or HTJ2K",
            ));
        }
        let blocks = self.blocks(bytes)?;
        let mut planes = self.planes(bytes.len())?;
        for (y, data) in blocks {
            self.decode_block(y, data, &mut planes)?;
        }
        let of = |name: &str| {
            let index = self.header.channels.list.iter().position(|c| c.name.to_string() == name);
            index.map(|index| &planes[index])
        };
        let (Some(luminance), Some(ry), Some(by)) = (of("Y"), of("RY"), of("BY")) else {
            return Err(PictureErrorKind::ExrUnsupported("luminance without chroma"));
        };
        let chromaticities = self.header.shared_attributes.chromaticities.as_ref();
        let weights = chromaticities.map_or(Primaries::REC709, primaries).luminance();
        let matrix = chromaticities.and_then(to_rec709);
        let image = RgbImage::from_fn(width, height, |x, y| {
            let luminance = luminance.at(x, y);
            let (r, b) = ((ry.at(x, y) + 1.0) * luminance, (by.at(x, y) + 1.0) * luminance);
            let g = (luminance - weights[0] * r - weights[2] * b) / weights[1];
            // The chroma of a negative value, or of one that is not finite, is no color.
            if !is_light(luminance) {
                return Rgb::splat(luminance);
            }
            // The chroma is rounded, so what should be 0 may be less.
            let color = Rgb::new(r, g, b).map(|c| if c < 0.0 { 0.0 } else { c });
            matrix.as_ref().map_or(color, |matrix| to_light(matrix, color))
        });
        let alpha =
            of("A").map(|a| (0..width * height).map(|i| a.at(i % width, i / width)).collect());
        let (envmap, window) = (envmap(&self.header), window(&self.header));
        let attributes = string_attributes(&self.header);
        let opaque = Picture::opaque(image, Format::Exr);
        Ok(Picture { alpha, envmap, window, attributes, ..opaque })
    }

    /// The first line of each block, from 0, and its compressed bytes.
    fn blocks<'b>(&self, bytes: &'b [u8]) -> Result<Vec<(usize, &'b [u8])>, PictureErrorKind> {
        let lines = self.header.compression.scan_lines_per_block();
        let count = self.header.layer_size.1.div_ceil(lines);
        let truncated =
            |offset| PictureErrorKind::Truncated { place: "the table of blocks".into(), offset };
        let table = bytes.get(self.table..).and_then(|rest| rest.get(..8 * count));
        let table = table.ok_or_else(|| truncated(bytes.len()))?;
        let block = |entry: &[u8; 8]| {
            let start = usize::try_from(u64::from_le_bytes(*entry)).ok()?;
            let head: [u8; 8] = *bytes.get(start..)?.first_chunk()?;
            let [y, size] =
                [&head[..4], &head[4..]].map(|b| i32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            let first = y.checked_sub(self.header.own_attributes.layer_position.1)?;
            let first = usize::try_from(first).ok().filter(|&y| y < self.header.layer_size.1)?;
            let data = bytes.get(start + 8..)?.get(..usize::try_from(size).ok()?)?;
            first.is_multiple_of(lines).then_some((first, data))
        };
        let entries = table.as_chunks::<8>().0.iter();
        let blocks = entries.map(|entry| block(entry).ok_or_else(|| truncated(bytes.len())));
        let blocks: Vec<_> = blocks.collect::<Result<_, _>>()?;
        let distinct: HashSet<_> = blocks.iter().map(|(first, _)| first).collect();
        if distinct.len() == count { Ok(blocks) } else { Err(PictureErrorKind::MissingBlocks) }
    }

    /// Zeros, where the sampling divides the picture.
    fn planes(&self, held: usize) -> Result<Vec<Plane>, PictureErrorKind> {
        let (width, height) = (self.header.layer_size.0, self.header.layer_size.1);
        let corner = self.header.own_attributes.layer_position;
        // As of whole pictures: 65536 lets a black map of any size through.
        let needed = (width * height / 65536) as u64;
        if (held as u64) < needed {
            return Err(PictureErrorKind::Promises { width, height, needed, held: held as u64 });
        }
        let plane = |channel: &ChannelDescription| {
            let [sx, sy] = sampling(channel);
            let divides = |size: usize, at: i32, by: usize| {
                by > 0 && size.is_multiple_of(by) && at.rem_euclid(by as i32) == 0
            };
            if !(divides(width, corner.0, sx) && divides(height, corner.1, sy)) {
                return Err(PictureErrorKind::ExrUnsupported(
                    "channels whose sampling does not divide the picture",
                ));
            }
            let values = allocate(0.0, width / sx, height / sy)?;
            Ok(Plane { sampling: [sx, sy], width: width / sx, values })
        };
        self.header.channels.list.iter().map(plane).collect()
    }

    fn decode_block(
        &self,
        first: usize,
        data: &[u8],
        planes: &mut [Plane],
    ) -> Result<(), PictureErrorKind> {
        let (width, height) = (self.header.layer_size.0, self.header.layer_size.1);
        let lines = self.header.compression.scan_lines_per_block().min(height - first);
        let list = &self.header.channels.list;
        let in_line = |channel: &ChannelDescription, line: usize| {
            let [sx, sy] = sampling(channel);
            if line.is_multiple_of(sy) { width / sx } else { 0 }
        };
        let samples = |line: usize| {
            list.iter()
                .map(move |c| in_line(c, line) * c.sample_type.bytes_per_sample())
                .sum::<usize>()
        };
        let expected: usize = (first..first + lines).map(samples).sum();
        // The crate multiplies the block's area with bytes for a texel.
        let mut header = self.header.clone();
        header.channels.bytes_per_pixel = expected / (width * lines);
        if header.channels.bytes_per_pixel * width * lines != expected {
            return Err(PictureErrorKind::ExrUnsupported("channels of such sampling"));
        }
        let corner = header.own_attributes.layer_position;
        let bounds =
            IntegerBounds::new(Vec2(corner.0, corner.1 + first as i32), Vec2(width, lines));
        let compression = header.compression;
        let bytes = compression
            .decompress_image_section_from_le(&header, data.to_vec(), bounds, false)
            .map_err(PictureErrorKind::Exr)?;
        let mut rest = &bytes[..];
        for line in first..first + lines {
            for (channel, plane) in list.iter().zip(planes.iter_mut()) {
                let n = in_line(channel, line);
                let (taken, after) = rest.split_at(n * channel.sample_type.bytes_per_sample());
                rest = after;
                let row = line / plane.sampling[1] * plane.width;
                if n > 0 {
                    to_floats(channel.sample_type, taken, &mut plane.values[row..row + n]);
                }
            }
        }
        Ok(())
    }
}

fn sampling(channel: &ChannelDescription) -> [usize; 2] {
    [channel.sampling.0, channel.sampling.1]
}

fn to_floats(kind: SampleType, bytes: &[u8], values: &mut [f32]) {
    match kind {
        SampleType::F16 => {
            let halves = bytes.as_chunks::<2>().0.iter().map(|&b| f16::from_ne_bytes(b).to_f32());
            values.iter_mut().zip(halves).for_each(|(value, half)| *value = half);
        }
        SampleType::F32 => {
            let floats = bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_ne_bytes(b));
            values.iter_mut().zip(floats).for_each(|(value, float)| *value = float);
        }
        SampleType::U32 => {
            let numbers = bytes.as_chunks::<4>().0.iter().map(|&b| u32::from_ne_bytes(b) as f32);
            values.iter_mut().zip(numbers).for_each(|(value, number)| *value = number);
        }
    }
}

impl Plane {
    /// Between samples, which lie on every first texel of a cell, bilinear; the last ones go on to the border.
    fn at(&self, x: usize, y: usize) -> f32 {
        let [sx, sy] = self.sampling;
        if [sx, sy] == [1, 1] {
            return self.values[y * self.width + x];
        }
        let (column, row) = (x / sx, y / sy);
        let next_column = (column + 1).min(self.width - 1);
        let next_row = (row + 1).min(self.values.len() / self.width - 1);
        let (fx, fy) = ((x % sx) as f32 / sx as f32, (y % sy) as f32 / sy as f32);
        let value = |column: usize, row: usize| self.values[row * self.width + column];
        let along = |row: usize| value(column, row) * (1.0 - fx) + value(next_column, row) * fx;
        along(row) * (1.0 - fy) + along(next_row) * fy
    }
}
