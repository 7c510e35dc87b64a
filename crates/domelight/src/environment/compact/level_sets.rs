//! Peaks of luminance that stand out from their surroundings.
//!
//! Let the level t fall from the brightest cell to black and follow the connected components of
//! {L > t} with their solid angles A(t): the component tree (Salembier et al. 1998, "Antiextensive
//! Connected Operators"; by union-find after Najman & Couprie 2006, "Building the Component Tree in
//! Quasi-Linear Time"). A component holds at least the flux t·A(t). This bound rises while a source is
//! filled, falls along the source's edge, where A hardly grows, and rises again in the surroundings.
//! **The source ends where t·A is minimal**: for a round source, where radiance begins to fall more
//! slowly than 1/r², so that further rings would add more and more light. The drop of t·A is the source's
//! contrast.
//!
//! No radius, brightness or background is assumed, and scaling the map's radiance changes nothing.

use super::grid::Grid;
use crate::parallel::sort;

/// t·A falls at least by this factor around a source.
const CONTRAST: f64 = 4.0;
/// A rise of t·A by this factor is the surroundings.
const RISE: f64 = 2.0;
/// What is smaller than this many cells is blurred by the camera to about that: the least area, so
/// that the first rings around a bright cell are not taken for surroundings.
const BLUR: f64 = 9.0;

/// A source: the cells that are connected to `seed` at luminances above `level`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    pub(super) seed: u32,
    pub(super) level: f32,
    /// The solid angle of those cells \[sr\].
    pub(super) solid_angle: f64,
    /// ∫ (L − level) dω over them, without the peaks that were found within.
    pub(super) excess: f64,
    /// The index of the one peak within, if there is exactly one.
    pub(super) core: Option<u32>,
}

/// A component of the level set, as the level falls.
#[derive(Clone, Copy, Debug)]
struct Component {
    seed: u32,
    area: f64,
    energy: f64,
    /// The largest t·A so far.
    most: f64,
    /// The least t·A since then, and the peak that would end there.
    least: f64,
    end: Peak,
    /// The sources that ended within: how many, and the last.
    n_within: u32,
    within: u32,
}

impl Component {
    fn flux(&self, level: f32, blur: f64) -> f64 {
        f64::from(level) * (self.area + blur)
    }

    /// Notes t·A before the component grows at `level`.
    fn descend(&mut self, level: f32, blur: f64) {
        let flux = self.flux(level, blur);
        if flux < self.least {
            let excess = self.energy - f64::from(level) * self.area;
            self.least = flux;
            let core = (self.n_within == 1).then_some(self.within);
            self.end = Peak { seed: self.seed, level, solid_angle: self.area, excess, core };
        }
    }

    /// Whether it is a source, should it end here.
    fn stands_out(&self, min_energy: f64) -> bool {
        self.most >= CONTRAST * self.least && self.end.excess >= min_energy
    }

    fn join(&mut self, o: &Self) {
        self.area += o.area;
        self.energy += o.energy;
        if o.n_within > 0 {
            self.n_within += o.n_within;
            self.within = o.within;
        }
    }

    /// Forgets the source that was found.
    fn start_again(&mut self, level: f32, blur: f64) {
        self.most = self.flux(level, blur);
        self.least = self.most;
    }
}

/// All sources of at least `min_energy`, in the order in which their levels end.
pub(super) fn find_peaks(grid: &Grid, min_energy: f64) -> Vec<Peak> {
    let blur = BLUR * grid.widest_solid_angle();
    let mut search = Search {
        grid,
        min_energy,
        blur,
        component: vec![NONE; grid.luminance.len()],
        parent: Vec::new(),
        components: Vec::new(),
        peaks: Vec::new(),
    };
    for cell in from_the_brightest(&grid.luminance) {
        search.add(cell);
    }
    search.finish()
}

/// Cells that are not black, the brightest first, in order among equals.
fn from_the_brightest(luminance: &[f32]) -> impl Iterator<Item = usize> {
    let lit = luminance.iter().enumerate().filter(|(_, l)| **l > 0.0);
    // The bits of positive numbers are in the numbers' order.
    let mut keys: Vec<u64> = lit.map(|(i, l)| u64::from(!l.to_bits()) << 32 | i as u64).collect();
    sort(&mut keys);
    keys.into_iter().map(|key| (key & 0xffff_ffff) as usize)
}

/// A cell that has not been reached.
const NONE: u32 = u32::MAX;

struct Search<'a> {
    grid: &'a Grid<'a>,
    min_energy: f64,
    blur: f64,
    /// The component that each cell was put into.
    component: Vec<u32>,
    /// What a component was merged into; itself if it stands.
    parent: Vec<u32>,
    components: Vec<Component>,
    peaks: Vec<Peak>,
}

impl Search<'_> {
    fn root(&mut self, mut c: u32) -> u32 {
        while self.parent[c as usize] != c {
            let grandparent = self.parent[self.parent[c as usize] as usize];
            self.parent[c as usize] = grandparent;
            c = grandparent;
        }
        c
    }

    /// The components that touch a cell: so many of the list.
    fn touching(&mut self, cell: usize) -> ([u32; 12], usize) {
        let (mut roots, mut n_roots) = ([NONE; 12], 0);
        for n in self.grid.connected(cell) {
            if self.component[n] != NONE {
                let root = self.root(self.component[n]);
                if !roots[..n_roots].contains(&root) {
                    roots[n_roots] = root;
                    n_roots += 1;
                }
            }
        }
        (roots, n_roots)
    }

    /// Lowers the level to that of the next cell.
    fn add(&mut self, cell: usize) {
        let (level, blur) = (self.grid.luminance[cell], self.blur);
        let area = self.grid.solid_angle(cell);
        let energy = f64::from(level) * area;
        let (touching, n) = self.touching(cell);
        let touching = &touching[..n];
        if touching.is_empty() {
            self.start(cell, level, area, energy);
            return;
        }
        for &c in touching {
            self.components[c as usize].descend(level, blur);
        }
        let into = self.merge(touching, level);
        let merged = &mut self.components[into as usize];
        merged.area += area;
        merged.energy += energy;
        let flux = merged.flux(level, blur);
        if merged.stands_out(self.min_energy) {
            if flux >= RISE * merged.least {
                self.end(into);
                self.components[into as usize].start_again(level, blur);
            }
        } else if flux > merged.most {
            merged.start_again(level, blur);
        }
        self.component[cell] = into;
    }

    fn start(&mut self, cell: usize, level: f32, area: f64, energy: f64) {
        let id = self.components.len() as u32;
        let seed = cell as u32;
        let end = Peak { seed, level, solid_angle: 0.0, excess: 0.0, core: None };
        let (most, least, n_within, within) = (0.0, 0.0, 0, NONE);
        let mut component = Component { seed, area, energy, most, least, end, n_within, within };
        component.start_again(level, self.blur);
        self.components.push(component);
        self.parent.push(id);
        self.component[cell] = id;
    }

    /// Joins components; those that stand out end if several do, else the one goes on as it was.
    fn merge(&mut self, ids: &[u32], level: f32) -> u32 {
        if let [only] = ids {
            return *only;
        }
        let stands_out = |c: &u32| self.components[*c as usize].stands_out(self.min_energy);
        let sources: Vec<u32> = ids.iter().copied().filter(stands_out).collect();
        if sources.len() > 1 {
            for &c in &sources {
                self.end(c);
            }
        }
        let most = |c: u32| self.components[c as usize].most;
        let brightest = ids.iter().copied().max_by(|&a, &b| most(a).total_cmp(&most(b)));
        let into = match sources[..] {
            [only] => only,
            _ => brightest.unwrap_or(ids[0]),
        };
        for &id in ids.iter().filter(|&&id| id != into) {
            let joined = self.components[id as usize];
            self.components[into as usize].join(&joined);
            self.parent[id as usize] = into;
        }
        if sources.len() > 1 {
            self.components[into as usize].start_again(level, self.blur);
        }
        into
    }

    /// Puts a component's source down and takes its light out of the component.
    fn end(&mut self, id: u32) {
        let component = &mut self.components[id as usize];
        component.energy -= component.end.excess;
        (component.n_within, component.within) = (1, self.peaks.len() as u32);
        self.peaks.push(component.end);
    }

    /// What is left stands in blackness.
    fn finish(mut self) -> Vec<Peak> {
        for id in 0..self.components.len() as u32 {
            if self.parent[id as usize] == id {
                self.components[id as usize].descend(0.0, self.blur);
                if self.components[id as usize].stands_out(self.min_energy) {
                    self.end(id);
                }
            }
        }
        self.peaks
    }
}
