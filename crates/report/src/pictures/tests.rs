use super::*;
use crate::phantom::{MARKER, Phantom};
use crate::summary::tests::example;
use supine_space::Matrix;
use supine_volume::label;

fn flat(rows: Vec<Row>) -> Vec<Picture> {
    rows.into_iter().flat_map(|r| r.pictures).collect()
}

/// The pictures of before, after and change.
fn compared(phantom: &Phantom) -> Vec<Picture> {
    let scene = phantom.scene();
    flat(compare::rows(&Studio::new(&scene, 2.0), &(&example()).into(), Progress::none()).unwrap())
}

fn find<'a>(pictures: &'a [Picture], name: &str) -> &'a Canvas {
    &pictures.iter().find(|p| p.name == name).unwrap().canvas
}

/// Mean place of the pixels of a colour in a box, relative to a spot; with their number.
fn mean(canvas: &Canvas, [x0, y0]: [f64; 2], half: f64, rgb: Rgb) -> ([f64; 2], usize) {
    let (mut sum, mut n) = ([0.0; 2], 0);
    for y in 0..canvas.height() {
        for x in 0..canvas.width() {
            let d = [x as f64 - x0, y as f64 - y0];
            if d[0].abs().max(d[1].abs()) < half && canvas.at(x, y) == rgb {
                sum = [sum[0] + d[0], sum[1] + d[1]];
                n += 1;
            }
        }
    }
    (sum.map(|s| s / n as f64), n)
}

/// Turned by some degrees about every axis.
fn oblique() -> Matrix {
    rotation(0.2, Vector::z()) * rotation(-0.15, Vector::x())
}

/// Rotation by `angle` (radians) about a unit `axis`, by Rodrigues' formula.
fn rotation(angle: f64, axis: Vector) -> Matrix {
    let cross = axis.cross_matrix();
    Matrix::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

#[test]
fn tissues_have_their_colours_in_their_places() {
    let phantom = Phantom::new(oblique(), Vector::zeros());
    let (scene, summary) = (phantom.scene(), example());
    let studio = Studio::new(&scene, 2.0);
    let found = summary.segmentation.tissues.as_ref().unwrap();
    let row = tissues::row(&studio, &phantom.tissues, found, Progress::none()).unwrap();
    assert!(row.text.contains("18 %") && row.table.is_some(), "{}", row.text);
    let canvas = find(&row.pictures, "axial_tissues");
    let px = 2.0 * 1.08 * 48.0 / SIZE;
    let at = |x: f64, y: f64| {
        let middle = [canvas.width(), canvas.height()].map(|n| n as f64 / 2.0);
        canvas.at((middle[0] + x / px) as usize, (middle[1] + y / px) as usize)
    };
    // Grey 128 of 0 HU under half of the colour.
    let half = |l: u8| {
        let (.., rgb) = label::ALL.iter().find(|(n, ..)| *n == l).unwrap();
        rgb.map(|c| ((128.0 + f64::from(c)) / 2.0).round() as u8)
    };
    assert_eq!(at(12.0, -8.0), half(label::GLAND));
    assert_eq!(at(-12.0, -8.0), half(label::FAT));
    assert_eq!(at(0.0, 20.0), half(label::MUSCLE));
}

#[test]
fn left_front_and_head_are_in_their_places_whatever_the_grid() {
    let feet_first = Matrix::from_columns(&[Vector::x(), Vector::y(), -Vector::z()]);
    let sagittal = Matrix::from_columns(&[Vector::y(), -Vector::z(), -Vector::x()]);
    for axes in [Matrix::identity(), feet_first, sagittal, oblique()] {
        let phantom = Phantom::new(axes, Vector::zeros());
        let pictures = compared(&phantom);
        let px = 2.0 * 1.08 * 48.0 / SIZE;
        let [left, front, head] = [MARKER[0] / px, -MARKER[1] / px, MARKER[2] / px];
        for (name, want) in [
            ("axial_before", [left, -front]),
            ("sagittal_before", [-front, -head]),
            ("coronal_before", [left, -head]),
            ("coronal_after", [left, -head]),
        ] {
            let canvas = find(&pictures, name);
            let middle = [canvas.width(), canvas.height()].map(|n| (n as f64 - 1.0) / 2.0);
            let (at, n) = mean(canvas, middle, 230.0, [255; 3]);
            assert!(n > 1000, "{name}: {n} pixels of the marker");
            let off = (at[0] - want[0]).hypot(at[1] - want[1]);
            assert!(off < 5.0, "{name}, axes {axes}: {at:?} instead of {want:?}");
        }
    }
}

#[test]
fn a_turned_grid_of_the_same_voxels_gives_the_same_pictures() {
    let turned = Matrix::from_columns(&[-Vector::z(), Vector::x(), Vector::y()]);
    let u = Vector::new(4.0, 0.0, -4.0);
    let (a, b) = (Phantom::new(Matrix::identity(), u), Phantom::new(turned, u));
    let all = |p: &Phantom| {
        let scene = p.scene();
        let studio = Studio::new(&scene, 2.0);
        let mut rows = of_motion(&studio, &(&example()).into(), Progress::none()).unwrap();
        rows.push(labels::row(&studio, Progress::none()).unwrap());
        let uncertainty = example().segmentation.uncertainty.unwrap();
        rows.push(uncertainty::row(&studio, &uncertainty, Progress::none()).unwrap());
        flat(rows)
    };
    for (a, b) in all(&a).iter().zip(&all(&b)) {
        let mut differ = 0;
        for y in 0..a.canvas.height() {
            for x in 0..a.canvas.width() {
                let (p, q) = (a.canvas.at(x, y), b.canvas.at(x, y));
                differ += usize::from((0..3).any(|c| p[c].abs_diff(q[c]) > 2));
            }
        }
        // Rounding may shift the crossing of a contour that lies on a pixel's centre.
        assert!(differ < 30, "{}: {differ} pixels differ", a.name);
    }
}

#[test]
fn names_of_strips_stand_on_dark() {
    let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
    let scene = phantom.scene();
    let row = curtain::row(&Studio::new(&scene, 2.0), Progress::none()).unwrap();
    let canvas = find(&row.pictures, "sagittal_curtain");
    // In the middle strips the tissue reaches up to the names: above, below and beside them it is 0
    // HU.
    for strip in [2, 3] {
        let x = (2 * strip + 1) * canvas.width() / 12;
        let beside = x - text_width(["CT", "SIM"][strip % 2], 0.8 * LETTER) as usize / 2 - 4;
        let around = [(x, 35), (x, 70), (x - 35, 52)];
        assert_eq!(around.map(|(x, y)| canvas.at(x, y)), [[128; 3]; 3]);
        assert!(canvas.at(beside, 52)[0] < 60, "{:?}", canvas.at(beside, 52));
    }
}

#[test]
fn change_is_red_where_tissue_came_and_blue_where_it_left() {
    let phantom = Phantom::new(Matrix::identity(), Vector::new(6.0, 0.0, 0.0));
    let pictures = compared(&phantom);
    let canvas = find(&pictures, "axial_change");
    let px = 2.0 * 1.08 * 48.0 / SIZE;
    let row = (259.5 + MARKER[1] / px) as usize;
    let column = |x: f64| (259.5 + x / px) as usize;
    let half = crate::phantom::MARKER_HALF;
    let [r, _, b] = canvas.at(column(MARKER[0] + half + 3.0), row);
    assert!(r > 200 && b < 100, "{r} {b}");
    let [r, _, b] = canvas.at(column(MARKER[0] - half + 3.0), row);
    assert!(b > 200 && r < 100, "{r} {b}");
}

#[test]
fn scales_are_round() {
    for (x, want) in [(0.0, 1.0), (4.05, 5.0), (0.13, 0.15), (1.0, 1.0), (8.2, 10.0), (23.0, 30.0)]
    {
        assert!((round_up(x) - want).abs() < 1e-12, "{x} {}", round_up(x));
    }
}

#[test]
fn the_uncertain_half_of_the_chest_wall_is_striped_and_dashed() {
    let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
    let scene = phantom.scene();
    let studio = Studio::new(&scene, 2.0);
    let uncertainty = example().segmentation.uncertainty.unwrap();
    let mut rows = vec![labels::row(&studio, Progress::none()).unwrap()];
    rows.push(uncertainty::row(&studio, &uncertainty, Progress::none()).unwrap());
    assert!(
        rows[1].text.contains("7 %") && rows[1].text.contains("upper outer"),
        "{}",
        rows[1].text
    );
    let pictures = flat(rows);
    for (name, rows) in [("chest_wall_front", 200..320), ("axial_segmentation", 200..260)] {
        let canvas = find(&pictures, name);
        let white = |from: usize, to: usize| {
            let on =
                |x: usize| rows.clone().filter(|&y| canvas.at(x, y) == palette::UNCERTAIN).count();
            (from..to).map(on).sum::<usize>()
        };
        let middle = canvas.width() / 2;
        // Lettering is not of that white.
        assert!(white(middle + 20, middle + 120) > 100, "{name}: nothing uncertain at the left");
        assert_eq!(white(middle - 120, middle - 20), 0, "{name}: uncertain at the right");
    }
}
