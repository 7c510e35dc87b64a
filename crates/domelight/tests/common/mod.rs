//! Points under coarse maps with some texels hidden, and their integrals by quadrature.

use domelight::bsdf::{Bsdf, Coat, MaterialSpec, MetallicRoughness, Sheen};
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::{Frame, Vec3, from_spherical, vec2, vec3};
use domelight::sampling::{Pcg32, Sampler, SamplerKind};
use domelight::strategy::{PointStrategy, SampleIndex, ShadingPoint};
use domelight::{Rgb, RgbImage};
use testkit::quadrature::{Adaptive, Rect};

pub(crate) const WIDTH: usize = 8;
pub(crate) const HEIGHT: usize = 6;

/// Of [`bsdf`].
pub(crate) const MATERIALS: [&str; 11] = [
    "diffuse:0.8,0.5,0.2",
    "phong:50:1:0",
    "phong:50:0.5:0.5",
    "ward:0.15:0.5",
    "ggx:0.05",
    "ggx:0.4",
    "beckmann:0.3",
    "mix",
    "gltf:0.9,0.6,0.3:0.5:0.5",
    "gltf:0.9,0.6,0.3:0.2:0.5:0.6:0.2,0.9,1:0.7",
    "layers",
];

/// What a text of `--material` says, or a leaning coat over sheen over a base.
pub(crate) fn bsdf(name: &str) -> Bsdf {
    if name != "layers" {
        return name.parse::<MaterialSpec>().unwrap().into();
    }
    let base = MetallicRoughness::new(Rgb::new(0.8, 0.3, 0.1), 0.2, 0.5);
    let sheen = Sheen::new(Rgb::new(0.2, 0.5, 1.0), 0.3);
    let coat = Coat::new(0.15, vec3(0.2, -0.1, 0.9));
    Bsdf::layered(base, Some(sheen), Some((0.8, coat)), from_spherical(0.4, 2.5))
}

/// Noise with a texel that outshines it near the horizon of most points.
pub(crate) fn environment(spots: bool, up: UpAxis) -> Environment {
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
pub(crate) fn hidden(env: &Environment, wi: Vec3) -> bool {
    let uv = env.uv(wi);
    let x = ((uv.x * WIDTH as f32) as usize).min(WIDTH - 1);
    let y = ((uv.y * HEIGHT as f32) as usize).min(HEIGHT - 1);
    (5 * x + 3 * y) % 7 < 2
}

/// A point whose shading normal is tilted against the surface, seen at `theta` from the former.
pub(crate) fn point(bsdf: Bsdf, theta: f32) -> ShadingPoint {
    let ng = vec3(0.3, 0.9, -0.2).normalize();
    let normal = vec3(0.4, 0.8, 0.1).normalize();
    let frame = Frame::from_z_and_tangent(normal, vec3(1.0, 0.2, 0.4));
    let wo = from_spherical(theta.cos(), 2.5);
    ShadingPoint { position: Vec3::ZERO, ng, frame, wo, bsdf: bsdf.for_view(wo) }
}

/// ∫ f dω over each texel in row order, `f` of the direction, its radiance and whether it is hidden.
pub(crate) fn texel_integrals<const N: usize>(
    env: &Environment,
    rule: Adaptive,
    mut f: impl FnMut(Vec3, Rgb, bool) -> [f64; N],
) -> Vec<[f64; N]> {
    let edges = |i: usize, n: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
    let middle = |[a, b]: [f64; 2]| 0.5 * (a + b) as f32;
    let mut texel = |column, row| {
        let (u, v) = (edges(column, WIDTH), edges(row, HEIGHT));
        let center = env.direction(vec2(middle(u), middle(v)));
        let (le, hidden) = (env.le(center), hidden(env, center));
        rule.rect(Rect { x: u, y: v }, &mut |u: f64, v: f64| {
            // dω = 2π² sin θ du dv
            let solid_angle = (std::f64::consts::PI * v).sin() * 2.0 * std::f64::consts::PI.powi(2);
            f(env.direction(vec2(u as f32, v as f32)), le, hidden).map(|f| f * solid_angle)
        })
    };
    (0..WIDTH * HEIGHT).map(|i| texel(i % WIDTH, i / WIDTH)).collect()
}

/// The sum over all texels.
pub(crate) fn integral<const N: usize>(
    env: &Environment,
    rule: Adaptive,
    f: impl FnMut(Vec3, Rgb, bool) -> [f64; N],
) -> [f64; N] {
    let texels = texel_integrals(env, rule, f);
    texels.iter().fold([0.0; N], |sum, t| std::array::from_fn(|k| sum[k] + t[k]))
}

/// ∫ f_r · cos θ · L · V dω.
pub(crate) fn quadrature(env: &Environment, at: &ShadingPoint) -> [f64; 3] {
    let rule = Adaptive { tolerance: 1e-5, min_depth: 2, max_depth: 8 };
    integral(env, rule, |wi, le, hidden| {
        if hidden { [0.0; 3] } else { (at.eval(wi) * le).to_array().map(f64::from) }
    })
}

/// The mean of the estimates of `n` samples of one stream.
pub(crate) fn estimate<S: PointStrategy>(
    strategy: &S,
    env: &Environment,
    at: &ShadingPoint,
    sampler: Sampler,
    n: u32,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut scratch = S::Scratch::default();
    for sample in 0..n {
        strategy.sample(at, SampleIndex { sampler, sample }, &mut scratch, |wi, weight| {
            if !hidden(env, wi) {
                for (s, w) in sum.iter_mut().zip(weight.to_array()) {
                    *s += f64::from(w);
                }
            }
        });
    }
    sum.map(|s| s / f64::from(n))
}

/// Batches of `n` samples of one strategy: of independent numbers, or each a scrambling of the Sobol' points.
pub(crate) fn batches<S: PointStrategy>(
    strategy: &S,
    env: &Environment,
    at: &ShadingPoint,
    kind: SamplerKind,
    n: u32,
) -> Vec<[f64; 3]> {
    assert!(S::UNBIASED);
    (0..40).map(|b| estimate(strategy, env, at, Sampler::new(kind, 5, b), n)).collect()
}

/// The same light from everywhere.
pub(crate) fn white_environment() -> Environment {
    let map = RgbImage::filled(WIDTH, HEIGHT, Rgb::WHITE);
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}
