//! Scenes of Godot 4.

use super::{Code, Godot, comment_text, double_quoted};

/// A string in double quotes.
pub fn string(text: &str) -> Code<Godot> {
    Code::generated(double_quoted(text))
}

/// The path of a resource, from the scene's folder; none where Godot would read a scheme.
pub fn path(path: &str) -> Option<Code<Godot>> {
    (!path.contains("://")).then(|| string(path))
}

/// Text after `;`; what breaks a line becomes a space.
pub fn comment(text: &str) -> Code<Godot> {
    Code::generated(comment_text(text))
}
