//! Pictures and probes in files: round trips, every variant of every format, damaged files.
#![cfg(feature = "io")]

use domelight::environment::LatLongGrid;
use domelight::environment::io::{
    ProbeError, ProbeOptions, SanitizeReport, Window, load_probe, probe_from_bytes,
    probe_from_picture, sanitize,
};
use domelight::environment::mapping::{CubeLayout, EnvmapKind, Mapping, from_lat_long};
use domelight::math::{vec2, vec3};
use domelight::picture::exr::{ExrLayers, text_attributes};
use domelight::picture::tone::{ToneCurve, ToneMapping};
use domelight::picture::{
    Format, Picture, PictureError, PictureErrorKind, ReadOptions, hdr, pfm, png, read, read_bytes,
    write_atomically,
};
use domelight::{Rgb, RgbImage};
use exr::math::RoundingMode;
use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, Levels, LineOrder, SampleType, SmallVec, Text, Vec2, WritableImage,
};
use half::f16;
use std::io::Cursor;

/// PCG-XSH-RR 32 (O'Neill 2014).
struct Pcg(u64);

impl Pcg {
    fn next(&mut self) -> u32 {
        let state = self.0;
        self.0 =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((state >> 18) ^ state) >> 27) as u32).rotate_right((state >> 59) as u32)
    }

    fn below(&mut self, n: usize) -> usize {
        self.next() as usize % n
    }

    fn float(&mut self) -> f32 {
        self.next() as f32 / u32::MAX as f32
    }
}

/// Radiance over many orders of magnitude, with runs of equal texels.
fn picture(width: usize, height: usize) -> RgbImage {
    let mut rng = Pcg(7);
    RgbImage::from_fn(width, height, |x, y| {
        let level = f32::exp2(rng.float() * 20.0 - 10.0);
        match (x / 9 + y) % 3 {
            0 => Rgb::BLACK,
            1 => Rgb::new(0.5, 0.25, 1.0 + y as f32),
            _ => Rgb::new(rng.float(), rng.float(), rng.float()) * level,
        }
    })
}

fn decode(bytes: &[u8]) -> Result<Picture, PictureError> {
    read_bytes(bytes, "test", &ReadOptions::default())
}

fn kind(bytes: &[u8]) -> PictureErrorKind {
    decode(bytes).expect_err("a damaged file").kind
}

fn hdr_bytes(image: &RgbImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    hdr::encode(image, &mut bytes).unwrap();
    bytes
}

// ---- Radiance ------------------------------------------------------------------------------------------------------

#[test]
fn hdr_rounds_to_the_nearest_and_then_stays() {
    for (width, height) in [(64, 16), (7, 3), (1, 1), (200, 5), (40000, 2)] {
        let image = picture(width, height);
        let once = decode(&hdr_bytes(&image)).unwrap();
        assert_eq!((once.format, &once.alpha), (Format::Hdr, &None));
        for (a, b) in image.pixels.iter().zip(&once.image.pixels) {
            // Half a step of a mantissa that is at least 128 for the largest channel.
            let step = 0.5 / 127.75 * a.max_component();
            assert!((*a - *b).map(f32::abs).max_component() <= step, "{a:?} {b:?}");
        }
        let twice = decode(&hdr_bytes(&once.image)).unwrap();
        assert_eq!(once, twice);
    }
}

#[test]
fn rgbe_of_extremes() {
    assert_eq!(hdr::rgbe(Rgb::BLACK), [0; 4]);
    assert_eq!(hdr::rgbe(Rgb::WHITE), [128, 128, 128, 129]);
    assert_eq!(hdr::rgbe(Rgb::new(f32::NAN, -1.0, 0.5)), [0, 0, 128, 128]);
    assert_eq!(hdr::rgbe(Rgb::splat(f32::INFINITY)), [255, 255, 255, 255]);
    assert_eq!(hdr::rgbe(Rgb::splat(1e-45)), [0; 4]);
    // 255.6 / 256 rounds up into the next exponent.
    assert_eq!(hdr::rgbe(Rgb::splat(255.6 / 256.0)), [128, 128, 128, 129]);
}

/// Pixel (x, y) of a 3 × 2 picture, and the same as RGBE.
fn small(x: usize, y: usize) -> [u8; 4] {
    [128 + x as u8, 128 + 10 * y as u8, 200, 129]
}

fn small_image() -> RgbImage {
    RgbImage::from_fn(3, 2, |x, y| {
        let [r, g, b, _] = small(x, y);
        Rgb::new(f32::from(r), f32::from(g), f32::from(b)) / 128.0
    })
}

#[test]
fn hdr_in_all_eight_orientations() {
    for y_first in [true, false] {
        for x_forward in [true, false] {
            for y_downward in [true, false] {
                let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
                let x_axis = format!("{}X 3", if x_forward { '+' } else { '-' });
                let y_axis = format!("{}Y 2", if y_downward { '-' } else { '+' });
                let (slow, fast) = if y_first { (y_axis, x_axis) } else { (x_axis, y_axis) };
                bytes.extend(format!("{slow} {fast}\n").bytes());
                let (lines, length) = if y_first { (2, 3) } else { (3, 2) };
                for i in 0..lines * length {
                    let (slow, fast) = (i / length, i % length);
                    let (x, y) = if y_first { (fast, slow) } else { (slow, fast) };
                    let x = if x_forward { x } else { 2 - x };
                    let y = if y_downward { y } else { 1 - y };
                    bytes.extend(small(x, y));
                }
                assert_eq!(decode(&bytes).unwrap().image, small_image(), "{slow} {fast}");
            }
        }
    }
}

#[test]
fn hdr_with_old_run_lengths() {
    let mut bytes = b"#?RGBE\n# a comment = not a variable\n\n-Y 2 +X 600\n".to_vec();
    // 1 + 2·256 + 44 equal pixels by two runs in a row, then 43 by one run.
    bytes.extend([130, 140, 150, 129, 1, 1, 1, 44, 1, 1, 1, 2, 200, 0, 0, 128, 1, 1, 1, 42]);
    bytes.extend([[9, 9, 200, 120]; 600].as_flattened());
    let image = decode(&bytes).unwrap().image;
    assert_eq!(image.row(0)[..557], [Rgb::new(130.0, 140.0, 150.0) / 128.0; 557]);
    assert_eq!(image.row(0)[557..], [Rgb::new(200.0 / 256.0, 0.0, 0.0); 43]);
    assert_eq!(image.get(599, 1).b, 200.0 / 65536.0);
    // A repetition with nothing before it, one past the end, and eight bits too many.
    let header = b"#?RGBE\n\n-Y 1 +X 600\n";
    for runs in
        [&[1u8, 1, 1, 3, 0, 0, 0, 0, 0, 0, 0, 0][..], &[1, 2, 3, 4, 1, 1, 1, 99, 1, 1, 1, 99]]
    {
        let scanline = kind(&[header, runs].concat());
        assert!(matches!(scanline, PictureErrorKind::Scanline { scanline: 0, .. }), "{scanline}");
    }
}

#[test]
fn hdr_exposure_correction_and_line_ends() {
    let header = "#?RADIANCE\r\nEXPOSURE=2\r\nEXPOSURE= 0.25\r\nCOLORCORR= 1 2 4\r\nVIEW= -vtv\r\n\r\n-Y 1 +X 1\r\n";
    let bytes = [header.as_bytes(), &[128, 128, 128, 129]].concat();
    assert_eq!(decode(&bytes).unwrap().image.pixels, [Rgb::new(2.0, 1.0, 0.5)]);
    // Indented lines are of the pictures that this one was made from.
    let header =
        "#?RADIANCE\npcomb a.hdr\na.hdr:\n\tEXPOSURE=2.0\n\tFORMAT=of a friend\n\n-Y 1 +X 1\n";
    let bytes = [header.as_bytes(), &[128, 128, 128, 129]].concat();
    assert_eq!(decode(&bytes).unwrap().image.pixels, [Rgb::WHITE]);
    let fisheye = "#?RADIANCE\nVIEW= -vth -vd 0 0 1 -vh 180 -vv 180\n\n-Y 1 +X 1\n";
    let picture = decode(&[fisheye.as_bytes(), &[128, 128, 128, 129]].concat()).unwrap();
    assert!(picture.warnings[0].contains("an orthographic fisheye"), "{:?}", picture.warnings);
    // What cannot be meant is ignored.
    for odd in ["EXPOSURE=0", "EXPOSURE=nan", "COLORCORR=1 1", "PRIMARIES=1 0 1 0 1 0 1 0"] {
        let bytes = [format!("#?RADIANCE\n{odd}\n\n-Y 1 +X 1\n").as_bytes(), &[128, 128, 128, 129]]
            .concat();
        let picture = decode(&bytes).unwrap();
        assert_eq!(picture.image.get(0, 0), Rgb::WHITE, "{odd}");
        assert!(picture.warnings[0].contains(odd), "{:?}", picture.warnings);
    }
    let bad = "FORMAT=png";
    let bytes = format!("#?RADIANCE\n{bad}\n\n-Y 1 +X 1\nabcd");
    let message = decode(bytes.as_bytes()).unwrap_err().to_string();
    assert!(message.starts_with(&format!("test: header line 2: \"{bad}\" is not ")), "{message}");
}

/// Half of the sphere, as Radiance's angular fisheye sees it from below, with a lamp in the west.
#[test]
fn a_fisheye_of_the_upper_half_is_placed_by_its_view() {
    let n = 64;
    let mut bytes =
        format!("#?RADIANCE\nVIEW= -vta -vd 0 0 1 -vu 0 1 0 -vh 180 -vv 180\n\n-Y {n} +X {n}\n")
            .into_bytes();
    let texel = |i: usize| {
        // Half of the way from the zenith to the horizon, where west is on the right.
        if i == n * n / 2 + 3 * n / 4 { [128, 128, 128, 137] } else { [128, 128, 128, 129] }
    };
    (0..n * n).for_each(|i| bytes.extend(texel(i)));
    let probe = probe_from_bytes(&bytes, "zenith.hdr", &ProbeOptions::default()).unwrap();
    assert_eq!((probe.warnings.as_slice(), probe.mapping), (&[][..], Mapping::Angular));
    assert_eq!(probe.notes, ["a fisheye of 180 degrees (VIEW)"]);
    let map = &probe.image;
    let (width, height) = (map.width, map.height);
    let grid = LatLongGrid::new(width, height);
    let brightest =
        (0..width * height).max_by(|&a, &b| map.pixels[a].r.total_cmp(&map.pixels[b].r));
    let uv = |i: usize| {
        vec2((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / vec2(width as f32, height as f32)
    };
    let lamp = Mapping::LatLong.direction(uv(brightest.unwrap())).unwrap();
    let west = vec3(-0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0);
    assert!(lamp.dot(west) > 0.999, "{lamp}");
    // Light: the half sphere, and 255 of the lamp's texel, dω = 4 (π/2 / n)² sin 45° / (π/4).
    let light: f64 =
        (0..width * height).map(|i| f64::from(map.pixels[i].g) * grid.solid_angle(i / width)).sum();
    let radians = std::f64::consts::PI / n as f64;
    let expected = std::f64::consts::TAU + 255.0 * radians.powi(2) * 0.5_f64.sqrt() / 0.785;
    assert!((light / expected - 1.0).abs() < 5e-3, "{light} instead of {expected}");
    assert!(map.pixels[width * (height / 2 + 1)..].iter().all(|&texel| texel == Rgb::BLACK));
}

#[test]
fn hdr_xyze_becomes_rec709() {
    let start = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n";
    // XYZ of D65 white and a green outside the gamut, whose red would be negative.
    let bytes = [&start[..], &[209, 220, 240, 128], &[40, 200, 20, 128]].concat();
    let image = decode(&bytes).unwrap().image;
    let white = image.get(0, 0);
    assert!(
        (white.g / white.r - 1.0).abs() < 0.01 && (white.g / white.b - 1.0).abs() < 0.01,
        "{white:?}"
    );
    assert!(image.get(1, 0).r == 0.0 && image.get(1, 0).g > 0.5);
    // Radiance's own converter: white is (1/3, 1/3), 179 lumens are a watt.
    let header = "#?RADIANCE\nra_xyze a.hdr b.hdr\nEXPOSURE=5.5866e-03\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    let picture = decode(&[header.as_bytes(), &[128, 128, 128, 129]].concat()).unwrap();
    assert!((picture.image.get(0, 0) - Rgb::WHITE).map(f32::abs).max_component() < 1e-3);
    assert_eq!(picture.notes.len(), 2, "{:?}", picture.notes);
    // Primaries of Rec. 709 itself change nothing; others do, but keep white.
    for (primaries, same) in [
        (".64 .33 .3 .6 .15 .06 .3127 .329", true),
        (".7 .3 .17 .8 .13 .05 .33 .34", false),
        // ACES AP0, whose green and blue are no colors.
        (".7347 .2653 0 1 .0001 -.077 .32168 .33767", false),
    ] {
        let header = format!("#?RADIANCE\nPRIMARIES= {primaries}\n\n-Y 1 +X 2\n");
        let bytes = [header.as_bytes(), &[128, 128, 128, 129, 255, 128, 128, 129]].concat();
        let image = decode(&bytes).unwrap().image;
        assert!((image.get(0, 0) - Rgb::WHITE).map(f32::abs).max_component() < 1e-3);
        assert_eq!((image.get(1, 0).r - 255.0 / 128.0).abs() < 1e-6, same);
    }
}

// ---- PFM -----------------------------------------------------------------------------------------------------------

#[test]
fn pfm_keeps_every_bit() {
    let mut image = picture(13, 7);
    image.pixels[5] = Rgb::new(-1.5, f32::MIN_POSITIVE / 8.0, f32::INFINITY);
    let mut bytes = Vec::new();
    pfm::encode(&image, &mut bytes).unwrap();
    assert_eq!(decode(&bytes).unwrap().image, image);
}

#[test]
fn pfm_in_both_byte_orders_and_gray() {
    let values = [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0];
    let big: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    let gray = decode(&[&b"Pf # gray\n3 2\n0.5\n"[..], &big].concat()).unwrap().image;
    // Bottom row first; the scale's magnitude multiplies.
    assert_eq!(gray.pixels, [2.0, 2.5, 3.0, 0.5, 1.0, 1.5].map(Rgb::splat));
    let little: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let color = decode(&[&b"PF\r\n1 2\r\n-1\r\n"[..], &little].concat()).unwrap().image;
    assert_eq!(color.pixels, [Rgb::new(4.0, 5.0, 6.0), Rgb::new(1.0, 2.0, 3.0)]);
}

// ---- PNG -----------------------------------------------------------------------------------------------------------

#[test]
fn png_round_trip_with_straight_alpha() {
    let image = RgbImage::from_fn(5, 4, |x, y| Rgb::new(0.2 * x as f32, 0.3 * y as f32, 0.5));
    let alpha: Vec<f32> = (0..20).map(|i| i as f32 / 19.0).collect();
    let premultiplied = RgbImage::from_fn(5, 4, |x, y| image.get(x, y) * alpha[y * 5 + x]);
    for (depth, step) in [(png::Depth::Eight, 1.0 / 255.0), (png::Depth::Sixteen, 1.0 / 65535.0)] {
        let mut bytes = Vec::new();
        png::encode(&premultiplied, Some(&alpha), &ToneMapping::default(), depth, &mut bytes)
            .unwrap();
        assert!(bytes.windows(4).any(|chunk| chunk == b"sRGB"));
        let back = decode(&bytes).unwrap();
        for (a, b) in back.alpha.unwrap().iter().zip(&alpha) {
            assert!((a - b).abs() <= 0.501 * step);
        }
        for (a, b) in back.image.pixels.iter().zip(&premultiplied.pixels) {
            // The encoding's derivative is at most 2.3 at white; alpha and color are rounded.
            assert!((*a - *b).map(f32::abs).max_component() < 2.5 * step, "{a:?} {b:?}");
        }
    }
    let mut opaque = Vec::new();
    let tone = ToneMapping { exposure: 1.0, curve: ToneCurve::Standard };
    png::encode(
        &RgbImage::filled(2, 1, Rgb::splat(0.5)),
        None,
        &tone,
        png::Depth::Eight,
        &mut opaque,
    )
    .unwrap();
    let back = decode(&opaque).unwrap();
    assert_eq!((back.image.pixels[0], back.alpha), (Rgb::WHITE, None));
}

// ---- OpenEXR -------------------------------------------------------------------------------------------------------

const COMPRESSIONS: [Compression; 10] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
    Compression::PXR24,
    Compression::B44,
    Compression::B44A,
    Compression::DWAA(None),
    Compression::DWAB(None),
];

fn plane(image: &RgbImage, f: fn(&Rgb) -> f32, sample: SampleType) -> FlatSamples {
    let values = image.pixels.iter().map(f);
    match sample {
        SampleType::F16 => FlatSamples::F16(values.map(f16::from_f32).collect()),
        SampleType::F32 => FlatSamples::F32(values.collect()),
        SampleType::U32 => FlatSamples::U32(values.map(|v| v as u32).collect()),
    }
}

fn rgb_channels(
    image: &RgbImage,
    prefix: &str,
    sample: SampleType,
) -> Vec<AnyChannel<FlatSamples>> {
    let name = |c: &str| Text::from(format!("{prefix}{c}").as_str());
    vec![
        AnyChannel::new(name("R"), plane(image, |c| c.r, sample)),
        AnyChannel::new(name("G"), plane(image, |c| c.g, sample)),
        AnyChannel::new(name("B"), plane(image, |c| c.b, sample)),
    ]
}

const ACESCG: Chromaticities = Chromaticities {
    red: Vec2(0.713, 0.293),
    green: Vec2(0.165, 0.83),
    blue: Vec2(0.128, 0.044),
    white: Vec2(0.32168, 0.33767),
};

fn exr_bytes(
    size: (usize, usize),
    channels: Vec<AnyChannel<FlatSamples>>,
    encoding: Encoding,
    attributes: LayerAttributes,
) -> Vec<u8> {
    let layer =
        Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn encodings() -> impl Iterator<Item = Encoding> {
    let tiled = [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 24))];
    COMPRESSIONS.into_iter().flat_map(move |compression| {
        tiled.into_iter().map(move |blocks| Encoding {
            compression,
            blocks,
            line_order: LineOrder::Increasing,
        })
    })
}

/// A smooth picture in the range where half floats and the lossy codecs are good.
fn smooth(width: usize, height: usize) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
        Rgb::new(0.5 + 0.4 * (3.0 * u).sin(), 0.3 + 0.2 * v, 0.6 + 0.3 * (2.0 * (u + v)).cos())
    })
}

#[test]
fn exr_in_every_compression_scanline_and_tiled() {
    let image = smooth(70, 53);
    for encoding in encodings() {
        for sample in [SampleType::F16, SampleType::F32] {
            let bytes = exr_bytes(
                (70, 53),
                rgb_channels(&image, "", sample),
                encoding,
                LayerAttributes::default(),
            );
            let back = decode(&bytes).unwrap_or_else(|e| panic!("{encoding:?} {sample:?}: {e}"));
            assert_eq!((back.format, back.envmap), (Format::Exr, None));
            // Half floats keep 11 bits; B44 and DWA at their standard quality are good to about a percent.
            let exact = encoding.compression.is_lossless_for(sample) && sample == SampleType::F32;
            let tolerance = match encoding.compression {
                _ if exact => 0.0,
                Compression::B44
                | Compression::B44A
                | Compression::DWAA(_)
                | Compression::DWAB(_) => 0.02,
                _ => 5e-4,
            };
            for (a, b) in image.pixels.iter().zip(&back.image.pixels) {
                let difference = (*a - *b).map(f32::abs).max_component();
                assert!(difference <= tolerance, "{encoding:?} {sample:?}: {difference}");
            }
        }
    }
}

#[test]
fn exr_of_unsigned_integers_and_luminance() {
    let image = RgbImage::from_fn(4, 3, |x, y| Rgb::splat((10 * x + y) as f32));
    let y = vec![AnyChannel::new("Y", plane(&image, |c| c.r, SampleType::U32))];
    let bytes = exr_bytes((4, 3), y, Encoding::SMALL_LOSSLESS, LayerAttributes::default());
    assert_eq!(decode(&bytes).unwrap().image, image);
}

#[test]
fn exr_mip_maps_give_the_largest_level() {
    let image = smooth(32, 16);
    let levels = |f: fn(&Rgb) -> f32| {
        let level = |size: Vec2<usize>| {
            if size == Vec2(32, 16) {
                plane(&image, f, SampleType::F32)
            } else {
                FlatSamples::F32(vec![9.0; size.area()])
            }
        };
        let sizes = [Vec2(32, 16), Vec2(16, 8), Vec2(8, 4), Vec2(4, 2), Vec2(2, 1), Vec2(1, 1)];
        Levels::Mip { rounding_mode: RoundingMode::Down, level_data: sizes.map(level).to_vec() }
    };
    let channels: SmallVec<_> = [
        AnyChannel::new("R", levels(|c| c.r)),
        AnyChannel::new("G", levels(|c| c.g)),
        AnyChannel::new("B", levels(|c| c.b)),
    ]
    .into_iter()
    .collect();
    let encoding = Encoding {
        compression: Compression::ZIP1,
        blocks: Blocks::Tiles(Vec2(8, 8)),
        line_order: LineOrder::Increasing,
    };
    let layer =
        Layer::new((32, 16), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    assert_eq!(decode(&bytes.into_inner()).unwrap().image, image);
}

#[test]
fn exr_data_window_attribute_and_chromaticities() {
    let image = smooth(8, 48);
    let attributes = LayerAttributes {
        layer_position: Vec2(-100, 7),
        environment_map: Some(EnvironmentMap::Cube),
        ..LayerAttributes::default()
    };
    let channels = rgb_channels(&image, "", SampleType::F32);
    let bytes = exr_bytes((8, 48), channels.clone(), Encoding::SMALL_LOSSLESS, attributes);
    let back = decode(&bytes).unwrap();
    assert_eq!((&back.image, back.envmap), (&image, Some(EnvmapKind::Cube)));

    let layer = Layer::new(
        (8, 48),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut file = Image::from_layer(layer);
    file.attributes.chromaticities = Some(ACESCG);
    let mut bytes = Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes).unwrap();
    // ACEScg (0.5, 0.3, 0.9) and Rec. 709 by the matrix that everybody prints, to its digits.
    let back = decode(&bytes.into_inner()).unwrap().image;
    let (from, to) = (image.pixels[0], back.pixels[0]);
    let expected = Rgb::new(
        1.70505 * from.r - 0.62179 * from.g - 0.08326 * from.b,
        -0.13026 * from.r + 1.14080 * from.g - 0.01055 * from.b,
        -0.02400 * from.r - 0.12897 * from.g + 1.15297 * from.b,
    );
    assert!((to - expected).map(f32::abs).max_component() < 2e-3, "{to:?} {expected:?}");
}

/// OpenEXR's own test picture of XYZ states these chromaticities: X and Z have no luminance, so y is 0.
#[test]
fn exr_xyz_chromaticities_are_xyz() {
    let xyz = Chromaticities {
        red: Vec2(1.0, 0.0),
        green: Vec2(0.0, 1.0),
        blue: Vec2(0.0, 0.0),
        white: Vec2(1.0 / 3.0, 1.0 / 3.0),
    };
    let impossible = Chromaticities { green: Vec2(1.0, 0.0), ..xyz };
    // D65 white of luminance 1.
    let image = RgbImage::filled(2, 1, Rgb::new(0.95047, 1.0, 1.08883));
    let read = |chromaticities: Chromaticities| {
        let layer = Layer::new(
            (2, 1),
            LayerAttributes::default(),
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(rgb_channels(&image, "", SampleType::F32).into_iter().collect()),
        );
        let mut file = Image::from_layer(layer);
        file.attributes.chromaticities = Some(chromaticities);
        let mut bytes = Cursor::new(Vec::new());
        file.write().to_buffered(&mut bytes).unwrap();
        decode(&bytes.into_inner()).unwrap()
    };
    let back = read(xyz);
    assert!((back.image.pixels[0] - Rgb::WHITE).map(f32::abs).max_component() < 2e-3, "{back:?}");
    assert!(back.notes[0].contains("chromaticities") && back.warnings.is_empty());
    let back = read(impossible);
    assert_eq!(back.image, image);
    assert!(back.warnings[0].contains("no color space") && back.notes.is_empty());
}

/// A sun beyond half precision, and what renderers make of a division by zero, in ACEScg.
#[test]
fn values_that_are_no_light_are_found_in_files_of_other_primaries() {
    let mut image = RgbImage::filled(4, 2, Rgb::splat(0.5));
    image.pixels[1] = Rgb::splat(f32::INFINITY);
    image.pixels[2].g = f32::NAN;
    image.pixels[5].r = f32::NEG_INFINITY;
    let channels = rgb_channels(&image, "", SampleType::F32);
    let layer = Layer::new(
        (4, 2),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut file = Image::from_layer(layer);
    file.attributes.chromaticities = Some(ACESCG);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("aces.exr");
    file.write().to_file(&path).unwrap();
    let probe = load_probe(&path, &ProbeOptions::default()).unwrap();
    assert_eq!(probe.image.pixels[1], Rgb::splat(65504.0));
    let expected = SanitizeReport { negative: 0, non_finite: 5, infinite: 3 };
    assert_eq!(probe.sanitized, expected);
    assert!(probe.image.pixels[2].g.is_finite());
    let strict = ProbeOptions { strict: true, ..ProbeOptions::default() };
    assert!(load_probe(&path, &strict).is_err());
}

#[test]
fn exr_of_x_y_z_is_cie_xyz_and_coordinates_are_no_picture() {
    let layers = |names: [&str; 3]| {
        let mut layers = ExrLayers::new(2, 1);
        for (name, value) in names.iter().zip([0.9505f32, 1.0, 1.089]) {
            let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
            layers.push_channel(layer, channel, vec![value; 2]);
        }
        layers.encode().unwrap()
    };
    let white = decode(&layers(["X", "Y", "Z"])).unwrap().image.pixels[0];
    assert!((white - Rgb::WHITE).map(f32::abs).max_component() < 1e-3, "{white:?}");
    assert!(matches!(kind(&layers(["N.X", "N.Y", "N.Z"])), PictureErrorKind::NoColor { .. }));
    assert!(matches!(kind(&layers(["uv.X", "uv.Y", "d.Z"])), PictureErrorKind::NoColor { .. }));
    let guess = decode(&layers(["a.Y", "b.Y", "c.Z"])).unwrap().guessed_layer;
    assert_eq!(guess.unwrap().others, ["b"]);
}

/// The table of a file of scanlines names one block twice.
#[test]
fn exr_of_blocks_that_are_missing_is_corrupt() {
    let image = smooth(8, 6);
    let encoding = Encoding { compression: Compression::Uncompressed, ..Encoding::SMALL_LOSSLESS };
    let channels = rgb_channels(&image, "", SampleType::F32);
    let bytes = exr_bytes((8, 6), channels, encoding, LayerAttributes::default());
    let table = bytes.len() - 6 * (8 + 8 + 8 * 12);
    let mut twice = bytes.clone();
    twice.copy_within(table + 8..table + 16, table + 16);
    assert!(matches!(kind(&twice), PictureErrorKind::MissingBlocks), "{}", kind(&twice));
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
    let mut bytes = std::fs::read(format!("{folder}/luminance_chroma_zips.exr")).unwrap();
    let begins = |at: &usize| {
        let offset = bytes.get(*at..*at + 8).map(|b| u64::from_le_bytes(b.try_into().unwrap()));
        // A block for each of the 36 lines, right after the table.
        offset == Some((*at + 36 * 8) as u64)
    };
    let table = (0..bytes.len()).find(begins).unwrap();
    bytes.copy_within(table + 8..table + 16, table + 16);
    assert!(matches!(kind(&bytes), PictureErrorKind::MissingBlocks));
}

/// Files of 16 × 36 texels that OpenEXR's own library wrote (3.5.3, by its Python module), chroma at every second
/// texel: R = 0.5 + 0.4 x / 16, G = 0.3 + 0.2 y / 36, B = 0.2 + 0.3 (x + y) / 52.
#[test]
fn exr_of_luminance_and_chroma() {
    for compression in ["no", "rle", "zips", "zip", "piz", "pxr24"] {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");
        let bytes = std::fs::read(format!("{folder}/luminance_chroma_{compression}.exr")).unwrap();
        let picture = decode(&bytes).unwrap_or_else(|error| panic!("{compression}: {error}"));
        assert_eq!((picture.image.width, picture.image.height), (16, 36));
        let tolerance = 0.012;
        for (i, color) in picture.image.pixels.iter().enumerate() {
            let (x, y) = ((i % 16) as f32, (i / 16) as f32);
            let expected =
                Rgb::new(0.5 + 0.4 * x / 16.0, 0.3 + 0.2 * y / 36.0, 0.2 + 0.3 * (x + y) / 52.0);
            let error = (*color - expected).map(f32::abs).max_component();
            // Chroma goes on beyond its last sample.
            let is_border = i % 16 == 15 || i / 16 == 35;
            let tolerance = if is_border { tolerance + 0.02 } else { tolerance };
            assert!(error < tolerance, "{compression} ({x}, {y}): {color:?} {expected:?}");
        }
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length]).is_err(), "{compression}: {length} bytes");
        }
        let mut rng = Pcg(3);
        for _ in 0..500 {
            let mut damaged = bytes.clone();
            let at = rng.below(damaged.len());
            damaged[at] = rng.next() as u8;
            let _ = decode(&damaged);
        }
    }
}

#[test]
fn exr_of_luminance_and_chroma_at_every_texel() {
    let image = smooth(8, 6);
    let luminance = |c: &Rgb| c.luminance();
    let of = |f: &dyn Fn(&Rgb) -> f32| image.pixels.iter().map(f).collect::<Vec<_>>();
    let mut layers = ExrLayers::new(8, 6);
    layers.push_channel("", "Y", of(&luminance));
    layers.push_channel("", "RY", of(&|c| c.r / luminance(c) - 1.0));
    layers.push_channel("", "BY", of(&|c| c.b / luminance(c) - 1.0));
    let bytes = layers.encode().unwrap();
    let read = decode(&bytes).unwrap().image;
    for (a, b) in read.pixels.iter().zip(&image.pixels) {
        assert!((*a - *b).map(f32::abs).max_component() < 1e-3, "{a:?} {b:?}");
    }
}

/// OpenEXR 3.4 has two more compressions.
#[test]
fn exr_compressed_by_htj2k_is_refused_by_name() {
    let mut layers = ExrLayers::new(4, 2);
    layers.push_channel("", "Y", vec![2.5; 8]);
    let bytes = layers.encode().unwrap();
    let attribute = b"compression\0compression\0\x01\0\0\0";
    let at = bytes.windows(attribute.len()).position(|window| window == attribute).unwrap();
    for number in [10, 11] {
        let mut bytes = bytes.clone();
        bytes[at + attribute.len()] = number;
        let message = kind(&bytes).to_string();
        assert_eq!(message, "OpenEXR: files compressed by HTJ2K are not supported");
    }
}

#[test]
fn exr_of_one_channel_of_any_name_is_gray() {
    for name in ["R", "luminance", "Y"] {
        let mut layers = ExrLayers::new(4, 2);
        layers.push_channel("", name, vec![2.5; 8]);
        assert_eq!(decode(&layers.encode().unwrap()).unwrap().image.pixels, [Rgb::splat(2.5); 8]);
    }
    let mut layers = ExrLayers::new(4, 2);
    layers.push_channel("", "Z", vec![2.5; 8]);
    assert!(matches!(kind(&layers.encode().unwrap()), PictureErrorKind::NoColor { .. }));
}

/// A file of several parts, as other programs write it: by the part's name, the first with color by default.
#[test]
fn exr_parts_are_read_by_name() {
    let parts = [("depth", "Z", 7.0), ("beauty", "", 0.5), ("diffuse", "", 0.25)];
    let part = |(name, channel, value): (&str, &str, f32)| {
        let image = RgbImage::filled(6, 4, Rgb::new(value, 2.0 * value, 3.0 * value));
        let channels = match channel {
            "" => rgb_channels(&image, "", SampleType::F32),
            name => {
                vec![AnyChannel::new(Text::from(name), plane(&image, |c| c.r, SampleType::F32))]
            }
        };
        let attributes = LayerAttributes::named(name);
        let channels = AnyChannels::sort(channels.into_iter().collect());
        Layer::new((6, 4), attributes, Encoding::FAST_LOSSLESS, channels)
    };
    let layers: SmallVec<[_; 2]> = parts.map(part).into_iter().collect();
    let window = exr::meta::attribute::IntegerBounds::from_dimensions((6, 4));
    let file = Image::from_layers(exr::meta::header::ImageAttributes::new(window), layers);
    let mut bytes = Cursor::new(Vec::new());
    file.write().to_buffered(&mut bytes).unwrap();
    let read = |layer: Option<&str>| {
        let options = ReadOptions { layer: layer.map(Into::into), ..ReadOptions::default() };
        read_bytes(bytes.get_ref(), "parts.exr", &options).map(|picture| picture.image.pixels[5])
    };
    assert_eq!(read(None).unwrap(), Rgb::new(0.5, 1.0, 1.5));
    assert_eq!(read(Some("Diffuse")).unwrap(), Rgb::new(0.25, 0.5, 0.75));
    assert_eq!(read(Some("depth")).unwrap(), Rgb::splat(7.0));
    let error = read(Some("specular")).unwrap_err().to_string();
    assert!(error.contains("specular") && error.contains("beauty"), "{error}");
}

#[test]
fn exr_layers_are_written_and_found_again() {
    let (color, albedo) = (picture(33, 17), smooth(33, 17));
    let alpha: Vec<f32> = (0..33 * 17).map(|i| i as f32 / 561.0).collect();
    let mut layers = ExrLayers::from_image(&color, Some(&alpha));
    layers.push_rgb("albedo", &albedo, None);
    layers.push_xyz("normal", &vec![vec3(0.0, 0.5, 1.0); 561]);
    layers.push_channel("depth", "Z", vec![3.5; 561]);
    layers.attributes = vec![("scene".into(), "Bühne".into()), ("seed".into(), "42".into())];
    layers.envmap = Some(EnvmapKind::LatLong);
    let bytes = layers.encode().unwrap();
    assert_eq!(text_attributes(&bytes).unwrap(), layers.attributes);

    let layer = |name: Option<&str>| {
        read_bytes(
            &bytes,
            "test",
            &ReadOptions { layer: name.map(Into::into), ..Default::default() },
        )
    };
    let main = layer(None).unwrap();
    assert_eq!(
        (main.image, main.alpha, main.envmap),
        (color, Some(alpha), Some(EnvmapKind::LatLong))
    );
    assert_eq!(layer(Some("Albedo")).unwrap().image, albedo);
    assert_eq!(layer(Some("normal")).unwrap().image.pixels[9], Rgb::new(0.0, 0.5, 1.0));
    assert_eq!(layer(Some("depth")).unwrap().image.pixels[9], Rgb::splat(3.5));
    assert_eq!(
        layer(Some("shadow")).unwrap_err().to_string(),
        "test: there is no layer \"shadow\" with color channels; the file has albedo, depth, normal"
    );
    // Without unnamed channels, a layer named after the whole picture is the picture.
    let named = |names: [&str; 3]| {
        let mut layers = ExrLayers::new(33, 17);
        let levels = [1.0, 2.0, 3.0].map(|level| RgbImage::filled(33, 17, Rgb::splat(level)));
        names.iter().zip(&levels).for_each(|(name, image)| layers.push_rgb(name, image, None));
        layers.encode().unwrap()
    };
    let read = |bytes: &[u8], name: Option<&str>| {
        let options = ReadOptions { layer: name.map(Into::into), ..Default::default() };
        read_bytes(bytes, "test", &options).map(|p| (p.image.pixels[0].r, p.guessed_layer))
    };
    let blender = named(["ViewLayer.AO", "ViewLayer.Combined", "ViewLayer.DiffCol"]);
    assert_eq!(read(&blender, None).unwrap(), (2.0, None));
    // Its last word names a layer, if there is only one.
    assert_eq!(read(&blender, Some("diffcol")).unwrap(), (3.0, None));
    assert!(read(&named(["a.x", "b.x", "c"]), Some("x")).is_err());
    // The first of others is a guess.
    let (level, guessed) = read(&named(["fill", "key", "rim"]), None).unwrap();
    let words = guessed.expect("a guess").to_string();
    assert_eq!((level, &*words), (1.0, "the layer 'fill' is read; the file also has key, rim"));
    // Something that is no color is no picture.
    let mut only = ExrLayers::new(33, 17);
    only.push_channel("a", "Z", vec![1.0; 561]);
    let none = kind(&only.encode().unwrap()).to_string();
    assert_eq!(none, "there are no color channels (R, G, B or Y); the file has a.Z");
    only.push_rgb("b", &albedo, None);
    assert_eq!(decode(&only.encode().unwrap()).unwrap().image, albedo);
}

#[test]
fn exr_layers_that_cannot_be_written_are_refused() {
    let image = smooth(4, 4);
    let mut twice = ExrLayers::from_image(&image, None);
    twice.push_channel("", "R", vec![0.0; 16]);
    assert!(
        matches!(twice.encode(), Err(PictureErrorKind::Channel { channel, .. }) if channel == "R")
    );
    let mut short = ExrLayers::new(4, 4);
    short.push_channel("x", "Y", vec![0.0; 15]);
    assert!(
        matches!(short.encode(), Err(PictureErrorKind::Channel { channel, .. }) if channel == "x.Y")
    );
    assert!(matches!(ExrLayers::new(0, 4).encode(), Err(PictureErrorKind::Empty { .. })));
    assert!(matches!(ExrLayers::new(4, 4).encode(), Err(PictureErrorKind::NoColor { .. })));
}

// ---- Damaged files -------------------------------------------------------------------------------------------------

/// One small file of each kind.
fn samples() -> Vec<(String, Vec<u8>)> {
    let image = picture(37, 11);
    let mut files = vec![("hdr".to_owned(), hdr_bytes(&image))];
    let flat = [&b"#?RGBE\n\n-Y 2 +X 3\n"[..], &[[9u8, 8, 200, 128]; 6].concat()].concat();
    files.push(("flat hdr".to_owned(), flat));
    let mut bytes = Vec::new();
    pfm::encode(&image, &mut bytes).unwrap();
    files.push(("pfm".to_owned(), bytes));
    let mut bytes = Vec::new();
    png::encode(&image, None, &ToneMapping::default(), png::Depth::Eight, &mut bytes).unwrap();
    files.push(("png".to_owned(), bytes));
    let mut bytes = Cursor::new(Vec::new());
    let gray = image::RgbImage::from_fn(37, 11, |x, y| image::Rgb([x as u8 * 6, y as u8 * 20, 99]));
    gray.write_to(&mut bytes, image::ImageFormat::Jpeg).unwrap();
    files.push(("jpeg".to_owned(), bytes.into_inner()));
    for encoding in encodings() {
        let channels = rgb_channels(&image, "", SampleType::F16);
        let bytes = exr_bytes((37, 11), channels, encoding, LayerAttributes::default());
        files.push((format!("{:?} {:?}", encoding.compression, encoding.blocks), bytes));
    }
    files
}

#[test]
fn truncated_files_are_errors() {
    for (name, bytes) in samples() {
        assert!(decode(&bytes).is_ok(), "{name}");
        for cut in 0..50 {
            let end = bytes.len() * cut / 50;
            assert!(decode(&bytes[..end]).is_err(), "{name} cut at {end} of {}", bytes.len());
        }
        // PNG and OpenEXR may end in bytes that nothing depends on; texels must be whole.
        if !name.contains("png") {
            assert!(decode(&bytes[..bytes.len() - 1]).is_err(), "{name} without its last byte");
        }
    }
}

#[test]
fn corrupt_files_do_no_harm() {
    let mut rng = Pcg(11);
    for (_, bytes) in samples() {
        for _ in 0..150 {
            let mut damaged = bytes.clone();
            for _ in 0..=rng.below(3) {
                // Half of the damage in the header, where it hurts.
                let within = if rng.below(2) == 0 { damaged.len().min(400) } else { damaged.len() };
                let at = rng.below(within);
                damaged[at] = rng.next() as u8;
            }
            // Whatever comes out, it comes out, and a picture is whole.
            if let Ok(picture) = decode(&damaged) {
                assert_eq!(picture.image.pixels.len(), picture.image.width * picture.image.height);
            }
        }
    }
}

#[test]
fn promises_beyond_the_file_are_refused_before_memory_is_taken() {
    for size in ["-Y 30000 +X 17000", "-Y 500000 +X 1000", "+X 1000 -Y 500000"] {
        let bytes = [format!("#?RADIANCE\n\n{size}\n").as_bytes(), &[2, 2, 66, 104]].concat();
        assert!(matches!(kind(&bytes), PictureErrorKind::Promises { held: 4, .. }), "{size}");
    }
    assert!(matches!(
        kind(b"PF\n20000 20000\n-1\n1234"),
        PictureErrorKind::Promises { needed: 4_800_000_000, .. }
    ));
    assert!(matches!(
        kind(b"#?RADIANCE\n\n-Y 99999999 +X 99999999\n"),
        PictureErrorKind::TooLarge { .. }
    ));
    assert!(matches!(kind(b"PF\n18446744073709551615 3\n-1\n"), PictureErrorKind::TooLarge { .. }));
    for empty in [&b"#?RADIANCE\n\n-Y 0 +X 10\n"[..], b"PF\n0 0\n-1\n"] {
        assert!(matches!(kind(empty), PictureErrorKind::Empty { .. }));
    }
    for encoding in encodings() {
        let image = smooth(24, 24);
        let bytes = exr_bytes(
            (24, 24),
            rgb_channels(&image, "", SampleType::F32),
            encoding,
            LayerAttributes::default(),
        );
        // The data window's last corner: after the attribute's name, type, size and first corner.
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4 + 8;
        let mut promising = bytes.clone();
        // Without the count of chunks, which would contradict.
        let name = b"chunkCount";
        if let Some(count) = bytes.windows(name.len()).position(|w| w == name) {
            promising[count] = b'C';
        }
        promising[at..at + 4].copy_from_slice(&22_000i32.to_le_bytes());
        promising[at + 4..at + 8].copy_from_slice(&22_000i32.to_le_bytes());
        let refused = kind(&promising);
        assert!(matches!(refused, PictureErrorKind::Promises { .. }), "{encoding:?}: {refused}");
    }
    // A PNG whose header promises 20000 × 20000.
    let mut bytes = Vec::new();
    png::encode(&smooth(2, 2), None, &ToneMapping::default(), png::Depth::Eight, &mut bytes)
        .unwrap();
    bytes[16..20].copy_from_slice(&20_000u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&20_000u32.to_be_bytes());
    assert!(decode(&bytes).is_err());
}

#[test]
fn unknown_formats_are_named() {
    assert_eq!(
        decode(b"GIF89a").unwrap_err().to_string(),
        "test: not a picture in a known format (Radiance HDR, OpenEXR, PFM, PNG, JPEG, KTX2, DDS), by its first bytes"
    );
    assert!(decode(b"").is_err());
}

// ---- Files ---------------------------------------------------------------------------------------------------------

#[test]
fn writing_is_all_or_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pfm");
    let image = picture(4, 4);
    write_atomically(&path, |out| pfm::encode(&image, out)).unwrap();
    assert_eq!(read(&path, &ReadOptions::default()).unwrap().image, image);
    let failed = write_atomically(&path, |out| {
        out.write_all(b"half")?;
        Err(std::io::Error::other("no more"))
    });
    assert!(failed.unwrap_err().to_string().ends_with("a.pfm: no more"));
    assert_eq!(read(&path, &ReadOptions::default()).unwrap().image, image);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let nowhere = folder.path().join("no/such/b.pfm");
    assert!(write_atomically(&nowhere, |_| Ok(())).unwrap_err().to_string().contains("b.pfm"));
    assert!(read(&nowhere, &ReadOptions::default()).unwrap_err().to_string().contains("b.pfm"));
}

// ---- Probes --------------------------------------------------------------------------------------------------------

fn saved(folder: &tempfile::TempDir, name: &str, image: &RgbImage) -> std::path::PathBuf {
    let path = folder.path().join(name);
    write_atomically(&path, |out| pfm::encode(image, out)).unwrap();
    path
}

#[test]
fn probes_of_any_shape_load() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in [(1, 1), (2, 1), (17, 9), (64, 32), (5, 40)] {
        for image in [picture(width, height), RgbImage::filled(width, height, Rgb::BLACK)] {
            let probe = load_probe(&saved(&folder, "p", &image), &ProbeOptions::default()).unwrap();
            assert_eq!((&probe.image, probe.mapping), (&image, Mapping::LatLong));
        }
    }
    let layout = Mapping::Cube(CubeLayout::CrossVertical);
    let smooth = smooth(48, 64);
    let cross = RgbImage::from_fn(48, 64, |x, y| {
        let uv = vec2((x as f32 + 0.5) / 48.0, (y as f32 + 0.5) / 64.0);
        if layout.direction(uv).is_some() { smooth.get(x, y) } else { Rgb::BLACK }
    });
    let cross = saved(&folder, "cross", &cross);
    let probe = load_probe(&cross, &ProbeOptions::default()).unwrap();
    assert_eq!((probe.mapping, probe.file_size), (layout, (48, 64)));
    assert_eq!((probe.image.width, probe.image.height), (52, 26));
    let ball = ProbeOptions { mapping: Some(Mapping::MirrorBall), ..Default::default() };
    assert_eq!(
        load_probe(&cross, &ball).unwrap_err().to_string(),
        format!(
            "{}: mirror-ball maps have width : height = 1:1, this picture is 48x64",
            cross.display()
        )
    );
}

#[test]
fn squares_are_told_apart_by_their_corners() {
    let folder = tempfile::tempdir().unwrap();
    let disc = RgbImage::from_fn(32, 32, |x, y| {
        let r = (x as f32 - 15.5).hypot(y as f32 - 15.5);
        if r < 16.0 { Rgb::WHITE } else { Rgb::BLACK }
    });
    let mapping =
        |image| load_probe(&saved(&folder, "s", image), &ProbeOptions::default()).unwrap().mapping;
    assert_eq!(mapping(&disc), Mapping::Angular);
    assert_eq!(mapping(&smooth(32, 32)), Mapping::Octahedral);
}

#[test]
fn texels_that_are_no_radiance_are_named_or_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = RgbImage::from_fn(8, 4, |x, _| Rgb::splat(x as f32));
    image.pixels[8 + 3] = Rgb::new(1.0, f32::NAN, -2.0);
    image.pixels[16 + 5].r = f32::INFINITY;
    let path = saved(&folder, "bad.pfm", &image);
    let error =
        load_probe(&path, &ProbeOptions { strict: true, ..Default::default() }).unwrap_err();
    assert!(matches!(error, ProbeError::BadTexel { x: 3, y: 1, channel: 'G', count: 3, .. }));
    assert_eq!(
        error.to_string(),
        format!(
            "{}: texel (3, 1) has G = NaN, and 3 value(s) in all are negative, NaN or infinite; without --strict they are repaired",
            path.display()
        )
    );
    let repaired = load_probe(&path, &ProbeOptions::default()).unwrap();
    let [warning] = &repaired.warnings[..] else { panic!("{:?}", repaired.warnings) };
    assert!(warning.contains("1 negative and 2 NaN or infinite"), "{warning}");
    assert_eq!(repaired.sanitized, SanitizeReport { negative: 1, non_finite: 2, infinite: 1 });
    assert!(
        warning.contains("1 infinite ones became as bright as their neighbors, at least 65504"),
        "{warning}"
    );
    // The mean of 2, 3, 4 in the rows around and 2, 4 beside it.
    assert_eq!(repaired.image.get(3, 1), Rgb::new(1.0, 3.0, 0.0));
    // What overflowed is as bright as can be.
    assert_eq!(repaired.image.get(5, 2).r, 65504.0);
}

/// A map whose black borders were cropped, one with texels beyond its frame, and one with any frame.
#[test]
fn data_windows_stand_in_display_windows_that_are_maps() {
    let folder = tempfile::tempdir().unwrap();
    let image = smooth(12, 5);
    let probe_in = |data: &RgbImage, origin: (i32, i32), display: (usize, usize), window| {
        let channels = rgb_channels(data, "", SampleType::F32);
        let attributes = LayerAttributes {
            layer_position: Vec2(origin.0, origin.1),
            ..LayerAttributes::default()
        };
        let layer = Layer::new(
            (data.width, data.height),
            attributes,
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(channels.into_iter().collect()),
        );
        let mut file = Image::from_layer(layer);
        file.attributes.display_window = exr::meta::attribute::IntegerBounds::new((3, -2), display);
        let path = folder.path().join("p.exr");
        file.write().to_file(&path).unwrap();
        load_probe(&path, &ProbeOptions { window, ..ProbeOptions::default() }).unwrap()
    };
    let probe = |data: &RgbImage, origin, display| probe_in(data, origin, display, None);
    let cropped = probe(&image, (5, 0), (16, 8));
    assert_eq!(cropped.file_size, (16, 8));
    assert_eq!(cropped.image.get(2, 2), image.get(0, 0));
    assert_eq!(cropped.image.get(13, 6), image.get(11, 4));
    assert_eq!((cropped.image.get(1, 2), cropped.image.get(2, 7)), (Rgb::BLACK, Rgb::BLACK));
    assert!(cropped.warnings[0].contains("12x5") && cropped.warnings[0].contains("16x8"));
    let beyond = probe(&smooth(18, 10), (2, -3), (16, 8));
    assert_eq!(beyond.image.get(0, 0), smooth(18, 10).get(1, 1));
    let as_is = probe(&smooth(16, 8), (0, 0), (19, 11));
    assert_eq!((as_is.image, as_is.warnings.len()), (smooth(16, 8), 0));
    let either = probe(&smooth(20, 10), (1, -3), (16, 8));
    assert_eq!((either.image, either.file_size), (smooth(20, 10), (20, 10)));
    let warning = "the data window is read as the whole map (--window display reads the other, of render: --env-window)";
    assert!(either.warnings[0].ends_with(warning), "{:?}", either.warnings);
    // The same file by an option.
    let data = probe_in(&smooth(20, 10), (1, -3), (16, 8), Some(Window::Data));
    assert_eq!((data.file_size, data.warnings.len()), ((20, 10), 0));
    let display = probe_in(&smooth(20, 10), (1, -3), (16, 8), Some(Window::Display));
    assert_eq!((display.file_size, display.warnings.len()), ((16, 8), 0));
    assert_eq!(display.image.get(0, 0), smooth(20, 10).get(2, 1));
    let neither = probe(&smooth(21, 9), (5, 3), (30, 17));
    assert_eq!(neither.image, smooth(21, 9));
    assert!(neither.warnings[0].ends_with(warning), "{:?}", neither.warnings);
    assert!(neither.warnings[1].contains("21x9 texels are stretched"), "{:?}", neither.warnings);
}

/// Strips and crosses of other programs, and pictures without faces.
#[test]
fn faces_in_another_order_are_a_map() {
    let probe = smooth(64, 32);
    let n = 8;
    let strip = from_lat_long(&probe, Mapping::Cube(CubeLayout::StripHorizontal), (6 * n, n));
    let picture = |image: &RgbImage| {
        let mut bytes = Vec::new();
        pfm::encode(image, &mut bytes).unwrap();
        read_bytes(&bytes, "p.pfm", &ReadOptions::default()).unwrap()
    };
    let load = |image: &RgbImage, faces: Option<&str>, mapping| {
        let faces = faces.map(|faces| faces.parse().unwrap());
        let options = ProbeOptions { faces, mapping, ..ProbeOptions::default() };
        probe_from_picture(picture(image), "p.pfm", &options)
    };
    let expected = load(&strip, None, None).unwrap();
    // Right, left, up, down, back, front in the order front, right, back, left, up, down.
    let order = [5, 0, 4, 1, 2, 3];
    let other = RgbImage::from_fn(6 * n, n, |x, y| strip.get(order[x / n] * n + x % n, y));
    let found = load(&other, Some("F,R,B,L,U,D"), None).unwrap();
    assert_eq!((&found.image, found.warnings.len()), (&expected.image, 0));
    // A cross with its lowest face upright.
    let layout = CubeLayout::CrossVertical;
    let cross = from_lat_long(&probe, Mapping::Cube(layout), (3 * n, 4 * n));
    let upright = RgbImage::from_fn(3 * n, 4 * n, |x, y| match (x / n, y / n) {
        (1, 3) => cross.get(3 * n - 1 - x, 7 * n - 1 - y),
        _ => cross.get(x, y),
    });
    assert_ne!(upright, cross);
    let found = load(&upright, Some("U,L,F,R,D,B"), Some(Mapping::Cube(layout))).unwrap();
    assert_eq!(found.image, load(&cross, None, Some(Mapping::Cube(layout))).unwrap().image);
    for mapping in [None, Some(Mapping::LatLong)] {
        let error = load(&probe, Some("F,R,B,L,U,D"), mapping).unwrap_err().to_string();
        assert!(error.contains("64x32") && error.contains("has no faces"), "{error}");
    }
}

#[test]
fn pictures_of_a_screen_are_maps_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let deep = image::ImageBuffer::from_pixel(8, 4, image::Rgb([65535u16, 32768, 0]));
    deep.save(folder.path().join("a.png")).unwrap();
    let small = image::RgbImage::from_pixel(8, 4, image::Rgb([255, 188, 0]));
    small.save(folder.path().join("b.png")).unwrap();
    small.save(folder.path().join("c.jpg")).unwrap();
    for (name, green, tolerance) in
        [("a.png", 0.2140, 1e-4), ("b.png", 0.5029, 1e-4), ("c.jpg", 0.5029, 0.02)]
    {
        let probe = load_probe(&folder.path().join(name), &ProbeOptions::default()).unwrap();
        let texel = probe.image.get(3, 2);
        assert!((texel.r - 1.0).abs() < 0.02 && (texel.g - green).abs() < tolerance, "{texel:?}");
        assert!(probe.warnings[0].contains("suns"), "{:?}", probe.warnings);
    }
}

/// A PNG that states a gamma is decoded by it, unless it is about that of sRGB or comes with the chunk sRGB.
#[test]
fn a_png_may_state_its_gamma() {
    let with = |gamma: Option<u32>, srgb: bool| {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(::png::ColorType::Rgb);
        if srgb {
            encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
        }
        if let Some(gamma) = gamma {
            encoder.set_source_gamma(::png::ScaledFloat::from_scaled(gamma));
        }
        encoder.write_header().unwrap().write_image_data(&[128; 3]).unwrap();
        read_bytes(&bytes, "a.png", &ReadOptions::default()).unwrap().image.pixels[0].g
    };
    let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
    assert!(near(with(None, false), 0.2159));
    assert!(near(with(Some(45455), false), 0.2159));
    assert!(near(with(Some(100_000), false), 0.502));
    assert!(near(with(Some(50_000), false), 0.252));
    assert!(near(with(Some(100_000), true), 0.2159));
}

/// A PNG's chunk of code points for the signal takes precedence.
#[test]
fn a_png_may_state_its_transfer_function() {
    let with = |transfer: u8| {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_source_gamma(::png::ScaledFloat::from_scaled(50_000));
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(::png::chunk::cICP, &[1, transfer, 0, 1]).unwrap();
        writer.write_image_data(&[128; 3]).unwrap();
        drop(writer);
        let picture = read_bytes(&bytes, "a.png", &ReadOptions::default());
        picture.map(|picture| picture.image.pixels[0].g)
    };
    for (transfer, expected) in [(8, 0.502), (13, 0.2159), (5, 0.1452)] {
        let found = with(transfer).unwrap();
        assert!((found - expected).abs() < 1e-3, "{transfer}: {found}");
    }
    for (transfer, name) in [(16, "PQ"), (18, "HLG")] {
        assert!(with(transfer).unwrap_err().to_string().contains(name));
    }
}

/// Cameras append films and gain maps to their pictures.
#[test]
fn what_follows_a_jpeg_is_of_no_concern() {
    let mut bytes = Vec::new();
    let image = image::RgbImage::from_fn(40, 20, |x, y| image::Rgb([x as u8 * 6, y as u8 * 9, 0]));
    image.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Jpeg).unwrap();
    let read = |bytes: &[u8]| read_bytes(bytes, "a.jpg", &ReadOptions::default());
    assert!(read(&bytes).is_ok_and(|picture| !picture.has_gain_map));
    // An application segment with XMP, after the start of the image.
    let xmp =
        b"http://ns.adobe.com/xap/1.0/\0<x xmlns:hdrgm=\"http://ns.adobe.com/hdr-gain-map/1.0/\"/>";
    let length = (xmp.len() as u16 + 2).to_be_bytes();
    let ultra = [&bytes[..2], &[0xff, 0xe1], &length, &xmp[..], &bytes[2..]].concat();
    assert!(read(&ultra).is_ok_and(|picture| picture.has_gain_map));
    let longer = [&bytes[..], &[0xff, 0xda, 0, 8, 1, 2, 3]].concat();
    assert!(read(&longer).is_ok());
    for length in [bytes.len() - 1, bytes.len() - 2, bytes.len() / 2] {
        assert!(read(&bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn large_holes_are_filled_from_their_borders() {
    let mut image = RgbImage::filled(40, 30, Rgb::new(2.0, f32::NAN, 2.0));
    for y in 5..25 {
        for x in 5..35 {
            image.pixels[y * 40 + x] = Rgb::splat(f32::NAN);
        }
    }
    let report = sanitize(&mut image, Mapping::LatLong);
    assert_eq!(report, SanitizeReport { negative: 0, non_finite: 1200 + 2 * 600, infinite: 0 });
    assert!(image.pixels.iter().all(|&pixel| pixel == Rgb::new(2.0, 0.0, 2.0)));
}

#[test]
fn openexr_probes_turn_to_the_working_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    let image = smooth(16, 8);
    let mut layers = ExrLayers::from_image(&image, None);
    layers.envmap = Some(EnvmapKind::LatLong);
    std::fs::write(&path, layers.encode().unwrap()).unwrap();
    let probe = load_probe(&path, &ProbeOptions::default()).unwrap();
    assert_eq!(probe.mapping, Mapping::LatLongExr);
    // OpenEXR's −Z, the middle of the border, comes to the center.
    assert_eq!(probe.image.get(8, 4), image.get(0, 4));
    let as_is = ProbeOptions { mapping: Some(Mapping::LatLong), ..Default::default() };
    assert_eq!(load_probe(&path, &as_is).unwrap().image, image);
}
