//! Each model of reflectance: value with density, and a sample.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::bsdf::{Brdf as _, Bsdf, MaterialSpec};
use domelight::math::{Vec3, vec2, vec3};
use domelight::sampling::warp::uniform_hemisphere;

const MATERIALS: [&str; 8] = [
    "diffuse:0.8",
    "phong:50:0.5:0.5",
    "ward:0.15:0.5",
    "ggx:0.2",
    "ggx:0.05,0.3",
    "beckmann:0.3",
    "gltf:0.9,0.6,0.3:0.5:0.5",
    "mix",
];
const N: u32 = 1024;

fn bsdf(criterion: &mut Criterion) {
    let numbers = |i: u32| vec2((i as f32 + 0.5) / N as f32, (i as f32 * 0.618_034).fract());
    let directions: Vec<Vec3> = (0..N).map(|i| uniform_hemisphere(numbers(i))).collect();
    let wo = vec3(0.5, 0.1, 0.8).normalize();
    let mut group = criterion.benchmark_group("bsdf");
    group.throughput(Throughput::Elements(N.into()));
    for name in MATERIALS {
        let bsdf = Bsdf::from(name.parse::<MaterialSpec>().expect("a material"));
        group.bench_function(format!("{name}, value and density"), |bencher| {
            bencher.iter(|| {
                let eval = |&wi| bsdf.eval_pdf(black_box(wo), wi).1;
                directions.iter().map(eval).sum::<f32>()
            });
        });
        group.bench_function(format!("{name}, sample"), |bencher| {
            bencher.iter(|| {
                let draw = |i| bsdf.sample(black_box(wo), (i as f32 * 0.75).fract(), numbers(i));
                (0..N).filter_map(draw).map(|s| s.pdf).sum::<f32>()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bsdf);
criterion_main!(benches);
