//! The command as it was typed, for reports.

use crate::shell::quote;

/// The command line of this process.
pub(crate) fn command() -> String {
    quoted(std::env::args().skip(1))
}

/// As it may be typed again.
fn quoted(arguments: impl Iterator<Item = String>) -> String {
    let words = std::iter::once("domelight".to_owned()).chain(arguments);
    words.map(|word| quote(&word)).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_can_be_typed_again() {
        let typed = ["compare", "my scene.toml", "--budget", "time:2s", "it's", ""];
        let text = quoted(typed.iter().map(ToString::to_string));
        assert_eq!(text, "domelight compare 'my scene.toml' --budget time:2s 'it'\\''s' ''");
    }
}
