//! Rays per second through a million cards, opaque and with leaves cut out of them: camera rays and shadow rays.

mod rays;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::Rgb;
use domelight::geometry::Mesh;
use domelight::math::{TAU, from_spherical, vec2, vec3};
use domelight::sampling::Pcg32;
use domelight::scene::{
    AlphaMode, Coverage, Encoding, Material, Part, Scene, SceneDescription, SightKey, Sights,
    Texture, TextureRef,
};
use rays::{camera_rays, shadow_rays};

const CARDS: usize = 1_000_000;
/// In a cube of edge 1: a ray through all of it meets eight cards.
const EDGE: f32 = 0.004;
const WIDTH: u32 = 192;
const TEXELS: u32 = 64;

/// Squares at random places and turns.
fn cards() -> Mesh {
    let mut pcg = Pcg32::new(1, 0);
    let mut mesh = Mesh::default();
    for _ in 0..CARDS {
        let mut random = || pcg.next_f32();
        let center = vec3(random(), random(), random()) - 0.5;
        let across = from_spherical(1.0 - 2.0 * random(), TAU * random());
        let (u, v) = across.any_orthonormal_pair();
        let first = mesh.positions.len() as u32;
        for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            mesh.positions.push(center + EDGE * (x * u + y * v));
            mesh.uvs.push(vec2(x + 0.5, y + 0.5));
        }
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + first)));
    }
    mesh
}

/// A disk with half of the card's area, its edge a ramp.
fn leaf() -> Texture {
    let at = |i: u32| (i as f32 + 0.5) / TEXELS as f32 - 0.5;
    let alpha = |i: u32| {
        let radius = vec2(at(i % TEXELS), at(i / TEXELS)).length();
        (255.0 * (0.5 + 20.0 * (0.399 - radius)).clamp(0.0, 1.0)) as u8
    };
    let white = vec![[255; 3]; (TEXELS * TEXELS) as usize];
    let texture = Texture::from_rgb8("leaf", TEXELS, TEXELS, white, Encoding::Linear);
    let alphas = (0..TEXELS * TEXELS).map(alpha).collect();
    texture.and_then(|texture| texture.with_alpha(alphas)).expect("one texel a place")
}

fn scene(mesh: Mesh, mode: AlphaMode) -> Scene {
    let texture = Some(TextureRef::new(0));
    let coverage = Coverage { mode, opacity: 1.0, texture };
    let description = SceneDescription {
        parts: vec![Part { name: "cards".into(), mesh, material: 0 }],
        materials: vec![Material { coverage, ..Material::diffuse("leaf", Rgb::splat(0.5)) }],
        textures: vec![leaf()],
        ..SceneDescription::default()
    };
    Scene::new(description).expect("the scene is valid")
}

fn foliage(c: &mut Criterion) {
    let mesh = cards();
    let camera = camera_rays(WIDTH, 2.0, 4.0);
    let opaque = scene(mesh.clone(), AlphaMode::Opaque);
    let masked = scene(mesh.clone(), AlphaMode::Mask { cutoff: 0.5 });
    let blended = scene(mesh, AlphaMode::Blend);
    let shadow = shadow_rays(opaque.bvh(), &camera);
    let (mut hits, mut occluded, mut transmittances) = (Vec::new(), Vec::new(), Vec::new());

    let keys: Vec<_> = (0..camera.len() as u64).map(|key| SightKey { key, sample: 0 }).collect();
    let mut sights = Sights::default();

    let mut group = c.benchmark_group("foliage");
    group.sample_size(10).throughput(Throughput::Elements(camera.len() as u64));
    group.bench_function("camera/opaque", |b| {
        b.iter(|| opaque.bvh().closest_hits(&camera, &mut hits));
    });
    for (name, scene) in [("camera/masked", &masked), ("camera/blended", &blended)] {
        group.bench_function(name, |b| {
            b.iter(|| scene.sights(&camera, &keys, &mut sights));
        });
    }
    for (name, scene) in [("camera/single/masked", &masked), ("camera/single/blended", &blended)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                let rays = camera.iter().zip(&keys);
                rays.filter(|(ray, key)| scene.camera_hit(ray, key.key, 0).is_some()).count()
            });
        });
    }
    group.throughput(Throughput::Elements(shadow.len() as u64));
    group.bench_function("shadow/opaque", |b| {
        b.iter(|| opaque.bvh().occluded(&shadow, &mut occluded));
    });
    for (name, scene) in [("shadow/masked", &masked), ("shadow/blended", &blended)] {
        group.bench_function(name, |b| {
            b.iter(|| {
                scene.bvh().occluded(&shadow, &mut occluded);
                scene.transmittances(&shadow, &mut transmittances);
            });
        });
    }
    group.finish();
}

criterion_group!(benches, foliage);
criterion_main!(benches);
