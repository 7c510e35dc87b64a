//! Materials, including their extensions.

use std::collections::{BTreeMap, HashMap};

use super::error::Failure;
use super::image::{ALPHA, COLOR, COLOR_AND_ALPHA, Channels, Images, LINEAR};
use super::json;
use super::source::Source;
use crate::Rgb;
use crate::scene::load::textures::Textures;
use crate::scene::{
    AlphaMode, Anisotropy, Clearcoat, ColorFactor, Coverage, Emission, Factor, Layers, Material,
    MaterialModel, MetallicRoughnessMaterial, NormalMap, Sheen, Specular,
    SpecularGlossinessMaterial, Texture, TextureRef, UvTransform, Volume,
};

/// A primitive's material: its index, and the vertex attributes that it uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slot {
    /// The index of the material.
    pub(super) material: usize,
    /// The file's texture coordinate sets that become the mesh's first and second sets; `None` if unused.
    pub(super) uv_sets: [Option<u32>; 2],
    /// Which of the two sets defines the tangents, and the transform to the image that they follow, if tangents are
    /// needed.
    pub(super) tangent_uvs: Option<(usize, UvTransform)>,
    /// Whether vertex opacity is used.
    pub(super) alpha: bool,
    /// Whether light passes through.
    pub(super) transmits: bool,
}

/// The materials in use.
pub(super) struct Materials<'a> {
    images: Images<'a>,
    loaded: Vec<Material>,
    slots: HashMap<Option<usize>, Slot>,
    /// The extensions that are not drawn, with the names of the materials that have them.
    left_out: BTreeMap<&'static str, Vec<String>>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(source: &Source<'a>) -> Self {
        let images = Images::new(Textures::new(source.budget));
        Self { images, loaded: Vec::new(), slots: HashMap::new(), left_out: BTreeMap::new() }
    }

    /// The slot of a material, or of the default material.
    pub(super) fn slot(
        &mut self,
        source: &Source<'_>,
        index: Option<usize>,
    ) -> Result<Slot, Failure> {
        if let Some(&slot) = self.slots.get(&index) {
            return Ok(slot);
        }
        let material: json::Material = match index {
            Some(index) => source.document.get(index)?,
            None => json::Material::default(),
        };
        let name = match (&*material.name, index) {
            ("", Some(index)) => format!("material {index}"),
            ("", None) => "default".into(),
            (name, _) => name.into(),
        };
        for extension in material.extensions.left_out() {
            self.left_out.entry(extension).or_default().push(name.clone());
        }
        let mut reader =
            Reader { source, images: &mut self.images, name: &name, uv_sets: [None; 2] };
        let material = reader.material(&material);
        let uv_sets = reader.uv_sets;
        let material = material.map_err(|e| e.within(|| format!("material '{name}'")))?;
        let follows = material.needs_tangent().then(|| material.tangent_uvs());
        let slot = Slot {
            material: self.loaded.len(),
            uv_sets,
            tangent_uvs: follows,
            alpha: material.coverage.mode != AlphaMode::Opaque,
            transmits: material.transmits(),
        };
        self.loaded.push(material);
        self.slots.insert(index, slot);
        Ok(slot)
    }

    /// Returns all materials and textures, and warns once per feature that is approximated or not drawn.
    pub(super) fn finish(self, mut warn: impl FnMut(&str)) -> (Vec<Material>, Vec<Texture>) {
        let mut approximated: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for material in &self.loaded {
            for feature in material.approximated_features() {
                approximated.entry(feature).or_default().push(&material.name);
            }
        }
        for (feature, names) in approximated {
            let (first, others) = (names[0], and_others(names.len()));
            warn(&format!(
                "{feature} of material '{first}'{others} is approximated: light passes straight through, without refraction"
            ));
        }
        for (extension, names) in &self.left_out {
            let (first, others) = (&names[0], and_others(names.len()));
            warn(&format!("{extension} of material '{first}'{others} is not shown"));
        }
        (self.loaded, self.images.finish(warn))
    }
}

/// That more than one of `count` materials have a feature.
fn and_others(count: usize) -> String {
    if count == 1 { String::new() } else { format!(" and of {} more", count - 1) }
}

/// Reads one material.
struct Reader<'r, 's, 'a> {
    source: &'r Source<'s>,
    images: &'r mut Images<'a>,
    name: &'r str,
    uv_sets: [Option<u32>; 2],
}

impl Reader<'_, '_, '_> {
    fn material(&mut self, material: &json::Material) -> Result<Material, Failure> {
        let extensions = &material.extensions;
        let alpha = material.alpha_mode != json::AlphaMode::Opaque;
        let (model, color_texture, opacity) = match &extensions.specular_glossiness {
            Some(s) => self.specular_glossiness(s, alpha)?,
            None => self.metallic_roughness(&material.pbr_metallic_roughness, alpha)?,
        };
        let normal_map = self.normal_map(material.normal_texture.as_ref())?;
        let has_alpha = |t: &TextureRef| self.images.textures.loaded[t.texture].has_alpha();
        let mode = match material.alpha_mode {
            json::AlphaMode::Opaque => AlphaMode::Opaque,
            json::AlphaMode::Mask => {
                AlphaMode::Mask { cutoff: not_negative(material.alpha_cutoff.unwrap_or(0.5)) }
            }
            json::AlphaMode::Blend => AlphaMode::Blend,
        };
        let coverage = if alpha {
            Coverage { mode, opacity: unit(opacity), texture: color_texture.filter(has_alpha) }
        } else {
            Coverage::default()
        };
        Ok(Material {
            normal_map,
            coverage,
            double_sided: material.double_sided,
            emission: self.emission(material)?,
            unlit: extensions.unlit.is_some(),
            layers: self.layers(extensions)?,
            ..Material::new(self.name, model)
        })
    }

    /// The metallic-roughness model, its color texture and its opacity.
    fn metallic_roughness(
        &mut self,
        m: &json::MetallicRoughness,
        alpha: bool,
    ) -> Result<(MaterialModel, Option<TextureRef>, f32), Failure> {
        let channels = if alpha { COLOR_AND_ALPHA } else { COLOR };
        let base_color_texture = self.texture(m.base_color_texture.as_ref(), channels)?;
        let [r, g, b, opacity] = m.base_color_factor;
        let model = MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
            base_color: Rgb::new(r, g, b),
            base_color_texture,
            metallic: m.metallic_factor,
            roughness: m.roughness_factor,
            metallic_roughness_texture: self
                .texture(m.metallic_roughness_texture.as_ref(), LINEAR)?,
        });
        Ok((model, base_color_texture, opacity))
    }

    fn specular_glossiness(
        &mut self,
        s: &json::SpecularGlossiness,
        alpha: bool,
    ) -> Result<(MaterialModel, Option<TextureRef>, f32), Failure> {
        let channels = if alpha { COLOR_AND_ALPHA } else { COLOR };
        let diffuse_texture = self.texture(s.diffuse_texture.as_ref(), channels)?;
        let [r, g, b, opacity] = s.diffuse_factor;
        let model = MaterialModel::SpecularGlossiness(SpecularGlossinessMaterial {
            diffuse: Rgb::new(r, g, b),
            diffuse_texture,
            specular: Rgb::from(s.specular_factor),
            glossiness: s.glossiness_factor,
            specular_glossiness_texture: self
                .texture(s.specular_glossiness_texture.as_ref(), COLOR_AND_ALPHA)?,
        });
        Ok((model, diffuse_texture, opacity))
    }

    fn emission(&mut self, material: &json::Material) -> Result<Option<Emission>, Failure> {
        let strength = &material.extensions.emissive_strength;
        let strength = strength.as_ref().map_or(1.0, |s| s.emissive_strength);
        let radiance = (Rgb::from(material.emissive_factor) * strength).map(not_negative);
        if radiance.is_black() {
            return Ok(None);
        }
        let texture = self.texture(material.emissive_texture.as_ref(), COLOR)?;
        // Without its map, the whole surface would glow.
        let is_lost = material.emissive_texture.is_some() && texture.is_none();
        Ok((!is_lost).then_some(Emission { radiance, texture }))
    }

    fn layers(&mut self, e: &json::MaterialExtensions) -> Result<Layers, Failure> {
        let mut layers = Layers { ior: e.ior.as_ref().and_then(|i| i.ior), ..Layers::default() };
        layers.ior = layers.ior.map(|ior| if ior >= 1.0 { ior } else { 0.0 });
        if let Some(s) = e.specular.as_ref().filter(|s| s.changes_anything()) {
            layers.specular = Some(Specular {
                strength: self.factor(s.specular_factor, s.specular_texture.as_ref(), ALPHA)?,
                color: ColorFactor {
                    value: Rgb::from(s.specular_color_factor).map(not_negative),
                    texture: self.texture(s.specular_color_texture.as_ref(), COLOR)?,
                },
            });
        }
        // A factor of zero disables the extension.
        if let Some(c) = e.clearcoat.as_ref().filter(|c| c.clearcoat_factor > 0.0) {
            layers.clearcoat = Some(Clearcoat {
                strength: self.factor(c.clearcoat_factor, c.clearcoat_texture.as_ref(), LINEAR)?,
                roughness: self.factor(
                    c.clearcoat_roughness_factor,
                    c.clearcoat_roughness_texture.as_ref(),
                    LINEAR,
                )?,
                normal_map: self.normal_map(c.clearcoat_normal_texture.as_ref())?,
            });
        }
        if let Some(s) = e.sheen.as_ref().filter(|s| s.sheen_color_factor != [0.0; 3]) {
            layers.sheen = Some(Sheen {
                color: ColorFactor {
                    value: Rgb::from(s.sheen_color_factor).map(unit),
                    texture: self.texture(s.sheen_color_texture.as_ref(), COLOR)?,
                },
                roughness: self.factor(
                    s.sheen_roughness_factor,
                    s.sheen_roughness_texture.as_ref(),
                    ALPHA,
                )?,
            });
        }
        if let Some(a) = e.anisotropy.as_ref().filter(|a| a.anisotropy_strength > 0.0) {
            layers.anisotropy = Some(Anisotropy {
                strength: unit(a.anisotropy_strength),
                rotation: if a.anisotropy_rotation.is_finite() {
                    a.anisotropy_rotation
                } else {
                    0.0
                },
                texture: self.texture(a.anisotropy_texture.as_ref(), LINEAR)?,
            });
        }
        if let Some(t) = e.transmission.as_ref().filter(|t| t.transmission_factor > 0.0) {
            let map = t.transmission_texture.as_ref();
            let share = self.factor(t.transmission_factor, map, LINEAR)?;
            // Without its map, the whole surface would be clear.
            let is_lost = map.is_some() && share.texture.is_none();
            layers.transmission = (!is_lost).then_some(share);
        }
        if let Some(v) = e.volume.as_ref().filter(|v| v.thickness_factor > 0.0) {
            let texture = self.texture(v.thickness_texture.as_ref(), LINEAR)?;
            layers.volume = Some(Volume {
                thickness: Factor { value: not_negative(v.thickness_factor), texture },
                attenuation_distance: v
                    .attenuation_distance
                    .filter(|&d| d > 0.0)
                    .unwrap_or(f32::INFINITY),
                attenuation_color: Rgb::from(v.attenuation_color).map(unit),
            });
        }
        Ok(layers)
    }

    fn factor(
        &mut self,
        value: f32,
        texture: Option<&json::TextureInfo>,
        channels: Channels,
    ) -> Result<Factor, Failure> {
        Ok(Factor { value: unit(value), texture: self.texture(texture, channels)? })
    }

    fn normal_map(
        &mut self,
        info: Option<&json::TextureInfo>,
    ) -> Result<Option<NormalMap>, Failure> {
        let scale = info.map_or(1.0, |info| info.scale);
        Ok(self.texture(info, LINEAR)?.map(|texture| NormalMap { texture, scale }))
    }

    /// A use of a texture; `None`, with a warning, if it needs a third texture coordinate set.
    fn texture(
        &mut self,
        info: Option<&json::TextureInfo>,
        channels: Channels,
    ) -> Result<Option<TextureRef>, Failure> {
        let Some(info) = info else { return Ok(None) };
        let set = info.extensions.transform.as_ref().and_then(|t| t.tex_coord);
        let set = set.unwrap_or(info.tex_coord);
        let places = &mut self.uv_sets;
        let Some(place) = places.iter().position(|&s| s.is_none_or(|s| s == set)) else {
            let name = self.name;
            self.source.warn(&format!(
                "material '{name}' uses more than two sets of texture coordinates; textures of the others are ignored"
            ));
            return Ok(None);
        };
        let texture = self.images.texture(self.source, self.name, info, place, channels)?;
        if texture.is_some() {
            self.uv_sets[place] = Some(set);
        }
        Ok(texture)
    }
}

/// Clamps to \[0, 1\]; NaN becomes 0.
fn unit(v: f32) -> f32 {
    not_negative(v).min(1.0)
}

/// Clamps to \[0, the largest number\]; NaN becomes 0.
fn not_negative(v: f32) -> f32 {
    if v > 0.0 { v.min(f32::MAX) } else { 0.0 }
}
