//! How well and how fast each method turns a map into lights.
//!
//! First a table of shading errors, of the built-in cathedral or of the probes whose paths the
//! variable `DOMELIGHT_PROBES` lists, separated by colons; then times. Errors are root mean squares
//! over 600 normals in percent of the root mean square of what the map shades: a matte surface in the
//! open, the same behind two occluders of 50 degrees across, and a lobe cos²⁰ in the open.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use domelight::RgbImage;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::io::{ProbeOptions, load_probe};
use domelight::environment::{Environment, EnvironmentSample, Orientation};
use domelight::math::{Frame, TAU, Vec3, from_spherical, vec2};
use domelight::rig::{
    LightPosition, MedianCut, Order, Region, Rig, RigError, RigLight, ShadingError,
    ShadingReference, VarianceMinimization, median_cut, variance_minimization,
};
use domelight::sampling::Pcg32;

type Method = fn(&Environment, usize) -> Result<Rig, RigError>;

const METHODS: [(&str, Method); 8] = [
    ("median cut, geometric center", |env, n| {
        let position = LightPosition::GeometricCenter;
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

/// A normal, and the middles of two occluders in front of it.
struct Place {
    normal: Vec3,
    occluders: [Vec3; 2],
}

impl Place {
    /// Half of 50 degrees.
    const COS_RADIUS: f32 = 0.906_307_8;

    fn random(numbers: &mut Pcg32) -> Self {
        let mut next = || numbers.next_f32();
        let normal = from_spherical(1.0 - 2.0 * next(), TAU * next());
        let frame = Frame::from_z(normal);
        let occluders = [(); 2].map(|()| frame.to_world(from_spherical(next(), TAU * next())));
        Self { normal, occluders }
    }

    /// What light of luminance `energy` [times sr] from there adds to a matte surface.
    fn shade(&self, direction: Vec3, energy: f64) -> f64 {
        let cos_theta = self.normal.dot(direction);
        let hidden = self.occluders.iter().any(|o| o.dot(direction) > Self::COS_RADIUS);
        if cos_theta > 0.0 && !hidden { f64::from(cos_theta) * energy } else { 0.0 }
    }
}

/// What the map shades behind occluders.
struct Occluded {
    places: Vec<Place>,
    exact: Vec<f64>,
}

impl Occluded {
    fn new(env: &Environment) -> Self {
        let mut numbers = Pcg32::new(600, 0);
        let places: Vec<Place> = (0..600).map(|_| Place::random(&mut numbers)).collect();
        let (width, height) = (env.map().width, env.map().height);
        let mut exact = vec![0.0; places.len()];
        for y in 0..height {
            let solid_angle = env.texel_solid_angle(y);
            for x in 0..width {
                let uv = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                let direction = env.direction(uv);
                let energy = f64::from(env.map().get(x, y).luminance()) * solid_angle;
                for (sum, place) in exact.iter_mut().zip(&places) {
                    *sum += place.shade(direction, energy);
                }
            }
        }
        Self { places, exact }
    }

    fn error(&self, rig: &Rig) -> f64 {
        let shaded = |place: &Place| -> f64 {
            let light = |l: &RigLight| (l.direction, f64::from(l.irradiance.luminance()));
            rig.lights.iter().map(light).map(|(d, e)| place.shade(d, e)).sum()
        };
        let pairs = self.places.iter().zip(&self.exact);
        let error: f64 = pairs.map(|(p, e)| (shaded(p) - e).powi(2)).sum();
        (error / self.exact.iter().map(|e| e * e).sum::<f64>()).sqrt()
    }
}

/// Samples of the map as lights of equal luminance, fixed once and for all.
fn random_lights(env: &Environment, n: usize, numbers: &mut Pcg32) -> Rig {
    let sample = |_| env.sample(vec2(numbers.next_f32(), numbers.next_f32()));
    let share = 1.0 / n as f32;
    let light = |s: EnvironmentSample| RigLight {
        direction: s.wi,
        irradiance: s.le * (share / s.pdf),
        angular_radius: 0.0,
        share,
        solid_angle: 0.0,
        region: Region::Cell,
    };
    let lights = (0..n).filter_map(sample).map(light).collect();
    Rig { lights, width: env.map().width, height: env.map().height, labels: Vec::new() }
}

/// Root mean squares over sets of random lights.
fn random_errors(
    env: &Environment,
    n: usize,
    open: &ShadingReference,
    behind: &Occluded,
) -> [f64; 3] {
    const SETS: usize = 20;
    let mut numbers = Pcg32::new(n as u64, 1);
    let mut squares = [0.0; 3];
    for _ in 0..SETS {
        let rig = random_lights(env, n, &mut numbers);
        let errors = three(&open.error(&rig), behind.error(&rig));
        squares.iter_mut().zip(errors).for_each(|(s, e)| *s += e * e / SETS as f64);
    }
    squares.map(f64::sqrt)
}

fn three(open: &ShadingError, occluded: f64) -> [f64; 3] {
    [open.diffuse, occluded, open.glossy]
}

/// RMS error in percent of RMS shading for each count.
fn errors(_: &mut Criterion) {
    for (name, env) in probes() {
        println!("{name}: RMS error [%], matte / behind occluders / glossy, at {COUNTS:?} lights");
        let (open, behind) = (ShadingReference::new(&env), Occluded::new(&env));
        let line = |method: &str, errors: &dyn Fn(usize) -> [f64; 3]| {
            print!("{method:34}");
            for n in COUNTS {
                let [matte, occluded, glossy] = errors(n).map(|e| 100.0 * e);
                print!(" | {matte:6.2} {occluded:6.2} {glossy:6.2}");
            }
            println!();
        };
        line("samples of the map, fixed", &|n| random_errors(&env, n, &open, &behind));
        for (method, rig) in METHODS {
            line(method, &|n| {
                let rig = rig(&env, n).expect("a map with light");
                three(&open.error(&rig), behind.error(&rig))
            });
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
