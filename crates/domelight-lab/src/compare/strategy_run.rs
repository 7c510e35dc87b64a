//! One strategy of a comparison: the number of samples in its budget, its pictures, and their errors.

use domelight::RgbImage;
use domelight::picture::compare::{REGULARIZER, compare};
use serde::Serialize;

use super::budget::{Budget, MOST_SAMPLES};
use crate::Error;
use crate::measure::Reference;
use crate::measure::render::{Render, RenderSetup};

/// How far a strategy may exceed its budget if it cannot meet it.
const MOST_EXCESS: f64 = 1.5;

/// Halvings of the budget that the convergence shows.
const HALVINGS: u32 = 4;

/// How many camera samples of each pixel a budget buys.
#[derive(Clone, Debug)]
pub(super) enum SampleCount {
    Samples(u32),
    /// Not one, and why.
    OverBudget(String),
}

/// What a budget buys, and a picture of about its size.
pub(super) struct Calibration {
    pub(super) samples: SampleCount,
    /// None where the budget buys nothing.
    pub(super) pilot: Option<Pilot>,
}

/// A picture that was made to calibrate.
pub(super) struct Pilot {
    n_samples: u32,
    image: RgbImage,
}

impl Pilot {
    pub(super) fn new(n_samples: u32, image: RgbImage) -> Self {
        Self { n_samples, image }
    }

    /// About the relMSE that a picture of `n_samples` has, where the reference's own is `noise`.
    pub(super) fn error_at(
        &self,
        n_samples: u32,
        reference: &RgbImage,
        noise: f64,
    ) -> Result<f64, Error> {
        /// The part of a measured error that remains at least.
        const LEAST_PART: f64 = 0.1;
        let measured = compare(&self.image, reference, None)?.rel_mse;
        let own = (measured - noise).max(LEAST_PART * measured);
        Ok(own * f64::from(self.n_samples) / f64::from(n_samples))
    }
}

/// A mean over seeds and its standard deviation.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MeanAndDeviation {
    /// Over all seeds.
    pub mean: f64,
    /// Standard deviation over seeds; null for a single one.
    pub sd: Option<f64>,
}

impl MeanAndDeviation {
    /// The mean of a single value.
    pub(super) fn single(mean: f64) -> Self {
        Self { mean, sd: None }
    }

    fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        Self { mean, sd: (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt()) }
    }
}

/// Cost and error at a number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ConvergencePoint {
    /// As asked for.
    pub spp: u32,
    /// Camera samples of a pixel, as counted; the mean over seeds.
    pub camera_samples: f64,
    /// Shadow rays of a pixel that the scene covers, as counted; the mean over seeds.
    pub rays: f64,
    /// CPU seconds of rendering alone.
    pub cpu_seconds: MeanAndDeviation,
    /// Against the reference, over all pixels.
    pub rel_mse: MeanAndDeviation,
}

/// Camera samples per pixel of all pictures that are measured, in multiples of the budget's. Pictures that do not continue from
/// one number of samples to the next are rendered anew for each.
pub(super) fn samples_to_measure(n_seeds: u32, continues: bool) -> f64 {
    let of_seed = if continues { 1.0 } else { 2.0 - 0.5f64.powi(HALVINGS as i32) };
    f64::from(n_seeds) * of_seed
}

/// relMSE that no more samples take away. An estimate, which may be below 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bias {
    pub(super) mean: f64,
    /// The 95 % confidence interval.
    pub(super) interval: [f64; 2],
}

/// All that was measured of a strategy.
pub(super) struct StrategyMeasurement {
    /// With few samples first; the last is that of the whole budget.
    pub(super) steps: Vec<ConvergencePoint>,
    /// The first seed's picture.
    pub(super) image: RgbImage,
    /// None for one seed.
    pub(super) bias: Option<Bias>,
    pub(super) non_finite: u64,
}

/// A strategy and how it is rendered.
pub(super) struct StrategyRun<'a> {
    pub(super) render_setup: RenderSetup<'a>,
    /// For the progress bar.
    pub(super) label: String,
    pub(super) n_seeds: u32,
}

impl StrategyRun<'_> {
    fn pilot(&self, n_samples: u32) -> Result<Render, Error> {
        // A seed of its own, as calibration must not look at the pictures that are measured.
        let label = format!("{}, calibrating", self.label);
        self.render_setup.render(&label, n_samples, !self.render_setup.settings.seed)
    }

    /// What the budget buys.
    pub(super) fn calibrate(&self, budget: Budget) -> Result<Calibration, Error> {
        match budget {
            Budget::Samples(n) => {
                let pilot = Some(Pilot::new(n, self.pilot(n)?.layers.color));
                Ok(Calibration { samples: SampleCount::Samples(n), pilot })
            }
            Budget::Rays(rays) => self.calibrate_rays(rays),
            Budget::Time(seconds) => self.calibrate_time(seconds),
        }
    }

    /// Where pictures continue, the rays of a camera sample do not depend on how many there are, and half of the samples
    /// suffice to predict the error, which falls a little faster than their number grows.
    ///
    /// Strategies that learn trace fewer rays for a camera sample the more there are, so goes from pilot to pilot and takes
    /// the number whose rays came nearest.
    fn calibrate_rays(&self, rays: f64) -> Result<Calibration, Error> {
        const MOST_PILOTS: usize = 4;
        const FIRST: u32 = 4;
        let first = self.pilot(FIRST)?;
        let mut purchase = count_for_rays(rays, first.rays() / f64::from(FIRST));
        if self.render_setup.continues() {
            let pilot = match &purchase {
                SampleCount::Samples(n) if *n > 2 * FIRST => {
                    let half = n.div_ceil(2);
                    Some(Pilot::new(half, self.pilot(half)?.layers.color))
                }
                SampleCount::Samples(_) => Some(Pilot::new(FIRST, first.layers.color)),
                SampleCount::OverBudget(_) => None,
            };
            return Ok(Calibration { samples: purchase, pilot });
        }
        let mut tried: Vec<(u32, f64)> = Vec::new();
        let off = |traced: f64| (traced / rays).ln().abs();
        let mut nearest: Option<(f64, Pilot)> = None;
        while let SampleCount::Samples(n) = purchase {
            if tried.len() == MOST_PILOTS || tried.iter().any(|&(m, _)| m == n) {
                break;
            }
            let render = self.pilot(n)?;
            let traced = render.rays();
            tried.push((n, traced));
            if nearest.as_ref().is_none_or(|(least, _)| off(traced) < *least) {
                nearest = Some((off(traced), Pilot::new(n, render.layers.color)));
            }
            purchase = count_for_rays(rays, traced / f64::from(n));
        }
        let pilot = nearest.map(|(_, pilot)| pilot);
        let samples = pilot.as_ref().map(|pilot| SampleCount::Samples(pilot.n_samples));
        Ok(Calibration { samples: samples.unwrap_or(purchase), pilot })
    }

    /// Doubles the samples until they take an eighth of the time, then goes along the line through the last two. Where
    /// the time is short, what takes time once counts as much: the number of samples is tried and corrected.
    fn calibrate_time(&self, seconds: f64) -> Result<Calibration, Error> {
        /// Up to how many seconds a number of samples is tried.
        const SHORT: f64 = 2.0;
        /// How often it is corrected.
        const CORRECTIONS: usize = 3;
        /// The share of the time by which it may miss.
        const MISS: f64 = 0.1;
        self.pilot(1)?; // warms the caches
        let mut render = self.pilot(1)?;
        let mut last = (1, render.seconds());
        let mut before = (0, 0.0);
        while last.1 < seconds / 8.0 && last.0 < MOST_SAMPLES {
            let n = last.0 * 2;
            render = self.pilot(n)?;
            (before, last) = (last, (n, render.seconds()));
        }
        let slope = (last.1 - before.1) / f64::from(last.0 - before.0);
        let each = if slope > 0.0 { slope } else { last.1 / f64::from(last.0) };
        let fixed = (last.1 - each * f64::from(last.0)).max(0.0);
        let one_sample = format!("takes {:.3} CPU seconds", fixed + each);
        let mut samples = sample_count(seconds - fixed, each, &one_sample);
        let mut pilot = Pilot::new(last.0, render.layers.color);
        for _ in 0..CORRECTIONS {
            let SampleCount::Samples(n) = samples else { break };
            if seconds > SHORT || n <= 2 {
                break;
            }
            let render = self.pilot(n)?;
            let spent = render.seconds();
            pilot = Pilot::new(n, render.layers.color);
            if (spent / seconds - 1.0).abs() < MISS {
                break;
            }
            samples = sample_count(seconds, spent / f64::from(n), "");
        }
        Ok(Calibration { samples, pilot: Some(pilot) })
    }

    /// Renders all seeds at the number of samples and its halves.
    pub(super) fn measure(
        &self,
        n_samples: u32,
        reference: &Reference,
    ) -> Result<StrategyMeasurement, Error> {
        let image = &reference.picture.image;
        let halves = (1..=HALVINGS).rev().map(|halving| n_samples >> halving).filter(|&n| n > 0);
        let numbers: Vec<u32> = halves.chain([n_samples]).collect();
        let mut steps = vec![Step::default(); numbers.len()];
        let mut pictures = PictureSum::default();
        let of = self.n_seeds;
        for i in 0..of {
            let label = format!("{}, {n_samples} spp, seed {} of {of}", self.label, i + 1);
            let seed = self.render_setup.settings.seed.wrapping_add(u64::from(i));
            self.render_setup.renders(&label, &numbers, seed, |k, render| {
                steps[k].add(&render, image)?;
                if numbers[k] == n_samples {
                    pictures.add(&render, image);
                }
                Ok(())
            })?;
        }
        let bias = pictures.bias(reference.picture.relative_noise().as_deref());
        let PictureSum { first, non_finite, .. } = pictures;
        let image = first.unwrap_or_else(|| RgbImage::new(0, 0, Vec::new()));
        let steps = numbers.into_iter().zip(steps).map(|(n, step)| step.point(n)).collect();
        Ok(StrategyMeasurement { steps, image, bias, non_finite })
    }
}

/// Costs and errors of the pictures of a number of samples, one of each seed.
#[derive(Clone, Default)]
struct Step {
    camera_samples: Vec<f64>,
    rays: Vec<f64>,
    seconds: Vec<f64>,
    errors: Vec<f64>,
}

impl Step {
    fn add(&mut self, render: &Render, reference: &RgbImage) -> Result<(), Error> {
        self.camera_samples.push(render.camera_samples());
        self.rays.push(render.rays());
        self.seconds.push(render.seconds());
        self.errors.push(compare(&render.layers.color, reference, None)?.rel_mse);
        Ok(())
    }

    fn point(&self, n_samples: u32) -> ConvergencePoint {
        ConvergencePoint {
            spp: n_samples,
            camera_samples: MeanAndDeviation::of(&self.camera_samples).mean,
            rays: MeanAndDeviation::of(&self.rays).mean,
            cpu_seconds: MeanAndDeviation::of(&self.seconds),
            rel_mse: MeanAndDeviation::of(&self.errors),
        }
    }
}

/// Whole samples for a budget, the nearest number that is not 0.
fn sample_count(budget: f64, each: f64, one_sample: &str) -> SampleCount {
    if each > MOST_EXCESS * budget {
        let advice = "give the strategy fewer rays or lights, or all a larger budget";
        return SampleCount::OverBudget(format!(
            "one camera sample per pixel {one_sample}; {advice}"
        ));
    }
    SampleCount::Samples(
        (budget / each.max(1e-12)).round().clamp(1.0, f64::from(MOST_SAMPLES)) as u32
    )
}

/// Whole samples for a budget of rays, if one traces `each`.
fn count_for_rays(rays: f64, each: f64) -> SampleCount {
    /// With fewer, the number of samples would be out of proportion to the budget, or without end.
    const LEAST: f64 = 1.0 / 64.0;
    if each.is_nan() || each < LEAST {
        return SampleCount::OverBudget(format!(
            "one camera sample per pixel traces {each:.2} shadow rays, too few for a budget of rays; give one of samples \
             (spp:N) or time (time:T)"
        ));
    }
    sample_count(rays, each, &format!("traces {each:.1} shadow rays"))
}

/// The pictures of all seeds, added up.
#[derive(Default)]
struct PictureSum {
    first: Option<RgbImage>,
    /// Σ d and Σ d² of each pixel and channel, d the difference from the reference R over √(R² + 0.01).
    sums: Vec<[[f64; 2]; 3]>,
    /// The differences d of the first pictures.
    differences: Vec<Vec<[f32; 3]>>,
    /// For pairs i < j of these, in the order of j and then of i, the mean of dᵢ dⱼ over pixels and channels.
    products: Vec<f64>,
    n: u32,
    non_finite: u64,
}

/// Pictures that show how much the bias is uncertain, for the sake of memory.
const MOST_PAIRED: usize = 8;

impl PictureSum {
    fn add(&mut self, render: &Render, reference: &RgbImage) {
        self.add_picture(&render.layers.color, reference);
        self.non_finite += render.counts.non_finite;
    }

    fn add_picture(&mut self, image: &RgbImage, reference: &RgbImage) {
        self.sums.resize(image.pixels.len(), [[0.0; 2]; 3]);
        let pixels = image.pixels.iter().zip(&reference.pixels);
        let differences: Vec<[f64; 3]> = pixels
            .map(|(x, r)| {
                let (x, r) = (x.to_array().map(f64::from), r.to_array().map(f64::from));
                std::array::from_fn(|c| (x[c] - r[c]) / (r[c] * r[c] + REGULARIZER).sqrt())
            })
            .collect();
        for (sums, differences) in self.sums.iter_mut().zip(&differences) {
            for (sums, &d) in sums.iter_mut().zip(differences) {
                *sums = [sums[0] + d, sums[1] + d * d];
            }
        }
        if self.differences.len() < MOST_PAIRED {
            let narrow: Vec<[f32; 3]> =
                differences.iter().map(|pixel| pixel.map(|d| d as f32)).collect();
            self.products.extend(self.differences.iter().map(|other| mean_product(other, &narrow)));
            self.differences.push(narrow);
        }
        self.first.get_or_insert_with(|| image.clone());
        self.n += 1;
    }

    /// Two independent pictures I and J and the halves A and B of the reference have E[(I − A)(J − B)] = bias². Over both
    /// ways to pair them, (I − A)(J − B) is (I − R)(J − R) − ((A − B)/2)², so the mean over all pairs of pictures,
    /// ((Σ d)² − Σ d²) / (n (n − 1)), less `noise` of the reference, ((A − B)/2)² relative as d² is, estimates bias².
    ///
    /// The spread of pixels gives the interval if they err independently of one another, the reference's included. Where
    /// the pixels of a picture share an error, as those of `product` do, three pictures or more give a wider one.
    fn bias(&self, noise: Option<&[[f32; 3]]>) -> Option<Bias> {
        if self.n < 2 {
            return None;
        }
        let n = f64::from(self.n);
        let of_channel = |[sum, squares]: [f64; 2]| (sum * sum - squares) / (n * (n - 1.0));
        let of_pixel = |(i, sums): (usize, &[[f64; 2]; 3])| {
            let noise: f64 = noise.map_or(0.0, |noise| noise[i].map(f64::from).iter().sum());
            (sums.iter().copied().map(of_channel).sum::<f64>() - noise) / 3.0
        };
        let n_pixels = self.sums.len() as f64;
        let pixels = || self.sums.iter().enumerate();
        let mean = pixels().map(of_pixel).sum::<f64>() / n_pixels;
        let variance = pixels().map(|pixel| (of_pixel(pixel) - mean).powi(2)).sum::<f64>()
            / (n_pixels * (n_pixels - 1.0).max(1.0));
        let half = 1.96 * variance.sqrt();
        let half = half.max(self.half_width_by_pictures(mean).unwrap_or(0.0));
        Some(Bias { mean, interval: [mean - half, mean + half] })
    }

    /// Half of the interval of the mean over pairs of pictures that the spread of pictures gives; none of fewer than three.
    ///
    /// Products of two pictures' errors are uncorrelated without bias, though pairs have pictures in common, so each counts.
    /// A `mean` beyond that interval is a bias. It multiplies the errors of all pairs of a picture, which only leaving out
    /// pictures shows.
    fn half_width_by_pictures(&self, mean: f64) -> Option<f64> {
        let n_pictures = self.differences.len();
        if n_pictures < 3 {
            return None;
        }
        let n = self.products.len() as f64;
        let average = self.products.iter().sum::<f64>() / n;
        let squares: f64 = self.products.iter().map(|product| (product - average).powi(2)).sum();
        let of_pairs = student(n - 1.0) * (squares / (n * (n - 1.0))).sqrt();
        if mean <= of_pairs {
            return Some(of_pairs);
        }
        let variance = self.variance_by_jackknife()?;
        Some(of_pairs.max(student(n_pictures as f64 - 1.0) * variance.sqrt()))
    }

    /// The variance of the mean over pairs of pictures, by leaving out one picture at a time; none of fewer than three.
    ///
    /// Without bias it is up to twice too large (Efron & Stein 1981, "The Jackknife Estimate of Variance").
    fn variance_by_jackknife(&self) -> Option<f64> {
        let n = self.differences.len();
        if n < 3 {
            return None;
        }
        let mut of_picture = vec![0.0; n];
        let pairs = (0..n).flat_map(|j| (0..j).map(move |i| (i, j)));
        for ((i, j), product) in pairs.zip(&self.products) {
            of_picture[i] += product;
            of_picture[j] += product;
        }
        let n = n as f64;
        // A mean without a picture differs from that of all by a constant and what the picture's pairs add.
        let scale = 2.0 / ((n - 1.0) * (n - 2.0));
        let mean = of_picture.iter().sum::<f64>() / n;
        let squares = of_picture.iter().map(|sum| ((sum - mean) * scale).powi(2)).sum::<f64>();
        Some((n - 1.0) / n * squares)
    }
}

/// The mean of the products of two pictures' differences.
fn mean_product(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let product = |(a, b): (&[f32; 3], &[f32; 3])| {
        a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum::<f64>()
    };
    a.iter().zip(b).map(product).sum::<f64>() / (3 * a.len()).max(1) as f64
}

/// The 97.5 % quantile of Student's distribution, by its expansion about the normal one (Abramowitz & Stegun 26.7.5).
fn student(freedom: f64) -> f64 {
    let terms = [1.959_964, 2.372_3, 2.822_5, 2.555_9];
    terms.into_iter().rev().fold(0.0, |sum, term| sum / freedom + term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use domelight::Rgb;
    use domelight::sampling::Pcg32;

    #[test]
    fn samples_are_whole_and_never_none() {
        let samples = |budget, each| match sample_count(budget, each, "") {
            SampleCount::Samples(n) => Some(n),
            SampleCount::OverBudget(_) => None,
        };
        assert_eq!(samples(64.0, 1.7), Some(38));
        assert_eq!(samples(64.0, 45.0), Some(1));
        assert_eq!(samples(64.0, 80.0), Some(1));
        assert_eq!(samples(64.0, 97.0), None);
        assert_eq!(samples(-1.0, 1.0), None);
        assert_eq!(samples(64.0, 0.0), Some(MOST_SAMPLES));
    }

    #[test]
    fn strategies_without_rays_have_no_budget_of_rays() {
        assert!(matches!(count_for_rays(64.0, 0.5), SampleCount::Samples(128)));
        assert!(matches!(count_for_rays(1.0, 0.05), SampleCount::Samples(20)));
        for each in [0.0, 0.01] {
            let SampleCount::OverBudget(why) = count_for_rays(1.0, each) else { panic!("{each}") };
            assert!(why.contains("too few for a budget of rays"), "{why}");
        }
        assert!(matches!(count_for_rays(1.0, 4.0), SampleCount::OverBudget(_)));
    }

    #[test]
    fn the_deviation_is_that_of_a_sample() {
        let deviation = MeanAndDeviation::of(&[1.0, 2.0, 3.0]);
        assert_eq!((deviation.mean, deviation.sd), (2.0, Some(1.0)));
        assert!(MeanAndDeviation::of(&[4.0]).sd.is_none());
    }

    /// What relMSE counts of the error of the mean of two halves.
    fn relative_noise(halves: &[RgbImage; 2]) -> Vec<[f32; 3]> {
        let [a, b] = halves.each_ref().map(|half| half.pixels.iter());
        let of_pixel = |(a, b): (&Rgb, &Rgb)| {
            let (mean, half) = ((*a + *b) * 0.5, (*a - *b) * 0.5);
            let (mean, half) = (mean.to_array(), half.to_array());
            std::array::from_fn(|c| half[c] * half[c] / (mean[c] * mean[c] + REGULARIZER as f32))
        };
        a.zip(b).map(of_pixel).collect()
    }

    /// A reference as noisy as the pictures, with pixels as dark as the noise and as bright as lamps.
    #[test]
    fn noisy_references_are_no_bias() {
        let side = 32;
        let mut pcg = Pcg32::new(11, 12);
        let mut picture = |noise: f32| {
            RgbImage::from_fn(side, side, |x, _| {
                let value = [0.02, 0.2, 1.0, 20.0][x % 4];
                // Seldom bright, as pictures are.
                let is_bright = pcg.next_f32() < 0.2;
                Rgb::splat(value * (1.0 + noise * if is_bright { 2.0 } else { -0.5 }))
            })
        };
        let mut n_inside = 0;
        for _ in 0..40 {
            let halves = [(); 2].map(|()| picture(0.14));
            let reference = RgbImage::from_fn(side, side, |x, y| {
                (halves[0].get(x, y) + halves[1].get(x, y)) * 0.5
            });
            let mut pictures = PictureSum::default();
            for _ in 0..3 {
                pictures.add_picture(&picture(0.1), &reference);
            }
            let noise = relative_noise(&halves);
            let Bias { interval: [low, high], .. } = pictures.bias(Some(&noise)).unwrap();
            n_inside += u32::from(low <= 0.0 && 0.0 <= high);
        }
        assert!((36..=40).contains(&n_inside), "{n_inside} of 40 intervals hold 0");
    }

    /// Noisy pictures without bias against a noisy reference, and pictures with bias.
    #[test]
    fn the_noise_of_the_reference_is_no_bias() {
        let (width, height, n_seeds) = (64, 64, 5);
        let mut pcg = Pcg32::new(7, 8);
        // Little, as errors are divided by the reference with its noise.
        let noise = 0.01f64;
        // A uniform number of variance noise².
        let mut noisy = |value: f32, factor: f64| {
            let range = (factor * noise) as f32 * 12f32.sqrt();
            RgbImage::from_fn(width, height, |_, _| {
                Rgb::splat(value + range * (pcg.next_f32() - 0.5))
            })
        };
        let of_reference = noise * noise / 1.01;
        for bias in [0.0f64, 0.005] {
            let truth = bias * bias / 1.01;
            let mut n_inside = 0;
            for _ in 0..60 {
                let halves = [(); 2].map(|()| noisy(1.0, 2f64.sqrt()));
                let reference = RgbImage::from_fn(width, height, |x, y| {
                    (halves[0].get(x, y) + halves[1].get(x, y)) * 0.5
                });
                let noise = relative_noise(&halves);
                let mut pictures = PictureSum::default();
                assert_eq!(pictures.bias(Some(&noise)), None);
                for _ in 0..n_seeds {
                    pictures.add_picture(&noisy(1.0 + bias as f32, 1.0), &reference);
                }
                let Bias { mean, interval: [low, high] } = pictures.bias(Some(&noise)).unwrap();
                assert!(low < mean && mean < high, "{low} to {high}");
                assert!(high - low < 0.3 * of_reference, "{low} to {high}");
                n_inside += u32::from(low <= truth && truth <= high);
            }
            // 95 % of 60 are 57, give or take 1.7.
            assert!(n_inside >= 50, "{bias}: {n_inside} of 60 intervals hold the truth");
        }
    }

    /// Pictures whose pixels err together, each by a number of its own, with bias and without.
    #[test]
    fn errors_that_pixels_share_widen_the_interval() {
        let (side, n_seeds) = (32, 4);
        let mut pcg = Pcg32::new(9, 10);
        let mut uniform = || f64::from(pcg.next_f32()) - 0.5;
        let reference = RgbImage::filled(side, side, Rgb::splat(1.0));
        for bias in [0.0f64, 0.02] {
            let truth = bias * bias / 1.01;
            let mut n_inside = 0;
            for _ in 0..100 {
                let mut pictures = PictureSum::default();
                for _ in 0..n_seeds {
                    let shared = bias + 0.02 * uniform();
                    let picture = RgbImage::from_fn(side, side, |_, _| {
                        Rgb::splat((1.0 + shared + 0.02 * uniform()) as f32)
                    });
                    pictures.add_picture(&picture, &reference);
                }
                let Bias { interval: [low, high], .. } = pictures.bias(None).unwrap();
                n_inside += u32::from(low <= truth && truth <= high);
            }
            assert!(n_inside >= 85, "{bias}: {n_inside} of 100 intervals hold the truth");
        }
    }

    #[test]
    fn few_degrees_of_freedom_widen_an_interval() {
        for (freedom, quantile) in [(2.0, 4.303), (5.0, 2.571), (27.0, 2.052), (1e9, 1.96)] {
            assert!((student(freedom) / quantile - 1.0).abs() < 0.04, "{freedom}");
        }
    }
}
