//! Stored values to HU.

use crate::support::{Slice, folder, put, put_samples, read, refusal, six, stored};
use dicom_core::{PrimitiveValue, VR};
use dicom_dictionary_std::tags;
use std::collections::BTreeSet;
use supine_dicom::{Accept, Depth, ReadParams, inspect, read_series};
use supine_space::{Progress, Warning};
use supine_volume::{Ct, Field};

/// The HU of the unchanged six slices and of changed ones.
fn both(change: impl Fn(usize, &mut Slice, Vec<u16>)) -> (Ct, Ct, Vec<Warning>) {
    let (plain, ..) = read(folder(&six()).path()).unwrap();
    let mut slices = six();
    let stored = stored(&slices);
    for (n, (slice, samples)) in slices.iter_mut().zip(stored).enumerate() {
        change(n, slice, samples);
    }
    let (ct, _, info) = read(folder(&slices).path()).unwrap();
    (plain, ct, info.warnings)
}

fn encode(slice: &mut Slice, bits: u16, signed: u16, intercept: &str) {
    put(slice, tags::BITS_STORED, VR::US, bits);
    put(slice, tags::HIGH_BIT, VR::US, bits - 1);
    put(slice, tags::PIXEL_REPRESENTATION, VR::US, signed);
    put(slice, tags::RESCALE_INTERCEPT, VR::DS, intercept);
}

#[test]
fn a_high_bit_beyond_all_bits_is_refused() {
    let mut slices = six();
    put(&mut slices[0], tags::HIGH_BIT, VR::US, u16::MAX);
    let message = refusal(&slices);
    assert!(message.contains("High Bit 65535"), "{message}");
}

#[test]
fn more_voxels_than_the_files_can_hold_are_refused_before_they_are_asked_for() {
    let mut slices = six();
    for slice in &mut slices {
        put_samples(slice, vec![0; 16]);
        slice.meta_mut().transfer_syntax = "1.2.840.10008.1.2.5".into();
        put(slice, tags::ROWS, VR::US, 4096_u16);
        put(slice, tags::COLUMNS, VR::US, 4096_u16);
    }
    let message = refusal(&slices);
    assert!(message.contains("the series claims 100663296 voxels in "), "{message}");
}

#[test]
fn every_layout_of_the_same_values_gives_the_same_hu() {
    type Change = fn(usize, &mut Slice, Vec<u16>);
    let layouts: [(&str, Change); 5] = [
        ("unsigned 12", |_, s, v| put_samples(s, v)),
        ("unsigned 12 with garbage above", |_, s, v| {
            put_samples(s, v.iter().map(|v| v | 0xB000).collect());
        }),
        ("signed 16", |_, s, v| {
            encode(s, 16, 1, "0");
            put_samples(s, v.iter().map(|&v| (v as i16 - 1024) as u16).collect());
        }),
        ("signed 12, sign extended", |_, s, v| {
            encode(s, 12, 1, "0");
            put_samples(s, v.iter().map(|&v| (v as i16 - 1024) as u16).collect());
        }),
        ("signed 12, zeros above", |_, s, v| {
            encode(s, 12, 1, "0");
            put_samples(s, v.iter().map(|&v| (v as i16 - 1024) as u16 & 0x0FFF).collect());
        }),
    ];
    for (name, layout) in layouts {
        let (plain, ct, _) = both(layout);
        assert!(plain == ct, "{name}");
    }
}

#[test]
fn every_uncompressed_syntax_gives_the_same_hu() {
    for syntax in [
        "1.2.840.10008.1.2",
        "1.2.840.10008.1.2.1",
        "1.2.840.10008.1.2.2",
        "1.2.840.10008.1.2.1.99",
    ] {
        let (plain, ct, warnings) = both(|_, slice, samples| {
            put_samples(slice, samples);
            slice.meta_mut().transfer_syntax = syntax.to_owned();
        });
        assert!(plain == ct, "{syntax}");
        assert!(warnings.is_empty(), "{syntax} {warnings:?}");
    }
}

#[test]
fn rescale_is_applied_per_slice() {
    // The same HU from another slope and intercept in every second slice.
    let (plain, ct, warnings) = both(|n, slice, samples| {
        if n % 2 == 1 {
            put(slice, tags::RESCALE_SLOPE, VR::DS, "0.5");
            put(slice, tags::BITS_STORED, VR::US, 16u16);
            put(slice, tags::HIGH_BIT, VR::US, 15u16);
            put_samples(slice, samples.iter().map(|v| v * 2).collect());
        }
    });
    assert!(plain == ct);
    assert!(warnings.iter().any(|w| w.to_string().contains("slice to slice")), "{warnings:?}");
}

#[test]
fn one_slice_with_another_rescale_is_named() {
    let (.., warnings) = both(|n, slice, _| {
        if n == 3 {
            put(slice, tags::RESCALE_INTERCEPT, VR::DS, "-1000");
        }
    });
    let told = warnings.iter().find(|w| w.code() == "rescale-per-slice").unwrap().to_string();
    assert!(told.contains("3.dcm has HU = 1 x value + -1000"), "{told}");
}

#[test]
fn slices_of_two_births_or_one_uid_do_not_pass_in_silence() {
    let (.., warnings) = both(|n, slice, _| {
        if n < 2 {
            put(slice, tags::SOP_INSTANCE_UID, VR::UI, "2.25.7");
        }
    });
    let told = warnings.iter().find(|w| w.code() == "instance-uid-twice").unwrap().to_string();
    assert!(told.contains("0.dcm") && told.contains("1.dcm"), "{told}");
    let mut slices = six();
    put(&mut slices[5], tags::PATIENT_BIRTH_DATE, VR::DA, "19010101");
    assert!(refusal(&slices).contains("Patient's Birth Date"), "{}", refusal(&slices));
}

#[test]
fn halves_are_rounded_to_even() {
    let (_, ct, warnings) = both(|_, slice, mut samples| {
        samples[..4].copy_from_slice(&[1, 3, 5, 2001]);
        put(slice, tags::RESCALE_SLOPE, VR::DS, "0.5");
        put_samples(slice, samples);
    });
    // 0.5, 1.5, 2.5 and 1000.5 above -1024.
    assert_eq!(ct.data()[..4], [-1024, -1022, -1022, -24]);
    assert!(warnings.iter().any(|w| w.to_string().contains("whole-numbered")), "{warnings:?}");
}

#[test]
fn padding_is_air_in_the_volume() {
    let (plain, ct, warnings) = both(|_, slice, mut samples| {
        encode(slice, 16, 1, "0");
        samples.iter_mut().for_each(|v| *v = (*v as i16 - 1024) as u16);
        samples[..64].fill(-2000i16 as u16);
        samples[64..70].fill(3071);
        put(slice, tags::PIXEL_PADDING_VALUE, VR::SS, PrimitiveValue::from(3071i16));
        put_samples(slice, samples);
    });
    assert!(ct.data()[..70].iter().all(|&v| v == -1000));
    assert_eq!(ct.data()[70..65536], plain.data()[70..65536]);
    let told = warnings.iter().any(|w| w.to_string().starts_with("420 voxels hold no measurement"));
    assert!(told, "{warnings:?}");
}

#[test]
fn a_padding_value_of_tissue_is_told() {
    let (.., warnings) = both(|_, slice, mut samples| {
        samples[..64].fill(1024 + 40);
        put(slice, tags::PIXEL_PADDING_VALUE, VR::US, 1024u16 + 40);
        put_samples(slice, samples);
    });
    let told = warnings.iter().find(|w| w.code() == "padding-in-tissue").unwrap().to_string();
    assert!(told.contains("(40 HU)") && told.contains("Pixel Padding Value"), "{told}");
}

#[test]
fn inspecting_tells_what_reading_tells() {
    let mut slices = six();
    for (n, (slice, mut samples)) in slices.iter_mut().zip(stored(&six())).enumerate() {
        samples[..64].fill(1024 + 40);
        put(slice, tags::PIXEL_PADDING_VALUE, VR::US, 1024u16 + 40);
        put_samples(slice, samples);
        match n {
            0 | 1 => put(slice, tags::SOP_INSTANCE_UID, VR::UI, "2.25.7"),
            3 => put(slice, tags::RESCALE_INTERCEPT, VR::DS, "-1000.5"),
            _ => {}
        }
    }
    let dir = folder(&slices);
    let last = dir.path().join("5.dcm");
    let mut bytes = std::fs::read(&last).unwrap();
    bytes.extend([0; 512]);
    std::fs::write(&last, bytes).unwrap();
    let (.., info) = read(dir.path()).unwrap();
    let codes = |warnings: &[Warning]| -> BTreeSet<String> {
        warnings.iter().map(|w| w.code().to_owned()).collect()
    };
    let seen = |depth| {
        let found = inspect(dir.path(), depth, Accept::default(), Progress::none()).unwrap();
        codes(&found.series[0].warnings)
    };
    let (all, pixels, headers) = (codes(&info.warnings), seen(Depth::Pixels), seen(Depth::Headers));
    assert_eq!(pixels, all);
    let of_pixels = ["bytes-behind-data", "padding-as-air", "padding-in-tissue"];
    let missing: Vec<&String> = all.difference(&headers).collect();
    assert_eq!(missing, of_pixels);
    assert_eq!(headers.len(), 3, "{headers:?}");
}

#[test]
fn an_image_of_another_modality_is_refused() {
    let mut slices = six();
    put(&mut slices[2], tags::MODALITY, VR::CS, "MR");
    let message = refusal(&slices);
    assert!(message.contains("2.dcm") && message.contains("Modality is \"MR\""), "{message}");
}

#[test]
fn padding_tells_what_was_measured_after_it_became_air() {
    let mut slices = six();
    let stored = stored(&slices);
    for (n, (slice, mut samples)) in slices.iter_mut().zip(stored).enumerate() {
        encode(slice, 16, 1, "0");
        samples.iter_mut().for_each(|v| *v = (*v as i16 - 1024) as u16);
        // The last columns of all slices, and one column more of all but the first.
        let from = if n == 0 { 201 } else { 200 };
        samples.chunks_mut(256).for_each(|row| row[from..].fill(-2000i16 as u16));
        put_samples(slice, samples);
    }
    let (ct, source, _) = read(folder(&slices).path()).unwrap();
    let field = source.field(ct.grid()).unwrap();
    assert!(field.seen().iter().enumerate().all(|(n, &seen)| seen == (n % 256 < 201)));
    // The values alone do not tell.
    assert!(Field::found(&ct).seen().iter().all(|&seen| seen));
    let (ct, source, _) = read(folder(&six()).path()).unwrap();
    assert_eq!(source.field(ct.grid()), None);
}

#[test]
fn unusable_values_are_refused_by_attribute() {
    type Change = fn(&mut Slice);
    let changes: [(Change, &str); 12] = [
        (|s| put(s, tags::RESCALE_SLOPE, VR::DS, "2,0"), "Rescale Slope is \"2,0\""),
        (|s| put(s, tags::RESCALE_SLOPE, VR::DS, "0"), "Rescale Slope is 0"),
        (|s| put(s, tags::RESCALE_SLOPE, VR::DS, "1\\2"), "Rescale Slope is"),
        (|s| put(s, tags::RESCALE_INTERCEPT, VR::DS, ""), "Rescale Intercept is missing"),
        (|s| put(s, tags::IMAGE_TYPE, VR::CS, "DERIVED\\PRIMARY\\AXIAL\\IODINE"), "material map"),
        (|s| put(s, tags::RESCALE_TYPE, VR::LO, "MGML"), "Rescale Type is \"MGML\""),
        (|s| put(s, tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME1"), "MONOCHROME1"),
        (|s| put(s, tags::BITS_ALLOCATED, VR::US, 12u16), "12 bits (Bits Allocated)"),
        (|s| put(s, tags::HIGH_BIT, VR::US, 15u16), "High Bit 15"),
        (|s| put(s, tags::ROWS, VR::US, 0u16), "Rows x Columns is 0 x 256"),
        (|s| put(s, tags::COLUMNS, VR::US, 65535u16), "65535"),
        (|s| put(s, tags::NUMBER_OF_FRAMES, VR::IS, "2"), "Number of Frames is 2"),
    ];
    for (change, expected) in changes {
        let mut slices = six();
        change(&mut slices[5]);
        let message = refusal(&slices);
        assert!(message.starts_with("5.dcm: ") && message.contains(expected), "{message}");
    }
}

/// The six slices with HU as stored values and without these elements.
fn without(missing: &[dicom_core::Tag], hu: impl Fn(u16) -> i16) -> Vec<Slice> {
    let mut slices = six();
    let stored = stored(&slices);
    for (slice, samples) in slices.iter_mut().zip(stored) {
        encode(slice, 16, 1, "0");
        put_samples(slice, samples.iter().map(|&v| hu(v) as u16).collect());
        missing.iter().for_each(|&tag| assert!(slice.remove_element(tag)));
    }
    slices
}

#[test]
fn values_without_rescale_are_taken_for_hu_only_when_asked() {
    let (plain, ..) = read(folder(&six()).path()).unwrap();
    let both = [tags::RESCALE_SLOPE, tags::RESCALE_INTERCEPT];
    let accept = Accept { assume_hu: true, ..Accept::default() };
    let assume = ReadParams { accept, ..ReadParams::default() };
    let read_assuming = |slices: &[Slice]| {
        read_series(folder(slices).path(), &assume, Progress::none())
            .map_err(|error| error.to_string())
    };
    let hu = |v: u16| v as i16 - 1024;
    let message = refusal(&without(&both, hu));
    assert!(
        message.contains("Rescale Slope is missing") && message.contains("assume_hu"),
        "{message}"
    );
    let (ct, _, info) = read_assuming(&without(&both, hu)).unwrap();
    assert!(ct == plain);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("taken for HU")),
        "{:?}",
        info.warnings
    );
    // One of the two missing is a damaged header, and air at 24 is no HU.
    let message = read_assuming(&without(&both[1..], hu)).unwrap_err();
    assert!(message.contains("Rescale Intercept is missing"), "{message}");
    let message = read_assuming(&without(&both, |v| v as i16)).unwrap_err();
    assert!(message.contains("cannot be Hounsfield units"), "{message}");
}

#[test]
fn pixel_data_of_the_wrong_length_is_refused() {
    let mut slices = six();
    let mut samples = stored(&slices).remove(1);
    samples.truncate(65_000);
    put_samples(&mut slices[1], samples);
    let message = refusal(&slices);
    assert!(message.starts_with("1.dcm: Pixel Data has 130000 bytes"), "{message}");
    // Another matrix than the compressed one.
    let mut slices = six();
    slices.iter_mut().for_each(|s| put(s, tags::ROWS, VR::US, 512u16));
    let message = refusal(&slices);
    assert!(message.contains("0.dcm: the pixels cannot be decoded"), "{message}");
}

#[test]
fn values_that_are_no_hu_are_refused() {
    for intercept in ["0", "-3000", "20000"] {
        let mut slices = six();
        slices.iter_mut().for_each(|s| put(s, tags::RESCALE_INTERCEPT, VR::DS, intercept));
        let message = refusal(&slices);
        assert!(message.contains("cannot be Hounsfield units"), "{intercept} {message}");
    }
    let mut slices = six();
    let stored = stored(&slices);
    for (slice, samples) in slices.iter_mut().zip(stored) {
        // Signed values declared unsigned: air at 64536.
        encode(slice, 16, 0, "0");
        put_samples(slice, samples.iter().map(|&v| (v as i16 - 1024) as u16).collect());
    }
    let message = refusal(&slices);
    assert!(message.contains("wrong rescale, sign"), "{message}");
}

#[test]
fn padding_that_no_pixel_can_have_is_told_and_marks_none() {
    // Signed and unsigned values of 12 bits; the lower 12 bits of the padding are those of a real
    // value.
    for (signed, padding) in [(true, 0x8000u16), (true, 0x0FFF), (false, 0xF428)] {
        let mut all = six();
        for slice in &mut all {
            put(slice, tags::BITS_STORED, VR::US, PrimitiveValue::from(12u16));
            put(slice, tags::HIGH_BIT, VR::US, PrimitiveValue::from(11u16));
            put(slice, tags::PIXEL_REPRESENTATION, VR::US, PrimitiveValue::from(u16::from(signed)));
        }
        let (plain, ..) = read(folder(&all).path()).unwrap();
        for slice in &mut all {
            put(slice, tags::PIXEL_PADDING_VALUE, VR::US, PrimitiveValue::from(padding));
        }
        let (ct, _, info) = read(folder(&all).path()).unwrap();
        assert!(ct.data() == plain.data(), "{padding:04x}");
        let told = info.warnings.iter().filter(|w| w.code() == "padding-out-of-range").count();
        assert_eq!(told, 1, "{:?}", info.warnings);
    }
}
