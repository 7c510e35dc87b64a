//! Everything that can go wrong in the lab.

use domelight::bsdf::ParseMaterialError;
use domelight::bvh::BvhError;
use domelight::environment::EnvironmentError;
use domelight::environment::io::ProbeError;
use domelight::files::FileConflict;
use domelight::memory::OverLimit;
use domelight::picture::compare::SizeMismatch;
use domelight::picture::{PictureError, PictureErrorKind};
use domelight::rig::RigError;
use domelight::sampling::TableError;
use domelight::scene::{CameraError, LoadError, SceneError};
use domelight::strategy::{PrepareError, RejectionError, StrategyError};

/// Any error of the lab. Its cause, if it has one, is its source, also where the text repeats it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// What was asked for cannot be: the same again would fail again.
    #[error("{0}")]
    Usage(String),
    /// The host ended the work.
    #[error("interrupted{0}")]
    Interrupted(&'static str),
    /// What went wrong, in words.
    #[error("{0}")]
    Failed(String),
    /// An error and where it happened.
    #[error("{place}: {error}")]
    At {
        /// A file, a strategy or a case.
        place: String,
        /// What happened there.
        #[source]
        error: Box<Self>,
    },
    /// A scene file that cannot be loaded.
    #[error("{0}")]
    Load(#[source] LoadError),
    /// A probe that cannot be loaded.
    #[error("{0}")]
    Probe(#[source] ProbeError),
    /// A description that makes no scene.
    #[error("{0}")]
    Scene(#[source] SceneError),
    /// A camera that makes no picture.
    #[error("{0}")]
    Camera(#[source] CameraError),
    /// A map that makes no environment.
    #[error("{0}")]
    Environment(#[source] EnvironmentError),
    /// A text that names no strategy.
    #[error("{0}")]
    Strategy(#[source] StrategyError),
    /// A strategy that does not suit its environment.
    #[error("{0}")]
    Prepare(#[source] PrepareError),
    /// A text that names no material.
    #[error("{0}")]
    Material(#[source] ParseMaterialError),
    /// Rejection sampling that has no estimate.
    #[error("{0}")]
    Rejection(#[source] RejectionError),
    /// Weights that make no table.
    #[error("{0}")]
    Table(#[source] TableError),
    /// Triangles that make no tree.
    #[error("{0}")]
    Bvh(#[source] BvhError),
    /// Lights that cannot be extracted.
    #[error("{0}")]
    Rig(#[source] RigError),
    /// A picture that cannot be read or written.
    #[error("{0}")]
    Picture(#[source] PictureError),
    /// The same, of bytes without a name.
    #[error("{0}")]
    PictureBytes(#[source] PictureErrorKind),
    /// Pictures of different sizes.
    #[error("{0}")]
    Size(#[source] SizeMismatch),
    /// More memory than is allowed.
    #[error("{0}")]
    Memory(#[source] OverLimit),
    /// A file that is read and written.
    #[error("{0}")]
    Conflict(#[source] FileConflict),
    /// A failure of the system.
    #[error("{0}")]
    Io(#[source] std::io::Error),
    /// A text that is no JSON, or values that make none.
    #[error("{0}")]
    Json(#[source] serde_json::Error),
    /// An error of the front end.
    #[error("{0}")]
    Host(#[source] Box<dyn std::error::Error + Send + Sync>),
}

macro_rules! from {
    ($($variant:ident($source:ty)),* $(,)?) => {
        $(impl From<$source> for Error {
            fn from(error: $source) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

from! {
    Load(LoadError), Probe(ProbeError), Scene(SceneError), Camera(CameraError), Environment(EnvironmentError),
    Strategy(StrategyError), Prepare(PrepareError), Material(ParseMaterialError), Rig(RigError), Picture(PictureError),
    PictureBytes(PictureErrorKind), Size(SizeMismatch), Memory(OverLimit), Conflict(FileConflict), Io(std::io::Error),
    Json(serde_json::Error), Rejection(RejectionError), Table(TableError), Bvh(BvhError),
}

/// Says where an error happened.
pub trait At<T> {
    /// The error at that place.
    ///
    /// # Errors
    /// If there was one.
    fn at(self, place: impl ToString) -> Result<T, Error>;
}

impl<T, E: Into<Error>> At<T> for Result<T, E> {
    fn at(self, place: impl ToString) -> Result<T, Error> {
        self.map_err(|error| Error::At { place: place.to_string(), error: Box::new(error.into()) })
    }
}
