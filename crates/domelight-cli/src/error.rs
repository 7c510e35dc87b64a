//! Errors as the user sees them, and the exit code.

use crate::args::FIRST_STEPS;
use crate::interrupt::RUN_AGAIN;
use crate::memory;
use crate::merge::MergeError;
use crate::output::NobodyReads;
use crate::suggest;
use clap::error::ErrorKind;
use domelight::environment::EnvironmentError;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::ProbeError;
use domelight::files::FileConflict;
use domelight::memory::OverLimit;
use domelight::picture::PictureErrorKind;
use domelight::picture::compare::SizeMismatch;
use domelight::quote::terminal;
use domelight::render::CheckpointError;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{CameraError, LoadError, SceneError};
use std::error::Error;
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write as _};
use std::path::Path;
use std::process::ExitCode;

/// Arguments that each are right but do not go together; exit code 2.
#[derive(Debug)]
pub(crate) struct UsageError(pub(crate) String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for UsageError {}

/// The work was interrupted and its state saved: run it again; exit code 75, the EX_TEMPFAIL of sysexits.h.
#[derive(Debug)]
pub(crate) struct InterruptedAndSaved(pub(crate) String);

impl std::fmt::Display for InterruptedAndSaved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for InterruptedAndSaved {}

/// Prints a line to standard error, in which nothing commands the terminal. If that is closed or full, nobody can be
/// told, and the work goes on.
pub(crate) fn status(line: &str) {
    let _ = writeln!(io::stderr(), "{}", terminal::line(line));
}

/// The same with several lines.
pub(crate) fn tell_lines(text: &str) {
    text.lines().for_each(status);
}

/// Prints a line after a label.
fn tell_after(label: Label, text: &str) {
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

#[derive(Clone, Copy)]
enum Label {
    Error,
    Hint,
    Warning,
}

/// Prints a warning unless asked for quiet.
pub(crate) fn warn(quiet: bool, text: &str) {
    if !quiet {
        tell_after(Label::Warning, text);
    }
}

/// Prints what is wrong with the command line, or the help that was asked for; the exit code.
pub(crate) fn report_usage(mut error: clap::Error) -> ExitCode {
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        tell_lines(FIRST_STEPS);
        return ExitCode::from(error.exit_code() as u8);
    }
    suggest::add_to(&mut error);
    let text = error.to_string();
    if terminal::lines(&text) == text {
        // In color.
        let _ = error.print();
    } else {
        tell_lines(text.trim_end());
    }
    ExitCode::from(error.exit_code() as u8)
}

/// Prints `error` with its causes on one line and a hint where there is one; the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    // Whoever read our report has seen enough.
    if error.is::<NobodyReads>() {
        return ExitCode::SUCCESS;
    }
    tell_after(Label::Error, &chain(error));
    if let Some(hint) = hint(error) {
        tell_after(Label::Hint, &hint);
    }
    ExitCode::from(code(error))
}

/// 2 if trying again cannot help: the arguments, the scene or the probe are wrong. 75 if it goes on where it was.
fn code(error: &anyhow::Error) -> u8 {
    let is_wrong_use = |cause: &(dyn Error + 'static)| {
        // What happened at some place is in a box.
        let boxed = cause.downcast_ref::<Box<domelight_lab::Error>>().map(|error| &**error);
        matches!(boxed.or(cause.downcast_ref()), Some(domelight_lab::Error::Usage(_)))
            || cause.is::<UsageError>()
            || cause.is::<LoadError>()
            || cause.is::<ProbeError>()
            || cause.is::<SceneError>()
            || cause.is::<CameraError>()
            || cause.is::<EnvironmentError>()
            || cause.is::<CheckpointError>()
            || cause.is::<FileConflict>()
    };
    let is_permanent = error.is::<UsageError>()
        || error.is::<FileConflict>()
        || error.chain().any(is_wrong_use)
        || over_limit(error).is_some();
    // What is not there or no plain file was asked for wrongly; other troubles of the system may pass.
    let passing = io_kind(error).is_some_and(|kind| {
        use io::ErrorKind::{InvalidInput, IsADirectory, NotADirectory, NotFound};
        !matches!(kind, NotFound | InvalidInput | IsADirectory | NotADirectory)
    });
    if let Some(error) = error.downcast_ref::<MergeError>() {
        return error.code();
    }
    match () {
        () if error.is::<InterruptedAndSaved>() => RUN_AGAIN as u8,
        () if is_permanent && !passing => 2,
        () => 1,
    }
}

/// The error and its causes, but for causes that the message above them already contains.
fn chain(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            let _ = write!(text, ": {cause}");
        }
    }
    text
}

fn hint(error: &anyhow::Error) -> Option<String> {
    if find::<SizeMismatch>(error).is_some() {
        return Some("render both with the same --size".into());
    }
    if let Some(error) = over_limit(error) {
        return Some(memory::hint(error));
    }
    let is_missing = io_kind(error) == Some(io::ErrorKind::NotFound);
    if let Some(LoadError::Read { path, .. }) = find(error)
        && is_missing
    {
        let names = BuiltinScene::ALL.map(BuiltinScene::name).join(", ");
        return Some(known("a scene", &names, suggest::scene(path)));
    }
    match find(error)? {
        ProbeError::Picture(picture) if is_missing => {
            let names = BuiltinProbe::ALL.map(BuiltinProbe::name).join(", ");
            Some(known("a probe", &names, suggest::probe(Path::new(&picture.file))))
        }
        ProbeError::Shape { .. } => {
            Some("--mapping (of render: --env-mapping) tells how the file is mapped".into())
        }
        _ => None,
    }
}

/// What the built-in names are, and which one was meant.
fn known(what: &str, names: &str, meant: Option<&str>) -> String {
    let text = format!("{what} is a file or one of {names}");
    meant.map_or(text.clone(), |name| format!("{text}; did you mean '{name}'?"))
}

/// The cause of that type.
fn find<T: Error + Send + Sync + 'static>(error: &anyhow::Error) -> Option<&T> {
    error.downcast_ref().or_else(|| error.chain().find_map(|cause| cause.downcast_ref()))
}

/// More memory than is allowed: the same again would not help.
fn over_limit(error: &anyhow::Error) -> Option<&OverLimit> {
    error.chain().find_map(|cause| match cause.downcast_ref() {
        Some(PictureErrorKind::Memory(error)) => Some(error),
        _ => cause.downcast_ref(),
    })
}

fn io_kind(error: &anyhow::Error) -> Option<io::ErrorKind> {
    error.chain().find_map(|cause| match cause.downcast_ref() {
        Some(PictureErrorKind::Io(error)) => Some(error.kind()),
        _ => cause.downcast_ref().map(io::Error::kind),
    })
}

/// <https://no-color.org>: color on a terminal unless NO_COLOR is set to something.
fn colored() -> bool {
    io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}
