//! Rays per second through a bumpy sphere: camera rays, and shadow rays one by one and in batches.

mod rays;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::bvh::Bvh;
use domelight::geometry::Ray;
use domelight::math::{PI, TAU, from_spherical};
use rays::{camera_rays, shadow_rays};

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

fn trace(c: &mut Criterion) {
    let bvh = bumpy_sphere();
    let camera = camera_rays(WIDTH, 3.0, 2.5);
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
