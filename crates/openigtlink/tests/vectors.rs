//! The messages that three peers write are read as meant and written back byte for byte.

mod support;

use serde_json::Value;
use std::time::Duration;
use supine_openigtlink::{
    Attribute, AttributeKind, AttributeOf, Cells, Content, Endian, Image, ImageFrame, ImageLayout,
    MILLINEWTON, Outcome, PointItem, PolyData, Position, QuaternionTool, Query, Rotation, Rows,
    Scalar, Sensor, Stamp, Start, Status, StatusCode, Text, Tool, Verb, Version,
};
use support::{Vector, all_lines, read, vectors, write};

/// Longest way of a time from the one that was asked for: pyigtl keeps seconds as f64.
const TIME: Duration = Duration::from_micros(1);

const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is no text"))
}

fn list<T>(value: &Value, of: impl Fn(&Value) -> T) -> Vec<T> {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list")).iter().map(of).collect()
}

fn numbers<const N: usize>(value: &Value) -> [f32; N] {
    list(value, |v| number(v) as f32).try_into().unwrap_or_else(|_| panic!("{value}: {N}"))
}

fn integers<const N: usize>(value: &Value) -> [u16; N] {
    numbers::<N>(value).map(|v| v as u16)
}

/// The content that a line says it has.
fn meant(vector: &Vector) -> Content {
    let fields = &vector.fields;
    match vector.id.as_str() {
        "transform" => {
            let rows = list(&fields["matrix_rows"], numbers::<4>);
            Content::Transform(rows.try_into().expect("three rows"))
        }
        "transform_name_26" | "transform_ns_123456789" => Content::Transform(IDENTITY),
        "position_12" | "position_24" | "position_28" => meant_position(&vector.id, fields),
        "point_0" | "point_2" => Content::Points(meant_points(fields)),
        "polydata" | "polydata_attr" => Content::PolyData(meant_poly_data(fields)),
        id if id.starts_with("image") => Content::Image(meant_image(vector)),
        id if id.starts_with("string") => {
            let text = Text::new(text(&fields["string"]));
            assert_eq!(f64::from(text.encoding), number(&fields["encoding"]));
            Content::Text(text)
        }
        "status_ok" | "status_negative_sub" => meant_status(fields),
        "tdata_2" | "qtdata_1" | "sensor_mN" | "capability_3" => meant_values(vector),
        id => Content::Query(meant_query(id, fields)),
    }
}

fn meant_position(id: &str, fields: &Value) -> Content {
    let quaternion @ [x, y, z, _] = numbers(&fields["quaternion_xyzw"]);
    let rotation = match id {
        "position_12" => Rotation::None,
        "position_24" => Rotation::Vector([x, y, z]),
        _ => Rotation::Quaternion(quaternion),
    };
    Content::Position(Position { position: numbers(&fields["xyz"]), rotation })
}

fn meant_status(fields: &Value) -> Content {
    // The field has 20 characters.
    let name = fields.get("name").unwrap_or(&fields["name_given"]);
    Content::Status(Status {
        code: StatusCode::from(number(&fields["code"]) as u16),
        sub_code: number(&fields["sub"]) as i64,
        name: text(name).chars().take(20).collect(),
        text: text(&fields["message"]).to_owned(),
    })
}

/// One source lists the points, the other each property.
fn meant_points(fields: &Value) -> Vec<PointItem> {
    let item = |name: &Value, position: &Value, group: &Value, of: &Value| PointItem {
        name: text(name).into(),
        group: text(group).into(),
        rgba: numbers(&of["rgba"]).map(|value| value as u8),
        position: numbers(position),
        diameter: number(&of["diameter_field"]) as f32,
        owner: text(&of["owner"]).into(),
    };
    match fields.get("points") {
        Some(points) => list(points, |of| item(&of["name"], &of["xyz"], &of["group"], of)),
        None => list(&fields["names"], Value::clone)
            .iter()
            .zip(list(&fields["xyz"], Value::clone))
            .map(|(name, xyz)| item(name, &xyz, &fields["group"], fields))
            .collect(),
    }
}

fn meant_poly_data(fields: &Value) -> PolyData {
    let cells = |key: &str| {
        let cells = fields
            .get(key)
            .map(|cells| list(cells, |cell| list(cell, |index| number(index) as u32)));
        cells.unwrap_or_default().into_iter().collect::<Cells>()
    };
    let attribute = |of: &Value| {
        let (kind, components) = match text(&of["type"]) {
            "0x00 point scalar" => (AttributeKind::Scalars, 1),
            "0x01 point vector" => (AttributeKind::Vectors, 3),
            other => panic!("{other}"),
        };
        assert_eq!(number(&of["ncomp"]), f64::from(components));
        let values = list(&of["data"], |value| number(value) as f32);
        Attribute::new(AttributeOf::Points, kind, components, text(&of["name"]), values)
            .expect("whole samples")
    };
    PolyData {
        points: list(&fields["points"], numbers),
        vertices: cells("vertices"),
        lines: cells("lines"),
        polygons: cells("polygons"),
        strips: cells("strips"),
        attributes: fields.get("attributes").map(|all| list(all, attribute)).unwrap_or_default(),
    }
}

fn meant_image(vector: &Vector) -> Image {
    let fields = &vector.fields;
    // The array of two dimensions goes out with one voxel along i; the line gives its shape only.
    let flat = vector.id == "image_2d";
    let size = if flat { [1, 3, 2] } else { integers(&fields["size"]) };
    let [i, j, k] = if flat { [0.5, 1.0, 2.0] } else { numbers(&fields["spacing"]) };
    let down = fields.get("normal_k").map_or(1.0, |normal| numbers::<3>(normal)[2]);
    let steps = [[i, 0.0, 0.0], [0.0, j, 0.0], [0.0, 0.0, k * down]];
    // What the C++ library calls the origin is the centre.
    let centre = match fields.get("origin_set") {
        Some(centre) => numbers(centre),
        None => {
            let first = fields.get("first_voxel").map_or([10.0, 20.0, 30.0], numbers);
            ImageLayout::centre_of(first.map(f64::from), &steps, size)
        }
    };
    let little = flat || number(&fields["endian"]) == 2.0;
    let lps = flat || number(&fields["coord"]) == 2.0;
    let layout = ImageLayout {
        components: 1,
        scalar: Scalar::I16,
        endian: if little { Endian::Little } else { Endian::Big },
        frame: if lps { ImageFrame::Lps } else { ImageFrame::Ras },
        size,
        steps,
        centre,
        start: fields.get("subvolume_offset").map_or([0; 3], integers),
        extent: fields.get("subvolume_size").map_or(size, integers),
    };
    let voxels = (0..layout.data_bytes() as i16 / 2).map(|n| 100 * n - 300);
    let bytes = |v: i16| if little { v.to_le_bytes() } else { v.to_be_bytes() };
    Image::new(layout, voxels.flat_map(bytes).collect()).expect("a whole image")
}

fn meant_values(vector: &Vector) -> Content {
    let fields = &vector.fields;
    let kind = |of: &Value| (number(&of["type"]) as u8).into();
    match vector.id.as_str() {
        "tdata_2" => Content::TrackingData(list(&fields["tools"], |of| {
            let mut pose = IDENTITY;
            let place = [&of["tx"], &fields["ty"], &fields["tz"]];
            pose.iter_mut().zip(place).for_each(|(row, v)| row[3] = number(v) as f32);
            pose[0][1] = number(&fields["m01"]) as f32;
            Tool { name: text(&of["name"]).into(), kind: kind(of), pose }
        })),
        "qtdata_1" => Content::QuaternionTracking(vec![QuaternionTool {
            name: text(&fields["name"]).into(),
            kind: kind(fields),
            position: numbers(&fields["xyz"]),
            rotation: numbers(&fields["quaternion_xyzw"]),
        }]),
        "capability_3" => Content::Capabilities(list(&fields["types"], |t| text(t).to_owned())),
        _ => {
            assert_eq!(text(&fields["unit"]), "milli newton");
            Content::Sensor(Sensor { unit: MILLINEWTON, values: list(&fields["values"], number) })
        }
    }
}

fn meant_query(id: &str, fields: &Value) -> Query {
    let tracking = || Start::Tracking {
        interval_ms: number(&fields["resol_ms"]) as i32,
        coordinates: text(&fields["coord"]).into(),
    };
    let (verb, of) = match id {
        "stt_tdata" => (Verb::Start(tracking()), "TDATA"),
        "stp_tdata" => (Verb::Stop, "TDATA"),
        "rts_tdata_ok" => (Verb::Reply(Outcome::Done), "TDATA"),
        "get_trans" => (Verb::Get, "TRANSFORM"),
        "get_status" => (Verb::Get, "STATUS"),
        "get_capabil" => (Verb::Get, "CAPABILITY"),
        "get_image" => (Verb::Get, "IMAGE"),
        "get_point" => (Verb::Get, "POINT"),
        "get_polydata" => (Verb::Get, "POLYDATA"),
        other => panic!("{other}: what should it say?"),
    };
    Query::new(verb, of)
}

/// The device that a message names. The lines tell it of some only.
fn meant_device(vector: &Vector) -> &str {
    match vector.id.as_str() {
        "transform_name_26" => &text(&vector.fields["device_given"])[..20],
        "transform_ns_123456789" => "T",
        "point_2" => "Tumour",
        "point_0" => "Empty",
        "get_image" => "CT",
        "get_point" => "",
        "sensor_mN" => "Force",
        "status_ok" | "status_negative_sub" | "capability_3" => "supine",
        "get_status" | "get_capabil" => "supine",
        id if id.starts_with("transform") || id.starts_with("position") => "Applicator",
        id if id.starts_with("image") => "CTslice",
        id if id.starts_with("string") => "Note",
        id if id.ends_with("data") && !id.contains('_') || id == "get_polydata" => "Breast",
        "polydata_attr" => "Breast",
        id if id.contains("tdata") => "Tracker",
        "get_trans" => "Applicator",
        other => panic!("{other}: which device?"),
    }
}

fn meant_time(vector: &Vector) -> Duration {
    let odd = vector.id == "transform_ns_123456789";
    Duration::new(1_700_000_000, if odd { 123_456_789 } else { 250_000_000 })
}

#[test]
fn every_message_says_what_its_fields_tell() {
    let mut count = 0;
    for vector in vectors().iter().filter(|vector| !vector.is_malformed()) {
        let name = vector.name();
        let message = read(&vector.bytes).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        assert_eq!(message.content, meant(vector), "{name}");
        assert_eq!(message.device, meant_device(vector), "{name}");
        if let Some(device) = vector.fields.get("device") {
            assert_eq!(message.device, text(device), "{name}");
        }
        let time = message.stamp.since_1970().expect("a time");
        assert!(time.abs_diff(meant_time(vector)) < TIME, "{name}: {time:?}");
        if vector.version == 1 {
            assert_eq!((message.version, message.id), (Version::One, 0), "{name}");
            assert!(message.metadata.is_empty(), "{name}");
        } else {
            assert_eq!((message.version, message.id), (Version::Two, 7), "{name}");
            let metadata = [("frame", "LPS"), ("tol", "0.02")];
            let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned()));
            assert_eq!(message.metadata, metadata, "{name}");
        }
        count += 1;
    }
    assert_eq!(count, 103);
}

#[test]
fn every_message_is_written_back_byte_for_byte() {
    let mut from = std::collections::BTreeMap::new();
    for vector in vectors().iter().filter(|vector| !vector.is_malformed()) {
        let name = vector.name();
        let message = read(&vector.bytes).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        assert_eq!(write(&message), vector.bytes, "{name}");
        *from.entry((vector.source.clone(), vector.version)).or_insert(0) += 1;
    }
    let counts: Vec<i32> = from.into_values().collect();
    assert_eq!(counts, [29, 29, 29, 8, 8], "C++ 1.11, C++ 3.1 v1 and v2, pyigtl v1 and v2");
}

#[test]
fn what_is_made_from_the_fields_alone_is_the_same_bytes() {
    for vector in vectors().iter().filter(|vector| !vector.is_malformed()) {
        let mut message = read(&vector.bytes).expect("read above");
        message.content = meant(vector);
        message.device = meant_device(vector).to_owned();
        if vector.id != "transform_ns_123456789" {
            message.stamp = Stamp::from_since_1970(meant_time(vector));
        }
        assert_eq!(write(&message), vector.bytes, "{}", vector.name());
    }
}

#[test]
fn the_two_malformed_kinds_are_refused_and_the_connection_stays() {
    let malformed: Vec<_> = vectors().into_iter().filter(Vector::is_malformed).collect();
    assert_eq!(malformed.len(), 4);
    for vector in malformed {
        let wrong = read(&vector.bytes).expect_err("malformed");
        assert_eq!(wrong.answer(), (StatusCode::ConfigurationError, true), "{}", vector.name());
    }
}

#[test]
fn all_lines_of_the_file_are_accounted_for() {
    let lines = all_lines();
    let empty: Vec<_> = lines.iter().filter(|vector| vector.bytes.is_empty()).collect();
    assert_eq!((lines.len(), empty.len()), (111, 4));
    assert!(empty.iter().all(|vector| vector.fields.get("error").is_some()));
}

#[test]
fn messages_of_two_sources_that_are_the_same_bytes_are_31() {
    let mut bytes_of = std::collections::BTreeMap::<_, Vec<_>>::new();
    for vector in vectors() {
        bytes_of.entry((vector.id, vector.version)).or_default().push(vector.bytes);
    }
    let shared =
        bytes_of.into_values().filter(|all| all.len() > 1 && all.iter().all(|b| *b == all[0]));
    assert_eq!(shared.count(), 31);
}
