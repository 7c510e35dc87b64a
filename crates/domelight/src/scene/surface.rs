//! What a mesh is made of, before textures are looked up.
//!
//! A [`Surface`] becomes a [`Material`], a sum of reflectance lobes with numbers in it, at each hit:
//! textures are looked up there and vertex colours multiplied in. All surfaces are opaque and
//! two-sided.

use super::texture::{Texture, TextureRef};
use crate::Rgb;
use crate::bsdf::{Lambert, Material, MetallicRoughness, Phong};
use crate::math::{Vec2, Vec3};

/// What a part of a scene is made of.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name in the file, for messages.
    pub name: String,
    /// How it reflects.
    pub model: SurfaceModel,
    /// Its fine relief.
    pub normal_map: Option<NormalMap>,
}

/// How a surface reflects.
#[derive(Clone, Debug)]
pub enum SurfaceModel {
    /// The same material everywhere; vertex colours do not touch it.
    Fixed(Material),
    /// Lambert, with a Phong highlight where `specular` is not black.
    Phong(PhongSurface),
    /// The metallic-roughness model of glTF.
    MetallicRoughness(MetallicRoughnessSurface),
}

/// Parameters of [`SurfaceModel::Phong`], as in a Wavefront MTL file.
#[derive(Clone, Debug, PartialEq)]
pub struct PhongSurface {
    /// Diffuse albedo k_d in \[0, 1\]; multiplied by the texture and the vertex colour.
    pub diffuse: Rgb,
    /// A colour texture, a factor on `diffuse`.
    pub diffuse_texture: Option<TextureRef>,
    /// Specular albedo k_s; cut to 1 − diffuse, so that no energy is made.
    pub specular: Rgb,
    /// Exponent of the highlight, ≥ 0.
    pub exponent: f32,
}

/// Parameters of [`SurfaceModel::MetallicRoughness`], as in glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughnessSurface {
    /// Base colour in \[0, 1\]; multiplied by the texture and the vertex colour.
    pub base_color: Rgb,
    /// A colour texture, a factor on `base_color`.
    pub base_color_texture: Option<TextureRef>,
    /// Metalness in \[0, 1\].
    pub metallic: f32,
    /// Perceptual roughness in \[0, 1\], the square root of GGX's α.
    pub roughness: f32,
    /// A linear texture: its green channel is a factor on `roughness`, its blue one on `metallic`.
    pub metallic_roughness_texture: Option<TextureRef>,
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// A linear texture: red along the tangent, green along the bitangent, blue along the normal,
    /// each from −1 at 0 to 1 at 1.
    pub texture: TextureRef,
    /// Factor on the first two.
    pub scale: f32,
}

impl Surface {
    /// A diffuse surface of one colour.
    pub fn diffuse(name: impl Into<String>, albedo: Rgb) -> Self {
        Self { name: name.into(), model: SurfaceModel::diffuse(albedo), normal_map: None }
    }

    /// A surface of one material.
    pub fn fixed(name: impl Into<String>, material: Material) -> Self {
        Self { name: name.into(), model: SurfaceModel::Fixed(material), normal_map: None }
    }

    /// The textures that it refers to.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let of_model = match &self.model {
            SurfaceModel::Fixed(_) => [None, None],
            SurfaceModel::Phong(p) => [p.diffuse_texture.as_ref(), None],
            SurfaceModel::MetallicRoughness(m) => {
                [m.base_color_texture.as_ref(), m.metallic_roughness_texture.as_ref()]
            }
        };
        of_model.into_iter().flatten().chain(self.normal_map.as_ref().map(|n| &n.texture))
    }

    /// Whether it matters which way the tangent points.
    #[inline]
    pub(crate) fn has_grain(&self) -> bool {
        let fixed = match &self.model {
            SurfaceModel::Fixed(material) => !material.is_isotropic(),
            SurfaceModel::Phong(_) | SurfaceModel::MetallicRoughness(_) => false,
        };
        fixed || self.normal_map.is_some()
    }

    /// Adds `by` to the index of every texture.
    pub(crate) fn shift_textures(&mut self, by: usize) {
        let shift = |t: &mut TextureRef| t.texture += by;
        match &mut self.model {
            SurfaceModel::Fixed(_) => {}
            SurfaceModel::Phong(p) => p.diffuse_texture.iter_mut().for_each(shift),
            SurfaceModel::MetallicRoughness(m) => {
                m.base_color_texture.iter_mut().for_each(shift);
                m.metallic_roughness_texture.iter_mut().for_each(shift);
            }
        }
        self.normal_map.iter_mut().for_each(|n| shift(&mut n.texture));
    }

    /// Sets `material` to that at texture coordinates `uv` under the vertex colour `tint`, seen from `wo`.
    #[inline]
    pub(crate) fn set_material(
        &self,
        textures: &[Texture],
        uv: Vec2,
        tint: Rgb,
        wo: Vec3,
        material: &mut Material,
    ) {
        let look_up =
            |t: &Option<TextureRef>| t.as_ref().map_or(Rgb::WHITE, |t| t.at(textures, uv));
        match &self.model {
            SurfaceModel::Fixed(fixed) => material.set(fixed, wo),
            SurfaceModel::Phong(p) => {
                let diffuse = p.diffuse * look_up(&p.diffuse_texture) * tint;
                material.set(&lambert_phong(diffuse.map(unit), p.specular, p.exponent), wo);
            }
            SurfaceModel::MetallicRoughness(m) => {
                let base = m.base_color * look_up(&m.base_color_texture) * tint;
                let factors = look_up(&m.metallic_roughness_texture);
                let (metallic, roughness) = (m.metallic * factors.b, m.roughness * factors.g);
                *material = Material::single(MetallicRoughness::new(base, metallic, roughness));
            }
        }
    }
}

impl SurfaceModel {
    /// Lambert of one colour.
    pub fn diffuse(albedo: Rgb) -> Self {
        Self::Phong(PhongSurface {
            diffuse: albedo,
            diffuse_texture: None,
            specular: Rgb::BLACK,
            exponent: 0.0,
        })
    }
}

impl NormalMap {
    /// The normal in the frame (tangent, bitangent, normal), not of unit length.
    #[inline]
    pub(crate) fn normal(&self, textures: &[Texture], uv: Vec2) -> Vec3 {
        let c = self.texture.at(textures, uv).map(|c| 2.0 * c - 1.0);
        Vec3::new(self.scale * c.r, self.scale * c.g, c.b)
    }
}

impl TextureRef {
    /// The look-up at the mesh's texture coordinates `uv`.
    #[inline]
    pub(crate) fn at(&self, textures: &[Texture], uv: Vec2) -> Rgb {
        textures[self.texture].sample(self.transform.apply(uv), self.wrap)
    }
}

/// Clamps to [0, 1]; NaN becomes 0.
fn unit(v: f32) -> f32 {
    if v.is_nan() { 0.0 } else { v.clamp(0.0, 1.0) }
}

fn lambert_phong(diffuse: Rgb, specular: Rgb, exponent: f32) -> Material {
    let lambert = Lambert::new(diffuse);
    let room = Rgb::WHITE - diffuse;
    let specular = Rgb::new(specular.r.min(room.r), specular.g.min(room.g), specular.b.min(room.b));
    if specular.is_black() {
        return Material::single(lambert);
    }
    Material::new(&[lambert.into(), Phong::new(specular, exponent).into()])
        .expect("a material holds two lobes")
}
