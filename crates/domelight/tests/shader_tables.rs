//! Tables for shaders: their numbers against the environment. `checks/tables/check` runs their code.

use domelight::environment::{Environment, Orientation, UpAxis};
use domelight::math::vec2;
use domelight::rig::tables::{ShaderTables, TableSettings, TablesError};
use domelight::{Rgb, RgbImage};

/// A sun of one texel over a gradient, with the orientation that most easily goes wrong.
fn sun(width: usize, height: usize) -> Environment {
    let mut map = RgbImage::from_fn(width, height, |x, y| {
        let [u, v] = [x as f32 / width as f32, y as f32 / height as f32];
        Rgb::new(0.2 + u, 0.5, 1.2 - v)
    });
    map.pixels[height / 3 * width + width / 5] = Rgb::new(90.0, 70.0, 50.0);
    Environment::new(map, Orientation { up: UpAxis::Z, rotation: 40.0 }, 1.0).unwrap()
}

/// The light of the whole sphere, per channel.
fn flux(width: usize, height: usize, texels: &[[f32; 4]]) -> [f64; 3] {
    let grid = domelight::environment::LatLongGrid::new(width, height);
    let mut sum = [0.0; 3];
    for (i, texel) in texels.iter().enumerate() {
        let omega = grid.solid_angle(i / width);
        (0..3).for_each(|c| sum[c] += omega * f64::from(texel[c]));
    }
    sum
}

fn texels(tables: &ShaderTables) -> &[[f32; 4]] {
    &tables.groups[tables.groups[0][3] as usize..]
}

#[test]
fn texels_are_radiance_and_density() {
    for (width, height) in [(1, 1), (3, 2), (2, 5), (64, 32)] {
        let environment = sun(width, height);
        let tables = ShaderTables::new(&environment, TableSettings::default()).unwrap();
        assert_eq!((tables.width, tables.height), (width, height));
        assert_eq!(texels(&tables).len(), width * height);
        for (i, texel) in texels(&tables).iter().enumerate() {
            let center = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
            let uv = vec2(center(i % width, width), center(i / width, height));
            let (le, pdf) = environment.le_pdf(environment.direction(uv));
            assert_eq!(*texel, [le.r, le.g, le.b, pdf]);
        }
    }
}

#[test]
fn the_warp_adds_up() {
    let tables = ShaderTables::new(&sun(13, 6), TableSettings::default()).unwrap();
    // Levels of 1 × 1, 1 × 1, 2 × 1 … quads: 13 × 6 texels are halved four times.
    let [width, height, levels, first] = tables.groups[0];
    assert_eq!([width, height, levels, first], [13.0, 6.0, 4.0, 4.0 + 1.0 + 2.0 + 8.0 + 21.0]);
    let sum = |groups: &[[f32; 4]]| groups.iter().flatten().map(|&w| f64::from(w)).sum::<f64>();
    let power = f64::from(tables.groups[3][3]);
    for level in [4..5, 5..7, 7..15, 15..36] {
        assert!((sum(&tables.groups[level.clone()]) / power - 1.0).abs() < 1e-6, "{level:?}");
    }
}

#[test]
fn averaged_tables_keep_the_light() {
    let environment = sun(200, 100);
    let whole = ShaderTables::new(&environment, TableSettings::default()).unwrap();
    let expected = flux(200, 100, texels(&whole));
    for most in [1, 6, 100, 3000, 19_999] {
        let settings = TableSettings { texels: most, ..TableSettings::default() };
        let tables = ShaderTables::new(&environment, settings).unwrap();
        let texels = texels(&tables);
        assert!(texels.len() <= most);
        let found = flux(tables.width, tables.height, texels);
        for c in 0..3 {
            assert!((found[c] / expected[c] - 1.0).abs() < 1e-5, "{most}: {found:?} {expected:?}");
        }
    }
}

#[test]
fn what_cannot_be_sampled_is_refused() {
    let black = Environment::constant(Rgb::BLACK).unwrap();
    let white = Environment::constant(Rgb::WHITE).unwrap();
    let settings = TableSettings::default();
    assert_eq!(ShaderTables::new(&black, settings), Err(TablesError::Black));
    let blinding = Environment::constant(Rgb::splat(3e38)).unwrap();
    assert_eq!(ShaderTables::new(&blinding, settings), Err(TablesError::TooBright));
    let compensated = TableSettings { compensated: true, ..settings };
    assert_eq!(ShaderTables::new(&white, compensated), Err(TablesError::NothingAboveMean));
    for texels in [0, TableSettings::MOST_TEXELS + 1] {
        let settings = TableSettings { texels, ..settings };
        assert_eq!(
            ShaderTables::new(&white, settings),
            Err(TablesError::Texels { requested: texels })
        );
    }
}

#[test]
fn textures_are_whole_rows_of_the_numbers() {
    let tables = ShaderTables::new(&sun(5, 3), TableSettings::default()).unwrap();
    let texture = tables.texture();
    assert!(texture.len().is_multiple_of(tables.texture_width()));
    assert_eq!(texture[..tables.groups.len()], tables.groups);
    let bytes = tables.to_bytes();
    assert_eq!(bytes.len(), 16 * texture.len());
    assert_eq!(bytes[..8], [0, 0, 160, 64, 0, 0, 64, 64]);
}
