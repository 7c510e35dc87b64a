//! Mappings between pictures and directions: inverses, Jacobians, conversion.

use domelight::environment::mapping::{
    CubeLayout, EnvmapKind, Mapping, from_lat_long, to_lat_long,
};
use domelight::math::{PI, Vec3, vec2, vec3};
use domelight::{Rgb, RgbImage};
use testkit::Chi2;

/// Directions spread evenly over the sphere (a Fibonacci lattice).
fn directions(n: usize) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f32 / n as f32;
        let phi = i as f32 * 2.399_963_2;
        let r = (1.0 - y * y).sqrt();
        vec3(r * phi.cos(), y, r * phi.sin())
    })
}

#[test]
fn directions_round_trip_through_every_mapping() {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for mapping in Mapping::ALL {
        for d in directions(5000).chain(axes) {
            let uv = mapping.uv(d);
            let inside = uv.cmpge(vec2(0.0, 0.0)).all() && uv.cmple(vec2(1.0, 1.0)).all();
            assert!(inside, "{mapping} {d} {uv}");
            // Where a disc's border is one direction, rounding may put it just outside.
            let Some(again) = mapping.direction(uv) else {
                assert!(d.z > 0.999, "{mapping} {d} {uv}");
                continue;
            };
            // In a mirror ball a step of the radius turns the direction by 2 / cos(θ/2) of it.
            let stretch = 1.0 / (0.5 * (1.0 - d.z)).sqrt().max(1e-3);
            let tolerance =
                if mapping == Mapping::MirrorBall { 1e-6 * (1.0 + stretch) } else { 2e-6 };
            assert!((again - d).length() < tolerance, "{mapping} {d} {again}");
            assert!((again.length() - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn picture_coordinates_round_trip_through_every_mapping() {
    for mapping in Mapping::ALL {
        let n = 97;
        for i in 0..n * n {
            // No point on the border of two faces.
            let uv = vec2((i % n) as f32 + 0.48, (i / n) as f32 + 0.53) / n as f32;
            match mapping.direction(uv) {
                None => assert_eq!(mapping.solid_angle_density(uv), 0.0),
                Some(d) => {
                    let again = mapping.uv(d);
                    assert!((again - uv).length() < 1e-5, "{mapping} {uv} {again}");
                }
            }
        }
    }
}

#[test]
fn jacobians_are_those_of_the_mappings() {
    for mapping in Mapping::ALL {
        let (n, mut total) = (800, 0.0f64);
        for i in 0..n * n {
            let uv = vec2((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
            total += f64::from(mapping.solid_angle_density(uv)) / (n * n) as f64;
        }
        // The discs' borders are resolved to a cell of the grid.
        let sphere = 4.0 * std::f64::consts::PI;
        assert!((total / sphere - 1.0).abs() < 1e-3, "{mapping}: {total}");
        // Against the cross product of finite differences.
        for d in directions(300) {
            let (uv, h) = (mapping.uv(d), 2e-3);
            let at = |du: f32, dv: f32| mapping.direction(uv + vec2(du, dv));
            let around = (at(h, 0.0), at(-h, 0.0), at(0.0, h), at(0.0, -h));
            let (Some(e), Some(w), Some(s), Some(n)) = around else { continue };
            let steps = [e, w, s, n].map(|other| (other - d).length());
            let difference = (e - w).cross(s - n).length() / (4.0 * h * h);
            let density = mapping.solid_angle_density(uv);
            // Across seams and folds, and where the mirror ball is singular, differences tell nothing.
            let regular = steps.iter().all(|&step| step < 0.05) && d.y.abs() < 0.95 && d.z < 0.9;
            let fold = mapping == Mapping::Octahedral && d.abs().min_element() < 0.05;
            let face_edge =
                mapping.name().starts_with("cross") || mapping.name().starts_with("strip");
            let middle = d.abs().max_element() > 0.75;
            if regular && !fold && (!face_edge || middle) {
                assert!(
                    (difference / density - 1.0).abs() < 0.02,
                    "{mapping} {d}: {difference} {density}"
                );
            }
        }
    }
}

#[test]
fn conventions() {
    let at = |mapping: Mapping, u: f32, v: f32| mapping.direction(vec2(u, v)).unwrap();
    let is = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-5, "{a} is not {b}");
    is(at(Mapping::LatLong, 0.5, 0.5), Vec3::NEG_Z);
    is(at(Mapping::LatLong, 0.75, 0.5), Vec3::X);
    is(at(Mapping::LatLong, 0.3, 0.0), Vec3::Y);
    // OpenEXR: longitude 0 in the middle is +Z, longitude +π/2, a quarter from the left, +X.
    is(at(Mapping::LatLongExr, 0.5, 0.5), Vec3::Z);
    is(at(Mapping::LatLongExr, 0.25, 0.5), Vec3::X);
    // Debevec's probe: forward, right at half the radius, up.
    is(at(Mapping::Angular, 0.5, 0.5), Vec3::NEG_Z);
    is(at(Mapping::Angular, 0.75, 0.5), Vec3::X);
    is(at(Mapping::Angular, 0.5, 0.25), Vec3::Y);
    // The ball's center reflects the camera; what is right of the camera, which looks along +Z, is −X.
    is(at(Mapping::MirrorBall, 0.5, 0.5), Vec3::NEG_Z);
    is(at(Mapping::MirrorBall, 0.5 + 0.5 * 0.5f32.sqrt(), 0.5), Vec3::NEG_X);
    is(at(Mapping::MirrorBall, 0.5, 0.5 - 0.5 * 0.5f32.sqrt()), Vec3::Y);
    // HDRShop's vertical cross.
    is(at(Mapping::Cube(CubeLayout::CrossVertical), 0.5, 0.125), Vec3::Y);
    is(at(Mapping::Cube(CubeLayout::CrossVertical), 0.5, 0.375), Vec3::NEG_Z);
    is(at(Mapping::Cube(CubeLayout::CrossVertical), 5.0 / 6.0, 0.375), Vec3::X);
    is(at(Mapping::Cube(CubeLayout::CrossVertical), 0.5, 0.875), Vec3::Z);
    is(at(Mapping::Cube(CubeLayout::CrossHorizontal), 0.875, 0.5), Vec3::Z);
    // pbrt: the axis in the middle, the opposite one in the corners.
    is(at(Mapping::Octahedral, 0.5, 0.5), Vec3::Y);
    is(at(Mapping::Octahedral, 0.0, 1.0), Vec3::NEG_Y);
}

/// The corners of OpenEXR's cube (`ImfEnvmap.h`) in the corners of its faces.
#[test]
fn cube_strips_are_openexr_cube_maps() {
    let corner = |i: i32| {
        vec3(
            if i & 1 == 0 { -1.0 } else { 1.0 },
            if i & 2 == 0 { -1.0 } else { 1.0 },
            if i & 4 == 0 { -1.0 } else { 1.0 },
        )
    };
    let faces =
        [[3, 7, 1, 5], [6, 2, 4, 0], [6, 7, 2, 3], [0, 1, 4, 5], [7, 6, 5, 4], [2, 3, 0, 1]];
    for (f, corners) in faces.iter().enumerate() {
        for (c, &label) in corners.iter().enumerate() {
            let e = 1e-4;
            let s = if c % 2 == 0 { e } else { 1.0 - e };
            let t = if c / 2 == 0 { e } else { 1.0 - e };
            let expected = corner(label).normalize();
            let strip = (f as f32 + t) / 6.0;
            let vertical =
                Mapping::Cube(CubeLayout::StripVertical).direction(vec2(s, strip)).unwrap();
            assert!(
                (vertical - expected).length() < 1e-3,
                "face {f} corner {c}: {vertical} {expected}"
            );
            let strip = (f as f32 + s) / 6.0;
            let horizontal =
                Mapping::Cube(CubeLayout::StripHorizontal).direction(vec2(strip, t)).unwrap();
            assert!((horizontal - expected).length() < 1e-3);
        }
    }
}

/// Neighboring texels of a cross that share an edge look in neighboring directions.
#[test]
fn crosses_have_no_seams_inside() {
    for mapping in
        [Mapping::Cube(CubeLayout::CrossHorizontal), Mapping::Cube(CubeLayout::CrossVertical)]
    {
        let n = 240;
        let at =
            |x: usize, y: usize| mapping.direction(vec2(x as f32 + 0.5, y as f32 + 0.5) / n as f32);
        for i in 0..n * n {
            let (x, y) = (i % n, i / n);
            let Some(d) = at(x, y) else { continue };
            for other in [at(x + 1, y), at(x, y + 1)].into_iter().flatten() {
                assert!((other - d).length() < 0.05, "{mapping} at {x} {y}");
            }
        }
    }
}

#[test]
fn mappings_are_guessed_from_shape_and_attribute() {
    let guesses = [
        ((1024, 512), None, Mapping::LatLong),
        ((1000, 499), None, Mapping::LatLong),
        ((1, 1), None, Mapping::LatLong),
        ((480, 480), None, Mapping::Angular),
        ((400, 300), None, Mapping::Cube(CubeLayout::CrossHorizontal)),
        ((300, 400), None, Mapping::Cube(CubeLayout::CrossVertical)),
        ((600, 100), None, Mapping::Cube(CubeLayout::StripHorizontal)),
        ((100, 600), None, Mapping::Cube(CubeLayout::StripVertical)),
        ((100, 600), Some(EnvmapKind::Cube), Mapping::Cube(CubeLayout::StripVertical)),
        ((400, 300), Some(EnvmapKind::Cube), Mapping::Cube(CubeLayout::CrossHorizontal)),
        ((1024, 512), Some(EnvmapKind::LatLong), Mapping::LatLongExr),
    ];
    for ((width, height), envmap, expected) in guesses {
        assert_eq!(Mapping::guess(width, height, envmap), expected, "{width}x{height}");
    }
    assert!(Mapping::Angular.check_shape(10, 11).is_err());
    assert_eq!(
        Mapping::Cube(CubeLayout::StripVertical).check_shape(7, 41).unwrap_err().to_string(),
        "strip-vertical maps have width : height = 1:6, this picture is 7x41"
    );
    for mapping in Mapping::ALL {
        assert_eq!(mapping.name().parse(), Ok(mapping));
        let (width, height) = mapping.size_for(64);
        assert!(mapping.check_shape(width, height).is_ok(), "{mapping}");
        assert!(mapping.lat_long_height(width, height) >= 64, "{mapping}");
    }
}

/// A smooth radiance without symmetry.
fn radiance(d: Vec3) -> Rgb {
    let bump = |axis: Vec3, k: f32| (k * (d.dot(axis.normalize()) - 1.0)).exp();
    Rgb::new(
        1.0 + d.x + 0.3 * d.y,
        bump(vec3(1.0, 2.0, -0.5), 3.0),
        1.0 + bump(vec3(-1.0, -0.3, 0.7), 5.0),
    )
}

fn lat_long_of(f: impl Fn(Vec3) -> Rgb, height: usize) -> RgbImage {
    RgbImage::from_fn(2 * height, height, |x, y| {
        let uv = vec2((x as f32 + 0.5) / (2 * height) as f32, (y as f32 + 0.5) / height as f32);
        f(Mapping::LatLong.direction(uv).unwrap())
    })
}

/// ∫ L dω over a lat-long map with exact texel solid angles.
fn energy(image: &RgbImage) -> [f64; 3] {
    let ring = |y: usize| (std::f64::consts::PI * y as f64 / image.height as f64).cos();
    let mut sum = [0.0; 3];
    for y in 0..image.height {
        let texel = (ring(y) - ring(y + 1)) * std::f64::consts::TAU / image.width as f64;
        for pixel in image.row(y) {
            for (sum, value) in sum.iter_mut().zip(pixel.to_array()) {
                *sum += f64::from(value) * texel;
            }
        }
    }
    sum
}

#[test]
fn conversion_there_and_back_keeps_the_picture() {
    let map = lat_long_of(radiance, 64);
    for mapping in Mapping::ALL {
        let picture = from_lat_long(&map, mapping, mapping.size_for(64));
        let back = to_lat_long(&picture, mapping, 64);
        let greatest = map
            .pixels
            .iter()
            .zip(&back.pixels)
            .map(|(a, b)| (*a - *b).map(f32::abs).max_component());
        // A texel or two of a function whose steepest slope is below 3 per radian.
        let greatest = greatest.fold(0.0, f32::max);
        assert!(greatest < 3.0 * 2.0 * PI / 64.0, "{mapping}: {greatest}");
        for (a, b) in energy(&map).into_iter().zip(energy(&back)) {
            assert!((a / b - 1.0).abs() < 2e-3, "{mapping}: {a} {b}");
        }
    }
}

#[test]
fn a_small_sun_keeps_its_energy() {
    // A sun of 1.8° radius, about a texel, and 10⁴ times the sky.
    for mapping in Mapping::ALL {
        for sun in [vec3(0.3, 0.8, -0.4), vec3(-0.7, 0.1, 0.6)] {
            let is_sun = |d: Vec3| d.dot(sun.normalize()) > 0.9995;
            let sky = lat_long_of(|d| Rgb::splat(if is_sun(d) { 1e4 } else { 1.0 }), 128);
            let picture = from_lat_long(&sky, mapping, mapping.size_for(128));
            let back = to_lat_long(&picture, mapping, 128);
            let (a, b) = (energy(&sky)[0], energy(&back)[0]);
            assert!((a / b - 1.0).abs() < 1e-5, "{mapping} {sun}: {a} {b}");
        }
    }
}

/// ∫ L dω of a picture in any mapping, each texel's solid angle by its Jacobian over fine cells.
fn texel_solid_angle(mapping: Mapping, (width, height): (usize, usize), x: usize, y: usize) -> f64 {
    let n = 64;
    let mut sum = 0.0;
    for i in 0..n * n {
        let u = (x as f64 + ((i % n) as f64 + 0.5) / n as f64) / width as f64;
        let v = (y as f64 + ((i / n) as f64 + 0.5) / n as f64) / height as f64;
        sum += f64::from(mapping.solid_angle_density(vec2(u as f32, v as f32)));
    }
    sum / (n * n * width * height) as f64
}

/// The light of a single lit texel arrives whole, wherever it is: in the middle of the picture, at its rim, at a
/// pole, at the seam.
#[test]
fn the_flux_of_every_texel_goes_somewhere() {
    for mapping in Mapping::ALL {
        let size = mapping.size_for(6);
        let black = RgbImage::filled(size.0, size.1, Rgb::BLACK);
        let mut total = 0.0;
        for i in 0..size.0 * size.1 {
            let mut picture = black.clone();
            picture.pixels[i] = Rgb::WHITE;
            let flux = energy(&to_lat_long(&picture, mapping, 16))[0];
            total += flux;
            let (x, y) = (i % size.0, i / size.0);
            let expected = texel_solid_angle(mapping, size, x, y);
            if mapping
                .direction(
                    vec2(x as f32 + 0.5, y as f32 + 0.5) / vec2(size.0 as f32, size.1 as f32),
                )
                .is_none()
            {
                assert!(flux <= expected + 1e-2, "{mapping} ({x}, {y})");
                continue;
            }
            // The cells resolve a texel on the disc's rim to a few percent, others well.
            let rim = matches!(mapping, Mapping::Angular | Mapping::MirrorBall);
            let tolerance = if rim { 0.05 } else { 2e-3 };
            assert!(
                (flux / expected - 1.0).abs() < tolerance,
                "{mapping} ({x}, {y}): {flux} {expected}"
            );
        }
        assert!((total / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6, "{mapping}: {total}");
    }
}

/// Of a map of noise over four orders of magnitude, to any mapping and back: to 10⁻⁵.
#[test]
fn conversion_conserves_energy() {
    let noise = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0;
    for mapping in Mapping::ALL {
        for (rows, size) in
            [(33, mapping.size_for(32)), (20, mapping.size_for(64)), (64, mapping.size_for(9))]
        {
            let picture = RgbImage::from_fn(size.0, size.1, |x, y| {
                let n = noise(y * size.0 + x);
                Rgb::new(n, n.powi(8), 1e4 * f32::from(n > 0.99) + 1.0)
            });
            let map = to_lat_long(&picture, mapping, rows);
            let back = from_lat_long(&map, mapping, size);
            let again = to_lat_long(&back, mapping, rows);
            for (a, b) in energy(&map).into_iter().zip(energy(&again)) {
                assert!((a / b - 1.0).abs() < 1e-5, "{mapping} {size:?}: {a} {b}");
            }
        }
    }
}

/// One size of lat-long map to another, up and down.
#[test]
fn resizing_conserves_energy() {
    let map = lat_long_of(radiance, 24);
    for rows in [1, 5, 23, 25, 48, 100] {
        for (a, b) in
            energy(&map).into_iter().zip(energy(&to_lat_long(&map, Mapping::LatLong, rows)))
        {
            assert!((a / b - 1.0).abs() < 1e-6, "{rows}: {a} {b}");
        }
    }
}

#[test]
fn lat_long_maps_pass_through_bit_for_bit() {
    let map = lat_long_of(radiance, 33);
    assert_eq!(to_lat_long(&map, Mapping::LatLong, 33), map);
    let odd = RgbImage::from_fn(7, 5, |x, y| Rgb::new(x as f32, y as f32, 1.0));
    assert_eq!(to_lat_long(&odd, Mapping::LatLong, 5), odd);
    let turned = to_lat_long(&map, Mapping::LatLongExr, 33);
    assert_eq!(turned.get(0, 7), map.get(33, 7));
    assert_eq!(from_lat_long(&turned, Mapping::LatLongExr, (66, 33)), map);
}

#[test]
fn constant_maps_stay_constant() {
    let color = Rgb::new(0.25, 1.0, 7.0);
    for mapping in Mapping::ALL {
        let (width, height) = mapping.size_for(16);
        let map = to_lat_long(&RgbImage::filled(width, height, color), mapping, 19);
        assert!(map.pixels.iter().all(|&pixel| pixel == color), "{mapping}");
        let one = to_lat_long(&RgbImage::filled(1, 1, color), mapping, 1);
        assert!(one.pixels.iter().all(|&pixel| pixel == color), "{mapping}");
    }
}

/// Uniform points of the picture, as directions, have the density 1 / (dω/dA): χ² for every
/// mapping. What falls outside the disc or the cross is lost and counted.
#[test]
fn uniform_points_follow_the_jacobian() {
    for mapping in Mapping::ALL {
        // Octants of the cells divide the faces of the cubes and the octahedron evenly.
        let test = Chi2 { cells: [24, 48], ..Chi2::in_suite_of(Mapping::ALL.len()) };
        let sampler = |u: [f32; 2], _| mapping.direction(vec2(u[0], u[1])).map(|d| d.to_array());
        let pdf =
            |w: [f32; 3]| 1.0 / f64::from(mapping.solid_angle_density(mapping.uv(Vec3::from(w))));
        let report = test.sphere(mapping.name(), sampler, pdf);
        let report = report.unwrap_or_else(|failure| panic!("{failure}"));
        let covered = 1.0 - report.lost as f64 / test.samples as f64;
        // Five standard deviations of a count of independent points.
        let bound = 5.0 * (0.25 / test.samples as f64).sqrt();
        assert!((covered - report.mass).abs() < bound, "{mapping}: {covered} {}", report.mass);
    }
}
