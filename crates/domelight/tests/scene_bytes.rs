//! Scenes and light probes from bytes are those from files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use domelight::environment::Environment;
use domelight::math::vec3;
use domelight::picture::{hdr, pfm};
use domelight::render::{Layers, RenderSettings, Renderer};
use domelight::scene::{
    Camera, EnvironmentSource, LoadError, LoadOptions, Reach, Scene, SceneDescription, SceneError,
    SceneFormat, load, load_bytes,
};
use domelight::{Error, Rgb, RgbImage};

/// Files in a folder of the file system; what reads them from bytes sees none of it.
struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    fn new(files: &[(&str, Vec<u8>)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// What a caller without a file system would do.
    fn resolve(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(self.folder.path().join(path))
    }
}

/// Both ways give the same scene, with as many warnings.
fn assert_same(files: &Files, name: &str) {
    let from_file = load(files.path(name)).unwrap();
    let bytes = fs::read(files.path(name)).unwrap();
    let resolver = |path: &Path| files.resolve(path);
    let from_bytes = load_bytes(name, &bytes, &resolver, &LoadOptions::default()).unwrap();
    let fingerprint =
        |description: SceneDescription| Scene::new(description).unwrap().fingerprint().to_string();
    assert_eq!(from_file.warnings.len(), from_bytes.warnings.len());
    assert_eq!(from_file.files.len(), from_bytes.files.len());
    assert_eq!(fingerprint(from_file.description), fingerprint(from_bytes.description), "{name}");
    let format = SceneFormat::of(Path::new(name), &bytes).unwrap();
    let folder = Path::new(name).parent().unwrap();
    let beside = |path: &Path| files.resolve(&folder.join(path));
    let scene = Scene::from_bytes(&bytes, format, &beside).unwrap();
    assert!(scene.triangle_count() > 0);
}

/// A picture of four colors; the loaders read it as a texture.
fn tga() -> Vec<u8> {
    let mut bytes = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 24, 0];
    bytes.extend((0..12u8).map(|i| 20 * i));
    bytes
}

fn positions() -> Vec<u8> {
    let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let uvs = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0]];
    corners.iter().flatten().chain(uvs.iter().flatten()).flat_map(|x| x.to_le_bytes()).collect()
}

/// A textured triangle; its buffer has `uri`, or is the file's own.
fn gltf(uri: Option<&str>) -> String {
    let buffer = uri.map(|uri| format!(r#","uri":"{uri}""#)).unwrap_or_default();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
"textures":[{{"source":0}}],"images":[{{"uri":"my%20textures/wood.tga"}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
{{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}],
"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],
"buffers":[{{"byteLength":60{buffer}}}]}}"#
    )
}

fn glb() -> Vec<u8> {
    let mut json = gltf(None).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = positions();
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut bytes = b"glTF".to_vec();
    bytes.extend(word(2));
    bytes.extend(word(12 + 8 + json.len() + 8 + binary.len()));
    bytes.extend(word(json.len()));
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(word(binary.len()));
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

#[test]
fn bytes_give_the_scene_of_the_files() {
    let files = Files::new(&[
        ("models/a.gltf", gltf(Some("a%20b.bin")).into_bytes()),
        ("models/a b.bin", positions()),
        ("models/my textures/wood.tga", tga()),
        ("models/b.glb", glb()),
        ("a.obj", b"mtllib my materials.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl wood\nf 1/1 2/1 3/1\n".to_vec()),
        ("my materials.mtl", b"newmtl wood\nmap_Kd models\\.\\my textures/wood.tga\n".to_vec()),
        ("a.ply", PLY.into()),
        ("scene.toml", b"[[objects]]\nfile = \"models/../a.ply\"\n[[objects]]\nfile = \"a.obj\"\n".to_vec()),
    ]);
    for name in ["models/a.gltf", "models/b.glb", "a.obj", "a.ply", "scene.toml"] {
        assert_same(&files, name);
    }
}

/// Meshes of any unit of length have the same picture; bounds, cameras and depths are in that unit.
#[test]
fn scenes_of_any_size_are_traced_at_a_usual_one() {
    let environment = Environment::constant(Rgb::WHITE).unwrap();
    let settings =
        RenderSettings { width: 24, height: 20, n_samples: 8, ..RenderSettings::default() };
    let layers = |scale: f32| {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0], [0.0, 0.0, 1.0]];
        let vertex = |c: [f32; 3]| {
            let [x, y, z] = c.map(|x| x * scale);
            format!("v {x:e} {y:e} {z:e}\n")
        };
        let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let obj: String = corners.map(vertex).concat() + faces;
        let files = Files::new(&[("a.obj", obj.into_bytes())]);
        let bytes = fs::read(files.path("a.obj")).unwrap();
        let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
        let scenes = [
            Scene::load(files.path("a.obj")).unwrap(),
            Scene::from_bytes(&bytes, SceneFormat::Obj, &nothing).unwrap(),
        ];
        let [layers, of_bytes] = scenes.map(|scene| {
            assert_eq!(scene.bounds().max, vec3(2.0, 1.5, 1.0) * scale, "{scale:e}");
            let camera = Camera::framing(&scene, settings.width, settings.height);
            let spec = "mis".parse().unwrap();
            let renderer = Renderer::new(&scene, &camera, &environment, spec, settings);
            renderer.unwrap().finish().layers()
        });
        assert!(layers.color == of_bytes.color && layers.depth == of_bytes.depth);
        layers
    };
    let usual = layers(1.0);
    let mean =
        |layers: &Layers| layers.color.pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>();
    let depth = |layers: &Layers| layers.depth.iter().map(|&d| f64::from(d)).sum::<f64>();
    assert!(depth(&usual) > 100.0);
    for scale in [1e-17, 1e-12, 1e-6, 1e-2, 1e2, 1e6, 1e10, 1e17] {
        let layers = layers(scale);
        let ratio = mean(&layers) / mean(&usual);
        assert!((ratio - 1.0).abs() < 2e-3, "{scale:e}: {ratio}");
        let ratio = depth(&layers) / f64::from(scale) / depth(&usual);
        assert!((ratio - 1.0).abs() < 1e-2, "{scale:e}: depth {ratio}");
    }
    for scale in [1e-19, 1e19] {
        let vertices = format!("v 0 0 0\nv {scale:e} 0 0\nv 0 {scale:e} 0\nf 1 2 3\n");
        let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
        let error = Scene::from_bytes(vertices.as_bytes(), SceneFormat::Obj, &nothing).unwrap_err();
        assert!(matches!(error, Error::Scene(SceneError::Size { .. })), "{error}");
    }
}

#[test]
fn missing_files_are_named() {
    let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
    let gltf = gltf(Some("a.bin"));
    let options = LoadOptions::default();
    let error = load_bytes("robot.gltf", gltf.as_bytes(), &nothing, &options).unwrap_err();
    assert!(matches!(error, LoadError::ReadReferenced { .. }), "{error}");
    assert!(error.to_string().contains("a.bin, which robot.gltf, buffer 0, refers to"), "{error}");
    let error = Scene::from_bytes(b"nothing", SceneFormat::Ply, &nothing).unwrap_err();
    assert!(matches!(error, Error::Load(LoadError::Ply { .. })), "{error}");
    let error = load_bytes("a.blend", b"BLENDER", &nothing, &options).unwrap_err();
    assert!(matches!(error, LoadError::UnknownFormat { .. }));
}

/// What reads a file named `-` reads standard input, which no scene file may ask for.
#[test]
fn a_probe_of_a_scene_file_is_never_standard_input() {
    let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
    for (name, file, expected) in
        [("a.toml", "-", "./-"), ("a.toml", "-/.", "./-"), ("b/a.toml", "-", "b/-")]
    {
        let text = format!("[environment]\nfile = \"{file}\"\n[[objects]]\nbuiltin = \"sphere\"\n");
        let loaded = load_bytes(name, text.as_bytes(), &nothing, &LoadOptions::default()).unwrap();
        let environment = loaded.description.environment.unwrap();
        assert_eq!(environment.source, EnvironmentSource::File(expected.into()), "{file}");
    }
}

#[test]
fn files_outside_are_refused_before_they_are_asked_for() {
    let asked = |path: &Path| {
        assert_ne!(path.file_name().unwrap(), "secret.bin");
        Err(io::ErrorKind::NotFound.into())
    };
    let gltf = gltf(Some("../secret.bin"));
    let options = LoadOptions { reach: Reach::OwnFolder, ..LoadOptions::default() };
    for name in ["robot.gltf", "models/robot.gltf"] {
        let error = load_bytes(name, gltf.as_bytes(), &asked, &options).unwrap_err();
        assert!(matches!(error, LoadError::Outside { .. }), "{error}");
    }
}

#[test]
fn memory_is_limited_for_bytes_too() {
    let options = LoadOptions { max_memory: Some(20), ..LoadOptions::default() };
    let nothing = |_: &Path| Err(io::ErrorKind::NotFound.into());
    let error = load_bytes("a.ply", PLY.as_bytes(), &nothing, &options).unwrap_err();
    assert!(matches!(error, LoadError::Memory { .. }), "{error}");
}

#[test]
fn probes_from_bytes_are_those_from_files() {
    let image = RgbImage::from_fn(8, 4, |x, y| Rgb::new(x as f32, y as f32, 0.5));
    let (mut as_pfm, mut as_hdr) = (Vec::new(), Vec::new());
    pfm::encode(&image, &mut as_pfm).unwrap();
    hdr::encode(&image, &mut as_hdr).unwrap();
    let files = Files::new(&[("a.pfm", as_pfm.clone()), ("a.hdr", as_hdr.clone())]);
    for (name, bytes) in [("a.pfm", as_pfm), ("a.hdr", as_hdr)] {
        let from_file = Environment::load(files.path(name)).unwrap();
        assert_eq!(Environment::from_bytes(&bytes).unwrap().map(), from_file.map());
    }
    assert!(matches!(Environment::from_bytes(b"no map").unwrap_err(), Error::Probe(_)));
}
