//! STL, the format of 3D printers: ASCII, with one part per solid, and binary.
//!
//! Facets share no vertices and shade flat. Their normals follow from the order of their corners, as in most programs,
//! because files often have wrong normals or none. The colors in the two bytes after a binary facet mean different
//! things to different programs and are ignored.
//!
//! 3D Systems 1989, "StereoLithography Interface Specification". A binary file may begin with `solid`, too, and some
//! programs append bytes of their own: a file is binary if it is as long as its count of facets says, or longer and its
//! header is not text.
//!
//! We do not use the crate stl_io, because it reads one solid and allocates memory for as many facets as a header
//! claims.

use std::path::Path;

use super::{Budget, DEFAULT_ALBEDO, LoadError, Loaded, non_finite, stem, text_of};
use crate::geometry::Mesh;
use crate::math::{DVec3, Vec3};
use crate::scene::{Material, Part, SceneDescription, offset};

/// An error in an STL file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StlErrorKind {
    /// Neither text nor a binary file of the right length.
    #[error(
        "neither text that begins with 'solid' nor a binary file: its header promises {facets} facets, \
         {needed} bytes, but it has {held}; the file is truncated or not STL"
    )]
    Length {
        /// The count in the header.
        facets: u32,
        /// The bytes that these take, with the header.
        needed: u64,
        /// The bytes there are.
        held: usize,
    },
    /// A vertex that cannot be read.
    #[error("line {line}: '{text}' is not a vertex; it needs three finite numbers")]
    Vertex {
        /// The line, from 1.
        line: usize,
        /// What stands there.
        text: String,
    },
    /// A facet that is not a triangle.
    #[error("line {line}: a facet of {corners} vertices; it needs three")]
    Facet {
        /// The line at which the facet ends, from 1.
        line: usize,
        /// How many it has.
        corners: usize,
    },
    /// Text that ends within a solid.
    #[error(
        "line {line}: the text ends here without 'endsolid', so the file may be truncated; without --strict the facets \
         before are drawn"
    )]
    Unended {
        /// The last line that is not empty, from 1.
        line: usize,
    },
    /// A vertex of a binary file at no place.
    #[error(
        "facet {facet}: the position is not finite: {position}; without --strict the facet is left out"
    )]
    NotFinite {
        /// The facet, from 0.
        facet: usize,
        /// The position.
        position: Vec3,
    },
}

/// The header and the count of facets.
const HEADER: usize = 84;
/// A facet: normal, three vertices and two bytes.
const FACET: usize = 50;
/// Memory of a mesh for each byte of text: a vertex line is some 15 bytes or more and takes 12, a third of a facet's
/// indices 4.
const MEMORY_PER_BYTE: u64 = 2;

/// Whether the bytes are an STL file, whatever its name.
pub(super) fn is_stl(bytes: &[u8]) -> bool {
    facets(bytes).is_some() || is_text(bytes)
}

pub(super) fn load(
    path: &Path,
    bytes: &[u8],
    budget: &Budget,
    strict: bool,
) -> Result<Loaded, LoadError> {
    let error = |kind| LoadError::Stl { path: path.into(), kind };
    let name = path.display().to_string();
    let mut warnings = Vec::new();
    let (parts, offset) = if let Some(facets) = facets(bytes) {
        budget.take(&name, facets as u64 * (3 * 12 + 12))?;
        let (counted, rest) = bytes[HEADER..].split_at(facets * FACET);
        if !rest.is_empty() && rest.len().is_multiple_of(FACET) {
            warnings.push(format!(
                "{name}: the header counts {facets} facets; bytes of {} more follow and are left out",
                rest.len() / FACET
            ));
        }
        let offset = offset::of_points(facet_vertices(counted));
        (vec![(stem(path), binary(counted, offset, strict).map_err(error)?)], offset)
    } else if is_text(bytes) {
        budget.take(&name, MEMORY_PER_BYTE * bytes.len() as u64)?;
        let offset = offset::of_points(text_vertices(bytes));
        let Solids { parts, unended } = ascii(path, bytes, offset, strict).map_err(error)?;
        warnings.extend(unended.map(|line| {
            format!(
                "{name}, line {line}: the text ends here without 'endsolid'; the file may be truncated"
            )
        }));
        (parts, offset)
    } else {
        let count = bytes.get(80..HEADER).and_then(|b| b.try_into().ok());
        let facets = count.map_or(0, u32::from_le_bytes);
        let needed = HEADER as u64 + FACET as u64 * u64::from(facets);
        return Err(error(StlErrorKind::Length { facets, needed, held: bytes.len() }));
    };
    let parts = parts.into_iter().filter(|(_, mesh)| !mesh.triangles.is_empty());
    let description = SceneDescription {
        parts: parts.map(|(name, mesh)| Part { name, mesh, material: 0 }).collect(),
        materials: vec![Material::diffuse("default", DEFAULT_ALBEDO)],
        offset,
        ..SceneDescription::default()
    };
    Ok(Loaded { description, warnings, ..Loaded::default() })
}

/// Whether it begins as text does. Zeros are in binary headers, or where a name was padded in text that has facets.
fn is_text(bytes: &[u8]) -> bool {
    let is_facet = |word: &[u8]| word.eq_ignore_ascii_case(b"facet");
    begins_with_solid(bytes) && (!has_zeros(bytes) || bytes.windows(5).any(is_facet))
}

fn begins_with_solid(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

/// Whether there are zeros where a binary file has its header. The bytes of a count below 2²⁴ include one.
fn has_zeros(bytes: &[u8]) -> bool {
    bytes.iter().take(HEADER).any(|&b| b == 0)
}

/// How many facets a binary file has; none if it is no binary file. Some programs append bytes of their own.
fn facets(bytes: &[u8]) -> Option<usize> {
    let count = u32::from_le_bytes(*bytes.get(80..)?.first_chunk()?) as usize;
    let needed = count.checked_mul(FACET)?.checked_add(HEADER)?;
    let may_be_longer = count > 0 && (!begins_with_solid(bytes) || has_zeros(bytes));
    let fits = bytes.len() == needed || (bytes.len() > needed && may_be_longer);
    fits.then_some(count)
}

fn binary(bytes: &[u8], offset: DVec3, strict: bool) -> Result<Mesh, StlErrorKind> {
    let mut mesh = Mesh::default();
    for (i, position) in facet_vertices(bytes).enumerate() {
        let position = (position - offset).as_vec3();
        if strict && !position.is_finite() {
            return Err(StlErrorKind::NotFinite { facet: i / 3, position });
        }
        mesh.positions.push(position);
        if i % 3 == 2 {
            add_facet(&mut mesh);
        }
    }
    Ok(mesh)
}

/// The vertices of binary facets, three each.
fn facet_vertices(bytes: &[u8]) -> impl Iterator<Item = DVec3> {
    bytes.as_chunks::<FACET>().0.iter().flat_map(|bytes| {
        let number = |i: usize| f32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[4 * i + k])).into();
        [3, 6, 9].map(|i| DVec3::new(number(i), number(i + 1), number(i + 2)))
    })
}

/// The vertices of a text.
fn text_vertices(bytes: &[u8]) -> impl Iterator<Item = DVec3> {
    bytes.split(|&b| b == b'\n' || b == b'\r').filter_map(|line| {
        let text = text_of(line);
        let (keyword, rest) = text.trim().split_once(char::is_whitespace)?;
        if keyword.eq_ignore_ascii_case("vertex") { precise_vertex(rest) } else { None }
    })
}

/// The solids of a text.
struct Solids {
    parts: Vec<(String, Mesh)>,
    /// The last line, if the last solid does not end.
    unended: Option<usize>,
}

fn ascii(path: &Path, bytes: &[u8], offset: DVec3, strict: bool) -> Result<Solids, StlErrorKind> {
    let mut solids: Vec<(String, Mesh)> = Vec::new();
    let mut corners = 0;
    let mut unended = None;
    for (index, line) in bytes.split(|&b| b == b'\n' || b == b'\r').enumerate() {
        let text = text_of(line);
        let text = text.trim();
        let (keyword, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let line = index + 1;
        if !text.is_empty() {
            unended = unended.map(|_| line);
        }
        if keyword.eq_ignore_ascii_case("solid") {
            if corners > 0 {
                return Err(StlErrorKind::Facet { line, corners });
            }
            let name = if rest.trim().is_empty() { stem(path) } else { rest.trim().to_owned() };
            solids.push((name, Mesh::default()));
            unended = Some(line);
        } else if keyword.eq_ignore_ascii_case("endsolid") {
            unended = None;
        } else if keyword.eq_ignore_ascii_case("vertex") {
            let Some((_, mesh)) = solids.last_mut() else { continue };
            let read = || vertex(rest, offset).filter(|position| position.is_finite() || !strict);
            mesh.positions.push(read().ok_or_else(|| StlErrorKind::Vertex {
                line,
                text: text.chars().take(60).collect(),
            })?);
            corners += 1;
        } else if keyword.eq_ignore_ascii_case("endfacet") {
            let Some((_, mesh)) = solids.last_mut() else { continue };
            if corners != 3 {
                return Err(StlErrorKind::Facet { line, corners });
            }
            add_facet(mesh);
            corners = 0;
        }
    }
    // A facet without its end belongs to a file that was truncated.
    if corners > 0 {
        let line = bytes.split(|&b| b == b'\n' || b == b'\r').count();
        return Err(StlErrorKind::Facet { line, corners });
    }
    match unended {
        Some(line) if strict => Err(StlErrorKind::Unended { line }),
        unended => Ok(Solids { parts: solids, unended }),
    }
}

/// A position relative to the offset.
fn vertex(text: &str, offset: DVec3) -> Option<Vec3> {
    let mut numbers = text.split_whitespace().map(non_finite::parse);
    let position = Vec3::new(numbers.next()??, numbers.next()??, numbers.next()??);
    if offset == DVec3::ZERO {
        return Some(position);
    }
    let precise = precise_vertex(text).unwrap_or_else(|| position.as_dvec3());
    Some((precise - offset).as_vec3())
}

/// A position in double precision, if it is written as usual.
fn precise_vertex(text: &str) -> Option<DVec3> {
    let mut numbers = text.split_whitespace().map(str::parse);
    let mut number = || numbers.next()?.ok();
    Some(DVec3::new(number()?, number()?, number()?))
}

/// The last three vertices as a triangle.
fn add_facet(mesh: &mut Mesh) {
    let end = mesh.positions.len() as u32;
    mesh.triangles.push([end - 3, end - 2, end - 1]);
}
