//! A Rust module for Bevy: `spawn_rig` spawns the lights, `dome` is the component for cameras.
//!
//! A light shines along the forward direction of its transform, −Z. `illuminance` is in lux, and the color, which is
//! linear, is multiplied by it (`bevy_pbr`, `render/light.rs`); it has no size. A camera's `EnvironmentMapLight` has cubes
//! that were filtered before, in multiples of `intensity` \[cd·m⁻²\]: `domelight ibl --for bevy` makes them of the dome's
//! picture, turned as the probe. Fields of later versions keep their defaults; set the one for shadows, whose name
//! depends on the version.

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use super::photometric::LUMENS_PER_WATT;
use super::text::vector;
use crate::code;
use crate::environment::UpAxis;
use crate::quote::{Code, Rust, Shell, rust, shell};

const SPAWN: &str = r"
pub fn spawn_rig(commands: &mut Commands) {
    for (name, [x, y, z], [r, g, b], irradiance) in LIGHTS {
        let light = DirectionalLight {
            color: Color::linear_rgb(r, g, b),
            illuminance: LUMENS_PER_WATT * irradiance,
            ..default()
        };
        let away = Vec3::new(-x, -y, -z);
        let up = if y.abs() > 0.999 { Vec3::X } else { Vec3::Y };
        commands.spawn((Name::new(name), light, Transform::default().looking_to(away, up)));
    }
}
";

const DOME: &str = r"
pub fn dome(assets: &AssetServer) -> EnvironmentMapLight {
    EnvironmentMapLight {
        diffuse_map: assets.load(DIFFUSE),
        specular_map: assets.load(SPECULAR),
        intensity: LUMENS_PER_WATT,
        ..default()
    }
}
";

pub(super) fn encode(rig: &RigExport) -> Code<Rust> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut text = code!(
        Rust,
        "// The lights of {probe}, by domelight, for Bevy: spawn_rig(&mut commands).\n\
         // Despawn other suns and skies; the dome is light without the lights below.\n\n\
         use bevy::prelude::*;\n\n\
         /// 1 W is 683 lm. For the probe's own units, 2^EV.\n\
         const LUMENS_PER_WATT: f32 = {lumens};\n\n\
         /// Name, direction toward the light, linear color, irradiance [W/m2].\n\
         const LIGHTS: [(&str, [f32; 3], [f32; 3], f32); {n}] = [\n",
        probe = rust::comment(rig.probe),
        lumens = float(LUMENS_PER_WATT),
        n = rig.lights.len(),
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let (color, strength) = color_and_strength(light.irradiance);
        text += code!(
            Rust,
            "    ({name}, [{toward}], [{color}], {strength}),\n",
            name = rust::string(&name),
            toward = floats(vector(axes.world * light.direction)),
            color = floats(color.to_array()),
            strength = float(strength),
        );
    }
    text += "];\n";
    text += SPAWN;
    if let Some(file) = rig.dome_file() {
        text += dome(file, rig.orientation.rotation);
    }
    text
}

/// The component, and how its cubes are made.
fn dome(file: &str, rotation: f32) -> Code<Rust> {
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    let cube = |what: &str| format!("{stem}_{what}.ktx2");
    let commands = code!(
        Shell,
        "domelight ibl {file} --env-rotate={rotation} --for bevy -o {specular} --irradiance {diffuse}",
        file = shell::word(file),
        rotation = rotation,
        specular = shell::word(&cube("specular")),
        diffuse = shell::word(&cube("diffuse")),
    );
    code!(
        Rust,
        "\n// The cubes, in the folder of assets:\n\
         // {commands}\n\
         const SPECULAR: &str = {specular};\n\
         const DIFFUSE: &str = {diffuse};\n\n\
         /// Light of the sky, for a camera.{DOME}",
        commands = rust::comment(commands.as_str()),
        specular = rust::string(&cube("specular")),
        diffuse = rust::string(&cube("diffuse")),
        DOME = DOME,
    )
}

fn floats(numbers: [f32; 3]) -> Code<Rust> {
    Code::join(numbers.map(float), ", ")
}

/// A literal that is no integer.
fn float(number: f32) -> Code<Rust> {
    Code::generated(format!("{number:?}"))
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;

    #[test]
    fn numbers_are_floats_and_names_are_escaped() {
        with_example(|rig| {
            let text = encode(&RigExport { probe: "a\nfn main", ..*rig }).into_string();
            assert!(text.starts_with("// The lights of a fn main, by domelight"), "{text}");
            assert!(text.contains("const LUMENS_PER_WATT: f32 = 683.0;"), "{text}");
            assert!(
                text.contains("(\"lamp_1\", [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], 2.0),"),
                "{text}"
            );
            assert!(text.contains("f32); 3] = ["), "{text}");
        });
    }

    #[test]
    fn the_dome_says_how_its_cubes_are_made() {
        with_dome_file("my dome.exr", |rig| {
            let text = encode(rig).into_string();
            let command = "// domelight ibl 'my dome.exr' --env-rotate=30 --for bevy -o 'my dome_specular.ktx2' \
                           --irradiance 'my dome_diffuse.ktx2'";
            assert!(text.contains(command), "{text}");
            assert!(text.contains("SPECULAR: &str = \"my dome_specular.ktx2\";"), "{text}");
            let without = encode(&RigExport { dome: None, ..*rig });
            assert!(!without.as_str().contains("EnvironmentMapLight"));
        });
    }
}
