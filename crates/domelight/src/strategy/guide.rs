//! What a strategy has learned, as bytes: a render that goes on from a file needs it to the bit.

/// Learned state that can be written and read back.
pub trait Guide: Default + Send {
    /// Appends the state; the bytes tell where they end.
    fn write(&self, out: &mut Vec<u8>);

    /// Takes the state of a tile of `width` × `height` pixels off the front; none if it is not whole, or of another.
    fn read(bytes: &mut &[u8], width: usize, height: usize) -> Option<Self>;
}

/// Nothing learned.
impl Guide for () {
    fn write(&self, _: &mut Vec<u8>) {}

    fn read(_: &mut &[u8], _: usize, _: usize) -> Option<Self> {
        Some(())
    }
}

/// Appends a whole number, seven bits a byte, the lowest first.
pub(super) fn write_number(mut number: u32, out: &mut Vec<u8>) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// Takes a whole number off the front.
pub(super) fn read_number(bytes: &mut &[u8]) -> Option<u32> {
    let mut number = 0;
    for shift in (0..32).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u32::from(byte & 0x7f).checked_shl(shift)?;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

/// Appends a list in which zeros are common: its length, and after each zero how many follow it.
pub(super) fn write_sparse(numbers: &[u32], out: &mut Vec<u8>) {
    write_number(numbers.len() as u32, out);
    for run in numbers.chunk_by(|a, b| *a == 0 && *b == 0) {
        write_number(run[0], out);
        if run[0] == 0 {
            write_number(run.len() as u32 - 1, out);
        }
    }
}

/// Takes a list of at most `most` numbers off the front.
pub(super) fn read_sparse(bytes: &mut &[u8], most: usize) -> Option<Vec<u32>> {
    let length = read_number(bytes)? as usize;
    if length > most {
        return None;
    }
    let mut numbers = Vec::with_capacity(length);
    while numbers.len() < length {
        let number = read_number(bytes)?;
        let follow = if number == 0 { read_number(bytes)? as usize } else { 0 };
        if follow >= length - numbers.len() {
            return None;
        }
        numbers.resize(numbers.len() + 1 + follow, number);
    }
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_come_back() {
        let lists: [&[u32]; 5] = [&[], &[0], &[7, 0, 0, 0, u32::MAX], &[0, 0, 1, 0], &[127, 128]];
        let mut bytes = Vec::new();
        for list in lists {
            write_sparse(list, &mut bytes);
        }
        let mut rest = &bytes[..];
        for list in lists {
            assert_eq!(read_sparse(&mut rest, 5).as_deref(), Some(list));
        }
        assert!(rest.is_empty());
        for end in 0..bytes.len() {
            let mut cut = &bytes[..end];
            while read_sparse(&mut cut, 5).is_some() {}
        }
        assert_eq!(read_sparse(&mut &[2, 0, 9][..], 5), None);
        assert_eq!(read_sparse(&mut &[9, 0, 8][..], 5), None);
    }
}
