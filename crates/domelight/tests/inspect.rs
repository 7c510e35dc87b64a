//! The pixel X-ray: pixels whose cause of noise is known, and the variance itself.

use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::{Environment, Orientation};
use domelight::geometry::Mesh;
use domelight::inspect::{Advice, Cause, Decomposition, Inspector, SourceKind, advice};
use domelight::math::{Vec3, vec3};
use domelight::render::{Background, Filter, RenderSettings, render};
use domelight::sampling::SamplerKind;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    Camera, CameraSettings, Material, Part, Projection, Scene, SceneDescription,
};
use domelight::strategy::PreparedStrategy;
use domelight::{Rgb, RgbImage};
use testkit::{Suite, Welford, ZTest};

const STRATEGIES: [&str; 5] = ["brdf", "environment", "mis:1:1", "sir:1/8", "product"];

/// A horizontal rectangle that faces up.
fn card([x0, x1]: [f32; 2], y: f32, depth: f32) -> Mesh {
    let corner = |x: f32, z: f32| vec3(x, y, z);
    Mesh {
        positions: vec![
            corner(x0, depth),
            corner(x1, depth),
            corner(x1, -depth),
            corner(x0, -depth),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn scene(cards: Vec<Mesh>, material: &str) -> Scene {
    let bsdf = Bsdf::from(material.parse::<MaterialSpec>().unwrap());
    let part = |mesh| Part { name: "card".into(), mesh, material: 0 };
    let mut description = SceneDescription {
        parts: cards.into_iter().map(part).collect(),
        materials: vec![Material::diffuse("card", Rgb::WHITE)],
        ..SceneDescription::default()
    };
    description.set_subject_material(bsdf);
    Scene::new(description).unwrap()
}

/// One pixel of the side `side` around (0, 0, 0), seen from `origin`.
struct Pixel {
    scene: Scene,
    origin: Vec3,
    side: f32,
    environment: Environment,
}

impl Pixel {
    fn new(cards: Vec<Mesh>, material: &str, side: f32, environment: Environment) -> Self {
        Self { scene: scene(cards, material), origin: vec3(0.0, 5.0, 0.0), side, environment }
    }

    fn camera(&self) -> Camera {
        let settings = CameraSettings {
            projection: Projection::Orthographic { height: self.side },
            origin: self.origin,
            target: Vec3::ZERO,
            up: Vec3::NEG_Z,
        };
        Camera::new(&settings, 1, 1).unwrap()
    }

    fn settings(seed: u64) -> RenderSettings {
        RenderSettings {
            width: 1,
            height: 1,
            n_samples: 1,
            seed,
            filter: Filter::Box,
            background: Background::Hidden,
            sampler: SamplerKind::Independent,
            ..RenderSettings::default()
        }
    }

    fn inspect(&self, seed: u64, strategies: &[&str]) -> Vec<Decomposition> {
        let settings = Self::settings(seed);
        let inspector =
            Inspector::new(&self.scene, &self.camera(), &self.environment, &settings, [0, 0]);
        let inspector = inspector.unwrap();
        let decompose = |text: &&str| {
            let strategy = PreparedStrategy::new(text.parse().unwrap(), &self.environment);
            inspector.decompose(text, &strategy.unwrap())
        };
        strategies.iter().map(decompose).collect()
    }
}

fn map(radiance: impl Fn(usize, usize) -> f32) -> Environment {
    let image = RgbImage::from_fn(64, 32, |x, y| Rgb::splat(radiance(x, y)));
    Environment::new(image, Orientation::default(), 1.0).unwrap()
}

fn constant() -> Environment {
    Environment::constant(Rgb::WHITE).unwrap()
}

/// A lamp at the zenith over faint light.
fn lamp() -> Environment {
    map(|_, y| if y < 2 { 100.0 } else { 0.01 })
}

/// The first cause, with its share checked to be most of the variance, and all shares to sum to 1.
fn main_cause(decomposition: &Decomposition, least: f64) -> Cause {
    let sum: f64 = decomposition.shares.iter().map(|share| share.share).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{decomposition:?}");
    let first = decomposition.shares[0];
    assert!(first.share > least, "{}: {:?}", decomposition.name, decomposition.shares);
    first.cause
}

#[test]
fn an_edge() {
    // Left of the middle of the pixel lies a card; brdf sampling has no error under constant light.
    let pixel = Pixel::new(vec![card([-9.0, 0.0], 0.0, 9.0)], "diffuse:0.5", 1.0, constant());
    let found = pixel.inspect(0, &["brdf"]);
    assert_eq!(main_cause(&found[0], 0.99), Cause::Coverage);
    assert!((found[0].coverage - 0.5).abs() < 0.1);
    // A coin of the values 0 and 1/2.
    assert!((found[0].variance - 0.0625).abs() < 0.003, "{}", found[0].variance);
    let text = found[0].diagnosis(&found).to_string();
    assert!(text.contains("show the scene: an edge"), "{text}");
    assert!(matches!(advice(&found), Advice::CameraSamples { .. }));
}

#[test]
fn a_penumbra() {
    // A blocker far above hides half of the lamp from the whole pixel.
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0), card([0.0, 9e3], 900.0, 9e3)];
    let pixel = Pixel::new(cards, "diffuse:0.5", 0.01, lamp());
    let found = pixel.inspect(0, &["environment"]);
    assert!(matches!(main_cause(&found[0], 0.8), Cause::Penumbra(_)));
    let of_lamp = &found[0].sources[0];
    assert!((of_lamp.free.unwrap() - 0.5).abs() < 0.1, "{of_lamp:?}");
    assert!(found[0].diagnosis(&found).to_string().contains("partly hidden"));
}

/// Half of a small lamp is hidden from the whole pixel, and brdf sampling finds it with one ray in a hundred. A ray that
/// does has V = 0 or 1, each with the probability 1/2, so directions and the penumbra have half of the variance each.
#[test]
fn a_penumbra_of_a_lamp_that_is_rarely_found() {
    let lamp = map(|_, y| if y < 1 { 100.0 } else { 0.0 });
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0), card([0.0, 9e3], 900.0, 9e3)];
    let pixel = Pixel::new(cards, "diffuse:0.5", 0.01, lamp);
    let mut off = Vec::new();
    for seed in 0..30 {
        let found = pixel.inspect(seed, &["brdf"]);
        // Only rays toward the lamp are traced.
        let p = found[0].rays_per_sample;
        assert!(p < 0.02, "{p}");
        let share = |is: fn(&Cause) -> bool| -> f64 {
            let shares = found[0].shares.iter().filter(|share| is(&share.cause));
            shares.map(|share| share.share * found[0].variance).sum()
        };
        let directions = share(|cause| matches!(cause, Cause::Directions(_)));
        let penumbra = share(|cause| matches!(cause, Cause::Penumbra(_)));
        // One ray: its variance is p/2 − p²/4, and that of directions p/4 − p²/4, in squares of its contribution.
        let expected = 0.5 * (1.0 - p) / (1.0 - 0.5 * p);
        off.push([directions - expected * (directions + penumbra)]);
    }
    let test = ZTest { suite: Suite::of(1), ..ZTest::default() };
    test.against("directions", &off, [0.0]).unwrap();
}

#[test]
fn the_edge_of_a_shadow() {
    // A blocker close above hides all of a small sun from half of the pixel.
    let sun = map(|_, y| if y < 1 { 1e4 } else { 0.0 });
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0), card([0.0, 9.0], 0.01, 9.0)];
    let mut pixel = Pixel::new(cards, "diffuse:0.5", 1.0, sun);
    // From below the blocker's height, from the left.
    pixel.origin = vec3(0.0, 0.009, 0.0);
    let found = pixel.inspect(0, &["environment"]);
    assert!(matches!(main_cause(&found[0], 0.8), Cause::ShadowEdge(_)));
    let text = found[0].diagnosis(&found).to_string();
    assert!(text.contains("of the camera samples"), "{text}");
    assert!(matches!(advice(&found), Advice::CameraSamples { .. }));
}

#[test]
fn a_glint() {
    // A glossy card mirrors even light, which environment sampling seldom hits in the lobe.
    let card = vec![card([-9.0, 9.0], 0.0, 9.0)];
    let even = map(|_, y| if y < 16 { 1.0 + y as f32 / 16.0 } else { 0.0 });
    let pixel = Pixel::new(card, "ggx:0.05", 0.01, even);
    let found = pixel.inspect(0, &["environment", "brdf"]);
    assert!(matches!(main_cause(&found[0], 0.9), Cause::Directions(_)));
    let best = advice(&found);
    assert!(matches!(&best, Advice::Strategy { name, .. } if name == "brdf"), "{best:?}");
}

#[test]
fn a_small_sun() {
    // Brdf sampling seldom hits it.
    let sun = map(|x, y| if (x, y) == (10, 8) { 1e5 } else { 0.1 });
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0)];
    let pixel = Pixel::new(cards, "diffuse:0.5", 0.01, sun);
    let found = pixel.inspect(0, &["brdf", "environment", "product"]);
    assert_eq!(main_cause(&found[0], 0.9), Cause::Directions(SourceKind::Sun));
    let of_sun = &found[0].sources[0];
    assert!(of_sun.rays < 0.01 && of_sun.light > 0.9, "{of_sun:?}");
    let text = found[0].diagnosis(&found).to_string();
    assert!(text.contains("of the rays go to the sun"), "{text}");
    assert!(matches!(advice(&found), Advice::Strategy { name, .. } if name != "brdf"));
}

#[test]
fn a_sun_that_no_ray_finds() {
    // Of 16 384 estimates none meets so small a texel: what was not found must not count as quiet.
    let image = RgbImage::from_fn(16_384, 8, |x, y| {
        Rgb::splat(if (x, y) == (3000, 2) { 1e6 } else { 0.1 })
    });
    let sun = Environment::new(image, Orientation::default(), 1.0).unwrap();
    let pixel = Pixel::new(vec![card([-9.0, 9.0], 0.0, 9.0)], "diffuse:0.5", 0.01, sun);
    let found = pixel.inspect(0, &["brdf", "environment"]);
    assert!(found[0].mean < 0.5 * found[1].mean, "{found:?}");
    assert!(found[0].variance > 100.0 * found[1].variance, "{found:?}");
    let text = found[0].diagnosis(&found).to_string();
    assert!(text.contains("hardly any of the rays go to"), "{text}");
    assert!(matches!(advice(&found), Advice::Strategy { name, .. } if name == "environment"));
}

#[test]
fn constant_light() {
    let pixel = Pixel::new(vec![card([-9.0, 9.0], 0.0, 9.0)], "diffuse:0.5", 0.01, constant());
    let found = pixel.inspect(0, &["brdf"]);
    assert_eq!(found[0].variance, 0.0, "{:?}", found[0]);
    assert!(found[0].shares.is_empty() && (found[0].mean - 0.5).abs() < 1e-4);
    assert_eq!(advice(&found), Advice::Nothing);
}

/// Few fixed lights have no noise here, and another mean.
#[test]
fn fixed_lights_are_biased_and_never_the_best() {
    let sky = map(|x, y| if y < 16 { 1.0 + ((x / 8) % 2 * y) as f32 } else { 0.0 });
    // A blocker hides half of the sky; where it ends, few lights are all or nothing.
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0), card([0.3, 9e3], 900.0, 9e3)];
    let pixel = Pixel::new(cards, "diffuse:0.5", 0.01, sky);
    let found = pixel.inspect(0, &["median-cut:4", "mis:1:1", "brdf", "variance-minimization:4"]);
    assert_eq!(found.iter().map(|d| d.unbiased).collect::<Vec<_>>(), [false, true, true, false]);
    let best = if found[1].variance_per_ray() < found[2].variance_per_ray() { 1 } else { 2 };
    let best = &found[best].name;
    for fixed in [&found[0], &found[3]] {
        // Nothing is charged for light that fixed lights leave out.
        assert_eq!((fixed.variance, fixed.shares.len()), (0.0, 0), "{fixed:?}");
        let text = fixed.diagnosis(&found).to_string();
        assert!(text.starts_with("no noise, but biased: its mean is "), "{text}");
        assert!(text.ends_with(&format!("that of {best}")), "{text}");
    }
    let names_fixed = |name: &String| found[0].name == *name || found[3].name == *name;
    assert!(!matches!(advice(&found), Advice::Strategy { name, .. } if names_fixed(&name)));
    assert_eq!(advice(&found), advice(&found[1..3]));
    // Alone, they allow no advice.
    assert_eq!(advice(&found[..1]), Advice::AllBiased);
    let text = found[0].diagnosis(&found[..1]).to_string();
    assert!(text.contains("such as mis"), "{text}");
}

#[test]
fn all_hidden() {
    let cards = vec![card([-9.0, 9.0], 0.0, 9.0), card([-99.0, 99.0], 0.01, 99.0)];
    let mut pixel = Pixel::new(cards, "diffuse:0.5", 0.01, lamp());
    pixel.origin = vec3(0.0, 0.005, 0.0);
    let found = pixel.inspect(0, &["environment", "mis:1:1"]);
    for decomposition in &found {
        assert_eq!((decomposition.mean, decomposition.variance), (0.0, 0.0));
    }
    assert_eq!(advice(&found), Advice::Nothing);
}

/// A pixel with everything: an edge, a penumbra of the lamp, and a gloss.
fn mixed() -> Pixel {
    let cards = vec![card([-9.0, 0.3], 0.0, 9.0), card([0.0, 9e3], 900.0, 9e3)];
    Pixel::new(cards, "phong:20:0.5:0.5", 1.0, lamp())
}

#[test]
fn shares_sum_to_one() {
    for decomposition in mixed().inspect(3, &STRATEGIES) {
        main_cause(&decomposition, 0.0);
        assert!(decomposition.variance > 0.0 && decomposition.variance.is_finite());
    }
}

#[test]
fn the_variance_is_that_of_the_renderer() {
    // Strategies of one point, whose samples of a pass are independent under independent numbers.
    const TEXTS: [&str; 4] = ["brdf", "environment", "mis:1:1", "sir:1/8"];
    const BATCHES: usize = 40;
    let pixel = mixed();
    let camera = pixel.camera();
    let mut inspected = vec![Vec::new(); TEXTS.len()];
    for seed in 0..BATCHES as u64 {
        for (of, found) in inspected.iter_mut().zip(pixel.inspect(seed, &TEXTS)) {
            of.push([found.variance]);
        }
    }
    let test = ZTest { suite: Suite::of(TEXTS.len()), ..ZTest::default() };
    for (text, inspected) in TEXTS.iter().zip(&inspected) {
        let strategy = PreparedStrategy::new(text.parse().unwrap(), &pixel.environment).unwrap();
        let rendered: Vec<[f64; 1]> = (0..BATCHES as u64)
            .map(|batch| {
                let mut values = Welford::default();
                for i in 0..500 {
                    let settings = &Pixel::settings(1 + batch * 1000 + i);
                    let (scene, environment) = (&pixel.scene, &pixel.environment);
                    let picture = render(scene, &camera, environment, &strategy, settings, &());
                    values.push(f64::from(picture.layers.color.pixels[0].luminance()));
                }
                [values.variance()]
            })
            .collect();
        if let Err(why) = test.two_sample(text, inspected, &rendered) {
            panic!("{text}: {why:?}");
        }
    }
}

#[test]
fn maps_of_the_hemisphere_integrate_to_the_pixel() {
    let pixel = Pixel::new(vec![card([-9.0, 9.0], 0.0, 9.0)], "diffuse:0.5", 0.01, constant());
    let settings = Pixel::settings(0);
    let inspector =
        Inspector::new(&pixel.scene, &pixel.camera(), &pixel.environment, &settings, [0, 0]);
    let inspector = inspector.unwrap();
    let maps = inspector.hemisphere(64).unwrap();
    let pixel_solid_angle = 8.0 / (64.0 * 64.0);
    let integral: f64 =
        maps.product.iter().map(|p| f64::from(p.luminance()) * pixel_solid_angle).sum();
    assert!((integral - 0.5).abs() < 2e-3, "{integral}");
    // The density of brdf sampling is the cosine's.
    let strategy = PreparedStrategy::new("brdf".parse().unwrap(), &pixel.environment).unwrap();
    let rays = inspector.directions(&strategy, 16).unwrap();
    let sum: f32 = rays.density.iter().map(|d| d * 8.0 / 256.0).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    let center = rays.density[8 * 16 + 8];
    assert!((center - 1.0 / std::f32::consts::PI).abs() < 0.05, "{center}");
    assert!(!rays.samples.is_empty());
}

#[test]
fn a_pixel_outside_is_refused() {
    let pixel = mixed();
    let settings = Pixel::settings(0);
    let inspector =
        Inspector::new(&pixel.scene, &pixel.camera(), &pixel.environment, &settings, [1, 0]);
    let text = inspector.err().unwrap().to_string();
    assert!(text.contains("(1, 0)") && text.contains("1x1"), "{text}");
}

/// In the room, the window holds a small part of the sphere. The advice is a portal, unless there is one or it is found.
#[test]
fn a_room_is_told_apart() {
    let environment =
        Environment::new(RgbImage::filled(8, 4, Rgb::WHITE), Orientation::default(), 1.0);
    let environment = environment.unwrap();
    let enclosure = |scene: BuiltinScene, keep_portals: bool, find_portals: bool| {
        let settings =
            RenderSettings { width: 24, height: 24, find_portals, ..RenderSettings::default() };
        let mut description = scene.description();
        description.portals.retain(|_| keep_portals);
        let scene = Scene::new(description).unwrap();
        let camera = Camera::framing(&scene, 24, 24);
        Inspector::new(&scene, &camera, &environment, &settings, [12, 20]).unwrap().enclosure()
    };
    let room = enclosure(BuiltinScene::Room, false, false).unwrap();
    assert!((0.001..0.1).contains(&room.open), "{room:?}");
    let text = room.to_string();
    assert!(text.contains("of the sphere: name it as a portal"), "{text}");
    let text = enclosure(BuiltinScene::Room, false, true).unwrap().to_string();
    assert!(
        text.ends_with("of the sphere, through a window that product looks through first"),
        "{text}"
    );
    let text = enclosure(BuiltinScene::Room, true, true).unwrap().to_string();
    assert!(text.ends_with("of the sphere"), "{text}");
    assert_eq!(enclosure(BuiltinScene::Spheres, false, true), None);
}
