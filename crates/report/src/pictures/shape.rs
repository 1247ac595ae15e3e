//! The mesh as a body, and the shapes of its tetrahedra.

use super::bars::Bars;
use super::{Legend, Picture, Row, letter};
use crate::body::{Camera, Side};
use crate::canvas::{Canvas, Pen, Rgb};
use crate::{Error, Mesh, palette, tables};
use supine_mesh::{
    BoundaryTag, DIHEDRAL_CLASS_DEG, Edges, RADIUS_RATIO_CLASS, TetMesh, tet_quality,
};
use supine_mesh::{Faces, below};
use supine_space::{Plane, View};
use supine_space::{Point, Progress, Vector};

/// Pixels across each picture.
const SIZE: usize = 520;
/// Smallest dihedral angles, degrees, at the ends of the colour scale; a regular tetrahedron has
/// 70.5.
const SCALE_DEG: [f64; 2] = [20.0, 70.0];
/// Below this, degrees, a tetrahedron is drawn in red.
const POOR_DEG: f64 = 20.0;
/// The pictures show this much more than the mesh.
const AROUND: f64 = 1.12;

/// The boundary by tag from three sides.
pub(super) fn body(mesh: &TetMesh, progress: Progress<'_>) -> Result<Row, Error> {
    let (centre, extent) = extent(mesh);
    // The outer side of the breast is the one farther from the patient's middle.
    let outer = if centre.x >= 0.0 { Side::Left } else { Side::Right };
    let mut pictures = Vec::new();
    for (n, side) in [Side::Front, outer, Side::Back].into_iter().enumerate() {
        progress.at(n as f64 / 3.0)?;
        let camera = Camera { side, centre, pixel_mm: AROUND * extent / SIZE as f64, size: SIZE };
        let faces = mesh
            .boundary()
            .iter()
            .map(|f| (f.points.map(|p| mesh.points()[p as usize]), palette::tag(f.tag)));
        let mut canvas = camera.picture(faces);
        letter(&mut canvas, side.letters());
        let name = side.name();
        pictures.push(Picture {
            name: format!("mesh_{name}"),
            caption: format!("Boundary of the mesh in the CT, seen from the {name}"),
            canvas,
        });
    }
    Ok(Row {
        title: "Shape of the mesh".into(),
        text: "Skin cyan, chest wall orange, cut violet; where two colours meet the rims must be smooth curves."
            .into(),
        pictures,
        ..Row::default()
    })
}

/// Sections coloured by the smallest dihedral angle, the angles' histogram, and the worst.
pub(super) fn quality(
    mesh: &TetMesh,
    facts: &Mesh,
    focus: &Point,
    progress: Progress<'_>,
) -> Result<Row, Error> {
    let (centre, extent) = extent(mesh);
    let angles: Vec<f64> =
        (0..mesh.tets().len()).map(|t| tet_quality(&mesh.corners(t)).min_dihedral_deg).collect();
    let (edges, faces) = (Edges::new(mesh), Faces::new(mesh));
    let half = Vector::repeat(0.5 * AROUND * extent);
    let mut pictures = Vec::new();
    for (n, view) in [View::Axial, View::Sagittal].into_iter().enumerate() {
        progress.at(0.4 * n as f64)?;
        let pixel = AROUND * extent / SIZE as f64;
        let plane = Plane::new(view, focus, [centre - half, centre + half], pixel);
        let mut canvas = Canvas::new(plane.width, plane.height);
        for (n, tet) in below(mesh, &plane).into_iter().enumerate() {
            let rgb = tet.map_or(palette::NOTHING, |(t, _)| by_angle(angles[t]));
            canvas.mix(n, rgb, 1.0);
        }
        let cuts = faces.cut(&edges, None, &plane);
        let lines: Vec<_> = cuts.iter().map(|c| c.segment).collect();
        canvas.stroke(&lines, Pen::new(0.9, palette::BLACK).alpha(0.6));
        for tag in BoundaryTag::ALL {
            let own = cuts.iter().filter(|c| c.tag == Some(tag)).map(|c| c.segment);
            canvas.stroke_on_halo(&own.collect::<Vec<_>>(), Pen::new(1.8, palette::tag(tag)));
        }
        super::dress(&mut canvas, &plane, "");
        legend(&mut canvas);
        let name = view.name();
        pictures.push(Picture {
            name: format!("{name}_mesh_quality"),
            caption: format!("Smallest dihedral angle of each tetrahedron, {name}"),
            canvas,
        });
    }
    progress.at(0.8)?;
    pictures.push(Picture {
        name: "mesh_histograms".into(),
        caption: "How the shapes are spread".into(),
        canvas: histograms(facts),
    });
    Ok(Row {
        text: format!(
            "Shapes of the tetrahedra: the regular one has angles of 70.5 degrees and a radius ratio of 1. Red: \
             below {POOR_DEG} degrees, where the mechanics lose accuracy."
        ),
        pictures,
        table: Some(tables::worst(facts)),
        ..Row::default()
    })
}

/// The middle of the box round the mesh (LPS, mm), and its longest side, mm.
fn extent(mesh: &TetMesh) -> (Point, f64) {
    let (low, high) = mesh.bounds();
    (low + 0.5 * (high - low), (high - low).max())
}

fn by_angle(angle: f64) -> Rgb {
    if angle < POOR_DEG {
        return palette::CHEST_WALL;
    }
    let [low, high] = SCALE_DEG;
    palette::on_scale(&palette::RISING, (angle - low) / (high - low))
}

fn legend(canvas: &mut Canvas) {
    let [low, high] = SCALE_DEG;
    let middle = 0.5 * (low + high);
    let legend = Legend {
        colour: &|share| palette::on_scale(&palette::RISING, share),
        ticks: [low, middle, high].map(|t| format!("{t:.0}°")),
        title: "smallest dihedral angle",
    };
    legend.draw(canvas, 0);
}

/// Both histograms, one above the other.
fn histograms(facts: &Mesh) -> Canvas {
    let mut canvas = Canvas::new(SIZE, SIZE);
    canvas.rectangle([0, 0], [SIZE, SIZE], palette::NOTHING, 1.0);
    let angle = |n: usize| format!("{:.0}°", n as f64 * DIHEDRAL_CLASS_DEG);
    let ratio = |n: usize| format!("{:.1}", n as f64 * RADIUS_RATIO_CLASS);
    let half = SIZE / 2;
    let amounts = |counts: &[usize]| counts.iter().map(|n| *n as f64).collect();
    let colour = |_| palette::SKIN;
    let amounts_of = amounts(&facts.dihedral_angles);
    let angles = Bars { amounts: amounts_of, every: 6, tick: &angle, colour: &colour };
    angles.draw(&mut canvas, 0, half, "dihedral angles, share of all");
    let amounts_of = amounts(&facts.radius_ratios);
    let ratios = Bars { amounts: amounts_of, every: 4, tick: &ratio, colour: &colour };
    ratios.draw(&mut canvas, half, half, "radius ratio, share of tetrahedra");
    canvas
}
