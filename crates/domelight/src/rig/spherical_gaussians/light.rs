//! Integrals of a map times a spherical Gaussian.
//!
//! The pyramid over the map's texels is traversed from the top. Over a node, the kernel is replaced by its Taylor
//! polynomial of degree two about the light's centroid, whose integral the node's moments give exactly. A node is opened
//! where the kernel's largest third derivative times the cube of the node's radius exceeds a tolerance.

use super::product::{Kernel, Linear, dot};
use crate::math::{Vec3, functions};
use crate::rig::geometry::Row;
use crate::rig::pyramid::{Node, Place, Pyramid};
use crate::rig::spherical_harmonics::harmonics;

/// The largest (√λ r)³ G of a node that is not opened.
const TOLERANCE: f64 = 0.1;
/// −ln G beyond which a kernel is 0.
const NEGLIGIBLE: f64 = 25.0;

/// ∫ L G dω and ∫ L ω G dω of each channel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LightMoments {
    zeroth: [f64; 3],
    first: [[f64; 3]; 3],
}

/// What is done with a node.
enum Visit {
    Skip,
    Open,
    Add,
}

impl LightMoments {
    /// Integrates over the whole map.
    pub(super) fn new(pyramid: &Pyramid, kernel: &Kernel) -> Self {
        let mut sums = Self::default();
        let mut places = vec![Place::Block { level: pyramid.levels.len() - 1, x: 0, y: 0 }];
        while let Some(place) = places.pop() {
            match place {
                Place::Block { level, x, y } => {
                    let nodes = &pyramid.levels[level];
                    let node = &nodes.nodes[y * nodes.columns + x];
                    if node.energy == [0.0; 3] {
                        continue;
                    }
                    match visit(kernel, node.direction, node.shape.radius) {
                        Visit::Skip => {}
                        Visit::Open => pyramid.open_block(level, x, y, &mut places),
                        Visit::Add => sums.add(kernel, node),
                    }
                }
                Place::Texel { depth, x, y } => {
                    let radiance = pyramid.radiance(depth, x, y);
                    if radiance == [0.0; 3] {
                        continue;
                    }
                    let division = &pyramid.divisions[depth];
                    let (row, meridian) = (&division.rows[y], division.meridians[x]);
                    let is_last = depth + 1 == pyramid.divisions.len();
                    match visit(kernel, direction(row, meridian), row.shape.radius) {
                        Visit::Skip => {}
                        Visit::Open if !is_last => places.extend(Place::parts(depth, x, y)),
                        Visit::Open | Visit::Add => {
                            sums.add(kernel, &texel(row, meridian, radiance));
                        }
                    }
                }
            }
        }
        sums
    }

    /// ∫ L Y dω of each channel and of the first nine harmonics.
    pub(super) fn harmonics(pyramid: &Pyramid) -> [[f64; 9]; 3] {
        let root = &pyramid.levels[pyramid.levels.len() - 1].nodes[0];
        let [x, y, z] = root.direction.as_dvec3().to_array();
        std::array::from_fn(|c| {
            let energy = f64::from(root.energy[c]);
            let [fx, fy, fz] = root.first[c].map(f64::from);
            let [xx, yy, zz, xy, yz, xz] = root.second[c].map(f64::from);
            // About the origin instead of the centroid; mixed moments were doubled.
            let square = |a: f64, f: f64, s: f64| s + 2.0 * a * f + energy * a * a;
            let mixed = |a: f64, fa: f64, b: f64, fb: f64, twice: f64| {
                0.5 * twice + a * fb + b * fa + energy * a * b
            };
            harmonics(
                energy,
                [energy * x + fx, energy * y + fy, energy * z + fz],
                [square(x, fx, xx), square(y, fy, yy), square(z, fz, zz)],
                [mixed(x, fx, y, fy, xy), mixed(y, fy, z, fz, yz), mixed(x, fx, z, fz, xz)],
            )
        })
    }

    /// ∫ L f G dω of a channel.
    pub(super) fn of(&self, channel: usize, f: &Linear) -> f64 {
        dot(f.vector, self.first[channel]) + f.constant * self.zeroth[channel]
    }

    fn add(&mut self, kernel: &Kernel, node: &Node) {
        let (lambda, axis) = (kernel.sharpness, kernel.axis);
        let center = node.direction.as_dvec3().to_array();
        let value = functions::exp(-lambda * half_square(axis, center));
        for c in 0..3 {
            let energy = f64::from(node.energy[c]);
            let first = node.first[c].map(f64::from);
            let [xx, yy, zz, xy, yz, xz] = node.second[c].map(f64::from);
            let [x, y, z] = axis;
            let turned = [
                xx * x + 0.5 * (xy * y + xz * z),
                yy * y + 0.5 * (xy * x + yz * z),
                zz * z + 0.5 * (xz * x + yz * y),
            ];
            let whole = energy + lambda * (dot(axis, first) + 0.5 * lambda * dot(axis, turned));
            self.zeroth[c] += value * whole;
            for i in 0..3 {
                self.first[c][i] += value * (center[i] * whole + first[i] + lambda * turned[i]);
            }
        }
    }
}

/// |a − b|²/2: 1 − a·b of unit vectors.
fn half_square(a: [f64; 3], b: [f64; 3]) -> f64 {
    0.5 * (0..3).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>()
}

/// The light within `radius` of `direction`.
fn visit(kernel: &Kernel, direction: Vec3, radius: f32) -> Visit {
    /// Wider nodes are always opened.
    const WIDEST: f64 = 0.6;
    let radius = f64::from(radius);
    let off = half_square(kernel.axis, direction.as_dvec3().to_array());
    // The chord to the nearest point is at least the chord to the centroid minus the radius.
    let chord = ((2.0 * off).sqrt() - radius).max(0.0);
    let exponent = 0.5 * kernel.sharpness * chord * chord;
    if exponent > NEGLIGIBLE {
        return Visit::Skip;
    }
    let width = kernel.sharpness.sqrt() * radius;
    let error = width * width * width * functions::exp(-exponent);
    if radius > WIDEST || error > TOLERANCE { Visit::Open } else { Visit::Add }
}

fn direction(row: &Row, [sin, cos]: [f32; 2]) -> Vec3 {
    let [h, v] = row.centroid;
    Vec3::new(h * sin, v, h * cos)
}

/// The light of a texel or of a part of one.
fn texel(row: &Row, [x, z]: [f32; 2], radiance: [f32; 3]) -> Node {
    let [h, v] = row.first;
    let [hh, hv, vv, pp] = row.second;
    let first = [h * x, v, h * z];
    // p = (−z, 0, x).
    let second = [
        hh * x * x + pp * z * z,
        vv,
        hh * z * z + pp * x * x,
        hv * x,
        hv * z,
        2.0 * (hh - pp) * x * z,
    ];
    Node {
        direction: direction(row, [x, z]),
        shape: row.shape,
        energy: radiance.map(|l| l * row.shape.solid_angle),
        first: radiance.map(|l| first.map(|m| l * m)),
        second: radiance.map(|l| second.map(|m| l * m)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Rgb, RgbImage};

    /// Against sums over 32 × 32 points of each texel.
    #[test]
    fn kernels_are_integrated_over_whole_texels() {
        const PARTS: usize = 32;
        let noise = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
        let map = RgbImage::from_fn(24, 12, |x, y| {
            let sun = if (x, y) == (15, 4) { 300.0 } else { 0.0 };
            Rgb::new(sun + 1.0, sun + noise(y * 24 + x), 0.5 * sun)
        });
        let pyramid = Pyramid::new(&map, 1e-3);
        let (rows, columns) = (12 * PARTS, 24 * PARTS);
        for (axis, sharpness) in [
            ([0.0, 0.0, -1.0], 0.01),
            ([0.0, 1.0, 0.0], 8.0),
            ([0.48, 0.6, -0.64], 60.0),
            ([0.626, 0.376, -0.683], 900.0),
        ] {
            let length = dot(axis, axis).sqrt();
            let kernel = Kernel { axis: axis.map(|c| c / length), sharpness };
            let found = LightMoments::new(&pyramid, &kernel);
            let mut exact = [[0.0; 4]; 3];
            for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
                let theta = std::f64::consts::PI * (y as f64 + 0.5) / rows as f64;
                let phi = std::f64::consts::TAU * ((x as f64 + 0.5) / columns as f64 - 0.5);
                let w = [theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()];
                let g = (sharpness * (dot(kernel.axis, w) - 1.0)).exp() * theta.sin();
                let le = map.get(x / PARTS, y / PARTS).to_array();
                for c in 0..3 {
                    exact[c][0] += g * f64::from(le[c]);
                    (0..3).for_each(|i| exact[c][i + 1] += g * w[i] * f64::from(le[c]));
                }
            }
            let cell = 2.0 * std::f64::consts::PI.powi(2) / (rows * columns) as f64;
            for c in 0..3 {
                let exact = exact[c].map(|e| e * cell);
                let sums = [&[found.zeroth[c]][..], &found.first[c]].concat();
                // A node's error is bounded as a part of the kernel's peak.
                let all = 4.0 * std::f64::consts::PI * f64::from(pyramid.mean[c]);
                for (a, b) in sums.iter().zip(exact) {
                    let close = (a - b).abs() < 2e-3 * exact[0] + 1e-4 * all;
                    assert!(close, "{sharpness}, channel {c}: {sums:?} {exact:?}");
                }
            }
        }
    }

    #[test]
    fn harmonics_are_those_of_the_map() {
        use crate::environment::Environment;
        use crate::rig::SphericalHarmonics;
        let map = RgbImage::from_fn(24, 12, |x, y| Rgb::new(x as f32, (y * y) as f32, 1.0));
        let found = LightMoments::harmonics(&Pyramid::new(&map, 1.0));
        let environment = Environment::from_image(map.clone()).unwrap();
        let exact = SphericalHarmonics::project(&environment).coefficients;
        for (i, exact) in exact.into_iter().enumerate() {
            for (c, exact) in exact.to_array().into_iter().enumerate() {
                let scale = found[c][0].abs();
                assert!((found[c][i] - f64::from(exact)).abs() < 1e-5 * scale, "{i}, {c}");
            }
        }
    }
}
