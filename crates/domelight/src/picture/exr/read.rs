//! Reads OpenEXR.
//!
//! The `exr` crate parses and decompresses: scanlines and tiles, half, float and uint, every compression
//! it supports (none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB). The largest level of mip- and rip-mapped
//! files is read. The picture is the data window, wherever it lies in the display window ([`DataWindow`]). Colors
//! with a `chromaticities` attribute other than Rec. 709 are converted, including the white point.
//!
//! Blocks are decompressed in batches on the program's own threads. The crate's parallel reader starts a new thread
//! pool for each file, in which a panic over a corrupt block would abort the process. Assertions of the crate that
//! replace errors are caught here and become [`PictureErrorKind::ExrPanic`].

use super::attributes::{envmap, primaries, to_rec709, window};
use super::luminance_chroma::LuminanceChroma;
use super::write::string_attributes;
use crate::environment::io::OVERFLOWED;
use crate::picture::primaries::{to_light, xyz_to_rec709};
use crate::picture::reduction::Reduction;
use crate::picture::{
    Format, GuessedLayer, MAX_TEXELS, Picture, PictureErrorKind, allocate, checked_area,
};
use crate::{Rgb, RgbImage, parallel};
use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::block::lines::LineRef;
use ::exr::block::reader::{ChunksReader, Reader};
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{Compression, SampleType, Text, f16};
use half::slice::HalfFloatSliceExt;
use std::collections::HashSet;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Decodes one layer of a complete file.
///
/// By default, this is the unnamed R, G, B channels, or else the layer that programs name after the whole picture
/// (Blender's `ViewLayer.Combined`, `rgba`, `beauty`), or else the first layer with R, G, B, or else unnamed X, Y, Z, which
/// are CIE XYZ, or else a layer with Y, or else the only channel, whatever its name except depth and coverage. `layer` names another: a part, the part of the
/// channel names before the last dot, both joined by a dot, or the last word of these if only one layer has it,
/// case-insensitive. X, Y, Z or a single channel of any name then also count as color.
///
/// # Errors
/// If the file is damaged, incomplete or deep, or has no such layer.
pub fn decode(bytes: &[u8], layer: Option<&str>) -> Result<Picture, PictureErrorKind> {
    guarded(|| decode_unguarded(bytes, layer, 1))
}

/// Decodes one layer as [`decode`] does, with blocks of texels averaged and without alpha.
pub(in crate::picture) fn decode_reduced(
    bytes: &[u8],
    layer: Option<&str>,
    factor: usize,
) -> Result<Picture, PictureErrorKind> {
    guarded(|| decode_unguarded(bytes, layer, factor))
}

/// Turns the crate's panics into errors: it asserts in places where only a corrupt file can lead. Nothing of what
/// it touched is used afterwards.
pub(super) fn guarded<T>(
    read: impl FnOnce() -> Result<T, PictureErrorKind>,
) -> Result<T, PictureErrorKind> {
    let decoded = catch_unwind(AssertUnwindSafe(read));
    decoded.unwrap_or_else(|panic| {
        let words = panic.downcast_ref::<String>().map(String::as_str);
        let message = words.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
        Err(PictureErrorKind::ExrPanic { message: message.to_owned() })
    })
}

/// Blocks decompressed together: enough for all cores, few enough to need little memory.
const BATCH: usize = 32;

fn decode_unguarded(
    bytes: &[u8],
    layer: Option<&str>,
    factor: usize,
) -> Result<Picture, PictureErrorKind> {
    if let Some(file) = LuminanceChroma::of(bytes).filter(|_| layer.is_none()) {
        return if factor == 1 { file.decode(bytes) } else { Err(PictureErrorKind::OnlyWhole) };
    }
    let reader = open(bytes)?;
    let selected = select(reader.headers(), layer)?;
    let header = &reader.headers()[selected.header];
    if matches!(header.compression, Compression::HTJ2K32 | Compression::HTJ2K256) {
        return Err(PictureErrorKind::ExrUnsupported("files compressed by HTJ2K"));
    }
    let envmap = envmap(header);
    let chromaticities = header.shared_attributes.chromaticities.as_ref();
    let matrix = match selected.space {
        Space::Rgb => chromaticities.and_then(to_rec709),
        Space::Xyz => Some(xyz_to_rec709()),
        Space::Data => None,
    };
    let is_impossible = chromaticities.is_some_and(|c| !primaries(c).span_a_space());
    let warnings = (selected.space == Space::Rgb && is_impossible)
        .then(|| "the attribute chromaticities spans no color space, and is ignored".to_owned());
    let notes = matrix.map(|_| {
        let from = if selected.space == Space::Xyz { "X, Y, Z" } else { "its chromaticities" };
        format!("converted from {from} to Rec. 709")
    });

    // Memory for the picture is taken when its first blocks have turned out to be whole.
    let mut planes = None;
    let [r, g, b, alpha] = selected.channels;
    let channels = [r, g, b, alpha.filter(|_| factor == 1)];
    let header = header.clone();
    let window = window(&header);
    if factor > 1 && window.is_some() {
        return Err(PictureErrorKind::ExrUnsupported(
            "reduced pictures whose data window is not the display window",
        ));
    }
    let new = || Planes::new(&header, channels, factor);
    for_each_block(reader, selected.header, |block| {
        let planes = match &mut planes {
            Some(planes) => planes,
            none => none.insert(new()?),
        };
        planes.insert(&header, block)
    })?;
    let planes = planes.map_or_else(new, Ok)?;
    let n = planes.n_infinite;
    let overflowed =
        (n > 0).then(|| format!("infinite values in means: {n}, as {OVERFLOWED} each"));
    let image = planes.into_image(matrix);
    let attributes = string_attributes(&header);
    Ok(Picture {
        alpha: image.1,
        envmap,
        window,
        guessed_layer: selected.guessed,
        attributes,
        notes: notes.into_iter().collect(),
        warnings: warnings.into_iter().chain(overflowed).collect(),
        ..Picture::opaque(image.0, Format::Exr)
    })
}

/// The width and height of the largest part.
pub(in crate::picture) fn size(bytes: &[u8]) -> Result<(usize, usize), PictureErrorKind> {
    guarded(|| {
        let reader = open(bytes)?;
        let sizes = reader.headers().iter().map(|header| header.layer_size);
        let largest = sizes.max_by_key(|size| size.area());
        largest.map(|size| (size.0, size.1)).ok_or(PictureErrorKind::NoBytes)
    })
}

/// How many texels the largest part has.
pub(crate) fn texels(bytes: &[u8]) -> Result<usize, PictureErrorKind> {
    guarded(|| {
        if let Some(file) = LuminanceChroma::of(bytes) {
            return file.texels();
        }
        let reader = open(bytes)?;
        let areas = reader.headers().iter().map(|header| header.layer_size.area());
        Ok(areas.max().unwrap_or(0))
    })
}

pub(super) fn open(bytes: &[u8]) -> Result<Reader<Cursor<&[u8]>>, PictureErrorKind> {
    if bytes.is_empty() {
        return Err(PictureErrorKind::NoBytes);
    }
    let reader =
        Reader::read_from_buffered(Cursor::new(bytes), false).map_err(PictureErrorKind::Exr)?;
    for header in reader.headers() {
        check_promises(header, bytes.len() as u64)?;
    }
    Ok(reader)
}

/// Decompresses the blocks of a part's largest level, in the order of the file.
pub(super) fn for_each_block(
    reader: Reader<Cursor<&[u8]>>,
    part: usize,
    mut each: impl FnMut(&UncompressedBlock) -> Result<(), PictureErrorKind>,
) -> Result<(), PictureErrorKind> {
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == part && tile.is_largest_resolution_level()
        })
        .map_err(PictureErrorKind::Exr)?;
    let meta = chunks.meta_data().clone();
    let (mut found, mut texels) = (HashSet::new(), 0);
    loop {
        // A few blocks keep a thread busy.
        let most = BATCH.min(4 * parallel::threads());
        let batch: Vec<Chunk> =
            chunks.by_ref().take(most).collect::<Result<_, _>>().map_err(PictureErrorKind::Exr)?;
        if batch.is_empty() {
            break;
        }
        for block in &decompress(batch, &meta)? {
            each(block)?;
            let (place, size) = (block.index.pixel_position, block.index.pixel_size);
            texels += if found.insert((place.0, place.1)) { size.area() } else { 0 };
        }
    }
    let whole = meta.headers[part].layer_size.area();
    if texels == whole { Ok(()) } else { Err(PictureErrorKind::MissingBlocks) }
}

fn decompress(
    batch: Vec<Chunk>,
    meta: &MetaData,
) -> Result<Vec<UncompressedBlock>, PictureErrorKind> {
    let blocks = parallel::map(batch, |chunk| {
        check_dwa_sizes(&chunk, meta)?;
        UncompressedBlock::decompress_chunk(chunk, meta, false).map_err(PictureErrorKind::Exr)
    });
    blocks.into_iter().collect()
}

/// Refuses a DWA block whose own header promises more than the block can make.
///
/// The crate takes memory for the promised sizes, and the process dies where there is not so much. The header is 11
/// little-endian numbers of 8 bytes; those at 1, 6, 7, 8 and 9 are sizes after decompression, none of which is more
/// than 8 bytes for each sample, padded to whole 8 × 8 blocks.
fn check_dwa_sizes(chunk: &Chunk, meta: &MetaData) -> Result<(), PictureErrorKind> {
    let Some(header) = meta.headers.get(chunk.layer_index) else { return Ok(()) };
    let data = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    if !matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        return Ok(());
    }
    let place = header
        .get_block_data_indices(&chunk.compressed_block)
        .and_then(|tile| header.get_absolute_block_pixel_coordinates(tile))
        .map_err(PictureErrorKind::Exr)?;
    let (width, height) = (place.size.0, place.size.1);
    // A block that would not shrink is stored as it is.
    if data.len() == width * height * header.channels.bytes_per_pixel {
        return Ok(());
    }
    let most = 8 * (width + 8) as u64 * (height + 8) as u64 * header.channels.list.len() as u64;
    let promise = |i: usize| data.get(8 * i..8 * i + 8)?.try_into().map(u64::from_le_bytes).ok();
    let greatest = [1, 6, 7, 8, 9].into_iter().filter_map(promise).max().unwrap_or(0);
    if greatest > most {
        let held = data.len() as u64;
        return Err(PictureErrorKind::Promises { width, height, needed: greatest, held });
    }
    Ok(())
}

/// Refuses a header whose blocks cannot all be in a file of `held` bytes.
///
/// Each block of the largest level has its offset (8 bytes), its place and size (8 at least) and its data in the file.
/// A byte of data makes at most 1 byte without compression, 64 of RLE and 1032 of deflate (1376 of PXR24). PIZ, B44A
/// and DWA have no useful bound on what a block can be made from; 65536 lets a black map of any size through.
fn check_promises(header: &Header, held: u64) -> Result<(), PictureErrorKind> {
    let (width, height) = (header.layer_size.0, header.layer_size.1);
    checked_area(width, height)?;
    let block = header.max_block_pixel_size();
    let blocks = width.div_ceil(block.0.max(1)) as u64 * height.div_ceil(block.1.max(1)) as u64;
    let ratio = match header.compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 64,
        Compression::ZIP1 | Compression::ZIP16 => 1032,
        Compression::PXR24 => 1376,
        _ => 65536,
    };
    // Subsampled channels take less than `bytes_per_pixel` says.
    let texel_bytes: u64 = header
        .channels
        .list
        .iter()
        .map(|c| match (c.sampling.0, c.sampling.1) {
            (1, 1) => c.sample_type.bytes_per_sample() as u64,
            _ => 0,
        })
        .sum();
    let data = (width as u64 * height as u64).saturating_mul(texel_bytes) / ratio;
    let needed = (blocks * 16).saturating_add(data);
    let tile_area = match header.blocks {
        BlockDescription::Tiles(tiles) => tiles.tile_size.0 as u64 * tiles.tile_size.1 as u64,
        BlockDescription::ScanLines => 0,
    };
    if held < needed || tile_area > MAX_TEXELS as u64 {
        return Err(PictureErrorKind::Promises { width, height, needed, held });
    }
    Ok(())
}

/// What three channels are.
#[derive(Clone, Copy, PartialEq)]
enum Space {
    /// Colors in the file's primaries.
    Rgb,
    /// Colors in CIE XYZ.
    Xyz,
    /// A gray, or something else by its own name.
    Data,
}

/// Which channels of which part make the picture.
struct Selected {
    header: usize,
    /// Indices into the part's channels of red, green, blue and, if there is one, alpha.
    channels: [Option<usize>; 4],
    space: Space,
    /// Set if nothing says which of several layers is the picture.
    guessed: Option<GuessedLayer>,
}

/// The channels of one part that share what stands before the last dot of their names.
struct Candidate {
    header: usize,
    part: String,
    prefix: String,
    /// (name after the dot, index).
    channels: Vec<(String, usize)>,
}

fn candidates(headers: &[Header]) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = Vec::new();
    for (index, header) in headers.iter().enumerate().filter(|(_, header)| !header.deep) {
        let part = header.own_attributes.layer_name.as_ref().map(Text::to_string);
        let part = part.filter(|_| headers.len() > 1).unwrap_or_default();
        for (channel, description) in header.channels.list.iter().enumerate() {
            let full = description.name.to_string();
            let (prefix, name) = full.rsplit_once('.').unwrap_or(("", &full));
            let known = found.iter().position(|c| c.header == index && c.prefix == prefix);
            let at = known.unwrap_or_else(|| {
                let (part, prefix) = (part.clone(), prefix.to_owned());
                found.push(Candidate { header: index, part, prefix, channels: Vec::new() });
                found.len() - 1
            });
            found[at].channels.push((name.to_owned(), channel));
        }
    }
    found
}

impl Candidate {
    fn full_name(&self) -> String {
        match (self.part.as_str(), self.prefix.as_str()) {
            ("", name) | (name, "") => name.to_owned(),
            (part, prefix) => format!("{part}.{prefix}"),
        }
    }

    fn is_called(&self, asked: &str) -> bool {
        [&self.full_name(), &self.part, &self.prefix]
            .into_iter()
            .any(|name| !name.is_empty() && name.eq_ignore_ascii_case(asked))
    }

    /// The last word of its name.
    fn last_word(&self) -> String {
        self.full_name().rsplit('.').next().unwrap_or_default().to_ascii_lowercase()
    }

    /// How well it suits as the picture of a file, among those with R, G, B: less is better.
    fn rank(&self) -> usize {
        /// Names of the whole picture: of Blender, Mitsuba and Nuke, V-Ray and Arnold.
        const WHOLE: [&str; 6] = ["combined", "rgba", "beauty", "rgb", "color", "main"];
        match () {
            () if self.full_name().is_empty() => 0,
            () if WHOLE.contains(&self.last_word().as_str()) => 1,
            () if self.prefix.is_empty() => 2,
            () => 3,
        }
    }

    fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().find(|(n, _)| n == name).map(|&(_, index)| index)
    }

    fn three(&self, names: [&str; 3]) -> Option<[usize; 3]> {
        Some([self.channel(names[0])?, self.channel(names[1])?, self.channel(names[2])?])
    }

    fn rgb(&self) -> Option<Selected> {
        let rgb = self.three(["R", "G", "B"]).or_else(|| self.three(["r", "g", "b"]))?;
        Some(self.selected(rgb, Space::Rgb))
    }

    /// CIE XYZ, as Mitsuba writes it.
    fn xyz(&self) -> Option<Selected> {
        self.three(["X", "Y", "Z"]).map(|xyz| self.selected(xyz, Space::Xyz))
    }

    /// Luminance without the subsampled chroma that sometimes goes with it; not a coordinate.
    fn luminance(&self) -> Option<Selected> {
        let is_other = ["RY", "X"].iter().any(|name| self.channel(name).is_some());
        let y = self.channel("Y").filter(|_| !is_other)?;
        Some(self.selected([y; 3], Space::Data))
    }

    fn anything(&self) -> Option<Selected> {
        let vector = self.three(["X", "Y", "Z"]);
        let single = (self.channels.len() == 1).then(|| [self.channels[0].1; 3]);
        vector.or(single).map(|channels| self.selected(channels, Space::Data))
    }

    /// A single channel that may be light.
    fn only(&self) -> Option<Selected> {
        let [(name, index)] = &self.channels[..] else { return None };
        let is_light = !matches!(name.as_str(), "A" | "a" | "Z" | "z" | "ZBack");
        is_light.then(|| self.selected([*index; 3], Space::Data))
    }

    fn selected(&self, [r, g, b]: [usize; 3], space: Space) -> Selected {
        let alpha = self.channel("A").or_else(|| self.channel("a"));
        let channels = [Some(r), Some(g), Some(b), alpha];
        Selected { header: self.header, channels, space, guessed: None }
    }
}

fn select(headers: &[Header], layer: Option<&str>) -> Result<Selected, PictureErrorKind> {
    if headers.iter().all(|header| header.deep) {
        return Err(PictureErrorKind::ExrUnsupported("deep pictures"));
    }
    let all = candidates(headers);
    let selected = if let Some(asked) = layer {
        let picture = |c: &Candidate| c.rgb().or_else(|| c.anything()).or_else(|| c.luminance());
        let mut called = all.iter().filter(|candidate| candidate.is_called(asked));
        let by_last_word = || {
            let word = asked.to_ascii_lowercase();
            let mut with_it = all.iter().filter(|candidate| candidate.last_word() == word);
            with_it.next().filter(|_| with_it.next().is_none()).and_then(picture)
        };
        let found = called.find_map(picture).or_else(by_last_word);
        found.ok_or_else(|| PictureErrorKind::NoSuchLayer {
            asked: asked.to_owned(),
            present: all.iter().map(Candidate::full_name).filter(|name| !name.is_empty()).collect(),
        })?
    } else {
        let unnamed = || all.iter().filter(|candidate| candidate.prefix.is_empty());
        let found = the_picture(&all, Candidate::rgb)
            .or_else(|| unnamed().find_map(Candidate::xyz))
            .or_else(|| the_picture(&all, Candidate::luminance))
            .or_else(|| unnamed().find_map(Candidate::only));
        found.ok_or_else(|| no_color(headers, &all))?
    };
    let list = &headers[selected.header].channels.list;
    let full = |index: usize| (list[index].sampling.0, list[index].sampling.1) == (1, 1);
    if list.iter().enumerate().any(|(index, _)| !full(index)) {
        return Err(PictureErrorKind::ExrUnsupported("subsampled channels"));
    }
    Ok(selected)
}

/// Of the layers that are pictures by `read`, the one that is most likely that of the file.
fn the_picture(
    all: &[Candidate],
    read: impl Fn(&Candidate) -> Option<Selected>,
) -> Option<Selected> {
    let pictures = || all.iter().filter(|candidate| read(candidate).is_some());
    let best = pictures().min_by_key(|candidate| candidate.rank())?;
    let others = pictures().map(Candidate::full_name).filter(|name| *name != best.full_name());
    let others: Vec<_> = others.collect();
    let is_guess = best.rank() > 1 && !others.is_empty();
    let guessed = is_guess.then(|| GuessedLayer { name: best.full_name(), others });
    Some(Selected { guessed, ..read(best)? })
}

fn no_color(headers: &[Header], all: &[Candidate]) -> PictureErrorKind {
    if all.iter().any(|c| c.channel("RY").is_some()) {
        return PictureErrorKind::ExrUnsupported(
            "tiles, parts or layers of luminance and chroma (Y, RY, BY)",
        );
    }
    let channels = headers.iter().flat_map(|header| &header.channels.list);
    PictureErrorKind::NoColor {
        present: channels.map(|channel| channel.name.to_string()).collect(),
    }
}

/// The picture while its blocks arrive.
struct Planes {
    width: usize,
    height: usize,
    pixels: Vec<Rgb>,
    alpha: Option<Vec<f32>>,
    channels: [Option<usize>; 4],
    /// Set if the picture is smaller than the file.
    reduction: Option<Reduction>,
    /// The number of infinite values that went into means.
    n_infinite: usize,
}

impl Planes {
    fn new(
        header: &Header,
        channels: [Option<usize>; 4],
        factor: usize,
    ) -> Result<Self, PictureErrorKind> {
        let (width, height) = (header.layer_size.0, header.layer_size.1);
        let reduction =
            (factor > 1).then(|| Reduction::new((width, height), factor)).transpose()?;
        let size = reduction.as_ref().map_or((width, height), |r| (r.width, r.height));
        let pixels = allocate(Rgb::BLACK, size.0, size.1)?;
        let alpha = channels[3].map(|_| allocate(0.0, width, height)).transpose()?;
        Ok(Self { width, height, pixels, alpha, channels, reduction, n_infinite: 0 })
    }

    fn insert(
        &mut self,
        header: &Header,
        block: &UncompressedBlock,
    ) -> Result<(), PictureErrorKind> {
        let (mut halves, mut values) = (Vec::new(), Vec::new());
        for line in block.lines(&header.channels) {
            let place = line.location;
            let wanted = self.channels.contains(&Some(place.channel));
            let inside = place.position.0 + place.sample_count <= self.width
                && place.position.1 < self.height;
            if !wanted || !inside {
                continue;
            }
            values.resize(place.sample_count, 0.0);
            let sample_type = header.channels.list[place.channel].sample_type;
            to_floats(line, sample_type, &mut halves, &mut values)
                .map_err(PictureErrorKind::Exr)?;
            let (x, y) = (place.position.0, place.position.1);
            if self.reduction.is_some() {
                self.add(place.channel, x, y, &values);
            } else {
                self.put(place.channel, y * self.width + x, &values);
            }
        }
        Ok(())
    }

    fn put(&mut self, channel: usize, start: usize, values: &[f32]) {
        let is = |i: usize| self.channels[i] == Some(channel);
        let pixels = &mut self.pixels[start..start + values.len()];
        let (r, g, b) = (is(0), is(1), is(2));
        for (pixel, &value) in pixels.iter_mut().zip(values) {
            pixel.r = if r { value } else { pixel.r };
            pixel.g = if g { value } else { pixel.g };
            pixel.b = if b { value } else { pixel.b };
        }
        if let Some(alpha) = self.alpha.as_mut().filter(|_| self.channels[3] == Some(channel)) {
            alpha[start..start + values.len()].copy_from_slice(values);
        }
    }

    /// Adds what the values of a row from (x, y) on contribute to a smaller picture. An infinite value, of a sun that
    /// overflowed, would make its whole block infinite.
    fn add(&mut self, channel: usize, x: usize, y: usize, values: &[f32]) {
        let Some(Reduction { factor, width, weights, .. }) = &self.reduction else { return };
        let [r, g, b] = [0, 1, 2].map(|i| self.channels[i] == Some(channel));
        let row = &mut self.pixels[y / factor * width..][..*width];
        for (x, &value) in (x..).zip(values) {
            let is_infinite = value == f32::INFINITY;
            self.n_infinite += usize::from(is_infinite);
            let value = if is_infinite { OVERFLOWED } else { value };
            let (pixel, part) = (&mut row[x / factor], weights[y] * value);
            pixel.r += if r { part } else { 0.0 };
            pixel.g += if g { part } else { 0.0 };
            pixel.b += if b { part } else { 0.0 };
        }
    }

    fn into_image(self, matrix: Option<crate::math::Mat3>) -> (RgbImage, Option<Vec<f32>>) {
        let mut pixels = self.pixels;
        if let Some(matrix) = matrix {
            for pixel in &mut pixels {
                *pixel = to_light(&matrix, *pixel);
            }
        }
        let size = self.reduction.map_or((self.width, self.height), |r| (r.width, r.height));
        (RgbImage::new(size.0, size.1, pixels), self.alpha)
    }
}

fn to_floats(
    line: LineRef<'_>,
    sample_type: SampleType,
    halves: &mut Vec<f16>,
    values: &mut [f32],
) -> ::exr::error::UnitResult {
    match sample_type {
        SampleType::F32 => line.read_samples_into_slice(values),
        SampleType::F16 => {
            halves.resize(values.len(), f16::ZERO);
            line.read_samples_into_slice(halves)?;
            halves.convert_to_f32_slice(values);
            Ok(())
        }
        SampleType::U32 => {
            for (value, sample) in values.iter_mut().zip(line.read_samples::<u32>()) {
                *value = sample? as f32;
            }
            Ok(())
        }
    }
}
