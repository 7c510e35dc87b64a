//! What compilers of shaders make of the snippets of `domelight tables` samples the density that the library states, and states it
//! itself. `checks/tables/check` runs these tests.

use std::path::{Path, PathBuf};
use std::process::Command;

use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{CompensatedTable, Environment, Orientation, UpAxis};
use domelight::math::{Vec2, Vec3};
use domelight::rig::tables::ShaderLanguage::{self, Cuda, Glsl, Hlsl, Metal, Slang, Wgsl};
use domelight::rig::tables::{ShaderTables, TableSettings};
use domelight::{Rgb, RgbImage};
use testkit::quadrature::Adaptive;
use testkit::{Chi2, Pcg};

/// A compiler and the languages that it compiles. Those after the first must draw the first one's samples, to the bit.
const RUNS: [(Compiler, &[ShaderLanguage]); 6] = [
    (Compiler::Vulkan, &[Wgsl]),
    (Compiler::Vulkan, &[Glsl]),
    (Compiler::Vulkan, &[Hlsl]),
    (Compiler::Chromium, &[Wgsl]),
    (Compiler::Chromium, &[Glsl]),
    (Compiler::Cpp, &[Cuda, Metal, Hlsl, Slang]),
];

/// A sample as a shader drew it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drawn {
    direction: Vec3,
    radiance: Rgb,
    pdf: f32,
    /// The density of a look-up in the direction.
    looked_up: f32,
}

/// An environment, and how its tables are made.
struct Case {
    name: &'static str,
    environment: Environment,
    compensated: bool,
}

impl Case {
    fn all() -> Vec<Self> {
        let case = |name, environment, compensated| Self { name, environment, compensated };
        let studio = Environment::from_image(BuiltinProbe::Studio.image(16)).expect("a probe");
        let white = Environment::constant(Rgb::WHITE).expect("a map");
        vec![
            case("a sun, turned, +Z up", sun(16, 8), false),
            case("a sun, compensated", sun(16, 8), true),
            case("a studio", studio, false),
            case("3 x 2 texels", sun(3, 2), false),
            case("a single texel", white, false),
            case("7 x 5 texels", sun(7, 5), false),
        ]
    }

    fn tables(&self) -> ShaderTables {
        let settings = TableSettings { compensated: self.compensated, ..TableSettings::default() };
        ShaderTables::new(&self.environment, settings).expect("tables")
    }

    /// Samples follow the library's density and state it.
    fn check(&self, drawn: &[Drawn], name: &str) {
        let density = self.density();
        for drawn in drawn {
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * b;
            assert!((drawn.direction.length() - 1.0).abs() < 1e-5, "{name}: {drawn:?}");
            assert!(near(drawn.pdf, density(drawn.direction)), "{name}: {drawn:?}");
            assert!(near(drawn.looked_up, drawn.pdf), "{name}: {drawn:?}");
            assert_eq!(drawn.radiance, self.environment.le(drawn.direction), "{name}: {drawn:?}");
        }
        let mut next = drawn.iter();
        let report = chi2().sphere(
            name,
            |_, _| next.next().map(|drawn| drawn.direction.to_array()),
            |wi| f64::from(density(Vec3::from(wi))),
        );
        report.unwrap_or_else(|failure| panic!("{failure}"));
    }

    fn density(&self) -> impl Fn(Vec3) -> f32 + '_ {
        let compensated = self.compensated.then(|| CompensatedTable::new(&self.environment));
        move |wi| match &compensated {
            Some(table) => table.le_pdf(&self.environment, wi).1,
            None => self.environment.pdf(wi),
        }
    }
}

/// A sun of one texel over a gradient, with the orientation that most easily goes wrong.
fn sun(width: usize, height: usize) -> Environment {
    let mut map = RgbImage::from_fn(width, height, |x, y| {
        let [u, v] = [x as f32 / width as f32, y as f32 / height as f32];
        Rgb::new(0.2 + u, 0.5, 1.2 - v)
    });
    map.pixels[height / 3 * width + width / 5] = Rgb::new(90.0, 70.0, 50.0);
    Environment::new(map, Orientation { up: UpAxis::Z, rotation: 40.0 }, 1.0).expect("a map")
}

/// The points that the test draws.
fn points() -> Vec<Vec2> {
    let mut pcg = Pcg::new(chi2().seed);
    let point = |_| {
        let u = pcg.next_2d();
        pcg.next_f32();
        u.into()
    };
    (0..chi2().samples).map(point).collect()
}

fn chi2() -> Chi2 {
    Chi2 {
        cells: [41, 83],
        axis: [0.0, 1.0, 0.0],
        quadrature: Adaptive { tolerance: 1e-6, min_depth: 2, max_depth: 6 },
        mass_tolerance: 1e-3,
        ..Chi2::in_suite_of(RUNS.len() * Case::all().len())
    }
}

/// A compiler of shaders, and what runs its code.
#[derive(Clone, Copy)]
enum Compiler {
    /// naga, after glslang for languages other than WGSL, and a Vulkan driver.
    Vulkan,
    /// A browser.
    Chromium,
    /// C++, with the words of the language defined for it.
    Cpp,
}

impl Compiler {
    fn name(self, language: ShaderLanguage) -> &'static str {
        let is_wgsl = language == Wgsl;
        match self {
            Self::Vulkan if is_wgsl => "naga and wgpu on Mesa's lavapipe",
            Self::Vulkan => "glslang to SPIR-V, naga and wgpu on Mesa's lavapipe",
            Self::Chromium if is_wgsl => "Chromium's WebGPU on SwiftShader",
            Self::Chromium => "Chromium's WebGL 2 on SwiftShader",
            Self::Cpp => "c++, as text",
        }
    }
}

/// A snippet in a folder of its own, where `u.bin` has points and each `I.tables` the columns and numbers of a map; running it
/// makes `I.samples`.
struct Shader {
    folder: tempfile::TempDir,
    command: Command,
}

impl Shader {
    fn new(compiler: Compiler, language: ShaderLanguage) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let snippet = match compiler {
            Compiler::Cpp => as_cpp(language),
            Compiler::Vulkan | Compiler::Chromium => language.snippet(),
        };
        std::fs::write(folder.path().join("snippet"), snippet).expect("the snippet");
        let mut command = match compiler {
            Compiler::Vulkan => script("python3", "vulkan.py", language),
            Compiler::Chromium => script("node", "browser.mjs", language),
            Compiler::Cpp => Command::new(compile(language, folder.path())),
        };
        command.arg(folder.path());
        Self { folder, command }
    }

    /// The samples of the points `u` under each of the maps.
    fn samples(mut self, maps: &[ShaderTables], u: &[Vec2]) -> Vec<Vec<Drawn>> {
        let path = |name: &str| self.folder.path().join(name);
        std::fs::write(path("u.bin"), bytes(u.iter().flat_map(|u| [u.x, u.y]))).expect("points");
        for (i, tables) in maps.iter().enumerate() {
            let columns = u32::try_from(tables.texture_width()).expect("a width");
            let file = [columns.to_le_bytes().to_vec(), tables.to_bytes()].concat();
            std::fs::write(path(&format!("{i}.tables")), file).expect("tables");
        }
        run(&mut self.command);
        let samples = |i: usize| {
            let drawn = drawn(&std::fs::read(path(&format!("{i}.samples"))).expect("samples"));
            assert_eq!(drawn.len(), u.len());
            drawn
        };
        (0..maps.len()).map(samples).collect()
    }
}

/// What C++ spells otherwise.
fn as_cpp(language: ShaderLanguage) -> String {
    let snippet = language.snippet();
    snippet.replace(" : register(t0)", "").replace("inout float u", "float& u")
}

/// The program that C++ makes of the snippet in a folder.
fn compile(language: ShaderLanguage, folder: &Path) -> PathBuf {
    let program = folder.join("shader");
    let mut compiler = Command::new("c++");
    compiler.args(["-std=c++17", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]);
    compiler.arg(format!("-DDOMELIGHT_{}", language.name().to_uppercase()));
    compiler.arg("-I").arg(folder).arg(checks().join("host.cpp")).arg("-o").arg(&program);
    run(&mut compiler);
    program
}

fn script(interpreter: &str, script: &str, language: ShaderLanguage) -> Command {
    let mut command = Command::new(interpreter);
    command.arg(checks().join(script)).arg(language.name());
    command
}

fn checks() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../checks/tables")
}

#[track_caller]
fn run(command: &mut Command) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn bytes(numbers: impl Iterator<Item = f32>) -> Vec<u8> {
    numbers.flat_map(f32::to_le_bytes).collect()
}

/// Direction, density, radiance, and the density of a look-up.
fn drawn(bytes: &[u8]) -> Vec<Drawn> {
    let (numbers, _) = bytes.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|&number| f32::from_le_bytes(number)).collect();
    let (samples, _) = numbers.as_chunks::<8>();
    let drawn = |&[x, y, z, pdf, r, g, b, looked_up]: &[f32; 8]| Drawn {
        direction: Vec3::new(x, y, z),
        radiance: Rgb::new(r, g, b),
        pdf,
        looked_up,
    };
    samples.iter().map(drawn).collect()
}

/// A language's name in prose.
fn title(language: ShaderLanguage) -> &'static str {
    match language {
        Wgsl => "WGSL",
        Glsl => "GLSL",
        Hlsl => "HLSL",
        Slang => "Slang",
        Cuda => "CUDA",
        Metal => "Metal",
    }
}

/// Runs languages by a compiler, and returns their rows of the table in docs/tables.md.
fn rows(compiler: Compiler, languages: &[ShaderLanguage]) -> Vec<String> {
    let cases = Case::all();
    let tables: Vec<ShaderTables> = cases.iter().map(Case::tables).collect();
    let run = |language| Shader::new(compiler, language).samples(&tables, &points());
    let row = |languages: &[ShaderLanguage], proof: &str| {
        let names: Vec<&str> = languages.iter().map(|&language| title(language)).collect();
        format!("| {} | {} | {proof} |", names.join(", "), compiler.name(languages[0]))
    };
    let (&first, others) = languages.split_first().unwrap();
    let samples = run(first);
    for (case, drawn) in cases.iter().zip(&samples) {
        case.check(drawn, &format!("{}, {}, {}", title(first), compiler.name(first), case.name));
    }
    let mut rows = vec![row(&[first], "χ², density, look-up")];
    for &language in others {
        assert!(run(language) == samples, "{} draws other samples", title(language));
    }
    if !others.is_empty() {
        rows.push(row(others, &format!("the samples of {}, to the bit", title(first))));
    }
    rows
}

#[test]
#[ignore = "needs compilers of shaders, a Vulkan driver and Chromium"]
fn shaders_sample_the_density() {
    let rows: Vec<String> =
        RUNS.into_iter().flat_map(|(c, languages)| rows(c, languages)).collect();
    let rows = rows.join("\n");
    let page = include_str!("../../../docs/tables.md");
    assert!(page.contains(&rows), "docs/tables.md has other rows than those proved:\n{rows}");
}
