//! Scenes of Radiance.

use super::{Code, Radiance, comment_text};

/// A word in quotes of the kind that is not in it; none for controls and for text with both kinds.
pub fn word(text: &str) -> Option<Code<Radiance>> {
    let quote = ['"', '\''].into_iter().find(|&quote| !text.contains(quote))?;
    (!text.contains(char::is_control)).then(|| Code::generated(format!("{quote}{text}{quote}")))
}

/// Text after `#`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<Radiance> {
    Code::generated(comment_text(text))
}
