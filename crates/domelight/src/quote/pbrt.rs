//! Scenes of pbrt-v4.

use super::{Code, Pbrt, comment_text};

/// A string in double quotes; none where pbrt has no way to write the text.
pub fn string(text: &str) -> Option<Code<Pbrt>> {
    let holds = !text.chars().any(|c| c.is_control() && !matches!(c, '\n' | '\r' | '\t'));
    let text = text.replace('\\', "\\\\").replace('"', "\\\"");
    let text = text.replace('\n', "\\n").replace('\r', "\\r").replace('\t', "\\t");
    holds.then(|| Code::generated(format!("\"{text}\"")))
}

/// Text after `#`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<Pbrt> {
    Code::generated(comment_text(text))
}
