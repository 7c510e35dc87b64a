//! The camera hits of a pixel, clustered by normal and BRDF. One table serves a cluster.

use super::super::ShadingPoint;
use super::strata::Counts;
use crate::Rgb;
use crate::bsdf::{Bsdf, GlossyLobe, LobeSummary};
use crate::math::{Frame, Vec3};

/// The camera hits of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Hits<'a> {
    pub(super) points: &'a [ShadingPoint],
    /// Whether all hits have the BSDF of the first.
    pub(super) one_material: bool,
}

impl<'a> Hits<'a> {
    /// The BSDF from which a hit is sampled.
    pub(super) fn bsdf(self, hit: usize) -> &'a Bsdf {
        &self.points[if self.one_material { 0 } else { hit }].bsdf
    }
}

/// Hits with similar normals and BSDFs.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The frame around the mean normal, with the tangent of the first hit.
    pub(super) frame: Frame,
    /// The mean direction to the viewer, in that frame.
    pub(super) wo: Vec3,
    /// The maximum angle between the normals and their mean \[rad\].
    pub(super) normal_spread: f32,
    /// The maximum angle between the tangents of elongated lobes and that of the first hit \[rad\].
    tangent_spread: f32,
    /// The ratio of the length and the width of the most elongated lobe.
    elongation: f32,
    /// The BSDF of the first hit.
    pub(super) lobe_summary: LobeSummary,
    /// The fraction of the pixel's hits.
    pub(super) share: f32,
}

impl Group {
    /// A frame around another normal, given in the group's frame, and the direction to the viewer in it.
    pub(super) fn about(&self, normal: Vec3) -> (Frame, Vec3) {
        let frame = Frame::from_z(self.frame.to_world(normal));
        let wo = frame.to_local(self.frame.to_world(self.wo));
        (frame, Vec3::new(wo.x, wo.y, wo.z.max(1e-3)))
    }
}

/// The normals of a group are within 18° of the first hit's normal.
const LIKE_NORMALS: f32 = 0.95;
/// The tangents of a group's elongated lobes are within 26° of the first hit's tangent.
const LIKE_TANGENTS: f32 = 0.9;
/// The roughnesses of a group are within this factor of the first hit's roughness.
const LIKE_ROUGHNESS: f32 = 1.5;

/// The spread of normals that hardly rotates a lobe, as a fraction of its roughness.
const SMALL_NORMAL_SPREAD: f32 = 0.25;
/// The spread of tangents that moves the ends of an elongated lobe by a fraction of its width.
const SMALL_TANGENT_SPREAD: f32 = 0.25;
/// The cosine of the view above which lobes are not elongated.
const STEEP_COSINE: f32 = 0.5;

/// A group under construction.
#[derive(Clone, Debug)]
struct HitCluster {
    first: usize,
    lobe_summary: LobeSummary,
    normals: Vec3,
    viewers: Vec3,
    n: usize,
}

/// Scratch memory for grouping.
#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    clusters: Vec<HitCluster>,
    member: Vec<usize>,
    /// The diffuse albedo of each hit.
    pub(super) diffuse: Vec<Rgb>,
    pub(super) all: Vec<Group>,
}

impl Groups {
    /// Groups the hits of a pixel.
    #[inline(always)]
    pub(super) fn cluster(&mut self, Hits { points, one_material }: Hits) {
        self.clusters.clear();
        self.member.clear();
        self.diffuse.clear();
        let (mut lobe_summary, mut is_elongated) = (LobeSummary::default(), false);
        for (i, p) in points.iter().enumerate() {
            if i == 0 || !one_material {
                lobe_summary = p.bsdf.lobe_summary(p.wo);
                is_elongated = elongation(&lobe_summary) > 1.0;
            }
            let like = |g: &HitCluster| {
                let first = &points[g.first].frame;
                first.z.dot(p.frame.z) > LIKE_NORMALS
                    && (one_material || alike(&g.lobe_summary, &lobe_summary))
                    && (!is_elongated || first.x.dot(p.frame.x).abs() > LIKE_TANGENTS)
            };
            let group = self.clusters.iter().position(like).unwrap_or_else(|| {
                let (normals, viewers) = (Vec3::ZERO, Vec3::ZERO);
                self.clusters.push(HitCluster { first: i, lobe_summary, normals, viewers, n: 0 });
                self.clusters.len() - 1
            });
            let cluster = &mut self.clusters[group];
            cluster.normals += p.frame.z;
            cluster.viewers += p.frame.to_world(p.wo);
            cluster.n += 1;
            self.member.push(group);
            self.diffuse.push(lobe_summary.diffuse);
        }
        self.all.clear();
        for g in &self.clusters {
            let first = &points[g.first].frame;
            let normal = g.normals.try_normalize().unwrap_or(first.z);
            let frame = Frame::from_z_and_tangent(normal, first.x);
            let wo = frame.to_local(g.viewers).try_normalize().unwrap_or(Vec3::Z);
            self.all.push(Group {
                frame,
                wo: Vec3::new(wo.x, wo.y, wo.z.max(1e-3)),
                normal_spread: 0.0,
                tangent_spread: 0.0,
                elongation: elongation(&g.lobe_summary),
                lobe_summary: g.lobe_summary,
                share: g.n as f32 / points.len() as f32,
            });
        }
        for (p, &member) in points.iter().zip(&self.member) {
            let group = &mut self.all[member];
            // The chord differs from the angle by less than a twentieth here.
            let angle = 1.05 * p.frame.z.distance(group.frame.z);
            group.normal_spread = group.normal_spread.max(angle);
            if group.elongation > 1.0 {
                let first = &points[self.clusters[member].first].frame;
                // A lobe is the same along its tangent's two directions.
                let [same, opposite] = [1.0, -1.0].map(|sign| p.frame.x.distance(sign * first.x));
                group.tangent_spread = group.tangent_spread.max(1.05 * same.min(opposite));
            }
        }
    }
}

impl Groups {
    /// Whether any of the BSDFs has a glossy lobe.
    pub(super) fn is_glossy(&self) -> bool {
        self.narrowest().is_some()
    }

    /// The roughness of the narrowest lobe; `None` if all lobes are diffuse.
    pub(super) fn narrowest(&self) -> Option<f32> {
        let lobes = self.all.iter().flat_map(|g| g.lobe_summary.lobes());
        lobes.map(|(_, gloss)| gloss.width()).reduce(f32::min)
    }

    /// Whether a table approximates lobes of this roughness well: the lobe hardly rotates within a group, and is not
    /// elongated along the horizon.
    pub(super) fn is_well_tabulated(&self, roughness: f32) -> bool {
        self.all.iter().all(|g| {
            g.normal_spread <= SMALL_NORMAL_SPREAD * roughness
                && g.tangent_spread * g.elongation <= SMALL_TANGENT_SPREAD
                && g.wo.z >= STEEP_COSINE
        })
    }

    /// The luminance of the diffuse albedo, averaged over the hits.
    pub(super) fn diffuse_albedo(&self) -> f32 {
        self.all.iter().map(|g| g.lobe_summary.diffuse.luminance() * g.share).sum()
    }

    /// The luminance of the albedo of all lobes, averaged over the hits.
    pub(super) fn albedo(&self) -> f32 {
        let lobes = self.all.iter().flat_map(|g| {
            let diffuse = std::iter::once(g.lobe_summary.diffuse);
            diffuse.chain(g.lobe_summary.lobes().map(|(c, _)| c)).map(|c| c.luminance() * g.share)
        });
        lobes.sum()
    }

    /// The density of BRDF samples relative to strata of a table with this total, where the light of a cell has
    /// density 1: the ratio of their numbers, times the light that the pixel reflects, averaged over its lobes.
    pub(super) fn brdf_share(&self, counts: Counts, total: f32) -> f32 {
        let albedo = self.albedo();
        if counts.brdf == 0 || albedo <= 0.0 {
            return 0.0;
        }
        counts.brdf as f32 / counts.light as f32 * total / albedo
    }
}

/// The ratio of the length and the width of the most elongated lobe; 1 of isotropic lobes.
#[inline(always)]
fn elongation(summary: &LobeSummary) -> f32 {
    let ratio = |lobe: GlossyLobe| match lobe {
        GlossyLobe::Slopes { alpha: [a, b], .. } => a.max(b) / a.min(b).max(f32::MIN_POSITIVE),
        GlossyLobe::Mirror { .. } => 1.0,
    };
    summary.lobes().map(|(_, lobe)| ratio(lobe)).fold(1.0, f32::max)
}

/// Compares BSDFs in similar local frames.
fn near_normals(a: Option<Vec3>, b: Option<Vec3>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => a.dot(b) > LIKE_NORMALS,
        _ => false,
    }
}

/// Whether both have the same kinds of lobes with about the same roughness.
fn alike(a: &LobeSummary, b: &LobeSummary) -> bool {
    let near = |a: f32, b: f32| a < LIKE_ROUGHNESS * b && b < LIKE_ROUGHNESS * a;
    // The width of the lobe falls as the square root of the exponent.
    let near_exponents = |a: f32, b: f32| {
        let factor = LIKE_ROUGHNESS * LIKE_ROUGHNESS;
        a + 1.0 < factor * (b + 1.0) && b + 1.0 < factor * (a + 1.0)
    };
    let gloss = |a: GlossyLobe, b: GlossyLobe| match (a, b) {
        (
            GlossyLobe::Slopes { alpha: a, gaussian: c, leaning: m },
            GlossyLobe::Slopes { alpha: b, gaussian: d, leaning: n },
        ) => c == d && near(a[0], b[0]) && near(a[1], b[1]) && near_normals(m, n),
        (GlossyLobe::Mirror { exponent: a }, GlossyLobe::Mirror { exponent: b }) => {
            near_exponents(a, b)
        }
        _ => false,
    };
    a.diffuse.is_black() == b.diffuse.is_black()
        && a.glossy.iter().zip(&b.glossy).all(|pair| match pair {
            (Some((_, a)), Some((_, b))) => gloss(*a, *b),
            (None, None) => true,
            _ => false,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::MaterialSpec;

    /// Hits on a plane with the tangent at these angles \[degrees\].
    fn grouped(material: &str, tangents: &[f32]) -> Groups {
        let bsdf = Bsdf::from(material.parse::<MaterialSpec>().unwrap());
        let hit = |&degrees: &f32| {
            let (y, x) = degrees.to_radians().sin_cos();
            let frame = Frame::from_z_and_tangent(Vec3::Z, Vec3::new(x, y, 0.0));
            ShadingPoint { frame, bsdf, ..ShadingPoint::UNSET }
        };
        let points: Vec<_> = tangents.iter().map(hit).collect();
        let mut groups = Groups::default();
        groups.cluster(Hits { points: &points, one_material: true });
        groups
    }

    #[test]
    fn elongated_lobes_of_crossed_tangents_have_tables_of_their_own() {
        let threads = [0.0, 90.0, 180.0, 270.0];
        let brushed = grouped("ggx:0.4,0.1", &threads);
        let shares: Vec<f32> = brushed.all.iter().map(|group| group.share).collect();
        assert_eq!(shares, [0.5, 0.5]);
        assert!(brushed.is_well_tabulated(0.1));
        assert_eq!(grouped("ggx:0.4", &threads).all.len(), 1);
    }

    #[test]
    fn a_table_is_poor_where_elongated_lobes_turn() {
        let bend = [0.0, 10.0, 20.0];
        assert_eq!(grouped("ggx:0.4,0.1", &bend).all.len(), 1);
        assert!(!grouped("ggx:0.4,0.1", &bend).is_well_tabulated(0.1));
        assert!(grouped("ggx:0.4,0.1", &[0.0, 1.0, 2.0]).is_well_tabulated(0.1));
        assert!(grouped("ggx:0.4", &bend).is_well_tabulated(0.4));
    }
}
