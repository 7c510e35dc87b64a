//! `KHR_meshopt_compression` and its predecessor `EXT_meshopt_compression`: compressed buffer views.
//!
//! Written from the bitstream's specification (appendices A and B of `KHR_meshopt_compression`); streams of the older
//! extension have version 0. The decoder grows its output block by block, so the stream's size bounds its allocation.

mod attributes;
mod filters;
mod indices;

use serde::Deserialize;

/// The compression of a buffer view: the extension's JSON object.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compression {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    /// Size of an element \[bytes\].
    pub(super) byte_stride: usize,
    /// The number of elements in the decoded view.
    pub(super) count: usize,
    pub(super) mode: Mode,
    #[serde(default)]
    pub(super) filter: Filter,
}

/// The kind of data in the bitstream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    /// Elements of any kind, coded as byte deltas.
    Attributes,
    /// A triangle list's indices.
    Triangles,
    /// Other indices.
    Indices,
}

/// A filter for decoded elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    /// No filter.
    #[default]
    None,
    /// Unit vectors from octahedral coordinates.
    Octahedral,
    /// Unit quaternions from their three smaller components.
    Quaternion,
    /// Floats from exponent and mantissa.
    Exponential,
    /// RGBA from luma, chroma and alpha.
    Color,
}

/// An error in a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshoptError {
    /// A stride that the mode or the filter does not allow.
    #[error("{stride} bytes per element do not fit its mode and filter")]
    Stride {
        /// The stride \[bytes\].
        stride: usize,
    },
    /// A filter on indices.
    #[error("indices take no filter")]
    Filter,
    /// A number of indices that is not a multiple of three.
    #[error("{count} indices do not form whole triangles")]
    Count {
        /// The number of indices.
        count: usize,
    },
    /// A first byte of another format or version.
    #[error("the stream begins with {found:#04x}, which this mode does not know")]
    Header {
        /// The byte.
        found: u8,
    },
    /// Data that end before the last element.
    #[error("the stream ends early")]
    Truncated,
    /// Data after the last element.
    #[error("the stream has {bytes} bytes too many")]
    TrailingBytes {
        /// The number of extra bytes.
        bytes: usize,
    },
    /// A byte that the format does not define.
    #[error("the stream holds the undefined code {code:#04x}")]
    Code {
        /// The byte.
        code: u8,
    },
}

/// Decodes a stream to `count` elements of `byte_stride` bytes each.
pub(super) fn decode(stream: &[u8], c: &Compression) -> Result<Vec<u8>, MeshoptError> {
    let stride = c.byte_stride;
    if c.mode != Mode::Attributes {
        if c.filter != Filter::None {
            return Err(MeshoptError::Filter);
        }
        return match (c.mode, stride) {
            (Mode::Triangles, 2 | 4) => indices::triangles(stream, c.count, stride),
            (_, 2 | 4) => indices::sequence(stream, c.count, stride),
            _ => Err(MeshoptError::Stride { stride }),
        };
    }
    let fits = match c.filter {
        Filter::None | Filter::Exponential => {
            stride.is_multiple_of(4) && (4..=256).contains(&stride)
        }
        Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
        Filter::Quaternion => stride == 8,
    };
    if !fits {
        return Err(MeshoptError::Stride { stride });
    }
    let mut elements = attributes::decode(stream, c.count, stride)?;
    filters::apply(c.filter, stride, &mut elements);
    Ok(elements)
}

/// The unread rest of a stream.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], MeshoptError> {
        let (head, tail) = self.0.split_at_checked(n).ok_or(MeshoptError::Truncated)?;
        self.0 = tail;
        Ok(head)
    }

    fn byte(&mut self) -> Result<u8, MeshoptError> {
        Ok(self.take(1)?[0])
    }

    /// An unsigned LEB128 number of at most five bytes; bits beyond 32 are lost.
    fn varint(&mut self) -> Result<u32, MeshoptError> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(MeshoptError::Code { code: 0x80 })
    }

    fn finish(self) -> Result<(), MeshoptError> {
        match self.0.len() {
            0 => Ok(()),
            bytes => Err(MeshoptError::TrailingBytes { bytes }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn varints_have_at_most_five_bytes() {
        let varint = |bytes: &[u8]| Cursor(bytes).varint();
        assert_eq!(varint(&[0x7f]), Ok(0x7f));
        assert_eq!(varint(&[0x81, 0x04]), Ok(0x201));
        assert_eq!(varint(&[0xff, 0xa0, 0x05]), Ok(0x1507f));
        assert_eq!(varint(&[0xff; 4]), Err(MeshoptError::Truncated));
        assert!(varint(&[0xff; 6]).is_err());
    }

    #[test]
    fn strides_and_filters_that_do_not_fit_are_refused() {
        let decode = |mode, filter, byte_stride| {
            let (buffer, byte_offset, byte_length, count) = (0, 0, 0, 3);
            let c =
                Compression { buffer, byte_offset, byte_length, byte_stride, count, mode, filter };
            decode(&[], &c)
        };
        for stride in [0, 2, 3, 6, 260] {
            assert_eq!(
                decode(Mode::Attributes, Filter::None, stride),
                Err(MeshoptError::Stride { stride })
            );
        }
        assert!(matches!(
            decode(Mode::Attributes, Filter::Quaternion, 4),
            Err(MeshoptError::Stride { .. })
        ));
        assert!(matches!(decode(Mode::Indices, Filter::None, 8), Err(MeshoptError::Stride { .. })));
        assert_eq!(decode(Mode::Triangles, Filter::Color, 4), Err(MeshoptError::Filter));
        assert_eq!(decode(Mode::Attributes, Filter::None, 4), Err(MeshoptError::Truncated));
    }
}
