//! Stanford PLY: ASCII and both binary byte orders.
//!
//! The reader supports, for the element `vertex`, the properties `x y z`, `nx ny nz`, texture coordinates
//! (`s t`, `u v` or `texture_u texture_v`, v upward) and `red green blue` (sRGB; floats by [`super::colors`]); for the element `face`, the list `vertex_indices` or `vertex_index` with polygons of any shape, and
//! colors as for vertices, which are used if vertices have none; for `tristrips`, the same list, where −1 ends a
//! strip. Elements and properties may come in any order. Everything else is ignored. A file without normals gets
//! smooth ones.
//!
//! `comment TextureFile NAME`, as MeshLab writes it, names a texture, which takes the place of colors. Its coordinates are
//! those of vertices, or the list `texcoord` of faces, with two numbers a corner; with several textures, `texnumber` of
//! a face says which.
//!
//! We do not use a PLY crate, because the existing ones build a map of properties for every row.

use std::collections::HashMap;
use std::fmt;
use std::path::Path;

use super::faces::{Polygons, color_triangles, map_corners};
use super::textures::{Content, Textures};
use super::{Budget, DEFAULT_ALBEDO, LoadError, Loaded, colors, line_end, non_finite};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{DVec3, Vec2, Vec3};
use crate::scene::texture::{Encoding, Texture, decode};
use crate::scene::{
    Material, MaterialModel, Part, PhongMaterial, SceneDescription, TextureRef, offset,
};

/// A position in a PLY file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PlyPlace {
    /// A line of the header, from 1.
    Line(usize),
    /// A byte offset into the file.
    Byte(usize),
    /// A row of an element, from 0.
    Row {
        /// The element's name.
        element: String,
        /// The row.
        row: usize,
    },
}

impl fmt::Display for PlyPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Row { element, row } => write!(f, "{element} {row}"),
        }
    }
}

/// An error in a PLY file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlyErrorKind {
    /// The header does not end.
    #[error("the header has no end_header line; the file is truncated or not PLY")]
    NoEndOfHeader,
    /// A header line that is not PLY.
    #[error("'{text}' is not a valid header line")]
    HeaderLine {
        /// The line.
        text: String,
    },
    /// A header without a usable format line.
    #[error(
        "the header names no format; it needs ascii, binary_little_endian or binary_big_endian"
    )]
    NoFormat,
    /// A required element or property is missing.
    #[error("the header declares no {what}")]
    Missing {
        /// What is absent.
        what: &'static str,
    },
    /// More rows than the file can hold.
    #[error(
        "the header promises {count} rows of {element}, at least {needed} bytes, but only {left} \
         bytes follow; the file is truncated or its header is wrong"
    )]
    TooManyRows {
        /// The element.
        element: String,
        /// Its count in the header.
        count: u64,
        /// The bytes that these take at least.
        needed: u128,
        /// The bytes there are.
        left: usize,
    },
    /// The data ends too early.
    #[error("the file ends in the middle of the data")]
    EndOfFile,
    /// A token that is not a number.
    #[error("'{text}' is not a number")]
    NotANumber {
        /// The token.
        text: String,
    },
    /// A list length that is negative or fractional.
    #[error("a list cannot have {value} entries")]
    ListLength {
        /// The length.
        value: f64,
    },
    /// An index that is out of range.
    #[error("index {value} refers to no vertex; there are {vertices}")]
    Index {
        /// The index.
        value: f64,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A row with more values than the header says.
    #[error(
        "there are more values in the line than the header says; without --strict they are left out"
    )]
    ExtraValues,
    /// A vertex with a non-finite position.
    #[error("the position is not finite: {position}; without --strict its triangles are left out")]
    NotFinite {
        /// The position.
        position: Vec3,
    },
}

type Located<T> = Result<T, (PlyPlace, PlyErrorKind)>;

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    strict: bool,
) -> Result<Loaded, LoadError> {
    let error = |(place, kind)| LoadError::Ply { path: path.into(), place, kind: Box::new(kind) };
    let header = Header::parse(bytes).map_err(error)?;
    header.check_size(bytes.len() - header.length).map_err(error)?;
    budget.take(&path.display().to_string(), header.memory(bytes.len() - header.length))?;
    let Parsed { body, rest, n_extra } = parse(&header, bytes, strict).map_err(error)?;
    let mut warnings = Vec::new();
    let textures = read_textures(&header, &body, path, budget, strict, &mut warnings)?;
    let Body { mut mesh, faces, offset, non_finite_colors } = body;
    let triangle_faces = faces.finish(&mut mesh, !textures.is_empty());
    let mut loaded = Loaded::of_mesh(path, mesh);
    if !textures.is_empty() {
        apply(textures, &mut loaded.description, &triangle_faces);
    }
    loaded.description.offset = offset;
    loaded.warnings = warnings;
    loaded.warnings.extend(colors::warning(path, non_finite_colors));
    if n_extra > 0 {
        loaded.warnings.push(format!(
            "{}: {n_extra} rows have more values than the header says, which are left out",
            path.display()
        ));
    }
    if header.format == Format::Ascii && !rest.trim_ascii().is_empty() {
        loaded.warnings.push(format!(
            "{}: text follows the rows that the header counts, and is left out",
            path.display()
        ));
    }
    Ok(loaded)
}

/// The textures that a file names and has coordinates for.
struct TextureSet {
    images: Vec<Texture>,
    /// The image of each name; `None` if it cannot be read.
    of_name: Vec<Option<usize>>,
}

impl TextureSet {
    fn is_empty(&self) -> bool {
        self.images.is_empty()
    }
}

/// Reads textures. One that cannot be read is left out with a warning, unless the load is strict.
fn read_textures(
    header: &Header,
    body: &Body,
    path: &Path,
    budget: &Budget,
    strict: bool,
    warnings: &mut Vec<String>,
) -> Result<TextureSet, LoadError> {
    let has_uvs = !body.faces.uvs.is_empty() || !body.mesh.uvs.is_empty();
    let mut textures = Textures::new(budget);
    let mut of_name = Vec::new();
    for (line, name) in header.textures.iter().filter(|_| has_uvs) {
        let referrer = format!("{}, line {line}", path.display());
        of_name.push(match textures.named_in(path, name, Content::Color, &referrer) {
            Ok(index) => Some(index),
            Err(error) if !strict && error.is_about_one_image() => {
                warnings.push(format!("{error}; it is left out"));
                None
            }
            Err(error) => return Err(error),
        });
    }
    Ok(TextureSet { images: textures.loaded, of_name })
}

/// Gives each triangle the texture of its number, and divides the mesh by textures. Triangles of a texture that is not
/// there are gray.
fn apply(textures: TextureSet, description: &mut SceneDescription, triangle_textures: &[u32]) {
    let TextureSet { images, of_name } = textures;
    let image_of = |&number: &u32| of_name.get(number as usize).copied().flatten();
    let Some(Part { name, mesh, .. }) = description.parts.pop() else { return };
    description.materials.clear();
    for image in (0..images.len()).map(Some).chain([None]) {
        let triangles = mesh.triangles.iter().zip(triangle_textures);
        let of_image = triangles.filter(|(_, number)| image_of(number) == image);
        let triangles: Vec<_> = of_image.map(|(triangle, _)| *triangle).collect();
        if triangles.is_empty() {
            continue;
        }
        let material = description.materials.len();
        description.materials.push(match image {
            Some(image) => textured(image),
            None => Material::diffuse("default", DEFAULT_ALBEDO),
        });
        description.parts.push(Part {
            name: name.clone(),
            mesh: of_triangles(&mesh, &triangles),
            material,
        });
    }
    description.textures = images;
}

/// The mesh of some triangles.
fn of_triangles(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let mut known = HashMap::new();
    let mut part = Mesh::default();
    for triangle in triangles {
        part.triangles.push(triangle.map(|vertex| {
            *known.entry(vertex).or_insert_with(|| {
                let at = vertex as usize;
                part.positions.push(mesh.positions[at]);
                part.normals.extend(mesh.normals.get(at));
                part.uvs.extend(mesh.uvs.get(at));
                (part.positions.len() - 1) as u32
            })
        }));
    }
    part
}

/// A diffuse material of the colors of an image.
fn textured(image: usize) -> Material {
    let model = PhongMaterial {
        diffuse: Rgb::WHITE,
        diffuse_texture: Some(TextureRef::new(image)),
        specular: Rgb::BLACK,
        exponent: 0.0,
    };
    Material::new("default", MaterialModel::Phong(model))
}

/// What the rows hold.
struct Body {
    /// The vertices.
    mesh: Mesh,
    faces: Faces,
    /// What the positions are relative to.
    offset: DVec3,
    /// How many colors are NaN or infinite.
    non_finite_colors: usize,
}

struct Parsed<'a> {
    body: Body,
    /// What follows the rows that the header counts.
    rest: &'a [u8],
    /// The number of rows with more values than the header says.
    n_extra: usize,
}

fn parse<'a>(header: &Header, bytes: &'a [u8], strict: bool) -> Located<Parsed<'a>> {
    let data = &bytes[header.length..];
    let start = header.length;
    let mut n_extra = 0;
    let (body, position) = match header.format {
        Format::Ascii => {
            let mut numbers = Ascii::new(data, start, header, strict);
            let body = read_body(header, &mut numbers, strict)?;
            n_extra = numbers.n_extra;
            (body, numbers.position)
        }
        Format::Little => {
            let mut numbers = Binary::<false> { data, position: 0, start };
            (read_body(header, &mut numbers, strict)?, numbers.position)
        }
        Format::Big => {
            let mut numbers = Binary::<true> { data, position: 0, start };
            (read_body(header, &mut numbers, strict)?, numbers.position)
        }
    };
    Ok(Parsed { body, rest: &data[position..], n_extra })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// What an integer color is 1 at. Wider types than two bytes hold bytes.
    fn max(self) -> Option<f32> {
        match self {
            Self::I8 => Some(127.0),
            Self::U8 | Self::I16 | Self::I32 | Self::U32 => Some(255.0),
            Self::U16 => Some(65535.0),
            Self::F32 | Self::F64 => None,
        }
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    /// The type of a list's length; `None` for a single value.
    list: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
    line: usize,
}

#[derive(Debug)]
struct Header {
    format: Format,
    elements: Vec<Element>,
    /// The names of textures, each with its line.
    textures: Vec<(usize, String)>,
    /// In bytes, with the end of its last line.
    length: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Located<Self> {
        let (mut format, mut elements, mut length) = (None, Vec::<Element>::new(), 0);
        let mut textures = Vec::new();
        let end = line_end(bytes);
        for (index, line) in bytes.split_inclusive(|&b| b == end).enumerate() {
            length += line.len();
            let text = String::from_utf8_lossy(line);
            let words: Vec<&str> = text.split_whitespace().collect();
            let wrong = || {
                let text = text.trim().chars().take(80).collect();
                (PlyPlace::Line(index + 1), PlyErrorKind::HeaderLine { text })
            };
            match (words.as_slice(), elements.last_mut()) {
                (["ply"], _) if index == 0 => {}
                _ if index == 0 => return Err(wrong()),
                (["comment", "TextureFile", _, ..], _) => {
                    let name = text.split_once("TextureFile").map_or("", |(_, name)| name.trim());
                    textures.push((index + 1, name.to_owned()));
                }
                ([] | ["comment" | "obj_info", ..], _) => {}
                (["format", name, ..], _) => {
                    format = Some(match *name {
                        "ascii" => Format::Ascii,
                        "binary_little_endian" => Format::Little,
                        "binary_big_endian" => Format::Big,
                        _ => return Err(wrong()),
                    });
                }
                (["element", name, count], _) => elements.push(Element {
                    name: (*name).into(),
                    count: count.parse().map_err(|_| wrong())?,
                    properties: Vec::new(),
                    line: index + 1,
                }),
                (["property", "list", length, scalar, name], Some(element)) => {
                    let list = Some(Scalar::from_name(length).ok_or_else(wrong)?);
                    let scalar = Scalar::from_name(scalar).ok_or_else(wrong)?;
                    element.properties.push(Property { name: (*name).into(), list, scalar });
                }
                (["property", scalar, name], Some(element)) => {
                    let scalar = Scalar::from_name(scalar).ok_or_else(wrong)?;
                    element.properties.push(Property { name: (*name).into(), list: None, scalar });
                }
                (["end_header"], _) => {
                    let format =
                        format.ok_or((PlyPlace::Line(index + 1), PlyErrorKind::NoFormat))?;
                    return Ok(Self { format, elements, textures, length });
                }
                // What is neither is a comment without its keyword, as Blender 2.47 wrote.
                ([word, ..], _) if !["ply", "format", "element", "property"].contains(word) => {}
                _ => return Err(wrong()),
            }
        }
        Err((PlyPlace::Byte(bytes.len()), PlyErrorKind::NoEndOfHeader))
    }

    /// How many vertices are promised.
    fn vertices(&self) -> u64 {
        self.elements.iter().filter(|e| e.name == "vertex").map(|e| e.count).sum()
    }

    /// An estimate of what the mesh takes, of triangles and quadrilaterals; greater polygons are longer in the file too.
    /// Strips take what the `left` bytes of the file can hold.
    fn memory(&self, left: usize) -> u64 {
        let size = |element: &Element| match element.name.as_str() {
            // Position, normal, texture coordinate, color.
            "vertex" => element.count.saturating_mul(12 + 12 + 8 + 12),
            // Where it ends, its indices, and two triangles; with a color or texture coordinates, six vertices of their own.
            "face" => {
                let colors = if Colors::of(element).is_some() { 12 + 6 * 44 } else { 0 };
                let has_uvs = element.properties.iter().any(is_corner_uvs);
                let uvs = if has_uvs { 4 * 8 + 4 + 6 * 44 } else { 0 };
                element.count.saturating_mul(8 + 4 * 4 + 2 * 12 + colors + uvs)
            }
            "tristrips" => {
                let least = element.properties.iter().filter(|p| is_indices(p));
                let least = match self.format {
                    Format::Ascii => 2,
                    Format::Little | Format::Big => {
                        least.map(|p| p.scalar.size()).min().unwrap_or(1)
                    }
                };
                12 * (left / least) as u64
            }
            _ => 0,
        };
        self.elements.iter().map(size).fold(0, u64::saturating_add)
    }

    /// Refuses a header that promises more rows than `left` bytes can hold.
    fn check_size(&self, left: usize) -> Located<()> {
        let mut total = 0;
        for element in &self.elements {
            let row: usize = element
                .properties
                .iter()
                .map(|p| match self.format {
                    Format::Ascii => 2,
                    Format::Little | Format::Big => p.list.unwrap_or(p.scalar).size(),
                })
                .sum();
            // The last value of an ASCII file needs no separator.
            let slack = u128::from(self.format == Format::Ascii);
            let needed = u128::from(element.count) * row as u128;
            total += needed;
            // Rows without properties take no bytes; one byte per row bounds the loop over them.
            let rows = u128::from(element.count);
            if total > left as u128 + slack || rows > (left as u128 + slack) {
                let kind = PlyErrorKind::TooManyRows {
                    element: element.name.clone(),
                    count: element.count,
                    needed,
                    left,
                };
                return Err((PlyPlace::Line(element.line), kind));
            }
        }
        Ok(())
    }
}

/// The numbers of the body in order.
trait Numbers: Clone {
    fn next(&mut self, scalar: Scalar) -> Located<f64>;

    /// Passes over what the line of a row holds after its values, if rows are lines.
    fn end_row(&mut self) -> Located<()>;
}

#[derive(Clone)]
struct Ascii<'a> {
    data: &'a [u8],
    position: usize,
    start: usize,
    /// The byte that ends lines, if each row has one of its own.
    row_end: Option<u8>,
    /// The number of rows with more values than the header says.
    n_extra: usize,
    /// Whether there may be none.
    strict: bool,
}

impl<'a> Ascii<'a> {
    fn new(data: &'a [u8], start: usize, header: &Header, strict: bool) -> Self {
        let end = line_end(data);
        let lines = data.split(|&b| b == end).filter(|line| !line.trim_ascii().is_empty()).count();
        let rows: u64 = header.elements.iter().map(|element| element.count).sum();
        let row_end = (lines as u64 == rows).then_some(end);
        Self { data, position: 0, start, row_end, n_extra: 0, strict }
    }
}

impl Numbers for Ascii<'_> {
    #[inline]
    fn end_row(&mut self) -> Located<()> {
        let Some(end) = self.row_end else { return Ok(()) };
        let rest = &self.data[self.position..];
        let length = rest.iter().position(|&b| b == end).unwrap_or(rest.len());
        if !rest[..length].trim_ascii().is_empty() {
            if self.strict {
                let place = PlyPlace::Byte(self.start + self.position);
                return Err((place, PlyErrorKind::ExtraValues));
            }
            self.n_extra += 1;
        }
        self.position += length;
        Ok(())
    }

    #[inline]
    fn next(&mut self, _: Scalar) -> Located<f64> {
        let rest = &self.data[self.position..];
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
        let length =
            rest[begin..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - begin);
        let token = &rest[begin..begin + length];
        let place = || PlyPlace::Byte(self.start + self.position + begin);
        if token.is_empty() {
            return Err((place(), PlyErrorKind::EndOfFile));
        }
        let text = std::str::from_utf8(token).unwrap_or("");
        let value = text.parse().ok().or_else(|| non_finite::parse(text).map(f64::from));
        let value = value.ok_or_else(|| {
            let text = String::from_utf8_lossy(token).chars().take(40).collect();
            (place(), PlyErrorKind::NotANumber { text })
        })?;
        self.position += begin + length;
        Ok(value)
    }
}

#[derive(Clone)]
struct Binary<'a, const BIG: bool> {
    data: &'a [u8],
    position: usize,
    start: usize,
}

impl<const BIG: bool> Binary<'_, BIG> {
    #[inline]
    fn bytes<const N: usize>(&mut self) -> Located<[u8; N]> {
        let Some(bytes) = self.data[self.position..].first_chunk::<N>() else {
            return Err((PlyPlace::Byte(self.start + self.position), PlyErrorKind::EndOfFile));
        };
        self.position += N;
        let mut bytes = *bytes;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    #[inline]
    fn end_row(&mut self) -> Located<()> {
        Ok(())
    }

    #[inline]
    fn next(&mut self, scalar: Scalar) -> Located<f64> {
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes(self.bytes()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.bytes()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.bytes()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.bytes()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.bytes()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.bytes()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.bytes()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }
}

fn read_body(header: &Header, numbers: &mut impl Numbers, strict: bool) -> Located<Body> {
    let mut mesh = Mesh::default();
    let mut offset = None;
    let mut non_finite_colors = 0;
    let mut faces = Faces::default();
    let (mut has_vertices, mut has_faces) = (false, false);
    let vertices = header.vertices();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => {
                has_vertices = true;
                let rows = VertexRows::new(element)?;
                let offset = *offset.get_or_insert_with(|| rows.offset(numbers.clone()));
                non_finite_colors += rows.read(numbers, offset, &mut mesh, strict)?;
            }
            "face" => {
                has_faces = true;
                non_finite_colors += read_faces(element, numbers, vertices, &mut faces)?;
            }
            "tristrips" => {
                has_faces = true;
                read_strips(element, numbers, vertices, &mut faces.strips)?;
            }
            _ => skip(element, numbers)?,
        }
    }
    let end = PlyPlace::Line(header.elements.last().map_or(1, |e| e.line));
    if !has_vertices {
        return Err((end, PlyErrorKind::Missing { what: "element vertex" }));
    }
    if !has_faces {
        return Err((
            end,
            PlyErrorKind::Missing { what: "element face; points alone cannot be rendered" },
        ));
    }
    let offset = offset.unwrap_or_default();
    Ok(Body { mesh, faces, offset, non_finite_colors })
}

/// What is read of a vertex, each with its names; the number is the slot in a row of values.
const SLOTS: [&[&str]; 11] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u"],
    &["v", "t", "texture_v"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
];

fn slot_of(property: &Property) -> Option<usize> {
    let name = property.name.as_str();
    SLOTS.iter().position(|names| property.list.is_none() && names.contains(&name))
}

/// How an element's red, green and blue are written.
#[derive(Clone, Copy)]
struct Colors {
    /// The largest value of an integer type.
    max: Option<f32>,
}

impl Colors {
    const RED: usize = 8;

    /// None if the element lacks one of the three.
    fn of(element: &Element) -> Option<Self> {
        let of_slot = |slot| element.properties.iter().find(|p| slot_of(p) == Some(slot));
        let [red, ..] = [of_slot(Self::RED)?, of_slot(Self::RED + 1)?, of_slot(Self::RED + 2)?];
        Some(Self { max: red.scalar.max() })
    }

    /// Makes colors linear, and returns how many are not finite.
    fn linearize(self, colors: &mut [Rgb]) -> usize {
        let Some(max) = self.max else { return colors::linearize(colors) };
        for color in colors {
            *color = color.map(|c| decode(c / max, Encoding::Srgb));
        }
        0
    }
}

/// The rows of the element `vertex`.
struct VertexRows<'a> {
    element: &'a Element,
    /// The slot of each property that is read.
    slots: Vec<Option<usize>>,
}

impl<'a> VertexRows<'a> {
    fn new(element: &'a Element) -> Located<Self> {
        let rows = Self { element, slots: element.properties.iter().map(slot_of).collect() };
        let missing = PlyErrorKind::Missing { what: "vertex properties x, y and z" };
        if rows.has(0..3) { Ok(rows) } else { Err((PlyPlace::Line(element.line), missing)) }
    }

    fn has(&self, mut wanted: std::ops::Range<usize>) -> bool {
        wanted.all(|slot| self.slots.contains(&Some(slot)))
    }

    /// The values of the next row.
    fn row(&self, numbers: &mut impl Numbers) -> Located<[f64; SLOTS.len()]> {
        let mut values = [0.0; SLOTS.len()];
        for (property, slot) in self.element.properties.iter().zip(&self.slots) {
            match (property.list, slot) {
                (None, Some(slot)) => values[*slot] = numbers.next(property.scalar)?,
                _ => skip_property(property, numbers)?,
            }
        }
        numbers.end_row()?;
        Ok(values)
    }

    /// What positions are to be relative to. Rows that cannot be read are reported by [`Self::read`].
    fn offset(&self, mut numbers: impl Numbers) -> DVec3 {
        let rows = (0..self.element.count).map_while(|_| self.row(&mut numbers).ok());
        offset::of_points(rows.map(|[x, y, z, ..]| DVec3::new(x, y, z)))
    }

    /// Reads positions and what comes with them, and returns how many colors are not finite.
    fn read(
        &self,
        numbers: &mut impl Numbers,
        offset: DVec3,
        mesh: &mut Mesh,
        strict: bool,
    ) -> Located<usize> {
        let Self { element, .. } = self;
        let (normals, uvs, colors) = (self.has(3..6), self.has(6..8), Colors::of(element));
        mesh.positions.reserve(element.count as usize);
        for row in 0..element.count as usize {
            let values = self.row(numbers)?;
            let [x, y, z, ..] = values;
            let position = (DVec3::new(x, y, z) - offset).as_vec3();
            if strict && !position.is_finite() {
                let place = PlyPlace::Row { element: element.name.clone(), row };
                return Err((place, PlyErrorKind::NotFinite { position }));
            }
            mesh.positions.push(position);
            let [_, _, _, nx, ny, nz, u, v, r, g, b] = values.map(|value| value as f32);
            if normals {
                mesh.normals.push(Vec3::new(nx, ny, nz).normalize_or_zero());
            }
            if uvs {
                mesh.uvs.push(Vec2::new(u, 1.0 - v));
            }
            mesh.colors.extend(colors.map(|_| Rgb::new(r, g, b)));
        }
        Ok(colors.map_or(0, |colors| colors.linearize(&mut mesh.colors)))
    }
}

/// What the triangles are made of.
#[derive(Default)]
struct Faces {
    polygons: Polygons,
    /// One a polygon, or none.
    colors: Vec<Rgb>,
    /// One a corner of the polygons, or none.
    uvs: Vec<Vec2>,
    /// The number of each polygon's texture; empty if the file does not say.
    textures: Vec<u32>,
    /// Triangles of strips.
    strips: Vec<[u32; 3]>,
}

impl Faces {
    /// Adds the triangles to the vertices, with colors or else texture coordinates of faces, and returns the number of the
    /// texture of each.
    fn finish(self, mesh: &mut Mesh, is_textured: bool) -> Vec<u32> {
        let polygons = self.polygons.corner_triangles(&mesh.positions);
        mesh.triangles = polygons.iter().map(|(t, _)| self.polygons.vertices(*t)).collect();
        mesh.triangles.extend(&self.strips);
        if mesh.normals.is_empty() {
            mesh.compute_normals();
        }
        if is_textured {
            mesh.colors.clear();
            if !self.uvs.is_empty() {
                let uvs = polygons.iter().map(|(t, _)| t.map(|corner| self.uvs[corner]));
                let of_strips = self.strips.iter().map(|_| [Vec2::ZERO; 3]);
                *mesh = map_corners(mesh, uvs.chain(of_strips));
            }
        } else if mesh.colors.is_empty() && !self.colors.is_empty() {
            let colors = polygons.iter().map(|&(_, face)| self.colors[face]);
            let of_strips = self.strips.iter().map(|_| DEFAULT_ALBEDO);
            *mesh = color_triangles(mesh, colors.chain(of_strips));
        }
        let texture = |face: usize| self.textures.get(face).copied().unwrap_or(0);
        let of_polygons = polygons.iter().map(|&(_, face)| texture(face));
        of_polygons.chain(self.strips.iter().map(|_| 0)).collect()
    }
}

/// Texture coordinates of a face's corners.
fn is_corner_uvs(p: &Property) -> bool {
    p.list.is_some() && p.name == "texcoord"
}

/// The number of a face's texture.
fn is_texture_number(p: &Property) -> bool {
    p.list.is_none() && p.name == "texnumber"
}

fn is_indices(p: &Property) -> bool {
    p.list.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index")
}

/// Refuses an element without a list of vertices.
fn require_indices(element: &Element) -> Located<()> {
    let what = match element.name.as_str() {
        "face" => "face property list vertex_indices",
        _ => "tristrips property list vertex_indices",
    };
    let missing = (PlyPlace::Line(element.line), PlyErrorKind::Missing { what });
    if element.properties.iter().any(is_indices) { Ok(()) } else { Err(missing) }
}

/// A vertex that is there.
fn index(value: f64, vertices: u64, element: &Element, row: usize) -> Located<u32> {
    if value >= 0.0 && value < vertices as f64 && value.fract() == 0.0 {
        return Ok(value as u32);
    }
    let place = PlyPlace::Row { element: element.name.clone(), row };
    Err((place, PlyErrorKind::Index { value, vertices: vertices as usize }))
}

/// Reads polygons and their colors, and returns how many colors are not finite.
fn read_faces(
    element: &Element,
    numbers: &mut impl Numbers,
    vertices: u64,
    out: &mut Faces,
) -> Located<usize> {
    require_indices(element)?;
    let colors = Colors::of(element);
    let has_uvs = element.properties.iter().any(is_corner_uvs);
    let has_numbers = element.properties.iter().any(is_texture_number);
    let mut uvs = Vec::new();
    for row in 0..element.count as usize {
        let mut rgb = [0.0; 3];
        let mut texture = 0;
        uvs.clear();
        for property in &element.properties {
            let color = slot_of(property).and_then(|slot| slot.checked_sub(Colors::RED));
            if is_indices(property) {
                for _ in 0..list_length(property, numbers, &element.name, row)? {
                    let value = numbers.next(property.scalar)?;
                    out.polygons.push(index(value, vertices, element, row)?);
                }
            } else if is_corner_uvs(property) {
                for _ in 0..list_length(property, numbers, &element.name, row)? {
                    uvs.push(numbers.next(property.scalar)? as f32);
                }
            } else if is_texture_number(property) {
                let number = numbers.next(property.scalar)?;
                texture = if number >= 0.0 { number as u32 } else { u32::MAX };
            } else if let Some(channel) = color {
                rgb[channel] = numbers.next(property.scalar)? as f32;
            } else {
                skip_property(property, numbers)?;
            }
        }
        numbers.end_row()?;
        out.polygons.end();
        out.colors.extend(colors.map(|_| Rgb::from(rgb)));
        if has_uvs {
            // A corner without a pair of numbers is at the origin of the texture.
            let origin = Vec2::new(0.0, 1.0);
            let uv = |&[u, v]: &[f32; 2]| Vec2::new(u, 1.0 - v);
            let pairs = uvs.as_chunks().0.iter().map(uv);
            out.uvs.extend(pairs.map(|uv| if uv.is_finite() { uv } else { origin }));
            out.uvs.resize(out.polygons.n_corners(), origin);
        }
        if has_numbers {
            out.textures.push(texture);
        }
    }
    Ok(colors.map_or(0, |colors| colors.linearize(&mut out.colors)))
}

/// Every corner after the second of a strip makes a triangle with the two before it, every other one turned.
fn read_strips(
    element: &Element,
    numbers: &mut impl Numbers,
    vertices: u64,
    out: &mut Vec<[u32; 3]>,
) -> Located<()> {
    require_indices(element)?;
    for row in 0..element.count as usize {
        for property in &element.properties {
            if !is_indices(property) {
                skip_property(property, numbers)?;
                continue;
            }
            let (mut before, mut n) = ([0; 2], 0);
            for _ in 0..list_length(property, numbers, &element.name, row)? {
                let value = numbers.next(property.scalar)?;
                if value == -1.0 {
                    n = 0;
                    continue;
                }
                let corner = index(value, vertices, element, row)?;
                let [a, b] = before;
                // A corner twice in a row joins strips.
                let is_triangle = n >= 2 && a != b && b != corner && a != corner;
                if is_triangle {
                    out.push(if n % 2 == 0 { [a, b, corner] } else { [b, a, corner] });
                }
                (before, n) = ([b, corner], n + 1);
            }
        }
        numbers.end_row()?;
    }
    Ok(())
}

fn list_length(
    property: &Property,
    numbers: &mut impl Numbers,
    element: &str,
    row: usize,
) -> Located<u64> {
    let value = property.list.map_or(Ok(1.0), |length| numbers.next(length))?;
    if value < 0.0 || value.fract() != 0.0 || value > f64::from(u32::MAX) {
        let place = PlyPlace::Row { element: element.into(), row };
        return Err((place, PlyErrorKind::ListLength { value }));
    }
    Ok(value as u64)
}

fn skip_property(property: &Property, numbers: &mut impl Numbers) -> Located<()> {
    for _ in 0..list_length(property, numbers, &property.name, 0)? {
        numbers.next(property.scalar)?;
    }
    Ok(())
}

fn skip(element: &Element, numbers: &mut impl Numbers) -> Located<()> {
    for _ in 0..element.count {
        for property in &element.properties {
            skip_property(property, numbers)?;
        }
        numbers.end_row()?;
    }
    Ok(())
}
