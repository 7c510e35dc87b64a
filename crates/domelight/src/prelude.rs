//! The items that most programs need to load a scene and an environment, render, and write.
//! The crate documentation, [`crate`], has an example.

pub use crate::environment::builtin::BuiltinProbe;
pub use crate::environment::{Environment, Orientation, UpAxis};
pub use crate::strategy::{PreparedStrategy, StrategyKind, StrategySpec};
pub use crate::{Error, Rgb, RgbImage};

#[cfg(feature = "render")]
pub use crate::{
    render::{Background, Film, Layers, Observer, Passes, RenderSettings, Renderer},
    scene::{Camera, CameraSettings, Scene, SceneDescription, builtin::BuiltinScene},
};

#[cfg(feature = "picture")]
pub use crate::picture::exposure::Exposure;
#[cfg(feature = "picture")]
pub use crate::picture::tone::{ToneCurve, ToneMapping};
