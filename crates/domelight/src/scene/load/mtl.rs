//! Wavefront MTL, the material libraries of OBJ files.
//!
//! `Kd`, `Ks`, `Ns` and `map_Kd` make Lambert with a Phong highlight; where `Pr` or `Pm` stands, the
//! material is metallic-roughness with `Kd` as the base colour. `norm` is a normal map. Of a
//! texture's options `-s`, `-o` and `-clamp` count. Ignored with a warning are emission, opacity,
//! bump maps (heights) and the other maps.

use std::path::Path;

use super::LoadError;
use super::obj::{ObjProblem, number, numbers};
use super::textures::Textures;
use crate::Rgb;
use crate::math::{Vec2, vec2};
use crate::scene::{
    Encoding, MetallicRoughnessSurface, NormalMap, PhongSurface, Surface, SurfaceModel, TextureRef,
    UvTransform, Wrap,
};

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
    normal_map: Option<TextureRef>,
}

pub(super) fn parse(
    path: &Path,
    bytes: &[u8],
    textures: &mut Textures<'_>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Surface>, LoadError> {
    let mut entries: Vec<Entry> = Vec::new();
    for (index, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let text = String::from_utf8_lossy(line);
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let at = |problem| LoadError::Obj { path: path.into(), line: index + 1, problem };
        if keyword.is_empty() || keyword.starts_with('#') {
            continue;
        }
        if keyword == "newmtl" {
            entries.push(Entry { name: rest.into(), ..Entry::default() });
            continue;
        }
        let Some(entry) = entries.last_mut() else {
            return Err(at(ObjProblem::NoMaterial { keyword: keyword.into() }));
        };
        let scalar = || Ok(numbers(keyword, rest, 1).map_err(at)?[0]);
        let color = || rgb(keyword, rest).map_err(at);
        let mut map = |encoding| {
            let (file, mut texture) = options(keyword, rest).map_err(at)?;
            let referrer = format!("{}, line {}", path.display(), index + 1);
            texture.texture = textures.file(&super::relative(path, file), encoding, &referrer)?;
            Ok(Some(texture))
        };
        let mut ignored = |what: &str| {
            let (path, name) = (path.display(), &entry.name);
            warnings.push(format!("{path}: {what} ({keyword}) of material '{name}' is ignored"));
        };
        match keyword {
            "Kd" => entry.diffuse = Some(color()?),
            "Ks" => entry.specular = Some(color()?),
            "Ns" => entry.exponent = Some(scalar()?),
            "Pr" => entry.roughness = Some(scalar()?),
            "Pm" => entry.metallic = Some(scalar()?),
            "map_Kd" => entry.diffuse_texture = map(Encoding::Srgb)?,
            "norm" => entry.normal_map = map(Encoding::Linear)?,
            "Ke" if !color()?.is_black() => ignored("emission"),
            "d" if scalar()? < 1.0 => ignored("opacity"),
            "Tr" if scalar()? > 0.0 => ignored("transparency"),
            "map_d" => ignored("opacity map"),
            "map_Ke" => ignored("emission map"),
            "bump" | "map_bump" | "map_Bump" => ignored("bump map"),
            "map_Ks" | "map_Ns" | "map_Pr" | "map_Pm" => ignored("map"),
            _ => {}
        }
    }
    Ok(entries.into_iter().map(Entry::surface).collect())
}

impl Entry {
    fn surface(self) -> Surface {
        let default = if self.diffuse_texture.is_some() { 1.0 } else { 0.8 };
        let diffuse = self.diffuse.unwrap_or(Rgb::splat(default));
        let model = if self.roughness.is_some() || self.metallic.is_some() {
            SurfaceModel::MetallicRoughness(MetallicRoughnessSurface {
                base_color: diffuse,
                base_color_texture: self.diffuse_texture,
                metallic: self.metallic.unwrap_or(0.0).clamp(0.0, 1.0),
                roughness: self.roughness.unwrap_or(0.5).clamp(0.0, 1.0),
                metallic_roughness_texture: None,
            })
        } else {
            SurfaceModel::Phong(PhongSurface {
                diffuse,
                diffuse_texture: self.diffuse_texture,
                specular: self.specular.unwrap_or(Rgb::BLACK),
                exponent: self.exponent.unwrap_or(0.0).max(0.0),
            })
        };
        let normal_map = self.normal_map.map(|texture| NormalMap { texture, scale: 1.0 });
        Surface { name: self.name, model, normal_map }
    }
}

/// A colour in \[0, 1\]: three numbers, or one for all channels.
fn rgb(keyword: &str, rest: &str) -> Result<Rgb, ObjProblem> {
    let n = numbers(keyword, rest, 1)?;
    let color = match n[..] {
        [r, g, b, ..] => Rgb::new(r, g, b),
        [r] => Rgb::splat(r),
        _ => return Err(ObjProblem::TooFew { keyword: keyword.into(), needed: 3, found: n.len() }),
    };
    Ok(color.map(|c| c.max(0.0)))
}

/// A texture's file name and options; the index is not yet known.
///
/// The options scale and move coordinates with v upward: v' = s v + o. In coordinates w = 1 − v that
/// is w' = s w + 1 − s − o.
fn options<'a>(keyword: &str, mut rest: &'a str) -> Result<(&'a str, TextureRef), ObjProblem> {
    let (mut scale, mut offset, mut wrap) = (Vec2::ONE, Vec2::ZERO, Wrap::Repeat);
    let no_name = || ObjProblem::Name { keyword: keyword.into() };
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
    Ok((rest, TextureRef { texture: 0, wrap: [wrap; 2], transform }))
}

fn skip_words(mut text: &str, n: usize) -> &str {
    for _ in 0..n {
        text = text.split_once(char::is_whitespace).map_or("", |(_, after)| after.trim_start());
    }
    text
}
