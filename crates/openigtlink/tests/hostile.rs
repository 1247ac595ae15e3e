//! Messages that are damaged, lie or mean harm: what answers each, and that none costs more than it
//! brings.

mod support;

use supine_openigtlink::{
    Content, HEADER_BYTES, Header, HeaderError, Limits, Message, Stamp, StatusCode, Version,
};
use support::{Wrong, held, raw, read, repair, vectors, write};

/// Memory that a message may take beyond its bytes.
const MARGIN: usize = 64 << 10;

/// What a message must bring.
#[derive(Debug, PartialEq)]
enum Answer {
    /// It is read.
    Read,
    /// It is read as a type that nobody knows: STATUS 12, the connection stays.
    Unknown,
    /// STATUS with this code; the connection stays.
    Keep(StatusCode),
    /// STATUS with this code; the connection is closed.
    Close(StatusCode),
}

use Answer::{Close, Keep, Unknown};
use StatusCode::{ChecksumError, ConfigurationError, NotEnoughResources};

fn answer(bytes: &[u8]) -> Answer {
    match read(bytes) {
        Ok(Message { content: Content::Unknown { .. }, .. }) => Unknown,
        Ok(_) => Answer::Read,
        Err(wrong) => match wrong.answer() {
            (code, true) => Keep(code),
            (code, false) => Close(code),
        },
    }
}

/// A TRANSFORM: the identity, 10, 20, 30 mm away.
fn pose() -> Vec<u8> {
    [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 10.0, 20.0, 30.0_f32]
        .iter()
        .flat_map(|value| value.to_be_bytes())
        .collect()
}

/// A good message with two bytes or more replaced.
fn with(place: usize, bytes: &[u8]) -> Vec<u8> {
    let mut message = raw(1, b"TRANSFORM", &pose());
    message[place..place + bytes.len()].copy_from_slice(bytes);
    message
}

/// A body of version 2 with sizes as given: of the extended header, of the metadata's header and
/// body.
fn two(sizes: (u16, u16, u32), metadata: &[u8]) -> Vec<u8> {
    let mut body = sizes.0.to_be_bytes().to_vec();
    body.extend(sizes.1.to_be_bytes());
    body.extend(sizes.2.to_be_bytes());
    body.extend(1_u32.to_be_bytes());
    body.extend(pose());
    body.extend(metadata);
    raw(2, b"TRANSFORM", &body)
}

/// One entry of metadata, "key" = "ab", with a size of the value as given.
fn entry(value: u32) -> Vec<u8> {
    let mut bytes = [0, 1, 0, 3, 0, 3].to_vec();
    bytes.extend(value.to_be_bytes());
    bytes.extend(b"keyab");
    bytes
}

/// The first 72 bytes of an IMAGE of so many voxels along each axis.
fn image(size: u16) -> Vec<u8> {
    let mut body = vec![0, 1, 1, 4, 2, 2];
    body.extend([size.to_be_bytes(); 3].concat());
    body.extend([0; 54]);
    body.extend([size.to_be_bytes(); 3].concat());
    body
}

fn check(table: &[(&str, Vec<u8>, Answer)]) {
    for (name, bytes, wanted) in table {
        assert_eq!(answer(bytes), *wanted, "{name}");
    }
}

#[test]
fn a_header_that_is_none_closes_the_connection() {
    let garbage: Vec<u8> = (0..4096_u32).map(|i| (i * 197 + 13) as u8).collect();
    let http =
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUser-Agent: a-browser-on-the-wrong-port\r\n\r\n";
    check(&[
        ("58 zero bytes", vec![0; HEADER_BYTES], Close(ConfigurationError)),
        ("garbage", garbage, Close(ConfigurationError)),
        ("HTTP", http.to_vec(), Close(ConfigurationError)),
        ("version 0", with(0, &[0, 0]), Close(ConfigurationError)),
        ("version 3", with(0, &[0, 3]), Close(ConfigurationError)),
        ("version 65535", with(0, &[255, 255]), Close(ConfigurationError)),
        ("type empty", raw(1, b"", &pose()), Close(ConfigurationError)),
        ("type not ASCII", raw(1, b"\xff\xfe\x80TRANS", &pose()), Close(ConfigurationError)),
        ("type with a control character", raw(1, b"TRANS\n", &pose()), Close(ConfigurationError)),
    ]);
}

#[test]
fn a_size_beyond_the_limit_closes_the_connection_with_11() {
    for size in [1 << 63, u64::MAX, u64::MAX - 57, 1 << 31, (1 << 32) - 1, 1 << 30, (64 << 20) + 1]
    {
        let bytes = with(42, &size.to_be_bytes());
        assert_eq!(answer(&bytes), Close(NotEnoughResources), "{size}");
    }
}

#[test]
fn the_limit_is_the_callers() {
    let bytes = raw(1, b"TRANSFORM", &pose());
    let (head, _) = bytes.split_first_chunk().expect("a header");
    assert!(Header::read_within(head, &Limits { body: 48 }).is_ok());
    let small = Header::read_within(head, &Limits { body: 47 });
    assert_eq!(small, Err(HeaderError::TooLarge { announced: 48, limit: 47 }));
}

#[test]
fn a_wrong_checksum_drops_the_message_and_keeps_the_connection() {
    let mut flipped = raw(1, b"TRANSFORM", &pose());
    flipped[HEADER_BYTES + 7] ^= 1;
    check(&[
        ("CRC 1", with(50, &1_u64.to_be_bytes()), Keep(ChecksumError)),
        ("CRC 0 is not 'no CRC'", with(50, &[0; 8]), Keep(ChecksumError)),
        ("one bit of the body", flipped, Keep(ChecksumError)),
    ]);
}

#[test]
fn names_are_read_to_the_first_nul_and_by_case() {
    check(&[
        ("twelve letters need no NUL", raw(1, b"ABCDEFGHIJKL", b"abcd"), Unknown),
        ("rubbish after the NUL", raw(1, b"TRANSFORM\0xy", &pose()), Answer::Read),
        ("lower case", raw(1, b"transform", &pose()), Unknown),
        ("unknown, 1 MB", raw(1, b"NOSUCHTYPE", &vec![b'z'; 1_000_000]), Unknown),
        ("unknown query", raw(1, b"GET_NOSUCH", b""), Unknown),
        ("device not ASCII", with(14, &b"\xc3\x28".repeat(10)), Answer::Read),
    ]);
    let bytes = with(14, &b"\xc3\x28".repeat(10));
    let message = read(&bytes).expect("read above");
    assert_eq!(message.device, "\u{c3}(".repeat(10));
    assert_eq!(write(&message), bytes, "the device gets its own name back");
}

#[test]
fn a_body_of_the_wrong_size_keeps_the_connection() {
    let longer = [pose(), b"x".to_vec()].concat();
    let cells = [&[0xff; 40][..], &[0; 40]].concat();
    let table: [(&str, &[u8], Vec<u8>); 19] = [
        ("TRANSFORM of 47", b"TRANSFORM", pose()[..47].to_vec()),
        ("TRANSFORM of 49", b"TRANSFORM", longer),
        ("TRANSFORM of 0", b"TRANSFORM", Vec::new()),
        ("IMAGE claims 65535^3", b"IMAGE", [image(65535), vec![0; 64]].concat()),
        ("IMAGE without voxels", b"IMAGE", image(2)),
        ("IMAGE with voxels too many", b"IMAGE", [image(2), vec![0; 17]].concat()),
        ("IMAGE cut", b"IMAGE", image(2)[..71].to_vec()),
        ("POLYDATA counts lie", b"POLYDATA", cells),
        ("POLYDATA empty", b"POLYDATA", Vec::new()),
        ("TDATA of 71", b"TDATA", vec![0; 71]),
        ("QTDATA of 49", b"QTDATA", vec![0; 49]),
        ("STRING length lies", b"STRING", b"\0\x03\xff\xffabc".to_vec()),
        ("STRING with more", b"STRING", b"\0\x03\0\x01abc".to_vec()),
        ("SENSOR 255, no data", b"SENSOR", [vec![255], vec![0; 9]].concat()),
        ("POSITION of 20", b"POSITION", vec![0; 20]),
        ("POINT of 137", b"POINT", vec![0; 137]),
        ("STATUS of 29", b"STATUS", vec![0; 29]),
        ("CAPABILITY of 13", b"CAPABILITY", vec![b'A'; 13]),
        ("STT_QTDATA with a status byte", b"STT_QTDATA", vec![0; 37]),
    ];
    for (name, kind, body) in table {
        assert_eq!(answer(&raw(1, kind, &body)), Keep(ConfigurationError), "{name}");
    }
}

#[test]
fn fields_of_an_image_without_meaning_are_refused() {
    let good = [image(2), vec![0; 16]].concat();
    assert_eq!(answer(&raw(1, b"IMAGE", &good)), Answer::Read);
    // Version, components, scalar, endian, frame, start of the sub-volume.
    for (place, value) in [(1, 2), (2, 0), (3, 9), (4, 3), (5, 0), (61, 1)] {
        let mut bad = good.clone();
        bad[place] = value;
        assert_eq!(answer(&raw(1, b"IMAGE", &bad)), Keep(ConfigurationError), "byte {place}");
    }
}

#[test]
fn version_2_that_lies_about_its_parts_keeps_the_connection() {
    let many = [65535_u16.to_be_bytes().to_vec(), vec![0; 40]].concat();
    let short = raw(2, b"TRANSFORM", &[0, 12, 0, 0]);
    // 16 bytes of extended header: what is more than 12 is skipped.
    let mut larger = 16_u16.to_be_bytes().to_vec();
    larger.extend([0, 2, 0, 0, 0, 0, 0, 0, 0, 9, 1, 2, 3, 4]);
    larger.extend(pose());
    larger.extend([0, 0]);
    check(&[
        ("good", two((12, 2, 0), &[0, 0]), Answer::Read),
        ("good, with metadata", two((12, 10, 5), &entry(2)), Answer::Read),
        ("good, without a count", two((12, 0, 0), &[]), Answer::Read),
        ("good, longer extended header", raw(2, b"TRANSFORM", &larger), Answer::Read),
        ("body of 4", short, Keep(ConfigurationError)),
        ("body of 0", raw(2, b"TRANSFORM", &[]), Keep(ConfigurationError)),
        ("extended header of 0", two((0, 2, 0), &[0, 0]), Keep(ConfigurationError)),
        ("extended header of 65535", two((65535, 2, 0), &[0, 0]), Keep(ConfigurationError)),
        ("metadata of 2^32-1", two((12, 2, u32::MAX), &[0, 0]), Keep(ConfigurationError)),
        ("metadata header of 65535", two((12, 65535, 0), &[0, 0]), Keep(ConfigurationError)),
        ("metadata header of 1", two((12, 1, 0), &[0]), Keep(ConfigurationError)),
        ("65535 entries", two((12, 42, 0), &many), Keep(ConfigurationError)),
        ("value of 2^32-1", two((12, 10, 5), &entry(u32::MAX)), Keep(ConfigurationError)),
        ("value too short", two((12, 10, 5), &entry(1)), Keep(ConfigurationError)),
        ("content too short", two((13, 2, 0), &[0, 0]), Keep(ConfigurationError)),
    ]);
}

#[test]
fn a_body_that_was_not_read_whole_is_an_error_that_closes() {
    let bytes = raw(1, b"TRANSFORM", &pose());
    assert_eq!(answer(&bytes[..bytes.len() - 1]), Close(ConfigurationError));
}

#[test]
fn numbers_that_make_no_pose_come_through() {
    let mut numbers =
        [f32::NAN, f32::INFINITY, 3e38, 1e-42, -1.0, 1.02].map(f32::to_be_bytes).concat();
    numbers.resize(48, 0);
    let bytes = raw(1, b"TRANSFORM", &numbers);
    let message = read(&bytes).expect("the wire takes all numbers");
    assert_eq!(write(&message), bytes, "to the bit");
}

#[test]
fn more_items_than_their_memory_is_worth_are_refused_with_11() {
    let metadata = |count: u16| {
        let header = [count.to_be_bytes().to_vec(), vec![0; 8 * usize::from(count)]].concat();
        two((12, 2 + 8 * count, 0), &header)
    };
    let names = |count: usize| raw(1, b"CAPABILITY", &b"TRANSFORM\0\0\0".repeat(count));
    let tools = |count: usize| raw(1, b"TDATA", &vec![0; 70 * count]);
    let attributes = |count: u32| {
        let mut body = vec![0; 36];
        body.extend(count.to_be_bytes());
        body.extend([0, 1, 0, 0, 0, 0].repeat(count as usize));
        // Names without letters, to an even length.
        body.extend(vec![0; count.next_multiple_of(2) as usize]);
        raw(1, b"POLYDATA", &body)
    };
    for most in [metadata(500), names(1000), tools(10_000), attributes(500)] {
        let message = read(&most).expect("as many as may be");
        assert!(held(&message) <= most.len() - HEADER_BYTES + MARGIN, "{}", held(&message));
        assert_eq!(write(&message).len(), most.len());
    }
    for more in [metadata(501), names(1001), tools(10_001), attributes(501)] {
        assert_eq!(answer(&more), Keep(NotEnoughResources));
    }
}

#[test]
fn large_bodies_cost_what_they_bring() {
    let status = [&[0, 1][..], &[0; 28], &[0xFF; 1 << 20]].concat();
    let text = [&[0, 3, 0xFF, 0xFF][..], &[0xFF; 65535]].concat();
    // A million cells without points.
    let mut cells = vec![0; 40];
    cells[4..12].copy_from_slice(&[0, 0x10, 0, 0, 0, 0x40, 0, 0]);
    cells.resize(40 + (4 << 20), 0);
    // An attribute with a long name that is no text.
    let mut attribute = vec![0; 40];
    attribute[39] = 1;
    attribute.extend([0, 1, 0, 0, 0, 0]);
    attribute.resize(attribute.len() + 999_999, 0xFF);
    attribute.push(0);
    let bodies: [(&[u8], Vec<u8>); 8] = [
        (b"STATUS", status),
        (b"STRING", text),
        (b"POLYDATA", cells),
        (b"POLYDATA", attribute),
        (b"POINT", vec![0xFF; 136 * 10_000]),
        (b"IMAGE", [image(128), vec![7; 2 << 21]].concat()),
        (b"GET_POINT", vec![7; 1 << 20]),
        (b"NOSUCHTYPE", vec![7; 1 << 20]),
    ];
    for (kind, body) in bodies {
        let message = read(&raw(1, kind, &body)).expect("well formed");
        let held = held(&message);
        assert!(held <= body.len() + MARGIN, "{:?}: {held}", message.content.kind());
        assert_eq!(format!("{:?}", read(&write(&message)).expect("ours")), format!("{message:?}"));
    }
}

#[test]
fn every_error_has_words_and_an_answer_that_can_be_sent() {
    let bad = [with(0, &[0, 9]), with(2, b"\xff"), with(42, &[255; 8]), with(50, &[1; 8])];
    for bytes in bad.iter().chain([&two((0, 2, 0), &[0, 0]), &raw(1, b"POSITION", &[0; 20])]) {
        let status = match read(bytes).expect_err("bad") {
            Wrong::Header(error) => error.status(),
            Wrong::Body(error) => error.status(),
            Wrong::Short => panic!("not short"),
        };
        assert!(status.text.len() > 30 && status.text.is_ascii(), "{}", status.text);
        let message = Message::new("supine", Stamp::NONE, Content::Status(status.clone()));
        let back = read(&write(&message)).expect("our own");
        assert_eq!(back.content, Content::Status(status));
    }
}

#[test]
fn what_a_field_cannot_hold_is_cut_and_the_message_stays_good() {
    use supine_openigtlink::{Sensor, Text};
    let mut message = Message::new(&"d".repeat(30), Stamp::NONE, Content::Text(Text::new("a")));
    message.version = Version::Two;
    message.metadata = vec![("k".repeat(70_000), "v".to_owned()); 600];
    message.content = Content::Text(Text::new(&"\u{e9}".repeat(40_000)));
    let back = read(&write(&message)).expect("our own");
    assert_eq!(back.device, "d".repeat(20));
    assert_eq!((back.metadata.len(), back.metadata[0].0.len()), (500, 65535));
    assert!(matches!(&back.content, Content::Text(text) if text.text.len() == 65534));
    message.content = Content::Sensor(Sensor { unit: 0, values: vec![1.0; 300] });
    let back = read(&write(&message)).expect("our own");
    assert!(matches!(&back.content, Content::Sensor(sensor) if sensor.values.len() == 255));
}

#[test]
fn messages_follow_each_other_in_one_buffer() {
    let first = Message::new("a", Stamp(1), Content::Capabilities(vec!["POINT".to_owned()]));
    let second = Message::new("b", Stamp(2), Content::Points(Vec::new()));
    let mut both = Vec::new();
    first.write(&mut both);
    second.write(&mut both);
    assert_eq!(both, [write(&first), write(&second)].concat());
}

/// SplitMix64: the same numbers everywhere.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ mixed >> 31) % end.max(1) as u64) as usize
    }

    /// One change to a message: a byte, a number at an end of its range, a cut, more bytes, bytes
    /// twice.
    fn change(&mut self, bytes: &mut Vec<u8>) {
        // Mostly behind the header, and there mostly where sizes and counts stand.
        let from = if self.below(8) == 0 { 0 } else { HEADER_BYTES.min(bytes.len()) };
        let reach = if self.below(2) == 0 { 64 } else { usize::MAX };
        let place = from + self.below((bytes.len() - from).min(reach));
        match self.below(6) {
            0 | 1 => {
                let value = [0, 1, 0x7F, 0x80, 0xFF, self.below(256) as u8][self.below(6)];
                bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte = value);
            }
            2 => bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte ^= 1 << self.below(8)),
            3 => {
                let number = [0_u32, 1, 2, 0x7FFF_FFFF, 0xFFFF_FFFF, 0xFFFF][self.below(6)];
                let places = bytes.iter_mut().skip(place);
                places.zip(number.to_be_bytes()).for_each(|(to, from)| *to = from);
            }
            4 => bytes.truncate(place.max(from)),
            _ => {
                let end = (place + self.below(40)).min(bytes.len());
                let twice = bytes[place.min(end)..end].to_vec();
                bytes.splice(place..place, twice);
            }
        }
    }
}

/// Mutates messages; how many of them are read, refused by their header and by their body.
fn mutate(rounds: usize, seed: u64) -> [usize; 3] {
    let seeds = vectors();
    let mut dice = Dice(seed);
    let mut counts = [0; 3];
    for round in 0..rounds {
        let mut bytes = seeds[round % seeds.len()].bytes.clone();
        for _ in 0..=dice.below(3) {
            dice.change(&mut bytes);
        }
        if dice.below(10) > 0 {
            repair(&mut bytes);
        }
        let body = bytes.len().saturating_sub(HEADER_BYTES);
        match read(&bytes) {
            Ok(message) => {
                assert!(held(&message) <= body + MARGIN, "round {round}: {}", held(&message));
                let once = write(&message);
                let again = read(&once).unwrap_or_else(|e| panic!("round {round}: {e:?}"));
                assert_eq!(write(&again), once, "round {round}");
                // In words, since NaN is not equal to itself.
                assert_eq!(format!("{again:?}"), format!("{message:?}"), "round {round}");
                counts[0] += 1;
            }
            Err(Wrong::Short | Wrong::Header(_)) => counts[1] += 1,
            Err(Wrong::Body(_)) => counts[2] += 1,
        }
    }
    counts
}

#[test]
fn a_hundred_thousand_damaged_messages_are_read_or_refused_and_cost_what_they_bring() {
    let counts = mutate(100_000, 1);
    // Each way is gone often, or the damage is not what it should be.
    assert!(counts.iter().all(|count| *count > 3000), "{counts:?}");
}
