//! `KHR_draco_mesh_compression`: a primitive's triangles and attributes in one stream.

use draco_core::{DecodeLimits, DecoderBuffer, FaceIndex, Mesh, MeshDecoder};

use super::accessor::normalized;
use super::error::{Failure, GltfErrorKind};
use super::json;
use super::source::Source;

/// A decoded stream.
pub(super) struct DracoMesh<'p> {
    mesh: Mesh,
    extension: &'p json::Draco,
}

impl<'p> DracoMesh<'p> {
    /// Decodes a primitive's stream within the memory limit.
    pub(super) fn new(
        source: &Source<'_>,
        extension: &'p json::Draco,
        place: &str,
    ) -> Result<Self, Failure> {
        let (stream, _) = source.view(extension.buffer_view)?;
        let mut limits = DecodeLimits::default();
        if let Some(left) = source.budget.left() {
            // A face takes three indices in the decoder and three here, plus its connectivity during decoding.
            limits = limits
                .with_max_decoded_bytes(left.min(limits.max_decoded_bytes))
                .with_max_faces((left / 64).min(limits.max_faces))
                .with_max_points((left / 16).min(limits.max_points));
        }
        let mut mesh = Mesh::new();
        MeshDecoder::new()
            .decode(&mut DecoderBuffer::new(&stream).with_limits(limits), &mut mesh)
            .map_err(|e| GltfErrorKind::Draco { problem: e.to_string() })?;
        // The decoder limits the number of faces, but not of points.
        let points = mesh.num_points() as u64;
        if points > limits.max_points {
            let problem = format!("{points} points, more than the limit of {}", limits.max_points);
            return Err(GltfErrorKind::Draco { problem }.into());
        }
        let values = extension.attributes.len() as u64 * points * 16;
        source.budget.take(place, values + 24 * mesh.num_faces() as u64)?;
        Ok(Self { mesh, extension })
    }

    /// The number of vertices.
    pub(super) fn n_vertices(&self) -> usize {
        self.mesh.num_points()
    }

    /// An attribute of the primitive, if the stream has it; missing components are 0.
    ///
    /// Integers are divided by `normalize_by`, according to the attribute's accessor.
    pub(super) fn floats<const N: usize>(
        &self,
        semantic: &str,
        normalize_by: Option<f32>,
    ) -> Option<Vec<[f32; N]>> {
        let id = self.extension.attributes.get(semantic)?;
        let attribute = self.mesh.attribute_by_unique_id(*id)?;
        let mut values = attribute.read_f32s(self.n_vertices(), N);
        if let Some(range) = normalize_by {
            for v in &mut values {
                *v = normalized(*v, range);
            }
        }
        Some(values.as_chunks().0.to_vec())
    }

    /// The corners of all triangles, in order.
    pub(super) fn indices(&self) -> Vec<u32> {
        let face = |i: usize| self.mesh.face(FaceIndex(i as u32)).map(|point| point.0);
        (0..self.mesh.num_faces()).flat_map(face).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use super::*;
    use crate::scene::load::files::Files;
    use crate::scene::load::{Budget, Reach};

    /// A square of two triangles, (0, 0, 0) to (1, 1, 0), its last corner (0, 1, ½).
    const EDGEBREAKER: &str = "RFJBQ08CAgEBAAAABAIBAgAAAR//ARH/AREC/wAAAAAAAQAJAwAAAgEDCQIAAQIBAQEADwMBMC8BEAMAKIKYAAAA/P8AAAAAAP8/\
    AAAAAAAAAAAAAAAAAAAAAIA/DgEBAQADAwEgASADAPCDpgAAAAAA/w8AAAAAAAAAAAAAAACAPww=";
    const SEQUENTIAL: &str = "RFJBQ08CAgEAAAACBAEAAQIAAgMBAgAJAwAAAwkCAAECAgABAQAPAwEwLwEQAwA0gogEAADg/wcAAAAA/z8AAAABAQADAwEgASAD\
    ACCEhgIAAAAA/w8AAAAAAAAAAAAAAAAAAAAAgD8OAAAAAAAAAAAAAIA/DA==";

    fn decoded<T>(
        stream: &str,
        max_memory: Option<u64>,
        f: impl FnOnce(DracoMesh<'_>) -> T,
    ) -> Result<T, String> {
        let json = format!(
            r#"{{"buffers":[{{"uri":"data:;base64,{stream}"}}],
"bufferViews":[{{"buffer":0,"byteLength":{}}}]}}"#,
            stream.len() / 4 * 3 - stream.bytes().filter(|&b| b == b'=').count()
        );
        let budget = Budget::new(Path::new(""), Files::System, max_memory, Reach::Anywhere);
        let source = Source::new(Path::new("a"), json.as_bytes(), &budget);
        let source = source.map_err(|failure| failure.to_string())?;
        let attributes = BTreeMap::from([("POSITION".into(), 0), ("TEXCOORD_0".into(), 1)]);
        let extension = json::Draco { buffer_view: 0, attributes };
        let mesh = DracoMesh::new(&source, &extension, "a, mesh 0");
        mesh.map(f).map_err(|failure| failure.to_string())
    }

    #[test]
    fn a_square_by_either_method() {
        for stream in [EDGEBREAKER, SEQUENTIAL] {
            let check = |mesh: DracoMesh<'_>| {
                let positions = mesh.floats::<3>("POSITION", None).unwrap();
                let uvs = mesh.floats::<2>("TEXCOORD_0", None).unwrap();
                assert!(mesh.floats::<3>("NORMAL", None).is_none());
                assert_eq!((positions.len(), uvs.len(), mesh.n_vertices()), (4, 4, 4));
                let mut area = 0.0;
                for triangle in mesh.indices().as_chunks::<3>().0 {
                    let [a, b, c] = triangle.map(|i| positions[i as usize]);
                    area += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
                }
                assert!((area - 1.0).abs() < 1e-3, "{area}");
                for (p, uv) in positions.iter().zip(uvs) {
                    assert!((p[0] - uv[0]).abs() < 1e-3 && (1.0 - p[1] - uv[1]).abs() < 1e-3);
                    assert!((p[2] - 0.5 * p[1] * (1.0 - p[0])).abs() < 1e-3);
                }
            };
            decoded(stream, None, check).unwrap();
        }
    }

    #[test]
    fn limits_and_damage_are_errors() {
        assert!(decoded(SEQUENTIAL, Some(30), |_| ()).is_err());
        let error = decoded(&SEQUENTIAL.replace("RFJB", "XXXX"), None, |_| ()).unwrap_err();
        assert!(error.contains("Draco"), "{error}");
        for i in 0..SEQUENTIAL.len() - 2 {
            let mut damaged = SEQUENTIAL.as_bytes().to_vec();
            damaged[i] = if damaged[i] == b'A' { b'z' } else { b'A' };
            let _ = decoded(std::str::from_utf8(&damaged).unwrap(), Some(1 << 20), |mesh| {
                let _ = (mesh.floats::<3>("POSITION", None), mesh.indices());
            });
        }
    }
}
