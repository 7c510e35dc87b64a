//! Instances: a tree over copies of other trees, each turned, scaled and moved.
//!
//! Every copy is traced in its object's own space, so that its memory is that of a few numbers. The upper tree has two
//! children per node and is traversed by one ray at a time, which makes rays several times slower than one tree over
//! all triangles (docs/limits.md). So [`crate::scene`] uses instances only where copies would take much memory.
//!
//! The upper tree tests boxes in double precision, without vectors: all instruction sets give the same bits.

use super::frustum::{self, Frustum};
use super::{Bvh, InstructionSet};
use crate::geometry::{Aabb, Hit, Ray, RayBatch, Similarity};
use crate::math::Vec3;

/// The depth of the upper tree: each level halves the number of instances.
const MAX_DEPTH: usize = 33;

/// A copy of an object.
#[derive(Clone, Debug)]
pub(crate) struct Instance {
    /// The index of the object.
    pub(crate) object: usize,
    /// From the object's space to the world.
    pub(crate) placement: Similarity,
    /// The index of its first triangle.
    pub(crate) first_triangle: u32,
}

/// Objects and their copies.
#[derive(Clone, Debug)]
pub(super) struct Instances {
    objects: Vec<Bvh>,
    /// The copies, in the order of the leaves.
    copies: Vec<Instance>,
    /// Depth first; the root is the first.
    nodes: Vec<Node>,
}

/// A node of the upper tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    content: Content,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Instance(u32),
    /// The left child follows its parent; this is the right one.
    Children(u32),
}

impl Instances {
    /// `None` if nothing can be hit.
    pub(super) fn new(objects: Vec<Bvh>, instances: Vec<Instance>) -> Option<Self> {
        let boxed = |instance: Instance| {
            let bounds = padded(&instance.placement.bounds(&objects[instance.object].bounds()));
            (!bounds.is_empty()).then_some((bounds, instance))
        };
        let mut leaves: Vec<_> = instances.into_iter().filter_map(boxed).collect();
        if leaves.is_empty() {
            return None;
        }
        let mut nodes = Vec::with_capacity(2 * leaves.len() - 1);
        build(&mut leaves, 0, &mut nodes);
        let copies = leaves.into_iter().map(|(_, instance)| instance).collect();
        Some(Self { objects, copies, nodes })
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.nodes[0].bounds
    }

    /// The number of triangles with an area, each counted once per copy.
    pub(super) fn triangle_count(&self) -> usize {
        self.copies.iter().map(|instance| self.objects[instance.object].triangle_count()).sum()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.copies[..])
            + size_of_val(&self.nodes[..])
            + self.objects.iter().map(Bvh::bytes).sum::<usize>()
    }

    pub(super) fn objects(&self) -> &[Bvh] {
        &self.objects
    }

    pub(super) fn set_instruction_set(&mut self, instruction_set: InstructionSet) {
        for object in &mut self.objects {
            object.instruction_set = instruction_set;
        }
    }

    /// The closest of `hit`, the first hit among other triangles, and the hits of instances that `accept` accepts.
    pub(super) fn closest_hit(
        &self,
        ray: &Ray,
        hit: Option<Hit>,
        accept: &dyn Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut closest = hit;
        let mut rest = Ray { t_max: hit.map_or(ray.t_max, |hit| hit.t), ..*ray };
        self.visit(ray, |instance, enter| {
            if enter >= f64::from(rest.t_max) {
                return Next::Go;
            }
            let object = &self.objects[instance.object];
            let in_scene = |hit: &Hit| hit.numbered_from(instance.first_triangle);
            let local = instance.placement.inverse_ray(&rest);
            if let Some(hit) = object.closest_hit_where(&local, |hit| accept(&in_scene(hit))) {
                closest = Some(in_scene(&hit));
                rest.t_max = hit.t;
            }
            Next::Go
        });
        closest
    }

    /// Whether the ray hits any instance.
    pub(super) fn any_hit(&self, ray: &Ray) -> bool {
        let mut is_hit = false;
        self.visit(ray, |instance, _| {
            is_hit = self.objects[instance.object].any_hit(&instance.placement.inverse_ray(ray));
            if is_hit { Next::Stop } else { Next::Go }
        });
        is_hit
    }

    /// The product of `of_hit` over all triangles of instances that the ray hits.
    pub(super) fn transmittance(&self, ray: &Ray, of_hit: &dyn Fn(&Hit) -> f32) -> f32 {
        let (mut product, mut answers) = (1.0, Vec::new());
        self.visit(ray, |instance, _| {
            let local = instance.placement.inverse_ray(ray);
            let one = RayBatch { origins: vec![local.origin], directions: vec![local.direction] };
            let of_hit = |_, hit: &Hit| of_hit(&hit.numbered_from(instance.first_triangle));
            self.objects[instance.object].transmittances(&one, &of_hit, &mut answers);
            product *= answers[0];
            if product > 0.0 { Next::Go } else { Next::Stop }
        });
        product
    }

    /// Whether a ray within the frustum may hit an instance's box.
    pub(super) fn may_hit(&self, frustum: &Frustum) -> bool {
        let planes = frustum::planes(frustum, &self.bounds());
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node: &Node = &self.nodes[index];
            if !frustum::sees(&planes, &node.bounds) {
                continue;
            }
            match node.content {
                Content::Instance(_) => return true,
                Content::Children(right) => stack.extend([index + 1, right as usize]),
            }
        }
        false
    }

    /// Visits the instances whose boxes the ray enters before its end, with the distances where it enters them, nearer
    /// children first. A ray that is not finite or has no direction visits none.
    fn visit(&self, ray: &Ray, mut visit: impl FnMut(&Instance, f64) -> Next) {
        let Some(slabs) = Slabs::new(ray) else { return };
        let mut stack = [(0, 0.0); MAX_DEPTH + 1];
        let mut len = 0;
        let push = |stack: &mut [(u32, f64)], len: &mut usize, entry| {
            stack[*len] = entry;
            *len += 1;
        };
        if let Some(enter) = slabs.enter(&self.nodes[0].bounds) {
            push(&mut stack, &mut len, (0, enter));
        }
        while len > 0 {
            len -= 1;
            let (index, enter) = stack[len];
            let right = match self.nodes[index as usize].content {
                Content::Children(right) => right,
                Content::Instance(instance) => {
                    match visit(&self.copies[instance as usize], enter) {
                        Next::Go => continue,
                        Next::Stop => return,
                    }
                }
            };
            let entered = |child: u32| {
                slabs.enter(&self.nodes[child as usize].bounds).map(|enter| (child, enter))
            };
            match (entered(index + 1), entered(right)) {
                (Some(a), Some(b)) => {
                    let (near, far) = if b.1 < a.1 { (b, a) } else { (a, b) };
                    push(&mut stack, &mut len, far);
                    push(&mut stack, &mut len, near);
                }
                (Some(child), None) | (None, Some(child)) => push(&mut stack, &mut len, child),
                (None, None) => {}
            }
        }
    }
}

/// Whether a traversal goes on.
enum Next {
    Go,
    Stop,
}

/// Sorts `leaves` into a tree, halving their number along the longest axis of their centers.
fn build(leaves: &mut [(Aabb, Instance)], first: u32, nodes: &mut Vec<Node>) {
    let bounds = leaves.iter().fold(Aabb::EMPTY, |all, (bounds, _)| all.union(*bounds));
    let index = nodes.len();
    nodes.push(Node { bounds, content: Content::Instance(first) });
    if leaves.len() == 1 {
        return;
    }
    let extent = Aabb::around(leaves.iter().map(|(bounds, _)| bounds.center())).size();
    let axis =
        if extent.x >= extent.y.max(extent.z) { 0 } else { 1 + usize::from(extent.z > extent.y) };
    let middle = leaves.len() / 2;
    leaves.select_nth_unstable_by(middle, |(a, i), (b, j)| {
        let order = a.center()[axis].total_cmp(&b.center()[axis]);
        order.then(i.first_triangle.cmp(&j.first_triangle))
    });
    let (left, right) = leaves.split_at_mut(middle);
    build(left, first, nodes);
    nodes[index].content = Content::Children(nodes.len() as u32);
    build(right, first + middle as u32, nodes);
}

/// A box widened by what rounding may move a hit that is computed in an object's space.
fn padded(bounds: &Aabb) -> Aabb {
    const ROUNDING: f32 = 16.0 * f32::EPSILON;
    let margin = ROUNDING * bounds.min.abs().max(bounds.max.abs()).max_element();
    Aabb { min: bounds.min - margin, max: bounds.max + margin }
}

/// A ray prepared for box tests.
struct Slabs {
    origin: [f64; 3],
    direction: [f64; 3],
    end: f64,
}

impl Slabs {
    /// `None` if the ray cannot hit anything.
    fn new(ray: &Ray) -> Option<Self> {
        let is_usable =
            ray.origin.is_finite() && ray.direction.is_finite() && ray.direction != Vec3::ZERO;
        let wide = |v: Vec3| v.to_array().map(f64::from);
        is_usable.then(|| Self {
            origin: wide(ray.origin),
            direction: wide(ray.direction),
            end: f64::from(ray.t_max),
        })
    }

    /// Where the ray enters a box, at least 0; `None` if it misses the box or ends before it.
    fn enter(&self, bounds: &Aabb) -> Option<f64> {
        let (mut enter, mut exit) = (0.0f64, self.end);
        for axis in 0..3 {
            let (o, d) = (self.origin[axis], self.direction[axis]);
            let planes = [bounds.min[axis], bounds.max[axis]].map(f64::from);
            if d == 0.0 {
                if o < planes[0] || o > planes[1] {
                    return None;
                }
                continue;
            }
            let [a, b] = planes.map(|plane| (plane - o) / d);
            enter = enter.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        (enter <= exit).then_some(enter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::math::{Mat4, Quat, vec3};
    use crate::sampling::Pcg32;
    use crate::scene::builtin::shapes;

    fn random(pcg: &mut Pcg32, size: f32) -> Vec3 {
        let mut number = || size * (2.0 * pcg.next_f32() - 1.0);
        vec3(number(), number(), number())
    }

    fn bvh(mesh: &Mesh) -> Bvh {
        Bvh::build(&mesh.positions, &mesh.triangles).unwrap()
    }

    /// A ball and a tetrahedron in many places, as instances and as one tree, around a box of its own.
    fn both() -> (Bvh, Bvh) {
        let mut pcg = Pcg32::new(7, 8);
        let objects = [shapes::icosphere(2), shapes::icosphere(0)];
        let own = shapes::icosphere(1);
        let mut flat = own.clone();
        let mut instances = Vec::new();
        for i in 0..200 {
            let axis = random(&mut pcg, 1.0).normalize();
            let matrix = Mat4::from_scale_rotation_translation(
                Vec3::splat(0.2 + pcg.next_f32()),
                Quat::from_axis_angle(axis, 6.0 * pcg.next_f32()),
                random(&mut pcg, 12.0),
            );
            let object = i % 2;
            let placement = Similarity::from_matrix(&matrix).unwrap();
            instances.push(Instance {
                object,
                placement,
                first_triangle: flat.triangles.len() as u32,
            });
            let first = flat.positions.len() as u32;
            let mesh = &objects[object];
            flat.positions.extend(mesh.positions.iter().map(|&p| placement.point(p)));
            flat.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + first)));
        }
        let objects = objects.iter().map(bvh).collect();
        (bvh(&own).with_instances(objects, instances), bvh(&flat))
    }

    fn rays(pcg: &mut Pcg32, n: usize) -> Vec<Ray> {
        let ray = |_| Ray::new(random(pcg, 15.0), random(pcg, 1.0).normalize());
        (0..n).map(ray).collect()
    }

    fn near(a: Option<Hit>, b: Option<Hit>) -> bool {
        match (a, b) {
            (Some(a), Some(b)) => {
                a.triangle == b.triangle && (a.t - b.t).abs() <= 1e-4 * (1.0 + b.t)
            }
            (a, b) => a.is_none() && b.is_none(),
        }
    }

    /// Rays may differ where they graze an edge: a few of many.
    #[test]
    fn instances_are_hit_where_their_triangles_are() {
        let (instanced, flat) = both();
        assert_eq!(instanced.triangle_count(), flat.triangle_count());
        assert!((instanced.bounds().max - flat.bounds().max).abs().max_element() < 1e-3 + 1.5);
        instanced.validate().unwrap();
        let rays = rays(&mut Pcg32::new(1, 2), 20_000);
        let differing =
            rays.iter().filter(|r| !near(instanced.closest_hit(r), flat.closest_hit(r)));
        assert!(differing.count() <= 4);
        let hits = rays.iter().filter(|ray| instanced.closest_hit(ray).is_some()).count();
        assert!(hits > 2000, "{hits}");
    }

    #[test]
    fn all_questions_have_the_same_answer() {
        let (bvh, _) = both();
        let rays = rays(&mut Pcg32::new(3, 4), 5000);
        let single: Vec<_> = rays.iter().map(|ray| bvh.closest_hit(ray)).collect();
        let mut hits = Vec::new();
        bvh.closest_hits(&rays, &mut hits);
        assert_eq!(hits, single);
        let everything =
            |of: &[(usize, Hit)], accepted: &mut [bool]| accepted[..of.len()].fill(true);
        bvh.closest_hits_where(&rays, everything, &mut hits);
        assert_eq!(hits, single);
        let mut batch = RayBatch::default();
        for ray in &rays {
            batch.push(ray.origin, ray.direction);
        }
        let mut occluded = Vec::new();
        bvh.occluded(&batch, &mut occluded);
        let mut transmittances = Vec::new();
        bvh.transmittances(&batch, &|_, _| 0.0, &mut transmittances);
        for (i, ray) in rays.iter().enumerate() {
            let is_hit = single[i].is_some();
            assert_eq!((bvh.any_hit(ray), occluded[i]), (is_hit, is_hit));
            assert_eq!(transmittances[i], if is_hit { 0.0 } else { 1.0 });
            // Without the closest triangle, the next one is hit, farther away.
            let Some(first) = single[i] else { continue };
            let next = bvh.closest_hit_where(ray, |hit| hit.triangle != first.triangle);
            assert!(next.is_none_or(|next| next.t >= first.t && next.triangle != first.triangle));
            let short = Ray { t_max: first.t, ..*ray };
            assert!(bvh.closest_hit(&short).is_none_or(|hit| hit.t < first.t));
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (bvh, _) = both();
        let rays = rays(&mut Pcg32::new(5, 6), 3000);
        let of = |set| {
            let bvh = bvh.clone().with_instruction_set(set)?;
            Some(rays.iter().map(|ray| bvh.closest_hit(ray)).collect::<Vec<_>>())
        };
        let scalar = of(InstructionSet::Scalar);
        for set in InstructionSet::ALL {
            assert!(of(set).is_none_or(|other| Some(other) == scalar), "{set:?}");
        }
    }

    #[test]
    fn rays_without_a_direction_hit_nothing_and_planes_count() {
        let (bvh, _) = both();
        for (origin, direction) in [
            (Vec3::ZERO, Vec3::ZERO),
            (Vec3::NAN, Vec3::X),
            (Vec3::ZERO, Vec3::splat(f32::INFINITY)),
        ] {
            assert_eq!(bvh.closest_hit(&Ray::new(origin, direction)), None);
            assert!(!bvh.any_hit(&Ray::new(origin, direction)));
        }
        let one = Bvh::build(&[], &[]).unwrap();
        let placement =
            Similarity::from_matrix(&Mat4::from_translation(vec3(5.0, 0.0, 0.0))).unwrap();
        let objects = vec![self::bvh(&shapes::icosphere(1))];
        let one =
            one.with_instances(objects, vec![Instance { object: 0, placement, first_triangle: 9 }]);
        let hit = one.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)).unwrap();
        assert!(hit.triangle >= 9 && (hit.t - 4.0).abs() < 0.2);
        let corners = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]];
        let view = |forward: Vec3, x: Vec3, y: Vec3| {
            Frustum::new(
                [Vec3::ZERO; 4],
                corners.map(|[a, b]| (forward + a * x + b * y).normalize()),
            )
        };
        assert!(one.may_hit(&view(Vec3::X, Vec3::Y, Vec3::Z)));
        assert!(!one.may_hit(&view(Vec3::Y, Vec3::Z, Vec3::X)));
    }
}
