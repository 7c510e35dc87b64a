//! A Babylon.js module: `await addRig(scene)` puts the lights and the dome into a scene.
//!
//! A light is a `DirectionalLight`: for physically based materials, its color times its intensity is the irradiance of a
//! surface that faces it (`Light.INTENSITYMODE_ILLUMINANCE`), in the units of the scene, here W·m⁻². It has no size. A
//! scene is left-handed unless `useRightHandedSystem` is set; there, x is negated, as the loader of glTF does. The dome
//! is an `HDRCubeTexture`, whose panorama has its center at +Z in a left-handed scene and at −Z in a right-handed one, and
//! `rotationY` turns it clockwise in the latter (measured, `checks/interop`).

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use super::text::{numbers, vector};
use crate::code;
use crate::environment::UpAxis;
use crate::quote::{Code, JavaScript, javascript};

const FUNCTIONS: &str = r#"
/**
 * Adds the lights to the scene and returns them. A material is lit by four of them unless its maxSimultaneousLights is
 * larger. A light casts shadows through a ShadowGenerator of its own.
 */
export function addLights(scene) {
  return lights.map(({ name, direction: [x, y, z], color, intensity }) => {
    const away = new Vector3(scene.useRightHandedSystem ? -x : x, -y, -z);
    const light = new DirectionalLight(name, away, scene);
    light.diffuse = light.specular = Color3.FromArray(color);
    light.intensity = intensity;
    return light;
  });
}

/**
 * Lights the scene by the dome's picture, which lies beside this module, filtered for rough surfaces. `size` is the
 * number of columns of a face.
 */
export async function setDome(scene, size = 256) {
  const path = dome.split("/").map(encodeURIComponent).join("/");
  const url = new URL(path, import.meta.url).href;
  const texture = await new Promise((loaded, failed) => {
    const cube = new HDRCubeTexture(url, scene, size, false, true, false, true, () => loaded(cube), failed);
  });
  texture.rotationY = scene.useRightHandedSystem ? -domeRotation : domeRotation + Math.PI;
  scene.environmentTexture = texture;
  return texture;
}

/** Adds lights and dome to the scene, without the scene's own environment, and returns the lights. */
export async function addRig(scene, size = 256) {
  if (dome !== null) await setDome(scene, size);
  return addLights(scene);
}
"#;

pub(super) fn encode(rig: &RigExport) -> Code<JavaScript> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut text = code!(
        JavaScript,
        "// The lights of {probe}, by domelight.\n\
         // import {{ addRig }} from \"./rig.babylon.js\"; await addRig(scene);\n\
         // Remove other suns from the scene; the dome is light without the lights below.\n\
         import {{ DirectionalLight }} from \"@babylonjs/core/Lights/directionalLight.js\";\n\
         import {{ HDRCubeTexture }} from \"@babylonjs/core/Materials/Textures/hdrCubeTexture.js\";\n\
         import {{ Color3 }} from \"@babylonjs/core/Maths/math.color.js\";\n\
         import {{ Vector3 }} from \"@babylonjs/core/Maths/math.vector.js\";\n\n\
         // Toward the light, right-handed with +Y up; linear color times intensity is irradiance.\n\
         export const lights = [\n",
        probe = javascript::comment(rig.probe),
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let (color, intensity) = color_and_strength(light.irradiance);
        text += code!(
            JavaScript,
            "  {{ name: {name}, direction: [{toward}], color: [{color}], intensity: {intensity} }},\n",
            name = javascript::string(&name),
            toward = numbers(vector(axes.world * light.direction), ", "),
            color = numbers(color.to_array(), ", "),
            intensity = intensity,
        );
    }
    text += code!(
        JavaScript,
        "];\n\n\
         export const dome = {dome};\n\
         // Counterclockwise as seen from above [radians].\n\
         export const domeRotation = {rotation};\n",
        dome = rig.dome_file().map_or(Code::literal("null"), javascript::string),
        rotation = rig.orientation.rotation.to_radians(),
    );
    text += FUNCTIONS;
    text
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;

    #[test]
    fn lights_and_dome_are_named() {
        with_example(|rig| {
            let text = encode(&RigExport { probe: "a\nalert()", ..*rig }).into_string();
            assert!(text.starts_with("// The lights of a alert(), by domelight.\n"), "{text}");
            let lamp =
                "{ name: \"lamp_1\", direction: [1, 0, 0], color: [0, 1, 0], intensity: 2 },";
            assert!(text.contains(lamp), "{text}");
            assert!(text.contains("export const dome = \"residual.exr\";"), "{text}");
            let without = encode(&RigExport { dome: None, ..*rig });
            assert!(without.as_str().contains("export const dome = null;"));
        });
    }
}
