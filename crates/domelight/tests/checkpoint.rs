//! Interrupted, saved, divided and merged renders end with the bits of the uninterrupted one.
#![cfg(feature = "io")]

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

use domelight::RgbImage;
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::picture::exr::ExrLayers;
use domelight::render::{
    Background, Checkpoint, CheckpointError, Counts, Film, FilmMismatch, Layers, Observer,
    RenderSettings, Renderer, Rendering, VarianceSums, Window, render,
};
use domelight::sampling::{Heuristic, Pcg32, Sampler};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, CameraSettings, Scene};
use domelight::strategy::{
    Contributions, LightTable, MultipleImportanceSampling, ProductSampling, Strategy, TileShading,
};

type Mis<'a> = MultipleImportanceSampling<'a>;

/// What a render needs.
struct TestScene {
    scene: Scene,
    camera: Camera,
    environment: Environment,
}

fn settings() -> RenderSettings {
    RenderSettings { width: 53, height: 38, n_samples: 9, tile_size: 8, ..Default::default() }
}

fn test_scene() -> TestScene {
    let description = BuiltinScene::Spheres.description();
    let bounds = description.subject_bounds();
    let RenderSettings { width, height, .. } = settings();
    let view =
        CameraSettings::framing(&bounds, width as f32 / height as f32, domelight::math::Vec3::Y);
    let map = BuiltinProbe::Sky.image(32);
    TestScene {
        scene: Scene::new(description).unwrap(),
        camera: Camera::new(&view, width, height).unwrap(),
        environment: Environment::new(map, Orientation::default(), 1.0).unwrap(),
    }
}

fn mis(test_scene: &TestScene) -> Mis<'_> {
    Mis::new(&test_scene.environment, LightTable::Full, Heuristic::Balance, 1, 1).unwrap()
}

fn renderer<'a, S: Strategy>(
    test_scene: &'a TestScene,
    strategy: &'a S,
    settings: &RenderSettings,
) -> Renderer<'a, S> {
    Renderer::with_strategy(
        &test_scene.scene,
        &test_scene.camera,
        &test_scene.environment,
        strategy,
        *settings,
    )
}

fn uninterrupted(
    test_scene: &TestScene,
    strategy: &impl Strategy,
    settings: &RenderSettings,
) -> Rendering {
    render(&test_scene.scene, &test_scene.camera, &test_scene.environment, strategy, settings, &())
}

fn checkpoint<S: Strategy>(renderer: &Renderer<S>, n_samples: u32) -> Checkpoint {
    Checkpoint {
        identity: vec![("scene".into(), "spheres".into()), ("seed".into(), "0".into())],
        provenance: vec![("domelight.version".into(), "test".into())],
        tiles: renderer.tiles(),
        n_tiles: renderer.tiling().n_tiles(),
        n_samples,
        complete: renderer.is_complete(),
        counts: renderer.counts(),
        film: renderer.film(),
    }
}

/// Ends a run after some tiles.
struct After(AtomicUsize);

impl After {
    fn tiles(n: usize) -> Self {
        Self(AtomicUsize::new(n))
    }
}

impl Observer for After {
    fn tile_finished(&self, _: &Counts) {
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1));
    }

    fn canceled(&self) -> bool {
        self.0.load(Ordering::Relaxed) == 0
    }
}

fn pool(n_threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap()
}

#[test]
fn a_resumed_render_has_the_bits_of_the_uninterrupted_one() {
    let (test_scene, settings) = (test_scene(), settings());
    interrupt_and_resume(&test_scene, &mis(&test_scene), &settings);
}

#[test]
fn a_strategy_that_learns_can_be_interrupted() {
    let test_scene = test_scene();
    let settings = RenderSettings { n_samples: 80, tile_size: 16, ..settings() };
    interrupt_and_resume(&test_scene, &ProductSampling::new(&test_scene.environment, 2), &settings);
}

/// The picture of a render that was interrupted in its first pass is coarse where nothing was rendered. The film that a
/// checkpoint keeps knows nothing of that.
#[test]
fn an_interrupted_picture_has_no_holes() {
    let test_scene = test_scene();
    let settings = RenderSettings { n_samples: 80, ..settings() };
    let strategy = ProductSampling::new(&test_scene.environment, 2);
    let mut renderer = renderer(&test_scene, &strategy, &settings);
    assert!(!renderer.run(&After::tiles(3)));
    let rendering = renderer.rendering();
    let coarse = rendering.layers.n_samples.iter().filter(|&&n| n == 1).count();
    assert!(coarse > 53 * 38 / 2, "{coarse}");
    assert!(!rendering.complete && rendering.layers.n_samples.iter().all(|&n| n > 0));
    assert!(renderer.whole_film().layers().color.pixels == rendering.layers.color.pixels);
    // Where it is coarse, it is the same picture.
    let expected = uninterrupted(&test_scene, &strategy, &settings).layers.color;
    let blurred = |image: &RgbImage, x: usize, y: usize| -> f32 {
        let block = (8 * y..8 * y + 8).flat_map(|y| &image.row(y)[8 * x..8 * x + 8]);
        block.map(|p| p.luminance()).sum()
    };
    for (x, y) in (0..4).flat_map(|y| (0..6).map(move |x| (x, y))) {
        let [kept, whole] = [&rendering.layers.color, &expected].map(|image| blurred(image, x, y));
        assert!((0.5..2.0).contains(&(kept / whole)), "{x} {y}: {kept} {whole}");
    }
    assert!(renderer.film().layers().n_samples.contains(&0));
    renderer.run(&());
    assert_eq!(renderer.rendering().layers.color.pixels, expected.pixels);
}

/// However slow a strategy is, what fills its interrupted picture is quick.
#[test]
fn an_interrupted_picture_of_a_slow_strategy_is_filled_by_another() {
    let test_scene = test_scene();
    let settings = RenderSettings { n_samples: 80, ..settings() };
    let slow = SlowStrategy { calls: AtomicU32::new(0) };
    let mut renderer = renderer(&test_scene, &slow, &settings);
    assert!(!renderer.run(&After::tiles(1)));
    let calls = slow.calls.load(Ordering::Relaxed);
    let layers = renderer.whole_film().layers();
    assert!(layers.n_samples.iter().all(|&n| n > 0));
    assert!(layers.color.pixels.iter().any(|pixel| pixel.luminance() > 0.0));
    assert_eq!(slow.calls.load(Ordering::Relaxed), calls);
}

/// Black, and counts its calls.
struct SlowStrategy {
    calls: AtomicU32,
}

impl Strategy for SlowStrategy {
    type Pass = ();
    type Scratch = ();
    type Findings = ();

    fn n_rays(&self) -> u32 {
        1
    }

    fn begin_pass(&self, _: Sampler, _: u32) {}

    fn push(&self, (): &(), tile: &TileShading, _: u32, (): &mut (), out: &mut Contributions) {
        self.calls.fetch_add(1, Ordering::Relaxed);
        out.reset(tile.points.len());
    }

    fn findings(&self, (): &()) {}
}

/// Before no background tiles that see nothing keep no sums.
#[test]
fn tiles_that_see_nothing_can_be_interrupted() {
    let mut test_scene = test_scene();
    let RenderSettings { width, height, .. } = settings();
    let fov_y_degrees = 120.0;
    let projection = domelight::scene::Projection::Perspective { fov_y_degrees };
    let [origin, target, up] = [[0.0, 1.0, 9.0], [0.0; 3], [0.0, 1.0, 0.0]].map(Into::into);
    let view = CameraSettings { projection, origin, target, up };
    test_scene.camera = Camera::new(&view, width, height).unwrap();
    let settings = RenderSettings { background: Background::Hidden, n_samples: 7, ..settings() };
    interrupt_and_resume(&test_scene, &mis(&test_scene), &settings);
    let rendering = uninterrupted(&test_scene, &mis(&test_scene), &settings);
    let corners = [0, width - 1, width * height - 1];
    assert!(corners.into_iter().all(|i| rendering.layers.n_samples[i] == 7));
    assert!(rendering.layers.alpha.contains(&0.0) && rendering.layers.alpha.contains(&1.0));
    assert_eq!(rendering.counts.camera_rays, (7 * width * height) as u64);
}

fn interrupt_and_resume<S: Strategy>(
    test_scene: &TestScene,
    strategy: &S,
    settings: &RenderSettings,
) {
    let expected = uninterrupted(test_scene, strategy, settings);
    let mut random = Pcg32::new(1, 1);
    for n_threads in [1, 2] {
        pool(n_threads).install(|| {
            let mut saved: Option<Vec<u8>> = None;
            let mut interruptions = 0;
            let rendering = loop {
                let mut renderer = renderer(test_scene, strategy, settings);
                if let Some(bytes) = &saved {
                    let checkpoint = Checkpoint::decode(bytes).unwrap();
                    renderer.restore(&checkpoint.film, checkpoint.counts).unwrap();
                }
                if renderer.run(&After::tiles(1 + random.next_u32() as usize % 5)) {
                    break renderer.rendering();
                }
                interruptions += 1;
                saved = Some(checkpoint(&renderer, settings.n_samples).encode().unwrap());
            };
            assert!(interruptions >= 3, "{interruptions}");
            assert_same(&rendering, &expected);
        });
    }
}

#[track_caller]
fn assert_same(a: &Rendering, b: &Rendering) {
    let bytes = |r: &Rendering| r.layers.to_exr(Vec::new()).encode().unwrap();
    assert!(bytes(a) == bytes(b), "the pictures differ");
    assert_eq!(a.counts, b.counts);
    assert!(a.complete && b.complete);
}

#[test]
fn more_samples_than_before_go_on_from_what_is_there() {
    let (test_scene, few) = (test_scene(), settings());
    let many = RenderSettings { n_samples: 20, ..few };
    let mis = mis(&test_scene);
    let mut first = renderer(&test_scene, &mis, &few);
    assert!(first.run(&()));
    let mut second = renderer(&test_scene, &mis, &many);
    second.restore(&first.film(), first.counts()).unwrap();
    assert!(!second.is_complete());
    assert!(second.run(&()));
    assert_same(&second.rendering(), &uninterrupted(&test_scene, &mis, &many));
}

#[test]
fn merged_shards_are_the_single_run() {
    let (test_scene, settings) = (test_scene(), settings());
    let mis = mis(&test_scene);
    let expected = uninterrupted(&test_scene, &mis, &settings);
    let RenderSettings { width, height, .. } = settings;
    for n in [1, 2, 3, 8, 64] {
        let mut counts = Counts::default();
        let mut variance = VarianceSums::default();
        let mut films = Vec::new();
        for k in (0..n).rev() {
            let whole = renderer(&test_scene, &mis, &settings);
            let tiles = whole.tiling().shard(k, n);
            let mut shard = whole.only(tiles);
            pool(1 + k % 3).install(|| shard.run(&()));
            let bytes = checkpoint(&shard, settings.n_samples).encode().unwrap();
            let part = Checkpoint::decode(&bytes).unwrap();
            assert!(part.complete);
            variance.add(&part.film.variance_sums());
            films.push(part.film);
            counts += part.counts;
        }
        let mut layers = Layers::new(width, height);
        for film in &films {
            layers.merge(film, 0, &variance);
        }
        let merged = Rendering { layers, counts, complete: true, ..expected.clone() };
        assert_same(&merged, &expected);
    }
}

#[test]
fn a_checkpoint_is_a_picture_and_keeps_everything() {
    let (test_scene, settings) = (test_scene(), settings());
    let mis = mis(&test_scene);
    let mut shard = renderer(&test_scene, &mis, &settings).only(9..12);
    shard.run(&After::tiles(4));
    let saved = checkpoint(&shard, settings.n_samples);
    let bytes = saved.encode().unwrap();
    assert_eq!(bytes, saved.encode().unwrap());
    assert_eq!(Checkpoint::decode(&bytes).unwrap(), saved);

    let picture = domelight::picture::exr::decode(&bytes, None).unwrap();
    assert_eq!(picture.image, saved.film.layers().color);
    let exr = ExrLayers::decode(&bytes).unwrap();
    let Window { x, y, width, height } = saved.film.window;
    assert_eq!((exr.origin, (exr.width, exr.height)), ((x, y), (width, height)));
    assert_eq!(exr.whole, Some((settings.width, settings.height)));

    assert_eq!(saved.difference(&saved.identity), None);
    let other = [("scene".into(), "spheres".into()), ("seed".into(), "1".into())];
    let difference = saved.difference(&other).unwrap();
    assert_eq!((difference.name, difference.here, difference.there), ("seed", "0", "1"));
    assert_eq!(saved.difference(&other[..1]).unwrap().there, "");
}

#[test]
fn foreign_and_damaged_files_are_refused() {
    let (test_scene, settings) = (test_scene(), settings());
    let mis = mis(&test_scene);
    let mut shard = renderer(&test_scene, &mis, &settings).only(0..3);
    shard.run(&());
    let saved = checkpoint(&shard, settings.n_samples);
    let bytes = saved.encode().unwrap();

    let picture = shard.rendering().layers.to_exr(Vec::new()).encode().unwrap();
    assert!(matches!(Checkpoint::decode(&picture), Err(CheckpointError::Foreign)));
    assert!(Checkpoint::decode(b"").is_err());
    for length in (0..bytes.len()).step_by(997).chain([bytes.len() - 1]) {
        assert!(Checkpoint::decode(&bytes[..length]).is_err(), "{length} bytes of {}", bytes.len());
    }
    // A flipped bit is found, or it changed nothing but the layers to look at.
    let mut random = Pcg32::new(3, 5);
    for _ in 0..200 {
        let mut damaged = bytes.clone();
        let bit = random.next_u32() as usize % (8 * bytes.len());
        damaged[bit / 8] ^= 1 << (bit % 8);
        if let Ok(read) = Checkpoint::decode(&damaged) {
            assert_eq!(read, saved, "bit {bit}");
        }
    }
}

#[test]
fn sums_of_another_render_are_refused() {
    let (test_scene, settings) = (test_scene(), settings());
    let mis = mis(&test_scene);
    let mut whole = renderer(&test_scene, &mis, &settings);
    let shard = renderer(&test_scene, &mis, &settings).only(0..3);
    let refused = whole.restore(&shard.film(), Counts::default());
    assert!(matches!(refused, Err(FilmMismatch::Window { .. })), "{refused:?}");
    let other_size = Film::new(99, 38, whole.film().window);
    assert!(whole.restore(&other_size, Counts::default()).is_err());
}

/// A tile stops by its own samples: the same with its neighbors or without.
#[test]
fn tiles_decide_for_themselves_when_the_error_is_reached() {
    let test_scene = test_scene();
    let settings = RenderSettings { n_samples: 256, target_error: Some(8e-3), ..settings() };
    let mis = mis(&test_scene);
    let mut whole = renderer(&test_scene, &mis, &settings);
    assert!(whole.run(&()));
    let layers = whole.film().layers();
    let least = layers.n_samples.iter().min().copied();
    let most = layers.n_samples.iter().max().copied();
    assert!(least >= Some(16) && least < most, "{least:?} to {most:?}");
    let mut films = Vec::new();
    let mut variance = VarianceSums::default();
    for k in 0..3 {
        let mut shard = renderer(&test_scene, &mis, &settings);
        let tiles = shard.tiling().shard(k, 3);
        shard = shard.only(tiles);
        assert!(shard.run(&()));
        films.push(shard.film());
        variance.add(&shard.film().variance_sums());
    }
    let mut merged = Layers::new(layers.width(), layers.height());
    for film in &films {
        merged.merge(film, 0, &variance);
    }
    let bytes = |layers: &Layers| layers.to_exr(Vec::new()).encode().unwrap();
    assert!(bytes(&merged) == bytes(&layers));
}
