//! Rays a second through a bumpy sphere: camera rays, and shadow rays one by one and in batches.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::bvh::Bvh;
use domelight::geometry::{Ray, RayBatch};
use domelight::math::{PI, TAU, Vec3, from_spherical, vec3};

const WIDTH: u32 = 256;

/// A sphere with waves, as a grid of about 82,000 triangles.
fn bumpy_sphere() -> Bvh {
    let (rows, columns) = (160u32, 256u32);
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for row in 0..=rows {
        for column in 0..columns {
            let theta = PI * row as f32 / rows as f32;
            let p = from_spherical(theta.cos(), TAU * column as f32 / columns as f32);
            positions.push(
                p * (1.0 + 0.1 * (9.0 * p.x).sin() * (11.0 * p.y).sin() * (10.0 * p.z).cos()),
            );
            if row < rows {
                let next = (column + 1) % columns;
                let [a, b] = [row * columns + column, row * columns + next];
                triangles.extend([[a, a + columns, b], [b, a + columns, b + columns]]);
            }
        }
    }
    Bvh::build(&positions, &triangles).expect("the mesh is valid")
}

/// In tiles of 8 × 8 pixels.
fn camera_rays() -> Vec<Ray> {
    let pixel = |i: u32| {
        let (tile, within) = (i / 64, i % 64);
        let (x, y) = (tile % (WIDTH / 8) * 8 + within % 8, tile / (WIDTH / 8) * 8 + within / 8);
        let to_unit = |k: u32| 2.0 * (k as f32 + 0.5) / WIDTH as f32 - 1.0;
        vec3(to_unit(x), -to_unit(y), -2.5).normalize()
    };
    (0..WIDTH * WIDTH).map(|i| Ray::new(vec3(0.0, 0.0, 3.0), pixel(i))).collect()
}

/// Two a hit, spread over the whole sphere of directions.
fn shadow_rays(bvh: &Bvh, rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::default();
    for (i, ray) in rays.iter().enumerate() {
        let Some(hit) = bvh.closest_hit(ray) else { continue };
        for k in 0..2 {
            let golden = (2 * i + k) as f32 * 0.618_034;
            let direction =
                from_spherical(1.0 - 2.0 * (golden * 7.3).fract(), TAU * golden.fract());
            let origin: Vec3 = ray.at(hit.t * 0.9999);
            batch.push(origin, direction);
        }
    }
    batch
}

fn trace(c: &mut Criterion) {
    let bvh = bumpy_sphere();
    let camera = camera_rays();
    let shadow = shadow_rays(&bvh, &camera);
    let singles: Vec<_> =
        shadow.origins.iter().zip(&shadow.directions).map(|(&o, &d)| Ray::new(o, d)).collect();
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());

    let mut group = c.benchmark_group("bvh");
    group.sample_size(20).throughput(Throughput::Elements(camera.len() as u64));
    group.bench_function("closest_hits", |b| b.iter(|| bvh.closest_hits(&camera, &mut hits)));
    group.throughput(Throughput::Elements(shadow.len() as u64));
    group.bench_function("occluded", |b| b.iter(|| bvh.occluded(&shadow, &mut occluded)));
    group.bench_function("any_hit", |b| {
        b.iter(|| black_box(singles.iter().filter(|ray| bvh.any_hit(ray)).count()));
    });
    group.finish();
}

fn build(c: &mut Criterion) {
    c.bench_function("bvh/build", |b| b.iter(bumpy_sphere));
}

criterion_group!(benches, trace, build);
criterion_main!(benches);
