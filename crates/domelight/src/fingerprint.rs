//! Fingerprints of the content that decides a picture. Two scenes or environments with the same fingerprint
//! are equal, wherever their files are.

use std::fmt;
use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

/// 128 bits of a BLAKE3 hash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint([u8; 16]);

/// 32 hexadecimal digits.
impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Hashes content, one array after the other, each with its length.
#[derive(Clone, Debug, Default)]
pub struct Fingerprinter {
    hasher: blake3::Hasher,
}

impl Fingerprinter {
    /// Hashes bytes.
    pub fn bytes(&mut self, bytes: impl IntoIterator<Item = u8>) {
        let mut buffer = [0; 4096];
        let (mut filled, mut length) = (0, 0u64);
        for byte in bytes {
            buffer[filled] = byte;
            filled += 1;
            length += 1;
            if filled == buffer.len() {
                self.hasher.update(&buffer);
                filled = 0;
            }
        }
        self.hasher.update(&buffer[..filled]);
        self.hasher.update(&length.to_le_bytes());
    }

    /// Hashes the bytes of a file, piece by piece.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn file(&mut self, path: &Path) -> io::Result<()> {
        let mut file = File::open(path)?;
        let mut buffer = vec![0; 1 << 16];
        let mut length = 0u64;
        loop {
            let n = match file.read(&mut buffer) {
                Ok(n) => n,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            if n == 0 {
                self.hasher.update(&length.to_le_bytes());
                return Ok(());
            }
            self.hasher.update(&buffer[..n]);
            length += n as u64;
        }
    }

    /// Hashes the bits of floats.
    pub fn numbers(&mut self, numbers: impl IntoIterator<Item = f32>) {
        self.words(numbers.into_iter().map(f32::to_bits));
    }

    /// Hashes integers.
    pub fn words(&mut self, words: impl IntoIterator<Item = u32>) {
        self.bytes(words.into_iter().flat_map(u32::to_le_bytes));
    }

    /// Hashes text. The `Debug` text of numbers is exact in Rust, so the `Debug` text of plain data is suitable.
    pub fn text(&mut self, text: impl fmt::Display) {
        self.bytes(text.to_string().into_bytes());
    }

    /// The fingerprint of the content so far.
    pub fn finish(&self) -> Fingerprint {
        let mut short = [0; 16];
        short.copy_from_slice(&self.hasher.finalize().as_bytes()[..16]);
        Fingerprint(short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(parts: &[&[u8]]) -> Fingerprint {
        let mut fingerprinter = Fingerprinter::default();
        for part in parts {
            fingerprinter.bytes(part.iter().copied());
        }
        fingerprinter.finish()
    }

    #[test]
    fn content_and_its_division_both_count() {
        assert_eq!(of(&[b"ab", b"c"]), of(&[b"ab", b"c"]));
        assert_ne!(of(&[b"ab", b"c"]), of(&[b"a", b"bc"]));
        assert_ne!(of(&[b"ab"]), of(&[b"ab", b""]));
        let long = vec![7; 10_000];
        assert_ne!(of(&[&long]), of(&[&long[1..]]));
        assert_eq!(of(&[]).to_string().len(), 32);
    }
}
