//! Words for a POSIX shell.

/// The word as it is where that is plain, else in single quotes.
pub(crate) fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::quote;

    #[test]
    fn a_shell_reads_back_what_was_quoted() {
        for word in ["plain-1.exr", "", "a b", "it's", "$HOME `x` \"y\" \\", "ü*?[]", "a\nb"] {
            let script = format!("printf %s {}", quote(word));
            let output = std::process::Command::new("sh").args(["-c", &script]).output();
            if let Ok(output) = output {
                assert_eq!(String::from_utf8_lossy(&output.stdout), word);
            }
        }
    }
}
