//! Mode 0: elements coded as byte deltas, 16 elements per group.

use super::{Cursor, MeshoptError};

/// The number of elements whose deltas are packed together.
const GROUP: usize = 16;

/// The maximum number of elements in a block.
const MAX_BLOCK: usize = 256;

/// How the deltas of four consecutive bytes of an element are coded.
#[derive(Clone, Copy)]
enum Channel {
    /// Byte by byte, in zigzag.
    Bytes,
    /// As two 16-bit numbers, in zigzag.
    Words,
    /// As one 32-bit number by exclusive or, rotated left by `rotation` bits.
    Xor { rotation: u32 },
}

impl Channel {
    fn new(code: u8) -> Result<Self, MeshoptError> {
        match (code & 15, code >> 4) {
            (0, 0) => Ok(Self::Bytes),
            (1, 0) => Ok(Self::Words),
            (2, rotation) => Ok(Self::Xor { rotation: rotation.into() }),
            _ => Err(MeshoptError::Code { code }),
        }
    }
}

/// Decodes `count` elements of `stride` bytes, a multiple of four.
pub(super) fn decode(stream: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, MeshoptError> {
    let (&header, body) = stream.split_first().ok_or(MeshoptError::Truncated)?;
    let version = match header {
        0xa0 | 0xa1 => header & 1,
        found => return Err(MeshoptError::Header { found }),
    };
    // Split off the tail: padding, the element before the first, and the channels' modes.
    let n_channels = stride / 4;
    let (modes_size, least) = if version == 0 { (0, 32) } else { (n_channels, 24) };
    let tail_size = (stride + modes_size).max(least);
    let data_size = body.len().checked_sub(tail_size).ok_or(MeshoptError::Truncated)?;
    let (data, tail) = body.split_at(data_size);
    let (baseline, modes) = tail[tail_size - stride - modes_size..].split_at(stride);
    let mut channels = vec![Channel::Bytes; n_channels];
    for (channel, &code) in channels.iter_mut().zip(modes) {
        *channel = Channel::new(code)?;
    }

    let mut cursor = Cursor(data);
    let mut previous = baseline.to_vec();
    let mut elements = Vec::new();
    let block = ((8192 / stride) & !(GROUP - 1)).min(MAX_BLOCK);
    let mut left = count;
    // One array of deltas per byte of the element.
    let mut deltas = vec![[0; MAX_BLOCK]; stride];
    while left > 0 {
        let n = left.min(block);
        let n_groups = n.div_ceil(GROUP);
        let controls = if version == 0 { &[][..] } else { cursor.take(n_channels)? };
        for (k, deltas) in deltas.iter_mut().enumerate() {
            let deltas = &mut deltas[..n_groups * GROUP];
            let lengths = match controls.get(k / 4).map(|control| control >> (2 * (k % 4)) & 3) {
                None => [0, 2, 4, 8],
                Some(0) => [0, 1, 2, 4],
                Some(1) => [1, 2, 4, 8],
                Some(2) => {
                    deltas.fill(0);
                    continue;
                }
                Some(_) => {
                    deltas[..n].copy_from_slice(cursor.take(n)?);
                    continue;
                }
            };
            let headers = cursor.take(n_groups.div_ceil(4))?;
            for (group, deltas) in deltas.chunks_exact_mut(GROUP).enumerate() {
                let header = headers[group / 4] >> (2 * (group % 4)) & 3;
                unpack(&mut cursor, lengths[usize::from(header)], deltas)?;
            }
        }
        let begin = elements.len();
        elements.resize(begin + n * stride, 0);
        for (k, (channel, previous)) in channels.iter().zip(previous.as_chunks_mut().0).enumerate()
        {
            let deltas = &deltas[4 * k..4 * k + 4];
            for (i, element) in elements[begin..].chunks_exact_mut(stride).enumerate() {
                let delta = [deltas[0][i], deltas[1][i], deltas[2][i], deltas[3][i]];
                *previous = add(*channel, *previous, delta);
                element[4 * k..4 * k + 4].copy_from_slice(previous);
            }
        }
        left -= n;
    }
    cursor.finish()?;
    Ok(elements)
}

/// Unpacks the deltas of a group, `bits` each; all ones stand for an explicit byte after the group.
fn unpack(cursor: &mut Cursor<'_>, bits: u32, deltas: &mut [u8]) -> Result<(), MeshoptError> {
    match bits {
        0 => deltas.fill(0),
        8 => deltas.copy_from_slice(cursor.take(GROUP)?),
        _ => {
            let per_byte = 8 / bits as usize;
            let sentinel = (1u8 << bits) - 1;
            let packed = cursor.take(GROUP / per_byte)?;
            for (i, delta) in deltas.iter_mut().enumerate() {
                let place = (i % per_byte) as u32 * bits;
                // Single bits start at the lowest, wider codes at the highest.
                let shift = if bits == 1 { place } else { 8 - bits - place };
                *delta = packed[i / per_byte] >> shift & sentinel;
                if *delta == sentinel {
                    *delta = cursor.byte()?;
                }
            }
        }
    }
    Ok(())
}

fn add(channel: Channel, previous: [u8; 4], delta: [u8; 4]) -> [u8; 4] {
    match channel {
        Channel::Bytes => {
            let zigzag = |v: u8| (v >> 1) ^ (v & 1).wrapping_neg();
            std::array::from_fn(|i| previous[i].wrapping_add(zigzag(delta[i])))
        }
        Channel::Words => {
            let zigzag = |v: u16| (v >> 1) ^ (v & 1).wrapping_neg();
            let word = |b: [u8; 4], i: usize| u16::from_le_bytes([b[2 * i], b[2 * i + 1]]);
            let sum = |i| word(previous, i).wrapping_add(zigzag(word(delta, i))).to_le_bytes();
            let [[a, b], [c, d]] = [sum(0), sum(1)];
            [a, b, c, d]
        }
        Channel::Xor { rotation } => {
            let delta = u32::from_le_bytes(delta).rotate_right(rotation);
            (u32::from_le_bytes(previous) ^ delta).to_le_bytes()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The specification's example.
    #[test]
    fn four_bit_differences_with_sentinels() {
        let bytes = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let mut cursor = Cursor(&bytes);
        let mut deltas = [0; GROUP];
        unpack(&mut cursor, 4, &mut deltas).unwrap();
        cursor.finish().unwrap();
        let mut sums = Vec::new();
        for delta in deltas {
            sums.push(add(Channel::Bytes, [0; 4], [delta, 0, 0, 0])[0] as i8);
        }
        assert_eq!(sums, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
    }

    #[test]
    fn single_bits_begin_with_the_lowest() {
        let mut deltas = [0; GROUP];
        unpack(&mut Cursor(&[0b0000_0010, 0x80, 77, 78]), 1, &mut deltas).unwrap();
        let mut expected = [0; GROUP];
        (expected[1], expected[15]) = (77, 78);
        assert_eq!(deltas, expected);
    }

    #[test]
    fn words_and_rotated_words() {
        let a = add(Channel::Words, [0xff, 0xff, 0, 0], [2, 0, 1, 0]);
        assert_eq!(a, [0, 0, 0xff, 0xff]);
        let b =
            add(Channel::Xor { rotation: 4 }, [1, 0, 0, 0], 0x123u32.rotate_left(4).to_le_bytes());
        assert_eq!(b, 0x122u32.to_le_bytes());
        assert!(Channel::new(0x10).is_err() && Channel::new(3).is_err());
    }

    /// A stream of literal bytes, written out by hand.
    #[test]
    fn a_stream_of_literals() {
        let mut stream = vec![0xa1, 0xff];
        // Deltas of two elements by byte: 1, −1; 0, 0; 2, 2; 0, 0.
        stream.extend([2, 1, 0, 0, 4, 4, 0, 0]);
        stream.extend([0; 24 - 5]);
        stream.extend([10, 20, 30, 40, 0]);
        assert_eq!(decode(&stream, 2, 4).unwrap(), [11, 20, 32, 40, 10, 20, 34, 40]);
        for length in 0..stream.len() {
            assert!(decode(&stream[..length], 2, 4).is_err());
        }
        stream.insert(2, 0);
        assert_eq!(decode(&stream, 2, 4), Err(MeshoptError::TrailingBytes { bytes: 1 }));
        stream[0] = 0xa2;
        assert_eq!(decode(&stream, 2, 4), Err(MeshoptError::Header { found: 0xa2 }));
    }
}
