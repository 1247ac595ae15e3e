use super::*;
use crate::{Problem, raster::Raster};
use proptest::prelude::*;
use supine_space::Progress;

const FILES: [&[u8]; 2] = [
    include_bytes!("../../tests/data/sitk.mha"),
    include_bytes!("../../tests/data/sitk_left_handed.mha"),
];

/// Two voxels along i, bytes 7 and 9, without the last line.
const HEADER: &str = "ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n\
                      Offset = 1 2 3\nElementSpacing = 1 1 2\nDimSize = 2 1 1\nElementType = MET_UCHAR\n";

fn with_header(header: &str, data: &[u8]) -> Result<Raster, Problem> {
    let bytes = [header.as_bytes(), b"ElementDataFile = LOCAL\n", data].concat();
    parse(&bytes, None, Progress::none())
}

#[test]
fn a_small_file_is_read() {
    let raster = with_header(HEADER, &[7, 9]).unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap(), [7, 9]);
    assert_eq!((raster.grid.spacing().z, raster.grid.origin().y), (2.0, 2.0));
    // Other names of the same, ends of lines of Windows, words that decide nothing.
    let other = HEADER.replace("TransformMatrix", "Rotation").replace("Offset", "Position");
    let other = format!("{other}AnatomicalOrientation = RAI\nModality = MET_MOD_CT\n");
    let raster = with_header(&other.replace('\n', "\r\n"), &[7, 9]).unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap(), [7, 9]);
    let vectors = HEADER.replace("2 1 1", "1 1 1") + "ElementNumberOfChannels = 2\n";
    let raster = with_header(&vectors, &[7, 9]).unwrap();
    assert_eq!((raster.layers, raster.layers_first), (2, true));
    // All but the last two bytes lie ahead.
    let raster = with_header(&format!("{HEADER}HeaderSize = -1\n"), &[1, 2, 7, 9]).unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap(), [7, 9]);
}

#[test]
fn unusable_headers_are_refused_by_name() {
    let changed = |from: &str, to: &str| HEADER.replace(from, to);
    let more = |line: &str| format!("{HEADER}{line}\n");
    for (header, expected) in [
        (changed("= Image", "= Tube"), "`Tube` is not Image"),
        (changed("NDims = 3", "NDims = 4"), "4 instead of 3"),
        (changed("NDims = 3\n", ""), "`NDims`: is missing"),
        (changed("BinaryData = True", "BinaryData = False"), "samples as text"),
        (changed("BinaryData = True", "BinaryData = Yes"), "neither True nor False"),
        (changed("TransformMatrix", "Matrix"), "left and right of the patient are not known"),
        (changed("Offset", "Start"), "`Offset`: is missing"),
        (changed("0 0 0 1\n", "0 0 0\n"), "instead of 9 numbers"),
        (changed("= 1 0 0 0 1", "= 1 0 0 0 nan"), "not finite"),
        (changed("1 0 0 0 1 0 0 0 1", "1 1 0 0 1 0 0 0 1"), "not orthonormal"),
        (changed("ElementSpacing", "ElementSize"), "`ElementSpacing`: is missing"),
        (changed("= 1 1 2", "= 1 0 2"), "spacing"),
        (changed("DimSize = 2 1 1", "DimSize = 2 1 -1"), "instead of 3 numbers"),
        (changed("DimSize = 2 1 1", "DimSize = 2 1 0"), "size"),
        (changed("DimSize = 2 1 1", "DimSize = 4000000000 4000000000 9"), "more"),
        (changed("DimSize = 2 1 1", "DimSize = 3 1 1"), "the data end early"),
        (changed("DimSize = 2 1 1", "DimSize = 1 1 1"), "more data than the 1 bytes"),
        (changed("MET_UCHAR", "MET_LONG"), "`MET_LONG` is not"),
        (changed("ElementType = MET_UCHAR\n", ""), "`ElementType`: is missing"),
        (more("Position = 0 0 0"), "`Offset`: is given twice"),
        (more("NDims = 3"), "line 9: `NDims` is given twice"),
        (more("no key"), "line 9: `no key` is not"),
        (more("CenterOfRotation = 1 0 0"), "`CenterOfRotation`"),
        (more("ElementToIntensityFunctionSlope = 2"), "is not 1"),
        (more("ElementToIntensityFunctionOffset = -1024"), "is not 0"),
        (more("ElementNumberOfChannels = 0"), "0 values per voxel"),
        (more("HeaderSize = 9"), "leads beyond the end"),
        (more("HeaderSize = -2"), "-2 is no number of bytes"),
        (more("CompressedData = True"), "damaged"),
        (more("CompressedData = True\nCompressedDataSize = 99"), "99 bytes, there are 2"),
    ] {
        let message = with_header(&header, &[7, 9]).unwrap_err().to_string();
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let message = parse(HEADER.as_bytes(), None, Progress::none()).unwrap_err().to_string();
    assert!(message.contains("does not end in a line `ElementDataFile"), "{message}");
}

#[test]
fn samples_may_lie_in_one_file_beside_the_header_only() {
    let file = |name: &str| format!("{HEADER}ElementDataFile = {name}").into_bytes();
    assert_eq!(data_file(&file("LOCAL")).unwrap(), None);
    assert_eq!(data_file(&file("a b.raw")).unwrap().as_deref(), Some("a b.raw"));
    let raster = parse(&file("a.raw"), Some(&[7, 9]), Progress::none()).unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap(), [7, 9]);
    for name in ["../a.raw", "/a.raw", "C:\\a.raw", "LIST", "LIST 2", "a%03d.raw 1 9 1", ""] {
        let message = data_file(&file(name)).unwrap_err().to_string();
        assert!(message.contains("save it as one file (.mha)"), "{name}: {message}");
    }
}

#[test]
fn a_header_without_an_end_is_not_searched_for_ever() {
    let long = [b"Comment = ".to_vec(), vec![b'x'; 1 << 20]].concat();
    assert!(is_meta_image(&long));
    let message = parse(&long, None, Progress::none()).unwrap_err().to_string();
    assert!(message.contains("line 1: the header does not end"), "{message}");
    let lines = (0..100_000).map(|n| format!("k{n} = 1\n")).collect::<String>();
    let message = parse(lines.as_bytes(), None, Progress::none()).unwrap_err().to_string();
    assert!(message.contains("the header does not end"), "{message}");
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for file in FILES {
        for end in 0..file.len() {
            assert!(parse(&file[..end], None, Progress::none()).is_err(), "cut at {end}");
        }
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        file in 0..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
    ) {
        let mut bytes = FILES[file].to_vec();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(raster) = parse(&bytes, None, Progress::none()) {
            prop_assert_eq!(raster.bytes.len(), raster.grid.len() * raster.layers * raster.scalar.size());
            let _ = raster.whole::<i16>("");
        }
    }
}
