//! Benchmark cases: a scene with a material, a probe and a camera.

use std::fmt;
use std::path::Path;
use std::str::FromStr as _;

use domelight::bsdf::{Bsdf, MaterialSpec};
use domelight::environment::builtin::BuiltinProbe;
use domelight::environment::{Environment, Orientation};
use domelight::math::{DVec3, Vec3, vec3};
use domelight::render::{Background, Filter, RenderSettings};
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{CameraSettings, SceneDescription};

use super::BenchSettings;
use crate::job::value::{Count, NotNegative, Rotation, Size, Text, Triple};
use crate::job::{Light, SceneSettings, Subject, View};
use crate::scene::{PreparedScene, close_up};
use crate::usage::{Seconds, Stopwatch};
use crate::{At as _, Error, Host};

/// The lecture's picture.
const LECTURE_SIZE: [usize; 2] = [176, 248];
const LECTURE_MATERIALS: [&str; 2] = ["phong:50:1", "phong:50:1:0.5"];

const SIZE: [usize; 2] = [256, 256];
const MATERIALS: &str = "diffuse:0.8,ggx:0.2:single,ggx:0.05:single,phong:50:0.5:0.5";
const MESH: BuiltinScene = BuiltinScene::Statue;
const PROBES: [BuiltinProbe; 3] =
    [BuiltinProbe::Sky, BuiltinProbe::Studio, BuiltinProbe::Cathedral];
/// Rows of a built-in probe.
const ROWS: u32 = 512;

/// Where normalized meshes are looked at from, and how wide.
const ORIGIN: Vec3 = vec3(0.0, 1.0, 4.0);
const FOV: f32 = 35.0;

/// What a picture shows, in words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Case {
    /// A built-in scene or a file.
    pub(super) scene: String,
    /// A built-in probe or a file.
    pub(super) probe: String,
    pub(super) material: CaseMaterial,
    placement: CameraPlacement,
}

/// What the scene is made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CaseMaterial {
    /// As it is, with floor and plinth.
    Own,
    /// Its subject alone, of one material.
    Of { text: String, material: MaterialSpec },
}

/// Where the camera is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CameraPlacement {
    /// In front of the normalized mesh; in front of scenes of their own look as they say.
    Standard,
    /// As near as the picture allows.
    CloseUp,
}

/// A case that can be rendered.
pub(super) struct BuiltCase {
    pub(super) view: PreparedScene,
    pub(super) camera: CameraSettings,
    pub(super) settings: RenderSettings,
    /// For the BVH and the environment's table.
    pub(super) time: Seconds,
}

/// The two of the lecture.
pub(super) fn of_lecture() -> Result<Vec<Case>, Error> {
    let case = |text: &&str| {
        let scene = BuiltinScene::Statue.name().to_owned();
        let probe = BuiltinProbe::Cathedral.name().to_owned();
        Ok(Case {
            scene,
            probe,
            material: case_material(text)?,
            placement: CameraPlacement::CloseUp,
        })
    };
    LECTURE_MATERIALS.iter().map(case).collect()
}

/// Those of the arguments: every scene under every probe, of every material.
pub(super) fn of_settings(settings: &BenchSettings) -> Result<Vec<Case>, Error> {
    let BenchSettings { meshes, probes, materials, cases, .. } = settings;
    let mut found = Vec::new();
    for case in cases.chunks_exact(3) {
        let list = |text: &str| text.split(',').map(str::to_owned).collect::<Vec<_>>();
        found.extend(product(&list(&case[0]), &list(&case[1]), Some(&case[2]))?);
    }
    let lists_given = !meshes.is_empty() || !probes.is_empty() || materials.is_some();
    if cases.is_empty() || lists_given {
        let builtin = [MESH.name().to_owned()];
        let meshes = if meshes.is_empty() { &builtin[..] } else { meshes };
        let builtin = PROBES.map(|probe| probe.name().to_owned());
        let probes = if probes.is_empty() { &builtin[..] } else { probes };
        found.extend(product(meshes, probes, materials.as_deref())?);
    }
    Ok(found)
}

fn product(
    meshes: &[String],
    probes: &[String],
    materials: Option<&str>,
) -> Result<Vec<Case>, Error> {
    let probes =
        probes.iter().map(|probe| files(probe)).collect::<Result<Vec<_>, Error>>()?.concat();
    let mut cases = Vec::new();
    for scene in meshes {
        let case_materials = case_materials(materials.unwrap_or(if has_own_material(scene) {
            OWN
        } else {
            MATERIALS
        }))?;
        for probe in &probes {
            cases.extend(case_materials.iter().map(|case_material| Case {
                scene: scene.clone(),
                probe: probe.clone(),
                material: case_material.clone(),
                placement: CameraPlacement::Standard,
            }));
        }
    }
    Ok(cases)
}

const OWN: &str = "own";

/// Declares the files that are read.
pub(super) fn declare(settings: &BenchSettings, host: &dyn Host) -> Result<(), Error> {
    let BenchSettings { meshes, probes, cases, .. } = settings;
    let of_cases =
        cases.chunks_exact(3).flat_map(|case| case[..2].iter()).flat_map(|s| s.split(','));
    for name in meshes.iter().chain(probes).map(String::as_str).chain(of_cases) {
        for file in files(name)?.iter().map(Path::new).filter(|file| file.is_file()) {
            host.reads(file)?;
        }
    }
    Ok(())
}

/// Formats that say what their parts are made of.
fn has_own_material(scene: &str) -> bool {
    let extension = Path::new(scene).extension();
    extension.is_some_and(|e| ["gltf", "glb", "toml"].iter().any(|own| e.eq_ignore_ascii_case(own)))
}

/// The probes of a folder, in the order of their names; else what was given.
fn files(probe: &str) -> Result<Vec<String>, Error> {
    if !Path::new(probe).is_dir() {
        return Ok(vec![probe.to_owned()]);
    }
    let entries = std::fs::read_dir(probe).at(probe)?.flatten();
    let is_probe = |path: &Path| {
        path.extension()
            .is_some_and(|e| ["hdr", "exr", "pfm"].iter().any(|p| e.eq_ignore_ascii_case(p)))
    };
    let mut files: Vec<String> = entries
        .map(|entry| entry.path())
        .filter(|path| is_probe(path))
        .map(|path| path.display().to_string())
        .collect();
    files.sort();
    if files.is_empty() {
        let why = format!("{probe}: no probes (.hdr, .exr, .pfm) in the folder");
        return Err(Error::Usage(why));
    }
    Ok(files)
}

/// Materials begin with a letter, further numbers of a color do not.
pub(super) fn case_materials(list: &str) -> Result<Vec<CaseMaterial>, Error> {
    let mut texts: Vec<String> = Vec::new();
    for part in list.split(',') {
        match texts.last_mut() {
            Some(last) if !part.trim_start().starts_with(|c: char| c.is_ascii_alphabetic()) => {
                *last += ",";
                *last += part;
            }
            _ => texts.push(part.trim().to_owned()),
        }
    }
    texts.iter().map(|text| case_material(text)).collect()
}

fn case_material(text: &str) -> Result<CaseMaterial, Error> {
    if text == OWN {
        return Ok(CaseMaterial::Own);
    }
    let parsed = text.parse();
    let material = parsed.map_err(|e| Error::Usage(format!("material '{text}': {e}")))?;
    Ok(CaseMaterial::Of { text: text.to_owned(), material })
}

impl fmt::Display for CaseMaterial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Own => OWN,
            Self::Of { text, .. } => text,
        })
    }
}

/// A file without its folder and extension; other names as they are.
pub(super) fn short(name: &str) -> &str {
    let stem = Path::new(name).file_stem().and_then(|stem| stem.to_str());
    stem.filter(|_| name.contains(['.', '/'])).unwrap_or(name)
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} / {} / {}", short(&self.scene), short(&self.probe), self.material)
    }
}

impl Case {
    /// Reads scene and probe and builds them.
    pub(super) fn build(
        &self,
        settings: &BenchSettings,
        host: &dyn Host,
    ) -> Result<BuiltCase, Error> {
        let size = settings.size.unwrap_or(match self.placement {
            CameraPlacement::Standard => SIZE,
            CameraPlacement::CloseUp => LECTURE_SIZE,
        });
        let mut loaded = self.scene_settings(settings, size).load(host)?;
        if let CaseMaterial::Of { material, .. } = self.material {
            loaded.description.set_subject_material(Bsdf::from(material));
            loaded.description.remove_scenery();
        }
        if self.placement == CameraPlacement::CloseUp {
            let aspect = size[0] as f32 / size[1] as f32;
            loaded.camera = close_up(&loaded.description, aspect, loaded.light.up.vector());
        }
        let camera = loaded.camera;
        let mut watch = Stopwatch::start();
        let view = loaded.build(host)?;
        let settings = RenderSettings {
            width: size[0],
            height: size[1],
            filter: Filter::Box,
            background: Background::Hidden,
            ..RenderSettings::default()
        };
        Ok(BuiltCase { view, camera, settings, time: watch.lap() })
    }

    /// The arguments of `render` for it.
    fn scene_settings(&self, settings: &BenchSettings, size: [usize; 2]) -> SceneSettings {
        let normalize = self.material != CaseMaterial::Own;
        let usual = normalize && self.placement == CameraPlacement::Standard;
        SceneSettings {
            light: light(&self.probe, settings.rotate, ROWS),
            view: View {
                size: Text(Size { width: size[0], height: size[1] }),
                origin: usual.then_some(Text(Triple(ORIGIN.as_dvec3()))),
                target: usual.then_some(Text(Triple(DVec3::ZERO))),
                up: usual.then_some(Text(Triple(DVec3::Y))),
                fov: NotNegative::new(FOV).filter(|_| usual),
                ..View::default()
            },
            subject: Subject { normalize, hide_env: true, ..Subject::default() },
            ..SceneSettings::new(&self.scene, size)
        }
    }
}

/// The argument of `render` for a probe.
fn light(probe: &str, rotate: f32, rows: u32) -> Light {
    Light {
        map: Some(probe.to_owned()),
        rotate: Some(Text(Rotation::Degrees(rotate))),
        rows: Count::new(rows),
        ..Light::default()
    }
}

/// The probes of the arguments, built-in ones with each number of rows.
pub(super) fn environments(
    settings: &BenchSettings,
    rows: &[u32],
    host: &dyn Host,
) -> Result<Vec<(String, Environment)>, Error> {
    let builtin = PROBES.map(|probe| probe.name().to_owned());
    let given = settings.probes.iter().map(|probe| files(probe));
    let given = given.collect::<Result<Vec<_>, Error>>()?.concat();
    let mut found = Vec::new();
    for probe in if given.is_empty() { &builtin[..] } else { &given } {
        let is_builtin = BuiltinProbe::from_str(probe).is_ok();
        for &rows in if is_builtin { rows } else { &rows[..1] } {
            let light = light(probe, settings.rotate, rows);
            let used = light.over(&SceneDescription::default());
            let map = light.load(&used, host)?;
            let orientation = Orientation { up: used.up, rotation: used.rotate_degrees };
            let environment = Environment::new(map, orientation, 1.0).at(probe)?;
            found.push((probe.clone(), environment));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_may_have_colors() {
        let texts = |list| {
            case_materials(list).unwrap().iter().map(CaseMaterial::to_string).collect::<Vec<_>>()
        };
        assert_eq!(texts("diffuse:0.8,ggx:0.2"), ["diffuse:0.8", "ggx:0.2"]);
        assert_eq!(texts("diffuse:0.1,0.2,0.3, own"), ["diffuse:0.1,0.2,0.3", "own"]);
        assert!(case_materials("velvet").unwrap_err().to_string().contains("velvet"));
        assert!(case_materials("").is_err());
    }

    #[test]
    fn every_scene_under_every_probe() {
        let list = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
        let cases = product(&list(&["a/b.ply", "c.glb"]), &list(&["sky", "x.hdr"]), None).unwrap();
        let text: Vec<String> = cases.iter().map(Case::to_string).collect();
        assert_eq!(text.len(), 2 * 4 + 2);
        assert_eq!(text[0], "b / sky / diffuse:0.8");
        assert_eq!(text[9], "c / x / own");
    }
}
