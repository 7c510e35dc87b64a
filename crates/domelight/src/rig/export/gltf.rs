//! glTF 2.0, as text with its data within (`.gltf`) and binary (`.glb`).
//!
//! A light is a node with a directional light of `KHR_lights_punctual`: it shines along the node's
//! −Z, color times intensity is the irradiance of a surface that faces it. glTF's unit is lux; the
//! number is the probe's own, in W·m⁻² where its radiance is in W·m⁻²·sr⁻¹. It has no size. +Y is
//! up.
//!
//! The dome is the scene's light of `EXT_lights_image_based`: its irradiance as nine harmonics, and,
//! because the schema wants them, images for reflections. Those are drawn from the same harmonics,
//! as smooth as they are. The extension's text leaves open how the harmonics are signed and how
//! directions are over its axes; both are as Babylon.js, whose authors wrote the extension, reads
//! them in its usual, left-handed scenes. (In a right-handed one it sees the dome half a turn about
//! +Y away.)

use base64::Engine as _;
use serde_json::{Map, Value, json};

use super::RigExport;
use super::axes::Axes;
use super::disc::color_and_strength;
use crate::Rgb;
use crate::environment::UpAxis;
use crate::math::{Mat3, Quat, Vec3, functions, vec3};
use crate::rig::SphericalHarmonics;

/// Texels along the edge of a face of the reflections.
const FACE_SIZE: u32 = 16;

/// The largest radiance that RGBD holds.
const RGBD_RANGE: f32 = 255.0;

/// The space of the image-based light, left-handed as that of cube maps, is the world in a mirror.
const WORLD_TO_CUBE: Mat3 = Mat3::from_diagonal(vec3(-1.0, 1.0, 1.0));

/// The sign (−1)^m of each harmonic.
const CONDON_SHORTLEY: [f32; 9] = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0];

/// glTF as text; its buffer is a data URI.
pub(super) fn encode_text(rig: &RigExport) -> String {
    let (mut root, buffer) = document(rig);
    if !buffer.is_empty() {
        let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
        let uri = format!("data:application/octet-stream;base64,{data}");
        root["buffers"] = json!([{ "byteLength": buffer.len(), "uri": uri }]);
    }
    let mut text = serde_json::to_string_pretty(&root).expect("text and finite numbers");
    text.push('\n');
    text
}

/// Binary glTF: a header, then a chunk of JSON and one of the buffer, each padded to 4 bytes.
pub(super) fn encode_binary(rig: &RigExport) -> Vec<u8> {
    const HEADER: usize = 12;
    let (mut root, buffer) = document(rig);
    if !buffer.is_empty() {
        root["buffers"] = json!([{ "byteLength": buffer.len() }]);
    }
    let json = serde_json::to_vec(&root).expect("text and finite numbers");
    let mut chunks = chunk(*b"JSON", json, b' ');
    if !buffer.is_empty() {
        chunks.extend(chunk(*b"BIN\0", buffer, 0));
    }
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend(((HEADER + chunks.len()) as u32).to_le_bytes());
    file.extend(chunks);
    file
}

fn chunk(kind: [u8; 4], mut data: Vec<u8>, padding: u8) -> Vec<u8> {
    data.resize(data.len().next_multiple_of(4), padding);
    let mut chunk = (data.len() as u32).to_le_bytes().to_vec();
    chunk.extend(kind);
    chunk.extend(data);
    chunk
}

/// The document but for its buffers, and the buffer.
fn document(rig: &RigExport) -> (Value, Vec<u8>) {
    let axes = Axes::with_up(rig, UpAxis::Y);
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("domelight ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": rig.probe }],
    });
    let (mut used, mut extensions) = (Vec::new(), Map::new());
    if !rig.lights.is_empty() {
        const PUNCTUAL: &str = "KHR_lights_punctual";
        let (mut lights, mut nodes) = (Vec::new(), Vec::new());
        for (light, name) in rig.lights.iter().zip(rig.names()) {
            let (color, intensity) = color_and_strength(light.irradiance);
            let toward = (axes.world * light.direction).normalize();
            nodes.push(json!({
                "name": name,
                "rotation": Quat::from_rotation_arc(Vec3::Z, toward).to_array(),
                "extensions": { PUNCTUAL: { "light": lights.len() } },
            }));
            lights.push(json!({
                "type": "directional",
                "name": name,
                "color": color.to_array(),
                "intensity": intensity,
            }));
        }
        root["scenes"][0]["nodes"] = (0..nodes.len()).collect();
        root["nodes"] = nodes.into();
        extensions.insert(PUNCTUAL.into(), json!({ "lights": lights }));
        used.push(PUNCTUAL);
    }
    let mut buffer = Vec::new();
    if let Some(dome) = rig.dome {
        const IMAGE_BASED: &str = "EXT_lights_image_based";
        let light = image_based_light(&dome.harmonics.turned(axes.world), &mut root, &mut buffer);
        extensions.insert(IMAGE_BASED.into(), json!({ "lights": [light] }));
        root["scenes"][0]["extensions"] = json!({ IMAGE_BASED: { "light": 0 } });
        used.push(IMAGE_BASED);
    }
    if !used.is_empty() {
        root["extensionsUsed"] = json!(used);
        root["extensions"] = extensions.into();
    }
    (root, buffer)
}

/// The light; its images go into the document and the buffer.
fn image_based_light(dome: &SphericalHarmonics, root: &mut Value, buffer: &mut Vec<u8>) -> Value {
    let dome = dome.turned(WORLD_TO_CUBE);
    let faces: Vec<Vec<Rgb>> = (0..6).map(|face| face_radiance(&dome, face)).collect();
    let peak = faces.iter().flatten().map(|le| le.max_component()).fold(0.0, f32::max);
    // 1 wherever it can be: Babylon.js multiplies the harmonics by it twice.
    let intensity = (peak / RGBD_RANGE).max(1.0);
    let (mut images, mut views) = (Vec::new(), Vec::new());
    for face in &faces {
        let image = png(face.iter().map(|&le| rgbd(le / intensity)));
        images.push(json!({ "bufferView": views.len(), "mimeType": "image/png" }));
        views.push(json!({ "buffer": 0, "byteOffset": buffer.len(), "byteLength": image.len() }));
        buffer.extend(image);
        buffer.resize(buffer.len().next_multiple_of(4), 0);
    }
    root["images"] = images.into();
    root["bufferViews"] = views.into();
    let signed = |(e, sign): (Rgb, f32)| (e * (sign / intensity)).to_array();
    let coefficients = dome.irradiance_coefficients().into_iter().zip(CONDON_SHORTLEY).map(signed);
    json!({
        "name": "dome",
        "intensity": intensity,
        "irradianceCoefficients": coefficients.collect::<Vec<_>>(),
        "specularImageSize": FACE_SIZE,
        "specularImages": [[0, 1, 2, 3, 4, 5]],
    })
}

/// Radiance at the texels of a face (+X, −X, +Y, −Y, +Z, −Z), row by row, none negative.
fn face_radiance(dome: &SphericalHarmonics, face: usize) -> Vec<Rgb> {
    let place = |i: u32| (2 * i + 1) as f32 / FACE_SIZE as f32 - 1.0;
    let texels = (0..FACE_SIZE * FACE_SIZE).map(|i| (place(i % FACE_SIZE), place(i / FACE_SIZE)));
    texels
        .map(|(right, down)| {
            let direction = face_direction(face, right, down).normalize();
            dome.radiance(direction).map(|le| le.max(0.0))
        })
        .collect()
}

/// The direction of a place on a face of the cube, `right` and `down` in [−1, 1].
fn face_direction(face: usize, right: f32, down: f32) -> Vec3 {
    match face {
        0 => vec3(1.0, -down, -right),
        1 => vec3(-1.0, -down, right),
        2 => vec3(right, 1.0, down),
        3 => vec3(right, -1.0, -down),
        4 => vec3(right, -down, 1.0),
        _ => vec3(-right, -down, -1.0),
    }
}

/// Red, green, blue and divisor: radiance is (rgb/255)^2.2 over d/255.
fn rgbd(le: Rgb) -> [u8; 4] {
    let divisor = (RGBD_RANGE / le.max_component().max(1.0)).floor().max(1.0);
    let byte = |c: f32| (255.0 * functions::powf(c * divisor / 255.0, 1.0 / 2.2)).round() as u8;
    [byte(le.r), byte(le.g), byte(le.b), divisor as u8]
}

/// A face as a picture.
fn png(texels: impl Iterator<Item = [u8; 4]>) -> Vec<u8> {
    let bytes: Vec<u8> = texels.flatten().collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, FACE_SIZE, FACE_SIZE);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let written = encoder.write_header().and_then(|mut image| image.write_image_data(&bytes));
    written.expect("a vector takes all bytes");
    file
}

#[cfg(test)]
mod tests {
    use super::super::tests_support::with_example;
    use super::*;
    use crate::picture;

    fn parse(text: &str) -> Value {
        serde_json::from_str(text).unwrap()
    }

    /// The JSON and the buffer of a binary file.
    fn split(file: &[u8]) -> (Value, Vec<u8>) {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        assert_eq!(&file[16..20], b"JSON");
        let end = 20 + word(12);
        let json = serde_json::from_slice(&file[20..end]).unwrap();
        if end == file.len() {
            return (json, Vec::new());
        }
        assert_eq!((&file[end + 4..end + 8], word(end) % 4), (&b"BIN\0"[..], 0));
        (json, file[end + 8..].to_vec())
    }

    #[test]
    fn nodes_shine_away_from_their_direction() {
        with_example(|rig| {
            let json = parse(&encode_text(rig));
            let lights = &json["extensions"]["KHR_lights_punctual"]["lights"];
            for (i, light) in rig.lights.iter().enumerate() {
                let number = |v: &Value| v.as_f64().unwrap() as f32;
                let q = &json["nodes"][i]["rotation"];
                let q = Quat::from_xyzw(number(&q[0]), number(&q[1]), number(&q[2]), number(&q[3]));
                assert!((q * Vec3::NEG_Z + light.direction).length() < 1e-6);
                let intensity = number(&lights[i]["intensity"]);
                for (c, e) in light.irradiance.to_array().iter().enumerate() {
                    assert!((number(&lights[i]["color"][c]) * intensity - e).abs() < 1e-6);
                }
            }
            assert_eq!(json["scenes"][0]["nodes"], json!([0, 1, 2]));
        });
    }

    #[test]
    fn the_dome_has_harmonics_and_images() {
        with_example(|rig| {
            let (json, buffer) = split(&encode_binary(rig));
            let light = &json["extensions"]["EXT_lights_image_based"]["lights"][0];
            let e = rig.dome.unwrap().harmonics.irradiance_coefficients();
            let sign = |i: usize| light["irradianceCoefficients"][i][1].as_f64().unwrap() as f32;
            assert!((sign(0) - e[0].g).abs() < 1e-4 && (sign(1) + e[1].g).abs() < 1e-4);
            assert_eq!(json["images"].as_array().unwrap().len(), 6);
            for view in json["bufferViews"].as_array().unwrap() {
                let at = view["byteOffset"].as_u64().unwrap() as usize;
                let image = &buffer[at..][..view["byteLength"].as_u64().unwrap() as usize];
                assert_eq!(picture::format_of(image), Some(picture::Format::Png));
            }
            let text = parse(&encode_text(rig));
            assert_eq!(text["extensions"], json["extensions"]);
            assert_eq!(text["buffers"][0]["byteLength"], json["buffers"][0]["byteLength"]);
        });
    }

    #[test]
    fn nothing_is_empty_where_there_is_nothing() {
        with_example(|rig| {
            let (json, buffer) =
                split(&encode_binary(&RigExport { lights: &[], dome: None, ..*rig }));
            assert!(buffer.is_empty());
            for key in ["nodes", "buffers", "images", "extensions", "extensionsUsed"] {
                assert!(json.get(key).is_none(), "{key}");
            }
        });
    }

    #[test]
    fn rgbd_holds_up_to_its_range() {
        for le in [0.0, 0.3, 1.0, 7.5, 120.0, 255.0] {
            let [r, _, _, d] = rgbd(Rgb::splat(le));
            let read = (f32::from(r) / 255.0).powf(2.2) / (f32::from(d) / 255.0);
            assert!((read - le).abs() <= 0.02 * le.max(0.1), "{le} {read}");
        }
    }
}
