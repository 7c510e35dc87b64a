//! What can be wrong with a glTF file.

use super::ktx2::Ktx2Error;
use super::meshopt::MeshoptError;
use crate::scene::TextureError;
use crate::scene::load::LoadError;

/// What is wrong with a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum GltfErrorKind {
    /// A part of the JSON that is not what the format has there.
    #[error("{place} is not valid: {source}")]
    Json {
        /// `the JSON`, or an array with an index.
        place: String,
        /// What the parser says.
        source: serde_json::Error,
    },
    /// A file of the format's first version.
    #[error(
        "this is glTF 1.0, which glTF 2.0 replaced in 2017; convert it, for instance by `npx gltf-pipeline -i OLD -o NEW.glb`"
    )]
    Version1,
    /// A file of a version that is not known.
    #[error("this is glTF {version}; version 2.0 is read")]
    Version {
        /// The version that the file asks for.
        version: String,
    },
    /// A GLB file whose chunks do not fit together.
    #[error("the GLB container is truncated or damaged: {problem}")]
    Container {
        /// What does not fit.
        problem: String,
    },
    /// Something wrong in one part of the file.
    #[error("{place}: {source}")]
    In {
        /// Which part.
        place: String,
        /// What is wrong there.
        source: Box<GltfErrorKind>,
    },
    /// An index of something that is not there.
    #[error("it refers to {what} {index}, but there are only {count}")]
    NoSuch {
        /// What.
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Data that lie outside of what holds them.
    #[error(
        "{what} {index} covers bytes {begin}..{end} of {length}; the file is truncated or damaged"
    )]
    OutOfRange {
        /// What lies outside.
        what: &'static str,
        /// Its index.
        index: usize,
        /// Where it begins.
        begin: u64,
        /// Where it ends.
        end: u64,
        /// How much there is.
        length: usize,
    },
    /// An accessor of a type that its use does not allow.
    #[error("accessor {index} holds {found}, but {needed} is needed for {used_for}")]
    AccessorType {
        /// The accessor.
        index: usize,
        /// What it holds.
        found: String,
        /// What was expected.
        needed: &'static str,
        /// For what.
        used_for: String,
    },
    /// Accessors that promise zeros without end.
    #[error(
        "accessor {index} has {count} values but no data, too many zeros for a file without data"
    )]
    NoData {
        /// The accessor.
        index: usize,
        /// Its count.
        count: usize,
    },
    /// Embedded data that are not base64.
    #[error("{what} {index} has a data URI that cannot be decoded: {source}")]
    Base64 {
        /// Whose.
        what: &'static str,
        /// Its index.
        index: usize,
        /// What the decoder says.
        source: base64::DecodeError,
    },
    /// A URI that is neither data nor a relative path.
    #[error("{what} {index} has the URI '{uri}'; only relative paths and base64 data are read")]
    Uri {
        /// Whose.
        what: &'static str,
        /// Its index.
        index: usize,
        /// The URI, shortened.
        uri: String,
    },
    /// A buffer or an image without data.
    #[error("{what} {index} has no data")]
    NoSource {
        /// What.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A buffer view that cannot be decompressed.
    #[error("buffer view {view}, compressed by meshopt: {source}")]
    Meshopt {
        /// The buffer view.
        view: usize,
        /// What is wrong.
        source: MeshoptError,
    },
    /// A mesh that Draco cannot decode.
    #[error("its Draco data cannot be decoded: {problem}")]
    Draco {
        /// What the decoder says.
        problem: String,
    },
    /// A KTX2 image that cannot be decoded.
    #[error("image {image} is not a readable KTX2 file: {source}")]
    Ktx2 {
        /// The image.
        image: usize,
        /// What is wrong.
        source: Ktx2Error,
    },
    /// An image whose size and data disagree.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// An image in a format that nothing here reads.
    #[error(
        "image {image} is AVIF, which is not read; convert it, for instance by `npx @gltf-transform/cli png IN.glb OUT.glb`"
    )]
    Avif {
        /// The image.
        image: usize,
    },
    /// A node with two parents or among its own ancestors, or too deep a tree.
    #[error(
        "node {node} is reached twice or is more than {limit} levels deep; nodes must form a tree"
    )]
    NotATree {
        /// The node.
        node: usize,
        /// The limit.
        limit: usize,
    },
    /// An index that names no vertex.
    #[error("index {index} refers to no vertex; there are {vertices}")]
    Index {
        /// The index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An attribute that is not as long as the positions.
    #[error("{count} {attribute} for {vertices} vertices")]
    Count {
        /// The attribute.
        attribute: String,
        /// How many there are.
        count: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A required extension that is not known, where none may be passed over.
    #[error(
        "the file requires the extension {name}, which is unknown; without --strict, the rest is drawn"
    )]
    RequiredExtension {
        /// The extension.
        name: String,
    },
    /// Attributes of instances that are not of one length.
    #[error("an attribute of its instances has {count} values, another {instances}")]
    Instances {
        /// How many one has.
        count: usize,
        /// How many another has.
        instances: usize,
    },
    /// A choice that the file does not have.
    #[error("there is no {what} '{asked}'; {}", list(.what, .known))]
    NoChoice {
        /// What was asked for.
        what: &'static str,
        /// Its name or number.
        asked: String,
        /// The names of those that there are.
        known: Vec<String>,
    },
}

/// `the scenes are 0 'a', 1 'b'`.
fn list(what: &str, known: &[String]) -> String {
    if known.is_empty() {
        return "the file has none".into();
    }
    let names: Vec<_> = known.iter().enumerate().map(|(i, name)| format!("{i} '{name}'")).collect();
    format!("the {what}s are {}", names.join(", "))
}

impl GltfErrorKind {
    /// The problem with the part of the file where it is.
    pub(super) fn within(self, place: impl Into<String>) -> Self {
        Self::In { place: place.into(), source: Box::new(self) }
    }
}

/// Why a file cannot be loaded: it is broken, or something around it is wrong.
pub(super) enum Failure {
    /// In the file.
    Problem(GltfErrorKind),
    /// Memory, or a file beside it.
    Load(LoadError),
}

impl Failure {
    /// With the part of the file where it is.
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
