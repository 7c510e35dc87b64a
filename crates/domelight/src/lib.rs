//! Direct illumination under measured light: every sampling strategy of the field for
//! ∫ f_r · cos θ · L · V dω under an HDR environment, a renderer around them, and light rigs.
//!
//! # Conventions
//! - `wo` points toward the viewer, `wi` toward the light; both are unit vectors away from the surface.
//!   BRDFs work in the local frame with z the shading normal.
//! - `eval` is f_r · max(0, cos θ_i): the cosine is inside. `pdf` is per solid angle \[sr⁻¹\].
//! - Radiance `le` is in W·m⁻²·sr⁻¹, linear Rec. 709.
//! - The world is right-handed, +Y up. On a lat-long map row 0 is +Y, the centre column looks toward
//!   −Z and u grows to the right as seen from inside.
//! - Uniform numbers lie in [0, 1), never 1. A sampler is a pure function of them.

pub mod bsdf;
mod color;
pub mod environment;
mod image;
pub mod math;
pub mod rig;
pub mod sampling;
pub mod strategy;

#[cfg(feature = "render")]
pub mod bvh;
#[cfg(feature = "render")]
pub mod geometry;
#[cfg(feature = "render")]
pub mod render;
#[cfg(feature = "render")]
pub mod scene;

#[cfg(feature = "io")]
pub mod picture;

pub use color::Rgb;
pub use image::RgbImage;
