//! The layer `variance` against the squared error over seeds, and a target error against the error that is reached: every
//! strategy on five scenes.

use domelight::RgbImage;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::render::{Layers, RenderSettings, Renderer};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, Scene};
use rayon::prelude::*;

const WIDTH: usize = 20;
const HEIGHT: usize = 16;

const PAIRS: [(BuiltinScene, BuiltinProbe); 5] = [
    (BuiltinScene::Statue, BuiltinProbe::Sky),
    (BuiltinScene::Spheres, BuiltinProbe::Studio),
    (BuiltinScene::MaterialBall, BuiltinProbe::Cathedral),
    (BuiltinScene::Sphere, BuiltinProbe::Constant),
    (BuiltinScene::SphereOrthographic, BuiltinProbe::Sky),
];

const STRATEGIES: [&str; 8] = [
    "brdf:2",
    "environment:2",
    "mis:1:1",
    "product:4",
    "rejection:8",
    "sir:1/8",
    "median-cut:16",
    "variance-minimization:16",
];

fn environment(probe: BuiltinProbe) -> Environment {
    Environment::new(probe.image(32), Orientation::default(), 1.0).unwrap()
}

fn picture(
    scene: &Scene,
    environment: &Environment,
    strategy: &str,
    settings: RenderSettings,
) -> Layers {
    let camera = Camera::framing(scene, settings.width, settings.height);
    let spec = strategy.parse().unwrap();
    let mut renderer = Renderer::new(scene, &camera, environment, spec, settings).unwrap();
    renderer.run(&());
    renderer.rendering().layers
}

fn channels(image: &RgbImage) -> impl Iterator<Item = f64> {
    image.pixels.iter().flat_map(|p| p.to_array()).map(f64::from)
}

/// The mean over pixels and seeds of the layer, over that of the squared error.
fn estimate_over_error(pictures: &[Layers]) -> f64 {
    let n = pictures.len() as f64;
    let mut sums = vec![[0.0; 2]; 3 * WIDTH * HEIGHT];
    for picture in pictures {
        for (sum, x) in sums.iter_mut().zip(channels(&picture.color)) {
            *sum = [sum[0] + x, sum[1] + x * x];
        }
    }
    let error: f64 = sums.iter().map(|[x, square]| (square - x * x / n) / (n - 1.0)).sum();
    let estimate: f64 = pictures.iter().flat_map(|picture| channels(&picture.variance)).sum();
    estimate / n / error
}

/// Averaged over pixels, within a fifth, from 64 seeds.
#[test]
fn the_variance_layer_is_the_error_of_every_strategy() {
    const SEEDS: u64 = 64;
    let mut wrong = Vec::new();
    for (builtin, probe) in PAIRS {
        let (scene, environment) = (Scene::builtin(builtin), environment(probe));
        for strategy in STRATEGIES {
            let seeds = (0..SEEDS).into_par_iter();
            let of_seed = |seed| {
                let settings = RenderSettings {
                    width: WIDTH,
                    height: HEIGHT,
                    n_samples: 16,
                    seed,
                    ..RenderSettings::default()
                };
                picture(&scene, &environment, strategy, settings)
            };
            let ratio = estimate_over_error(&seeds.map(of_seed).collect::<Vec<_>>());
            if !(0.8..1.2).contains(&ratio) {
                wrong.push(format!("{} {} {strategy}: {ratio:.3}", builtin.name(), probe.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the layer costs `product`: second sets of samples, which are no more than a fiftieth of all. Other pixels have the
/// same samples with them and without, and strategies of one round have none.
#[test]
fn the_variance_layer_takes_a_fiftieth_of_the_samples_at_most() {
    let (scene, environment) =
        (Scene::builtin(BuiltinScene::Spheres), environment(BuiltinProbe::Sky));
    let settings = RenderSettings {
        width: 160,
        height: 128,
        n_samples: 4,
        adaptive: false,
        ..RenderSettings::default()
    };
    let spent = |strategy| {
        let n_samples = picture(&scene, &environment, strategy, settings).n_samples;
        n_samples.iter().map(|&n| u64::from(n)).sum::<u64>() as f64 / (160.0 * 128.0 * 4.0)
    };
    assert_eq!(spent("mis"), 1.0);
    let product = spent("product:4");
    assert!((1.005..1.02).contains(&product), "{product}");
}

/// Tiles that stop because the target is reached have it within a factor of 1.5, on average over tiles and seeds.
#[test]
fn a_target_error_is_reached_within_a_factor_of_one_and_a_half() {
    const SIZE: usize = 48;
    const TILE: usize = 16;
    const SEEDS: u64 = 6;
    let cases = [
        (BuiltinScene::Spheres, BuiltinProbe::Cathedral),
        (BuiltinScene::Statue, BuiltinProbe::Studio),
        (BuiltinScene::MaterialBall, BuiltinProbe::Sky),
    ];
    let targets = [("mis:1:1", [1e-2, 2e-3]), ("product:4", [1e-3, 2e-4])];
    let mut wrong = Vec::new();
    for (builtin, probe) in cases {
        let (scene, environment) = (Scene::builtin(builtin), environment(probe));
        let settings = RenderSettings { width: SIZE, height: SIZE, ..RenderSettings::default() };
        let converged = RenderSettings { n_samples: 2048, adaptive: false, seed: 99, ..settings };
        let reference = picture(&scene, &environment, "product:8", converged).color;
        for (strategy, targets) in targets {
            for target in targets {
                let of_seed = |seed| {
                    let settings = RenderSettings {
                        n_samples: 1 << 14,
                        target_error: Some(target),
                        seed,
                        ..settings
                    };
                    picture(&scene, &environment, strategy, settings)
                };
                let pictures: Vec<Layers> = (0..SEEDS).into_par_iter().map(of_seed).collect();
                let mut reached = Vec::new();
                for picture in &pictures {
                    for tile in 0..(SIZE / TILE).pow(2) {
                        let corner = [tile % (SIZE / TILE) * TILE, tile / (SIZE / TILE) * TILE];
                        let pixels = || {
                            (0..TILE * TILE)
                                .map(|i| (corner[1] + i / TILE) * SIZE + corner[0] + i % TILE)
                        };
                        // Tiles that 16 samples are more than enough for do not stop at the target. The first pixel
                        // has the usual number of samples.
                        if picture.n_samples[corner[1] * SIZE + corner[0]] > 16 {
                            reached.push(rel_mse(&picture.color, &reference, pixels()));
                        }
                    }
                }
                let ratio = reached.iter().sum::<f64>() / reached.len() as f64 / f64::from(target);
                let name = format!("{} {} {strategy}", builtin.name(), probe.name());
                println!("{name} to {target:e}: {ratio:.2} over {} tiles", reached.len());
                if !(1.0 / 1.5..1.5).contains(&ratio) {
                    wrong.push(format!("{name} to {target:e}: {ratio:.3}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The mean over some pixels of the squared error of the luminance, relative to the reference's.
fn rel_mse(picture: &RgbImage, reference: &RgbImage, pixels: impl Iterator<Item = usize>) -> f64 {
    let error = |i: usize| {
        let [x, r] = [picture, reference].map(|image| f64::from(image.pixels[i].luminance()));
        (x - r).powi(2) / (r * r + 0.01)
    };
    let errors: Vec<f64> = pixels.map(error).collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}
