//! A Python script for the editor of Unreal Engine 5: `DirectionalLight`s and a `SkyLight` of the dome.
//!
//! Unreal's world is left-handed with +Z up. Its importers of glTF and FBX exchange y and z, and so does this script, so that
//! the lights stand around an imported model as here: our front, −Z, is −Y. A directional light has lux, and `light_source_angle` is its full angle \[degrees\]. A sky light's intensity times a texel is cd·m⁻². A picture
//! in `.hdr` is imported as a cube, whose panorama has its center at −Y (`TextureCompressorModule.cpp`,
//! `GenerateBaseCubeMipFromLongitudeLatitude2D`), and a sky light looks it up turned by `source_cubemap_angle` from +X
//! toward +Y (`ReflectionEnvironmentShaders.usf`, `CopyCubemapToCubeFaceColorPS`).
//!
//! A script that runs again replaces the actors in the folder "domelight" of its former run.

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use super::photometric::LUMENS_PER_WATT;
use super::text::{numbers, vector};
use crate::code;
use crate::environment::UpAxis;
use crate::math::{Vec3, vec3};
use crate::quote::{Code, Python, python};

const FUNCTIONS: &str = r#"

def add(actor_class, name, rotation):
    actor = actors.spawn_actor_from_class(actor_class, unreal.Vector(0, 0, 0), rotation)
    actor.set_actor_label(name)
    actor.set_folder_path("domelight")
    return actor


def remove_former():
    for actor in actors.get_all_level_actors():
        if str(actor.get_folder_path()) == "domelight":
            actors.destroy_actor(actor)


def add_lights():
    for name, toward, color, irradiance, angle in LIGHTS:
        away = unreal.Vector(*(-c for c in toward))
        sun = add(unreal.DirectionalLight, name, unreal.MathLibrary.conv_vector_to_rotator(away))
        light = sun.get_component_by_class(unreal.DirectionalLightComponent)
        light.set_mobility(unreal.ComponentMobility.MOVABLE)
        light.set_intensity(LUMENS_PER_WATT * irradiance)
        light.set_light_color(unreal.LinearColor(*color, 1), True)
        light.set_editor_property("light_source_angle", angle)
        # The dome has its light: no atmosphere draws this sun a second time.
        light.set_editor_property("atmosphere_sun_light", False)


def import_dome():
    task = unreal.AssetImportTask()
    task.filename = os.path.join(os.path.dirname(os.path.abspath(__file__)), DOME)
    task.destination_path = "/Game/domelight"
    task.automated = task.replace_existing = task.save = True
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    return unreal.load_asset(task.imported_object_paths[0])


def add_sky():
    sky = add(unreal.SkyLight, "dome", unreal.Rotator(0, 0, 0))
    light = sky.get_component_by_class(unreal.SkyLightComponent)
    light.set_mobility(unreal.ComponentMobility.MOVABLE)
    light.set_editor_property("real_time_capture", False)
    light.set_editor_property("source_type", unreal.SkyLightSourceType.SLS_SPECIFIED_CUBEMAP)
    light.set_editor_property("cubemap", import_dome())
    light.set_editor_property("source_cubemap_angle", DOME_ANGLE)
    light.set_editor_property("lower_hemisphere_is_black", False)
    light.set_intensity(LUMENS_PER_WATT)
    light.recapture_sky()


actors = unreal.get_editor_subsystem(unreal.EditorActorSubsystem)
remove_former()
add_lights()
if DOME is not None:
    add_sky()
"#;

pub(super) fn encode(rig: &RigExport) -> Code<Python> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut text = code!(
        Python,
        "# Lights for Unreal Engine 5: Tools > Execute Python Script.\n\
         # Switch other suns, skies and atmospheres of the level off; the dome below is light without the lights below.\n\
         # The lights of {probe}, by domelight.\n\n\
         import os\n\n\
         import unreal\n\n\
         # 1 W is 683 lm. For the probe's own units, 2 ** EV.\n\
         LUMENS_PER_WATT = {lumens}\n\
         # Toward the light; linear color; irradiance [W/m2]; full angle [degrees].\n\
         LIGHTS = [\n",
        probe = python::comment(rig.probe),
        lumens = LUMENS_PER_WATT,
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let (color, strength) = color_and_strength(light.irradiance);
        text += code!(
            Python,
            "    ({name}, ({toward}), ({color}), {strength}, {angle}),\n",
            name = python::string(&name),
            toward = numbers(vector(from_y_up(axes.world * light.direction)), ", "),
            color = numbers(color.to_array(), ", "),
            strength = strength,
            angle = (2.0 * light.angular_radius).to_degrees().min(180.0),
        );
    }
    text += "]\n";
    text += match rig.dome_file() {
        None => Code::literal("DOME = None\n"),
        Some(file) => code!(
            Python,
            "DOME = {file}\n# From the panorama's center at -Y to its place [degrees].\nDOME_ANGLE = {angle}\n",
            file = python::string(file),
            angle = dome_angle(rig.orientation.rotation),
        ),
    };
    text += FUNCTIONS;
    text
}

/// Unreal's direction of a direction in a world with +Y up.
fn from_y_up(d: Vec3) -> Vec3 {
    vec3(d.x, d.z, d.y)
}

/// The sky light's angle for a map with this rotation \[degrees\], in \[0, 360).
fn dome_angle(rotation: f32) -> f32 {
    rotation.rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use crate::environment::Orientation;

    #[test]
    fn front_is_minus_y_right_is_x_and_up_is_z() {
        assert_eq!(from_y_up(Vec3::NEG_Z), Vec3::NEG_Y);
        assert_eq!(from_y_up(Vec3::X), Vec3::X);
        assert_eq!(from_y_up(Vec3::Y), Vec3::Z);
    }

    /// The direction of each column as the engine looks it up is that of the map.
    #[test]
    fn the_sky_stands_as_the_map_does() {
        for rotation in [0.0f32, 30.0, 215.0] {
            let (sin, cos) = dome_angle(rotation).to_radians().sin_cos();
            let map_to_world = Orientation { rotation, ..Orientation::default() }.map_to_world();
            for column in 0..16 {
                let phi = std::f32::consts::TAU * (column as f32 / 16.0 - 0.5);
                let world = map_to_world * vec3(phi.sin(), 0.0, -phi.cos());
                let d = from_y_up(world);
                // The cube's texel, and its column in the panorama.
                let s = [cos * d.x - sin * d.y, sin * d.x + cos * d.y];
                let u = 0.5 + s[0].atan2(-s[1]) / std::f32::consts::TAU;
                let off = (u - column as f32 / 16.0).rem_euclid(1.0);
                assert!(off.min(1.0 - off) < 1e-5, "{rotation} {column}: {u}");
            }
        }
    }

    #[test]
    fn names_are_escaped_and_blocks_are_python() {
        with_example(|rig| {
            let text = encode(&RigExport { probe: "a\nimport os", ..*rig }).into_string();
            assert!(text.contains("# The lights of a import os, by domelight."), "{text}");
            assert!(text.contains("DOME = \"residual.exr\"\n"), "{text}");
            let without = encode(&RigExport { dome: None, ..*rig });
            assert!(without.as_str().contains("DOME = None\n"));
        });
    }
}
