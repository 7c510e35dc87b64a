//! Meshes compressed by Draco.
#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../file.rs"]
mod file;
#[path = "../glb.rs"]
mod glb;

fuzz_target!(|stream: &[u8]| {
    let length = stream.len();
    let json = format!(
        r#"{{"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":0,"TEXCOORD_0":1}},"indices":2,
"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}}}}}}}}]}}],
"accessors":[{{"componentType":5126,"count":3,"type":"VEC3"}},{{"componentType":5126,"count":3,"type":"VEC2"}},
{{"componentType":5123,"count":3,"type":"SCALAR"}}],
"buffers":[{{"byteLength":{length}}}],"bufferViews":[{{"buffer":0,"byteLength":{length}}}]}}"#
    );
    file::load("scene.glb", &glb::glb(&json, stream));
});
