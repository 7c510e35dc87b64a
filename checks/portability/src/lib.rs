//! Films of every strategy, material and kind of surface, and a checksum of their bits for each: the same wherever the
//! library runs.

mod surfaces;

use std::fmt::Write as _;
use std::sync::OnceLock;

use domelight::Rgb;
use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::bvh::InstructionSet;
use domelight::environment::{Environment, Orientation, builtin::BuiltinProbe};
use domelight::math::{Mat4, Vec3, vec3};
use domelight::render::{
    Background, Filter, LAYERS, LayerValues, Layers, Passes, RenderSettings, render,
};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{Camera, EnvironmentSource, Instance, Material, Scene};
use domelight::strategy::{PreparedStrategy, StrategySpec};

/// One for each kind of strategy, and for what differs most within a kind.
const STRATEGIES: [&str; 14] = [
    "brdf:4",
    "environment:4",
    "mis:2:1",
    "mis:2:1:heuristic=balance:no-compensation",
    "product:8",
    "rejection:8",
    "rejection:8:proposal=brdf",
    "rejection:rays=2:tries=64:proposal=tighter",
    "sir:2/32",
    "sir:2",
    "sir:2/32:from=brdf:resampling=multinomial",
    "sir:2/32:from=environment:resampling=reservoir",
    "median-cut:32",
    "variance-minimization:32",
];

/// One for each model, and for what differs most within a model.
const MATERIALS: [&str; 10] = [
    "diffuse:0.8,0.5,0.2",
    "phong:50:0.6:0.3",
    "ward:0.15:0.5",
    "ward:0.3:0.1:0.9:1992",
    "ward:0.2:0.2:0.9:duer",
    "ggx:0.2,0.4:gold",
    "ggx:0.1:0.04:correlated",
    "beckmann:0.2:copper",
    "gltf:0.9,0.5,0.2:0.5:0.3",
    "mix",
];

const SCENES: [BuiltinScene; 4] = [
    BuiltinScene::Statue,
    BuiltinScene::Spheres,
    BuiltinScene::MaterialBall,
    BuiltinScene::SphereOrthographic,
];

/// The axes of a rotation about x, then about y.
const TURN: [Vec3; 3] = [
    Vec3::new(0.8, 0.0, -0.6),
    Vec3::new(0.6 * 0.28, 0.96, 0.8 * 0.28),
    Vec3::new(0.6 * 0.96, -0.28, 0.8 * 0.96),
];

/// Pixels along an edge: not a multiple of a tile.
const SIZE: usize = 37;

/// A line for each strategy, material, surface, for instances and for short passes: its name, a space and sixteen hexadecimal digits.
///
/// # Panics
/// If a name above is none, a scene cannot be rendered, or the processor lacks the instructions.
pub fn report(instruction_set: InstructionSet) -> String {
    let stages = SCENES.map(|scene| Stage::new(scene, instruction_set));
    let mut report = String::new();
    for strategy in STRATEGIES {
        let mut checksum = Checksum::new();
        for stage in &stages {
            checksum.layers(&stage.render(strategy));
        }
        writeln!(report, "{strategy} {:016x}", checksum.0).expect("text has room");
    }
    let mut stage = Stage::new(BuiltinScene::Sphere, instruction_set);
    for material in MATERIALS {
        let spec: MaterialSpec = material.parse().expect("a material");
        stage.replace_materials(Bsdf::from(spec));
        let mut checksum = Checksum::new();
        for strategy in ["mis:2:2", "product:4", "sir:2/16:from=brdf"] {
            checksum.layers(&stage.render(strategy));
        }
        writeln!(report, "{material} {:016x}", checksum.0).expect("text has room");
    }
    for (surface, material) in surfaces::surfaces() {
        stage.make_of(material);
        let mut checksum = Checksum::new();
        for strategy in ["mis:2:2", "product:4", "sir:2/16:from=brdf"] {
            checksum.layers(&stage.render(strategy));
        }
        writeln!(report, "{surface} {:016x}", checksum.0).expect("text has room");
    }
    stage.copy();
    let mut checksum = Checksum::new();
    for strategy in ["mis:2:2", "product:4", "sir:2/16:from=brdf"] {
        checksum.layers(&stage.render(strategy));
    }
    writeln!(report, "instances {:016x}", checksum.0).expect("text has room");
    for strategy in ["mis:2:2", "product:4"] {
        let mut checksum = Checksum::new();
        for stage in &stages {
            checksum.layers(&stage.render_in(Passes::Doubling, strategy));
        }
        writeln!(report, "{strategy} in doubling passes {:016x}", checksum.0)
            .expect("text has room");
    }
    report
}

/// A scene in its light.
struct Stage {
    builtin: BuiltinScene,
    scene: Scene,
    environment: Environment,
    instruction_set: InstructionSet,
}

impl Stage {
    fn new(builtin: BuiltinScene, instruction_set: InstructionSet) -> Self {
        let light = builtin.environment();
        let EnvironmentSource::Builtin(probe) = &light.source else { panic!("a built-in probe") };
        let map = probe.parse::<BuiltinProbe>().expect("a probe").image(64);
        let orientation = Orientation { up: light.up, rotation: light.rotate_degrees };
        let environment =
            Environment::new(map, orientation, light.factor().expect("a factor")).expect("a map");
        let scene =
            Scene::builtin(builtin).with_instruction_set(instruction_set).expect("instructions");
        Self { builtin, scene, environment, instruction_set }
    }

    fn replace_materials(&mut self, bsdf: Bsdf) {
        let mut description = self.builtin.description();
        for material in &mut description.materials {
            *material = Material::fixed("replaced", bsdf);
        }
        let scene = Scene::new(description).expect("a scene");
        self.scene = scene.with_instruction_set(self.instruction_set).expect("instructions");
    }

    fn make_of(&mut self, material: Material) {
        let scene = Scene::new(surfaces::made_of(self.builtin, material)).expect("a scene");
        self.scene = scene.with_instruction_set(self.instruction_set).expect("instructions");
    }

    /// Shows every part in six more places, turned and scaled.
    fn copy(&mut self) {
        let mut description = self.builtin.description();
        for part in 0..description.parts.len() {
            description.instances.extend((1..7).map(|i| {
                let scale = 0.4 + 0.1 * i as f32;
                let [x, y, z] = TURN.map(|axis| axis * scale);
                let place = vec3((i % 3) as f32 - 1.0, 0.5 * i as f32, 1.3 * (i % 2) as f32);
                let [x, y, z] = [x, y, z].map(|axis| axis.extend(0.0));
                Instance { part, transform: Mat4::from_cols(x, y, z, place.extend(1.0)) }
            }));
        }
        let scene = Scene::new(description).expect("a scene");
        assert!(scene.instances().count() > 0, "copies share their memory");
        self.scene = scene.with_instruction_set(self.instruction_set).expect("instructions");
    }

    fn render(&self, strategy: &str) -> Layers {
        self.render_in(Passes::Efficient, strategy)
    }

    fn render_in(&self, passes: Passes, strategy: &str) -> Layers {
        let settings = RenderSettings {
            width: SIZE,
            height: SIZE,
            n_samples: 6,
            filter: Filter::BlackmanHarris,
            background: Background::Shown,
            passes,
            ..RenderSettings::default()
        };
        let camera = Camera::framing(&self.scene, SIZE, SIZE);
        let Self { scene, environment, .. } = self;
        let spec: StrategySpec = strategy.parse().expect("a strategy");
        let spec = spec.for_picture(scene, &camera, environment, &settings);
        let strategy = PreparedStrategy::new(spec, environment)
            .expect("a strategy that suits the environment")
            .with_instruction_set(self.instruction_set)
            .expect("instructions");
        render(scene, &camera, environment, &strategy, &settings, &()).layers
    }
}

/// FNV-1a of 64 bits.
struct Checksum(u64);

impl Checksum {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn word(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn numbers(&mut self, numbers: impl IntoIterator<Item = f32>) {
        numbers.into_iter().for_each(|x| self.word(x.to_bits()));
    }

    fn layers(&mut self, layers: &Layers) {
        for layer in LAYERS {
            match (layer.values)(layers) {
                LayerValues::Colors(image) => {
                    self.numbers(image.pixels.iter().flat_map(|&Rgb { r, g, b }| [r, g, b]));
                }
                LayerValues::Vectors(vectors) => {
                    self.numbers(vectors.iter().flat_map(|v| v.to_array()));
                }
                LayerValues::Numbers(numbers) => self.numbers(numbers.iter().copied()),
                LayerValues::Counts(counts) => counts.iter().for_each(|&n| self.word(n)),
                _ => panic!("layer {} has values of a kind that has no checksum", layer.name),
            }
        }
    }
}

/// Byte `i` of the report, or 256 beyond its end: for WebAssembly, which has no standard output.
#[unsafe(no_mangle)]
pub extern "C" fn report_byte(i: u32) -> u32 {
    static REPORT: OnceLock<String> = OnceLock::new();
    let report = REPORT.get_or_init(|| report(InstructionSet::best()));
    report.as_bytes().get(i as usize).map_or(256, |&byte| u32::from(byte))
}
