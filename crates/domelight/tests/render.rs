//! The renderer: the same bits however the work is divided, strategies that agree pixel by pixel,
//! and layers that mean what they say.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::{CompensatedTable, Environment, Orientation};
use domelight::geometry::Mesh;
use domelight::math::{Mat4, Vec3, vec3};
use domelight::render::{
    Background, ExposureBasis, Filter, Layers, Observer, Passes, RenderSettings, Renderer,
    Rendering, automatic_exposure, render,
};
use domelight::rig::{VarianceMinimization, variance_minimization};
use domelight::sampling::{Heuristic, Pcg32, SamplerKind};
use domelight::scene::builtin::shapes;
use domelight::scene::{
    Camera, CameraSettings, Material, Part, Projection, Scene, SceneDescription,
};
use domelight::strategy::{
    BrdfSampling, Candidates, EnvironmentSampling, LightSet, LightTable,
    MultipleImportanceSampling, ProductSampling, Proposal, RejectionSampling, Resampling,
    SamplingImportanceResampling, StoppingRule, Strategy,
};
use domelight::{Rgb, RgbImage};
use testkit::{Suite, ZTest};

fn bsdf(text: &str) -> Bsdf {
    text.parse::<MaterialSpec>().unwrap().into()
}

/// Two spheres on a floor, which shade each other.
fn scene(ball: &str) -> Scene {
    Scene::new(description(ball)).unwrap()
}

fn description(ball: &str) -> SceneDescription {
    let place = |mut mesh: Mesh, m: Mat4| {
        mesh.transform(&m);
        mesh
    };
    let sphere = |x: f32, r: f32| {
        let m = Mat4::from_translation(vec3(x, r, 0.0)) * Mat4::from_scale(Vec3::splat(r));
        place(shapes::icosphere(3), m)
    };
    let part = |name: &str, mesh, material| Part { name: name.into(), mesh, material };
    let material = |name: &str, text| Material::fixed(name, bsdf(text));
    SceneDescription {
        parts: vec![
            part("left", sphere(-0.8, 0.8), 0),
            part("right", sphere(0.7, 0.5), 0),
            part("floor", shapes::disc(4.0, 48), 1),
        ],
        materials: vec![material("ball", ball), material("gray", "diffuse:0.5")],
        ..SceneDescription::default()
    }
}

fn view() -> CameraSettings {
    CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: 35.0 },
        origin: vec3(0.0, 1.6, 5.0),
        target: vec3(0.0, 0.6, 0.0),
        up: Vec3::Y,
    }
}

fn camera(settings: &RenderSettings) -> Camera {
    Camera::new(&view(), settings.width, settings.height).unwrap()
}

/// A bright patch on a noisy sky, wide enough that BRDF samples find it in every batch: the t-test
/// needs batch means that are nearly normal.
fn environment() -> Environment {
    let mut pcg = Pcg32::new(2, 0);
    let mut map = RgbImage::from_fn(32, 16, |_, y| {
        let level = if y < 8 { 0.3 } else { 0.1 };
        Rgb::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) * level
    });
    for y in 3..6 {
        map.pixels[y * 32 + 3..y * 32 + 8].fill(Rgb::new(4.0, 3.5, 3.0));
    }
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

fn mis(environment: &Environment) -> MultipleImportanceSampling<'_> {
    MultipleImportanceSampling::new(environment, LightTable::Full, Heuristic::Balance, 1, 1)
        .unwrap()
}

fn draw<S: Strategy>(
    scene: &Scene,
    environment: &Environment,
    strategy: &S,
    settings: &RenderSettings,
) -> Rendering {
    render(scene, &camera(settings), environment, strategy, settings, &())
}

fn small() -> RenderSettings {
    RenderSettings { width: 45, height: 37, n_samples: 9, seed: 3, ..RenderSettings::default() }
}

fn bits(layers: &Layers) -> Vec<u32> {
    let images = [&layers.color, &layers.unoccluded, &layers.albedo, &layers.variance];
    let colors = images.into_iter().flat_map(|i| &i.pixels).flat_map(|p| p.to_array());
    let normals = layers.normal.iter().flat_map(Vec3::to_array);
    let others = layers.alpha.iter().chain(&layers.depth).copied();
    colors.chain(normals).chain(others).map(f32::to_bits).collect()
}

#[test]
fn the_same_bits_for_any_threads_and_tiles() {
    let environment = environment();
    same_bits("mis", &environment, &mis(&environment));
    let sir = SamplingImportanceResampling {
        environment: &environment,
        n_candidates: 16,
        n_samples: 3,
        candidates: Candidates::default(),
        resampling: Resampling::default(),
    };
    same_bits("sir", &environment, &sir);
    let stop = StoppingRule::Accepted { n: 2, max_tries: 20 };
    let rejection = RejectionSampling::new(&environment, Proposal::Tighter, stop).unwrap();
    same_bits("rejection", &environment, &rejection);
    let rig = variance_minimization(&environment, 8, VarianceMinimization::default()).unwrap();
    same_bits("lights", &environment, &LightSet { rig: rig.clone(), unit: 1.0 });
}

/// A strategy that learns from a tile's other pixels depends on the tiles, but not on who renders them.
#[test]
fn what_is_learned_does_not_depend_on_threads() {
    let (scene, environment) = (scene("ggx:0.2"), environment());
    let strategy = ProductSampling::new(&environment, 3);
    let picture = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = RenderSettings { n_samples: 20, ..small() };
        let picture = pool.install(|| draw(&scene, &environment, &strategy, &settings));
        (bits(&picture.layers), picture.counts)
    };
    let expected = picture(1);
    assert!(picture(2) == expected && picture(5) == expected);
}

fn same_bits<S: Strategy>(name: &str, environment: &Environment, strategy: &S) {
    let scene = scene("ggx:0.2");
    let picture = |threads: usize, tile_size: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = RenderSettings { tile_size, ..small() };
        let picture = pool.install(|| draw(&scene, environment, strategy, &settings));
        (bits(&picture.layers), picture.layers.n_samples, picture.counts)
    };
    let expected = picture(1, 16);
    for (threads, tile_size) in [(2, 16), (5, 16), (2, 7), (1, 64), (3, 1)] {
        let same = picture(threads, tile_size) == expected;
        assert!(same, "{name}: {threads} threads, tiles of {tile_size}");
    }
}

#[test]
fn seeds_and_samplers_differ() {
    let (scene, environment) = (scene("diffuse:0.8"), environment());
    let strategy = mis(&environment);
    let picture = |settings| bits(&draw(&scene, &environment, &strategy, &settings).layers);
    let first = picture(small());
    assert!(first != picture(RenderSettings { seed: 4, ..small() }));
    assert!(first != picture(RenderSettings { sampler: SamplerKind::Independent, ..small() }));
}

/// Every pixel and channel of pictures under many seeds, strategy against strategy.
#[test]
fn strategies_agree_pixel_by_pixel() {
    let environment = environment();
    let settings =
        RenderSettings { width: 12, height: 9, n_samples: 128, ..RenderSettings::default() };
    let n_values = settings.width * settings.height;
    let compensated = CompensatedTable::new(&environment);
    let compensated = MultipleImportanceSampling::new(
        &environment,
        LightTable::Compensated(compensated),
        Heuristic::Power,
        2,
        1,
    )
    .unwrap();
    // A narrower lobe would give environment samples rare large values, and the t-test batch means
    // that are far from normal; tests/unbiased.rs has narrow lobes with larger batches.
    let product = ProductSampling::new(&environment, 2);
    let balls = ["diffuse:0.8", "phong:8:0.6:0.3"];
    for ball in balls {
        let scene = scene(ball);
        let brdf = BrdfSampling { environment: &environment, n_samples: 2 };
        let light = EnvironmentSampling { environment: &environment, n_samples: 2 };
        let balance = pictures(&scene, &environment, &mis(&environment), &settings);
        let others = [
            ("brdf", pictures(&scene, &environment, &brdf, &settings)),
            ("environment", pictures(&scene, &environment, &light, &settings)),
            ("compensated", pictures(&scene, &environment, &compensated, &settings)),
            ("product", pictures(&scene, &environment, &product, &settings)),
        ];
        let suite = Suite::of(others.len() * balls.len() * n_values);
        let test = ZTest { suite, ..ZTest::default() };
        for (name, other) in &others {
            for i in 0..n_values {
                let pixel = |pictures: &[RgbImage]| -> Vec<[f64; 3]> {
                    pictures.iter().map(|p| p.pixels[i].to_array().map(f64::from)).collect()
                };
                let name = format!("{name} against mis, {ball}, pixel {i}");
                let result = test.two_sample(&name, &pixel(other), &pixel(&balance));
                result.unwrap_or_else(|f| panic!("{f}"));
            }
        }
    }
}

fn pictures<S: Strategy>(
    scene: &Scene,
    environment: &Environment,
    strategy: &S,
    settings: &RenderSettings,
) -> Vec<RgbImage> {
    let picture = |seed| {
        let settings = RenderSettings { seed, ..*settings };
        draw(scene, environment, strategy, &settings).layers.color
    };
    (0..40).map(picture).collect()
}

#[test]
fn noisy_pixels_get_more_camera_samples() {
    let (scene, environment) = (scene("ggx:0.2"), environment());
    let strategy = ProductSampling::new(&environment, 4);
    let picture = |adaptive| {
        let settings = RenderSettings { n_samples: 40, adaptive, ..small() };
        draw(&scene, &environment, &strategy, &settings)
    };
    // One pixel in 64 has a second set, from which the variance is estimated.
    let even = picture(false).layers.n_samples;
    assert!(even.iter().all(|&n| n == 40 || n == 80));
    let second = even.iter().filter(|&&n| n == 80).count();
    assert!((10..50).contains(&second), "{second}");
    let Rendering { layers, counts, complete, .. } = picture(true);
    assert!(complete);
    let [least, most] = [layers.n_samples.iter().min(), layers.n_samples.iter().max()];
    assert!(least < Some(&40) && most > Some(&40), "{least:?} {most:?}");
    let sum: u64 = layers.n_samples.iter().map(|&n| u64::from(n)).sum();
    assert_eq!(sum, counts.camera_rays);
    let hits: u64 = layers.n_hits.iter().map(|&n| u64::from(n)).sum();
    assert_eq!(hits, counts.shading_points);
}

/// With any number asked for, and however the picture is divided; as nearly as the scouts of a small picture show.
#[test]
fn adaptive_sampling_spends_about_what_was_asked_for() {
    let environment = environment();
    for (ball, background) in [("ggx:0.2", Background::Hidden), ("diffuse:0.8", Background::Shown)]
    {
        let scene = scene(ball);
        let strategy = ProductSampling::new(&environment, 8);
        for (n_samples, tile_size) in [(2, 16), (8, 16), (24, 32), (100, 16)] {
            let settings = RenderSettings {
                width: 96,
                height: 80,
                n_samples,
                tile_size,
                background,
                ..small()
            };
            let counts = draw(&scene, &environment, &strategy, &settings).counts;
            let spent = counts.camera_rays as f64 / (96.0 * 80.0 * f64::from(n_samples));
            assert!((spent - 1.0).abs() < 0.2, "{ball}, {n_samples}: {spent}");
        }
    }
}

/// The layer `variance`, averaged over pixels, is the mean squared error over seeds: for sequences, for strategies that
/// place a pixel's rays together, and for sets of passes.
#[test]
fn the_variance_layer_is_the_error_over_seeds() {
    let (scene, environment) = (scene("ggx:0.3"), environment());
    let check = |name: &str, picture: &dyn Fn(u64) -> Layers| {
        const SEEDS: u64 = 64;
        let pictures: Vec<Layers> = (0..SEEDS).map(picture).collect();
        let mean_picture = mean(&pictures.iter().map(|p| p.color.clone()).collect::<Vec<_>>());
        let channels = |image: &RgbImage| -> Vec<f64> {
            image.pixels.iter().flat_map(|p| p.to_array()).map(f64::from).collect()
        };
        let means = channels(&mean_picture);
        let (mut error, mut estimate) = (0.0, 0.0);
        for picture in &pictures {
            let squares = channels(&picture.color).into_iter().zip(&means);
            error += squares.map(|(x, m)| (x - m).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
            estimate += channels(&picture.variance).iter().sum::<f64>() / SEEDS as f64;
        }
        let ratio = estimate / error;
        assert!((0.8..1.25).contains(&ratio), "{name}: {ratio}");
    };
    let base = RenderSettings { n_samples: 16, ..small() };
    let at = |n_samples, seed| RenderSettings { n_samples, seed, ..base };
    let mis = mis(&environment);
    let product = ProductSampling::new(&environment, 4);
    for n in [8, 16, 24] {
        check(&format!("mis, {n}"), &|s| draw(&scene, &environment, &mis, &at(n, s)).layers);
        let picture = |s| draw(&scene, &environment, &product, &at(n, s)).layers;
        check(&format!("product, {n}"), &picture);
    }
    let even = |s| RenderSettings { adaptive: false, ..at(16, s) };
    check("even product", &|s| draw(&scene, &environment, &product, &even(s)).layers);
    let independent = |s| RenderSettings { sampler: SamplerKind::Independent, ..at(16, s) };
    check("independent", &|s| draw(&scene, &environment, &mis, &independent(s)).layers);
    // Until the samples are spent.
    let sets = |s| RenderSettings { target_error: Some(1e-12), ..at(24, s) };
    check("sets of mis", &|s| draw(&scene, &environment, &mis, &sets(s)).layers);
    check("sets of product", &|s| draw(&scene, &environment, &product, &sets(s)).layers);
}

/// Pixels that get more samples where others are noisy, and visibility learned from others, leave no error behind that
/// seeds have in common.
#[test]
fn the_mean_of_32_pictures_has_a_32nd_of_the_error() {
    let (scene, environment) = (scene("ggx:0.2"), environment());
    let settings = RenderSettings { n_samples: 8, filter: Filter::Box, ..small() };
    let strategy = ProductSampling::new(&environment, 4);
    let pictures: Vec<Layers> = (0..32)
        .map(|seed| {
            let settings = RenderSettings { seed, ..settings };
            draw(&scene, &environment, &strategy, &settings).layers
        })
        .collect();
    let some = |p: &Layers, f: fn(&u32) -> bool| p.n_samples.iter().any(f);
    assert!(pictures.iter().all(|p| some(p, |&n| n < 8) && some(p, |&n| n > 8)));

    let converged = |seed| {
        let settings = RenderSettings { n_samples: 2048, seed, ..settings };
        draw(&scene, &environment, &mis(&environment), &settings).layers.color
    };
    let halves = [converged(1000), converged(1001)];
    let reference = mean(&halves);
    let noise = rel_mse(&halves[0], &halves[1]) / 4.0;
    let colors: Vec<RgbImage> = pictures.into_iter().map(|p| p.color).collect();
    let single = colors.iter().map(|c| rel_mse(c, &reference)).sum::<f64>() / 32.0 - noise;
    let left = rel_mse(&mean(&colors), &reference) - noise;
    let ratio = left / (single / 32.0);
    assert!((0.8..1.25).contains(&ratio), "{ratio}: {left} of {single}, reference {noise}");
}

fn mean(pictures: &[RgbImage]) -> RgbImage {
    let RgbImage { width, height, .. } = pictures[0];
    let pixel = |i: usize| {
        let sum: Rgb = pictures.iter().map(|p| p.pixels[i]).sum();
        sum / pictures.len() as f32
    };
    RgbImage::new(width, height, (0..width * height).map(pixel).collect())
}

fn rel_mse(picture: &RgbImage, reference: &RgbImage) -> f64 {
    let error = |(p, r): (f32, f32)| f64::from((p - r) * (p - r) / (r * r + 0.01));
    let pairs = picture.pixels.iter().zip(&reference.pixels);
    let errors = pairs.flat_map(|(p, r)| p.to_array().into_iter().zip(r.to_array())).map(error);
    errors.sum::<f64>() / (3 * reference.pixels.len()) as f64
}

#[test]
fn a_white_sphere_in_a_white_furnace_vanishes() {
    let environment = Environment::constant(Rgb::WHITE).unwrap();
    let sphere = Part { name: "sphere".into(), mesh: shapes::icosphere(4), material: 0 };
    let scene = Scene::new(SceneDescription {
        parts: vec![sphere],
        materials: vec![Material::fixed("white", bsdf("diffuse:1"))],
        ..SceneDescription::default()
    })
    .unwrap();
    let settings = RenderSettings { width: 24, height: 24, ..small() };
    // Cosine sampling has no variance here; a shading normal that is not the facet's loses what
    // lies below the facet, which is less than one part in a hundred for these facets.
    let strategy = BrdfSampling { environment: &environment, n_samples: 4 };
    let picture = draw(&scene, &environment, &strategy, &settings);
    for (i, p) in picture.layers.color.pixels.iter().enumerate() {
        assert!((0.96..=1.0001).contains(&p.g), "pixel {i}: {p:?}");
    }
    assert_eq!(picture.counts.non_finite, 0);
}

#[test]
fn layers_mean_what_they_say() {
    let (scene, environment) = (scene("diffuse:0.8"), environment());
    let settings = RenderSettings {
        background: Background::Hidden,
        filter: Filter::Box,
        n_samples: 16,
        ..small()
    };
    let Rendering { layers, counts, complete, .. } =
        draw(&scene, &environment, &mis(&environment), &settings);
    assert!(complete);
    assert_eq!(counts.camera_rays, 45 * 37 * 16);
    let covered: f32 = layers.alpha.iter().sum();
    assert_eq!((covered * 16.0).round() as u64, counts.shading_points);
    for i in 0..layers.alpha.len() {
        let (color, open) = (layers.color.pixels[i], layers.unoccluded.pixels[i]);
        assert!(open.g >= color.g * 0.999_99, "free rays only add light");
        assert!(layers.normal[i].length() <= layers.alpha[i] + 1e-4);
        assert!((0.0..=1.0).contains(&layers.alpha[i]));
        assert_eq!(layers.n_samples[i], 16);
        if layers.alpha[i] == 0.0 {
            assert!(color.is_black() && layers.depth[i] == 0.0);
        } else {
            assert!((2.0..9.0).contains(&layers.depth[i]), "{}", layers.depth[i]);
        }
    }
    // The upper corners look past the scene, the middle of the lower edge at the gray floor.
    assert_eq!(layers.alpha[0], 0.0);
    let floor = 36 * 45 + 22;
    assert_eq!(layers.alpha[floor], 1.0);
    assert!((layers.albedo.pixels[floor].g - 0.5).abs() < 1e-5);
    assert!((layers.normal[floor] - Vec3::Y).length() < 1e-4);

    let shown = RenderSettings { background: Background::Shown, ..settings };
    let shown = draw(&scene, &environment, &mis(&environment), &shown).layers;
    assert!(shown.alpha.iter().all(|&a| a == 1.0));
    assert!(shown.color.pixels[0].g > 0.0);
}

/// The picture of a scene does not depend on its unit of length.
#[test]
fn tiny_and_huge_scenes_are_shadowed_alike() {
    let environment = environment();
    let picture = |scale: f32| {
        let mut description = description("diffuse:0.8");
        description.transform(&Mat4::from_scale(Vec3::splat(scale)));
        let scene = Scene::new(description).unwrap();
        let settings = RenderSettings { width: 24, height: 20, n_samples: 64, ..small() };
        let mut view = view();
        view.origin *= scale;
        view.target *= scale;
        let camera = Camera::new(&view, settings.width, settings.height).unwrap();
        let mis = mis(&environment);
        render(&scene, &camera, &environment, &mis, &settings, &()).layers.color
    };
    let expected = picture(1.0);
    let mean = |image: &RgbImage| image.pixels.iter().map(|p| f64::from(p.g)).sum::<f64>();
    for scale in [1e-4, 1e-2, 1e4] {
        // The same random numbers: only rays that graze an edge may fall on its other side.
        let ratio = mean(&picture(scale)) / mean(&expected);
        assert!((ratio - 1.0).abs() < 2e-3, "scale {scale}: {ratio}");
    }
}

#[test]
fn a_canceled_render_keeps_what_is_done() {
    struct After(AtomicUsize);
    impl Observer for After {
        fn tile_finished(&self, _: &domelight::render::Counts) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
        fn canceled(&self) -> bool {
            self.0.load(Ordering::Relaxed) >= 20
        }
    }
    let (scene, environment) = (scene("diffuse:0.8"), environment());
    let settings = RenderSettings { n_samples: 64, ..small() };
    let observer = After(AtomicUsize::new(0));
    let camera = camera(&settings);
    let rendering = render(&scene, &camera, &environment, &mis(&environment), &settings, &observer);
    assert!(!rendering.complete);
    assert!(rendering.layers.n_samples.iter().all(|&n| (1..64).contains(&n)));
    assert!(rendering.layers.color.pixels.iter().all(|p| p.is_finite()));
}

#[test]
fn passes_of_one_two_and_four_samples_go_on_where_they_were_ended() {
    #[derive(Default)]
    struct OneTile(AtomicBool);
    impl Observer for OneTile {
        fn tile_finished(&self, _: &domelight::render::Counts) {
            self.0.store(true, Ordering::Relaxed);
        }
        fn canceled(&self) -> bool {
            self.0.load(Ordering::Relaxed)
        }
    }
    let (scene, environment) = (scene("phong:50:0.5:0.3"), environment());
    let settings = RenderSettings { n_samples: 6, passes: Passes::Doubling, ..small() };
    let camera = camera(&settings);
    let product = ProductSampling::new(&environment, 4);
    let start = || Renderer::with_strategy(&scene, &camera, &environment, &product, settings);
    let mut interrupted = start();
    while !interrupted.run(&OneTile::default()) {}
    assert!(interrupted.film() == start().finish(), "an interruption changed the picture");
}

/// Cuts a render short while scouts are under way.
#[derive(Default)]
struct CutShort {
    asked: AtomicUsize,
    after: usize,
}

impl Observer for CutShort {
    fn has_cut_short(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) >= self.after
    }
}

#[test]
fn scouts_that_are_cut_short_are_sent_anew() {
    let (scene, environment) = (scene("phong:50:0.5:0.3"), environment());
    let settings = RenderSettings { n_samples: 6, passes: Passes::Doubling, ..small() };
    let camera = camera(&settings);
    let product = ProductSampling::new(&environment, 4);
    let start = || Renderer::with_strategy(&scene, &camera, &environment, &product, settings);
    let mut renderer = start();
    for after in [0, 1, 10, 20] {
        assert!(!renderer.run(&CutShort { after, ..CutShort::default() }));
        assert_eq!(renderer.least_samples(), 0);
    }
    assert!(renderer.finish() == start().finish(), "scouts that were cut short were believed");
}

#[test]
fn the_relative_variance_is_that_of_the_layers() {
    let (scene, environment) = (scene("phong:50:0.5:0.3"), environment());
    let settings = RenderSettings { n_samples: 4, ..small() };
    let (camera, strategy) = (camera(&settings), mis(&environment));
    let mut renderer = Renderer::with_strategy(&scene, &camera, &environment, &strategy, settings);
    assert_eq!(renderer.relative_variance(), 0.0);
    renderer.run(&());
    let Layers { variance, color, .. } = renderer.rendering().layers;
    let of_pixel = |(variance, color): (&Rgb, &Rgb)| {
        let luminance = f64::from(color.luminance());
        f64::from(variance.luminance()) / (luminance * luminance + 0.01)
    };
    let expected: f64 = variance.pixels.iter().zip(&color.pixels).map(of_pixel).sum();
    let found = renderer.relative_variance();
    assert!((found / expected - 1.0).abs() < 1e-6, "{found} instead of {expected}");
}

/// Passes of a set length end with the same picture for a strategy that learns nothing, also where an observer left
/// tiles behind.
#[test]
fn short_passes_end_with_the_same_picture() {
    struct SomeTiles(AtomicUsize);
    impl Observer for SomeTiles {
        fn tile_finished(&self, _: &domelight::render::Counts) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
        fn canceled(&self) -> bool {
            self.0.load(Ordering::Relaxed) >= 3
        }
    }
    let (scene, environment) = (scene("diffuse:0.8"), environment());
    let settings = RenderSettings { n_samples: 11, ..small() };
    let (camera, strategy) = (camera(&settings), mis(&environment));
    let whole = render(&scene, &camera, &environment, &strategy, &settings, &());
    let mut renderer = Renderer::with_strategy(&scene, &camera, &environment, &strategy, settings);
    assert_eq!((renderer.least_samples(), renderer.share_behind()), (0, 1.0));
    let ended = SomeTiles(AtomicUsize::new(0));
    assert!(renderer.step_at_most(7, &ended));
    assert!(renderer.least_samples() == 0 && renderer.share_behind() < 1.0);
    let mut least = 0;
    for most in [2, 3, 1, 0].into_iter().chain(std::iter::repeat(5)) {
        if !renderer.step_at_most(most, &()) {
            break;
        }
        let now = renderer.least_samples();
        assert!(now - least <= most.max(1), "{least} to {now}, not more than {most}");
        least = now;
    }
    assert_eq!((renderer.least_samples(), renderer.share_behind()), (11, 0.0));
    assert!(bits(&renderer.rendering().layers) == bits(&whole.layers));
}

/// On its way, a picture is one of fewer samples, unless its strategy learns.
#[test]
fn a_picture_begins_as_one_of_fewer_samples() {
    let (scene, environment) = (scene("phong:50:0.5:0.3"), environment());
    let camera = camera(&small());
    let strategies = [
        "mis:1:1",
        "brdf:2",
        "environment:1",
        "rejection:1",
        "sir:1/1",
        "sir:2/16",
        "median-cut:16",
    ];
    for text in strategies {
        let start = |n_samples| {
            let settings = RenderSettings { n_samples, ..small() };
            let strategy = text.parse().unwrap();
            Renderer::new(&scene, &camera, &environment, strategy, settings).unwrap()
        };
        let mut renderer = start(11);
        for n in [1, 2, 5, 11] {
            while renderer.least_samples() < n {
                renderer.step_at_most(n - renderer.least_samples(), &());
            }
            let mut alone = start(n);
            alone.finish();
            let (begun, whole) = (renderer.rendering(), alone.rendering());
            assert!(bits(&begun.layers) == bits(&whole.layers), "{text}, {n} samples");
            assert_eq!(begun.counts.shadow_rays, whole.counts.shadow_rays, "{text}, {n} samples");
        }
    }
}

#[test]
fn an_empty_scene_and_a_black_probe_render() {
    let environment = Environment::constant(Rgb::BLACK).unwrap();
    let nothing = Scene::new(SceneDescription::default()).unwrap();
    let settings = RenderSettings { width: 1, height: 3, ..small() };
    for scene in [nothing, scene("ggx:0.1")] {
        let picture = draw(&scene, &environment, &mis(&environment), &settings);
        assert!(picture.layers.color.pixels.iter().all(|p| p.is_black()));
        let product = ProductSampling::new(&environment, 4);
        let picture = draw(&scene, &environment, &product, &settings);
        assert!(picture.layers.color.pixels.iter().all(|p| p.is_black()));
    }
}

/// The exposure does not depend on what is left to the render: samples, seed, background, size.
#[test]
fn the_automatic_exposure_is_known_before_the_picture() {
    let (scene, environment) = (scene("ggx:0.3"), environment());
    let settings = RenderSettings { width: 150, height: 100, n_samples: 8, ..Default::default() };
    let exposure = automatic_exposure(&scene, &camera(&settings), &environment, &settings);
    let others = [
        RenderSettings { seed: 5, n_samples: 1, ..settings },
        RenderSettings { background: Background::Hidden, tile_size: 7, ..settings },
        RenderSettings { width: 300, height: 200, ..settings },
    ];
    for other in others {
        let of_other = automatic_exposure(&scene, &camera(&other), &environment, &other);
        assert_eq!(of_other, exposure, "{other:?}");
    }
}

/// In the open, all subjects are exposed for the light: black stays black, and white stays white.
#[test]
fn the_automatic_exposure_is_the_same_for_all_albedos() {
    let environment = environment();
    let settings = RenderSettings { width: 60, height: 40, ..Default::default() };
    let exposures = ["diffuse:0.02", "diffuse:0.2", "diffuse:0.8", "ggx:0.1"].map(|material| {
        automatic_exposure(&scene(material), &camera(&settings), &environment, &settings)
    });
    assert!(exposures.iter().all(|&e| e == exposures[0]), "{exposures:?}");
    assert_eq!(exposures[0].basis, ExposureBasis::Light);
}

/// A gray ball under uniform light is middle gray.
#[test]
fn a_gray_ball_is_middle_gray() {
    let environment = Environment::constant(Rgb::splat(8.0)).unwrap();
    let settings = RenderSettings { width: 60, height: 40, ..Default::default() };
    let exposure =
        automatic_exposure(&scene("diffuse:0.18"), &camera(&settings), &environment, &settings);
    assert!((exposure.stops - -3.0).abs() < 0.011, "{exposure:?}");
}

/// In a box with a small opening, the exposure is for the light that comes in. Light that the camera alone could see does
/// not count.
#[test]
fn the_automatic_exposure_in_a_room_is_for_the_light_that_arrives() {
    let mut mesh = Mesh::default();
    let mut wall = |origin: Vec3, x: Vec3, y: Vec3| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([origin, origin + x, origin + x + y, origin + y]);
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    };
    let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| 4.0 * axis);
    let o = Vec3::splat(-2.0);
    for (origin, [a, b]) in
        [(o, [x, z]), (o, [y, z]), (o + x, [y, z]), (o, [x, y]), (o + z, [x, y])]
    {
        wall(origin, a, b);
    }
    // The ceiling leaves a gap.
    wall(o + y, 0.9 * x, z);
    let room = Scene::from_mesh(mesh, "diffuse:0.7".parse().unwrap()).unwrap();
    let settings = RenderSettings { width: 40, height: 40, ..Default::default() };
    let (origin, target) = (vec3(0.0, -1.0, 1.5), vec3(0.0, -1.5, -2.0));
    let view = CameraSettings { origin, target, ..view() };
    let camera = Camera::new(&view, 40, 40).unwrap();
    let exposure = automatic_exposure(&room, &camera, &environment(), &settings);
    let ExposureBasis::Shade(share) = exposure.basis else { panic!("{exposure:?}") };
    assert!((1e-3..0.1).contains(&share), "{share}");
}
