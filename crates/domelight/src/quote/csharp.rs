//! C#.

use super::{CSharp, Code, comment_text, double_quoted};

/// A string literal.
pub fn string(text: &str) -> Code<CSharp> {
    Code::generated(double_quoted(text))
}

/// Text after `//`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<CSharp> {
    Code::generated(comment_text(text))
}
