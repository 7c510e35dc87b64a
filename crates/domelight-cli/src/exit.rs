//! Error messages for the user, and exit codes.

use crate::args::FIRST_STEPS;
use crate::error::{
    Interrupted, InterruptedAndSaved, Label, UsageError, print_labeled, status_lines,
};
use crate::interrupt::{ENDED, RUN_AGAIN};
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
use domelight::rig::ibl::IblError;
use domelight::rig::tables::TablesError;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{CameraError, LoadError, SceneError};
use domelight::strategy::PrepareError;
use std::error::Error;
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// Prints the error in the command line, or the requested help. Returns the exit code.
pub(crate) fn report_usage(mut error: clap::Error) -> ExitCode {
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        status_lines(FIRST_STEPS);
        return ExitCode::from(error.exit_code() as u8);
    }
    if error.kind() == ErrorKind::InvalidUtf8
        && let Some(word) = std::env::args_os().find(|word| word.to_str().is_none())
    {
        print_labeled(
            Label::Error,
            &format!("{} is not UTF-8, which this command needs", word.display()),
        );
        return ExitCode::from(error.exit_code() as u8);
    }
    suggest::add_to(&mut error);
    let text = error.to_string();
    if terminal::lines(&text) == text {
        // In color. Help that cannot be written is a failure, unless its reader is gone.
        if error.print().is_err_and(|error| error.kind() != io::ErrorKind::BrokenPipe) {
            return ExitCode::FAILURE;
        }
    } else {
        status_lines(text.trim_end());
    }
    ExitCode::from(error.exit_code() as u8)
}

/// Prints `error` with its causes on one line, and a hint if there is one. Returns the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    // The reader of the report is gone, which is not an error.
    if error.is::<NobodyReads>() {
        return ExitCode::SUCCESS;
    }
    print_labeled(Label::Error, &chain(error));
    if let Some(hint) = hint(error) {
        print_labeled(Label::Hint, &hint);
    }
    ExitCode::from(code(error))
}

/// 2 if retrying cannot help, because the arguments, the scene or the probe are invalid. 75 if a retry continues the work.
fn code(error: &anyhow::Error) -> u8 {
    let is_wrong_use = |cause: &(dyn Error + 'static)| {
        matches!(of_lab(cause), Some(domelight_lab::Error::Usage(_)))
            || cause.is::<PrepareError>()
            || cause.is::<UsageError>()
            || cause.is::<LoadError>()
            || cause.is::<ProbeError>()
            || cause.is::<SceneError>()
            || cause.is::<CameraError>()
            || cause.is::<EnvironmentError>()
            || cause.is::<CheckpointError>()
            || cause.is::<IblError>()
            || cause.is::<TablesError>()
            || cause.is::<FileConflict>()
    };
    let is_permanent = error.is::<UsageError>()
        || error.is::<FileConflict>()
        || error.chain().any(is_wrong_use)
        || over_limit(error).is_some();
    // A missing file or one that is not a regular file is a usage error; other system errors may be temporary.
    let passing = io_kind(error).is_some_and(|kind| {
        use io::ErrorKind::{InvalidInput, IsADirectory, NotADirectory, NotFound};
        !matches!(kind, NotFound | InvalidInput | IsADirectory | NotADirectory)
    });
    if let Some(error) = error.downcast_ref::<MergeError>() {
        return error.code();
    }
    match () {
        () if error.is::<InterruptedAndSaved>() => RUN_AGAIN as u8,
        () if error.is::<Interrupted>() || error.chain().any(is_interruption) => ENDED as u8,
        () if is_permanent && !passing => 2,
        () => 1,
    }
}

/// An error of the lab; with a location, it is boxed.
fn of_lab<'a>(cause: &'a (dyn Error + 'static)) -> Option<&'a domelight_lab::Error> {
    let boxed = cause.downcast_ref::<Box<domelight_lab::Error>>().map(|error| &**error);
    boxed.or(cause.downcast_ref())
}

/// The lab keeps nothing of interrupted work.
fn is_interruption(cause: &(dyn Error + 'static)) -> bool {
    matches!(of_lab(cause), Some(domelight_lab::Error::Interrupted(_)))
}

/// The error and its causes, except for causes that the message above already contains.
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
            Some("--mapping (of render: --env-mapping) states the mapping of the file".into())
        }
        _ => None,
    }
}

/// Lists the built-in names and suggests the intended one.
fn known(what: &str, names: &str, meant: Option<&str>) -> String {
    let text = format!("{what} is a file or one of {names}");
    meant.map_or(text.clone(), |name| format!("{text}; did you mean '{name}'?"))
}

/// The first cause of a given type.
fn find<T: Error + Send + Sync + 'static>(error: &anyhow::Error) -> Option<&T> {
    error.downcast_ref().or_else(|| error.chain().find_map(|cause| cause.downcast_ref()))
}

/// The memory limit was exceeded; retrying would not help.
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
