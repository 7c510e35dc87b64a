//! Every kind of material on a ball, near its outline: there the view changes within a pixel, and with it everything
//! that depends on the view.

use domelight::bsdf::{Bsdf, Fresnel, Ggx, Lambert, Lobe, Masking};
use domelight::environment::{Environment, Orientation};
use domelight::math::{Vec3, vec3};
use domelight::render::{Background, RenderSettings, render};
use domelight::scene::builtin::shapes;
use domelight::scene::{
    Anisotropy, Camera, CameraSettings, Clearcoat, ColorFactor, Factor, Layers, Material,
    MaterialModel, MetallicRoughnessMaterial, Part, PhongMaterial, Projection, Scene,
    SceneDescription, Sheen, Specular,
};
use domelight::strategy::PreparedStrategy;
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::{Suite, ZTest};

const STRATEGIES: [&str; 5] = ["brdf:4", "environment:4", "rejection:4", "sir:2/8", "product:4"];

fn factor(value: f32) -> Factor {
    Factor { value, texture: None }
}

fn color(value: Rgb) -> ColorFactor {
    ColorFactor { value, texture: None }
}

/// Glazed clay, fabric and so on: a red dielectric under the given layers.
fn layered(name: &str, layers: &Layers) -> Material {
    let model = MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
        base_color: Rgb::new(0.8, 0.2, 0.1),
        base_color_texture: None,
        metallic: 0.0,
        roughness: 0.7,
        metallic_roughness_texture: None,
    });
    Material { model, layers: *layers, ..Material::diffuse(name, Rgb::WHITE) }
}

fn materials() -> Vec<Material> {
    let coat = Some(Clearcoat { strength: factor(1.0), roughness: factor(0.5), normal_map: None });
    let sheen = Some(Sheen { color: color(Rgb::new(0.5, 0.7, 0.9)), roughness: factor(0.4) });
    let specular = Some(Specular { strength: factor(0.6), color: color(Rgb::new(1.0, 0.6, 0.3)) });
    let anisotropy = Some(Anisotropy { strength: 0.7, rotation: 0.5, texture: None });
    let ggx = Ggx::new([0.3; 2], Fresnel::Schlick { f0: Rgb::splat(0.1) }, Masking::Correlated);
    let lobes: [Lobe; 2] = [Lambert::new(Rgb::splat(0.4)).into(), ggx.into()];
    let fixed = MaterialModel::Fixed(Bsdf::new(&lobes).unwrap());
    let phong = MaterialModel::Phong(PhongMaterial {
        diffuse: Rgb::splat(0.4),
        diffuse_texture: None,
        specular: Rgb::splat(0.4),
        exponent: 20.0,
    });
    let of = |model| Material { model, ..Material::diffuse("two lobes", Rgb::WHITE) };
    vec![
        Material::diffuse("diffuse", Rgb::splat(0.6)),
        of(fixed),
        of(phong),
        layered("plain", &Layers::default()),
        layered("coat", &Layers { clearcoat: coat, ..Layers::default() }),
        layered("sheen", &Layers { sheen, ..Layers::default() }),
        layered("coat on sheen", &Layers { clearcoat: coat, sheen, ..Layers::default() }),
        layered("specular", &Layers { specular, anisotropy, ..Layers::default() }),
        layered("thin glass", &Layers { transmission: Some(factor(0.6)), ..Layers::default() }),
    ]
}

/// A cloudy sky with lamps all around the horizon.
fn sky() -> Environment {
    let map = RgbImage::from_fn(32, 16, |x, y| match (x, y) {
        (_, 6..10) if x % 8 < 3 => Rgb::new(9.0, 8.0, 5.0),
        (_, ..8) => Rgb::new(0.5, 0.7, 1.0),
        _ => Rgb::new(0.5, 0.4, 0.3),
    });
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

/// The mean over a picture of the rim of a ball, in a few large pixels.
fn outline(
    scene: &Scene,
    environment: &Environment,
    strategy: &PreparedStrategy,
    seed: u64,
) -> [f64; 3] {
    let settings = RenderSettings {
        width: 2,
        height: 2,
        n_samples: 64,
        background: Background::Hidden,
        seed,
        ..RenderSettings::default()
    };
    let camera = CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: 0.5 },
        origin: vec3(0.0, 0.0, 10.0),
        target: vec3(0.97, 0.0, 0.0),
        up: Vec3::Y,
    };
    let camera = Camera::new(&camera, settings.width, settings.height).unwrap();
    let picture = render(scene, &camera, environment, strategy, &settings, &()).layers.color;
    let sum: Rgb = picture.pixels.iter().copied().sum();
    sum.to_array().map(|c| f64::from(c) / picture.pixels.len() as f64)
}

/// A pixel's hits share what does not depend on the view, and nothing else.
#[test]
fn pixels_whose_view_varies_are_unbiased() {
    let environment = sky();
    let materials = materials();
    let test = ZTest { suite: Suite::of(materials.len() * STRATEGIES.len()), ..ZTest::default() };
    materials.into_par_iter().for_each(|material| {
        let name = material.name.clone();
        let mesh = shapes::icosphere(5);
        let parts = vec![Part { name: "ball".into(), mesh, material: 0 }];
        let materials = vec![material];
        let description = SceneDescription { parts, materials, ..SceneDescription::default() };
        let scene = Scene::new(description).unwrap();
        let means = |strategy: &str, seeds: std::ops::Range<u64>| -> Vec<[f64; 3]> {
            let strategy = PreparedStrategy::new(strategy.parse().unwrap(), &environment).unwrap();
            seeds.map(|seed| outline(&scene, &environment, &strategy, seed)).collect()
        };
        let expected = means("mis:8:8", 200..264);
        for strategy in STRATEGIES {
            let found = means(strategy, 0..64);
            let label = format!("{name}, {strategy}");
            test.two_sample(&label, &found, &expected).unwrap_or_else(|f| panic!("{f}"));
        }
    });
}
