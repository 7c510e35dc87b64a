//! The command line as typed, for reports that others read.

use domelight::fingerprint::Fingerprinter;
use domelight::quote::shell;
use domelight_lab::names::shared_word;

/// The command line of this process, without folders of this machine.
pub(crate) fn command() -> String {
    // A name may not be UTF-8.
    quoted(std::env::args_os().skip(1).map(|word| shared_word(&word.to_string_lossy())))
}

/// The fingerprint of this program's file, because another build may make other pictures.
pub(crate) fn program() -> String {
    let mut fingerprint = Fingerprinter::default();
    if let Ok(program) = std::env::current_exe().and_then(std::fs::read) {
        fingerprint.bytes(program);
    }
    fingerprint.finish().to_string()
}

/// Quoted, so that it can be typed again.
fn quoted(arguments: impl Iterator<Item = String>) -> String {
    let words = std::iter::once("domelight".to_owned()).chain(arguments);
    shell::words(words).into_string()
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
