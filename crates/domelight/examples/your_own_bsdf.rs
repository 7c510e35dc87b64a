//! A BSDF of one's own under every strategy: retroreflective tape, a lobe back toward the viewer.

use domelight::bsdf::{Bsdf, Bxdf, CustomLobe, Lambert};
use domelight::geometry::Mesh;
use domelight::math::{Frame, PI, Vec2, Vec3};
use domelight::prelude::*;
use domelight::sampling::warp::{phong_lobe, phong_lobe_pdf};

/// f_r cos θ_i = ρ (n + 1) / 2π · max(0, wo·wi)ⁿ: light returns where it comes from.
#[derive(Debug)]
struct Retroreflector {
    rho: Rgb,
    n: f32,
}

impl Bxdf for Retroreflector {
    fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let pdf = phong_lobe_pdf(wo.dot(wi), self.n);
        (self.rho * pdf, pdf)
    }

    fn sample(&self, wo: Vec3, _u_lobe: f32, u: Vec2) -> Option<Vec3> {
        Some(Frame::from_z(wo).to_world(phong_lobe(u, self.n)))
    }

    fn max_eval(&self, _wo: Vec3) -> f32 {
        self.rho.max_component() * (self.n + 1.0) / (2.0 * PI)
    }

    fn albedo(&self, _cos_theta_o: f32) -> Rgb {
        self.rho
    }

    fn roughness(&self) -> Option<f32> {
        Some((2.0 / (self.n + 2.0)).sqrt())
    }
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tape = CustomLobe::leak(Retroreflector { rho: Rgb::splat(0.7), n: 30.0 });
    let bsdf = Bsdf::new(&[Lambert::new(Rgb::splat(0.1)).into(), tape.into()])?;
    let quad = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let positions = quad.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec();
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let scene = Scene::from_mesh(mesh, bsdf)?;
    let environment = Environment::builtin(BuiltinProbe::Studio);
    let settings = RenderSettings { width: 48, height: 48, n_samples: 16, ..Default::default() };
    let camera = Camera::framing(&scene, settings.width, settings.height);
    for strategy in ["brdf:4", "environment:4", "mis:2:2", "product:8", "rejection:64", "sir:2/8"] {
        let spec = strategy.parse()?;
        let film = Renderer::new(&scene, &camera, &environment, spec, settings)?.finish();
        println!("{strategy:14} {:?}", film.layers().color.pixels[24 * 48 + 24]);
    }
    Ok(())
}
