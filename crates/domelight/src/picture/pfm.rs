//! Portable float maps (`.pfm`): `PF` (RGB) and `Pf` (gray), bottom row first, either byte order.
//!
//! Debevec's format. The sign of the scale is the byte order (negative: little endian), and its magnitude is a
//! factor on the values.

use super::{PictureErrorKind, allocate, checked_area};
use crate::{Rgb, RgbImage};
use std::io::{self, Write};

/// How many texels the header promises.
pub(super) fn texels(bytes: &[u8]) -> Result<usize, PictureErrorKind> {
    let mut header = Words { bytes, at: 0, line: 1 };
    header.next()?;
    checked_area(header.number("a width")?, header.number("a height")?)
}

/// Decodes a whole file, top row first.
///
/// # Errors
/// If the header or the data is damaged or incomplete.
pub fn decode(bytes: &[u8]) -> Result<RgbImage, PictureErrorKind> {
    let mut header = Words { bytes, at: 0, line: 1 };
    let channels = if header.next()? == b"PF" { 3 } else { 1 };
    let width: usize = header.number("a width")?;
    let height: usize = header.number("a height")?;
    let scale: f32 = header.number("a scale")?;
    if scale == 0.0 || !scale.is_finite() {
        let found = scale.to_string();
        return Err(PictureErrorKind::Header {
            line: header.line,
            found,
            expected: "a scale other than 0",
        });
    }
    checked_area(width, height)?;
    let needed = width as u64 * height as u64 * channels as u64 * 4;
    let start = header.data_start(needed);
    let held = (bytes.len() - start.min(bytes.len())) as u64;
    if held < needed {
        return Err(PictureErrorKind::Promises { width, height, needed, held });
    }
    let value = |at: usize| {
        let four = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let raw = if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) };
        raw * scale.abs()
    };
    let mut pixels = allocate(Rgb::BLACK, width, height)?;
    for (y, row) in pixels.chunks_exact_mut(width).enumerate() {
        let row_start = start + (height - 1 - y) * width * channels * 4;
        for (x, pixel) in row.iter_mut().enumerate() {
            let at = row_start + x * channels * 4;
            *pixel = match channels {
                3 => Rgb::new(value(at), value(at + 4), value(at + 8)),
                _ => Rgb::splat(value(at)),
            };
        }
    }
    Ok(RgbImage::new(width, height, pixels))
}

/// Writes a little-endian color map with scale 1, which keeps every bit of the values.
///
/// # Errors
/// If writing to `out` fails.
pub fn encode(image: &RgbImage, out: &mut dyn Write) -> io::Result<()> {
    write!(out, "PF\n{} {}\n-1.0\n", image.width, image.height)?;
    for row in image.pixels.chunks(image.width.max(1)).rev() {
        let bytes: Vec<u8> =
            row.iter().flat_map(|pixel| pixel.to_array()).flat_map(f32::to_le_bytes).collect();
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// The words of the header; `#` starts a comment.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Words<'a> {
    /// The next word, with `at` on the byte after it.
    fn next(&mut self) -> Result<&'a [u8], PictureErrorKind> {
        let bytes = self.bytes;
        let mut in_comment = false;
        while let Some(&byte) = bytes.get(self.at) {
            in_comment = byte == b'#' || (in_comment && byte != b'\n');
            if !in_comment && !byte.is_ascii_whitespace() {
                break;
            }
            self.line += usize::from(byte == b'\n');
            self.at += 1;
        }
        let word = &bytes[self.at..];
        let end = word.iter().position(u8::is_ascii_whitespace).ok_or_else(|| {
            PictureErrorKind::Truncated {
                place: format!("header line {}", self.line),
                offset: bytes.len(),
            }
        })?;
        self.at += end;
        Ok(&word[..end])
    }

    fn number<T: std::str::FromStr>(
        &mut self,
        expected: &'static str,
    ) -> Result<T, PictureErrorKind> {
        let word = self.next()?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
        number.ok_or_else(|| PictureErrorKind::Header {
            line: self.line,
            found: String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned(),
            expected,
        })
    }

    /// One white-space byte follows the scale; a CRLF counts as one if the file is long enough for both.
    fn data_start(&self, needed: u64) -> usize {
        let after = self.at + 1;
        let crlf = self.bytes.get(self.at..self.at + 2) == Some(b"\r\n");
        after + usize::from(crlf && self.bytes.len() as u64 > after as u64 + needed)
    }
}
