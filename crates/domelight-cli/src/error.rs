//! Errors of the program, and lines on standard error.

use domelight::quote::terminal;
use std::io::{self, IsTerminal, Write as _};

/// Arguments that are valid but incompatible; exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UsageError(pub(crate) String);

/// The work was interrupted and its state saved, so that it can be run again; exit code 75, EX_TEMPFAIL of sysexits.h.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct InterruptedAndSaved(pub(crate) String);

/// The work was interrupted and has no saved state, perhaps a picture; exit code 130.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Interrupted(pub(crate) String);

/// Prints a line to standard error, with terminal control characters escaped. If standard error is closed or full, the line
/// is lost and the work continues.
pub(crate) fn status(line: &str) {
    let _ = writeln!(io::stderr(), "{}", terminal::line(line));
}

/// The same with several lines.
pub(crate) fn status_lines(text: &str) {
    text.lines().for_each(status);
}

/// Prints a line after a label.
pub(crate) fn print_labeled(label: Label, text: &str) {
    let (code, name) = match label {
        Label::Error => ("1;31", "error:"),
        Label::Hint => ("1;36", "hint:"),
        Label::Warning => ("1;33", "warning:"),
    };
    let line = terminal::line(text);
    let _ = if colored() {
        writeln!(io::stderr(), "\x1b[{code}m{name}\x1b[0m {line}")
    } else {
        writeln!(io::stderr(), "{name} {line}")
    };
}

/// The label of a line.
#[derive(Clone, Copy)]
pub(crate) enum Label {
    Error,
    Hint,
    Warning,
}

/// Prints a warning unless --quiet is set.
pub(crate) fn warn(quiet: bool, text: &str) {
    if !quiet {
        print_labeled(Label::Warning, text);
    }
}

/// <https://no-color.org>: color on a terminal unless NO_COLOR is set to something.
fn colored() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
