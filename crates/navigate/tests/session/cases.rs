//! What a peer can do wrong, as a table.

use crate::raw::{Around, Raw, body};
use crate::support::{near, rows, stamp};
use std::time::Duration;
use supine_openigtlink::{Content, HEADER_BYTES, Message, Stamp};

/// What a peer does, and what is to come of it.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    /// Bytes, and how long nothing follows.
    pub(crate) sent: Vec<(Vec<u8>, Duration)>,
    pub(crate) wanted: Wanted,
    pub(crate) then: Then,
    /// It takes seconds.
    pub(crate) slow: bool,
}

/// What the session has to say to it.
#[derive(Clone, Debug)]
pub(crate) enum Wanted {
    /// The tumour's place for the pose of a stamp.
    Reply(Stamp),
    /// These STATUS, in this order.
    Status(Vec<(u16, &'static str)>),
    /// One STATUS, and the last place becomes stale.
    Refused,
    Nothing,
    /// The peer does not read.
    Unread,
}

/// What becomes of the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    Kept,
    Closed,
    /// The peer leaves.
    Left,
}

use Then::{Closed, Kept, Left};
use Wanted::{Nothing, Refused, Reply, Unread};

const NO_TIME: Duration = Duration::ZERO;

fn case(name: &'static str, bytes: Vec<u8>, wanted: Wanted, then: Then) -> Case {
    Case { name, sent: vec![(bytes, NO_TIME)], wanted, then, slow: false }
}

fn status(code: u16, name: &'static str) -> Wanted {
    Wanted::Status(vec![(code, name)])
}

/// The pose with a number, in version 1.
fn pose(n: u64) -> Raw {
    Raw::pose(stamp(n), &near(n))
}

/// All of them; poses have stamps from `first` on, and no two have the same.
pub(crate) fn all(first: u64) -> Vec<Case> {
    let mut cases = sums_and_sizes(first);
    cases.extend(headers(first + 100));
    cases.extend(second_version(first + 200));
    cases.extend(poses(first + 300));
    cases.extend(contents());
    cases.extend(flows(first + 400));
    cases
}

fn sums_and_sizes(first: u64) -> Vec<Case> {
    let valid = pose(first);
    let pose = pose(first + 1);
    let size = |size| Raw { size: Some(size), ..pose.clone() }.bytes();
    let content = |body: &[u8]| Raw { body: body.into(), ..pose.clone() }.bytes();
    let large = || status(11, "TooLarge");
    let bad = || status(10, "BadBody");
    let longer = [pose.body.as_slice(), b"x"].concat();
    // Its last 8 bytes are taken for the next header.
    let short = Raw { body: pose.body[..40].into(), ..pose.clone() }.bytes();
    let short = [short.as_slice(), &pose.body[40..], &pose.bytes()].concat();
    let out_of_step = Wanted::Status(vec![(10, "BadBody"), (10, "BadHeader")]);
    vec![
        case("a valid pose", valid.bytes(), Reply(valid.stamp), Kept),
        case(
            "a wrong checksum",
            Raw { crc: Some(1), ..pose.clone() }.bytes(),
            status(9, "Checksum"),
            Kept,
        ),
        case(
            "a checksum of zero",
            Raw { crc: Some(0), ..pose.clone() }.bytes(),
            status(9, "Checksum"),
            Kept,
        ),
        case("2^63 bytes", size(1 << 63), large(), Closed),
        case("2^64 - 1 bytes", size(u64::MAX), large(), Closed),
        case("2^64 - 58 bytes", size(u64::MAX - 57), large(), Closed),
        case("2^32 - 1 bytes", size((1 << 32) - 1), large(), Closed),
        case("2^31 bytes", size(1 << 31), large(), Closed),
        case("1 GiB", size(1 << 30), large(), Closed),
        case("a pose of 47 bytes", content(&pose.body[..47]), bad(), Kept),
        case("a pose of 49 bytes", content(&longer), bad(), Kept),
        case("a pose of 0 bytes", content(&[]), bad(), Kept),
        case("a pose announced too short, then one", short, out_of_step, Closed),
    ]
}

fn headers(first: u64) -> Vec<Case> {
    let of = |kind: &[u8], n: u64| Raw { kind: kind.into(), ..pose(n) };
    let kind = |kind: &[u8]| of(kind, first).bytes();
    let version = |version| Raw { version, ..pose(first) }.bytes();
    let bad = || status(10, "BadHeader");
    let unknown = || status(12, "UnknownType");
    let garbage = (0..4096_u32).map(|n| (n * 151 + 77) as u8).collect();
    let http = b"GET /index.html HTTP/1.1\r\nHost: localhost:18944\r\nAccept: text/html\r\n\r\n";
    let rubbish = of(b"TRANSFORM\0q", first + 1);
    let device = Raw { device: [0xE9, 0x20].repeat(10), ..pose(first + 2) };
    let large = Raw { crc: Some(0), ..Raw::new("WHATEVER", &vec![b'w'; 1_000_000]) };
    vec![
        case("58 zeros", vec![0; HEADER_BYTES], bad(), Closed),
        case("garbage", garbage, bad(), Closed),
        case("a browser", http.into(), bad(), Closed),
        case("a type of 12 letters without NUL", kind(b"NOSUCHTYPE12"), unknown(), Kept),
        case("rubbish behind the NUL of a type", rubbish.bytes(), Reply(rubbish.stamp), Kept),
        case("an empty type", kind(b""), bad(), Closed),
        case("a type that is not ASCII", kind(b"\xC3\x9Cnknown"), bad(), Closed),
        case("a type in small letters", kind(b"transform"), unknown(), Kept),
        case("a device that is not ASCII", device.bytes(), Reply(device.stamp), Kept),
        case("1 MB of a type that is not known", large.bytes(), unknown(), Kept),
        case("header version 0", version(0), bad(), Closed),
        case("header version 3", version(3), bad(), Closed),
        case("header version 65535", version(65535), bad(), Closed),
    ]
}

fn second_version(first: u64) -> Vec<Case> {
    let content = body(&near(first));
    let of = |body: Vec<u8>, n: u64| Raw { version: 2, body, stamp: stamp(n), ..pose(n) }.bytes();
    let around = |around: Around<'_>, n: u64| of(around.body(&content), n);
    // One entry: a key of 4 bytes, ASCII, a value of 2.
    let entry = [0, 1, 0, 4, 0, 3, 0, 0, 0, 2];
    let (mut lies, values) = (entry, b"tool42".as_slice());
    lies[6..].fill(0xFF);
    let plain = Around::default();
    let extended = |extended| around(Around { extended, ..Around::default() }, first);
    let metadata = Around { header: &entry, values, ..Around::default() };
    let values_size = Around { values_size: Some(u32::MAX), ..Around::default() };
    let header_size = Around { header_size: Some(u16::MAX), ..Around::default() };
    let count = Around { header: &[0xFF, 0xFF], ..Around::default() };
    let lying = Around { header: &lies, values, ..Around::default() };
    let bad = || status(10, "BadExtendedHeader");
    let wrong = || status(10, "BadMetadata");
    vec![
        case("version 2", around(plain, first + 1), Reply(stamp(first + 1)), Kept),
        case("version 2 with metadata", around(metadata, first + 2), Reply(stamp(first + 2)), Kept),
        case("version 2 with a body of 4 bytes", of(vec![0, 12, 0, 0], first), bad(), Kept),
        case("an extended header of size 0", extended(0), bad(), Kept),
        case("an extended header of size 65535", extended(u16::MAX), bad(), Kept),
        case("metadata of 2^32 - 1 bytes", around(values_size, first), bad(), Kept),
        case("a metadata header of 65535 bytes", around(header_size, first), bad(), Kept),
        case("65535 entries of metadata", around(count, first), wrong(), Kept),
        case("a value of 2^32 - 1 bytes", around(lying, first), wrong(), Kept),
    ]
}

fn poses(first: u64) -> Vec<Case> {
    let with = |n: u64, change: &dyn Fn(&mut [[f32; 4]; 3])| {
        let mut rows = rows(&near(n));
        change(&mut rows);
        let mut bytes = vec![];
        Message::new("Applicator", stamp(n), Content::Transform(rows)).write(&mut bytes);
        bytes
    };
    let number = |row: usize, column: usize, value: f32| {
        with(first, &|rows: &mut [[f32; 4]; 3]| rows[row][column] = value)
    };
    let turn = |factors: [f32; 3]| {
        with(first, &|rows: &mut [[f32; 4]; 3]| {
            for row in rows {
                (0..3).for_each(|column| row[column] *= factors[column]);
            }
        })
    };
    let tiny = with(first + 1, &|rows: &mut [[f32; 4]; 3]| rows[0][3] = 1e-42);
    vec![
        case("a shift that is no number", number(0, 3, f32::NAN), Refused, Kept),
        case("a turn that is infinite", number(1, 1, f32::INFINITY), Refused, Kept),
        case("a shift of 3e38 mm", number(0, 3, 3e38), Refused, Kept),
        case("a shift of 1e-42 mm", tiny, Reply(stamp(first + 1)), Kept),
        case(
            "zeros",
            with(first, &|rows: &mut [[f32; 4]; 3]| *rows = [[0.0; 4]; 3]),
            Refused,
            Kept,
        ),
        case("a mirror", turn([-1.0, 1.0, 1.0]), Refused, Kept),
        case("a scale of 1.02", turn([1.02; 3]), Refused, Kept),
    ]
}

fn contents() -> Vec<Case> {
    let of = |kind: &str, body: &[u8]| Raw::new(kind, body).bytes();
    let bad = || status(10, "BadBody");
    // Version 1, one component, i16, little-endian, LPS, 65535 voxels along each axis.
    let mut image = vec![0, 1, 1, 4, 2, 2];
    image.extend([0xFF; 6]);
    image.extend(
        [1_f32, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
            .map(f32::to_be_bytes)
            .concat(),
    );
    image.extend([0; 6]);
    image.extend([0xFF; 6]);
    assert_eq!(image.len(), 72, "bytes before the voxels");
    let large = Raw {
        crc: Some(0),
        body: [image.as_slice(), &vec![0; 20_000_000]].concat(),
        ..Raw::new("IMAGE", &[])
    };
    let poly_data = [[0xFF; 40], [0; 40]].concat();
    vec![
        case(
            "an image of 65535^3 voxels",
            of("IMAGE", &[image.as_slice(), &[0; 64]].concat()),
            bad(),
            Kept,
        ),
        case("20 MB of an image", large.bytes(), status(9, "Checksum"), Kept),
        case("counts of a surface that lie", of("POLYDATA", &poly_data), bad(), Kept),
        case("a tool and a byte", of("TDATA", &[0; 71]), bad(), Kept),
        case("a text shorter than it says", of("STRING", b"\0\x03\xFF\xFFabc"), bad(), Kept),
        case(
            "a sensor without values",
            of("SENSOR", &[255, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
            bad(),
            Kept,
        ),
        case("a position of 20 bytes", of("POSITION", &[0; 20]), bad(), Kept),
    ]
}

fn flows(first: u64) -> Vec<Case> {
    let row = |first: u64, count: u64| -> Vec<u8> {
        (first..first + count).flat_map(|n| pose(n).bytes()).collect()
    };
    let last = stamp(first + 1199);
    let one = pose(first + 1200);
    // The pauses are few: with other work a machine makes each of them longer, and a message has 2
    // s.
    let bytewise = |raw: &Raw, pause, each: usize| {
        let pause = |n: usize| if n.is_multiple_of(each) { pause } else { NO_TIME };
        raw.bytes().into_iter().enumerate().map(|(n, b)| (vec![b], pause(n))).collect()
    };
    let slow = |name, sent, wanted, then| Case { name, sent, wanted, then, slow: true };
    let late = || status(7, "Late");
    let (quick, quarter) = (Duration::from_millis(2), Duration::from_millis(250));
    let mut loris: Vec<_> = bytewise(&one, quarter, 1);
    loris.truncate(16);
    let cut = |size: usize| vec![(one.bytes()[..size].to_vec(), NO_TIME)];
    vec![
        case("200 poses in one write", row(first + 1000, 200), Reply(last), Kept),
        Case {
            name: "a pose byte by byte",
            sent: bytewise(&one, quick, 10),
            wanted: Reply(one.stamp),
            then: Kept,
            slow: false,
        },
        case("2000 poses, and nothing read", row(first + 2000, 2000), Unread, Left),
        case("gone at once", vec![], Nothing, Left),
        slow("a header without its end", cut(57), late(), Closed),
        slow("a body without its end", cut(80), late(), Closed),
        slow("a header byte by byte, slowly", loris, late(), Closed),
        slow("silent for 5 s", vec![(vec![], Duration::from_secs(5))], Nothing, Kept),
    ]
}
