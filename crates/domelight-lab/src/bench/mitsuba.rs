//! Mitsuba 3 (Jakob et al. 2022), on the same cases.
//!
//! One Python process serves all cases: a line requests a picture, and a line returns its cost. So its pictures and
//! ours can be rendered in turns. Mitsuba is configured as strongly as possible for this task: one light sample with
//! MIS compensation and one BRDF sample, weighted by the power heuristic, correlated multi-jittered points, compiled
//! by LLVM for all cores.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use domelight::bsdf::{Fresnel, Masking, MaterialSpec, Scattering};
use domelight::environment::Environment;
use domelight::math::{Mat3, PI, Vec3};
use domelight::picture::exr::ExrLayers;
use domelight::scene::{CameraSettings, Projection, Scene};
use domelight::{Rgb, RgbImage};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::cases::{BuiltCase, CaseMaterial};
use super::ply;
use super::{BenchSettings, Peer};
use crate::measure::{Cache, Goal, Key, Reference, ReferencePicture};
use crate::scene::PreparedScene;
use crate::usage::Seconds;
use crate::{At as _, Error, Host};

const SCRIPT: &str = include_str!("mitsuba.py");
const VARIANT: &str = "llvm_ad_rgb";

/// The most camera samples of one call; more are several calls, whose pictures are averaged.
const MOST_OF_A_CALL: u32 = 1024;
/// Seeds of the halves of a reference, which nobody takes for pictures.
const REFERENCE_SEEDS: [u64; 2] = [0x5eed_0001, 0x5eed_0002];

/// What it is to show.
pub(super) struct MitsubaScene<'a> {
    pub(super) scene: &'a Scene,
    pub(super) camera: CameraSettings,
    pub(super) environment: &'a Environment,
    pub(super) size: [usize; 2],
}

impl<'a> MitsubaScene<'a> {
    pub(super) fn of_case(built: &'a BuiltCase) -> Self {
        let PreparedScene { scene, environment, .. } = &built.view;
        let size = [built.settings.width, built.settings.height];
        Self { scene, camera: built.camera, environment, size }
    }
}

/// A Python that waits for work.
pub(super) struct Mitsuba {
    python: String,
    child: Child,
    /// `None` when it is told to end.
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    /// Meshes, maps and pictures on their way.
    folder: TempDir,
    version: String,
    threads: u64,
    size: [usize; 2],
    setup: Seconds,
}

impl Drop for Mitsuba {
    fn drop(&mut self) {
        self.input = None;
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Mitsuba {
    /// The one that the settings ask for.
    pub(super) fn of_settings(settings: &BenchSettings) -> Result<Option<Self>, Error> {
        let threads = rayon::current_num_threads();
        let peer = settings.vs.as_ref();
        peer.map(|Peer::Mitsuba { python }| Self::start(python, threads)).transpose()
    }

    fn start(python: &Path, threads: usize) -> Result<Self, Error> {
        let name = python.display().to_string();
        let folder = TempDir::new().at("cannot make a temporary folder")?;
        let messages = fs::File::create(folder.path().join(MESSAGES))?;
        let mut child = Command::new(python)
            .args(["-c", SCRIPT, &threads.to_string(), VARIANT])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(messages)
            .spawn()
            .map_err(|e| {
                Error::Usage(format!("{name}: {e}; --python names a Python with Mitsuba 3"))
            })?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Error::Failed(format!("{name}: no pipes")));
        };
        let mut mitsuba = Self {
            python: name,
            child,
            input: Some(input),
            output: BufReader::new(output),
            folder,
            version: String::new(),
            threads: 0,
            size: [0; 2],
            setup: Seconds { wall: 0.0, cpu: None },
        };
        let hello = mitsuba.answer().map_err(|error| {
            Error::Usage(format!(
                "{error}; --vs mitsuba needs Mitsuba 3 and LLVM: pip install mitsuba numpy, \
                 --python PROGRAM where it is not in python3, and DRJIT_LIBLLVM_PATH where LLVM is \
                 not found"
            ))
        })?;
        hello["version"].as_str().unwrap_or_default().clone_into(&mut mitsuba.version);
        mitsuba.threads = hello["threads"].as_u64().unwrap_or(0);
        Ok(mitsuba)
    }

    pub(super) fn describe(&self) -> String {
        let Self { version, threads, .. } = self;
        format!(
            "Mitsuba {version}, {VARIANT}, direct: 1 emitter and 1 BSDF sample, MIS compensation, \
             multijitter, {threads} threads"
        )
    }

    /// What reading and building the last scene took.
    pub(super) fn setup(&self) -> Seconds {
        self.setup
    }

    /// Hands a scene over; why not, if it cannot show the same.
    pub(super) fn load(
        &mut self,
        shown: &MitsubaScene,
        case_material: &CaseMaterial,
    ) -> Result<Option<String>, Error> {
        let scene = match self.scene(shown, case_material) {
            Ok(scene) => scene,
            Err(why) => return Ok(Some(why)),
        };
        let path = |name| self.folder.path().join(name);
        let mut file = std::io::BufWriter::new(fs::File::create(path(MESH))?);
        ply::encode(shown.scene, &mut file)?;
        file.flush()?;
        let map = ExrLayers::from_image(&shown.environment.radiance_map(), None);
        fs::write(path(MAP), map.encode()?)?;
        let times = self.ask(&json!({ "scene": scene }))?;
        self.setup = seconds(&times);
        self.size = shown.size;
        Ok(None)
    }

    /// The scene as the script takes it; else why it cannot be said.
    fn scene(&self, shown: &MitsubaScene, case_material: &CaseMaterial) -> Result<Value, String> {
        let CaseMaterial::Of { material, text } = case_material else {
            return Err("the scene's own materials cannot be passed on".to_owned());
        };
        let bsdf = bsdf(material).ok_or_else(|| format!("it has no {text}"))?;
        let camera = shown.camera;
        let Projection::Perspective { fov_y_degrees } = camera.projection else {
            return Err("an orthographic camera cannot be passed on".to_owned());
        };
        // Its first column is toward −Z, ours toward +Z.
        let turn = Mat3::from_rotation_y(PI);
        let rotation = shown.environment.orientation().map_to_world() * turn;
        let file = |name| self.folder.path().join(name).display().to_string();
        let array = |v: Vec3| v.to_array();
        Ok(json!({
            "mesh": file(MESH),
            "environment": file(MAP),
            "rotation": rotation.transpose().to_cols_array_2d(),
            "bsdf": bsdf,
            "fov": fov_y_degrees,
            "origin": array(camera.origin),
            "target": array(camera.target),
            "up": array(camera.up),
            "size": shown.size,
        }))
    }

    /// Renders what was loaded.
    pub(super) fn render(
        &mut self,
        n_samples: u32,
        seed: u64,
    ) -> Result<(ReferencePicture, Seconds), Error> {
        let n_calls = n_samples.div_ceil(MOST_OF_A_CALL);
        let spp = n_samples.div_ceil(n_calls);
        let mut sum = vec![0.0; 4 * self.size[0] * self.size[1]];
        let mut time = Seconds { wall: 0.0, cpu: Some(0.0) };
        for call in 0..n_calls {
            let seed = seed.wrapping_mul(100_003).wrapping_add(u64::from(call)) as u32;
            let out = self.folder.path().join(PICTURE);
            let times = self.ask(&json!({ "spp": spp, "seed": seed, "out": out }))?;
            let of_call = seconds(&times);
            time.wall += of_call.wall;
            time.cpu = time.cpu.zip(of_call.cpu).map(|(sum, cpu)| sum + cpu);
            let bytes = fs::read(&out).at(out.display())?;
            if bytes.len() != 4 * sum.len() {
                let why = format!("{}: a picture of another size", self.python);
                return Err(Error::Failed(why));
            }
            let values = bytes.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b)));
            sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / f64::from(n_calls));
        }
        let pixels = sum.as_chunks::<4>().0;
        let image = pixels.iter().map(|&[r, g, b, _]| Rgb::new(r as f32, g as f32, b as f32));
        let image = RgbImage::new(self.size[0], self.size[1], image.collect());
        let alpha = pixels.iter().map(|p| p[3] as f32).collect();
        Ok((
            ReferencePicture { image, alpha: Some(alpha), unoccluded: None, half_difference: None },
            time,
        ))
    }

    /// Its own converged picture of the case: its look-ups differ from ours, which are constant over a texel.
    pub(super) fn reference(
        &mut self,
        cache: Option<&Cache>,
        built: &BuiltCase,
        case_material: &CaseMaterial,
        goal: Goal,
        host: &dyn Host,
    ) -> Result<Reference, Error> {
        let settings = self.describe();
        let key = format_args!("{settings}{case_material}{:?}{goal:?}{SCRIPT}", built.settings);
        let key = &Key::of_other(built.view.view(), key);
        let cache = cache.map(|cache| (cache, key));
        Reference::get(cache, goal, &settings, host, |n_samples, half| {
            Ok(self.render(n_samples, REFERENCE_SEEDS[half])?.0)
        })
    }

    fn ask(&mut self, question: &Value) -> Result<Value, Error> {
        if let Some(input) = &mut self.input {
            // Where it has ended, the answer says why.
            let _ = writeln!(input, "{question}").and_then(|()| input.flush());
        }
        self.answer()
    }

    fn answer(&mut self) -> Result<Value, Error> {
        let mut line = String::new();
        let n = self.output.read_line(&mut line).at("cannot read from Python")?;
        if n == 0 {
            let messages =
                fs::read_to_string(self.folder.path().join(MESSAGES)).unwrap_or_default();
            let last = messages.lines().rev().find(|line| !line.trim().is_empty());
            let why = last.unwrap_or("it gives no reason").trim();
            return Err(Error::Failed(format!("{} ended: {why}", self.python)));
        }
        let answer: Value = serde_json::from_str(&line).at(format_args!(
            "{} answers «{}»",
            self.python,
            line.trim()
        ))?;
        match answer["error"].as_str() {
            Some(error) => Err(Error::Failed(format!("Mitsuba: {error}"))),
            None => Ok(answer),
        }
    }
}

const MESSAGES: &str = "messages";
const MESH: &str = "mesh.ply";
const MAP: &str = "map.exr";
const PICTURE: &str = "picture";

fn seconds(times: &Value) -> Seconds {
    Seconds { wall: times["wall"].as_f64().unwrap_or(f64::NAN), cpu: times["cpu"].as_f64() }
}

/// The same reflectance in Mitsuba's words, if it has it.
fn bsdf(material: &MaterialSpec) -> Option<Value> {
    let diffuse = |albedo: Rgb| {
        let reflectance = json!({ "type": "rgb", "value": albedo.to_array() });
        json!({ "type": "diffuse", "reflectance": reflectance })
    };
    // Its roughconductor masks separably and scatters once; "none" is a perfect mirror's F = 1.
    let ggx = |alpha: f32| {
        json!({
            "type": "roughconductor", "material": "none", "distribution": "ggx",
            "alpha": alpha, "sample_visible": true,
        })
    };
    match *material {
        MaterialSpec::Diffuse { albedo } => Some(diffuse(albedo)),
        MaterialSpec::Ggx {
            alpha: [x, y],
            fresnel: Fresnel::One,
            masking: Masking::Separable,
            scattering: Scattering::Single,
        } if x == y => Some(ggx(x)),
        MaterialSpec::Mix => Some(json!({
            "type": "blendbsdf", "weight": 0.5, "a": diffuse(Rgb::splat(0.5)), "b": ggx(0.1),
        })),
        MaterialSpec::Ggx { .. }
        | MaterialSpec::Phong { .. }
        | MaterialSpec::Ward { .. }
        | MaterialSpec::Beckmann { .. }
        | MaterialSpec::Gltf { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_that_both_have() {
        let bsdf = |text: &str| bsdf(&text.parse().unwrap());
        assert_eq!(bsdf("ggx:0.2:single").unwrap()["type"], "roughconductor");
        assert_eq!(bsdf("diffuse:0.8").unwrap()["reflectance"]["value"][2], json!(0.8f32));
        assert_eq!(bsdf("mix").unwrap()["type"], "blendbsdf");
        for other in [
            "phong:50",
            "ggx:0.2",
            "ggx:0.2:gold:single",
            "ggx:0.1,0.2:single",
            "ggx:0.2:one:correlated:single",
        ] {
            assert!(bsdf(other).is_none(), "{other}");
        }
    }

    #[test]
    fn a_python_without_it_is_a_wrong_argument() {
        for (python, word) in [("true", "ended"), ("no-such-python", "--python")] {
            let error = Mitsuba::start(Path::new(python), 1).err().expect("no Mitsuba");
            assert!(matches!(error, Error::Usage(_)));
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
