//! Wavefront OBJ.
//!
//! The reader supports `v` (with colors), `vt` (v upward), `vn`, `f` (polygons of any shape, relative
//! indices), `s`, `o`, `g`, `usemtl` and `mtllib` ([`super::mtl`]). Lines, points and curves are ignored. A
//! backslash continues a line; text that is not UTF-8 is read as Latin-1.
//! Every object or group and material becomes a separate part, wherever in the file its faces are.
//! A corner without a normal is flat, or has the normal of its smoothing group ([`super::smoothing`]), computed over
//! the whole file, so that seams of texture coordinates and materials do not show.
//!
//! We do not use the crate tobj, because it reports no line numbers and its arithmetic overflows on
//! out-of-range relative indices.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::colors::ColorScale;
use super::notes::Notes;
use super::polygon::Triangulator;
use super::smoothing::Smoothing;
use super::textures::Textures;
use super::wavefront::{ObjErrorKind, enough, lines, number, numbers, unquoted, words};
use super::{
    Budget, DEFAULT_ALBEDO, LoadError, Loaded, colors, last_part, mtl, non_finite, part_name, stem,
};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{DVec3, Vec2, Vec3};
use crate::scene::offset;
use crate::scene::{Material, Part, SceneDescription};

/// Memory of a mesh for each byte of its text: a corner of a face is some 3 to 10 bytes, and takes 20 while it is read and
/// up to 32 as a vertex.
const MEMORY_PER_BYTE: u64 = 8;

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    strict: bool,
) -> Result<Loaded, LoadError> {
    budget.take(&path.display().to_string(), MEMORY_PER_BYTE * bytes.len() as u64)?;
    let mut reader = Reader::new(path, budget, strict);
    reader.offset = offset::of_points(lines(bytes).filter_map(|(_, line)| vertex_of(&line)));
    for (number, line) in lines(bytes) {
        reader.line(number, &line)?;
    }
    Ok(reader.finish())
}

/// Indices of a corner's position, texture coordinate and normal.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    position: u32,
    uv: Option<u32>,
    normal: Normal,
}

/// Where the normal of a corner comes from.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Normal {
    /// The file.
    Given(u32),
    /// A smoothing group.
    Smooth(u32),
    /// The triangle.
    Flat,
}

/// The faces of one object and one material.
struct Group {
    name: Rc<str>,
    material: Option<Rc<str>>,
    triangles: Vec<[Corner; 3]>,
}

/// What faces belong to until the next line that says so.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
struct Label {
    name: Rc<str>,
    material: Option<Rc<str>>,
}

struct Reader<'a> {
    path: &'a Path,
    /// Whether positions that are not finite and files that cannot be read are errors.
    strict: bool,
    positions: Vec<Vec3>,
    /// What the positions are relative to.
    offset: DVec3,
    /// One a position as the file has it, none where it gives none; empty if it never does.
    colors: Vec<Option<Rgb>>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// In the order of their first faces.
    groups: Vec<Group>,
    group_of: HashMap<Label, usize>,
    label: Label,
    /// The normal of corners that bring none.
    shading: Normal,
    /// The group of `label`, once it has faces.
    group: Option<usize>,
    materials: Vec<Material>,
    /// Material libraries that were read.
    libraries: HashSet<PathBuf>,
    /// What faces refer to and does not exist.
    missing: HashSet<&'static str>,
    material_of: HashMap<String, usize>,
    textures: Textures<'a>,
    triangulator: Triangulator,
    /// The corners of the face that is read.
    corners: Vec<Corner>,
    notes: Notes,
    warnings: Vec<String>,
}

impl<'a> Reader<'a> {
    fn new(path: &'a Path, budget: &'a Budget<'a>, strict: bool) -> Self {
        Self {
            path,
            strict,
            positions: Vec::new(),
            offset: DVec3::ZERO,
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            groups: Vec::new(),
            group_of: HashMap::new(),
            label: Label { name: stem(path).into(), material: None },
            shading: Normal::Flat,
            group: None,
            materials: Vec::new(),
            libraries: HashSet::new(),
            missing: HashSet::new(),
            material_of: HashMap::new(),
            textures: Textures::new(budget),
            triangulator: Triangulator::default(),
            corners: Vec::new(),
            notes: Notes::default(),
            warnings: Vec::new(),
        }
    }

    fn line(&mut self, number: usize, text: &str) -> Result<(), LoadError> {
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        let at = |kind| LoadError::Obj { path: self.path.into(), line: number, kind };
        match keyword {
            "v" => {
                let read = if self.strict { numbers } else { any_numbers };
                let numbers = read(keyword, rest, 3).map_err(at)?;
                let position = Vec3::from_slice(&numbers);
                self.positions.push(self.relative(position, text));
                self.vertex_color(&numbers);
            }
            "vt" => {
                let n = numbers_or_zero(keyword, rest, 1).map_err(at)?;
                self.uvs.push(Vec2::new(n[0], 1.0 - n.get(1).unwrap_or(&0.0)));
            }
            "vn" => {
                let n = numbers_or_zero(keyword, rest, 3).map_err(at)?;
                self.normals.push(Vec3::new(n[0], n[1], n[2]).normalize_or_zero());
            }
            // `fo` was the keyword of old.
            "f" | "fo" => self.face(rest).map_err(at)?,
            "s" => self.shading = smoothing_group(rest),
            "o" | "g" => {
                self.label.name =
                    if rest.is_empty() { stem(self.path).into() } else { part_name(rest).into() };
                self.group = None;
            }
            "usemtl" => {
                self.label.material = (!rest.is_empty()).then(|| rest.into());
                self.group = None;
            }
            "mtllib" if rest.is_empty() => {
                return Err(at(ObjErrorKind::Name { keyword: keyword.into() }));
            }
            "mtllib" => self.library(number, rest)?,
            "curv" | "surf" => {
                let before = format!("{}: free-form geometry is left out: ", self.path.display());
                self.notes.add(&before, keyword, "");
            }
            _ => {}
        }
        Ok(())
    }

    /// A position relative to the offset, of the line that it is from.
    fn relative(&self, position: Vec3, line: &str) -> Vec3 {
        if self.offset == DVec3::ZERO {
            return position;
        }
        let precise = vertex_of(line).unwrap_or_else(|| position.as_dvec3());
        (precise - self.offset).as_vec3()
    }

    /// The color of the last position, perhaps after a weight, which rendering ignores.
    fn vertex_color(&mut self, n: &[f32]) {
        if n.len() >= 6 {
            self.colors.resize(self.positions.len() - 1, None);
            self.colors.push(Some(Rgb::new(n[n.len() - 3], n[n.len() - 2], n[n.len() - 1])));
        }
    }

    /// A corner of a face. Without `strict`, texture coordinates and normals that do not exist are left out.
    fn corner(&mut self, text: &str) -> Result<Corner, ObjErrorKind> {
        let mut words = text.split('/');
        let mut index = |what, count| match words.next() {
            None | Some("") => Ok(None),
            Some(word) => {
                let malformed = |_| ObjErrorKind::Corner { text: text.into() };
                resolve(word.parse().map_err(malformed)?, what, count).map(Some)
            }
        };
        let position = index("vertex (v)", self.positions.len())?;
        let uv = index("texture coordinate (vt)", self.uvs.len());
        let normal = index("normal (vn)", self.normals.len());
        let [uv, normal] = [self.existing(uv)?, self.existing(normal)?];
        let normal = normal.map_or(self.shading, Normal::Given);
        let position = position.ok_or_else(|| ObjErrorKind::Corner { text: text.into() })?;
        Ok(Corner { position, uv, normal })
    }

    fn existing(
        &mut self,
        index: Result<Option<u32>, ObjErrorKind>,
    ) -> Result<Option<u32>, ObjErrorKind> {
        match index {
            Err(ObjErrorKind::Index { what, .. }) if !self.strict => {
                if self.missing.insert(what) {
                    let path = self.path.display();
                    let before = format!("{path}: left out of faces, because it does not exist: ");
                    self.notes.add(&before, what, "");
                }
                Ok(None)
            }
            index => index,
        }
    }

    fn face(&mut self, text: &str) -> Result<(), ObjErrorKind> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words(text) {
            corners.push(self.corner(word)?);
        }
        if corners.len() < 3 {
            return Err(ObjErrorKind::Face { corners: corners.len() });
        }
        let position = |i: usize| self.positions[corners[i].position as usize];
        let triangles = self.triangulator.triangulate(corners.len(), position);
        let triangles = triangles.iter().map(|t| t.map(|i| corners[i as usize]));
        let (groups, label) = (&mut self.groups, &self.label);
        let group = *self.group.get_or_insert_with(|| {
            *self.group_of.entry(label.clone()).or_insert_with(|| {
                let Label { name, material } = label.clone();
                groups.push(Group { name, material, triangles: Vec::new() });
                groups.len() - 1
            })
        });
        groups[group].triangles.extend(triangles);
        self.corners = corners;
        Ok(())
    }

    /// Reads a material library, or several; one that is missing is a warning.
    fn library(&mut self, line: usize, names: &str) -> Result<(), LoadError> {
        let names = unquoted(names);
        let exists = |name: &str| {
            let path = super::relative(self.path, name);
            self.textures.budget.exists(&path)
        };
        // A name may hold spaces, and so may a path of the computer where the file was made.
        let is_one = !names.contains(char::is_whitespace)
            || exists(names)
            || !words(names).any(exists) && exists(last_part(names));
        if is_one {
            return self.one_library(line, names);
        }
        words(names).try_for_each(|name| self.one_library(line, name))
    }

    /// The bytes of a library: from where the file says, or else, if that is a path of the computer where the file was
    /// made, from its last part beside the file.
    fn read_library(
        &self,
        path: PathBuf,
        name: &str,
        place: &str,
    ) -> (PathBuf, Result<Vec<u8>, LoadError>) {
        let read = |path: &Path| super::read_referenced(path, place, self.textures.budget);
        let found = read(&path);
        let beside = super::relative(self.path, last_part(name));
        if !matches!(found, Err(LoadError::ReadReferenced { .. })) || beside == path {
            return (path, found);
        }
        match read(&beside) {
            Ok(bytes) => (beside, Ok(bytes)),
            Err(_) => (path, found),
        }
    }

    fn one_library(&mut self, line: usize, name: &str) -> Result<(), LoadError> {
        let path = super::relative(self.path, name);
        if !self.libraries.insert(path.clone()) {
            return Ok(());
        }
        let place = format!("{}, line {line}", self.path.display());
        let (path, found) = self.read_library(path, name, &place);
        let why = match found {
            // Report nothing of the content of another file.
            Ok(bytes) if !mtl::is_library(&super::utf8_of(&bytes)) => {
                "it is not a material library (MTL)".to_owned()
            }
            Ok(bytes) => {
                let (textures, warnings) = (&mut self.textures, &mut self.warnings);
                let bytes = super::utf8_of(&bytes);
                for material in mtl::parse(&path, &bytes, textures, self.strict, warnings)? {
                    // Of two of a name, the first.
                    let next = self.materials.len();
                    self.material_of.entry(material.name.clone()).or_insert(next);
                    self.materials.push(material);
                }
                return Ok(());
            }
            Err(LoadError::ReadReferenced { source, .. }) if !self.strict => source.to_string(),
            Err(error) => return Err(error),
        };
        let before = format!("{}: cannot read the material library ", self.path.display());
        let after = format!(" (line {line}: {why}); its materials are gray");
        self.notes.add(&before, &path.display().to_string(), &after);
        Ok(())
    }

    fn finish(mut self) -> Loaded {
        let colors = self.linear_colors();
        let smoothing = self.smoothing();
        let mut parts = Vec::new();
        for group in std::mem::take(&mut self.groups) {
            if !group.triangles.is_empty() {
                let material = self.material_index(group.material.as_deref());
                let mesh = self.mesh(&group.triangles, &smoothing, &colors);
                parts.push(Part { name: group.name.to_string(), mesh, material });
            }
        }
        let description = SceneDescription {
            parts,
            materials: self.materials,
            textures: self.textures.loaded,
            offset: self.offset,
            ..SceneDescription::default()
        };
        self.warnings.extend(self.notes.sentences());
        Loaded { description, warnings: self.warnings, ..Loaded::default() }
    }

    /// The surface of a name; all unknown ones are one gray.
    fn material_index(&mut self, name: Option<&str>) -> usize {
        const DEFAULT: &str = "default";
        let known = self.material_of.get(name.unwrap_or(DEFAULT));
        if let Some(&index) = known {
            return index;
        }
        if let Some(name) = name {
            let before = format!("{}: without definition and gray: material ", self.path.display());
            self.notes.add(&before, name, "");
        }
        let gray = self.material_of.get(DEFAULT).copied().unwrap_or_else(|| {
            let albedo = if self.colors.is_empty() { DEFAULT_ALBEDO } else { Rgb::WHITE };
            self.materials.push(Material::diffuse(DEFAULT, albedo));
            self.materials.len() - 1
        });
        self.material_of.insert(DEFAULT.into(), gray);
        self.material_of.insert(name.unwrap_or(DEFAULT).into(), gray);
        gray
    }

    /// The color of each position, white where the file gives none; empty if it never does.
    fn linear_colors(&mut self) -> Vec<Rgb> {
        if self.colors.is_empty() {
            return Vec::new();
        }
        self.colors.resize(self.positions.len(), None);
        let scale = ColorScale::of(self.colors.iter().copied().flatten());
        self.warnings.extend(colors::warning(self.path, scale.non_finite));
        let linear = |color: &Option<Rgb>| color.map_or(Rgb::WHITE, |color| scale.linear(color));
        self.colors.iter().map(linear).collect()
    }

    /// The normals of all smoothing groups.
    fn smoothing(&self) -> Smoothing {
        let mut smoothing = Smoothing::default();
        for triangle in self.groups.iter().flat_map(|group| &group.triangles) {
            // A face has one group.
            let group = triangle.iter().find_map(|corner| match corner.normal {
                Normal::Smooth(group) => Some(group),
                Normal::Given(_) | Normal::Flat => None,
            });
            if let Some(group) = group {
                smoothing.add(group, triangle.map(|corner| corner.position), &self.positions);
            }
        }
        smoothing
    }

    /// One vertex for each different corner.
    fn mesh(&self, triangles: &[[Corner; 3]], smoothing: &Smoothing, colors: &[Rgb]) -> Mesh {
        let mut mesh = Mesh::default();
        let mut known = HashMap::new();
        let has_uvs = triangles.iter().flatten().any(|c| c.uv.is_some());
        let has_normals = triangles.iter().flatten().any(|c| c.normal != Normal::Flat);
        mesh.triangles.reserve(triangles.len());
        for triangle in triangles {
            let indices = triangle.map(|corner| {
                *known.entry(corner).or_insert_with(|| {
                    let position = corner.position as usize;
                    mesh.positions.push(self.positions[position]);
                    if has_normals {
                        mesh.normals.push(match corner.normal {
                            Normal::Given(normal) => self.normals[normal as usize],
                            Normal::Smooth(group) => smoothing.normal(group, corner.position),
                            // Zero stands for the triangle's own.
                            Normal::Flat => Vec3::ZERO,
                        });
                    }
                    if has_uvs {
                        mesh.uvs.push(corner.uv.map_or(Vec2::ZERO, |t| self.uvs[t as usize]));
                    }
                    mesh.colors.extend(colors.get(position));
                    (mesh.positions.len() - 1) as u32
                })
            });
            mesh.triangles.push(indices);
        }
        mesh
    }
}

/// The position of a line that defines a vertex.
fn vertex_of(line: &str) -> Option<DVec3> {
    let mut words = words(line);
    let is_vertex = words.next() == Some("v");
    let mut number = || words.next()?.parse().ok();
    if is_vertex { Some(DVec3::new(number()?, number()?, number()?)) } else { None }
}

/// The group that `s` names: none for `off`, `null` and 0. Words that are no numbers, such as `on`, name one group.
fn smoothing_group(rest: &str) -> Normal {
    match words(rest).next() {
        None => Normal::Flat,
        Some(word) if ["off", "null"].iter().any(|no| word.eq_ignore_ascii_case(no)) => {
            Normal::Flat
        }
        Some(word) => match word.parse() {
            Ok(0) => Normal::Flat,
            Ok(group) => Normal::Smooth(group),
            Err(_) => Normal::Smooth(u32::MAX),
        },
    }
}

/// As [`numbers`], with what exporters write of NaN and infinities (`nan`, `-1.#IND`).
fn any_numbers(keyword: &str, rest: &str, needed: usize) -> Result<Vec<f32>, ObjErrorKind> {
    let value = |word| non_finite::parse(word).map_or_else(|| number(word), Ok);
    enough(keyword, words(rest).map(value).collect::<Result<_, _>>()?, needed)
}

/// As [`numbers`], with 0 for NaN and infinities.
fn numbers_or_zero(keyword: &str, rest: &str, needed: usize) -> Result<Vec<f32>, ObjErrorKind> {
    let mut numbers = any_numbers(keyword, rest, needed)?;
    for number in numbers.iter_mut().filter(|number| !number.is_finite()) {
        *number = 0.0;
    }
    Ok(numbers)
}

/// An index of a file, from 1 or relative to the end, as one from 0.
fn resolve(index: i64, what: &'static str, count: usize) -> Result<u32, ObjErrorKind> {
    let resolved = if index < 0 { index.checked_add(count as i64) } else { index.checked_sub(1) };
    resolved
        .filter(|i| (0..count as i64).contains(i))
        .and_then(|i| u32::try_from(i).ok())
        .ok_or(ObjErrorKind::Index { index, what, count })
}
