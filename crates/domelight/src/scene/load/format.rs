//! Which format a scene's file has.

use std::fmt;
use std::path::Path;

use super::{off, stl};

/// The formats that scenes are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFormat {
    /// Polygon file format.
    Ply,
    /// Wavefront OBJ, with MTL.
    Obj,
    /// Stereolithography.
    Stl,
    /// Object file format.
    Off,
    /// glTF 2.0 as text.
    Gltf,
    /// Binary glTF 2.0.
    Glb,
    /// A scene file of this program.
    Toml,
}

impl SceneFormat {
    /// All formats.
    pub const ALL: [Self; 7] =
        [Self::Ply, Self::Obj, Self::Stl, Self::Off, Self::Gltf, Self::Glb, Self::Toml];

    /// The end of its files' names, in lower case and without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Stl => "stl",
            Self::Off => "off",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Toml => "toml",
        }
    }

    /// The format of a file: by its first bytes where they are telling, else by its name, else by its first word; `None`
    /// if it is none of these.
    pub fn of(path: &Path, bytes: &[u8]) -> Option<Self> {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        let by_name = Self::ALL.into_iter().find(|format| format.extension() == extension);
        match bytes {
            [b'p', b'l', b'y', ..] => Some(Self::Ply),
            [b'g', b'l', b'T', b'F', ..] => Some(Self::Glb),
            _ if by_name.is_some() => by_name,
            _ if off::is_off(bytes) => Some(Self::Off),
            _ if stl::is_stl(bytes) => Some(Self::Stl),
            _ => None,
        }
    }
}

impl fmt::Display for SceneFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}
