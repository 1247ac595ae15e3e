use super::*;
use std::fmt::Write as _;

/// Four voxels in a row, in layers, with segments of (name, layer, value).
fn read(layers: &[[u8; 4]], segments: &[(&str, usize, u8)]) -> Result<Vec<u8>, String> {
    let mut keys = String::new();
    for (n, (name, layer, value)) in segments.iter().enumerate() {
        writeln!(keys, "Segment{n}_ID:=S{n}\nSegment{n}_Name:={name}").unwrap();
        writeln!(keys, "Segment{n}_Layer:={layer}\nSegment{n}_LabelValue:={value}").unwrap();
    }
    read_with(layers, &keys)
}

fn read_with(layers: &[[u8; 4]], keys: &str) -> Result<Vec<u8>, String> {
    let mut text = format!(
        "NRRD0004\ntype: uint8\ndimension: 4\nspace: LPS\nsizes: {} 4 1 1\nspace directions: none \
         (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n",
        layers.len()
    );
    text.push_str(keys);
    text.push('\n');
    let mut bytes = text.into_bytes();
    bytes.extend((0..4).flat_map(|v| layers.iter().map(move |l| l[v])));
    let raster = raster_file::parse(&bytes, Progress::none()).map_err(|e| e.to_string())?;
    labels(&raster).map(|l| l.into_parts().1).map_err(|e| e.to_string())
}

#[test]
fn names_decide_in_segmentations_and_numbers_elsewhere() {
    let named =
        read(&[[0, 1, 2, 9]], &[("Chest_Wall", 0, 1), ("soft tissue", 0, 2), ("FAT", 0, 9)]);
    assert_eq!(named.unwrap(), [0, 2, 1, 6]);
    assert_eq!(read(&[[0, 1, 2, 9]], &[]).unwrap(), [0, 1, 2, 9]);
}

#[test]
fn the_finer_label_stands_where_segments_overlap() {
    let segments = [("soft tissue", 0, 1), ("tumour", 1, 1), ("chest wall", 0, 2)];
    assert_eq!(read(&[[1, 1, 2, 0], [0, 1, 0, 0]], &segments).unwrap(), [1, 9, 2, 0]);
    let message = read(&[[1, 1, 2, 2], [0, 1, 1, 1]], &segments).unwrap_err();
    assert!(message.contains("2 voxels belong both to `chest wall` and to `tumour`"), "{message}");
}

/// As 3D Slicer 4.10 and older ones wrote it.
#[test]
fn segments_that_say_neither_layer_nor_value_are_a_layer_each() {
    let keys =
        "Segment0_ID:=a\nSegment0_Name:=soft tissue\nSegment1_ID:=b\nSegment1_Name:=chest wall\n";
    assert_eq!(read_with(&[[1, 1, 0, 0], [0, 0, 1, 1]], keys).unwrap(), [1, 1, 2, 2]);
    let message = read_with(&[[1, 1, 0, 0], [0, 0, 1, 1]], &format!("{keys}Segment2_Name:=fat\n"));
    assert!(message.unwrap_err().contains("2 is not one of the 2 layers"));
}

#[test]
fn foreign_labels_are_refused_by_name() {
    for (layers, segments, expected) in [
        (
            [0, 1, 42, 42],
            vec![],
            "2 voxels have the label 42, which is not one of 1 soft tissue, 2",
        ),
        (
            [0, 1, 3, 0],
            vec![("Liver", 0, 3), ("skin", 0, 1)],
            "1 voxels have the label 3 (`Liver`)",
        ),
        ([0, 1, 3, 0], vec![("skin", 0, 1)], "1 voxels have the label 3, which"),
        ([0, 1, 0, 0], vec![("skin", 4, 1)], "4 is not one of the 1 layers"),
    ] {
        let message = read(&[layers], &segments).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    // A foreign segment without voxels is no obstacle.
    assert_eq!(read(&[[0, 1, 0, 0]], &[("Liver", 0, 3), ("skin", 0, 1)]).unwrap(), [0, 8, 0, 0]);
}

#[test]
fn every_label_says_what_it_is_in_terms_that_slicer_keeps() {
    let grid = supine_space::Grid::new(
        [10, 1, 1],
        supine_space::Vector::repeat(1.0),
        supine_space::Point::origin(),
        supine_space::Matrix::identity(),
    );
    let all = LabelMap::from_fn(grid.unwrap(), |[i, ..]| i as u8 + 1);
    let keys: BTreeMap<String, String> = segments::keys(&all).unwrap().into_iter().collect();
    for (n, (number, ..)) in label::ALL.iter().enumerate() {
        let tags: Vec<&str> = keys[&format!("Segment{n}_Tags")].split('|').collect();
        assert_eq!((tags[0], tags.len(), tags[2]), ("Segmentation.Status:completed", 3, ""));
        let entry = tags[1].strip_prefix("TerminologyEntry:").unwrap();
        let parts: Vec<Vec<&str>> = entry.split('~').map(|p| p.split('^').collect()).collect();
        let counts: Vec<usize> = parts.iter().map(Vec::len).collect();
        assert_eq!(counts, [1, 3, 3, 3, 1, 3, 3], "{entry}");
        let [category, kind] = label::terms(*number).unwrap();
        assert_eq!(parts[1], ["SCT", category.0, category.1]);
        assert_eq!(parts[2], ["SCT", kind.0, kind.1]);
        assert!(parts[1..3].concat().iter().all(|word| !word.contains(':')), "{entry}");
    }
}

#[test]
fn foreign_tags_decide_nothing() {
    let with = |tags: &str| {
        let header = format!(
            "NRRD0004\ntype: uint8\ndimension: 3\nspace: LPS\nsizes: 2 1 1\nspace directions: (1,0,0) (0,1,0) \
             (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\nSegment0_ID:=S\nSegment0_Name:=skin\n\
             Segment0_LabelValue:=1\nSegment0_Tags:={tags}\n\n"
        );
        let bytes = [header.as_bytes(), &[1, 0]].concat();
        let raster = raster_file::parse(&bytes, Progress::none()).unwrap();
        labels(&raster).unwrap().into_parts().1
    };
    for tags in [
        "",
        "|||",
        "TerminologyEntry:~~~^^^|",
        "TerminologyEntry:a~SCT^39607008^Lung~SCT^39607008^Lung~^^~~^^~^^|\\n",
    ] {
        assert_eq!(with(tags), [label::SKIN, 0], "{tags}");
    }
}
