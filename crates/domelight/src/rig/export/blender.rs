//! A script for Blender 4.2 or later: `blender --python rig.py`, or pasted into its console.
//!
//! A light is a sun, which shines along its local −Z: `energy` times `color` is what a surface that
//! faces it receives \[W·m⁻²\], `angle` the full angle of its disc \[rad\]; Blender keeps the
//! irradiance as the angle changes. The dome becomes the world: an environment texture, whose
//! middle Blender shows at +X where ours is at +Y. The world is Z-up.
//!
//! A script that runs again replaces the collection and the world "domelight" of its former run, the world's picture
//! included; without a dome that world stays, black.
//!
//! The console runs a line at a time: blocks have no empty lines within, and one after them.

use std::f32::consts::FRAC_PI_2;

use super::RigExport;
use super::axes::Axes;
use super::disc::{Disc, color_and_strength};
use super::text::{numbers, vector};
use crate::code;
use crate::environment::UpAxis;
use crate::quote::{Code, Python, python};

const ADD_LIGHTS: &str = r#"
def remove_former_lights():
    former = bpy.data.collections.get("domelight")
    if former is None:
        return
    for sun in list(former.objects):
        light = sun.data
        bpy.data.objects.remove(sun)
        if light is not None and light.users == 0:
            bpy.data.lights.remove(light)
    bpy.data.collections.remove(former)

def remove_former_world():
    world = bpy.data.worlds.get("domelight")
    if world is None or world.node_tree is None:
        return
    nodes = world.node_tree.nodes
    pictures = {node.image for node in nodes if node.type == "TEX_ENVIRONMENT" and node.image is not None}
    nodes.clear()
    for picture in pictures:
        if picture.users == 0:
            bpy.data.images.remove(picture)

def add_lights():
    collection = bpy.data.collections.new("domelight")
    bpy.context.scene.collection.children.link(collection)
    for name, toward, color, strength, angle in LIGHTS:
        light = bpy.data.lights.new(name, "SUN")
        light.color, light.energy, light.angle = color, strength, angle
        sun = bpy.data.objects.new(name, light)
        sun.rotation_euler = Vector(toward).to_track_quat("Z", "Y").to_euler()
        collection.objects.link(sun)

remove_former_lights()
remove_former_world()
add_lights()
"#;

const SET_WORLD: &str = r#"
def find_dome():
    beside_script = os.path.dirname(os.path.abspath(globals().get("__file__", "")))
    folders = [beside_script, bpy.path.abspath("//"), os.getcwd()]
    paths = [os.path.join(folder, DOME) for folder in folders]
    for path in filter(os.path.isfile, paths):
        return path
    raise FileNotFoundError("the residual map is in none of these: " + ", ".join(paths))

def set_world():
    world = bpy.data.worlds.get("domelight") or bpy.data.worlds.new("domelight")
    world.use_nodes = True
    nodes, link = world.node_tree.nodes, world.node_tree.links.new
    nodes.clear()  # What Blender puts into a new one.
    place = nodes.new("ShaderNodeTexCoord")
    turn = nodes.new("ShaderNodeMapping")
    turn.inputs["Rotation"].default_value = (0, 0, DOME_ROTATION)
    picture = nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(find_dome())
    background = nodes.new("ShaderNodeBackground")
    output = nodes.new("ShaderNodeOutputWorld")
    link(place.outputs["Generated"], turn.inputs["Vector"])
    link(turn.outputs["Vector"], picture.inputs["Vector"])
    link(picture.outputs["Color"], background.inputs["Color"])
    link(background.outputs["Background"], output.inputs["Surface"])
    for i, node in enumerate((place, turn, picture, background, output)):
        node.location = (250 * i, 0)
    bpy.context.scene.world = world

set_world()
"#;

pub(super) fn encode(rig: &RigExport) -> Code<Python> {
    let axes = Axes::with_up(rig, UpAxis::Z);
    // The first line says how the file is encoded, which no comment can say after it.
    let mut text = code!(
        Python,
        "# -*- coding: utf-8 -*-\n\
         # The lights of {probe}, by domelight, for Blender 4.2 or later.\n\
         import os\nimport bpy\nfrom mathutils import Vector\n\n\
         # Name, toward the light, color, strength in W/m2, angle in radians\n\
         LIGHTS = [\n",
        probe = python::comment(rig.probe)
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let Disc { radius, facing } = Disc::of(light);
        let (color, strength) = color_and_strength(facing);
        text += code!(
            Python,
            "    ({name}, ({toward}), ({color}), {strength}, {angle}),\n",
            name = python::string(&name),
            toward = numbers(vector(axes.world * light.direction), ", "),
            color = numbers(color.to_array(), ", "),
            strength = strength,
            angle = 2.0 * radius,
        );
    }
    text += "]\n";
    text += ADD_LIGHTS;
    if let Some(file) = rig.dome_file() {
        // Blender looks a direction up at the place that the mapping turns it to.
        let rotation = -rig.orientation.rotation.to_radians() - FRAC_PI_2;
        text += code!(
            Python,
            "\n# The map without the light of these lights\nDOME = {file}\nDOME_ROTATION = {rotation}\n",
            file = python::string(file),
            rotation = rotation,
        );
        text += SET_WORLD;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    #[test]
    fn suns_face_surfaces_with_their_discs() {
        with_example(|rig| {
            let text = encode(rig).into_string();
            let line = text.lines().find(|line| line.contains("\"sun\"")).unwrap();
            // Y-up (0, 0.6, −0.8) is Z-up (0, 0.8, 0.6).
            assert!(line.contains("(0, 0.8, 0.6)"), "{line}");
            let numbers: Vec<f32> = line
                .trim_end_matches("),")
                .rsplit(", ")
                .take(2)
                .map(|number| number.parse().unwrap())
                .collect();
            assert_eq!(numbers[0], 2.0 * rig.lights[0].angular_radius);
            let facing = 3.0 * 0.5 * (1.0 + rig.lights[0].angular_radius.cos());
            assert!((numbers[1] - facing).abs() < 1e-6);
        });
    }

    /// In the console an empty line ends a block, and a block needs one to end.
    #[test]
    fn blocks_can_be_pasted_into_the_console() {
        with_example(|rig| {
            let text = encode(rig).into_string();
            let lines: Vec<&str> = text.lines().collect();
            for pair in lines.windows(2) {
                let indented = |line: &str| line.starts_with("    ");
                if indented(pair[0]) && !pair[0].starts_with("    (") {
                    assert!(indented(pair[1]) || pair[1].is_empty(), "{pair:?}");
                }
                assert!(!(pair[0].is_empty() && indented(pair[1])), "{pair:?}");
            }
        });
    }

    #[test]
    fn names_are_escaped() {
        with_dome_file("C:\\maps\\\"r\".exr", |rig| {
            let text = encode(&RigExport { probe: "a\nimport os", ..*rig }).into_string();
            assert!(text.contains(r#"DOME = "C:\\maps\\\"r\".exr""#), "{text}");
            assert!(text.lines().nth(1).unwrap().starts_with("# The lights of a import os, by"));
            let without = encode(&RigExport { dome: None, ..*rig });
            assert!(!without.as_str().contains("set_world"));
        });
    }
}
