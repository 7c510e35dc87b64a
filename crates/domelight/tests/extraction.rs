//! Compact sources are found whole and taken out; lights and residual are the environment.

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::statistics::ProbeStatistics;
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::{Mat3, Vec3, vec2, vec3};
use domelight::rig::{
    CompactExtraction, Extraction, ExtractionSettings, MedianCut, Method, Region, Rig, RigError,
    RigLight, ShadingReference, SphericalHarmonics, VarianceMinimization, extract, quadrature,
    smallest_rig,
};
use domelight::sampling::Pcg32;
use domelight::{Rgb, RgbImage};

const WIDTH: usize = 256;
const HEIGHT: usize = 128;
/// The width of a texel at the horizon.
const TEXEL: f32 = std::f32::consts::PI / HEIGHT as f32;

const SUN: ExtractionSettings = ExtractionSettings {
    sun: true,
    n_lamps: 0,
    n_lights: None,
    method: Method::VarianceMinimization(VarianceMinimization {
        rule: domelight::rig::Rule::Spherical,
        order: domelight::rig::Order::WorstFirst,
        lloyd_steps: 15,
    }),
    min_share: None,
};

fn lamps(n_lamps: usize) -> ExtractionSettings {
    ExtractionSettings { sun: false, n_lamps, ..SUN }
}

fn environment(map: RgbImage) -> Environment {
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

/// A map of `f` over directions, each texel the mean over 4 × 4 points of its solid angle.
fn map_of(width: usize, height: usize, f: impl Fn(Vec3) -> Rgb) -> RgbImage {
    let frame = environment(RgbImage::filled(width, height, Rgb::BLACK));
    RgbImage::from_fn(width, height, |x, y| {
        let point = |i: usize| {
            let (a, b) = ((i % 4) as f32 + 0.5, (i / 4) as f32 + 0.5);
            let uv = vec2(x as f32 + 0.25 * a, y as f32 + 0.25 * b);
            let w = frame.direction(uv / vec2(width as f32, height as f32));
            let weight = w.x.hypot(w.z);
            (f(w) * weight, weight)
        };
        let (sums, weights): (Vec<Rgb>, Vec<f32>) = (0..16).map(point).unzip();
        sums.into_iter().sum::<Rgb>() / weights.into_iter().sum::<f32>()
    })
}

/// A disc of radiance `le` beside what `behind` says.
#[derive(Clone, Copy)]
struct Disc {
    center: Vec3,
    radius: f32,
    le: Rgb,
}

impl Disc {
    fn new(center: Vec3, radius: f32, le: f32) -> Self {
        Self { center: center.normalize(), radius, le: Rgb::new(le, 0.8 * le, 0.6 * le) }
    }

    fn covers(&self, w: Vec3) -> bool {
        w.distance(self.center) < 2.0 * (0.5 * self.radius).sin()
    }
}

fn discs_on(behind: impl Fn(Vec3) -> Rgb, discs: &[Disc]) -> RgbImage {
    map_of(WIDTH, HEIGHT, |w| {
        discs.iter().find(|d| d.covers(w)).map_or_else(|| behind(w), |d| d.le)
    })
}

/// A sky that is brighter toward the horizon over a darker ground.
fn sky(w: Vec3) -> Rgb {
    if w.y > 0.0 { Rgb::new(0.3, 0.5, 0.9) * (1.0 - 0.6 * w.y) } else { Rgb::new(0.2, 0.15, 0.1) }
}

/// ∫ L dω by channel.
fn integral(env: &Environment) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for y in 0..env.map().height {
        for le in env.map().row(y) {
            let le = le.to_array();
            (0..3).for_each(|c| sum[c] += env.texel_solid_angle(y) * f64::from(le[c]));
        }
    }
    sum
}

/// Lights and residual are the environment, and the residual is nowhere negative or above it.
#[track_caller]
fn assert_conserved(env: &Environment, found: &Extraction) {
    let taken = found.rig.irradiance().to_array().map(f64::from);
    let left = found.residual.as_ref().map_or([0.0; 3], integral);
    for (c, all) in integral(env).into_iter().enumerate() {
        assert!((taken[c] + left[c] - all).abs() <= 1e-6 * all, "{taken:?} + {left:?}, not {all}");
    }
    if let Some(residual) = &found.residual {
        for (r, l) in residual.map().pixels.iter().zip(&env.map().pixels) {
            assert!(r.min_component() >= 0.0 && (*l - *r).min_component() >= 0.0);
        }
    }
    let known = |l: &u32| *l == Rig::NO_LIGHT || (*l as usize) < found.rig.lights.len();
    assert!(found.rig.labels.iter().all(known));
}

/// The light has the disc's direction within a texel, and the irradiance by which the environment
/// exceeds the one without the disc.
#[track_caller]
fn assert_is_disc(light: &RigLight, disc: &Disc, env: &Environment, without: &Environment) {
    let off = light.direction.angle_between(disc.center);
    assert!(off < TEXEL, "{off} rad off");
    let irradiance = light.irradiance.to_array().map(f64::from);
    for (c, (with, without)) in integral(env).into_iter().zip(integral(without)).enumerate() {
        let off = irradiance[c] / (with - without) - 1.0;
        assert!(off.abs() < 0.02, "{off} too much: {light:?}");
    }
}

#[test]
fn suns_of_many_sizes_and_places_are_found_whole() {
    let places = [
        vec3(0.3, 0.5, -0.8),
        // On the seam, beside it, at the pole, near it, below the horizon and on it.
        vec3(0.0, 0.4, 1.0),
        vec3(0.02, 0.4, 1.0),
        Vec3::Y,
        vec3(0.05, 1.0, 0.03),
        -Vec3::Y,
        vec3(1.0, 0.0, 0.0),
    ];
    let plain = environment(discs_on(sky, &[]));
    for center in places {
        for radius in [0.02, 0.05, 0.1] {
            let disc = Disc::new(center, radius, 2000.0);
            let env = environment(discs_on(sky, &[disc]));
            let found = extract(&env, SUN).unwrap();
            assert_eq!(found.rig.lights.len(), 1);
            let light = &found.rig.lights[0];
            assert_eq!(light.region, Region::Sun);
            assert_is_disc(light, &disc, &env, &plain);
            let spread = light.angular_radius.to_degrees() - radius.to_degrees();
            assert!(spread.abs() < 0.5 * TEXEL.to_degrees(), "{spread}° at {center}");
            assert_conserved(&env, &found);
            // Neither hole nor halo: what is left is like the sky without the sun; where the sun
            // hid the horizon, between sky and ground.
            let on_horizon = center.y.abs() < 0.2;
            let residual = found.residual.unwrap();
            for (r, p) in residual.map().pixels.iter().zip(&plain.map().pixels) {
                let off = (*r - *p).map(f32::abs).max_component();
                let between = (0.1..0.91).contains(&r.b) && (0.15..0.51).contains(&r.g);
                assert!(off < 0.2 || (on_horizon && between), "{r:?} for {p:?}, {center}");
            }
        }
    }
}

#[test]
fn a_sun_with_a_glow_is_found() {
    let center = vec3(-0.4, 0.6, 0.7).normalize();
    let angle = |w: Vec3| w.angle_between(center).max(0.01);
    let veil = |w: Vec3| sky(w) + Rgb::WHITE * (0.05 / angle(w));
    let glow = |w: Vec3| veil(w) + Rgb::WHITE * (2e-4 / angle(w).powi(3));
    let disc = Disc::new(center, 0.03, 5000.0);
    let env = environment(discs_on(glow, &[disc]));
    let found = extract(&env, SUN).unwrap();
    // What falls off faster than 1/r² is the sun's, as far as it stands out.
    let [least, most] =
        [integral(&environment(discs_on(glow, &[]))), integral(&environment(discs_on(veil, &[])))];
    let (taken, all) = (f64::from(found.rig.lights[0].irradiance.g), integral(&env));
    assert!(all[1] - least[1] < taken && taken < all[1] - most[1], "{taken}");
    assert!(found.rig.lights[0].direction.angle_between(center) < 0.1 * TEXEL);
    let residual = found.residual.as_ref().unwrap();
    // What falls off slower than 1/r² stays, without the peak.
    assert!(residual.max_luminance() < 30.0, "{}", residual.max_luminance());
    assert!(residual.le(center).luminance() > 0.5);
    assert_conserved(&env, &found);
}

#[test]
fn two_suns_near_each_other_are_two() {
    let a = Disc::new(vec3(0.3, 0.5, -0.8), 0.06, 3000.0);
    let b =
        Disc { center: Mat3::from_rotation_y(0.2) * a.center, ..Disc::new(a.center, 0.05, 1500.0) };
    let env = environment(discs_on(sky, &[a, b]));
    let found = extract(&env, ExtractionSettings { sun: true, ..lamps(3) }).unwrap();
    assert_eq!(found.rig.lights.len(), 2);
    assert_eq!(
        found.rig.lights.iter().map(|l| l.region).collect::<Vec<_>>(),
        [Region::Sun, Region::Lamp]
    );
    for (light, disc, other) in [(0, a, b), (1, b, a)] {
        let without = environment(discs_on(sky, &[other]));
        assert_is_disc(&found.rig.lights[light], &disc, &env, &without);
    }
    assert_conserved(&env, &found);
}

#[test]
fn a_sun_beside_and_in_a_bright_window() {
    let window = |w: Vec3| {
        if w.x.abs() < 0.25 && w.y.abs() < 0.25 && w.z < 0.0 { Rgb::splat(20.0) } else { sky(w) }
    };
    for center in [vec3(0.29, 0.0, -1.0), vec3(0.1, 0.05, -1.0)] {
        let disc = Disc::new(center, 0.03, 20_000.0);
        let env = environment(discs_on(window, &[disc]));
        let found = extract(&env, SUN).unwrap();
        let without = environment(discs_on(window, &[]));
        assert_is_disc(&found.rig.lights[0], &disc, &env, &without);
        assert_conserved(&env, &found);
        let both = extract(&env, ExtractionSettings { sun: true, ..lamps(4) }).unwrap();
        assert_eq!(both.rig.lights.len(), 2, "{:?}", both.rig.lights);
        let of_window = 20.0 * 0.25;
        assert!((both.rig.lights[1].irradiance.r / of_window - 1.0).abs() < 0.1);
        assert_conserved(&env, &both);
    }
}

#[test]
fn a_lamp_and_its_dish_are_one() {
    let dish = Disc::new(vec3(0.5, 0.3, 0.6), 0.15, 40.0);
    let bulb = Disc { radius: 0.07, le: dish.le * 50.0, ..dish };
    let env = environment(discs_on(|w| sky(w) * 0.1, &[bulb, dish]));
    let found = extract(&env, lamps(5)).unwrap();
    assert_eq!(found.rig.lights.len(), 1, "{:?}", found.rig.lights);
    assert!(found.residual.unwrap().max_luminance() < 0.2);
}

/// A tube overhead and a band along the horizon have small solid angles, but no direction: they stay on the map, and a
/// bulb beside them is found.
#[test]
fn long_sources_are_no_lamps() {
    let bulb = Disc::new(vec3(0.3, 0.4, 1.0), 0.04, 200.0);
    let tube = |w: Vec3| w.y > 0.3 && (w.x / w.y).abs() < 0.03;
    let band = |w: Vec3| w.y.abs() < 0.03 && w.z > -0.7;
    for is_long in [tube as fn(Vec3) -> bool, band] {
        let map = map_of(WIDTH, HEIGHT, |w| match () {
            () if bulb.covers(w) => bulb.le,
            () if is_long(w) => Rgb::splat(30.0),
            () => Rgb::splat(0.2),
        });
        let env = environment(map);
        let found = extract(&env, lamps(4)).unwrap();
        assert_conserved(&env, &found);
        let [lamp] = &found.rig.lights[..] else { panic!("{:?}", found.rig.lights) };
        assert!(lamp.direction.dot(bulb.center) > 0.999, "{:?}", lamp.direction);
    }
}

#[test]
fn noise_hides_no_sun_and_makes_none() {
    let mut pcg = Pcg32::new(5, 1);
    let mut noise = |map: RgbImage| {
        let pixels = map.pixels.iter().map(|&p| p * (0.6 + 0.8 * pcg.next_f32())).collect();
        environment(RgbImage { pixels, ..map })
    };
    let disc = Disc::new(vec3(0.3, 0.5, -0.8), 0.05, 500.0);
    let (with_sun, without) = (noise(discs_on(sky, &[disc])), noise(discs_on(sky, &[])));
    let light = extract(&with_sun, SUN).unwrap().rig.lights[0];
    assert!(light.direction.angle_between(disc.center) < TEXEL);
    assert_eq!(extract(&without, SUN).unwrap_err(), RigError::NoSun { min_share: 0.001 });
    assert_eq!(extract(&without, lamps(9)).unwrap_err(), RigError::NoLamp { min_share: 0.001 });
}

#[test]
fn nothing_to_extract_is_an_error() {
    let constant = environment(RgbImage::filled(64, 32, Rgb::splat(0.7)));
    let black = environment(RgbImage::filled(64, 32, Rgb::BLACK));
    let lights = |n| ExtractionSettings { n_lights: Some(n), ..lamps(0) };
    assert_eq!(extract(&constant, SUN).unwrap_err(), RigError::NoSun { min_share: 0.001 });
    assert_eq!(extract(&constant, lamps(2)).unwrap_err(), RigError::NoLamp { min_share: 0.001 });
    assert_eq!(extract(&black, SUN).unwrap_err(), RigError::Black);
    assert_eq!(extract(&black, lights(3)).unwrap_err(), RigError::Black);
    assert_eq!(extract(&constant, lamps(0)).unwrap_err(), RigError::NoLights);
    assert_eq!(extract(&constant, lights(0)).unwrap_err(), RigError::NoLights);
    let few = RigError::TooFewTexels { n_lights: 2049, lit: 2048 };
    assert_eq!(extract(&constant, lights(2049)).unwrap_err(), few);
    let dim = ExtractionSettings { min_share: Some(0.9), ..lights(4) };
    assert_eq!(extract(&constant, dim).unwrap_err(), RigError::TooDim);
}

#[test]
fn maps_of_few_texels_have_an_answer() {
    for (width, height) in [(1, 1), (2, 1), (1, 2), (3, 2), (4, 2), (2, 3), (9, 1)] {
        let mut map = RgbImage::filled(width, height, Rgb::splat(0.01));
        map.pixels[0] = Rgb::splat(1e5);
        let env = environment(map);
        if let Ok(found) = extract(&env, ExtractionSettings { sun: true, ..lamps(2) }) {
            assert_conserved(&env, &found);
        }
        let found = extract(&env, ExtractionSettings { n_lights: Some(1), ..lamps(1) }).unwrap();
        assert_conserved(&env, &found);
    }
}

/// Lamps that fill black: all light is theirs, or stays.
#[test]
fn a_sun_alone_in_the_dark() {
    let disc = Disc::new(vec3(0.3, 0.5, -0.8), 0.05, 1.0);
    let env = environment(discs_on(|_| Rgb::BLACK, &[disc]));
    let found = extract(&env, ExtractionSettings { n_lights: Some(9), ..SUN }).unwrap();
    assert_eq!(found.rig.lights.len(), 1);
    let without = environment(RgbImage::filled(WIDTH, HEIGHT, Rgb::BLACK));
    assert_is_disc(&found.rig.lights[0], &disc, &env, &without);
    assert!((found.rig.lights[0].share - 1.0).abs() < 1e-6);
    assert_conserved(&env, &found);
}

#[test]
fn lights_are_counted_with_the_sun() {
    let disc = Disc::new(vec3(0.3, 0.5, -0.8), 0.05, 2000.0);
    let lamp = Disc::new(vec3(-0.9, 0.1, 0.5), 0.08, 100.0);
    let env = environment(discs_on(sky, &[disc, lamp]));
    let methods = [Method::default(), Method::MedianCut(MedianCut::default())];
    for (method, n) in methods.into_iter().flat_map(|m| [1, 2, 3, 16].map(|n| (m, n))) {
        let settings =
            ExtractionSettings { sun: true, n_lamps: 4, n_lights: Some(n), method, ..SUN };
        let found = extract(&env, settings).unwrap();
        assert_eq!(found.rig.lights.len(), n);
        assert_eq!(found.rig.lights[0].region, Region::Sun);
        assert!(n < 2 || found.rig.lights[1].region == Region::Lamp);
        // Regions take the rest; without them it stays.
        assert_eq!(found.residual.is_some(), n <= 2);
        assert_conserved(&env, &found);
        let shares: f32 = found.rig.lights.iter().map(|l| l.share).sum();
        assert!(n <= 2 || (shares - 1.0).abs() < 1e-5, "{shares}");
        let label = |w: Vec3| {
            let uv = env.uv(w);
            let (x, y) = ((uv.x * WIDTH as f32) as usize, (uv.y * HEIGHT as f32) as usize);
            found.rig.labels[y * WIDTH + x]
        };
        assert_eq!(label(disc.center), 0);
        assert!(n < 2 || label(lamp.center) == 1);
    }
}

#[test]
fn dim_lights_stay_on_the_map() {
    let env = environment(discs_on(sky, &[Disc::new(vec3(0.3, 0.5, -0.8), 0.05, 400.0)]));
    let all = ExtractionSettings { n_lights: Some(40), ..SUN };
    let min_share = extract(&env, all).unwrap().rig.lights[19].share;
    let found = extract(&env, ExtractionSettings { min_share: Some(min_share), ..all }).unwrap();
    assert_eq!(found.rig.lights.len(), 20);
    assert!(found.rig.lights.iter().all(|l| l.share >= min_share));
    assert_conserved(&env, &found);
}

/// Turning the map about its axis turns sun and residual.
#[test]
fn orientation_turns_the_sun() {
    let disc = Disc::new(vec3(0.3, 0.5, -0.8), 0.05, 2000.0);
    let map = discs_on(sky, &[disc]);
    let still = extract(&environment(map.clone()), SUN).unwrap();
    let orientation = Orientation { up: UpAxis::Y, rotation: 90.0 };
    let turned = Environment::new(map, orientation, 1.0).unwrap();
    let turned = extract(&turned, SUN).unwrap();
    let expected = Mat3::from_rotation_y(90f32.to_radians()) * still.rig.lights[0].direction;
    assert!(turned.rig.lights[0].direction.distance(expected) < 1e-5);
    assert_eq!(turned.residual.as_ref().unwrap().orientation(), orientation);
    assert_eq!(turned.residual.unwrap().map(), still.residual.unwrap().map());
}

/// A large map is searched in blocks; what is taken is decided for each texel.
#[test]
fn the_sun_of_a_large_map_is_that_of_a_small_one() {
    let sizes = [512, 1024];
    let suns = sizes.map(|height| {
        let env = environment(BuiltinProbe::Sky.image(height));
        let found = extract(&env, SUN).unwrap();
        assert_conserved(&env, &found);
        found.rig.lights[0]
    });
    assert!(suns[0].direction.distance(suns[1].direction) < 2e-3);
    assert!((suns[0].irradiance.g / suns[1].irradiance.g - 1.0).abs() < 0.02, "{suns:?}");
}

/// A probe's statistics and its rig speak of the same sun.
#[test]
fn statistics_know_the_same_sun() {
    let map = BuiltinProbe::Sky.image(128);
    let sun = ProbeStatistics::new(&map).sun.unwrap();
    let light = extract(&environment(map), SUN).unwrap().rig.lights[0];
    assert!(light.direction.distance(sun.direction) < 1e-3);
    assert!((light.irradiance.g / sun.irradiance.g - 1.0).abs() < 1e-4);
    assert!((f64::from(light.share) - sun.share).abs() < 1e-4);
}

#[test]
fn the_smallest_rig_is_good_enough_and_one_light_fewer_is_not() {
    let env = environment(BuiltinProbe::Sky.image(64));
    let reference = ShadingReference::new(&env);
    for (settings, target) in [(lamps(0), 0.05), (SUN, 0.05), (lamps(0), 0.2)] {
        let found = smallest_rig(&env, settings, target).unwrap();
        let n = found.extraction.rig.lights.len();
        assert_eq!(reference.error(&found.extraction.rig), found.error);
        assert!(found.error.worst() <= target);
        assert!(found.tried.is_sorted_by_key(|(n, _)| *n));
        let fewer =
            CompactExtraction::new(&env, ExtractionSettings { n_lights: Some(n), ..settings });
        let fewer = fewer.unwrap().with_lights(Some(n - 1)).unwrap();
        assert!(fewer.residual.is_some() || reference.error(&fewer.rig).worst() > target);
        assert_conserved(&env, &found.extraction);
    }
    let never = smallest_rig(&env, lamps(0), 1e-9).unwrap_err();
    assert!(matches!(never, RigError::ErrorNotReached { n_lights: 4096, .. }), "{never}");
}

/// The sun beside a dome shades as the probe does but for the sun's size.
#[test]
fn a_sun_beside_a_dome_has_little_error() {
    let env = environment(discs_on(sky, &[Disc::new(vec3(0.3, 0.5, -0.8), 0.03, 2000.0)]));
    let found = extract(&env, SUN).unwrap();
    let reference = ShadingReference::new(&env);
    let dome = ShadingReference::new(found.residual.as_ref().unwrap());
    assert!(reference.error_beside(&found.rig, &dome).worst() < 0.01);
    assert!(reference.error(&found.rig).worst() > 0.05);
}

/// Maps whose unit is not 1: lights, residual, harmonics and errors are those of an ordinary map times the scale.
#[test]
fn rigs_of_extreme_maps_are_scaled_rigs() {
    let map = discs_on(sky, &[Disc::new(vec3(0.3, 0.5, -0.8), 0.03, 2000.0)]);
    let rig = |scale: f32| {
        let env = Environment::new(map.clone(), Orientation::default(), scale).unwrap();
        let found = extract(&env, SUN).unwrap();
        let (reference, dome) = (ShadingReference::new(&env), found.residual.as_ref().unwrap());
        let harmonics = SphericalHarmonics::project(dome).coefficients[0].g;
        let numbers =
            [dome.radiance_map().get(0, 0).g, harmonics, found.rig.lights[0].irradiance.g];
        let error = reference.error_beside(&found.rig, &ShadingReference::new(dome));
        let smallest = smallest_rig(&env, SUN, 0.2).unwrap().extraction.rig.lights.len();
        (env.unit(), numbers.map(|x| f64::from(x) / f64::from(scale)), error, smallest)
    };
    let (unit, numbers, error, smallest) = rig(1.0);
    assert_eq!(unit, 1.0);
    // At 2⁶⁰, only the sun is extreme.
    for exponent in [60, 80, -80] {
        let scaled = rig(2f32.powi(exponent));
        assert_ne!(scaled.0, 1.0);
        assert_eq!((scaled.1, scaled.2, scaled.3), (numbers, error, smallest), "2^{exponent}");
    }
}

#[test]
fn a_quadrature_holds_all_light() {
    let env = environment(BuiltinProbe::Studio.image(96));
    for max in [1, 100, 5000, 1 << 20] {
        let rig = quadrature(&env, max);
        assert!(rig.lights.len() <= max);
        for (sum, exact) in rig.irradiance().to_array().into_iter().zip(integral(&env)) {
            assert!((f64::from(sum) / exact - 1.0).abs() < 1e-5);
        }
    }
    let reference = ShadingReference::new(&env);
    let [coarse, fine, whole] =
        [500, 5000, 1 << 20].map(|max| reference.error(&quadrature(&env, max)).worst());
    assert!(fine < 0.3 * coarse && whole < fine, "{coarse} {fine} {whole}");

    // With a light for each texel, what is left is the size of the texels: it falls as their area.
    let env = environment(BuiltinProbe::Studio.image(48));
    let of_coarser_map = ShadingReference::new(&env).error(&quadrature(&env, 1 << 20)).worst();
    assert!(whole < 0.4 * of_coarser_map, "{whole} {of_coarser_map}");
}
