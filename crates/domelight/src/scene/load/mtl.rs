//! Wavefront MTL, the material libraries of OBJ files.
//!
//! `Kd`, `Ks`, `Ns` and `map_Kd` give a Lambertian material with a Phong highlight. With `Pr`, `Pm`, `map_Pr` or
//! `map_Pm`, the material is metallic-roughness with `Kd` as the base color, and a map replaces its number. `Ke` and
//! `map_Ke` are emission. `d`, or else `Tr`, is opacity, multiplied by `map_d`: its alpha channel if it has one, else
//! its luminance. `norm` is a normal map, and so is `map_Bump` or `bump` if its picture looks like one, as most
//! exporters write it. The texture options `-s`, `-o`, `-bm` and `-clamp` are supported. Heights, spectra, other maps
//! and textures that cannot be read are ignored, each kind with one warning; only `map_Ka` is ignored without one,
//! because rays determine what is ambient. Keywords may be written in any case.

use std::path::Path;

use super::LoadError;
use super::notes::Notes;
use super::textures::{Content, Textures};
use super::wavefront::{ObjErrorKind, lines, number, numbers, unquoted};
use crate::Rgb;
use crate::math::{Vec2, vec2};
use crate::scene::{
    Coverage, Emission, Material, MaterialModel, MetallicRoughnessMaterial, NormalMap,
    PhongMaterial, TextureRef, UvTransform, Wrap,
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
        let is_map = word.get(..4).is_some_and(|begin| begin.eq_ignore_ascii_case(b"map_"));
        is_map || KEYWORDS.iter().any(|keyword| word.eq_ignore_ascii_case(keyword.as_bytes()))
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
    emission: Option<Rgb>,
    /// Opacity by `d`.
    opacity: Option<f32>,
    /// Transparency by `Tr`.
    transparency: Option<f32>,
    diffuse_texture: Option<TextureRef>,
    roughness_texture: Option<TextureRef>,
    metallic_texture: Option<TextureRef>,
    emission_texture: Option<TextureRef>,
    opacity_texture: Option<TextureRef>,
    normal_map: Option<NormalMap>,
}

/// The materials of a library. With `strict` a texture that cannot be read is an error.
pub(super) fn parse(
    path: &Path,
    bytes: &[u8],
    textures: &mut Textures<'_>,
    strict: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Material>, LoadError> {
    let mut reader = Reader { path, textures, strict, notes: Notes::default(), warnings };
    let mut entries: Vec<Entry> = Vec::new();
    for (number, text) in lines(bytes) {
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let line = Line { number, keyword, rest: rest.trim() };
        match entries.last_mut() {
            _ if keyword.eq_ignore_ascii_case("newmtl") => {
                entries.push(Entry { name: line.rest.into(), ..Entry::default() });
            }
            Some(entry) => reader.statement(entry, line)?,
            None if keyword.is_empty() || keyword.starts_with('#') => {}
            None => {
                let kind = ObjErrorKind::NoMaterial { keyword: keyword.into() };
                return Err(reader.error(line, kind));
            }
        }
    }
    let materials = entries.into_iter().map(|entry| reader.material(entry)).collect();
    let Reader { notes, warnings, .. } = reader;
    warnings.extend(notes.sentences());
    materials
}

/// A statement of the file.
#[derive(Clone, Copy)]
struct Line<'a> {
    number: usize,
    keyword: &'a str,
    rest: &'a str,
}

struct Reader<'r, 'b> {
    path: &'r Path,
    textures: &'r mut Textures<'b>,
    strict: bool,
    notes: Notes,
    warnings: &'r mut Vec<String>,
}

impl Reader<'_, '_> {
    fn error(&self, line: Line<'_>, kind: ObjErrorKind) -> LoadError {
        LoadError::Obj { path: self.path.into(), line: line.number, kind }
    }

    fn ignored(&mut self, entry: &Entry, line: Line<'_>, what: &str) {
        let (path, keyword) = (self.path.display(), line.keyword);
        let before = format!("{path}: {what} ({keyword}) is ignored, of material ");
        self.notes.add(&before, &entry.name, "");
    }

    fn scalar(&self, line: Line<'_>) -> Result<f32, LoadError> {
        let values = numbers(line.keyword, line.rest, 1);
        Ok(values.map_err(|kind| self.error(line, kind))?[0])
    }

    fn color(&self, line: Line<'_>) -> Result<Rgb, LoadError> {
        rgb(line.keyword, line.rest).map_err(|kind| self.error(line, kind))
    }

    fn statement(&mut self, entry: &mut Entry, line: Line<'_>) -> Result<(), LoadError> {
        let keyword = line.keyword.to_ascii_lowercase();
        let is_spectrum = matches!(line.rest.split_whitespace().next(), Some("spectral" | "xyz"));
        if is_spectrum && matches!(&*keyword, "ka" | "kd" | "ks" | "ke" | "tf") {
            self.ignored(entry, line, "a color that is not RGB");
            return Ok(());
        }
        match &*keyword {
            "kd" => entry.diffuse = Some(self.color(line)?),
            "ks" => entry.specular = Some(self.color(line)?),
            "ke" => entry.emission = Some(self.color(line)?),
            "ns" => entry.exponent = Some(self.scalar(line)?),
            "pr" => entry.roughness = Some(self.scalar(line)?),
            "pm" => entry.metallic = Some(self.scalar(line)?),
            "d" => {
                // The factor of a halo is of the view, which is not drawn.
                let rest = line.rest.strip_prefix("-halo").unwrap_or(line.rest).trim_start();
                entry.opacity = Some(self.scalar(Line { rest, ..line })?);
            }
            "tr" => entry.transparency = Some(self.scalar(line)?),
            "map_kd" => entry.diffuse_texture = self.map(line, Content::Color)?,
            "map_ke" => entry.emission_texture = self.map(line, Content::Color)?,
            "map_pr" => entry.roughness_texture = self.map(line, Content::Numbers)?,
            "map_pm" => entry.metallic_texture = self.map(line, Content::Numbers)?,
            "map_d" => entry.opacity_texture = self.map(line, Content::Opacity)?,
            "norm" => {
                entry.normal_map = self.relief(line, Content::Numbers)?.map(normal_map);
            }
            "bump" | "map_bump" if entry.normal_map.is_none() => self.bump(entry, line)?,
            "map_tr" => self.ignored(entry, line, "a transparency map"),
            "refl" => self.ignored(entry, line, "a reflection map"),
            // A relief beside a normal map, a map of ambient light, which rays determine, and a switch.
            "map_bump" | "map_ka" | "map_aat" => {}
            "disp" | "decal" => self.ignored(entry, line, "a map"),
            other if other.starts_with("map_") => self.ignored(entry, line, "a map"),
            _ => {}
        }
        Ok(())
    }

    /// A relief as a normal map, where its picture looks like one.
    fn bump(&mut self, entry: &mut Entry, line: Line<'_>) -> Result<(), LoadError> {
        let Some((texture, scale)) = self.relief(line, Content::Numbers)? else { return Ok(()) };
        if self.textures.loaded[texture.texture].looks_like_normals() {
            entry.normal_map = Some(normal_map((texture, scale)));
        } else {
            self.textures.forget(texture.texture);
            self.ignored(entry, line, "a bump map of heights");
        }
        Ok(())
    }

    fn map(&mut self, line: Line<'_>, content: Content) -> Result<Option<TextureRef>, LoadError> {
        Ok(self.relief(line, content)?.map(|(texture, _)| texture))
    }

    /// A texture and the factor on a relief; `None`, with a warning, if it cannot be read.
    fn relief(
        &mut self,
        line: Line<'_>,
        content: Content,
    ) -> Result<Option<(TextureRef, f32)>, LoadError> {
        let parsed = options(line.keyword, line.rest);
        let (file, texture, bump) = parsed.map_err(|kind| self.error(line, kind))?;
        let referrer = format!("{}, line {}", self.path.display(), line.number);
        match self.textures.named_in(self.path, file, content, &referrer) {
            Ok(index) => Ok(Some((TextureRef { texture: index, ..texture }, bump))),
            Err(error) if !self.strict && error.is_about_one_image() => {
                self.warnings.push(format!("{error}; it is left out"));
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn material(&mut self, entry: Entry) -> Result<Material, LoadError> {
        let default = if entry.diffuse_texture.is_some() { 1.0 } else { 0.8 };
        let mut diffuse = entry.diffuse.unwrap_or(Rgb::splat(default));
        if diffuse.is_black() && entry.diffuse_texture.is_some() {
            let before = format!(
                "{}: Kd is black, but map_Kd is taken for the color, of material ",
                self.path.display()
            );
            self.notes.add(&before, &entry.name, "");
            diffuse = Rgb::WHITE;
        }
        let maps = [entry.roughness_texture, entry.metallic_texture];
        let is_physical =
            entry.roughness.or(entry.metallic).is_some() || maps.iter().any(Option::is_some);
        let model = if is_physical {
            let factor = |map: &Option<TextureRef>, value: Option<f32>, default: f32| {
                map.map_or(value.unwrap_or(default).clamp(0.0, 1.0), |_| 1.0)
            };
            MaterialModel::MetallicRoughness(MetallicRoughnessMaterial {
                base_color: diffuse,
                base_color_texture: entry.diffuse_texture,
                metallic: factor(&maps[1], entry.metallic, 0.0),
                roughness: factor(&maps[0], entry.roughness, 0.5),
                metallic_roughness_texture: self.packed(&entry.name, maps)?,
            })
        } else {
            MaterialModel::Phong(PhongMaterial {
                diffuse,
                diffuse_texture: entry.diffuse_texture,
                specular: entry.specular.unwrap_or(Rgb::BLACK),
                exponent: entry.exponent.unwrap_or(0.0).max(0.0),
            })
        };
        Ok(Material {
            normal_map: entry.normal_map,
            emission: entry.emission(),
            coverage: entry.coverage(),
            ..Material::new(entry.name, model)
        })
    }

    /// Roughness in green and metalness in blue, out of a texture of each.
    fn packed(
        &mut self,
        material: &str,
        [roughness, metallic]: [Option<TextureRef>; 2],
    ) -> Result<Option<TextureRef>, LoadError> {
        let (first, second) = match (roughness, metallic) {
            (Some(roughness), Some(metallic)) => (roughness, metallic),
            // The other is a factor on a map of ones.
            (Some(only), None) | (None, Some(only)) => (only, only),
            (None, None) => return Ok(None),
        };
        if second != (TextureRef { texture: second.texture, ..first }) {
            let before = format!(
                "{}: the options of map_Pm are taken to be those of map_Pr, of material ",
                self.path.display()
            );
            self.notes.add(&before, material, "");
        }
        let is_packed =
            roughness.is_some() && metallic.is_some() && first.texture == second.texture;
        if is_packed {
            return Ok(Some(first));
        }
        let green = roughness.map(|texture| texture.texture);
        let blue = metallic.map(|texture| texture.texture);
        let place = format!("{}: maps of material '{material}'", self.path.display());
        let texture = self.textures.packed(&place, green, blue)?;
        Ok(Some(TextureRef { texture, ..first }))
    }
}

impl Entry {
    /// A map stands for itself where the file has no color or, as some programs write it, black.
    fn emission(&self) -> Option<Emission> {
        let color = self.emission.filter(|color| !color.is_black());
        let radiance = color.or(self.emission_texture.map(|_| Rgb::WHITE))?;
        Some(Emission { radiance, texture: self.emission_texture })
    }

    fn coverage(&self) -> Coverage {
        // To some programs Tr is opacity; a surface that is not there is not what one writes down.
        let transparency = self.transparency.filter(|&t| t < 1.0);
        let opacity = self.opacity.or(transparency.map(|t| 1.0 - t)).unwrap_or(1.0);
        Coverage::blend(opacity.clamp(0.0, 1.0), self.opacity_texture)
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
    Ok((unquoted(rest), TextureRef { wrap: [wrap; 2], transform, ..TextureRef::new(0) }, bump))
}

fn skip_words(mut text: &str, n: usize) -> &str {
    for _ in 0..n {
        text = text.split_once(char::is_whitespace).map_or("", |(_, after)| after.trim_start());
    }
    text
}
