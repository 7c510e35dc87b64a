//! Hits and environments for tests.

use crate::bsdf::{Bsdf, MaterialSpec};
use crate::environment::builtin::BuiltinProbe;
use crate::environment::{Environment, Orientation};
use crate::math::{Frame, Vec3, vec3};
use crate::strategy::ShadingPoint;

/// A hit seen 39° from its normal, with a material in the notation of the command line.
pub(super) fn hit(bsdf: &str, normal: Vec3) -> ShadingPoint {
    let bsdf = Bsdf::from(bsdf.parse::<MaterialSpec>().unwrap());
    let frame = Frame::from_z_and_tangent(normal.normalize(), Vec3::X);
    let wo = vec3(0.5, 0.1, 0.8).normalize();
    ShadingPoint { position: Vec3::ZERO, ng: frame.z, frame, wo, bsdf }
}

/// A sky with a sun.
pub(super) fn sky() -> Environment {
    Environment::new(BuiltinProbe::Sky.image(32), Orientation::default(), 1.0).unwrap()
}
