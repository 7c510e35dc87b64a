//! A Mitsuba 3 scene that holds the lights alone: `<include filename="rig.xml"/>` adds them to
//! another.
//!
//! A light is a `directional` emitter: `irradiance` is that of a surface that faces it \[W·m⁻²\],
//! `direction` is the way that light travels, away from the light. It has no size. The dome is an
//! `envmap`, whose center column looks toward +Z where ours looks toward −Z, so its `to_world` has
//! half a turn about +Y. Axes are those of the rig's world.

use std::f32::consts::PI;

use super::RigExport;
use super::axes::Axes;
use super::text::{numbers, vector};
use super::{ExportError, Format};
use crate::code;
use crate::math::{Mat4, rotation_y};
use crate::quote::{Code, Xml, xml};

pub(super) fn encode(rig: &RigExport) -> Result<Code<Xml>, ExportError> {
    let mut text = code!(
        Xml,
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <!-- The lights of {probe}, by domelight. -->\n\
         <scene version=\"3.0.0\">\n",
        probe = xml::comment(rig.probe)
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        text += code!(
            Xml,
            r#"    <emitter type="directional" id="{name}">
        <vector name="direction" value="{direction}"/>
        <rgb name="irradiance" value="{irradiance}"/>
    </emitter>
"#,
            name = xml::text(&name),
            direction = numbers(vector(-light.direction), ", "),
            irradiance = numbers(light.irradiance.to_array(), ", "),
        );
    }
    if let Some(file) = rig.dome_file() {
        let to_world = Axes::of_world(rig).dome * rotation_y(PI);
        let rows = Mat4::from_mat3(to_world).transpose().to_cols_array();
        text += code!(
            Xml,
            r#"    <emitter type="envmap" id="dome">
        <string name="filename" value="{file}"/>
        <transform name="to_world">
            <matrix value="{matrix}"/>
        </transform>
    </emitter>
"#,
            file = filename(file)?,
            matrix = Code::generated(rows.map(|value| (value + 0.0).to_string()).join(" ")),
        );
    }
    Ok(text + "</scene>\n")
}

/// Mitsuba takes what follows a dollar for the name of a parameter, and has no other way to write one.
fn filename(file: &str) -> Result<Code<Xml>, ExportError> {
    let holds = xml::holds(file) && !file.contains(|c: char| c == '$' || c.is_control());
    if holds { Ok(xml::text(file)) } else { Err(Format::Mitsuba.cannot_name(file)) }
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    #[test]
    fn light_travels_away_from_the_light() {
        with_example(|rig| {
            let text = encode(rig).unwrap().into_string();
            assert_eq!(text.matches("type=\"directional\"").count(), rig.lights.len());
            assert!(text.contains(r#"id="sun""#) && text.contains(r#"value="0, -0.6, 0.8""#));
            assert!(text.contains(r#"<rgb name="irradiance" value="3, 0.1, 0"/>"#));
        });
    }

    #[test]
    fn without_a_dome_there_is_no_map() {
        with_example(|rig| {
            assert!(
                encode(rig)
                    .unwrap()
                    .as_str()
                    .contains(r#"<string name="filename" value="residual.exr"/>"#)
            );
            let without = encode(&RigExport { dome: None, ..*rig }).unwrap();
            assert!(!without.as_str().contains("envmap"));
        });
    }

    #[test]
    fn names_are_escaped() {
        with_dome_file("a\"<&>.exr", |rig| {
            let text = encode(&RigExport { probe: "-->\n<bsdf/>", ..*rig }).unwrap().into_string();
            assert!(text.contains("value=\"a&quot;&lt;&amp;&gt;.exr\""), "{text}");
            assert_eq!(text.matches("-->").count(), 1);
        });
    }
}
