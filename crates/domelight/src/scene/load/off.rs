//! OFF, the Object File Format of Geomview and of collections of meshes.
//!
//! The reader supports the header words `OFF`, `COFF` (colors of vertices), `NOFF` (normals), `STOFF` (texture
//! coordinates), `4OFF` (homogeneous coordinates) and their compounds, or none; the counts on the same line or even
//! in the same word; comments after `#`; polygons of any shape; and face colors after the indices, with one number
//! for gray, three or four ([`super::colors`]). Opacity and indices into color maps are ignored. Vertices without
//! normals get smooth ones.
//!
//! <http://www.geomview.org/docs/html/OFF.html>. Binary files and files with other dimensions are rejected with a
//! message.

use std::path::Path;

use super::colors::ColorScale;
use super::faces::{Polygons, color_triangles};
use super::{Budget, DEFAULT_ALBEDO, LoadError, Loaded, colors, line_end, non_finite};
use crate::Rgb;
use crate::geometry::Mesh;
use crate::math::{DVec3, Vec2};
use crate::scene::offset;

/// An error in an OFF file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OffErrorKind {
    /// An unsupported kind of OFF file.
    #[error("{kind} files are not read; write it as plain OFF or as PLY")]
    Unsupported {
        /// The header word.
        kind: String,
    },
    /// The numbers of vertices and faces are missing.
    #[error("'{text}' are not the numbers of vertices, faces and edges")]
    Counts {
        /// What stands there.
        text: String,
    },
    /// The file ends too early.
    #[error(
        "the file ends after {found} of {promised} {what}; it is truncated or its header is wrong"
    )]
    EndOfFile {
        /// Vertices or faces.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many the header promises.
        promised: usize,
    },
    /// A word that is not a finite number.
    #[error("'{text}' is not a finite number")]
    NotANumber {
        /// The word.
        text: String,
    },
    /// An index that is out of range.
    #[error("index {text} refers to no vertex; there are {vertices}")]
    Index {
        /// The index.
        text: String,
        /// How many vertices there are.
        vertices: usize,
    },
}

type Located<T> = Result<T, (usize, OffErrorKind)>;

/// Memory of a mesh for each byte of its text: a vertex is 6 bytes or more and takes 44, a triangle with a color 14 and
/// takes up to 144.
const MEMORY_PER_BYTE: u64 = 12;

/// Whether the first word says so, whatever the file's name.
pub(super) fn is_off(bytes: &[u8]) -> bool {
    let start = &bytes[..bytes.len().min(64)];
    let word = start.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    std::str::from_utf8(word).is_ok_and(|word| Kind::parse(word).is_some())
}

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    strict: bool,
) -> Result<Loaded, LoadError> {
    budget.take(&path.display().to_string(), MEMORY_PER_BYTE * bytes.len() as u64)?;
    let error = |(line, kind)| LoadError::Off { path: path.into(), line, kind };
    let Read { mesh, offset, non_finite_colors } = read(bytes, strict).map_err(error)?;
    let mut loaded = Loaded::of_mesh(path, mesh);
    loaded.description.offset = offset;
    loaded.warnings.extend(colors::warning(path, non_finite_colors));
    Ok(loaded)
}

/// What the header word says of vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Kind {
    uvs: bool,
    colors: bool,
    normals: bool,
    coordinates: Coordinates,
}

/// How many coordinates a position has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Coordinates {
    #[default]
    Three,
    /// With a divisor.
    Homogeneous,
    /// As many as the file says.
    Any,
}

impl Kind {
    /// `[ST][C][N][4][n]OFF`, and what stands after it in the word.
    fn parse(word: &str) -> Option<(Self, &str)> {
        let mut kind = Self::default();
        let (mut letters, after) = word.split_once("OFF")?;
        let mut take = |prefix: &str| {
            let rest = letters.strip_prefix(prefix);
            letters = rest.unwrap_or(letters);
            rest.is_some()
        };
        kind.uvs = take("ST");
        kind.colors = take("C");
        kind.normals = take("N");
        if take("4") {
            kind.coordinates = Coordinates::Homogeneous;
        }
        if take("n") {
            kind.coordinates = Coordinates::Any;
        }
        letters.is_empty().then_some((kind, after))
    }
}

type Lines<'a> = std::iter::Enumerate<std::slice::Split<'a, u8, fn(&u8) -> bool>>;

/// A file's words, line by line, without comments.
#[derive(Clone)]
struct Words<'a> {
    lines: Lines<'a>,
    /// The line, from 1.
    line: usize,
    /// What is left of it.
    rest: std::str::SplitWhitespace<'a>,
    /// Every vertex and every face has a line of its own, which may hold more than is read.
    by_line: bool,
    /// Whether numbers must be finite.
    strict: bool,
}

impl<'a> Words<'a> {
    fn new(bytes: &'a [u8], strict: bool) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let is_end: fn(&u8) -> bool =
            if line_end(bytes) == b'\r' { |&b| b == b'\r' } else { |&b| b == b'\n' };
        let rest = "".split_whitespace();
        Self { lines: bytes.split(is_end).enumerate(), line: 0, rest, by_line: true, strict }
    }

    /// The next word of this line or of the next.
    fn next(&mut self) -> Option<&'a str> {
        loop {
            if let Some(word) = self.rest.next() {
                return Some(word);
            }
            let (index, line) = self.lines.next()?;
            self.line = index + 1;
            let text = line.split(|&b| b == b'#').next().unwrap_or_default();
            // What is no text is no number either.
            self.rest = std::str::from_utf8(text).unwrap_or("\u{fffd}").split_whitespace();
        }
    }

    fn number(&mut self, ended: &impl Fn() -> OffErrorKind) -> Located<f32> {
        Ok(self.precise_number(ended)? as f32)
    }

    fn precise_number(&mut self, ended: &impl Fn() -> OffErrorKind) -> Located<f64> {
        let word = self.next().ok_or_else(|| (self.line, ended()))?;
        let value = match non_finite::parse(word) {
            Some(value) if !self.strict => value,
            _ => number(word).map_err(|kind| (self.line, kind))?,
        };
        Ok(word.parse().unwrap_or_else(|_| value.into()))
    }

    fn vector(&mut self, ended: &impl Fn() -> OffErrorKind) -> Located<DVec3> {
        let mut number = || self.precise_number(ended);
        Ok(DVec3::new(number()?, number()?, number()?))
    }

    /// The words that are left of a line, none where lines mean nothing.
    fn rest_of_line(&mut self) -> Vec<&'a str> {
        if self.by_line { self.rest.by_ref().collect() } else { Vec::new() }
    }
}

fn number(word: &str) -> Result<f32, OffErrorKind> {
    let value = word.parse().ok().filter(|v: &f32| v.is_finite());
    value.ok_or_else(|| OffErrorKind::NotANumber { text: word.chars().take(40).collect() })
}

/// What a file holds.
struct Read {
    mesh: Mesh,
    /// What the positions are relative to.
    offset: DVec3,
    /// How many colors are NaN or infinite.
    non_finite_colors: usize,
}

fn read(bytes: &[u8], strict: bool) -> Located<Read> {
    let mut words = Words::new(bytes, strict);
    let end = line_end(bytes);
    let lines = bytes.split(|&b| b == end).count();
    let (kind, vertices, faces) = header(&mut words, lines)?;
    let offset = offset_of(words.clone(), kind, vertices);
    let mut mesh = Mesh::default();
    let mut vertex_colors = Colors::default();
    for found in 0..vertices {
        let ended = || OffErrorKind::EndOfFile { what: "vertices", found, promised: vertices };
        let position = read_vertex(&mut words, kind, &mut mesh, &mut vertex_colors, &ended)?;
        let position = (position - offset).as_vec3();
        if strict && !position.is_finite() {
            let text = position.to_string();
            return Err((words.line, OffErrorKind::NotANumber { text }));
        }
        mesh.positions.push(position);
    }
    let mut polygons = Polygons::default();
    let mut face_colors = Colors::default();
    for found in 0..faces {
        let ended = || OffErrorKind::EndOfFile { what: "faces", found, promised: faces };
        read_face(&mut words, vertices, &mut polygons, &ended)?;
        let color = words.rest_of_line();
        face_colors.add(&color).map_err(|kind| (words.line, kind))?;
    }
    let mut non_finite_colors = 0;
    if kind.colors {
        let (colors, non_finite) = vertex_colors.linear();
        mesh.colors = colors.into_iter().map(|c| c.unwrap_or(Rgb::WHITE)).collect();
        non_finite_colors = non_finite;
    }
    let triangles = polygons.triangles(&mesh.positions);
    mesh.triangles = triangles.iter().map(|(triangle, _)| *triangle).collect();
    if mesh.normals.is_empty() {
        mesh.compute_normals();
    }
    let (face_colors, non_finite) = face_colors.linear();
    if mesh.colors.is_empty() && face_colors.iter().any(Option::is_some) {
        let of = |&(_, face): &([u32; 3], usize)| face_colors[face].unwrap_or(DEFAULT_ALBEDO);
        mesh = color_triangles(&mesh, triangles.iter().map(of));
        non_finite_colors = non_finite;
    }
    Ok(Read { mesh, offset, non_finite_colors })
}

/// The kind, and how many vertices and faces are promised, in a file of so many lines.
fn header(words: &mut Words, lines: usize) -> Located<(Kind, usize, usize)> {
    let mut next = || (words.next().unwrap_or_default(), words.line);
    let (first, line) = next();
    let (kind, count) = match Kind::parse(first) {
        // Counts may stand in the same word: OFF8 6 12.
        Some((kind, "")) => (kind, next().0),
        Some((kind, count)) => (kind, count),
        // Geomview takes a file without the word.
        None => (Kind::default(), first),
    };
    let unsupported = |kind: &str| (line, OffErrorKind::Unsupported { kind: kind.into() });
    if count == "BINARY" {
        return Err(unsupported("binary OFF"));
    }
    if kind.coordinates == Coordinates::Any {
        return Err(unsupported("nOFF"));
    }
    let parse = |text: &str, line: usize| {
        let wrong = |_| (line, OffErrorKind::Counts { text: text.chars().take(40).collect() });
        text.parse::<usize>().map_err(wrong)
    };
    let vertices = parse(count, line)?;
    let (second, line) = next();
    let faces = parse(second, line)?;
    words.by_line = vertices.saturating_add(faces) < lines;
    // The number of edges counts for nothing; where lines mean something, some leave it out.
    if words.by_line {
        let _ = words.rest_of_line();
    } else {
        let _ = words.next();
    }
    Ok((kind, vertices, faces))
}

/// What positions are to be relative to. Vertices that cannot be read are reported when they are read again.
fn offset_of(mut words: Words, kind: Kind, vertices: usize) -> DVec3 {
    let ended = || OffErrorKind::EndOfFile { what: "vertices", found: 0, promised: vertices };
    offset::of_points((0..vertices).map_while(|_| {
        let (mut mesh, mut colors) = (Mesh::default(), Colors::default());
        read_vertex(&mut words, kind, &mut mesh, &mut colors, &ended).ok()
    }))
}

/// Reads what comes with a vertex, and returns its position.
fn read_vertex(
    words: &mut Words,
    kind: Kind,
    mesh: &mut Mesh,
    colors: &mut Colors,
    ended: &impl Fn() -> OffErrorKind,
) -> Located<DVec3> {
    let mut position = words.vector(ended)?;
    if kind.coordinates == Coordinates::Homogeneous {
        let w = words.precise_number(ended)?;
        position /= if w == 0.0 { 1.0 } else { w };
    }
    if kind.normals {
        mesh.normals.push(words.vector(ended)?.as_vec3().normalize_or_zero());
    }
    if kind.colors {
        let uvs = 2 * usize::from(kind.uvs);
        // Three numbers or four: opacity is left out at times.
        let left = if words.by_line { words.rest.clone().count() } else { 4 + uvs };
        let n = left.saturating_sub(uvs).clamp(3, 4);
        let mut color = Vec::with_capacity(n);
        for _ in 0..n {
            color.push(words.next().ok_or_else(|| (words.line, ended()))?);
        }
        colors.add(&color).map_err(|kind| (words.line, kind))?;
    }
    if kind.uvs {
        mesh.uvs.push(Vec2::new(words.number(ended)?, 1.0 - words.number(ended)?));
    }
    // What the header word does not name.
    let _ = words.rest_of_line();
    Ok(position)
}

fn read_face(
    words: &mut Words,
    vertices: usize,
    polygons: &mut Polygons,
    ended: &impl Fn() -> OffErrorKind,
) -> Located<()> {
    let short = |word: &str| word.chars().take(40).collect();
    let word = words.next().ok_or_else(|| (words.line, ended()))?;
    let wrong = |_| (words.line, OffErrorKind::NotANumber { text: short(word) });
    let n: usize = word.parse().map_err(wrong)?;
    for _ in 0..n {
        let word = words.next().ok_or_else(|| (words.line, ended()))?;
        let index = word.parse().ok().filter(|&i: &u32| (i as usize) < vertices);
        let wrong = || (words.line, OffErrorKind::Index { text: short(word), vertices });
        polygons.push(index.ok_or_else(wrong)?);
    }
    polygons.end();
    Ok(())
}

/// Colors as they are written, none where a file has an index into a color map that nobody has.
#[derive(Default)]
struct Colors(Vec<Option<Rgb>>);

impl Colors {
    /// Three numbers or four are a color.
    fn add(&mut self, words: &[&str]) -> Result<(), OffErrorKind> {
        let value = |word| non_finite::parse(word).map_or_else(|| number(word), Ok);
        self.0.push(match words {
            [r, g, b, ..] => Some(Rgb::new(value(r)?, value(g)?, value(b)?)),
            _ => None,
        });
        Ok(())
    }

    /// Linear colors, and how many are not finite.
    fn linear(self) -> (Vec<Option<Rgb>>, usize) {
        let scale = ColorScale::of(self.0.iter().copied().flatten());
        let linear = self.0.into_iter().map(|color| color.map(|color| scale.linear(color)));
        (linear.collect(), scale.non_finite)
    }
}
