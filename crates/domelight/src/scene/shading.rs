//! Turns a hit into a shading point: position, normals, frame and BSDF.
//!
//! Surfaces are shaded from either side: both normals are flipped to the viewer's side. The position is computed from
//! the barycentric coordinates, with the error of the vertices, rather than from origin + t · direction, whose error
//! grows with the distance.
//!
//! [`facet`](super::facet) does what needs no material, for several hits side by side.

use super::corners::Corners;
use super::facet::{Facet, TriangleLanes};
use super::texture::Uvs;
use super::{Layers, Material, NormalMap, Part, Scene};
use crate::Rgb;
use crate::bsdf::Bsdf;
use crate::geometry::{Hit, Ray, Similarity};
use crate::math::{Frame, Vec3};
use crate::simd::{Kernel, LANES, Simd, dispatch};
use crate::strategy::ShadingPoint;

impl Scene {
    /// The shading point of a hit that [`Scene::bvh`] reported for `ray`.
    ///
    /// # Panics
    /// If `hit.triangle` is not one of this scene's.
    pub fn shading_point(&self, ray: &Ray, hit: &Hit) -> ShadingPoint {
        let mut point = ShadingPoint::UNSET;
        let surface = self.surface(ray, hit);
        let facet = Facet::new(&surface.part.mesh, &surface.corners, surface.direction);
        self.shade(&surface, &facet, &mut point);
        point
    }

    /// The material, an index into [`Scene::materials`], of a hit that [`Scene::bvh`] reported.
    ///
    /// # Panics
    /// If `hit.triangle` is not one of this scene's.
    pub fn material_of(&self, hit: &Hit) -> usize {
        self.locate(hit.triangle).0.material
    }

    /// Sets each of `points` to [`Scene::shading_point`] of one of the `seeing` rays, and each of `constants` to its
    /// material if the BSDF of this is the same everywhere. `hits` has an entry for each ray.
    ///
    /// # Panics
    /// If one of the `seeing` rays hits nothing.
    pub(crate) fn shade_all(
        &self,
        rays: &[Ray],
        hits: &[Option<Hit>],
        seeing: &[u32],
        points: &mut [ShadingPoint],
        constants: &mut [Option<usize>],
    ) {
        dispatch(
            self.bvh.instruction_set(),
            ShadeAll { scene: self, rays, hits, seeing, points, constants },
        );
    }

    /// The triangle of a hit.
    #[inline]
    fn surface(&self, ray: &Ray, hit: &Hit) -> Surface<'_> {
        let (part, triangle) = self.locate(hit.triangle);
        let placement = self.placement(hit.triangle);
        let direction = placement.map_or(ray.direction, |p| p.inverse_direction(ray.direction));
        let corners = Corners::new(&part.mesh, triangle, hit);
        Surface { part, placement, corners, direction }
    }

    /// Sets `point` to the shading point of a facet. Returns the material if its BSDF is the same everywhere.
    fn shade(
        &self,
        surface: &Surface,
        facet: &Facet<f32>,
        point: &mut ShadingPoint,
    ) -> Option<usize> {
        let Surface { part, placement, corners, .. } = surface;
        let material = &self.materials[part.material];
        let uvs = corners.uvs(&part.mesh);
        let smooth = facet.smooth();
        let relief = if material.needs_tangent() {
            self.relief(part, material, corners, smooth, &uvs)
        } else {
            Relief { normal: smooth, coat_normal: smooth, tangent: None }
        };
        let toward_viewer = |normal: Vec3| {
            if normal == smooth {
                facet.toward_viewer(normal.into()).into()
            } else {
                facet.mapped_toward_viewer(normal)
            }
        };
        let normal = toward_viewer(relief.normal);
        let frame = relief
            .tangent
            .map_or_else(|| Frame::from_z(normal), |t| Frame::from_z_and_tangent(normal, t));
        facet.set(point, frame);
        let coat_normal = match material.layers.clearcoat {
            Some(_) if relief.coat_normal != relief.normal => {
                frame.to_local(toward_viewer(relief.coat_normal))
            }
            _ => Vec3::Z,
        };
        let constant = match (&self.constant_bsdfs[part.material], corners.mix(&part.mesh.colors)) {
            (Some(bsdf), None) => {
                point.bsdf.set(bsdf, point.wo);
                Some(part.material)
            }
            (_, tint) => {
                let tint = tint.unwrap_or(Rgb::WHITE);
                let directions = [point.wo, coat_normal];
                material.set_bsdf(&self.textures, &uvs, tint, directions, &mut point.bsdf);
                None
            }
        };
        if let Some(placement) = placement {
            point.position = placement.point(point.position);
            point.ng = placement.direction(point.ng);
            point.frame = placement.frame(point.frame);
        }
        constant
    }

    /// The BSDF of a surface on which nothing but the mesh's normals varies.
    #[inline]
    fn plain_bsdf(&self, Surface { part, placement, .. }: &Surface) -> Option<&Bsdf> {
        let is_plain = self.plain_materials[part.material] && part.mesh.colors.is_empty();
        let bsdf = self.constant_bsdfs[part.material].as_ref();
        bsdf.filter(|_| is_plain && placement.is_none())
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
        let tangent = corner.mix(&mesh.tangents).or_else(|| {
            let (set, transform) = material.tangent_uvs();
            let uvs = if set == 1 { &mesh.uvs2 } else { &mesh.uvs };
            corner.uv_tangent(&mesh.positions, uvs, &transform, normal)
        });
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

/// The triangle of a hit and the direction in which it is seen, where the mesh of its part is.
struct Surface<'a> {
    part: &'a Part,
    /// From there to the hit; `None` if it is the same place.
    placement: Option<&'a Similarity>,
    corners: Corners,
    direction: Vec3,
}

/// Shades hits side by side.
struct ShadeAll<'a> {
    scene: &'a Scene,
    rays: &'a [Ray],
    hits: &'a [Option<Hit>],
    seeing: &'a [u32],
    points: &'a mut [ShadingPoint],
    constants: &'a mut [Option<usize>],
}

impl Kernel for ShadeAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { scene, rays, hits, seeing, points, constants } = self;
        let mut lanes = TriangleLanes::default();
        let mut surfaces = [const { None }; LANES];
        let out = points.chunks_mut(LANES).zip(constants.chunks_mut(LANES));
        for (seeing, (points, constants)) in seeing.chunks(LANES).zip(out) {
            for (lane, &ray) in seeing.iter().enumerate() {
                let (ray, hit) = (&rays[ray as usize], hits[ray as usize].as_ref());
                let surface = scene.surface(ray, hit.expect("the ray hits something"));
                lanes.set(lane, &surface.part.mesh, &surface.corners, surface.direction);
                surfaces[lane] = Some(surface);
            }
            let facets = lanes.facets(simd);
            let out = points.iter_mut().zip(constants);
            for (lane, (surface, (point, constant))) in
                surfaces.iter().flatten().zip(out).enumerate()
            {
                *constant = if let Some(bsdf) = scene.plain_bsdf(surface) {
                    facets.set(lane, point);
                    point.bsdf.set(bsdf, point.wo);
                    Some(surface.part.material)
                } else {
                    scene.shade(surface, &facets.get(lane), point)
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::facet::MIN_COS_THETA_O;
    use super::*;
    use crate::geometry::{Mesh, offset_origin};
    use crate::math::{Mat4, Quat, Vec4, vec2, vec3};
    use crate::sampling::Pcg32;
    use crate::sampling::warp::uniform_sphere;
    use crate::scene::builtin::shapes;
    use crate::scene::{
        Encoding, Instance, MaterialModel, NormalMap, SceneDescription, Texture, TextureRef,
    };
    use crate::simd::InstructionSet;

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

    /// A copy of a mesh, turned and enlarged.
    fn scene_of_copy(mesh: Mesh) -> Scene {
        let part = Part { name: "original".into(), mesh, material: 0 };
        let turn = Quat::from_rotation_x(0.7);
        let transform = Mat4::from_scale_rotation_translation(Vec3::splat(2.0), turn, Vec3::X);
        let description = SceneDescription {
            parts: vec![part],
            instances: vec![Instance { part: 0, transform }],
            materials: vec![Material::diffuse("gray", Rgb::splat(0.5))],
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

    /// The mirror direction about a normal from a map lies above the surface, however steep the map and from either side.
    #[test]
    fn mapped_normals_mirror_the_view_out_of_the_surface() {
        let mut bent = 0;
        for texel in [[255, 128, 128], [128, 255, 140], [10, 60, 128], [0, 0, 0], [150, 120, 250]] {
            let scene = scene(triangle(), Some(texel));
            for i in 0..200u8 {
                let angle = 0.13 * f32::from(i);
                let height = 0.001 + 0.02 * f32::from(i);
                let height = if i % 2 == 0 { height } else { -height };
                let from = vec3(0.25 + 2.0 * angle.cos(), 0.25 + 2.0 * angle.sin(), height);
                let p = look(&scene, from);
                let mirror = p.frame.to_world(vec3(-p.wo.x, -p.wo.y, p.wo.z));
                let cos_o = p.frame.to_world(p.wo).dot(p.ng);
                let least = (0.9 * cos_o).min(0.01);
                // Where the surface is seen from its edge, the normal has to face the viewer first.
                if p.wo.z > 1.01 * MIN_COS_THETA_O {
                    assert!(mirror.dot(p.ng) > least - 1e-4, "{texel:?} {from}: {mirror}");
                }
                assert!(p.wo.z > 0.5 * MIN_COS_THETA_O && p.frame.z.is_finite(), "{texel:?}");
                bent += usize::from((mirror.dot(p.ng) - least).abs() < 1e-4);
            }
        }
        assert!(bent > 100, "{bent}");
        // A gentle relief keeps its normals.
        let p = look(&scene(triangle(), Some([150, 128, 250])), vec3(0.5, 1.0, 3.0));
        let unbent = vec3(45.0, 1.0, 245.0).normalize();
        assert!((p.frame.z - unbent).length() < 1e-3, "{}", p.frame.z);
    }

    /// Triangles of a coarse ball do not shade one another: rays start on the ball, and leave it wherever its normal says.
    /// Hits that are shaded side by side have the bits of those shaded one by one: with and without normals, seen from
    /// either side, at grazing angles, with a normal map, with vertex colors, and in a copy.
    #[test]
    fn hits_side_by_side_have_the_same_bits() {
        let ball = shapes::uv_sphere(7, 5);
        let mut flat = ball.clone();
        flat.normals.clear();
        let mut colored = ball.clone();
        colored.colors = vec![Rgb::new(0.2, 0.4, 0.8); ball.positions.len()];
        let mut pcg = Pcg32::new(5, 9);
        let mut hits_of_all = 0;
        let scenes = [scene(ball.clone(), None), scene(flat, None), scene(colored, None)]
            .into_iter()
            .chain([scene(ball.clone(), Some([200, 90, 180])), scene_of_copy(ball)]);
        for scene in scenes {
            let rays: Vec<Ray> = (0..200)
                .map(|i| {
                    let at = uniform_sphere(vec2(pcg.next_f32(), pcg.next_f32()));
                    let toward = 1.1 * uniform_sphere(vec2(pcg.next_f32(), pcg.next_f32()));
                    let from = if i % 4 == 0 { 0.1 * at } else { 4.0 * at };
                    Ray::new(from, (toward - from) * (0.5 + pcg.next_f32()))
                })
                .collect();
            let hits: Vec<_> = rays.iter().map(|ray| scene.bvh().closest_hit(ray)).collect();
            let seeing: Vec<u32> = (0..200).filter(|&ray| hits[ray as usize].is_some()).collect();
            hits_of_all += seeing.len();
            for set in InstructionSet::ALL {
                let mut points = vec![ShadingPoint::UNSET; seeing.len()];
                let mut constants = vec![None; seeing.len()];
                let (out, constants) = (&mut points[..], &mut constants[..]);
                let kernel = ShadeAll {
                    scene: &scene,
                    rays: &rays,
                    hits: &hits,
                    seeing: &seeing,
                    points: out,
                    constants,
                };
                dispatch(set, kernel);
                for (&ray, point) in seeing.iter().zip(&points) {
                    let ray = ray as usize;
                    let one = scene.shading_point(&rays[ray], &hits[ray].unwrap());
                    assert_eq!(format!("{point:?}"), format!("{one:?}"), "{set:?}");
                }
            }
        }
        assert!(hits_of_all > 500, "{hits_of_all}");
    }

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
        moved.transform(&Mat4::from_translation(vec3(5.0, 0.0, 0.0)));
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
