//! Sources of bytes: buffers and buffer views, which may be compressed.
//!
//! Buffers are read on first use. So the fallback buffer of a compressed view, which often has no data, is never read.

use std::borrow::Cow;
use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashMap;
use std::ops::Deref;
use std::path::Path;
use std::rc::Rc;

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

use super::container::Container;
use super::error::{Failure, GltfErrorKind};
use super::json::{Buffer, BufferView, Document};
use super::meshopt;
use crate::scene::load::{Budget, read_referenced, relative};

/// The maximum total number of implicit zeros in accessors, over all meshes and their instances.
const MAX_ZEROS: usize = 1 << 24;

/// The document, and the bytes that it refers to.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    pub(super) document: Document<'a>,
    pub(super) budget: &'a Budget<'a>,
    /// Whether missing data are an error instead of a warning.
    pub(super) strict: bool,
    binary: Option<&'a [u8]>,
    buffers: Vec<OnceCell<Cow<'a, [u8]>>>,
    /// Decompressed views.
    decoded: RefCell<HashMap<usize, Rc<[u8]>>>,
    /// The remainder of [`MAX_ZEROS`].
    zeros_left: Cell<usize>,
    warnings: RefCell<Vec<String>>,
}

/// The bytes of a buffer view.
pub(super) enum ViewBytes<'b> {
    Plain(&'b [u8]),
    Decoded(Rc<[u8]>),
}

impl Deref for ViewBytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Plain(bytes) => bytes,
            Self::Decoded(bytes) => bytes,
        }
    }
}

impl<'a> Source<'a> {
    /// Opens a file without reading any other.
    pub(super) fn new(
        path: &'a Path,
        bytes: &'a [u8],
        budget: &'a Budget<'a>,
    ) -> Result<Self, Failure> {
        let Container { json, binary } = Container::new(bytes)?;
        // An array item is stored as a reference of 16 bytes.
        let most_items = json.iter().map(|&b| u64::from(b == b',')).sum::<u64>();
        budget.take(&path.display().to_string(), 16 * most_items)?;
        let document = Document::new(json)?;
        let buffers = (0..document.count::<Buffer>()).map(|_| OnceCell::new()).collect();
        Ok(Self {
            path,
            document,
            budget,
            strict: false,
            binary,
            buffers,
            decoded: RefCell::default(),
            zeros_left: Cell::new(MAX_ZEROS),
            warnings: RefCell::default(),
        })
    }

    /// Records a warning once, up to a maximum number of warnings.
    pub(super) fn warn(&self, text: &str) {
        const MAX_WARNINGS: usize = 100;
        let text = format!("{}: {text}", self.path.display());
        let mut warnings = self.warnings.borrow_mut();
        if warnings.len() < MAX_WARNINGS && !warnings.contains(&text) {
            warnings.push(text);
        }
    }

    /// The recorded warnings.
    pub(super) fn into_warnings(self) -> Vec<String> {
        self.warnings.into_inner()
    }

    /// Takes `count` implicit zeros from the file's budget, and returns whether it sufficed.
    pub(super) fn take_zeros(&self, count: usize) -> bool {
        let left = self.zeros_left.get().checked_sub(count);
        if let Some(left) = left {
            self.zeros_left.set(left);
        }
        left.is_some()
    }

    /// Names the file and an object in it that refers to another file, for messages.
    pub(super) fn referrer(&self, what: &str) -> String {
        format!("{}, {what},", self.path.display())
    }

    fn buffer(&self, index: usize) -> Result<&[u8], Failure> {
        let Some(cell) = self.buffers.get(index) else {
            let (what, count) = ("buffer", self.buffers.len());
            return Err(GltfErrorKind::NoSuch { what, index, count }.into());
        };
        if let Some(bytes) = cell.get() {
            return Ok(bytes);
        }
        let Buffer { uri, byte_length } = self.document.get(index)?;
        let bytes = match (&uri, self.binary) {
            (Some(uri), _) => Cow::Owned(self.uri("buffer", index, uri)?),
            (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
            (None, _) => return Err(GltfErrorKind::NoSource { what: "buffer", index }.into()),
        };
        if (bytes.len() as u64) < byte_length {
            let length = bytes.len();
            self.warn(&format!("buffer {index} has only {length} of its {byte_length} bytes"));
        }
        Ok(cell.get_or_init(|| bytes))
    }

    /// The data of a URI: embedded, or in a file.
    pub(super) fn uri(
        &self,
        what: &'static str,
        index: usize,
        uri: &str,
    ) -> Result<Vec<u8>, Failure> {
        let refused = || {
            let uri = uri.chars().take(60).collect();
            Failure::from(GltfErrorKind::Uri { what, index, uri })
        };
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, encoded) = data.split_once(";base64,").ok_or_else(refused)?;
            // Padding is often missing.
            let config = GeneralPurposeConfig::new()
                .with_decode_padding_mode(DecodePaddingMode::Indifferent);
            let problem = |source| GltfErrorKind::Base64 { what, index, source };
            let bytes = GeneralPurpose::new(&base64::alphabet::STANDARD, config)
                .decode(encoded.trim())
                .map_err(problem)?;
            return Ok(bytes);
        }
        if uri.contains("://") {
            return Err(refused());
        }
        let referrer = self.referrer(&format!("{what} {index}"));
        let path = relative(self.path, &percent_decoded(uri));
        Ok(read_referenced(&path, &referrer, self.budget)?)
    }

    /// The bytes of a buffer view, decompressed, and their stride if it has one.
    pub(super) fn view(&self, index: usize) -> Result<(ViewBytes<'_>, Option<usize>), Failure> {
        let view: BufferView = self.document.get(index)?;
        let BufferView { buffer, byte_offset, byte_length, byte_stride, extensions } = &view;
        let Some(c) = extensions.compression() else {
            let bytes = self.buffer(*buffer)?;
            let bytes = slice(bytes, *byte_offset, *byte_length, "buffer view", index)?;
            return Ok((ViewBytes::Plain(bytes), *byte_stride));
        };
        if let Some(bytes) = self.decoded.borrow().get(&index) {
            return Ok((ViewBytes::Decoded(bytes.clone()), *byte_stride));
        }
        let stream = self.buffer(c.buffer)?;
        let stream = slice(stream, c.byte_offset, c.byte_length, "buffer view", index)?;
        let place = format!("{}, buffer view {index}", self.path.display());
        self.budget.take(&place, (c.count as u64).saturating_mul(c.byte_stride as u64))?;
        let problem = |source| GltfErrorKind::Meshopt { view: index, source };
        let bytes: Rc<[u8]> = meshopt::decode(stream, c).map_err(problem)?.into();
        self.decoded.borrow_mut().insert(index, bytes.clone());
        Ok((ViewBytes::Decoded(bytes), *byte_stride))
    }
}

/// A slice of `length` bytes starting at `begin`.
pub(super) fn slice<'b>(
    bytes: &'b [u8],
    begin: u64,
    length: u64,
    what: &'static str,
    index: usize,
) -> Result<&'b [u8], GltfErrorKind> {
    let end = begin.saturating_add(length);
    let range = usize::try_from(begin).ok().zip(usize::try_from(end).ok());
    range.and_then(|(begin, end)| bytes.get(begin..end)).ok_or(GltfErrorKind::OutOfRange {
        what,
        index,
        begin,
        end,
        length: bytes.len(),
    })
}

/// Decodes percent escapes such as `%20` in a URI's path; invalid escapes stay.
pub(super) fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let code = uri.get(i + 1..i + 3).filter(|_| bytes[i] == b'%');
        if let Some(byte) = code.and_then(|c| u8::from_str_radix(c, 16).ok()) {
            out.push(byte);
            i += 3;
        } else {
            out.push(bytes[i]);
            i += 1;
        }
    }
    String::from_utf8(out).unwrap_or_else(|_| uri.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_stand_for_bytes() {
        assert_eq!(percent_decoded("a%20b%C3%A9.png"), "a bé.png");
        assert_eq!(percent_decoded("50%.png"), "50%.png");
        assert_eq!(percent_decoded("%zz%f"), "%zz%f");
    }

    fn source<'a>(json: &'a str, budget: &'a Budget<'a>) -> Source<'a> {
        Source::new(Path::new("a.gltf"), json.as_bytes(), budget).ok().expect("a document")
    }

    /// A stream of two elements in mode 0, with a fallback without data.
    #[test]
    fn compressed_views_ask_no_fallback() {
        let json = r#"{"buffers":[{"byteLength":8},{"byteLength":34,"uri":"data:;base64,of8CAQAABAQAAAAAAAAAAAAAAAAAAAAAAAAAAAAKFB4oAA"}],
"bufferViews":[{"buffer":0,"byteLength":8,"extensions":{"KHR_meshopt_compression":
 {"buffer":1,"byteLength":34,"byteStride":4,"count":2,"mode":"ATTRIBUTES"}}},{"buffer":0,"byteLength":1}]}"#;
        let budget = Budget::unlimited();
        let source = source(json, &budget);
        let Ok((view, stride)) = source.view(0) else { panic!() };
        assert_eq!((&*view, stride), (&[11, 20, 32, 40, 10, 20, 34, 40][..], None));
        let Err(Failure::Problem(problem)) = source.view(1) else { panic!() };
        assert!(problem.to_string().contains("buffer 0 has no data"));
    }

    #[test]
    fn short_buffers_are_used_as_far_as_they_go() {
        let json = r#"{"buffers":[{"byteLength":9,"uri":"data:;base64,AQID"}],
"bufferViews":[{"buffer":0,"byteOffset":1,"byteLength":2},{"buffer":0,"byteLength":4}]}"#;
        let budget = Budget::unlimited();
        let source = source(json, &budget);
        assert!(matches!(source.view(0), Ok((view, None)) if *view == [2, 3]));
        assert!(source.view(1).is_err() && source.view(2).is_err());
        let warnings = source.into_warnings();
        assert!(warnings.len() == 1 && warnings[0].contains("buffer 0 has only 3 of its 9 bytes"));
    }
}
