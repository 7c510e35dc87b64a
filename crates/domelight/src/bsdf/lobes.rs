//! BSDFs: weighted sums of a few lobes.
//!
//! A BSDF is sampled by choosing one lobe and sampling it. The density is that of the mixture, so the
//! weight of a sample is bounded by the lobes' own weights divided by the probabilities of the choice.

use super::{
    Beckmann, Brdf, Coat, CustomLobe, Ggx, Lambert, MetallicRoughness, Phong, Sheen, Ward, range,
};
use crate::Rgb;
use crate::math::Vec3;
use crate::sampling::ONE_MINUS_EPSILON;
use crate::simd::{Colors, LaneMask as _, SimdFloat, Vectors};

macro_rules! lobes {
    ($($(#[$doc:meta])* $model:ident),*) => {
        /// One reflectance lobe.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum Lobe {
            $($(#[$doc])* $model($model),)*
            /// A custom lobe.
            Custom(CustomLobe),
        }

        impl Lobe {
            /// The names of the library's models, for tests that must not forget one.
            pub const MODELS: &[&str] = &[$(stringify!($model)),*];
        }

        $(impl From<$model> for Lobe {
            fn from(lobe: $model) -> Self {
                Self::$model(lobe)
            }
        })*
    };
}
lobes! {
    /// Ideal diffuse.
    Lambert,
    /// A power of the cosine to the mirror direction.
    Phong,
    /// Anisotropic Gaussian.
    Ward,
    /// Microfacets, Trowbridge–Reitz.
    Ggx,
    /// Microfacets, Gaussian slopes.
    Beckmann,
    /// glTF's coupled diffuse and GGX.
    MetallicRoughness,
    /// glTF's fibers.
    Sheen,
    /// glTF's clear coat.
    Coat
}

/// Evaluates the same expression for any lobe.
macro_rules! each {
    ($lobe:expr, $l:ident => $body:expr) => {
        match $lobe {
            Lobe::Lambert($l) => $body,
            Lobe::Phong($l) => $body,
            Lobe::Ward($l) => $body,
            Lobe::Ggx($l) => $body,
            Lobe::Beckmann($l) => $body,
            Lobe::MetallicRoughness($l) => $body,
            Lobe::Sheen($l) => $body,
            Lobe::Coat($l) => $body,
            Lobe::Custom($l) => $body,
        }
    };
}

impl Brdf for Lobe {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        each!(self, l => l.eval_lanes(wo, wi))
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F> {
        each!(self, l => l.sample_lanes(wo, u_lobe, u))
    }

    fn max_eval(&self, wo: Vec3) -> f32 {
        each!(self, l => l.max_eval(wo))
    }

    #[inline]
    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        each!(self, l => l.directional_albedo(cos_theta_o))
    }
}

impl From<CustomLobe> for Lobe {
    fn from(lobe: CustomLobe) -> Self {
        Self::Custom(lobe)
    }
}

/// The maximum number of lobes of a [`Bsdf`].
pub const MAX_LOBES: usize = 3;

/// A sum of at most [`MAX_LOBES`] weighted lobes: plain data of 196 bytes, no heap.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    terms: [Term; MAX_LOBES],
    n_terms: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    lobe: Lobe,
    weight: f32,
    /// The probability of choosing this lobe: positive, and those of all lobes sum to 1.
    probability: f32,
}

/// The error of too many lobes for a [`Bsdf`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a material is a sum of at most {MAX_LOBES} non-black lobes, not {count}")]
pub struct TooManyLobes {
    /// The number of lobes given.
    pub count: usize,
}

/// The cosine at which lobes are weighted while the view is unknown: the mean of cos θ over the
/// directions from which a diffuse surface receives light.
const TYPICAL_COSINE: f32 = 2.0 / 3.0;

/// The minimum share of a lobe relative to the sum of all, because its albedo is only an estimate.
const LEAST_SHARE: f32 = 0.05;

impl Bsdf {
    /// A BSDF that reflects nothing.
    pub const BLACK: Self = {
        let lobe = Lobe::Lambert(Lambert::new(Rgb::BLACK));
        let term = Term { lobe, weight: 0.0, probability: 0.0 };
        Self { terms: [term; MAX_LOBES], n_terms: 0 }
    };

    /// Creates a BSDF with a single lobe.
    pub fn single(lobe: impl Into<Lobe>) -> Self {
        Self::of_terms([(1.0, lobe.into())])
    }

    /// Creates the sum of lobes.
    ///
    /// # Errors
    /// [`TooManyLobes`] if more than [`MAX_LOBES`] lobes are not black.
    pub fn new(lobes: &[Lobe]) -> Result<Self, TooManyLobes> {
        Self::checked(lobes.iter().map(|&lobe| (1.0, lobe)))
    }

    /// Creates the sum of lobes times weights in [0, 1000]. Greater weights are clamped, and a lobe whose weight is not
    /// positive is dropped.
    ///
    /// # Errors
    /// [`TooManyLobes`] if more than [`MAX_LOBES`] lobes are not black.
    pub fn weighted(lobes: &[(f32, Lobe)]) -> Result<Self, TooManyLobes> {
        Self::checked(lobes.iter().copied())
    }

    /// Creates glTF's layers as seen from `wo`: sheen on the `base`, and a coat with a strength in \[0, 1\] on both.
    /// A layer dims those below by what it reflects toward `wo`, regardless of the direction of light, so the result
    /// is valid only for this view.
    #[must_use]
    pub fn layered(
        base: impl Into<Lobe>,
        sheen: Option<Sheen>,
        coat: Option<(f32, Coat)>,
        wo: Vec3,
    ) -> Self {
        let below_coat =
            coat.map_or(1.0, |(strength, coat)| 1.0 - range::unit(strength) * coat.reflectance(wo));
        let below_sheen = sheen.map_or(1.0, |sheen| sheen.share_below(wo.z));
        let base = (below_coat * below_sheen, base.into());
        let sheen = sheen.map(|sheen| (below_coat, sheen.into()));
        let coat = coat.map(|(strength, coat)| (range::unit(strength), coat.into()));
        let mut layered = Self::of_terms([Some(base), sheen, coat].into_iter().flatten());
        if layered.n_terms > 1 {
            layered.choose_by_albedo(wo.z.clamp(0.0, 1.0));
        }
        layered
    }

    fn checked(lobes: impl Iterator<Item = (f32, Lobe)> + Clone) -> Result<Self, TooManyLobes> {
        let count = lobes.clone().filter(reflects).count();
        if count > MAX_LOBES { Err(TooManyLobes { count }) } else { Ok(Self::of_terms(lobes)) }
    }

    fn of_terms(lobes: impl IntoIterator<Item = (f32, Lobe)>) -> Self {
        let mut bsdf = Self::BLACK;
        for (slot, (weight, lobe)) in bsdf.terms.iter_mut().zip(lobes.into_iter().filter(reflects))
        {
            *slot = Term { lobe, weight: range::weight(weight), probability: 0.0 };
            bsdf.n_terms += 1;
        }
        bsdf.choose_by_albedo(TYPICAL_COSINE);
        bsdf
    }

    /// The same BSDF with its lobes chosen in proportion to their albedos toward `wo`, which accounts for the
    /// Fresnel reflectance at every angle. Worth its cost from a few samples up.
    #[must_use]
    #[inline]
    pub fn for_view(&self, wo: Vec3) -> Self {
        let mut seen = Self::BLACK;
        seen.set(self, wo);
        seen
    }

    /// Sets this to [`Bsdf::for_view`] of `other`, in place.
    #[inline]
    pub(crate) fn set(&mut self, other: &Self, wo: Vec3) {
        self.n_terms = other.n_terms;
        for (term, other) in self.terms.iter_mut().zip(other.terms()) {
            *term = *other;
        }
        if self.n_terms > 1 {
            self.choose_by_albedo(wo.z.clamp(0.0, 1.0));
        }
    }

    fn choose_by_albedo(&mut self, cos_theta_o: f32) {
        let terms = &mut self.terms[..self.n_terms as usize];
        let mut sum = 0.0;
        for term in terms.iter_mut() {
            term.probability = term.weight * term.lobe.directional_albedo(cos_theta_o).mean();
            sum += term.probability;
        }
        let floor = if sum > 0.0 { LEAST_SHARE * sum } else { 1.0 };
        let total = sum + floor * terms.len() as f32;
        for term in terms {
            term.probability = (term.probability + floor) / total;
        }
    }

    /// The approximate color of the surface: its albedo as seen from above.
    pub fn albedo(&self) -> Rgb {
        self.directional_albedo(1.0)
    }

    /// Whether samples choose among lobes or parts of them; if not, `u_lobe` is unused.
    pub(crate) fn has_choice(&self) -> bool {
        self.n_terms > 1 || self.terms().iter().any(|t| t.lobe.has_choice())
    }

    /// The lobes with their weights.
    pub fn lobes(&self) -> impl Iterator<Item = (f32, &Lobe)> {
        self.terms().iter().map(|t| (t.weight, &t.lobe))
    }

    #[inline]
    fn terms(&self) -> &[Term] {
        &self.terms[..self.n_terms as usize]
    }
}

impl Lobe {
    /// Whether its samples use `u_lobe`.
    fn has_choice(&self) -> bool {
        match self {
            Self::MetallicRoughness(_) | Self::Custom(_) => true,
            Self::Lambert(_)
            | Self::Phong(_)
            | Self::Ward(_)
            | Self::Ggx(_)
            | Self::Beckmann(_)
            | Self::Sheen(_)
            | Self::Coat(_) => false,
        }
    }
}

/// Whether the lobe is not black from every direction.
fn reflects(&(weight, lobe): &(f32, Lobe)) -> bool {
    let albedo = lobe.directional_albedo(0.0) + lobe.directional_albedo(1.0);
    weight > 0.0 && !albedo.is_black()
}

impl PartialEq for Bsdf {
    fn eq(&self, other: &Self) -> bool {
        self.terms() == other.terms()
    }
}

impl Default for Bsdf {
    /// Black.
    fn default() -> Self {
        Self::BLACK
    }
}

impl From<Lobe> for Bsdf {
    fn from(lobe: Lobe) -> Self {
        Self::single(lobe)
    }
}

/// The probability of choosing each lobe, for several views side by side.
#[derive(Clone, Copy)]
pub(crate) struct LobeChoice<F>([F; MAX_LOBES]);

impl Bsdf {
    /// The choice among the lobes.
    #[inline(always)]
    pub(crate) fn choice<F: SimdFloat>(&self, like: F) -> LobeChoice<F> {
        let [a, b, c] = self.probabilities();
        LobeChoice([like.splat(a), like.splat(b), like.splat(c)])
    }

    /// The choices of BSDFs that differ in nothing else, one per lane.
    #[inline(always)]
    pub(crate) fn choices<'b, F: SimdFloat>(
        like: F,
        bsdf: impl Fn(usize) -> &'b Self,
    ) -> LobeChoice<F> {
        LobeChoice(like.by_lane(|lane| bsdf(lane).probabilities()))
    }

    #[inline(always)]
    fn probabilities(&self) -> [f32; MAX_LOBES] {
        let [a, b, c] = &self.terms;
        [a.probability, b.probability, c.probability]
    }

    /// Whether both are the same but for [`Bsdf::for_view`], and all their lobes are the library's.
    #[inline]
    pub(crate) fn is_same_material(&self, other: &Self) -> bool {
        let same = |(a, b): (&Term, &Term)| {
            a.weight == b.weight && a.lobe == b.lobe && !matches!(a.lobe, Lobe::Custom(_))
        };
        self.n_terms == other.n_terms && self.terms().iter().zip(other.terms()).all(same)
    }

    /// [`Brdf::eval_lanes`] for lobes that are chosen with other probabilities.
    #[inline(always)]
    pub(crate) fn eval_chosen<F: SimdFloat>(
        &self,
        choice: &LobeChoice<F>,
        wo: Vectors<F>,
        wi: Vectors<F>,
    ) -> (Colors<F>, F) {
        let one = |x| wi.z.splat(x);
        let (mut value, mut pdf) = (Colors::splat(wi.z, Rgb::BLACK), one(0.0));
        for (term, &probability) in self.terms().iter().zip(&choice.0) {
            let (v, p) = term.lobe.eval_lanes(wo, wi);
            value = value.zip(v.scaled(one(term.weight)), |a, b| a + b);
            pdf = pdf + p * probability;
        }
        (value, pdf)
    }

    /// [`Brdf::sample_lanes`] for lobes that are chosen with other probabilities.
    ///
    /// The remainder of `u_lobe` after the choice of a lobe is uniform again, and chooses within the lobe.
    #[inline(always)]
    pub(crate) fn sample_chosen<F: SimdFloat>(
        &self,
        choice: &LobeChoice<F>,
        wo: Vectors<F>,
        u_lobe: F,
        u: [F; 2],
    ) -> Vectors<F> {
        let one = |x| wo.z.splat(x);
        let mut wi = Vectors::splat(wo.z, Vec3::ZERO);
        // Lanes whose lobe is this one or a later one, and what is left of their numbers.
        let (mut open, mut rest) = (u_lobe.le(u_lobe), u_lobe);
        for (i, (term, &probability)) in self.terms().iter().zip(&choice.0).enumerate() {
            let is_last = i + 1 == self.terms().len();
            let chosen = if is_last { open } else { open & rest.lt(probability) };
            if chosen.bits() != 0 {
                let within = (rest / probability).min(one(ONE_MINUS_EPSILON));
                wi = Vectors::select(chosen, term.lobe.sample_lanes(wo, within, u), wi);
            }
            open = open & probability.le(rest);
            rest = rest - probability;
        }
        wi
    }
}

impl Brdf for Bsdf {
    #[inline(always)]
    fn eval_lanes<F: SimdFloat>(&self, wo: Vectors<F>, wi: Vectors<F>) -> (Colors<F>, F) {
        self.eval_chosen(&self.choice(wi.z), wo, wi)
    }

    #[inline(always)]
    fn sample_lanes<F: SimdFloat>(&self, wo: Vectors<F>, u_lobe: F, u: [F; 2]) -> Vectors<F> {
        self.sample_chosen(&self.choice(wo.z), wo, u_lobe, u)
    }

    /// The sum of the lobes' bounds.
    fn max_eval(&self, wo: Vec3) -> f32 {
        self.terms().iter().map(|t| t.weight * t.lobe.max_eval(wo)).sum()
    }

    fn directional_albedo(&self, cos_theta_o: f32) -> Rgb {
        self.terms().iter().map(|t| t.weight * t.lobe.directional_albedo(cos_theta_o)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::test_support::{check_bound, check_lobe, toward};
    use crate::bsdf::{Fresnel, Masking, WardForm};
    use crate::math::vec2;
    use crate::simd::{self, InstructionSet, Kernel, LANES, Simd};

    fn glossy(f0: f32) -> Lobe {
        Ggx::new([0.1; 2], Fresnel::Schlick { f0: Rgb::splat(f0) }, Masking::Correlated).into()
    }

    fn three() -> Bsdf {
        let ward = Ward::new(Rgb::splat(0.2), [0.15, 0.5], WardForm::default());
        let phong = Phong::new(Rgb::new(0.1, 0.2, 0.3), 50.0);
        Bsdf::new(&[Lambert::new(Rgb::splat(0.3)).into(), ward.into(), phong.into()]).unwrap()
    }

    #[test]
    fn is_small() {
        assert_eq!(size_of::<Lobe>(), 56);
        assert_eq!(size_of::<Bsdf>(), 196);
    }

    #[test]
    fn obeys_the_laws() {
        check_lobe(&three());
        check_bound(&three(), 3.0);
    }

    /// A coat over sheen over a base: each takes from those below.
    #[test]
    fn layers_take_from_those_below() {
        let base = MetallicRoughness::new(Rgb::new(0.8, 0.5, 0.2), 0.0, 0.5);
        let (sheen, coat) = (Sheen::new(Rgb::new(0.5, 1.0, 0.0), 0.4), Coat::new(0.1, Vec3::Z));
        let (wo, wi) = (toward(60.0, 0.3), toward(40.0, 2.5));
        let layered = Bsdf::layered(base, Some(sheen), Some((0.5, coat)), wo);
        let reflected = 0.5 * (0.04 + 0.96 * 0.5f32.powi(5));
        let below = 1.0 - reflected;
        let kept = 1.0 - sheen.directional_albedo(wo.z).max_component();
        let expected =
            base.eval(wo, wi) * kept * below + sheen.eval(wo, wi) * below + coat.eval(wo, wi) * 0.5;
        let difference = (layered.eval(wo, wi) - expected).map(f32::abs).max_component();
        assert!(difference < 1e-5, "{difference}");
        assert_eq!(Bsdf::layered(base, None, None, wo), Bsdf::single(base));
        assert_eq!(Bsdf::layered(base, None, Some((f32::NAN, coat)), wo), Bsdf::single(base));
    }

    #[test]
    fn is_the_weighted_sum_of_its_lobes() {
        let (a, b) = (Lobe::from(Lambert::new(Rgb::splat(0.5))), glossy(0.5));
        let mix = Bsdf::weighted(&[(0.5, a), (0.25, b)]).unwrap();
        let (wo, wi) = (toward(40.0, 0.0), toward(35.0, 3.0));
        let expected = a.eval(wo, wi) * 0.5 + b.eval(wo, wi) * 0.25;
        assert!((mix.eval(wo, wi) - expected).max_component().abs() < 1e-6);
    }

    struct SideBySide<'a> {
        bsdf: &'a Bsdf,
        wo: Vec3,
        wi: [Vec3; LANES],
    }

    impl Kernel for SideBySide<'_> {
        type Output = [(Rgb, f32); LANES];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let [x, y, z] = [0, 1, 2].map(|c| simd.load(&self.wi.map(|w| w[c])));
            let (value, pdf) =
                self.bsdf.eval_lanes(Vectors::splat(x, self.wo), Vectors { x, y, z });
            let ([r, g, b], pdf) =
                (value.0.map(simd::SimdF32x8::store), simd::SimdF32x8::store(pdf));
            std::array::from_fn(|i| (Rgb::new(r[i], g[i], b[i]), pdf[i]))
        }
    }

    struct DrawnSideBySide<'a> {
        bsdf: &'a Bsdf,
        wo: Vec3,
        u: [[f32; LANES]; 3],
    }

    impl Kernel for DrawnSideBySide<'_> {
        type Output = [[f32; LANES]; 3];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Output {
            let [u_lobe, u, v] = self.u.each_ref().map(|u| simd.load(u));
            let wo = Vectors::splat(u, self.wo);
            self.bsdf.sample_lanes(wo, u_lobe, [u, v]).store()
        }
    }

    /// Lanes of all lobes at once are what each is alone, bit for bit.
    #[test]
    fn lanes_are_samples_side_by_side() {
        let beckmann = Beckmann::new([0.2, 0.3], Fresnel::One, Masking::Correlated);
        let gltf = MetallicRoughness::new(Rgb::new(0.5, 0.3, 0.1), 0.3, 0.4);
        let lobes = [beckmann.into(), gltf.into(), glossy(0.5)];
        for bsdf in [three(), Bsdf::new(&lobes).unwrap(), Bsdf::single(gltf)] {
            for view in [0.0, 50.0, 89.0] {
                let wo = toward(view, 0.3);
                let number = |i: usize, step: f32| (0.1 + step * i as f32).fract();
                let u = [0.137, 0.618, 0.755].map(|step| std::array::from_fn(|i| number(i, step)));
                let alone = |i: usize| -> Vec3 {
                    bsdf.sample_lanes(wo.into(), u[0][i], [u[1][i], u[2][i]]).into()
                };
                for set in InstructionSet::ALL {
                    let draw = DrawnSideBySide { bsdf: &bsdf, wo, u };
                    let drawn = simd::dispatch(set, draw);
                    let drawn: [Vec3; LANES] = std::array::from_fn(|i| drawn.map(|c| c[i]).into());
                    assert_eq!(drawn, std::array::from_fn(alone), "{set:?}");
                }
            }
        }
    }

    #[test]
    fn lanes_are_directions_side_by_side() {
        let lambert = Lobe::from(Lambert::new(Rgb::new(0.5, 0.3, 0.1)));
        let gltf = MetallicRoughness::new(Rgb::new(0.5, 0.3, 0.1), 0.3, 0.4);
        let silver = Fresnel::Conductor(crate::bsdf::Conductor::SILVER);
        let metal = Ggx::new([0.1, 0.3], silver, Masking::Separable);
        let materials = [three(), Bsdf::single(gltf), Bsdf::new(&[lambert, metal.into()]).unwrap()];
        for bsdf in materials {
            for view in [0.0, 50.0, 89.0] {
                let wi = std::array::from_fn(|i| toward(18.0 * i as f32, 0.5 * i as f32));
                let wo = toward(view, 0.3);
                let expected = wi.map(|wi| bsdf.eval_pdf(wo, wi));
                for set in InstructionSet::ALL {
                    let values = simd::dispatch(set, SideBySide { bsdf: &bsdf, wo, wi });
                    assert_eq!(values, expected, "{set:?}");
                }
            }
        }
    }

    #[test]
    fn one_lobe_is_that_lobe() {
        let bsdf = Bsdf::single(Lambert::new(Rgb::splat(0.5)));
        let (wo, u) = (toward(50.0, 1.0), vec2(0.3, 0.8));
        let lobe = Lambert::new(Rgb::splat(0.5));
        assert_eq!(bsdf.sample(wo, 0.7, u), lobe.sample(wo, 0.7, u));
    }

    #[test]
    fn black_lobes_are_dropped_and_black_materials_have_no_samples() {
        let black = Lobe::from(Lambert::new(Rgb::BLACK));
        let bsdf = Bsdf::new(&[black, black, glossy(0.0), black, black]).unwrap();
        assert_eq!(bsdf.lobes().count(), 1);
        let nothing = Bsdf::new(&[black]).unwrap();
        assert_eq!(nothing, Bsdf::BLACK);
        let (wo, wi) = (toward(50.0, 1.0), toward(10.0, 0.0));
        assert!(nothing.sample(wo, 0.7, vec2(0.3, 0.8)).is_none());
        assert_eq!((nothing.eval(wo, wi), nothing.max_eval(wo)), (Rgb::BLACK, 0.0));
    }

    #[test]
    fn a_fourth_lobe_is_refused() {
        let error = Bsdf::new(&[glossy(0.5); 4]).unwrap_err();
        assert_eq!(error, TooManyLobes { count: 4 });
    }

    /// The share of samples drawn from the glossy lobe follows the Fresnel reflectance.
    #[test]
    fn a_view_refines_the_choice() {
        let bsdf = Bsdf::new(&[Lambert::new(Rgb::splat(0.5)).into(), glossy(0.04)]).unwrap();
        let share = |degrees: f32| {
            let refined = bsdf.for_view(toward(degrees, 0.0));
            let shares: Vec<f32> = refined.terms().iter().map(|t| t.probability).collect();
            assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            shares[1]
        };
        assert!(share(0.0) < 0.15 && share(88.0) > 0.5, "{} {}", share(0.0), share(88.0));
        check_lobe(&bsdf.for_view(toward(80.0, 0.0)));
    }

    /// Every value is covered by the density: no lobe has a probability of zero.
    #[test]
    fn lobes_that_look_black_head_on_are_still_sampled() {
        let bsdf = Bsdf::new(&[Lambert::new(Rgb::splat(0.5)).into(), glossy(0.0)]).unwrap();
        let refined = bsdf.for_view(Vec3::Z);
        assert!(refined.terms().iter().all(|t| t.probability > 0.0));
    }
}
