//! Structure sets written for an exported CT.

use crate::dose::params;
use crate::segmentation::data;
use crate::support::{contents, folder, place, position, put, read, six, text};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, InMemDicomObject, open_file};
use std::path::Path;
use supine_dicom::{
    Drawing, Line, LineKind, Source, Structures, StructuresInfo, read_structures, write_structures,
};
use supine_space::Point;
use tempfile::TempDir;

/// Regions of pydicom, and a CT of the same patient whose heights are no short numbers.
fn given() -> (Structures, Source, Vec<f64>) {
    let path = data("pydicom_rtstruct.dcm");
    let id = text(&open_file(&path).unwrap(), tags::PATIENT_ID);
    let mut ct = six();
    let mut heights = Vec::new();
    for slice in &mut ct {
        put(slice, tags::PATIENT_ID, VR::LO, id.as_str());
        let [x, y, z] = position(slice);
        place(slice, [x, y, z + 1.0 / 3.0]);
        heights.push(z + 1.0 / 3.0);
    }
    heights.sort_by(f64::total_cmp);
    let dir = folder(&ct);
    (read_structures(&path).unwrap(), read(dir.path()).unwrap().1, heights)
}

fn square(middle: [f64; 2], half: f64, z: f64) -> Vec<Point> {
    let corner = |[a, b]: [f64; 2]| Point::new(middle[0] + half * a, middle[1] + half * b, z);
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner).to_vec()
}

fn write(carried: &[Vec<Vec<Point>>], path: &Path) -> (StructuresInfo, DefaultDicomObject) {
    let closed = |c: &Vec<Vec<Point>>| Drawing { contours: c.clone(), lines: vec![] };
    draw(&carried.iter().map(closed).collect::<Vec<_>>(), path)
}

fn draw(carried: &[Drawing], path: &Path) -> (StructuresInfo, DefaultDicomObject) {
    let (from, ct, _) = given();
    let info = write_structures(carried, &from, &ct, &params(&ct), path).unwrap();
    (info, open_file(path).unwrap())
}

fn items(object: &InMemDicomObject, tag: dicom_core::Tag) -> Vec<InMemDicomObject> {
    object.element(tag).map_or_else(|_| vec![], |e| e.items().unwrap_or_default().to_vec())
}

fn string(object: &InMemDicomObject, tag: dicom_core::Tag) -> String {
    object.element(tag).unwrap().to_str().unwrap().trim_matches([' ', '\0']).to_owned()
}

#[test]
fn regions_keep_who_they_are_and_contours_lie_in_their_slices() {
    let (_, ct, heights) = given();
    let ring = vec![square([0.0, 0.0], 20.0, heights[2]), square([0.0, 0.0], 5.0, heights[2])];
    let mut closed = square([9.0, 3.0], 4.0, heights[3] + 0.004);
    closed.push(closed[0]);
    let carried = vec![vec![], vec![closed], ring, vec![], vec![]];
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("rs.dcm");
    let (info, object) = write(&carried, &path);
    assert_eq!((info.contours, info.warnings.len()), (3, 0), "{:?}", info.warnings);
    let (from, read) =
        (read_structures(&data("pydicom_rtstruct.dcm")).unwrap(), read_structures(&path).unwrap());
    for (a, b) in read.rois().iter().zip(from.rois()) {
        assert_eq!((a.number, &a.name, a.colour), (b.number, &b.name, b.colour));
        assert_eq!(a.interpreted_type, b.interpreted_type);
        assert_eq!(a.frame_of_reference, ct.frame_of_reference_uid());
    }
    assert_eq!(read.rois().iter().map(|r| r.contours.len()).collect::<Vec<_>>(), [0, 1, 2, 0, 0]);
    let drawn = items(&object, tags::ROI_CONTOUR_SEQUENCE);
    assert_eq!(drawn.len(), 5, "a region without contours stays");
    assert!(drawn[0].element(tags::CONTOUR_SEQUENCE).is_err());
    let closed = &items(&drawn[1], tags::CONTOUR_SEQUENCE)[0];
    assert_eq!(string(closed, tags::NUMBER_OF_CONTOUR_POINTS), "4", "the first is not repeated");
    assert_eq!(string(closed, tags::CONTOUR_GEOMETRIC_TYPE), "CLOSED_PLANAR");
    // The very string of the slice, which no rounding of the corner would give.
    let texts: Vec<String> =
        string(closed, tags::CONTOUR_DATA).split('\\').map(str::to_owned).collect();
    let z = format!("{:.10}", heights[3]);
    assert!(texts.iter().skip(2).step_by(3).all(|t| *t == z), "{texts:?} and not {z}");
    assert_eq!(items(closed, tags::CONTOUR_IMAGE_SEQUENCE).len(), 1);
    let algorithm = |roi: &InMemDicomObject| string(roi, tags::ROI_GENERATION_ALGORITHM);
    let rois = items(&object, tags::STRUCTURE_SET_ROI_SEQUENCE);
    assert!(rois.iter().all(|r| algorithm(r) == "AUTOMATIC"));
    let again = write(&carried, &path).0;
    assert_eq!(again, info, "the same structures have the same identity");
}

#[test]
fn a_contour_between_slices_names_none_and_it_is_said() {
    let (_, _, heights) = given();
    let between = square([0.0, 0.0], 9.0, 0.5 * (heights[2] + heights[3]));
    let dir = TempDir::new().unwrap();
    let (info, object) = write(&[vec![between]], &dir.path().join("rs.dcm"));
    assert!(
        info.warnings[0].to_string().contains("1 contour(s)")
            && info.warnings[0].to_string().contains("between")
    );
    let contour = &items(&items(&object, tags::ROI_CONTOUR_SEQUENCE)[0], tags::CONTOUR_SEQUENCE)[0];
    assert!(items(contour, tags::CONTOUR_IMAGE_SEQUENCE).is_empty());
}

#[test]
fn a_long_contour_is_thinned_until_its_element_keeps_its_vr() {
    let (_, _, heights) = given();
    let round = |n: usize| {
        let (s, c) = (n as f64 * std::f64::consts::TAU / 9000.0).sin_cos();
        Point::new(150.0 * c, 120.0 * s, heights[1])
    };
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("rs.dcm");
    let (info, object) = write(&[vec![(0..9000).map(round).collect()]], &path);
    assert!(info.warnings[0].to_string().contains("thinned"), "{:?}", info.warnings);
    let contour = &items(&items(&object, tags::ROI_CONTOUR_SEQUENCE)[0], tags::CONTOUR_SEQUENCE)[0];
    let data = contour.element(tags::CONTOUR_DATA).unwrap();
    assert_eq!(data.vr(), VR::DS);
    let read = read_structures(&path).unwrap();
    let area = |p: &[Point]| {
        let ends = (0..p.len()).map(|n| (p[n], p[(n + 1) % p.len()]));
        ends.map(|(a, b)| a.x * b.y - a.y * b.x).sum::<f64>() / 2.0
    };
    let exact = std::f64::consts::PI * 150.0 * 120.0;
    assert!((area(&read.rois()[0].contours[0]) / exact - 1.0).abs() < 2e-4);
}

#[test]
fn points_and_open_lines_stay_what_they_are() {
    let (_, _, heights) = given();
    let along = |n: usize| Point::new(0.01 * n as f64, 5.0, heights[1] + 0.002 * n as f64);
    let lines = vec![
        Line { kind: LineKind::Point, points: vec![Point::new(1.0, 2.0, heights[2])] },
        Line { kind: LineKind::Point, points: vec![Point::new(1.0, 2.0, heights[2] + 0.7)] },
        Line { kind: LineKind::OpenPlanar, points: square([3.0, 4.0], 2.0, heights[2]) },
        Line { kind: LineKind::OpenNonplanar, points: (0..3000).map(along).collect() },
    ];
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("rs.dcm");
    let (info, object) = draw(&[Drawing { contours: vec![], lines: lines.clone() }], &path);
    assert_eq!((info.contours, info.lines), (0, 6));
    let read = read_structures(&path).unwrap();
    let found = &read.rois()[0].lines;
    assert_eq!(
        found.iter().map(|l| l.points.len()).collect::<Vec<_>>(),
        [1, 1, 4, 1280, 1280, 442]
    );
    assert_eq!(found[3].points[1279], found[4].points[0], "the pieces meet");
    assert_eq!(found[2].kind, LineKind::OpenPlanar);
    let written = items(&items(&object, tags::ROI_CONTOUR_SEQUENCE)[0], tags::CONTOUR_SEQUENCE);
    let slices = written.iter().map(|c| items(c, tags::CONTOUR_IMAGE_SEQUENCE).len());
    assert_eq!(slices.collect::<Vec<_>>(), [1, 0, 1, 0, 0, 0], "a point between slices names none");
}

#[test]
fn structures_of_another_patient_leave_nothing() {
    let (from, _, _) = given();
    let (ct, out) = (folder(&six()), TempDir::new().unwrap());
    let (_, ct, _) = read(ct.path()).unwrap();
    let path = out.path().join("rs.dcm");
    let said = write_structures(&[], &from, &ct, &params(&ct), &path).unwrap_err().to_string();
    assert!(said.contains("another patient") && contents(out.path()).is_empty(), "{said}");
}
