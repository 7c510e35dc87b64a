//! Accessors: decodes numbers from bytes, including sparse accessors.

use super::error::{Failure, GltfErrorKind};
use super::json::{Accessor, Sparse, SparseData};
use super::source::{Source, slice};

/// A component type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn new(code: u32) -> Option<Self> {
        match code {
            5120 => Some(Self::I8),
            5121 => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The divisor of normalized integers; `None` for types that cannot be normalized.
    fn range(self) -> Option<f32> {
        match self {
            Self::I8 => Some(127.0),
            Self::U8 => Some(255.0),
            Self::I16 => Some(32767.0),
            Self::U16 => Some(65535.0),
            Self::U32 | Self::F32 => None,
        }
    }

    fn value(self, bytes: &[u8]) -> f32 {
        match self {
            Self::I8 => f32::from(bytes[0] as i8),
            Self::U8 => f32::from(bytes[0]),
            Self::I16 => f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U16 => f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 => unsigned(&bytes[..4]) as f32,
            Self::F32 => f32::from_bits(unsigned(&bytes[..4])),
        }
    }
}

/// The divisor of an accessor's integers, if they are normalized.
pub(super) fn component_range(accessor: &Accessor) -> Option<f32> {
    Component::new(accessor.component_type)
        .and_then(Component::range)
        .filter(|_| accessor.normalized)
}

/// A normalized integer in \[0, 1\] or \[−1, 1\].
pub(super) fn normalized(value: f32, range: f32) -> f32 {
    (value / range).max(-1.0)
}

/// An unsigned little-endian integer of up to four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &b| value << 8 | u32::from(b))
}

/// The number of components of a value.
fn dimensions(shape: &str) -> Option<usize> {
    match shape {
        "SCALAR" => Some(1),
        "VEC2" => Some(2),
        "VEC3" => Some(3),
        "VEC4" => Some(4),
        "MAT4" => Some(16),
        _ => None,
    }
}

impl Source<'_> {
    /// The values of an accessor as `N` numbers each; normalized integers are in \[0, 1\] or \[−1, 1\], and missing
    /// components are 0. `needed` lists the allowed shapes, separated by ` or `.
    pub(super) fn floats<const N: usize>(
        &self,
        index: usize,
        needed: &'static str,
        used_for: &str,
    ) -> Result<Vec<[f32; N]>, Failure> {
        let accessor: Accessor = self.document.get(index)?;
        let component = Component::new(accessor.component_type);
        let dimensions = dimensions(&accessor.shape).filter(|&n| n <= N);
        let allowed = needed.split(" or ").any(|shape| shape == accessor.shape);
        let (Some(component), Some(n), true) = (component, dimensions, allowed) else {
            let found = format!("{} of type {}", accessor.shape, accessor.component_type);
            let used_for = used_for.into();
            return Err(GltfErrorKind::AccessorType { index, found, needed, used_for }.into());
        };
        let range = component_range(&accessor);
        let size = component.size();
        let number = |bytes: &[u8]| {
            let value = component.value(bytes);
            range.map_or(value, |range| normalized(value, range))
        };
        self.values(index, &accessor, n * size, |bytes| {
            let mut value = [0.0; N];
            for (i, v) in value[..n].iter_mut().enumerate() {
                *v = number(&bytes[i * size..]);
            }
            value
        })
    }

    /// The values of an accessor as `N` unsigned integers each.
    pub(super) fn integers<const N: usize>(
        &self,
        index: usize,
        needed: &'static str,
        used_for: &str,
    ) -> Result<Vec<[u32; N]>, Failure> {
        let accessor: Accessor = self.document.get(index)?;
        let component = Component::new(accessor.component_type)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32));
        let component = component.filter(|_| dimensions(&accessor.shape) == Some(N));
        let Some(component) = component else {
            let found = format!("{} of type {}", accessor.shape, accessor.component_type);
            let used_for = used_for.into();
            return Err(GltfErrorKind::AccessorType { index, found, needed, used_for }.into());
        };
        let size = component.size();
        self.values(index, &accessor, N * size, |bytes| {
            std::array::from_fn(|i| unsigned(&bytes[i * size..(i + 1) * size]))
        })
    }

    /// The indices of a primitive.
    pub(super) fn indices(&self, index: usize) -> Result<Vec<u32>, Failure> {
        let needed = "SCALAR of unsigned integers";
        Ok(self.integers::<1>(index, needed, "indices")?.into_iter().map(|[i]| i).collect())
    }

    /// Decodes all values of an accessor from `size` bytes each, including sparse replacements.
    fn values<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        size: usize,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Failure> {
        let &Accessor { count, byte_offset, .. } = accessor;
        let mut values: Vec<T> = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(view)?;
                let stride = stride.unwrap_or(size);
                let what = ("accessor", index);
                strided(&bytes, byte_offset, stride, size, count, what)?.map(&decode).collect()
            }
            // The format defines these as zeros; limit their total, because no data in the file backs them.
            None if self.take_zeros(count) => vec![decode(&vec![0; size]); count],
            None => return Err(GltfErrorKind::NoData { index, count }.into()),
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(index, sparse, size, &mut values, decode)?;
        }
        Ok(values)
    }

    /// Replaces the values listed by a sparse accessor.
    fn replace<T>(
        &self,
        index: usize,
        sparse: &Sparse,
        size: usize,
        values: &mut [T],
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<(), Failure> {
        let Sparse { count, indices, values: new } = sparse;
        let width = indices.component_type.and_then(Component::new);
        let SparseData { buffer_view, byte_offset, .. } = indices;
        let Some(width @ (1 | 2 | 4)) = width.filter(|&w| w != Component::F32).map(Component::size)
        else {
            let found = format!("type {:?}", indices.component_type);
            let (needed, used_for) = ("an unsigned integer", "sparse indices".into());
            return Err(GltfErrorKind::AccessorType { index, found, needed, used_for }.into());
        };
        let what = ("sparse accessor", index);
        let (places, _) = self.view(*buffer_view)?;
        let (replacements, _) = self.view(new.buffer_view)?;
        let places = strided(&places, *byte_offset, width, width, *count, what)?.map(unsigned);
        let replacements = strided(&replacements, new.byte_offset, size, size, *count, what)?;
        for (place, bytes) in places.zip(replacements) {
            let length = values.len();
            let slot = values.get_mut(place as usize).ok_or(GltfErrorKind::OutOfRange {
                what: what.0,
                index,
                begin: place.into(),
                end: u64::from(place) + 1,
                length,
            })?;
            *slot = decode(bytes);
        }
        Ok(())
    }
}

/// `count` values of `size` bytes, `stride` bytes apart.
fn strided<'b>(
    bytes: &'b [u8],
    offset: u64,
    stride: usize,
    size: usize,
    count: usize,
    (what, index): (&'static str, usize),
) -> Result<impl Iterator<Item = &'b [u8]>, GltfErrorKind> {
    let stride = stride.max(size);
    let length = (count as u64)
        .saturating_sub(1)
        .saturating_mul(stride as u64)
        .saturating_add(if count == 0 { 0 } else { size as u64 });
    let data = slice(bytes, offset, length, what, index)?;
    Ok(data.chunks(stride).take(count).map(move |chunk| &chunk[..size]))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::load::Budget;

    /// Reads an accessor of the bytes 0 to 15, in a view of stride 4 from byte 2.
    fn read<T>(
        accessor: &str,
        f: impl FnOnce(&Source<'_>) -> Result<T, Failure>,
    ) -> Result<T, String> {
        let json = format!(
            r#"{{"buffers":[{{"byteLength":16,"uri":"data:;base64,AAECAwQFBgcICQoLDA0ODw=="}}],
"bufferViews":[{{"buffer":0,"byteOffset":2,"byteLength":14,"byteStride":4}},{{"buffer":0,"byteLength":16}}],
"accessors":[{accessor}]}}"#
        );
        let budget = Budget::unlimited();
        let source = Source::new(Path::new("a"), json.as_bytes(), &budget);
        source.and_then(|source| f(&source)).map_err(|failure| failure.to_string())
    }

    fn floats(accessor: &str) -> Result<Vec<[f32; 4]>, String> {
        read(accessor, |s| s.floats(0, "VEC2 or VEC3", "a test"))
    }

    #[test]
    fn values_are_strided_and_normalized() {
        let plain =
            r#"{"bufferView":0,"byteOffset":1,"componentType":5121,"count":3,"type":"VEC2"}"#;
        let expected = [[3.0, 4.0, 0.0, 0.0], [7.0, 8.0, 0.0, 0.0], [11.0, 12.0, 0.0, 0.0]];
        assert_eq!(floats(plain).unwrap(), expected);
        let scaled = plain.replace(r#""count""#, r#""normalized":true,"count""#);
        assert_eq!(floats(&scaled).unwrap()[0], [3.0 / 255.0, 4.0 / 255.0, 0.0, 0.0]);
        assert_eq!(normalized(-128.0, 127.0), -1.0);
        assert!(floats(&plain.replace(":3,", ":4,")).unwrap_err().contains("accessor 0"));
        assert!(floats(&plain.replace("VEC2", "VEC4")).unwrap_err().contains("VEC2 or VEC3"));
        assert!(floats(&plain.replace("5121", "5124")).unwrap_err().contains("5124"));
        assert!(floats(&plain.replace(":3,", ":99999999999999,")).is_err());
    }

    #[test]
    fn accessors_without_a_view_are_zeros_up_to_a_bound() {
        let zeros = r#"{"componentType":5126,"count":2,"type":"VEC3"}"#;
        assert_eq!(floats(zeros).unwrap(), [[0.0; 4]; 2]);
        assert!(floats(&zeros.replace(":2,", ":4000000000,")).unwrap_err().contains("zeros"));
    }

    #[test]
    fn sparse_values_replace_others() {
        let sparse = r#"{"componentType":5121,"count":3,"type":"VEC2","sparse":{"count":2,
"indices":{"bufferView":1,"byteOffset":1,"componentType":5121},"values":{"bufferView":1,"byteOffset":8}}}"#;
        let expected = [[0.0; 4], [8.0, 9.0, 0.0, 0.0], [10.0, 11.0, 0.0, 0.0]];
        assert_eq!(floats(sparse).unwrap(), expected);
        assert!(floats(&sparse.replace(r#""byteOffset":1,"#, r#""byteOffset":2,"#)).is_err());
        let message = floats(
            &sparse.replace(r#""byteOffset":1,"componentType":5121"#, r#""componentType":5126"#),
        );
        assert!(message.unwrap_err().contains("sparse indices"));
    }

    #[test]
    fn indices_are_unsigned_scalars() {
        let indices = r#"{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}"#;
        assert_eq!(read(indices, |s| s.indices(0)).unwrap(), [0x0100, 0x0302, 0x0504]);
        let wrong = indices.replace("5123", "5122");
        assert!(read(&wrong, |s| s.indices(0)).unwrap_err().contains("unsigned"));
    }
}
