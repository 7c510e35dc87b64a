//! OpenUSD as text (`.usda`).
//!
//! A light is a `DistantLight`: it shines along its −Z, which a rotation turns away from the
//! light's direction; `inputs:angle` is the full angle of its disc \[degrees\], and with
//! `inputs:normalize` intensity times color is what a surface that faces it receives \[W·m⁻²\],
//! whatever the angle. The dome is a `DomeLight` of intensity 1, whose panorama's middle looks
//! toward +Z where ours looks toward −Z, so it has half a turn about +Y, and its pole is +Y even on
//! a Z-up stage. Axes are those of the rig's world, its up axis the stage's.

use std::f32::consts::PI;

use super::RigExport;
use super::axes::Axes;
use super::disc::{Disc, color_and_strength};
use super::text::numbers;
use super::{ExportError, Format};
use crate::code;
use crate::environment::UpAxis;
use crate::math::{Quat, Vec3, rotation_y};
use crate::quote::{Code, Usd, usd};

pub(super) fn encode(rig: &RigExport) -> Result<Code<Usd>, ExportError> {
    let up = match rig.orientation.up {
        UpAxis::Y => "Y",
        UpAxis::Z => "Z",
    };
    let mut text = code!(
        Usd,
        r#"#usda 1.0
(
    defaultPrim = "rig"
    doc = {doc}
    metersPerUnit = 1
    upAxis = "{up}"
)

def Xform "rig"
{{
"#,
        doc = usd::string(&format!("The lights of {}, by domelight.", rig.probe)),
        up = up,
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let Disc { radius, facing } = Disc::of(light);
        let (color, intensity) = color_and_strength(facing);
        text += code!(
            Usd,
            r#"    def DistantLight {name}
    {{
        float inputs:angle = {angle}
        color3f inputs:color = ({color})
        float inputs:intensity = {intensity}
        bool inputs:normalize = 1
{rotation}    }}
"#,
            name = usd::string(&name),
            angle = 2.0 * radius.to_degrees(),
            color = numbers(color.to_array(), ", "),
            intensity = intensity,
            rotation = orient(Quat::from_rotation_arc(Vec3::Z, light.direction)),
        );
    }
    if let Some(file) = rig.dome_file() {
        let turn = Axes::of_world(rig).dome * rotation_y(PI);
        text += code!(
            Usd,
            r#"    def DomeLight "dome"
    {{
        float inputs:intensity = 1
        asset inputs:texture:file = {file}
        token inputs:texture:format = "latlong"
{rotation}    }}
"#,
            file = asset(file).ok_or_else(|| Format::Usd.cannot_name(file))?,
            rotation = orient(Quat::from_mat3(&turn)),
        );
    }
    Ok(text + "}\n")
}

/// The rotation of a prim.
fn orient(rotation: Quat) -> Code<Usd> {
    let [x, y, z, w] = rotation.to_array().map(|value| value + 0.0);
    code!(
        Usd,
        r#"        quatf xformOp:orient = ({w}, {x}, {y}, {z})
        uniform token[] xformOpOrder = ["xformOp:orient"]
"#,
        w = w,
        x = x,
        y = y,
        z = z,
    )
}

/// An asset path; one that is relative is anchored to the file that names it.
fn asset(file: &str) -> Option<Code<Usd>> {
    let anchored = file.starts_with(['/', '.']) || file.contains(':');
    let anchor = if anchored { "" } else { "./" };
    usd::asset(&format!("{anchor}{file}"))
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    /// The numbers of the first `key` after `start`.
    fn values(text: &str, start: &str, key: &str) -> Vec<f32> {
        let text = &text[text.find(start).unwrap()..];
        let line = text.lines().find(|line| line.contains(&format!("{key} = "))).unwrap();
        let numbers = line.split(" = ").nth(1).unwrap().trim_matches(['(', ')']);
        numbers.split(", ").map(|number| number.parse().unwrap()).collect()
    }

    #[test]
    fn lights_turn_their_back_to_their_direction() {
        with_example(|rig| {
            let text = encode(rig).unwrap().into_string();
            for (light, name) in rig.lights.iter().zip(rig.names()) {
                let start = format!("DistantLight \"{name}\"");
                let q = values(&text, &start, "xformOp:orient");
                let z = Quat::from_xyzw(q[1], q[2], q[3], q[0]) * Vec3::Z;
                assert!((z - light.direction).length() < 1e-6);
                let angle = values(&text, &start, "inputs:angle")[0];
                assert!((angle - 2.0 * light.angular_radius.to_degrees()).abs() < 1e-5);
                let (color, intensity) = (
                    values(&text, &start, "inputs:color"),
                    values(&text, &start, "inputs:intensity")[0],
                );
                let facing = light.irradiance * (0.5 * (1.0 + light.angular_radius.cos()));
                for (c, f) in color.iter().zip(facing.to_array()) {
                    assert!((c * intensity - f).abs() < 1e-6);
                }
            }
        });
    }

    #[test]
    fn the_stage_has_the_axes_of_the_world() {
        with_example(|rig| {
            assert!(encode(rig).unwrap().as_str().contains("upAxis = \"Y\""));
            let orientation = crate::environment::Orientation { up: UpAxis::Z, rotation: 0.0 };
            let text = encode(&RigExport { orientation, ..*rig }).unwrap().into_string();
            assert!(text.contains("upAxis = \"Z\""));
            // The pole, +Y of the DomeLight, is up; its +Z looks at the middle of the map, +Y.
            let q = values(&text, "DomeLight", "xformOp:orient");
            let q = Quat::from_xyzw(q[1], q[2], q[3], q[0]);
            assert!((q * Vec3::Y - Vec3::Z).length() < 1e-6);
            assert!((q * Vec3::Z - Vec3::Y).length() < 1e-6);
        });
    }

    #[test]
    fn names_are_escaped() {
        for (file, written) in [
            ("residual.exr", "@./residual.exr@"),
            ("../a b.exr", "@../a b.exr@"),
            ("C:/maps/r.exr", "@C:/maps/r.exr@"),
            ("r@1.exr", "@@@./r@1.exr@@@"),
        ] {
            with_dome_file(file, |rig| {
                let text = encode(&RigExport { probe: "a\"\nb", ..*rig }).unwrap().into_string();
                assert!(text.contains(&format!("texture:file = {written}\n")), "{text}");
                assert!(text.contains(r#"doc = "The lights of a\"\nb, by domelight.""#));
            });
        }
    }
}
