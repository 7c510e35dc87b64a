//! Modes 1 and 2: triangle lists, and other index sequences.

use super::{Cursor, MeshoptError};

/// Indices as bytes of `stride` each.
struct Output {
    bytes: Vec<u8>,
    stride: usize,
}

impl Output {
    fn new(count: usize, stride: usize) -> Self {
        Self { bytes: Vec::with_capacity(count * stride), stride }
    }

    fn push(&mut self, index: u32) {
        self.bytes.extend_from_slice(&index.to_le_bytes()[..self.stride]);
    }
}

/// The last sixteen pushed values, the latest at index 0.
#[derive(Default)]
struct Fifo<T> {
    items: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn push(&mut self, item: T) {
        self.items[self.next] = Some(item);
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, age: u8, code: u8) -> Result<T, MeshoptError> {
        self.items[(self.next + 15 - usize::from(age)) % 16].ok_or(MeshoptError::Code { code })
    }
}

fn zigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

/// The state of the triangle decoder.
#[derive(Default)]
struct Triangles {
    /// The expected next new index.
    next: u32,
    /// The last explicitly coded index.
    last: u32,
    edges: Fifo<[u32; 2]>,
    vertices: Fifo<u32>,
}

impl Triangles {
    fn new_vertex(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    fn explicit(&mut self, data: &mut Cursor<'_>) -> Result<u32, MeshoptError> {
        self.last = self.last.wrapping_add(zigzag(data.varint()?));
        Ok(self.last)
    }

    /// A corner from its nibble: 0 is a new vertex, 15 an explicitly coded one, other values a recent one.
    fn corner(&mut self, nibble: u8, data: &mut Cursor<'_>) -> Result<u32, MeshoptError> {
        match nibble {
            0 => Ok(self.new_vertex()),
            15 => self.explicit(data),
            _ => self.vertices.get(nibble - 1, nibble),
        }
    }

    /// A triangle that continues a recent edge.
    fn continued(&mut self, code: u8, data: &mut Cursor<'_>) -> Result<[u32; 3], MeshoptError> {
        let [a, b] = self.edges.get(code >> 4, code)?;
        let (c, is_recent) = match code & 15 {
            0 => (self.new_vertex(), false),
            15 => (self.explicit(data)?, false),
            nibble @ (13 | 14) => {
                let step = if nibble == 13 { 1u32.wrapping_neg() } else { 1 };
                self.last = self.last.wrapping_add(step);
                (self.last, false)
            }
            nibble => (self.vertices.get(nibble, code)?, true),
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if !is_recent {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    /// A triangle of three coded corners: the first from `first`, the others from the nibbles of `pair`.
    fn separate(
        &mut self,
        first: u8,
        pair: u8,
        data: &mut Cursor<'_>,
    ) -> Result<[u32; 3], MeshoptError> {
        let a = self.corner(first, data)?;
        let b = self.corner(pair >> 4, data)?;
        let c = self.corner(pair & 15, data)?;
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        for (vertex, nibble) in [(a, first), (b, pair >> 4), (c, pair & 15)] {
            if matches!(nibble, 0 | 15) {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }
}

/// `count` indices of a triangle list, `stride` bytes each.
pub(super) fn triangles(
    stream: &[u8],
    count: usize,
    stride: usize,
) -> Result<Vec<u8>, MeshoptError> {
    if !count.is_multiple_of(3) {
        return Err(MeshoptError::Count { count });
    }
    let mut cursor = Cursor(stream);
    match cursor.byte()? {
        0xe1 => {}
        found => return Err(MeshoptError::Header { found }),
    }
    let codes = cursor.take(count / 3)?;
    let data_size = cursor.0.len().checked_sub(16).ok_or(MeshoptError::Truncated)?;
    let (mut data, table) = (Cursor(cursor.take(data_size)?), cursor.0);
    let mut out = Output::new(count, stride);
    let mut state = Triangles::default();
    for &code in codes {
        let triangle = match code {
            0xfe | 0xff => {
                let pair = data.byte()?;
                if pair == 0 {
                    state.next = 0;
                }
                state.separate(if code == 0xfe { 0 } else { 15 }, pair, &mut data)?
            }
            0xf0.. => {
                let pair = table[usize::from(code & 15)];
                if pair >> 4 == 15 || pair & 15 == 15 {
                    return Err(MeshoptError::Code { code: pair });
                }
                state.separate(0, pair, &mut data)?
            }
            _ => state.continued(code, &mut data)?,
        };
        for index in triangle {
            out.push(index);
        }
    }
    data.finish()?;
    Ok(out.bytes)
}

/// `count` indices of any kind, `stride` bytes each.
pub(super) fn sequence(
    stream: &[u8],
    count: usize,
    stride: usize,
) -> Result<Vec<u8>, MeshoptError> {
    let mut cursor = Cursor(stream);
    match cursor.byte()? {
        0xd1 => {}
        found => return Err(MeshoptError::Header { found }),
    }
    let data_size = cursor.0.len().checked_sub(4).ok_or(MeshoptError::Truncated)?;
    // An index takes at least one byte.
    if count > data_size {
        return Err(MeshoptError::Truncated);
    }
    let mut data = Cursor(cursor.take(data_size)?);
    let mut out = Output::new(count, stride);
    let mut last = [0u32; 2];
    for _ in 0..count {
        let v = data.varint()?;
        let baseline = &mut last[(v & 1) as usize];
        *baseline = baseline.wrapping_add(zigzag(v >> 1));
        out.push(*baseline);
    }
    data.finish()?;
    Ok(out.bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(bytes: &[u8]) -> Vec<u32> {
        bytes.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect()
    }

    #[test]
    fn triangles_share_edges_and_vertices() {
        // A new triangle from the table's first pair; then edge 0 with a new vertex; then with an explicit vertex.
        let mut stream = vec![0xe1, 0xf0, 0x00, 0xfe];
        stream.extend([0x1f, 20]);
        stream.extend([0; 16]);
        let decoded = words(&triangles(&stream, 9, 4).unwrap());
        assert_eq!(decoded, [0, 1, 2, 0, 2, 3, 4, 3, 10]);
        for length in 0..stream.len() {
            assert!(triangles(&stream[..length], 9, 4).is_err());
        }
        assert_eq!(triangles(&stream, 8, 4), Err(MeshoptError::Count { count: 8 }));
        // There is no previous edge.
        stream[1] = 0;
        assert_eq!(triangles(&stream, 9, 4), Err(MeshoptError::Code { code: 0 }));
    }

    #[test]
    fn sequences_have_two_baselines() {
        let mut stream = vec![0xd1];
        // +5 and +3 on the first baseline, −2 on the second.
        stream.extend([5 << 2, 3 << 2, (1 << 2) | 2 | 1]);
        stream.extend([0; 4]);
        assert_eq!(words(&sequence(&stream, 3, 4).unwrap()), [5, 8, u32::MAX - 1]);
        assert_eq!(sequence(&stream, 3, 2).unwrap(), [5, 0, 8, 0, 0xfe, 0xff]);
        assert_eq!(sequence(&stream, 4, 4), Err(MeshoptError::Truncated));
        assert_eq!(sequence(&stream, 2, 4), Err(MeshoptError::TrailingBytes { bytes: 1 }));
        assert!(sequence(&stream, usize::MAX, 4).is_err());
    }
}
