//! Every unbiased strategy estimates ∫ f_r · cos θ · L · V dω: each against quadrature texel by
//! texel, on every kind of material, with some texels hidden from the point.

use domelight::bsdf::{Material, MaterialSpec};
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::{Frame, Vec3, from_spherical, vec2, vec3};
use domelight::sampling::{Heuristic, Pcg32, SamplerKind, Stream};
use domelight::strategy::{
    BrdfSampling, EnvironmentSampling, LightTable, MultipleImportanceSampling, PointStrategy,
    SampleNumbers, ShadingPoint,
};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::quadrature::{Adaptive, Rect};
use testkit::{Suite, ZTest};

const WIDTH: usize = 8;
const HEIGHT: usize = 6;

const MATERIALS: [&str; 9] = [
    "diffuse:0.8,0.5,0.2",
    "phong:50:1:0",
    "phong:50:0.5:0.5",
    "ward:0.15:0.5",
    "ggx:0.05",
    "ggx:0.4",
    "beckmann:0.3",
    "mix",
    "gltf:0.9,0.6,0.3:0.5:0.5",
];

/// Noise with a texel that outshines it near the horizon of most points.
fn environment(spots: bool, up: UpAxis) -> Environment {
    let mut pcg = Pcg32::new(17, 0);
    let mut number = move || (2.0 * pcg.next_f32()).exp();
    let mut map = RgbImage::from_fn(WIDTH, HEIGHT, |_, _| Rgb::new(number(), number(), number()));
    if spots {
        map.pixels[2 * WIDTH + 5] = Rgb::new(300.0, 200.0, 100.0);
        map.pixels[3 * WIDTH + 1] = Rgb::BLACK;
    }
    Environment::new(map, Orientation { up, rotation: 20.0 }, 1.0).unwrap()
}

/// Which texels are hidden: a third of them, without pattern.
fn hidden(env: &Environment, wi: Vec3) -> bool {
    let uv = env.uv(wi);
    let x = ((uv.x * WIDTH as f32) as usize).min(WIDTH - 1);
    let y = ((uv.y * HEIGHT as f32) as usize).min(HEIGHT - 1);
    (5 * x + 3 * y) % 7 < 2
}

/// A point whose shading normal is tilted against the surface, seen at `theta` from the former.
fn point(material: Material, theta: f32) -> ShadingPoint {
    let ng = vec3(0.3, 0.9, -0.2).normalize();
    let normal = vec3(0.4, 0.8, 0.1).normalize();
    let frame = Frame::from_z_and_tangent(normal, vec3(1.0, 0.2, 0.4));
    let wo = from_spherical(theta.cos(), 2.5);
    ShadingPoint { position: Vec3::ZERO, ng, frame, wo, material: material.for_view(wo) }
}

/// The integral, texel by texel.
fn quadrature(env: &Environment, at: &ShadingPoint) -> [f64; 3] {
    let rule = Adaptive { tolerance: 1e-5, min_depth: 2, max_depth: 8 };
    let mut sum = [0.0; 3];
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let edges = |i: usize, n: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
            let middle = |[a, b]: [f64; 2]| 0.5 * (a + b) as f32;
            let (u, v) = (edges(x, WIDTH), edges(y, HEIGHT));
            let center = env.direction(vec2(middle(u), middle(v)));
            let le = env.le(center);
            if hidden(env, center) || le.is_black() {
                continue;
            }
            let integral = rule.rect(Rect { x: u, y: v }, &mut |u: f64, v: f64| {
                let f = at.eval(env.direction(vec2(u as f32, v as f32))).to_array();
                // dω = 2π² sin θ du dv
                let solid_angle =
                    (std::f64::consts::PI * v).sin() * 2.0 * std::f64::consts::PI.powi(2);
                f.map(|f| f64::from(f) * solid_angle)
            });
            for c in 0..3 {
                sum[c] += f64::from(le.to_array()[c]) * integral[c];
            }
        }
    }
    sum
}

/// The mean of the estimates of `n` samples of one stream.
fn estimate<S: PointStrategy>(
    strategy: &S,
    env: &Environment,
    at: &ShadingPoint,
    stream: Stream,
    n: u32,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for sample in 0..n {
        strategy.sample(at, SampleNumbers { stream, sample }, &mut scratch, |wi, weight| {
            if !hidden(env, wi) {
                for (s, w) in sum.iter_mut().zip(weight.to_array()) {
                    *s += f64::from(w);
                }
            }
        });
    }
    sum.map(|s| s / f64::from(n))
}

/// Batches of one strategy: of independent numbers, or each a scrambling of the Sobol' points.
fn batches<S: PointStrategy>(
    strategy: &S,
    env: &Environment,
    at: &ShadingPoint,
    kind: SamplerKind,
) -> Vec<[f64; 3]> {
    assert!(S::UNBIASED);
    (0..40).map(|b| estimate(strategy, env, at, Stream::new(kind, 5, b), 1024)).collect()
}

#[test]
fn strategies_agree_with_quadrature() {
    let views = [0.2, 1.1, 1.48];
    let environments =
        [environment(false, UpAxis::Y), environment(true, UpAxis::Z), white_environment()];
    let suite = Suite::of(MATERIALS.len() * views.len() * environments.len() * 8);
    let test = ZTest { suite, ..ZTest::default() };
    for env in &environments {
        let table = CompensatedTable::new(env);
        MATERIALS.par_iter().for_each(|name| {
            let material = name.parse::<MaterialSpec>().unwrap().into();
            for theta in views {
                let at = point(material, theta);
                let reference = quadrature(env, &at);
                let check = |what: &str, batches: Vec<[f64; 3]>| {
                    let label = format!("{what}, {name}, view {theta}");
                    test.against(&label, &batches, reference).unwrap_or_else(|f| panic!("{f}"));
                };
                for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
                    let brdf = BrdfSampling { environment: env, n_samples: 2 };
                    check("brdf", batches(&brdf, env, &at, kind));
                    let light = EnvironmentSampling { environment: env, n_samples: 2 };
                    check("environment", batches(&light, env, &at, kind));
                }
                let mis = |table, heuristic, m, n| {
                    MultipleImportanceSampling::new(env, table, heuristic, m, n).unwrap()
                };
                let kind = SamplerKind::Sobol;
                let balance = mis(LightTable::Full, Heuristic::Balance, 1, 1);
                check("mis balance", batches(&balance, env, &at, kind));
                let power = mis(LightTable::Full, Heuristic::Power, 3, 1);
                check("mis power 3:1", batches(&power, env, &at, kind));
                let compensated = LightTable::Compensated(&table);
                let compensated = mis(compensated, Heuristic::Balance, 1, 2);
                check("mis compensated", batches(&compensated, env, &at, kind));
                let alone = mis(LightTable::Full, Heuristic::Balance, 2, 0);
                check("mis 2:0", batches(&alone, env, &at, SamplerKind::Independent));
            }
        });
    }
}

fn white_environment() -> Environment {
    let map = RgbImage::filled(WIDTH, HEIGHT, Rgb::WHITE);
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

/// Two techniques whose weights sum to one, divided by the common count as some slides have it,
/// give exactly half of the answer; this estimator does not.
#[test]
fn weights_that_sum_to_one_go_with_their_own_counts() {
    let env = environment(true, UpAxis::Y);
    let material = "diffuse:0.8".parse::<MaterialSpec>().unwrap().into();
    let at = point(material, 0.5);
    let mis =
        MultipleImportanceSampling::new(&env, LightTable::Full, Heuristic::Balance, 1, 1).unwrap();
    let mean = estimate(&mis, &env, &at, Stream::new(SamplerKind::Sobol, 1, 1), 1 << 16)[1];
    let expected = quadrature(&env, &at)[1];
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
    assert!(mean > 1.9 * 0.5 * expected);
}

/// One channel keeps its own value although directions follow luminance.
#[test]
fn colours_are_not_lost_in_luminance() {
    let map = RgbImage::from_fn(WIDTH, HEIGHT, |x, _| match x % 3 {
        0 => Rgb::new(1.0, 0.0, 0.0),
        1 => Rgb::new(0.0, 1.0, 0.0),
        _ => Rgb::new(0.0, 0.0, 1.0),
    });
    let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
    let at = point("diffuse:0.8".parse::<MaterialSpec>().unwrap().into(), 0.4);
    let light = EnvironmentSampling { environment: &env, n_samples: 1 };
    let reference = quadrature(&env, &at);
    let batches = batches(&light, &env, &at, SamplerKind::Independent);
    ZTest::default().against("coloured map", &batches, reference).unwrap();
}
