//! Loaders: meshes and scenes from files, one format per file.
//!
//! | format | geometry | materials | camera |
//! |---|---|---|---|
//! | PLY | yes, with triangle strips | colors of vertices and faces | no |
//! | OBJ + MTL | yes | `Kd Ks Ke Ns Pr Pm d Tr`, their maps, normal maps | no |
//! | STL | ASCII and binary | no | no |
//! | OFF | also COFF, NOFF, STOFF, 4OFF | colors of vertices and faces | no |
//! | glTF, GLB | triangles, skins, morph targets | all of the standard's extensions as data | all |
//! | TOML | the above and built-in meshes | by text or table | yes |
//!
//! The format is recognized by the first bytes if they are unambiguous (PLY, GLB), or else by the extension, or else by
//! the first word (`OFF`, `solid`).
//! Every loader checks its input before it allocates memory. Invalid input gives a [`LoadError`]
//! that names the file and the place, never a panic.

mod budget;
mod colors;
mod faces;
mod files;
mod format;
mod gltf;
mod inside_out;
mod mtl;
mod non_finite;
mod notes;
mod obj;
mod off;
mod ply;
mod polygon;
mod smoothing;
mod stl;
mod textures;
mod toml;
mod wavefront;

use std::borrow::Cow;
use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

pub use self::gltf::{GltfErrorKind, KeyError, Ktx2Error, MeshoptError, VertexError};
pub use files::Resolver;
pub use format::SceneFormat;
pub use off::OffErrorKind;
pub use ply::{PlyErrorKind, PlyPlace};
pub use stl::StlErrorKind;
pub use toml::TomlErrorKind;
pub use wavefront::ObjErrorKind;

use super::{Material, Part, SceneDescription};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::DVec3;
use crate::memory::OverLimit;
use budget::Budget;
use files::Files;

/// A scene loaded from a file, with the loader's warnings.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene.
    pub description: SceneDescription,
    /// What the picture will lack, one sentence per item.
    pub warnings: Vec<String>,
    /// An estimate of the memory that loading used \[bytes\].
    pub memory: u64,
    /// The other files that were read.
    pub files: Vec<PathBuf>,
}

impl Loaded {
    /// The mesh of a file without materials: white under colors of its own, else gray.
    fn of_mesh(path: &Path, mesh: Mesh) -> Self {
        let albedo = if mesh.colors.is_empty() { DEFAULT_ALBEDO } else { Rgb::WHITE };
        let description = SceneDescription {
            parts: vec![Part { name: stem(path), mesh, material: 0 }],
            materials: vec![Material::diffuse("default", albedo)],
            ..SceneDescription::default()
        };
        Self { description, ..Self::default() }
    }
}

/// The albedo of meshes that come without a material.
const DEFAULT_ALBEDO: Rgb = Rgb::splat(0.6);

/// Copies of a mesh that have more triangles than this together share its memory, though rays through them are slower.
const SHARED_TRIANGLES: u64 = 1 << 20;

/// The folders that a scene's files may be in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// Anywhere. Files outside the scene's folder give one warning.
    #[default]
    Anywhere,
    /// The scene's folder and its subfolders, after following links; for programs that load untrusted scenes.
    OwnFolder,
}

/// Options for loading a scene file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// The maximum memory of meshes and textures together \[bytes\]; unlimited by default.
    pub max_memory: Option<u64>,
    /// The folders that the scene's files may be in.
    pub reach: Reach,
    /// Whether to reject files that require an unknown extension (glTF), refer to an image or a material library that
    /// cannot be read (glTF, OBJ), end within a solid (STL), have a vertex with a NaN or infinite position, or have
    /// unusable texture coordinates, colors, cameras or keys of the requested animation (glTF). Otherwise the rest is
    /// drawn, with a warning.
    pub strict: bool,
    /// The scene in a file with several scenes (glTF), by name or by number from 0.
    pub scene: Option<String>,
    /// A time in an animation (glTF); without one, nodes have the rest pose of the file.
    pub animation: Option<AnimationTime>,
}

/// A time in an animation.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimationTime {
    /// The animation's name, or its number from 0.
    pub name: String,
    /// The time since its start \[s\]. Nothing moves before the first key and after the last.
    pub seconds: f32,
}

/// An error in loading a scene.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file that another one refers to cannot be read.
    #[error("cannot read {}, which {referrer} refers to: {source}", path.display())]
    ReadReferenced {
        /// The file.
        path: PathBuf,
        /// Which file and what in it.
        referrer: String,
        /// What the system says.
        source: io::Error,
    },
    /// A file outside the scene's folder that [`Reach`] does not allow.
    #[error("{}, which {referrer} refers to, is outside of the scene's folder", path.display())]
    Outside {
        /// The file.
        path: PathBuf,
        /// Which file and what in it.
        referrer: String,
    },
    /// A texture that is no image.
    #[error(
        "texture {image}, which {referrer} refers to, cannot be decoded: {source}; use PNG, JPEG, TGA or WebP"
    )]
    Image {
        /// The file, or its place in another one.
        image: String,
        /// Which file and what in it.
        referrer: String,
        /// What the decoder says.
        source: image::ImageError,
    },
    /// A file that needs more memory than allowed.
    #[error("{file}: {source}")]
    Memory {
        /// The file, or its place in another one.
        file: String,
        /// How much.
        source: OverLimit,
    },
    /// Neither content nor extension is known.
    #[error(
        "{} is not in a known scene format: .ply, .obj, .stl, .off, .gltf, .glb and \
         .toml", path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A scene file in the place of a mesh.
    #[error(
        "{}, which {referrer} refers to, is a scene file; objects of a scene file are .ply, .obj, .stl, .off, .gltf and \
         .glb files", path.display()
    )]
    SceneInScene {
        /// The file.
        path: PathBuf,
        /// Which file and what in it.
        referrer: String,
    },
    /// A scene or an animation requested from a format that has none.
    #[error("{} is not a glTF file and has no {what} to choose", path.display())]
    NoChoice {
        /// The file.
        path: PathBuf,
        /// `scenes` or `animations`.
        what: &'static str,
    },
    /// Nothing to render.
    #[error("{} holds no triangles", path.display())]
    NoTriangles {
        /// The file.
        path: PathBuf,
    },
    /// A file without a byte.
    #[error("{}: the file is empty", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// An invalid PLY file.
    #[error("{}, {place}: {kind}", path.display())]
    Ply {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: PlyPlace,
        /// What is wrong.
        kind: Box<PlyErrorKind>,
    },
    /// An invalid OBJ or MTL file.
    #[error("{}, line {line}: {kind}", path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What is wrong.
        kind: ObjErrorKind,
    },
    /// An invalid OFF file.
    #[error("{}, line {line}: {kind}", path.display())]
    Off {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What is wrong.
        kind: OffErrorKind,
    },
    /// An invalid STL file.
    #[error("{}: {kind}", path.display())]
    Stl {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        kind: StlErrorKind,
    },
    /// An invalid glTF file.
    #[error("{}: {kind}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        kind: Box<GltfErrorKind>,
    },
    /// An invalid scene file.
    #[error("{}{}: {kind}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: Option<usize>,
        /// What is wrong.
        kind: Box<TomlErrorKind>,
    },
}

impl LoadError {
    /// Whether an image cannot be read, without which the rest of a scene can be drawn. What exceeds a limit is not that.
    fn is_about_one_image(&self) -> bool {
        match self {
            Self::ReadReferenced { .. } => true,
            Self::Image { source, .. } => !matches!(source, image::ImageError::Limits(_)),
            _ => false,
        }
    }
}

/// Loads a mesh or a scene file.
///
/// # Errors
/// A [`LoadError`] that names the file and the place.
pub fn load(path: impl AsRef<Path>) -> Result<Loaded, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Like [`load`], within limits.
///
/// # Errors
/// Those of [`load`]. Also if the scene would exceed the memory limit, which is checked before allocating memory or
/// reading a file, if the options reject the file, or if it lacks the requested scene or animation.
pub fn load_with(path: impl AsRef<Path>, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let path = path.as_ref();
    let budget = &Budget::new(path, Files::System, options.max_memory, options.reach);
    let bytes = budget.read(path, |source| LoadError::Read { path: path.into(), source })?;
    Ok(finish(load_file(path, &bytes, false, budget, options)?, path, budget))
}

/// Like [`load_with`], from the bytes of a file. `name` is the path of the file, for messages and to recognize the
/// format if the content does not determine it. `resolver` returns the bytes of the files that it refers to, with
/// paths relative to the folder of `name`.
///
/// ```
/// use std::io;
/// use std::path::Path;
///
/// let obj = b"mtllib red.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
/// let resolver = |path: &Path| match path.to_str() {
///     Some("red.mtl") => Ok(b"newmtl red\nKd 1 0 0\n".to_vec()),
///     _ => Err(io::ErrorKind::NotFound.into()),
/// };
/// let options = domelight::scene::LoadOptions::default();
/// let loaded = domelight::scene::load_bytes("triangle.obj", obj, &resolver, &options)?;
/// assert_eq!(loaded.description.materials[0].name, "red");
/// # Ok::<(), domelight::scene::LoadError>(())
/// ```
///
/// # Errors
/// Those of [`load_with`]. With [`Reach::OwnFolder`], the resolver is not called for files outside the scene's folder.
pub fn load_bytes(
    name: impl AsRef<Path>,
    bytes: &[u8],
    resolver: &Resolver<'_>,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let path = name.as_ref();
    let budget = &Budget::new(path, Files::Given(resolver), options.max_memory, options.reach);
    budget.take(&path.display().to_string(), bytes.len() as u64)?;
    Ok(finish(load_file(path, bytes, false, budget, options)?, path, budget))
}

fn finish(mut loaded: Loaded, path: &Path, budget: &Budget) -> Loaded {
    loaded.warnings.extend(budget.warning(path));
    loaded.warnings.extend(far_away(path, &loaded.description));
    once(&mut loaded.warnings);
    Loaded { memory: budget.taken(), files: budget.files(), ..loaded }
}

/// What is said of a scene that is described relative to a point far from the origin.
fn far_away(path: &Path, description: &SceneDescription) -> Option<String> {
    let DVec3 { x, y, z } = description.offset;
    if description.offset == DVec3::ZERO {
        return None;
    }
    let size = description.bounds().size().max_element();
    Some(format!(
        "{}: a scene {size} across at large coordinates is drawn relative to {x},{y},{z}, to keep its precision",
        path.display()
    ))
}

/// Leaves each warning once, and no more than anybody reads.
fn once(warnings: &mut Vec<String>) {
    const MOST: usize = 30;
    let mut told = HashSet::new();
    warnings.retain(|warning| told.insert(warning.clone()));
    if warnings.len() > MOST {
        let more = warnings.len() - (MOST - 1);
        warnings.truncate(MOST - 1);
        warnings.push(format!("{more} more warnings like these"));
    }
}

/// Loads what is no scene file, for a scene file that refers to it.
fn load_mesh(
    path: &Path,
    referrer: &str,
    budget: &Budget,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        return Err(LoadError::SceneInScene { path: path.into(), referrer: referrer.into() });
    }
    load_file(path, &read_referenced(path, referrer, budget)?, true, budget, options)
}

fn load_file(
    path: &Path,
    bytes: &[u8],
    mesh_only: bool,
    budget: &Budget,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let unknown = || LoadError::UnknownFormat { path: path.into() };
    let bytes = &*utf8_of(bytes);
    let format = SceneFormat::of(path, bytes).ok_or_else(unknown)?;
    if bytes.is_empty() {
        return Err(LoadError::Empty { path: path.into() });
    }
    let is_gltf = matches!(format, SceneFormat::Gltf | SceneFormat::Glb);
    let chosen = [("scenes", options.scene.is_some()), ("animations", options.animation.is_some())];
    if let (false, Some((what, _))) = (is_gltf, chosen.into_iter().find(|(_, chosen)| *chosen)) {
        return Err(LoadError::NoChoice { path: path.into(), what });
    }
    let strict = options.strict;
    let mut loaded = match format {
        // Report nothing of the content of a file that is no mesh.
        SceneFormat::Ply if mesh_only && !bytes.starts_with(b"ply") => return Err(unknown()),
        SceneFormat::Toml if mesh_only => return Err(unknown()),
        SceneFormat::Ply => ply::load(path, bytes, budget, strict)?,
        SceneFormat::Gltf | SceneFormat::Glb => gltf::load(path, bytes, budget, options)?,
        SceneFormat::Obj => obj::load(path, bytes, budget, strict)?,
        SceneFormat::Stl => stl::load(path, bytes, budget, strict)?,
        SceneFormat::Off => off::load(path, bytes, budget, strict)?,
        SceneFormat::Toml => toml::load(path, bytes, budget, options)?,
    };
    if loaded.description.parts.iter().all(|p| p.mesh.triangles.is_empty()) {
        return Err(LoadError::NoTriangles { path: path.into() });
    }
    if !strict {
        loaded.warnings.extend(non_finite::leave_out(path, &mut loaded.description.parts));
        loaded.warnings.extend(inside_out::show(path, &mut loaded.description));
    }
    Ok(loaded)
}

fn read_referenced(path: &Path, referrer: &str, budget: &Budget) -> Result<Vec<u8>, LoadError> {
    budget.refer(path, referrer)?;
    budget.read(path, |source| LoadError::ReadReferenced {
        path: path.into(),
        referrer: referrer.into(),
        source,
    })
}

/// The byte that ends the lines of a text: a line feed, or a carriage return if none follows the first line.
fn line_end(text: &[u8]) -> u8 {
    let is_end = |&b: &u8| b == b'\n' || b == b'\r';
    let first = text.iter().position(is_end).unwrap_or(text.len());
    let after = text[first..].iter().find(|&&b| b != b'\r');
    if after == Some(&b'\n') || first == text.len() { b'\n' } else { b'\r' }
}

/// The bytes of a text after its byte order mark, in UTF-8 if the mark is of UTF-16; other bytes as they are.
fn utf8_of(bytes: &[u8]) -> Cow<'_, [u8]> {
    let of_units = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|b| unit([b[0], b[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    };
    match bytes {
        [0xff, 0xfe, ..] => of_units(u16::from_le_bytes),
        [0xfe, 0xff, ..] => of_units(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, text @ ..] => Cow::Borrowed(text),
        _ => Cow::Borrowed(bytes),
    }
}

/// Text that may be of before UTF-8.
fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        // Latin-1 is the first 256 characters of Unicode.
        Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
    }
}

/// The name of a part, which serves messages alone: the beginning of a long one, because every part has its own copy.
fn part_name(name: &str) -> String {
    const MOST: usize = 200;
    match name.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &name[..end]),
        None => name.to_owned(),
    }
}

/// The name of a file without folder and extension.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name of a file at the end of a path of any system.
fn last_part(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// A path that a file gives, relative to that file; backslashes count as slashes. `-` is a file of that name: what reads
/// standard input is up to the user.
fn relative(file: &Path, path: &str) -> PathBuf {
    let path = file.parent().unwrap_or(Path::new("")).join(path.replace('\\', "/"));
    if path == Path::new("-") { Path::new(".").join(path) } else { path }
}
