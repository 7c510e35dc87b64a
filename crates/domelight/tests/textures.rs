//! KTX2 and DDS files, read back by readers that were written from the specifications.

use domelight::environment::Environment;
use domelight::picture::texture::{TexelFormat, Texture, dds, ktx2};
use domelight::rig::ibl::{BrdfTable, FilteredMap, Layout, TableTerms};
use domelight::rig::tables::{ShaderTables, TableSettings};
use domelight::{Rgb, RgbImage};

/// What a reader found: format number, size, faces, and each level's faces as bytes.
#[derive(Debug, PartialEq)]
struct Read {
    format: u32,
    size: [usize; 2],
    faces: usize,
    levels: Vec<Vec<Vec<u8>>>,
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn long(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// KTX File Format Specification 2.0, section 3, with all of its rules for files without supercompression.
fn read_ktx2(file: &[u8], texel: usize) -> Read {
    assert_eq!(
        file[..12],
        [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a]
    );
    let [format, type_size, width, height, depth, layers, faces, levels, scheme] =
        std::array::from_fn(|i| word(file, 12 + 4 * i));
    assert_eq!((depth, layers, scheme), (0, 0, 0));
    assert!(faces == 6 || faces == 1);
    assert_eq!(type_size, if [109, 123].contains(&format) { 4 } else { 2 });
    let size = [width, height].map(|n| n as usize);
    let [dfd_at, dfd_length, kvd_at, kvd_length] =
        std::array::from_fn(|i| word(file, 48 + 4 * i) as usize);
    assert_eq!((long(file, 64), long(file, 72)), (0, 0), "supercompression data");
    // Descriptor and key and value data follow the index of levels without a gap.
    assert_eq!(dfd_at, 80 + 24 * levels as usize);
    assert_eq!(word(file, dfd_at) as usize, dfd_length);
    assert_eq!(kvd_at, dfd_at + dfd_length);
    read_descriptor(&file[dfd_at + 4..dfd_at + dfd_length], format, texel);
    read_metadata(&file[kvd_at..kvd_at + kvd_length]);
    let mut end = kvd_at + kvd_length;
    let mut read = Vec::new();
    for level in (0..levels as usize).rev() {
        let [offset, length, uncompressed] = [0, 8, 16].map(|i| long(file, 80 + 24 * level + i));
        let texels: usize = size.map(|n| (n >> level).max(1)).iter().product();
        assert_eq!(offset, end.next_multiple_of(texel), "the smallest level comes first");
        assert_eq!(length, uncompressed);
        assert_eq!(length, texels * texel * faces as usize);
        end = offset + length;
        let level = &file[offset..end];
        read.push(level.chunks(texels * texel).map(<[u8]>::to_vec).collect());
    }
    assert_eq!(end, file.len());
    read.reverse();
    Read { format, size, faces: faces as usize, levels: read }
}

/// Khronos Data Format Specification 1.3, section 5: samples must cover the texel's bits once.
fn read_descriptor(block: &[u8], format: u32, texel: usize) {
    assert_eq!(word(block, 0), 0, "Khronos's basic descriptor");
    let (version, size) = (word(block, 4) & 0xffff, word(block, 4) >> 16);
    assert_eq!((version, size as usize), (2, block.len()));
    // RGBSDA, Rec. 709, linear, no flags.
    assert_eq!(block[8..12], [1, 1, 1, 0]);
    assert_eq!(word(block, 12), 0, "one texel per block");
    assert_eq!((block[16] as usize, word(block, 20)), (texel, 0));
    let mut bits = 0u128;
    for sample in block[24..].chunks(16) {
        let first = u16::from_le_bytes([sample[0], sample[1]]);
        let covered = ((1u128 << (sample[2] + 1)) - 1) << first;
        let is_exponent = sample[3] & 0x20 != 0;
        assert!(is_exponent || bits & covered == 0);
        bits |= covered;
        assert_eq!(sample[3] & 0xc0, if format == 123 { 0 } else { 0xc0 }, "signed float");
    }
    assert_eq!(bits, u128::MAX >> (128 - 8 * texel));
}

fn read_metadata(mut data: &[u8]) {
    let mut keys = Vec::new();
    while !data.is_empty() {
        let length = word(data, 0) as usize;
        let pair = std::str::from_utf8(&data[4..4 + length]).unwrap();
        let (key, value) = pair.split_once('\0').unwrap();
        assert!(value.ends_with('\0'));
        keys.push(key.to_owned());
        data = &data[(4 + length).next_multiple_of(4)..];
    }
    assert_eq!(keys, ["KTXorientation", "KTXwriter"], "in the order of code points");
}

/// Programming Guide for DDS: header of 124 bytes, extension of 20, then face by face.
fn read_dds(file: &[u8], texel: usize) -> Read {
    assert_eq!(&file[..4], b"DDS ");
    assert_eq!((word(file, 4), word(file, 76)), (124, 32));
    let [flags, height, width, pitch, _, levels] = std::array::from_fn(|i| word(file, 8 + 4 * i));
    assert_eq!(flags & 0x1007, 0x1007, "caps, height, width, pixel format");
    assert_eq!((width, pitch), (height, width * texel as u32));
    assert_eq!((word(file, 80), &file[84..88]), (4, &b"DX10"[..]));
    let (caps, caps2) = (word(file, 108), word(file, 112));
    assert_eq!(caps & 0x1000, 0x1000);
    assert_eq!(caps & 0x40_0000 != 0, levels > 1);
    let [format, dimension, flag, count, _] = std::array::from_fn(|i| word(file, 128 + 4 * i));
    assert_eq!((dimension, count), (3, 1));
    let is_cube = flag == 4;
    assert_eq!(caps2, if is_cube { 0xfe00 } else { 0 });
    let faces = if is_cube { 6 } else { 1 };
    let mut read = vec![Vec::new(); levels as usize];
    let mut at = 148;
    for _ in 0..faces {
        for (level, surfaces) in read.iter_mut().enumerate() {
            let length = (width as usize >> level).max(1).pow(2) * texel;
            surfaces.push(file[at..at + length].to_vec());
            at += length;
        }
    }
    assert_eq!(at, file.len());
    Read { format, size: [width as usize; 2], faces, levels: read }
}

/// A chain of levels in which every texel is another color, a power of two in each channel.
fn levels(layout: Layout, size: usize) -> Vec<FilteredMap> {
    let map = |level: usize| {
        let size = (size >> level).max(1);
        let color = |i: usize| {
            let power = |k: usize| 2f32.powi(((i + k) % 7) as i32 - 3 + level as i32);
            Rgb::new(power(0), power(1), power(2))
        };
        FilteredMap { layout, size, texels: (0..layout.texels(size)).map(color).collect() }
    };
    (0..=size.ilog2() as usize).map(map).collect()
}

fn half(bytes: &[u8]) -> f32 {
    let bits = u16::from_le_bytes([bytes[0], bytes[1]]);
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    match exponent {
        0 => mantissa * 2f32.powi(-24),
        _ => (1024.0 + mantissa) * 2f32.powi(exponent - 25),
    }
}

fn decode(format: TexelFormat, bytes: &[u8]) -> [f32; 3] {
    if format == TexelFormat::SharedExponent {
        let bits = word(bytes, 0);
        let unit = 2f32.powi((bits >> 27) as i32 - 24);
        return [0, 9, 18].map(|shift| (bits >> shift & 511) as f32 * unit);
    }
    assert_eq!(half(&bytes[6..]), 1.0, "alpha");
    [0, 2, 4].map(|i| half(&bytes[i..]))
}

#[test]
fn cubes_and_octahedral_maps_are_read_back() {
    for format in [TexelFormat::SharedExponent, TexelFormat::Half] {
        for (layout, size) in Layout::ALL.into_iter().flat_map(|l| [1, 2, 6, 16].map(|s| (l, s))) {
            let maps = levels(layout, size);
            let (texture, clipped) = Texture::light(&maps, format);
            assert_eq!(clipped.texels, 0);
            let (mut ktx, mut direct) = (Vec::new(), Vec::new());
            ktx2::encode(&texture, &mut ktx).unwrap();
            dds::encode(&texture, &mut direct).unwrap();
            let from_ktx = read_ktx2(&ktx, format.bytes());
            let from_dds = read_dds(&direct, format.bytes());
            let numbers = match format {
                TexelFormat::SharedExponent => (123, 67),
                TexelFormat::Half | TexelFormat::HalfPair | TexelFormat::Single => (97, 10),
            };
            assert_eq!((from_ktx.format, from_dds.format), numbers);
            assert_eq!((from_ktx.size, from_ktx.faces), ([size; 2], layout.faces()));
            assert_eq!(from_ktx.levels, from_dds.levels);
            for (map, faces) in maps.iter().zip(&from_ktx.levels) {
                for (face, bytes) in faces.iter().enumerate() {
                    let texels = bytes.chunks(format.bytes()).map(|t| decode(format, t));
                    assert!(texels.eq(map.face(face).iter().map(|t| t.to_array())));
                }
            }
        }
    }
}

#[test]
fn tables_are_read_back() {
    let table = BrdfTable::new(8, TableTerms::ScaleAndBias);
    let texture = Texture::table(&table);
    let (mut ktx, mut direct) = (Vec::new(), Vec::new());
    ktx2::encode(&texture, &mut ktx).unwrap();
    dds::encode(&texture, &mut direct).unwrap();
    let (from_ktx, from_dds) = (read_ktx2(&ktx, 4), read_dds(&direct, 4));
    assert_eq!((from_ktx.format, from_dds.format), (83, 34));
    assert_eq!((from_ktx.faces, from_ktx.levels.len()), (1, 1));
    assert_eq!(from_ktx.levels, from_dds.levels);
    for (pair, bytes) in table.texels.iter().zip(from_ktx.levels[0][0].chunks(4)) {
        assert!((half(bytes) - pair[0]).abs() < 5e-4 && (half(&bytes[2..]) - pair[1]).abs() < 5e-4);
    }
}

#[test]
fn tables_for_shaders_are_read_back() {
    let map = RgbImage::from_fn(6, 5, |x, y| Rgb::new(1e-9 + x as f32, y as f32, 1e6));
    let environment = Environment::from_image(map).unwrap();
    let tables = ShaderTables::new(&environment, TableSettings::default()).unwrap();
    let mut file = Vec::new();
    ktx2::encode(&Texture::shader_tables(&tables), &mut file).unwrap();
    let read = read_ktx2(&file, 16);
    let (width, groups) = (tables.texture_width(), tables.texture());
    assert_eq!((read.format, read.size, read.faces), (109, [width, groups.len() / width], 1));
    let numbers = read.levels[0][0].chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
    assert!(numbers.eq(groups.into_iter().flatten()));
}
