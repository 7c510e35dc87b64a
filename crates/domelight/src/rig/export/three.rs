//! A three.js module: `await addRig(scene)` puts the lights and the dome into a scene.
//!
//! A light is a `DirectionalLight`: color times intensity is the irradiance of a surface that
//! faces it \[W·m⁻²\]; it shines from its position to its target. It has no size. The dome is a
//! `LightProbe` of nine harmonics of radiance, whose order and signs are ours; it lights matte
//! surfaces. Where the picture of the dome was written beside the module, `addRig` loads it and lights by it instead,
//! reflections included; three.js expects its middle at +X where ours is at −Z. +Y is up.

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use super::text::{numbers, vector};
use crate::code;
use crate::environment::UpAxis;
use crate::quote::{Code, JavaScript, javascript};

const FUNCTIONS: &str = r#"
/**
 * Adds the rig to the scene and returns it, a group; light casts shadows if its `castShadow` is set.
 * The light probe ignores rotations of the group. Leave it out where `setDome` lights the scene.
 */
export function addLights(scene, { probe = true } = {}) {
  const rig = new THREE.Group();
  rig.name = "domelight";
  for (const { name, direction, color, intensity } of lights) {
    const light = new THREE.DirectionalLight(undefined, intensity);
    light.name = name;
    light.color.setRGB(...color);
    light.position.set(...direction);
    rig.add(light, light.target);
  }
  if (probe && harmonics) {
    rig.add(new THREE.LightProbe(new THREE.SphericalHarmonics3().fromArray(harmonics.flat())));
  }
  scene.add(rig);
  return rig;
}

/**
 * Lights the scene by a texture of the residual map, as EXRLoader and HDRLoader load it, and shows
 * it behind the scene.
 */
export function setDome(scene, texture) {
  texture.mapping = THREE.EquirectangularReflectionMapping;
  scene.environment = scene.background = texture;
  scene.environmentRotation.set(0, domeRotation, 0);
  scene.backgroundRotation.copy(scene.environmentRotation);
}

/**
 * Adds the rig to the scene and returns it. The dome is its picture, if there is one: it is loaded from beside this
 * module, lights the scene and is seen behind it.
 */
export async function addRig(scene) {
  const rig = addLights(scene, { probe: dome === null });
  if (dome !== null) setDome(scene, await loadDome());
  return rig;
}
"#;

/// Where there is a picture of the dome.
const LOAD_DOME: &str = r#"
async function loadDome() {
  const path = dome.split("/").map(encodeURIComponent).join("/");
  return new PictureLoader().setDataType(THREE.FloatType).loadAsync(new URL(path, import.meta.url).href);
}
"#;

/// Where there is none.
const NO_DOME: &str = "\nexport const dome = null;\n";

/// The loader of three.js that reads a picture of that name, its module; none of formats that it has no loader for.
fn loader(file: &str) -> Option<&'static str> {
    let (_, extension) = file.rsplit_once('.')?;
    match extension.to_ascii_lowercase().as_str() {
        "exr" => Some("EXRLoader"),
        "hdr" | "pic" | "rgbe" => Some("HDRLoader"),
        _ => None,
    }
}

pub(super) fn encode(rig: &RigExport) -> Code<JavaScript> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let picture = rig.dome_file().and_then(|file| Some((file, loader(file)?)));
    let import = picture.map_or(Code::default(), |(_, loader)| {
        code!(
            JavaScript,
            "import {{ {loader} as PictureLoader }} from \"three/addons/loaders/{loader}.js\";\n",
            loader = loader,
        )
    });
    let mut text = code!(
        JavaScript,
        "// The lights of {probe}, by domelight.\n\
         // import {{ addRig }} from \"./rig.js\"; await addRig(scene);\n\
         import * as THREE from \"three\";\n{import}\n\
         // Toward the light; linear color times intensity is irradiance.\n\
         export const lights = [\n",
        probe = javascript::comment(rig.probe),
        import = import,
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
    text += "];\n\n";
    match rig.dome {
        None => text += "export const harmonics = null;\n",
        Some(dome) => {
            text += "// Radiance of the residual map, in the order of SphericalHarmonics3.\n\
                     export const harmonics = [\n";
            for coefficient in dome.harmonics.turned(axes.world).coefficients {
                let row = numbers(coefficient.to_array(), ", ");
                text += code!(JavaScript, "  [{row}],\n", row = row);
            }
            text += "];\n";
        }
    }
    let turn = rig.orientation.rotation.to_radians() + std::f32::consts::FRAC_PI_2;
    text += code!(
        JavaScript,
        "\n// About +Y: the middle of the map is where three.js looks for it at +X.\n\
         const domeRotation = {turn};\n",
        turn = turn,
    );
    match picture {
        None => text += NO_DOME,
        Some((file, _)) => {
            text += code!(
                JavaScript,
                "\n// The picture of the residual map, beside this module.\nexport const dome = {file};\n",
                file = javascript::string(file),
            );
            text += LOAD_DOME;
        }
    }
    text + FUNCTIONS
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::{with_dome_file, with_example};
    use super::*;
    use crate::environment::Orientation;
    use crate::rig::SphericalHarmonics;

    #[test]
    fn lights_have_color_times_intensity() {
        with_example(|rig| {
            let text = encode(rig).into_string();
            let sun = r#"{ name: "sun", direction: [0, 0.6, -0.8], color: [1, 0.033333335, 0], intensity: 3 },"#;
            assert!(text.contains(sun), "{text}");
            assert_eq!(text.matches("{ name: ").count(), rig.lights.len());
        });
    }

    #[test]
    fn a_z_up_world_is_turned_with_its_harmonics() {
        with_example(|rig| {
            let orientation = Orientation { up: UpAxis::Z, rotation: 0.0 };
            let mut dome = rig.dome.unwrap();
            // Light from above is first order in z of the Z-up world, in y of three.js.
            dome.harmonics = SphericalHarmonics { coefficients: [crate::Rgb::BLACK; 9] };
            dome.harmonics.coefficients[2] = crate::Rgb::WHITE;
            let rig = RigExport { orientation, dome: Some(dome), ..*rig };
            let text = encode(&rig).into_string();
            assert!(text.contains("direction: [0, -0.8, -0.6]"), "{text}");
            let start = text.find("harmonics = [\n").unwrap();
            let rows: Vec<&str> = text[start..].lines().skip(1).take(9).collect();
            let first = |row: &str| -> f32 {
                row.trim_start_matches("  [").split(',').next().unwrap().parse().unwrap()
            };
            assert!((first(rows[1]) - 1.0).abs() < 1e-6 && first(rows[2]).abs() < 1e-6, "{rows:?}");
        });
    }

    #[test]
    fn a_picture_of_the_dome_is_loaded_where_three_js_can() {
        for (file, loader) in [("d.exr", "EXRLoader"), ("my \"d\".HDR", "HDRLoader")] {
            with_dome_file(file, |rig| {
                let text = encode(rig).into_string();
                let import = format!(
                    "import {{ {loader} as PictureLoader }} from \"three/addons/loaders/{loader}.js\";"
                );
                assert!(text.contains(&import), "{text}");
                let name = file.replace('"', "\\\"");
                assert!(text.contains(&format!("export const dome = \"{name}\";")), "{text}");
            });
        }
        with_dome_file("d.pfm", |rig| {
            let text = encode(rig).into_string();
            assert!(text.contains("export const dome = null;") && !text.contains("addons"));
        });
    }

    #[test]
    fn names_are_escaped() {
        with_example(|rig| {
            let probe = "a\n}*/b\u{2028}alert(1)";
            let text = encode(&RigExport { probe, dome: None, ..*rig }).into_string();
            assert!(text.starts_with("// The lights of a }*/b alert(1), by domelight.\n"));
            assert!(text.contains("export const harmonics = null;"));
        });
    }
}
