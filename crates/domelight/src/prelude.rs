//! What most programs need: load a scene and an environment, render, write.
//!
//! ```no_run
//! use domelight::prelude::*;
//!
//! let scene = Scene::load("robot.glb")?;
//! let environment = Environment::load("studio.hdr")?;
//! let settings = RenderSettings { width: 640, height: 640, n_samples: 32, ..Default::default() };
//! let camera = Camera::framing(&scene, settings.width, settings.height);
//! let strategy = StrategySpec::default();
//! let film = Renderer::new(&scene, &camera, &environment, strategy, settings)?.finish();
//! film.write("robot.exr")?;
//! film.develop(Exposure::Auto, ToneCurve::Agx).write("robot.png")?;
//! # Ok::<(), domelight::Error>(())
//! ```

pub use crate::environment::builtin::BuiltinProbe;
pub use crate::environment::{Environment, Orientation, UpAxis};
pub use crate::strategy::{PreparedStrategy, StrategyKind, StrategySpec};
pub use crate::{Error, Rgb, RgbImage};

#[cfg(feature = "render")]
pub use crate::{
    render::{Background, Film, Layers, Observer, Passes, RenderSettings, Renderer},
    scene::{Camera, CameraSettings, Scene, SceneDescription, builtin::BuiltinScene},
};

#[cfg(feature = "io")]
pub use crate::picture::exposure::Exposure;
#[cfg(feature = "io")]
pub use crate::picture::tone::{ToneCurve, ToneMapping};
