//! Every environment table draws what it says, in cells finer than its texels.

use domelight::environment::statistics::ProbeStatistics;
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::{Vec2, Vec3, vec2};
use domelight::sampling::Pcg32;
use domelight::{Rgb, RgbImage};
use testkit::chi2::Chi2;

fn noise(width: usize, height: usize) -> RgbImage {
    let mut pcg = Pcg32::new(11, 0);
    let mut number = move || (4.0 * pcg.next_f32()).exp();
    RgbImage::from_fn(width, height, |_, _| Rgb::new(number(), number(), number()))
}

/// A dim map with some texels that outshine it.
fn spotted(width: usize, height: usize, spots: &[(usize, usize)]) -> RgbImage {
    let mut map = RgbImage::filled(width, height, Rgb::splat(0.01));
    for &(x, y) in spots {
        map.pixels[y * width + x] = Rgb::new(50.0, 30.0, 10.0);
    }
    map
}

fn maps() -> Vec<(&'static str, RgbImage)> {
    vec![
        ("constant", RgbImage::filled(6, 3, Rgb::WHITE)),
        ("one texel", RgbImage::filled(1, 1, Rgb::WHITE)),
        ("noise", noise(10, 5)),
        ("odd", noise(7, 4)),
        ("sun at the pole", spotted(8, 6, &[(3, 0)])),
        ("suns at the seam", spotted(9, 6, &[(0, 2), (8, 3)])),
        ("black rows", {
            let mut map = noise(6, 6);
            map.pixels[6..18].fill(Rgb::BLACK);
            map
        }),
    ]
}

fn orientations() -> [Orientation; 3] {
    [
        Orientation::default(),
        Orientation { up: UpAxis::Y, rotation: 47.0 },
        Orientation { up: UpAxis::Z, rotation: -110.0 },
    ]
}

/// χ² on the unit square of the map with 3×3 cells a texel. In that measure the density is
/// p(ω) · 2π² sin θ.
fn check(
    name: &str,
    env: &Environment,
    suite: usize,
    sample: impl Fn(Vec2) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) {
    let cells = [3 * env.map().width, 3 * env.map().height];
    let test = Chi2 { cells, ..Chi2::in_suite_of(suite) };
    let report = test.square(
        name,
        |[x, y], _| sample(vec2(x, y)).map(|wi| env.uv(wi).to_array()),
        |[x, y]| {
            let sin_theta = (std::f64::consts::PI * f64::from(y)).sin();
            let pdf = pdf(env.direction(vec2(x, y)));
            f64::from(pdf) * 2.0 * std::f64::consts::PI.powi(2) * sin_theta
        },
    );
    let report = report.unwrap_or_else(|failure| panic!("{failure}"));
    assert!((report.mass - 1.0).abs() < 1e-4, "{name}: the density integrates to {}", report.mass);
}

/// The irradiance of a surface is that of its hemisphere, however the map is turned.
#[test]
fn irradiance_is_the_integral_over_the_hemisphere() {
    let map = RgbImage::from_fn(7, 5, |x, y| Rgb::new((x + 2 * y) as f32, 1.0, 0.1 * y as f32));
    let above = ProbeStatistics::new(&map).irradiance_up;
    for (up, rotation) in [(UpAxis::Y, 0.0), (UpAxis::Y, 77.0), (UpAxis::Z, -10.0)] {
        let environment = Environment::new(map.clone(), Orientation { up, rotation }, 1.0).unwrap();
        let found = environment.irradiance(up.vector());
        for (found, expected) in found.to_array().into_iter().zip(above.to_array()) {
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} is not {expected}");
        }
        let aside = environment.irradiance(Vec3::X).g;
        assert!((aside / std::f32::consts::PI - 1.0).abs() < 1e-4, "{aside}");
    }
}

#[test]
fn samples_follow_the_density() {
    let n = maps().len() * orientations().len();
    for (name, map) in maps() {
        for orientation in orientations() {
            let env = Environment::new(map.clone(), orientation, 1.0).unwrap();
            check(name, &env, n, |u| env.sample(u).map(|s| s.wi), |wi| env.pdf(wi));
        }
    }
}

#[test]
fn compensated_samples_follow_their_density() {
    let spotted = [("pole", spotted(8, 6, &[(3, 0)])), ("noise", noise(10, 5))];
    for (name, map) in &spotted {
        let env = Environment::new(map.clone(), Orientation::default(), 1.0).unwrap();
        let table = CompensatedTable::new(&env);
        let sample = |u| table.sample(&env, u).map(|s| s.wi);
        check(name, &env, spotted.len(), sample, |wi| table.le_pdf(&env, wi).1);
    }
}

/// A look-up that interpolated would lose up to 43.75 % of a single bright texel: the estimate of
/// ∫ L dω by the table's own samples is exact, sample by sample, on any map.
#[test]
fn every_sample_estimates_the_power_exactly() {
    for (name, map) in maps() {
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let mut pcg = Pcg32::new(3, 3);
        for _ in 0..1000 {
            let s = env.sample(vec2(pcg.next_f32(), pcg.next_f32())).unwrap();
            let power = f64::from(s.le.luminance() / s.pdf);
            assert!((power / env.power() - 1.0).abs() < 1e-5, "{name}: {power} {}", env.power());
        }
    }
}

/// Figures draw from rows and columns what rendering draws from its own table.
#[test]
fn rows_and_columns_have_the_density() {
    for (name, map) in maps() {
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let (width, height) = (env.map().width, env.map().height);
        let table = env.rows_and_columns().unwrap();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let center = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
            let expected = f64::from(env.pdf(env.direction(center))) * env.texel_solid_angle(y);
            let found = table.pmf(x, y);
            assert!((found - expected).abs() < 1e-6, "{name}: {found} is not {expected}");
        }
    }
}
