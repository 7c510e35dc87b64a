//! Direct illumination under measured light: the field's sampling strategies for
//! ∫ f_r · cos θ · L · V dω under an HDR environment, a renderer built on them, and light rigs.
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
//!
//! [`Renderer`](render::Renderer) also renders in steps, with progress, checkpoints and your own strategies.
//! [`inspect`] explains the noise of a pixel, and [`rig`] turns an environment into lights. The folder `examples/`
//! has a program for each.
//!
//! # Conventions
//! - `wo` points toward the viewer, `wi` toward the light; both are unit vectors away from the surface.
//!   BRDFs work in the local frame with z the shading normal.
//! - `eval` is f_r · max(0, cos θ_i): it includes the cosine. `pdf` is per solid angle \[sr⁻¹\].
//! - Radiance `le` is in W·m⁻²·sr⁻¹, linear Rec. 709.
//! - The world is right-handed, +Y up. On a lat-long map row 0 is +Y, the center column looks toward
//!   −Z and u grows to the right as seen from inside.
//! - Uniform random numbers lie in [0, 1) and are never 1. A sampler is a pure function of them.
//!
//! # The sampling core
//! A strategy turns a shading point into pairs (wi, weight); the estimate is Σ weight · V(wi).
//!
//! ```
//! use domelight::bsdf::{Lambert, Bsdf};
//! use domelight::environment::{Environment, Orientation, builtin::BuiltinProbe};
//! use domelight::math::{Frame, Vec3};
//! use domelight::sampling::{SamplerKind, Sampler};
//! use domelight::strategy::{
//!     EnvironmentSampling, PointStrategy, SampleIndex, SampleScratch, ShadingPoint,
//! };
//! use domelight::Rgb;
//!
//! let map = BuiltinProbe::Sky.image(64);
//! let environment = &Environment::new(map, Orientation::default(), 1.0)?;
//! let bsdf = Bsdf::single(Lambert::new(Rgb::splat(0.5)));
//! let (ng, frame) = (Vec3::Y, Frame::from_z(Vec3::Y));
//! let at = ShadingPoint { position: Vec3::ZERO, ng, frame, wo: Vec3::Z, bsdf };
//!
//! let strategy = EnvironmentSampling { environment, n_samples: 16 };
//! let sampler = Sampler::new(SamplerKind::Sobol, 0, 0);
//! let mut unoccluded = Rgb::BLACK;
//! let numbers = SampleIndex { sampler, sample: 0 };
//! let mut scratch = SampleScratch::default();
//! strategy.sample(&at, numbers, &mut scratch, |_wi, weight| unoccluded += weight);
//! assert!(unoccluded.luminance() > 0.0);
//! # Ok::<(), domelight::environment::EnvironmentError>(())
//! ```
//!
//! # Features
//! - `io` (default): files of all kinds: pictures, probes, meshes and scenes, films and rigs. It has `picture` and `render`.
//! - `render` (default): scenes, ray tracing, the renderer; loops run in parallel.
//! - `picture`: reads Radiance, OpenEXR, PFM and cube textures (not PNG and JPEG) as pictures and probes, without scenes
//!   and ray tracing: `examples/sample_a_file.rs`.
//!
//! Without features, the library is only the sampling core: [`math`], [`sampling`], [`bsdf`], [`environment`],
//! [`strategy`], [`rig`].

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // See `math::functions`.

pub mod bsdf;
mod color;
pub mod environment;
mod image;
pub mod math;
mod names;
mod parallel;
pub mod rig;
pub mod sampling;
mod simd;
pub mod strategy;

#[cfg(feature = "render")]
pub mod bvh;
#[cfg(feature = "render")]
pub mod geometry;
#[cfg(feature = "render")]
pub mod inspect;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "render")]
pub mod scene;

mod error;
pub mod prelude;

#[cfg(feature = "io")]
pub mod files;
#[cfg(feature = "io")]
pub mod fingerprint;
#[cfg(feature = "picture")]
mod load;
#[cfg(feature = "picture")]
pub mod memory;
#[cfg(feature = "picture")]
pub mod picture;
#[cfg(feature = "io")]
pub mod quote;

pub use color::Rgb;
pub use error::Error;
pub use image::RgbImage;
