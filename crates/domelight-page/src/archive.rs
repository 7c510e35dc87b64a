//! Several files in one: a ZIP archive without compression.
//!
//! PKWARE, ".ZIP File Format Specification" (APPNOTE), 4.3. Files have no date of their own, so that the same files make the same
//! bytes. Sizes have 32 bits.

use flate2::Crc;

use crate::Error;
use crate::error::refused;

/// The first moment that the format knows, 1 January 1980 at midnight: time and date.
const MOMENT: [u16; 2] = [0, 1 << 5 | 1];

/// An archive in the making.
#[derive(Default)]
pub(crate) struct Archive {
    bytes: Vec<u8>,
    /// The entries of the directory that follows the files.
    directory: Vec<u8>,
    n_files: u16,
}

impl Archive {
    /// Adds a file; `name` is ASCII and has no slashes.
    ///
    /// # Errors
    /// If the archive would be larger than its format allows.
    pub(crate) fn add(&mut self, name: &str, content: &[u8]) -> Result<(), Error> {
        let too_large = || refused("the archive is larger than 4 GiB; take a smaller size");
        let offset = u32::try_from(self.bytes.len()).map_err(|_| too_large())?;
        let size = u32::try_from(content.len()).map_err(|_| too_large())?;
        offset.checked_add(size).and_then(|end| end.checked_add(1 << 20)).ok_or_else(too_large)?;
        let mut crc = Crc::new();
        crc.update(content);
        // Version 2.0, no flags, stored, the moment; checksum and sizes; the length of the name, nothing extra.
        let mut entry = shorts(&[20, 0, 0, MOMENT[0], MOMENT[1]]);
        entry.extend([crc.sum(), size, size].iter().flat_map(|word| word.to_le_bytes()));
        entry.extend(shorts(&[name.len() as u16, 0]));
        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&entry);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend(content);
        // Made by version 2.0; no comment, first disk, no attributes.
        self.directory.extend(b"PK\x01\x02");
        self.directory.extend(shorts(&[20]));
        self.directory.extend(&entry);
        self.directory.extend([0; 10]);
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.n_files += 1;
        Ok(())
    }

    /// The bytes of the file.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        let (start, length) = (self.bytes.len() as u32, self.directory.len() as u32);
        self.bytes.append(&mut self.directory);
        // One disk; the entries; the directory's size and place; no comment.
        self.bytes.extend(b"PK\x05\x06");
        self.bytes.extend(shorts(&[0, 0, self.n_files, self.n_files]));
        self.bytes.extend([length, start].iter().flat_map(|word| word.to_le_bytes()));
        self.bytes.extend([0; 2]);
        self.bytes
    }
}

fn shorts(numbers: &[u16]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn short(bytes: &[u8], at: usize) -> usize {
        usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
    }

    fn word(bytes: &[u8], at: usize) -> usize {
        short(bytes, at) | short(bytes, at + 2) << 16
    }

    /// Reads by the directory, as programs do.
    #[test]
    fn files_are_found_by_the_directory() {
        let files = [("a.txt", &b"123456789"[..]), ("empty", b""), ("b.bin", &[7; 3000])];
        let mut archive = Archive::default();
        for (name, content) in files {
            archive.add(name, content).unwrap();
        }
        let bytes = archive.finish();
        let end = bytes.len() - 22;
        assert_eq!(&bytes[end..end + 4], b"PK\x05\x06");
        assert_eq!(short(&bytes, end + 10), 3);
        let mut at = word(&bytes, end + 16);
        assert_eq!(at + word(&bytes, end + 12), end);
        for (name, content) in files {
            assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
            let (checksum, size) = (word(&bytes, at + 16), word(&bytes, at + 24));
            assert_eq!((short(&bytes, at + 10), size), (0, content.len()));
            if name == "a.txt" {
                // The check value of CRC-32.
                assert_eq!(checksum, 0xcbf4_3926);
            }
            let local = word(&bytes, at + 42);
            assert_eq!(&bytes[local..local + 4], b"PK\x03\x04");
            assert_eq!(word(&bytes, local + 14), checksum);
            let start = local + 30 + short(&bytes, local + 26);
            assert_eq!(&bytes[local + 30..start], name.as_bytes());
            assert_eq!(&bytes[start..start + size], content);
            assert_eq!(&bytes[at + 46..at + 46 + name.len()], name.as_bytes());
            at += 46 + name.len();
        }
        assert_eq!(at, end);
    }
}
