//! Python.
//!
//! A comment in one of the first two lines may name the file's encoding (PEP 263): foreign text comes after them.

use super::{Code, Python, comment_text, double_quoted};

/// A string literal.
pub fn string(text: &str) -> Code<Python> {
    Code::generated(double_quoted(text))
}

/// Text after `#`, from the third line on; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<Python> {
    Code::generated(comment_text(text))
}
