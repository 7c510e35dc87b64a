//! The layers that glTF's material extensions add to metallic-roughness, as a file states them.
//!
//! A loader fills them in completely. [`Material::approximated_features`](super::Material::approximated_features) lists
//! those that a picture only approximates. A number with a texture is multiplied by it.

use super::texture::{Texture, TextureRef, Uvs};
use crate::Rgb;
use crate::bsdf::{self, Coat};
use crate::math::{Vec2, Vec3, functions, sqr, vec2};

/// Alpha coverage: how much of the background shows through a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coverage {
    /// The meaning of the opacity.
    pub mode: AlphaMode,
    /// The opacity in \[0, 1\], multiplied by the alpha of the texture and of the vertices.
    pub opacity: f32,
    /// A texture whose alpha multiplies the opacity.
    pub texture: Option<TextureRef>,
}

/// The meaning of a surface's opacity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Ignored: the surface is opaque.
    #[default]
    Opaque,
    /// The surface exists where the opacity reaches the cutoff.
    Mask {
        /// The cutoff, ≥ 0.
        cutoff: f32,
    },
    /// The opacity blends the surface with what is behind it.
    Blend,
}

impl Default for Coverage {
    fn default() -> Self {
        Self { mode: AlphaMode::Opaque, opacity: 1.0, texture: None }
    }
}

impl Coverage {
    /// That of a surface that is there by a share, an opacity in \[0, 1\] times the alpha of a texture.
    #[cfg(feature = "io")]
    pub(super) fn blend(opacity: f32, texture: Option<TextureRef>) -> Self {
        if opacity >= 1.0 && texture.is_none() {
            return Self::default();
        }
        Self { mode: AlphaMode::Blend, opacity, texture }
    }
}

/// Light that a surface emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// The radiance ≥ 0, including the strength of `KHR_materials_emissive_strength`.
    pub radiance: Rgb,
    /// A color texture.
    pub texture: Option<TextureRef>,
}

/// A number with a linear texture that multiplies it by one of its channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// The number.
    pub value: f32,
    /// The texture; the parameter defines the channel.
    pub texture: Option<TextureRef>,
}

/// A color with a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorFactor {
    /// The linear color.
    pub value: Rgb,
    /// The texture, in sRGB.
    pub texture: Option<TextureRef>,
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// A linear texture: red along the tangent, green along the bitangent, blue along the normal,
    /// each from −1 at 0 to 1 at 1.
    pub texture: TextureRef,
    /// A factor on the first two components.
    pub scale: f32,
}

impl NormalMap {
    /// The normal in the frame (tangent, bitangent, normal), not of unit length.
    #[inline]
    pub(crate) fn normal(&self, textures: &[Texture], uvs: &Uvs) -> Vec3 {
        let c = self.texture.at(textures, uvs).map(|c| 2.0 * c - 1.0);
        Vec3::new(self.scale * c.r, self.scale * c.g, c.b)
    }
}

/// A channel of a texture that holds a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Channel {
    Red,
    Green,
    Alpha,
}

impl Factor {
    /// The number times that of the texture at texture coordinates `uvs`.
    pub(super) fn at(&self, channel: Channel, textures: &[Texture], uvs: &Uvs) -> f32 {
        let of_texture = |texture: &TextureRef| match channel {
            Channel::Red => texture.at(textures, uvs).r,
            Channel::Green => texture.at(textures, uvs).g,
            Channel::Alpha => texture.alpha_at(textures, uvs),
        };
        self.value * self.texture.as_ref().map_or(1.0, of_texture)
    }
}

impl ColorFactor {
    /// The color times that of the texture at texture coordinates `uvs`.
    pub(super) fn at(&self, textures: &[Texture], uvs: &Uvs) -> Rgb {
        self.value * self.texture.as_ref().map_or(Rgb::WHITE, |texture| texture.at(textures, uvs))
    }
}

/// The layers on, in and behind the metallic-roughness layer; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layers {
    /// The index of refraction ≥ 1, or 0 for a reflectance of 1; `None`: 1.5
    /// (`KHR_materials_ior`).
    pub ior: Option<f32>,
    /// The strength and color of the dielectric reflection.
    pub specular: Option<Specular>,
    /// A clear coat.
    pub clearcoat: Option<Clearcoat>,
    /// Fibers that brighten the surface at grazing angles.
    pub sheen: Option<Sheen>,
    /// A highlight stretched in one direction.
    pub anisotropy: Option<Anisotropy>,
    /// Light that passes through the surface.
    pub transmission: Option<Factor>,
    /// The volume behind a transmissive surface.
    pub volume: Option<Volume>,
}

/// `KHR_materials_specular`: factors on the reflectance of a dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular {
    /// Strength in \[0, 1\]; the texture's alpha channel.
    pub strength: Factor,
    /// Color ≥ 0 of the reflection at normal incidence.
    pub color: ColorFactor,
}

/// `KHR_materials_clearcoat`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// Strength in \[0, 1\]; the texture's red channel.
    pub strength: Factor,
    /// Perceptual roughness in \[0, 1\]; the texture's green channel.
    pub roughness: Factor,
    /// The coat's own normal map.
    pub normal_map: Option<NormalMap>,
}

/// `KHR_materials_sheen`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Color in \[0, 1\].
    pub color: ColorFactor,
    /// Perceptual roughness in \[0, 1\]; the texture's alpha channel.
    pub roughness: Factor,
}

/// `KHR_materials_anisotropy`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// Strength in \[0, 1\]; the texture's blue channel.
    pub strength: f32,
    /// The direction of the stretch, counterclockwise from the tangent \[rad\].
    pub rotation: f32,
    /// A linear texture: a direction in red and green from −1 at 0 to 1 at 1, and the strength.
    pub texture: Option<TextureRef>,
}

/// `KHR_materials_volume`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Thickness ≥ 0 in the mesh's units, 0 for a thin wall; the texture's green channel.
    pub thickness: Factor,
    /// The distance after which white light has the attenuation color, in world units; may be infinite.
    pub attenuation_distance: f32,
    /// The color at that distance, in \[0, 1\].
    pub attenuation_color: Rgb,
}

impl Clearcoat {
    /// The strength and the lobe at texture coordinates `uvs`, about a `normal` in the shading frame; `None` where the
    /// strength is 0.
    pub(super) fn coat(
        &self,
        textures: &[Texture],
        uvs: &Uvs,
        normal: Vec3,
    ) -> Option<(f32, Coat)> {
        let strength = self.strength.at(Channel::Red, textures, uvs);
        if strength <= 0.0 {
            return None;
        }
        let roughness = self.roughness.at(Channel::Green, textures, uvs);
        Some((strength, Coat::new(sqr(roughness), normal)))
    }
}

impl Sheen {
    /// The lobe at texture coordinates `uvs`.
    pub(super) fn lobe(&self, textures: &[Texture], uvs: &Uvs) -> bsdf::Sheen {
        let roughness = self.roughness.at(Channel::Alpha, textures, uvs);
        bsdf::Sheen::new(self.color.at(textures, uvs), roughness)
    }
}

impl Anisotropy {
    /// At texture coordinates `uvs`: the strength in \[0, 1\], and the longer direction along the tangent and the
    /// bitangent, not of unit length.
    pub(super) fn at(&self, textures: &[Texture], uvs: &Uvs) -> (f32, Vec2) {
        let (sin, cos) = functions::sin_cos(self.rotation);
        let Some(texture) = &self.texture else { return (self.strength, vec2(cos, sin)) };
        let texel = texture.at(textures, uvs);
        let along = vec2(2.0 * texel.r - 1.0, 2.0 * texel.g - 1.0);
        (self.strength * texel.b, vec2(cos, sin).rotate(along))
    }
}

impl Volume {
    /// The share of each channel that passes half of the body at texture coordinates `uvs`, since light meets a body's
    /// surface twice; all of it at a surface that is seen from its front alone.
    pub(super) fn transmittance(&self, textures: &[Texture], uvs: &Uvs, double_sided: bool) -> Rgb {
        let thickness = self.thickness.at(Channel::Green, textures, uvs);
        let share = if double_sided { 0.5 } else { 1.0 };
        // Infinite distances attenuate nothing.
        let exponent = share * thickness / self.attenuation_distance;
        self.attenuation_color.map(|c| functions::powf(c, exponent))
    }
}

impl Layers {
    /// The reflectance of the dielectric at normal incidence, in \[0, 1\], from the refractive index (1.5 by default).
    #[inline]
    pub fn dielectric_f0(&self) -> f32 {
        self.ior.map_or(0.04, |ior| sqr((ior - 1.0) / (ior + 1.0)))
    }

    /// Every use of a texture.
    pub(super) fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let Self { ior: _, specular, clearcoat, sheen, anisotropy, transmission, volume } = self;
        let normal_map = clearcoat.as_ref().and_then(|c| c.normal_map.as_ref());
        [
            specular.as_ref().and_then(|s| s.strength.texture.as_ref()),
            specular.as_ref().and_then(|s| s.color.texture.as_ref()),
            clearcoat.as_ref().and_then(|c| c.strength.texture.as_ref()),
            clearcoat.as_ref().and_then(|c| c.roughness.texture.as_ref()),
            normal_map.map(|n| &n.texture),
            sheen.as_ref().and_then(|s| s.color.texture.as_ref()),
            sheen.as_ref().and_then(|s| s.roughness.texture.as_ref()),
            anisotropy.as_ref().and_then(|a| a.texture.as_ref()),
            transmission.as_ref().and_then(|t| t.texture.as_ref()),
            volume.as_ref().and_then(|v| v.thickness.texture.as_ref()),
        ]
        .into_iter()
        .flatten()
    }

    /// Every use of a texture, to change it.
    pub(super) fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureRef> {
        let Self { ior: _, specular, clearcoat, sheen, anisotropy, transmission, volume } = self;
        let [mut strength, mut color] = [None, None];
        if let Some(s) = specular {
            (strength, color) = (s.strength.texture.as_mut(), s.color.texture.as_mut());
        }
        let [mut coat, mut coat_roughness, mut coat_normal] = [None, None, None];
        if let Some(c) = clearcoat {
            (coat, coat_roughness) = (c.strength.texture.as_mut(), c.roughness.texture.as_mut());
            coat_normal = c.normal_map.as_mut().map(|n| &mut n.texture);
        }
        let [mut fibers, mut fiber_roughness] = [None, None];
        if let Some(s) = sheen {
            (fibers, fiber_roughness) = (s.color.texture.as_mut(), s.roughness.texture.as_mut());
        }
        [
            strength,
            color,
            coat,
            coat_roughness,
            coat_normal,
            fibers,
            fiber_roughness,
            anisotropy.as_mut().and_then(|a| a.texture.as_mut()),
            transmission.as_mut().and_then(|t| t.texture.as_mut()),
            volume.as_mut().and_then(|v| v.thickness.texture.as_mut()),
        ]
        .into_iter()
        .flatten()
    }
}
