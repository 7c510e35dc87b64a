//! OpenUSD as text.

use std::fmt::Write as _;

use super::{Code, Usd};

/// A string in double quotes.
pub fn string(text: &str) -> Code<Usd> {
    let mut quoted = String::with_capacity(text.len() + 2);
    quoted.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted += "\\n",
            '\r' => quoted += "\\r",
            '\t' => quoted += "\\t",
            // Escapes are of bytes: what has more than one stays as it is.
            c if c.is_ascii_control() => {
                let _ = write!(quoted, "\\x{:02x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    Code::generated(quoted)
}

/// An asset path; none where USD has no way to write it.
pub fn asset(path: &str) -> Option<Code<Usd>> {
    if path.contains(char::is_control) {
        return None;
    }
    if !path.contains('@') {
        return Some(Code::generated(format!("@{path}@")));
    }
    // Three in a row are escaped, and no more than two may stand before the end.
    Some(Code::generated(format!("@@@{}@@@", path.replace("@@@", "\\@@@"))))
}
