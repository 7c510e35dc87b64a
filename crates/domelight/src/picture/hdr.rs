//! Radiance pictures (`.hdr`, `.pic`): RGBE and XYZE, flat and both run-length encodings, all eight orientations.
//!
//! Ward 1991, "Real Pixels", Graphics Gems II; the *Radiance* reference manual, "File Formats". A color is three
//! mantissas and one exponent, c = m · 2^(e−136). The reader does not add ½ to the mantissa (Ward's own reader
//! does; stb, OpenImageIO and most others do not). The writer rounds to nearest, so that reading and writing a
//! file leaves it unchanged.
//!
//! EXPOSURE and COLORCORR are divided out (all of them, as they accumulate), and PRIMARIES other than Rec. 709's are
//! converted. What cannot be meant, such as the EXPOSURE=0 of old versions of FreeImage, is ignored with a warning.
//! A VIEW that is an equidistant fisheye says which directions the picture shows.
//! XYZE is converted to Rec. 709 with the D65 matrix. In files of Radiance's `ra_xyze`, white is (1/3, 1/3), and EXPOSURE
//! makes lumens of watts. Colors outside the gamut are clipped at zero, because a mantissa step in XYZ is enough to leave it.
//!
//! Reading takes two passes. The first scans the runs of all scanlines, which proves that the file holds what the
//! header promises before memory is allocated. The second decodes scanlines independently, in parallel. The `image`
//! crate's decoder supports only one orientation and drops EXPOSURE.

use super::primaries::{Primaries, to_light, xyz_of_white_to_rec709, xyz_to_rec709};
use super::reduction::Reduction;
use super::{Format, Picture, PictureErrorKind, allocate, checked_area};
use crate::environment::mapping::Fisheye;
use crate::math::functions;
use crate::parallel::bands;
use crate::{Rgb, RgbImage};
use std::io::{self, Write};

/// Scanlines that share the memory of one.
const BAND_LINES: usize = 16;

/// Decodes a whole file into linear Rec. 709, top row first.
///
/// # Errors
/// If the header or the data is damaged or incomplete.
pub fn decode(bytes: &[u8]) -> Result<Picture, PictureErrorKind> {
    let header = Header::parse(bytes)?;
    let (lines, length) = (header.lines, header.length);
    let area = checked_area(length, lines)?;
    let starts = scanline_starts(bytes, &header)?;
    let color = ColorTable::new(&header);
    let mut pixels = allocate(Rgb::BLACK, length, lines)?;
    debug_assert_eq!(pixels.len(), area);
    bands(&mut pixels, BAND_LINES * length, |band, rows| {
        let mut rgbe = vec![[0u8; 4]; length];
        for (row, &start) in rows.chunks_exact_mut(length).zip(&starts[band * BAND_LINES..]) {
            decode_scanline(&bytes[start..], &mut rgbe);
            for (pixel, &rgbe) in row.iter_mut().zip(&rgbe) {
                *pixel = color.decode(rgbe);
            }
        }
    });
    let picture = Picture::opaque(header.upright(pixels), Format::Hdr);
    let (notes, fisheye) = (header.notes(), header.fisheye);
    Ok(Picture { notes, fisheye, warnings: header.warnings, ..picture })
}

/// Decodes a whole file, with blocks of texels averaged.
pub(super) fn decode_reduced(bytes: &[u8], factor: usize) -> Result<Picture, PictureErrorKind> {
    let header = Header::parse(bytes)?;
    let reduction = Reduction::new(header.size(), factor)?;
    if !header.is_direct() {
        return Err(PictureErrorKind::OnlyWhole);
    }
    let starts = scanline_starts(bytes, &header)?;
    let color = ColorTable::new(&header);
    let mut pixels = allocate(Rgb::BLACK, reduction.width, reduction.height)?;
    bands(&mut pixels, reduction.width, |y, row| {
        let mut rgbe = vec![[0u8; 4]; header.length];
        for line in y * factor..(y + 1) * factor {
            decode_scanline(&bytes[starts[line]..], &mut rgbe);
            for (pixel, block) in row.iter_mut().zip(rgbe.chunks_exact(factor)) {
                let colors = block.iter().map(|&rgbe| color.decode(rgbe));
                colors.for_each(|color| *pixel += reduction.weights[line] * color);
            }
        }
    });
    let image = RgbImage::new(reduction.width, reduction.height, pixels);
    let (notes, fisheye) = (header.notes(), header.fisheye);
    let picture = Picture::opaque(image, Format::Hdr);
    Ok(Picture { notes, fisheye, warnings: header.warnings, ..picture })
}

/// The width and height that the header promises.
pub(super) fn size(bytes: &[u8]) -> Result<(usize, usize), PictureErrorKind> {
    let header = Header::parse(bytes)?;
    checked_area(header.length, header.lines)?;
    Ok(header.size())
}

/// How many texels the header promises.
pub(super) fn texels(bytes: &[u8]) -> Result<usize, PictureErrorKind> {
    let header = Header::parse(bytes)?;
    checked_area(header.length, header.lines)
}

/// Which way an axis of the picture goes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    is_x: bool,
    forward: bool,
    size: usize,
}

/// Lumens per watt of white light, by Radiance's definition.
const EFFICACY: f64 = 179.0;

/// The chromaticity of white in `ra_xyze`.
const EQUAL_ENERGY: [f32; 2] = [1.0 / 3.0; 2];

struct Header {
    is_xyz: bool,
    /// Whether Radiance's `ra_xyze` made the file.
    is_of_ra_xyze: bool,
    has_exposure: bool,
    /// What was ignored.
    warnings: Vec<String>,
    /// What the pixels were multiplied by, per channel.
    exposure: [f64; 3],
    primaries: Option<Primaries>,
    fisheye: Option<Fisheye>,
    lines: usize,
    length: usize,
    /// The axis from scanline to scanline and the one along a scanline.
    slow: Axis,
    fast: Axis,
    /// Where the pixels begin.
    end: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, PictureErrorKind> {
        let mut lines = Lines { bytes, at: 0, number: 0 };
        let mut header = Self {
            is_xyz: false,
            is_of_ra_xyze: false,
            has_exposure: false,
            warnings: Vec::new(),
            exposure: [1.0; 3],
            primaries: None,
            fisheye: None,
            lines: 0,
            length: 0,
            slow: Axis { is_x: false, forward: true, size: 0 },
            fast: Axis { is_x: true, forward: true, size: 0 },
            end: 0,
        };
        lines.next()?;
        loop {
            let line = lines.next()?;
            if line.is_empty() {
                break;
            }
            header.read_variable(line, lines.number)?;
        }
        let resolution = lines.next()?;
        (header.slow, header.fast) =
            parse_resolution(resolution).ok_or_else(|| PictureErrorKind::Header {
                line: lines.number,
                found: lossy(resolution),
                expected: "a resolution such as \"-Y 512 +X 1024\"",
            })?;
        (header.lines, header.length) = (header.slow.size, header.fast.size);
        header.end = lines.at;
        Ok(header)
    }

    fn read_variable(&mut self, line: &[u8], number: usize) -> Result<(), PictureErrorKind> {
        let line = String::from_utf8_lossy(line);
        self.is_of_ra_xyze |= line.split_ascii_whitespace().next() == Some("ra_xyze");
        // Indented lines are of the pictures that this one was made from.
        let is_own = !line.starts_with(['#', ' ', '\t']);
        let Some((name, value)) = line.split_once('=').filter(|_| is_own) else {
            return Ok(());
        };
        let bad =
            |expected| PictureErrorKind::Header { line: number, found: line.to_string(), expected };
        let value = value.trim();
        let ignored = || format!("header line {number}: {line:?} is not possible, and is ignored");
        match name.trim_end() {
            "FORMAT" => {
                self.is_xyz = match value {
                    "32-bit_rle_rgbe" => false,
                    "32-bit_rle_xyze" => true,
                    _ => return Err(bad("FORMAT=32-bit_rle_rgbe or 32-bit_rle_xyze")),
                }
            }
            "EXPOSURE" => {
                let Some([by]) = positive_numbers::<1>(value) else {
                    self.warnings.push(ignored());
                    return Ok(());
                };
                self.has_exposure = true;
                self.exposure.iter_mut().for_each(|e| *e *= by);
            }
            "COLORCORR" => {
                let Some(by) = positive_numbers::<3>(value) else {
                    self.warnings.push(ignored());
                    return Ok(());
                };
                self.exposure.iter_mut().zip(by).for_each(|(e, by)| *e *= by);
            }
            // Primaries that cannot be read are ignored, as everybody does.
            "PRIMARIES" => {
                self.primaries = numbers::<8>(value)
                    .map(|p| {
                        Primaries([0, 1, 2, 3].map(|i| [p[2 * i] as f32, p[2 * i + 1] as f32]))
                    })
                    .filter(Primaries::span_a_space);
                // Zeros, which cameras' software writes, mean that nothing is known.
                let is_unknown = numbers::<8>(value).is_some_and(|p| p == [0.0; 8]);
                if self.primaries.is_none() && !is_unknown {
                    self.warnings.push(ignored());
                }
            }
            "VIEW" => match Fisheye::of_view(value) {
                Ok(fisheye) => self.fisheye = fisheye,
                Err(kind) => self.warnings.push(format!(
                    "its VIEW is {kind}, which is not read: convert it to lat-long first"
                )),
            },
            _ => {}
        }
        Ok(())
    }

    /// What radiance is divided by to get the file's numbers, per channel.
    fn scale(&self) -> [f64; 3] {
        let of_lumens =
            if self.is_xyz && self.is_of_ra_xyze && self.has_exposure { EFFICACY } else { 1.0 };
        self.exposure.map(|exposure| exposure * of_lumens)
    }

    /// The matrix to linear Rec. 709.
    fn matrix(&self) -> Option<crate::math::Mat3> {
        match self.primaries {
            _ if self.is_xyz && self.is_of_ra_xyze => Some(xyz_of_white_to_rec709(EQUAL_ENERGY)),
            _ if self.is_xyz => Some(xyz_to_rec709()),
            primaries => primaries.and_then(Primaries::to_rec709),
        }
    }

    /// What was applied.
    fn notes(&self) -> Vec<String> {
        let scale = self.scale();
        let scaled = (scale != [1.0; 3]).then(|| {
            let [r, g, b] = scale.map(|s| s as f32);
            let by = if r == g && g == b { format!("{r}") } else { format!("{r}, {g}, {b}") };
            format!("divided by {by} (EXPOSURE, COLORCORR)")
        });
        let converted = self.matrix().map(|_| {
            let from = if self.is_xyz { "XYZ" } else { "PRIMARIES" };
            format!("converted from {from} to Rec. 709")
        });
        scaled.into_iter().chain(converted).collect()
    }

    fn size(&self) -> (usize, usize) {
        if self.fast.is_x { (self.length, self.lines) } else { (self.lines, self.length) }
    }

    /// Whether the file has the top row first, left to right.
    fn is_direct(&self) -> bool {
        self.fast.is_x && self.slow.forward && self.fast.forward
    }

    /// Top row first, left to right, from the file's order.
    fn upright(&self, pixels: Vec<Rgb>) -> RgbImage {
        let (width, height) = self.size();
        if self.is_direct() {
            return RgbImage::new(width, height, pixels);
        }
        let along = |axis: Axis, i: usize| if axis.forward { i } else { axis.size - 1 - i };
        RgbImage::from_fn(width, height, |x, y| {
            let (slow, fast) = if self.fast.is_x { (y, x) } else { (x, y) };
            pixels[along(self.slow, slow) * self.length + along(self.fast, fast)]
        })
    }
}

/// "-Y 512 +X 1024": the first axis goes from scanline to scanline; y grows upward, so that −Y runs downward.
fn parse_resolution(line: &[u8]) -> Option<(Axis, Axis)> {
    let text = std::str::from_utf8(line).ok()?;
    let mut words = text.split_ascii_whitespace();
    let mut axis = || {
        let (name, size) = (words.next()?, words.next()?.parse().ok()?);
        let (is_x, forward) = match name {
            "+X" => (true, true),
            "-X" => (true, false),
            "-Y" => (false, true),
            "+Y" => (false, false),
            _ => return None,
        };
        Some(Axis { is_x, forward, size })
    };
    let (slow, fast) = (axis()?, axis()?);
    (slow.is_x != fast.is_x && words.next().is_none()).then_some((slow, fast))
}

fn positive_numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    numbers(text).filter(|numbers| numbers.iter().all(|&n| n > 0.0))
}

/// So many finite numbers.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> =
        text.split_ascii_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite()))
}

/// The lines of a header, each without its line end (LF or CRLF).
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a [u8], PictureErrorKind> {
        let rest = &self.bytes[self.at..];
        let length =
            rest.iter().position(|&b| b == b'\n').ok_or_else(|| PictureErrorKind::Truncated {
                place: format!("header line {}", self.number + 1),
                offset: self.bytes.len(),
            })?;
        self.at += length + 1;
        self.number += 1;
        let line = &rest[..length];
        Ok(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

fn lossy(line: &[u8]) -> String {
    String::from_utf8_lossy(&line[..line.len().min(80)]).into_owned()
}

/// Widths whose scanlines may be run-length encoded component by component.
const NEW_RUNS: std::ops::Range<usize> = 8..32768;

/// The fewest bytes that a scanline of `length` pixels can take: one pixel repeated by runs of the old kind, each of
/// which counts for eight bits more of the repetition.
fn least_bytes(length: usize) -> u64 {
    let digits = (usize::BITS - (length - 1).leading_zeros()).div_ceil(8);
    4 + 4 * u64::from(digits)
}

/// Whether a scanline at `at` is in the new encoding, which starts with 2, 2 and its length.
fn is_new(bytes: &[u8], at: usize, length: usize) -> bool {
    let [high, low] = (length as u16).to_be_bytes();
    NEW_RUNS.contains(&length) && bytes.get(at..at + 4).is_some_and(|b| b == [2, 2, high, low])
}

/// Where each scanline begins, having walked through all of them.
fn scanline_starts(bytes: &[u8], header: &Header) -> Result<Vec<usize>, PictureErrorKind> {
    // No scanline takes fewer bytes than this.
    let needed = header.lines as u64 * least_bytes(header.length);
    let held = (bytes.len() - header.end) as u64;
    if held < needed {
        let (width, height) = header.size();
        return Err(PictureErrorKind::Promises { width, height, needed, held });
    }
    let mut at = header.end;
    let mut starts = Vec::with_capacity(header.lines);
    for scanline in 0..header.lines {
        starts.push(at);
        at = if is_new(bytes, at, header.length) {
            skip_new(bytes, at + 4, header.length, scanline)?
        } else {
            skip_old(bytes, at, header.length, scanline)?
        };
    }
    Ok(starts)
}

fn truncated(bytes: &[u8], scanline: usize) -> PictureErrorKind {
    PictureErrorKind::Truncated { place: format!("scanline {scanline}"), offset: bytes.len() }
}

/// The end of a scanline in the new encoding: per component, runs of 128 + n equal bytes or n literal ones.
fn skip_new(
    bytes: &[u8],
    mut at: usize,
    length: usize,
    scanline: usize,
) -> Result<usize, PictureErrorKind> {
    for _ in 0..4 {
        let mut filled = 0;
        while filled < length {
            let code = *bytes.get(at).ok_or_else(|| truncated(bytes, scanline))?;
            let (count, taken) = if code > 128 { (code - 128, 1) } else { (code, code.into()) };
            filled += usize::from(count);
            if count == 0 || filled > length {
                let what = if count == 0 {
                    "a run of length zero"
                } else {
                    "a run past the scanline's end"
                };
                return Err(PictureErrorKind::Scanline { scanline, offset: at, what });
            }
            at += 1 + taken;
        }
        if at > bytes.len() {
            return Err(truncated(bytes, scanline));
        }
    }
    Ok(at)
}

/// The end of a scanline of plain pixels, among which (1, 1, 1, n) repeats the one before n times.
fn skip_old(
    bytes: &[u8],
    mut at: usize,
    length: usize,
    scanline: usize,
) -> Result<usize, PictureErrorKind> {
    let (mut filled, mut shift) = (0usize, 0u32);
    while filled < length {
        let pixel = bytes.get(at..at + 4).ok_or_else(|| truncated(bytes, scanline))?;
        let bad = |what| PictureErrorKind::Scanline { scanline, offset: at, what };
        if pixel[..3] == [1, 1, 1] {
            if filled == 0 {
                return Err(bad("a repetition before the first pixel"));
            }
            let count = usize::from(pixel[3]).checked_shl(shift).filter(|_| shift < 32);
            filled = filled.saturating_add(count.unwrap_or(usize::MAX));
            if filled > length {
                return Err(bad("a repetition past the scanline's end"));
            }
            shift += 8;
        } else {
            filled += 1;
            shift = 0;
        }
        at += 4;
    }
    Ok(at)
}

/// Decodes a scanline that [`scanline_starts`] has walked through.
fn decode_scanline(bytes: &[u8], out: &mut [[u8; 4]]) {
    if is_new(bytes, 0, out.len()) {
        decode_new(&bytes[4..], out);
    } else {
        decode_old(bytes, out);
    }
}

fn decode_new(bytes: &[u8], out: &mut [[u8; 4]]) {
    let mut at = 0;
    for component in 0..4 {
        let mut filled = 0;
        while filled < out.len() {
            let code = bytes[at];
            let count = usize::from(if code > 128 { code - 128 } else { code });
            let run = &mut out[filled..filled + count];
            if code > 128 {
                for pixel in run {
                    pixel[component] = bytes[at + 1];
                }
                at += 2;
            } else {
                let literal = &bytes[at + 1..=at + count];
                run.iter_mut().zip(literal).for_each(|(pixel, &byte)| pixel[component] = byte);
                at += 1 + count;
            }
            filled += count;
        }
    }
}

fn decode_old(bytes: &[u8], out: &mut [[u8; 4]]) {
    let (mut filled, mut shift) = (0, 0);
    for pixel in bytes.chunks_exact(4) {
        if filled == out.len() {
            break;
        }
        if let &[1, 1, 1, n] = pixel {
            let count = usize::from(n) << shift;
            let last = out[filled - 1];
            out[filled..filled + count].fill(last);
            filled += count;
            shift += 8;
        } else {
            out[filled].copy_from_slice(pixel);
            filled += 1;
            shift = 0;
        }
    }
}

/// From (mantissas, exponent) to linear Rec. 709.
struct ColorTable {
    /// 2^(e−136) over the exposure, per exponent; zero for e = 0.
    scale: Vec<[f32; 3]>,
    matrix: Option<crate::math::Mat3>,
}

impl ColorTable {
    fn new(header: &Header) -> Self {
        let scale = (0..256).map(|e| match e {
            0 => [0.0; 3],
            e => header.scale().map(|scale| (functions::powi(2.0, e - 136) / scale) as f32),
        });
        Self { scale: scale.collect(), matrix: header.matrix() }
    }

    #[inline]
    fn decode(&self, [r, g, b, e]: [u8; 4]) -> Rgb {
        let scale = self.scale[usize::from(e)];
        let color =
            Rgb::new(f32::from(r) * scale[0], f32::from(g) * scale[1], f32::from(b) * scale[2]);
        match &self.matrix {
            None => color,
            Some(matrix) => to_light(matrix, color),
        }
    }
}

/// Writes an RGBE picture with the new run-length encoding.
///
/// Each color is rounded to the nearest one in the format, which has no negative and no non-finite values:
/// negative and NaN values become 0, and infinity becomes the maximum, 255 · 2^119.
///
/// # Errors
/// If writing to `out` fails.
pub fn encode(image: &RgbImage, out: &mut dyn Write) -> io::Result<()> {
    write!(out, "#?RADIANCE\nSOFTWARE=domelight\nFORMAT=32-bit_rle_rgbe\n\n")?;
    writeln!(out, "-Y {} +X {}", image.height, image.width)?;
    let mut encoded = Vec::new();
    for pixels in image.pixels.chunks(image.width.max(1)) {
        let row: Vec<[u8; 4]> = pixels.iter().map(|&pixel| rgbe(pixel)).collect();
        encoded.clear();
        if NEW_RUNS.contains(&image.width) {
            encode_runs(&row, &mut encoded);
        } else {
            // Plain pixels; (1, 1, 1, e), which would be a repetition, cannot come out of `rgbe`.
            encoded.extend(row.as_flattened());
        }
        out.write_all(&encoded)?;
    }
    Ok(())
}

/// The nearest (mantissas, exponent), with the largest mantissa in 128 ..= 255.
pub fn rgbe(color: Rgb) -> [u8; 4] {
    // max before min: NaN becomes 0.
    let color = color.map(|c| f32::min(c.max(0.0), f32::MAX));
    let greatest = f64::from(color.max_component());
    // 2^(e−136) · 127.5 ≤ largest < 2^(e−136) · 255.5, so that the largest mantissa rounds to 128 ..= 255.
    let exponent = |value: f64| (functions::log2(value / 255.5).floor() as i32 + 137).clamp(0, 255);
    let mut e = if greatest > 0.0 { exponent(greatest) } else { 0 };
    if e > 0 && e < 255 && greatest / functions::powi(2.0, e - 136) >= 255.5 {
        e += 1;
    }
    if e == 0 {
        return [0; 4];
    }
    let scale = functions::powi(2.0, e - 136);
    let [r, g, b] = color.to_array().map(|c| (f64::from(c) / scale).round().min(255.0) as u8);
    [r, g, b, e as u8]
}

/// Runs of at least four equal bytes as such, everything else literally.
fn encode_runs(row: &[[u8; 4]], out: &mut Vec<u8>) {
    let [high, low] = (row.len() as u16).to_be_bytes();
    out.extend([2, 2, high, low]);
    for component in 0..4 {
        let bytes: Vec<u8> = row.iter().map(|pixel| pixel[component]).collect();
        let mut at = 0;
        while at < bytes.len() {
            let literal = (at..bytes.len()).find(|&i| run_length(&bytes[i..]) >= 4);
            let literal_end = literal.unwrap_or(bytes.len());
            for chunk in bytes[at..literal_end].chunks(128) {
                out.push(chunk.len() as u8);
                out.extend(chunk);
            }
            at = literal_end;
            if at < bytes.len() {
                let run = run_length(&bytes[at..]);
                out.extend([128 + run as u8, bytes[at]]);
                at += run;
            }
        }
    }
}

/// How often the first byte is repeated, up to 127.
fn run_length(bytes: &[u8]) -> usize {
    bytes.iter().take(127).take_while(|&&byte| byte == bytes[0]).count()
}
