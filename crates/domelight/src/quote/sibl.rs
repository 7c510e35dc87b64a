//! Smart IBL sets, which have no way to write a double quote or a line break within a value.

use super::{Code, Sibl, comment_text};

/// A value in double quotes; none where the format has no way to write the text.
pub fn value(text: &str) -> Option<Code<Sibl>> {
    let holds = !text.contains(|c: char| c == '"' || c.is_control());
    holds.then(|| Code::generated(format!("\"{text}\"")))
}

/// A value to read: double quotes become single ones, what breaks a line a space.
pub fn caption(text: &str) -> Code<Sibl> {
    Code::generated(format!("\"{}\"", comment_text(text).replace('"', "'")))
}
