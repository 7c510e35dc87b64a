//! Merging parts of a division.
//!
//! Cuts are final. A cut through a lamp, such as any cut between columns at a pole, leaves two lights
//! where one would suffice, and Lloyd's refinement cannot undo it. So the map is divided into more parts
//! than the number of lights, and the two parts whose union adds the least variance are merged
//! repeatedly: Ward 1963, "Hierarchical Grouping to Optimize an Objective Function".

use glam::DVec3;

use super::regions::Moments;

/// A part and the one that it joins at the least cost.
#[derive(Clone, Copy)]
struct Part {
    /// R = ∫ L ω dω.
    moment: DVec3,
    /// W = ∫ L dω.
    energy: f64,
    /// R / W.
    centroid: DVec3,
    partner: usize,
    cost: f64,
}

impl Part {
    fn new(moment: DVec3, energy: f64) -> Self {
        let centroid = moment / energy;
        Self { moment, energy, centroid, partner: usize::MAX, cost: f64::INFINITY }
    }

    /// Var(a ∪ b) − Var(a) − Var(b) = |c_a − c_b|² W_a W_b / (W_a + W_b).
    fn added_variance(&self, o: &Self) -> f64 {
        let gap = self.centroid.distance_squared(o.centroid);
        gap * self.energy * o.energy / (self.energy + o.energy)
    }
}

/// Joins parts on the sphere, each with energy, until `n` are left: the energy vector R of each.
pub(super) fn merge(parts: &[Moments], n: usize) -> Vec<[f64; 3]> {
    let part = |m: &Moments| Part::new(m.first.into(), m.energy);
    let mut parts: Vec<Part> = parts.iter().map(part).collect();
    if parts.len() > n {
        for i in 0..parts.len() {
            find_partner(&mut parts, i);
        }
    }
    while parts.len() > n.max(1) {
        join_cheapest(&mut parts);
    }
    parts.iter().map(|p| p.moment.into()).collect()
}

/// Joins the two parts, of at least two, that are cheapest to join.
fn join_cheapest(parts: &mut Vec<Part>) {
    let cheaper = |best: usize, i: usize| if parts[i].cost < parts[best].cost { i } else { best };
    let a = (1..parts.len()).fold(0, cheaper);
    let (i, j) = (a.min(parts[a].partner), a.max(parts[a].partner));
    let last = parts.len() - 1;
    parts[i] = Part::new(parts[i].moment + parts[j].moment, parts[i].energy + parts[j].energy);
    parts.swap_remove(j);
    find_partner(parts, i);
    for k in (0..parts.len()).filter(|&k| k != i) {
        // The last part moved to the place of the one that is gone.
        match parts[k].partner {
            p if p == i || p == j => find_partner(parts, k),
            p if p == last => parts[k].partner = j,
            _ => {}
        }
    }
}

fn find_partner(parts: &mut [Part], i: usize) {
    let me = parts[i];
    let (mut cost, mut partner) = (f64::INFINITY, usize::MAX);
    for (j, other) in parts.iter().enumerate() {
        let added = me.added_variance(other);
        if added < cost && j != i {
            (cost, partner) = (added, j);
        }
    }
    parts[i] = Part { partner, cost, ..me };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::regions::Metric;
    use crate::sampling::Pcg32;

    fn moments(n: usize) -> Vec<Moments> {
        let mut pcg = Pcg32::new(5, 5);
        let mut number = move || f64::from(pcg.next_f32());
        let mut part = move |_| {
            let energy = 0.1 + number();
            let first = DVec3::new(number() - 0.5, number() - 0.5, number() - 0.5);
            Moments { energy, first: (first.normalize() * energy).into(), lit: 1.0 }
        };
        (0..n).map(&mut part).collect()
    }

    /// The cheapest pair of all, again and again, by trying every pair.
    #[test]
    fn joins_the_cheapest_pair() {
        let mut parts = moments(40);
        let start = parts.clone();
        let variance = |m: &Moments| Metric::Sphere.variance(m);
        for n in (3..40).rev() {
            let pairs = (0..parts.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
            let cost = |&(i, j): &(usize, usize)| {
                let (a, b): (Moments, Moments) = (parts[i], parts[j]);
                variance(&(a + b)) - variance(&a) - variance(&b)
            };
            let (i, j) = pairs.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap();
            let gone = parts.swap_remove(j);
            parts[i] += gone;
            let merged = merge(&start, n);
            assert_eq!(merged.len(), n);
            for (m, p) in merged.iter().zip(&parts) {
                assert!((0..3).all(|c| (m[c] - p.first[c]).abs() < 1e-12), "{n}");
            }
        }
    }
}
