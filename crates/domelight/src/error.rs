//! One error type for programs that do not care which part of the library failed.

/// Any error of the library; `?` converts the errors of all modules.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid environment.
    #[error(transparent)]
    Environment(#[from] crate::environment::EnvironmentError),
    /// An invalid strategy text.
    #[error(transparent)]
    Strategy(#[from] crate::strategy::StrategyError),
    /// A strategy that does not suit its environment.
    #[error(transparent)]
    Prepare(#[from] crate::strategy::PrepareError),
    /// An invalid material text.
    #[error(transparent)]
    Bsdf(#[from] crate::bsdf::ParseMaterialError),
    /// Lights that cannot be extracted.
    #[error(transparent)]
    Rig(#[from] crate::rig::RigError),
    /// An invalid scene description.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// An invalid camera.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Camera(#[from] crate::scene::CameraError),
    /// A pixel that cannot be inspected.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Inspect(#[from] crate::inspect::InspectError),
    /// A film that does not match a render.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Film(#[from] crate::render::FilmMismatch),
    /// A file that is not a valid scene.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Load(#[from] crate::scene::LoadError),
    /// A file that is not a valid environment.
    #[cfg(feature = "picture")]
    #[error(transparent)]
    Probe(#[from] crate::environment::io::ProbeError),
    /// A picture that cannot be read or written.
    #[cfg(feature = "picture")]
    #[error(transparent)]
    Picture(#[from] crate::picture::PictureError),
    /// A file that is not a valid checkpoint.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Checkpoint(#[from] crate::render::CheckpointError),
}
