//! The faces of the first level of a cube texture in the bytes of a file.

use half::f16;

use super::{TexelFormat, from_shared_exponent};
use crate::Rgb;

/// The kinds of errors in reading a texture. Places are in bytes from the start of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextureErrorKind {
    /// The file ends within its header.
    #[error("the file ends at byte {length}, before the number at byte {at}: it is truncated")]
    Truncated {
        /// The place of a number.
        at: usize,
        /// The length of the file.
        length: usize,
    },
    /// A format of texels that is not read.
    #[error(
        "byte {at}: {kind} {number}{name} is not read; write the cube as uncompressed RGBA16F, RGBA32F or RGB9E5"
    )]
    Format {
        /// What the number is.
        kind: &'static str,
        /// The number.
        number: u32,
        /// Its name in parentheses, if it has one.
        name: &'static str,
        /// The place.
        at: usize,
    },
    /// No cube.
    #[error(
        "byte {at}: the texture has {faces} faces and no cube has but 6; write the map as a cube, or as .hdr or .exr"
    )]
    NoCube {
        /// The number of faces.
        faces: u32,
        /// The place.
        at: usize,
    },
    /// Faces that are no squares.
    #[error(
        "byte {at}: the faces are {columns}x{rows}x{depth} texels; those of a cube are squares"
    )]
    NoSquare {
        /// The width.
        columns: u32,
        /// The height.
        rows: u32,
        /// The depth.
        depth: u32,
        /// The place.
        at: usize,
    },
    /// An array.
    #[error("byte {at}: the texture is an array of {layers} cubes; write the one that is the map")]
    Layers {
        /// The number of layers.
        layers: u32,
        /// The place.
        at: usize,
    },
    /// Supercompression.
    #[error(
        "byte {at}: supercompression scheme {scheme} is not read; write the texture without (toktx without --zcmp, ktx create \
         without --zstd)"
    )]
    Supercompressed {
        /// Its number.
        scheme: u32,
        /// The place.
        at: usize,
    },
    /// A level of the wrong length.
    #[error(
        "byte 88: level 0 has {length} bytes; six faces of {columns}x{columns} texels have {expected}"
    )]
    Length {
        /// The columns of a face.
        columns: usize,
        /// The length in the index.
        length: u64,
        /// What it should be.
        expected: u64,
    },
    /// Faces beyond the end of the file.
    #[error(
        "the faces of {columns}x{columns} texels end at byte {end}, and the file at byte {length}: it is truncated or corrupt"
    )]
    Promises {
        /// The columns of a face.
        columns: usize,
        /// Where the last face ends.
        end: u64,
        /// The length of the file.
        length: usize,
    },
}

/// The 32-bit number at a place.
pub(super) fn word(bytes: &[u8], at: usize) -> Result<u32, TextureErrorKind> {
    let four = bytes.get(at..at + 4).and_then(|four| four.try_into().ok());
    let length = bytes.len();
    four.map(u32::from_le_bytes).ok_or(TextureErrorKind::Truncated { at, length })
}

/// The 64-bit number at a place.
pub(super) fn long(bytes: &[u8], at: usize) -> Result<u64, TextureErrorKind> {
    Ok(u64::from(word(bytes, at)?) | u64::from(word(bytes, at + 4)?) << 32)
}

/// Whether six square faces are there. `at` are the places of the size and of the number of faces.
pub(super) fn check_cube(
    at: [usize; 2],
    [columns, rows, depth]: [u32; 3],
    faces: u32,
) -> Result<(), TextureErrorKind> {
    let is_flat = columns == rows && columns > 0 && depth <= 1;
    match faces {
        6 if is_flat => Ok(()),
        6 => Err(TextureErrorKind::NoSquare { columns, rows, depth, at: at[0] }),
        _ => Err(TextureErrorKind::NoCube { faces, at: at[1] }),
    }
}

/// The texels of the first level.
pub(super) struct FaceBytes<'a> {
    format: TexelFormat,
    pub(super) size: usize,
    faces: [&'a [u8]; 6],
}

/// The bytes of a face.
fn face_bytes(format: TexelFormat, size: usize) -> u64 {
    (size as u64).saturating_mul(size as u64).saturating_mul(format.bytes() as u64)
}

impl<'a> FaceBytes<'a> {
    /// Six faces in one piece of `length` bytes.
    pub(super) fn new(
        bytes: &'a [u8],
        format: TexelFormat,
        size: usize,
        start: u64,
        length: u64,
    ) -> Result<Self, TextureErrorKind> {
        let face = face_bytes(format, size);
        let expected = face.saturating_mul(6);
        if length != expected {
            return Err(TextureErrorKind::Length { columns: size, length, expected });
        }
        Self::apart(bytes, format, size, start, face)
    }

    /// Six faces, `stride` bytes from one to the next.
    pub(super) fn apart(
        bytes: &'a [u8],
        format: TexelFormat,
        size: usize,
        start: u64,
        stride: u64,
    ) -> Result<Self, TextureErrorKind> {
        let face = face_bytes(format, size);
        let end = start.saturating_add(stride.saturating_mul(5)).saturating_add(face);
        let length = bytes.len();
        if end > length as u64 {
            return Err(TextureErrorKind::Promises { columns: size, end, length });
        }
        let faces = std::array::from_fn(|i| {
            let from = start as usize + i * stride as usize;
            &bytes[from..from + face as usize]
        });
        Ok(Self { format, size, faces })
    }

    /// The texel in (column, row) of a face.
    pub(super) fn texel(&self, face: usize, x: usize, y: usize) -> Rgb {
        let at = (y * self.size + x) * self.format.bytes();
        let bytes = &self.faces[face][at..at + self.format.bytes()];
        match self.format {
            TexelFormat::SharedExponent => {
                from_shared_exponent(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            }
            TexelFormat::Half | TexelFormat::HalfPair => {
                let half = |i: usize| f16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]).to_f32();
                Rgb::new(half(0), half(1), half(2))
            }
            TexelFormat::Single => {
                let single = |i: usize| {
                    let at = 4 * i;
                    f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
                };
                Rgb::new(single(0), single(1), single(2))
            }
        }
    }
}
