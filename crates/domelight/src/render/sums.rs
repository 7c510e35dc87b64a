//! The sums over the camera samples of a pixel, which make up a film and which a checkpoint stores bit by bit.

use super::tiling::SampleSet;
use super::variance::{Contrast, Scale, usual_at_edges};
use crate::Rgb;
use crate::color::REGULARIZER;
use crate::math::{Vec3, functions};

/// The contribution of one camera sample to its pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CameraSample {
    pub(super) color: Rgb,
    pub(super) unoccluded: Rgb,
    pub(super) alpha: f32,
    /// The fraction of each channel of the background that shadows remove, on a shadow catcher.
    pub(super) shadow: Rgb,
    /// The luminance of the shadow catcher if the background is hidden; its noise is that of the composited picture.
    pub(super) unseen: f32,
    /// `None` if the ray left the scene.
    pub(super) surface: Option<SurfaceSample>,
}

impl CameraSample {
    /// Attenuates the sample by the `throughput` of the surfaces in front.
    pub(super) fn through(self, throughput: Rgb) -> Self {
        // The surfaces in front cover the fraction of the background that they remove.
        let behind = if self.surface.is_some() { 0.0 } else { throughput.mean() };
        Self {
            color: self.color * throughput,
            unoccluded: self.unoccluded * throughput,
            alpha: 1.0 - (1.0 - self.alpha) * behind,
            shadow: self.shadow * throughput,
            unseen: self.unseen * throughput.luminance(),
            surface: self.surface,
        }
    }

    /// Adds the fraction `beyond` of the background that is seen through the sample's surfaces.
    pub(super) fn before(self, background: &Self, beyond: Rgb) -> Self {
        Self {
            color: self.color + background.color * beyond,
            unoccluded: self.unoccluded + background.unoccluded * beyond,
            // The surfaces cover the fraction of the background that they remove.
            alpha: 1.0 - (1.0 - background.alpha) * beyond.mean(),
            ..self
        }
    }
}

/// The surface that a camera sample saw.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSample {
    pub(super) albedo: Rgb,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
}

/// Defines the sums of a pixel: for each, its type and the channels in which a checkpoint stores its bits, one channel
/// per 32 bits. A checkpoint's digest hashes the channels in the order of the sums.
macro_rules! pixel_sums {
    ($(#[$meta:meta])* { $($(#[$doc:meta])* $sum:ident: $type:ty = [$($word:literal)*],)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub(super) struct PixelSums {
            $($(#[$doc])* pub(super) $sum: $type,)*
        }

        #[cfg(feature = "io")]
        impl PixelSums {
            /// The channels of [`PixelSums::to_words`].
            pub(super) const WORDS: [&'static str; [$($($word,)*)*].len()] = [$($($word,)*)*];

            /// The bits of all sums.
            pub(super) fn to_words(self) -> [u32; Self::WORDS.len()] {
                let mut words = [0; Self::WORDS.len()];
                let mut slots = words.iter_mut();
                let mut put = |word| *slots.next().expect("a channel for each word") = word;
                $(self.$sum.put_words(&mut put);)*
                words
            }

            /// The sums of [`PixelSums::to_words`].
            pub(super) fn from_words(words: [u32; Self::WORDS.len()]) -> Self {
                let mut words = words.into_iter();
                let mut take = || words.next().expect("a channel for each word");
                Self { $($sum: Words::take_words(&mut take),)* }
            }
        }
    };
}

pixel_sums! {
    /// The sums of one pixel. Samples are added one by one in order, regardless of the passes, so the
    /// same samples give the same bits.
    {
        color: [f64; 3] = [
            "color.R.high" "color.R.low" "color.G.high" "color.G.low" "color.B.high" "color.B.low"
        ],
        color_squared: [f64; 3] = [
            "color2.R.high" "color2.R.low" "color2.G.high" "color2.G.low" "color2.B.high"
            "color2.B.low"
        ],
        unoccluded: [f64; 3] = [
            "unoccluded.R.high" "unoccluded.R.low" "unoccluded.G.high" "unoccluded.G.low"
            "unoccluded.B.high" "unoccluded.B.low"
        ],
        /// The part of `color` from the second set.
        second: [f64; 3] = [
            "second.R.high" "second.R.low" "second.G.high" "second.G.low" "second.B.high"
            "second.B.low"
        ],
        depth: f64 = ["depth.Z.high" "depth.Z.low"],
        /// `color` after the first n and n/2 samples, where n is the largest power of two so far.
        prefixes: [Rgb; 2] = ["whole.R" "whole.G" "whole.B" "half.R" "half.G" "half.B"],
        shadow: Rgb = ["shadow.R" "shadow.G" "shadow.B"],
        albedo: Rgb = ["albedo.R" "albedo.G" "albedo.B"],
        normal: Vec3 = ["normal.X" "normal.Y" "normal.Z"],
        alpha: f32 = ["alpha.A"],
        n_hits: u32 = ["hits.Y"],
        n_samples: u32 = ["samples.Y"],
        /// The number of samples in the second set.
        n_second: u32 = ["second.samples.Y"],
    }
}

/// A sum stored in 32-bit words.
#[cfg(feature = "io")]
trait Words: Sized {
    fn put_words(self, put: &mut impl FnMut(u32));
    fn take_words(take: &mut impl FnMut() -> u32) -> Self;
}

#[cfg(feature = "io")]
impl Words for u32 {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        put(self);
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        take()
    }
}

#[cfg(feature = "io")]
impl Words for f32 {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        put(self.to_bits());
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        Self::from_bits(take())
    }
}

/// The upper half of the bits, then the lower half.
#[cfg(feature = "io")]
impl Words for f64 {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        let bits = self.to_bits();
        put((bits >> 32) as u32);
        put(bits as u32);
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        let [high, low] = [take(), take()].map(u64::from);
        Self::from_bits(high << 32 | low)
    }
}

#[cfg(feature = "io")]
impl<T: Words, const N: usize> Words for [T; N] {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        for x in self {
            x.put_words(put);
        }
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        std::array::from_fn(|_| T::take_words(take))
    }
}

#[cfg(feature = "io")]
impl Words for Rgb {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        self.to_array().put_words(put);
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        <[f32; 3]>::take_words(take).into()
    }
}

#[cfg(feature = "io")]
impl Words for Vec3 {
    fn put_words(self, put: &mut impl FnMut(u32)) {
        self.to_array().put_words(put);
    }

    fn take_words(take: &mut impl FnMut() -> u32) -> Self {
        <[f32; 3]>::take_words(take).into()
    }
}

impl PixelSums {
    /// The sums after `n_samples` that saw nothing, without background.
    pub(super) fn missed(n_samples: u32) -> Self {
        Self { n_samples, ..Self::default() }
    }

    /// Adds a sample of a set, with colors in multiples of `unit`. A sample that is not finite counts as black, and the
    /// function returns false.
    #[inline]
    pub(super) fn add(&mut self, sample: &CameraSample, set: SampleSet, unit: f64) -> bool {
        let colors = [sample.color, sample.unoccluded, sample.shadow];
        let finite = colors.iter().all(|color| color.is_finite());
        if finite {
            self.shadow += sample.shadow;
            let in_units = |color: Rgb| color.to_array().map(|c| f64::from(c) * unit);
            for (c, x) in in_units(sample.color).into_iter().enumerate() {
                self.color[c] += x;
                self.color_squared[c] += x * x;
            }
            for (c, x) in in_units(sample.unoccluded).into_iter().enumerate() {
                self.unoccluded[c] += x;
            }
        }
        if sample.alpha.is_finite() {
            self.alpha += sample.alpha;
        }
        self.n_samples += 1;
        if set == SampleSet::Second {
            self.n_second += 1;
            let color = if finite { sample.color } else { Rgb::BLACK };
            for (sum, x) in self.second.iter_mut().zip(color.to_array()) {
                *sum += f64::from(x) * unit;
            }
        }
        self.keep_prefix();
        if let Some(surface) = sample.surface {
            self.albedo += surface.albedo;
            self.normal += surface.normal;
            self.depth += f64::from(surface.depth);
            self.n_hits += 1;
        }
        finite
    }

    /// Adds a sample of a set that saw nothing, without background.
    #[inline]
    pub(super) fn add_miss(&mut self, set: SampleSet) {
        self.n_samples += 1;
        self.n_second += u32::from(set == SampleSet::Second);
        self.keep_prefix();
    }

    /// Keeps `color` if the number of samples is a power of two.
    #[inline]
    fn keep_prefix(&mut self) {
        if self.n_samples.is_power_of_two() {
            self.prefixes = [Rgb::from(self.color.map(narrowed)), self.prefixes[0]];
        }
    }

    /// Adds `n` samples of a set that saw nothing, without background, to a pixel that never saw anything.
    pub(super) fn add_misses(&mut self, n: u32, set: SampleSet) {
        self.n_samples += n;
        self.n_second += if set == SampleSet::Second { n } else { 0 };
    }

    pub(super) fn n_samples(&self) -> u32 {
        self.n_samples
    }

    /// The number of samples in a set.
    pub(super) fn n_of(&self, set: SampleSet) -> u32 {
        match set {
            SampleSet::First => self.n_samples - self.n_second,
            SampleSet::Second => self.n_second,
        }
    }

    /// The relMSE of the mean from the difference of the two sets; 0 if either is empty.
    pub(super) fn error_by_sets(&self) -> f64 {
        let [first, second] = self.means_of_sets();
        let of_channel = |c: usize| {
            let variance = self.balance() * functions::powi(first[c] - second[c], 2);
            // A firefly brightens one of the sets. The other shows how bright the pixel is.
            let brightness = first[c].min(second[c]).max(0.0);
            variance / (brightness * brightness + REGULARIZER)
        };
        (0..3).map(of_channel).sum::<f64>() / 3.0
    }

    /// The means of the two sets; black if either is empty.
    fn means_of_sets(&self) -> [[f64; 3]; 2] {
        let [n_first, n_second] = self.sizes_of_sets();
        if n_first == 0.0 || n_second == 0.0 {
            return [[0.0; 3]; 2];
        }
        let first = std::array::from_fn(|c| (self.color[c] - self.second[c]) / n_first);
        [first, self.second.map(|sum| sum / n_second)]
    }

    /// The numbers of samples of the two sets.
    fn sizes_of_sets(&self) -> [f64; 2] {
        [SampleSet::First, SampleSet::Second].map(|set| f64::from(self.n_of(set)))
    }

    /// The variance of the mean divided by that of the difference of the sets, for equally noisy sets: a b / (a + b)².
    fn balance(&self) -> f64 {
        let [first, second] = self.sizes_of_sets();
        first * second / functions::powi(first + second, 2).max(1.0)
    }

    /// The pixel's contribution to the variance sums.
    pub(super) fn contrast(&self) -> Option<Contrast> {
        if self.n_samples < 2 {
            return None;
        }
        let independent: f64 = self.independent_variance().into_iter().sum();
        let squares = |x: [f64; 3]| x.into_iter().map(|x| x * x).sum::<f64>();
        if self.n_second > 0 {
            let [first, second] = self.means_of_sets();
            let difference = std::array::from_fn(|c| first[c] - second[c]);
            let measured = self.balance() * squares(difference);
            let coverage: f64 = self.coverage_variance().into_iter().sum();
            if coverage > 0.0 {
                let usual = coverage * usual_at_edges(self.n_samples - self.n_second);
                return Some(Contrast::Edge([independent - coverage, coverage, usual, measured]));
            }
            return Some(Contrast::Sets([independent, measured]));
        }
        let [whole, half] = self.prefixes.map(|sum| sum.to_array().map(f64::from));
        let prefix = f64::from(1u32 << self.n_samples.ilog2());
        let halves = std::array::from_fn(|c| (2.0 * half[c] - whole[c]) * 2.0 / prefix);
        let independent = independent * f64::from(self.n_samples) / prefix;
        Some(Contrast::Halves([independent, squares(halves)]))
    }

    /// The reciprocal of the number of samples.
    pub(super) fn scale(&self) -> f32 {
        1.0 / self.n_samples.max(1) as f32
    }

    /// A sum divided by the number of samples.
    pub(super) fn mean(&self, sum: [f64; 3]) -> Rgb {
        let n = f64::from(self.n_samples.max(1));
        // Means of differences may be negative; clamping them would introduce bias.
        Rgb::from(sum.map(|c| narrowed(c / n)))
    }

    /// The fraction of the background that shadows remove; an unbiased estimate, as unclamped as color.
    pub(super) fn shadow(&self) -> Rgb {
        self.shadow.map(|sum| self.share(sum))
    }

    /// The fraction of camera samples that show something; an unbiased estimate where shadows are caught.
    pub(super) fn alpha(&self) -> f32 {
        self.share(self.alpha)
    }

    /// A sum divided by the number of samples, clamped to 1 against rounding.
    fn share(&self, sum: f32) -> f32 {
        let mean = sum * self.scale();
        if sum <= self.n_samples as f32 { mean.min(1.0) } else { mean }
    }

    /// The mean over the samples that hit.
    pub(super) fn depth(&self) -> f32 {
        (self.depth / f64::from(self.n_hits.max(1))) as f32
    }

    /// s²/n: the variance of the mean if the samples were independent.
    fn independent_variance(&self) -> [f64; 3] {
        let n = f64::from(self.n_samples);
        if n < 2.0 {
            return [0.0; 3];
        }
        std::array::from_fn(|c| {
            let mean = self.color[c] / n;
            (self.color_squared[c] / n - mean * mean).max(0.0) / (n - 1.0)
        })
    }

    /// The part of s²/n that comes from the coverage of a hidden background: α(1 − α) m² / (n − 1), where m is the mean of
    /// what covers it.
    fn coverage_variance(&self) -> [f64; 3] {
        let (n, alpha) = (f64::from(self.n_samples), f64::from(self.alpha()));
        if n < 2.0 || alpha <= 0.0 || alpha >= 1.0 {
            return [0.0; 3];
        }
        let independent = self.independent_variance();
        std::array::from_fn(|c| {
            let mean = self.color[c] / n;
            ((1.0 - alpha) / alpha * mean * mean / (n - 1.0)).min(independent[c])
        })
    }

    /// The variance of the mean; `scale` is [`super::variance::VarianceSums::scale`] of its samples.
    pub(super) fn variance(&self, scale: Scale) -> Rgb {
        let (independent, coverage) = (self.independent_variance(), self.coverage_variance());
        let of_coverage = scale.coverage.unwrap_or(scale.inside);
        Rgb::from(std::array::from_fn(|c| {
            narrowed(scale.inside * (independent[c] - coverage[c]) + of_coverage * coverage[c])
        }))
    }

    /// The variance of the mean relative to the brightness: variance / (luminance² + 0.01).
    pub(super) fn relative_variance(&self, scale: Scale) -> f64 {
        let luminance = f64::from(self.mean(self.color).luminance());
        f64::from(self.variance(scale).luminance()) / (luminance * luminance + REGULARIZER)
    }
}

/// The nearest finite single-precision number.
fn narrowed(x: f64) -> f32 {
    x.min(f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a sometimes negative estimate is unbiased, unless it is clamped.
    #[test]
    fn negative_means_are_kept() {
        let mut pixel = PixelSums::missed(0);
        for x in [0.25, -0.75] {
            let color = Rgb::splat(x);
            let sample = CameraSample { color, unoccluded: color, ..CameraSample::default() };
            assert!(pixel.add(&sample, SampleSet::First, 1.0));
        }
        assert_eq!(pixel.mean(pixel.color), Rgb::splat(-0.25));
        assert_eq!(pixel.mean(pixel.unoccluded), Rgb::splat(-0.25));
    }

    /// A shadow estimate that is sometimes below 0 or above 1 keeps its mean for any number of samples.
    #[test]
    fn means_of_shadows_are_kept_beyond_0_and_1() {
        let estimates = [-0.5, 0.25, 1.75, 0.5];
        let shown = |estimates: &[f32]| {
            let mut pixel = PixelSums::missed(0);
            for &x in estimates {
                let shadow = Rgb::splat(x);
                let sample = CameraSample { shadow, alpha: x, ..CameraSample::default() };
                assert!(pixel.add(&sample, SampleSet::First, 1.0));
            }
            assert_eq!(pixel.shadow(), Rgb::splat(pixel.alpha()));
            pixel.alpha()
        };
        let of_one: f32 = estimates.iter().map(|&x| shown(&[x])).sum();
        assert_eq!(of_one / 4.0, shown(&estimates));
        // Coverage is at most 1.
        assert!((1..200).all(|n| shown(&vec![1.0; n]) <= 1.0));
    }
}
