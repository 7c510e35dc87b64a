//! Product sampling on hits and visibility of another crate's ray tracer: shading points in, radiance out.

use std::time::Duration;

use domelight::bsdf::{Bsdf, Lambert};
use domelight::math::{Frame, Vec3, vec3};
use domelight::prelude::*;
use domelight::sampling::{Sampler, SamplerKind};
use domelight::strategy::{
    Estimator, PixelPoints, ProductSampling, ShadingPoint, Strategy, TileShading,
};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::test_util::geometry::{PLANE, icosphere};
use obvhs::{BvhBuildParams, triangle::Triangle};

/// The index and distance of the closest triangle.
fn trace(bvh: &CwBvh, triangles: &[Triangle], origin: Vec3, wi: Vec3) -> Option<(usize, f32)> {
    let id = |i: usize| bvh.primitive_indices[i] as usize;
    let mut hit = RayHit::none();
    let ray = Ray::new_inf(origin.into(), wi.into());
    let found = bvh.ray_traverse(ray, &mut hit, |ray, i| triangles[id(i)].intersect(ray));
    found.then(|| (id(hit.primitive_id as usize), hit.t))
}

pub(crate) fn main() {
    let mut triangles = icosphere(2);
    triangles.extend(PLANE);
    let timer = &mut Duration::default();
    let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), timer);
    let bsdf = Bsdf::single(Lambert::new(Rgb::splat(0.7)));

    // A tile of 16 × 16 pixels with one shading point for each hit.
    let (mut points, mut samples, mut pixels) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..256 {
        let (start, eye) = (points.len(), vec3(0.0, 2.0, 6.0));
        let toward = vec3((i % 16) as f32 / 4.0 - 2.0, 0.5 - (i / 16) as f32 / 8.0, 0.0) - eye;
        if let Some((t, distance)) = trace(&bvh, &triangles, eye, toward.normalize()) {
            let position = eye + distance * toward.normalize();
            let normal = Vec3::from(triangles[t].compute_normal());
            let ng = if normal.dot(toward) > 0.0 { -normal } else { normal };
            let frame = Frame::from_z(ng);
            let wo = frame.to_local(-toward.normalize());
            points.push(ShadingPoint { position, ng, frame, wo, bsdf: bsdf.for_view(wo) });
            samples.push(0);
        }
        let sampler = Sampler::new(SamplerKind::Sobol, 0, i);
        pixels.push(PixelPoints::new(start..points.len(), 1, sampler));
    }
    let tile = TileShading::new(&points, &samples, &pixels, 16);

    let environment = Environment::builtin(BuiltinProbe::Sky);
    let product = ProductSampling::new(&environment, 16);
    let pass = product.begin_pass(Sampler::for_pass(SamplerKind::Sobol, 0, 0), 1);
    let mut estimator = Estimator::new(&product);
    let radiance = estimator.estimate(&pass, &tile, |rays, visibility| {
        for ((v, &point), &wi) in visibility.iter_mut().zip(&rays.point).zip(&rays.wi) {
            let ShadingPoint { position, ng, .. } = points[point as usize];
            let is_hidden = trace(&bvh, &triangles, position + 1e-3 * ng, wi).is_some();
            *v = if is_hidden { 0.0 } else { 1.0 };
        }
    });
    let mean = radiance.iter().copied().sum::<Rgb>() / radiance.len() as f32;
    println!("{} points, mean radiance {mean:?}", radiance.len());
}
