//! Why a call fails, as a sentence for the page.

use std::fmt::Display;

/// An error of a call.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A call needs a scene.
    #[error("there is no scene yet; load one first")]
    NoScene,
    /// A call needs light.
    #[error("there is no environment yet; load one first")]
    NoEnvironment,
    /// There is no render to continue.
    #[error("nothing was started")]
    NothingStarted,
    /// Settings that are not JSON, or not those of the call.
    #[error("settings: {0}")]
    Settings(#[from] serde_json::Error),
    /// What the library refuses.
    #[error(transparent)]
    Library(#[from] domelight::Error),
    /// Anything else.
    #[error("{0}")]
    Refused(String),
}

/// An error of the library.
pub(crate) fn error(error: impl Into<domelight::Error>) -> Error {
    Error::Library(error.into())
}

/// An error with a text of its own.
pub(crate) fn refused(text: impl Display) -> Error {
    Error::Refused(text.to_string())
}
