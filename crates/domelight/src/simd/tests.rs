//! Compares every operation of every instruction set with scalar code, on difficult numbers.

use super::*;
use crate::sampling::Pcg32;

#[inline(always)]
fn masks<F: SimdFloat>(a: F, b: F) -> [F::Mask; 5] {
    [a.le(b), a.lt(b), a.eq(b), a.le(b) & b.le(a), a.lt(b) | b.lt(a)]
}

#[inline(always)]
fn operations<F: SimdFloat>(a: F, b: F) -> [F; 12] {
    let [each] = SimdFloat::each([a, b], |[a, b]| [a.atan2(b)]);
    [
        a + b,
        a - b,
        a * b,
        a / b,
        a.min(b),
        a.max(b),
        a.sqrt(),
        a.squared(),
        a.splat(3.0),
        a.map(|x| 2.0 * x),
        each,
        SimdFloat::select(a.lt(b), a, b),
    ]
}

/// The results of all operations on two vectors, as bits; all NaNs are equal.
struct All {
    a: Lanes,
    b: Lanes,
}

impl Kernel for All {
    type Output = Vec<[u32; LANES]>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let (a, b) = (simd.load(&self.a), simd.load(&self.b));
        let (masks, floats) = (masks(a, b), operations(a, b));
        let floats = floats.into_iter().chain([simd.splat(self.a[3])]);
        let rows: [Lanes; LANES] = std::array::from_fn(|i| self.a.map(|x| x * i as f32));
        let columns = simd.transpose(rows.each_ref());
        let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
        let mut all: Vec<[u32; LANES]> =
            floats.chain(columns).map(|x| x.store().map(bits)).collect();
        all.push(std::array::from_fn(|i| masks.get(i).map_or(0, |m| m.bits())));
        all.push(std::array::from_fn(|_| bits(a.sum())));
        let mut sets = simd.empty();
        for (i, mask) in masks.into_iter().enumerate() {
            sets = sets.insert(mask, 1 << i);
        }
        all.push(sets.store());
        all.push([sets.not_empty(); LANES]);
        let first = simd.empty().insert(masks[0], 1 << 31);
        let (packed, numbers, n) = SimdBitSets::pack([sets, first], [0, 1, 2, 3, 4, 5, 6, 7]);
        let number = |i| packed[0][i] | packed[1][i] | numbers[i] << 16;
        all.push(std::array::from_fn(|i| if i < n { number(i) } else { 0 }));
        all
    }
}

/// The same for sixteen numbers.
struct Sixteen {
    a: [Lanes; 2],
    b: [Lanes; 2],
}

impl Kernel for Sixteen {
    type Output = Vec<[[u32; LANES]; 2]>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let (a, b) = (simd.load_f32x16(self.a.each_ref()), simd.load_f32x16(self.b.each_ref()));
        let (masks, floats) = (masks(a, b), operations(a, b));
        let floats = floats.into_iter().chain([simd.splat_f32x16(self.a[1][3])]);
        let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
        let mut all: Vec<_> = floats.map(|x| x.store().map(|half| half.map(bits))).collect();
        all.push([std::array::from_fn(|i| masks.get(i).map_or(0, |m| m.bits())); 2]);
        all.push([a.folded().store().map(bits), [bits(a.sum()); LANES]]);
        all
    }
}

/// The same for integers.
struct Whole {
    a: [i32; LANES],
    b: [i32; LANES],
}

impl Kernel for Whole {
    type Output = Vec<[i32; LANES]>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let (a, b) = (simd.load_i32(&self.a), simd.load_i32(&self.b));
        let table: [Lanes; 4] =
            std::array::from_fn(|row| std::array::from_fn(|lane| (row * LANES + lane) as f32));
        let gathered = S::F32x8::gather(&table, a);
        let ints = [
            a + b,
            a.shl::<3>(),
            a.min(b),
            SimdI32x8::select(a.lt(b), a, b),
            a.to_f32().to_i32(),
            gathered.to_i32(),
            simd.iota(),
            simd.splat_i32(self.a[5]),
        ];
        let keep = a.lt(b);
        let (packed, n) = (a.compress(keep), keep.bits().count_ones() as usize);
        let mut all = ints.map(SimdI32x8::store).to_vec();
        all.push(std::array::from_fn(|i| if i < n { packed[i] } else { 0 }));
        all
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    const HARD: [f32; 16] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e-42,
        -1e-42,
        f32::EPSILON,
        16_777_216.0,
        0.1,
        -3.5,
    ];
    let mut pcg = Pcg32::new(1, 2);
    let mut hard = || match pcg.next_u32() % 3 {
        0 => f32::from_bits(pcg.next_u32()),
        _ => HARD[pcg.next_u32() as usize % HARD.len()],
    };
    for _ in 0..5000 {
        let (a, b) = (std::array::from_fn(|_| hard()), std::array::from_fn(|_| hard()));
        let expected = dispatch(InstructionSet::Scalar, All { a, b });
        for set in InstructionSet::ALL {
            assert_eq!(dispatch(set, All { a, b }), expected, "{set:?} {a:?} {b:?}");
        }
        let (a, b) = ([a, b], [b, std::array::from_fn(|_| hard())]);
        let expected = dispatch(InstructionSet::Scalar, Sixteen { a, b });
        for set in InstructionSet::ALL {
            assert_eq!(dispatch(set, Sixteen { a, b }), expected, "{set:?} {a:?} {b:?}");
        }
    }
    let mut pcg = Pcg32::new(3, 4);
    for _ in 0..5000 {
        // Within the integers that f32 represents exactly, so that `to_i32` restores them.
        let mut number = || pcg.next_u32() as i32 >> 8;
        let (a, b) = (std::array::from_fn(|_| number()), std::array::from_fn(|_| number()));
        let expected = dispatch(InstructionSet::Scalar, Whole { a, b });
        for set in InstructionSet::ALL {
            assert_eq!(dispatch(set, Whole { a, b }), expected, "{set:?} {a:?} {b:?}");
        }
    }
}
