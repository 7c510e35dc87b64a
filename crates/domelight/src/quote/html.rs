//! HTML.

use super::{Code, Html, xml};

/// Text within an element, or an attribute's value in double quotes. What HTML cannot hold becomes U+FFFD.
pub fn text(text: &str) -> Code<Html> {
    // What XML can hold HTML holds as well, written alike.
    Code::generated(xml::text(text).into_string())
}

/// JSON within a `script` element: it can neither end the element nor begin a comment.
pub fn script_data(json: &serde_json::Value) -> Code<Html> {
    // Within JSON these stand in strings alone.
    let json = json.to_string().replace('<', "\\u003c");
    Code::generated(json.replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029"))
}
