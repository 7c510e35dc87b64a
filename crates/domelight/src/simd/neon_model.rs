//! A lane-by-lane model of the NEON instructions in `neon.rs`, with the signatures of `std::arch::aarch64`, so that
//! `neon.rs` is compiled and tested on other processors as well.
#![allow(unsafe_code)]
#![allow(non_camel_case_types)] // The names of `std::arch`.

use std::array::from_fn;

#[derive(Clone, Copy)]
pub(super) struct float32x4_t([f32; 4]);

#[derive(Clone, Copy)]
pub(super) struct int32x4_t([i32; 4]);

#[derive(Clone, Copy)]
pub(super) struct uint32x4_t([u32; 4]);

/// Defines instructions that fill, load and store.
macro_rules! memory {
    ($type:ident, $number:ident, $dup:ident, $load:ident, $store:ident) => {
        pub(super) fn $dup(x: $number) -> $type {
            $type([x; 4])
        }
        pub(super) unsafe fn $load(from: *const $number) -> $type {
            // SAFETY: the caller's: four are readable.
            $type(unsafe { from.cast::<[$number; 4]>().read_unaligned() })
        }
        pub(super) unsafe fn $store(to: *mut $number, a: $type) {
            // SAFETY: the caller's: four are writable.
            unsafe { to.cast::<[$number; 4]>().write_unaligned(a.0) }
        }
    };
}
memory!(float32x4_t, f32, vdupq_n_f32, vld1q_f32, vst1q_f32);
memory!(int32x4_t, i32, vdupq_n_s32, vld1q_s32, vst1q_s32);
memory!(uint32x4_t, u32, vdupq_n_u32, vld1q_u32, vst1q_u32);

/// Defines functions of each lane.
macro_rules! unary {
    ($name:ident, $from:ident, $to:ident, $f:expr) => {
        pub(super) fn $name(a: $from) -> $to {
            $to(a.0.map($f))
        }
    };
}
unary!(vnegq_f32, float32x4_t, float32x4_t, |x| -x);
unary!(vsqrtq_f32, float32x4_t, float32x4_t, f32::sqrt);
unary!(vcvtq_f32_s32, int32x4_t, float32x4_t, |x| x as f32);
unary!(vcvtq_s32_f32, float32x4_t, int32x4_t, |x| x as i32);

/// Defines functions of the lanes of two vectors.
macro_rules! binary {
    ($name:ident, $from:ident, $to:ident, $f:expr) => {
        pub(super) fn $name(a: $from, b: $from) -> $to {
            $to(from_fn(|i| $f(a.0[i], b.0[i])))
        }
    };
}
binary!(vaddq_f32, float32x4_t, float32x4_t, |a, b| a + b);
binary!(vsubq_f32, float32x4_t, float32x4_t, |a, b| a - b);
binary!(vmulq_f32, float32x4_t, float32x4_t, |a, b| a * b);
binary!(vdivq_f32, float32x4_t, float32x4_t, |a, b| a / b);
binary!(vaddq_s32, int32x4_t, int32x4_t, i32::wrapping_add);
binary!(vminq_s32, int32x4_t, int32x4_t, i32::min);
binary!(vandq_u32, uint32x4_t, uint32x4_t, |a, b| a & b);
binary!(vorrq_u32, uint32x4_t, uint32x4_t, |a, b| a | b);
binary!(vceqq_f32, float32x4_t, uint32x4_t, |a, b| all_bits(a == b));
binary!(vcleq_f32, float32x4_t, uint32x4_t, |a, b| all_bits(a <= b));
binary!(vcltq_f32, float32x4_t, uint32x4_t, |a, b| all_bits(a < b));
binary!(vcltq_s32, int32x4_t, uint32x4_t, |a, b| all_bits(a < b));
binary!(vtstq_u32, uint32x4_t, uint32x4_t, |a, b| all_bits(a & b != 0));

fn all_bits(is_true: bool) -> u32 {
    if is_true { u32::MAX } else { 0 }
}

/// a + b c, rounded once.
pub(super) fn vfmaq_f32(a: float32x4_t, b: float32x4_t, c: float32x4_t) -> float32x4_t {
    float32x4_t(from_fn(|i| b.0[i].mul_add(c.0[i], a.0[i])))
}

/// The bits of b where the mask is set, the bits of c elsewhere.
pub(super) fn vbslq_f32(mask: uint32x4_t, b: float32x4_t, c: float32x4_t) -> float32x4_t {
    let bits = |i: usize| mask.0[i] & b.0[i].to_bits() | !mask.0[i] & c.0[i].to_bits();
    float32x4_t(from_fn(|i| f32::from_bits(bits(i))))
}

/// The same for integers.
pub(super) fn vbslq_s32(mask: uint32x4_t, b: int32x4_t, c: int32x4_t) -> int32x4_t {
    int32x4_t(from_fn(|i| mask.0[i] as i32 & b.0[i] | !mask.0[i] as i32 & c.0[i]))
}

pub(super) fn vshlq_n_s32<const N: i32>(a: int32x4_t) -> int32x4_t {
    int32x4_t(a.0.map(|x| x << N))
}

/// The sum of all lanes.
pub(super) fn vaddvq_u32(a: uint32x4_t) -> u32 {
    a.0.into_iter().fold(0, u32::wrapping_add)
}
