//! A terminal, which obeys what it is sent.

use super::{is_invisible, replaced};

/// A line in which nothing commands the terminal: what is invisible stands there as `\u{1b}`, a line break as `\n`.
pub fn line(text: &str) -> String {
    visible(text, |_| false)
}

/// The same of text with lines and tabs.
pub fn lines(text: &str) -> String {
    visible(text, |c| matches!(c, '\n' | '\t'))
}

/// The same of JSON, which stays what it is.
pub fn json(text: &str) -> String {
    // Line breaks and tabs are between its values, all else in strings.
    let is_escaped = |c| is_invisible(c) && !matches!(c, '\n' | '\r' | '\t');
    replaced(text, |c| is_escaped(c).then(|| format!("\\u{:04x}", u32::from(c))))
}

fn visible(text: &str, kept: impl Fn(char) -> bool) -> String {
    replaced(text, |c| (is_invisible(c) && !kept(c)).then(|| c.escape_default().to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_commands_the_terminal() {
        assert_eq!(
            line("a\x1b]0;b\x07\u{9b}1m\r\n\u{202e}é🌞\\"),
            "a\\u{1b}]0;b\\u{7}\\u{9b}1m\\r\\n\\u{202e}é🌞\\"
        );
        let text = "é\u{9b}\u{202e}\"\n\u{2028}";
        let shown = json(&serde_json::to_string_pretty(&[text]).unwrap());
        assert!(!shown.contains(|c| c != '\n' && is_invisible(c)), "{shown}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&shown).unwrap(), [text]);
        assert_eq!(lines("a\tb\nc\r\x1b[2J"), "a\tb\nc\\r\\u{1b}[2J");
    }
}
