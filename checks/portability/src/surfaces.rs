//! Surfaces beyond one reflectance model: coverage, the layers that glTF's extensions add, and textures.

use domelight::Rgb;
use domelight::math::vec2;
use domelight::scene::builtin::BuiltinScene;
use domelight::scene::{
    AlphaMode, Anisotropy, Clearcoat, ColorFactor, Coverage, Encoding, Factor, Layers, Material,
    MaterialModel, MetallicRoughnessMaterial, NormalMap, PhongMaterial, SceneDescription, Sheen,
    Specular, SpecularGlossinessMaterial, Texture, TextureFilter, TextureRef, UvTransform, Volume,
    Wrap,
};

/// Names and materials, one for each way that a surface can differ.
pub fn surfaces() -> Vec<(&'static str, Material)> {
    let plain = || metallic_roughness(0.1, 0.4, false);
    let layered = |layers| Material { layers, ..plain() };
    let covered =
        |mode, texture| Material { coverage: Coverage { mode, opacity: 0.7, texture }, ..plain() };
    let relief = NormalMap { texture: TextureRef::new(NORMALS), scale: 0.6 };
    vec![
        ("alpha mask", covered(AlphaMode::Mask { cutoff: 0.4 }, Some(texture(COLOR)))),
        ("alpha blend", covered(AlphaMode::Blend, Some(texture(COLOR)))),
        ("coat", layered(Layers { clearcoat: Some(coat(None)), ..Layers::default() })),
        (
            "coat with relief",
            layered(Layers { clearcoat: Some(coat(Some(relief))), ..Layers::default() }),
        ),
        ("sheen", layered(Layers { sheen: Some(sheen()), ..Layers::default() })),
        (
            "specular",
            layered(Layers { ior: Some(1.8), specular: Some(specular()), ..Layers::default() }),
        ),
        ("anisotropy", layered(Layers { anisotropy: Some(anisotropy()), ..Layers::default() })),
        (
            "transmission",
            layered(Layers {
                transmission: Some(factor(0.8)),
                volume: Some(volume()),
                ..Layers::default()
            }),
        ),
        ("textures", Material { normal_map: Some(relief), ..metallic_roughness(1.0, 0.9, true) }),
        ("textures of phong", Material::new("phong", phong())),
        ("textures of specular-glossiness", Material::new("gloss", specular_glossiness())),
    ]
}

/// The scene with the subject made of `material`; its meshes get texture coordinates.
pub fn made_of(scene: BuiltinScene, material: Material) -> SceneDescription {
    let mut description = scene.description();
    description.textures = textures();
    let index = description.materials.len();
    description.materials.push(material);
    let SceneDescription { parts, scenery, .. } = &mut description;
    for (_, part) in parts.iter_mut().enumerate().filter(|(i, _)| !scenery.contains(i)) {
        part.material = index;
        part.mesh.uvs = part.mesh.positions.iter().map(|p| vec2(0.7 * p.x, 0.7 * p.y)).collect();
    }
    description
}

/// Indices into [`textures`].
const COLOR: usize = 0;
const NUMBERS: usize = 1;
const NORMALS: usize = 2;

/// Edge of the textures \[texels\].
const EDGE: u32 = 8;

/// A color texture with alpha, one of numbers, and a normal map of 16 bits.
fn textures() -> Vec<Texture> {
    let texel = |i: u32| [i * 37 % 256, i * 91 % 256, i * 53 % 256].map(|value| value as u8);
    let texels: Vec<[u8; 3]> = (0..EDGE * EDGE).map(texel).collect();
    let alpha = (0..EDGE * EDGE).map(|i| (i * 29 % 256) as u8).collect();
    let normal = |i: u32| [20_000 + i * 401, 45_000 - i * 307, 60_000].map(|value| value as u16);
    let normals = (0..EDGE * EDGE).map(normal).collect();
    let color = Texture::from_rgb8("color", EDGE, EDGE, texels.clone(), Encoding::Srgb);
    let numbers = Texture::from_rgb8("numbers", EDGE, EDGE, texels, Encoding::Linear);
    let normals = Texture::from_rgb16("normals", EDGE, EDGE, normals, Encoding::Linear);
    let color = color.and_then(|color| color.with_alpha(alpha));
    [color, numbers, normals]
        .map(|texture| texture.expect("as many texels as the size says"))
        .into()
}

/// A use of a texture that is turned, mirrored in u and clamped in v.
fn texture(index: usize) -> TextureRef {
    TextureRef {
        wrap: [Wrap::Mirror, Wrap::Clamp],
        transform: UvTransform::new(vec2(0.3, 0.1), 0.4, vec2(1.5, 0.8)),
        ..TextureRef::new(index)
    }
}

fn factor(value: f32) -> Factor {
    Factor {
        value,
        texture: Some(TextureRef { filter: TextureFilter::Nearest, ..texture(NUMBERS) }),
    }
}

fn color_factor(value: Rgb) -> ColorFactor {
    ColorFactor { value, texture: Some(texture(COLOR)) }
}

fn metallic_roughness(metallic: f32, roughness: f32, textured: bool) -> Material {
    let model = MetallicRoughnessMaterial {
        base_color: Rgb::new(0.8, 0.5, 0.3),
        base_color_texture: textured.then(|| texture(COLOR)),
        metallic,
        roughness,
        metallic_roughness_texture: textured.then(|| texture(NUMBERS)),
    };
    Material::new("metal", MaterialModel::MetallicRoughness(model))
}

fn phong() -> MaterialModel {
    MaterialModel::Phong(PhongMaterial {
        diffuse: Rgb::new(0.6, 0.4, 0.3),
        diffuse_texture: Some(texture(COLOR)),
        specular: Rgb::splat(0.3),
        exponent: 40.0,
    })
}

fn specular_glossiness() -> MaterialModel {
    MaterialModel::SpecularGlossiness(SpecularGlossinessMaterial {
        diffuse: Rgb::new(0.5, 0.4, 0.3),
        diffuse_texture: Some(texture(COLOR)),
        specular: Rgb::new(0.4, 0.3, 0.2),
        glossiness: 0.8,
        specular_glossiness_texture: Some(texture(NUMBERS)),
    })
}

fn coat(normal_map: Option<NormalMap>) -> Clearcoat {
    Clearcoat { strength: factor(0.9), roughness: factor(0.3), normal_map }
}

fn sheen() -> Sheen {
    Sheen {
        color: color_factor(Rgb::new(0.6, 0.7, 0.9)),
        roughness: Factor { value: 0.5, texture: None },
    }
}

fn specular() -> Specular {
    Specular {
        strength: Factor { value: 0.8, texture: Some(texture(COLOR)) },
        color: color_factor(Rgb::splat(1.5)),
    }
}

fn anisotropy() -> Anisotropy {
    Anisotropy { strength: 0.7, rotation: 0.5, texture: Some(texture(NUMBERS)) }
}

fn volume() -> Volume {
    Volume {
        thickness: factor(0.5),
        attenuation_distance: 0.6,
        attenuation_color: Rgb::new(0.9, 0.6, 0.4),
    }
}
