//! Supported, harmless and unknown extensions.

use std::collections::BTreeSet;

use super::error::GltfErrorKind;
use super::json::Document;

/// The effect of an extension on a picture under an environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effect {
    /// It is read; features of materials that are not drawn are reported per material.
    Read,
    /// It adds only data without effect on a picture under an environment, described by the text.
    Harmless(&'static str),
    /// It may change the picture, but is not supported.
    Unknown,
}

const READ: [&str; 24] = [
    "CESIUM_RTC",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Name prefixes of harmless extensions, with descriptions.
const HARMLESS: [(&str, &str); 22] = [
    ("KHR_lights_punctual", "its lamps are left out: light comes from the environment"),
    ("EXT_lights_", "its own light is left out: light comes from the environment"),
    ("KHR_lights_environment", "its own light is left out: light comes from the environment"),
    ("KHR_animation_pointer", "the values that it animates stay at rest"),
    ("KHR_materials_variants", "its default materials are drawn"),
    ("KHR_xmp", "metadata are left out"),
    ("AGI_articulations", "articulations stay at rest"),
    ("KHR_audio", "sound is left out"),
    ("KHR_interactivity", "interaction is left out"),
    ("KHR_node_hoverability", "interaction is left out"),
    ("KHR_node_selectability", "interaction is left out"),
    ("KHR_physics", "physics is left out"),
    ("KHR_implicit_shapes", "physics is left out"),
    ("KHR_collision_shapes", "physics is left out"),
    ("OMI_", "physics, sound and interaction are left out"),
    ("MSFT_lod", "the finest level is drawn"),
    ("EXT_mesh_features", "metadata are left out"),
    ("EXT_instance_features", "metadata are left out"),
    ("EXT_structural_metadata", "metadata are left out"),
    ("CESIUM_", "metadata are left out"),
    ("FB_geometry_metadata", "metadata are left out"),
    ("VRM", "its rig is left out"),
];

/// The effect of an extension, by its name.
pub(super) fn effect(name: &str) -> Effect {
    if READ.contains(&name) {
        return Effect::Read;
    }
    let harmless = HARMLESS.iter().find(|(prefix, _)| name.starts_with(prefix));
    harmless.map_or(Effect::Unknown, |(_, text)| Effect::Harmless(text))
}

/// Warns of each unsupported extension; with `strict`, an unknown required extension is an error.
pub(super) fn check(
    document: &Document<'_>,
    strict: bool,
    mut warn: impl FnMut(&str),
) -> Result<(), GltfErrorKind> {
    let Document { extensions_used: used, extensions_required: required, .. } = document;
    let required: BTreeSet<_> = required.iter().collect();
    let all: BTreeSet<_> = used.iter().chain(required.iter().copied()).collect();
    for name in all {
        match effect(name) {
            Effect::Read => {}
            Effect::Harmless(text) => {
                warn(&format!("the extension {name} is not supported; {text}"));
            }
            Effect::Unknown if !required.contains(name) => {
                warn(&format!("the extension {name} is unknown and ignored"));
            }
            Effect::Unknown if strict => {
                return Err(GltfErrorKind::RequiredExtension { name: name.clone() });
            }
            Effect::Unknown => warn(&format!(
                "the file requires the extension {name}, which is unknown; the rest is drawn without it"
            )),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(json: &str, strict: bool) -> (Vec<String>, Option<String>) {
        let mut warnings = Vec::new();
        let document = Document::new(json.as_bytes()).unwrap();
        let result = check(&document, strict, |text| warnings.push(text.to_owned()));
        (warnings, result.err().map(|e| e.to_string()))
    }

    #[test]
    fn lamps_end_no_load_and_the_unknown_only_a_strict_one() {
        let lamps = r#"{"extensionsUsed":["KHR_lights_punctual","KHR_materials_ior"],
            "extensionsRequired":["KHR_lights_punctual"]}"#;
        let (warnings, error) = run(lamps, true);
        assert!(warnings.len() == 1 && warnings[0].contains("lamps") && error.is_none());
        let unknown = r#"{"extensionsUsed":["X_used","X_all"],"extensionsRequired":["X_all"]}"#;
        let (warnings, error) = run(unknown, false);
        assert!(
            warnings[1].contains("X_used") && warnings[0].contains("requires") && error.is_none()
        );
        assert!(run(unknown, true).1.unwrap().contains("X_all"));
        // Required but not listed as used.
        assert!(run(r#"{"extensionsRequired":["X"]}"#, true).1.is_some());
    }
}
