//! Tables for shaders: their numbers against the environment, and their code as it runs.

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::{Vec2, Vec3, vec2};
use domelight::rig::tables::{ShaderLanguage, ShaderTables, TableSettings, TablesError};
use domelight::{Rgb, RgbImage};
use std::path::{Path, PathBuf};
use std::process::Command;
use testkit::quadrature::Adaptive;
use testkit::{Chi2, Pcg};

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

/// A sample as a shader drew it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drawn {
    direction: Vec3,
    radiance: Rgb,
    pdf: f32,
    /// The density of a look-up in the direction.
    looked_up: f32,
}

/// Runs a snippet in a folder of its own.
struct Shader {
    language: ShaderLanguage,
    folder: tempfile::TempDir,
    /// For languages that are compiled as C++.
    program: Option<PathBuf>,
}

impl Shader {
    fn new(language: ShaderLanguage) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let snippet = match language {
            // What C++ spells otherwise.
            ShaderLanguage::Hlsl | ShaderLanguage::Slang => language
                .snippet()
                .replace(" : register(t0)", "")
                .replace("inout float u", "float& u"),
            ShaderLanguage::Wgsl
            | ShaderLanguage::Glsl
            | ShaderLanguage::Cuda
            | ShaderLanguage::Metal => language.snippet(),
        };
        std::fs::write(folder.path().join("snippet"), snippet).unwrap();
        let is_like_c = !matches!(language, ShaderLanguage::Wgsl | ShaderLanguage::Glsl);
        let program = is_like_c.then(|| {
            let program = folder.path().join("shader");
            let mut compiler = Command::new("c++");
            compiler.args([
                "-std=c++17",
                "-O1",
                "-ffp-contract=off",
                "-Wall",
                "-Wextra",
                "-Werror",
            ]);
            compiler.arg(format!("-DDOMELIGHT_{}", language.name().to_uppercase()));
            compiler.arg("-I").arg(folder.path()).arg(checks().join("host.cpp"));
            run(compiler.arg("-o").arg(&program));
            program
        });
        Self { language, folder, program }
    }

    /// The samples of the points `u`.
    fn samples(&self, tables: &ShaderTables, u: &[Vec2]) -> Vec<Drawn> {
        let path = |name: &str| self.folder.path().join(name);
        std::fs::write(path("tables.bin"), tables.to_bytes()).unwrap();
        let numbers = u.iter().flat_map(|u| [u.x, u.y]);
        std::fs::write(path("u.bin"), bytes(numbers)).unwrap();
        let mut command = match &self.program {
            Some(program) => Command::new(program),
            None => Command::new("node"),
        };
        if self.program.is_none() {
            command.arg(checks().join("browser.mjs")).arg(self.language.name());
            command.arg(tables.texture_width().to_string());
        }
        run(command.arg(self.folder.path()));
        let numbers = std::fs::read(path("samples.bin")).unwrap();
        let numbers = numbers.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
        let numbers: Vec<f32> = numbers.collect();
        assert_eq!(numbers.len(), 8 * u.len());
        let drawn = |n: &[f32]| Drawn {
            direction: Vec3::new(n[0], n[1], n[2]),
            pdf: n[3],
            radiance: Rgb::new(n[4], n[5], n[6]),
            looked_up: n[7],
        };
        numbers.chunks_exact(8).map(drawn).collect()
    }
}

fn bytes(numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    numbers.flat_map(f32::to_le_bytes).collect()
}

fn checks() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../checks/tables")
}

#[track_caller]
fn run(command: &mut Command) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// An environment, its tables, and the density that they claim.
struct Case {
    name: &'static str,
    environment: Environment,
    compensated: bool,
}

impl Case {
    fn all() -> Vec<Self> {
        let case = |name, environment, compensated| Self { name, environment, compensated };
        let studio = Environment::from_image(BuiltinProbe::Studio.image(16)).unwrap();
        let white = Environment::constant(Rgb::WHITE).unwrap();
        vec![
            case("a sun, turned, +Z up", sun(16, 8), false),
            case("a sun, compensated", sun(16, 8), true),
            case("a studio", studio, false),
            case("3 x 2 texels", sun(3, 2), false),
            case("a single texel", white, false),
            case("7 x 5 texels", sun(7, 5), false),
        ]
    }

    fn density(&self) -> impl Fn(Vec3) -> f32 + '_ {
        let compensated = self.compensated.then(|| CompensatedTable::new(&self.environment));
        move |wi| match &compensated {
            Some(table) => table.le_pdf(&self.environment, wi).1,
            None => self.environment.pdf(wi),
        }
    }
}

/// The test of a case, in all languages.
fn chi2() -> Chi2 {
    Chi2 {
        cells: [41, 83],
        axis: [0.0, 1.0, 0.0],
        quadrature: Adaptive { tolerance: 1e-6, min_depth: 2, max_depth: 6 },
        mass_tolerance: 1e-3,
        ..Chi2::in_suite_of(3 * Case::all().len())
    }
}

/// What a shader draws in each case, of the points that the test draws.
fn samples(language: ShaderLanguage) -> Vec<Vec<Drawn>> {
    let mut pcg = Pcg::new(chi2().seed);
    let point = |_| {
        let u = pcg.next_2d();
        pcg.next_f32();
        u.into()
    };
    let u: Vec<Vec2> = (0..chi2().samples).map(point).collect();
    let shader = Shader::new(language);
    let draw = |case: &Case| {
        let settings = TableSettings { compensated: case.compensated, ..TableSettings::default() };
        shader.samples(&ShaderTables::new(&case.environment, settings).unwrap(), &u)
    };
    Case::all().iter().map(draw).collect()
}

/// What a shader compiler makes of a snippet samples the density that the library states, and states it itself.
fn check(language: ShaderLanguage) -> Vec<Vec<Drawn>> {
    let samples = samples(language);
    for (case, drawn) in Case::all().iter().zip(&samples) {
        let name = format!("{}, {}", language.name(), case.name);
        let density = case.density();
        for drawn in drawn {
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * b;
            assert!((drawn.direction.length() - 1.0).abs() < 1e-5, "{name}: {drawn:?}");
            assert!(near(drawn.pdf, density(drawn.direction)), "{name}: {drawn:?}");
            assert!(near(drawn.looked_up, drawn.pdf), "{name}: {drawn:?}");
            assert_eq!(drawn.radiance, case.environment.le(drawn.direction), "{name}: {drawn:?}");
        }
        let mut next = drawn.iter();
        let report = chi2().sphere(
            &name,
            |_, _| next.next().map(|drawn| drawn.direction.to_array()),
            |wi| f64::from(density(Vec3::from(wi))),
        );
        report.unwrap_or_else(|failure| panic!("{failure}"));
    }
    samples
}

#[test]
#[ignore = "needs c++"]
fn shaders_like_c_sample_the_density() {
    use ShaderLanguage::{Cuda, Hlsl, Metal, Slang};
    let expected = check(Cuda);
    for language in [Metal, Hlsl, Slang] {
        assert!(samples(language) == expected, "{} draws other samples", language.name());
    }
}

#[test]
#[ignore = "needs Node and Chromium"]
fn shaders_of_the_web_sample_the_density() {
    check(ShaderLanguage::Wgsl);
    check(ShaderLanguage::Glsl);
}
