//! Encodes a whole picture for display, faster than pixel by pixel with the formulas of [`super::tone`].

use super::agx;
use super::tone::{ToneCurve, ToneMapping, srgb_from_linear};
use crate::Rgb;
use crate::math::functions;

/// A tone mapping and the sRGB encoding after it, by tables: within 2e-6 of the formulas.
pub(super) struct DisplayEncoder {
    curve: ToneCurve,
    gain: f32,
    shape: FloatTable,
    encoding: FloatTable,
}

impl DisplayEncoder {
    pub(super) fn new(tone: &ToneMapping) -> Self {
        let (least, greatest) = agx::range();
        // No other curve needs it.
        let greatest = if tone.curve == ToneCurve::Agx { greatest } else { least };
        Self {
            curve: tone.curve,
            gain: functions::exp2(tone.exposure),
            shape: FloatTable::new(least, greatest, agx::shaped),
            encoding: FloatTable::new(LINEAR_PART, 1.0, srgb_from_linear),
        }
    }

    /// sRGB values in \[0, 1\] of radiance.
    pub(super) fn encode(&self, radiance: Rgb) -> Rgb {
        let shown = self.curve.apply_with(radiance * self.gain, |light| self.shape.get(light));
        shown.map(|c| if c <= LINEAR_PART { 12.92 * c } else { self.encoding.get(c) })
    }
}

/// The sRGB encoding is linear up to here.
const LINEAR_PART: f32 = 0.003_130_8;

/// A function of positive numbers, linear between 256 values an octave. Since the bits of a positive float rise with it
/// and are linear in each octave, they are the index.
struct FloatTable {
    least: f32,
    greatest: f32,
    values: Vec<f32>,
}

/// Bits of the mantissa below the index.
const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - 8;

impl FloatTable {
    /// Tabulates `f` between `least` and `greatest`, both above 0; beyond them it has the value of the end.
    fn new(least: f32, greatest: f32, f: impl Fn(f32) -> f32) -> Self {
        let (first, last) = (least.to_bits() >> SHIFT, (greatest.to_bits() >> SHIFT) + 1);
        let mut values: Vec<f32> = (first..=last).map(|i| f(f32::from_bits(i << SHIFT))).collect();
        // The function may bend at its largest argument: lead the last line through its value there.
        let (t, n) = (fraction(greatest.to_bits()), values.len());
        if t > 0.0 {
            values[n - 1] = values[n - 2] + (f(greatest) - values[n - 2]) / t;
        }
        Self { least, greatest, values }
    }

    /// The function's value; of NaN that of the least number.
    fn get(&self, x: f32) -> f32 {
        let bits = x.max(self.least).min(self.greatest).to_bits();
        let i = ((bits >> SHIFT) - (self.least.to_bits() >> SHIFT)) as usize;
        self.values[i] + (self.values[i + 1] - self.values[i]) * fraction(bits)
    }
}

/// How far between two values of the table, in [0, 1).
fn fraction(bits: u32) -> f32 {
    (bits & ((1 << SHIFT) - 1)) as f32 / (1 << SHIFT) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_near_the_formulas() {
        for curve in ToneCurve::ALL {
            let tone = ToneMapping { exposure: 0.7, curve };
            let encoder = DisplayEncoder::new(&tone);
            for i in 0..4000u16 {
                let [r, g, b] = [1.0, 2.7, 0.4].map(|k| k * f32::from(i) / 200.0 - 14.0);
                let color = Rgb::new(r, g, b).map(f32::exp2);
                let exact = tone.apply(color).map(srgb_from_linear);
                let off = (encoder.encode(color) - exact).map(f32::abs).max_component();
                assert!(off < 2e-6, "{curve} of {color:?} is off by {off}");
            }
            for odd in [f32::NAN, -1.0, 0.0, f32::INFINITY, f32::MAX] {
                let shown = encoder.encode(Rgb::new(odd, 0.5, 0.0));
                assert!(shown.min_component() >= 0.0 && shown.max_component() <= 1.0, "{shown:?}");
            }
        }
    }
}
