//! Positions that are NaN or infinite, as broken exporters write them.
//!
//! The triangles at such vertices are dropped, with one warning per file. If that would leave nothing, the meshes stay
//! unchanged, and [`Scene::new`](crate::scene::Scene::new) names the vertex.

use std::path::Path;

use crate::geometry::Mesh;
use crate::math::Vec3;
use crate::scene::Part;

/// The number that a word means: NaN of `nan`, `-nan(ind)` and `1.#QNAN`, infinite of `inf` and of what is too large.
pub(super) fn parse(word: &str) -> Option<f32> {
    let digits = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
    let of_windows = digits.split_once(".#").is_some_and(|(whole, kind)| {
        let is =
            |text: &str, all: fn(&u8) -> bool| !text.is_empty() && text.bytes().all(|b| all(&b));
        is(whole, u8::is_ascii_digit) && is(kind, u8::is_ascii_alphanumeric)
    });
    let is_nan = digits.starts_with("nan") || of_windows;
    if is_nan { Some(f32::NAN) } else { word.parse().ok() }
}

/// Leaves out the triangles at vertices that are not finite, and says so.
pub(super) fn leave_out(path: &Path, parts: &mut [Part]) -> Option<String> {
    let (part, vertex) = parts.iter().find_map(|part| Some((part, first(&part.mesh)?)))?;
    let leaves_some = parts.iter().any(|part| {
        part.mesh.triangles.iter().any(|triangle| is_finite(&part.mesh.positions, triangle))
    });
    if !leaves_some {
        return None;
    }
    let position = part.mesh.positions[vertex];
    let place = format!("{}: vertex {vertex} of mesh '{}'", path.display(), part.name);
    let before = count(parts);
    for part in parts.iter_mut() {
        leave_out_of(&mut part.mesh);
    }
    let left_out = before - count(parts);
    Some(format!(
        "{place} is not finite: {position}; {left_out} of {before} triangles have such corners and are left out"
    ))
}

fn count(parts: &[Part]) -> usize {
    parts.iter().map(|part| part.mesh.triangles.len()).sum()
}

/// The first vertex that is not finite.
fn first(mesh: &Mesh) -> Option<usize> {
    mesh.positions.iter().position(|position| !position.is_finite())
}

fn is_finite(positions: &[Vec3], triangle: &[u32; 3]) -> bool {
    let position = |&i: &u32| positions.get(i as usize);
    // An index that names no vertex is refused elsewhere.
    triangle.iter().all(|i| position(i).is_none_or(|position| position.is_finite()))
}

fn leave_out_of(mesh: &mut Mesh) {
    let Mesh { positions, triangles, .. } = mesh;
    triangles.retain(|triangle| is_finite(positions, triangle));
    // No triangle has these vertices any more; they join one that counts in the bounds already.
    let place = positions.iter().copied().find(|position| position.is_finite());
    for position in positions.iter_mut().filter(|position| !position.is_finite()) {
        *position = place.unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::vec3;

    #[test]
    fn words_of_exporters_are_numbers() {
        for word in ["#hello", "a#b", "1#2", ".#nan", "1.#"] {
            assert_eq!(parse(word), None, "{word}");
        }
        for word in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND00"] {
            assert!(parse(word).is_some_and(f32::is_nan), "{word}");
        }
        assert_eq!(parse("inf"), Some(f32::INFINITY));
        assert_eq!(parse("-1e999"), Some(f32::NEG_INFINITY));
        assert_eq!((parse("1.5"), parse("x"), parse("")), (Some(1.5), None, None));
    }

    #[test]
    fn bounds_are_those_of_what_stays() {
        let far = vec3(7.0, 7.0, 7.0);
        let mut mesh = Mesh {
            positions: vec![Vec3::NAN, far, far + Vec3::X, far + Vec3::Y],
            triangles: vec![[0, 1, 2], [1, 2, 3]],
            ..Mesh::default()
        };
        leave_out_of(&mut mesh);
        assert_eq!(mesh.triangles, [[1, 2, 3]]);
        assert_eq!(mesh.bounds().min, far);
    }
}
