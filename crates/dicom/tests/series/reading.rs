//! Folders and files: what is there, what is chosen, what is refused.

use crate::support::{Slice, folder, put, read, refusal, rename, six, slices, text};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use std::path::Path;
use supine_dicom::{Accept, Depth, Error, ReadParams, inspect, read_series};
use supine_space::{Failure, Progress, Stopped};

const OTHER: &str = "2.25.77";

fn other_series() -> Vec<Slice> {
    let mut other = slices(50, 4);
    for (n, slice) in other.iter_mut().enumerate() {
        put(slice, tags::SERIES_INSTANCE_UID, VR::UI, OTHER);
        put(slice, tags::SERIES_DESCRIPTION, VR::LO, "bone kernel");
        rename(slice, &format!("{OTHER}.{n}"));
    }
    other
}

#[test]
fn several_series_are_listed_and_one_must_be_chosen() {
    let dir = folder(&six().into_iter().chain(other_series()).collect::<Vec<_>>());
    let error = read(dir.path()).unwrap_err();
    let Error::SeveralSeries { series } = &error else { panic!("{error}") };
    assert_eq!(series.iter().map(|s| s.slices).collect::<Vec<_>>(), [6, 4]);
    assert_eq!(series[1].description, "bone kernel");
    assert!(error.to_string().contains(OTHER) && error.kind() == Failure::Input);

    let params = ReadParams { series: Some(OTHER.into()), ..ReadParams::default() };
    let (ct, _, info) = read_series(dir.path(), &params, Progress::none()).unwrap();
    assert_eq!(ct.grid().size()[2], 4);
    assert_eq!((info.series_uid.as_str(), info.series_count), (OTHER, 2));
    assert_eq!(info.left_out.len(), 6);
    assert!(info.warnings.iter().any(|w| w.to_string().contains("6 CT file(s) of other series")));

    let params = ReadParams { series: Some("1.2.3".into()), ..ReadParams::default() };
    let error = read_series(dir.path(), &params, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("no CT series 1.2.3") && error.contains(OTHER), "{error}");

    // A file names its series.
    let (ct, ..) = read(&dir.path().join("7.dcm")).unwrap();
    assert_eq!(ct.grid().size()[2], 4);
}

#[test]
fn localizers_and_foreign_files_are_left_out_and_listed() {
    let mut scout = slices(50, 1);
    rename(&mut scout[0], "2.25.55");
    put(&mut scout[0], tags::IMAGE_TYPE, VR::CS, "ORIGINAL\\PRIMARY\\LOCALIZER");
    put(&mut scout[0], tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0\\0\\-1");
    let mut dose = slices(51, 1);
    let class = "1.2.840.10008.5.1.4.1.1.481.2";
    put(&mut dose[0], tags::SOP_CLASS_UID, VR::UI, class);
    dose[0].meta_mut().media_storage_sop_class_uid = class.to_owned();
    let dir = folder(&six().into_iter().chain(scout).chain(dose).collect::<Vec<_>>());
    std::fs::write(dir.path().join("notes.txt"), "hello world\n".repeat(30)).unwrap();
    std::fs::write(dir.path().join(".hidden"), "").unwrap();

    let (ct, _, info) = read(dir.path()).unwrap();
    assert_eq!(ct.grid().size()[2], 6);
    let left: Vec<(String, String)> =
        info.left_out.iter().map(|l| (l.file.clone(), l.reason.to_string())).collect();
    let expected =
        [("6.dcm", "localizer"), ("7.dcm", "RT Dose Storage"), ("notes.txt", "not a DICOM file")];
    assert_eq!(left, expected.map(|(file, reason)| (file.to_owned(), reason.to_owned())));

    let error = read(&dir.path().join("6.dcm")).unwrap_err().to_string();
    assert!(error.contains("6.dcm") && error.contains("localizer"), "{error}");
    let error = read(&dir.path().join("7.dcm")).unwrap_err().to_string();
    assert!(error.contains("RT Dose"), "{error}");

    let inspection =
        inspect(dir.path(), Depth::Headers, Accept::default(), Progress::none()).unwrap();
    assert_eq!(inspection.files, 9);
    assert_eq!(inspection.usable().count(), 1);
    let series = &inspection.series[0];
    assert_eq!((series.slices, series.localizers, series.usable), (6, 1, true));
    assert_eq!(series.grid.as_ref().unwrap().size, [256, 256, 6]);
    assert_eq!(series.stored, "12 bits unsigned");
    assert_eq!(inspection.other[0].kind, "RT Dose Storage");
}

#[test]
fn a_dicomdir_stands_for_its_folder_and_leads_nowhere_else() {
    let dir = folder(&[]);
    let [inside, outside] = ["disc/CT/A", "other"].map(|name| dir.path().join(name));
    for (folder, slices) in [(&inside, six()), (&outside, other_series())] {
        std::fs::create_dir_all(folder).unwrap();
        for (n, slice) in slices.iter().enumerate() {
            slice.write_to_file(folder.join(format!("{n}"))).unwrap();
        }
    }
    let directory = dir.path().join("disc/DICOMDIR");
    let mut list = slices(40, 1).remove(0);
    list.meta_mut().media_storage_sop_class_uid = "1.2.840.10008.1.3.10".into();
    list.write_to_file(&directory).unwrap();
    let (ct, _, info) = read(&directory).unwrap();
    assert_eq!(ct, read(&inside).unwrap().0);
    let listed: Vec<_> =
        info.left_out.iter().map(|l| (l.file.clone(), l.reason.to_string())).collect();
    assert_eq!(listed, [("DICOMDIR".into(), "Media Storage Directory Storage".into())]);
}

#[test]
fn identity_that_an_anonymiser_emptied_is_taken_from_the_file_header() {
    let mut emptied = six();
    for slice in &mut emptied {
        put(slice, tags::SOP_CLASS_UID, VR::UI, "");
        put(slice, tags::SOP_INSTANCE_UID, VR::UI, "");
    }
    let (ct, _, info) = read(folder(&emptied).path()).unwrap();
    assert_eq!(ct, read(folder(&six()).path()).unwrap().0);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("file header")),
        "{:?}",
        info.warnings
    );
}

#[test]
fn looking_at_the_pixels_finds_the_slice_that_cannot_be_decoded() {
    let dir = folder(&six());
    let pixels = || {
        let mut inspection =
            inspect(dir.path(), Depth::Pixels, Accept::default(), Progress::none()).unwrap();
        let series = inspection.series.remove(0);
        (series.usable, series.reason, series.pixels.unwrap())
    };
    let (usable, _, whole) = pixels();
    assert!(usable && whole.failed.is_empty());
    let (ct, ..) = read(dir.path()).unwrap();
    let low = whole.slices.iter().map(|s| s.hu_range[0]).min();
    assert_eq!(low, ct.data().iter().copied().min());
    // One byte of the run lengths of a slice: the header stays as it was.
    let path = dir.path().join("2.dcm");
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.len() - 9000;
    bytes[at..at + 4000].fill(0x80);
    std::fs::write(&path, bytes).unwrap();
    let (usable, reason, broken) = pixels();
    assert!(!usable && broken.slices.len() == 5, "{broken:?}");
    assert!(reason.unwrap().contains("2.dcm: the pixels cannot be decoded"));
    for (n, slice) in broken.slices.iter().enumerate() {
        assert_eq!(slice, &whole.slices[if n < 2 { n } else { n + 1 }]);
    }
}

#[test]
fn a_folder_without_ct_says_what_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let error = read(dir.path()).unwrap_err().to_string();
    assert!(error.contains("the folder is empty"), "{error}");
    std::fs::write(dir.path().join("a.txt"), "hello world\n".repeat(30)).unwrap();
    std::fs::write(dir.path().join("bare"), [8, 0, 5, 0, 10, 0, 0, 0, 73, 83, 79, 0]).unwrap();
    let error = read(dir.path()).unwrap_err().to_string();
    assert!(error.contains("1 x not a DICOM file"), "{error}");
    assert!(error.contains("without file header"), "{error}");
    let error = read(&dir.path().join("nowhere")).unwrap_err();
    assert!(matches!(error, Error::Read { .. }), "{error}");
}

#[test]
fn damaged_files_are_refused_by_name() {
    let dir = folder(&six());
    let path = dir.path().join("3.dcm");
    let whole = std::fs::read(&path).unwrap();
    for (bytes, expected) in [
        (&whole[..whole.len() - 3000], "cut short"),
        (&whole[..700], "cut short"),
        (&whole[..200], "3.dcm"),
        (&whole[..0], "empty"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let error = read(dir.path()).unwrap_err();
        let message = error.to_string();
        assert!(message.contains("3.dcm") && message.contains(expected), "{message}");
        assert_eq!(error.kind(), Failure::Input);
        let inspection =
            inspect(dir.path(), Depth::Headers, Accept::default(), Progress::none()).unwrap();
        assert!(inspection.damaged.iter().any(|d| d.contains("3.dcm")));
    }
}

#[test]
fn what_file_managers_leave_empty_is_no_slice() {
    let dir = folder(&six());
    for name in ["Thumbs.db", "desktop.ini", "Icon\r", "notes.txt"] {
        std::fs::write(dir.path().join(name), b"").unwrap();
    }
    let (ct, _, info) = read(dir.path()).unwrap();
    assert_eq!((ct.grid().size()[2], info.left_out.len()), (6, 4));
    let seen = || inspect(dir.path(), Depth::Headers, Accept::default(), Progress::none()).unwrap();
    assert_eq!((seen().usable().count(), seen().damaged.len()), (1, 0));
    // What may be a slice that was lost is not passed over, by neither.
    for name in ["7.dcm", "IM0007", "1.2.840.7"] {
        let path = dir.path().join(name);
        std::fs::write(&path, b"").unwrap();
        let error = read(dir.path()).unwrap_err().to_string();
        assert!(error.contains("empty") && error.contains("exclude"), "{error}");
        assert_eq!(seen().usable().count(), 0);
        assert!(seen().series[0].reason.as_ref().unwrap().contains(name));
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn what_comes_behind_the_last_element_is_passed_over_and_told() {
    let dir = folder(&six());
    let (ct, ..) = read(dir.path()).unwrap();
    for (name, count) in [("1.dcm", 1), ("2.dcm", 8), ("4.dcm", 2048)] {
        let path = dir.path().join(name);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes.resize(bytes.len() + count, 0);
        std::fs::write(&path, bytes).unwrap();
    }
    let (again, _, info) = read(dir.path()).unwrap();
    assert!(again == ct);
    let told = info.warnings.iter().filter(|w| w.code() == "bytes-behind-data").count();
    assert_eq!(told, 1, "{:?}", info.warnings);
    let (path, other) = (dir.path().join("3.dcm"), dir.path().join("4.dcm"));
    let (whole, other) = (std::fs::read(&path).unwrap(), std::fs::read(other).unwrap());
    let behind: [&[u8]; 5] =
        [&[0, 0, 0, 0, 7, 0, 0, 0], b"x", b"<html>no DICOM</html>", &whole[200..], &other];
    for behind in behind {
        std::fs::write(&path, [&whole, behind].concat()).unwrap();
        let (again, _, info) = read(dir.path()).unwrap();
        assert!(again == ct, "{behind:?}");
        assert!(info.warnings.iter().any(|w| w.code() == "bytes-behind-data"));
    }
    // Before the pixels nothing is passed over.
    let middle = whole.len() / 2;
    std::fs::write(&path, &whole[..middle]).unwrap();
    assert!(read(dir.path()).is_err());
}

#[test]
fn a_damaged_file_of_another_series_does_not_matter() {
    let dir = folder(&six().into_iter().chain(other_series()).collect::<Vec<_>>());
    for n in 7..10 {
        let path = dir.path().join(format!("{n}.dcm"));
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 40_000]).unwrap();
    }
    let series = text(&six()[0], tags::SERIES_INSTANCE_UID);
    let (ct, ..) = read_series(
        dir.path(),
        &ReadParams { series: Some(series.trim_end_matches('\0').into()), ..ReadParams::default() },
        Progress::none(),
    )
    .unwrap();
    assert_eq!(ct.grid().size()[2], 6);
}

#[test]
fn lying_lengths_and_deep_nesting_are_refused_quickly() {
    let dir = folder(&six());
    let path = dir.path().join("2.dcm");
    let whole = std::fs::read(&path).unwrap();
    // Study Date (0008,0020) DA: its length becomes 0xFFF0.
    let at = whole.windows(6).position(|w| w == b"\x08\x00\x20\x00DA").unwrap();
    let mut lying = whole.clone();
    lying[at + 6..at + 8].copy_from_slice(&[0xF0, 0xFF]);
    std::fs::write(&path, &lying).unwrap();
    let message = read(dir.path()).unwrap_err().to_string();
    assert!(message.contains("2.dcm is not a sound DICOM file"), "{message}");

    let mut nested = whole[..at].to_vec();
    for _ in 0..20_000 {
        nested.extend_from_slice(b"\x08\x00\x12\x21SQ\x00\x00\xFF\xFF\xFF\xFF");
        nested.extend_from_slice(b"\xFE\xFF\x00\xE0\xFF\xFF\xFF\xFF");
    }
    std::fs::write(&path, &nested).unwrap();
    let message = read(dir.path()).unwrap_err().to_string();
    assert!(message.contains("nested deeper than 32"), "{message}");
}

#[test]
fn a_deflate_bomb_is_refused() {
    use std::io::Write as _;
    let mut slice = slices(40, 1);
    slice[0].meta_mut().transfer_syntax = "1.2.840.10008.1.2.1.99".to_owned();
    slice[0].meta_mut().update_information_group_length();
    let dir = folder(&slice);
    let path = dir.path().join("0.dcm");
    let good = std::fs::read(&path).unwrap();
    let length = 144 + u32::from_le_bytes([good[140], good[141], good[142], good[143]]) as usize;
    let mut packer = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(b"\x08\x00\x08\x00OB\x00\x00\x00\x00\x00\x08").unwrap();
    for _ in 0..128 {
        packer.write_all(&vec![0; 1 << 20]).unwrap();
    }
    let mut bomb = good[..length].to_vec();
    bomb.extend(packer.finish().unwrap());
    std::fs::write(&path, bomb).unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("inflates past 64 MiB"), "{message}");
}

#[test]
fn unknown_codings_are_refused_by_name() {
    let mut slices = six();
    for (uid, name) in [
        ("1.2.840.10008.1.2.4.51", "JPEG Extended (12 bit)"),
        ("1.2.840.10008.1.2.4.201", "High-Throughput JPEG 2000 Lossless"),
        ("1.2.840.10008.1.2.4.110", "JPEG XL Lossless"),
    ] {
        slices.iter_mut().for_each(|s| s.meta_mut().transfer_syntax = uid.into());
        let message = refusal(&slices);
        assert!(message.contains("0.dcm") && message.contains(name), "{message}");
        assert!(message.contains(uid), "{message}");
    }
}

#[test]
fn too_few_slices_are_no_volume() {
    let message = refusal(&slices(40, 2));
    assert!(message.contains("2 slice(s)"), "{message}");
}

#[test]
fn an_inspection_can_be_sent_and_stopped() {
    let dir = folder(&six());
    for depth in [Depth::Headers, Depth::Pixels] {
        let found = inspect(dir.path(), depth, Accept::default(), Progress::none()).unwrap();
        let sent = serde_json::to_value(&found).unwrap();
        assert_eq!(sent["series"][0]["grid"]["size"], serde_json::json!([256, 256, 6]));
        assert_eq!(sent["series"][0]["pixels"].is_null(), depth == Depth::Headers);
        for from in [0.0, 0.1, 0.6] {
            let sink = move |share: f64| share < from;
            let stopped = inspect(dir.path(), depth, Accept::default(), Progress::new(&sink));
            assert_eq!(stopped.unwrap_err().kind(), Failure::Stopped, "{depth:?} {from}");
        }
    }
}

#[test]
fn the_user_can_stop() {
    let dir = folder(&six());
    for from in [0.0, 0.5] {
        let sink = move |share: f64| share < from;
        let error = read_series(dir.path(), &ReadParams::default(), Progress::new(&sink));
        let error = error.unwrap_err();
        assert!(matches!(error, Error::Stopped(Stopped)) && error.kind() == Failure::Stopped);
    }
}

#[test]
fn the_whole_fixture_is_read() {
    let ct = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient/ct");
    let (ct, source, info) = read(&ct).unwrap();
    assert_eq!(ct.grid().size(), [256, 256, 86]);
    assert_eq!(info.hu_range, [-1024, 744]);
    assert_eq!(info.transfer_syntaxes, ["RLE Lossless"]);
    assert_eq!(
        source.clock(),
        supine_dicom::Clock { date: "20260310".into(), time: "093412".into() }
    );
    assert!(!format!("{source:?} {info:?}").contains("PHANTOM"));
}

#[test]
fn mutated_files_give_a_result_or_an_error_and_never_a_panic() {
    let dir = folder(&slices(40, 3));
    let path = dir.path().join("1.dcm");
    let good = std::fs::read(&path).unwrap();
    let mut state = 0x9E37_79B9_7F4A_7C15u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as usize % below
    };
    let (mut read_well, mut refused) = (0, 0);
    for n in 0..200 {
        let mut bytes = good.clone();
        // Mostly the header, which is the first 1500 bytes.
        let range = if n % 4 == 0 { good.len() } else { 1500 };
        for _ in 0..1 + random(5) {
            let at = random(range);
            bytes[at] = [0xFF, 0x00, random(256) as u8, bytes[at] ^ 1 << random(8)][random(4)];
        }
        if n % 10 == 0 {
            bytes.truncate(random(good.len()));
        }
        std::fs::write(&path, &bytes).unwrap();
        inspect(dir.path(), Depth::Headers, Accept::default(), Progress::none()).unwrap();
        match read(dir.path()) {
            Ok((ct, ..)) => {
                assert_eq!(ct.grid().size()[..2], [256, 256]);
                read_well += 1;
            }
            Err(error) => {
                assert_eq!(error.kind(), Failure::Input, "{error}");
                refused += 1;
            }
        }
    }
    assert!(read_well > 10 && refused > 10, "{read_well} read, {refused} refused");
}
