//! An sIBL set (`.ibl`) of HDR Labs: a file of sections that names a panorama and its lights.
//!
//! `u` and `v` are the light's place in the panorama, from its left and top in [0, 1]; the picture
//! decides where that is in the world. Colours are 0 … 255 with a multiplier: in sIBL's programs a
//! light of multiplier 1 makes a white matt surface that faces it as bright as white in the
//! panorama, so the multiplier is irradiance over π. The first light is `[Sun]`; the others are
//! `[Light1]`, …, which older loaders pass over. Lights have no size. (`[Enviroment]` is spelt so.)
//!
//! Source: <http://www.hdrlabs.com/sibl/formatspecs.html>.

use std::f32::consts::PI;
use std::fmt::Write;

use super::RigExport;
use super::disc::color_and_strength;
use super::text::one_line;
use crate::environment::mapping::Mapping;

pub(super) fn encode(rig: &RigExport) -> String {
    let mut text = String::from("[Header]\n");
    let _ = writeln!(text, "Name = {}", quoted(rig.probe));
    text += "Author = \"domelight\"\n";
    let _ = writeln!(text, "Comment = {}", quoted(&format!("The lights of {}", rig.probe)));
    if let (Some(file), Some(dome)) = (rig.dome_file(), rig.dome) {
        let (file, height) = (quoted(file), dome.environment.map().height);
        for (section, group) in [("Background", "BG"), ("Enviroment", "EV"), ("Reflection", "REF")]
        {
            let _ = write!(
                text,
                "\n[{section}]\n{group}file = {file}\n{group}map = 1\n{group}u = 0\n{group}v = 0\n\
                 {group}height = {height}\n"
            );
            if group != "BG" {
                let _ = write!(text, "{group}multi = 1\n{group}gamma = 1\n");
            }
        }
    }
    let world_to_map = rig.orientation.map_to_world().transpose();
    for (i, (light, name)) in rig.lights.iter().zip(rig.names()).enumerate() {
        let [u, v] = Mapping::LatLong.uv(world_to_map * light.direction).to_array();
        let (color, strength) = color_and_strength(light.irradiance / PI);
        let [r, g, b] = color.to_array().map(|c| (255.0 * c).round());
        let (section, group) = match i {
            0 => ("Sun".to_owned(), "SUN"),
            i => (format!("Light{i}"), "LIGHT"),
        };
        let _ = writeln!(text, "\n[{section}]");
        if group == "LIGHT" {
            let _ = writeln!(text, "LIGHTname = {}", quoted(&name));
        }
        let _ = write!(
            text,
            "{group}color = {r},{g},{b}\n{group}multi = {strength}\n{group}u = {u}\n{group}v = {v}\n"
        );
    }
    text
}

/// In double quotes; the format has no way to write one within them.
fn quoted(text: &str) -> String {
    format!("\"{}\"", one_line(text).replace('"', "'"))
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use crate::environment::Environment;

    /// The values of a section.
    fn section<'a>(text: &'a str, name: &str) -> std::collections::HashMap<&'a str, &'a str> {
        let start = text.find(&format!("[{name}]\n")).unwrap();
        let lines = text[start..].lines().skip(1).take_while(|line| !line.is_empty());
        lines.map(|line| line.split_once(" = ").unwrap()).collect()
    }

    #[test]
    fn lights_are_where_the_panorama_looks_toward_them() {
        with_example(|rig| {
            let text = encode(rig);
            let environment: &Environment = rig.dome.unwrap().environment;
            for (light, name) in rig.lights.iter().zip(["Sun", "Light1", "Light2"]) {
                let values = section(&text, name);
                let prefix = if name == "Sun" { "SUN" } else { "LIGHT" };
                let number =
                    |key: &str| values[format!("{prefix}{key}").as_str()].parse::<f32>().unwrap();
                let uv = environment.uv(light.direction);
                assert!((number("u") - uv.x).abs() < 1e-5 && (number("v") - uv.y).abs() < 1e-5);
                let peak = light.irradiance.max_component();
                assert!((number("multi") * PI - peak).abs() < 1e-5);
            }
            assert_eq!(section(&text, "Sun")["SUNcolor"], "255,9,0");
        });
    }

    #[test]
    fn the_panorama_is_the_dome() {
        with_example(|rig| {
            let text = encode(rig);
            assert_eq!(section(&text, "Enviroment")["EVfile"], "\"residual.exr\"");
            assert_eq!(section(&text, "Reflection")["REFheight"], "8");
            let without = encode(&RigExport { dome: None, probe: "a \"b\"\n[Sun]", ..*rig });
            assert!(!without.contains("EVfile"));
            assert!(without.starts_with("[Header]\nName = \"a 'b' [Sun]\"\n"));
        });
    }
}
