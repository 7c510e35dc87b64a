//! Lights for a Radiance scene: `oconv scene.rad rig.rad`.
//!
//! A light is a `source` with the full angle of the light's disc \[degrees\], of a `light` whose
//! radiance fills the disc with the light's irradiance; no narrower than [`LEAST_ANGLE`], no wider
//! than a hemisphere. The dome is a `glow` all around, its `colorpict` pattern the picture, which
//! must be a Radiance `.hdr`: `-ab 1` or more gathers it. The world is Z-up as in Radiance's sky
//! generators; the middle of the map is at +Y. Numbers are taken as they are: Radiance has Rec. 709's
//! primaries but for green, (0.29, 0.60), and a white of equal energy.

use std::fmt::Write;

use super::RigExport;
use super::axes::Axes;
use super::disc::{Disc, solid_angle};
use super::text::{numbers, one_line, vector};
use crate::environment::UpAxis;

/// The full angle of a light without size \[degrees\]; Radiance wants more than 0.
const LEAST_ANGLE: f32 = 0.01;

pub(super) fn encode(rig: &RigExport) -> String {
    let axes = Axes::with_up(rig, UpAxis::Z);
    let mut text = format!("# The lights of {}, by domelight. +Z is up.\n", one_line(rig.probe));
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let radius = Disc::of(light).radius.max(0.5 * LEAST_ANGLE.to_radians());
        let radiance = numbers((light.irradiance / solid_angle(radius)).to_array(), " ");
        let toward = numbers(vector(axes.world * light.direction), " ");
        let angle = 2.0 * radius.to_degrees();
        let _ = write!(
            text,
            "
void light {name}_radiance
0
0
3 {radiance}

{name}_radiance source {name}
0
0
4 {toward} {angle}
"
        );
    }
    if let Some(file) = rig.dome_file() {
        let (file, rotation) = (word(file), rig.orientation.rotation);
        let _ = write!(
            text,
            "
# The probe without the light of these lights
void colorpict dome_picture
9 red green blue {file} . (atan2(Dx,Dy)/PI)+1 1-acos(Dz)/PI -rz {rotation}
0
0

dome_picture glow dome_radiance
0
0
4 1 1 1 0

dome_radiance source dome
0
0
4 0 0 1 360
"
        );
    }
    text
}

/// One word of a scene file: in quotes, of the kind that is not in it.
fn word(text: &str) -> String {
    let text = one_line(text);
    if text.contains('"') { format!("'{text}'") } else { format!("\"{text}\"") }
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{light, with_dome_file, with_example};
    use super::*;
    use crate::Rgb;
    use crate::math::Vec3;
    use crate::rig::{Region, RigLight};

    /// The arguments of the primitive called `name`.
    fn arguments(text: &str, name: &str) -> Vec<f32> {
        let start = text.find(&format!(" {name}\n0\n0\n")).unwrap();
        let line = text[start..].lines().nth(3).unwrap();
        line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect()
    }

    #[test]
    fn a_source_holds_the_irradiance() {
        with_example(|rig| {
            let text = encode(rig);
            let source = arguments(&text, "sun");
            assert_eq!(source[..3], [0.0, 0.8, 0.6], "Z-up");
            let radius = 0.5 * source[3].to_radians();
            assert!((radius - rig.lights[0].angular_radius).abs() < 1e-6);
            let irradiance = arguments(&text, "sun_radiance")[0] * solid_angle(radius);
            assert!((irradiance - 3.0).abs() < 1e-4, "{irradiance}");
        });
    }

    #[test]
    fn a_light_of_no_size_or_all_around_has_a_valid_angle() {
        for (angular_radius, angle) in [(0.0, LEAST_ANGLE), (3.1, 180.0)] {
            let light = light(Vec3::X, Rgb::WHITE, Region::Sun);
            let lights = [RigLight { angular_radius, ..light }];
            with_example(|rig| {
                let text = encode(&RigExport { lights: &lights, ..*rig });
                assert!((arguments(&text, "sun")[3] - angle).abs() < 1e-4);
                let radiance = arguments(&text, "sun_radiance")[0];
                assert!(radiance > 0.0 && radiance.is_finite());
            });
        }
    }

    #[test]
    fn the_dome_turns_about_the_up_axis() {
        with_dome_file("my residual.hdr", |rig| {
            let text = encode(rig);
            assert!(text.contains("\"my residual.hdr\"") && text.contains("-rz 30\n"), "{text}");
            assert!(!encode(&RigExport { dome: None, ..*rig }).contains("glow"));
        });
    }
}
