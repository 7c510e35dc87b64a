//! How well and how fast each method turns a map into lights.
//!
//! First a table of shading errors, of the built-in cathedral or of the probes whose paths the
//! variable `DOMELIGHT_PROBES` lists, separated by colons; then times.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use domelight::RgbImage;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, Orientation};
use domelight::rig::{
    LightPosition, MedianCut, Order, Rig, RigError, ShadingReference, VarianceMinimization,
    median_cut, variance_minimization,
};

type Method = fn(&Environment, usize) -> Result<Rig, RigError>;

const METHODS: [(&str, Method); 8] = [
    ("median cut, geometric centre", |env, n| {
        let position = LightPosition::GeometricCentre;
        median_cut(env, n, MedianCut { position, ..MedianCut::default() })
    }),
    ("median cut", |env, n| median_cut(env, n, MedianCut::default())),
    ("median cut, widths as on the map", |env, n| {
        median_cut(env, n, MedianCut { scale_width: false, ..MedianCut::default() })
    }),
    ("variance, poster", |env, n| variance_minimization(env, n, VarianceMinimization::poster())),
    ("variance, poster, worst first", |env, n| {
        let order = Order::WorstFirst;
        variance_minimization(
            env,
            n,
            VarianceMinimization { order, ..VarianceMinimization::poster() },
        )
    }),
    ("variance, sphere, levels", |env, n| {
        let settings = VarianceMinimization::default();
        let order = Order::Levels;
        variance_minimization(env, n, VarianceMinimization { order, lloyd_steps: 0, ..settings })
    }),
    ("variance, sphere, worst first", |env, n| {
        let settings = VarianceMinimization::default();
        variance_minimization(env, n, VarianceMinimization { lloyd_steps: 0, ..settings })
    }),
    ("variance, sphere, refined", |env, n| {
        variance_minimization(env, n, VarianceMinimization::default())
    }),
];

const COUNTS: [usize; 4] = [16, 64, 256, 1024];

fn environment(map: RgbImage) -> Environment {
    Environment::new(map, Orientation::default(), 1.0).expect("a valid map")
}

fn probes() -> Vec<(String, Environment)> {
    let Ok(paths) = std::env::var("DOMELIGHT_PROBES") else {
        let probe = BuiltinProbe::Cathedral;
        return vec![(probe.name().into(), environment(probe.image(512)))];
    };
    let load = |path: &str| {
        let probe = load_probe(Path::new(path), &ProbeOptions::default());
        let probe = probe.unwrap_or_else(|error| panic!("{error}"));
        (path.to_owned(), environment(probe.image))
    };
    paths.split(':').map(load).collect()
}

/// RMS error in per cent of RMS shading, diffuse and of a lobe cos²⁰, for each count.
fn errors(_: &mut Criterion) {
    for (name, env) in probes() {
        println!("{name}: diffuse, glossy RMS error [%] at {COUNTS:?} lights");
        let reference = ShadingReference::new(&env);
        for (method, rig) in METHODS {
            print!("{method:34}");
            for n in COUNTS {
                let error = reference.error(&rig(&env, n).expect("a map with light"));
                print!(" | {:7.3} {:6.2}", 100.0 * error.diffuse, 100.0 * error.glossy);
            }
            println!();
        }
    }
}

fn speed(c: &mut Criterion) {
    let small = BuiltinProbe::Cathedral.image(512);
    let large = RgbImage::from_fn(8192, 4096, |x, y| {
        let texture = 0.5 + ((x * 7919 + y * 104_729) % 97) as f32 / 97.0;
        small.get(x / 8, y / 8) * texture
    });
    for (size, map) in [("1k", small), ("8k", large)] {
        let env = environment(map);
        let mut group = c.benchmark_group(size);
        group.sample_size(10);
        for n in [64, 1024] {
            for (method, rig) in [METHODS[1], METHODS[3], METHODS[6], METHODS[7]] {
                group.bench_function(format!("{method}, {n}"), |b| {
                    b.iter(|| rig(black_box(&env), n));
                });
            }
        }
    }
}

criterion_group!(benches, errors, speed);
criterion_main!(benches);
