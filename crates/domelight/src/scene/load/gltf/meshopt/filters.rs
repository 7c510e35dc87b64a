//! Filters for decoded elements (appendix B of the specification).

use super::Filter;
use crate::math::functions;

/// Applies a filter to elements of `stride` bytes; the filter must allow this stride.
pub(super) fn apply(filter: Filter, stride: usize, elements: &mut [u8]) {
    match filter {
        Filter::None => {}
        Filter::Exponential => elements.as_chunks_mut().0.iter_mut().for_each(exponential),
        Filter::Octahedral if stride == 4 => {
            for e in elements.as_chunks_mut::<4>().0 {
                let v = octahedral(e.map(|b| i16::from(b as i8)), 127.0);
                *e = v.map(|v| v as u8);
            }
        }
        Filter::Color if stride == 4 => {
            for [y, co, cg, a] in elements.as_chunks_mut::<4>().0 {
                let chroma = [*co, *cg].map(|b| i32::from(b as i8));
                let rgba = color(i32::from(*y), chroma, i32::from(*a), 255.0);
                [*y, *co, *cg, *a] = rgba.map(|v| v as u8);
            }
        }
        Filter::Octahedral => each_four(elements, |e| octahedral(e, 32767.0)),
        Filter::Quaternion => each_four(elements, quaternion),
        Filter::Color => each_four(elements, |[y, co, cg, a]| {
            let unsigned = |v: i16| i32::from(v as u16);
            let rgba = color(unsigned(y), [co.into(), cg.into()], unsigned(a), 65535.0);
            rgba.map(|v| v as u16 as i16)
        }),
    }
}

/// Applies `f` to four 16-bit numbers at a time.
fn each_four(elements: &mut [u8], f: impl Fn([i16; 4]) -> [i16; 4]) {
    for e in elements.as_chunks_mut::<8>().0 {
        let words = std::array::from_fn(|i| i16::from_le_bytes([e[2 * i], e[2 * i + 1]]));
        for (bytes, v) in e.as_chunks_mut().0.iter_mut().zip(f(words)) {
            *bytes = v.to_le_bytes();
        }
    }
}

/// A unit vector from octahedral coordinates; the third number is their scale.
fn octahedral([x, y, one, w]: [i16; 4], max: f32) -> [i16; 4] {
    let (x, y) = (f32::from(x) / f32::from(one), f32::from(y) / f32::from(one));
    let z = 1.0 - x.abs() - y.abs();
    // Unfold the lower hemisphere.
    let t = z.min(0.0);
    let (x, y) = (x - t.copysign(x), y - t.copysign(y));
    let scale = max / (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|c| (c * scale).round() as i16);
    [x, y, z, w]
}

/// A unit quaternion from its three smaller components; the fourth number is their scale, except for the last two bits,
/// the index of the largest component.
fn quaternion([x, y, z, w]: [i16; 4]) -> [i16; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(w | 3);
    let [x, y, z] = [x, y, z].map(|c| f32::from(c) * scale);
    let greatest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let mut out = [0; 4];
    for (i, c) in [greatest, x, y, z].into_iter().enumerate() {
        out[((w & 3) as usize + i) % 4] = (c * 32767.0).round() as i16;
    }
    out
}

/// 2^e · m from a signed byte e and a signed 24-bit m.
fn exponential(element: &mut [u8; 4]) {
    let v = i32::from_le_bytes(*element);
    let (e, m) = (v >> 24, v << 8 >> 8);
    *element = (functions::powi(2f32, e) * m as f32).to_le_bytes();
}

/// RGBA from luma, chroma and alpha; alpha's highest bit gives the number of bits.
fn color(y: i32, [co, cg]: [i32; 2], a: i32, max: f32) -> [f32; 4] {
    let n_bits = 32 - a.leading_zeros();
    let unit = (1i32 << n_bits) - 1;
    let alpha = a & (unit >> 1);
    let alpha = alpha << 1 | alpha & 1;
    // Without a highest bit, the result is undefined.
    let scale = if unit == 0 { 0.0 } else { max / unit as f32 };
    [y + co - cg, y + cg, y - co - cg, alpha].map(|c| (c as f32 * scale).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(v: [i16; 4]) -> Vec<u8> {
        v.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn octahedral_vectors_are_of_unit_length() {
        let mut bytes = [0, 0, 127, 7];
        apply(Filter::Octahedral, 4, &mut bytes);
        assert_eq!(bytes, [0, 0, 127, 7]);
        // The lower hemisphere, with ten bits in sixteen.
        let mut bytes = words([-511, 511, 511, -5]);
        apply(Filter::Octahedral, 8, &mut bytes);
        assert_eq!(bytes, words([0, 0, -32767, -5]));
        let mut bytes = words([300, -100, 511, 0]);
        apply(Filter::Octahedral, 8, &mut bytes);
        let v: Vec<f32> = bytes
            .as_chunks()
            .0
            .iter()
            .map(|b| f32::from(i16::from_le_bytes(*b)) / 32767.0)
            .collect();
        assert!((v.iter().map(|c| c * c).sum::<f32>() - 1.0).abs() < 1e-4);
        // A scale of zero is undefined, but must not fail.
        apply(Filter::Octahedral, 4, &mut [1, 2, 0, 0]);
    }

    #[test]
    fn quaternions_get_their_greatest_component() {
        let mut bytes = words([0, 0, 0, 2047 & !3 | 3]);
        apply(Filter::Quaternion, 8, &mut bytes);
        assert_eq!(bytes, words([0, 0, 0, 32767]));
        // x = y = 1/√2: y is the largest component, and x, its third successor, is at the end of its range.
        let mut bytes = words([0, 0, 2047, 2047 & !3 | 1]);
        apply(Filter::Quaternion, 8, &mut bytes);
        assert_eq!(bytes, words([23170, 23170, 0, 0]));
    }

    #[test]
    fn floats_of_exponent_and_mantissa() {
        for (e, m, value) in [(0i32, 3i32, 3.0f32), (-2, -7, -1.75), (10, 1 << 20, 1_073_741_824.0)]
        {
            let mut bytes = ((e << 24) | (m & 0xff_ffff)).to_le_bytes();
            apply(Filter::Exponential, 4, &mut bytes);
            assert_eq!(f32::from_le_bytes(bytes), value);
        }
    }

    #[test]
    fn colors_are_scaled_to_their_range() {
        // Seven bits: white, opaque.
        let mut bytes = [127, 0, 0, 0x7f];
        apply(Filter::Color, 4, &mut bytes);
        assert_eq!(bytes, [255; 4]);
        // Pure red: luma 1/4, chroma orange 1/2, chroma green −1/4.
        let mut bytes = [32, 63, (-31i8) as u8, 0x40];
        apply(Filter::Color, 4, &mut bytes);
        assert_eq!([bytes[0], bytes[3]], [253, 0]);
        assert!(bytes[1] < 4 && bytes[2] < 4);
        apply(Filter::Color, 8, &mut [1; 8]);
        apply(Filter::Color, 4, &mut [1, 2, 3, 0]);
    }
}
