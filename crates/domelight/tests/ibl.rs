//! Prefiltered light against quadrature over all texels of the map.

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::Vec3;
use domelight::rig::ibl::{
    CubeAxes, Engine, FilteredMap, IblError, IblSettings, Layout, PrefilteredLight, prefilter,
};
use domelight::{Rgb, RgbImage};
use std::f64::consts::{PI, TAU};

/// Nodes and weights of the Gauss–Legendre rule with four points on [−1, 1].
const GAUSS: [[f64; 2]; 4] = [
    [-0.861_136_311_594_052_6, 0.347_854_845_137_453_9],
    [-0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
    [0.339_981_043_584_856_3, 0.652_145_154_862_546_1],
    [0.861_136_311_594_052_6, 0.347_854_845_137_453_9],
];

/// The light of a map as points: directions in the world, and radiance times solid angle.
struct Points(Vec<([f64; 3], [f64; 3])>);

impl Points {
    /// Each lit texel as `cells` × `cells` cells of 4 × 4 points; suns, which the horizon may divide, as 32 × 32 cells.
    fn of(environment: &Environment, cells: usize) -> Self {
        let map = environment.map();
        let to_world = environment.orientation().map_to_world();
        let mut points = Vec::new();
        for (i, le) in map.pixels.iter().enumerate().filter(|(_, le)| !le.is_black()) {
            let n = if le.r > 1e3 { 32 } else { cells };
            let (x, y) = ((i % map.width * n) as f64, (i / map.width * n) as f64);
            let (columns, rows) = ((map.width * n) as f64, (map.height * n) as f64);
            for cell in 0..n * n {
                let (cell_x, cell_y) = (x + (cell % n) as f64, y + (cell / n) as f64);
                for [s, ws] in GAUSS {
                    for [t, wt] in GAUSS {
                        let phi = TAU * ((cell_x + 0.5 + 0.5 * s) / columns - 0.5);
                        let theta = PI * (cell_y + 0.5 + 0.5 * t) / rows;
                        let (sin_phi, cos_phi) = phi.sin_cos();
                        let (sin, cos) = theta.sin_cos();
                        let omega = 0.25 * ws * wt * TAU * PI / (columns * rows) * sin;
                        let d = [sin_phi * sin, cos, -cos_phi * sin];
                        let d = std::array::from_fn(|i| {
                            (0..3).map(|k| f64::from(to_world.col(k)[i]) * d[k]).sum()
                        });
                        points.push((d, le.to_array().map(|c| f64::from(c) * omega)));
                    }
                }
            }
        }
        Self(points)
    }

    /// Σ L D n·l / ∫ D n·l with n = v = r; the lobe's integral by its own quadrature.
    fn filtered(&self, n: [f64; 3], alpha: f64, norm: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (l, light) in &self.0 {
            let cosine = n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
            if cosine > 0.0 {
                let weight = lobe(cosine, alpha) / norm;
                (0..3).for_each(|c| sum[c] += weight * light[c]);
            }
        }
        sum
    }
}

/// D(h) n·l of GGX with n = v.
fn lobe(cosine: f64, alpha: f64) -> f64 {
    let cos2_h = 0.5 * (1.0 + cosine);
    let a2 = alpha * alpha;
    a2 / (PI * (cos2_h * (a2 - 1.0) + 1.0).powi(2)) * cosine
}

/// ∫ D n·l dω by midpoints, which crowd where the lobe is narrow.
fn lobe_integral(alpha: f64) -> f64 {
    let n = 100_000;
    (0..n)
        .map(|i| {
            let u = (f64::from(i) + 0.5) / f64::from(n);
            // 1 − cos θ = u³.
            TAU * 3.0 * u * u / f64::from(n) * lobe(1.0 - u * u * u, alpha)
        })
        .sum()
}

/// The largest relative error of all texels of filtered levels and of the irradiance; below 10⁻⁵ of the map's mean, the
/// error relative to that.
fn worst_error(environment: &Environment, settings: &IblSettings, cells: usize) -> f64 {
    let light = prefilter(environment, settings).unwrap();
    let points = Points::of(environment, cells);
    let mut mean = [0.0; 3];
    for (_, le) in &points.0 {
        (0..3).for_each(|c| mean[c] += le[c] / (4.0 * PI));
    }
    let filtered = settings.roughness.iter().zip(&light.levels).filter(|(r, _)| **r > 0.0);
    let cubes = filtered.map(|(&r, cube)| (cube, f64::from(r * r)));
    let mut worst = 0.0f64;
    for (cube, alpha) in cubes.chain([(&light.irradiance, 1.0)]) {
        let norm = lobe_integral(alpha);
        for (i, texel) in cube.texels.iter().enumerate() {
            let n = normal(cube, i, settings.axes).as_dvec3().normalize().to_array();
            let expected = points.filtered(n, alpha, norm);
            for (c, value) in texel.to_array().into_iter().enumerate() {
                let scale = expected[c].max(1e-5 * mean[c]);
                let error = (f64::from(value) - expected[c]).abs();
                assert!(value >= 0.0 && (scale > 0.0 || error == 0.0));
                if scale > 0.0 {
                    worst = worst.max(error / scale);
                }
            }
        }
    }
    worst
}

fn normal(map: &FilteredMap, i: usize, axes: CubeAxes) -> Vec3 {
    axes.to_world(map.layout.direction(map.size, i))
}

/// A map that is black but for one texel.
fn one_texel(width: usize, height: usize, at: [usize; 2], sky: f32) -> Environment {
    let mut map = RgbImage::filled(width, height, Rgb::splat(sky));
    map.pixels[at[1] * width + at[0]] = Rgb::new(3e4, 2e4, 1e4);
    Environment::from_image(map).unwrap()
}

fn small(size: usize) -> IblSettings {
    IblSettings { irradiance_size: 8, ..IblSettings::linear(size) }
}

fn octahedral(size: usize) -> IblSettings {
    IblSettings { layout: Layout::Octahedral, ..small(size) }
}

const TOLERANCE: f64 = 0.005;

#[test]
fn a_sun_of_one_texel_leaves_neither_fireflies_nor_rings() {
    for at in [[40, 11], [0, 31], [63, 0], [20, 15]] {
        let alone = one_texel(64, 32, at, 0.0);
        for settings in [small(16), octahedral(32)] {
            let error = worst_error(&alone, &settings, 1);
            assert!(error < TOLERANCE, "{:?} {at:?}: {error}", settings.layout);
        }
    }
    // A texel of 0.7°, and a lobe of 3.5°.
    let tiny = one_texel(512, 256, [150, 70], 0.0);
    let sharpest = IblSettings { roughness: vec![0.0, 1.0 / 6.0], ..small(32) };
    let error = worst_error(&tiny, &sharpest, 1);
    assert!(error < TOLERANCE, "{error}");
}

#[test]
fn a_sun_in_a_sky_is_right() {
    let error = worst_error(&one_texel(32, 16, [9, 4], 1.0), &small(16), 2);
    assert!(error < TOLERANCE, "{error}");
}

#[test]
fn a_checker_is_right() {
    let map = RgbImage::from_fn(32, 16, |x, y| {
        if (x / 2 + y / 2) % 2 == 0 { Rgb::new(4.0, 2.0, 0.0) } else { Rgb::new(0.0, 0.5, 1.0) }
    });
    let error = worst_error(&Environment::from_image(map).unwrap(), &small(16), 2);
    assert!(error < TOLERANCE, "{error}");
}

#[test]
fn builtin_probes_are_right() {
    for probe in [BuiltinProbe::Sky, BuiltinProbe::Studio, BuiltinProbe::Cathedral] {
        let environment = Environment::from_image(probe.image(32)).unwrap();
        for settings in [small(16), octahedral(32)] {
            let error = worst_error(&environment, &settings, 1);
            assert!(error < TOLERANCE, "{} {:?}: {error}", probe.name(), settings.layout);
        }
    }
}

#[test]
fn maps_of_any_shape_and_orientation_are_right() {
    let noise = |x: usize, y: usize| Rgb::splat(((7 * x + 13 * y) % 11) as f32);
    for (width, height) in [(1, 1), (2, 1), (5, 3), (1, 4), (12, 2)] {
        let map = RgbImage::from_fn(width, height, |x, y| noise(x + 1, y));
        for orientation in [
            Orientation::default(),
            Orientation { up: UpAxis::Y, rotation: 33.0 },
            Orientation { up: UpAxis::Z, rotation: -140.0 },
        ] {
            let environment = Environment::new(map.clone(), orientation, 2.0).unwrap();
            let axes = Engine::Three.axes();
            for settings in [small(8), octahedral(8)] {
                let settings = IblSettings { axes, irradiance_size: 4, ..settings };
                let error = worst_error(&environment, &settings, 16);
                assert!(error < TOLERANCE, "{width}x{height} {orientation:?}: {error}");
            }
        }
    }
}

#[test]
fn a_white_furnace_is_white() {
    for (width, height) in [(1, 1), (2, 1), (64, 32), (37, 11)] {
        let map = RgbImage::filled(width, height, Rgb::WHITE);
        let environment = Environment::from_image(map).unwrap();
        for settings in [small(16), octahedral(16), octahedral(15)] {
            let light = prefilter(&environment, &settings).unwrap();
            for map in light.levels.iter().chain([&light.irradiance]) {
                for texel in &map.texels {
                    let error = (*texel - Rgb::WHITE).map(f32::abs).max_component();
                    assert!(error < 0.002, "{width}x{height} at {}: {texel:?}", map.size);
                }
            }
        }
    }
}

/// The solid angle of a texel.
fn solid_angle(layout: Layout, size: usize, i: usize) -> f64 {
    if layout == Layout::Octahedral {
        return 4.0 * PI / (size * size) as f64;
    }
    let (x, y) = (i % size, i / size % size);
    let edge = |i: usize| 2.0 * i as f64 / size as f64 - 1.0;
    let corner = |s: f64, t: f64| (s * t).atan2((s * s + t * t + 1.0).sqrt());
    let (s0, s1, t0, t1) = (edge(x), edge(x + 1), edge(y), edge(y + 1));
    corner(s1, t1) - corner(s0, t1) - corner(s1, t0) + corner(s0, t0)
}

/// ∫ L ω dω and ∫ L dω of a map, in the world.
fn moments(map: &FilteredMap, axes: CubeAxes) -> ([f64; 3], f64) {
    let (mut moment, mut energy) = ([0.0; 3], 0.0);
    for (i, texel) in map.texels.iter().enumerate() {
        let flux = f64::from(texel.g) * solid_angle(map.layout, map.size, i);
        let d = normal(map, i, axes).to_array();
        (0..3).for_each(|k| moment[k] += flux * f64::from(d[k]));
        energy += flux;
    }
    (moment, energy)
}

/// Level 0 keeps the energy and the direction of the sun, for every engine and orientation; so does the next level.
#[test]
fn the_sun_stands_where_the_engine_looks_for_it() {
    let mut map = RgbImage::filled(64, 32, Rgb::BLACK);
    map.pixels[10 * 64 + 37] = Rgb::splat(1e4);
    for orientation in [
        Orientation::default(),
        Orientation { up: UpAxis::Y, rotation: 71.0 },
        Orientation { up: UpAxis::Z, rotation: 200.0 },
    ] {
        let environment = Environment::new(map.clone(), orientation, 1.0).unwrap();
        let sun = environment.direction(domelight::math::vec2(37.5 / 64.0, 10.5 / 32.0));
        let all = Engine::ALL.map(Engine::axes).into_iter().chain([CubeAxes::WORLD]);
        let all =
            all.flat_map(|axes| [small(32), octahedral(64), octahedral(63)].map(|s| (axes, s)));
        for (axes, settings) in all {
            let roughness = vec![0.0, 0.3];
            let settings = IblSettings { axes, roughness, irradiance_size: 1, ..settings };
            let PrefilteredLight { levels, .. } = prefilter(&environment, &settings).unwrap();
            let (moment, energy) = moments(&levels[0], axes);
            assert!((energy / environment.power() - 1.0).abs() < 1e-4, "{energy}");
            let [x, y, z] = moment.map(|m| (m / energy) as f32);
            // Within a texel of 2.8°: the flux of a texel stands in its middle.
            let cosine = Vec3::new(x, y, z).dot(sun);
            assert!(cosine > 0.9988, "{orientation:?} {axes:?}: {cosine}");
            for level in &levels[1..] {
                let (moment, energy) = moments(level, axes);
                let length = moment.iter().map(|m| m * m).sum::<f64>().sqrt();
                let [x, y, z] = moment.map(|m| (m / length) as f32);
                assert!((energy / environment.power() - 1.0).abs() < 0.02, "{energy}");
                let cosine = Vec3::new(x, y, z).dot(sun);
                assert!(cosine > 0.9995, "{orientation:?} {axes:?} {}: {cosine}", level.size);
            }
        }
    }
}

/// Neighbors at an edge of an octahedral map differ no more than those within it, and the last level is a single texel.
#[test]
fn octahedral_maps_have_no_seams() {
    let environment = Environment::from_image(BuiltinProbe::Cathedral.image(64)).unwrap();
    let light = prefilter(&environment, &octahedral(32)).unwrap();
    assert_eq!(light.levels.iter().map(|map| map.size).collect::<Vec<_>>(), [32, 16, 8, 4, 2, 1]);
    for map in &light.levels[1..5] {
        let (size, last) = (map.size, map.size - 1);
        let difference = |a: [usize; 2], b: [usize; 2]| {
            let [a, b] = [a, b].map(|[x, y]| map.texels[y * size + x]);
            (a - b).map(f32::abs).max_component()
        };
        let indices = (0..size).flat_map(|y| (0..last).map(move |x| (x, y)));
        let within = indices
            .map(|(x, y)| difference([x, y], [x + 1, y]).max(difference([y, x], [y, x + 1])));
        let within = within.fold(0.0, f32::max);
        for i in 0..size {
            for [at, beyond] in [
                [[0, i], [0, last - i]],
                [[last, i], [last, last - i]],
                [[i, 0], [last - i, 0]],
                [[i, last], [last - i, last]],
            ] {
                let across = difference(at, beyond);
                // The texels of level 4 are as wide as a quarter of the sphere.
                assert!(across <= 1.2 * within, "{size} {at:?}: {across} {within}");
            }
        }
    }
    let mean = environment.power() / (4.0 * PI);
    let single =
        f64::from(light.levels[0].texels.iter().map(|t| t.luminance()).sum::<f32>()) / 1024.0;
    assert!((single / mean - 1.0).abs() < 1e-4, "{single} {mean}");
}

/// Irradiance of the nine coefficients beside the exact one: Ramamoorthi & Hanrahan 2001 prove an average error of at
/// most 3 % and a largest one of at most 9 % of the brightest.
#[test]
fn harmonics_are_near_the_exact_irradiance() {
    for engine in [Engine::Bevy, Engine::Three, Engine::Filament] {
        for probe in [BuiltinProbe::Sky, BuiltinProbe::Studio, BuiltinProbe::Cathedral] {
            let environment = Environment::from_image(probe.image(64)).unwrap();
            let axes = engine.axes();
            let settings = IblSettings { axes, harmonics_window: false, ..small(16) };
            let light = prefilter(&environment, &settings).unwrap();
            let cube = &light.irradiance;
            let brightest = cube.texels.iter().map(|t| t.max_component()).fold(0.0, f32::max);
            let (mut sum, mut worst) = (0.0, 0.0f32);
            for (i, &exact) in cube.texels.iter().enumerate() {
                let n = normal(cube, i, CubeAxes::WORLD);
                let harmonic = light.harmonics.irradiance(n) / domelight::math::PI;
                let error = (harmonic - exact).map(f32::abs).max_component() / brightest;
                sum += error;
                worst = worst.max(error);
            }
            let mean = sum / cube.texels.len() as f32;
            assert!(mean < 0.03 && worst < 0.09, "{}: {mean} {worst}", probe.name());
        }
    }
}

/// Opposite to a sun, nine harmonics fall below zero, and their window prevents it.
#[test]
fn harmonics_are_not_negative() {
    let environment = one_texel(32, 16, [9, 4], 1.0);
    let with = |harmonics_window| {
        let settings = IblSettings { axes: Engine::Three.axes(), harmonics_window, ..small(16) };
        prefilter(&environment, &settings).unwrap()
    };
    let darkest = |light: &PrefilteredLight| {
        let cube = &light.irradiance;
        let irradiance = |i| light.harmonics.irradiance(normal(cube, i, CubeAxes::WORLD)).r;
        let darkest = (0..cube.texels.len()).map(irradiance).fold(f32::MAX, f32::min);
        darkest / light.harmonics.irradiance(Vec3::Y).r.abs()
    };
    let [rings, windowed] = [false, true].map(with);
    assert!(darkest(&rings) < -0.01 && rings.harmonics_window == 1.0);
    assert!(darkest(&windowed) > -1e-6 && windowed.harmonics_window < 1.0);
    let constant = |light: &PrefilteredLight| light.harmonics.coefficients[0].r;
    assert!((constant(&windowed) / constant(&rings) - 1.0).abs() < 1e-6);
}

#[test]
fn extreme_radiance_keeps_its_scale() {
    let dim = prefilter(&one_texel(32, 16, [9, 4], 1.0), &small(8)).unwrap();
    let bright = one_texel(32, 16, [9, 4], 1.0).scaled(1e30).unwrap();
    let bright = prefilter(&bright, &small(8)).unwrap();
    for (a, b) in dim.levels.iter().zip(&bright.levels) {
        for (a, b) in a.texels.iter().zip(&b.texels) {
            assert!((b.r / a.r / 1e30 - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn bad_settings_and_black_maps_are_errors() {
    let black = Environment::constant(Rgb::BLACK).unwrap();
    assert_eq!(prefilter(&black, &small(8)), Err(IblError::Black));
    let white = Environment::constant(Rgb::WHITE).unwrap();
    let with = |change: fn(&mut IblSettings)| {
        let mut settings = small(8);
        change(&mut settings);
        prefilter(&white, &settings)
    };
    assert_eq!(with(|s| s.size = 0), Err(IblError::Size { size: 0 }));
    assert_eq!(with(|s| s.irradiance_size = 5000), Err(IblError::Size { size: 5000 }));
    assert_eq!(with(|s| s.size = 4), Err(IblError::Levels { levels: 4, size: 4 }));
    assert_eq!(with(|s| s.roughness.clear()), Err(IblError::Levels { levels: 0, size: 8 }));
    assert_eq!(with(|s| s.roughness[1] = 1.5), Err(IblError::Roughness(1.5)));
    assert!(matches!(with(|s| s.roughness[1] = f32::NAN), Err(IblError::Roughness(_))));
    assert!(with(|s| s.roughness[0] = 0.02).is_ok());
}
