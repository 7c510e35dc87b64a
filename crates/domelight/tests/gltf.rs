//! glTF as the world writes it: extensions, animations, cameras, and files that are odd but meant.
#![cfg(feature = "io")]

use std::fs;
use std::path::PathBuf;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use domelight::Rgb;
use domelight::bsdf::{self, Brdf, Bsdf, Coat, MetallicRoughness};
use domelight::geometry::Ray;
use domelight::math::{Vec2, Vec3, vec2, vec3};
use domelight::scene::{
    AlphaMode, AnimationTime, Coverage, LoadOptions, Loaded, Material, MaterialModel, Scene,
    TextureFilter, Wrap, load_with,
};
use domelight::strategy::ShadingPoint;
use tempfile::TempDir;

/// Bytes that accessors look into: a triangle's positions, and three times two, four and one number.
fn data() -> Vec<u8> {
    let floats: [f32; 30] = [
        0., 0., 0., 1., 0., 0., 0., 1., 0., // 0: positions
        0., 1., 1., 1., 0., 0., // 36: texture coordinates
        1., 0.5, 0.25, 1., 1., 0.5, 0.25, 0.5, 1., 0.5, 0.25, 0., // 60: colors
        0., 1., 2., // 108: times
    ];
    floats.iter().flat_map(|f| f.to_le_bytes()).collect()
}

/// A document of one triangle, with more in its JSON and in its primitive; `data` as a view of bytes 0 to 120.
fn document(more: &str, primitive: &str) -> String {
    let data = STANDARD.encode(data());
    let scene = if more.contains("\"nodes\"") {
        ""
    } else {
        r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"#
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},{scene}{more}
"meshes":[{{"name":"tri","primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":1,"COLOR_0":2{primitive}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
 {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC2"}},
 {{"bufferView":0,"byteOffset":60,"componentType":5126,"count":3,"type":"VEC4"}},
 {{"bufferView":0,"byteOffset":108,"componentType":5126,"count":3,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":120}}],
"buffers":[{{"byteLength":120,"uri":"data:;base64,{data}"}}]}}"#
    )
}

struct File {
    _folder: TempDir,
    path: PathBuf,
}

fn file(json: &str) -> File {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    fs::write(&path, json).unwrap();
    File { _folder: folder, path }
}

fn loaded_with(json: &str, options: &LoadOptions) -> Loaded {
    let loaded = load_with(&file(json).path, options).unwrap_or_else(|e| panic!("{e}"));
    Scene::new(loaded.description.clone()).unwrap();
    loaded
}

fn loaded(json: &str) -> Loaded {
    loaded_with(json, &LoadOptions::default())
}

fn error_with(json: &str, options: &LoadOptions) -> String {
    load_with(&file(json).path, options).unwrap_err().to_string()
}

fn error(json: &str) -> String {
    error_with(json, &LoadOptions::default())
}

fn strict() -> LoadOptions {
    LoadOptions { strict: true, ..LoadOptions::default() }
}

fn has(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "'{word}' is not in: {text}");
    }
}

/// A picture of 2 × 2 texels, as a data URI.
fn image(format: image::ImageFormat, rgba: [u8; 4]) -> String {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_pixel(2, 2, image::Rgba(rgba));
    image.write_to(&mut bytes, format).unwrap();
    format!("data:image/x;base64,{}", STANDARD.encode(bytes.into_inner()))
}

fn png(rgba: [u8; 4]) -> String {
    image(image::ImageFormat::Png, rgba)
}

/// The surface of a material, with images that are textures of their own.
fn material(bsdf: &str, images: &[String]) -> (Material, Loaded) {
    let uris: Vec<_> = images.iter().map(|uri| format!(r#"{{"uri":"{uri}"}}"#)).collect();
    let textures: Vec<_> =
        (0..images.len()).map(|i| format!(r#"{{"source":{i},"sampler":0}}"#)).collect();
    let more = format!(
        r#""materials":[{bsdf}],"images":[{}],"textures":[{}],"samplers":[{{"magFilter":9728,"wrapT":33071}}],"#,
        uris.join(","),
        textures.join(",")
    );
    let loaded = loaded(&document(&more, r#"},"material":0"#));
    (loaded.description.materials[0].clone(), loaded)
}

#[test]
fn coverage_comes_from_factor_texture_and_vertices() {
    let bsdf = r#"{"alphaMode":"MASK","alphaCutoff":0.25,"doubleSided":true,"pbrMetallicRoughness":
{"baseColorFactor":[1,1,1,0.75],"baseColorTexture":{"index":0,"texCoord":1}}}"#;
    let (material, of_mask) = material(bsdf, &[png([255, 0, 0, 51])]);
    assert_eq!(material.coverage.mode, AlphaMode::Mask { cutoff: 0.25 });
    assert_eq!(material.coverage.opacity, 0.75);
    assert!(material.double_sided);
    let texture = material.coverage.texture.unwrap();
    assert_eq!(
        (texture.filter, texture.wrap),
        (TextureFilter::Nearest, [Wrap::Repeat, Wrap::Clamp])
    );
    let image = &of_mask.description.textures[texture.texture];
    let alpha = image.sample_alpha(vec2(0.5, 0.5), texture.wrap, texture.filter);
    assert!((alpha - 0.2).abs() < 1e-6);
    assert_eq!(of_mask.description.parts[0].mesh.alphas, [1.0, 0.5, 0.0]);
    assert!(of_mask.warnings.is_empty(), "{:?}", of_mask.warnings);

    // Opaque, alpha does not count.
    let (material, opaque) =
        self::material(&bsdf.replace("MASK", "OPAQUE"), &[png([255, 0, 0, 51])]);
    assert_eq!(material.coverage, Coverage::default());
    assert!(opaque.description.parts[0].mesh.alphas.is_empty());
    assert!(!opaque.description.textures[0].has_alpha());
    assert!(opaque.warnings.is_empty(), "{:?}", opaque.warnings);
}

#[test]
fn two_sets_of_texture_coordinates_and_no_third() {
    let white = || png([255; 4]);
    let bsdf = r#"{"name":"m","normalTexture":{"index":1,"texCoord":1,"extensions":
{"KHR_texture_transform":{"texCoord":0,"offset":[0.5,0]}}},"emissiveFactor":[1,1,1],"emissiveTexture":{"index":1,"texCoord":7},
"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}}}"#;
    let (material, loaded) = material(bsdf, &[white(), white()]);
    let MaterialModel::MetallicRoughness(m) = &material.model else { panic!() };
    assert_eq!(m.base_color_texture.unwrap().uv_set, 0, "the first that is used");
    let normal = material.normal_map.unwrap().texture;
    assert_eq!((normal.uv_set, normal.transform.offset), (1, vec2(0.5, 0.0)));
    assert_eq!(material.emission, None, "without its map all of it would glow");
    let mesh = &loaded.description.parts[0].mesh;
    assert_eq!((mesh.uvs.len(), mesh.uvs2.len(), mesh.tangents.len()), (3, 3, 3));
    assert_eq!(mesh.uvs2[0], Vec2::Y);
    has(&loaded.warnings.join("\n"), &["'m'", "more than two sets"]);
}

#[test]
fn extensions_of_materials_are_kept_and_named_once_if_approximated() {
    let bsdf = r#"{"name":"all","emissiveFactor":[1,0.5,0],"extensions":{
"KHR_materials_emissive_strength":{"emissiveStrength":4},"KHR_materials_unlit":{},"KHR_materials_ior":{"ior":1.3},
"KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[2,1,0]},
"KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.25,"clearcoatNormalTexture":{"index":0,"scale":2}},
"KHR_materials_sheen":{"sheenColorFactor":[0.5,0.5,0.5],"sheenRoughnessFactor":0.3},
"KHR_materials_anisotropy":{"anisotropyStrength":0.6,"anisotropyRotation":1.5},
"KHR_materials_transmission":{"transmissionFactor":0.9},
"KHR_materials_volume":{"thicknessFactor":2,"attenuationColor":[0.5,0.6,0.7]}}}"#;
    let (material, loaded) = material(bsdf, &[png([255; 4])]);
    assert_eq!(material.emission.unwrap().radiance, Rgb::new(4.0, 2.0, 0.0));
    assert!(material.unlit && !material.double_sided);
    let layers = &material.layers;
    assert_eq!(layers.ior, Some(1.3));
    assert!((layers.dielectric_f0() - 0.017_013_2).abs() < 1e-6);
    let specular = layers.specular.unwrap();
    assert_eq!((specular.strength.value, specular.color.value), (0.5, Rgb::new(2.0, 1.0, 0.0)));
    let coat = layers.clearcoat.unwrap();
    assert_eq!((coat.strength.value, coat.roughness.value), (0.5, 0.25));
    assert_eq!(coat.normal_map.unwrap().scale, 2.0);
    assert_eq!(layers.sheen.unwrap().roughness.value, 0.3);
    assert_eq!(layers.anisotropy.unwrap().rotation, 1.5);
    assert_eq!(layers.transmission.unwrap().value, 0.9);
    let volume = layers.volume.unwrap();
    assert_eq!((volume.thickness.value, volume.attenuation_distance), (2.0, f32::INFINITY));
    assert_eq!(material.textures().count(), 1);
    let unlit: Vec<_> = material.approximated_features().collect();
    assert!(unlit.is_empty(), "nothing of an unlit surface is drawn but its color: {unlit:?}");
    let lit = Material { unlit: false, ..material };
    let features: Vec<_> = lit.approximated_features().collect();
    assert_eq!(features, ["KHR_materials_transmission", "KHR_materials_volume"]);
    assert!(loaded.warnings.is_empty());
    let glass = r#"{"name":"glass","extensions":{"KHR_materials_transmission":{"transmissionFactor":0.9}}}"#;
    let (_, loaded) = self::material(glass, &[]);
    assert_eq!(loaded.warnings.len(), 1, "{:?}", loaded.warnings);
    has(&loaded.warnings[0], &["KHR_materials_transmission", "'glass'", "approximated"]);
    // What an extension leaves as it is, is not named.
    let plain = r#"{"extensions":{"KHR_materials_ior":{"ior":1.5},"KHR_materials_specular":{},"KHR_materials_clearcoat":{}}}"#;
    let (material, loaded) = self::material(plain, &[]);
    assert_eq!(material.approximated_features().count(), 0);
    assert!(loaded.warnings.is_empty());
}

/// Each is named once, and not where a factor of zero disables it.
#[test]
fn extensions_that_are_not_drawn_are_named() {
    let of = |factor: f32| {
        let surface = |name: &str| {
            format!(
                r#"{{"name":"{name}","extensions":{{"KHR_materials_iridescence":{{"iridescenceFactor":{factor}}},
"KHR_materials_dispersion":{{"dispersion":{factor}}},
"KHR_materials_diffuse_transmission":{{"diffuseTransmissionFactor":{factor}}}}}}}"#
            )
        };
        let used = ["iridescence", "dispersion", "diffuse_transmission"]
            .map(|name| format!("\"KHR_materials_{name}\""))
            .join(",");
        let more = format!(
            r#""extensionsUsed":[{used}],"materials":[{},{}],"#,
            surface("a"),
            surface("b")
        );
        let triangles = r#"},"material":0},{"attributes":{"POSITION":0},"material":1"#;
        loaded(&document(&more, triangles)).warnings
    };
    let warnings = of(0.5);
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    for (warning, name) in
        warnings.iter().zip(["diffuse_transmission", "dispersion", "iridescence"])
    {
        has(warning, &[&format!("KHR_materials_{name}"), "'a'", "1 more", "not shown"]);
    }
    assert!(of(0.0).is_empty(), "{:?}", of(0.0));
}

/// Rounding between vertices does not take a constant opacity below a cutoff that it reaches.
#[test]
fn an_opacity_at_the_cutoff_is_kept() {
    let bsdf = r#"{"alphaMode":"MASK","alphaCutoff":0.3,"doubleSided":true}"#;
    let (_, loaded) = material(bsdf, &[]);
    let mut description = loaded.description;
    description.parts[0].mesh.alphas = vec![0.3; 3];
    let scene = Scene::new(description).unwrap();
    for i in 0..2000u32 {
        let [x, y] = [0.618, 0.755].map(|step: f32| (step * i as f32).fract());
        let at = if x + y < 1.0 { vec3(x, y, 0.0) } else { vec3(1.0 - x, 1.0 - y, 0.0) };
        let ray = Ray::new(at * 0.99 + vec3(0.003, 0.003, 1.0), -Vec3::Z);
        assert!(scene.camera_hit(&ray, u64::from(i), 0).is_some(), "{at}");
    }
}

/// A normal map that an exporter turns with its image shows the same bumps: the slope points where the turned image has it.
#[test]
fn bumps_stay_bumps_in_a_turned_image() {
    let bsdf = |rotation: f32| {
        format!(
            r#"{{"normalTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"rotation":{rotation},
"offset":[1,1]}}}}}}}}"#
        )
    };
    let images = [png([140, 128, 250, 255])];
    let plain = shaded(&bsdf(0.0), &images).frame.z;
    assert!(plain.x > 0.05 && plain.y.abs() < 0.01, "{plain}");
    let turned = shaded(&bsdf(std::f32::consts::PI), &images).frame.z;
    assert!((turned - vec3(-plain.x, -plain.y, plain.z)).length() < 1e-5, "{turned}");
}

/// The point of the triangle of [`document`] that a viewer sees at 60°, with its material. Its vertices are (1, ½, ¼).
fn shaded(bsdf: &str, images: &[String]) -> ShadingPoint {
    let (_, loaded) = material(bsdf, images);
    let scene = Scene::new(loaded.description).unwrap();
    let ray = Ray::new(vec3(0.25 + 3f32.sqrt(), 0.25, 1.0), vec3(-3f32.sqrt(), 0.0, -1.0) / 2.0);
    let hit = scene.bvh().closest_hit(&ray).expect("the triangle");
    scene.shading_point(&ray, &hit)
}

const VERTEX_COLOR: Rgb = Rgb::new(1.0, 0.5, 0.25);

/// A BSDF looks like another from the viewer's side; 8-bit textures leave a little room.
fn assert_alike(point: &ShadingPoint, expected: &Bsdf) {
    assert_eq!(point.bsdf.lobes().count(), expected.lobes().count());
    for (x, y) in [(0.0, 0.0), (-0.5, 0.3), (0.2, -0.7), (0.6, 0.1), (-0.8, -0.1)] {
        let wi = vec3(x, y, f32::sqrt(1.0 - x * x - y * y));
        let (value, expected) = (point.bsdf.eval(point.wo, wi), expected.eval(point.wo, wi));
        let difference = (value - expected).map(f32::abs).max_component();
        assert!(difference < 1e-3 * expected.max_component(), "{wi}: {value:?} {expected:?}");
    }
}

#[test]
fn specular_strength_and_color_are_drawn() {
    let bsdf = r#"{"pbrMetallicRoughness":{"metallicFactor":0.25,"roughnessFactor":0.5},"extensions":{
"KHR_materials_ior":{"ior":2},"KHR_materials_specular":{"specularFactor":0.8,"specularTexture":{"index":0},
"specularColorFactor":[3,2,1],"specularColorTexture":{"index":1}}}}"#;
    let images = [png([0, 0, 0, 51]), png([255, 255, 0, 255])];
    let (read, loaded) = material(bsdf, &images);
    let specular = read.layers.specular.unwrap();
    assert_eq!((specular.strength.value, specular.color.value), (0.8, Rgb::new(3.0, 2.0, 1.0)));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let f0 = Rgb::new(3.0, 2.0, 0.0) / 9.0;
    let lobe = MetallicRoughness::with_specular(VERTEX_COLOR, 0.25, 0.5, f0, 0.8 * 0.2);
    assert_alike(&shaded(bsdf, &images), &Bsdf::single(lobe));
    let ordinary = MetallicRoughness::with_dielectric(VERTEX_COLOR, 0.25, 0.5, 1.0 / 9.0);
    let bsdf = bsdf.replace("KHR_materials_specular", "none");
    assert_alike(&shaded(&bsdf, &images), &Bsdf::single(ordinary));
}

#[test]
fn coats_and_sheen_are_drawn() {
    let bsdf = r#"{"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":0.8,"clearcoatTexture":{"index":0},
"clearcoatRoughnessFactor":0.5,"clearcoatRoughnessTexture":{"index":0}},
"KHR_materials_sheen":{"sheenColorFactor":[0.2,0.4,0.8],"sheenColorTexture":{"index":1},"sheenRoughnessFactor":0.5,
"sheenRoughnessTexture":{"index":1}}},"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.5}}"#;
    let images = [png([51, 204, 0, 255]), png([255, 0, 255, 153])];
    let (_, loaded) = material(bsdf, &images);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let base = MetallicRoughness::new(VERTEX_COLOR, 0.0, 0.5);
    let sheen = bsdf::Sheen::new(Rgb::new(0.2, 0.0, 0.8), 0.5 * 0.6);
    let roughness = 0.5 * 0.8;
    let coat = Coat::new(roughness * roughness, Vec3::Z);
    let point = shaded(bsdf, &images);
    let expected = Bsdf::layered(base, Some(sheen), Some((0.8 * 0.2, coat)), point.wo);
    assert_alike(&point, &expected);
}

/// A coat follows the surface where the layer below has relief, and the relief of its own.
#[test]
fn coats_have_normals_of_their_own() {
    let normal = |red| png([red, 128, 230, 255]);
    let bsdf = |coat: &str| {
        format!(
            r#"{{"normalTexture":{{"index":0}},"extensions":{{"KHR_materials_clearcoat":{{"clearcoatFactor":1,
"clearcoatRoughnessFactor":0.3{coat}}}}}}}"#
        )
    };
    let mirror = |normal: Vec3, point: &ShadingPoint| {
        let n = point.frame.to_local(normal.normalize());
        2.0 * n.dot(point.wo) * n - point.wo
    };
    let coat_of = |point: &ShadingPoint| {
        let coat = point.bsdf.lobes().map(|(_, lobe)| *lobe);
        coat.into_iter().find(|lobe| matches!(lobe, bsdf::Lobe::Coat(_))).expect("a coat")
    };
    let images = [normal(180), normal(128)];
    let plain = shaded(&bsdf(""), &images);
    let relief = shaded(&bsdf(r#","clearcoatNormalTexture":{"index":0}"#), &images);
    assert!(plain.frame.z.z < 0.99, "the layer below has relief");
    let (straight, bent) = (mirror(Vec3::Z, &plain), mirror(plain.frame.z, &plain));
    let at = |point: &ShadingPoint, wi: Vec3| coat_of(point).eval(point.wo, wi).r;
    assert!(at(&plain, straight) > 2.0 * at(&plain, bent));
    assert!(at(&relief, bent) > 2.0 * at(&relief, straight));
}

#[test]
fn anisotropy_is_drawn_along_its_direction() {
    let bsdf = |rotation: f32, texture: &str| {
        format!(
            r#"{{"pbrMetallicRoughness":{{"roughnessFactor":0.4}},"extensions":{{"KHR_materials_anisotropy":{{
"anisotropyStrength":0.8,"anisotropyRotation":{rotation}{texture}}}}}}}"#
        )
    };
    let lobe = MetallicRoughness::new(VERTEX_COLOR, 1.0, 0.4);
    let images = [png([128, 255, 128, 255])];
    let point = shaded(&bsdf(0.0, ""), &images);
    assert_alike(&point, &Bsdf::single(lobe.anisotropic(0.8)));
    let along = point.frame.x;
    // A quarter turn, by a number and by a texture of half the strength.
    let turned = shaded(&bsdf(std::f32::consts::FRAC_PI_2, ""), &images);
    let texture = r#","anisotropyTexture":{"index":0}"#;
    let by_texture = shaded(&bsdf(0.0, texture), &images);
    assert!(turned.frame.x.dot(along).abs() < 1e-5);
    assert!(by_texture.frame.x.dot(along).abs() < 0.01);
    assert!(turned.frame.x.dot(by_texture.frame.x) > 0.99);
    assert_alike(&by_texture, &Bsdf::single(lobe.anisotropic(0.8 * 128.0 / 255.0)));
    let half = shaded(&bsdf(0.5, ""), &images);
    assert!((half.frame.x.dot(along) - 0.5f32.cos()).abs() < 1e-5);
}

#[test]
fn specular_and_glossiness_are_drawn() {
    let bsdf = r#"{"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.5,0.5,1],
"specularFactor":[0.2,0.2,0.2],"glossinessFactor":0.8,"specularGlossinessTexture":{"index":0}}}}"#;
    let (material, loaded) = material(bsdf, &[png([255, 255, 255, 128])]);
    let MaterialModel::SpecularGlossiness(s) = &material.model else { panic!() };
    assert_eq!((s.diffuse, s.specular, s.glossiness), (Rgb::splat(0.5), Rgb::splat(0.2), 0.8));
    assert!(loaded.description.textures[0].has_alpha() && loaded.warnings.is_empty());
}

/// The older model's picture of a dielectric is that of the newer one with the same reflectance.
#[test]
fn specular_glossiness_looks_like_metallic_roughness() {
    let older = r#"{"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.25,0.125,1],
"specularFactor":[0.04,0.04,0.04],"glossinessFactor":0.75,"specularGlossinessTexture":{"index":0}}}}"#;
    let images = [png([255, 255, 255, 204])];
    let diffuse = Rgb::new(0.5, 0.25, 0.125) * VERTEX_COLOR;
    let expected = MetallicRoughness::new(diffuse, 0.0, 1.0 - 0.75 * 0.8);
    let point = shaded(older, &images);
    for (x, y) in [(0.0, 0.0), (-0.5, 0.3), (0.2, -0.7), (-0.8, -0.1)] {
        let wi = vec3(x, y, f32::sqrt(1.0 - x * x - y * y));
        let (value, expected) = (point.bsdf.eval(point.wo, wi), expected.eval(point.wo, wi));
        // The older model scales its diffuse part by 1 - 0.04, the newer one by what is reflected.
        assert!((value - expected).map(f32::abs).max_component() < 0.05 * expected.max_component());
    }
}

/// A mirrored node turns its triangles round: its front stays where its normals point, for single-sided materials, too.
#[test]
fn mirrored_nodes_keep_their_front() {
    for (scale, side) in [("[1,1,1]", 1.0), ("[-1,1,1]", 1.0), ("[1,1,-1]", -1.0)] {
        let more = format!(r#""scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0,"scale":{scale}}}],"#);
        let scene = Scene::new(loaded(&document(&more, "}")).description).unwrap();
        let x = if scale == "[-1,1,1]" { -0.25 } else { 0.25 };
        let sees = |z: f32| {
            let ray = Ray::new(vec3(x, 0.25, z), vec3(0.0, 0.0, -z));
            scene.camera_hit(&ray, 0, 0).is_some()
        };
        assert!(sees(side) && !sees(-side), "{scale}");
    }
}

/// The first bytes of an AVIF file.
const AVIF: &str = "data:;base64,AAAAIGZ0eXBhdmlmAAAAAA==";

#[test]
fn images_of_webp_are_read_and_avif_is_named() {
    let webp = image(image::ImageFormat::WebP, [0, 255, 0, 255]);
    let more = |texture: &str, uri: &str| {
        let bsdf = r#"{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}"#;
        let more =
            format!(r#""materials":[{bsdf}],"images":[{{"uri":"{uri}"}}],"textures":[{texture}],"#);
        document(&more, r#"},"material":0"#)
    };
    let by_extension = r#"{"extensions":{"EXT_texture_webp":{"source":0}}}"#;
    let loaded = loaded(&more(by_extension, &webp));
    assert_eq!(loaded.description.textures[0].texel(1, 1), Rgb::new(0.0, 1.0, 0.0));
    let avif = r#"{"extensions":{"EXT_texture_avif":{"source":0}}}"#;
    has(&error_with(&more(avif, &webp), &strict()), &["image 0 is AVIF", "gltf-transform"]);
    let disguised = more(r#"{"source":0}"#, AVIF);
    has(&error_with(&disguised, &strict()), &["material 0", "image 0 is AVIF"]);
}

/// An image too large for the memory allowed is refused by its header.
#[test]
fn huge_images_are_refused_before_they_are_decoded() {
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    png.extend(30_000u32.to_be_bytes());
    png.extend(30_000u32.to_be_bytes());
    png.extend([8, 2, 0, 0, 0, 0x1b, 0x2d, 0xa2, 0x9d]);
    // The checksum of that header, and some data.
    let crc = {
        let mut crc = u32::MAX;
        for &byte in &png[12..29] {
            crc ^= u32::from(byte);
            for _ in 0..8 {
                crc = if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
            }
        }
        !crc
    };
    png.truncate(29);
    png.extend(crc.to_be_bytes());
    png.extend(b"\0\0\0\0IDAT");
    let more = format!(
        r#""materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
"textures":[{{"source":0}}],"images":[{{"uri":"data:;base64,{}"}}],"#,
        STANDARD.encode(&png)
    );
    let json = document(&more, r#"},"material":0"#);
    let options = LoadOptions { max_memory: Some(1 << 30), ..LoadOptions::default() };
    has(&error_with(&json, &options), &["image 0", "GiB", "1.0 GiB"]);
}

#[test]
fn extensions_end_a_load_only_if_that_is_asked_for() {
    let strict = strict();
    let with = |extension: &str| {
        let list = format!(r#"["{extension}"]"#);
        document(&format!(r#""extensionsUsed":{list},"extensionsRequired":{list},"#), "}")
    };
    for options in [&LoadOptions::default(), &strict] {
        let loaded = loaded_with(&with("KHR_lights_punctual"), options);
        has(&loaded.warnings.join("\n"), &["KHR_lights_punctual", "lamps"]);
    }
    let loaded = loaded(&with("ACME_shape"));
    assert_eq!(loaded.warnings.len(), 1);
    has(&loaded.warnings[0], &["requires the extension ACME_shape"]);
    has(&error_with(&with("ACME_shape"), &strict), &["ACME_shape", "--strict"]);
}

#[test]
fn what_nothing_shows_is_not_checked() {
    // Attributes with names of their own, broken animations, skins and materials, and text beside it all.
    let more = r#""animations":[7],"skins":[{}],"materials":["wood"],"extras":{"a":[1]},"textures":[{"source":99}],"#;
    let loaded = loaded(&document(more, r#","_WEIRD":3,"BATCHID":1}"#));
    assert_eq!(loaded.description.parts[0].mesh.positions.len(), 3);
    assert!(loaded.warnings.is_empty());
}

#[test]
fn accessors_without_data_are_zeros() {
    let json = document("", "}").replace(
        r#"{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC2"}"#,
        r#"{"componentType":5126,"count":3,"type":"VEC2"}"#,
    );
    assert_eq!(loaded(&json).description.parts[0].mesh.uvs, [Vec2::ZERO; 3]);
}

#[test]
fn short_buffers_are_a_warning_where_nothing_is_missing() {
    let json = document("", "}").replacen(
        r#""buffers":[{"byteLength":120"#,
        r#""buffers":[{"byteLength":121"#,
        1,
    );
    has(&loaded(&json).warnings.join("\n"), &["buffer 0", "120 of its 121"]);
}

#[test]
fn the_first_version_is_named() {
    has(
        &error(r#"{"meshes":{"cube":{"primitives":[]}},"nodes":{}}"#),
        &["glTF 1.0", "gltf-pipeline"],
    );
}

#[test]
fn cameras_scenes_and_hidden_nodes() {
    let more = r#""scene":1,"scenes":[{"name":"a","nodes":[0]},{"name":"b","nodes":[1,2]}],"nodes":[
{"mesh":0,"translation":[5,0,0]},{"mesh":0,"children":[3]},{"camera":0,"name":"left"},
{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":false}},"children":[4]},{"camera":1,"translation":[0,0,9]}],
"cameras":[{"type":"perspective","perspective":{"yfov":0.5}},{"name":"top","type":"orthographic","orthographic":{"ymag":2}}],"#;
    let json = document(more, "}");
    let d = loaded(&json).description;
    assert_eq!((d.parts.len(), d.cameras.len()), (1, 1));
    assert_eq!(d.cameras[0].name, "left");
    assert_eq!(d.camera, Some(d.cameras[0].settings));
    let scene = |name: &str| LoadOptions { scene: Some(name.into()), ..LoadOptions::default() };
    for name in ["a", "0"] {
        let d = loaded_with(&json, &scene(name)).description;
        assert_eq!(d.parts[0].mesh.positions[0], vec3(5.0, 0.0, 0.0));
        assert!(d.camera.is_none());
    }
    has(&error_with(&json, &scene("c")), &["no scene 'c'", "0 'a', 1 'b'"]);
    let visible = json.replace(r#""visible":false"#, r#""visible":true"#);
    let d = loaded(&visible).description;
    assert_eq!(d.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["top", "left"]);
}

#[test]
fn nodes_marked_as_portals_are_rectangles_and_not_shown() {
    let nodes = |extras: &str| {
        let more = format!(
            r#""scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0}},{{"mesh":0,"translation":[5,0,0],"scale":[2,1,1],"extras":{extras}}}],"#
        );
        loaded(&document(&more, "}")).description
    };
    let box_of = nodes("7").parts[0].mesh.bounds();
    for extras in [r#"{"portal":true}"#, r#"{"portal":1,"other":[]}"#] {
        let description = nodes(extras);
        assert_eq!((description.parts.len(), description.instances.len()), (1, 0));
        let [portal] = &description.portals[..] else { panic!("{:?}", description.portals) };
        let size = box_of.size();
        let area = 2.0 * size.x * size.y;
        assert!((portal.area() / area - 1.0).abs() < 1e-5, "{portal:?} {size}");
        assert!(
            (portal.corner() - vec3(5.0 + 2.0 * box_of.min.x, box_of.min.y, box_of.min.z)).length()
                < 1e-5
        );
    }
    for extras in [r#"{"portal":false}"#, r#"{"portal":0}"#, r#""portal""#, "null"] {
        assert!(nodes(extras).portals.is_empty(), "{extras}");
    }
}

#[test]
fn unusable_cameras_are_left_out_unless_that_is_refused() {
    let cases = [
        (r#""perspective":{"yfov":0}"#, "0°"),
        (r#""orthographic":{"ymag":0}"#, "height 0"),
        (r#""type":"perspective""#, "neither perspective nor orthographic"),
    ];
    for (camera, words) in cases {
        let more = format!(
            r#""scenes":[{{"nodes":[0,1,2]}}],"nodes":[{{"mesh":0}},{{"camera":0,"name":"left"}},{{"camera":1}}],
"cameras":[{{{camera}}},{{"name":"sound","perspective":{{"yfov":0.5}}}}],"#
        );
        let json = document(&more, "}");
        let loaded = loaded(&json);
        assert_eq!(loaded.description.cameras.len(), 1);
        assert_eq!(loaded.description.cameras[0].name, "sound");
        let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        has(warning, &["a.gltf", "camera 0 ('left')", words, "left out"]);
        has(&error_with(&json, &strict()), &["a.gltf", "camera 0 ('left')", words, "--strict"]);
    }
}

#[test]
fn animations_move_nodes_at_a_moment() {
    // The positions' accessor as a path.
    let more = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":[2,2,2],"rotation":[0,0,0,2]}],"animations":[{"name":"go","samplers":
[{"input":3,"output":0}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}],"#;
    let json = document(more, "}");
    let first =
        |options: &LoadOptions| loaded_with(&json, options).description.parts[0].mesh.positions[1];
    let at = |name: &str, seconds| {
        let animation = Some(AnimationTime { name: name.into(), seconds });
        LoadOptions { animation, ..LoadOptions::default() }
    };
    assert_eq!(first(&LoadOptions::default()), vec3(2.0, 0.0, 0.0));
    assert_eq!(first(&at("go", 0.5)), vec3(2.5, 0.0, 0.0));
    assert_eq!(first(&at("0", 1.5)), vec3(2.5, 0.5, 0.0));
    assert_eq!(first(&at("go", 99.0)), vec3(2.0, 1.0, 0.0));
    has(&error_with(&json, &at("stop", 0.0)), &["no animation 'stop'", "0 'go'"]);
    let broken = json.replace(r#""sampler":0,"target""#, r#""sampler":4,"target""#);
    has(&error_with(&broken, &at("go", 0.0)), &["animation 'go', channel 0", "sampler 4"]);
}

#[test]
fn channels_without_usable_keys_leave_their_nodes_at_rest() {
    // A value less than there are keys, and times that are those of colors.
    let more = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[7,0,0]},{}],"animations":[{"name":"go","samplers":
[{"input":3,"output":0,"interpolation":"CUBICSPLINE"},{"input":3,"output":0}],"channels":[
{"sampler":0,"target":{"node":0,"path":"translation"}},{"sampler":1,"target":{"node":0,"path":"scale"}},
{"sampler":0,"target":{"node":1,"path":"scale"}}]}],"#;
    let json = document(more, "}");
    let animation = Some(AnimationTime { name: "go".into(), seconds: 1.0 });
    let options = LoadOptions { animation, ..LoadOptions::default() };
    let loaded = loaded_with(&json, &options);
    let mesh = &loaded.description.parts[0].mesh;
    assert_eq!(mesh.positions[1], vec3(8.0, 0.0, 0.0), "scaled, but not moved");
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    let place = "animation 'go', channel 0 (translation of node 0)";
    has(warning, &["a.gltf", place, "3 values for 3 keys", "three", "it and one more channel"]);
    let message = error_with(&json, &LoadOptions { strict: true, ..options });
    has(&message, &["a.gltf", place, "3 values for 3 keys", "without --strict"]);
}

#[test]
fn skins_place_vertices_by_their_joints_and_not_by_their_node() {
    // All joints are 0: an accessor without data. Weights are the colors' first numbers, scaled to one.
    let more = r#""scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"skin":0,"translation":[99,0,0]},{"translation":[0,0,3]}],
"skins":[{"joints":[1]}],"#;
    // As the fifth accessor.
    let json = document(more, r#","JOINTS_0":4,"WEIGHTS_0":2}"#).replace(
        r#""count":3,"type":"SCALAR"}]"#,
        r#""count":3,"type":"SCALAR"},{"componentType":5121,"count":3,"type":"VEC4"}]"#,
    );
    let d = loaded(&json).description;
    assert!((d.parts[0].mesh.positions[1] - vec3(1.0, 0.0, 3.0)).length() < 1e-5);
    has(&error(&json.replace(r#""joints":[1]"#, r#""joints":[8]"#)), &["skin 0", "node 8"]);
}

#[test]
fn instances_are_parts_of_their_own() {
    let more = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,1],"extensions":
{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"_COLOR":1}}}}],"#;
    let d = loaded(&document(more, "}")).description;
    let first: Vec<Vec3> = d.parts.iter().map(|p| p.mesh.positions[0]).collect();
    assert_eq!(first, [vec3(0., 0., 1.), vec3(1., 0., 1.), vec3(0., 1., 1.)]);
    let uneven = more.replace(r#""_COLOR":1"#, r#""ROTATION":4"#);
    let json = document(&uneven, "}").replace(
        r#""count":3,"type":"SCALAR"}]"#,
        r#""count":3,"type":"SCALAR"},{"componentType":5126,"count":2,"type":"VEC4"}]"#,
    );
    has(&error(&json), &["node 0", "2 values", "3"]);
}

#[test]
fn choices_of_formats_without_them_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let options = LoadOptions { scene: Some("0".into()), ..LoadOptions::default() };
    has(&load_with(&path, &options).unwrap_err().to_string(), &["a.obj", "no scenes"]);
}

#[test]
fn missing_images_are_left_out_unless_that_is_refused() {
    let more = r#""materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
"textures":[{"source":0}],"images":[{"uri":"gone.png"}],"#;
    let json = document(more, r#"},"material":0"#);
    let loaded = loaded(&json);
    assert_eq!(loaded.description.materials[0].textures().count(), 0);
    assert_eq!(loaded.warnings.len(), 1);
    has(&loaded.warnings[0], &["gone.png", "image 0", "left out"]);
    has(&error_with(&json, &strict()), &["gone.png", "image 0"]);
}

/// A material with one sound texture and seven that are of no use, of five kinds.
#[test]
fn damaged_unknown_and_remote_images_are_left_out_once_a_kind() {
    let gif = "data:;base64,R0lGODlhAQABAIAAAAUEBAAAACwAAAAAAQABAAACAkQBADs=";
    let sound = png([255, 0, 0, 255]);
    let cut = &sound[..sound.len() - 40];
    let remote = "https://example.org/x.png";
    let uris = [&sound, gif, cut, "data:;base64,*", remote, "http://a/b", AVIF];
    let images: Vec<_> = uris.iter().map(|uri| format!(r#"{{"uri":"{uri}"}}"#)).collect();
    let textures: Vec<_> = (0..8).map(|i| format!(r#"{{"source":{i}}}"#)).collect();
    let more = format!(
        r#""materials":[{{"name":"paint","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}},
"metallicRoughnessTexture":{{"index":1}}}},"normalTexture":{{"index":2}},"emissiveFactor":[1,1,1],
"emissiveTexture":{{"index":3}},"extensions":{{"KHR_materials_clearcoat":{{"clearcoatFactor":1,
"clearcoatTexture":{{"index":4}},"clearcoatRoughnessTexture":{{"index":5}},"clearcoatNormalTexture":{{"index":6}}}},
"KHR_materials_transmission":{{"transmissionFactor":1,"transmissionTexture":{{"index":7}}}}}}}}],
"images":[{}],"textures":[{}],"#,
        images.join(","),
        textures.join(",")
    );
    let json = document(&more, r#"},"material":0"#);
    let loaded = loaded(&json);
    let material = &loaded.description.materials[0];
    assert_eq!(material.textures().count(), 1);
    assert!(material.emission.is_none() && material.layers.transmission.is_none());
    let warnings = &loaded.warnings;
    assert_eq!(warnings.len(), 4, "{warnings:#?}");
    has(&warnings[0], &["a.gltf", "'paint'", "image 1", "Gif", "it and 2 more textures like it"]);
    has(&warnings[1], &["image 4", "https://example.org/x.png", "it and one more"]);
    has(&warnings[2], &["image 6 is AVIF", "gltf-transform", "it is left out"]);
    has(&warnings[3], &["image 7", "only 7", "it is left out"]);
    has(&error_with(&json, &strict()), &["a.gltf", "image 1", "Gif"]);
}

/// One warning per kind and mesh, however many primitives there are.
#[test]
fn vertices_without_what_their_material_needs_are_named() {
    let more = format!(
        r#""materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":0}}}},
"normalTexture":{{"index":0,"texCoord":7}}}}],"textures":[{{"source":0}}],"images":[{{"uri":"{}"}}],"#,
        png([255; 4])
    );
    let twice = r#"},"material":0},{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0"#;
    let sound = document(&more, twice).replace(r#""texCoord":7"#, r#""texCoord":1"#);
    let lacking = sound.replace(r#","TEXCOORD_1":1"#, "");
    // Infinite numbers in place of the second coordinate and of the last color's blue.
    let mut data = data();
    for at in [40, 60 + 4 * 10] {
        data[at..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    }
    let bad = |json: &str| json.replace(&STANDARD.encode(self::data()), &STANDARD.encode(&data));
    let cases = [
        (lacking.clone(), vec!["TEXCOORD_1, which it lacks"]),
        (
            bad(&lacking),
            vec![
                "TEXCOORD_1",
                "TEXCOORD_0 of vertex 0 is not finite: [0, inf]",
                "COLOR_0 of vertex 2",
            ],
        ),
        // Nothing looks at the coordinates.
        (bad(&document("", "}")), vec!["COLOR_0 of vertex 2 is not finite: [1, 0.5, inf, 0]"]),
        (
            document(&more, r#"},"material":0"#).replace(r#""texCoord":7"#, r#""texCoord":1"#),
            vec![],
        ),
    ];
    for (json, expected) in cases {
        let warnings = loaded(&json).warnings;
        assert_eq!(warnings.len(), expected.len(), "{warnings:#?}");
        for (warning, words) in warnings.iter().zip(&expected) {
            has(warning, &["a.gltf", "mesh 0, primitive 0 ('tri')", words]);
        }
        if let Some(first) = expected.first() {
            has(
                &error_with(&json, &strict()),
                &["a.gltf", "mesh 0, primitive 0", first, "--strict"],
            );
        }
    }
}

#[test]
fn vertices_that_are_not_finite_are_left_out_unless_that_is_refused() {
    let numbers = |numbers: &[f32]| {
        STANDARD.encode(numbers.iter().flat_map(|f| f.to_le_bytes()).collect::<Vec<_>>())
    };
    let soup = |bad: f32| {
        let positions = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 0., 1., 0., bad, 1.];
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
"meshes":[{{"name":"soup","primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":6,"type":"VEC3"}}],
"bufferViews":[{{"buffer":0,"byteLength":72}}],
"buffers":[{{"byteLength":72,"uri":"data:;base64,{}"}}]}}"#,
            numbers(&positions)
        )
    };
    for bad in [f32::NAN, f32::INFINITY] {
        let loaded = loaded(&soup(bad));
        assert_eq!(loaded.description.parts[0].mesh.triangles, [[0, 1, 2]]);
        let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        has(warning, &["a.gltf", "vertex 5", "'soup'", "1 of 2 triangles", "left out"]);
        let refused = load_with(&file(&soup(bad)).path, &strict()).unwrap();
        let error = Scene::new(refused.description).unwrap_err().to_string();
        has(&error, &["soup", "vertex 5", "non-finite"]);
    }
    assert_eq!(loaded(&soup(1.0)).warnings, [""; 0]);
}

/// Without normals, the format says, tangents are ignored: those along the texture coordinates take their place.
#[test]
fn tangents_without_normals_are_ignored() {
    let png = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = image::RgbImage::from_pixel(2, 2, image::Rgb([200, 128, 220]));
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        STANDARD.encode(bytes.into_inner())
    };
    let more = format!(
        r#""materials":[{{"name":null,"normalTexture":{{"index":0}}}}],"textures":[{{"source":0}}],
        "images":[{{"uri":"data:image/png;base64,{png}"}}],"#
    );
    let document = document(&more, r#","TANGENT":2},"material":0"#);
    let without = document.replace(r#","TANGENT":2"#, "");
    let tangents = |json: &str| {
        let loaded = load_with(&file(json).path, &LoadOptions::default()).unwrap();
        loaded.description.parts[0].mesh.tangents.clone()
    };
    assert!(!tangents(&document).is_empty());
    assert_eq!(tangents(&document), tangents(&without));
}
