//! The surface at a hit, or at several side by side, before its material: position, normals and viewer.
//!
//! An interpolated or mapped normal may face away from the viewer although the surface does not.
//! Such a normal is **bent toward the viewer** until `wo` lies just above the shading horizon:
//! n' = √(1 − ε²) t + ε wo with t ∝ n − (n·wo) wo, the nearest normal with n'·wo = ε. Otherwise there
//! would be black pixels along silhouettes.
//!
//! A normal from a map may face the viewer and yet mirror the view into the surface, where there is no light: glossy
//! metal would have black blotches. Such a normal n is **bent toward the surface's own normal** g until the mirror
//! direction r lies just above the surface, at r·g = t (as in Cycles, `ensure_valid_specular_reflection`). In the plane
//! of g and n, at the angle θ from g, r·g = v_x sin 2θ + v_z cos 2θ, where v_x and v_z are the components of the
//! direction to the viewer; so cos 2θ = (v_z t − v_x √(ρ² − t²))/ρ² with ρ² = v_x² + v_z².
//!
//! A smooth surface with coarse triangles is shaded as smooth: shadow rays start where the smooth surface would be,
//! above the triangle, and may point as far down as it allows. Otherwise triangles shadow one another near the
//! terminator, in stair-steps. (Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4.)

use super::corners::Corners;
use crate::geometry::Mesh;
use crate::math::{Frame, Vec3, sqr, tangents};
use crate::simd::{LaneMask, Lanes, Simd, SimdF32x8, SimdFloat, Vectors, lane_of};
use crate::strategy::ShadingPoint;

/// The minimum cosine between the shading normal and the direction to the viewer.
pub(super) const MIN_COS_THETA_O: f32 = 1e-3;

/// The minimum cosine between the surface's own normal and the mirror direction about a normal from a map, and the share
/// of that to the viewer, if that is less.
const MIN_COS_MIRROR: f32 = 0.01;
const MIN_MIRROR_SHARE: f32 = 0.9;

/// Vertex normals within this cosine of the geometric one belong to a flat triangle: 0.1°, far more than rounding.
const COS_FLAT: f32 = 0.999_998;

/// Vertex normals beyond this cosine do not describe a smooth surface over the triangle: 60°.
const COS_ROUGH: f32 = 0.5;

/// What a [`Facet`] is made of.
#[derive(Clone, Copy)]
struct Triangle<F> {
    corners: [Vectors<F>; 3],
    /// The vertex normals; 0 if the mesh has none.
    normals: [Vectors<F>; 3],
    /// The barycentric weights of the last two corners.
    uv: [F; 2],
    /// The direction of the camera ray, of any length.
    direction: Vectors<F>,
}

/// The surface at a hit, or at several side by side.
#[derive(Clone, Copy)]
pub(super) struct Facet<F: SimdFloat> {
    /// The unit direction to the viewer.
    viewer: Vectors<F>,
    /// The geometric normal, toward the viewer's side.
    ng: Vectors<F>,
    /// The interpolated normal, toward the front side.
    smooth: Vectors<F>,
    /// 1 if the viewer is on the front side, else −1.
    side: F,
    /// Where shadow rays start.
    position: Vectors<F>,
    /// Whether the position is above the triangle.
    is_risen: F::Mask,
}

impl<F: SimdFloat> Facet<F> {
    /// The position is raised from the triangle up to the smooth surface that the vertex normals nᵢ describe, if that
    /// surface bulges to the viewer's side: by Σ bᵢ max(0, (pᵢ − p) · nᵢ) nᵢ, where each term leads to the tangent plane
    /// of a vertex; not on flat triangles and in hollows.
    #[inline(always)]
    fn of_triangle(triangle: &Triangle<F>) -> Self {
        let Triangle { corners, normals, uv: [u, v], direction } = *triangle;
        let (zero, one) = (u.splat(0.0), u.splat(1.0));
        let minus_one = zero - one;
        let weights = [one - u - v, u, v];
        let viewer = direction.times(one / direction.length_squared().sqrt()).times(minus_one);
        // The normals.
        let [p0, p1, p2] = corners;
        let ng = p1.minus(p0).cross(p2.minus(p0)).normalized_or(viewer);
        let smooth = mix(&normals, &weights).normalized_or(ng);
        let ng = ng.times(F::select(ng.dot_each(viewer).lt(zero), minus_one, one));
        let side = F::select(smooth.dot_each(ng).lt(zero), minus_one, one);
        // The smooth surface over the triangle.
        let position = mix(&corners, &weights);
        let none = Vectors { x: zero, y: zero, z: zero };
        let (mut rise, mut least) = (none, one);
        for i in 0..3 {
            let normal = normals[i].normalized_or(none).times(side);
            let height = corners[i].minus(position).dot_each(normal).max(zero);
            rise = rise.plus(normal.times(weights[i] * height));
            least = least.min(normal.dot_each(ng));
        }
        let bulges = least.le(zero.splat(COS_FLAT)) & zero.splat(COS_ROUGH).le(least);
        let is_risen = bulges & zero.lt(rise.length_squared());
        let position = Vectors::select(is_risen, position.plus(rise), position);
        Self { viewer, ng, smooth, side, position, is_risen }
    }

    /// A normal of the front side on the viewer's side, and bent toward the viewer if it faces away.
    #[inline(always)]
    pub(super) fn toward_viewer(&self, normal: Vectors<F>) -> Vectors<F> {
        let normal = normal.times(self.side);
        let cos_theta_o = normal.dot_each(self.viewer);
        let faces_away = cos_theta_o.lt(cos_theta_o.splat(MIN_COS_THETA_O));
        if faces_away.bits() == 0 {
            return normal;
        }
        Vectors::select(faces_away, self.bent(normal), normal)
    }

    /// `normal` bent until its cosine with the direction to the viewer is [`MIN_COS_THETA_O`].
    #[inline(always)]
    fn bent(&self, normal: Vectors<F>) -> Vectors<F> {
        let horizon = (1.0 - MIN_COS_THETA_O * MIN_COS_THETA_O).sqrt();
        let grazing =
            self.grazing(normal).normalized_or(self.grazing(self.ng).normalized_or(self.viewer));
        let (up, along) = (
            self.viewer.times(self.side.splat(MIN_COS_THETA_O)),
            grazing.times(self.side.splat(horizon)),
        );
        along.plus(up).normalized_or(self.viewer)
    }

    /// The part of `v` perpendicular to the direction to the viewer.
    #[inline(always)]
    fn grazing(&self, v: Vectors<F>) -> Vectors<F> {
        v.minus(self.viewer.times(v.dot_each(self.viewer)))
    }

    /// The shading frame if there is no relief.
    #[inline(always)]
    fn frame(&self) -> [Vectors<F>; 3] {
        let z = self.toward_viewer(self.smooth);
        let [x, y] = tangents(z);
        [x, y, z]
    }
}

impl Facet<f32> {
    /// The surface at a hit of a ray with this direction.
    pub(super) fn new(mesh: &Mesh, corners: &Corners, direction: Vec3) -> Self {
        Self::of_triangle(&Triangle {
            corners: corners.of(&mesh.positions).map(Vectors::from),
            normals: corners.normals(mesh).map(Vectors::from),
            uv: corners.uv(),
            direction: direction.into(),
        })
    }

    /// The interpolated normal, toward the front side.
    pub(super) fn smooth(&self) -> Vec3 {
        self.smooth.into()
    }

    /// The normal of the surface below which there is no light.
    fn surface_normal(&self) -> Vec3 {
        if self.is_risen { self.toward_viewer(self.smooth).into() } else { self.ng.into() }
    }

    /// A mapped normal of the front side on the viewer's side, bent if it faces away, and bent toward the surface's own
    /// normal if it mirrors the view into the surface.
    pub(super) fn mapped_toward_viewer(&self, normal: Vec3) -> Vec3 {
        let normal = Vec3::from(self.toward_viewer(normal.into()));
        let (viewer, up) = (Vec3::from(self.viewer), self.surface_normal());
        let cos_o = viewer.dot(up);
        let mirror = 2.0 * normal.dot(viewer) * normal.dot(up) - cos_o;
        let least = (MIN_MIRROR_SHARE * cos_o).min(MIN_COS_MIRROR);
        if mirror >= least {
            return normal;
        }
        let Some(along) = (normal - normal.dot(up) * up).try_normalize() else { return up };
        let across = viewer.dot(along);
        let length2 = sqr(across) + sqr(cos_o);
        let cos_double =
            (cos_o * least - across * (length2 - sqr(least)).max(0.0).sqrt()) / length2;
        let [cos, sin] = [cos_double, -cos_double].map(|c| (0.5 + 0.5 * c).clamp(0.0, 1.0).sqrt());
        let bent = (cos * up + sin * along).try_normalize().unwrap_or(up) * self.side;
        // At grazing views of the surface, the viewer has the last word.
        self.toward_viewer(bent.into()).into()
    }

    /// Sets all of a shading point but its BSDF.
    pub(super) fn set(&self, point: &mut ShadingPoint, frame: Frame) {
        point.position = self.position.into();
        point.ng = self.surface_normal();
        point.frame = frame;
        point.wo = frame.to_local(self.viewer.into()).normalize();
    }
}

/// Σ bᵢ vᵢ.
#[inline(always)]
fn mix<F: SimdFloat>([a, b, c]: &[Vectors<F>; 3], [u, v, w]: &[F; 3]) -> Vectors<F> {
    a.times(*u).plus(b.times(*v)).plus(c.times(*w))
}

/// Three components by lane.
type Lanes3 = [Lanes; 3];

/// What [`Triangle`]s hold, by lane.
#[derive(Default)]
pub(super) struct TriangleLanes {
    corners: [Lanes3; 3],
    normals: [Lanes3; 3],
    uv: [Lanes; 2],
    direction: Lanes3,
}

impl TriangleLanes {
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, mesh: &Mesh, corners: &Corners, direction: Vec3) {
        let (positions, normals, uv) =
            (corners.of(&mesh.positions), corners.normals(mesh), corners.uv());
        for i in 0..3 {
            set_lane(&mut self.corners[i], lane, positions[i]);
            set_lane(&mut self.normals[i], lane, normals[i]);
        }
        (self.uv[0][lane], self.uv[1][lane]) = (uv[0], uv[1]);
        set_lane(&mut self.direction, lane, direction);
    }

    /// The surfaces.
    #[inline(always)]
    pub(super) fn facets<S: Simd>(&self, simd: S) -> FacetLanes {
        let [[p0, p1, p2], [n0, n1, n2]] = [&self.corners, &self.normals];
        let facet = Facet::of_triangle(&Triangle {
            corners: [Vectors::load(simd, p0), Vectors::load(simd, p1), Vectors::load(simd, p2)],
            normals: [Vectors::load(simd, n0), Vectors::load(simd, n1), Vectors::load(simd, n2)],
            uv: [simd.load(&self.uv[0]), simd.load(&self.uv[1])],
            direction: Vectors::load(simd, &self.direction),
        });
        let [x, y, z] = facet.frame();
        let wo = Vectors {
            x: x.dot_each(facet.viewer),
            y: y.dot_each(facet.viewer),
            z: z.dot_each(facet.viewer),
        };
        let wo = wo.times(wo.x.splat(1.0) / wo.length_squared().sqrt());
        FacetLanes {
            viewer: facet.viewer.store(),
            ng: facet.ng.store(),
            smooth: facet.smooth.store(),
            side: facet.side.store(),
            position: facet.position.store(),
            is_risen: facet.is_risen.bits(),
            frame: [x.store(), y.store(), z.store()],
            wo: wo.store(),
        }
    }
}

/// [`Facet`]s by lane.
pub(super) struct FacetLanes {
    viewer: Lanes3,
    ng: Lanes3,
    smooth: Lanes3,
    side: Lanes,
    position: Lanes3,
    is_risen: u32,
    /// The shading frame if there is no relief.
    frame: [Lanes3; 3],
    /// The direction to the viewer in this frame.
    wo: Lanes3,
}

impl FacetLanes {
    /// The surface of one lane.
    pub(super) fn get(&self, lane: usize) -> Facet<f32> {
        Facet {
            viewer: vec3_of(&self.viewer, lane).into(),
            ng: vec3_of(&self.ng, lane).into(),
            smooth: vec3_of(&self.smooth, lane).into(),
            side: self.side[lane],
            position: vec3_of(&self.position, lane).into(),
            is_risen: self.is_risen(lane),
        }
    }

    /// [`Facet::set`] with the frame of a surface without relief.
    #[inline(always)]
    pub(super) fn set(&self, lane: usize, point: &mut ShadingPoint) {
        let [x, y, z] = &self.frame;
        let frame = Frame { x: vec3_of(x, lane), y: vec3_of(y, lane), z: vec3_of(z, lane) };
        point.position = vec3_of(&self.position, lane);
        point.ng = if self.is_risen(lane) { frame.z } else { vec3_of(&self.ng, lane) };
        point.frame = frame;
        point.wo = vec3_of(&self.wo, lane);
    }

    #[inline(always)]
    fn is_risen(&self, lane: usize) -> bool {
        self.is_risen >> lane & 1 == 1
    }
}

#[inline(always)]
fn set_lane(of: &mut Lanes3, lane: usize, v: Vec3) {
    (of[0][lane], of[1][lane], of[2][lane]) = (v.x, v.y, v.z);
}

#[inline(always)]
fn vec3_of(v: &Lanes3, lane: usize) -> Vec3 {
    lane_of(v, lane).into()
}
