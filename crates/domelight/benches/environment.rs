//! Light probes: to build the table of one, to look it up, and to sample it.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::math::{Vec2, Vec3, vec2};
use domelight::sampling::warp::uniform_sphere;
use domelight::sampling::{Dimension, Sampler, SamplerKind};

const N: u32 = 4096;

fn environment(criterion: &mut Criterion) {
    let image = BuiltinProbe::Sky.image(512);
    let build =
        || Environment::new(image.clone(), Orientation::default(), 1.0).expect("a light probe");
    let environment = build();
    let numbers: Vec<Vec2> =
        (0..N).map(|i| vec2((i as f32 + 0.5) / N as f32, (i as f32 * 0.618_034).fract())).collect();
    let directions: Vec<Vec3> = numbers.iter().map(|&u| uniform_sphere(u)).collect();
    let mut group = criterion.benchmark_group("environment");
    group.throughput(Throughput::Elements(image.pixels.len() as u64));
    group.bench_function("build, 1024 x 512", |bencher| bencher.iter(build));
    group.throughput(Throughput::Elements(N.into()));
    group.bench_function("radiance", |bencher| {
        bencher.iter(|| directions.iter().map(|&wi| environment.le(wi).g).sum::<f32>());
    });
    group.bench_function("density", |bencher| {
        bencher.iter(|| directions.iter().map(|&wi| environment.pdf(wi)).sum::<f32>());
    });
    group.bench_function("sample", |bencher| {
        bencher.iter(|| {
            numbers.iter().filter_map(|&u| environment.sample(u)).map(|s| s.pdf).sum::<f32>()
        });
    });
    group.bench_function("scrambled numbers", |bencher| {
        let sampler = Sampler::new(SamplerKind::Sobol, 1, 2);
        bencher.iter(|| {
            (0..N).map(|i| sampler.numbers(black_box(Dimension::Film), i).u().x).sum::<f32>()
        });
    });
    group.finish();
}

criterion_group!(benches, environment);
criterion_main!(benches);
