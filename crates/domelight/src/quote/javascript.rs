//! JavaScript.

use super::{Code, JavaScript, comment_text, double_quoted};

/// A string literal.
pub fn string(text: &str) -> Code<JavaScript> {
    Code::generated(double_quoted(text))
}

/// Text after `//`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<JavaScript> {
    Code::generated(comment_text(text))
}
