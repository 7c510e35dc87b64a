//! The distant light: radiance over directions, look-up, and importance sampling.
//!
//! An [`Environment`] is a lat-long map of constant texels. Its table holds luminance times the
//! texel's *exact* solid angle, so look-up, table and density agree everywhere: at the poles, at
//! the seam and next to the sun. (A bilinear look-up over this table would lose up to 43.75 % of a
//! single bright texel's light, because the table is zero where the interpolant is not.)

pub mod builtin;
pub(crate) mod compact;
mod compensation;
pub mod convention;
mod density;
#[cfg(feature = "picture")]
mod guess;
#[cfg(feature = "picture")]
pub mod io;
mod key_light;
pub(crate) mod lat_long;
mod light_density;
pub mod mapping;
#[cfg(feature = "picture")]
mod repair;
pub mod statistics;

pub use compensation::CompensatedTable;
pub use density::{DensityError, EnvironmentDensity};
pub use key_light::key_light_rotation;
pub use lat_long::LatLongGrid;
pub(crate) use light_density::LightDensity;

use std::borrow::Cow;

use crate::math::{
    Mat3, PI, TAU, Vec2, Vec3, atan2, functions, rotation_y, sin_cos_half_turns, vec2,
};
use crate::names::read_by_name;
use crate::sampling::{HierarchicalTable, ONE_MINUS_EPSILON, Table2d, TableError};
use crate::simd::{Colors, LANES, LaneMask as _, SimdF32x8, SimdFloat, SimdI32x8 as _, Vectors};
use crate::{Rgb, RgbImage};

/// A world axis that points up; the top row of a map faces it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "io", derive(serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum UpAxis {
    /// +Y up; the map's center column looks toward −Z.
    #[default]
    Y,
    /// +Z up; the map's center column looks toward +Y.
    Z,
}

impl UpAxis {
    /// Both axes.
    pub const ALL: [Self; 2] = [Self::Y, Self::Z];

    /// The name that [`FromStr`](std::str::FromStr) reads.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// The axis as a unit vector.
    pub fn vector(self) -> Vec3 {
        match self {
            Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
        }
    }

    /// The rotation from a world in which +Y is up to one in which this axis is up. The center of a
    /// map stays in front.
    pub fn from_y_up(self) -> Mat3 {
        Mat3::from_cols(self.to_world(Vec3::X), self.to_world(Vec3::Y), self.to_world(Vec3::Z))
    }

    /// Transforms from world space to the map's own frame, where +Y is up.
    #[inline(always)]
    pub(crate) fn to_map<F: SimdFloat>(self, w: Vectors<F>) -> Vectors<F> {
        match self {
            Self::Y => w,
            Self::Z => Vectors { x: w.x, y: w.z, z: w.y.splat(0.0) - w.y },
        }
    }

    /// Transforms from the map's own frame to world space.
    pub(crate) fn to_world(self, m: Vec3) -> Vec3 {
        self.to_world_lanes(m.into()).into()
    }

    /// [`UpAxis::to_world`] of one direction or of several side by side.
    #[inline(always)]
    fn to_world_lanes<F: SimdFloat>(self, m: Vectors<F>) -> Vectors<F> {
        match self {
            Self::Y => m,
            Self::Z => Vectors { x: m.x, y: m.z.splat(0.0) - m.z, z: m.y },
        }
    }
}

read_by_name!(UpAxis::ALL, UnknownUpAxis, "there is no up axis");

/// The orientation of a map in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orientation {
    /// The axis of the top row.
    pub up: UpAxis,
    /// Rotation about the up axis \[degrees\], counterclockwise as seen from above: at 90, the part that was in
    /// front (−Z) is on the left (−X).
    pub rotation: f32,
}

impl Orientation {
    /// The rotation from the map's own frame, +Y up and the center column toward −Z, to the world.
    pub fn map_to_world(self) -> Mat3 {
        self.up.from_y_up() * rotation_y(self.rotation.to_radians())
    }
}

/// An error in the construction of an environment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentError {
    /// No texels.
    #[error("the map is empty ({width}x{height})")]
    Empty {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A texel that is negative, NaN or infinite.
    #[error(
        "texel ({x}, {y}) is ({}, {}, {}); radiance must be finite and not negative",
        value.r, value.g, value.b
    )]
    BadTexel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The value, including the scale.
        value: Rgb,
    },
    /// A scale that is negative, NaN or infinite.
    #[error("the scale is {0}; it must be finite and not negative")]
    BadScale(f32),
    /// An exposure whose power of two, times the scale, is beyond single precision.
    #[error(
        "an exposure of {exposure} stops multiplies radiance by {factor}, which is beyond single precision; \
         choose one between -120 and 120"
    )]
    BadExposure {
        /// The exposure in stops.
        exposure: f32,
        /// The factor that is left of it: 0, infinite or NaN.
        factor: f32,
    },
    /// A rotation that is NaN or infinite.
    #[error("the rotation is {0} degrees; it must be finite")]
    BadRotation(f32),
}

/// The factor on a map's radiance that a scale and an exposure in stops make: scale · 2^exposure.
///
/// # Errors
/// [`EnvironmentError::BadExposure`] for an exposure that makes a factor of 0 or ∞ of a scale that is neither.
pub fn radiance_factor(scale: f32, exposure: f32) -> Result<f32, EnvironmentError> {
    let factor = scale * functions::exp2(exposure);
    let is_lost = !factor.is_finite() || factor == 0.0;
    if is_lost && scale.is_finite() && scale != 0.0 {
        return Err(EnvironmentError::BadExposure { exposure, factor });
    }
    Ok(factor)
}

/// A direction sampled from the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// The unit direction toward the light, in world space.
    pub wi: Vec3,
    /// Radiance from `wi`, equal to [`Environment::le`].
    pub le: Rgb,
    /// Density \[sr⁻¹\] of `wi`, positive and equal to [`Environment::pdf`].
    pub pdf: f32,
}

/// A texel of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Texel {
    column: usize,
    row: usize,
}

/// Radiance over all directions, with importance sampling proportional to its luminance.
///
/// Radiance, power and map are in multiples of [`Environment::unit`] W·m⁻²·sr⁻¹. The unit is 1 unless the brightest
/// texel lies outside 2^±64; with such maps, it keeps weights and their squares from overflowing or vanishing.
///
/// Resident memory is 17⅓ bytes per texel: three floats of radiance and a pyramid of weights.
#[derive(Clone, Debug)]
pub struct Environment {
    /// In multiples of the unit.
    map: RgbImage,
    /// A power of two.
    unit: f64,
    orientation: Orientation,
    grid: Grid,
    /// The table of luminance · solid angle; `None` for a black map.
    table: Option<HierarchicalTable>,
    /// The reciprocal of the table's total; 0 for a black map.
    inverse_power: f32,
    /// The maximum luminance of a texel.
    max_luminance: f32,
}

/// A change of resolution along columns and rows that preserves the map's radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Reshaping {
    /// This many equal texels become one.
    merged: [usize; 2],
    /// Each of these texels becomes this many.
    divided: [usize; 2],
}

/// The number of columns and rows into which each texel is divided to become about square, as far as memory allows.
fn division([width, height]: [usize; 2]) -> [usize; 2] {
    /// The maximum number of texels after the division.
    const MOST_TEXELS: usize = 1 << 22;
    let columns = if width < height { (2 * height).div_ceil(width) } else { 1 };
    let rows = if width > 4 * height { width.div_ceil(2 * height) } else { 1 };
    let most = (MOST_TEXELS / width.saturating_mul(height)).max(1);
    [columns.min(most), rows.min(most)]
}

/// The greatest common divisor.
fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Environment {
    /// The fingerprint of the light: the map's texels times the scale, and the orientation.
    #[cfg(feature = "io")]
    pub fn fingerprint(&self) -> crate::fingerprint::Fingerprint {
        let mut fingerprinter = crate::fingerprint::Fingerprinter::default();
        let RgbImage { width, height, pixels } = &self.map;
        fingerprinter.text(format_args!("{width}x{height} {:?}", self.orientation));
        if self.unit != 1.0 {
            fingerprinter.text(format_args!("{:e}", self.unit));
        }
        fingerprinter.numbers(pixels.iter().flat_map(|texel| texel.to_array()));
        fingerprinter.finish()
    }

    /// A built-in probe with 512 rows.
    pub fn builtin(probe: builtin::BuiltinProbe) -> Self {
        const ROWS: usize = 512;
        Self::from_image(probe.image(ROWS))
            .unwrap_or_else(|_| unreachable!("built-in probes are valid"))
    }

    /// Creates an environment from an upright lat-long map: [`Environment::new`] without rotation and scale.
    ///
    /// # Errors
    /// The first bad texel in row order, or an empty map.
    pub fn from_image(map: RgbImage) -> Result<Self, EnvironmentError> {
        Self::new(map, Orientation::default(), 1.0)
    }

    /// The irradiance ∫ L max(0, n · ω) dω of an unoccluded surface with the unit normal n in world space, in
    /// multiples of [`Environment::unit`] \[W·m⁻²\].
    pub fn irradiance(&self, normal: Vec3) -> Rgb {
        /// Columns and rows into which coarse maps are divided.
        const SIZE: [usize; 2] = [1024, 512];
        let n = self.orientation.map_to_world().transpose() * normal;
        let RgbImage { width, height, .. } = self.map;
        let [fine_x, fine_y] = [SIZE[0].div_ceil(width), SIZE[1].div_ceil(height)];
        let grid = LatLongGrid::new(width * fine_x, height * fine_y);
        let row_sum = |y: usize| {
            let omega = grid.column_angle() * grid.band(y..y + 1);
            let texels = self.map.row(y / fine_y);
            let mut sum = [0.0f64; 3];
            for x in 0..grid.width() {
                let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
                let uv = vec2(at(x, grid.width()), at(y, grid.height()));
                let wi = mapping::Mapping::LatLong.direction(uv).unwrap_or(Vec3::Y);
                let weight = omega * f64::from(n.dot(wi).max(0.0));
                let texel = texels[x / fine_x].to_array();
                sum.iter_mut().zip(texel).for_each(|(s, c)| *s += weight * f64::from(c));
            }
            sum
        };
        // Add rows in order, whichever thread computed them.
        let rows: Vec<[f64; 3]> = crate::parallel::in_order(grid.height(), row_sum);
        let sum = rows.iter().fold([0.0; 3], |sum, row| std::array::from_fn(|c| sum[c] + row[c]));
        Rgb::from(sum.map(|c: f64| c as f32))
    }

    /// The same environment rotated further about its up axis \[degrees\]; see [`Orientation::rotation`].
    ///
    /// # Errors
    /// If the angle is not finite.
    pub fn rotated(self, degrees: f32) -> Result<Self, EnvironmentError> {
        let rotation = self.orientation.rotation + degrees;
        Self::in_units(self.map, Orientation { rotation, ..self.orientation }, self.unit, 1.0)
    }

    /// The same environment with its radiance multiplied by `scale` ≥ 0.
    ///
    /// # Errors
    /// If the scale is negative or not finite.
    pub fn scaled(self, scale: f32) -> Result<Self, EnvironmentError> {
        Self::in_units(self.map, self.orientation, self.unit, scale)
    }

    /// Creates an environment from a lat-long map with row 0 at the top and texel centers at +½. Every texel must be
    /// finite and not negative. The radiance is multiplied by `scale`.
    ///
    /// # Errors
    /// The first bad texel in row order, an empty map, or a bad scale or rotation.
    pub fn new(
        map: RgbImage,
        orientation: Orientation,
        scale: f32,
    ) -> Result<Self, EnvironmentError> {
        Self::in_units(map, orientation, 1.0, scale)
    }

    /// Like [`Environment::new`], but from radiance in multiples of `unit`, which single precision may not hold: from
    /// [`Environment::map`] and [`Environment::unit`] of another environment.
    ///
    /// # Errors
    /// If the map has no pixels, or a pixel, the rotation or the unit is invalid.
    pub fn from_units(
        map: RgbImage,
        orientation: Orientation,
        unit: f64,
    ) -> Result<Self, EnvironmentError> {
        if !unit.is_finite() || unit < 0.0 {
            return Err(EnvironmentError::BadScale(unit as f32));
        }
        Self::in_units(map, orientation, unit, 1.0)
    }

    /// [`Environment::new`] from multiples of `unit`.
    fn in_units(
        mut map: RgbImage,
        orientation: Orientation,
        unit: f64,
        scale: f32,
    ) -> Result<Self, EnvironmentError> {
        let (width, height) = (map.width, map.height);
        if width == 0 || height == 0 {
            return Err(EnvironmentError::Empty { width, height });
        }
        if !scale.is_finite() || scale < 0.0 {
            return Err(EnvironmentError::BadScale(scale));
        }
        if !orientation.rotation.is_finite() {
            return Err(EnvironmentError::BadRotation(orientation.rotation));
        }
        let is_bad = |p: &Rgb| !p.is_finite() || p.min_component() < 0.0;
        if map.pixels.iter().any(is_bad) {
            return Err(Self::bad_texel(&map));
        }
        let brightest = map.pixels.iter().map(|p| p.max_component()).fold(0.0, f32::max);
        let factor = unit * f64::from(scale);
        let unit = unit_of(f64::from(brightest) * factor);
        let factor = factor / unit;
        if factor == f64::from(factor as f32) {
            map.pixels.iter_mut().filter(|_| factor != 1.0).for_each(|p| *p *= factor as f32);
        } else {
            let scaled = |c: f32| (f64::from(c) * factor) as f32;
            map.pixels.iter_mut().for_each(|p| *p = Rgb::from(p.to_array().map(scaled)));
        }
        let grid = Grid::new(width, height, orientation.rotation);
        let table = grid.table(&map, Rgb::luminance);
        let table = match table {
            Ok(table) => Some(table),
            Err(TableError::AllZero) => None,
            Err(_) => return Err(Self::bad_texel(&map)),
        };
        let max_luminance = map.pixels.iter().map(|p| p.luminance()).fold(0.0, f32::max);
        let power = table.as_ref().map_or(0.0, HierarchicalTable::total);
        let inverse_power = if power > 0.0 { (1.0 / power) as f32 } else { 0.0 };
        Ok(Self { map, unit, orientation, grid, table, inverse_power, max_luminance })
    }

    /// The same radiance with about square texels, if the map is much narrower or wider than 2:1; otherwise `None`.
    /// Equal neighbors along the longer side are merged, then texels are divided along the shorter side.
    ///
    /// Algorithms that divide a map into squares of texels assume that the texels are about square.
    pub(crate) fn reshaped(&self) -> Option<Self> {
        let Reshaping { merged, divided } = self.reshaping()?;
        let [width, height] = [0, 1].map(|i| self.size()[i] / merged[i] * divided[i]);
        let texel = |x: usize, y: usize| {
            self.map.get(x / divided[0] * merged[0], y / divided[1] * merged[1])
        };
        let map = RgbImage::from_fn(width, height, texel);
        Self::in_units(map, self.orientation, self.unit, 1.0).ok()
    }

    /// How [`Environment::reshaped`] changes the texels; `None` if it keeps the map unchanged.
    fn reshaping(&self) -> Option<Reshaping> {
        let [width, height] = self.size();
        let merged = match () {
            () if width < height => [1, self.equal_rows()],
            () if width > 4 * height => [self.equal_columns(), 1],
            () => return None,
        };
        let divided = division([width / merged[0], height / merged[1]]);
        (merged != divided).then_some(Reshaping { merged, divided })
    }

    /// The largest number of rows such that all groups of that size hold equal rows.
    fn equal_rows(&self) -> usize {
        let RgbImage { width, height, pixels } = &self.map;
        let row = |y: usize| &pixels[y * width..][..*width];
        (1..*height).filter(|&y| row(y) != row(y - 1)).fold(*height, gcd)
    }

    /// The largest number of columns such that all groups of that size hold equal columns.
    fn equal_columns(&self) -> usize {
        let RgbImage { width, pixels, .. } = &self.map;
        let differs = |x: usize| pixels.chunks_exact(*width).any(|row| row[x] != row[x - 1]);
        (1..*width).filter(|&x| differs(x)).fold(*width, gcd)
    }

    /// Columns and rows of the map.
    fn size(&self) -> [usize; 2] {
        [self.map.width, self.map.height]
    }

    /// The memory that [`Environment::reshaped`] needs \[bytes\].
    pub(crate) fn memory_to_reshape(&self) -> u64 {
        let n_texels = |Reshaping { merged, divided }: Reshaping| {
            let along = |i: usize| self.size()[i] / merged[i] * divided[i];
            (along(0) * along(1)) as u64
        };
        Self::MEMORY_PER_TEXEL * self.reshaping().map_or(0, n_texels)
    }

    /// The memory per texel \[bytes\] of an environment and everything built from it, including during construction:
    /// the map, its tables, fixed lights.
    pub const MEMORY_PER_TEXEL: u64 = 36;

    /// Creates an environment with constant radiance.
    ///
    /// # Errors
    /// If it is negative or not finite.
    pub fn constant(radiance: Rgb) -> Result<Self, EnvironmentError> {
        Self::new(RgbImage::filled(1, 1, radiance), Orientation::default(), 1.0)
    }

    fn bad_texel(map: &RgbImage) -> EnvironmentError {
        let bad = |p: &Rgb| !p.is_finite() || p.min_component() < 0.0;
        let i = map.pixels.iter().position(bad).unwrap_or(0);
        let (x, y) = (i % map.width, i / map.width);
        EnvironmentError::BadTexel { x, y, value: map.pixels[i] }
    }

    /// The same numbers in multiples of 1: a map whose brightest texel is ordinary.
    pub(crate) fn with_radiance_in_units(&self) -> Cow<'_, Self> {
        if self.unit == 1.0 {
            Cow::Borrowed(self)
        } else {
            Cow::Owned(Self { unit: 1.0, ..self.clone() })
        }
    }

    /// The environment with every texel scaled until its brightest channel is at most `radiance` \[W·m⁻²·sr⁻¹\], and the share
    /// of the light that is lost.
    ///
    /// # Errors
    /// If `radiance` is negative.
    pub fn clamped(&self, radiance: f32) -> Result<(Self, f64), EnvironmentError> {
        let mut map = self.radiance_map().into_owned();
        for texel in &mut map.pixels {
            let brightest = texel.max_component();
            if brightest > radiance {
                *texel *= radiance / brightest;
            }
        }
        let clamped = Self::new(map, self.orientation(), 1.0)?;
        let [before, after] = [self, &clamped].map(|e| e.power() * e.unit());
        let lost = if before > 0.0 { (1.0 - after / before).max(0.0) } else { 0.0 };
        Ok((clamped, lost))
    }

    /// The unit of radiance, power and map \[W·m⁻²·sr⁻¹\]: a power of two, 1 for all but extreme maps.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// The map, including the scale, in multiples of [`Environment::unit`].
    pub fn map(&self) -> &RgbImage {
        &self.map
    }

    /// The map, including the scale \[W·m⁻²·sr⁻¹\], whatever the unit.
    pub fn radiance_map(&self) -> Cow<'_, RgbImage> {
        if self.unit == 1.0 {
            return Cow::Borrowed(&self.map);
        }
        let in_watts = |c: f32| (f64::from(c) * self.unit) as f32;
        let pixels = self.map.pixels.iter().map(|p| p.map(in_watts)).collect();
        Cow::Owned(RgbImage { pixels, ..self.map })
    }

    /// The orientation of the map in the world.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }

    /// The table of luminance times solid angle; `None` for a black map.
    pub fn table(&self) -> Option<&HierarchicalTable> {
        self.table.as_ref()
    }

    /// The solid angle of a texel in row `row` \[sr\], the exact integral of sin θ over it.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn texel_solid_angle(&self, row: usize) -> f64 {
        self.grid.texels.solid_angle(row)
    }

    /// The luminance of each texel times its solid angle, as a table of rows and columns.
    ///
    /// Rendering samples a hierarchical table instead, which keeps samples stratified. This one is for figures.
    ///
    /// # Errors
    /// If the map is black.
    pub fn rows_and_columns(&self) -> Result<Table2d, TableError> {
        Table2d::from_rows(self.map.width, self.map.height, |y, out| {
            let solid_angle = self.texel_solid_angle(y);
            for (weight, le) in out.iter_mut().zip(self.map.row(y)) {
                *weight = f64::from(le.luminance()) * solid_angle;
            }
        })
    }

    /// ∫ luminance dω over the sphere.
    pub fn power(&self) -> f64 {
        self.table.as_ref().map_or(0.0, HierarchicalTable::total)
    }

    /// The maximum luminance of [`Environment::le`] over all directions; 0 for a black map.
    pub fn max_luminance(&self) -> f32 {
        self.max_luminance
    }

    /// Radiance from the unit direction `wi`, constant over each texel, in multiples of [`Environment::unit`].
    pub fn le(&self, wi: Vec3) -> Rgb {
        self.le_lanes(Vectors::from(wi)).single()
    }

    /// [`Environment::le`] of one direction or of several side by side.
    #[inline(always)]
    pub(crate) fn le_lanes<F: SimdFloat>(&self, wi: Vectors<F>) -> Colors<F> {
        let [u, v] = self.grid.uv(self.orientation.up.to_map(wi));
        Colors(F::each([u, v], |uv| {
            let Texel { column, row } = self.grid.texel_at(uv);
            self.map.get(column, row).to_array()
        }))
    }

    /// Radiance from `wi`, interpolated between texel centers. It is for the background that the
    /// camera sees, where texels would show. It lights nothing, because the table does not match it.
    pub fn le_interpolated(&self, wi: Vec3) -> Rgb {
        let (w, h) = (self.map.width, self.map.height);
        let uv = self.uv(wi);
        let (x, y) = (uv.x * w as f32 - 0.5, (uv.y * h as f32 - 0.5).clamp(0.0, (h - 1) as f32));
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |i: f32| (i as isize).rem_euclid(w as isize) as usize;
        let (x0, x1) = (column(x.floor()), column(x.floor() + 1.0));
        let (y0, y1) = (y as usize, (y as usize + 1).min(h - 1));
        let row = |y| self.map.get(x0, y).lerp(self.map.get(x1, y), fx);
        row(y0).lerp(row(y1), fy)
    }

    /// Density of [`Environment::sample`] at `wi` \[sr⁻¹\].
    pub fn pdf(&self, wi: Vec3) -> f32 {
        self.le_pdf(wi).1
    }

    /// [`Environment::le`] and [`Environment::pdf`] with a single look-up.
    pub fn le_pdf(&self, wi: Vec3) -> (Rgb, f32) {
        let le = self.le(wi);
        (le, self.density(le))
    }

    /// Samples a direction with density proportional to luminance; `None` for a black map.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Option<EnvironmentSample> {
        self.light_density().sample(self, u)
    }

    /// The density proportional to luminance.
    #[inline]
    pub(crate) fn light_density(&self) -> LightDensity<'_> {
        let Self { ref table, inverse_power, .. } = *self;
        LightDensity { table: table.as_ref(), floor: 0.0, inverse_total: inverse_power }
    }

    /// A texel's probability divided by its solid angle. The solid angle in the weight cancels.
    pub(crate) fn density(&self, le: Rgb) -> f32 {
        self.light_density().pdf(Colors::from(le))
    }

    /// The distance from a texel's edge, in texels, within which a rounded direction may look up a neighbor.
    pub(crate) fn rounding_margin(&self) -> Vec2 {
        self.grid.margin
    }

    /// The direction of a position on the map, in texels from its upper left corner, in the map's own
    /// frame with +Y up. Positions within a texel are uniform in cos θ, and so in solid angle.
    pub(crate) fn map_direction(&self, column: f64, row: f64) -> Vec3 {
        self.grid.direction(column / self.grid.texels.width() as f64, self.cos_theta(row))
    }

    /// The polar cosine of a row of the map, in texels from the upper edge.
    pub(crate) fn cos_theta(&self, row: f64) -> f64 {
        self.grid.texels.cos_theta(row)
    }

    /// The columns and the rows that directions look up; unspecified for non-finite directions.
    #[inline(always)]
    pub(crate) fn texels_at<F: SimdF32x8>(&self, wi: Vectors<F>) -> [[i32; LANES]; 2] {
        let [u, v] = self.grid.uv(self.orientation.up.to_map(wi));
        // Values rounded up to the edge belong to the last texel; these are exact.
        let [width, height] = [self.map.width as f32, self.map.height as f32];
        let column = (u * u.splat(width)).min(u.splat(width - 1.0));
        let row = (v * v.splat(height)).min(v.splat(height - 1.0));
        [column.to_i32().store(), row.to_i32().store()]
    }

    /// The column and the row that `wi` looks up.
    #[cfg(any(test, feature = "render"))]
    pub(crate) fn texel_at(&self, wi: Vec3) -> [usize; 2] {
        let wi = self.orientation.up.to_map(wi.into());
        let Texel { column, row } = self.grid.texel(wi.into());
        [column, row]
    }

    /// The position within its texel that `wi` looks up, in [0, 1)²: linear in φ and cos θ.
    pub(crate) fn inside(&self, wi: Vec3) -> Vec2 {
        let wi = Vec3::from(self.orientation.up.to_map(wi.into()));
        let Texel { column, row } = self.grid.texel(wi);
        let x = self.grid.uv(wi.into())[0] * self.map.width as f32 - column as f32;
        let (top, bottom) = (self.grid.texels.cos_edge(row), self.grid.texels.cos_edge(row + 1));
        let y = ((top - f64::from(wi.y)) / (top - bottom)) as f32;
        Vec2::new(x, y).clamp(Vec2::ZERO, Vec2::splat(ONE_MINUS_EPSILON))
    }

    /// The direction of a point of the map, `uv` in [0, 1]² with (0, 0) the corner of the first texel.
    pub fn direction(&self, uv: Vec2) -> Vec3 {
        let (x, y) = (f64::from(uv.x), f64::from(uv.y));
        self.orientation.up.to_world(self.grid.direction(x, functions::cos(f64::from(PI) * y)))
    }

    /// The point of the map that `wi` looks up, in [0, 1]².
    pub fn uv(&self, wi: Vec3) -> Vec2 {
        self.grid.uv(self.orientation.up.to_map(wi.into())).into()
    }
}

/// The unit for a map whose brightest channel is `brightest`.
fn unit_of(brightest: f64) -> f64 {
    /// Products and squares of such radiances, multiplied or divided by solid angles, stay within single precision.
    const ORDINARY: std::ops::RangeInclusive<f64> =
        5.421_010_862_427_522e-20..=18_446_744_073_709_551_616.0;
    if brightest == 0.0 || ORDINARY.contains(&brightest) {
        1.0
    } else {
        functions::powi(2f64, functions::log2(brightest).floor() as i32)
    }
}

/// The map's texels and the directions in them, in the map's own frame, rotation included.
#[derive(Clone, Debug)]
struct Grid {
    texels: LatLongGrid,
    /// The rotation as a fraction of a full turn.
    turn: f32,
    /// The distance from a texel's edge, in texels, within which rounding may cross the edge.
    margin: Vec2,
}

impl Grid {
    fn new(width: usize, height: usize, rotation: f32) -> Self {
        // A direction in single precision is off by no more than a few units in the last place.
        let error = 16.0 * f32::EPSILON;
        let margin = Vec2::new(error * width as f32 / TAU, error * height as f32 / PI);
        Self {
            texels: LatLongGrid::new(width, height),
            turn: (rotation / 360.0).rem_euclid(1.0),
            margin: margin.min(Vec2::splat(0.25)),
        }
    }

    /// A table of `importance(texel)` times solid angle.
    fn table(
        &self,
        map: &RgbImage,
        importance: impl Fn(Rgb) -> f32 + Sync,
    ) -> Result<HierarchicalTable, TableError> {
        HierarchicalTable::from_rows(self.texels.width(), self.texels.height(), |row, out| {
            let solid_angle = self.texels.solid_angle(row) as f32;
            for (o, &le) in out.iter_mut().zip(map.row(row)) {
                *o = importance(le) * solid_angle;
            }
        })
    }

    /// The direction at `u` in [0, 1] across the map and polar cosine `cos_theta`.
    fn direction(&self, u: f64, cos_theta: f64) -> Vec3 {
        direction_at(self.turn(u), cos_sin(cos_theta)).into()
    }

    /// The longitude at `u` in [0, 1] across the map, from −Z toward +X, in [−½, ½] turns.
    #[inline(always)]
    fn turn(&self, u: f64) -> f32 {
        let turn = u - 0.5 - f64::from(self.turn);
        (turn - (turn + 0.5).floor()) as f32
    }

    /// The directions at `inside` texels, uniform in solid angle: linear in φ and cos θ.
    #[inline(always)]
    fn directions_in<F: SimdFloat>(&self, column: F, row: F, [x, y]: [F; 2]) -> Vectors<F> {
        let width = self.texels.width() as f64;
        let [turn] = F::each([column, x], |[column, x]| {
            [self.turn((f64::from(column) + f64::from(x)) / width)]
        });
        let polar = F::each([row, y], |[row, y]| {
            let row = row as u32 as usize;
            let (top, bottom) = (self.texels.cos_edge(row), self.texels.cos_edge(row + 1));
            cos_sin(top + f64::from(y) * (bottom - top))
        });
        direction_at(turn, polar)
    }

    /// Like [`Grid::directions_in`], but never rounded into a neighbor: a direction looks up the texel that was
    /// sampled.
    #[inline(always)]
    fn directions_inside<F: SimdFloat>(&self, column: F, row: F, inside: [F; 2]) -> Vectors<F> {
        let wi = self.directions_in(column, row, inside);
        let [x, y] = inside;
        let (low, high) = (self.margin, Vec2::ONE - self.margin);
        let (left, right) = (x.splat(low.x), x.splat(high.x));
        let (top, bottom) = (y.splat(low.y), y.splat(high.y));
        let near_edge = x.lt(left) | right.lt(x) | y.lt(top) | bottom.lt(y);
        if near_edge.bits() == 0 {
            return wi;
        }
        let [u, v] = self.uv(wi);
        let [looked_up_column, looked_up_row] = F::each([u, v], |uv| {
            let Texel { column, row } = self.texel_at(uv);
            [column as f32, row as f32]
        });
        let is_same = looked_up_column.eq(column) & looked_up_row.eq(row);
        // SimdFloat's comparisons, because `f32::clamp` is a call in WebAssembly.
        let inside = [x.max(left).min(right), y.max(top).min(bottom)];
        Vectors::select(is_same, wi, self.directions_in(column, row, inside))
    }

    #[inline(always)]
    fn uv<F: SimdFloat>(&self, d: Vectors<F>) -> [F; 2] {
        let (zero, one) = (d.x.splat(0.0), d.x.splat(1.0));
        // Between 0 and 2.
        let turn = atan2(d.x, zero - d.z) * d.x.splat(1.0 / TAU) + d.x.splat(0.5 + self.turn);
        let u = F::select(turn.lt(one), turn, turn - one);
        // acos would lose the rows next to the poles.
        let theta = atan2((d.x * d.x + d.z * d.z).sqrt(), d.y);
        [u.max(zero), theta * d.x.splat(1.0 / PI)]
    }

    fn texel(&self, d: Vec3) -> Texel {
        self.texel_at(self.uv(d.into()))
    }

    /// The texel at a position in [0, 1]².
    #[inline(always)]
    fn texel_at(&self, [u, v]: [f32; 2]) -> Texel {
        let (width, height) = (self.texels.width(), self.texels.height());
        let column = ((u * width as f32) as usize).min(width - 1);
        let row = ((v * height as f32) as usize).min(height - 1);
        Texel { column, row }
    }
}

/// The direction at a longitude [turns] and the cosine and sine of a polar angle.
#[inline(always)]
fn direction_at<F: SimdFloat>(turn: F, [cos_theta, sin_theta]: [F; 2]) -> Vectors<F> {
    let [sin_phi, cos_phi] = sin_cos_half_turns(turn);
    let back = turn.splat(0.0) - cos_phi;
    Vectors { x: sin_phi * sin_theta, y: cos_theta, z: back * sin_theta }
}

/// The cosine and the sine of a polar angle.
#[inline(always)]
fn cos_sin(cos_theta: f64) -> [f32; 2] {
    let squared = (1.0 - cos_theta) * (1.0 + cos_theta);
    [cos_theta as f32, (if squared > 0.0 { squared } else { 0.0 }).sqrt() as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{vec2, vec3};
    use crate::sampling::Pcg32;

    fn noise(width: usize, height: usize, seed: u64) -> RgbImage {
        let mut pcg = Pcg32::new(seed, 0);
        let mut number = move || (pcg.next_f32() * 12.0 - 6.0).exp();
        RgbImage::from_fn(width, height, |_, _| Rgb::new(number(), number(), number()))
    }

    fn orientations() -> impl Iterator<Item = Orientation> {
        [(UpAxis::Y, 0.0), (UpAxis::Y, 90.0), (UpAxis::Z, -33.3), (UpAxis::Y, 777.7)]
            .into_iter()
            .map(|(up, rotation)| Orientation { up, rotation })
    }

    #[test]
    fn the_conventions() {
        // One bright texel at a time on a 4x2 map, whose texels span quarters of a turn.
        let looks_at = |column: usize, row: usize, orientation| {
            let mut map = RgbImage::filled(4, 2, Rgb::BLACK);
            map.pixels[row * 4 + column] = Rgb::WHITE;
            let env = Environment::new(map, orientation, 1.0).unwrap();
            env.sample(vec2(0.5, 0.5)).unwrap().wi
        };
        let o = Orientation::default();
        // Right of the center column lies +X, left −X; the first row is up.
        let w = looks_at(2, 0, o);
        assert!(w.x > 0.4 && w.y > 0.4 && w.z < -0.4, "{w}");
        let w = looks_at(1, 1, o);
        assert!(w.x < -0.4 && w.y < -0.4 && w.z < -0.4, "{w}");
        let w = looks_at(0, 0, o);
        assert!(w.x < -0.4 && w.z > 0.4, "{w}");
        // Turned by 90 degrees what was right in front is left in front.
        let w = looks_at(2, 0, Orientation { rotation: 90.0, ..o });
        assert!(w.x < -0.4 && w.z < -0.4, "{w}");
        // With +Z up the center looks toward +Y.
        let w = looks_at(2, 0, Orientation { up: UpAxis::Z, ..o });
        assert!(w.x > 0.4 && w.z > 0.4 && w.y > 0.4, "{w}");
    }

    #[test]
    fn samples_look_up_as_they_were_drawn() {
        for orientation in orientations() {
            for (w, h) in [(1, 1), (3, 5), (64, 32), (8192, 8), (8, 4096)] {
                let env = Environment::new(noise(w, h, 5), orientation, 1.0).unwrap();
                let mut pcg = Pcg32::new(w as u64, 1);
                let ends = [0.0, ONE_MINUS_EPSILON, 0.5];
                let corners = ends.iter().flat_map(|&x| ends.map(|y| vec2(x, y)));
                let random = (0..20_000).map(|_| vec2(pcg.next_f32(), pcg.next_f32()));
                for u in corners.chain(random) {
                    let s = env.sample(u).unwrap();
                    assert_eq!((s.le, s.pdf), env.le_pdf(s.wi), "{w}x{h} {u} {orientation:?}");
                    assert!((s.wi.length() - 1.0).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn texels_partition_the_sphere() {
        for (w, h) in [(1, 1), (7, 3), (64, 32), (1, 9)] {
            let env = Environment::new(noise(w, h, 2), Orientation::default(), 1.0).unwrap();
            let sphere: f64 = (0..h).map(|y| env.texel_solid_angle(y) * w as f64).sum();
            assert!((sphere - 4.0 * std::f64::consts::PI).abs() < 1e-12);
            let table = env.table().unwrap();
            let total: f64 = (0..w * h).map(|i| table.pmf(i % w, i / w)).sum();
            assert!((total - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_rotation_of_an_orientation_turns_the_map() {
        let still = Environment::new(noise(8, 4, 1), Orientation::default(), 1.0).unwrap();
        for orientation in orientations() {
            let turned = Environment::new(noise(8, 4, 1), orientation, 1.0).unwrap();
            for uv in [vec2(0.5, 0.5), vec2(0.1, 0.2), vec2(0.7, 0.8)] {
                let expected = orientation.map_to_world() * still.direction(uv);
                assert!((turned.direction(uv) - expected).length() < 1e-5, "{orientation:?}");
            }
        }
    }

    #[test]
    fn directions_round_trip_through_the_map() {
        let map = noise(64, 32, 3);
        for orientation in orientations() {
            let env = Environment::new(map.clone(), orientation, 2.0).unwrap();
            for y in 0..32 {
                for x in 0..64 {
                    // The center of every texel, the poles' rows included.
                    let uv = vec2((x as f32 + 0.5) / 64.0, (y as f32 + 0.5) / 32.0);
                    let d = env.direction(uv);
                    assert!((env.uv(d) - uv).length() < 1e-5, "{uv}");
                    assert_eq!(env.le(d), 2.0 * map.get(x, y));
                }
            }
        }
    }

    #[test]
    fn interpolated_radiance_passes_through_texel_centers_and_is_continuous() {
        let value = |x: usize, y: usize| ((3 * x + 5 * y) % 7) as f32;
        let map = RgbImage::from_fn(16, 9, |x, y| Rgb::splat(value(x, y)));
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        for (x, y) in [(0, 0), (15, 8), (7, 4), (0, 5)] {
            let center = env.direction(vec2((x as f32 + 0.5) / 16.0, (y as f32 + 0.5) / 9.0));
            assert!((env.le_interpolated(center).g - value(x, y)).abs() < 1e-3);
        }
        // Across the seam and a texel's edge: the slope is at most 6 a texel.
        for u in [0.0, 0.25] {
            let at = |du: f32| env.le_interpolated(env.direction(vec2(u + du, 0.4))).g;
            assert!((at(1e-5) - at(-1e-5)).abs() < 6.0 * 16.0 * 2e-5 + 1e-3);
        }
        let single = Environment::constant(Rgb::WHITE).unwrap();
        assert_eq!(single.le_interpolated(Vec3::Y), Rgb::WHITE);
    }

    #[test]
    fn the_poles_and_the_seam_are_inside() {
        let env = Environment::new(noise(9, 7, 4), Orientation::default(), 1.0).unwrap();
        for d in [Vec3::Y, -Vec3::Y, Vec3::Z, vec3(-0.0, 0.0, 1.0), vec3(-1e-8, 0.0, 1.0)] {
            let (le, pdf) = env.le_pdf(d);
            assert!(le.is_finite() && pdf.is_finite() && pdf > 0.0);
        }
    }

    #[test]
    fn a_rotation_turns_the_radiance() {
        let map = noise(16, 8, 6);
        let still = Environment::new(map.clone(), Orientation::default(), 1.0).unwrap();
        let orientation = Orientation { rotation: 30.0, ..Default::default() };
        let turned = Environment::new(map, orientation, 1.0).unwrap();
        let turn = Mat3::from_rotation_y(30f32.to_radians());
        let mut pcg = Pcg32::new(1, 2);
        for _ in 0..1000 {
            let w = still.sample(vec2(pcg.next_f32(), pcg.next_f32())).unwrap();
            // Away from texel edges, where rounding decides.
            let uv = still.uv(w.wi) * vec2(16.0, 8.0);
            if (uv.fract() - 0.5).abs().max_element() < 0.49 {
                assert_eq!(turned.le_pdf(turn * w.wi), (w.le, w.pdf));
            }
        }
    }

    #[test]
    fn black_constant_and_bad_maps() {
        let black = Environment::constant(Rgb::BLACK).unwrap();
        assert!(black.sample(vec2(0.5, 0.5)).is_none());
        assert_eq!(black.le_pdf(Vec3::X), (Rgb::BLACK, 0.0));
        let white = Environment::constant(Rgb::WHITE).unwrap();
        assert_eq!(white.pdf(Vec3::X), crate::math::FRAC_1_4PI);
        assert_eq!((black.max_luminance(), white.max_luminance()), (0.0, Rgb::WHITE.luminance()));
        let dim = Environment::new(noise(9, 5, 3), Orientation::default(), 0.5).unwrap();
        let brightest = dim.map().pixels.iter().map(|p| p.luminance()).fold(0.0, f32::max);
        assert_eq!(dim.max_luminance(), brightest);
        for value in [f32::NAN, f32::INFINITY, -1.0] {
            let mut map = RgbImage::filled(4, 2, Rgb::WHITE);
            map.pixels[6].g = value;
            let error = Environment::new(map, Orientation::default(), 1.0).unwrap_err();
            assert!(matches!(error, EnvironmentError::BadTexel { x: 2, y: 1, .. }), "{error}");
        }
        assert!(Environment::new(RgbImage::default(), Orientation::default(), 1.0).is_err());
        assert!(Environment::new(noise(2, 2, 1), Orientation::default(), -1.0).is_err());
    }

    #[test]
    fn compensation_leaves_dim_texels_to_the_brdf() {
        let mut map = RgbImage::filled(8, 4, Rgb::splat(0.1));
        map.pixels[10] = Rgb::splat(100.0);
        let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
        let table = CompensatedTable::new(&env);
        let s = table.sample(&env, vec2(0.3, 0.7)).unwrap();
        assert_eq!(s.le, Rgb::splat(100.0));
        assert_eq!(table.le_pdf(&env, s.wi), (s.le, s.pdf));
        assert_eq!(table.le_pdf(&env, -s.wi).1, 0.0);
        for radiance in [Rgb::BLACK, Rgb::WHITE, Rgb::splat(0.3)] {
            let map = RgbImage::filled(33, 17, radiance);
            let env = Environment::new(map, Orientation::default(), 1.0).unwrap();
            assert!(CompensatedTable::new(&env).sample(&env, vec2(0.3, 0.7)).is_none());
        }
    }
}
