use super::*;
use proptest::prelude::*;

#[test]
fn csv_as_it_comes() {
    let text = b"\xef\xbb\xbfName,X,y,Z\r\n\"a, \"\"b\"\"\",1.5,-2,3e1\r\n nipple , 4 ,5,6\r\n";
    let points = parse_csv(text).unwrap();
    assert_eq!(points.len(), 2);
    assert_eq!(points[0].name, "a, \"b\"");
    assert_eq!(points[0].position, Point::new(1.5, -2.0, 30.0));
    assert_eq!(points[1].name, "nipple");
    assert_eq!(points[1].position, Point::new(4.0, 5.0, 6.0));
    assert!(parse_csv(b"name,x,y,z\n").unwrap().is_empty());
}

#[test]
fn a_name_that_a_spreadsheet_would_compute_is_written_as_text_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.csv");
    let points = ["=HYPERLINK(\"x\")", "-clip", "clip", "'=1"]
        .map(|name| NamedPoint { name: name.into(), position: Point::new(1.0, 2.0, 3.0) });
    write_points(&points, &path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.lines().all(|line| !line.starts_with(['=', '-']) && !line.starts_with("\"=")),
        "{text}"
    );
    assert_eq!(read_points(&path).unwrap(), points);
}

#[test]
fn unusable_tables_are_refused_with_their_line() {
    for (text, expected) in [
        ("a,1,2,3\n", "line 1: `a,1,2,3` instead of the heading"),
        ("name;x;y\na;1;2\n", "line 1: `name,x,y` instead of the heading"),
        ("name;x;y;z\na;1,5;2;3\n", "line 2: `1,5` is not a coordinate"),
        ("name,x,y,z\na,1,2,3\nb,1,2,z\n", "line 3: `z` is not a coordinate"),
        ("name,x,y,z\na,1,2,inf\n", "line 2: `inf` is not a coordinate"),
        ("name,x,y,z\na,1,2\n", "line 2: "),
        ("", "line 1"),
    ] {
        let message = parse_csv(text.as_bytes()).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn tables_of_spreadsheets_are_read_and_other_texts_are_told_as_what_they_are() {
    for text in
        ["name;x;y;z\r\nM\u{fc}ller, A;1;2;3\r\n", "Name\tX\tY\tZ\nM\u{fc}ller, A\t1\t2\t3\n"]
    {
        let points = parse_csv(text.as_bytes()).unwrap();
        assert_eq!(points[0].name, "M\u{fc}ller, A");
        assert_eq!(points[0].position, Point::new(1.0, 2.0, 3.0));
    }
    for (bytes, told) in [
        (&b"name,x,y,z\nM\xfcller,1,2,3\n"[..], "the byte FC in line 2 is no UTF-8"),
        (b"\xff\xfen\0a\0m\0e\0", "it is UTF-16 and not UTF-8: save it as UTF-8"),
    ] {
        let message = parse_csv(bytes).unwrap_err().to_string();
        assert!(message.contains(told), "{message}");
    }
}

fn markup(inner: &str) -> Vec<u8> {
    format!("{{\"markups\":[{{\"type\":\"Fiducial\",{inner}}}]}}").into_bytes()
}

#[test]
fn markups_say_their_frame() {
    let point = "\"controlPoints\":[{\"label\":\"a\",\"position\":[1,2,3]}]";
    let read = |frame: &str| {
        markups::parse(&markup(&format!("{frame}{point}"))).map(|l| l[0].points[0].position)
    };
    assert_eq!(read("").unwrap(), Point::new(1.0, 2.0, 3.0));
    assert_eq!(read("\"coordinateSystem\":\"LPS\",").unwrap(), Point::new(1.0, 2.0, 3.0));
    assert_eq!(read("\"coordinateSystem\":\"RAS\",").unwrap(), Point::new(-1.0, -2.0, 3.0));
    let foreign = read("\"coordinateSystem\":\"IJK\",").unwrap_err().to_string();
    assert!(foreign.contains("`IJK` is neither LPS nor RAS"), "{foreign}");
    let inches = read("\"coordinateUnits\":\"in\",").unwrap_err().to_string();
    assert!(inches.contains("`in` instead of mm"), "{inches}");
    assert!(read("\"coordinateUnits\":[\"mm\",\"UCUM\",\"millimeter\"],").is_ok());
}

#[test]
fn points_never_placed_are_left_out_and_broken_ones_refused() {
    let two = markup(
        "\"controlPoints\":[{\"label\":\"a\",\"positionStatus\":\"undefined\"},\
         {\"label\":\"b\",\"position\":[1,2,3],\"positionStatus\":\"defined\"}]",
    );
    let lists = markups::parse(&two).unwrap();
    assert_eq!(lists[0].points.len(), 1);
    let broken = markup("\"controlPoints\":[{\"label\":\"a\",\"position\":[1,2]}]");
    let message = markups::parse(&broken).unwrap_err().to_string();
    assert_eq!(message, "point 1 (`a`): `position` is not three numbers");
    assert!(markups::parse(b"[]").is_err());
    assert!(markups::parse(&[b'['; 100_000]).is_err());
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = parse_csv(&bytes);
        let _ = parse_csv(&[b"name,x,y,z\n".as_slice(), &bytes].concat());
        let _ = markups::parse(&bytes);
    }
}
