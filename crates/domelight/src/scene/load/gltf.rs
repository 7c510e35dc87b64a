//! glTF 2.0, as JSON with files beside it or as one GLB file.
//!
//! Read are the default scene's nodes with their transforms, triangle lists, strips and fans,
//! normals (flat ones where there are none, as the format demands), tangents, vertex colours, one
//! set of texture coordinates a material, metallic-roughness materials with their textures, normal
//! maps, `KHR_texture_transform` (but of normal maps), and the first camera. Passed over with a warning are emission,
//! transparency, points and lines, and textures of a second set of coordinates; skins and morph
//! targets stay in their rest pose.
//!
//! The crate `gltf` parses and checks the JSON; accessors are read here, because its readers panic
//! on sparse data that end early.

use std::cell::Cell;
use std::collections::HashMap;
use std::path::Path;

use base64::Engine;
use gltf::accessor::{DataType, Dimensions};
use gltf::json;
use gltf::mesh::{Mode, Semantic};
use gltf::texture::WrappingMode;

use super::textures::Textures;
use super::{Budget, LoadError, Loaded, read_referenced, relative};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{Mat4, Vec2, Vec3, Vec4};
use crate::scene::{
    CameraSettings, Encoding, MetallicRoughnessSurface, NormalMap, Part, Projection,
    SceneDescription, Surface, SurfaceModel, TextureRef, UpAxis, UvTransform, Wrap,
};

/// What is wrong with a glTF file.
#[derive(Debug, thiserror::Error)]
pub enum GltfProblem {
    /// The container or the JSON in it.
    #[error("not valid glTF 2.0: {0}")]
    Document(#[from] gltf::Error),
    /// The header of a GLB file gives an impossible length.
    #[error("the GLB header gives a length of {length} bytes; the file is damaged")]
    GlbLength {
        /// The length.
        length: u32,
    },
    /// Data that lie outside of what holds them.
    #[error(
        "{what} {index} covers bytes {begin}..{end} of {length}; the file is cut short or damaged"
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
    /// An accessor that promises values without saying what they are.
    #[error(
        "accessor {index} has {count} values but no data, or too many sparse ones without a base"
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
    /// A buffer without data.
    #[error("{what} {index} has no data")]
    NoSource {
        /// What.
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A node with two parents or among its own ancestors, or too deep a tree.
    #[error(
        "node {node} is reached twice or lies more than {limit} levels deep; nodes must form a tree"
    )]
    NotATree {
        /// The node.
        node: usize,
        /// The limit.
        limit: usize,
    },
    /// An index that names no vertex.
    #[error(
        "mesh {mesh}, primitive {primitive}: index {index} names no vertex; there are {vertices}"
    )]
    Index {
        /// The mesh.
        mesh: usize,
        /// The primitive.
        primitive: usize,
        /// The index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// An attribute that is not as long as the positions.
    #[error("mesh {mesh}, primitive {primitive}: {count} {attribute} for {vertices} vertices")]
    Count {
        /// The mesh.
        mesh: usize,
        /// The primitive.
        primitive: usize,
        /// The attribute.
        attribute: &'static str,
        /// How many there are.
        count: usize,
        /// How many vertices there are.
        vertices: usize,
    },
    /// Positions in an accessor that does not exist.
    #[error(
        "mesh {mesh}, primitive {primitive}: its positions are in accessor {accessor}, but there are only {accessors}"
    )]
    NoAccessor {
        /// The mesh.
        mesh: usize,
        /// The primitive.
        primitive: usize,
        /// The accessor.
        accessor: usize,
        /// How many there are.
        accessors: usize,
    },
    /// A primitive without positions.
    #[error("mesh {mesh}, primitive {primitive} has no positions")]
    NoPositions {
        /// The mesh.
        mesh: usize,
        /// The primitive.
        primitive: usize,
    },
}

const MAX_DEPTH: usize = 200;

/// Extensions that change nothing unseen: read, or warned of where they matter.
const HANDLED_EXTENSIONS: [&str; 2] = ["KHR_texture_transform", "KHR_materials_emissive_strength"];

/// The most values of sparse accessors that nothing in the file backs, all meshes and their instances together.
const MAX_ZEROS: usize = 1 << 24;

pub(super) fn load(path: &Path, bytes: &[u8], budget: &Budget) -> Result<Loaded, LoadError> {
    let (document, blob) = parse(bytes)
        .map_err(|problem| LoadError::Gltf { path: path.into(), problem: Box::new(problem) })?;
    let mut reader = Reader {
        path,
        document: &document,
        buffers: Vec::new(),
        zeros_left: Cell::new(MAX_ZEROS),
        visited: vec![false; document.nodes().len()],
        images: HashMap::new(),
        textures: Textures::new(budget),
        budget,
        surfaces: Vec::new(),
        surface_of: HashMap::new(),
        parts: Vec::new(),
        camera: None,
        warnings: Vec::new(),
    };
    for extension in document.extensions_used().filter(|e| !HANDLED_EXTENSIONS.contains(e)) {
        reader.warn(&format!("the extension {extension} is ignored"));
    }
    reader.read_buffers(blob.as_deref())?;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    match scene {
        Some(scene) => {
            for node in scene.nodes() {
                reader.node(&node, Mat4::IDENTITY, 0)?;
            }
        }
        None => {
            for mesh in document.meshes() {
                reader.mesh(&mesh, Mat4::IDENTITY)?;
            }
        }
    }
    Ok(reader.finish())
}

/// The document, checked, and the binary chunk of a GLB file.
///
/// The crate's own checks look up the accessor of the positions before they have checked its index.
fn parse(bytes: &[u8]) -> Result<(gltf::Document, Option<Vec<u8>>), GltfProblem> {
    check_glb_header(bytes)?;
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(bytes)?;
    let json = document.into_json();
    let positions = json::validation::Checked::Valid(Semantic::Positions);
    for (mesh, primitives) in json.meshes.iter().map(|m| &m.primitives).enumerate() {
        for (primitive, attributes) in primitives.iter().map(|p| &p.attributes).enumerate() {
            let Some(accessor) = attributes.get(&positions).map(json::Index::value) else {
                return Err(GltfProblem::NoPositions { mesh, primitive });
            };
            let accessors = json.accessors.len();
            if accessor >= accessors {
                return Err(GltfProblem::NoAccessor { mesh, primitive, accessor, accessors });
            }
        }
    }
    Ok((gltf::Document::from_json(json)?, blob))
}

/// The crate subtracts the header's size from the length without a check.
fn check_glb_header(bytes: &[u8]) -> Result<(), GltfProblem> {
    if bytes.starts_with(b"glTF")
        && let Some(length) = bytes.get(8..).and_then(|b| b.first_chunk())
    {
        let length = u32::from_le_bytes(*length);
        if length < 20 {
            return Err(GltfProblem::GlbLength { length });
        }
    }
    Ok(())
}

struct Reader<'a> {
    path: &'a Path,
    document: &'a gltf::Document,
    buffers: Vec<Vec<u8>>,
    /// Of [`MAX_ZEROS`].
    zeros_left: Cell<usize>,
    /// Nodes that were reached.
    visited: Vec<bool>,
    /// Textures by image index.
    images: HashMap<(usize, Encoding), usize>,
    textures: Textures<'a>,
    budget: &'a Budget,
    surfaces: Vec<Surface>,
    /// Surfaces and the set of texture coordinates by material index.
    surface_of: HashMap<Option<usize>, (usize, u32)>,
    parts: Vec<Part>,
    camera: Option<CameraSettings>,
    warnings: Vec<String>,
}

impl<'a> Reader<'a> {
    fn error(&self, problem: GltfProblem) -> LoadError {
        LoadError::Gltf { path: self.path.into(), problem: Box::new(problem) }
    }

    fn warn(&mut self, text: &str) {
        let text = format!("{}: {text}", self.path.display());
        if !self.warnings.contains(&text) {
            self.warnings.push(text);
        }
    }

    fn finish(self) -> Loaded {
        let description = SceneDescription {
            parts: self.parts,
            surfaces: self.surfaces,
            textures: self.textures.loaded,
            camera: self.camera,
            environment: None,
            up: Some(UpAxis::Y),
            scenery: Vec::new(),
        };
        Loaded { description, warnings: self.warnings, memory: 0 }
    }

    fn read_buffers(&mut self, blob: Option<&[u8]>) -> Result<(), LoadError> {
        for (index, buffer) in self.document.as_json().buffers.iter().enumerate() {
            let data = match &buffer.uri {
                Some(uri) => self.read_uri("buffer", index, uri)?,
                None => blob
                    .filter(|_| index == 0)
                    .ok_or_else(|| self.error(GltfProblem::NoSource { what: "buffer", index }))?
                    .to_vec(),
            };
            let needed = buffer.byte_length.0;
            if (data.len() as u64) < needed {
                let (what, length) = ("buffer", data.len());
                let problem =
                    GltfProblem::OutOfRange { what, index, begin: 0, end: needed, length };
                return Err(self.error(problem));
            }
            self.buffers.push(data);
        }
        Ok(())
    }

    fn read_uri(&self, what: &'static str, index: usize, uri: &str) -> Result<Vec<u8>, LoadError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let encoded =
                data.split_once(";base64,").map(|(_, encoded)| encoded).ok_or_else(|| {
                    let uri = uri.chars().take(60).collect();
                    self.error(GltfProblem::Uri { what, index, uri })
                })?;
            return base64::engine::general_purpose::STANDARD
                .decode(encoded.trim())
                .map_err(|source| self.error(GltfProblem::Base64 { what, index, source }));
        }
        if uri.contains("://") {
            let uri = uri.chars().take(60).collect();
            return Err(self.error(GltfProblem::Uri { what, index, uri }));
        }
        let referrer = format!("{}, {what} {index},", self.path.display());
        read_referenced(&relative(self.path, &percent_decoded(uri)), &referrer, self.budget)
    }

    /// The bytes of a buffer view.
    fn view(&self, index: usize) -> Result<&[u8], GltfProblem> {
        let view = &self.document.as_json().buffer_views[index];
        let begin = view.byte_offset.map_or(0, |o| o.0);
        let buffer = &self.buffers[view.buffer.value()];
        slice(buffer, begin, view.byte_length.0, "buffer view", index)
    }

    fn node(&mut self, node: &gltf::Node<'a>, parent: Mat4, depth: usize) -> Result<(), LoadError> {
        let again = std::mem::replace(&mut self.visited[node.index()], true);
        if again || depth > MAX_DEPTH {
            let problem = GltfProblem::NotATree { node: node.index(), limit: MAX_DEPTH };
            return Err(self.error(problem));
        }
        let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            self.mesh(&mesh, world)?;
        }
        if self.camera.is_none()
            && let Some(index) = self.document.as_json().nodes[node.index()].camera
        {
            self.camera = camera(&self.document.as_json().cameras[index.value()], &world);
        }
        for child in node.children() {
            self.node(&child, world, depth + 1)?;
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: &gltf::Mesh<'a>, world: Mat4) -> Result<(), LoadError> {
        for primitive in mesh.primitives() {
            if !matches!(
                primitive.mode(),
                Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
            ) {
                self.warn("points and lines are not rendered");
                continue;
            }
            self.take_memory(mesh.index(), &primitive)?;
            let (surface, uv_set) = self.surface(&primitive.material())?;
            let mut geometry = self
                .geometry(mesh.index(), &primitive, uv_set)
                .map_err(|problem| self.error(problem))?;
            geometry.transform(&world);
            let name = mesh.name().map_or_else(|| format!("mesh {}", mesh.index()), Into::into);
            self.parts.push(Part { name, mesh: geometry, surface });
        }
        Ok(())
    }

    /// What a mesh takes by the counts of its accessors, for each of the nodes that show it.
    fn take_memory(&self, mesh: usize, primitive: &gltf::Primitive<'a>) -> Result<(), LoadError> {
        // Values are read as four floats, and kept as two to four.
        const VALUE: u64 = 16 + 16;
        // An index, and a triangle for each in a strip.
        const INDEX: u64 = 4 + 12;
        let values: u64 = primitive.attributes().map(|(_, a)| a.count() as u64 * VALUE).sum();
        let vertices = primitive.get(&Semantic::Positions).map_or(0, |a| a.count());
        let indices = primitive.indices().map_or(vertices, |a| a.count()) as u64;
        let bytes = values.saturating_add(indices.saturating_mul(INDEX));
        self.budget.take(&format!("{}, mesh {mesh}", self.path.display()), bytes)
    }

    fn geometry(
        &self,
        mesh: usize,
        primitive: &gltf::Primitive<'a>,
        uv_set: u32,
    ) -> Result<Mesh, GltfProblem> {
        let attribute = |semantic: &Semantic, dimensions: &[Dimensions], needed| {
            primitive.get(semantic).map_or(Ok(Vec::new()), |a| {
                self.floats(&a, dimensions, needed, &format!("{semantic:?}"))
            })
        };
        let positions = attribute(&Semantic::Positions, &[Dimensions::Vec3], "VEC3")?;
        let normals = attribute(&Semantic::Normals, &[Dimensions::Vec3], "VEC3")?;
        let tangents = attribute(&Semantic::Tangents, &[Dimensions::Vec4], "VEC4")?;
        let uvs = attribute(&Semantic::TexCoords(uv_set), &[Dimensions::Vec2], "VEC2")?;
        let colors = [Dimensions::Vec3, Dimensions::Vec4];
        let colors = attribute(&Semantic::Colors(0), &colors, "VEC3 or VEC4")?;
        let vertices = positions.len();
        let primitive_index = primitive.index();
        if vertices == 0 {
            return Err(GltfProblem::NoPositions { mesh, primitive: primitive_index });
        }
        let counts = [
            ("normals", &normals),
            ("tangents", &tangents),
            ("texture coordinates", &uvs),
            ("colors", &colors),
        ];
        for (attribute, values) in counts {
            if !values.is_empty() && values.len() != vertices {
                let (primitive, count) = (primitive_index, values.len());
                return Err(GltfProblem::Count { mesh, primitive, attribute, count, vertices });
            }
        }
        let indices = match primitive.indices() {
            Some(accessor) => self.indices(&accessor)?,
            None => (0..vertices as u32).collect(),
        };
        if let Some(&index) = indices.iter().find(|&&i| i as usize >= vertices) {
            return Err(GltfProblem::Index { mesh, primitive: primitive_index, index, vertices });
        }
        Ok(Mesh {
            positions: positions.iter().map(|p| Vec3::new(p[0], p[1], p[2])).collect(),
            normals: normals.iter().map(|n| Vec3::new(n[0], n[1], n[2])).collect(),
            uvs: uvs.iter().map(|t| Vec2::new(t[0], t[1])).collect(),
            tangents: tangents.iter().map(|&t| Vec4::from_array(t)).collect(),
            colors: colors.iter().map(|c| Rgb::new(c[0], c[1], c[2])).collect(),
            triangles: triangles(&indices, primitive.mode()),
        })
    }

    /// The values of an accessor as numbers, normalised integers in \[0, 1\] or \[−1, 1\]; missing
    /// components are 0.
    fn floats(
        &self,
        accessor: &gltf::Accessor<'a>,
        dimensions: &[Dimensions],
        needed: &'static str,
        used_for: &str,
    ) -> Result<Vec<[f32; 4]>, GltfProblem> {
        if !dimensions.contains(&accessor.dimensions()) {
            let found = format!("{:?}", accessor.dimensions());
            let (index, used_for) = (accessor.index(), used_for.into());
            return Err(GltfProblem::AccessorType { index, found, needed, used_for });
        }
        let n = accessor.dimensions().multiplicity();
        let (size, kind) = (accessor.data_type().size(), accessor.data_type());
        let component = |bytes: &[u8]| float(bytes, kind, accessor.normalized());
        self.values(accessor, |bytes| {
            let mut value = [0.0; 4];
            for i in 0..n {
                value[i] = component(&bytes[i * size..]);
            }
            value
        })
    }

    fn indices(&self, accessor: &gltf::Accessor<'a>) -> Result<Vec<u32>, GltfProblem> {
        let integer = matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
        if accessor.dimensions() != Dimensions::Scalar || !integer {
            let found = format!("{:?} of {:?}", accessor.dimensions(), accessor.data_type());
            let (index, used_for) = (accessor.index(), "indices".into());
            let needed = "SCALAR of unsigned integers";
            return Err(GltfProblem::AccessorType { index, found, needed, used_for });
        }
        let size = accessor.data_type().size();
        self.values(accessor, |bytes| unsigned(&bytes[..size]))
    }

    /// Every value of an accessor, decoded from its bytes; sparse ones replaced.
    fn values<T: Clone>(
        &self,
        accessor: &gltf::Accessor<'a>,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, GltfProblem> {
        let (index, count, size) = (accessor.index(), accessor.count(), accessor.size());
        let mut values = match accessor.view() {
            Some(view) => {
                let stride = view.stride().unwrap_or(size);
                let bytes = self.view(view.index())?;
                strided(bytes, accessor.offset(), stride, size, count, ("accessor", index))?
                    .map(&decode)
                    .collect()
            }
            // Zeros by the format; bounded in all the file, for nothing in it backs them.
            None if accessor.sparse().is_some() && count <= self.zeros_left.get() => {
                self.zeros_left.update(|left| left - count);
                vec![decode(&vec![0; size]); count]
            }
            None => return Err(GltfProblem::NoData { index, count }),
        };
        if let Some(sparse) = accessor.sparse() {
            let (at, new, n) = (sparse.indices(), sparse.values(), sparse.count());
            let width = at.index_type().size();
            let (at_view, new_view) =
                (self.view(at.view().index())?, self.view(new.view().index())?);
            let what = ("sparse accessor", index);
            let places = strided(at_view, at.offset(), width, width, n, what)?.map(unsigned);
            let replacements = strided(new_view, new.offset(), size, size, n, what)?;
            for (place, bytes) in places.zip(replacements) {
                let length = values.len();
                let slot = values.get_mut(place as usize).ok_or(GltfProblem::OutOfRange {
                    what: "sparse accessor",
                    index,
                    begin: place.into(),
                    end: u64::from(place) + 1,
                    length,
                })?;
                *slot = decode(bytes);
            }
        }
        Ok(values)
    }

    /// The surface of a material, and the set of texture coordinates that it uses.
    fn surface(&mut self, material: &gltf::Material<'a>) -> Result<(usize, u32), LoadError> {
        if let Some(&known) = self.surface_of.get(&material.index()) {
            return Ok(known);
        }
        let name = material.name().unwrap_or("unnamed").to_owned();
        if material.emissive_factor() != [0.0; 3] {
            self.warn("emission is ignored");
        }
        if material.alpha_mode() != gltf::material::AlphaMode::Opaque {
            self.warn(&format!("material '{name}' is rendered as opaque"));
        }
        let pbr = material.pbr_metallic_roughness();
        let mut uv_set = None;
        let base_color_texture = match pbr.base_color_texture() {
            Some(info) => self.info(&info, Encoding::Srgb, &name, &mut uv_set)?,
            None => None,
        };
        let metallic_roughness_texture = match pbr.metallic_roughness_texture() {
            Some(info) => self.info(&info, Encoding::Linear, &name, &mut uv_set)?,
            None => None,
        };
        let normal_map = match material.normal_texture() {
            Some(n) => {
                let (texture, set) = (n.texture(), n.tex_coord());
                let transform = UvTransform::IDENTITY;
                self.texture(&texture, set, transform, Encoding::Linear, &name, &mut uv_set)?
                    .map(|texture| NormalMap { texture, scale: n.scale() })
            }
            None => None,
        };
        let [r, g, b, _] = pbr.base_color_factor();
        let model = SurfaceModel::MetallicRoughness(MetallicRoughnessSurface {
            base_color: Rgb::new(r, g, b),
            base_color_texture,
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            metallic_roughness_texture,
        });
        self.surfaces.push(Surface { name, model, normal_map });
        let result = (self.surfaces.len() - 1, uv_set.unwrap_or(0));
        self.surface_of.insert(material.index(), result);
        Ok(result)
    }

    fn info(
        &mut self,
        info: &gltf::texture::Info<'a>,
        encoding: Encoding,
        material: &str,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<TextureRef>, LoadError> {
        let transform = info.texture_transform();
        let set = transform
            .as_ref()
            .and_then(gltf::texture::TextureTransform::tex_coord)
            .unwrap_or(info.tex_coord());
        let transform = transform.map_or(UvTransform::IDENTITY, |t| {
            UvTransform::new(t.offset().into(), t.rotation(), t.scale().into())
        });
        self.texture(&info.texture(), set, transform, encoding, material, uv_set)
    }

    /// A use of a texture; `None`, with a warning, if its coordinates are not the material's first.
    fn texture(
        &mut self,
        texture: &gltf::Texture<'a>,
        set: u32,
        transform: UvTransform,
        encoding: Encoding,
        material: &str,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<TextureRef>, LoadError> {
        if *uv_set.get_or_insert(set) != set {
            self.warn(&format!(
                "material '{material}' uses two sets of texture coordinates; the second's textures are ignored"
            ));
            return Ok(None);
        }
        let image = self.document.as_json().textures[texture.index()].source.value();
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::Repeat => Wrap::Repeat,
        });
        let texture = self.image(image, encoding, material)?;
        Ok(Some(TextureRef { texture, wrap, transform }))
    }

    fn image(
        &mut self,
        index: usize,
        encoding: Encoding,
        material: &str,
    ) -> Result<usize, LoadError> {
        if let Some(&known) = self.images.get(&(index, encoding)) {
            return Ok(known);
        }
        let referrer = format!("{}, material '{material}',", self.path.display());
        let image = &self.document.as_json().images[index];
        let texture = match (&image.uri, image.buffer_view) {
            (Some(uri), _) if !uri.starts_with("data:") && !uri.contains("://") => {
                let path = relative(self.path, &percent_decoded(uri));
                self.textures.file(&path, encoding, &referrer)?
            }
            (Some(uri), _) => {
                let bytes = self.read_uri("image", index, uri)?;
                self.textures.bytes(&format!("image {index}"), &bytes, encoding, &referrer)?
            }
            (None, Some(view)) => {
                let bytes = self.view(view.value()).map_err(|p| self.error(p))?.to_vec();
                self.textures.bytes(&format!("image {index}"), &bytes, encoding, &referrer)?
            }
            (None, None) => {
                return Err(self.error(GltfProblem::NoSource { what: "image", index }));
            }
        };
        self.images.insert((index, encoding), texture);
        Ok(texture)
    }
}

/// A glTF camera looks along −Z of its node, +Y up.
fn camera(camera: &json::Camera, world: &Mat4) -> Option<CameraSettings> {
    let projection = if let Some(p) = &camera.perspective {
        Projection::Perspective { fov_y_degrees: p.yfov.to_degrees() }
    } else {
        Projection::Orthographic { height: 2.0 * camera.orthographic.as_ref()?.ymag }
    };
    let origin = world.transform_point3(Vec3::ZERO);
    let forward = world.transform_vector3(Vec3::NEG_Z);
    let up = world.transform_vector3(Vec3::Y);
    Some(CameraSettings { projection, origin, target: origin + forward, up })
}

fn triangles(indices: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        Mode::TriangleFan => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [w[0], w[1], indices[0]])
            .collect(),
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// `length` bytes from `begin`.
fn slice<'b>(
    bytes: &'b [u8],
    begin: u64,
    length: u64,
    what: &'static str,
    index: usize,
) -> Result<&'b [u8], GltfProblem> {
    let end = begin.saturating_add(length);
    let range = usize::try_from(begin).ok().zip(usize::try_from(end).ok());
    range.and_then(|(begin, end)| bytes.get(begin..end)).ok_or(GltfProblem::OutOfRange {
        what,
        index,
        begin,
        end,
        length: bytes.len(),
    })
}

/// `count` values of `size` bytes, each `stride` bytes after the other.
fn strided<'b>(
    bytes: &'b [u8],
    offset: usize,
    stride: usize,
    size: usize,
    count: usize,
    (what, index): (&'static str, usize),
) -> Result<impl Iterator<Item = &'b [u8]>, GltfProblem> {
    let stride = stride.max(size);
    let length = (count as u64)
        .saturating_sub(1)
        .saturating_mul(stride as u64)
        .saturating_add(if count == 0 { 0 } else { size as u64 });
    let data = slice(bytes, offset as u64, length, what, index)?;
    Ok(data.chunks(stride).take(count).map(move |chunk| &chunk[..size]))
}

fn float(bytes: &[u8], kind: DataType, normalized: bool) -> f32 {
    let (value, max) = match kind {
        DataType::I8 => (f32::from(bytes[0] as i8), 127.0),
        DataType::U8 => (f32::from(bytes[0]), 255.0),
        DataType::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        DataType::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        DataType::U32 => (unsigned(&bytes[..4]) as f32, u32::MAX as f32),
        DataType::F32 => (f32::from_bits(unsigned(&bytes[..4])), 1.0),
    };
    if normalized && kind != DataType::F32 { (value / max).max(-1.0) } else { value }
}

/// An unsigned little-endian integer of up to four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &b| value << 8 | u32::from(b))
}

/// A URI's path with `%20` and the like decoded; what is not valid stays.
fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let code = uri.get(i + 1..i + 3).filter(|_| bytes[i] == b'%');
        if let Some(byte) = code.and_then(|c| u8::from_str_radix(c, 16).ok()) {
            out.push(byte);
            i += 3;
        } else {
            out.push(bytes[i]);
            i += 1;
        }
    }
    String::from_utf8(out).unwrap_or_else(|_| uri.into())
}
