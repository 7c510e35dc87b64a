//! The document, parsed on demand.
//!
//! Arrays are kept as text, and their items are parsed when something refers to them. So a broken item that nothing
//! uses does not end the load, and errors name the broken item that matters.

// Fields are named as in the format.
#![allow(clippy::struct_field_names)]

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use serde_json::value::RawValue;

use super::error::GltfErrorKind;
use super::meshopt::Compression;

/// An array; empty where an exporter wrote `null`.
fn array<'de, D, T>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Option::deserialize(deserializer).map(Option::unwrap_or_default)
}

/// Removes members that are `null`, which some exporters write for members that are not there.
fn remove_nulls(value: &mut Value) {
    match value {
        Value::Object(members) => {
            members.retain(|_, member| !member.is_null());
            members.values_mut().for_each(remove_nulls);
        }
        Value::Array(items) => items.iter_mut().for_each(remove_nulls),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// Parses an item, again without its `null` members if they are in the way.
fn parse<T: DeserializeOwned>(text: &str) -> Result<T, serde_json::Error> {
    serde_json::from_str(text).or_else(|error| {
        let Ok(mut value) = serde_json::from_str(text) else { return Err(error) };
        remove_nulls(&mut value);
        T::deserialize(value).map_err(|_| error)
    })
}

/// The top level of the document.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Document<'a> {
    #[serde(borrow)]
    asset: Option<&'a RawValue>,
    #[serde(deserialize_with = "array")]
    pub(super) extensions_used: Vec<String>,
    #[serde(deserialize_with = "array")]
    pub(super) extensions_required: Vec<String>,
    pub(super) scene: Option<usize>,
    #[serde(borrow)]
    extensions: Option<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    accessors: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    animations: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    buffers: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    buffer_views: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    cameras: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    images: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    materials: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    meshes: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    nodes: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    samplers: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    scenes: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    skins: Vec<&'a RawValue>,
    #[serde(borrow, deserialize_with = "array")]
    textures: Vec<&'a RawValue>,
}

/// What extensions say of the whole document.
#[derive(Deserialize)]
struct DocumentExtensions {
    #[serde(rename = "CESIUM_RTC")]
    rtc: Option<RelativeToCenter>,
}

#[derive(Deserialize)]
struct RelativeToCenter {
    center: [f64; 3],
}

/// The parts of the document that identify the version.
#[derive(Deserialize)]
struct Header<'a> {
    #[serde(borrow)]
    asset: Option<&'a RawValue>,
    #[serde(borrow)]
    meshes: Option<&'a RawValue>,
    #[serde(borrow)]
    nodes: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: Option<Value>,
    min_version: Option<Value>,
}

impl<'a> Document<'a> {
    /// Parses a document's top level.
    pub(super) fn new(json: &'a [u8]) -> Result<Self, GltfErrorKind> {
        let invalid = |source| GltfErrorKind::Json { place: "the JSON".into(), source };
        check_version(&serde_json::from_slice(json).map_err(invalid)?)?;
        serde_json::from_slice(json).map_err(invalid)
    }

    /// The item at an index.
    pub(super) fn get<T: Item>(&self, index: usize) -> Result<T, GltfErrorKind> {
        let items = T::items(self);
        let text = items.get(index).ok_or_else(|| {
            let (what, count) = (T::NAME, items.len());
            GltfErrorKind::NoSuch { what, index, count }
        })?;
        parse(text.get()).map_err(|source| {
            let place = format!("{} {index}", T::NAME);
            GltfErrorKind::Json { place, source }
        })
    }

    /// The point that `CESIUM_RTC` adds to all positions, if the file has that extension.
    pub(super) fn rtc_center(&self) -> Result<Option<[f64; 3]>, GltfErrorKind> {
        let Some(text) = self.extensions else { return Ok(None) };
        let extensions: DocumentExtensions = serde_json::from_str(text.get())
            .map_err(|source| GltfErrorKind::Json { place: "CESIUM_RTC".into(), source })?;
        Ok(extensions.rtc.map(|rtc| rtc.center))
    }

    /// The number of items.
    pub(super) fn count<T: Item>(&self) -> usize {
        T::items(self).len()
    }
}

/// Refuses versions other than 2; in version 1, arrays were objects.
fn check_version(header: &Header<'_>) -> Result<(), GltfErrorKind> {
    let is_object = |raw: Option<&RawValue>| raw.is_some_and(|raw| raw.get().starts_with('{'));
    if is_object(header.meshes) || is_object(header.nodes) {
        return Err(GltfErrorKind::Version1);
    }
    let asset = header.asset.and_then(|raw| serde_json::from_str::<Asset>(raw.get()).ok());
    let Some(Asset { version, min_version }) = asset else { return Ok(()) };
    // A later version may declare that version 2 suffices. Accept numbers instead of strings.
    let text = |value: Value| match value {
        Value::String(text) => text,
        other => other.to_string(),
    };
    match min_version.or(version).map(text) {
        Some(version) if version.starts_with('1') => Err(GltfErrorKind::Version1),
        Some(version) if !version.starts_with('2') => Err(GltfErrorKind::Version { version }),
        _ => Ok(()),
    }
}

/// An item of one of the document's arrays.
pub(super) trait Item: DeserializeOwned {
    /// The item's name in messages.
    const NAME: &'static str;

    /// The array of the items.
    fn items<'d>(document: &'d Document<'_>) -> &'d [&'d RawValue];
}

macro_rules! items {
    ($($field:ident: $item:ident = $name:literal),*) => {$(
        impl Item for $item {
            const NAME: &'static str = $name;

            fn items<'d>(document: &'d Document<'_>) -> &'d [&'d RawValue] {
                &document.$field
            }
        }
    )*};
}

items! {
    accessors: Accessor = "accessor",
    animations: Animation = "animation",
    buffers: Buffer = "buffer",
    buffer_views: BufferView = "buffer view",
    cameras: Camera = "camera",
    images: Image = "image",
    materials: Material = "material",
    meshes: Mesh = "mesh",
    nodes: Node = "node",
    samplers: Sampler = "sampler",
    scenes: Scene = "scene",
    skins: Skin = "skin",
    textures: Texture = "texture"
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
    #[serde(default)]
    min: Value,
    #[serde(default)]
    max: Value,
}

impl Accessor {
    /// The smallest and the largest value of each of three components, as the file gives them, if it does.
    pub(super) fn range(&self) -> Option<[[f64; 3]; 2]> {
        let numbers = |value: &Value| {
            let [x, y, z] = value.as_array()?.as_slice() else { return None };
            Some([x.as_f64()?, y.as_f64()?, z.as_f64()?])
        };
        Some([numbers(&self.min)?, numbers(&self.max)?])
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparseData,
    pub(super) values: SparseData,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseData {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    /// The component type of sparse indices; sparse values have the type of their accessor.
    pub(super) component_type: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    #[serde(default)]
    pub(super) byte_length: u64,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<usize>,
    #[serde(default)]
    pub(super) extensions: BufferViewExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct BufferViewExtensions {
    #[serde(rename = "KHR_meshopt_compression")]
    khr_meshopt: Option<Compression>,
    #[serde(rename = "EXT_meshopt_compression")]
    ext_meshopt: Option<Compression>,
}

impl BufferViewExtensions {
    pub(super) fn compression(&self) -> Option<&Compression> {
        self.khr_meshopt.as_ref().or(self.ext_meshopt.as_ref())
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    pub(super) name: String,
    #[serde(default)]
    pub(super) nodes: Vec<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) children: Vec<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f32; 4]>,
    pub(super) scale: Option<[f32; 3]>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    pub(super) camera: Option<usize>,
    pub(super) weights: Option<Vec<f32>>,
    pub(super) extensions: NodeExtensions,
    pub(super) extras: NodeExtras,
}

/// What authors write on nodes for us. Extras may be anything.
#[derive(Debug, Default)]
pub(super) struct NodeExtras {
    /// Whether the node's mesh is a rectangle through which light enters.
    pub(super) portal: bool,
}

impl<'de> Deserialize<'de> for NodeExtras {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let extras = Value::deserialize(deserializer)?;
        let portal = match extras.get("portal") {
            Some(Value::Bool(portal)) => *portal,
            // Blender writes custom properties as numbers.
            Some(Value::Number(number)) => number.as_f64() != Some(0.0),
            _ => false,
        };
        Ok(Self { portal })
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    pub(super) visibility: Option<Visibility>,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct Instancing {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Visibility {
    #[serde(default = "yes")]
    pub(super) visible: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    #[serde(default)]
    pub(super) name: String,
    #[serde(default)]
    pub(super) primitives: Vec<Primitive>,
    pub(super) weights: Option<Vec<f32>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    #[serde(default = "triangles")]
    pub(super) mode: u32,
    #[serde(default)]
    pub(super) targets: Vec<BTreeMap<String, usize>>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

#[derive(Debug, Default, Deserialize)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(super) draco: Option<Draco>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub(super) buffer_view: usize,
    /// Draco's attribute ids.
    #[serde(default)]
    pub(super) attributes: BTreeMap<String, u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub(super) inverse_bind_matrices: Option<usize>,
    pub(super) joints: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    pub(super) name: String,
    #[serde(default)]
    pub(super) channels: Vec<Channel>,
    #[serde(default)]
    pub(super) samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Channel {
    pub(super) sampler: usize,
    pub(super) target: ChannelTarget,
}

#[derive(Debug, Deserialize)]
pub(super) struct ChannelTarget {
    pub(super) node: Option<usize>,
    pub(super) path: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct AnimationSampler {
    pub(super) input: usize,
    pub(super) output: usize,
    #[serde(default)]
    pub(super) interpolation: Interpolation,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Interpolation {
    #[default]
    Linear,
    Step,
    CubicSpline,
}

#[derive(Debug, Deserialize)]
pub(super) struct Camera {
    #[serde(default)]
    pub(super) name: String,
    pub(super) perspective: Option<Perspective>,
    pub(super) orthographic: Option<Orthographic>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Perspective {
    pub(super) yfov: f32,
}

#[derive(Debug, Deserialize)]
pub(super) struct Orthographic {
    pub(super) ymag: f32,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Image {
    pub(super) uri: Option<String>,
    pub(super) buffer_view: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct Texture {
    pub(super) sampler: Option<usize>,
    pub(super) source: Option<usize>,
    pub(super) extensions: TextureExtensions,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct TextureExtensions {
    #[serde(rename = "KHR_texture_basisu")]
    pub(super) basisu: Option<TextureSource>,
    #[serde(rename = "EXT_texture_webp")]
    pub(super) webp: Option<TextureSource>,
    #[serde(rename = "EXT_texture_avif")]
    pub(super) avif: Option<TextureSource>,
}

#[derive(Debug, Deserialize)]
pub(super) struct TextureSource {
    pub(super) source: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sampler {
    pub(super) mag_filter: Option<u32>,
    pub(super) wrap_s: Option<u32>,
    pub(super) wrap_t: Option<u32>,
}

/// A use of a texture, with the extra fields of normal and occlusion maps.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureInfo {
    pub(super) index: usize,
    #[serde(default)]
    pub(super) tex_coord: u32,
    /// The factor on a normal map's x and y.
    #[serde(default = "one")]
    pub(super) scale: f32,
    #[serde(default)]
    pub(super) extensions: TextureInfoExtensions,
}

#[derive(Clone, Debug, Default, Deserialize)]
pub(super) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(super) transform: Option<TextureTransform>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureTransform {
    #[serde(default)]
    pub(super) offset: [f32; 2],
    #[serde(default)]
    pub(super) rotation: f32,
    #[serde(default = "one_by_one")]
    pub(super) scale: [f32; 2],
    pub(super) tex_coord: Option<u32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) name: String,
    pub(super) pbr_metallic_roughness: MetallicRoughness,
    pub(super) normal_texture: Option<TextureInfo>,
    pub(super) emissive_texture: Option<TextureInfo>,
    pub(super) emissive_factor: [f32; 3],
    pub(super) alpha_mode: AlphaMode,
    pub(super) alpha_cutoff: Option<f32>,
    pub(super) double_sided: bool,
    pub(super) extensions: MaterialExtensions,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum AlphaMode {
    #[default]
    Opaque,
    Mask,
    Blend,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct MetallicRoughness {
    pub(super) base_color_factor: [f32; 4],
    pub(super) base_color_texture: Option<TextureInfo>,
    pub(super) metallic_factor: f32,
    pub(super) roughness_factor: f32,
    pub(super) metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(super) emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_unlit")]
    pub(super) unlit: Option<Unlit>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(super) specular_glossiness: Option<SpecularGlossiness>,
    #[serde(rename = "KHR_materials_ior")]
    pub(super) ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub(super) specular: Option<Specular>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub(super) clearcoat: Option<Clearcoat>,
    #[serde(rename = "KHR_materials_sheen")]
    pub(super) sheen: Option<Sheen>,
    #[serde(rename = "KHR_materials_anisotropy")]
    pub(super) anisotropy: Option<Anisotropy>,
    #[serde(rename = "KHR_materials_transmission")]
    pub(super) transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_volume")]
    pub(super) volume: Option<Volume>,
    #[serde(rename = "KHR_materials_iridescence")]
    iridescence: Option<Iridescence>,
    #[serde(rename = "KHR_materials_dispersion")]
    dispersion: Option<Dispersion>,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    diffuse_transmission: Option<DiffuseTransmission>,
}

impl MaterialExtensions {
    /// The extensions that change the material but are not drawn.
    pub(super) fn left_out(&self) -> impl Iterator<Item = &'static str> {
        let Self { iridescence, dispersion, diffuse_transmission, .. } = self;
        let film = iridescence.as_ref().map(|i| i.iridescence_factor);
        let spread = dispersion.as_ref().map(|d| d.dispersion);
        let through = diffuse_transmission.as_ref().map(|d| d.diffuse_transmission_factor);
        // A factor of zero disables an extension.
        [
            (film, "KHR_materials_iridescence"),
            (spread, "KHR_materials_dispersion"),
            (through, "KHR_materials_diffuse_transmission"),
        ]
        .into_iter()
        .filter_map(|(factor, name)| factor.is_some_and(|factor| factor > 0.0).then_some(name))
    }
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct EmissiveStrength {
    #[serde(default = "one")]
    pub(super) emissive_strength: f32,
}

#[derive(Debug, Deserialize)]
pub(super) struct Unlit {}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    #[serde(default = "opaque_white")]
    pub(super) diffuse_factor: [f32; 4],
    pub(super) diffuse_texture: Option<TextureInfo>,
    #[serde(default = "white")]
    pub(super) specular_factor: [f32; 3],
    #[serde(default = "one")]
    pub(super) glossiness_factor: f32,
    pub(super) specular_glossiness_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Ior {
    pub(super) ior: Option<f32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Specular {
    #[serde(default = "one")]
    pub(super) specular_factor: f32,
    pub(super) specular_texture: Option<TextureInfo>,
    #[serde(default = "white")]
    pub(super) specular_color_factor: [f32; 3],
    pub(super) specular_color_texture: Option<TextureInfo>,
}

impl Specular {
    /// Whether it differs from the defaults, which many exporters write.
    pub(super) fn changes_anything(&self) -> bool {
        let Self {
            specular_factor,
            specular_texture,
            specular_color_factor,
            specular_color_texture,
        } = self;
        *specular_factor != 1.0
            || *specular_color_factor != [1.0; 3]
            || specular_texture.is_some()
            || specular_color_texture.is_some()
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Clearcoat {
    pub(super) clearcoat_factor: f32,
    pub(super) clearcoat_texture: Option<TextureInfo>,
    pub(super) clearcoat_roughness_factor: f32,
    pub(super) clearcoat_roughness_texture: Option<TextureInfo>,
    pub(super) clearcoat_normal_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Sheen {
    pub(super) sheen_color_factor: [f32; 3],
    pub(super) sheen_color_texture: Option<TextureInfo>,
    pub(super) sheen_roughness_factor: f32,
    pub(super) sheen_roughness_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Anisotropy {
    pub(super) anisotropy_strength: f32,
    pub(super) anisotropy_rotation: f32,
    pub(super) anisotropy_texture: Option<TextureInfo>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Transmission {
    pub(super) transmission_factor: f32,
    pub(super) transmission_texture: Option<TextureInfo>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Volume {
    #[serde(default)]
    pub(super) thickness_factor: f32,
    pub(super) thickness_texture: Option<TextureInfo>,
    pub(super) attenuation_distance: Option<f32>,
    #[serde(default = "white")]
    pub(super) attenuation_color: [f32; 3],
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Iridescence {
    iridescence_factor: f32,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Dispersion {
    dispersion: f32,
}

#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct DiffuseTransmission {
    diffuse_transmission_factor: f32,
}

fn yes() -> bool {
    true
}

fn triangles() -> u32 {
    4
}

fn one() -> f32 {
    1.0
}

fn one_by_one() -> [f32; 2] {
    [1.0; 2]
}

fn white() -> [f32; 3] {
    [1.0; 3]
}

fn opaque_white() -> [f32; 4] {
    [1.0; 4]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_items_matter_when_they_are_used() {
        let json = br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":"cube"},{"mesh":3}]}"#;
        let document = Document::new(json).unwrap();
        assert_eq!(document.get::<Node>(1).unwrap().mesh, Some(3));
        let error = document.get::<Node>(0).unwrap_err().to_string();
        assert!(error.contains("node 0"), "{error}");
        let error = document.get::<Node>(2).unwrap_err().to_string();
        assert!(error.contains("node 2") && error.contains("only 2"), "{error}");
    }

    /// In the document, its items and their extensions; not as an item of an array.
    #[test]
    fn null_is_what_is_not_there() {
        let json = br#"{"asset":{"version":"2.0"},"scene":null,"skins":null,"extensionsUsed":null,
            "nodes":[{"name":null,"mesh":null,"children":null,"extensions":null,"translation":[1,2,3]}],
            "materials":[{"alphaMode":null,"doubleSided":null,"pbrMetallicRoughness":{"metallicFactor":null,
                "roughnessFactor":0.5},"extensions":{"KHR_materials_sheen":{"sheenRoughnessFactor":null}}}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":null},"mode":null},null]}]}"#;
        let document = Document::new(json).unwrap();
        assert!(document.scene.is_none() && document.count::<Skin>() == 0);
        let node: Node = document.get(0).unwrap();
        assert!(node.children.is_empty() && node.translation == Some([1.0, 2.0, 3.0]));
        let material: Material = document.get(0).unwrap();
        let base = material.pbr_metallic_roughness;
        assert_eq!((base.metallic_factor, base.roughness_factor), (1.0, 0.5));
        assert!(material.alpha_mode == AlphaMode::Opaque && material.extensions.sheen.is_some());
        let error = document.get::<Mesh>(0).unwrap_err().to_string();
        assert!(error.contains("mesh 0") && error.contains("null"), "{error}");
    }

    #[test]
    fn versions_are_told_apart() {
        let error = |json: &str| match Document::new(json.as_bytes()) {
            Ok(_) => "none".to_owned(),
            Err(e) => e.to_string(),
        };
        assert_eq!(error(r#"{"asset":{"version":"2.0"}}"#), "none");
        assert_eq!(error(r#"{"asset":{"version":2}}"#), "none");
        assert_eq!(error(r#"{"asset":{"version":"2.1","minVersion":"2.0"}}"#), "none");
        assert_eq!(error("{}"), "none");
        assert!(error(r#"{"asset":{"version":"1.0"}}"#).contains("1.0"));
        assert!(error(r#"{"meshes":{"a":{}}}"#).contains("gltf-pipeline"));
        assert!(error(r#"{"asset":{"version":"3.0"}}"#).contains("glTF 3.0"));
        assert!(error("{").contains("the JSON is not valid"));
        assert!(error("[1]").contains("the JSON is not valid"));
    }
}
