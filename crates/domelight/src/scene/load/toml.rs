//! Scene files: a TOML text that combines meshes, materials, a camera and an environment;
//! `docs/scene-format.md` is its manual.
//!
//! ```toml
//! up = "y"                            # or "z": the up axis of the whole scene
//!
//! [camera]
//! origin = [0.0, 1.0, 5.0]
//! target = [0.0, 0.5, 0.0]            # required, as is origin
//! up = [0.0, 1.0, 0.0]                # default: the scene's up axis
//! fov = 35.0                          # vertical, degrees (the default); or
//! # orthographic = 3.0                # the height of the picture in world units
//!
//! [environment]
//! file = "probes/courtyard.exr"       # or builtin = "studio"
//! rotate = 90.0                       # degrees about the up axis, default 0
//! scale = 1.0                         # factor on the radiance, default 1
//! exposure = 0.0                      # stops, default 0
//! up = "y"                            # the map's up axis, default "y"
//!
//! [[portals]]                         # where light enters, such as a window: a hint against noise
//! corner = [2.0, 1.0, -0.5]           # of a rectangle
//! edges = [[0.0, 1.2, 0.0], [0.0, 0.0, 1.0]]
//!
//! [materials]
//! clay = "diffuse:0.8"                # the command line's notation, see `bsdf::MaterialSpec`
//!
//! [materials.brass]                   # metallic-roughness as in glTF; every key is optional
//! base_color = [0.9, 0.7, 0.3]        # linear, default white
//! base_color_texture = "brass.png"    # sRGB
//! metallic = 1.0                      # default 0
//! roughness = 0.3                     # default 0.5; α = roughness²
//! metallic_roughness_texture = "mr.png"   # linear: green × roughness, blue × metallic
//! normal_map = "normal.png"           # linear, +Y up as in glTF
//! normal_scale = 1.0
//! emission = [0.0, 0.0, 0.0]          # radiance that the camera sees; it lights nothing else
//! emission_texture = "glow.png"       # sRGB, multiplied by emission, whose default is then white
//! opacity = 1.0                       # of the surface and of its shadow
//! opacity_texture = "leaf.png"        # its alpha, or its luminance if it has none, multiplied by opacity
//! wrap = "repeat"                     # or "clamp", "mirror"; for all textures of the material
//! uv_scale = 1.0                      # how often the textures repeat, default 1
//!
//! [[objects]]
//! file = "teapot.ply"                 # PLY, OBJ, glTF or GLB; or builtin = "statue", a built-in scene
//! name = "teapot"                     # for messages; default: the file's own names
//! material = "brass"                  # a name from [materials] or the command line's notation;
//!                                     # default: the file's own materials
//! scale = 2.0                         # or [x, y, z]
//! rotate = [0.0, 90.0, 0.0]           # degrees about x, then y, then z
//! translate = [0.0, 1.0, 0.0]         # scale first, then rotate, then translate
//! # matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]   # rows, instead of the three
//! ```
//!
//! Paths are relative to the scene file. Unknown keys and missing files are errors.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::Path;

use glam::DMat4;
use serde::de::value::MapAccessDeserializer;
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use super::textures::{Content, Textures};
use super::{
    Budget, LoadError, LoadOptions, Loaded, SHARED_TRIANGLES, load_mesh, part_name, relative,
};
use crate::Rgb;
use crate::bsdf::{Bsdf, ParseMaterialError};
use crate::geometry::{Similarity, linear_part};
use crate::math::{DVec3, Mat4, Vec2, Vec3, Vec4, rotation_x, rotation_y, rotation_z};
use crate::scene::builtin::{BuiltinScene, UnknownScene};
use crate::scene::camera::{CameraError, CameraSettings, Projection};
use crate::scene::{
    Coverage, Emission, EnvironmentSettings, EnvironmentSource, Instance, Material, MaterialModel,
    MetallicRoughnessMaterial, NormalMap, SceneDescription, TextureRef, UpAxis, UvTransform, Wrap,
    offset,
};
use crate::strategy::{Portal, PortalError};

/// An error in a scene file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TomlErrorKind {
    /// Not UTF-8.
    #[error("not UTF-8 text; the first bad byte is byte {byte}")]
    Encoding {
        /// The first bad byte.
        byte: usize,
    },
    /// Not TOML, or not a scene.
    #[error("{0}")]
    Syntax(String),
    /// A table that needs exactly one of two keys.
    #[error("{what} needs either '{first}' or '{second}', and not both")]
    OneOf {
        /// The table.
        what: String,
        /// One key.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// A built-in scene that does not exist.
    #[error(transparent)]
    Builtin(#[from] UnknownScene),
    /// A material that is neither defined nor valid notation.
    #[error("material '{text}' is neither a name in [materials] nor valid notation: {source}")]
    Material {
        /// The text.
        text: String,
        /// Why it is no notation.
        source: ParseMaterialError,
    },
    /// A number outside its range.
    #[error("{what} is {value}, which is outside {range}")]
    Range {
        /// Which key.
        what: &'static str,
        /// Its value.
        value: f32,
        /// Its range.
        range: &'static str,
    },
    /// A singular or non-finite transform.
    #[error(
        "the transform of this object cannot be inverted: no scale may be 0 or vanish beside 1, and every number must be finite"
    )]
    Singular,
    /// A matrix together with other transforms.
    #[error("'matrix' replaces 'scale', 'rotate' and 'translate'; give one or the other")]
    MatrixAndOthers,
    /// A matrix that is not affine.
    #[error("the last row of 'matrix' must be [0, 0, 0, 1]; give the matrix row by row")]
    NotAffine,
    /// An invalid camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A portal without an area.
    #[error(transparent)]
    Portal(#[from] PortalError),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    #[serde(default)]
    up: UpAxis,
    camera: Option<Spanned<CameraTable>>,
    environment: Option<Spanned<EnvironmentTable>>,
    #[serde(default)]
    materials: BTreeMap<String, Spanned<MaterialEntry>>,
    #[serde(default)]
    objects: Vec<Spanned<ObjectTable>>,
    #[serde(default)]
    portals: Vec<Spanned<PortalTable>>,
    /// How the scene is rendered, which is not the description's business.
    #[serde(default, rename = "file")]
    _file: IgnoredAny,
    #[serde(default, rename = "light")]
    _light: IgnoredAny,
    #[serde(default, rename = "view")]
    _view: IgnoredAny,
    #[serde(default, rename = "subject")]
    _subject: IgnoredAny,
    #[serde(default, rename = "sampling")]
    _sampling: IgnoredAny,
    #[serde(default, rename = "pixel")]
    _pixel: IgnoredAny,
    #[serde(default, rename = "output")]
    _output: IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    origin: [f64; 3],
    target: [f64; 3],
    up: Option<[f32; 3]>,
    fov: Option<f32>,
    orthographic: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PortalTable {
    corner: [f64; 3],
    edges: [[f32; 3]; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvironmentTable {
    file: Option<String>,
    builtin: Option<String>,
    #[serde(default)]
    rotate: f32,
    #[serde(default = "one")]
    scale: f32,
    #[serde(default)]
    exposure: f32,
    #[serde(default)]
    up: UpAxis,
}

enum MaterialEntry {
    Notation(String),
    Table(Box<MaterialTable>),
}

/// By hand, because the errors of derived code for an untagged enum say neither where nor what is wrong.
impl<'de> Deserialize<'de> for MaterialEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MaterialVisitor)
    }
}

struct MaterialVisitor;

impl<'de> Visitor<'de> for MaterialVisitor {
    type Value = MaterialEntry;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a material: notation such as \"ggx:0.2\", or a table")
    }

    fn visit_str<E>(self, text: &str) -> Result<MaterialEntry, E> {
        Ok(MaterialEntry::Notation(text.into()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MaterialEntry, A::Error> {
        let table = MaterialTable::deserialize(MapAccessDeserializer::new(map))?;
        Ok(MaterialEntry::Table(Box::new(table)))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialTable {
    #[serde(default = "white")]
    base_color: [f32; 3],
    base_color_texture: Option<String>,
    #[serde(default)]
    metallic: f32,
    #[serde(default = "half")]
    roughness: f32,
    metallic_roughness_texture: Option<String>,
    normal_map: Option<String>,
    #[serde(default = "one")]
    normal_scale: f32,
    emission: Option<[f32; 3]>,
    emission_texture: Option<String>,
    #[serde(default = "one")]
    opacity: f32,
    opacity_texture: Option<String>,
    #[serde(default)]
    wrap: Wrap,
    #[serde(default = "one")]
    uv_scale: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectTable {
    file: Option<String>,
    builtin: Option<String>,
    name: Option<String>,
    material: Option<String>,
    scale: Option<Scale>,
    rotate: Option<[f32; 3]>,
    translate: Option<[f64; 3]>,
    matrix: Option<[[f64; 4]; 4]>,
}

impl ObjectTable {
    fn key(&self) -> ObjectKey {
        [self.file.clone(), self.builtin.clone(), self.material.clone()]
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "a scale is a number or [x, y, z]")]
enum Scale {
    Uniform(f32),
    Axes([f32; 3]),
}

fn one() -> f32 {
    1.0
}

fn half() -> f32 {
    0.5
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let failed = |line, kind| LoadError::Toml { path: path.into(), line, kind: Box::new(kind) };
    let text = std::str::from_utf8(bytes)
        .map_err(|e| failed(None, TomlErrorKind::Encoding { byte: e.valid_up_to() }))?;
    let lines = Lines::new(text);
    let file: SceneFile = toml::from_str(text).map_err(|e| {
        let line = e.span().map(|span| lines.of(span.start));
        failed(line, TomlErrorKind::Syntax(syntax(e, text)))
    })?;
    let mut reader = Reader {
        path,
        lines,
        n_objects: BTreeMap::new(),
        shared: BTreeMap::new(),
        named: BTreeMap::new(),
        builtin: BTreeMap::new(),
        textures: Textures::new(budget),
        budget,
        options,
        loaded: Loaded::default(),
        may_be_far: false,
    };
    reader.scene(file)?;
    Ok(reader.finish())
}

/// What the parser says, with the keys that lead there and the value if it does not say them itself.
fn syntax(mut error: toml::de::Error, text: &str) -> String {
    const MOST: usize = 60;
    let message = error.message().to_owned();
    let value = error.span().and_then(|span| text.get(span)).unwrap_or_default();
    let value: String = value.lines().next().unwrap_or_default().chars().take(MOST).collect();
    // Without the text, the last line of the error is the keys.
    error.set_input(None);
    let whole = error.to_string();
    let keys = whole.lines().last().and_then(|line| line.strip_prefix("in `")?.strip_suffix('`'));
    match keys {
        None => message,
        Some(keys) if message.contains(value.trim_matches(['"', '\''])) => {
            format!("{message}, in {keys}")
        }
        Some(keys) => format!("{message}, in {keys} = {value}"),
    }
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn new(text: &str) -> Self {
        let after = text.match_indices('\n').map(|(byte, _)| byte + 1);
        Self(std::iter::once(0).chain(after).collect())
    }

    /// The line of a byte, from 1.
    fn of(&self, byte: usize) -> usize {
        self.0.partition_point(|&begin| begin <= byte)
    }
}

/// The translation up to which single precision places objects finely, at any usual size.
const FINE: f64 = 65536.0;

/// What makes objects copies of each other: file, built-in scene, material.
type ObjectKey = [Option<String>; 3];

/// An object whose copies share its memory.
struct SharedObject {
    parts: Range<usize>,
    instances: Range<usize>,
    placement: Placement,
}

struct Reader<'a> {
    path: &'a Path,
    lines: Lines,
    /// The number of objects of each kind.
    n_objects: BTreeMap<ObjectKey, u64>,
    shared: BTreeMap<ObjectKey, SharedObject>,
    /// Indices of materials by their name or notation.
    named: BTreeMap<String, usize>,
    /// Built-in scenes that were made.
    builtin: BTreeMap<&'static str, SceneDescription>,
    textures: Textures<'a>,
    budget: &'a Budget<'a>,
    options: &'a LoadOptions,
    loaded: Loaded,
    /// Whether the objects' places leave open that the scene is far from the origin beside its extent.
    may_be_far: bool,
}

impl Reader<'_> {
    /// An error in the table that begins at a byte of the text.
    fn error(&self, byte: usize, kind: TomlErrorKind) -> LoadError {
        let line = Some(self.lines.of(byte));
        LoadError::Toml { path: self.path.into(), line, kind: Box::new(kind) }
    }

    fn scene(&mut self, file: SceneFile) -> Result<(), LoadError> {
        self.loaded.description.up = Some(file.up);
        for (name, entry) in file.materials {
            let at = entry.span().start;
            let material = self.material(&name, entry.into_inner(), at)?;
            self.add_material(name, material);
        }
        // The materials of [materials] come first, and with them the only textures so far.
        self.loaded.description.textures = std::mem::take(&mut self.textures.loaded);
        if let Some(environment) = file.environment {
            let at = environment.span().start;
            let settings = self.environment(environment.into_inner(), at)?;
            self.loaded.description.environment = Some(settings);
        }
        for object in &file.objects {
            *self.n_objects.entry(object.get_ref().key()).or_default() += 1;
        }
        let places = file.objects.iter().filter_map(|object| Placement::new(object.get_ref()).ok());
        let places: Vec<DVec3> = places.map(|placement| placement.translation).collect();
        let is_one = places.iter().all(|place| *place == places[0]);
        let is_coarse = places.iter().any(|place| place.abs().max_element() > FINE);
        self.may_be_far = is_one || is_coarse || offset::of_points(places) != DVec3::ZERO;
        for object in file.objects {
            let at = object.span().start;
            self.object(object.get_ref(), at)?;
        }
        self.loaded.description.return_if_near();
        // The objects decide what the camera is relative to.
        if let Some(camera) = file.camera {
            let at = camera.span().start;
            let offset = self.loaded.description.offset;
            let settings = camera_settings(&camera.into_inner(), file.up, offset)
                .map_err(|kind| self.error(at, kind))?;
            self.loaded.description.camera = Some(settings);
        }
        for portal in file.portals {
            let at = portal.span().start;
            let PortalTable { corner, edges } = portal.into_inner();
            let corner = (DVec3::from(corner) - self.loaded.description.offset).as_vec3();
            let portal = Portal::new(corner, edges.map(Vec3::from))
                .map_err(|e| self.error(at, TomlErrorKind::Portal(e)))?;
            self.loaded.description.portals.push(portal);
        }
        Ok(())
    }

    fn finish(self) -> Loaded {
        self.loaded
    }

    fn add_material(&mut self, name: String, material: Material) -> usize {
        let materials = &mut self.loaded.description.materials;
        materials.push(material);
        self.named.insert(name, materials.len() - 1);
        materials.len() - 1
    }

    fn material(
        &mut self,
        name: &str,
        entry: MaterialEntry,
        at: usize,
    ) -> Result<Material, LoadError> {
        let table = match entry {
            MaterialEntry::Notation(text) => return self.notation(name, &text, at),
            MaterialEntry::Table(table) => table,
        };
        let ranges = [
            ("base_color", table.base_color[0]),
            ("base_color", table.base_color[1]),
            ("base_color", table.base_color[2]),
            ("metallic", table.metallic),
            ("roughness", table.roughness),
            ("opacity", table.opacity),
        ];
        for (what, value) in ranges {
            if !(0.0..=1.0).contains(&value) {
                return Err(self.error(at, TomlErrorKind::Range { what, value, range: "[0, 1]" }));
            }
        }
        for value in table.emission.unwrap_or_default() {
            if !(value.is_finite() && value >= 0.0) {
                let (what, range) = ("emission", "[0, ∞)");
                return Err(self.error(at, TomlErrorKind::Range { what, value, range }));
            }
        }
        for (what, value) in [("normal_scale", table.normal_scale), ("uv_scale", table.uv_scale)] {
            if !value.is_finite() {
                let range = "the finite numbers";
                return Err(self.error(at, TomlErrorKind::Range { what, value, range }));
            }
        }
        let referrer =
            format!("{}, line {}, material '{name}',", self.path.display(), self.lines.of(at));
        let transform = UvTransform::new(Vec2::ZERO, 0.0, Vec2::splat(table.uv_scale));
        let mut texture = |file: &Option<String>, content| {
            let Some(file) = file else { return Ok(None) };
            let texture = self.textures.file_of(&relative(self.path, file), content, &referrer)?;
            let wrap = [table.wrap; 2];
            Ok(Some(TextureRef { wrap, transform, ..TextureRef::new(texture) }))
        };
        let base_color_texture = texture(&table.base_color_texture, Content::Color)?;
        let metallic_roughness_texture =
            texture(&table.metallic_roughness_texture, Content::Numbers)?;
        let normal_map = texture(&table.normal_map, Content::Numbers)?
            .map(|texture| NormalMap { texture, scale: table.normal_scale });
        let emission_texture = texture(&table.emission_texture, Content::Color)?;
        let opacity_texture = texture(&table.opacity_texture, Content::Opacity)?;
        let model = MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
            base_color: Rgb::from(table.base_color),
            base_color_texture,
            metallic: table.metallic,
            roughness: table.roughness,
            metallic_roughness_texture,
        });
        let white = || emission_texture.map(|_| Rgb::WHITE);
        let radiance = table.emission.map(Rgb::from).or_else(white);
        let radiance = radiance.filter(|radiance| !radiance.is_black());
        let emission = radiance.map(|radiance| Emission { radiance, texture: emission_texture });
        let coverage = Coverage::blend(table.opacity, opacity_texture);
        Ok(Material { normal_map, coverage, emission, ..Material::new(name, model) })
    }

    fn notation(&self, name: &str, text: &str, at: usize) -> Result<Material, LoadError> {
        let bsdf = text.parse::<Bsdf>().map_err(|source| {
            self.error(at, TomlErrorKind::Material { text: text.into(), source })
        })?;
        Ok(Material::fixed(name, bsdf))
    }

    fn environment(
        &self,
        table: EnvironmentTable,
        at: usize,
    ) -> Result<EnvironmentSettings, LoadError> {
        let line = self.lines.of(at);
        let referrer = format!("{}, line {line}, [environment]", self.path.display());
        let source = match (table.file, table.builtin) {
            (Some(file), None) => {
                let file = relative(self.path, &file);
                self.budget.refer(&file, &format!("{referrer},"))?;
                EnvironmentSource::File(file)
            }
            (None, Some(name)) => EnvironmentSource::Builtin(name),
            _ => return Err(self.error(at, one_of("[environment]"))),
        };
        let finite = "the finite numbers";
        let ranges = [
            ("rotate", table.rotate, finite, f32::MIN),
            ("scale", table.scale, "[0, ∞)", 0.0),
            ("exposure", table.exposure, finite, f32::MIN),
        ];
        for (what, value, range, least) in ranges {
            if !(value.is_finite() && value >= least) {
                return Err(self.error(at, TomlErrorKind::Range { what, value, range }));
            }
        }
        Ok(EnvironmentSettings {
            source,
            referrer: Some(referrer),
            rotate_degrees: table.rotate,
            scale: table.scale,
            exposure: table.exposure,
            up: table.up,
        })
    }

    fn object(&mut self, table: &ObjectTable, at: usize) -> Result<(), LoadError> {
        let placement = Placement::new(table).map_err(|kind| self.error(at, kind))?;
        if self.add_copy(&table.key(), &placement)? {
            return Ok(());
        }
        let mut loaded = match (&table.file, &table.builtin) {
            (Some(file), None) => {
                let line = self.lines.of(at);
                let referrer = format!("{}, line {line}, an object,", self.path.display());
                load_mesh(&relative(self.path, file), &referrer, self.budget, self.options)?
            }
            (None, Some(name)) => {
                let scene = name.parse::<BuiltinScene>();
                let scene = scene.map_err(|unknown| self.error(at, unknown.into()))?;
                let made = self.builtin.entry(scene.name()).or_insert_with(|| scene.description());
                let name = format!("{}: object {name}", self.path.display());
                self.budget.take(&name, made.memory())?;
                Loaded { description: made.clone(), ..Loaded::default() }
            }
            _ => return Err(self.error(at, one_of("an object"))),
        };
        self.loaded.warnings.append(&mut loaded.warnings);
        let mut description = loaded.description;
        let offsets = [self.loaded.description.offset, description.offset];
        if self.may_be_far || offsets != [DVec3::ZERO; 2] {
            description.place(&placement.matrix, placement.translation);
        } else {
            description.transform(&placement.matrix);
        }
        // The scene file decides which axis points up.
        description.up = None;
        if let Some(name) = table.name.as_deref().map(part_name) {
            for part in &mut description.parts {
                part.name.clone_from(&name);
            }
        }
        let material =
            table.material.as_ref().map(|text| self.material_index(text, at)).transpose()?;
        let (first, first_instance) = self.count();
        self.loaded.description.append(description);
        // A material is the subject's; floors and plinths keep theirs.
        let SceneDescription { parts, scenery, .. } = &mut self.loaded.description;
        for (i, part) in parts.iter_mut().enumerate().skip(first) {
            if let (Some(material), false) = (material, scenery.contains(&i)) {
                part.material = material;
            }
        }
        self.share(table.key(), first, first_instance, placement);
        Ok(())
    }

    /// The numbers of parts and of instances so far.
    fn count(&self) -> (usize, usize) {
        let SceneDescription { parts, instances, .. } = &self.loaded.description;
        (parts.len(), instances.len())
    }

    /// Lets later objects of the same kind share the memory of the last one, which begins at a part and an instance, if
    /// its copies would take much and are opaque.
    fn share(&mut self, key: ObjectKey, first: usize, first_instance: usize, placement: Placement) {
        let SceneDescription { parts, instances, materials, .. } = &self.loaded.description;
        let n_copies = self.n_objects.get(&key).map_or(0, |n| n - 1);
        let own = parts[first..].iter().map(|part| part.mesh.triangles.len()).sum::<usize>();
        let is_large = n_copies.saturating_mul(own as u64) > SHARED_TRIANGLES;
        if is_large && parts[first..].iter().all(|part| part.is_opaque(materials)) {
            let (parts, instances) = (first..parts.len(), first_instance..instances.len());
            self.shared.entry(key).or_insert(SharedObject { parts, instances, placement });
        }
    }

    /// Adds an object as a copy of an earlier one. Returns whether it is one.
    fn add_copy(&mut self, key: &ObjectKey, placement: &Placement) -> Result<bool, LoadError> {
        let Some(SharedObject { parts, instances, placement: first }) = self.shared.get(key) else {
            return Ok(false);
        };
        let offset = self.loaded.description.offset;
        let inverse = first.relative_to(offset).inverse();
        let transform = (placement.relative_to(offset) * inverse).as_mat4();
        if Similarity::from_matrix(&transform).is_none() {
            return Ok(false);
        }
        let bytes = (parts.len() + instances.len()) * size_of::<Instance>();
        self.budget.take(&self.path.display().to_string(), bytes as u64)?;
        let all = &mut self.loaded.description.instances;
        all.extend(parts.clone().map(|part| Instance { part, transform }));
        for i in instances.clone() {
            let Instance { part, transform: inner } = all[i];
            let transform = (transform.as_dmat4() * inner.as_dmat4()).as_mat4();
            all.push(Instance { part, transform });
        }
        Ok(true)
    }

    /// The index of the material of that name, or of that notation.
    fn material_index(&mut self, text: &str, at: usize) -> Result<usize, LoadError> {
        if let Some(&material) = self.named.get(text) {
            return Ok(material);
        }
        let material = self.notation(text, text, at)?;
        Ok(self.add_material(text.into(), material))
    }
}

fn one_of(what: &str) -> TomlErrorKind {
    TomlErrorKind::OneOf { what: what.into(), first: "file", second: "builtin" }
}

fn camera_settings(
    table: &CameraTable,
    up: UpAxis,
    offset: DVec3,
) -> Result<CameraSettings, TomlErrorKind> {
    let projection = match (table.fov, table.orthographic) {
        (Some(_), Some(_)) => {
            let (first, second) = ("fov", "orthographic");
            return Err(TomlErrorKind::OneOf { what: "[camera]".into(), first, second });
        }
        (None, Some(height)) => Projection::Orthographic { height },
        (fov, None) => Projection::Perspective {
            fov_y_degrees: fov.unwrap_or(CameraSettings::DEFAULT_FOV_Y_DEGREES),
        },
    };
    let settings = CameraSettings {
        projection,
        origin: (DVec3::from(table.origin) - offset).as_vec3(),
        target: (DVec3::from(table.target) - offset).as_vec3(),
        up: table.up.map_or(up.vector(), Vec3::from),
    };
    settings.check()?;
    Ok(settings)
}

/// The place of an object.
#[derive(Clone, Copy)]
struct Placement {
    matrix: Mat4,
    /// That of the matrix, as precise as it is given.
    translation: DVec3,
}

impl Placement {
    /// Scale, then rotation about x, y and z, then translation; or the matrix.
    fn new(table: &ObjectTable) -> Result<Self, TomlErrorKind> {
        let others = table.scale.is_some() || table.rotate.is_some() || table.translate.is_some();
        let (matrix, translation) = match table.matrix {
            Some(_) if others => return Err(TomlErrorKind::MatrixAndOthers),
            Some(rows) if rows[3] != [0.0, 0.0, 0.0, 1.0] => return Err(TomlErrorKind::NotAffine),
            Some(rows) => {
                let m = DMat4::from_cols_array_2d(&rows).transpose();
                (m.as_mat4(), m.w_axis.truncate())
            }
            None => {
                let scale = match table.scale {
                    None => Vec3::ONE,
                    Some(Scale::Uniform(s)) => Vec3::splat(s),
                    Some(Scale::Axes(s)) => s.into(),
                };
                let [x, y, z] = table.rotate.unwrap_or_default().map(f32::to_radians);
                let translation = DVec3::from(table.translate.unwrap_or_default());
                let matrix = Mat4::from_translation(translation.as_vec3())
                    * Mat4::from_mat3(rotation_z(z) * rotation_y(y) * rotation_x(x))
                    * Mat4::from_scale(scale);
                (matrix, translation)
            }
        };
        let columns: [Vec4; 4] = [matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis];
        let is_finite = columns.iter().all(|c| c.is_finite());
        let usable = is_finite && linear_part(&matrix).determinant() != 0.0;
        if usable { Ok(Self { matrix, translation }) } else { Err(TomlErrorKind::Singular) }
    }

    /// The transform to coordinates relative to a point of the scene.
    fn relative_to(&self, offset: DVec3) -> DMat4 {
        if offset == DVec3::ZERO {
            return self.matrix.as_dmat4();
        }
        DMat4 { w_axis: (self.translation - offset).extend(1.0), ..self.matrix.as_dmat4() }
    }
}
