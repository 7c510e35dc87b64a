//! One error for programs that do not care which part of the library failed.

/// Any error of the library; `?` converts each module's own.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An environment that cannot be used.
    #[error(transparent)]
    Environment(#[from] crate::environment::EnvironmentError),
    /// A text that names no strategy.
    #[error(transparent)]
    Strategy(#[from] crate::strategy::StrategyError),
    /// A strategy that does not suit its environment.
    #[error(transparent)]
    Prepare(#[from] crate::strategy::PrepareError),
    /// A text that names no material.
    #[error(transparent)]
    Bsdf(#[from] crate::bsdf::ParseMaterialError),
    /// Lights that cannot be extracted.
    #[error(transparent)]
    Rig(#[from] crate::rig::RigError),
    /// A description that makes no scene.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// A camera that makes no picture.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Camera(#[from] crate::scene::CameraError),
    /// A pixel that cannot be inspected.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Inspect(#[from] crate::inspect::InspectError),
    /// A film that does not belong to a render.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Film(#[from] crate::render::FilmMismatch),
    /// A file that makes no scene.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Load(#[from] crate::scene::LoadError),
    /// A file that makes no environment.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Probe(#[from] crate::environment::io::ProbeError),
    /// A picture that cannot be read or written.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Picture(#[from] crate::picture::PictureError),
    /// A file that is no checkpoint.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Checkpoint(#[from] crate::render::CheckpointError),
}
