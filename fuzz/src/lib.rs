//! What the fuzz targets share: a folder for the input, and the good slices beside a fuzzed one.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use supine_exchange::{
    SuppliedLabels, read_any_volume, read_ct, read_labels, read_seeds, read_signed_distance,
    read_supplied_labels, read_tenths,
};
use supine_space::Progress;

/// A folder of this process; in memory where the system has a place for that, since each input is
/// written to a file.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let memory = Path::new("/dev/shm");
        let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let folder = parent.join(format!("supine-fuzz-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder for the inputs");
        folder
    })
}

/// Writes the input to a file of this name, which is the same at each call.
pub fn file(name: &str, input: &[u8]) -> PathBuf {
    let path = folder().join(name);
    fs::write(&path, input).expect("the input is written");
    path
}

/// Feeds every reader of volumes: a CT, maps of labels, segmentations, painted seeds, signed
/// distances.
pub fn read_volume(name: &str, input: &[u8]) {
    let path = file(name, input);
    let _ = read_ct(&path, Progress::none());
    let _ = read_tenths(&path, Progress::none());
    let _ = read_signed_distance(&path, Progress::none());
    let _ = read_labels(&path, Progress::none());
    let _ = read_seeds(&path, Progress::none());
    let _ = read_any_volume(&path, None, Progress::none());
    if let Ok(SuppliedLabels::Segments(found)) = read_supplied_labels(&path, Progress::none()) {
        for place in 0..found.names().count() {
            let _ = found.mask(place);
        }
    }
}

/// A folder with the input as the first of three slices. The others are good, and 2 mm apart.
pub fn series(input: &[u8]) -> PathBuf {
    let series = folder().join("series");
    if !series.is_dir() {
        fs::create_dir(&series).expect("a folder for the series");
        for n in [2, 3] {
            fs::write(series.join(format!("{n}.dcm")), slice(n)).expect("a slice is written");
        }
    }
    fs::write(series.join("1.dcm"), input).expect("the input is written");
    series
}

/// Slice `n` of a made-up CT of 16 x 16 voxels of 1 x 1 x 2 mm: Explicit VR Little Endian.
pub fn slice(n: u8) -> Vec<u8> {
    let instance = format!("2.25.9.{n}");
    let position = format!("0\\0\\{}", 2 * n);
    let number = n.to_string();
    let mut meta = Vec::new();
    put(&mut meta, (2, 2), *b"UI", b"1.2.840.10008.5.1.4.1.1.2");
    put(&mut meta, (2, 3), *b"UI", instance.as_bytes());
    put(&mut meta, (2, 0x10), *b"UI", b"1.2.840.10008.1.2.1");
    let mut set = Vec::new();
    for (tag, vr, value) in [
        ((8, 8), *b"CS", "ORIGINAL\\PRIMARY\\AXIAL"),
        ((8, 0x16), *b"UI", "1.2.840.10008.5.1.4.1.1.2"),
        ((8, 0x18), *b"UI", instance.as_str()),
        ((8, 0x60), *b"CS", "CT"),
        ((0x10, 0x10), *b"PN", "Nobody"),
        ((0x18, 0x50), *b"DS", "2"),
        ((0x18, 0x5100), *b"CS", "HFS"),
        ((0x20, 0xD), *b"UI", "2.25.7"),
        ((0x20, 0xE), *b"UI", "2.25.8"),
        ((0x20, 0x13), *b"IS", number.as_str()),
        ((0x20, 0x32), *b"DS", position.as_str()),
        ((0x20, 0x37), *b"DS", "1\\0\\0\\0\\1\\0"),
        ((0x20, 0x52), *b"UI", "2.25.6"),
        ((0x28, 4), *b"CS", "MONOCHROME2"),
        ((0x28, 0x30), *b"DS", "1\\1"),
        ((0x28, 0x1052), *b"DS", "-1024"),
        ((0x28, 0x1053), *b"DS", "1"),
        ((0x28, 0x1054), *b"LO", "HU"),
    ] {
        put(&mut set, tag, vr, value.as_bytes());
    }
    let numbers =
        [(2, 1), (0x10, 16), (0x11, 16), (0x100, 16), (0x101, 12), (0x102, 11), (0x103, 0)];
    for (element, number) in numbers {
        put(&mut set, (0x28, element), *b"US", &u16::to_le_bytes(number));
    }
    let pixels: Vec<u8> =
        (0..256).flat_map(|at| (1000 + at * u16::from(n)).to_le_bytes()).collect();
    put(&mut set, (0x7FE0, 0x10), *b"OW", &pixels);
    let mut file = vec![0; 128];
    file.extend(b"DICM");
    file.extend([2, 0, 0, 0, b'U', b'L', 4, 0]);
    file.extend((meta.len() as u32).to_le_bytes());
    file.extend(meta);
    file.extend(set);
    file
}

/// Appends one element, padded to an even length.
fn put(to: &mut Vec<u8>, tag: (u16, u16), vr: [u8; 2], value: &[u8]) {
    let padding = if vr == *b"UI" { 0 } else { b' ' };
    let odd = value.len() % 2;
    to.extend(tag.0.to_le_bytes());
    to.extend(tag.1.to_le_bytes());
    to.extend(vr);
    let length = (value.len() + odd) as u16;
    if vr == *b"OW" {
        to.extend([0, 0]);
        to.extend(u32::from(length).to_le_bytes());
    } else {
        to.extend(length.to_le_bytes());
    }
    to.extend(value);
    to.extend(std::iter::repeat_n(padding, odd));
}
