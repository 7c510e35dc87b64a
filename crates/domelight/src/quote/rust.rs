//! Rust.

use super::{Code, Rust, comment_text, escaped, is_invisible};

/// A string literal.
pub fn string(text: &str) -> Code<Rust> {
    Code::generated(escaped(text, |c| {
        is_invisible(c).then(|| format!("\\u{{{:x}}}", u32::from(c)))
    }))
}

/// Text after `//`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<Rust> {
    Code::generated(comment_text(text))
}
