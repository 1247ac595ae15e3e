//! The mesh, cut by the planes, in the CT shape and in the operating position.

use super::{Picture, Row, Studio, dress, paint};
use crate::canvas::{Canvas, Pen, Spot};
use crate::{Error, palette};
use supine_mesh::BoundaryTag;
use supine_mesh::{FaceCut, Faces};
use supine_space::Progress;

/// The mesh in the CT shape, and in the operating position.
pub(super) fn rows(studio: &Studio<'_>, progress: Progress<'_>) -> Result<Vec<Row>, Error> {
    let scene = studio.scene;
    let faces = Faces::new(scene.mesh());
    let (mut rest, mut moved) = (Vec::new(), Vec::new());
    for (n, plane) in studio.planes().into_iter().enumerate() {
        progress.at(n as f64 / 3.0)?;
        let mut canvas = paint(&plane, &supine_volume::sample_plane(scene.ct, &plane), 0.85);
        draw(&mut canvas, &faces.cut(&studio.edges, None, &plane));
        studio.mark_before(&mut canvas, &plane, false);
        dress(&mut canvas, &plane, "CT");
        let name = plane.view.name();
        rest.push(Picture {
            name: format!("{name}_mesh_ct"),
            caption: format!("Mesh in the CT, {name}"),
            canvas,
        });
        let mut canvas = paint(&plane, &supine_volume::sample_plane(scene.deformed, &plane), 0.85);
        draw(&mut canvas, &faces.cut(&studio.edges, Some(scene.displacement()), &plane));
        studio.mark_after(&mut canvas, &plane);
        dress(&mut canvas, &plane, "SIMULATED");
        moved.push(Picture {
            name: format!("{name}_mesh_moved"),
            caption: format!("Mesh on the operating table, {name}"),
            canvas,
        });
    }
    let row = |title: &str, text: &str, pictures| Row {
        title: title.into(),
        text: text.into(),
        pictures,
        ..Row::default()
    };
    Ok(vec![
        row(
            "Mesh",
            "Its faces where the plane cuts them. Boundary: skin cyan (free), chest wall orange \
             (held), cut violet (end of what is simulated).",
            rest,
        ),
        row("", "The same mesh, moved, on the simulated CT: its skin must lie on the skin.", moved),
    ])
}

fn draw(canvas: &mut Canvas, cuts: &[FaceCut]) {
    let lines = |tag: Option<BoundaryTag>| -> Vec<[Spot; 2]> {
        cuts.iter().filter(|c| c.tag == tag).map(|c| c.segment).collect()
    };
    canvas.stroke(&lines(None), Pen::new(0.9, palette::INNER).alpha(0.5));
    for tag in [BoundaryTag::Cut, BoundaryTag::ChestWall, BoundaryTag::Skin] {
        canvas.stroke_on_halo(&lines(Some(tag)), Pen::new(1.8, palette::tag(tag)));
    }
}
