//! Wavefront MTL, the material libraries of OBJ files.
//!
//! `Kd`, `Ks`, `Ns` and `map_Kd` make Lambert with a Phong highlight; where `Pr` or `Pm` stands, the
//! material is metallic-roughness with `Kd` as the base color. `norm` is a normal map, and so is `map_Bump` or
//! `bump` where its picture looks like one, as most exporters write it. Of a texture's options `-s`, `-o`, `-bm` and
//! `-clamp` count. Emission, opacity, heights, spectra and the other maps are passed over, and so is a texture whose
//! file is missing, each kind with one warning.

use std::path::Path;

use super::LoadError;
use super::notes::Notes;
use super::textures::Textures;
use super::wavefront::{ObjErrorKind, lines, number, numbers};
use crate::Rgb;
use crate::math::{Vec2, vec2};
use crate::scene::{
    Encoding, Material, MaterialModel, MetallicRoughnessMaterial, NormalMap, PhongMaterial,
    TextureRef, UvTransform, Wrap,
};

/// Whether the first statement is one of a material library.
pub(super) fn is_library(bytes: &[u8]) -> bool {
    const KEYWORDS: [&str; 22] = [
        "newmtl",
        "Ka",
        "Kd",
        "Ks",
        "Ke",
        "Ns",
        "Ni",
        "d",
        "Tr",
        "Tf",
        "illum",
        "bump",
        "disp",
        "decal",
        "refl",
        "norm",
        "Pr",
        "Pm",
        "Ps",
        "sharpness",
        "aniso",
        "anisor",
    ];
    let words = bytes.split(|&b| b == b'\n').filter_map(|line| {
        let word = line.split(u8::is_ascii_whitespace).find(|word| !word.is_empty())?;
        (word[0] != b'#').then_some(word)
    });
    let first = words.map(|word| word.strip_prefix(b"\xef\xbb\xbf").unwrap_or(word)).next();
    first.is_none_or(|word| {
        word.starts_with(b"map_") || KEYWORDS.iter().any(|keyword| keyword.as_bytes() == word)
    })
}

/// A material while it is read.
#[derive(Default)]
struct Entry {
    name: String,
    diffuse: Option<Rgb>,
    specular: Option<Rgb>,
    exponent: Option<f32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
    diffuse_texture: Option<TextureRef>,
    normal_map: Option<NormalMap>,
}

pub(super) fn parse(
    path: &Path,
    bytes: &[u8],
    textures: &mut Textures<'_>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Material>, LoadError> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut notes = Notes::default();
    for (number, text) in lines(bytes) {
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let at = |kind| LoadError::Obj { path: path.into(), line: number, kind };
        if keyword.is_empty() || keyword.starts_with('#') {
            continue;
        }
        if keyword == "newmtl" {
            entries.push(Entry { name: rest.into(), ..Entry::default() });
            continue;
        }
        let Some(entry) = entries.last_mut() else {
            return Err(at(ObjErrorKind::NoMaterial { keyword: keyword.into() }));
        };
        let name = entry.name.clone();
        let mut ignored = |what: &str| {
            let before = format!("{}: {what} ({keyword}) is ignored, of material ", path.display());
            notes.add(&before, &name, "");
        };
        let scalar = || Ok(numbers(keyword, rest, 1).map_err(at)?[0]);
        let color = || rgb(keyword, rest).map_err(at);
        let is_spectrum = matches!(rest.split_whitespace().next(), Some("spectral" | "xyz"));
        if is_spectrum && matches!(keyword, "Ka" | "Kd" | "Ks" | "Ke" | "Tf") {
            ignored("a color that is not RGB");
            continue;
        }
        let mut map = |encoding| {
            let (file, mut texture, bump) = options(keyword, rest).map_err(at)?;
            let referrer = format!("{}, line {number}", path.display());
            match textures.file(&super::relative(path, file), encoding, &referrer) {
                Ok(index) => texture.texture = index,
                // A mesh without a texture is better than none; one beyond the limit of memory is not.
                Err(error @ (LoadError::ReadReferenced { .. } | LoadError::Image { .. })) => {
                    warnings.push(format!("{error}; it is left out"));
                    return Ok(None);
                }
                Err(error) => return Err(error),
            }
            Ok(Some((texture, bump)))
        };
        match keyword {
            "Kd" => entry.diffuse = Some(color()?),
            "Ks" => entry.specular = Some(color()?),
            "Ns" => entry.exponent = Some(scalar()?),
            "Pr" => entry.roughness = Some(scalar()?),
            "Pm" => entry.metallic = Some(scalar()?),
            "map_Kd" => entry.diffuse_texture = map(Encoding::Srgb)?.map(|(texture, _)| texture),
            "norm" => entry.normal_map = map(Encoding::Linear)?.map(normal_map),
            "bump" | "map_bump" | "map_Bump" if entry.normal_map.is_none() => {
                if let Some((texture, scale)) = map(Encoding::Linear)? {
                    if textures.loaded[texture.texture].looks_like_normals() {
                        entry.normal_map = Some(normal_map((texture, scale)));
                    } else {
                        textures.forget(texture.texture);
                        ignored("a bump map of heights");
                    }
                }
            }
            "Ke" if !color()?.is_black() => ignored("emission"),
            "d" if scalar()? < 1.0 => ignored("opacity"),
            "Tr" if scalar()? > 0.0 => ignored("transparency"),
            "map_d" | "map_Tr" => ignored("an opacity map"),
            "map_Ke" => ignored("an emission map"),
            "map_Ks" | "map_Ns" | "map_Pr" | "map_Pm" => ignored("a map"),
            _ => {}
        }
    }
    warnings.extend(notes.sentences());
    Ok(entries.into_iter().map(Entry::material).collect())
}

impl Entry {
    fn material(self) -> Material {
        let default = if self.diffuse_texture.is_some() { 1.0 } else { 0.8 };
        let diffuse = self.diffuse.unwrap_or(Rgb::splat(default));
        let model = if self.roughness.is_some() || self.metallic.is_some() {
            MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
                base_color: diffuse,
                base_color_texture: self.diffuse_texture,
                metallic: self.metallic.unwrap_or(0.0).clamp(0.0, 1.0),
                roughness: self.roughness.unwrap_or(0.5).clamp(0.0, 1.0),
                metallic_roughness_texture: None,
            })
        } else {
            MaterialModel::Phong(PhongMaterial {
                diffuse,
                diffuse_texture: self.diffuse_texture,
                specular: self.specular.unwrap_or(Rgb::BLACK),
                exponent: self.exponent.unwrap_or(0.0).max(0.0),
            })
        };
        Material { normal_map: self.normal_map, ..Material::new(self.name, model) }
    }
}

fn normal_map((texture, scale): (TextureRef, f32)) -> NormalMap {
    NormalMap { texture, scale }
}

/// A color in \[0, 1\]: three numbers, or one for all channels.
fn rgb(keyword: &str, rest: &str) -> Result<Rgb, ObjErrorKind> {
    let n = numbers(keyword, rest, 1)?;
    let color = match n[..] {
        [r, g, b, ..] => Rgb::new(r, g, b),
        [r] => Rgb::splat(r),
        _ => {
            return Err(ObjErrorKind::TooFew {
                keyword: keyword.into(),
                needed: 3,
                found: n.len(),
            });
        }
    };
    Ok(color.map(|c| c.max(0.0)))
}

/// A texture's file name, its options and the factor on a relief; the texture's index is not yet known.
///
/// The options scale and move coordinates with v upward: v' = s v + o. In coordinates w = 1 − v that
/// is w' = s w + 1 − s − o.
fn options<'a>(
    keyword: &str,
    mut rest: &'a str,
) -> Result<(&'a str, TextureRef, f32), ObjErrorKind> {
    let mut bump = 1.0;
    let (mut scale, mut offset, mut wrap) = (Vec2::ONE, Vec2::ZERO, Wrap::Repeat);
    let no_name = || ObjErrorKind::Name { keyword: keyword.into() };
    while rest.starts_with('-') {
        let (option, after) = rest.split_once(char::is_whitespace).ok_or_else(no_name)?;
        rest = after.trim_start();
        match option {
            "-s" | "-o" | "-t" => {
                let mut values = Vec::new();
                while let Some((word, after)) = rest.split_once(char::is_whitespace)
                    && values.len() < 3
                    && let Ok(value) = number(word)
                {
                    values.push(value);
                    rest = after.trim_start();
                }
                let target = match option {
                    "-s" => &mut scale,
                    "-o" => &mut offset,
                    _ => continue,
                };
                target.x = *values.first().unwrap_or(&target.x);
                target.y = *values.get(1).unwrap_or(&target.y);
            }
            "-mm" => rest = skip_words(rest, 2),
            "-bm" => {
                let word = rest.split_whitespace().next().unwrap_or("");
                bump = number(word)?;
                rest = skip_words(rest, 1);
            }
            _ => {
                if option == "-clamp" && rest.starts_with("on") {
                    wrap = Wrap::Clamp;
                }
                rest = skip_words(rest, 1);
            }
        }
    }
    if rest.is_empty() {
        return Err(no_name());
    }
    let transform = UvTransform::new(vec2(offset.x, 1.0 - scale.y - offset.y), 0.0, scale);
    Ok((rest, TextureRef { wrap: [wrap; 2], transform, ..TextureRef::new(0) }, bump))
}

fn skip_words(mut text: &str, n: usize) -> &str {
    for _ in 0..n {
        text = text.split_once(char::is_whitespace).map_or("", |(_, after)| after.trim_start());
    }
    text
}
