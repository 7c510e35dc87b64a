//! The POSIX shell.

use super::{Code, Shell};

/// A word as it is where that is plain, else in single quotes.
///
/// No two braces are neighbors in it: templates of Open Job Description replace what stands in double ones, wherever.
pub fn word(word: &str) -> Code<Shell> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return Code::generated(word.to_owned());
    }
    let mut quoted = String::with_capacity(word.len() + 2);
    quoted.push('\'');
    let mut last = ' ';
    for c in word.chars() {
        match c {
            '\'' => quoted += r"'\''",
            '{' | '}' if c == last => quoted.extend(['\'', '\'', c]),
            c => quoted.push(c),
        }
        last = c;
    }
    quoted.push('\'');
    Code::generated(quoted)
}

/// Words with spaces between them.
pub fn words<S: AsRef<str>>(words: impl IntoIterator<Item = S>) -> Code<Shell> {
    Code::join(words.into_iter().map(|text| word(text.as_ref())), " ")
}
