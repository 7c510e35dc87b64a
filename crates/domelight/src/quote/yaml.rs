//! YAML, and what engines that read it replace in its strings.

use super::{Code, Shell, Yaml, double_quoted, is_invisible};

/// A string in double quotes.
pub fn string(text: &str) -> Code<Yaml> {
    Code::generated(double_quoted(text))
}

/// A string in double quotes for a command or an argument of Kubernetes, which replaces `$(NAME)` in them.
pub fn kubernetes_argument(text: &str) -> Code<Yaml> {
    let mut doubled = String::with_capacity(text.len());
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        doubled.push(c);
        // Two dollars stand for one.
        if c == '$' && matches!(chars.peek(), Some('$' | '(')) {
            doubled.push('$');
        }
    }
    string(&doubled)
}

/// A script after `key: `, as a block of lines, each `indent` spaces from the left, or in double quotes where it holds
/// what YAML does not keep in a block. A line break must follow.
pub fn script(script: &Code<Shell>, indent: usize) -> Code<Yaml> {
    let text = script.as_str();
    let kept = |line: &str| !line.contains(|c| c != '\t' && is_invisible(c));
    // The first line sets the indentation of the block, and the block ends with one line break.
    let one_end = text.ends_with('\n') && !text.ends_with("\n\n");
    if !one_end || text.starts_with([' ', '\n']) || !text.split('\n').all(kept) {
        return string(text);
    }
    let indented = text.trim_end_matches('\n').split('\n').map(|line| match line {
        "" => String::new(),
        line => format!("{:indent$}{line}", ""),
    });
    Code::generated(format!("|\n{}", indented.collect::<Vec<_>>().join("\n")))
}
