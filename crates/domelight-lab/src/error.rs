//! The errors of the lab.

use domelight::bsdf::ParseMaterialError;
use domelight::bvh::BvhError;
use domelight::environment::EnvironmentError;
use domelight::environment::io::ProbeError;
use domelight::files::FileConflict;
use domelight::memory::OverLimit;
use domelight::picture::compare::SizeMismatch;
use domelight::picture::flip::FlipError;
use domelight::picture::{PictureError, PictureErrorKind};
use domelight::rig::RigError;
use domelight::sampling::TableError;
use domelight::scene::{CameraError, LoadError, SceneError};
use domelight::strategy::{PrepareError, RejectionError, StrategyError};

/// Any error of the lab. Its cause, if there is one, is its source, even if the text repeats it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid request, which would fail again.
    #[error("{0}")]
    Usage(String),
    /// The host ended the work.
    #[error("interrupted{0}")]
    Interrupted(&'static str),
    /// A description of the error.
    #[error("{0}")]
    Failed(String),
    /// An error and its location.
    #[error("{place}: {error}")]
    At {
        /// A file, a strategy or a case.
        place: String,
        /// The error at this location.
        #[source]
        error: Box<Self>,
    },
    /// A scene file that cannot be loaded.
    #[error("{0}")]
    Load(#[source] LoadError),
    /// A probe that cannot be loaded.
    #[error("{0}")]
    Probe(#[source] ProbeError),
    /// An invalid scene description.
    #[error("{0}")]
    Scene(#[source] SceneError),
    /// An invalid camera.
    #[error("{0}")]
    Camera(#[source] CameraError),
    /// An invalid environment map.
    #[error("{0}")]
    Environment(#[source] EnvironmentError),
    /// An invalid strategy text.
    #[error("{0}")]
    Strategy(#[source] StrategyError),
    /// A strategy that does not suit its environment.
    #[error("{0}")]
    Prepare(#[source] PrepareError),
    /// An invalid material text.
    #[error("{0}")]
    Material(#[source] ParseMaterialError),
    /// Rejection sampling without an estimate.
    #[error("{0}")]
    Rejection(#[source] RejectionError),
    /// Invalid weights of a table.
    #[error("{0}")]
    Table(#[source] TableError),
    /// Triangles for which a BVH cannot be built.
    #[error("{0}")]
    Bvh(#[source] BvhError),
    /// Lights that cannot be extracted.
    #[error("{0}")]
    Rig(#[source] RigError),
    /// A picture that cannot be read or written.
    #[error("{0}")]
    Picture(#[source] PictureError),
    /// The same for bytes without a name.
    #[error("{0}")]
    PictureBytes(#[source] PictureErrorKind),
    /// Pictures of different sizes.
    #[error("{0}")]
    Size(#[source] SizeMismatch),
    /// Pictures without a ꟻLIP.
    #[error("{0}")]
    Flip(#[source] FlipError),
    /// More memory than is allowed.
    #[error("{0}")]
    Memory(#[source] OverLimit),
    /// A file that is both read and written.
    #[error("{0}")]
    Conflict(#[source] FileConflict),
    /// A failure of the system.
    #[error("{0}")]
    Io(#[source] std::io::Error),
    /// Invalid JSON, or values that cannot be written as JSON.
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
    PictureBytes(PictureErrorKind), Size(SizeMismatch), Flip(FlipError), Memory(OverLimit), Conflict(FileConflict), Io(std::io::Error),
    Json(serde_json::Error), Rejection(RejectionError), Table(TableError), Bvh(BvhError),
}

/// Adds the location of an error.
pub trait At<T> {
    /// Adds the location to the error.
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
