//! KTX2 images of `KHR_texture_basisu`: Basis Universal, as ETC1S or UASTC.
//!
//! The crate `basisu` transcodes the blocks, but trusts the lengths in the file's tables: a damaged table could make it
//! allocate unbounded memory. So this module checks the tables first, and converts panics of the crate to errors.

use std::panic::{AssertUnwindSafe, catch_unwind};

use basisu::{DecodeFlags, TargetFormat, Transcoder};

/// An error in a KTX2 file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Ktx2Error {
    /// Not a KTX2 file.
    #[error("it lacks the KTX2 signature")]
    Magic,
    /// The file ends too early, or a table lies outside of it.
    #[error("its {0} lies outside the file, which is truncated or damaged")]
    OutOfRange(&'static str),
    /// A header field with a value not allowed for glTF textures.
    #[error("its {what} is {value}; {wanted}")]
    Header {
        /// The field.
        what: &'static str,
        /// The value.
        value: u64,
        /// The allowed values.
        wanted: &'static str,
    },
    /// The blocks cannot be decoded.
    #[error("its blocks are damaged")]
    Blocks,
}

const MAGIC: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// The maximum width and height, as on GPUs.
const MAX_SIZE: u32 = 16384;

/// Color models of the data format descriptor (Khronos, "Data Format Specification" 1.4).
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// The checked header of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ktx2<'a> {
    file: &'a [u8],
    pub(super) width: u32,
    pub(super) height: u32,
}

/// Whether a file starts with the KTX2 signature.
pub(super) fn is_ktx2(file: &[u8]) -> bool {
    file.starts_with(&MAGIC)
}

impl<'a> Ktx2<'a> {
    /// Checks a file's header and tables (Khronos, "KTX File Format Specification" 2.0, section 3).
    pub(super) fn new(file: &'a [u8]) -> Result<Self, Ktx2Error> {
        if !is_ktx2(file) {
            return Err(Ktx2Error::Magic);
        }
        let words = file.get(12..80).ok_or(Ktx2Error::OutOfRange("header"))?.as_chunks::<4>().0;
        let word = |i: usize| u32::from_le_bytes(words[i]);
        let long = |i: usize| u64::from(word(i)) | u64::from(word(i + 1)) << 32;
        let [format, _, width, height, depth, layers, faces, levels, scheme] =
            std::array::from_fn(word);
        let check = |is_right: bool, what, value: u32, wanted| {
            let value = value.into();
            if is_right { Ok(()) } else { Err(Ktx2Error::Header { what, value, wanted }) }
        };
        let universal = "0 for Basis Universal, the only kind allowed in glTF";
        check(format == 0, "vkFormat", format, universal)?;
        let sizes = "1 to 16384 are supported";
        check((1..=MAX_SIZE).contains(&width), "width", width, sizes)?;
        check((1..=MAX_SIZE).contains(&height), "height", height, sizes)?;
        check(depth == 0, "depth", depth, "0 for a flat image")?;
        check(layers <= 1, "number of layers", layers, "0 or 1 for a single image")?;
        check(faces == 1, "number of faces", faces, "1 for a flat image")?;
        check((1..=15).contains(&levels), "number of levels", levels, "1 to 15 fit the size")?;
        let schemes = "0, 1 (BasisLZ) and 2 (Zstandard) are supported";
        check(scheme <= 2, "supercompression", scheme, schemes)?;

        let size = file.len() as u64;
        let inside = |begin: u64, length: u64, what| match begin.checked_add(length) {
            Some(end) if end <= size => Ok(()),
            _ => Err(Ktx2Error::OutOfRange(what)),
        };
        inside(word(9).into(), word(10).into(), "data format descriptor")?;
        inside(word(11).into(), word(12).into(), "key and value data")?;
        inside(long(13), long(15), "supercompression global data")?;
        // Color model and scheme determine the kind of blocks.
        let descriptor = file.get(word(9) as usize..).unwrap_or_default();
        let model = *descriptor.get(12).ok_or(Ktx2Error::OutOfRange("data format descriptor"))?;
        let is_uastc = model == UASTC;
        let models = "163 (ETC1S, with BasisLZ) and 166 (UASTC, without) are supported";
        let fits = if is_uastc { scheme != 1 } else { model == ETC1S && scheme == 1 };
        check(fits, "color model", model.into(), models)?;

        let index_size = 24 * levels as usize;
        let index = file.get(80..80 + index_size).ok_or(Ktx2Error::OutOfRange("level index"))?;
        let blocks = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
        for (level, entry) in index.as_chunks::<24>().0.iter().enumerate() {
            let [offset, length, uncompressed] =
                [0, 8, 16].map(|i| u64::from_le_bytes(std::array::from_fn(|j| entry[i + j])));
            inside(offset, length, "level")?;
            if level == 0 && is_uastc {
                let (what, wanted) =
                    ("length of the first level", "16 bytes per block fit the size");
                let value = if scheme == 0 { length } else { uncompressed };
                if value != 16 * blocks {
                    return Err(Ktx2Error::Header { what, value, wanted });
                }
            }
        }
        Ok(Self { file, width, height })
    }

    /// The first level as RGBA, top row first, and whether any alpha is not opaque.
    pub(super) fn decode(&self) -> Result<(Vec<[u8; 4]>, bool), Ktx2Error> {
        let decode = || {
            let transcoder = Transcoder::new(self.file).ok()?;
            let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).ok()?;
            Some((texels, transcoder.has_alpha()))
        };
        let decoded = catch_unwind(AssertUnwindSafe(decode)).ok().flatten();
        let (texels, has_alpha) = decoded.ok_or(Ktx2Error::Blocks)?;
        let texels = texels.as_chunks().0.to_vec();
        let expected = self.width as usize * self.height as usize;
        if texels.len() == expected { Ok((texels, has_alpha)) } else { Err(Ktx2Error::Blocks) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;

    /// An image of 8 × 8 texels: the left half red, the right half blue with an alpha of one half.
    fn images() -> [Vec<u8>; 3] {
        let etc1s = "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAADwAAACkAAAAJAAAAMgAAAAAAAAAjgAA\
        AAAAAABWAQAAAAAAAAMAAAAAAAAAAAAAAAAAAAA8AAAAAAAAAAIAOACjAQIAAwMAAAgIAAAAAAAAAAA/AAAAAAAAAAAA/////0AA\
        Pw8AAAAAAAAAAP////8fAAAAS1RYd3JpdGVyAEJhc2lzIFVuaXZlcnNhbCAyLjUwAAAEAAIALgAAAAkAAAAvAAAAAAAAAAAAAAAA\
        AAAAAQAAAAEAAAACAAAAIMBEAAAAAAAA4gQIMBEAAAAAAIAsOCAATAAAAAAAACAgAFMAAAAAACBQFn2YAqyqqqpSVVVVBWDARAAA\
        AAAAAJKKAJgAEAAAAABAdAiIEjAAAAAM2u0lEYiCADABIAAAAACACAQAJqwc";
        let uastc = "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAAAAAAAaAAAACwAAACUAAAALAAAAAAAAAAAAAAAAAAA\
        AAAAAADAAAAAAAAAAEAAAAAAAAAAQAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8A\
        AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAAAQAAAB/fwAA9x8A4B96AAAAAAAAAAAAABcA4B8QAuABAAAAAAAAAAD3\
        HwDgH3oAAAAAAAAAAAAAFwDgHxAC4AEAAAAAAAAAAA==";
        let zstandard = "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAA\
        AAAAAAC4AAAAAAAAACMAAAAAAAAAQAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8A\
        AABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuNTAAACi1L/0gQNUAAHj3HwDgH3oAFwDgHxAC4AEDAENhMPNxDRgB";
        let decode = |text| base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        [etc1s, uastc, zstandard].map(decode)
    }

    #[test]
    fn all_kinds_of_blocks_are_decoded() {
        for file in images() {
            let image = Ktx2::new(&file).unwrap();
            assert_eq!((image.width, image.height), (8, 8));
            let (texels, has_alpha) = image.decode().unwrap();
            assert!(has_alpha);
            for (i, texel) in texels.iter().enumerate() {
                let expected = if i % 8 < 4 { [255, 0, 0, 255] } else { [0, 0, 255, 128] };
                let off = texel.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
                assert!(off <= Some(8), "{texel:?} at {i}");
            }
        }
    }

    #[test]
    fn tables_that_lie_outside_are_refused() {
        let [_, uastc, _] = images();
        let error = |at: usize, value: u64| {
            let mut file = uastc.clone();
            let bytes = value.to_le_bytes();
            // The header has words of 32 bits, then of 64.
            let width = if at < 64 { 4 } else { 8 };
            file[at..at + width].copy_from_slice(&bytes[..width]);
            Ktx2::new(&file).unwrap_err().to_string()
        };
        assert!(error(12, 37).contains("vkFormat is 37"));
        assert!(error(20, 0).contains("width") && error(24, 99_999).contains("height"));
        assert!(error(32, 2).contains("layers") && error(36, 6).contains("faces"));
        assert!(error(40, 0).contains("levels") && error(40, 15).contains("level index"));
        assert!(error(44, 3).contains("supercompression"));
        assert!(error(48, 0xffff_fff0).contains("descriptor"));
        assert!(error(80, u64::MAX - 3).contains("level"));
        assert!(error(88, 1 << 55).contains("level"));
        assert!(error(20, 16384).contains("16 bytes per block"));
        assert_eq!(Ktx2::new(b"PNG"), Err(Ktx2Error::Magic));
    }

    #[test]
    fn damaged_files_are_errors_or_images() {
        for file in images() {
            for length in 0..file.len() {
                if let Ok(image) = Ktx2::new(&file[..length]) {
                    let _ = image.decode();
                }
            }
            for i in 0..file.len() {
                let mut file = file.clone();
                file[i] ^= 0x55;
                if let Ok(image) = Ktx2::new(&file) {
                    let _ = image.decode();
                }
            }
        }
    }
}
