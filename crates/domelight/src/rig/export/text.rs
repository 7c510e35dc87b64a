//! Names and paths within other languages.

use crate::math::Vec3;

/// For a comment that ends with its line: no line breaks, no control characters.
pub(super) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// A literal in double quotes that JSON, JavaScript and Python read alike.
pub(super) fn quoted(text: &str) -> String {
    serde_json::to_string(text).expect("text is JSON")
}

/// Three numbers with `separator` between them.
pub(super) fn numbers([a, b, c]: [f32; 3], separator: &str) -> String {
    format!("{a}{separator}{b}{separator}{c}")
}

/// The numbers of a vector, none of them a negative zero.
pub(super) fn vector(v: Vec3) -> [f32; 3] {
    (v + Vec3::ZERO).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_on_its_line_and_in_its_quotes() {
        assert_eq!(one_line("a\r\nb\u{85}"), "a  b ");
        assert_eq!(quoted("a\"\\\n"), r#""a\"\\\n""#);
        assert_eq!(numbers(vector(-Vec3::ZERO), ", "), "0, 0, 0");
    }
}
