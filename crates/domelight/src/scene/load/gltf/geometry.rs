//! A primitive's vertices and triangles in mesh space.

use std::collections::{BTreeMap, BTreeSet};

use super::accessor::component_range;
use super::draco::DracoMesh;
use super::error::{Failure, GltfErrorKind, VertexError};
use super::json;
use super::material::Slot;
use super::source::Source;
use crate::math::Vec2;

/// The vertices of a primitive; each attribute is empty or has one value per vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) tangents: Vec<[f32; 4]>,
    pub(super) uvs: [Vec<[f32; 2]>; 2],
    pub(super) colors: Vec<[f32; 4]>,
    /// Joints and weights, four per vertex and set.
    pub(super) joints: Vec<Vec<[u32; 4]>>,
    pub(super) weights: Vec<Vec<[f32; 4]>>,
    /// The morph targets used by any placement, by index.
    pub(super) targets: BTreeMap<usize, Target>,
}

/// A morph target: differences of attributes.
#[derive(Clone, Debug, Default)]
pub(super) struct Target {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) tangents: Vec<[f32; 3]>,
}

/// A primitive that can be placed any number of times.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub(super) vertices: Vertices,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) slot: Slot,
}

/// The morph targets to read, and whether to read joints.
#[derive(Clone, Debug, Default)]
pub(super) struct Deformations {
    pub(super) targets: BTreeSet<usize>,
    pub(super) skin: bool,
}

impl Geometry {
    /// What the vertices lack for their material, the first of each kind.
    pub(super) fn problems(&self) -> impl Iterator<Item = VertexError> {
        let Vertices { uvs, colors, .. } = &self.vertices;
        let sets = || {
            let used = self.slot.uv_sets.iter().zip(uvs);
            used.filter_map(|(set, uvs)| Some(((*set)?, uvs)))
        };
        let missing = sets().find(|(_, uvs)| uvs.is_empty());
        let missing = missing.map(|(set, _)| VertexError::NoUvs { set });
        let uv = sets().find_map(|(set, uvs)| {
            let vertex = uvs.iter().position(|&uv| !Vec2::from(uv).is_finite())?;
            Some(VertexError::Uv { set, vertex, value: uvs[vertex].into() })
        });
        let n_channels = if self.slot.alpha { 4 } else { 3 };
        let is_bad = |color: &[f32; 4]| color[..n_channels].iter().any(|c| !c.is_finite());
        let color = colors.iter().position(is_bad);
        let color = color.map(|i| VertexError::Color { vertex: i, value: colors[i].into() });
        [missing, uv, color].into_iter().flatten()
    }
}

/// Reads a primitive. `place` names it in messages about memory.
pub(super) fn read(
    source: &Source<'_>,
    primitive: &json::Primitive,
    slot: Slot,
    deformations: &Deformations,
    place: &str,
) -> Result<Geometry, Failure> {
    let extension = primitive.extensions.draco.as_ref();
    let draco = extension.map(|draco| DracoMesh::new(source, draco, place)).transpose()?;
    let reader = Reader { source, primitive, draco };
    let vertices = reader.vertices(slot, deformations)?;
    let n_vertices = vertices.positions.len();
    let indices = match (&reader.draco, primitive.indices) {
        (Some(draco), _) => draco.indices(),
        (None, Some(accessor)) => source.indices(accessor)?,
        (None, None) => (0..n_vertices as u32).collect(),
    };
    if let Some(&index) = indices.iter().find(|&&i| i as usize >= n_vertices) {
        return Err(GltfErrorKind::Index { index, vertices: n_vertices }.into());
    }
    let mode = if reader.draco.is_some() { TRIANGLES } else { primitive.mode };
    Ok(Geometry { vertices, triangles: triangles(&indices, mode), slot })
}

pub(super) const TRIANGLES: u32 = 4;
pub(super) const TRIANGLE_STRIP: u32 = 5;
pub(super) const TRIANGLE_FAN: u32 = 6;

fn triangles(indices: &[u32], mode: u32) -> Vec<[u32; 3]> {
    match mode {
        TRIANGLE_STRIP => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            .collect(),
        TRIANGLE_FAN => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [w[0], w[1], indices[0]])
            .collect(),
        _ => indices.as_chunks().0.to_vec(),
    }
}

struct Reader<'r, 's> {
    source: &'r Source<'s>,
    primitive: &'r json::Primitive,
    draco: Option<DracoMesh<'r>>,
}

/// The values of an attribute; none if it is broken and the material does not use it.
fn unless_unused<T>(values: Result<Vec<T>, Failure>, is_used: bool) -> Result<Vec<T>, Failure> {
    match values {
        Err(Failure::Problem(_)) if !is_used => Ok(Vec::new()),
        values => values,
    }
}

impl Reader<'_, '_> {
    fn vertices(&self, slot: Slot, deformations: &Deformations) -> Result<Vertices, Failure> {
        let positions = self.floats("POSITION", "VEC3", None)?;
        if positions.is_empty() {
            let attribute = "positions".into();
            return Err(GltfErrorKind::Count { attribute, count: 0, vertices: 0 }.into());
        }
        let n = Some(positions.len());
        let uvs = |set: Option<u32>| match set {
            Some(set) => self.floats(&format!("TEXCOORD_{set}"), "VEC2", n),
            None => Ok(Vec::new()),
        };
        let first = slot.uv_sets[0];
        let normals = self.floats("NORMAL", "VEC3", n)?;
        // glTF 2.0, 3.7.2.1: without normals, tangents are ignored.
        let uses_tangents = slot.tangent_uvs.is_some() && !normals.is_empty();
        let tangents = unless_unused(self.floats("TANGENT", "VEC4", n), uses_tangents)?;
        let mut vertices = Vertices {
            normals,
            tangents: if uses_tangents { tangents } else { Vec::new() },
            uvs: [unless_unused(uvs(first.or(Some(0))), first.is_some())?, uvs(slot.uv_sets[1])?],
            colors: self.colors(n)?,
            positions,
            ..Vertices::default()
        };
        if deformations.skin {
            for set in 0.. {
                let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
                if !self.primitive.attributes.contains_key(&joints) {
                    break;
                }
                vertices.joints.push(self.joints(&joints, n)?);
                vertices.weights.push(self.floats(&weights, "VEC4", n)?);
            }
        }
        for &index in &deformations.targets {
            if let Some(target) = self.primitive.targets.get(index) {
                vertices.targets.insert(index, self.target(target, n)?);
            }
        }
        Ok(vertices)
    }

    /// The values of an attribute; empty if the primitive lacks it.
    fn floats<const N: usize>(
        &self,
        semantic: &str,
        needed: &'static str,
        n_vertices: Option<usize>,
    ) -> Result<Vec<[f32; N]>, Failure> {
        let Some(&accessor) = self.primitive.attributes.get(semantic) else {
            return Ok(Vec::new());
        };
        let values = match self.in_draco(semantic, accessor)? {
            Some(values) => values,
            None => self.source.floats(accessor, needed, semantic)?,
        };
        checked(semantic, values, n_vertices)
    }

    /// An attribute from the Draco stream, if the stream exists and has it.
    fn in_draco<const N: usize>(
        &self,
        semantic: &str,
        accessor: usize,
    ) -> Result<Option<Vec<[f32; N]>>, Failure> {
        let Some(draco) = &self.draco else { return Ok(None) };
        let range = component_range(&self.source.document.get(accessor)?);
        Ok(draco.floats(semantic, range))
    }

    /// Colors; those with three components are opaque.
    fn colors(&self, n_vertices: Option<usize>) -> Result<Vec<[f32; 4]>, Failure> {
        let mut colors: Vec<[f32; 4]> = self.floats("COLOR_0", "VEC3 or VEC4", n_vertices)?;
        if let Some(&accessor) = self.primitive.attributes.get("COLOR_0") {
            let accessor: json::Accessor = self.source.document.get(accessor)?;
            if accessor.shape == "VEC3" {
                for color in &mut colors {
                    color[3] = 1.0;
                }
            }
        }
        Ok(colors)
    }

    fn joints(&self, semantic: &str, n_vertices: Option<usize>) -> Result<Vec<[u32; 4]>, Failure> {
        let accessor = self.primitive.attributes[semantic];
        let values = match self.in_draco::<4>(semantic, accessor)? {
            Some(values) => values.into_iter().map(|v| v.map(|j| j as u32)).collect(),
            None => self.source.integers(accessor, "VEC4 of unsigned integers", semantic)?,
        };
        checked(semantic, values, n_vertices)
    }

    fn target(
        &self,
        target: &BTreeMap<String, usize>,
        n_vertices: Option<usize>,
    ) -> Result<Target, Failure> {
        let differences = |semantic: &str| match target.get(semantic) {
            Some(&accessor) => {
                let what = format!("{semantic} of a morph target");
                let values = self.source.floats(accessor, "VEC3", &what)?;
                checked(&what, values, n_vertices)
            }
            None => Ok(Vec::new()),
        };
        Ok(Target {
            positions: differences("POSITION")?,
            normals: differences("NORMAL")?,
            tangents: differences("TANGENT")?,
        })
    }
}

/// Checks that an attribute has one value per vertex.
fn checked<T>(
    semantic: &str,
    values: Vec<T>,
    n_vertices: Option<usize>,
) -> Result<Vec<T>, Failure> {
    match n_vertices {
        Some(vertices) if values.len() != vertices => {
            let (attribute, count) = (format!("values of {semantic}"), values.len());
            Err(GltfErrorKind::Count { attribute, count, vertices }.into())
        }
        _ => Ok(values),
    }
}

/// The number of triangles of a primitive at most, by the counts of its accessors.
pub(super) fn n_triangles(
    source: &Source<'_>,
    primitive: &json::Primitive,
) -> Result<u64, GltfErrorKind> {
    let accessor = primitive.indices.as_ref().or_else(|| primitive.attributes.get("POSITION"));
    let Some(&accessor) = accessor else { return Ok(0) };
    let count = source.document.get::<json::Accessor>(accessor)?.count as u64;
    Ok(if primitive.mode == TRIANGLES { count / 3 } else { count.saturating_sub(2) })
}

/// The memory of a primitive, read and placed `placements` times, from the counts of its accessors \[bytes\].
pub(super) fn memory(
    source: &Source<'_>,
    primitive: &json::Primitive,
    deformations: &Deformations,
    placements: u64,
) -> Result<u64, GltfErrorKind> {
    // Values are read as up to four floats and stored as two to four.
    const VALUE: u64 = 16 + 16;
    // An index, and one triangle per index in a strip.
    const INDEX: u64 = 4 + 12;
    /// A part without vertices, with its name.
    const PART: u64 = 512;
    let count = |&accessor: &usize| -> Result<u64, GltfErrorKind> {
        Ok(source.document.get::<json::Accessor>(accessor)?.count as u64)
    };
    let mut bytes = 0u64;
    let targets = deformations.targets.iter().filter_map(|&target| primitive.targets.get(target));
    for accessor in std::iter::once(&primitive.attributes).chain(targets).flat_map(BTreeMap::values)
    {
        bytes = bytes.saturating_add(count(accessor)?.saturating_mul(VALUE));
    }
    let vertices = primitive.attributes.get("POSITION").map_or(Ok(0), count)?;
    let indices = primitive.indices.as_ref().map_or(Ok(vertices), count)?;
    let bytes = bytes.saturating_add(indices.saturating_mul(INDEX)).saturating_add(PART);
    Ok(bytes.saturating_mul(placements))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_every_second_triangle() {
        let indices = [0, 1, 2, 3, 4];
        assert_eq!(triangles(&indices, TRIANGLES), [[0, 1, 2]]);
        assert_eq!(triangles(&indices, TRIANGLE_STRIP), [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
        assert_eq!(triangles(&indices, TRIANGLE_FAN), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        for mode in [TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN] {
            assert!(triangles(&[], mode).is_empty() && triangles(&[1, 2], mode).is_empty());
        }
    }
}
