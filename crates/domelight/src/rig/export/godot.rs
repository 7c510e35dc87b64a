//! A scene of Godot 4: a node with `DirectionalLight3D`s and a `WorldEnvironment`, to instantiate in a scene.
//!
//! A light shines along its local −Z. Godot's shader multiplies color and energy by π, or with physical light units by
//! the light's lux instead, and a matte surface reflects 1/π of that (`light_storage.cpp`, `update_light_buffers`). So
//! energy E/π with 683 π lux is right either way, and so is a sky of 683 cd·m⁻². Colors are sRGB.
//! `light_angular_distance` is the full angle ("the Sun from the Earth is approximately 0.5", `Light3D.xml`). A
//! panorama has its center at +Z where ours is at −Z, and `sky_rotation` turns it counterclockwise about +Y (`sky.glsl`,
//! `sky.cpp`). `sky_mode` 1 keeps procedural skies from drawing the sun a second time.

use std::f32::consts::PI;

use super::axes::Axes;
use super::disc::color_and_strength;
use super::photometric::LUMENS_PER_WATT;
use super::text::{numbers, vector};
use super::{ExportError, Format, RigExport};
use crate::code;
use crate::environment::UpAxis;
use crate::math::{Vec3, vec3};
use crate::picture::tone::srgb_from_linear;
use crate::quote::{Code, Godot, godot};

pub(super) fn encode(rig: &RigExport) -> Result<Code<Godot>, ExportError> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut text = code!(
        Godot,
        "[gd_scene format=3]\n\n\
         ; The lights of {probe}, by domelight.\n\
         ; The picture of the dome is light without the lights below: switch other suns and skies off.\n\
         ; With and without physical light units: 1 W is 683 lm.\n\n",
        probe = godot::comment(rig.probe),
    );
    if let Some(file) = rig.dome_file() {
        text += resources(file, rig.orientation.rotation)?;
    }
    text += "[node name=\"domelight\" type=\"Node3D\"]\n\n";
    if rig.dome_file().is_some() {
        text += "[node name=\"sky\" type=\"WorldEnvironment\" parent=\".\"]\n\
                 environment = SubResource(\"environment\")\n\n";
    }
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let (color, strength) = color_and_strength(light.irradiance);
        text += code!(
            Godot,
            "[node name={name} type=\"DirectionalLight3D\" parent=\".\"]\n\
             transform = Transform3D({basis}, 0, 0, 0)\n\
             light_color = Color({color}, 1)\n\
             light_energy = {energy}\n\
             light_intensity_lux = {lux}\n\
             light_angular_distance = {angle}\n\
             shadow_enabled = true\n\
             sky_mode = 1\n\n",
            name = godot::string(&name),
            basis = basis(axes.world * light.direction),
            color = numbers(color.to_array().map(srgb_from_linear), ", "),
            energy = strength / PI,
            lux = LUMENS_PER_WATT * PI,
            angle = (2.0 * light.angular_radius).to_degrees().min(90.0),
        );
    }
    Ok(text)
}

/// The sky and the environment that it lights.
fn resources(file: &str, rotation: f32) -> Result<Code<Godot>, ExportError> {
    Ok(code!(
        Godot,
        "[ext_resource type=\"Texture2D\" path={file} id=\"dome\"]\n\n\
         [sub_resource type=\"PanoramaSkyMaterial\" id=\"panorama\"]\n\
         panorama = ExtResource(\"dome\")\n\n\
         [sub_resource type=\"Sky\" id=\"sky\"]\n\
         sky_material = SubResource(\"panorama\")\n\n\
         [sub_resource type=\"Environment\" id=\"environment\"]\n\
         background_mode = 2\n\
         background_intensity = {nits}\n\
         sky = SubResource(\"sky\")\n\
         sky_rotation = Vector3(0, {turn}, 0)\n\
         ambient_light_source = 3\n\
         reflected_light_source = 2\n\n",
        file = godot::path(file).ok_or_else(|| Format::Godot.cannot_name(file))?,
        nits = LUMENS_PER_WATT,
        turn = (rotation + 180.0).to_radians(),
    ))
}

/// The rows of a rotation that takes +Z to the unit vector `z`.
fn basis(z: Vec3) -> Code<Godot> {
    let across = if z.y.abs() > 0.999 { Vec3::X } else { Vec3::Y };
    let x = across.cross(z).normalize();
    let y = z.cross(x);
    let rows = [0, 1, 2].map(|i| numbers(vector(vec3(x[i], y[i], z[i])), ", "));
    Code::join(rows, ", ")
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    /// The numbers in brackets after `key`, of each line that has it.
    fn values(text: &str, key: &str) -> Vec<Vec<f32>> {
        let lines = text.lines().filter_map(|line| line.strip_prefix(key));
        lines
            .map(|line| {
                let list = line.trim_start_matches(|c: char| c != '(').trim_matches(['(', ')']);
                list.split(", ").map(|number| number.parse().unwrap()).collect()
            })
            .collect()
    }

    #[test]
    fn lights_shine_from_their_directions_with_their_irradiance() {
        with_example(|rig| {
            let text = encode(rig).unwrap().into_string();
            let transforms = values(&text, "transform = ");
            let colors = values(&text, "light_color = ");
            let energies: Vec<f32> = text
                .lines()
                .filter_map(|line| line.strip_prefix("light_energy = "))
                .map(|number| number.parse().unwrap())
                .collect();
            assert_eq!(transforms.len(), rig.lights.len());
            for (i, light) in rig.lights.iter().enumerate() {
                let t = &transforms[i];
                // The third column is the local +Z, against which the light shines.
                let z = vec3(t[2], t[5], t[8]);
                assert!((z - light.direction).length() < 1e-6, "{z}");
                let [x, y] = [0, 1].map(|k| vec3(t[k], t[k + 3], t[k + 6]));
                assert!((x.cross(y) - z).length() < 1e-6 && x.dot(y).abs() < 1e-6);
                for c in 0..3 {
                    let linear = crate::picture::tone::linear_from_srgb(colors[i][c]);
                    let irradiance = PI * energies[i] * linear;
                    assert!((irradiance - light.irradiance.to_array()[c]).abs() < 1e-5);
                }
            }
        });
    }

    #[test]
    fn the_sky_names_its_picture_and_its_turn() {
        with_dome_file("a \"b\"\\.exr", |rig| {
            let text = encode(rig).unwrap().into_string();
            assert!(text.contains(r#"path="a \"b\"\\.exr""#), "{text}");
            let turn = values(&text, "sky_rotation = ")[0][1];
            assert!((turn - 210f32.to_radians()).abs() < 1e-6);
            let without = encode(&RigExport { dome: None, ..*rig }).unwrap();
            assert!(!without.as_str().contains("WorldEnvironment"));
        });
        with_dome_file("res://x.exr", |rig| assert!(encode(rig).is_err()));
    }
}
