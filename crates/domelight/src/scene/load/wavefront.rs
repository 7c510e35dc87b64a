//! Lines of Wavefront's text formats OBJ and MTL: a keyword followed by numbers or names.

use std::borrow::Cow;

use super::{line_end, text_of};

/// An error in a line of an OBJ or MTL file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjErrorKind {
    /// Not enough numbers.
    #[error("{keyword} needs {needed} numbers, but there are only {found}")]
    TooFew {
        /// The line's keyword.
        keyword: String,
        /// How many it needs.
        needed: usize,
        /// How many there are.
        found: usize,
    },
    /// A word that is not a number.
    #[error("'{text}' is not a finite number")]
    NotANumber {
        /// The word.
        text: String,
    },
    /// A face with a corner that cannot be read.
    #[error("'{text}' is not a face corner; write v, v/vt, v//vn or v/vt/vn")]
    Corner {
        /// The corner.
        text: String,
    },
    /// An index that is not defined yet.
    #[error("index {index} refers to no {what}; {count} are defined so far")]
    Index {
        /// The index as written.
        index: i64,
        /// What it should name.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A face with fewer than three corners.
    #[error("a face needs three corners or more, but there are {corners}")]
    Face {
        /// How many it has.
        corners: usize,
    },
    /// A keyword without its name.
    #[error("{keyword} needs a name")]
    Name {
        /// The keyword.
        keyword: String,
    },
    /// A material's property before any material.
    #[error("{keyword} comes before the first newmtl")]
    NoMaterial {
        /// The keyword.
        keyword: String,
    },
}

/// The lines of an OBJ or MTL file with their numbers from 1; one that ends in a backslash goes on in the next.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let end = line_end(bytes);
    let mut rest = bytes.split(move |&b| b == end).enumerate();
    std::iter::from_fn(move || {
        let (index, first) = rest.next()?;
        let Some(begin) = continued(first) else { return Some((index + 1, text_of(first))) };
        let mut whole = begin.to_vec();
        for (_, next) in rest.by_ref() {
            whole.push(b' ');
            let Some(part) = continued(next) else {
                whole.extend(next);
                break;
            };
            whole.extend(part);
        }
        Some((index + 1, Cow::Owned(text_of(&whole).into_owned())))
    })
}

/// What stands before the backslash at the end of a line.
fn continued(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

/// The words of a line before its comment.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_whitespace().take_while(|word| !word.starts_with('#'))
}

/// A file name without the quotation marks that some exporters put around it.
pub(super) fn unquoted(name: &str) -> &str {
    let inner = name.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    inner.map_or(name, str::trim)
}

/// All numbers after a keyword, at least `needed`.
pub(super) fn numbers(keyword: &str, rest: &str, needed: usize) -> Result<Vec<f32>, ObjErrorKind> {
    enough(keyword, words(rest).map(number).collect::<Result<_, _>>()?, needed)
}

pub(super) fn enough(
    keyword: &str,
    numbers: Vec<f32>,
    needed: usize,
) -> Result<Vec<f32>, ObjErrorKind> {
    if numbers.len() < needed {
        let found = numbers.len();
        return Err(ObjErrorKind::TooFew { keyword: keyword.into(), needed, found });
    }
    Ok(numbers)
}

pub(super) fn number(word: &str) -> Result<f32, ObjErrorKind> {
    let not_a_number = || ObjErrorKind::NotANumber { text: word.chars().take(40).collect() };
    // Some exporters write the sign before the e.
    let swapped = || word.replace("+e", "e+").replace("-e", "e-").parse().ok();
    word.parse().ok().or_else(swapped).filter(|v: &f32| v.is_finite()).ok_or_else(not_a_number)
}
