//! A C# script for the editor of Unity: a menu entry that adds directional lights and the dome's sky, for the universal
//! and the built-in pipeline, and with a symbol for the high-definition one.
//!
//! Unity's world is left-handed with +Y up; glTF importers negate x, and so does this script. A light shines along its
//! local +Z. The universal pipeline's matte surfaces reflect the light's color times intensity, without 1/π
//! (`Lighting.hlsl`, `BRDFData.diffuse`), so the intensity is E/π; colors are sRGB. The high-definition pipeline has
//! lux, and `angularDiameter` \[degrees\]. The material Skybox/Panoramic has the center of a map at +X where −Z is ours
//! (`Skybox-Panoramic.shader`), and `_Rotation` turns it from +X toward +Z. A cube that Unity imports from a panorama
//! has its center at +Z (`DirectionToLatLongCoordinate` in the render pipelines' `Common.hlsl` has the same): read for
//! the shader, a guess for the importer.

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use super::photometric::LUMENS_PER_WATT;
use super::text::vector;
use crate::code;
use crate::environment::UpAxis;
use crate::math::{Vec3, vec3};
use crate::quote::{CSharp, Code, csharp};

const HEAD: &str = r"
using System.IO;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;
#if DOMELIGHT_HDRP
using UnityEngine.Rendering.HighDefinition;
#endif

public static class DomelightRig
{
";

const FUNCTIONS: &str = r#"
    [MenuItem("Tools/Add the rig of domelight")]
    static void AddRig()
    {
        Object.DestroyImmediate(GameObject.Find("domelight"));
        var rig = new GameObject("domelight");
        foreach (var (name, toward, color, irradiance, angle) in Lights)
        {
            var sun = new GameObject(name);
            sun.transform.SetParent(rig.transform);
            sun.transform.rotation = Quaternion.LookRotation(-toward);
            var light = sun.AddComponent<Light>();
            light.type = LightType.Directional;
            light.color = color.gamma;
            light.shadows = LightShadows.Soft;
#if DOMELIGHT_HDRP
            var data = sun.AddComponent<HDAdditionalLightData>();
            data.angularDiameter = angle;
#if UNITY_6000_0_OR_NEWER
            light.lightUnit = LightUnit.Lux;
            light.intensity = LumensPerWatt * irradiance;
#else
            data.SetIntensity(LumensPerWatt * irradiance, LightUnit.Lux);
#endif
#else
            GraphicsSettings.lightsUseLinearIntensity = true;
            light.intensity = irradiance / Mathf.PI;
#endif
        }
        if (Dome != null) AddSky(rig);
    }

    /// The dome's picture, which lies beside this script.
    static T Import<T>(TextureImporterShape shape) where T : Texture
    {
        var script = AssetDatabase.GUIDToAssetPath(AssetDatabase.FindAssets("t:MonoScript " + ScriptName)[0]);
        var path = Path.Combine(Path.GetDirectoryName(script), Dome).Replace('\\', '/');
        var importer = (TextureImporter)AssetImporter.GetAtPath(path);
        importer.textureShape = shape;
        importer.generateCubemap = TextureImporterGenerateCubemap.Cylindrical;
        importer.maxTextureSize = 8192;
        importer.textureCompression = TextureImporterCompression.Uncompressed;
        importer.npotScale = TextureImporterNPOTScale.None;
        importer.wrapMode = TextureWrapMode.Repeat;
        importer.SaveAndReimport();
        return AssetDatabase.LoadAssetAtPath<T>(path);
    }

#if DOMELIGHT_HDRP
    static void AddSky(GameObject rig)
    {
        var volume = rig.AddComponent<Volume>();
        volume.profile = ScriptableObject.CreateInstance<VolumeProfile>();
        volume.profile.Add<VisualEnvironment>().skyType.Override((int)SkyType.HDRI);
        var sky = volume.profile.Add<HDRISky>();
        sky.hdriSky.Override(Import<Cubemap>(TextureImporterShape.TextureCube));
        sky.rotation.Override(CubeRotation);
        sky.skyIntensityMode.Override(SkyIntensityMode.Multiplier);
        sky.multiplier.Override(LumensPerWatt);
    }
#else
    static void AddSky(GameObject rig)
    {
        var sky = new Material(Shader.Find("Skybox/Panoramic"));
        sky.SetTexture("_MainTex", Import<Texture2D>(TextureImporterShape.Texture2D));
        sky.SetFloat("_Rotation", SkyRotation);
        sky.SetFloat("_Exposure", 1);
        RenderSettings.skybox = sky;
        RenderSettings.ambientMode = AmbientMode.Skybox;
        RenderSettings.ambientIntensity = 1;
        RenderSettings.sun = null;
        DynamicGI.UpdateEnvironment();
    }
#endif
}
"#;

pub(super) fn encode(rig: &RigExport) -> Code<CSharp> {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut text = code!(
        CSharp,
        "// With the high-definition pipeline, take the slashes from the next line.\n\
         // #define DOMELIGHT_HDRP\n\n\
         // The lights of {probe}, by domelight, for Unity: into a folder Editor with the dome's picture, then Tools.\n\
         // Delete other suns and skies; the dome is light without the lights below.\n\
         {HEAD}\
         \x20   // 1 W is 683 lm, in the high-definition pipeline. For the probe's own units, 2^EV.\n\
         \x20   const float LumensPerWatt = {lumens}f;\n\n\
         \x20   // Name, toward the light, linear color, irradiance [W/m2], full angle [degrees].\n\
         \x20   static readonly (string, Vector3, Color, float, float)[] Lights =\n\
         \x20   {{\n",
        probe = csharp::comment(rig.probe),
        HEAD = HEAD,
        lumens = LUMENS_PER_WATT,
    );
    for (light, name) in rig.lights.iter().zip(rig.names()) {
        let (color, strength) = color_and_strength(light.irradiance);
        text += code!(
            CSharp,
            "        ({name}, new Vector3({toward}), new Color({color}), {strength}f, {angle}f),\n",
            name = csharp::string(&name),
            toward = floats(from_right_handed(axes.world * light.direction)),
            color = floats(Vec3::from_array(color.to_array())),
            strength = strength,
            angle = (2.0 * light.angular_radius).to_degrees().min(90.0),
        );
    }
    text += "    };\n\n";
    let rotation = rig.orientation.rotation;
    text += code!(
        CSharp,
        "    const string Dome = {dome};\n\
         \x20   const string ScriptName = nameof(DomelightRig);\n\
         \x20   const float SkyRotation = {sky}f;\n\
         \x20   const float CubeRotation = {cube}f;\n",
        dome = rig.dome_file().map_or(Code::literal("null"), csharp::string),
        sky = sky_rotation(rotation),
        cube = cube_rotation(rotation),
    );
    text += FUNCTIONS;
    text
}

/// Unity's direction of a direction in a right-handed world with +Y up.
fn from_right_handed(d: Vec3) -> Vec3 {
    vec3(-d.x, d.y, d.z)
}

/// `_Rotation` of Skybox/Panoramic for a map with this rotation \[degrees\], in \[0, 360).
fn sky_rotation(rotation: f32) -> f32 {
    (rotation + 270.0).rem_euclid(360.0)
}

/// The rotation of a cube whose center is +Z, in the same sense.
fn cube_rotation(rotation: f32) -> f32 {
    (rotation + 180.0).rem_euclid(360.0)
}

fn floats(v: Vec3) -> Code<CSharp> {
    Code::join(vector(v).map(|number| Code::generated(format!("{number}f"))), ", ")
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use crate::environment::Orientation;
    use std::f32::consts::TAU;

    /// The direction of each column as the engine looks it up is that of the map.
    #[test]
    fn the_sky_stands_as_the_map_does() {
        for rotation in [0.0f32, 30.0, 215.0] {
            let map_to_world = Orientation { rotation, ..Orientation::default() }.map_to_world();
            for column in 0..16 {
                let phi = TAU * (column as f32 / 16.0 - 0.5);
                let d = from_right_handed(map_to_world * vec3(phi.sin(), 0.0, -phi.cos()));
                // Undo a turn from +X toward +Z, then look up.
                let unturned = |angle: f32| {
                    let (sin, cos) = angle.to_radians().sin_cos();
                    [cos * d.x + sin * d.z, cos * d.z - sin * d.x]
                };
                let [x, z] = unturned(sky_rotation(rotation));
                let panorama = 0.5 - z.atan2(x) / TAU;
                let [x, z] = unturned(cube_rotation(rotation));
                let cube = 0.5 + x.atan2(z) / TAU;
                for u in [panorama, cube] {
                    let off = (u - column as f32 / 16.0).rem_euclid(1.0);
                    assert!(off.min(1.0 - off) < 1e-5, "{rotation} {column}: {panorama} {cube}");
                }
            }
        }
    }

    #[test]
    fn names_are_escaped_and_numbers_are_floats() {
        with_example(|rig| {
            let text = encode(&RigExport { probe: "a\nclass B", ..*rig }).into_string();
            assert!(text.contains("// The lights of a class B, by domelight"), "{text}");
            let lamp = "(\"lamp_1\", new Vector3(-1f, 0f, 0f), new Color(0f, 1f, 0f), 2f, ";
            assert!(text.contains(lamp), "{text}");
            assert!(text.contains("Dome = \"residual.exr\";"), "{text}");
            let without = encode(&RigExport { dome: None, ..*rig });
            assert!(without.as_str().contains("Dome = null;"));
        });
    }
}
