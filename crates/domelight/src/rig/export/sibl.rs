//! An sIBL set (`.ibl`) of HDR Labs: a file of sections that names a panorama and its lights.
//!
//! `u` and `v` are the light's place in the panorama, from its left and top in [0, 1]; the picture
//! decides where that is in the world. Colors are 0 … 255 with a multiplier: in sIBL's programs a
//! light of multiplier 1 makes a white matte surface that faces it as bright as white in the
//! panorama, so the multiplier is irradiance over π. The first light is `[Sun]`; the others are
//! `[Light1]`, …, which older loaders pass over. Lights have no size. (`[Enviroment]` is spelt so.)
//!
//! Source: <http://www.hdrlabs.com/sibl/formatspecs.html>.

use std::f32::consts::PI;

use super::RigExport;
use super::disc::color_and_strength;
use super::{ExportError, Format};
use crate::code;
use crate::environment::mapping::Mapping;
use crate::quote::{Code, Sibl, sibl};

pub(super) fn encode(rig: &RigExport) -> Result<Code<Sibl>, ExportError> {
    let mut text = code!(
        Sibl,
        "[Header]\nName = {probe}\nAuthor = \"domelight\"\nComment = {comment}\n",
        probe = sibl::caption(rig.probe),
        comment = sibl::caption(&format!("The lights of {}", rig.probe)),
    );
    if let (Some(file), Some(dome)) = (rig.dome_file(), rig.dome) {
        let file = sibl::value(file).ok_or_else(|| Format::Sibl.cannot_name(file))?;
        for (section, group) in [("Background", "BG"), ("Enviroment", "EV"), ("Reflection", "REF")]
        {
            text += code!(
                Sibl,
                "\n[{section}]\n{group}file = {file}\n{group}map = 1\n{group}u = 0\n{group}v = 0\n\
                 {group}height = {height}\n",
                section = section,
                group = group,
                file = file,
                height = dome.environment.map().height,
            );
            if group != "BG" {
                text += code!(Sibl, "{group}multi = 1\n{group}gamma = 1\n", group = group);
            }
        }
    }
    let world_to_map = rig.orientation.map_to_world().transpose();
    for (i, (light, name)) in rig.lights.iter().zip(rig.names()).enumerate() {
        let [u, v] = Mapping::LatLong.uv(world_to_map * light.direction).to_array();
        let (color, strength) = color_and_strength(light.irradiance / PI);
        let [r, g, b] = color.to_array().map(|c| (255.0 * c).round());
        let (section, group) = match i {
            0 => (Code::literal("Sun"), "SUN"),
            i => (code!(Sibl, "Light{i}", i = i), "LIGHT"),
        };
        text += code!(Sibl, "\n[{section}]\n", section = section);
        if group == "LIGHT" {
            text += code!(Sibl, "LIGHTname = {name}\n", name = sibl::caption(&name));
        }
        text += code!(
            Sibl,
            "{group}color = {r},{g},{b}\n{group}multi = {strength}\n{group}u = {u}\n{group}v = {v}\n",
            group = group,
            r = r,
            g = g,
            b = b,
            strength = strength,
            u = u,
            v = v,
        );
    }
    Ok(text)
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
            let text = encode(rig).unwrap().into_string();
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
            let text = encode(rig).unwrap().into_string();
            assert_eq!(section(&text, "Enviroment")["EVfile"], "\"residual.exr\"");
            assert_eq!(section(&text, "Reflection")["REFheight"], "8");
            let rig = RigExport { dome: None, probe: "a \"b\"\n[Sun]", ..*rig };
            let without = encode(&rig).unwrap().into_string();
            assert!(!without.contains("EVfile"));
            assert!(without.starts_with("[Header]\nName = \"a 'b' [Sun]\"\n"));
        });
    }
}
