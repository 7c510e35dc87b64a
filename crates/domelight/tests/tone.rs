//! Tone curves against the programs that their users know.

#![cfg(feature = "io")]

use domelight::Rgb;
use domelight::picture::tone::{ToneCurve, ToneMapping, linear_from_srgb};

/// The sRGB values that X-Rite publishes for the ColorChecker Classic (after November 2014).
const PATCHES: [[u8; 3]; 24] = [
    [115, 82, 68],
    [194, 150, 130],
    [98, 122, 157],
    [87, 108, 67],
    [133, 128, 177],
    [103, 189, 170],
    [214, 126, 44],
    [80, 91, 166],
    [193, 90, 99],
    [94, 60, 108],
    [157, 188, 64],
    [224, 163, 46],
    [56, 61, 150],
    [70, 148, 73],
    [175, 54, 60],
    [231, 199, 31],
    [187, 86, 149],
    [8, 133, 161],
    [243, 243, 242],
    [200, 200, 200],
    [160, 160, 160],
    [122, 122, 121],
    [85, 85, 85],
    [52, 52, 52],
];

/// What Blender 5.0.1's view AgX, look None, shows of the patches at an exposure \[stops\]: sRGB of 16 bits, as
/// `checks/interop/agx.py` prints it.
const BLENDER: [(f32, [[u16; 3]; 24]); 3] = [
    (
        -4.0,
        [
            [4882, 2392, 1477],
            [11377, 7861, 6221],
            [3621, 5894, 8408],
            [2935, 4212, 1419],
            [6407, 6582, 10067],
            [4060, 10930, 9554],
            [12744, 5861, 32],
            [2014, 3959, 9099],
            [10984, 3285, 3676],
            [3216, 1423, 4439],
            [8745, 10409, 290],
            [13719, 8736, 73],
            [537, 1966, 7739],
            [2009, 7203, 1698],
            [9383, 853, 888],
            [14581, 11542, 8],
            [10496, 3497, 7788],
            [0, 6722, 8696],
            [15956, 15948, 15868],
            [12154, 12154, 12156],
            [8754, 8754, 8755],
            [5623, 5616, 5543],
            [2668, 2668, 2668],
            [731, 731, 731],
        ],
    ),
    (
        0.0,
        [
            [29158, 20107, 16216],
            [44908, 37361, 33877],
            [25467, 32081, 39241],
            [22114, 26679, 15974],
            [33814, 34164, 42512],
            [31485, 43625, 41044],
            [49163, 31336, 14004],
            [19813, 25640, 41346],
            [46183, 24849, 25777],
            [23097, 15908, 27543],
            [38983, 42762, 20179],
            [49579, 38086, 18418],
            [11715, 18343, 38310],
            [19818, 36200, 18256],
            [43650, 14240, 14093],
            [49639, 43437, 21086],
            [44677, 25859, 37224],
            [8253, 34160, 40125],
            [49518, 49510, 49435],
            [45190, 45190, 45191],
            [39378, 39378, 39380],
            [31356, 31332, 31102],
            [21114, 21114, 21116],
            [11751, 11751, 11752],
        ],
    ),
    (
        3.0,
        [
            [53905, 46694, 43657],
            [60651, 56991, 55452],
            [51405, 54352, 58072],
            [48296, 51610, 43760],
            [55347, 55489, 59501],
            [54619, 59963, 58691],
            [63635, 53560, 46656],
            [47978, 50672, 59591],
            [62153, 51013, 51329],
            [49076, 43005, 52664],
            [57647, 59595, 49621],
            [63202, 57032, 49163],
            [41237, 44778, 59113],
            [48159, 56784, 46984],
            [62804, 44352, 43770],
            [62973, 59646, 50539],
            [61125, 51605, 56909],
            [44994, 55353, 58756],
            [62574, 62570, 62538],
            [60611, 60611, 60612],
            [57950, 57950, 57951],
            [54054, 54041, 53930],
            [47559, 47559, 47561],
            [36170, 36170, 36172],
        ],
    ),
];

#[test]
fn agx_is_blenders() {
    let mut worst = 0.0f64;
    for (exposure, shown) in BLENDER {
        let tone = ToneMapping { exposure, curve: ToneCurve::Agx };
        for (patch, blender) in PATCHES.iter().zip(shown) {
            let [r, g, b] = patch.map(|c| linear_from_srgb(f32::from(c) / 255.0));
            let ours = tone.apply(Rgb::new(r, g, b)).to_array();
            let theirs = blender.map(|c| linear_from_srgb(f32::from(c) / 65535.0));
            let difference = delta_e(lab(ours), lab(theirs));
            assert!(difference < 0.5, "{patch:?} at {exposure:+} EV: ΔE2000 {difference:.2}");
            worst = worst.max(difference);
        }
    }
    // Blender interpolates in a table of 57³ values.
    assert!(worst > 0.01, "{worst}");
}

#[test]
fn agx_keeps_grays_and_shows_the_strongest_lights_as_colors() {
    let mut last = Rgb::BLACK;
    for quarter in -39..=26i16 {
        let light = 0.18 * f32::exp2(f32::from(quarter) / 4.0);
        let gray = ToneCurve::Agx.apply(Rgb::splat(light));
        assert!(gray.max_component() - gray.min_component() < 1e-5, "{light}: {gray:?}");
        assert!(gray.g > last.g, "{light}: {gray:?}");
        last = gray;
    }
    for light in [Rgb::new(1.0, 0.0, 0.0), Rgb::new(0.0, 1.0, 0.0), Rgb::new(0.0, 0.0, 1.0)] {
        let brightest = light.max_component();
        for stops in -8..12i16 {
            let shown = ToneCurve::Agx.apply(light * f32::exp2(f32::from(stops)));
            for (of_light, c) in light.to_array().into_iter().zip(shown.to_array()) {
                let is_brightest = of_light == brightest;
                assert!(!is_brightest || c > shown.max_component() - 1e-6, "{light:?}: {shown:?}");
            }
        }
    }
}

#[test]
fn delta_e_is_that_of_its_authors() {
    // Sharma, Wu, Dalal 2005: pairs 1, 7, 13, 17 and 25 of their table.
    let pairs = [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, -0.001, 2.49], [50.0, 0.0011, -2.49], 4.7461),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
    ];
    for (a, b, expected) in pairs {
        let found = delta_e(a, b);
        assert!((found - expected).abs() < 5e-5, "{a:?} {b:?}: {found}");
        assert!((delta_e(b, a) - expected).abs() < 5e-5);
    }
}

/// CIELAB under D65 of linear Rec. 709.
fn lab(rgb: [f32; 3]) -> [f64; 3] {
    const TO_XYZ: [[f64; 3]; 3] =
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
    let [x, y, z] = TO_XYZ.map(|row| {
        let sum: f64 = row.iter().zip(rgb).map(|(k, c)| k * f64::from(c)).sum();
        let t = sum / row.iter().sum::<f64>();
        let linear_part: f64 = 6.0 / 29.0;
        if t > linear_part.powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * linear_part.powi(2)) + 4.0 / 29.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIEDE2000, after Sharma, Wu, Dalal 2005.
fn delta_e([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
    let of_chroma = |c: f64| (c.powi(7) / (c.powi(7) + 25.0f64.powi(7))).sqrt();
    let g = 0.5 * (1.0 - of_chroma(0.5 * (a1.hypot(b1) + a2.hypot(b2))));
    let polar = |a: f64, b: f64| {
        let a = a * (1.0 + g);
        (a.hypot(b), b.atan2(a).to_degrees().rem_euclid(360.0))
    };
    let ((c1, h1), (c2, h2)) = (polar(a1, b1), polar(a2, b2));
    let is_gray = c1 * c2 == 0.0;
    let turn = if is_gray { 0.0 } else { (h2 - h1 + 180.0).rem_euclid(360.0) - 180.0 };
    let hue_difference = 2.0 * (c1 * c2).sqrt() * (0.5 * turn).to_radians().sin();
    let hue = if is_gray { h1 + h2 } else { h1 + 0.5 * turn };
    let (lightness, chroma) = (0.5 * (l1 + l2), 0.5 * (c1 + c2));
    let cos = |k: f64, offset: f64| (k * hue + offset).to_radians().cos();
    let t = 1.0 - 0.17 * cos(1.0, -30.0) + 0.24 * cos(2.0, 0.0) + 0.32 * cos(3.0, 6.0)
        - 0.20 * cos(4.0, -63.0);
    let off_middle = (lightness - 50.0).powi(2);
    let of_lightness = (l2 - l1) / (1.0 + 0.015 * off_middle / (20.0 + off_middle).sqrt());
    let of_chroma_difference = (c2 - c1) / (1.0 + 0.045 * chroma);
    let of_hue = hue_difference / (1.0 + 0.015 * chroma * t);
    let blue = 30.0 * (-((hue.rem_euclid(360.0) - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * of_chroma(chroma) * (2.0 * blue).to_radians().sin();
    let sum = of_lightness.powi(2)
        + of_chroma_difference.powi(2)
        + of_hue.powi(2)
        + rotation * of_chroma_difference * of_hue;
    sum.max(0.0).sqrt()
}
