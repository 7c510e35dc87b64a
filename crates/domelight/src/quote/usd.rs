//! OpenUSD as text.

use super::{Code, Usd, escaped};

/// A string in double quotes.
pub fn string(text: &str) -> Code<Usd> {
    // Escapes stand for bytes: characters of more than one byte stay as they are.
    let escape = |c: char| c.is_ascii_control().then(|| format!("\\x{:02x}", u32::from(c)));
    Code::generated(escaped(text, escape))
}

/// An asset path; none where USD has no way to write it.
pub fn asset(path: &str) -> Option<Code<Usd>> {
    // OpenUSD reads backslashes as separators.
    if path.contains(|c: char| c.is_control() || c == '\\') {
        return None;
    }
    if !path.contains('@') {
        return Some(Code::generated(format!("@{path}@")));
    }
    // Three in a row are escaped, and no more than two may stand before the end.
    Some(Code::generated(format!("@@@{}@@@", path.replace("@@@", "\\@@@"))))
}
