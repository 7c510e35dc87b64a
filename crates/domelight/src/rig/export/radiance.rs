//! Lights for a Radiance scene: `oconv scene.rad rig.rad`.
//!
//! A light is a `source` with the full angle of the light's disc \[degrees\], of a `light` whose
//! radiance fills the disc with the light's irradiance; no narrower than [`LEAST_ANGLE`], no wider
//! than a hemisphere. The dome is a `glow` all around, its `colorpict` pattern the picture, which
//! must be a Radiance `.hdr`: `-ab 1` or more gathers it. Radiance's coordinates of a picture make its shorter side 1.
//! The world is Z-up as in Radiance's sky
//! generators; the middle of the map is at +Y. Numbers are taken as they are: Radiance has Rec. 709's
//! primaries but for green, (0.29, 0.60), and a white of equal energy.

use super::RigExport;
use super::axes::Axes;
use super::disc::{Disc, solid_angle};
use super::text::{numbers, vector};
use super::{ExportError, Format};
use crate::code;
use crate::environment::UpAxis;
use crate::quote::{Code, Radiance, radiance as language};

/// The full angle of a light without size \[degrees\]; Radiance wants more than 0.
const LEAST_ANGLE: f32 = 0.01;

pub(super) fn encode(rig: &RigExport) -> Result<Code<Radiance>, ExportError> {
    let axes = Axes::with_up(rig, UpAxis::Z);
    let mut text = code!(
        Radiance,
        "# The lights of {probe}, by domelight. +Z is up.\n",
        probe = language::comment(rig.probe)
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let radius = Disc::of(light).radius.max(0.5 * LEAST_ANGLE.to_radians());
        text += code!(
            Radiance,
            "
void light {name}_radiance
0
0
3 {radiance}

{name}_radiance source {name}
0
0
4 {toward} {angle}
",
            // A word as they are.
            name = Code::generated(name),
            radiance = numbers((light.irradiance / solid_angle(radius)).to_array(), " "),
            toward = numbers(vector(axes.world * light.direction), " "),
            angle = 2.0 * radius.to_degrees(),
        );
    }
    if let (Some(file), Some(dome)) = (rig.dome_file(), rig.dome) {
        let map = dome.environment.map();
        let shorter = map.width.min(map.height) as f64;
        text += code!(
            Radiance,
            "
# The probe without the light of these lights
void colorpict dome_picture
9 red green blue {file} . {u}*(atan2(Dx,Dy)/PI+1) {v}*(1-acos(Dz)/PI) -rz {rotation}
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
",
            file = language::word(file).ok_or_else(|| Format::Radiance.cannot_name(file))?,
            u = 0.5 * map.width as f64 / shorter,
            v = map.height as f64 / shorter,
            rotation = rig.orientation.rotation,
        );
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::super::Dome;
    use super::super::tests_support::{light, with_dome_file, with_example};
    use super::*;
    use crate::environment::{Environment, Orientation};
    use crate::math::Vec3;
    use crate::rig::SphericalHarmonics;
    use crate::rig::{Region, RigLight};
    use crate::{Rgb, RgbImage};

    /// The arguments of the primitive called `name`.
    fn arguments(text: &str, name: &str) -> Vec<f32> {
        let start = text.find(&format!(" {name}\n0\n0\n")).unwrap();
        let line = text[start..].lines().nth(3).unwrap();
        line.split(' ').skip(1).map(|number| number.parse().unwrap()).collect()
    }

    #[test]
    fn a_source_holds_the_irradiance() {
        with_example(|rig| {
            let text = encode(rig).unwrap().into_string();
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
                let rig = RigExport { lights: &lights, ..*rig };
                let text = encode(&rig).unwrap().into_string();
                assert!((arguments(&text, "sun")[3] - angle).abs() < 1e-4);
                let radiance = arguments(&text, "sun_radiance")[0];
                assert!(radiance > 0.0 && radiance.is_finite());
            });
        }
    }

    /// Radiance's picture coordinates of a direction: the line's expressions by hand.
    #[test]
    fn a_dome_of_any_shape_points_the_right_way() {
        for (width, height) in [(16, 8), (173, 50), (50, 173), (9, 9)] {
            let map = RgbImage::filled(width, height, Rgb::WHITE);
            let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
            let harmonics = SphericalHarmonics::project(&environment);
            let dome = Dome { environment: &environment, harmonics, file: Some("dome.hdr") };
            let text = encode(&RigExport {
                probe: "p",
                orientation: Orientation::default(),
                lights: &[],
                dome: Some(dome),
            })
            .unwrap()
            .into_string();
            let line = text.lines().find(|line| line.contains("atan2")).unwrap();
            let words: Vec<&str> = line.split(' ').collect();
            let scale = |word: &str| word.split_once('*').unwrap().0.parse::<f64>().unwrap();
            // The longitude runs over (-1, 1) + 1, the colatitude over (0, 1); the picture over its sides by the shorter.
            let shorter = width.min(height) as f64;
            assert!((2.0 * scale(words[6]) - width as f64 / shorter).abs() < 1e-12, "{line}");
            assert!((scale(words[7]) - height as f64 / shorter).abs() < 1e-12, "{line}");
        }
    }

    #[test]
    fn the_dome_turns_about_the_up_axis() {
        with_dome_file("my residual.hdr", |rig| {
            let text = encode(rig).unwrap().into_string();
            assert!(text.contains("\"my residual.hdr\"") && text.contains("-rz 30\n"), "{text}");
            let without = encode(&RigExport { dome: None, ..*rig }).unwrap();
            assert!(!without.as_str().contains("glow"));
        });
    }
}
