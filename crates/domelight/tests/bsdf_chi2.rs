//! Every lobe draws from the density that it claims, from the normal to grazing angles.

use domelight::Rgb;
use domelight::bsdf::{
    Beckmann, Brdf, Bsdf, Coat, Conductor, Fresnel, Ggx, Lambert, Lobe, Masking, MetallicRoughness,
    Phong, Sheen, Ward, WardForm,
};
use domelight::math::{Vec2, Vec3, from_spherical, vec3};
use testkit::quadrature::Adaptive;
use testkit::{Chi2, Suite};

const ANGLES: [f32; 5] = [0.0, 30.0, 60.0, 75.0, 85.0];

/// More than the tests of this file, which share one probability of a false alarm.
const SUITE: usize = 250;

/// How closely the cells look: rings and sectors about the mirror direction, where narrow lobes have
/// their peak.
const WIDE: Chi2 = Chi2 {
    samples: 100_000,
    cells: [91, 31],
    axis: [0.0, 0.0, 1.0],
    quadrature: Adaptive { tolerance: 3e-7, min_depth: 0, max_depth: 7 },
    mass_tolerance: 1e-4,
    min_expected: 5.0,
    seed: 100,
    suite: Suite { tests: SUITE, significance: 0.01 },
    save_tables: true,
};

/// Runs the χ² test of a lobe at all angles.
fn check(name: &str, brdf: &impl Brdf) {
    for (i, degrees) in ANGLES.into_iter().enumerate() {
        check_at(name, brdf, degrees, Chi2 { seed: 100 + i as u64, ..WIDE });
    }
}

fn check_at(name: &str, brdf: &impl Brdf, degrees: f32, test: Chi2) {
    let wo = from_spherical(degrees.to_radians().cos(), 0.3 + 0.02 * degrees);
    let test = Chi2 { axis: [-wo.x, -wo.y, wo.z], ..test };
    let sampler =
        |u: [f32; 2], u_lobe: f32| brdf.sample(wo, u_lobe, Vec2::from(u)).map(|s| s.wi.to_array());
    let pdf = |w: [f32; 3]| f64::from(brdf.pdf(wo, Vec3::from(w)));
    test.sphere(&format!("{name} at {degrees}°"), sampler, pdf).unwrap();
}

#[test]
fn lambert() {
    check("lambert", &Lambert::new(Rgb::splat(0.5)));
}

#[test]
fn phong() {
    for n in [1.0, 10.0, 200.0, 2000.0] {
        check(&format!("phong {n}"), &Phong::new(Rgb::WHITE, n));
    }
}

#[test]
fn ward() {
    // The forms share one sampler and one density.
    for alpha in [[0.05, 0.05], [0.15, 0.5], [0.5, 0.1], [0.4, 0.4]] {
        check(&format!("ward {alpha:?}"), &Ward::new(Rgb::WHITE, alpha, WardForm::default()));
    }
}

#[test]
fn ggx() {
    // Masking and the Fresnel factor do not enter the density.
    for alpha in [[0.05, 0.05], [0.1, 0.5], [0.3, 0.3], [0.6, 0.05], [1.0, 1.0]] {
        check(&format!("ggx {alpha:?}"), &Ggx::new(alpha, Fresnel::One, Masking::Correlated));
    }
}

#[test]
fn beckmann() {
    for alpha in [[0.05, 0.05], [0.1, 0.5], [0.3, 0.3], [1.0, 1.0]] {
        check(
            &format!("beckmann {alpha:?}"),
            &Beckmann::new(alpha, Fresnel::One, Masking::Separable),
        );
    }
}

#[test]
fn metallic_roughness() {
    let base = Rgb::new(0.9, 0.5, 0.2);
    for (metallic, roughness) in [(0.0, 0.25), (0.0, 0.8), (0.5, 0.4), (1.0, 0.25)] {
        let lobe = MetallicRoughness::new(base, metallic, roughness);
        check(&format!("metallic {metallic} rough {roughness}"), &lobe);
    }
}

#[test]
fn metallic_roughness_with_extensions() {
    let base = Rgb::new(0.9, 0.5, 0.2);
    for (strength, f0) in [(0.0, 0.04), (0.5, 0.3), (1.0, 0.0)] {
        let f0 = Rgb::new(f0, 2.0 * f0, 0.0);
        let lobe = MetallicRoughness::with_specular(base, 0.0, 0.4, f0, strength);
        check(&format!("strength {strength} f0 {f0:?}"), &lobe);
    }
    let brushed = MetallicRoughness::new(base, 0.5, 0.3).anisotropic(0.7);
    check("anisotropic", &brushed);
}

#[test]
fn layers() {
    for roughness in [0.1, 0.4, 1.0] {
        check(&format!("sheen {roughness}"), &Sheen::new(Rgb::WHITE, roughness));
    }
    let leaning = vec3(0.3, -0.2, 0.9);
    for alpha in [0.05, 0.4] {
        check(&format!("coat {alpha}"), &Coat::new(alpha, Vec3::Z));
        // More oblique views are below the coat.
        for degrees in [0.0, 30.0, 60.0] {
            check_at("leaning coat", &Coat::new(alpha, leaning), degrees, WIDE);
        }
    }
    let base = MetallicRoughness::new(Rgb::new(0.8, 0.3, 0.1), 0.2, 0.6).anisotropic(0.5);
    let (sheen, coat) = (Sheen::new(Rgb::new(0.2, 0.5, 1.0), 0.3), Coat::new(0.05, leaning));
    let layered = Bsdf::layered(base, Some(sheen), Some((0.8, coat)), from_spherical(0.5, 0.0));
    check("coat over sheen over a base", &layered);
}

/// Rings of two thousandths of a radian resolve lobes a few of them wide.
#[test]
fn narrow_lobes() {
    let narrow: [(&str, Lobe); 4] = [
        ("ggx", Ggx::new([0.005; 2], Fresnel::One, Masking::Correlated).into()),
        ("ward", Ward::new(Rgb::WHITE, [0.004, 0.008], WardForm::default()).into()),
        ("beckmann", Beckmann::new([0.005; 2], Fresnel::One, Masking::Correlated).into()),
        ("phong", Phong::new(Rgb::WHITE, 20_000.0).into()),
    ];
    let quadrature = Adaptive { min_depth: 1, ..WIDE.quadrature };
    for (name, lobe) in narrow {
        for degrees in [0.0, 60.0] {
            let test = Chi2 { cells: [1501, 5], quadrature, ..WIDE };
            check_at(&format!("narrow {name}"), &lobe, degrees, test);
        }
    }
}

#[test]
fn mixtures() {
    let three: [Lobe; 3] = [
        Lambert::new(Rgb::new(0.3, 0.2, 0.1)).into(),
        Phong::new(Rgb::splat(0.2), 50.0).into(),
        Ggx::new([0.05; 2], Fresnel::Conductor(Conductor::GOLD), Masking::Correlated).into(),
    ];
    check("three lobes", &Bsdf::new(&three).unwrap());
    let refined = Bsdf::new(&three).unwrap().for_view(from_spherical(0.2, 0.0));
    check("three lobes for a view", &refined);
    check("mix", &"mix".parse::<Bsdf>().unwrap());
    let coupled: [Lobe; 2] = [
        MetallicRoughness::new(Rgb::splat(0.8), 0.0, 0.3).into(),
        Ward::new(Rgb::splat(0.1), [0.1, 0.3], WardForm::default()).into(),
    ];
    check("a mixture of a mixture", &Bsdf::new(&coupled).unwrap());
}
