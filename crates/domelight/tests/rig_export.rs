//! What holds for all formats of light rigs.

use domelight::environment::{Environment, Orientation};
use domelight::math::{Vec3, from_spherical};
use domelight::rig::export::{Dome, ExportError, Format, RigExport};
use domelight::rig::{Region, RigLight, SphericalHarmonics};
use domelight::{Rgb, RgbImage};

fn light(direction: Vec3) -> RigLight {
    RigLight {
        direction,
        irradiance: Rgb::new(2.0, 1.0, 0.5),
        angular_radius: 0.2,
        share: 0.01,
        solid_angle: 0.1,
        region: Region::Cell,
    }
}

/// Lights all over the sphere.
fn lights(n: usize) -> Vec<RigLight> {
    let spiral = |i: usize| from_spherical(1.0 - (2 * i + 1) as f32 / n as f32, 2.4 * i as f32);
    (0..n).map(|i| light(spiral(i).normalize())).collect()
}

fn rig(lights: &[RigLight]) -> RigExport<'_> {
    RigExport { probe: "probe.hdr", orientation: Orientation::default(), lights, dome: None }
}

#[test]
fn a_rig_may_have_no_lights_and_no_dome() {
    for format in Format::ALL {
        assert!(!format.encode(&rig(&[])).unwrap().is_empty(), "{format}");
    }
}

#[test]
fn a_rig_may_have_a_thousand_lights() {
    let lights = lights(1024);
    for format in Format::ALL {
        let file = format.encode(&rig(&lights)).unwrap();
        let text = String::from_utf8_lossy(&file);
        let last = if format == Format::Sibl { "[Light1023]" } else { "light_1024" };
        assert!(text.contains(last), "{format}");
        assert!(!text.contains("NaN") && !text.contains("inf,"), "{format}");
    }
}

#[test]
fn lights_that_are_none_are_refused() {
    let good = light(Vec3::Y);
    let bad = [
        RigLight { direction: Vec3::NAN, ..good },
        RigLight { direction: Vec3::ZERO, ..good },
        RigLight { irradiance: Rgb::new(1.0, f32::INFINITY, 0.0), ..good },
        RigLight { irradiance: Rgb::new(1.0, -1.0, 0.0), ..good },
        RigLight { angular_radius: f32::NAN, ..good },
    ];
    for light in bad {
        for format in Format::ALL {
            let error = format.encode(&rig(&[good, light])).unwrap_err();
            assert!(error.to_string().contains("light_2"), "{error}");
        }
    }
}

#[test]
fn file_names_that_a_format_cannot_hold_are_refused() {
    let map = RgbImage::filled(4, 2, Rgb::WHITE);
    let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
    let harmonics = SphericalHarmonics::project(&environment);
    let refused = |format: Format, file: &str| match format {
        Format::Usd => file.contains(['\u{1}', '\\']),
        Format::Pbrt => file.contains('\u{1}'),
        Format::Mitsuba => file.contains(['\n', '\u{1}', '$']),
        Format::Sibl => file.contains(['\n', '\u{1}', '"']),
        Format::Radiance => {
            file.contains(['\n', '\u{1}']) || file.contains('"') && file.contains('\'')
        }
        _ => false,
    };
    let names = [
        "line\nbreak.exr",
        "bell\u{1}.exr",
        "quote\".exr",
        "'\".exr",
        "$x.exr",
        "back\\slash.exr",
        "söme name.exr",
    ];
    for file in names {
        let dome = Dome { environment: &environment, harmonics, file: Some(file) };
        for format in Format::ALL {
            let result = format.encode(&RigExport { dome: Some(dome), ..rig(&[]) });
            if format == Format::Usd && file.contains('\n') || refused(format, file) {
                assert!(matches!(result, Err(ExportError::BadFileName { .. })), "{format} {file}");
            } else {
                let text = String::from_utf8_lossy(&result.unwrap()).into_owned();
                let plain = !file.contains(['"', '\'', '\n', '\u{1}', '\\']);
                let named = format.dome_picture().is_some();
                assert!(!named || !plain || text.contains(file), "{format}");
            }
        }
    }
}
