//! Errors in glTF files.

use super::ktx2::Ktx2Error;
use super::meshopt::MeshoptError;
use crate::math::{Vec2, Vec4};
use crate::scene::TextureError;
use crate::scene::load::LoadError;

/// The kind of a glTF error.
#[derive(Debug, thiserror::Error)]
pub enum GltfErrorKind {
    /// A part of the JSON that violates the format.
    #[error("{place} is not valid: {source}")]
    Json {
        /// `the JSON`, or an array with an index.
        place: String,
        /// The parser's error.
        source: serde_json::Error,
    },
    /// A glTF 1.0 file.
    #[error(
        "this is glTF 1.0, which glTF 2.0 replaced in 2017; convert it, for instance with `npx gltf-pipeline -i OLD -o NEW.glb`"
    )]
    Version1,
    /// A file of an unknown version.
    #[error("this is glTF {version}; only version 2.0 is supported")]
    Version {
        /// The version that the file requires.
        version: String,
    },
    /// A GLB file with inconsistent chunks.
    #[error("the GLB container is truncated or damaged: {problem}")]
    Container {
        /// The inconsistency.
        problem: String,
    },
    /// An error in one part of the file.
    #[error("{place}: {source}")]
    In {
        /// The part.
        place: String,
        /// The error there.
        source: Box<GltfErrorKind>,
    },
    /// An index out of range.
    #[error("it refers to {what} {index}, but there are only {count}")]
    NoSuch {
        /// The kind of object.
        what: &'static str,
        /// The index.
        index: usize,
        /// The number of objects.
        count: usize,
    },
    /// Data outside of their container.
    #[error(
        "{what} {index} covers bytes {begin}..{end} of {length}; the file is truncated or damaged"
    )]
    OutOfRange {
        /// The kind of data.
        what: &'static str,
        /// The index.
        index: usize,
        /// The first byte.
        begin: u64,
        /// The byte after the last.
        end: u64,
        /// The size of the container \[bytes\].
        length: usize,
    },
    /// An accessor of a type that its use does not allow.
    #[error("accessor {index} holds {found}, but its use for {used_for} requires {needed}")]
    AccessorType {
        /// The accessor.
        index: usize,
        /// The type that it holds.
        found: String,
        /// The type that the use requires.
        needed: &'static str,
        /// The use.
        used_for: String,
    },
    /// Accessors with too many implicit zeros.
    #[error(
        "accessor {index} has {count} values but no data, too many zeros for a file without data"
    )]
    NoData {
        /// The accessor.
        index: usize,
        /// The number of values.
        count: usize,
    },
    /// Embedded data that are not base64.
    #[error("{what} {index} has a data URI that cannot be decoded: {source}")]
    Base64 {
        /// The kind of object.
        what: &'static str,
        /// The index.
        index: usize,
        /// The decoder's error.
        source: base64::DecodeError,
    },
    /// A URI that is neither data nor a relative path.
    #[error(
        "{what} {index} has the URI '{uri}'; only relative paths and base64 data are supported"
    )]
    Uri {
        /// The kind of object.
        what: &'static str,
        /// The index.
        index: usize,
        /// The URI, shortened.
        uri: String,
    },
    /// A buffer or an image without data.
    #[error("{what} {index} has no data")]
    NoSource {
        /// The kind of object.
        what: &'static str,
        /// The index.
        index: usize,
    },
    /// A buffer view that cannot be decompressed.
    #[error("buffer view {view}, compressed by meshopt: {source}")]
    Meshopt {
        /// The buffer view.
        view: usize,
        /// The decoder's error.
        source: MeshoptError,
    },
    /// A mesh that Draco cannot decode.
    #[error("its Draco data cannot be decoded: {problem}")]
    Draco {
        /// The decoder's error.
        problem: String,
    },
    /// A KTX2 image that cannot be decoded.
    #[error("image {image} is not a readable KTX2 file: {source}")]
    Ktx2 {
        /// The image.
        image: usize,
        /// The decoder's error.
        source: Ktx2Error,
    },
    /// An image whose size does not match its data.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// An image in an unsupported format.
    #[error(
        "image {image} is AVIF, which is not supported; convert it, for instance with `npx @gltf-transform/cli png IN.glb OUT.glb`"
    )]
    Avif {
        /// The image.
        image: usize,
    },
    /// A node with two parents, a cycle, or a tree that is too deep.
    #[error(
        "node {node} is reached twice or is more than {limit} levels deep; nodes must form a tree"
    )]
    NotATree {
        /// The node.
        node: usize,
        /// The limit.
        limit: usize,
    },
    /// An index that refers to no vertex.
    #[error("index {index} refers to no vertex; there are {vertices}")]
    Index {
        /// The index.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// An attribute whose count differs from that of the positions.
    #[error("{count} {attribute} for {vertices} vertices")]
    Count {
        /// The attribute.
        attribute: String,
        /// The number of values.
        count: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// An unknown required extension in strict mode.
    #[error(
        "the file requires the extension {name}, which is unknown; without --strict, the rest is drawn"
    )]
    RequiredExtension {
        /// The extension.
        name: String,
    },
    /// Vertices that lack something in strict mode.
    #[error("{source}; without --strict, the mesh is drawn in wrong colors there")]
    Vertices {
        /// What they lack.
        source: VertexError,
    },
    /// An animation with unusable keys in strict mode.
    #[error("{source}; without --strict, the channel is left out")]
    Keys {
        /// What is wrong with the keys.
        source: KeyError,
    },
    /// An unusable camera in strict mode.
    #[error("{problem}; without --strict, the camera is left out")]
    Camera {
        /// Why it is unusable.
        problem: String,
    },
    /// A portal without an area in strict mode.
    #[error("a portal without an area; without --strict, it is left out")]
    Portal,
    /// Attributes of instances with different lengths.
    #[error("an attribute of its instances has {count} values, another {instances}")]
    Instances {
        /// The length of one attribute.
        count: usize,
        /// The length of another attribute.
        instances: usize,
    },
    /// A choice that the file does not have.
    #[error("there is no {what} '{asked}'; {}", list(.what, .known))]
    NoChoice {
        /// The kind of object.
        what: &'static str,
        /// The requested name or number.
        asked: String,
        /// The available names.
        known: Vec<String>,
    },
}

/// Vertices that do not have what their material needs.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum VertexError {
    /// A set of texture coordinates that a texture needs.
    #[error("a texture of its material needs TEXCOORD_{set}, which it lacks")]
    NoUvs {
        /// The number of the set.
        set: u32,
    },
    /// Texture coordinates that are NaN or infinite.
    #[error("TEXCOORD_{set} of vertex {vertex} is not finite: {value}")]
    Uv {
        /// The number of the set.
        set: u32,
        /// The first such vertex.
        vertex: usize,
        /// Its coordinates.
        value: Vec2,
    },
    /// A color that is NaN or infinite.
    #[error("COLOR_0 of vertex {vertex} is not finite: {value}")]
    Color {
        /// The first such vertex.
        vertex: usize,
        /// Its color.
        value: Vec4,
    },
}

/// Keys of an animation that have no value at any time.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum KeyError {
    /// No keys.
    #[error("there are no keys")]
    Empty,
    /// A time that is NaN or infinite, or before that of the last key.
    #[error("key {key} is at {time} s, but times must be finite and must not decrease")]
    Time {
        /// The key, from 0.
        key: usize,
        /// Its time \[s\].
        time: f32,
    },
    /// A number of values that does not fit the number of keys.
    #[error("there are {values} values for {keys} keys, each of which needs {needed}")]
    Count {
        /// The number of values.
        values: usize,
        /// The number of keys.
        keys: usize,
        /// The number of values for each key, in words.
        needed: &'static str,
    },
    /// A value that is NaN or infinite.
    #[error("value {index} is not finite: {value}")]
    Value {
        /// The value, from 0.
        index: usize,
        /// Its first number that is not finite.
        value: f32,
    },
}

/// Lists the available names: `the scenes are 0 'a', 1 'b'`.
fn list(what: &str, known: &[String]) -> String {
    if known.is_empty() {
        return "the file has none".into();
    }
    let names: Vec<_> = known.iter().enumerate().map(|(i, name)| format!("{i} '{name}'")).collect();
    format!("the {what}s are {}", names.join(", "))
}

impl GltfErrorKind {
    /// Adds the part of the file that contains the error.
    pub(super) fn within(self, place: impl Into<String>) -> Self {
        Self::In { place: place.into(), source: Box::new(self) }
    }
}

/// The reason why a file cannot be loaded.
pub(super) enum Failure {
    /// An error in the file.
    Problem(GltfErrorKind),
    /// A lack of memory, or an error in a referenced file.
    Load(LoadError),
}

impl Failure {
    /// Adds the part of the file that contains the error.
    pub(super) fn within(self, place: impl FnOnce() -> String) -> Self {
        match self {
            Self::Problem(problem) => Self::Problem(problem.within(place())),
            load @ Self::Load(_) => load,
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Problem(problem) => problem.fmt(f),
            Self::Load(error) => error.fmt(f),
        }
    }
}

impl From<GltfErrorKind> for Failure {
    fn from(problem: GltfErrorKind) -> Self {
        Self::Problem(problem)
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        Self::Load(error)
    }
}
