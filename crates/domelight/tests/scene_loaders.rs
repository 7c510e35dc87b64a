//! The scene loaders on small files of every format, sound and broken.
#![cfg(feature = "io")]

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use domelight::Rgb;
use domelight::math::{Vec2, Vec3, vec2, vec3};
use domelight::scene::{
    AlphaMode, Coverage, EnvironmentSource, LoadOptions, Loaded, Material, MaterialModel,
    Projection, Reach, Scene, TextureFilter, UpAxis, Wrap, load, load_bytes, load_with,
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

    /// With a picture of one color.
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
    fails_with(&LoadOptions::default(), name, contents, words);
}

/// What only `--strict` refuses.
fn fails_if_strict(name: &str, contents: impl AsRef<[u8]>, words: &[&str]) {
    let strict = LoadOptions { strict: true, ..LoadOptions::default() };
    fails_with(&strict, name, contents, words);
}

fn fails_with(options: &LoadOptions, name: &str, contents: impl AsRef<[u8]>, words: &[&str]) {
    let folder = Folder::new().with(name, contents);
    let message = load_with(folder.path(name), options).unwrap_err().to_string();
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
    assert_eq!(loaded.warnings, [""; 0]);
    for (kind, max) in [("int", "255"), ("uint", "255"), ("short", "255"), ("ushort", "65535")] {
        let text = PLY_QUAD.replace("property uchar red", &format!("property {kind} red"));
        let text = text.replace("1 1 0 1 9 1 1 255 0 0", &format!("1 1 0 1 9 1 1 {max} 0 0"));
        let colors = &one("quad.ply", text).description.parts[0].mesh.colors;
        assert_eq!(colors[2].r, 1.0, "{kind}");
        assert!(kind == "ushort" || (colors[0].r - 1.0).abs() < 1e-6, "{kind}: {:?}", colors[0]);
    }
    let longer = one("quad.ply", format!("{PLY_QUAD}3 0 1 2\n"));
    assert!(longer.warnings[0].contains("text follows the rows that the header counts"));
}

#[test]
fn line_ends_of_other_systems() {
    // The last is what text mode makes of Windows' line ends.
    for end in ["\r\n", "\r", "\r\r\n"] {
        let ply = one("quad.ply", PLY_QUAD.replace('\n', end));
        assert_eq!(ply.description.parts[0].mesh.triangles.len(), 2, "{end:?}");
        assert_eq!(ply.warnings, [""; 0]);
        for (name, text) in [("a.obj", OBJ), ("a.off", OFF)] {
            let triangles = |text: String| {
                let parts = one(name, text).description.parts;
                parts.iter().map(|part| part.mesh.triangles.len()).collect::<Vec<_>>()
            };
            assert_eq!(
                triangles(text.replace('\n', end)),
                triangles(text.into()),
                "{name} {end:?}"
            );
        }
    }
    // Bytes after a binary file's header are no line ends.
    let binary = binary_ply(false);
    let header = binary.windows(10).position(|w| w == b"end_header").unwrap() + 11;
    let text = String::from_utf8_lossy(&binary[..header]).replace('\n', "\r");
    let loaded = one("mesh.ply", [text.as_bytes(), &binary[header..]].concat());
    assert_eq!(loaded.description.parts[0].mesh.triangles.len(), 2);
}

/// A quadrilateral with texture coordinates of its corners, as MeshLab writes it.
const TEXTURED_PLY: &str = "ply
format ascii 1.0
comment TextureFile   my picture.png
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
end_header
0 0 0 9 9 9
1 0 0 9 9 9
1 1 0 9 9 9
0 1 0 9 9 9
3 0 1 2 6 0 0 1 0 1 0.25
3 0 2 3 6 0.5 0 nan 1 0 1
";

#[test]
fn textures_of_a_ply_have_coordinates_of_corners() {
    let folder = Folder::new().with("a.ply", TEXTURED_PLY);
    let plain = folder.load("a.ply");
    assert!(plain.warnings[0].contains("my picture.png") && plain.warnings[0].contains("left out"));
    assert_eq!(plain.description.parts[0].mesh.colors.len(), 4);

    let folder = folder.with_image("my picture.png", [255, 0, 0]);
    let loaded = folder.load("a.ply");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let d = &loaded.description;
    let MaterialModel::Phong(model) = &d.materials[d.parts[0].material].model else { panic!() };
    assert_eq!((model.diffuse, model.diffuse_texture.map(|t| t.texture)), (Rgb::WHITE, Some(0)));
    let mesh = &d.parts[0].mesh;
    // The texture takes the place of colors.
    assert!(mesh.colors.is_empty() && d.textures.len() == 1);
    let uvs = mesh.triangles.as_flattened().iter().map(|&i| mesh.uvs[i as usize]);
    let expected =
        [[0.0, 1.0], [1.0, 1.0], [1.0, 0.75], [0.5, 1.0], [0.0, 1.0], [0.0, 0.0]].map(Vec2::from);
    assert!(uvs.eq(expected));

    // A path of another computer, and coordinates of vertices.
    let of_vertices = "ply\nformat ascii 1.0\ncomment TextureFile C:\\scans\\my picture.png
element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t
element face 1\nproperty list uchar int vertex_indices\nend_header
0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 0.25\n3 0 1 2\n";
    let d = folder.with("b.ply", of_vertices).load("b.ply").description;
    assert_eq!((d.textures.len(), d.parts[0].mesh.uvs[2]), (1, vec2(0.0, 0.75)));
}

#[test]
fn faces_of_a_ply_choose_among_textures() {
    let text = TEXTURED_PLY
        .replace(
            "comment TextureFile   my picture.png",
            "comment TextureFile a.png\ncomment TextureFile b.png",
        )
        .replace("element face 2", "element face 3")
        .replace("end_header", "property int texnumber\nend_header")
        .replace("0.25\n", "0.25 1\n")
        .replace("nan 1 0 1\n", "1 1 0 1 0\n3 0 1 3 6 0 0 0 0 0 0 -1\n");
    let folder = Folder::new().with("a.ply", text);
    let folder = folder.with_image("a.png", [255, 0, 0]).with_image("b.png", [0, 255, 0]);
    let d = folder.load("a.ply").description;
    let textures = d.parts.iter().map(|part| match &d.materials[part.material].model {
        MaterialModel::Phong(model) => model.diffuse_texture.map(|t| t.texture),
        _ => None,
    });
    assert_eq!(textures.collect::<Vec<_>>(), [Some(0), Some(1), None]);
    assert!(d.parts.iter().all(|part| part.mesh.triangles == [[0, 1, 2]]));
    let of_first = d.parts[0].mesh.positions.iter().map(|p| p.truncate()).collect::<Vec<_>>();
    assert_eq!(of_first, [vec2(0.0, 0.0), vec2(1.0, 1.0), vec2(0.0, 1.0)]);
}

#[test]
fn more_values_than_the_header_says_are_left_out() {
    let more =
        |text: &str| text.replace("1 1 0\n", "1 1 0 0.5 0.5\n").replace("3 0 1 2\n", "3 0 1 2 7\n");
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z
element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n";
    let (plain, extended) = (one("a.ply", text), one("a.ply", more(text)));
    assert!(plain.warnings.is_empty());
    let warnings = &extended.warnings;
    assert!(warnings.len() == 1 && warnings[0].contains("2 rows"), "{warnings:?}");
    let mesh = |loaded: &Loaded| loaded.description.parts[0].mesh.clone();
    assert_eq!(mesh(&plain).positions, mesh(&extended).positions);
    assert_eq!(mesh(&plain).triangles, mesh(&extended).triangles);
    fails_if_strict("a.ply", more(text), &["more values", "--strict"]);
    // Rows need not be lines.
    let flowing = text.replace("0 0 0\n1 0 0\n1 1 0\n", "0 0\n0 1 0 0\n1 1 0 ");
    assert_eq!(mesh(&one("a.ply", flowing)).positions, mesh(&plain).positions);
}

#[test]
fn libraries_of_another_computer_lie_beside_the_obj() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let names = ["C:\\My models\\my red.mtl", "/home/me/my red.mtl", "\"C:\\models\\my red.mtl\""];
    for name in names {
        let folder = Folder::new()
            .with("a.obj", format!("mtllib {name}\n{triangle}"))
            .with("my red.mtl", "newmtl red\nKd 1 0 0\nmap_Kd red.png\n")
            .with_image("red.png", [255, 0, 0]);
        let loaded = folder.load("a.obj");
        assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
        assert_eq!(loaded.description.materials[0].name, "red", "{name}");
        assert_eq!(loaded.description.textures.len(), 1, "{name}");
    }
    // Several names, of which one is not there.
    let folder = Folder::new()
        .with("a.obj", format!("mtllib red.mtl none/blue.mtl\n{triangle}"))
        .with("red.mtl", "newmtl red\nKd 1 0 0\n")
        .with("blue.mtl", "newmtl blue\nKd 0 0 1\n");
    let names = folder.load("a.obj").description.materials.into_iter().map(|m| m.name);
    assert!(names.eq(["red", "blue"]));
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
    let nan = PLY_QUAD.replace("1 1 0 1 9", "1 nan 0 1 9");
    fails_if_strict("a.ply", nan, &["vertex 2", "finite", "--strict"]);
    fails("a.ply", PLY_QUAD.replace("float z", "half z"), &["line 7", "half z"]);
    fails("a.ply", PLY_QUAD.replace("float z", "float w"), &["x, y and z"]);
    fails("a.ply", PLY_QUAD.replace("vertex_indices", "indices"), &["vertex_indices"]);
    fails("a.ply", PLY_QUAD.replace("element face 1", "element facet 1"), &["element face"]);
    fails("a.ply", PLY_QUAD.replace("ascii", "ebcdic"), &["line 2", "ebcdic"]);
    fails("a.ply", PLY_QUAD.replace("format ascii 1.0\n", ""), &["format"]);
    fails("a.ply", "ply\nformat ascii 1.0\n", &["end_header"]);
    for name in ["a.ply", "a.obj", "a.stl", "a.off", "a.glb", "a.gltf", "a.toml"] {
        fails(name, "", &[name, "the file is empty"]);
    }
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

    let MaterialModel::Phong(red) = &d.materials[d.parts[0].material].model else { panic!() };
    assert_eq!((red.diffuse, red.exponent), (Rgb::new(0.8, 0.1, 0.1), 40.0));
    assert_eq!(red.specular, Rgb::splat(0.5));
    let metal = &d.materials[d.parts[1].material];
    let MaterialModel::MetallicRoughness(m) = &metal.model else { panic!() };
    assert_eq!((m.metallic, m.roughness), (1.0, 0.3));
    let texture = m.base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp; 2]);
    // Texture coordinates grow upward in the file, downward in the program.
    assert_eq!(texture.transform.apply(vec2(0.5, 1.0)), vec2(1.0, 1.0));
    assert_eq!(texture.transform.apply(vec2(0.5, 0.0)), vec2(1.0, -2.0));
    assert!(metal.normal_map.is_some());
    assert_eq!(d.textures.len(), 2);
    let coverage = d.materials[d.parts[0].material].coverage;
    assert_eq!((coverage.mode, coverage.opacity), (AlphaMode::Blend, 0.5));
    assert!(loaded.warnings.iter().any(|w| w.contains("nowhere")), "{:?}", loaded.warnings);
}

/// A file of one long name and many parts would take their product of memory.
#[test]
fn names_of_parts_are_shortened() {
    let long = "ö".repeat(1000);
    let obj = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\no {long}\nf 1 2 3\nusemtl {long}\nf 1 2 3\n");
    let parts = one("a.obj", &obj).description.parts;
    assert_eq!(parts.len(), 2);
    assert!(parts.iter().all(|part| part.name == format!("{}…", "ö".repeat(200))));
    let toml = format!("[[objects]]\nbuiltin = \"spheres\"\nname = \"{long}\"\n");
    let parts = one("a.toml", toml).description.parts;
    assert!(parts.len() > 1 && parts.iter().all(|part| part.name.chars().count() == 201));
}

#[test]
fn an_obj_without_its_library_is_gray_with_a_warning() {
    let loaded = one("a.obj", OBJ);
    assert_eq!(loaded.description.parts.len(), 3);
    assert!(loaded.warnings[0].contains("things.mtl") && loaded.warnings[0].contains("line 2"));
}

#[test]
fn smooth_normals_cross_seams_of_an_obj() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 1\ns 1\nf 1/1 2/1 3/1\nusemtl b\nf 1/2 3/2 4/2\n";
    let loaded = one("a.obj", text);
    let [a, b] = &loaded.description.parts[..] else { panic!() };
    let expected = vec3(1.0, 0.0, 1.0).normalize();
    assert!(close(a.mesh.normals[0], expected) && close(b.mesh.normals[0], expected));
}

#[test]
fn faces_of_an_obj_are_flat_unless_a_smoothing_group_joins_them() {
    let normals = |first: &str, second: &str| {
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
        let loaded = one("a.obj", format!("{vertices}{first}\nf 1 2 3\n{second}\nf 1 3 4\n"));
        loaded.description.parts[0].mesh.normals.clone()
    };
    for (first, second) in [("", ""), ("s off", ""), ("s 0", "s null"), ("s", "s OFF # none")] {
        assert_eq!(normals(first, second), [], "{first}, {second}");
    }
    // Faces of different groups share no normal, those of one group do.
    let apart = normals("s 1", "s 2");
    assert!(apart.len() == 6 && apart[..3].iter().all(|&n| n == Vec3::Z));
    assert!(apart[3..].iter().all(|&n| n == Vec3::X));
    for smooth in ["s 1", "s 3 # of 32", "s on"] {
        let joined = normals(smooth, "");
        assert_eq!(joined.len(), 4);
        assert!(close(joined[0], vec3(1.0, 0.0, 1.0).normalize()), "{smooth}: {joined:?}");
        assert!(joined[1] == Vec3::Z && joined[3] == Vec3::X);
    }
    // A flat face beside a smooth one has no normals.
    let mixed = normals("s 1", "s off");
    assert_eq!(mixed.iter().filter(|&&n| n == Vec3::ZERO).count(), 3);
}

/// What other programs write and read: quoted names, paths of another computer, black colors under textures, indices to
/// what is not there, numbers with the sign before the e.
#[test]
fn habits_of_exporters() {
    let square = "mtllib \"a b.mtl\"\nv 0 0 0\nv 1 0 0\nv 0 3.1+e2 0\nvt 0 0\nusemtl m\n";
    let obj = format!("{square}f 1/1/7 2/1/7 3/1/7\n");
    let png = |color: [u8; 3]| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = image::RgbImage::from_pixel(2, 2, image::Rgb(color));
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let library = "newmtl m\nKd 0 0 0\nmap_Kd \"C:\\maps of me\\red one.png\"\n";
    let (obj, png) = (obj.into_bytes(), png([255, 0, 0]));
    let resolver = |path: &Path| match path.to_str() {
        Some("a b.mtl") => Ok(library.as_bytes().to_vec()),
        Some("red one.png") => Ok(png.clone()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    };
    let loaded = load_bytes("a.obj", &obj, &resolver, &LoadOptions::default()).unwrap();
    let MaterialModel::Phong(material) = &loaded.description.materials[0].model else {
        panic!("{loaded:?}")
    };
    assert_eq!(material.diffuse, Rgb::WHITE);
    assert!(material.diffuse_texture.is_some());
    assert_eq!(loaded.description.parts[0].mesh.positions[2].y, 310.0);
    let [missing, black] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    let texts = format!("{missing}{black}");
    assert!(texts.contains("normal (vn)") && texts.contains("Kd is black"), "{texts}");
}

/// UTF-16 of both byte orders, and a byte order mark of UTF-8.
#[test]
fn texts_with_byte_order_marks() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let units = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
        std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(unit).collect()
    };
    let stl = "\u{feff}solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
               endfacet\nendsolid\n";
    for (name, bytes) in [
        ("a.obj", units(u16::to_le_bytes)),
        ("a.obj", units(u16::to_be_bytes)),
        ("a.stl", stl.as_bytes().to_vec()),
    ] {
        assert_eq!(one(name, bytes).description.triangle_count(), 1, "{name}");
    }
    let ply = "ply\nformat ascii 1.0\nCreated by a program\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n\
               0 1 0\n3 0 1 2\n";
    assert_eq!(one("a.ply", ply).description.triangle_count(), 1);
}

#[test]
fn vertex_colors_of_an_obj() {
    let loaded = one("a.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nv 2 2 2\nf 1 2 3\n");
    let colors = &loaded.description.parts[0].mesh.colors;
    assert_eq!(colors[..], [Rgb::new(1.0, 0.0, 0.0), Rgb::WHITE, Rgb::new(0.0, 0.0, 1.0)]);
    // Display values from 0 to 1 or to 255.
    for half in ["0.5 0.5 0.5", "127.5 127.5 127.5"] {
        let last = if half.len() > 12 { "255 0 0" } else { "nan 0 0" };
        let text = format!("v 0 0 0 {half}\nv 1 0 0 {half}\nv 0 1 0 {last}\nf 1 2 3\n");
        let loaded = one("a.obj", text);
        let colors = &loaded.description.parts[0].mesh.colors;
        assert!(close_f(colors[0].g, 0.214_041) && colors[2].r == 1.0, "{colors:?}");
        let warns = loaded.warnings.iter().any(|warning| warning.contains("1 color is NaN"));
        assert_eq!(warns, last.contains("nan"));
    }
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
    fails_if_strict("a.obj", format!("{v}f 1/1 2/1 3/1\n"), &["line 4", "texture coordinate"]);
    fails_if_strict("a.obj", format!("{v}f 1//1 2//1 3//1\n"), &["line 4", "normal"]);
    bad("f a b c", &["'a'"]);
    bad("f /1 /2 /3", &["'/1'"]);
    bad("v 1 2", &["3 numbers"]);
    fails_if_strict("a.obj", format!("{v}v 1 2 inf\n"), &["line 4", "inf"]);
    bad("v 1 2 x", &["'x'"]);
    fails("a.obj", "v 0 0 0\n", &["no triangles"]);
    fails("a.obj", [0xff, 0xfe, 0x00], &["empty"]);
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
    bad("newmtl a\nmap_Kd -clamp on\n", &["line 2", "map_Kd"]);
}

#[test]
fn textures_of_a_library_that_cannot_be_had_are_left_out() {
    for (mtl, words) in [
        ("newmtl red\n\nmap_Kd nowhere.png\n", ["nowhere.png", "things.mtl, line 3"]),
        ("newmtl red\nmap_Kd things.mtl\n", ["things.mtl", "decoded"]),
    ] {
        let loaded = Folder::new().with("a.obj", OBJ).with("things.mtl", mtl).load("a.obj");
        let texture = loaded.warnings.iter().filter(|w| words.iter().all(|word| w.contains(word)));
        assert_eq!(texture.count(), 1, "{:?}", loaded.warnings);
    }
}

/// What exporters write: continued lines, comments after words, Latin-1, white space of all kinds, concave faces.
#[test]
fn obj_as_exporters_write_it() {
    let text = b"\xef\xbb\xbf# exported\r\nmtllib \\\r\n  b\xf6se.mtl\r\ng  wall  left # two names\r\n\
        v 0 0 0 1.0\r\nv 2 1 0\r\nv\t0 2 0\r\nv 0.5 1 0\r\nvn nan -nan(ind) 0\r\nvt 0.5 -1.#IND 0\r\n\
        usemtl r\xf6t \r\nf 1/1 2/1 3/1 \\\r\n 4/1 # an arrow head\r\nl 1 2\r\np 1\r\ns off\r\n\
        usemtl r\xf6t\r\nf -4//1 -3//1 -1//1\r\n";
    let mtl = b"newmtl r\xf6t\r\nKd 1 0 0\r\nKe 2 2 2\r\nmap_d a.png\r\nmap_Ks k.png\r\nmap_Bump -bm 0.5 n.png\r\n\
        newmtl b\r\nKd spectral a.rfl\r\nKe 1 0 0\r\nbump heights.png\r\n";
    let loaded = Folder::new()
        .with("a.obj", text)
        .with("b\u{f6}se.mtl", mtl)
        .with_image("n.png", [127, 130, 250])
        .with_image("heights.png", [90, 90, 90])
        .load("a.obj");
    let d = &loaded.description;
    assert_eq!(d.parts.len(), 1);
    let mesh = &d.parts[0].mesh;
    // The arrow head's inner corner is 4: no triangle spans 1, 2, 3.
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    let areas: Vec<f32> = mesh.triangles.iter().map(area).collect();
    assert_eq!(areas.len(), 3);
    assert!(areas.iter().all(|&a| a > 0.0) && close_f(areas[0] + areas[1], 1.5), "{areas:?}");
    let MaterialModel::Phong(red) = &d.materials[d.parts[0].material].model else { panic!() };
    assert_eq!(
        (red.diffuse, d.parts[0].name.as_str()),
        (Rgb::new(1.0, 0.0, 0.0), "wall  left # two names")
    );
    assert_eq!(d.materials[0].normal_map.map(|map| map.scale), Some(0.5));
    assert!(d.materials[1].normal_map.is_none());
    assert_eq!(d.textures.len(), 1);
    assert_eq!(d.materials[0].emission.map(|e| e.radiance), Some(Rgb::splat(2.0)));
    assert_eq!(d.materials[0].coverage, Coverage::default());
    for word in ["a map (map_Ks) is ignored, of material 'r\u{f6}t'", "a.png", "heights", "not RGB"]
    {
        assert_eq!(
            loaded.warnings.iter().filter(|w| w.contains(word)).count(),
            1,
            "{:?}",
            loaded.warnings
        );
    }
}

fn mtl(library: &str, pictures: &[(&str, image::RgbaImage)]) -> (Material, Loaded) {
    let text = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let folder = Folder::new().with("a.obj", text).with("a.mtl", format!("newmtl a\n{library}"));
    for (name, picture) in pictures {
        picture.save(folder.path(name)).unwrap();
    }
    let loaded = folder.load("a.obj");
    (loaded.description.materials[0].clone(), loaded)
}

fn picture(side: u32, rgba: [u8; 4]) -> image::RgbaImage {
    image::RgbaImage::from_pixel(side, side, image::Rgba(rgba))
}

#[test]
fn mtl_opacity() {
    let coverage = |library: &str| mtl(library, &[]).0.coverage;
    assert_eq!(coverage("d 1\nTr 0.5\n"), Coverage::default());
    // To some programs Tr is opacity.
    assert_eq!(coverage("Tr 1\n"), Coverage::default());
    for library in ["Tr 0.75\n", "d 0.25\n", "d -halo 0.25\n", "Tr 1\nd 0.25\n"] {
        let Coverage { mode, opacity, texture } = coverage(library);
        assert_eq!((mode, opacity, texture), (AlphaMode::Blend, 0.25, None), "{library}");
    }
    // The alpha of one, the luminance of the other.
    for rgba in [[255, 0, 255, 51], [51, 51, 51, 255]] {
        let (material, loaded) = mtl("map_d -s 2 2 leaf.png\n", &[("leaf.png", picture(2, rgba))]);
        let texture = material.coverage.texture.unwrap();
        assert_eq!((material.coverage.mode, texture.transform.x.x), (AlphaMode::Blend, 2.0));
        let texture = &loaded.description.textures[texture.texture];
        let alpha = texture.sample_alpha(Vec2::ZERO, [Wrap::Repeat; 2], TextureFilter::Linear);
        assert!(close_f(alpha, 0.2), "{alpha}");
        assert_eq!(loaded.warnings, [""; 0]);
    }
}

#[test]
fn mtl_emission() {
    let emission = |library: &str| {
        let (material, loaded) = mtl(library, &[("e.png", picture(1, [255, 0, 0, 255]))]);
        assert_eq!(loaded.warnings, [""; 0]);
        material.emission.map(|e| (e.radiance, e.texture.is_some()))
    };
    assert_eq!(emission("Ke 0 0 0\n"), None);
    assert_eq!(emission("Ke 1 2 3\n"), Some((Rgb::new(1.0, 2.0, 3.0), false)));
    assert_eq!(emission("Ke 1 2 3\nmap_Ke e.png\n"), Some((Rgb::new(1.0, 2.0, 3.0), true)));
    assert_eq!(emission("map_Ke e.png\nKe 0 0 0\n"), Some((Rgb::WHITE, true)));
    // The whole surface would glow without the map.
    assert!(mtl("map_Ke gone.png\n", &[]).0.emission.is_none());
}

/// Maps of roughness and metalness stand instead of the numbers, and are one texture.
#[test]
fn mtl_maps_of_roughness_and_metalness() {
    let rough = || ("r.png", picture(4, [51, 51, 51, 255]));
    let metal = || ("m.png", picture(2, [102, 102, 102, 255]));
    let read = |library: &str, maps: &[(&str, image::RgbaImage)]| {
        let (material, loaded) = mtl(library, maps);
        let MaterialModel::MetallicRoughness(m) = material.model else { panic!() };
        let texture = &loaded.description.textures[m.metallic_roughness_texture.unwrap().texture];
        let Rgb { g, b, .. } = texture.texel(1, 1);
        (m.roughness * g, m.metallic * b)
    };
    let close = |(r, m): (f32, f32), expected: (f32, f32)| {
        assert!(close_f(r, expected.0) && close_f(m, expected.1), "{r}, {m}");
    };
    let both = read("Pr 0.9\nmap_Pr r.png\nPm 0\nmap_Pm m.png\n", &[rough(), metal()]);
    close(both, (0.2, 0.4));
    close(read("map_Pr r.png\nPm 0.5\n", &[rough()]), (0.2, 0.5));
    close(read("Pr 0.75\nmap_Pm m.png\n", &[metal()]), (0.75, 0.4));
    // As glTF packs them.
    let packed = ("p.png", picture(2, [0, 51, 102, 255]));
    close(read("map_Pr p.png\nmap_Pm p.png\n", &[packed]), (0.2, 0.4));
}

#[test]
fn mtl_keywords_of_any_case() {
    let library = "NEWMTL a\nkd 1 0 0\nMAP_KD c.png\nBump n.png\nD 0.25\nPR 0.5\n";
    let text = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    let folder = Folder::new()
        .with("a.obj", text)
        .with("a.mtl", library)
        .with_image("c.png", [255, 0, 0])
        .with_image("n.png", [127, 130, 250]);
    let loaded = folder.load("a.obj");
    assert_eq!(loaded.warnings, [""; 0]);
    let material = &loaded.description.materials[0];
    let MaterialModel::MetallicRoughness(m) = &material.model else { panic!() };
    assert_eq!((m.base_color, m.roughness), (Rgb::new(1.0, 0.0, 0.0), 0.5));
    assert!(m.base_color_texture.is_some() && material.normal_map.is_some());
    assert_eq!(material.coverage.opacity, 0.25);
}

#[test]
fn maps_that_mtl_ignores_are_named() {
    let library = "refl -type sphere sky.png\nmap_Ka a.png\nmap_aat on\nDisp h.png\nmap_Ps s.png\n";
    let warnings = mtl(library, &[]).1.warnings;
    for (warning, word) in warnings.iter().zip(["reflection map (refl)", "(Disp)", "(map_Ps)"]) {
        assert!(
            warning.contains(word) && warning.contains("ignored, of material 'a'"),
            "{warning}"
        );
    }
    assert_eq!(warnings.len(), 3, "{warnings:?}");
}

#[test]
fn strict_loads_refuse_textures_and_libraries_that_are_missing() {
    let strict = LoadOptions { strict: true, ..LoadOptions::default() };
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let folder = Folder::new().with("a.obj", text);
    let error = || load_with(folder.path("a.obj"), &strict).unwrap_err().to_string();
    assert!(error().contains("a.mtl"), "{}", error());
    fs::write(folder.path("a.mtl"), "newmtl a\nmap_Kd gone.png\n").unwrap();
    assert!(error().contains("gone.png"), "{}", error());
}

/// A file of two triangles, the second with a vertex at no place.
#[test]
fn vertices_at_no_place_take_their_triangles_with_them() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n0 -1.#IND 1\n3 0 1 2\n3 1 2 3\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 nan 1\nf 1 2 3\nf 2 3 4\n";
    let off = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 1e99 1\n3 0 1 2\n3 1 2 3\n";
    let stl = STL.replace("1.0e0", "-nan(ind)");
    for (name, text) in [("a.ply", ply), ("a.obj", obj), ("a.off", off), ("a.stl", &stl)] {
        let loaded = one(name, text);
        let meshes = || loaded.description.parts.iter().map(|part| &part.mesh);
        assert_eq!(meshes().map(|mesh| mesh.triangles.len()).sum::<usize>(), 1, "{name}");
        for mesh in meshes().filter(|mesh| !mesh.normals.is_empty()) {
            let corners = mesh.triangles.iter().flatten().map(|&i| mesh.normals[i as usize]);
            assert!(corners.into_iter().all(|normal| normal == Vec3::Z), "{name}");
        }
        let [warning] = &loaded.warnings[..] else { panic!("{name}: {:?}", loaded.warnings) };
        for word in [name, "not finite", "1 of 2 triangles", "left out"] {
            assert!(warning.contains(word), "'{word}' is not in: {warning}");
        }
        fails_if_strict(name, text, &["finite"]);
    }
    // Where nothing is left, the scene names the vertex.
    let obj = "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let description = load(Folder::new().with("a.obj", obj).path("a.obj")).unwrap().description;
    let error = Scene::new(description).unwrap_err().to_string();
    assert!(error.contains("vertex 0") && error.contains("non-finite"), "{error}");
}

fn close_f(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-5
}

/// 100,000 changes of material cost as many steps, and whatever is missing is told once.
#[test]
fn many_materials_are_neither_slow_nor_loud() {
    let change = |i: usize| format!("usemtl m{}\nf 1 2 3\n", i % 30_000);
    let faces = (0..100_000).map(change).collect::<Vec<_>>().concat();
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let start = std::time::Instant::now();
    let loaded = Folder::new().with("a.obj", &text).load("a.obj");
    // 44 s when every change searched all before it.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    assert_eq!((loaded.description.materials.len(), loaded.description.parts.len()), (1, 30_000));
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings.len()) };
    assert!(warning.contains("'m0', 'm1', 'm2' and 29997 more"), "{warning}");
    let material = |i: usize| format!("newmtl m{i}\nmap_Ks k.png\nmap_Kd no{i}.png\n");
    let mtl = (0..10_000).map(material).collect::<Vec<_>>().concat();
    let folder = Folder::new().with("a.mtl", mtl).with("a.obj", format!("mtllib a.mtl\n{text}"));
    let warnings = folder.load("a.obj").warnings;
    assert!(warnings.len() <= 30, "{}", warnings.len());

    // As many names, each once, and as many lines of the library.
    let faces =
        (0..100_000).map(|i| format!("usemtl n{i}\nf 1 2 3\n")).collect::<Vec<_>>().concat();
    let text = "mtllib b.mtl\n".repeat(1000) + "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + &faces;
    let library = "newmtl n7\n".to_owned() + &"map_Ks k.png\n".repeat(1000);
    let loaded = Folder::new().with("b.obj", text).with("b.mtl", library).load("b.obj");
    assert_eq!(loaded.description.parts.len(), 100_000);
    assert_eq!(loaded.warnings.len(), 2, "{:?}", loaded.warnings);
    assert!(start.elapsed().as_secs() < 40, "{:?}", start.elapsed());
}

// STL and OFF

fn binary_stl(header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend(2u32.to_le_bytes());
    for z in [0.0f32, 1.0] {
        for v in [0.0, 0.0, 0.0, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z] {
            bytes.extend(v.to_le_bytes());
        }
        bytes.extend([0xff, 0x7f]);
    }
    bytes
}

const STL: &str = "solid one of two
  facet normal 0 0 0
    outer loop
      vertex 0 0 0
      vertex 1.0e0 0 0
      vertex 0 1 0
    endloop
  endfacet
endsolid one of two
SOLID
FACET NORMAL 0 0 1
OUTER LOOP
VERTEX 0 0 1
VERTEX 1 0 1
VERTEX 0 1 1
ENDLOOP
ENDFACET
ENDSOLID
";

#[test]
fn stl_in_both_encodings() {
    for text in [STL.to_owned(), STL.replace('\n', "\r\n"), STL.replace('\n', "\r")] {
        let parts = one("two.stl", text).description.parts;
        assert_eq!(
            parts.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(),
            ["one of two", "two"]
        );
        assert_eq!(parts[1].mesh.positions, [Vec3::Z, vec3(1.0, 0.0, 1.0), vec3(0.0, 1.0, 1.0)]);
        assert_eq!(parts[0].mesh.triangles, [[0, 1, 2]]);
    }
    for header in [&b"by a scanner"[..], b"solid but binary"] {
        let parts = one("two.stl", binary_stl(header)).description.parts;
        assert_eq!((parts.len(), parts[0].mesh.triangles.len()), (1, 2));
        assert_eq!(parts[0].mesh.positions[4], vec3(1.0, 0.0, 1.0));
        assert!(parts[0].mesh.normals.is_empty(), "facets shade flat");
    }
    // Told by its content where the name tells nothing.
    assert_eq!(one("two.part", STL).description.parts.len(), 2);
}

#[test]
fn bytes_after_the_facets_of_a_binary_stl_are_no_facets() {
    let spaces = format!("{:80}", "solid but binary");
    for header in [&b"by a scanner"[..], b"solid but binary", spaces.as_bytes()] {
        let mut bytes = binary_stl(header);
        bytes.extend([0xff; 120]);
        for name in ["two.stl", "two.part"] {
            let d = one(name, &bytes).description;
            assert_eq!((d.parts.len(), d.parts[0].mesh.triangles.len()), (1, 2), "{name}");
        }
        fails("two.stl", &bytes[..150], &["2 facets", "184 bytes", "150"]);
    }
    // Whole facets beyond the header's count are missed.
    let mut bytes = binary_stl(b"by a scanner");
    bytes.extend([0; 50]);
    let loaded = one("two.stl", &bytes);
    assert!(loaded.warnings[0].contains("counts 2 facets; bytes of 1 more follow"));
    // Text stays text.
    let padded = STL.replacen("one of two", &format!("one{}", "\0".repeat(90)), 1);
    assert_eq!(one("two.stl", padded).description.parts.len(), 2);
}

#[test]
fn text_without_the_end_of_its_last_solid_may_be_truncated() {
    let cut = &STL[..STL.find("ENDSOLID").unwrap()];
    let [first, second] = [&cut[..cut.find("endsolid").unwrap()], cut];
    for (text, n_parts, line) in [(first, 1, "line 8"), (second, 2, "line 17")] {
        let loaded = one("a.stl", text);
        assert_eq!(loaded.description.parts.len(), n_parts);
        let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        for word in ["a.stl", line, "endsolid", "truncated"] {
            assert!(warning.contains(word), "'{word}' is not in: {warning}");
        }
        fails_if_strict("a.stl", text, &[line, "endsolid", "truncated", "--strict"]);
    }
    assert_eq!(one("a.stl", STL).warnings, [""; 0]);
    // The end of one solid is the beginning of the next.
    assert_eq!(one("a.stl", STL.replace("endsolid one of two\n", "")).warnings, [""; 0]);
}

#[test]
fn broken_stl_files_name_the_place() {
    fails("a.stl", STL.replace("1.0e0", "one"), &["line 5", "vertex one 0 0"]);
    fails_if_strict("a.stl", STL.replace("1.0e0", "inf"), &["line 5"]);
    fails("a.stl", STL.replace("VERTEX 0 0 1\n", ""), &["line 16", "2 vertices"]);
    fails("a.stl", &STL[..100], &["vertices"]);
    fails("a.stl", "solid nothing\nendsolid\n", &["no triangles"]);
    let whole = binary_stl(b"");
    fails("a.stl", &whole[..150], &["2 facets", "184 bytes", "150"]);
    let mut huge = whole.clone();
    huge[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    fails("a.stl", huge, &["4294967295 facets"]);
    let mut nan = whole;
    nan[84 + 50 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    fails_if_strict("a.stl", nan, &["facet 1", "NaN", "--strict"]);
}

const OFF: &str = "OFF # a pyramid
# its counts
5 5 8

0 0 0
1 0 0
1 1 0   # a corner
0 1 0
0.5 0.5 1
4 0 3 2 1
3 0 1 4
3 1 2 4
3 2 3 4
3 3 0 4
";

#[test]
fn off_and_its_variants() {
    let check = |text: &str| {
        let mesh = one("a.off", text).description.parts.remove(0).mesh;
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (5, 6), "{text}");
        assert_eq!(
            (mesh.positions[4], mesh.triangles[5]),
            (vec3(0.5, 0.5, 1.0), [3, 0, 4]),
            "{text}"
        );
        mesh
    };
    let mesh = check(OFF);
    assert!(mesh.normals.len() == 5 && mesh.colors.is_empty());
    let (_, body) = OFF.split_once("\n\n").unwrap();
    for head in ["OFF 5 5 8", "OFF5 5 8", "5 5 8", "OFF\n5 5", "\u{feff}OFF\r\n5 5 0\r"] {
        check(&format!("{head}\n{body}"));
    }
    // All in a line, and with what the header word does not name.
    check(&format!("OFF 5 5 8 {}", body.replace("   # a corner", "").replace('\n', " ")));
    check(&OFF.replace("1 0 0\n", "1 0 0 0.5 0.5 0.5\n"));
    assert_eq!(one("pyramid.mesh", OFF).description.parts.len(), 1);

    let vertices = ["0 0 0", "1 0 0", "1 1 0   # a corner", "0 1 0", "0.5 0.5 1"];
    let with = |word: &str, after: &str| {
        let line = |text: String, v: &&str| {
            text.replace(
                &format!("\n{v}\n"),
                &format!("\n{} {after}\n", &v[..v.find("  ").unwrap_or(v.len())]),
            )
        };
        vertices.iter().fold(OFF.replace("OFF #", &format!("{word} #")), line)
    };
    for rgb in ["255 188 0", "255 188 0 128", "1.0 0.735 0.0 1.0"] {
        let mesh = check(&with("COFF", rgb));
        assert_eq!(mesh.colors.len(), 5);
        assert!((mesh.colors[2] - Rgb::new(1.0, 0.5, 0.0)).map(f32::abs).max_component() < 4e-3);
    }
    let mesh = check(&with("STCNOFF", "0 0 2 1.0 0.0 0.0 1.0 0.25 0.75"));
    assert_eq!((mesh.normals[0], mesh.colors[1].g, mesh.uvs[3]), (Vec3::Z, 0.0, vec2(0.25, 0.25)));
    let mesh = one("a.off", with("4OFF", "2")).description.parts.remove(0).mesh;
    assert_eq!(mesh.positions[4], vec3(0.25, 0.25, 0.5));

    // A face with a color parts its vertices from those of others.
    let mesh =
        one("a.off", OFF.replace("3 1 2 4", "3 1 2 4 255 0 0")).description.parts.remove(0).mesh;
    let reds = mesh.colors.iter().filter(|c| **c == Rgb::new(1.0, 0.0, 0.0)).count();
    assert_eq!((mesh.positions.len(), reds, mesh.normals.len()), (8, 3, 8));
    // A concave face: the arrow head's area is 1.5.
    let arrow = "OFF 4 1 0\n0 0 0\n2 1 0\n0 2 0\n0.5 1 0\n4 0 1 2 3\n";
    let mesh = one("a.off", arrow).description.parts.remove(0).mesh;
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    assert!(mesh.triangles.iter().all(|t| area(t) > 0.0));
}

#[test]
fn broken_off_files_name_the_line() {
    fails("a.off", OFF.replace("5 5 8", "5 6 8"), &["5 of 6 faces"]);
    fails("a.off", OFF.replace("5 5 8", "18446744073709551615 5 8"), &["vertices"]);
    fails("a.off", OFF.replace("5 5 8", "5 x 8"), &["line 3", "'x'"]);
    fails("a.off", OFF.replace("OFF", "OFF BINARY"), &["line 1", "binary"]);
    fails("a.off", OFF.replace("OFF", "nOFF"), &["nOFF"]);
    fails("a.off", OFF.replace("0 1 0\n", "0 1 spam\n"), &["line 8", "spam"]);
    fails_if_strict("a.off", OFF.replace("0 1 0\n", "0 1 inf\n"), &["line 8", "inf"]);
    fails("a.off", OFF.replace("3 1 2 4", "3 1 2 5"), &["line 12", "index 5"]);
    fails("a.off", OFF.replace("3 1 2 4", "3 1 2 -1"), &["line 12", "index -1"]);
    fails("a.off", OFF.replace("3 1 2 4", "99999999999999999999 1 2 4"), &["line 12"]);
    fails("a.off", "\n", &["numbers"]);
    fails("a.off", "OFF 3 0 0\n0 0 0\n1 0 0\n0 1 0\n", &["no triangles"]);
}

#[test]
fn ply_strips_and_colored_faces() {
    let head = "ply\nformat ascii 1.0\nelement tristrips 1\nproperty list int int vertex_indices\n\
        element vertex 5\nproperty uchar blue\nproperty float z\nproperty float y\nproperty float x\n";
    let body = "9 0 1 2 3 -1 1 4 2 2\n0 0 0 0\n0 0 0 1\n0 0 1 0\n0 0 1 1\n0 0 0 2\n";
    let mesh = one("a.ply", format!("{head}end_header\n{body}")).description.parts.remove(0).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [1, 4, 2]]);
    assert_eq!(mesh.positions[4], vec3(2.0, 0.0, 0.0));
    assert!(mesh.colors.is_empty(), "one channel is no color");
    fails(
        "a.ply",
        format!("{head}end_header\n{}", body.replace("1 4 2 2", "1 5 2 2")),
        &["tristrips 0", "5"],
    );

    let float = PLY_QUAD.replace("property uchar", "property float");
    let float = float
        .replace("255 188 0", "1 0.5 nan")
        .replace("255", "1")
        .replace("float flag", "uchar flag");
    let loaded = one("a.ply", float);
    let colors = &loaded.description.parts[0].mesh.colors;
    assert_eq!(colors[..2], [Rgb::new(1.0, 0.0, 0.0); 2]);
    assert!(colors[3] == Rgb::WHITE && loaded.warnings[0].contains("1 color is NaN"));

    let colored = PLY_QUAD
        .replace(
            "property uchar flag\n",
            "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        )
        .replace(
            "property uchar red\nproperty uchar green\nproperty uchar blue\nelement",
            "element",
        )
        .replace("5 4 0 1 2 3", "0 255 0 4 0 1 2 3");
    let colored = colored
        .lines()
        .map(|line| {
            line.strip_suffix(" 255 0 0")
                .or(line.strip_suffix(" 0 255 0"))
                .or(line.strip_suffix(" 255 188 0"))
                .unwrap_or(line)
                .to_owned()
                + "\n"
        })
        .collect::<String>();
    let mesh = one("a.ply", colored).description.parts.remove(0).mesh;
    assert_eq!(mesh.colors, [Rgb::new(0.0, 1.0, 0.0); 4]);
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
    assert_eq!(d.materials.len(), 1);
    let material = &d.materials[0];
    let MaterialModel::MetallicRoughness(m) = &material.model else { panic!() };
    assert_eq!((m.metallic, m.roughness), (0.25, 0.75));
    assert_eq!(m.base_color, Rgb::new(0.5, 1.0, 1.0));
    let texture = m.base_color_texture.unwrap();
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(texture.transform.apply(Vec2::ONE), vec2(2.0, 2.0));
    assert_eq!(material.normal_map.unwrap().scale, 0.5);
    assert_eq!(d.textures.len(), 2, "one image as color and as numbers");
    let camera = d.camera.unwrap();
    assert_eq!((camera.origin, camera.up), (vec3(0.0, 0.0, 5.0), Vec3::Y));
    assert_eq!(camera.target, vec3(0.0, 0.0, 4.0));
    let degrees = 0.5f32.to_degrees();
    assert_eq!(camera.projection, Projection::Perspective { fov_y_degrees: degrees });
    assert!(material.emission.is_some());
    assert_eq!(material.coverage.mode, AlphaMode::Blend);
    assert_eq!(loaded.warnings, [""; 0], "all of it is drawn");
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
    bad(r#""componentType":5123"#, r#""componentType":5126"#, &["accessor 3", "indices"]);
    bad(r#""TEXCOORD_0":2"#, r#""TEXCOORD_0":1"#, &["accessor 1", "VEC2"]);
    bad(r#""NORMAL":1"#, r#""NORMAL":9"#, &["accessor 9", "primitive 0"]);
    bad(r#""NORMAL":1"#, r#""NORMAL":"1""#, &["mesh 0", "not valid"]);
    bad(r#""POSITION":0"#, r#""POSITION":9"#, &["accessor 9", "primitive 0"]);
    bad(r#""children":[1,2]"#, r#""children":[1,0]"#, &["node 0", "tree"]);
    bad(r#""children":[1,2]"#, r#""children":[1,1]"#, &["node 1", "tree"]);
    bad("base64,", "base64,*", &["buffer 0", "decoded"]);
    bad(r#""version":"2.0""#, r#""version":"1.0""#, &["glTF 1.0", "gltf-pipeline"]);
    bad(r#""material":0"#, r#""material":7"#, &["material 7", "only 1"]);
    let json = embedded_json();
    let lacking = json.replace("my%20paint.png", "https://example.org/x.png");
    fails_if_strict("a.gltf", lacking, &["example.org"]);
    let lacking = json.replace(r#""sampler":0"#, r#""sampler":7"#);
    fails_if_strict("a.gltf", lacking, &["material 'paint'", "sampler 7"]);
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
    let referrer = environment.referrer.as_ref().unwrap();
    assert!(referrer.ends_with("scene.toml, line 9, [environment]"), "{referrer}");

    assert_eq!(d.parts.len(), 3);
    assert!(close(d.parts[0].mesh.positions[1], vec3(10.0, 2.0, 0.0)));
    assert_eq!(d.parts[1].name, "second");
    assert_eq!(d.parts[1].mesh.positions[1], vec3(6.0, 0.0, 0.0));
    let brass = &d.materials[d.parts[0].material];
    assert_eq!(brass.name, "brass");
    assert_eq!(brass.textures().count(), 2);
    let MaterialModel::MetallicRoughness(m) = &brass.model else { panic!() };
    assert_eq!(m.base_color_texture.unwrap().transform.apply(Vec2::ONE), vec2(4.0, 4.0));
    assert!(matches!(d.materials[d.parts[1].material].model, MaterialModel::Fixed(_)));
    assert_eq!(d.materials[d.parts[2].material].name, "default");
}

#[test]
fn a_scene_files_materials_glow_and_let_through() {
    let material = |keys: &str| {
        let materials = format!("roughness = 0.25\n{keys}");
        let text = TOML.replacen("roughness = 0.25", &materials, 1);
        let d = toml_folder().with("scene.toml", text).load("scene.toml").description;
        d.materials[d.parts[0].material].clone()
    };
    let plain = material("");
    assert_eq!((plain.emission, plain.coverage), (None, Coverage::default()));
    let lamp = material("emission = [5, 0, 2.5]\nopacity = 0.5");
    assert_eq!(lamp.emission.map(|e| e.radiance), Some(Rgb::new(5.0, 0.0, 2.5)));
    assert_eq!((lamp.coverage.mode, lamp.coverage.opacity), (AlphaMode::Blend, 0.5));
    let mapped = material("emission_texture = \"brass.png\"\nopacity_texture = \"normal.png\"");
    let emission = mapped.emission.unwrap();
    assert_eq!((emission.radiance, emission.texture.is_some()), (Rgb::WHITE, true));
    assert_eq!(mapped.coverage.texture.unwrap().transform.x.x, 4.0);
}

#[test]
fn built_in_scenes_are_objects_with_a_camera() {
    let text = "[[objects]]\nbuiltin = \"sphere\"\nmaterial = \"ggx:0.3\"\ntranslate = [7, 0, 0]\n";
    let d = one("scene.toml", text).description;
    assert!(close(d.parts[0].mesh.bounds().center(), vec3(7.0, 0.0, 0.0)));
    assert!(close(d.camera.unwrap().target, vec3(7.0, 0.0, 0.0)));
    assert!(matches!(d.materials[d.parts[0].material].model, MaterialModel::Fixed(_)));
}

/// A material is the subject's; floor, probe and camera of the scene stay as they are.
#[test]
fn a_material_changes_nothing_but_the_subject() {
    let text = "[[objects]]\nbuiltin = \"material-ball\"\nmaterial = \"ggx:0.3\"\n";
    let d = one("scene.toml", text).description;
    assert!(d.environment.is_some() && d.camera.is_some() && !d.scenery.is_empty());
    for (i, part) in d.parts.iter().enumerate() {
        let fixed = matches!(d.materials[part.material].model, MaterialModel::Fixed(_));
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
    bad("roughness = 0.25", "opacity = 1.5", &["line 18", "opacity", "1.5"]);
    bad("roughness = 0.25", "emission = [0, -1, 0]", &["line 18", "emission", "-1"]);
    bad("roughness = 0.25", "rougness = 0.25", &["line 23", "`rougness`", "materials.brass"]);
    let short = &["line 19", "invalid length 2", "in materials.brass.base_color = [1, 1]"];
    bad("[0.9, 0.7, 0.3]", "[1, 1]", short);
    let word = &["line 19", "string \"red\", expected f32", "in materials.brass.base_color"];
    bad("0.9, 0.7", "\"red\", 0.7", word);
    let wrap = &["line 23", "`foo`", "`mirror`", "in materials.brass.wrap"];
    bad("roughness = 0.25", "wrap = \"foo\"", wrap);
    bad("\"diffuse:0.5\"", "0.5", &["line 16", "0.5", "ggx:0.2", "in materials.clay"]);
    bad("rotate = [0, 0, 90]", "rotate = 90", &["line 30", "90", "in objects.rotate"]);
    bad("scale = 2\n", "scale = [2, 2]\n", &["line 29", "[x, y, z]", "objects.scale = [2, 2]"]);
    bad("brass.png", "gone.png", &["gone.png", "brass", "line 18"]);
    bad("quad.ply", "gone.ply", &["gone.ply", "line 26"]);
    bad("quad.ply", "scene.toml", &["scene.toml"]);
    bad("file = \"quad.ply\"", "builtin = \"unicorn\"", &["unicorn", "line 26"]);
    bad("material = \"brass\"", "material = \"brss\"", &["brss", "line 26"]);
    bad("scale = 2\n", "scale = 0\n", &["line 26", "inverted"]);
    bad("scale = 2\n", "scale = nan\n", &["line 26", "inverted"]);
    bad("[0, 0, 0, 1]]", "[0, 0, 1, 1]]", &["line 33", "last row"]);
    bad("name = \"second\"", "name = \"second\"\nscale = 2", &["matrix"]);
    bad("[camera]", "[camera", &["line 4"]);
    fails("a.toml", [0x61, 0xff], &["UTF-8", "byte 1"]);
    fails("a.toml", "# nothing\n", &["no triangles"]);
}

// Any format

#[test]
fn files_that_are_none() {
    let folder = Folder::new().with("a.fbx", "solid or not").with("odd.obj", PLY_QUAD);
    assert!(folder.error("missing.ply").contains("missing.ply"));
    let folder = folder.with("b.fbx", "Kaydara");
    assert!(folder.error("b.fbx").contains(".glb"));
    assert!(folder.error("a.fbx").contains("no triangles"));
    fs::create_dir(folder.path("folder.obj")).unwrap();
    assert!(folder.error("folder.obj").contains("folder.obj"));
    assert_eq!(folder.load("odd.obj").description.parts[0].mesh.triangles.len(), 2);
}

#[test]
fn sixteen_bit_and_gray_textures_load() {
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
        ("g.stl", STL.as_bytes().to_vec()),
        ("h.stl", binary_stl(b"")),
        ("i.off", OFF.as_bytes().to_vec()),
        (
            "j.off",
            OFF.replace("OFF #", "STCN4OFF #")
                .replace(" 0\n", " 0 1 0 0 1 9 9 9 9 0 0\n")
                .into_bytes(),
        ),
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

/// What is no material library is not shown, and one that is may still be wrong.
#[test]
fn other_files_are_nobodys_business() {
    let secret = "root:x:0:0:root:/root:/bin/bash\n";
    let mesh = "mtllib ../secret.txt\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = "[[objects]]\nfile = \"secret.ply\"\n";
    let folder = Folder::new().with("secret.txt", secret).with("secret.ply", secret);
    fs::create_dir(folder.path("sub")).unwrap();
    let folder = folder.with("sub/mesh.obj", mesh).with("scene.toml", scene);
    let loaded = folder.load("sub/mesh.obj");
    let text = loaded.warnings.join("\n");
    assert!(text.contains("not a material library") && !text.contains("root:"), "{text}");
    assert!(text.contains("outside of its folder"), "{text}");
    assert_eq!(loaded.files.len(), 1);
    let error = folder.error("scene.toml");
    assert!(error.contains("secret.ply") && !error.contains("root:"), "{error}");

    let folder = folder.with("nested.toml", "[[objects]]\nfile = \"scene.toml\"\n");
    let error = folder.error("nested.toml");
    assert!(error.contains("scene.toml, which") && error.contains("is a scene file"), "{error}");

    let confined = LoadOptions { reach: Reach::OwnFolder, ..LoadOptions::default() };
    let error = load_with(folder.path("sub/mesh.obj"), &confined).unwrap_err().to_string();
    assert!(error.contains("outside of the scene's folder"), "{error}");
    let folder = folder.with("sub/inside.obj", mesh.replace("../secret.txt", "a.mtl"));
    let folder = folder.with("sub/a.mtl", "newmtl a\nKd 1 0 0\n");
    let loaded = load_with(folder.path("sub/inside.obj"), &confined).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.txt", folder.path("sub/link.mtl")).unwrap();
        let folder = folder.with("sub/link.obj", mesh.replace("../secret.txt", "link.mtl"));
        assert!(load_with(folder.path("sub/link.obj"), &confined).is_err());
    }
}
