//! Loaders: meshes and scenes from files, one format a file.
//!
//! | format | geometry | materials | camera |
//! |---|---|---|---|
//! | PLY | yes | vertex colours | no |
//! | OBJ + MTL | yes | `Kd Ks Ns Pr Pm map_Kd norm` | no |
//! | glTF, GLB | triangles | metallic-roughness, normal maps | perspective, orthographic |
//! | TOML | the above and built-in meshes | by text or table | yes |
//!
//! The format is told by the first bytes where they are telling (PLY, GLB), else by the extension.
//! Every loader checks what it reads before it takes memory for it; bad input is a [`LoadError`]
//! that names the file and the place, never a panic.

mod budget;
mod gltf;
mod mtl;
mod obj;
mod ply;
mod textures;
mod toml;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

pub use self::gltf::GltfProblem;
pub use obj::ObjProblem;
pub use ply::{PlyPlace, PlyProblem};
pub use toml::TomlProblem;

use super::SceneDescription;
use crate::memory::OverLimit;
use budget::Budget;

/// A scene from a file, and what the loader passed over.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene.
    pub description: SceneDescription,
    /// What the picture will lack, one sentence each.
    pub warnings: Vec<String>,
    /// An estimate of the memory that loading took, in bytes.
    pub memory: u64,
}

/// Why a file makes no scene.
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
    /// A file that takes more memory than is allowed.
    #[error("{file}: {source}")]
    Memory {
        /// The file, or its place in another one.
        file: String,
        /// How much.
        source: OverLimit,
    },
    /// Neither content nor extension is known.
    #[error(
        "{} is none of the scene formats known: .ply, .obj, .gltf, .glb and .toml", path.display()
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Nothing to render.
    #[error("{} holds no triangles", path.display())]
    NoTriangles {
        /// The file.
        path: PathBuf,
    },
    /// A broken PLY file.
    #[error("{}, {place}: {problem}", path.display())]
    Ply {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: PlyPlace,
        /// What is wrong.
        problem: Box<PlyProblem>,
    },
    /// A broken OBJ or MTL file.
    #[error("{}, line {line}: {problem}", path.display())]
    Obj {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What is wrong.
        problem: ObjProblem,
    },
    /// A broken glTF file.
    #[error("{}: {problem}", path.display())]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: Box<GltfProblem>,
    },
    /// A broken scene file.
    #[error("{}{}: {problem}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: Option<usize>,
        /// What is wrong.
        problem: Box<TomlProblem>,
    },
}

/// Loads a mesh or a scene file.
///
/// # Errors
/// A [`LoadError`] that names the file and the place.
pub fn load(path: impl AsRef<Path>) -> Result<Loaded, LoadError> {
    load_within(path, None)
}

/// As [`load`], with a limit on what its meshes and textures together take of the memory \[bytes\].
///
/// # Errors
/// As [`load`]; a file that would exceed the limit is refused before the memory is taken.
pub fn load_within(path: impl AsRef<Path>, max_memory: Option<u64>) -> Result<Loaded, LoadError> {
    let path = path.as_ref();
    let budget = &Budget::new(max_memory);
    let loaded = load_bytes(path, &read(path, budget)?, false, budget)?;
    Ok(Loaded { memory: budget.taken(), ..loaded })
}

/// Loads what is no scene file, for a scene file that refers to it.
fn load_mesh(path: &Path, referrer: &str, budget: &Budget) -> Result<Loaded, LoadError> {
    load_bytes(path, &read_referenced(path, referrer, budget)?, true, budget)
}

fn load_bytes(
    path: &Path,
    bytes: &[u8],
    mesh_only: bool,
    budget: &Budget,
) -> Result<Loaded, LoadError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let loaded = match extension.to_str() {
        _ if bytes.starts_with(b"ply") => ply::load(path, bytes, budget)?,
        _ if bytes.starts_with(b"glTF") => gltf::load(path, bytes, budget)?,
        Some("ply") => ply::load(path, bytes, budget)?,
        Some("gltf" | "glb") => gltf::load(path, bytes, budget)?,
        Some("obj") => obj::load(path, bytes, budget)?,
        Some("toml") if !mesh_only => toml::load(path, bytes, budget)?,
        _ => return Err(LoadError::UnknownFormat { path: path.into() }),
    };
    if loaded.description.parts.iter().all(|p| p.mesh.triangles.is_empty()) {
        return Err(LoadError::NoTriangles { path: path.into() });
    }
    Ok(loaded)
}

fn read(path: &Path, budget: &Budget) -> Result<Vec<u8>, LoadError> {
    read_plain(path, budget, |source| LoadError::Read { path: path.into(), source })
}

fn read_referenced(path: &Path, referrer: &str, budget: &Budget) -> Result<Vec<u8>, LoadError> {
    read_plain(path, budget, |source| LoadError::ReadReferenced {
        path: path.into(),
        referrer: referrer.into(),
        source,
    })
}

/// The bytes of a plain file: a device or a pipe might never end.
fn read_plain(
    path: &Path,
    budget: &Budget,
    error: impl Fn(io::Error) -> LoadError,
) -> Result<Vec<u8>, LoadError> {
    let metadata = fs::metadata(path).map_err(&error)?;
    if metadata.is_dir() {
        return Err(error(io::ErrorKind::IsADirectory.into()));
    }
    if !metadata.is_file() {
        return Err(error(io::Error::new(io::ErrorKind::InvalidInput, "it is not a plain file")));
    }
    budget.take(&path.display().to_string(), metadata.len())?;
    fs::read(path).map_err(error)
}

/// The name of a file without folder and extension.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A path that a file gives, relative to that file; backslashes count as slashes.
fn relative(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path.replace('\\', "/"))
}
