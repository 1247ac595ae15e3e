use super::*;
use crate::Problem;
use proptest::prelude::*;
use supine_space::Progress;

const FILES: [&[u8]; 5] = [
    include_bytes!("../../tests/data/sitk.nii.gz"),
    include_bytes!("../../tests/data/nibabel_qform.nii.gz"),
    include_bytes!("../../tests/data/nibabel_qform_left_handed.nii.gz"),
    include_bytes!("../../tests/data/nibabel_sform_big_scaled.nii.gz"),
    include_bytes!("../../tests/data/totalsegmentator_ml.nii.gz"),
];

fn plain(file: usize) -> Vec<u8> {
    crate::file::gunzip(FILES[file], 1 << 20, Progress::none()).unwrap().0
}

/// The first file with some bytes of its little-endian header changed.
fn changed(at: usize, bytes: &[u8]) -> Result<crate::raster::Raster, Problem> {
    let mut file = plain(0);
    file[at..at + bytes.len()].copy_from_slice(bytes);
    parse(&file, Progress::none())
}

#[test]
fn unusable_headers_are_refused_by_name() {
    let short = |n: i16| n.to_le_bytes().to_vec();
    let dims = |n: &[i16]| n.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let refused: [(usize, Vec<u8>, &str); 12] = [
        (0, 540i32.to_le_bytes().to_vec(), "NIfTI-2 is not read"),
        (0, 7i32.to_le_bytes().to_vec(), "7 is not 348"),
        (344, b"ni1\0".to_vec(), "data are in another file (.img)"),
        (344, b"xxxx".to_vec(), "`header`"),
        (40, dims(&[4, 5, 6, 7, 3]), "instead of one volume"),
        (40, dims(&[2, 5, 42]), "instead of one volume"),
        (40, dims(&[3, 10000, 10000, 10000]), "the data end early"),
        (70, short(128), "is not one real number"),
        (70, short(99), "`datatype`"),
        (252, dims(&[0, 0]), "`sform_code`"),
        (108, 1e9f32.to_le_bytes().to_vec(), "`vox_offset`"),
        (280, f32::NAN.to_le_bytes().to_vec(), "spacing [NaN, 1.1, 2.5] mm"),
    ];
    for (at, bytes, expected) in refused {
        let message = changed(at, &bytes).unwrap_err().to_string();
        assert!(message.contains(expected), "{at}: {message}");
    }
}

#[test]
fn an_sform_against_the_qform_is_refused_unless_one_of_them_is_not_set() {
    let float = |file: &[u8], at: usize| f32::from_le_bytes(file[at..at + 4].try_into().unwrap());
    let with_codes = |qform: i16, sform: i16, change: &dyn Fn(&mut Vec<u8>)| {
        let mut file = plain(0);
        change(&mut file);
        file[252..256].copy_from_slice(&[qform.to_le_bytes(), sform.to_le_bytes()].concat());
        parse(&file, Progress::none()).map(|raster| raster.grid)
    };
    let mirrored = |file: &mut Vec<u8>| {
        for at in [280, 284, 288, 292] {
            let turned = -float(file, at);
            file[at..at + 4].copy_from_slice(&turned.to_le_bytes());
        }
    };
    let shifted = |file: &mut Vec<u8>| {
        let beside = float(file, 268) + 0.5;
        file[268..272].copy_from_slice(&beside.to_le_bytes());
    };
    for (qform, sform) in [(1, 1), (1, 2), (2, 1), (1, 4)] {
        assert!(with_codes(qform, sform, &|_| {}).is_ok());
        for (change, how) in
            [(&mirrored as &dyn Fn(&mut Vec<u8>), ", mirrored"), (&shifted, "0.5 mm")]
        {
            let text = with_codes(qform, sform, change).unwrap_err().to_string();
            let named = [format!("sform (code {sform})"), format!("qform (code {qform})")];
            assert!(named.iter().all(|n| text.contains(n)) && text.contains(how), "{text}");
        }
    }
    for (qform, sform) in [(1, 0), (0, 2)] {
        for change in [&mirrored as &dyn Fn(&mut Vec<u8>), &shifted] {
            assert!(with_codes(qform, sform, change).is_ok());
        }
    }
}

#[test]
fn scaling_and_units_are_applied() {
    let slope = [0.5f32.to_le_bytes(), 10f32.to_le_bytes()].concat();
    let raster = changed(112, &slope).unwrap();
    // The first sample is -300, the second -299.
    assert!(raster.whole::<i16>("").unwrap_err().to_string().contains("-139.5"));
    let raster = changed(112, &[2f32.to_le_bytes(), 10f32.to_le_bytes()].concat()).unwrap();
    assert_eq!(raster.whole::<i16>("").unwrap()[..2], [-590, -588]);
    let raster = changed(123, &[3]).unwrap();
    assert!((raster.grid.spacing().x - 0.7e-3).abs() < 1e-9, "micrometres");
}

#[test]
fn a_file_cut_anywhere_is_refused() {
    for (n, file) in FILES.iter().enumerate() {
        for end in 0..file.len() {
            assert!(parse(&file[..end], Progress::none()).is_err(), "cut at {end}");
        }
        let plain = plain(n);
        for end in 0..plain.len() {
            assert!(parse(&plain[..end], Progress::none()).is_err(), "cut at {end}");
        }
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(
        file in 0..FILES.len(),
        gzip in any::<bool>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
    ) {
        let mut bytes = if gzip { FILES[file].to_vec() } else { plain(file) };
        let range = if gzip { bytes.len() } else { 352.max(bytes.len() - 500) };
        for (at, value) in changes {
            bytes[at.index(range)] = value;
        }
        if let Ok(raster) = parse(&bytes, Progress::none()) {
            prop_assert_eq!(raster.bytes.len(), raster.grid.len() * raster.scalar.size());
            let _ = raster.whole::<i16>("");
        }
    }
}

#[test]
fn a_damaged_table_of_labels_is_refused_by_name() {
    let whole = plain(4);
    let place = |what: &[u8]| whole.windows(what.len()).position(|w| w == what).unwrap();
    for (what, with, expected) in [
        (&b"</LabelTable>"[..], &b"<!LabelTable>"[..], "malformed XML"),
        (b"Key=\"92\"", b"Key=\"xx\"", "the key `xx` is not a number"),
        (b"</Label>", b"</Lobel>", "malformed XML"),
    ] {
        let mut file = whole.clone();
        let at = place(what);
        file[at..at + with.len()].copy_from_slice(with);
        let message = parse(&file, Progress::none()).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    // Another kind of extension is not looked at.
    let mut file = whole.clone();
    let at = place(b"<LabelTable");
    file[at + 1] = b'X';
    assert!(parse(&file, Progress::none()).unwrap().segments.is_empty());
}
