//! A GLB file of one triangle with an image on it.

#[path = "glb.rs"]
mod glb;

/// The file; `mode` is how its alpha is used.
pub fn with_image(image: &[u8], mode: &str) -> Vec<u8> {
    let length = image.len();
    let json = format!(
        r#"{{"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
"materials":[{{"alphaMode":"{mode}","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
"textures":[{{"source":0}}],"images":[{{"bufferView":0}}],"accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}}],
"buffers":[{{"byteLength":{length}}}],"bufferViews":[{{"buffer":0,"byteLength":{length}}}]}}"#
    );
    glb::glb(&json, image)
}
