//! XML 1.0.

use super::{Code, Xml, comment_text};

/// Text within an element, or an attribute's value in quotes. What XML cannot hold ([`holds`]) becomes U+FFFD.
pub fn text(text: &str) -> Code<Xml> {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\'' => escaped += "&#39;",
            // As they are, readers take them for spaces or line ends.
            '\t' => escaped += "&#9;",
            '\n' => escaped += "&#10;",
            '\r' => escaped += "&#13;",
            c if is_char(c) => escaped.push(c),
            _ => escaped.push('\u{fffd}'),
        }
    }
    Code::generated(escaped)
}

/// Text within `<!--` and `-->`: hyphens become U+2010, what XML cannot hold and what breaks a line a space.
pub fn comment(text: &str) -> Code<Xml> {
    Code::generated(comment_text(text).replace('-', "\u{2010}"))
}

/// Whether XML can hold the text.
pub fn holds(text: &str) -> bool {
    text.chars().all(is_char)
}

/// Production 2 of XML 1.0.
fn is_char(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
}
