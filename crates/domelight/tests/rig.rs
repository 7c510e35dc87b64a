//! Light rigs: regions partition the sphere, light is conserved, and the error falls.

use domelight::bsdf::MaterialSpec;
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::{Frame, Mat3, PI, Vec3};
use domelight::rig::{
    LightPosition, MedianCut, Order, Region, Rig, RigError, Rule, ShadingReference,
    VarianceMinimization, median_cut, variance_minimization,
};
use domelight::sampling::{Pcg32, Sampler, SamplerKind};
use domelight::strategy::{LightSet, PointStrategy, SampleIndex, ShadingPoint};
use domelight::{Rgb, RgbImage};

/// A way to make a rig.
#[derive(Clone, Copy, Debug)]
enum Method {
    MedianCut(MedianCut),
    Variance(VarianceMinimization),
}

impl Method {
    fn rig(self, env: &Environment, n: usize) -> Result<Rig, RigError> {
        match self {
            Self::MedianCut(settings) => median_cut(env, n, settings),
            Self::Variance(settings) => variance_minimization(env, n, settings),
        }
    }

    /// All that differ in kind.
    fn all() -> Vec<Self> {
        let (cut, vm) = (MedianCut::default(), VarianceMinimization::default());
        let poster = VarianceMinimization::poster();
        vec![
            Self::MedianCut(cut),
            Self::MedianCut(MedianCut { scale_width: false, order: Order::WorstFirst, ..cut }),
            Self::MedianCut(MedianCut { position: LightPosition::GeometricCenter, ..cut }),
            Self::Variance(poster),
            Self::Variance(VarianceMinimization { lloyd_steps: 3, ..poster }),
            Self::Variance(VarianceMinimization { lloyd_steps: 0, ..vm }),
            Self::Variance(VarianceMinimization { lloyd_steps: 0, order: Order::Levels, ..vm }),
            Self::Variance(vm),
        ]
    }
}

fn environment(map: RgbImage) -> Environment {
    Environment::new(map, Orientation::default(), 1.0).unwrap()
}

/// Log-normal noise, a colored sky, a lamp, and darkness below.
fn interior(width: usize, height: usize) -> RgbImage {
    let mut pcg = Pcg32::new(7, 1);
    RgbImage::from_fn(width, height, |x, y| {
        let (u, v) = ((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let noise = (2.0 * pcg.next_f32()).exp();
        let lamp = if (u - 0.3).hypot(v - 0.35) < 0.03 { 200.0 } else { 0.0 };
        let window = if (0.9..0.97).contains(&u) && (0.3..0.5).contains(&v) { 20.0 } else { 0.0 };
        match v {
            0.85.. => Rgb::BLACK,
            0.6.. => Rgb::new(0.2, 0.1, 0.05) * noise,
            _ => {
                (Rgb::new(0.3, 0.5, 0.9)
                    + Rgb::new(lamp, 0.8 * lamp, 0.5 * lamp)
                    + Rgb::splat(window))
                    * noise
            }
        }
    })
}

/// A uniform disc of radius `radius` around `center` on a sky of radiance `sky`.
fn sun(width: usize, height: usize, center: Vec3, radius: f32, sky: f32) -> RgbImage {
    let env = environment(RgbImage::filled(width, height, Rgb::BLACK));
    RgbImage::from_fn(width, height, |x, y| {
        let uv = [(x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32];
        let inside = env.direction(uv.into()).distance(center) < 2.0 * (0.5 * radius).sin();
        if inside { Rgb::new(1e4, 8e3, 6e3) } else { Rgb::splat(sky) }
    })
}

fn maps() -> Vec<(&'static str, RgbImage)> {
    let mut sparse = RgbImage::filled(40, 20, Rgb::BLACK);
    for i in 0..60 {
        sparse.pixels[(i * 137) % 800] = Rgb::new(1.0, i as f32, 0.5);
    }
    vec![
        ("interior", interior(96, 48)),
        ("sun", sun(128, 64, Vec3::new(0.36, 0.48, 0.8), 0.1, 0.3)),
        ("sparse", sparse),
        ("constant", RgbImage::filled(24, 12, Rgb::new(1.0, 2.0, 3.0))),
        ("odd", interior(37, 23)),
        ("tall", interior(8, 40)),
        ("one row", interior(64, 1)),
    ]
}

/// ∫ L dω over the texels that `keep` names, by channel.
fn integral(env: &Environment, keep: impl Fn(usize) -> bool) -> [f64; 3] {
    let map = env.map();
    let mut sum = [0.0; 3];
    for (i, le) in map.pixels.iter().enumerate().filter(|(i, _)| keep(*i)) {
        let solid_angle = env.texel_solid_angle(i / map.width);
        let le = le.to_array();
        (0..3).for_each(|c| sum[c] += f64::from(le[c]) * solid_angle);
    }
    sum
}

fn assert_close(name: &str, value: Rgb, exact: [f64; 3]) {
    for (v, e) in value.to_array().into_iter().zip(exact) {
        assert!((f64::from(v) - e).abs() <= 1e-5 * e.abs(), "{name}: {value:?}, not {exact:?}");
    }
}

#[test]
fn regions_partition_the_map_and_conserve_its_light() {
    for (name, map) in maps() {
        let env = environment(map);
        for method in Method::all() {
            for n in [1, 2, 3, 7, 16, 33] {
                let name = format!("{name}, {n} lights, {method:?}");
                let rig = method.rig(&env, n).unwrap();
                assert_eq!(rig.lights.len(), n, "{name}");
                assert_eq!(rig.labels.len(), env.map().pixels.len());
                assert_close(&name, rig.irradiance(), integral(&env, |_| true));
                let sphere: f64 = rig.lights.iter().map(|l| f64::from(l.solid_angle)).sum();
                assert!((sphere / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6, "{name}");
                check_lights(&name, &env, &rig);
            }
        }
    }
}

fn check_lights(name: &str, env: &Environment, rig: &Rig) {
    let mut last = f32::INFINITY;
    for (i, light) in rig.lights.iter().enumerate() {
        let exact = integral(env, |texel| rig.labels[texel] == i as u32);
        assert_close(name, light.irradiance, exact);
        assert!((light.direction.length() - 1.0).abs() < 1e-6, "{name}: {light:?}");
        assert!((0.0..=PI).contains(&light.angular_radius), "{name}: {light:?}");
        assert!(light.share > 0.0 && light.share <= last, "{name}: {light:?}");
        last = light.share;
        let n_texels = rig.labels.iter().filter(|&&l| l == i as u32).count();
        if let Region::Rectangle(r) = light.region {
            assert_eq!(r.area(), n_texels, "{name}: {r:?}");
            for x in r.x0..r.x1 {
                for y in r.y0..r.y1 {
                    assert_eq!(rig.labels[y * rig.width + x % rig.width], i as u32, "{name}");
                }
            }
        }
    }
    let shares: f32 = rig.lights.iter().map(|l| l.share).sum();
    assert!((shares - 1.0).abs() < 1e-5);
}

/// Large maps are cut between blocks of texels, and small regions of them between texels: a
/// dark map with a few lit texels needs both.
#[test]
fn large_maps_conserve_light_as_well() {
    let (width, height) = (3001, 1500);
    let mut sparse = RgbImage::filled(width, height, Rgb::BLACK);
    for i in 0..40 {
        sparse.pixels[(i * i * 7_919 + i % 3) % (width * height)] = Rgb::new(1.0, 0.5, i as f32);
    }
    sparse.pixels[5_000..5_006].fill(Rgb::WHITE);
    for (name, map) in [("interior", interior(width, height)), ("sparse", sparse)] {
        let env = environment(map);
        for method in Method::all() {
            let rig = method.rig(&env, 40).unwrap();
            assert_eq!(rig.lights.len(), 40, "{name} {method:?}");
            let mut sums = vec![[0.0; 3]; 40];
            for (i, le) in env.map().pixels.iter().enumerate() {
                let solid_angle = env.texel_solid_angle(i / width);
                let sum = &mut sums[rig.labels[i] as usize];
                let le = le.to_array();
                (0..3).for_each(|c| sum[c] += f64::from(le[c]) * solid_angle);
            }
            for (light, sum) in rig.lights.iter().zip(sums) {
                assert_close(&format!("{name} {method:?}"), light.irradiance, sum);
            }
        }
    }
}

#[test]
fn any_number_of_lights_to_the_last_texel() {
    for (name, map) in [("sparse", maps().remove(2).1), ("interior", interior(12, 6))] {
        let env = environment(map);
        let lit = env.map().pixels.iter().filter(|p| !p.is_black()).count();
        for method in Method::all() {
            let counts: Vec<usize> = (1..=lit).collect();
            for n in counts {
                assert_eq!(method.rig(&env, n).unwrap().lights.len(), n, "{name} {method:?}");
            }
            let error = method.rig(&env, lit + 1).unwrap_err();
            assert_eq!(error, RigError::TooFewTexels { n_lights: lit + 1, lit });
        }
    }
}

#[test]
fn no_light_is_an_error() {
    let black = environment(RgbImage::filled(8, 4, Rgb::BLACK));
    let white = Environment::constant(Rgb::WHITE).unwrap();
    for method in Method::all() {
        assert_eq!(method.rig(&black, 4), Err(RigError::Black));
        assert_eq!(method.rig(&white, 0), Err(RigError::NoLights));
        assert_eq!(method.rig(&black, 0), Err(RigError::NoLights));
        let rig = method.rig(&white, 1).unwrap();
        assert!(rig.lights[0].direction.is_finite());
        assert_close("constant", rig.irradiance(), [4.0 * std::f64::consts::PI; 3]);
    }
}

#[test]
fn a_light_that_is_alone_has_its_own_size_and_place() {
    let centers = [Vec3::X, Vec3::Z, Vec3::Y, -Vec3::Y, Vec3::new(0.6, 0.8, 0.0)];
    for center in centers {
        let (width, height) = (512, 256);
        let env = environment(sun(width, height, center, 0.2, 0.0));
        let rig = variance_minimization(&env, 1, VarianceMinimization::default()).unwrap();
        let light = rig.lights[0];
        let texel = PI / height as f32;
        assert!(light.direction.distance(center) < texel, "{center}: {light:?}");
        assert!((light.angular_radius - 0.2).abs() < texel, "{center}: {light:?}");
    }
}

/// A small sun under a dim sky stays whole where a rectangle of the map could not hold it.
#[test]
fn a_sun_across_the_seam_or_a_pole_is_one_light() {
    let seam = [Vec3::Z, Vec3::new(0.002, 0.6, 0.8).normalize()];
    for center in seam.into_iter().chain([Vec3::Y, -Vec3::Y]) {
        let env = environment(sun(512, 256, center, 0.03, 2.0));
        for n in [4, 16, 32] {
            let rig = variance_minimization(&env, n, VarianceMinimization::default()).unwrap();
            let sun = env.map().pixels.iter().zip(&rig.labels).filter(|(p, _)| p.r > 1e3);
            let labels: std::collections::BTreeSet<u32> = sun.map(|(_, &l)| l).collect();
            assert_eq!(labels.len(), 1, "{center}, {n} lights");
        }
    }
}

#[test]
fn turning_the_environment_turns_the_rig() {
    let map = interior(96, 48);
    let still = environment(map.clone());
    for method in Method::all() {
        let expected = method.rig(&still, 24).unwrap();
        let orientation = Orientation { up: UpAxis::Y, rotation: 50.0 };
        let env = Environment::new(map.clone(), orientation, 1.0).unwrap();
        let rig = method.rig(&env, 24).unwrap();
        assert_eq!(rig.labels, expected.labels);
        let turn = Mat3::from_rotation_y(50f32.to_radians());
        for (a, b) in rig.lights.iter().zip(&expected.lights) {
            assert!((a.direction - turn * b.direction).length() < 1e-5, "{method:?}");
        }
        let orientation = Orientation { up: UpAxis::Z, rotation: 0.0 };
        let env = Environment::new(map.clone(), orientation, 1.0).unwrap();
        for (a, b) in method.rig(&env, 24).unwrap().lights.iter().zip(&expected.lights) {
            let d = b.direction;
            assert!((a.direction - Vec3::new(d.x, -d.z, d.y)).length() < 1e-5, "{method:?}");
        }
    }
}

/// The spherical rule does not know where the map's seam is.
#[test]
fn rolling_the_map_turns_the_rig() {
    let map = interior(96, 48);
    for lloyd_steps in [0, 15] {
        let settings = VarianceMinimization { lloyd_steps, ..Default::default() };
        let expected = variance_minimization(&environment(map.clone()), 40, settings).unwrap();
        for shift in [1, 17, 48, 95] {
            let rolled = RgbImage::from_fn(96, 48, |x, y| map.get((x + 96 - shift) % 96, y));
            let rig = variance_minimization(&environment(rolled), 40, settings).unwrap();
            // Columns grow to the right as seen from inside: clockwise from above.
            let turn = Mat3::from_rotation_y(-(shift as f32) / 96.0 * 2.0 * PI);
            for (a, b) in rig.lights.iter().zip(&expected.lights) {
                assert!((a.direction - turn * b.direction).length() < 1e-5, "{shift} {a:?} {b:?}");
                assert!((a.share - b.share).abs() < 1e-6, "{shift} {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn the_error_falls_with_the_number_of_lights() {
    let env = environment(interior(256, 128));
    let reference = ShadingReference::new(&env);
    for method in Method::all() {
        let errors =
            [1, 4, 16, 64, 256, 1024].map(|n| reference.error(&method.rig(&env, n).unwrap()));
        for pair in errors.windows(2) {
            assert!(pair[1].diffuse < pair[0].diffuse, "{method:?}: {errors:?}");
            assert!(pair[1].glossy < pair[0].glossy, "{method:?}: {errors:?}");
        }
    }
}

/// Each step from the common mistake to the default is worth its trouble.
#[test]
fn better_methods_have_smaller_errors() {
    let env = environment(interior(256, 128));
    let reference = ShadingReference::new(&env);
    let (cut, vm) = (MedianCut::default(), VarianceMinimization::default());
    let methods = [
        Method::MedianCut(MedianCut { position: LightPosition::GeometricCenter, ..cut }),
        Method::MedianCut(cut),
        Method::Variance(VarianceMinimization { lloyd_steps: 0, ..vm }),
        Method::Variance(vm),
    ];
    for n in [16, 64, 256] {
        let errors = methods.map(|m| reference.error(&m.rig(&env, n).unwrap()));
        for (pair, methods) in errors.windows(2).zip(methods.windows(2)) {
            assert!(pair[1].diffuse < pair[0].diffuse, "{n}: {methods:?} {pair:?}");
            assert!(pair[1].glossy < pair[0].glossy, "{n}: {methods:?} {pair:?}");
        }
    }
}

/// Σ f_r cos θ · E over the lights: one light in each texel is a sum over the map.
#[test]
fn a_light_set_asks_for_one_ray_a_light() {
    let env = environment(interior(32, 16));
    let lit = env.map().pixels.iter().filter(|p| !p.is_black()).count();
    let rig = median_cut(&env, lit, MedianCut::default()).unwrap();
    let lights = LightSet { rig: rig.clone(), unit: 1.0 };
    assert_eq!(PointStrategy::n_rays(&lights), lit as u32);
    let normal = Vec3::new(0.6, 0.64, 0.48);
    let at = ShadingPoint {
        position: Vec3::ZERO,
        ng: normal,
        frame: Frame::from_z(normal),
        wo: Vec3::Z,
        bsdf: "diffuse:0.8,0.5,0.2".parse::<MaterialSpec>().unwrap().into(),
    };
    let mut shaded = Rgb::BLACK;
    let numbers = SampleIndex { sampler: Sampler::new(SamplerKind::Sobol, 0, 0), sample: 0 };
    lights.sample(&at, numbers, &mut (), |_, weight| shaded += weight);
    let exact = rig.lights.iter().map(|l| {
        let cos_theta = l.direction.dot(normal).max(0.0);
        Rgb::new(0.8, 0.5, 0.2) * l.irradiance * (cos_theta / PI)
    });
    let exact: Rgb = exact.sum();
    assert_close("light set", shaded, exact.to_array().map(f64::from));
}

/// One light in every lit texel is the map, up to the extent of a texel.
#[test]
fn a_light_in_every_texel_shades_as_the_map() {
    let [coarse, fine] = [(32, 16), (64, 32)].map(|(width, height)| {
        let env = environment(interior(width, height));
        let lit = env.map().pixels.iter().filter(|p| !p.is_black()).count();
        let rig = variance_minimization(&env, lit, VarianceMinimization::default()).unwrap();
        ShadingReference::new(&env).error(&rig)
    });
    // What is left is the size of the texels.
    assert!(fine.diffuse < 0.5 * coarse.diffuse, "{coarse:?} {fine:?}");
    assert!(fine.glossy < 0.5 * coarse.glossy, "{coarse:?} {fine:?}");
}

#[test]
fn the_poster_cuts_two_to_the_n_regions_level_by_level() {
    let settings = VarianceMinimization::poster();
    assert_eq!(settings.rule, Rule::Poster);
    let env = environment(interior(96, 48));
    let rigs = [4, 5, 6, 7, 8].map(|n| variance_minimization(&env, n, settings).unwrap());
    // Each further light divides one of the four regions, and none twice.
    for (i, rig) in rigs.iter().enumerate().skip(1) {
        let kept =
            rig.lights.iter().filter(|l| rigs[0].lights.iter().any(|o| o.region == l.region));
        assert_eq!(kept.count(), 4 - i);
    }
}

#[cfg(feature = "render")]
#[test]
fn the_same_bits_for_any_number_of_threads() {
    let env = environment(interior(300, 150));
    for method in Method::all() {
        let rigs = [1, 2, 5].map(|n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| method.rig(&env, 100).unwrap())
        });
        assert_eq!(rigs[0], rigs[1], "{method:?}");
        assert_eq!(rigs[0], rigs[2], "{method:?}");
    }
}
