//! Directions side by side, for loops that become vector instructions.

use crate::Rgb;
use crate::math::{Vec3, vec3};

/// Directions of a block.
pub const LANES: usize = 8;

/// One number a lane.
pub type Lanes = [f32; LANES];

/// Vectors by component.
#[derive(Clone, Copy, Debug, Default)]
pub struct VecBlock {
    /// x of each lane.
    pub x: Lanes,
    /// y of each lane.
    pub y: Lanes,
    /// z of each lane.
    pub z: Lanes,
}

impl VecBlock {
    /// The vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        vec3(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Sets the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    /// The scalar products with a vector.
    #[inline(always)]
    pub fn dot(&self, v: Vec3) -> Lanes {
        std::array::from_fn(|i| self.x[i] * v.x + self.y[i] * v.y + self.z[i] * v.z)
    }
}

/// Values and densities of a block of directions.
#[derive(Clone, Copy, Debug, Default)]
pub struct ValueBlock {
    /// Values by channel.
    pub value: [Lanes; 3],
    /// Densities.
    pub pdf: Lanes,
}

impl ValueBlock {
    /// The value of a lane.
    #[inline(always)]
    pub fn value(&self, lane: usize) -> Rgb {
        let [r, g, b] = &self.value;
        Rgb::new(r[lane], g[lane], b[lane])
    }

    /// Adds to a lane.
    #[inline(always)]
    pub(super) fn add(&mut self, lane: usize, value: Rgb, pdf: f32) {
        let [r, g, b] = &mut self.value;
        r[lane] += value.r;
        g[lane] += value.g;
        b[lane] += value.b;
        self.pdf[lane] += pdf;
    }
}
