//! Compact bright sources: suns, lamps and windows, each detected as a whole and extracted from the map.
//!
//! A source stands out from its surroundings (`level_sets`: where the level sets of luminance hardly grow
//! while the level falls). The background behind it is estimated from its rim (`fill`), and the source is
//! the excess over this background, so that source and remainder add up to the map, texel by texel.
//!
//! Large maps are searched in blocks of texels, but the light of a source is determined for every
//! texel.

mod fill;
mod grid;
mod level_sets;

use crate::environment::lat_long::even_disc_radius;
use crate::{Rgb, RgbImage};
use fill::continue_rim;
use grid::Grid;
use level_sets::{Peak, find_peaks};

/// The widest sun, a cap of 7°. The real one has 6.8e-5 sr, but thin cloud and a camera's glare widen it.
const WIDEST_SUN: Extent = Extent { solid_angle: 0.047, radius: 7.0 };
/// The widest lamp or window, a cap of 28°.
const WIDEST_LAMP: Extent = Extent { solid_angle: 0.75, radius: 28.0 };

/// How wide a source is. A tube is long, but has a small solid angle.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// \[sr\]
    solid_angle: f64,
    /// The radius of the even disc of as much angular variance \[°\].
    radius: f64,
}

/// How many times the solid angle of a source what belongs to it around it has at the most: four
/// times the radius.
const SHELL: f64 = 16.0;

/// Which compact sources are taken out of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SourceCriteria {
    /// The sun: of the sources no wider than 7° the one with the most light.
    pub(crate) sun: bool,
    /// Up to so many others, those with the most light.
    pub(crate) n_lamps: usize,
    /// The least share of the map's luminance.
    pub(crate) min_share: f64,
}

impl SourceCriteria {
    /// Share of the map's luminance below which nothing is a source unless asked for.
    pub(crate) const MIN_SHARE: f64 = 1e-3;

    /// The sun alone.
    pub(crate) const SUN: Self = Self { sun: true, n_lamps: 0, min_share: Self::MIN_SHARE };
}

/// A source: texels and what stays of their radiance when it is taken out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CompactSource {
    /// Whether it is what was taken for the sun.
    pub(crate) is_sun: bool,
    /// Indices of texels that it has light of, rising.
    pub(crate) texels: Vec<u32>,
    /// The radiance that is not the source's, at each of `texels`: in every channel at least 0 and at
    /// the most the map's.
    pub(crate) residual: Vec<Rgb>,
}

/// The wanted sources of a lat-long map of finite radiance ≥ 0: the sun first, then those of the
/// most light.
pub(crate) fn compact_sources(map: &RgbImage, criteria: SourceCriteria) -> Vec<CompactSource> {
    if !criteria.sun && criteria.n_lamps == 0 {
        return Vec::new();
    }
    let grid = Grid::new(map);
    let mut peaks: Vec<Option<Peak>> = Vec::new();
    peaks.extend(find_peaks(&grid, criteria.min_share * grid.total()).into_iter().map(Some));
    let radii = radii(&grid, &peaks);
    let mut chosen = Vec::new();
    if criteria.sun {
        let suns = whole_sources(&peaks, &radii, WIDEST_SUN);
        if let Some(sun) = brightest(&suns, 1).pop() {
            remove(&mut peaks, sun);
            chosen.extend(suns[sun]);
        }
    }
    let has_sun = !chosen.is_empty();
    let lamps = whole_sources(&peaks, &radii, WIDEST_LAMP);
    chosen.extend(brightest(&lamps, criteria.n_lamps).into_iter().filter_map(|i| lamps[i]));
    let mut sources = take_out(map, &grid, &chosen);
    sources.iter_mut().take(1).for_each(|first| first.is_sun = has_sun);
    sources
}

/// The radius of the even disc of as much angular variance as each peak has \[°\]; 0 for peaks that no limit admits.
fn radii(grid: &Grid, peaks: &[Option<Peak>]) -> Vec<f64> {
    let mut entered = vec![NO_OWNER; grid.luminance.len()];
    let of_peak = |(i, peak): (usize, &Option<Peak>)| {
        let admitted = |p: &Peak| p.solid_angle <= WIDEST_LAMP.solid_angle;
        let Some(peak) = peak.filter(admitted) else { return 0.0 };
        let above = |cell: usize| f64::from(grid.luminance[cell] - peak.level);
        let cells = flood(
            peak.seed,
            |cell| grid.connected(cell),
            |c| above(c) > 0.0 && std::mem::replace(&mut entered[c], i as u32) != i as u32,
        );
        let (mut moment, mut energy) = ([0.0; 3], 0.0);
        for cell in cells.into_iter().map(|cell| cell as usize) {
            let weight = above(cell) * grid.solid_angle(cell);
            let direction = grid.direction(cell).to_array();
            moment.iter_mut().zip(direction).for_each(|(m, d)| *m += weight * f64::from(d));
            energy += weight;
        }
        even_disc_radius(moment, energy).to_degrees()
    };
    peaks.iter().enumerate().map(of_peak).collect()
}

/// The peaks that are no wider than `widest`, whole: what surrounds a single one and is no wider than [`SHELL`] times its
/// solid angle belongs to it, as the dish does to the bulb.
fn whole_sources(peaks: &[Option<Peak>], radii: &[f64], widest: Extent) -> Vec<Option<Peak>> {
    let mut whole = vec![None; peaks.len()];
    // What lies within another comes before it.
    for (i, (peak, &radius)) in peaks.iter().zip(radii).enumerate() {
        let fits = |p: &Peak| p.solid_angle <= widest.solid_angle && radius <= widest.radius;
        let Some(mut peak) = peak.filter(fits) else { continue };
        if let Some(core) = peak.core.map(|c| c as usize)
            && whole[core].is_some_and(|c: Peak| peak.solid_angle <= SHELL * c.solid_angle)
        {
            peak.excess += whole[core].take().map_or(0.0, |c| c.excess);
        }
        whole[i] = Some(peak);
    }
    whole
}

/// The indices of up to `n` of the most light, in this order.
fn brightest(peaks: &[Option<Peak>], n: usize) -> Vec<usize> {
    let excess = |i: usize| peaks[i].map_or(0.0, |p| p.excess);
    let mut order: Vec<usize> = (0..peaks.len()).filter(|&i| peaks[i].is_some()).collect();
    order.sort_by(|&a, &b| excess(b).total_cmp(&excess(a)));
    order.truncate(n);
    order
}

/// Removes a peak and those within it.
fn remove(peaks: &mut [Option<Peak>], i: usize) {
    let mut next = Some(i);
    while let Some(i) = next {
        next = peaks[i].take().and_then(|p| p.core).map(|core| core as usize);
    }
}

/// Separates the peaks from what is behind them.
fn take_out(map: &RgbImage, grid: &Grid, peaks: &[Peak]) -> Vec<CompactSource> {
    let owner = owners(grid, peaks);
    let background = BackgroundEstimate::new(grid, &owner);
    let nothing = CompactSource { is_sun: false, texels: Vec::new(), residual: Vec::new() };
    let mut sources = vec![nothing; peaks.len()];
    for y in 0..map.height {
        let row = y / grid.step * grid.columns;
        let mut x = 0;
        while x < map.width {
            let cell = row + x / grid.step;
            let [columns, _] = grid.texels(cell);
            if owner[cell] != NO_OWNER {
                let source = &mut sources[owner[cell] as usize];
                columns.clone().for_each(|x| source.take(map, x, y, background.at(x, y)));
            }
            x = columns.end;
        }
    }
    sources
}

impl CompactSource {
    /// Takes what exceeds `background` out of a texel.
    fn take(&mut self, map: &RgbImage, x: usize, y: usize, background: Rgb) {
        let le = map.row(y)[x];
        let rest = Rgb::new(le.r.min(background.r), le.g.min(background.g), le.b.min(background.b));
        // The rounding of the background is no light.
        if (le - rest).max_component() > 1e-5 * le.max_component() {
            self.texels.push((y * map.width + x) as u32);
            self.residual.push(rest);
        }
    }
}

/// The owner of a cell outside of all sources.
const NO_OWNER: u32 = u32::MAX;

/// The peak that each cell belongs to. Each is grown by a cell, for the source's edge may pass
/// through it.
fn owners(grid: &Grid, peaks: &[Peak]) -> Vec<u32> {
    let mut owner = vec![NO_OWNER; grid.luminance.len()];
    let mut order: Vec<usize> = (0..peaks.len()).collect();
    // What lies within another has the higher level.
    order.sort_by(|&a, &b| peaks[a].level.total_cmp(&peaks[b].level));
    let mut inside = Vec::new();
    for i in order {
        let id = i as u32;
        let bright = |cell: usize| grid.luminance[cell] > peaks[i].level;
        inside.extend(flood(
            peaks[i].seed,
            |cell| grid.connected(cell),
            |c| bright(c) && std::mem::replace(&mut owner[c], id) != id,
        ));
    }
    for cell in inside {
        for n in grid.neighbors(cell as usize) {
            if owner[n] == NO_OWNER {
                owner[n] = owner[cell as usize];
            }
        }
    }
    owner
}

/// The cells that are connected to `seed` by steps to cells `around` for which `enter` holds.
fn flood<const N: usize>(
    seed: u32,
    around: impl Fn(usize) -> [usize; N],
    mut enter: impl FnMut(usize) -> bool,
) -> Vec<u32> {
    let mut cells = Vec::new();
    if enter(seed as usize) {
        cells.push(seed);
    }
    let mut next = 0;
    while let Some(&cell) = cells.get(next) {
        next += 1;
        let entered = around(cell as usize).into_iter().filter(|&n| enter(n));
        cells.extend(entered.map(|n| n as u32));
    }
    cells
}

/// The map without its sources: cells of sources continued from around them.
struct BackgroundEstimate<'a> {
    grid: &'a Grid<'a>,
    /// Where in `radiance` a cell is, [`NO_OWNER`] for cells outside of sources.
    index: Vec<u32>,
    radiance: Vec<Rgb>,
}

impl<'a> BackgroundEstimate<'a> {
    fn new(grid: &'a Grid<'a>, owner: &[u32]) -> Self {
        let mut index = vec![NO_OWNER; owner.len()];
        let mut radiance = Vec::new();
        for seed in 0..owner.len() {
            if owner[seed] == NO_OWNER || index[seed] != NO_OWNER {
                continue;
            }
            let mut rim = Vec::new();
            let group = flood(
                seed as u32,
                |cell| grid.neighbors(cell),
                |cell| {
                    if owner[cell] == NO_OWNER {
                        rim.push(cell as u32);
                        return false;
                    }
                    std::mem::replace(&mut index[cell], 0) == NO_OWNER
                },
            );
            rim.sort_unstable();
            rim.dedup();
            for (i, &cell) in group.iter().enumerate() {
                index[cell as usize] = (radiance.len() + i) as u32;
            }
            let is_outside =
                |cell: usize| owner[cell] == NO_OWNER && rim.binary_search(&(cell as u32)).is_err();
            radiance.extend(continue_rim(grid, &group, &rim, is_outside));
        }
        Self { grid, index, radiance }
    }

    fn cell(&self, column: usize, row: usize) -> Rgb {
        let cell = row * self.grid.columns + column;
        match self.index[cell] {
            NO_OWNER => self.grid.mean(cell),
            i => self.radiance[i as usize],
        }
    }

    /// At a texel: interpolated between the middles of cells.
    fn at(&self, x: usize, y: usize) -> Rgb {
        let Grid { step, columns, rows, .. } = *self.grid;
        if step == 1 {
            return self.cell(x, y);
        }
        let place = |texel: usize| (texel as f32 + 0.5) / step as f32 - 0.5;
        let (u, v) = (place(x), place(y).clamp(0.0, (rows - 1) as f32));
        let (fx, fy) = (u - u.floor(), v - v.floor());
        let left = (u.floor() as isize).rem_euclid(columns as isize) as usize;
        let (right, top) = ((left + 1) % columns, v as usize);
        let row = |row| self.cell(left, row).lerp(self.cell(right, row), fx);
        row(top).lerp(row((top + 1).min(rows - 1)), fy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wire of one texel before the sun, upright, level or aslant, divides neither its light nor its background.
    #[test]
    fn a_sun_behind_a_wire_is_whole() {
        let wires =
            [|x: usize, _: usize| x == 60, |_, y| y == 40, |x: usize, y: usize| x == y + 20];
        for wire in wires {
            let map = RgbImage::from_fn(256, 128, |x, y| {
                let (dx, dy) = (x as f32 - 60.0, y as f32 - 40.0);
                let is_sun = dx * dx + dy * dy < 9.0;
                Rgb::splat(if is_sun && !wire(x, y) { 5000.0 } else { 0.5 })
            });
            let sources = compact_sources(&map, SourceCriteria::SUN);
            let [sun] = &sources[..] else { panic!("{} sources", sources.len()) };
            let n_bright = map.pixels.iter().filter(|p| p.r > 100.0).count();
            assert_eq!(sun.texels.len(), n_bright);
            assert!(sun.residual.iter().all(|p| p.r <= 0.51), "{:?}", sun.residual);
        }
    }
}
