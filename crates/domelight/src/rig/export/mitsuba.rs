//! A Mitsuba 3 scene that holds the lights alone: `<include filename="rig.xml"/>` adds them to
//! another.
//!
//! A light is a `directional` emitter: `irradiance` is that of a surface that faces it \[W·m⁻²\],
//! `direction` is the way that light travels, away from the light. It has no size. The dome is an
//! `envmap`, whose centre column looks toward +Z where ours looks toward −Z, so its `to_world` has
//! half a turn about +Y. Axes are those of the rig's world.

use std::f32::consts::PI;
use std::fmt::Write;

use super::RigExport;
use super::axes::Axes;
use super::text::{numbers, one_line, vector};
use crate::math::{Mat3, Mat4};

pub(super) fn encode(rig: &RigExport) -> String {
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n");
    let _ = writeln!(text, "<!-- The lights of {}, by domelight. -->", comment(rig.probe));
    text += "<scene version=\"3.0.0\">\n";
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let direction = numbers(vector(-light.direction), ", ");
        let irradiance = numbers(light.irradiance.to_array(), ", ");
        let _ = write!(
            text,
            r#"    <emitter type="directional" id="{name}">
        <vector name="direction" value="{direction}"/>
        <rgb name="irradiance" value="{irradiance}"/>
    </emitter>
"#
        );
    }
    if let Some(file) = rig.dome_file() {
        let to_world = Axes::of_world(rig).dome * Mat3::from_rotation_y(PI);
        let rows = Mat4::from_mat3(to_world).transpose().to_cols_array();
        let matrix = rows.map(|value| (value + 0.0).to_string()).join(" ");
        let file = attribute(file);
        let _ = write!(
            text,
            r#"    <emitter type="envmap" id="dome">
        <string name="filename" value="{file}"/>
        <transform name="to_world">
            <matrix value="{matrix}"/>
        </transform>
    </emitter>
"#
        );
    }
    text + "</scene>\n"
}

/// Within a comment: XML forbids two hyphens in a row, and one at the end.
fn comment(text: &str) -> String {
    one_line(text).replace('-', "\u{2010}")
}

/// Within an attribute in double quotes.
fn attribute(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in one_line(text).chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '"' => escaped += "&quot;",
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    #[test]
    fn light_travels_away_from_the_light() {
        with_example(|rig| {
            let text = encode(rig);
            assert_eq!(text.matches("type=\"directional\"").count(), rig.lights.len());
            assert!(text.contains(r#"id="sun""#) && text.contains(r#"value="0, -0.6, 0.8""#));
            assert!(text.contains(r#"<rgb name="irradiance" value="3, 0.1, 0"/>"#));
        });
    }

    #[test]
    fn without_a_dome_there_is_no_map() {
        with_example(|rig| {
            assert!(encode(rig).contains(r#"<string name="filename" value="residual.exr"/>"#));
            assert!(!encode(&RigExport { dome: None, ..*rig }).contains("envmap"));
        });
    }

    #[test]
    fn names_are_escaped() {
        with_dome_file("a\"<&>.exr", |rig| {
            let text = encode(&RigExport { probe: "-->\n<bsdf/>", ..*rig });
            assert!(text.contains("value=\"a&quot;&lt;&amp;>.exr\""), "{text}");
            assert_eq!(text.matches("-->").count(), 1);
        });
    }
}
