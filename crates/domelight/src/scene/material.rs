//! Materials: reflectance models with parameters and textures.
//!
//! At each hit, a [`Material`] becomes a [`Bsdf`], a sum of reflectance lobes: textures are looked up
//! and multiplied by vertex colors.

use super::layers::{Channel, Coverage, Emission, Layers, NormalMap};
use super::texture::{Texture, TextureRef, UvTransform, Uvs};
use crate::Rgb;
use crate::bsdf::{Bsdf, Fresnel, Lambert, MetallicRoughness, Phong};
use crate::math::Vec3;

/// The reflectance of shadow catchers, on which shadows do not depend.
pub(crate) const CATCHER_REFLECTANCE: f32 = 0.5;

/// The reflectance of a clear coat at normal incidence.
const COAT_F0: f32 = 0.04;

/// What becomes of the light that a surface meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightShares {
    /// The share of each channel that passes straight through.
    pub(crate) transmitted: Rgb,
    /// About the share of all light that is reflected, in \[0, 1\].
    pub(crate) reflected: f32,
}

impl LightShares {
    const OPAQUE: Self = Self { transmitted: Rgb::BLACK, reflected: 1.0 };
}

/// The material of a part of a scene.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name in the file, for messages.
    pub name: String,
    /// The reflectance model.
    pub model: MaterialModel,
    /// The normal map.
    pub normal_map: Option<NormalMap>,
    /// How much of the background shows through.
    pub coverage: Coverage,
    /// Whether the surface is also visible from behind. It casts a shadow from either side.
    pub double_sided: bool,
    /// Emitted light, which the camera sees and which lights nothing else.
    pub emission: Option<Emission>,
    /// Whether the color is shown unchanged, regardless of the light (`KHR_materials_unlit`).
    pub unlit: bool,
    /// Whether the surface is a shadow catcher, which shows only the shadows on it, regardless of its model: the
    /// background is seen instead, darkened as a diffuse surface would be. It casts no shadow. Shadow catchers are
    /// flat, and all of them in a scene face the same way.
    pub catches_shadows: bool,
    /// The layers that glTF's extensions add.
    pub layers: Layers,
}

/// The reflectance model of a material, with its parameters.
#[derive(Clone, Debug)]
pub enum MaterialModel {
    /// The same BSDF everywhere, independent of vertex colors.
    Fixed(Bsdf),
    /// Lambert, with a Phong highlight unless `specular` is black.
    Phong(PhongMaterial),
    /// The metallic-roughness model of glTF.
    MetallicRoughness(MetallicRoughnessMaterial),
    /// glTF's older model, `KHR_materials_pbrSpecularGlossiness`.
    SpecularGlossiness(SpecularGlossinessMaterial),
}

/// Parameters of [`MaterialModel::Phong`], as in a Wavefront MTL file.
#[derive(Clone, Debug, PartialEq)]
pub struct PhongMaterial {
    /// Diffuse albedo k_d in \[0, 1\], multiplied by the texture and the vertex color.
    pub diffuse: Rgb,
    /// A color texture, multiplied by `diffuse`.
    pub diffuse_texture: Option<TextureRef>,
    /// Specular albedo k_s, clamped to 1 − diffuse to conserve energy.
    pub specular: Rgb,
    /// Exponent of the highlight, ≥ 0.
    pub exponent: f32,
}

/// Parameters of [`MaterialModel::MetallicRoughness`], as in glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughnessMaterial {
    /// Base color in \[0, 1\], multiplied by the texture and the vertex color.
    pub base_color: Rgb,
    /// A color texture, multiplied by `base_color`.
    pub base_color_texture: Option<TextureRef>,
    /// Metalness in \[0, 1\].
    pub metallic: f32,
    /// Perceptual roughness in \[0, 1\], the square root of GGX's α.
    pub roughness: f32,
    /// A linear texture: its green channel multiplies `roughness`, its blue channel `metallic`.
    pub metallic_roughness_texture: Option<TextureRef>,
}

/// Parameters of [`MaterialModel::SpecularGlossiness`], as in glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecularGlossinessMaterial {
    /// Diffuse color in \[0, 1\], multiplied by the texture and the vertex color.
    pub diffuse: Rgb,
    /// A color texture, multiplied by `diffuse`.
    pub diffuse_texture: Option<TextureRef>,
    /// Reflectance at normal incidence in \[0, 1\].
    pub specular: Rgb,
    /// Glossiness in \[0, 1\], 1 − perceptual roughness.
    pub glossiness: f32,
    /// A texture: its color multiplies `specular`, its alpha `glossiness`.
    pub specular_glossiness_texture: Option<TextureRef>,
}

impl Material {
    /// Creates an opaque, two-sided material.
    pub fn new(name: impl Into<String>, model: MaterialModel) -> Self {
        Self {
            name: name.into(),
            model,
            normal_map: None,
            coverage: Coverage::default(),
            double_sided: true,
            emission: None,
            unlit: false,
            catches_shadows: false,
            layers: Layers::default(),
        }
    }

    /// Creates a diffuse material with one color.
    pub fn diffuse(name: impl Into<String>, albedo: Rgb) -> Self {
        Self::new(name, MaterialModel::diffuse(albedo))
    }

    /// Creates a material with the same BSDF everywhere.
    pub fn fixed(name: impl Into<String>, bsdf: Bsdf) -> Self {
        Self::new(name, MaterialModel::Fixed(bsdf))
    }

    /// The features of this surface that a picture only approximates, in glTF terms.
    pub fn approximated_features(&self) -> impl Iterator<Item = &'static str> {
        let Layers { transmission, volume, .. } = &self.layers;
        let transmits = self.transmits();
        [
            (transmission.is_some() && transmits, "KHR_materials_transmission"),
            (volume.is_some() && transmits, "KHR_materials_volume"),
        ]
        .into_iter()
        .filter_map(|(is_used, feature)| is_used.then_some(feature))
    }

    /// Whether the surface transmits light.
    #[inline]
    pub(crate) fn transmits(&self) -> bool {
        self.layers.transmission.is_some()
            && !self.unlit
            && matches!(self.model, MaterialModel::MetallicRoughness(_))
    }

    /// What becomes of light at texture coordinates `uvs` under the vertex color `tint`, along a direction at the cosine
    /// `cos_theta` to the normal. A body does not refract.
    pub(crate) fn shares(
        &self,
        textures: &[Texture],
        uvs: &Uvs,
        tint: Rgb,
        cos_theta: f32,
    ) -> LightShares {
        let MaterialModel::MetallicRoughness(m) = &self.model else { return LightShares::OPAQUE };
        let Some(transmission) = self.layers.transmission.filter(|_| !self.unlit) else {
            return LightShares::OPAQUE;
        };
        let look_up =
            |t: &Option<TextureRef>| t.as_ref().map_or(Rgb::WHITE, |t| t.at(textures, uvs));
        let base = (m.base_color * look_up(&m.base_color_texture) * tint).map(unit);
        let dielectric = 1.0 - unit(m.metallic * look_up(&m.metallic_roughness_texture).b);
        let f0 = Rgb::splat(self.layers.dielectric_f0());
        let strength = self
            .layers
            .specular
            .as_ref()
            .map_or(1.0, |specular| unit(specular.strength.at(Channel::Alpha, textures, uvs)));
        let entering = 1.0 - strength * Fresnel::Schlick { f0 }.eval(cos_theta).r;
        let transmission = unit(transmission.at(Channel::Red, textures, uvs));
        let share = transmission * dielectric * entering;
        let body =
            self.layers.volume.as_ref().map_or(Rgb::WHITE, |volume| {
                volume.transmittance(textures, uvs, self.double_sided)
            });
        // Dielectrics reflect by Fresnel's equations and diffusely what is not transmitted, metals by their color.
        let diffuse = entering * (1.0 - transmission) * dielectric + (1.0 - dielectric);
        let below = (1.0 - entering) * dielectric + base.luminance() * diffuse;
        let coat = self.layers.clearcoat.as_ref().map_or(0.0, |coat| {
            let fresnel = Fresnel::Schlick { f0: Rgb::splat(COAT_F0) }.eval(cos_theta).r;
            unit(coat.strength.at(Channel::Red, textures, uvs)) * fresnel
        });
        LightShares { transmitted: base * body * share, reflected: coat + (1.0 - coat) * below }
    }

    /// The textures that the material refers to.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        self.shading_textures()
            .chain(&self.coverage.texture)
            .chain(self.emission.iter().filter_map(|e| e.texture.as_ref()))
    }

    /// The textures that its material depends on.
    #[inline]
    pub(crate) fn shading_textures(&self) -> impl Iterator<Item = &TextureRef> {
        let of_model = match &self.model {
            MaterialModel::Fixed(_) => [None, None],
            MaterialModel::Phong(p) => [p.diffuse_texture.as_ref(), None],
            MaterialModel::MetallicRoughness(m) => {
                [m.base_color_texture.as_ref(), m.metallic_roughness_texture.as_ref()]
            }
            MaterialModel::SpecularGlossiness(s) => {
                [s.diffuse_texture.as_ref(), s.specular_glossiness_texture.as_ref()]
            }
        };
        let of_model = of_model.into_iter().flatten();
        of_model.chain(self.normal_map.as_ref().map(|n| &n.texture)).chain(self.layers.textures())
    }

    /// The BSDF that the material has everywhere on meshes without vertex colors, up to the choice of lobes. `None` if it
    /// has textures, or a coat or sheen, which dim the layers below depending on the view.
    pub(super) fn constant_bsdf(&self) -> Option<Bsdf> {
        let is_layered = self.layers.sheen.is_some() || self.layers.clearcoat.is_some();
        if is_layered || self.shading_textures().next().is_some() {
            return None;
        }
        let mut bsdf = Bsdf::BLACK;
        self.set_bsdf(&[], &Uvs::default(), Rgb::WHITE, [Vec3::Z, Vec3::Z], &mut bsdf);
        Some(bsdf)
    }

    /// Whether the direction of the tangent matters.
    #[inline]
    pub(crate) fn needs_tangent(&self) -> bool {
        let fixed = match &self.model {
            MaterialModel::Fixed(bsdf) => !bsdf.is_isotropic(),
            MaterialModel::Phong(_)
            | MaterialModel::MetallicRoughness(_)
            | MaterialModel::SpecularGlossiness(_) => false,
        };
        let coat_relief = self.layers.clearcoat.as_ref().is_some_and(|c| c.normal_map.is_some());
        fixed || self.normal_map.is_some() || self.layers.anisotropy.is_some() || coat_relief
    }

    /// The set of texture coordinates for tangents, 0 or 1, and the transform to those of the image that the tangents
    /// follow, so that bumps stay bumps in a turned image. One that maps all to a line or point is left out.
    #[inline]
    pub(crate) fn tangent_uvs(&self) -> (usize, UvTransform) {
        let Layers { anisotropy, clearcoat, .. } = &self.layers;
        let of_anisotropy = || anisotropy.as_ref().and_then(|a| a.texture);
        let of_coat = || clearcoat.as_ref().and_then(|c| c.normal_map).map(|n| n.texture);
        let texture = self.normal_map.map(|n| n.texture).or_else(of_anisotropy).or_else(of_coat);
        let Some(TextureRef { uv_set, transform, .. }) = texture else {
            return (0, UvTransform::IDENTITY);
        };
        let area = transform.x.perp_dot(transform.y);
        let is_invertible = area != 0.0 && area.is_finite();
        (uv_set, if is_invertible { transform } else { UvTransform::IDENTITY })
    }

    /// Adds `by` to the index of every texture.
    pub(crate) fn shift_textures(&mut self, by: usize) {
        let shift = |t: &mut TextureRef| t.texture += by;
        match &mut self.model {
            MaterialModel::Fixed(_) => {}
            MaterialModel::Phong(p) => p.diffuse_texture.iter_mut().for_each(shift),
            MaterialModel::MetallicRoughness(m) => {
                m.base_color_texture.iter_mut().for_each(shift);
                m.metallic_roughness_texture.iter_mut().for_each(shift);
            }
            MaterialModel::SpecularGlossiness(s) => {
                s.diffuse_texture.iter_mut().for_each(shift);
                s.specular_glossiness_texture.iter_mut().for_each(shift);
            }
        }
        self.normal_map.iter_mut().for_each(|n| shift(&mut n.texture));
        self.coverage.texture.iter_mut().for_each(shift);
        self.emission.iter_mut().filter_map(|e| e.texture.as_mut()).for_each(shift);
        self.layers.textures_mut().for_each(shift);
    }

    /// The color of an unlit surface at texture coordinates `uvs` under the vertex color `tint`.
    pub(crate) fn color(&self, textures: &[Texture], uvs: &Uvs, tint: Rgb) -> Rgb {
        let (color, texture) = match &self.model {
            MaterialModel::Fixed(bsdf) => return bsdf.albedo(),
            MaterialModel::Phong(p) => (p.diffuse, &p.diffuse_texture),
            MaterialModel::MetallicRoughness(m) => (m.base_color, &m.base_color_texture),
            MaterialModel::SpecularGlossiness(s) => (s.diffuse, &s.diffuse_texture),
        };
        let texture = texture.as_ref().map_or(Rgb::WHITE, |t| t.at(textures, uvs));
        (color * texture * tint).map(unit)
    }

    /// Sets `bsdf` to that at texture coordinates `uvs` under the vertex color `tint`, seen from `wo`. The normal of a
    /// coat, in the shading frame, is `coat_normal`.
    #[inline]
    pub(crate) fn set_bsdf(
        &self,
        textures: &[Texture],
        uvs: &Uvs,
        tint: Rgb,
        [wo, coat_normal]: [Vec3; 2],
        bsdf: &mut Bsdf,
    ) {
        let look_up =
            |t: &Option<TextureRef>| t.as_ref().map_or(Rgb::WHITE, |t| t.at(textures, uvs));
        if self.unlit {
            *bsdf = Bsdf::single(Lambert::new(Rgb::BLACK));
            return;
        }
        if self.catches_shadows {
            *bsdf = Bsdf::single(Lambert::new(Rgb::splat(CATCHER_REFLECTANCE)));
            return;
        }
        match &self.model {
            MaterialModel::Fixed(fixed) => bsdf.set(fixed, wo),
            MaterialModel::Phong(p) => {
                let diffuse = p.diffuse * look_up(&p.diffuse_texture) * tint;
                bsdf.set(&lambert_phong(diffuse.map(unit), p.specular, p.exponent), wo);
            }
            MaterialModel::MetallicRoughness(m) => {
                let base = m.base_color * look_up(&m.base_color_texture) * tint;
                let factors = look_up(&m.metallic_roughness_texture);
                let (metallic, roughness) = (m.metallic * factors.b, m.roughness * factors.g);
                let f0 = self.layers.dielectric_f0();
                let lobe = match &self.layers.specular {
                    None => MetallicRoughness::with_dielectric(base, metallic, roughness, f0),
                    Some(specular) => {
                        let f0 = specular.color.at(textures, uvs) * f0;
                        let strength = specular.strength.at(Channel::Alpha, textures, uvs);
                        MetallicRoughness::with_specular(base, metallic, roughness, f0, strength)
                    }
                };
                let lobe = match &self.layers.anisotropy {
                    None => lobe,
                    Some(anisotropy) => lobe.anisotropic(anisotropy.at(textures, uvs).0),
                };
                let Layers { sheen, clearcoat, transmission, .. } = &self.layers;
                let lobe = match transmission {
                    None => lobe,
                    Some(share) => lobe.transmitting(share.at(Channel::Red, textures, uvs)),
                };
                if sheen.is_none() && clearcoat.is_none() {
                    *bsdf = Bsdf::single(lobe);
                    return;
                }
                let sheen = sheen.map(|sheen| sheen.lobe(textures, uvs));
                let coat = clearcoat.and_then(|coat| coat.coat(textures, uvs, coat_normal));
                *bsdf = Bsdf::layered(lobe, sheen, coat, wo);
            }
            MaterialModel::SpecularGlossiness(s) => {
                let diffuse = s.diffuse * look_up(&s.diffuse_texture) * tint;
                let specular = s.specular * look_up(&s.specular_glossiness_texture);
                let alpha = s.specular_glossiness_texture.as_ref();
                let glossiness = s.glossiness * alpha.map_or(1.0, |t| t.alpha_at(textures, uvs));
                let lobe = MetallicRoughness::specular_glossiness(diffuse, specular, glossiness);
                *bsdf = Bsdf::single(lobe);
            }
        }
    }
}

impl MaterialModel {
    /// Creates a Lambertian model with one color.
    pub fn diffuse(albedo: Rgb) -> Self {
        Self::Phong(PhongMaterial {
            diffuse: albedo,
            diffuse_texture: None,
            specular: Rgb::BLACK,
            exponent: 0.0,
        })
    }
}

impl TextureRef {
    /// The look-up at the mesh's texture coordinates.
    #[inline]
    pub(crate) fn at(&self, textures: &[Texture], uvs: &Uvs) -> Rgb {
        let uv = self.transform.apply(uvs[self.uv_set]);
        textures[self.texture].sample_by(uv, self.wrap, self.filter)
    }

    /// The alpha at these coordinates; 1 if the texture has none.
    #[inline]
    pub(crate) fn alpha_at(&self, textures: &[Texture], uvs: &Uvs) -> f32 {
        let uv = self.transform.apply(uvs[self.uv_set]);
        textures[self.texture].sample_alpha(uv, self.wrap, self.filter)
    }
}

/// Clamps to [0, 1]; NaN becomes 0.
pub(super) fn unit(v: f32) -> f32 {
    if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }
}

fn lambert_phong(diffuse: Rgb, specular: Rgb, exponent: f32) -> Bsdf {
    let lambert = Lambert::new(diffuse);
    let room = Rgb::WHITE - diffuse;
    let specular = Rgb::new(specular.r.min(room.r), specular.g.min(room.g), specular.b.min(room.b));
    if specular.is_black() {
        return Bsdf::single(lambert);
    }
    Bsdf::new(&[lambert.into(), Phong::new(specular, exponent).into()])
        .expect("a material holds two lobes")
}
