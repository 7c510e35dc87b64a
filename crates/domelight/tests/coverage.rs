//! Surfaces that cover a share of what is behind them, that are not seen from behind, and that send out light.

use domelight::environment::{Environment, Orientation};
use domelight::geometry::{Mesh, Ray, RayBatch};
use domelight::math::{Mat4, Vec2, Vec3, vec2, vec3};
use domelight::render::{Background, Layers, RenderSettings, pilot_points, render, visibility};
use domelight::sampling::Pcg32;
use domelight::scene::builtin::shapes;
use domelight::scene::{
    AlphaMode, Camera, CameraSettings, ColorFactor, Coverage, Emission, Encoding, Factor,
    Layers as MaterialLayers, Material, MaterialModel, MetallicRoughnessMaterial, Part, Projection,
    Scene, SceneDescription, SightKey, Sights, Specular, Texture, TextureFilter, TextureRef,
    UvTransform, Volume,
};
use domelight::strategy::{EnvironmentSampling, PreparedStrategy, Strategy};
use domelight::{Rgb, RgbImage};
use testkit::{Suite, ZTest};

/// A wide square at height `y` that faces up.
fn card(y: f32) -> Mesh {
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
    Mesh {
        positions: corners.map(|[x, z]| 50.0 * vec3(x, 0.0, z) + vec3(0.0, y, 0.0)).to_vec(),
        uvs: corners.map(|[x, z]| 0.5 + 0.5 * vec2(x, z)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn covering(mode: AlphaMode, opacity: f32, albedo: f32) -> Material {
    let coverage = Coverage { mode, opacity, texture: None };
    Material { coverage, ..Material::diffuse("card", Rgb::splat(albedo)) }
}

/// Cards from the top down, a unit apart.
fn stack(materials: Vec<Material>, textures: Vec<Texture>) -> Scene {
    let part = |i| Part { name: "card".into(), mesh: card(-(i as f32)), material: i };
    let parts = (0..materials.len()).map(part).collect();
    let description =
        SceneDescription { parts, materials, textures, ..SceneDescription::default() };
    Scene::new(description).unwrap()
}

/// A patch around the zenith: whatever a card sees of it lies behind all cards above.
fn zenith() -> Environment {
    let map =
        RgbImage::from_fn(32, 16, |_, y| if y < 3 { Rgb::new(3.0, 2.0, 1.0) } else { Rgb::BLACK });
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

fn settings() -> RenderSettings {
    RenderSettings {
        width: 8,
        height: 8,
        n_samples: 64,
        background: Background::Hidden,
        ..RenderSettings::default()
    }
}

fn draw_from<S: Strategy>(
    origin: Vec3,
    scene: &Scene,
    environment: &Environment,
    strategy: &S,
    settings: &RenderSettings,
) -> Layers {
    let camera = CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: 20.0 },
        origin,
        target: Vec3::ZERO,
        up: Vec3::Z,
    };
    let camera = Camera::new(&camera, settings.width, settings.height).unwrap();
    render(scene, &camera, environment, strategy, settings, &()).layers
}

const ABOVE: Vec3 = Vec3::new(3.0, 10.0, 0.0);

fn mean(image: &RgbImage) -> [f64; 3] {
    let sum: Rgb = image.pixels.iter().fold(Rgb::BLACK, |sum, &p| sum + p);
    (sum / image.pixels.len() as f32).to_array().map(f64::from)
}

/// Means over pictures under many seeds.
fn means<S: Strategy>(scene: &Scene, environment: &Environment, strategy: &S) -> Vec<[f64; 3]> {
    let picture = |seed| {
        let settings = RenderSettings { seed, ..settings() };
        mean(&draw_from(ABOVE, scene, environment, strategy, &settings).color)
    };
    (0..32).map(picture).collect()
}

/// What is seen of a stack is Σ α ρ T², with T the product of 1 − α of the cards above: once for the camera, once for the
/// light. One random number for all layers of a camera ray, or noise in both that is not independent, would differ.
#[test]
fn a_stack_of_cards_is_the_sum_over_its_layers_by_every_strategy() {
    let layers = [(0.3, 0.8), (0.5, 0.2), (0.25, 0.9), (0.6, 0.5), (1.0, 0.7)];
    let (mut through, mut expected) = (1.0, 0.0);
    for (opacity, albedo) in layers {
        expected += opacity * albedo * through * through;
        through *= 1.0 - opacity;
    }
    let blend = |(opacity, albedo)| covering(AlphaMode::Blend, opacity as f32, albedo as f32);
    let cards = stack(layers.map(blend).to_vec(), Vec::new());
    let white = stack(vec![Material::diffuse("white", Rgb::WHITE)], Vec::new());
    let environment = zenith();
    let light = EnvironmentSampling { environment: &environment, n_samples: 4 };
    let of_white = means(&white, &environment, &light);
    let of_white: Vec<_> = of_white.iter().map(|m| m.map(|x| x * expected)).collect();
    check_every_strategy(&cards, &environment, &of_white);
}

/// Every strategy estimates what `expected` are batches of.
fn check_every_strategy(scene: &Scene, environment: &Environment, expected: &[[f64; 3]]) {
    let test = ZTest { suite: Suite::of(STRATEGIES.len()), ..ZTest::default() };
    for name in STRATEGIES {
        let strategy = PreparedStrategy::new(name.parse().unwrap(), environment).unwrap();
        let means = means(scene, environment, &strategy);
        test.two_sample(name, &means, expected).unwrap_or_else(|f| panic!("{f}"));
    }
}

const STRATEGIES: [&str; 6] =
    ["brdf:4", "environment:4", "mis:2:2", "rejection:4", "sir:2/8", "product:2"];

/// A ball over ground at y = −1; a description of the ball alone with no ground.
fn ball_over(ground: Option<Material>) -> Scene {
    let mut ball = shapes::icosphere(3);
    ball.transform(&Mat4::from_translation(vec3(0.0, 0.6, 0.0)));
    let mut parts = vec![Part { name: "ball".into(), mesh: ball, material: 0 }];
    let mut materials = vec![Material::diffuse("ball", Rgb::splat(0.6))];
    if let Some(ground) = ground {
        parts.push(Part { name: "ground".into(), mesh: card(-1.0), material: 1 });
        materials.push(ground);
    }
    Scene::new(SceneDescription { parts, materials, ..SceneDescription::default() }).unwrap()
}

fn catcher() -> Material {
    Material { catches_shadows: true, double_sided: false, ..Material::diffuse("g", Rgb::BLACK) }
}

/// A blue sky with a warm lamp, over ground of one color.
fn lamp() -> Environment {
    let map = RgbImage::from_fn(32, 16, |x, y| match (x, y) {
        (6..10, 3..6) => Rgb::new(20.0, 15.0, 5.0),
        (_, ..8) => Rgb::new(0.2, 0.5, 1.0),
        _ => Rgb::new(0.7, 0.5, 0.3),
    });
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

/// Draws the ground beside the ball, where the lamp's shadow is, or all of it.
fn draw_ground<S: Strategy>(
    scene: &Scene,
    environment: &Environment,
    strategy: &S,
    fov_y_degrees: f32,
    settings: &RenderSettings,
) -> Layers {
    let camera = CameraSettings {
        projection: Projection::Perspective { fov_y_degrees },
        origin: vec3(5.0, 3.0, 5.0),
        target: vec3(1.9, -1.0, 0.0),
        up: Vec3::Y,
    };
    let camera = Camera::new(&camera, settings.width, settings.height).unwrap();
    render(scene, &camera, environment, strategy, settings, &()).layers
}

/// Of the ground in the shadow alone.
const SHADOW: f32 = 14.0;
/// Of ball, shadow and ground.
const ALL: f32 = 45.0;

/// The shadow on ground that shows nothing else is that of a diffuse plate, by every strategy.
#[test]
fn caught_shadows_are_those_of_a_diffuse_plate() {
    let environment = lamp();
    let unoccluded = environment.irradiance(Vec3::Y) * (0.5 / std::f32::consts::PI);
    let seeds = |of: &dyn Fn(&RenderSettings) -> [f64; 3]| -> Vec<[f64; 3]> {
        (0..32).map(|seed| of(&RenderSettings { seed, ..settings() })).collect()
    };
    let plate = ball_over(Some(Material::diffuse("plate", Rgb::splat(0.5))));
    let light = EnvironmentSampling { environment: &environment, n_samples: 4 };
    let expected = seeds(&|settings| {
        let layers = draw_ground(&plate, &environment, &light, SHADOW, settings);
        assert!(layers.alpha.iter().all(|&alpha| alpha == 1.0));
        let (mean, all) = (mean(&layers.color), unoccluded.to_array());
        std::array::from_fn(|c| 1.0 - mean[c] / f64::from(all[c]))
    });
    assert!(expected[0].iter().all(|&shadow| shadow > 0.1), "it is dark there");
    let scene = ball_over(Some(catcher()));
    let test = ZTest { suite: Suite::of(STRATEGIES.len()), ..ZTest::default() };
    for name in STRATEGIES {
        let strategy = PreparedStrategy::new(name.parse().unwrap(), &environment).unwrap();
        let means = seeds(&|settings| {
            mean(&draw_ground(&scene, &environment, &strategy, SHADOW, settings).shadow)
        });
        test.two_sample(name, &means, &expected).unwrap_or_else(|f| panic!("{f}"));
    }
}

/// With a hidden background, color over any background is the picture with it: exactly so by the layer of shadows, and by
/// alpha alone where shadows are gray.
#[test]
fn caught_shadows_composite_to_the_picture_with_the_background() {
    let environment = lamp();
    let behind = environment.le_interpolated(Vec3::NEG_Y);
    let strategy = EnvironmentSampling { environment: &environment, n_samples: 2 };
    let scene = ball_over(Some(catcher()));
    let hidden = RenderSettings { width: 24, height: 24, ..settings() };
    let shown = RenderSettings { background: Background::Shown, ..hidden };
    let [hidden, shown] = [hidden, shown]
        .map(|settings| draw_ground(&scene, &environment, &strategy, ALL, &settings));
    let (mut dark, mut bright) = (0, 0);
    for i in 0..hidden.alpha.len() {
        let (alpha, shadow) = (hidden.alpha[i], hidden.shadow.pixels[i]);
        let over =
            hidden.color.pixels[i] + behind * (1.0 - alpha + shadow.mean()) - behind * shadow;
        let difference = over - shown.color.pixels[i];
        assert!(difference.to_array().iter().all(|d| d.abs() < 1e-4), "{i}: {difference:?}");
        assert_eq!((shown.alpha[i], shown.shadow.pixels[i]), (1.0, shadow));
        if hidden.n_hits[i] == 0 {
            assert_eq!(hidden.color.pixels[i], Rgb::BLACK);
            assert!((alpha - shadow.mean()).abs() < 1e-5);
            dark += u32::from(alpha > 0.3);
            bright += u32::from(alpha < 0.1);
        }
    }
    assert!(dark > 10 && bright > 10, "{dark} {bright}");
}

/// Ground that shows nothing but shadows hides no light: the ball has the bits that it has without it.
#[test]
fn ground_that_catches_shadows_leaves_the_subject_as_it_is() {
    let environment = lamp();
    let strategy = EnvironmentSampling { environment: &environment, n_samples: 2 };
    let settings = RenderSettings { width: 24, height: 24, ..settings() };
    let [with, without] = [Some(catcher()), None]
        .map(|ground| draw_ground(&ball_over(ground), &environment, &strategy, ALL, &settings));
    let ball = (0..without.alpha.len()).filter(|&i| without.alpha[i] == 1.0);
    let mut n = 0;
    for i in ball {
        assert_eq!(with.color.pixels[i], without.color.pixels[i], "{i}");
        assert_eq!(with.depth[i], without.depth[i]);
        n += 1;
    }
    assert!(n > 20, "{n}");
    assert!(without.shadow.pixels.iter().all(|&shadow| shadow == Rgb::BLACK));
    assert_eq!(with.n_hits, without.n_hits);
}

/// A material that lets the share `transmission` of each channel of `color` pass, and reflects the rest of it diffusely.
fn pane(color: Rgb, transmission: f32, opacity: f32) -> Material {
    let model = MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
        base_color: color,
        base_color_texture: None,
        metallic: 0.0,
        roughness: 1.0,
        metallic_roughness_texture: None,
    });
    let transmission = Some(Factor { value: transmission, texture: None });
    let matte = Specular {
        strength: Factor { value: 0.0, texture: None },
        color: ColorFactor { value: Rgb::WHITE, texture: None },
    };
    Material {
        coverage: Coverage { mode: AlphaMode::Blend, opacity, texture: None },
        layers: MaterialLayers { specular: Some(matte), transmission, ..MaterialLayers::default() },
        ..Material::new("pane", model)
    }
}

/// A card behind a clear pane and a milky one that covers a share: the camera sees through them in color, light passes by
/// the mean of their channels.
#[test]
fn panes_tint_what_is_behind_them_by_every_strategy() {
    check_panes(Rgb::new(1.0, 0.5, 0.25), Rgb::new(0.8, 0.8, 0.4), 0.6);
}

/// Dark panes, which camera rays hit as often as they reflect beside what they let through.
#[test]
fn dark_panes_tint_what_is_behind_them_by_every_strategy() {
    check_panes(Rgb::new(0.9, 0.9, 0.6), Rgb::new(0.03, 0.02, 0.05), 1.0);
}

/// A card behind a pane that lets a color pass and one that lets half of another pass where it is, and reflects the
/// other half.
fn check_panes(clear: Rgb, milky: Rgb, opacity: f32) {
    let scene = stack(
        vec![
            pane(clear, 1.0, 1.0),
            pane(milky, 0.5, opacity),
            covering(AlphaMode::Opaque, 1.0, 0.7),
        ],
        Vec::new(),
    );
    let half = 0.5 * opacity;
    let through = Rgb::splat(1.0 - opacity) + milky * half;
    let milk = clear * clear.mean() * milky * half;
    let card = clear * through * (0.7 * clear.mean() * through.mean());
    let expected = (milk + card).to_array().map(f64::from);
    let white = stack(vec![Material::diffuse("white", Rgb::WHITE)], Vec::new());
    let environment = zenith();
    let light = EnvironmentSampling { environment: &environment, n_samples: 4 };
    let of_white = means(&white, &environment, &light);
    let of_white: Vec<_> =
        of_white.iter().map(|m| std::array::from_fn(|c| m[c] * expected[c])).collect();
    check_every_strategy(&scene, &environment, &of_white);
}

/// A ball of dark glass, which lets little through, or of the same glossy black without any transmission.
fn dark_ball(transmission: Option<f32>) -> Scene {
    let model = MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
        base_color: Rgb::splat(if transmission.is_some() { 0.02 } else { 0.0 }),
        base_color_texture: None,
        metallic: 0.0,
        roughness: 0.2,
        metallic_roughness_texture: None,
    });
    let transmission = transmission.map(|value| Factor { value, texture: None });
    let glass = Material {
        double_sided: false,
        layers: MaterialLayers { transmission, ..MaterialLayers::default() },
        ..Material::new("glass", model)
    };
    let parts = vec![Part { name: "ball".into(), mesh: shapes::icosphere(3), material: 0 }];
    let description =
        SceneDescription { parts, materials: vec![glass], ..SceneDescription::default() };
    Scene::new(description).unwrap()
}

/// What little is seen through dark glass adds little noise to what the glass reflects.
#[test]
fn dark_glass_is_about_as_quiet_as_its_coat() {
    let environment = lamp();
    for name in ["mis:2:2", "product:2"] {
        let strategy = PreparedStrategy::new(name.parse().unwrap(), &environment).unwrap();
        let variance = |scene: &Scene| {
            let picture = |seed| {
                let background = Background::Shown;
                let settings = RenderSettings { seed, background, n_samples: 8, ..settings() };
                draw_from(vec3(4.0, 2.0, 1.0), scene, &environment, &strategy, &settings).color
            };
            let pictures: Vec<_> = (0..48).map(picture).collect();
            let n = pictures.len() as f64;
            let of_pixel = |i: usize| {
                let values = pictures.iter().map(|p| f64::from(p.pixels[i].luminance()));
                let mean = values.clone().sum::<f64>() / n;
                values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)
            };
            (0..pictures[0].pixels.len()).map(of_pixel).sum::<f64>()
        };
        let [glass, coat] =
            [Some(1.0), None].map(|transmission| variance(&dark_ball(transmission)));
        assert!(glass <= 1.2 * coat, "{name}: {glass:e} for {coat:e}");
    }
}

/// Behind panes, a bright map is seen tinted, and what hides it is counted in alpha.
#[test]
fn panes_show_the_map_behind_them() {
    let map = RgbImage::filled(8, 4, Rgb::splat(2.0));
    let environment = Environment::new(map, Orientation::default(), 1.0).unwrap();
    let strategy = EnvironmentSampling { environment: &environment, n_samples: 1 };
    let color = Rgb::new(1.0, 0.5, 0.25);
    let body = Volume {
        thickness: Factor { value: 3.0, texture: None },
        attenuation_distance: 1.5,
        attenuation_color: Rgb::new(0.5, 1.0, 0.25),
    };
    // A two-sided surface is half of a body: three units at half strength a unit and a half.
    for (volume, through) in [(None, color), (Some(body), color * Rgb::new(0.5, 1.0, 0.25))] {
        let mut glass = pane(color, 1.0, 1.0);
        glass.layers.volume = volume;
        let scene = stack(vec![glass; 2], Vec::new());
        let expected = through * through;
        let pictures = |background| -> Vec<([f64; 3], f64)> {
            let picture = |seed| {
                let settings = RenderSettings { seed, background, ..settings() };
                let layers = draw_from(ABOVE, &scene, &environment, &strategy, &settings);
                let alpha = layers.alpha.iter().map(|&a| f64::from(a)).sum::<f64>();
                (mean(&layers.color), alpha / layers.alpha.len() as f64)
            };
            (0..32).map(picture).collect()
        };
        let test = ZTest { suite: Suite::of(4), ..ZTest::default() };
        let shown: Vec<_> = pictures(Background::Shown).iter().map(|p| p.0).collect();
        let reference = (expected * 2.0).to_array().map(f64::from);
        test.against("color", &shown, reference).unwrap_or_else(|f| panic!("{f}"));
        let alpha: Vec<_> = pictures(Background::Hidden).iter().map(|p| [p.1; 3]).collect();
        let reference = [1.0 - f64::from(expected.mean()); 3];
        test.against("alpha", &alpha, reference).unwrap_or_else(|f| panic!("{f}"));
    }
}

/// The faces of a wide box from `top` down to `bottom`.
fn boxed(top: f32, bottom: f32) -> Mesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    // The corner that each face turns round, and two edges whose cross product points out of the box.
    let (low, high) = (vec3(-50.0, bottom, -50.0), vec3(50.0, top, 50.0));
    let edges = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * (high - low));
    for axis in 0..3 {
        let [u, v] = [edges[(axis + 1) % 3], edges[(axis + 2) % 3]];
        for (corner, [u, v]) in [(low, [v, u]), (high, [-u, -v])] {
            let first = positions.len() as u32;
            positions.extend([corner, corner + u, corner + u + v, corner + v]);
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + first)));
        }
    }
    Mesh { positions, triangles, ..Mesh::default() }
}

/// A closed single-sided body of glass tints once what is behind it or in it: on the camera's way through its front, and
/// on the light's. The two-sided one beside it does so at each of its surfaces.
#[test]
fn closed_bodies_tint_once_for_the_camera_and_once_for_light() {
    let color = Rgb::new(0.9, 0.5, 0.25);
    let volume = Volume {
        thickness: Factor { value: 2.0, texture: None },
        attenuation_distance: 1.0,
        attenuation_color: Rgb::new(0.5, 0.9, 0.7),
    };
    let whole = Rgb::new(0.25, 0.81, 0.49);
    let half = Rgb::new(0.5, 0.9, 0.7);
    let squared = |c: Rgb| c * c;
    // Behind the body, then in it.
    let cases = [(false, -3.0, color * whole), (false, -1.0, color * whole)];
    let two_sided = [(true, -3.0, squared(color * half)), (true, -1.0, color * half)];
    let environment = zenith();
    let light = EnvironmentSampling { environment: &environment, n_samples: 4 };
    let white = stack(vec![Material::diffuse("white", Rgb::WHITE)], Vec::new());
    let of_white = means(&white, &environment, &light);
    for (double_sided, height, through) in cases.into_iter().chain(two_sided) {
        let mut glass = pane(color, 1.0, 1.0);
        glass.layers.volume = Some(volume);
        glass.double_sided = double_sided;
        let part = |mesh, material| Part { name: "part".into(), mesh, material };
        let description = SceneDescription {
            parts: vec![part(boxed(0.0, -2.0), 0), part(card(height), 1)],
            materials: vec![glass, Material::diffuse("card", Rgb::splat(0.7))],
            ..SceneDescription::default()
        };
        let scene = Scene::new(description).unwrap();
        // Light passes one surface where the card is in the body, two where it is behind.
        let to_light = match (double_sided, height < -2.0) {
            (false, _) => (color * whole).mean(),
            (true, false) => (color * half).mean(),
            (true, true) => (color * half).mean() * (color * half).mean(),
        };
        let expected = (through * (0.7 * to_light)).to_array().map(f64::from);
        let of_white: Vec<_> =
            of_white.iter().map(|m| std::array::from_fn(|c| m[c] * expected[c])).collect();
        check_every_strategy(&scene, &environment, &of_white);
    }
}

/// What a single-sided surface hides stays hidden from either side.
#[test]
fn what_lets_nothing_through_casts_shadow_from_either_side() {
    for (transmission, expected) in [(1.0, [0.5, 1.0]), (0.0, [0.0, 0.0])] {
        let mut glass = pane(Rgb::splat(0.5), transmission, 1.0);
        glass.double_sided = false;
        let scene = stack(vec![glass], Vec::new());
        let mut rays = RayBatch::default();
        // Light comes upon the front of what the first ray leaves.
        rays.push(vec3(1.0, -1.0, 2.0), Vec3::Y);
        rays.push(vec3(1.0, 1.0, 2.0), -Vec3::Y);
        let mut transmittances = Vec::new();
        scene.transmittances(&rays, &mut transmittances);
        assert_eq!(transmittances, expected);
    }
}

/// How often the pattern of a leaf repeats along a card, and how many texels it has along a side.
const REPEATS: u32 = 25;
const TEXELS: u32 = 8;

/// Whether the pattern of a leaf has a texel: about half of them, at random.
fn is_leaf(column: u32, row: u32) -> bool {
    let n = (row % TEXELS) * TEXELS + column % TEXELS;
    n.wrapping_mul(2_654_435_761) >> 31 == 1
}

/// The texels of the leaf on a card as squares.
fn cut_out() -> Mesh {
    let n = REPEATS * TEXELS;
    let mut mesh = Mesh::default();
    let at = |i: u32| 100.0 * i as f32 / n as f32 - 50.0;
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        if is_leaf(column, row) {
            let first = mesh.positions.len() as u32;
            let (x, z) = ([at(column), at(column + 1)], [at(row), at(row + 1)]);
            let corners = [(0, 1), (1, 1), (1, 0), (0, 0)];
            mesh.positions.extend(corners.map(|(i, k): (usize, usize)| vec3(x[i], 0.0, z[k])));
            mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + first)));
        }
    }
    mesh
}

/// A card with a map of its opacity above a floor is the mesh of its opaque texels, by every strategy: leaves, the light
/// that falls between them, and their shadow.
#[test]
fn cards_of_leaves_are_the_meshes_of_their_texels_by_every_strategy() {
    let leaf = || Material::diffuse("leaf", Rgb::new(0.2, 0.6, 0.1));
    let floor = Material::diffuse("floor", Rgb::new(0.7, 0.6, 0.5));
    let part = |mesh, material| Part { name: "part".into(), mesh, material };
    let scene = |leaves: Mesh, material: Material, textures: Vec<Texture>| {
        Scene::new(SceneDescription {
            parts: vec![part(leaves, 0), part(card(-1.0), 1)],
            materials: vec![material, floor.clone()],
            textures,
            ..SceneDescription::default()
        })
        .unwrap()
    };
    let environment = zenith();
    let light = EnvironmentSampling { environment: &environment, n_samples: 4 };
    let expected = means(&scene(cut_out(), leaf(), Vec::new()), &environment, &light);
    let texels = (0..TEXELS).flat_map(|row| (0..TEXELS).map(move |column| (column, row)));
    let texels = || texels.clone();
    // A mask cuts at 100 of 255, whatever there is on either side.
    let masked =
        texels().map(|(x, y)| if is_leaf(x, y) { 100 + 2 * y as u8 } else { 99 - x as u8 });
    let blended = texels().map(|(x, y)| if is_leaf(x, y) { 255 } else { 0 });
    let modes = [
        (AlphaMode::Mask { cutoff: 100.0 / 255.0 }, masked.collect::<Vec<u8>>()),
        (AlphaMode::Blend, blended.collect()),
    ];
    for (mode, alpha) in modes {
        let white = vec![[255; 3]; (TEXELS * TEXELS) as usize];
        let texture = Texture::from_rgb8("leaf", TEXELS, TEXELS, white, Encoding::Linear);
        let texture = texture.unwrap().with_alpha(alpha).unwrap();
        let scale = Vec2::splat(REPEATS as f32);
        let reference = TextureRef {
            filter: TextureFilter::Nearest,
            transform: UvTransform::new(Vec2::ZERO, 0.0, scale),
            ..TextureRef::new(0)
        };
        let coverage = Coverage { mode, opacity: 1.0, texture: Some(reference) };
        let scene = scene(card(0.0), Material { coverage, ..leaf() }, vec![texture]);
        check_every_strategy(&scene, &environment, &expected);
    }
}

/// A texture of two columns, opaque on the left and clear on the right.
fn half() -> (Texture, TextureRef) {
    let texture = Texture::from_rgb8("half", 2, 1, vec![[255; 3]; 2], Encoding::Linear).unwrap();
    let reference = TextureRef { filter: TextureFilter::Nearest, ..TextureRef::new(0) };
    (texture.with_alpha(vec![255, 100]).unwrap(), reference)
}

#[test]
fn masks_cut_holes_for_the_camera_and_for_light() {
    let (texture, reference) = half();
    let mut masked = covering(AlphaMode::Mask { cutoff: 0.5 }, 1.0, 0.5);
    masked.coverage.texture = Some(reference);
    let scene = stack(vec![masked], vec![texture]);
    let mut rays = RayBatch::default();
    for (x, opacity) in [(-10.0, 1.0), (10.0, 0.0)] {
        let down = Ray::new(vec3(x, 1.0, 1.0), -Vec3::Y);
        rays.push(vec3(x, -1.0, 1.0), Vec3::Y);
        for key in 0..50 {
            assert_eq!(scene.camera_hit(&down, key, 0).is_some(), opacity > 0.5);
        }
    }
    let mut transmittances = Vec::new();
    scene.transmittances(&rays, &mut transmittances);
    assert_eq!(transmittances, [0.0, 1.0]);
    // Nothing is opaque: the hierarchy of such surfaces is empty.
    assert_eq!((scene.bvh().triangle_count(), scene.triangle_count()), (0, 2));
}

#[test]
fn alpha_is_the_share_that_is_covered() {
    let environment = zenith();
    let strategy = EnvironmentSampling { environment: &environment, n_samples: 1 };
    let scene = stack(vec![covering(AlphaMode::Blend, 0.25, 0.5); 2], Vec::new());
    let settings = RenderSettings { n_samples: 256, ..settings() };
    let layers = draw_from(ABOVE, &scene, &environment, &strategy, &settings);
    let covered = layers.alpha.iter().map(|&a| f64::from(a)).sum::<f64>() / 64.0;
    let n = 64.0 * 256.0;
    let expected = 1.0 - 0.75f64.powi(2);
    let sigma = (expected * (1.0 - expected) / n).sqrt();
    // Five standard deviations of a binomial: one run in two million.
    assert!((covered - expected).abs() < 5.0 * sigma, "{covered}, not {expected}");
}

#[test]
fn a_mask_with_whole_opacity_is_opaque() {
    let solid = covering(AlphaMode::Mask { cutoff: 0.5 }, 0.75, 0.5);
    assert_eq!(stack(vec![solid], Vec::new()).bvh().triangle_count(), 2);
}

#[test]
fn single_sided_surfaces_are_not_seen_from_behind_and_cast_shadow() {
    let mut above = Material::diffuse("roof", Rgb::splat(0.5));
    above.double_sided = false;
    let floor =
        Material { emission: Some(emission(1.0)), ..Material::diffuse("floor", Rgb::WHITE) };
    let scene = stack(vec![above, floor], Vec::new());
    let up = Ray::new(vec3(1.0, -0.5, 2.0), Vec3::Y);
    let down = Ray::new(vec3(1.0, 0.5, 2.0), -Vec3::Y);
    let (from_below, from_above) =
        (scene.camera_hit(&up, 0, 0), scene.camera_hit(&down, 0, 0).unwrap());
    assert_eq!(from_below, None);
    assert_eq!(from_above.t, 0.5);
    assert!(scene.bvh().any_hit(&up), "a shadow");
    // From below the floor, its underside hides the roof.
    let from_far_below = Ray::new(vec3(1.0, -5.0, 2.0), Vec3::Y);
    assert_eq!(scene.camera_hit(&from_far_below, 0, 0).unwrap().t, 4.0);
}

fn emission(radiance: f32) -> Emission {
    Emission { radiance: Rgb::splat(radiance), texture: None }
}

#[test]
fn the_camera_sees_emission_and_unlit_colors_as_they_are() {
    let dark =
        Environment::new(RgbImage::filled(8, 4, Rgb::BLACK), Orientation::default(), 1.0).unwrap();
    let bright = zenith();
    let lit =
        Material { emission: Some(emission(2.5)), ..Material::diffuse("lamp", Rgb::splat(0.5)) };
    let unlit = Material {
        unlit: true,
        emission: Some(emission(9.0)),
        ..Material::diffuse("sign", Rgb::new(0.75, 0.5, 0.25))
    };
    let draw = |material: &Material, environment: &Environment| {
        let scene = stack(vec![material.clone()], Vec::new());
        let strategy = EnvironmentSampling { environment, n_samples: 1 };
        mean(&draw_from(ABOVE, &scene, environment, &strategy, &settings()).color)
    };
    assert_eq!(draw(&lit, &dark), [2.5; 3]);
    assert!(draw(&lit, &bright)[2] > 2.6);
    for environment in [&dark, &bright] {
        assert_eq!(draw(&unlit, environment), [0.75, 0.5, 0.25]);
    }
}

/// Cards at random places and turns, each twice in the same place.
fn scattered(pcg: &mut Pcg32, n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..n {
        let center = pcg.next_vec3() - 0.5;
        let (u, v) = (pcg.next_vec3() - 0.5).normalize().any_orthonormal_pair();
        let first = mesh.positions.len() as u32;
        for (x, y) in [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)] {
            mesh.positions.push(center + 0.3 * (x * u + y * v));
            mesh.uvs.push(vec2(x + 0.5, y + 0.5));
            mesh.alphas.push(pcg.next_f32());
        }
        let card = [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]];
        mesh.triangles.extend(card.map(|triangle| triangle.map(|i| i + first)));
    }
    mesh
}

trait NextVec3 {
    fn next_vec3(&mut self) -> Vec3;
}

impl NextVec3 for Pcg32 {
    fn next_vec3(&mut self) -> Vec3 {
        vec3(self.next_f32(), self.next_f32(), self.next_f32())
    }
}

/// Many rays together see what each of them sees alone, to the bit: through cut-outs, what is blended, what transmits, from
/// either side, where several coincide, and with opaque surfaces among them.
#[test]
fn rays_see_together_what_each_sees_alone() {
    let mut pcg = Pcg32::new(5, 0);
    let (texture, reference) = half();
    let mut masked = covering(AlphaMode::Mask { cutoff: 0.5 }, 1.0, 0.5);
    masked.coverage.texture = Some(reference);
    let blended = covering(AlphaMode::Blend, 0.7, 0.5);
    let one_sided = |material: Material| Material { double_sided: false, ..material };
    let tinted = pane(Rgb::new(0.9, 0.5, 0.2), 0.8, 1.0);
    let materials = vec![
        masked.clone(),
        blended.clone(),
        tinted.clone(),
        pane(Rgb::new(0.3, 0.6, 0.9), 1.0, 0.6),
        one_sided(masked),
        one_sided(blended),
        one_sided(tinted),
        Material::diffuse("opaque", Rgb::WHITE),
        one_sided(Material::diffuse("opaque from the front", Rgb::WHITE)),
    ];
    let mut part = |material| {
        let mesh = scattered(&mut pcg, if material < 7 { 12 } else { 3 });
        Part { name: "cards".into(), mesh, material }
    };
    let mut parts: Vec<Part> = (0..materials.len()).map(&mut part).collect();
    // The cards of one material are where those of another are.
    let again = |i: usize, material| Part { material, ..parts[i].clone() };
    let coincident = [again(0, 2), again(2, 1), again(3, 2), again(7, 3)];
    parts.extend(coincident);
    let of_part: Vec<usize> =
        parts.iter().flat_map(|p| vec![p.material; p.mesh.triangles.len()]).collect();
    let n_materials = materials.len();
    let textures = vec![texture];
    let description =
        SceneDescription { parts, materials, textures, ..SceneDescription::default() };
    let scene = Scene::new(description).unwrap();

    let mut sights = Sights::default();
    let (mut seen, mut n_tinted, mut n_clear) = (vec![0; n_materials], 0, 0);
    for batch in [1, 2, 63, 64, 65, 1000, 4096, 20_000] {
        let mut random_ray = |_| {
            let origin = 2.0 * (pcg.next_vec3() - 0.5);
            Ray::new(origin, pcg.next_vec3() - 0.5 - origin)
        };
        let rays: Vec<Ray> = (0..batch).map(&mut random_ray).collect();
        let key = |i: u32| SightKey { key: u64::from(i / 4), sample: i % 4 };
        let keys: Vec<SightKey> = (0..batch).map(key).collect();
        scene.sights(&rays, &keys, &mut sights);
        assert_eq!((sights.hits.len(), sights.throughputs.len()), (rays.len(), rays.len()));
        for (i, (ray, key)) in rays.iter().zip(&keys).enumerate() {
            let alone = scene.sight(ray, key.key, key.sample);
            assert_eq!(sights.hits[i], alone.hit, "{ray:?}");
            let bits = |color: Rgb| color.to_array().map(f32::to_bits);
            assert_eq!(bits(sights.throughputs[i]), bits(alone.throughput), "{ray:?}");
            assert_eq!(bits(sights.beyond[i]), bits(alone.beyond), "{ray:?}");
            match alone.hit {
                Some(hit) => seen[of_part[hit.triangle as usize]] += 1,
                None => n_clear += 1,
            }
            n_tinted += usize::from(alone.throughput != Rgb::WHITE);
        }
    }
    assert!(n_tinted > 1000 && n_clear > 100, "{n_tinted} {n_clear}");
    assert!(seen.iter().all(|&n| n > 50), "{seen:?}");
}

/// Of two surfaces in the same place that are met with probabilities p and q, a ray sees the first with p and the second with
/// (1 − p) q; neither is lost or met twice.
#[test]
fn of_coincident_cards_each_is_seen_with_its_own_probability() {
    const N: u32 = 40_000;
    let parts = [0.5, 0.4].map(|opacity| (card(0.0), covering(AlphaMode::Blend, opacity, 0.5)));
    let (meshes, materials): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    let part = |(material, mesh)| Part { name: "card".into(), mesh, material };
    let parts = meshes.into_iter().enumerate().map(part).collect();
    let scene = SceneDescription { parts, materials, ..SceneDescription::default() };
    let scene = Scene::new(scene).unwrap();
    let rays = vec![Ray::new(vec3(1.0, 1.0, 2.0), -Vec3::Y); N as usize];
    let keys: Vec<_> = (0..N).map(|i| SightKey { key: u64::from(i), sample: 0 }).collect();
    let mut sights = Sights::default();
    scene.sights(&rays, &keys, &mut sights);
    for (i, expected) in [0.5, 0.5 * 0.4].into_iter().enumerate() {
        let of_card = |hit: &&domelight::geometry::Hit| hit.triangle as usize / 2 == i;
        let share = sights.hits.iter().flatten().filter(of_card).count() as f64 / f64::from(N);
        let sigma = (expected * (1.0 - expected) / f64::from(N)).sqrt();
        // Five standard deviations of a binomial: one run in two million.
        assert!((share - expected).abs() < 5.0 * sigma, "{share}, not {expected}");
    }
}

#[test]
fn tiles_do_not_change_what_is_seen_through() {
    let cards = vec![covering(AlphaMode::Blend, 0.4, 0.5); 6];
    let scene = stack(cards, Vec::new());
    let environment = zenith();
    let strategy = EnvironmentSampling { environment: &environment, n_samples: 2 };
    let draw = |tile_size| {
        let settings =
            RenderSettings { tile_size, width: 21, height: 13, n_samples: 5, ..settings() };
        let layers = draw_from(ABOVE, &scene, &environment, &strategy, &settings);
        layers.color.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(draw(16), draw(5));
    assert_eq!(draw(16), draw(64));
}

/// A pilot sees the light through foliage that a render sees.
#[test]
fn visibility_at_a_point_counts_what_covers_it_in_part() {
    let white = Material::diffuse("white", Rgb::WHITE);
    let cards = stack(vec![covering(AlphaMode::Blend, 0.25, 0.5), white], Vec::new());
    // Between the cards.
    let camera = CameraSettings {
        projection: Projection::Perspective { fov_y_degrees: 20.0 },
        origin: vec3(0.1, -0.5, 0.0),
        target: vec3(0.0, -1.0, 0.0),
        up: Vec3::Z,
    };
    let camera = Camera::new(&camera, 16, 16).unwrap();
    let points = pilot_points(&cards, &camera, &settings());
    assert!(!points.is_empty());
    for point in &points {
        let visible = visibility(&cards, point, &[Vec3::Y, vec3(0.6, 0.8, 0.0), -Vec3::Y]);
        assert_eq!(visible, [0.75, 0.75, 1.0]);
    }
}
