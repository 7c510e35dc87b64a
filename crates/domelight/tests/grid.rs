//! Every lobe at its extremes × every extreme map × every strategy × short and long passes × normal and grazing views:
//! no NaN, no infinity, and no bias.

use domelight::bsdf::{Bsdf, Coat, MaterialSpec, MetallicRoughness, Sheen};
use domelight::environment::{Environment, Orientation};
use domelight::math::{Frame, Vec3, from_spherical, vec3};
use domelight::render::{Background, RenderSettings, Renderer};
use domelight::rig::RigError;
use domelight::sampling::{Pcg32, Sampler, SamplerKind};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, Scene};
use domelight::strategy::levels::level;
use domelight::strategy::{
    Contributions, PixelPoints, PrepareError, PreparedStrategy, ShadingPoint, Strategy,
    StrategySpec, TileShading,
};
use domelight::{Rgb, RgbImage};
use rayon::prelude::*;
use testkit::{Suite, ZTest};

/// Smooth and narrow, black and white, metal and dielectric. What is narrow lies on a base that reflects every channel that
/// it does: by luminance, `sir` picks its reflection of a dim sky once in ten thousand samples where the base shows a sun.
const LOBES: [(&str, Width); 32] = [
    ("diffuse:1", Width::Wide),
    ("diffuse:0", Width::Wide),
    ("phong:0:1:0", Width::Wide),
    ("phong:1e5:1:0", Width::Narrow),
    ("phong:50:0.5:0.5", Width::Narrow),
    ("ward:1e-4:1", Width::Narrow),
    ("ward:0.5:0.5", Width::Wide),
    ("ward:1e-4:1e-4:1:1992", Width::Beyond),
    ("ward:0.3:0.2:0.5:1992", Width::Beyond),
    ("ward:1e-4:1e-4:1:duer", Width::Beyond),
    ("ward:0.3:0.2:0.5:duer", Width::Beyond),
    ("ggx:1e-4", Width::Narrow),
    ("ggx:1e-4:silver", Width::Narrow),
    ("ggx:0.3:copper:correlated", Width::Narrow),
    ("ggx:0.05", Width::Narrow),
    ("ggx:10", Width::Beyond),
    ("beckmann:1e-4", Width::Narrow),
    ("beckmann:0.5", Width::Wide),
    ("gltf:1,1,1:1:0", Width::Narrow),
    ("gltf:1,1,1:1:1", Width::Wide),
    ("gltf:1,1,1:0:0", Width::Narrow),
    ("gltf:1,1,1:0:0.14", Width::Narrow),
    ("gltf:1,0,0.5:0.5:1", Width::Wide),
    ("gltf:0:1:1", Width::Beyond),
    ("gltf:1:0:0:0", Width::Wide),
    ("gltf:1,0.5,0.1:0.2:0.14:0.5:1,0.2,0", Width::Narrow),
    ("gltf:1:0.5:0.1:1:1:1", Width::Narrow),
    ("smooth glass", Width::Narrow),
    ("milk glass under a coat", Width::Narrow),
    ("the narrowest sheen on white", Width::Wide),
    ("the smoothest coat, leaning, on gray", Width::Narrow),
    ("a coat on sheen on a smooth metal", Width::Narrow),
];

/// What a text of `--material` says, or layers by their names in [`LOBES`], seen at the cosine `cos_o`.
fn bsdf(text: &str, cos_o: f32) -> Bsdf {
    let base =
        |color, metallic, roughness| MetallicRoughness::new(Rgb::splat(color), metallic, roughness);
    let (base, sheen, coat) = match text {
        "smooth glass" => (base(1.0, 0.0, 0.0).transmitting(1.0), None, None),
        "milk glass under a coat" => {
            let coat = Coat::new(0.0, Vec3::Z);
            (base(0.8, 0.0, 1.0).transmitting(0.5), None, Some((1.0, coat)))
        }
        "the narrowest sheen on white" => {
            (base(1.0, 0.0, 1.0), Some(Sheen::new(Rgb::WHITE, 0.0)), None)
        }
        "the smoothest coat, leaning, on gray" => {
            let leaning = Coat::new(0.0, vec3(0.5, 0.1, 1.0));
            (base(0.5, 0.0, 1.0), None, Some((1.0, leaning)))
        }
        "a coat on sheen on a smooth metal" => {
            let sheen = Sheen::new(Rgb::new(1.0, 0.0, 0.2), 1.0);
            (base(1.0, 1.0, 0.0), Some(sheen), Some((0.5, Coat::new(0.3, Vec3::Z))))
        }
        text => return text.parse::<MaterialSpec>().unwrap().into(),
    };
    Bsdf::layered(base, sheen, coat, from_spherical(cos_o, 2.5))
}

/// Whether samples of the environment alone find the lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Width {
    Wide,
    Narrow,
    /// Nor do those of the BRDF, most of which fall below the surface or have weights without a bound, or it is so dark
    /// that rays are rare: means of a few have no normal distribution.
    Beyond,
}

/// Whether samples of the BRDF alone find the light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    Even,
    Spotted,
}

fn maps() -> Vec<(&'static str, Light, Environment)> {
    let environment = |map| Environment::new(map, Orientation::default(), 1.0).unwrap();
    let even = |x, width, height| environment(RgbImage::filled(width, height, Rgb::splat(x)));
    let mut pcg = Pcg32::new(17, 0);
    let mut noise = |scale: Rgb| {
        environment(RgbImage::from_fn(8, 6, |_, _| {
            Rgb::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) * scale
        }))
    };
    let sun = |x: f32, sky: f32| {
        let at_sun = |c, r| (c, r) == (5, 2);
        environment(RgbImage::from_fn(16, 12, |c, r| {
            Rgb::splat(if at_sun(c, r) { x } else { sky })
        }))
    };
    vec![
        ("a sun alone", Light::Spotted, sun(1e4, 0.0)),
        ("a sun over a dim sky", Light::Spotted, sun(1e4, 1e-2)),
        ("black", Light::Even, even(0.0, 8, 6)),
        ("even", Light::Even, even(1.0, 8, 6)),
        ("one texel", Light::Even, even(1.0, 1, 1)),
        ("one column", Light::Even, even(1.0, 1, 100)),
        ("one row", Light::Even, even(1.0, 100, 1)),
        ("without blue", Light::Even, noise(Rgb::new(1.0, 1.0, 0.0))),
        ("blue alone", Light::Even, noise(Rgb::new(0.0, 0.0, 1.0))),
        ("even 1.2e-38", Light::Even, even(1.2e-38, 8, 6)),
        ("noise 1e-30", Light::Even, noise(Rgb::splat(1e-30))),
        ("noise 1e30", Light::Even, noise(Rgb::splat(1e30))),
        ("even 3e38", Light::Even, even(3e38, 8, 6)),
        ("a sun 3e38", Light::Spotted, sun(3e38, 1e-38)),
        ("a sun 1e-42", Light::Spotted, sun(1e-42, 0.0)),
    ]
}

/// Camera samples of a pixel in a short pass of `product`, and in a long one.
const SHORT: usize = 2;
const LONG: usize = 9;

/// Strategies, camera samples, and the lobes and lights of which so few samples are enough for a t-test: of others rare
/// samples decide.
const STRATEGIES: [(&str, usize, Option<Width>, Option<Light>); 9] = [
    ("environment:2", SHORT, Some(Width::Wide), Some(Light::Even)),
    ("brdf:2", SHORT, None, Some(Light::Even)),
    ("mis:1:1", SHORT, None, None),
    ("rejection:16", SHORT, Some(Width::Wide), Some(Light::Even)),
    ("sir:1/1", 3, None, None),
    ("sir:2/7", SHORT, None, None),
    ("product:8", SHORT, None, None),
    ("product:1", LONG, None, None),
    ("product:1", 1, None, None),
];

/// Fixed lights, which err by what they leave out: they are only finite.
const RIGS: [&str; 3] =
    ["median-cut:4", "variance-minimization:4", "variance-minimization:4:rule=2009"];

/// A tile of 3 × 3 pixels, which are of all levels.
const SIDE: usize = 3;

/// A point seen at the cosine `cos_o` from its normal.
fn point(bsdf: Bsdf, cos_o: f32) -> ShadingPoint {
    let ng = vec3(0.3, 0.9, -0.2).normalize();
    let frame = Frame::from_z_and_tangent(ng, vec3(1.0, 0.2, 0.4));
    let wo = from_spherical(cos_o, 2.5);
    ShadingPoint { position: Vec3::ZERO, ng, frame, wo, bsdf: bsdf.for_view(wo) }
}

/// V of a direction: in three steps, so that none is a mean of the others.
fn visibility(wi: Vec3) -> f32 {
    if wi.x > 0.3 {
        1.0
    } else if wi.x > -0.4 {
        0.25
    } else {
        0.0
    }
}

/// The mean over a tile, in multiples of the strategy's unit.
fn estimate<S: Strategy>(strategy: &S, at: &ShadingPoint, n: usize, seed: u64) -> [f64; 3] {
    let kind = if n.is_multiple_of(2) { SamplerKind::Sobol } else { SamplerKind::Independent };
    let pass = strategy.begin_pass(Sampler::for_pass(kind, seed, 0), n as u32);
    let (mut scratch, mut out) = (S::Scratch::default(), Contributions::default());
    let n_rounds = strategy.n_rounds();
    let mut sum = [0.0; 3];
    for round in 0..n_rounds {
        let (mut points, mut samples) = (Vec::new(), Vec::new());
        let pixels: Vec<PixelPoints> = (0..SIDE * SIDE)
            .map(|i| {
                let start = points.len();
                if n_rounds == 1 || level(i % SIDE, i / SIDE) == round {
                    points.extend(std::iter::repeat_n(*at, n));
                    samples.extend(0..n as u32);
                }
                let count = (points.len() - start) as u32;
                let sampler = Sampler::new(kind, seed, i as u64);
                PixelPoints::new(start..points.len(), count, sampler)
            })
            .collect();
        let tile = TileShading::new(&points, &samples, &pixels, SIDE);
        out.reset(points.len());
        strategy.push(&pass, &tile, round, &mut scratch, &mut out);
        let visible: Vec<f32> = out.wi.iter().map(|&wi| visibility(wi)).collect();
        let seen = out.weight.iter().zip(&visible).map(|(&weight, &v)| weight * v);
        for color in out.base.iter().copied().chain(seen) {
            assert!(color.is_finite(), "{color:?}");
            sum.iter_mut().zip(color.to_array()).for_each(|(sum, x)| *sum += f64::from(x));
        }
        if round + 1 < n_rounds {
            strategy.learn(&tile, &out, &visible, &mut scratch);
        }
    }
    sum.map(|sum| sum / (SIDE * SIDE * n) as f64)
}

/// Batches of 64 times the estimates, whose standard error is an eighth.
fn long_batches<S: Strategy>(strategy: &S, at: &ShadingPoint, n: usize) -> Vec<[f64; 3]> {
    const LENGTH: u64 = 64;
    let mean = |batch: u64| {
        let seeds = batch * LENGTH..(batch + 1) * LENGTH;
        let mut sums = [0.0; 3];
        for seed in seeds {
            let of_seed = estimate(strategy, at, n, seed);
            sums.iter_mut().zip(of_seed).for_each(|(sum, x)| *sum += x / LENGTH as f64);
        }
        sums
    };
    (0..32).map(mean).collect()
}

fn batches<S: Strategy>(strategy: &S, at: &ShadingPoint, n: usize, seed: u64) -> Vec<[f64; 3]> {
    (0..32).map(|batch| estimate(strategy, at, n, seed + batch)).collect()
}

#[test]
fn no_value_is_beyond_any_strategy() {
    let maps = maps();
    let views = [1.0, 1e-4];
    let n_tests = LOBES.len() * maps.len() * views.len() * STRATEGIES.len();
    let test = ZTest { suite: Suite::of(n_tests), ..ZTest::default() };
    let cells: Vec<_> =
        LOBES.iter().flat_map(|lobe| maps.iter().map(move |map| (lobe, map))).collect();
    cells.par_iter().for_each(|&(&(text, width), (name, light, env))| {
        let prepare = |text: &str| {
            let spec: StrategySpec = text.parse().unwrap();
            PreparedStrategy::new(spec, env).unwrap()
        };
        for view in views {
            let at = point(bsdf(text, view), view);
            let reference = batches(&prepare("mis:4:4"), &at, 8, 1 << 20);
            for (strategy, n, needed_width, needed_light) in STRATEGIES {
                let label = format!("{strategy}, {text}, {name}, view {view}");
                let batches = batches(&prepare(strategy), &at, n, 0);
                assert!(batches.iter().flatten().all(|x| x.is_finite()), "{label}");
                let is_tested = width != Width::Beyond
                    && needed_width.is_none_or(|needed| needed == width)
                    && needed_light.is_none_or(|needed| needed == *light);
                if is_tested {
                    // Narrow lobes beside a sun hang on events that few of these batches have: more must agree.
                    if test.two_sample(&label, &batches, &reference).is_err() {
                        let batches = long_batches(&prepare(strategy), &at, n);
                        test.two_sample(&label, &batches, &reference)
                            .unwrap_or_else(|f| panic!("{f}"));
                    }
                }
            }
            for rig in RIGS.iter().filter_map(|text| rig(text, env)) {
                let estimate = estimate(&rig, &at, SHORT, 0);
                let label = format!("lights, {text}, {name}, view {view}");
                assert!(estimate.iter().all(|x| x.is_finite()), "{label}: {estimate:?}");
            }
        }
    });
}

/// The lights of a map, if it has as many texels with light.
fn rig<'e>(text: &str, environment: &'e Environment) -> Option<PreparedStrategy<'e>> {
    match PreparedStrategy::new(text.parse().unwrap(), environment) {
        Err(PrepareError::Lights(RigError::Black | RigError::TooFewTexels { .. })) => None,
        rig => Some(rig.unwrap()),
    }
}

/// A black metal reflects nothing at normal incidence, and a ten-thousandth of the light by rough slopes.
#[test]
fn what_is_black_at_normal_incidence_reflects_at_others() {
    let env = Environment::from_image(RgbImage::filled(8, 6, Rgb::WHITE)).unwrap();
    let at = point(bsdf("gltf:0:1:1", 1.0), 1.0);
    let prepare = |text: &str| PreparedStrategy::new(text.parse().unwrap(), &env).unwrap();
    let reference = batches(&prepare("mis:4:4"), &at, 8, 1);
    assert!(reference.iter().all(|mean| mean[0] > 1e-5));
    for (text, n) in [("product:8", SHORT), ("product:1", LONG), ("product:1", 1)] {
        let test = ZTest { suite: Suite::of(2), ..ZTest::default() };
        let strategy = prepare(text);
        // The light at grazing angles hangs on events that few of these batches have: more must agree.
        if test.two_sample(text, &batches(&strategy, &at, n, 1), &reference).is_err() {
            let batches = long_batches(&strategy, &at, n);
            test.two_sample(text, &batches, &reference).unwrap_or_else(|f| panic!("{f}"));
        }
    }
}

/// A map 2ⁿ times as bright makes a picture 2ⁿ times as bright, to the bit, as far as single precision goes.
#[test]
fn only_ratios_of_radiance_matter() {
    let scene = Scene::builtin(BuiltinScene::Sphere);
    let settings =
        RenderSettings { width: 16, height: 16, n_samples: 4, ..RenderSettings::default() };
    let camera = Camera::framing(&scene, 16, 16);
    let map = |scale: f32| {
        RgbImage::from_fn(16, 8, |x, y| {
            let x = if (x, y) == (5, 2) { 1.9 } else { 0.001 * x as f32 };
            Rgb::splat(x * scale)
        })
    };
    let picture = |scale: f32, strategy: &str| {
        let environment = Environment::from_image(map(scale)).unwrap();
        let spec = strategy.parse().unwrap();
        let mut renderer = Renderer::new(&scene, &camera, &environment, spec, settings).unwrap();
        let film = renderer.finish();
        assert_eq!(renderer.counts().non_finite, 0, "{strategy} {scale:e}");
        film.layers()
    };
    for strategy in ["mis", "environment", "brdf", "rejection", "sir:1/8", "product"] {
        let ordinary = picture(1.0, strategy).color;
        for exponent in [-125, 70, 127] {
            let scale = 2f32.powi(exponent);
            let layers = picture(scale, strategy);
            assert!(layers.variance.pixels.iter().all(|v| v.is_finite()), "{strategy} {scale:e}");
            let mean = |image: &RgbImage| {
                image.pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>()
            };
            let ratio = mean(&layers.color) / mean(&ordinary) / f64::from(scale);
            // The numbers of samples of product depend on absolute brightness.
            let tolerance = if strategy == "product" { 0.05 } else { 1e-5 };
            assert!((ratio - 1.0).abs() < tolerance, "{strategy} {scale:e}: {ratio}");
        }
    }
}

/// The mean of a picture errs no more than twice as much as with `mis`, under equal texels whatever the map's shape, and
/// under every extreme map: one pool of light samples serves all pixels, and must not err for all of them.
#[test]
fn product_shares_no_error_under_extreme_maps() {
    const N_SEEDS: u64 = 24;
    let scene = Scene::builtin(BuiltinScene::Sphere);
    let camera = Camera::framing(&scene, 12, 12);
    let deviation = |environment: &Environment, strategy: &str| {
        let means: Vec<f64> = (0..N_SEEDS)
            .into_par_iter()
            .map(|seed| {
                let settings = RenderSettings {
                    width: 12,
                    height: 12,
                    n_samples: 16,
                    seed,
                    background: Background::Hidden,
                    ..RenderSettings::default()
                };
                let spec = strategy.parse().unwrap();
                let film = Renderer::new(&scene, &camera, environment, spec, settings);
                let color = film.unwrap().finish().layers().color;
                color.pixels.iter().map(|p| f64::from(p.luminance())).sum()
            })
            .collect();
        let mean = means.iter().sum::<f64>() / N_SEEDS as f64;
        (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / N_SEEDS as f64).sqrt() / mean
    };
    let check = |name: &str, environment: &Environment| {
        let [product, mis] = ["product", "mis"].map(|text| deviation(environment, text));
        assert!(product < 2.0 * mis, "{name}: {product} {mis}");
    };
    let shapes = [(1, 1), (1, 1000), (3, 1000), (1000, 1), (64, 32), (1, 4000), (16_000, 1)];
    for (width, height) in shapes {
        let map = RgbImage::filled(width, height, Rgb::WHITE);
        check(&format!("{width} x {height}"), &Environment::from_image(map).unwrap());
    }
    let lit = |(_, _, environment): &(_, _, Environment)| environment.table().is_some();
    for (name, _, environment) in maps().iter().filter(|map| lit(map)) {
        check(name, environment);
    }
    // Texels that differ cannot become fewer.
    let mut pcg = Pcg32::new(18, 0);
    for (width, height) in [(1, 4000), (3, 1000), (16_000, 1)] {
        let map = RgbImage::from_fn(width, height, |_, _| Rgb::splat(pcg.next_f32()));
        check(&format!("noise {width} x {height}"), &Environment::from_image(map).unwrap());
    }
}
