//! The container: a JSON text, or a GLB file with a JSON chunk and a binary chunk.

use super::error::GltfErrorKind;

/// The document and the binary chunk of a GLB file, without a copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Splits a file into its chunks.
    pub(super) fn new(file: &'a [u8]) -> Result<Self, GltfErrorKind> {
        let Some(header) = file.strip_prefix(b"glTF") else {
            // Some exporters write a byte order mark.
            let json = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
            return Ok(Self { json, binary: None });
        };
        let damaged = |problem: &str| GltfErrorKind::Container { problem: problem.into() };
        let (words, _) = header.as_chunks::<4>();
        let [version, length, ..] = words else { return Err(damaged("it ends in the header")) };
        match u32::from_le_bytes(*version) {
            2 => {}
            1 => return Err(GltfErrorKind::Version1),
            version => return Err(GltfErrorKind::Version { version: version.to_string() }),
        }
        let length = u32::from_le_bytes(*length);
        let within = usize::try_from(length).ok().and_then(|length| file.get(12..length));
        let Some(mut rest) = within else {
            let problem = format!("the header says {length} bytes, the file has {}", file.len());
            return Err(GltfErrorKind::Container { problem });
        };
        let Some((kind, json)) = chunk(&mut rest)? else { return Err(damaged("it has no chunk")) };
        if &kind != b"JSON" {
            return Err(damaged("its first chunk is not the JSON"));
        }
        let mut binary = None;
        while binary.is_none()
            && let Some((kind, data)) = chunk(&mut rest)?
        {
            if &kind == b"BIN\0" {
                binary = Some(data);
            }
        }
        Ok(Self { json, binary })
    }
}

/// A chunk's kind and its data.
type Chunk<'a> = ([u8; 4], &'a [u8]);

/// Splits off the next chunk: its kind and its data.
fn chunk<'a>(rest: &mut &'a [u8]) -> Result<Option<Chunk<'a>>, GltfErrorKind> {
    // Fewer bytes than a header are padding.
    let Some((header, data)) = rest.split_at_checked(8) else { return Ok(None) };
    let [length, kind] = [0, 4].map(|i| [header[i], header[i + 1], header[i + 2], header[i + 3]]);
    let length = u32::from_le_bytes(length);
    let (data, after) = data.split_at_checked(length as usize).ok_or_else(|| {
        let problem = format!("a chunk of {length} bytes where {} are left", data.len());
        GltfErrorKind::Container { problem }
    })?;
    *rest = after;
    Ok(Some((kind, data)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(version: u32, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut body = Vec::new();
        for (kind, data) in chunks {
            body.extend((data.len() as u32).to_le_bytes());
            body.extend(*kind);
            body.extend(*data);
        }
        let mut file = b"glTF".to_vec();
        file.extend(version.to_le_bytes());
        file.extend((12 + body.len() as u32).to_le_bytes());
        file.extend(body);
        file
    }

    #[test]
    fn chunks_are_split_and_unknown_ones_skipped() {
        let file = glb(2, &[(b"JSON", b"{}  "), (b"TEST", b"????"), (b"BIN\0", b"1234")]);
        let container = Container::new(&file).unwrap();
        assert_eq!(container, Container { json: b"{}  ", binary: Some(b"1234") });
        for length in 4..file.len() {
            assert!(Container::new(&file[..length]).is_err(), "{length}");
        }
        let text = Container::new(b"\xef\xbb\xbf{}").unwrap();
        assert_eq!(text, Container { json: b"{}", binary: None });
    }

    #[test]
    fn other_versions_are_named() {
        let error = |file: &[u8]| Container::new(file).unwrap_err().to_string();
        assert!(error(&glb(1, &[(b"JSON", b"{}")])).contains("1.0"));
        assert!(error(&glb(3, &[(b"JSON", b"{}")])).contains("glTF 3"));
        assert!(error(&glb(2, &[(b"BIN\0", b"{}")])).contains("JSON"));
        assert!(error(&glb(2, &[])).contains("chunk"));
    }
}
