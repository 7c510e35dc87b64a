//! The scene loaders on small files of every format, sound and broken.
#![cfg(feature = "io")]

use std::fs;
use std::path::PathBuf;

use base64::Engine;
use domelight::Rgb;
use domelight::math::{Vec2, Vec3, vec2, vec3};
use domelight::scene::{
    EnvironmentSource, Loaded, Projection, Scene, SurfaceModel, UpAxis, Wrap, load,
};
use tempfile::TempDir;

/// A folder of small files.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn with(self, name: &str, contents: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), contents).unwrap();
        self
    }

    /// With a picture of one colour.
    fn with_image(self, name: &str, color: [u8; 3]) -> Self {
        image::RgbImage::from_pixel(2, 2, image::Rgb(color)).save(self.path(name)).unwrap();
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn load(&self, name: &str) -> Loaded {
        let loaded = load(self.path(name)).unwrap_or_else(|e| panic!("{e}"));
        Scene::new(loaded.description.clone()).unwrap();
        loaded
    }

    fn error(&self, name: &str) -> String {
        load(self.path(name)).unwrap_err().to_string()
    }
}

fn one(name: &str, contents: impl AsRef<[u8]>) -> Loaded {
    Folder::new().with(name, contents).load(name)
}

fn fails(name: &str, contents: impl AsRef<[u8]>, words: &[&str]) {
    let message = Folder::new().with(name, contents).error(name);
    for word in words.iter().chain([&name]) {
        assert!(message.contains(word), "'{word}' is not in: {message}");
    }
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

// PLY

const PLY_QUAD: &str = "ply
format ascii 1.0
comment a quadrilateral
element vertex 4
property float x
property float y
property float z
property list uchar int junk
property float s
property float t
property uchar red
property uchar green
property uchar blue
element face 1
property uchar flag
property list uchar int vertex_indices
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 2 7 7 0 0 255 0 0
1 0 0 0 1 0 255 0 0
1 1 0 1 9 1 1 255 0 0
0 1 0 0 0 1 255 188 0
5 4 0 1 2 3
0 1
";

#[test]
fn ascii_ply_with_extras_and_polygons() {
    let loaded = one("quad.ply", PLY_QUAD);
    let mesh = &loaded.description.parts[0].mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions[2], vec3(1.0, 1.0, 0.0));
    assert_eq!(mesh.uvs, [vec2(0.0, 1.0), Vec2::ONE, vec2(1.0, 0.0), Vec2::ZERO]);
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    assert_eq!(mesh.colors[0], Rgb::new(1.0, 0.0, 0.0));
    assert!((mesh.colors[3].g - 0.502).abs() < 2e-3, "sRGB 188 is about half");
}

#[test]
fn windows_line_ends_in_ply() {
    let loaded = one("quad.ply", PLY_QUAD.replace('\n', "\r\n"));
    assert_eq!(loaded.description.parts[0].mesh.triangles.len(), 2);
}

fn binary_ply(big: bool) -> Vec<u8> {
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut out = format!(
        "ply\nformat {name} 1.0\nelement face 2\nproperty list uint8 uint32 vertex_index\n\
         element vertex 4\nproperty double x\nproperty float y\nproperty short z\n\
         property float nx\nproperty float ny\nproperty float nz\nend_header\n"
    )
    .into_bytes();
    let put = |out: &mut Vec<u8>, bytes: &[u8]| {
        if big {
            out.extend(bytes.iter().rev());
        } else {
            out.extend(bytes);
        }
    };
    for face in [vec![0u32, 1, 2], vec![0, 2, 3]] {
        out.push(face.len() as u8);
        for i in face {
            put(&mut out, &i.to_le_bytes());
        }
    }
    for (x, y, z) in [(0f64, 0f32, 0i16), (2.0, 0.0, 0), (2.0, 1.5, -3), (0.0, 1.5, 0)] {
        put(&mut out, &x.to_le_bytes());
        put(&mut out, &y.to_le_bytes());
        put(&mut out, &z.to_le_bytes());
        for n in [0f32, 0.0, 2.0] {
            put(&mut out, &n.to_le_bytes());
        }
    }
    out
}

#[test]
fn binary_ply_of_both_byte_orders() {
    for big in [false, true] {
        let loaded = one("mesh.ply", binary_ply(big));
        let mesh = &loaded.description.parts[0].mesh;
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions[2], vec3(2.0, 1.5, -3.0));
        assert_eq!(mesh.normals, [Vec3::Z; 4]);
    }
}

#[test]
fn every_truncation_of_a_ply_is_an_error() {
    for whole in [PLY_QUAD.trim_end().as_bytes().to_vec(), binary_ply(false), binary_ply(true)] {
        let folder = Folder::new();
        for length in 0..whole.len() {
            fs::write(folder.path("cut.ply"), &whole[..length]).unwrap();
            // The last digit of the ASCII file may go unnoticed; nothing may panic.
            let result = load(folder.path("cut.ply"));
            assert!(result.is_err() || length + 2 > whole.len(), "{length} bytes were accepted");
        }
    }
}

#[test]
fn broken_ply_files_name_the_place() {
    let absurd = PLY_QUAD.replace("element vertex 4", "element vertex 18446744073709551615");
    fails("a.ply", absurd, &["line 4", "18446744073709551615", "vertex"]);
    let many = PLY_QUAD.replace("element edge 1", "element edge 999999999");
    fails("a.ply", many, &["edge", "999999999"]);
    let empty_rows = "ply\nformat ascii 1.0\nelement nothing 4000000000\nend_header\n";
    fails("a.ply", empty_rows, &["nothing"]);
    fails("a.ply", PLY_QUAD.replace("0 1 2 3\n", "0 1 2 4\n"), &["face 0", "4"]);
    fails("a.ply", PLY_QUAD.replace("5 4 0 1", "5 4 -1 1"), &["face 0", "-1"]);
    fails("a.ply", PLY_QUAD.replace("5 4 0 1", "5 -4 0 1"), &["face 0", "-4"]);
    fails("a.ply", PLY_QUAD.replace("1 1 0 1 9", "1 spam 0 1 9"), &["byte", "spam"]);
    fails("a.ply", PLY_QUAD.replace("1 1 0 1 9", "1 nan 0 1 9"), &["vertex 2", "finite"]);
    fails("a.ply", PLY_QUAD.replace("float z", "half z"), &["line 7", "half z"]);
    fails("a.ply", PLY_QUAD.replace("float z", "float w"), &["x, y and z"]);
    fails("a.ply", PLY_QUAD.replace("vertex_indices", "indices"), &["vertex_indices"]);
    fails("a.ply", PLY_QUAD.replace("element face 1", "element facet 1"), &["element face"]);
    fails("a.ply", PLY_QUAD.replace("ascii", "ebcdic"), &["line 2", "ebcdic"]);
    fails("a.ply", PLY_QUAD.replace("format ascii 1.0\n", ""), &["format"]);
    fails("a.ply", "ply\nformat ascii 1.0\n", &["end_header"]);
    fails("a.ply", "", &["end_header"]);
}

// OBJ and MTL

const OBJ: &str = "# two squares
mtllib things.mtl
o first
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 2
usemtl red
f 1/1/1 2/2/1 3/3/1 4/4/1
o second
v 0 0 1
v 1 0 1
v 1 1 1
usemtl metal
f -3 -2 -1
usemtl nowhere
f -1 -2 -3
";

const MTL: &str = "newmtl red
Kd 0.8 0.1 0.1
Ks 0.5
Ns 40
d 0.5
newmtl metal
Kd 0.9 0.8 0.7
Pr 0.3
Pm 1
map_Kd -s 2 3 1 -clamp on my picture.png
norm bumps.png
";

#[test]
fn obj_with_materials_polygons_and_relative_indices() {
    let folder = Folder::new()
        .with("a.obj", OBJ)
        .with("things.mtl", MTL)
        .with_image("my picture.png", [255, 0, 0])
        .with_image("bumps.png", [128, 128, 255]);
    let loaded = folder.load("a.obj");
    let d = &loaded.description;
    assert_eq!(
        d.parts.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(),
        ["first", "second", "second"]
    );
    let first = &d.parts[0].mesh;
    assert_eq!(first.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!((first.uvs[0], first.uvs[2]), (vec2(0.0, 1.0), vec2(1.0, 0.0)));
    assert_eq!(first.normals, [Vec3::Z; 4]);
    assert_eq!(d.parts[1].mesh.positions[0], Vec3::Z);

    let SurfaceModel::Phong(red) = &d.surfaces[d.parts[0].surface].model else { panic!() };
    assert_eq!((red.diffuse, red.exponent), (Rgb::new(0.8, 0.1, 0.1), 40.0));
    assert_eq!(red.specular, Rgb::splat(0.5));
    let metal = &d.surfaces[d.parts[1].surface];
    let SurfaceModel::MetallicRoughness(m) = &metal.model else { panic!() };
    assert_eq!((m.metallic, m.roughness), (1.0, 0.3));
    let texture = m.base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // Texture coordinates grow upward in the file, downward in the program.
    assert_eq!(texture.transform.apply(vec2(0.5, 1.0)), vec2(1.0, 1.0));
    assert_eq!(texture.transform.apply(vec2(0.5, 0.0)), vec2(1.0, -2.0));
    assert!(metal.normal_map.is_some());
    assert_eq!(d.textures.len(), 2);
    for word in ["opacity", "nowhere"] {
        assert!(loaded.warnings.iter().any(|w| w.contains(word)), "{:?}", loaded.warnings);
    }
}

#[test]
fn an_obj_without_its_library_is_grey_with_a_warning() {
    let loaded = one("a.obj", OBJ);
    assert_eq!(loaded.description.parts.len(), 3);
    assert!(loaded.warnings[0].contains("things.mtl") && loaded.warnings[0].contains("line 2"));
}

#[test]
fn smooth_normals_cross_seams_of_an_obj() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nusemtl b\nf 1/2 3/2 4/2\n";
    let loaded = one("a.obj", text);
    let [a, b] = &loaded.description.parts[..] else { panic!() };
    let expected = vec3(1.0, 0.0, 1.0).normalize();
    assert!(close(a.mesh.normals[0], expected) && close(b.mesh.normals[0], expected));
}

#[test]
fn vertex_colors_of_an_obj() {
    let loaded = one("a.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nv 2 2 2\nf 1 2 3\n");
    let colors = &loaded.description.parts[0].mesh.colors;
    assert_eq!(colors[..], [Rgb::new(1.0, 0.0, 0.0), Rgb::WHITE, Rgb::new(0.0, 0.0, 1.0)]);
}

#[test]
fn broken_obj_files_name_the_line() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let bad = |line: &str, words: &[&str]| {
        fails("a.obj", format!("{v}{line}\n"), &[&["line 4"], words].concat());
    };
    bad("f 1 2 4", &["4", "3 are defined"]);
    bad("f 1 2 0", &["0"]);
    bad("f 1 2 -4", &["-4"]);
    bad("f 1 2 -9223372036854775808", &["-9223372036854775808"]);
    bad("f 1 2", &["three corners", "2"]);
    bad("f 1/1 2/1 3/1", &["texture coordinate"]);
    bad("f 1//1 2//1 3//1", &["normal"]);
    bad("f a b c", &["'a'"]);
    bad("f /1 /2 /3", &["texture coordinate"]);
    bad("v 1 2", &["3 numbers"]);
    bad("v 1 2 inf", &["inf"]);
    bad("v 1 2 x", &["'x'"]);
    fails("a.obj", "v 0 0 0\n", &["no triangles"]);
    fails("a.obj", [0xff, 0xfe, 0x00], &["no triangles"]);
}

#[test]
fn broken_libraries_name_the_line() {
    let bad = |mtl: &str, words: &[&str]| {
        let folder = Folder::new().with("a.obj", OBJ).with("things.mtl", mtl);
        let message = folder.error("a.obj");
        for word in words {
            assert!(message.contains(word), "'{word}' is not in: {message}");
        }
    };
    bad("newmtl a\nKd 1 spam 1\n", &["things.mtl", "line 2", "spam"]);
    bad("newmtl a\nKd\n", &["things.mtl", "line 2", "Kd"]);
    bad("Kd 1 1 1\n", &["line 1", "newmtl"]);
    bad("newmtl a\n\nmap_Kd nowhere.png\n", &["nowhere.png", "things.mtl, line 3"]);
    bad("newmtl a\nmap_Kd -clamp on\n", &["line 2", "map_Kd"]);
    bad("newmtl a\nmap_Kd things.mtl\n", &["things.mtl", "decoded"]);
}

// glTF

/// Positions, normals, uvs and u16 indices of a triangle; 108 bytes.
fn triangle_bytes() -> Vec<u8> {
    let floats: [f32; 24] = [
        0., 0., 0., 1., 0., 0., 0., 1., 0., // positions at 0
        0., 0., 1., 0., 0., 1., 0., 0., 1., // normals at 36
        0., 1., 1., 1., 0., 0., // uvs at 72
    ];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    for i in [0u16, 1, 2, 0] {
        bytes.extend(i.to_le_bytes());
    }
    bytes.extend([255, 0, 0, 255]);
    bytes
}

/// The JSON of a triangle with its buffer's source.
fn triangle_json(buffer: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,3]}}],
"nodes":[{{"children":[1,2],"translation":[10,0,0]}},{{"mesh":0,"scale":[2,2,2]}},{{"mesh":0,"scale":[-1,1,1]}},
 {{"camera":0,"translation":[0,0,5]}}],
"cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
"meshes":[{{"name":"tri","primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":0}}]}}],
"materials":[{{"name":"paint","alphaMode":"BLEND","emissiveFactor":[1,1,1],"normalTexture":{{"index":0,"scale":0.5}},
 "pbrMetallicRoughness":{{"baseColorFactor":[0.5,1,1,1],"metallicFactor":0.25,"roughnessFactor":0.75,
  "baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"scale":[2,2]}}}}}}}}}}],
"extensionsUsed":["KHR_texture_transform"],
"textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33071,"wrapT":33648}}],"images":[{{"uri":"my%20paint.png"}}],
"accessors":[
 {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
 {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"}},
 {{"bufferView":0,"byteOffset":72,"componentType":5126,"count":3,"type":"VEC2"}},
 {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":12}}],
"buffers":[{{{buffer}"byteLength":108}}]}}"#
    )
}

fn embedded_json() -> String {
    let data = base64::engine::general_purpose::STANDARD.encode(triangle_bytes());
    triangle_json(&format!(r#""uri":"data:application/octet-stream;base64,{data}","#))
}

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + 8 + bin.len();
    let mut out = b"glTF".to_vec();
    for word in [2, length as u32, json.len() as u32] {
        out.extend(word.to_le_bytes());
    }
    out.extend(b"JSON");
    out.extend(json);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

fn gltf_folder() -> Folder {
    Folder::new().with_image("my paint.png", [255, 128, 0])
}

fn check_triangles(loaded: &Loaded) {
    let d = &loaded.description;
    assert_eq!(d.parts.len(), 2, "one mesh, two instances");
    let [scaled, mirrored] = &d.parts[..] else { panic!() };
    assert_eq!(scaled.mesh.positions[1], vec3(12.0, 0.0, 0.0));
    assert_eq!(scaled.mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mirrored.mesh.positions[1], vec3(9.0, 0.0, 0.0));
    assert_eq!(mirrored.mesh.triangles, [[0, 2, 1]]);
    assert!(close(mirrored.mesh.normals[0], Vec3::Z));
    assert_eq!(d.surfaces.len(), 1);
    let surface = &d.surfaces[0];
    let SurfaceModel::MetallicRoughness(m) = &surface.model else { panic!() };
    assert_eq!((m.metallic, m.roughness), (0.25, 0.75));
    assert_eq!(m.base_color, Rgb::new(0.5, 1.0, 1.0));
    let texture = m.base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(texture.transform.apply(Vec2::ONE), vec2(2.0, 2.0));
    assert_eq!(surface.normal_map.unwrap().scale, 0.5);
    assert_eq!(d.textures.len(), 2, "one image as colour and as numbers");
    let camera = d.camera.unwrap();
    assert_eq!((camera.origin, camera.up), (vec3(0.0, 0.0, 5.0), Vec3::Y));
    assert_eq!(camera.target, vec3(0.0, 0.0, 4.0));
    let degrees = 0.5f32.to_degrees();
    assert_eq!(camera.projection, Projection::Perspective { fov_y_degrees: degrees });
    for word in ["emission", "opaque"] {
        assert!(loaded.warnings.iter().any(|w| w.contains(word)));
    }
}

#[test]
fn gltf_with_external_embedded_and_binary_buffers() {
    let external = triangle_json(r#""uri":"tri.bin","#);
    let folder = gltf_folder()
        .with("external.gltf", external)
        .with("tri.bin", triangle_bytes())
        .with("embedded.gltf", embedded_json())
        .with("binary.glb", glb(&triangle_json(""), &triangle_bytes()));
    for name in ["external.gltf", "embedded.gltf", "binary.glb"] {
        check_triangles(&folder.load(name));
    }
}

#[test]
fn gltf_strips_fans_and_lists_without_indices() {
    // Four vertices of a square from the strip's order; a fan orders them differently.
    let floats: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
    let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    for (mode, expected) in
        [(4, vec![[0, 1, 2]]), (5, vec![[0, 1, 2], [2, 1, 3]]), (6, vec![[1, 2, 0], [2, 3, 0]])]
    {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":{mode}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
"bufferViews":[{{"buffer":0,"byteLength":48}}],
"buffers":[{{"uri":"data:;base64,{data}","byteLength":48}}]}}"#
        );
        let loaded = one("a.gltf", json);
        let mesh = &loaded.description.parts[0].mesh;
        assert_eq!(mesh.triangles, expected);
        assert!(mesh.normals.is_empty(), "glTF asks for flat normals");
    }
}

#[test]
fn broken_gltf_files_are_errors() {
    let bad = |from: &str, to: &str, words: &[&str]| {
        let json = embedded_json();
        assert!(json.contains(from), "{from}");
        let folder = gltf_folder().with("a.gltf", json.replace(from, to));
        let message = folder.error("a.gltf");
        for word in words.iter().chain(&["a.gltf"]) {
            assert!(message.contains(word), "'{word}' is not in: {message}");
        }
    };
    bad(r#""count":3,"type":"VEC2""#, r#""count":4,"type":"VEC2""#, &["accessor 2", "104"]);
    bad(r#""count":3,"type":"SCALAR""#, r#""count":4000000000,"type":"SCALAR""#, &["accessor 3"]);
    bad(r#""byteOffset":36"#, r#""byteOffset":18446744073709551615"#, &["a.gltf"]);
    bad(r#""byteOffset":96,"#, r#""byteOffset":1000,"#, &["buffer view 1", "1012"]);
    bad(r#""byteLength":108"#, r#""byteLength":109"#, &["buffer 0"]);
    bad(r#""componentType":5123"#, r#""componentType":5126"#, &["accessor 3", "indices"]);
    bad(r#""TEXCOORD_0":2"#, r#""TEXCOORD_0":1"#, &["accessor 1", "VEC2"]);
    bad(r#""NORMAL":1"#, r#""NORMAL":9"#, &["not valid"]);
    bad(r#""POSITION":0"#, r#""POSITION":9"#, &["accessor 9", "primitive 0"]);
    bad(r#""children":[1,2]"#, r#""children":[1,0]"#, &["node 0", "tree"]);
    bad(r#""children":[1,2]"#, r#""children":[1,1]"#, &["node 1", "tree"]);
    bad("my%20paint.png", "gone.png", &["gone.png", "paint"]);
    bad("my%20paint.png", "https://example.org/x.png", &["example.org"]);
    bad("base64,", "base64,*", &["buffer 0", "decoded"]);
    bad(r#""version":"2.0""#, r#""version":2"#, &["not valid"]);
    let strange = r#""bufferView":0,"byteOffset":72,"#;
    bad(strange, r#""byteOffset":72,"#, &["accessors[2]"]);
}

#[test]
fn indices_beyond_the_vertices_are_errors() {
    let mut bytes = triangle_bytes();
    bytes[96] = 3;
    let folder = gltf_folder().with("a.glb", glb(&triangle_json(""), &bytes));
    let message = folder.error("a.glb");
    assert!(message.contains("index 3") && message.contains("primitive 0"), "{message}");
}

#[test]
fn every_truncation_of_a_glb_is_an_error() {
    let whole = glb(&triangle_json(""), &triangle_bytes());
    let folder = gltf_folder();
    for length in (0..whole.len()).step_by(7) {
        fs::write(folder.path("cut.glb"), &whole[..length]).unwrap();
        assert!(load(folder.path("cut.glb")).is_err(), "{length} bytes were accepted");
    }
    for length in [0u32, 11, 19, u32::MAX] {
        let mut wrong = whole.clone();
        wrong[8..12].copy_from_slice(&length.to_le_bytes());
        fs::write(folder.path("cut.glb"), &wrong).unwrap();
        assert!(load(folder.path("cut.glb")).is_err());
    }
}

// TOML

const TOML: &str = r#"
up = "z"

[camera]
origin = [0, -5, 1]
target = [0, 0, 0]
fov = 40

[environment]
file = "probes/sky.exr"
rotate = 90
scale = 2.0
up = "z"

[materials]
clay = "diffuse:0.5"

[materials.brass]
base_color = [0.9, 0.7, 0.3]
base_color_texture = "brass.png"
normal_map = "normal.png"
metallic = 1.0
roughness = 0.25
uv_scale = 4.0

[[objects]]
file = "quad.ply"
material = "brass"
scale = 2
rotate = [0, 0, 90]
translate = [10, 0, 0]

[[objects]]
name = "second"
file = "quad.ply"
material = "ggx:0.2"
matrix = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

[[objects]]
file = "quad.ply"
"#;

fn toml_folder() -> Folder {
    Folder::new()
        .with("quad.ply", PLY_QUAD)
        .with_image("brass.png", [255, 255, 255])
        .with_image("normal.png", [128, 128, 255])
}

#[test]
fn a_scene_file_combines_everything() {
    let folder = toml_folder().with("scene.toml", TOML);
    let loaded = folder.load("scene.toml");
    let d = &loaded.description;
    assert_eq!(d.up, Some(UpAxis::Z));
    let camera = d.camera.unwrap();
    assert_eq!((camera.origin, camera.up), (vec3(0.0, -5.0, 1.0), Vec3::Z));
    assert_eq!(camera.projection, Projection::Perspective { fov_y_degrees: 40.0 });
    let environment = d.environment.as_ref().unwrap();
    assert_eq!(environment.source, EnvironmentSource::File(folder.path("probes/sky.exr")));
    assert_eq!((environment.rotate_degrees, environment.scale), (90.0, 2.0));

    assert_eq!(d.parts.len(), 3);
    assert!(close(d.parts[0].mesh.positions[1], vec3(10.0, 2.0, 0.0)));
    assert_eq!(d.parts[1].name, "second");
    assert_eq!(d.parts[1].mesh.positions[1], vec3(6.0, 0.0, 0.0));
    let brass = &d.surfaces[d.parts[0].surface];
    assert_eq!(brass.name, "brass");
    assert_eq!(brass.textures().count(), 2);
    let SurfaceModel::MetallicRoughness(m) = &brass.model else { panic!() };
    assert_eq!(m.base_color_texture.unwrap().transform.apply(Vec2::ONE), vec2(4.0, 4.0));
    assert!(matches!(d.surfaces[d.parts[1].surface].model, SurfaceModel::Fixed(_)));
    assert_eq!(d.surfaces[d.parts[2].surface].name, "default");
}

#[test]
fn built_in_scenes_are_objects_with_a_camera() {
    let text = "[[objects]]\nbuiltin = \"sphere\"\nmaterial = \"ggx:0.3\"\ntranslate = [7, 0, 0]\n";
    let d = one("scene.toml", text).description;
    assert!(close(d.parts[0].mesh.bounds().center(), vec3(7.0, 0.0, 0.0)));
    assert!(close(d.camera.unwrap().target, vec3(7.0, 0.0, 0.0)));
    assert!(matches!(d.surfaces[d.parts[0].surface].model, SurfaceModel::Fixed(_)));
}

/// A material is the subject's; floor, probe and camera of the scene stay as they are.
#[test]
fn a_material_changes_nothing_but_the_subject() {
    let text = "[[objects]]\nbuiltin = \"material-ball\"\nmaterial = \"ggx:0.3\"\n";
    let d = one("scene.toml", text).description;
    assert!(d.environment.is_some() && d.camera.is_some() && !d.scenery.is_empty());
    for (i, part) in d.parts.iter().enumerate() {
        let fixed = matches!(d.surfaces[part.surface].model, SurfaceModel::Fixed(_));
        assert_eq!(fixed, !d.scenery.contains(&i), "{}", part.name);
    }
}

#[test]
fn broken_scene_files_name_the_line_and_the_reason() {
    let bad = |from: &str, to: &str, words: &[&str]| {
        assert!(TOML.contains(from), "{from}");
        let folder = toml_folder().with("scene.toml", TOML.replacen(from, to, 1));
        let message = folder.error("scene.toml");
        for word in words.iter().chain(&["scene.toml"]) {
            assert!(message.contains(word), "'{word}' is not in: {message}");
        }
    };
    bad("fov = 40", "fovy = 40", &["line 7", "fovy"]);
    bad("fov = 40", "fov = 180", &["line 4", "180"]);
    bad("fov = 40", "fov = 40\northographic = 2", &["orthographic"]);
    bad("target = [0, 0, 0]", "target = [0, -5, 1]", &["line 4", "same point"]);
    bad("up = \"z\"", "up = \"x\"", &["line 2", "x"]);
    bad("scale = 2.0", "scale = -1.0", &["scale", "-1"]);
    bad("file = \"probes/sky.exr\"", "", &["environment", "builtin"]);
    bad("diffuse:0.5", "difuse:0.5", &["line 16", "difuse"]);
    bad("roughness = 0.25", "roughness = 25", &["line 18", "roughness", "25"]);
    bad("roughness = 0.25", "rougness = 0.25", &["line 18", "roughness"]);
    bad("brass.png", "gone.png", &["gone.png", "brass", "line 18"]);
    bad("quad.ply", "gone.ply", &["gone.ply", "line 26"]);
    bad("quad.ply", "scene.toml", &["scene.toml"]);
    bad("file = \"quad.ply\"", "builtin = \"unicorn\"", &["unicorn", "line 26"]);
    bad("material = \"brass\"", "material = \"brss\"", &["brss", "line 26"]);
    bad("scale = 2\n", "scale = 0\n", &["line 26", "singular"]);
    bad("scale = 2\n", "scale = nan\n", &["line 26", "singular"]);
    bad("[0, 0, 0, 1]]", "[0, 0, 1, 1]]", &["line 33", "last row"]);
    bad("name = \"second\"", "name = \"second\"\nscale = 2", &["matrix"]);
    bad("[camera]", "[camera", &["line 4"]);
    fails("a.toml", [0x61, 0xff], &["UTF-8", "byte 1"]);
    fails("a.toml", "", &["no triangles"]);
}

// Any format

#[test]
fn files_that_are_none() {
    let folder = Folder::new().with("a.stl", "solid").with("odd.obj", PLY_QUAD);
    assert!(folder.error("missing.ply").contains("missing.ply"));
    assert!(folder.error("a.stl").contains(".glb"));
    fs::create_dir(folder.path("folder.obj")).unwrap();
    assert!(folder.error("folder.obj").contains("folder.obj"));
    assert_eq!(folder.load("odd.obj").description.parts[0].mesh.triangles.len(), 2);
}

#[test]
fn sixteen_bit_and_grey_textures_load() {
    let folder = toml_folder().with("scene.toml", TOML);
    let deep = image::ImageBuffer::from_pixel(1, 1, image::Luma([65535u16]));
    deep.save(folder.path("brass.png")).unwrap();
    let d = folder.load("scene.toml").description;
    assert_eq!(d.textures[0].texel(0, 0), Rgb::WHITE);
}

/// Whatever is loaded from a damaged file makes a scene or an error.
#[test]
fn damaged_files_never_panic() {
    let folder = toml_folder().with_image("my paint.png", [1, 2, 3]).with("things.mtl", MTL);
    let whole = [
        ("a.ply", PLY_QUAD.as_bytes().to_vec()),
        ("b.ply", binary_ply(true)),
        ("c.obj", OBJ.as_bytes().to_vec()),
        ("things.mtl", MTL.as_bytes().to_vec()),
        ("d.glb", glb(&triangle_json(""), &triangle_bytes())),
        ("e.gltf", embedded_json().into_bytes()),
        ("f.toml", TOML.as_bytes().to_vec()),
    ];
    fs::write(folder.path("c.obj"), OBJ).unwrap();
    let mut state = 1u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) as usize) % n
    };
    for (name, bytes) in whole {
        for _ in 0..200 {
            let mut damaged = bytes.clone();
            for _ in 0..=random(3) {
                let at = random(damaged.len());
                match random(4) {
                    0 => damaged[at] = random(256) as u8,
                    1 => damaged[at] = b"0123456789-.e,[]{}\" \n"[random(21)],
                    2 => drop(damaged.remove(at)),
                    _ => damaged.insert(at, b"09-"[random(3)]),
                }
            }
            fs::write(folder.path(name), &damaged).unwrap();
            let scene = if name == "things.mtl" { "c.obj" } else { name };
            if let Ok(loaded) = load(folder.path(scene)) {
                let _ = Scene::new(loaded.description);
            }
        }
        fs::write(folder.path(name), &bytes).unwrap();
    }
}
