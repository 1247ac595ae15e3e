//! RT structure sets of spheres, written byte by byte: no reader of ours has a hand in them.

use std::fmt::Write as _;
use std::path::Path;

/// A region drawn as circles on planes 3 mm apart.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Its name.
    pub name: &'static str,
    /// Centre of the sphere, LPS, mm.
    pub centre: [f64; 3],
    /// Radius, mm.
    pub radius: f64,
}

/// Distance of the planes, mm: that of the fixture patient's slices.
const STEP: f64 = 3.0;

/// Frame of Reference UID of an uncompressed explicit little endian slice.
///
/// # Panics
/// When the slice cannot be read or has none.
pub fn frame_of_reference(slice: &Path) -> String {
    let bytes = std::fs::read(slice).expect("the slice is read");
    let head = [0x20, 0x00, 0x52, 0x00, b'U', b'I'];
    let tag = bytes.windows(6).position(|w| w == head).expect("it has a frame of reference");
    let length = usize::from(u16::from_le_bytes([bytes[tag + 6], bytes[tag + 7]]));
    let text = String::from_utf8_lossy(&bytes[tag + 8..tag + 8 + length]).into_owned();
    text.trim_end_matches(['\0', ' ']).to_owned()
}

/// Writes an RT structure set (PS3.3 A.19) of such regions, explicit little endian.
///
/// # Panics
/// When it cannot be written.
pub fn write_structures(path: &Path, frame: &str, regions: &[Drawn]) {
    write_structures_of(path, frame, "", regions);
}

/// The same of a patient with this ID.
///
/// # Panics
/// When it cannot be written.
pub fn write_structures_of(path: &Path, frame: &str, patient: &str, regions: &[Drawn]) {
    const CLASS: &str = "1.2.840.10008.5.1.4.1.1.481.3";
    const INSTANCE: &str = "2.25.3141592653589793";
    let mut meta =
        [element(0x0002_0002, b"UI", CLASS), element(0x0002_0003, b"UI", INSTANCE)].concat();
    meta.extend(element(0x0002_0010, b"UI", "1.2.840.10008.1.2.1"));
    meta.extend(element(0x0002_0012, b"UI", "2.25.1"));
    let mut bytes = vec![0; 128];
    bytes.extend(b"DICM");
    let length = u32::try_from(meta.len()).expect("it is short").to_le_bytes();
    bytes.extend([&[0x02, 0x00, 0x00, 0x00, b'U', b'L', 4, 0][..], &length].concat());
    bytes.extend(meta);
    bytes.extend(element(0x0008_0016, b"UI", CLASS));
    bytes.extend(element(0x0008_0018, b"UI", INSTANCE));
    bytes.extend(element(0x0008_0060, b"CS", "RTSTRUCT"));
    bytes.extend(element(0x0010_0020, b"LO", patient));
    bytes.extend(element(0x0020_000D, b"UI", "2.25.2"));
    bytes.extend(element(0x0020_000E, b"UI", "2.25.3"));
    let numbered = || (1..).zip(regions);
    let rois = numbered().map(|(n, region)| {
        let text = |tag, vr, value: &str| element(tag, vr, value);
        [
            text(0x3006_0022, b"IS", &format!("{n}")),
            text(0x3006_0024, b"UI", frame),
            text(0x3006_0026, b"LO", region.name),
        ]
        .concat()
    });
    bytes.extend(sequence(0x3006_0020, rois.collect()));
    let contours = numbered().map(|(n, region)| {
        let number = element(0x3006_0084, b"IS", &format!("{n}"));
        [sequence(0x3006_0040, circles(region)), number].concat()
    });
    bytes.extend(sequence(0x3006_0039, contours.collect()));
    std::fs::write(path, bytes).expect("the structure set is written");
}

/// The contours of a sphere, an item each.
fn circles(region: &Drawn) -> Vec<Vec<u8>> {
    let Drawn { centre: [x, y, z], radius, .. } = *region;
    let planes = (radius / STEP).floor() as i32;
    let circle = |n: i32| {
        let height = f64::from(n) * STEP;
        let r = (radius * radius - height * height).sqrt();
        let mut data = String::new();
        for k in 0..60 {
            let (sin, cos) = (f64::from(k) * 6.0).to_radians().sin_cos();
            let _ = write!(data, "{:.2}\\{:.2}\\{:.2}\\", x + r * cos, y + r * sin, z + height);
        }
        [
            element(0x3006_0042, b"CS", "CLOSED_PLANAR"),
            element(0x3006_0046, b"IS", "60"),
            element(0x3006_0050, b"DS", data.trim_end_matches('\\')),
        ]
        .concat()
    };
    (-planes..=planes).map(circle).collect()
}

/// A text.
fn element(tag: u32, vr: &[u8; 2], value: &str) -> Vec<u8> {
    let mut value = value.as_bytes().to_vec();
    if value.len() % 2 == 1 {
        value.push(if vr == b"UI" { 0 } else { b' ' });
    }
    let length = u16::try_from(value.len()).expect("the value is short").to_le_bytes();
    [&head(tag)[..], vr, &length, &value].concat()
}

/// A sequence of items, both of known length.
fn sequence(tag: u32, items: Vec<Vec<u8>>) -> Vec<u8> {
    let length = |bytes: &[u8]| u32::try_from(bytes.len()).expect("it is short").to_le_bytes();
    let item = |item: Vec<u8>| [&head(0xFFFE_E000)[..], &length(&item), &item].concat();
    let items: Vec<u8> = items.into_iter().flat_map(item).collect();
    [&head(tag)[..], b"SQ\0\0", &length(&items), &items].concat()
}

fn head(tag: u32) -> [u8; 4] {
    let [group, element] = [(tag >> 16) as u16, tag as u16].map(u16::to_le_bytes);
    [group[0], group[1], element[0], element[1]]
}
