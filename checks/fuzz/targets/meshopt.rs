//! Compressed buffer views: the first four bytes choose mode, filter, stride and count.
#![no_main]
use libfuzzer_sys::fuzz_target;

#[path = "../file.rs"]
mod file;
#[path = "../glb.rs"]
mod glb;

fuzz_target!(|bytes: &[u8]| {
    let Some((&[kind, stride, low, high], stream)) = bytes.split_first_chunk() else { return };
    let (mode, filter) = match kind % 8 {
        0 => ("TRIANGLES", "NONE"),
        1 => ("INDICES", "NONE"),
        2 => ("ATTRIBUTES", "OCTAHEDRAL"),
        3 => ("ATTRIBUTES", "QUATERNION"),
        4 => ("ATTRIBUTES", "EXPONENTIAL"),
        5 => ("ATTRIBUTES", "COLOR"),
        _ => ("ATTRIBUTES", "NONE"),
    };
    let (stride, count) = (u32::from(stride) + 1, u32::from(u16::from_le_bytes([low, high])));
    let length = stream.len();
    // Whatever comes out is read as positions, and if it is indices, as those of zeros.
    let json = format!(
        r#"{{"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}},{{"attributes":{{"POSITION":2}},"indices":1}}]}}],
"accessors":[{{"bufferView":0,"componentType":5120,"count":{count},"type":"VEC3"}},
{{"bufferView":0,"componentType":5121,"count":{count},"type":"SCALAR"}},{{"componentType":5126,"count":256,"type":"VEC3"}}],
"buffers":[{{"byteLength":{length}}},{{"byteLength":1}}],
"bufferViews":[{{"buffer":1,"byteLength":1,"extensions":{{"KHR_meshopt_compression":{{"buffer":0,"byteLength":{length},
"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}]}}"#
    );
    file::load("scene.glb", &glb::glb(&json, stream));
});
