//! HTML.

use super::{Code, Html, directs_writing, replaced, xml};

/// Text within an element, or an attribute's value in double quotes. What HTML cannot hold becomes U+FFFD, and marks of
/// writing direction stand there as `\u{202e}`.
pub fn text(text: &str) -> Code<Html> {
    // What XML can hold HTML holds as well, written alike.
    let visible = replaced(text, |c| directs_writing(c).then(|| c.escape_unicode().to_string()));
    Code::generated(xml::text(&visible).into_string())
}

/// JSON within a `script` element: it can neither end the element nor begin a comment. In its strings, marks of writing
/// direction stand as in [`text`].
pub fn script_data(json: &serde_json::Value) -> Code<Html> {
    // Within JSON these stand in strings alone.
    let visible = |c| directs_writing(c).then(|| format!(r"\{}", c.escape_unicode()));
    let json = replaced(&json.to_string(), visible).replace('<', "\\u003c");
    Code::generated(json.replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mark_turns_the_writing() {
        for mark in ('\u{61c}'..='\u{2069}').filter(|&c| directs_writing(c)) {
            let (name, shown) = (format!("a{mark}b"), format!("a\\u{{{:x}}}b", u32::from(mark)));
            assert_eq!(text(&name).as_str(), shown);
            let data = script_data(&serde_json::json!({ "name": name }));
            let data: serde_json::Value = serde_json::from_str(data.as_str()).unwrap();
            assert_eq!(data["name"], shown);
        }
    }
}
