//! Lights as discs of uniform radiance, for formats that know the size of a distant light.
//!
//! A disc of angular radius α and radiance L has ∫ L dω = 2π L (1 − cos α), the light's irradiance
//! E in a [`RigLight`], and its spread; a surface that faces it receives π L sin² α = E (1 + cos α)/2,
//! less than E because most of the disc is seen at a slant. Formats that cannot hold such a width
//! get a narrower disc with the same ∫ L dω, which keeps the mean irradiance over all normals.

use crate::math::functions;
use std::f32::consts::FRAC_PI_2;

use crate::Rgb;
use crate::rig::RigLight;

/// A light as a disc no wider than a hemisphere.
pub(super) struct Disc {
    /// Angular radius \[rad\], in [0, π/2].
    pub(super) radius: f32,
    /// What a surface that faces the disc receives \[W·m⁻²\].
    pub(super) facing: Rgb,
}

impl Disc {
    pub(super) fn of(light: &RigLight) -> Self {
        let radius = light.angular_radius.clamp(0.0, FRAC_PI_2);
        Self { radius, facing: light.irradiance * (0.5 * (1.0 + functions::cos(radius))) }
    }
}

/// 2π (1 − cos α), the solid angle of a disc of angular radius α \[sr\], without cancellation.
pub(super) fn solid_angle(radius: f32) -> f32 {
    4.0 * std::f32::consts::PI * functions::powi(functions::sin(0.5 * radius), 2)
}

/// A color whose largest channel is 1 and the factor that restores the light; white and 0 for
/// none.
pub(super) fn color_and_strength(light: Rgb) -> (Rgb, f32) {
    match light.max_component() {
        strength if strength > 0.0 => (light / strength, strength),
        _ => (Rgb::WHITE, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::light;
    use super::*;
    use crate::math::Vec3;
    use crate::rig::Region;
    use std::f32::consts::PI;

    #[test]
    fn a_disc_faces_a_surface_with_its_projected_solid_angle() {
        for degrees in [0.01, 0.25, 10.0, 45.0, 90.0] {
            let radius = f32::to_radians(degrees);
            let light = light(Vec3::Y, Rgb::WHITE, Region::Sun);
            let disc = Disc::of(&RigLight { angular_radius: radius, ..light });
            let radiance = 1.0 / solid_angle(radius);
            let projected = PI * radius.sin().powi(2);
            assert!((disc.facing.r - radiance * projected).abs() < 1e-5, "{degrees}");
        }
    }

    #[test]
    fn wider_discs_become_hemispheres() {
        let light = light(Vec3::Y, Rgb::WHITE, Region::Cell);
        let disc = Disc::of(&RigLight { angular_radius: 3.0, ..light });
        assert_eq!(disc.radius, FRAC_PI_2);
        assert!((disc.facing.g - 0.5).abs() < 1e-6);
    }

    #[test]
    fn color_times_strength_is_the_light() {
        let (color, strength) = color_and_strength(Rgb::new(2.0, 8.0, 0.0));
        assert_eq!((color, strength), (Rgb::new(0.25, 1.0, 0.0), 8.0));
        assert_eq!(color_and_strength(Rgb::BLACK), (Rgb::WHITE, 0.0));
    }
}
