use super::*;
use proptest::prelude::*;
use supine_space::Progress;

const FILES: [&[u8]; 6] = [
    include_bytes!("../../tests/data/sitk.nrrd"),
    include_bytes!("../../tests/data/sitk_float.nrrd"),
    include_bytes!("../../tests/data/pynrrd_ras_big_raw.nrrd"),
    include_bytes!("../../tests/data/pynrrd_las_ascii.nrrd"),
    include_bytes!("../../tests/data/slicer_layers.seg.nrrd"),
    include_bytes!("../../tests/data/slicer_cropped.seg.nrrd"),
];

/// Two by one by one voxels of 8 bit, with one line of the header changed or left out.
fn changed(field: &str, line: &str) -> Result<Raster, Problem> {
    let header = [
        "type: uint8",
        "dimension: 3",
        "space: LPS",
        "sizes: 2 1 1",
        "space directions: (1,0,0) (0,1,0) (0,0,1)",
        "encoding: raw",
        "space origin: (0,0,0)",
    ];
    let name = format!("{field}:");
    let mut text = String::from("NRRD0004\r\n");
    for known in header.into_iter().filter(|l| !l.starts_with(&name)).chain([line]) {
        text += known;
        text += if known.is_empty() { "" } else { "\r\n" };
    }
    text += "\r\n\x01\x02";
    parse(text.as_bytes(), Progress::none())
}

#[test]
fn the_plain_header_is_read() {
    let raster = changed("", "").unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap(), [1, 2]);
    assert_eq!(raster.grid.size(), [2, 1, 1]);
    let skipped = changed("sizes", "byte skip: 1\r\nsizes: 1 1 1").unwrap();
    assert_eq!(skipped.whole::<i16>("").unwrap(), [2]);
    let tail = changed("sizes", "byte skip: -1\r\nsizes: 1 1 1").unwrap();
    assert_eq!(tail.whole::<i16>("").unwrap(), [2]);
    let key = changed("", "note:=a\\nb\\\\c").unwrap();
    assert_eq!(key.keys["note"], "a\nb\\c");
}

#[test]
fn unusable_headers_are_refused_by_name() {
    let refused = [
        ("space", "", "`space`: is missing"),
        ("space", "space: 3D-right-handed", "3D-right-handed"),
        ("space", "space: RAST", "`RAST` is not an anatomical frame of three axes"),
        ("space directions", "spacings: 1 1 1", "`space directions`: is missing"),
        ("space directions", "space directions: (1,0,0) (0,1,0)", "2 entries for 3 axes"),
        ("space directions", "space directions: (1,0,0) (0,1,0) none", "expected three axes"),
        ("space directions", "space directions: (1,0,0) (0,1,0) (1,0,0)", "not orthonormal"),
        ("space directions", "space directions: (1,0,0) (0,1,0) (0,0,x)", "is not a vector"),
        ("space origin", "", "`space origin`: is missing"),
        ("sizes", "sizes: 2 1", "2 numbers for dimension 3"),
        ("sizes", "sizes: 2 1 -1", "are not counts"),
        ("sizes", "sizes: 0 1 1", "grid size"),
        ("sizes", "sizes: 3 1 1", "asks for 3 bytes, there are 2"),
        ("sizes", "sizes: 1 1 1", "more data than the 1 bytes"),
        ("sizes", "sizes: 10000 10000 10000", "asks for 1000000000000 bytes, there are 2"),
        ("sizes", "sizes: 9999999999999 9999999999999 9999999999999", "grid size"),
        ("type", "type: int16", "`endian`: is missing"),
        ("type", "type: block", "`block` is not a type of numbers"),
        ("encoding", "encoding: bz2", "encoding `bz2`"),
        ("encoding", "encoding: gzip", "asks for 2 bytes, there are 0"),
        ("encoding", "encoding: gzip\r\nbyte skip: -1", "only raw data allow"),
        ("", "data file: other.raw", "data are in another file (`other.raw`)"),
        ("", "byte skip: 3", "beyond the end"),
        ("", "sizes: 2 1 1", "line 9: `sizes` is given twice"),
        ("", "space units: \"m\" \"m\" \"m\"", "instead of \"mm\""),
        ("", "nonsense", "`nonsense` is neither a field nor a key"),
    ];
    for (field, line, expected) in refused {
        let message = changed(field, line).unwrap_err().to_string();
        assert!(message.contains(expected), "{line}: {message}");
    }
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for file in FILES {
        // A cut in the last number of a text cannot be seen.
        let text = file.windows(5).any(|w| w == b"ascii");
        for end in 0..file.len() - if text { 4 } else { 0 } {
            assert!(
                parse(&file[..end], Progress::none()).is_err(),
                "cut at {end} of {}",
                file.len()
            );
        }
    }
}

#[test]
fn unusable_values_are_refused_with_their_voxel() {
    let text = "NRRD0004\ntype: double\ndimension: 3\nspace: LPS\nsizes: 1 2 1\nspace directions: \
                (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: text\n\n";
    for (numbers, expected) in [
        ("1 40000", "voxel (0, 1, 0) has the value 40000"),
        ("1 0.5", "voxel (0, 1, 0) has the value 0.5"),
        ("nan 1", "voxel (0, 0, 0) has the value NaN"),
        ("inf 1", "voxel (0, 0, 0) has the value inf"),
        ("-1e300 1", "voxel (0, 0, 0) has the value -1"),
    ] {
        let raster = parse(format!("{text}{numbers}\n").as_bytes(), Progress::none()).unwrap();
        let message = raster.whole::<i16>("expected HU").unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
    assert!(parse(format!("{text}1 x\n").as_bytes(), Progress::none()).is_err());
    assert!(parse(format!("{text}1\n").as_bytes(), Progress::none()).is_err());
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        file in 0..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        header_only in any::<bool>(),
    ) {
        let mut bytes = FILES[file].to_vec();
        let head = bytes.windows(2).position(|w| w == b"\n\n").unwrap();
        for (at, value) in changes {
            let range = if header_only { head } else { bytes.len() };
            let at = at.index(range);
            bytes[at] = value;
        }
        if let Ok(raster) = parse(&bytes, Progress::none()) {
            prop_assert_eq!(raster.bytes.len(), raster.grid.len() * raster.layers * raster.scalar.size());
            let _ = raster.whole::<i16>("");
        }
    }

    #[test]
    fn no_digit_of_the_header_makes_it_panic(
        file in 0..FILES.len(),
        at in any::<prop::sample::Index>(),
        digits in "[-0-9]{1,12}",
    ) {
        let head = FILES[file].windows(2).position(|w| w == b"\n\n").unwrap();
        let numbers: Vec<usize> = (0..head).filter(|&n| FILES[file][n].is_ascii_digit()).collect();
        let mut bytes = FILES[file].to_vec();
        bytes.splice(numbers[at.index(numbers.len())]..=numbers[at.index(numbers.len())], digits.bytes());
        let _ = parse(&bytes, Progress::none());
    }
}

#[test]
fn a_signed_distance_comes_back() {
    use crate::{read_signed_distance, write_ct_nrrd, write_signed_distance};
    use supine_space::{Grid, Matrix, Point, Vector};
    use supine_volume::SignedDistance;
    let grid =
        Grid::new([9, 8, 7], Vector::new(1.0, 1.5, 3.0), Point::origin(), Matrix::identity());
    let grid = grid.unwrap();
    let inside = |n: usize| grid.voxel(n)[0] < 4;
    let distance = SignedDistance::new(&grid, 5.0, inside, |_, _| 0.25);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("skin.nrrd");
    write_signed_distance(&distance, &path, Progress::none()).unwrap();
    assert_eq!(read_signed_distance(&path, Progress::none()).unwrap(), distance);
    write_ct_nrrd(distance.values(), &path, "", Progress::none()).unwrap();
    let error = read_signed_distance(&path, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("1/2000 mm"), "{error}");
}
