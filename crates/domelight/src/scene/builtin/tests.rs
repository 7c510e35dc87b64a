//! What every built-in mesh must be: closed, turned outward, of unit normals, the same every time.

use std::collections::HashMap;

use super::*;
use crate::math::{PI, vec2};

/// Vertices with the same position bit for bit get the same number.
fn weld(mesh: &Mesh) -> Vec<u32> {
    let mut numbers = HashMap::new();
    let key = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    let number = |p| {
        let next = numbers.len() as u32;
        *numbers.entry(key(p)).or_insert(next)
    };
    mesh.positions.iter().map(number).collect()
}

/// Every edge belongs to exactly two triangles, which run along it in opposite directions.
fn assert_closed(name: &str, mesh: &Mesh) {
    let welded = weld(mesh);
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| welded[i as usize]);
        assert!(a != b && b != c && c != a, "{name}: degenerate triangle");
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    for (&(a, b), &count) in &edges {
        assert!(count == 1, "{name}: {count} triangles run along one edge the same way");
        assert!(edges.contains_key(&(b, a)), "{name}: an open edge");
    }
}

/// Normals are unit vectors on the outer side of every triangle; texture coordinates are complete.
fn assert_normals(name: &str, mesh: &Mesh) {
    mesh.validate().unwrap();
    assert_eq!(mesh.normals.len(), mesh.positions.len(), "{name}");
    for n in &mesh.normals {
        assert!((n.length() - 1.0).abs() < 1e-5, "{name}: normal {n}");
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let face = (b - a).cross(c - a);
        for &i in t {
            assert!(mesh.normals[i as usize].dot(face) > 0.0, "{name}: turned at {a}");
        }
    }
}

/// Volume inside a closed mesh, by the divergence theorem.
fn volume(mesh: &Mesh) -> f64 {
    let sixth = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles.iter().map(sixth).sum()
}

fn solids() -> Vec<(&'static str, Mesh)> {
    let square =
        [vec2(0.5, -0.2), vec2(0.9, -0.2), vec2(0.9, 0.2), vec2(0.5, 0.2), vec2(0.5, -0.2)];
    vec![
        ("icosphere", shapes::icosphere(3)),
        ("uv sphere", shapes::uv_sphere(31, 17)),
        ("box", shapes::beveled_box(vec3(1.0, 0.5, 0.7), 0.1, 4)),
        ("ring", shapes::lathe(&square, 24)),
        ("figure", statue::figure()),
        ("plinth", statue::plinth()),
        ("ball", material_ball::ball()),
        ("core", material_ball::core()),
        ("cradle", material_ball::cradle()),
        ("walls", room::walls()),
        ("floor", room::floor()),
        ("table", room::table()),
        ("vase", room::vase()),
    ]
}

#[test]
fn solids_are_closed_and_turned_outward() {
    for (name, mesh) in solids() {
        assert_closed(name, &mesh);
        assert_normals(name, &mesh);
        assert!(volume(&mesh) > 0.0, "{name}");
        assert!(
            mesh.uvs.is_empty() || mesh.uvs.iter().all(|uv| uv.cmpge(vec2(-1e-6, -1e-6)).all())
        );
    }
}

#[test]
fn shapes_have_the_volumes_of_the_solids_they_approach() {
    let ring = PI * (0.81 - 0.25) * 0.4;
    let slab = [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(1.0, 0.5), vec2(0.0, 0.5)];
    let square =
        [vec2(0.5, -0.2), vec2(0.9, -0.2), vec2(0.9, 0.2), vec2(0.5, 0.2), vec2(0.5, -0.2)];
    // Inscribed polyhedra: smaller by O(edge²).
    for (mesh, expected) in [
        (shapes::icosphere(5), 4.0 / 3.0 * PI),
        (shapes::uv_sphere(256, 128), 4.0 / 3.0 * PI),
        (shapes::beveled_box(vec3(1.0, 0.5, 0.7), 1e-3, 2), 8.0 * 0.35),
        (shapes::lathe(&square, 256), ring),
        (shapes::lathe(&slab, 256), 0.5 * PI),
    ] {
        let ratio = volume(&mesh) / f64::from(expected);
        assert!((0.998..1.000001).contains(&ratio), "{ratio}");
    }
}

#[test]
fn spheres_have_exact_normals_and_lat_long_coordinates() {
    let sphere = shapes::icosphere(5);
    assert_eq!(sphere.triangles.len(), 20 * 4usize.pow(5));
    assert_eq!(sphere.positions, sphere.normals);
    let sphere = shapes::uv_sphere(16, 8);
    for ((p, n), uv) in sphere.positions.iter().zip(&sphere.normals).zip(&sphere.uvs) {
        assert!((*p - *n).length() < 1e-6);
        let (sin_theta, cos_theta) = (PI * uv.y).sin_cos();
        let (sin_phi, cos_phi) = (2.0 * PI * (uv.x - 0.5)).sin_cos();
        let d = vec3(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta);
        assert!((d - *p).length() < 1e-5, "{uv} is {p}, not {d}");
    }
}

#[test]
fn a_disc_faces_up() {
    let disc = shapes::disc(2.0, 12);
    assert_normals("disc", &disc);
    assert!(disc.positions.iter().all(|p| p.y == 0.0 && p.length() < 2.00001));
    assert!(disc.normals.iter().all(|n| *n == Vec3::Y));
    assert_eq!(disc.triangles.len(), 12);
}

#[test]
fn the_statue_is_detailed_and_stands_on_its_plinth() {
    let figure = statue::figure();
    assert!(figure.triangles.len() >= 100_000, "{}", figure.triangles.len());
    let bounds = figure.bounds();
    assert!(bounds.min.y < 0.0 && bounds.min.y > -statue::PLINTH_HEIGHT);
    assert!(bounds.max.y > 2.0 && bounds.size().max_element() < 2.6);
    let plinth = statue::plinth().bounds();
    assert_eq!(plinth.min.y, 0.0);
    assert_eq!(plinth.max.y, statue::PLINTH_HEIGHT);
}

#[test]
fn the_statue_is_the_same_every_time() {
    let (a, b) = (statue::figure(), statue::figure());
    assert_eq!(a.positions, b.positions);
    assert_eq!(a.normals, b.normals);
    assert_eq!(a.triangles, b.triangles);
}

#[test]
fn every_scene_can_be_built_and_is_seen_by_its_camera() {
    for name in BuiltinScene::ALL {
        let scene = crate::scene::Scene::new(name.description()).unwrap();
        let camera = crate::scene::Camera::framing(&scene, 64, 64);
        let hit = scene.bvh().closest_hit(&camera.ray(32.0, 32.0));
        assert!(hit.is_some(), "{name}: nothing in the middle of the picture");
    }
}

#[test]
fn names_round_trip_and_errors_list_them() {
    for scene in BuiltinScene::ALL {
        assert_eq!(scene.to_string().parse(), Ok(scene));
        let error = "stature".parse::<BuiltinScene>().unwrap_err().to_string();
        assert!(error.contains(scene.name()) && error.contains("\"stature\""));
    }
}
