//! The segmentation, drawn on the whole CT.

use super::{Picture, Row, Studio, dress, paint, uncertainty};
use crate::Error;
use supine_space::{Plane, Point, Progress, Vector, View};
use supine_volume::{LabelMap, label};

/// Air shown around the body, mm.
const MARGIN: f64 = 12.0;

/// Skin and chest wall in three planes through the region's centre.
pub(super) fn row(studio: &Studio<'_>, progress: Progress<'_>) -> Result<Row, Error> {
    let scene = studio.scene;
    let frame = extent(scene.labels);
    let pixel_mm = (frame[1] - frame[0]).max() / super::SIZE;
    let mut pictures = Vec::new();
    for (n, view) in View::ALL.into_iter().enumerate() {
        progress.at(n as f64 / 3.0)?;
        let plane = Plane::new(view, &scene.sphere.centre(), frame, pixel_mm);
        let mut canvas = paint(&plane, &supine_volume::sample_plane(scene.ct, &plane), 1.0);
        uncertainty::outlines(studio, &mut canvas, &plane);
        studio.outline_region(&mut canvas, &plane);
        studio.mark_before(&mut canvas, &plane, false);
        dress(&mut canvas, &plane, "");
        pictures.push(Picture {
            name: format!("{}_segmentation", view.name()),
            caption: format!("Segmentation, {}", view.name()),
            canvas,
        });
    }
    Ok(Row {
        title: "Segmentation".into(),
        text: "Skin cyan, chest wall orange (ribs, intercostals, pectoralis and all they enclose: \
               held still), white and dashed where it may lie off (below); region thinly dashed; \
               through the region's centre. All between skin and \
               chest wall within the region moves: where a line is wrong, the result is wrong."
            .into(),
        pictures,
        ..Row::default()
    })
}

/// Lower and upper corner of the body with some air, LPS, mm; of the volume when there is none.
fn extent(labels: &LabelMap) -> [Point; 2] {
    let grid = labels.grid();
    let (mut low, mut high) = (grid.size(), [0; 3]);
    for n in (0..grid.len()).filter(|n| labels.data()[*n] != label::OUTSIDE) {
        let voxel = grid.voxel(n);
        for a in 0..3 {
            low[a] = low[a].min(voxel[a]);
            high[a] = high[a].max(voxel[a]);
        }
    }
    if low[0] > high[0] {
        (low, high) = ([0; 3], grid.size().map(|n| n - 1));
    }
    let corners = (0..8).map(|n| grid.centre([0, 1, 2].map(|a| [low[a], high[a]][n >> a & 1])));
    let corners: Vec<Point> = corners.collect();
    let around = Vector::repeat(MARGIN);
    let first = [corners[0], corners[0]];
    let [low, high] = corners.iter().fold(first, |[l, h], c| [l.inf(c), h.sup(c)]);
    [low - around, high + around]
}
