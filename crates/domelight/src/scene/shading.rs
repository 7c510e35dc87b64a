//! Turns a hit into a shading point: position, normals, frame and BSDF.
//!
//! Surfaces are shaded from either side: both normals are flipped to the viewer's side. The position is computed from
//! the barycentric coordinates, with the error of the vertices, rather than from origin + t · direction, whose error
//! grows with the distance.
//!
//! An interpolated or mapped normal may face away from the viewer although the surface does not.
//! Such a normal is **bent toward the viewer** until `wo` lies just above the shading horizon:
//! n' = √(1 − ε²) t + ε wo with t ∝ n − (n·wo) wo, the nearest normal with n'·wo = ε. Otherwise there
//! would be black pixels along silhouettes.
//!
//! A smooth surface with coarse triangles is shaded as smooth: shadow rays start where the smooth surface would be,
//! above the triangle, and may point as far down as it allows. Otherwise triangles shadow one another near the
//! terminator, in stair-steps. (Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4.)

use super::{Layers, Material, NormalMap, Part, Scene};
use crate::Rgb;
use crate::geometry::{Hit, Mesh, Ray};
use crate::math::{Frame, Vec2, Vec3, Vec4};
use crate::scene::texture::Uvs;
use crate::strategy::ShadingPoint;

/// The minimum cosine between the shading normal and the direction to the viewer.
const MIN_COS_THETA_O: f32 = 1e-3;

/// Vertex normals within this cosine of the geometric one belong to a flat triangle: 0.1°, far more than rounding.
const COS_FLAT: f32 = 0.999_998;

/// Vertex normals beyond this cosine do not describe a smooth surface over the triangle: 60°.
const COS_ROUGH: f32 = 0.5;

impl Scene {
    /// The shading point of a hit that [`Scene::bvh`] reported for `ray`.
    ///
    /// # Panics
    /// If `hit.triangle` is not one of this scene's.
    pub fn shading_point(&self, ray: &Ray, hit: &Hit) -> ShadingPoint {
        let mut point = ShadingPoint::UNSET;
        self.shade(ray, hit, &mut point);
        point
    }

    /// Sets `point` to [`Scene::shading_point`] in place, because a point is large. Returns the material if its BSDF is
    /// the same everywhere.
    #[inline]
    pub(crate) fn shade(&self, ray: &Ray, hit: &Hit, point: &mut ShadingPoint) -> Option<usize> {
        let Some(placement) = self.placement(hit.triangle) else {
            return self.shade_part(ray, hit, point);
        };
        let constant = self.shade_part(&placement.inverse_ray(ray), hit, point);
        point.position = placement.point(point.position);
        point.ng = placement.direction(point.ng);
        point.frame = placement.frame(point.frame);
        constant
    }

    /// [`Scene::shade`] where the mesh of the hit's part is.
    #[inline]
    fn shade_part(&self, ray: &Ray, hit: &Hit, point: &mut ShadingPoint) -> Option<usize> {
        let (part, triangle) = self.locate(hit.triangle);
        let material = &self.materials[part.material];
        let corner = Corners::new(&part.mesh, triangle, hit);
        let viewer = -ray.direction.normalize();

        let [p0, p1, p2] = corner.of(&part.mesh.positions);
        let ng = (p1 - p0).cross(p2 - p0).try_normalize().unwrap_or(viewer);
        let uvs = corner.uvs(&part.mesh);
        let smooth = corner.mix(&part.mesh.normals).and_then(Vec3::try_normalize).unwrap_or(ng);
        let relief = if material.needs_tangent() {
            self.relief(part, material, &corner, smooth, &uvs)
        } else {
            Relief { normal: smooth, coat_normal: smooth, tangent: None }
        };

        let ng = if ng.dot(viewer) < 0.0 { -ng } else { ng };
        let to_viewer = |normal: Vec3| {
            let normal = if smooth.dot(ng) < 0.0 { -normal } else { normal };
            bend(normal, viewer, ng)
        };
        let normal = to_viewer(relief.normal);
        let frame = relief
            .tangent
            .map_or_else(|| Frame::from_z(normal), |t| Frame::from_z_and_tangent(normal, t));
        let wo = frame.to_local(viewer).normalize();
        let coat_normal = match material.layers.clearcoat {
            Some(_) if relief.coat_normal != relief.normal => {
                frame.to_local(to_viewer(relief.coat_normal))
            }
            _ => Vec3::Z,
        };
        let tint = corner.mix(&part.mesh.colors);
        let constant = match (&self.constant_bsdfs[part.material], tint) {
            (Some(bsdf), None) => {
                point.bsdf.set(bsdf, wo);
                Some(part.material)
            }
            (_, tint) => {
                let tint = tint.unwrap_or(Rgb::WHITE);
                material.set_bsdf(&self.textures, &uvs, tint, [wo, coat_normal], &mut point.bsdf);
                None
            }
        };
        let position = corner.mix(&part.mesh.positions).unwrap_or(p0);
        let side = if smooth.dot(ng) < 0.0 { -1.0 } else { 1.0 };
        (point.position, point.ng) = match corner.rise(&part.mesh, position, ng, side) {
            Some(rise) => (position + rise, to_viewer(smooth)),
            None => (position, ng),
        };
        (point.frame, point.wo) = (frame, wo);
        constant
    }

    /// The normals and the tangent at a hit, given the interpolated `normal`.
    fn relief(
        &self,
        part: &Part,
        material: &Material,
        corner: &Corners,
        normal: Vec3,
        uvs: &Uvs,
    ) -> Relief {
        let mesh = &part.mesh;
        let set = match material.tangent_set() {
            1 => &mesh.uvs2,
            _ => &mesh.uvs,
        };
        let tangent = corner.mix(&mesh.tangents);
        let tangent = tangent.or_else(|| corner.uv_tangent(&mesh.positions, set, normal));
        let Some(tangent) = tangent else {
            return Relief { normal, coat_normal: normal, tangent: None };
        };
        let frame = Frame::from_z_and_tangent(normal, tangent.truncate());
        let bitangent = frame.y * 1f32.copysign(tangent.w);
        let mapped = |map: &Option<NormalMap>| {
            let n = map.as_ref()?.normal(&self.textures, uvs);
            (frame.x * n.x + bitangent * n.y + frame.z * n.z).try_normalize()
        };
        let Layers { anisotropy, clearcoat, .. } = &material.layers;
        let coat_map = clearcoat.as_ref().map_or(&None, |coat| &coat.normal_map);
        let tangent = match anisotropy {
            None => tangent.truncate(),
            Some(anisotropy) => {
                let (_, along) = anisotropy.at(&self.textures, uvs);
                frame.x * along.x + bitangent * along.y
            }
        };
        Relief {
            normal: mapped(&material.normal_map).unwrap_or(normal),
            coat_normal: mapped(coat_map).unwrap_or(normal),
            tangent: Some(tangent),
        }
    }
}

/// The normals and tangent from maps at a point, on the front side of the surface. The interpolated normal determines the
/// viewer's side, because a normal map may tilt others over.
struct Relief {
    /// The interpolated normal with the normal map applied.
    normal: Vec3,
    /// The same for a clear coat.
    coat_normal: Vec3,
    /// The x axis of anisotropic lobes, of any length.
    tangent: Option<Vec3>,
}

/// `normal` bent toward `viewer` until their cosine is [`MIN_COS_THETA_O`]; see the
/// [module](self).
#[inline]
fn bend(normal: Vec3, viewer: Vec3, ng: Vec3) -> Vec3 {
    let cos_theta_o = normal.dot(viewer);
    if cos_theta_o >= MIN_COS_THETA_O {
        return normal;
    }
    let grazing = |n: Vec3| (n - n.dot(viewer) * viewer).try_normalize();
    let horizon = (1.0 - MIN_COS_THETA_O * MIN_COS_THETA_O).sqrt();
    grazing(normal)
        .or_else(|| grazing(ng))
        .map_or(viewer, |n| (horizon * n + MIN_COS_THETA_O * viewer).normalize())
}

/// The corners of the triangle that was hit, and their barycentric weights.
pub(super) struct Corners {
    indices: [usize; 3],
    weights: [f32; 3],
}

impl Corners {
    #[inline]
    pub(super) fn new(mesh: &Mesh, triangle: usize, hit: &Hit) -> Self {
        Self {
            indices: mesh.triangles[triangle].map(|i| i as usize),
            weights: [1.0 - hit.u - hit.v, hit.u, hit.v],
        }
    }

    /// An attribute at the corners.
    #[inline]
    fn of<T: Copy>(&self, attribute: &[T]) -> [T; 3] {
        self.indices.map(|i| attribute[i])
    }

    /// An interpolated attribute; `None` if the mesh lacks it.
    #[inline]
    pub(super) fn mix<T>(&self, attribute: &[T]) -> Option<T>
    where
        T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
    {
        if attribute.is_empty() {
            return None;
        }
        let [a, b, c] = self.of(attribute);
        let [wa, wb, wc] = self.weights;
        Some(a * wa + b * wb + c * wc)
    }

    /// The offset from `position` on the triangle up to the smooth surface that the vertex normals, times `side`,
    /// describe, if that surface bulges to the side of the geometric normal `ng`: Σ bᵢ max(0, (pᵢ − p) · nᵢ) nᵢ,
    /// where each term leads to the tangent plane of a vertex. `None` for flat triangles and hollows.
    #[inline]
    fn rise(&self, mesh: &Mesh, position: Vec3, ng: Vec3, side: f32) -> Option<Vec3> {
        if mesh.normals.is_empty() {
            return None;
        }
        let normals = self.of(&mesh.normals).map(|n| side * n.normalize_or_zero());
        let cosines = normals.map(|n| n.dot(ng));
        if cosines.iter().all(|&cos| cos > COS_FLAT) || cosines.iter().any(|&cos| cos < COS_ROUGH) {
            return None;
        }
        let corners = self.of(&mesh.positions);
        let terms = (0..3).map(|i| {
            let height = (corners[i] - position).dot(normals[i]).max(0.0);
            self.weights[i] * height * normals[i]
        });
        let rise = terms.fold(Vec3::ZERO, |sum, term| sum + term);
        (rise != Vec3::ZERO).then_some(rise)
    }

    /// The texture coordinates; 0 for a set that the mesh lacks.
    #[inline]
    pub(super) fn uvs(&self, mesh: &Mesh) -> Uvs {
        [&mesh.uvs, &mesh.uvs2].map(|set| self.mix(set).unwrap_or_default())
    }

    /// The tangent ∂p/∂u with the bitangent's sign as glTF defines it: the bitangent points toward
    /// falling v, which is up in the image.
    #[inline]
    fn uv_tangent(&self, positions: &[Vec3], uvs: &[Vec2], normal: Vec3) -> Option<Vec4> {
        if uvs.is_empty() {
            return None;
        }
        let [p0, p1, p2] = self.of(positions);
        let [t0, t1, t2] = self.of(uvs);
        let (e1, e2, d1, d2) = (p1 - p0, p2 - p0, t1 - t0, t2 - t0);
        let sign = 1f32.copysign(d1.perp_dot(d2));
        let along_u = (sign * (d2.y * e1 - d1.y * e2)).try_normalize()?;
        let along_v = sign * (d1.x * e2 - d2.x * e1);
        let handedness = -1f32.copysign(normal.cross(along_u).dot(along_v));
        Some(along_u.extend(handedness))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::offset_origin;
    use crate::math::{vec2, vec3};
    use crate::sampling::Pcg32;
    use crate::sampling::warp::uniform_sphere;
    use crate::scene::builtin::shapes;
    use crate::scene::{Encoding, MaterialModel, NormalMap, SceneDescription, Texture, TextureRef};

    /// The triangle (0,0,0), (1,0,0), (0,1,0) with its image's v axis pointing down.
    fn triangle() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            uvs: vec![vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(0.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    fn scene(mesh: Mesh, normal_texel: Option<[u8; 3]>) -> Scene {
        let mut material = Material::diffuse("gray", Rgb::splat(0.5));
        let mut textures = Vec::new();
        if let Some(texel) = normal_texel {
            textures.push(Texture::from_rgb8("n", 1, 1, vec![texel], Encoding::Linear).unwrap());
            material.normal_map = Some(NormalMap { texture: TextureRef::new(0), scale: 1.0 });
        }
        let part = Part { name: "triangle".into(), mesh, material: 0 };
        let description = SceneDescription {
            parts: vec![part],
            materials: vec![material],
            textures,
            ..SceneDescription::default()
        };
        Scene::new(description).unwrap()
    }

    fn look(scene: &Scene, from: Vec3) -> ShadingPoint {
        let at = vec3(0.25, 0.25, 0.0);
        let ray = Ray::new(from, (at - from).normalize());
        let hit = scene.bvh().closest_hit(&ray).unwrap();
        scene.shading_point(&ray, &hit)
    }

    #[test]
    fn both_sides_face_their_viewer() {
        let scene = scene(triangle(), None);
        for z in [3.0, -3.0] {
            let p = look(&scene, vec3(0.5, 1.0, z));
            let side = Vec3::Z * f32::signum(z);
            assert_eq!(p.ng, side);
            assert!((p.frame.z - side).length() < 1e-6);
            assert!((p.position - vec3(0.25, 0.25, 0.0)).length() < 1e-6);
            assert!(p.wo.z > 0.0);
            let toward = (vec3(0.5, 1.0, z) - p.position).normalize();
            assert!((p.frame.to_world(p.wo) - toward).length() < 1e-5);
            assert_eq!(p.bsdf.albedo(), Rgb::splat(0.5));
        }
    }

    #[test]
    fn normals_that_face_away_are_bent_toward_the_viewer() {
        let mut mesh = triangle();
        mesh.normals = vec![vec3(-0.995, 0.0, 0.1).normalize(); 3];
        let p = look(&scene(mesh, None), vec3(3.0, 0.25, 0.5));
        assert!(p.wo.z > 0.5 * MIN_COS_THETA_O && p.wo.z < 2.0 * MIN_COS_THETA_O);
        assert!((p.frame.z.length() - 1.0).abs() < 1e-5);
    }

    /// Triangles of a coarse ball do not shade one another: rays start on the ball, and leave it wherever its normal says.
    #[test]
    fn a_coarse_ball_is_shaded_as_a_ball() {
        let scene = scene(shapes::icosphere(1), None);
        let mut pcg = Pcg32::new(1, 2);
        let mut direction = || {
            let u = vec2(pcg.next_f32(), pcg.next_f32());
            uniform_sphere(u)
        };
        let mut lowest = 1.0f32;
        for _ in 0..4000 {
            let (from, wi) = (direction(), direction());
            let ray = Ray::new(3.0 * from, -from);
            let Some(hit) = scene.bvh().closest_hit(&ray) else { continue };
            let p = scene.shading_point(&ray, &hit);
            assert_eq!(p.ng, p.frame.z);
            assert!(p.ng.dot(p.position.normalize()) > 0.99);
            lowest = lowest.min(p.position.length());
            let origin = offset_origin(p.position, p.ng, 2.0);
            let is_seen = !scene.bvh().any_hit(&Ray::new(origin, wi));
            assert!(is_seen || p.ng.dot(wi) < 0.15, "{} at {}", p.ng.dot(wi), p.position);
        }
        // The triangles themselves come as near to the center as 0.93.
        assert!(lowest > 0.985, "{lowest}");
    }

    #[test]
    fn flat_triangles_and_hollows_stay_where_they_are() {
        let mut flat = triangle();
        flat.normals = vec![vec3(1e-4, 0.0, 2.0); 3];
        let p = look(&scene(flat, None), vec3(0.3, 0.2, 2.0));
        let bare = look(&scene(triangle(), None), vec3(0.3, 0.2, 2.0));
        assert_eq!((p.position, p.ng), (bare.position, bare.ng));
        let ball = shapes::icosphere(1);
        let within = scene(ball, None);
        let ray = Ray::new(vec3(0.1, 0.2, 0.0), vec3(0.4, 0.2, -0.9).normalize());
        let hit = within.bvh().closest_hit(&ray).unwrap();
        let p = within.shading_point(&ray, &hit);
        assert!((p.position - ray.at(hit.t)).length() < 1e-5);
        assert!(p.ng.dot(ray.direction) < 0.0);
    }

    #[test]
    fn degenerate_normals_fall_back_to_the_geometric_one() {
        for n in [Vec3::ZERO, Vec3::NAN] {
            let mut mesh = triangle();
            mesh.normals = vec![n; 3];
            assert_eq!(look(&scene(mesh, None), vec3(0.2, 0.2, 2.0)).frame.z, Vec3::Z);
        }
    }

    #[test]
    fn green_of_a_normal_map_points_up_in_the_image_on_either_side() {
        let mut mirrored = triangle();
        for uv in &mut mirrored.uvs {
            uv.x = 1.0 - uv.x;
        }
        let mut with_tangents = triangle();
        with_tangents.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3];
        for mesh in [triangle(), mirrored, with_tangents] {
            let n = look(&scene(mesh.clone(), Some([128, 218, 218])), vec3(0.25, 0.25, 3.0));
            assert!(n.frame.z.y > 0.6 && n.frame.z.z > 0.6, "{:?}", n.frame.z);
            let back = look(&scene(mesh, Some([128, 218, 218])), vec3(0.25, 0.25, -3.0));
            assert!((back.frame.z + n.frame.z).length() < 1e-3);
        }
    }

    #[test]
    fn red_of_a_normal_map_points_along_u() {
        let n = look(&scene(triangle(), Some([218, 128, 218])), vec3(0.25, 0.25, 3.0));
        assert!(n.frame.z.x > 0.6 && n.frame.z.z > 0.6);
    }

    #[test]
    fn vertex_colors_and_textures_multiply_the_base_color() {
        let mut mesh = triangle();
        mesh.colors = vec![Rgb::new(1.0, 0.5, 0.0); 3];
        let mut description = SceneDescription {
            parts: vec![Part { name: "t".into(), mesh, material: 0 }],
            materials: vec![Material::diffuse("s", Rgb::splat(0.5))],
            textures: vec![
                Texture::from_rgb8("t", 1, 1, vec![[255, 255, 51]], Encoding::Linear).unwrap(),
            ],
            ..SceneDescription::default()
        };
        if let MaterialModel::Phong(p) = &mut description.materials[0].model {
            p.diffuse_texture = Some(TextureRef::new(0));
        }
        let p = look(&Scene::new(description).unwrap(), vec3(0.25, 0.25, 3.0));
        assert_eq!(p.bsdf.albedo(), Rgb::new(0.5, 0.25, 0.0));
    }

    #[test]
    fn triangles_find_their_part_past_empty_ones() {
        let part = |name: &str, mesh| Part { name: name.into(), mesh, material: 0 };
        let mut moved = triangle();
        moved.transform(&crate::math::Mat4::from_translation(vec3(5.0, 0.0, 0.0)));
        let description = SceneDescription {
            parts: vec![
                part("empty", Mesh::default()),
                part("a", triangle()),
                part("empty", Mesh::default()),
                part("b", moved),
            ],
            materials: vec![Material::diffuse("s", Rgb::splat(0.5))],
            ..SceneDescription::default()
        };
        let scene = Scene::new(description).unwrap();
        assert_eq!((scene.locate(0).0.name.as_str(), scene.locate(0).1), ("a", 0));
        assert_eq!((scene.locate(1).0.name.as_str(), scene.locate(1).1), ("b", 0));
        assert_eq!(scene.triangle_count(), 2);
        assert_eq!(scene.bounds().max.x, 6.0);
    }

    #[test]
    fn broken_descriptions_are_refused_by_name() {
        let broken = |edit: fn(&mut SceneDescription)| {
            let mut d = SceneDescription {
                parts: vec![Part { name: "vase".into(), mesh: triangle(), material: 0 }],
                materials: vec![Material::diffuse("clay", Rgb::splat(0.5))],
                ..SceneDescription::default()
            };
            edit(&mut d);
            Scene::new(d).unwrap_err().to_string()
        };
        assert!(broken(|d| d.parts[0].mesh.triangles[0][1] = 7).contains("vase"));
        assert!(broken(|d| d.parts[0].mesh.positions[2].y = f32::NAN).contains("vase"));
        assert!(broken(|d| d.parts[0].material = 3).contains("material 3"));
        let texture = |d: &mut SceneDescription| {
            d.materials[0].normal_map = Some(NormalMap { texture: TextureRef::new(2), scale: 1.0 });
        };
        assert!(broken(texture).contains("clay"));
    }
}
