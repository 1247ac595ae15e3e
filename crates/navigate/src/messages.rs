//! What the navigator sends.

use crate::answer::{Answer, State};
use crate::frame::Frame;
use std::time::SystemTime;
use supine_mesh::Deformation;
use supine_openigtlink::{
    Attribute, AttributeKind, AttributeOf, Content, Endian, Image, ImageFrame, ImageLayout,
    Message, PointItem, PolyData, Position, Rotation, Rows, Scalar, Stamp, Status, StatusCode,
    Text, Version,
};
use supine_space::{Grid, Pose};
use supine_volume::Ct;

/// Device name of the tumour's place.
pub(crate) const TUMOUR: &str = "Tumour";
/// Device name of the applicator's pose.
pub(crate) const APPLICATOR: &str = "Applicator";
/// Device name of the tissue's surface.
pub(crate) const SURFACE: &str = "Surface";
/// Device name of the CT around the tumour.
pub(crate) const REGION: &str = "Region";
/// Device name of all else.
pub(crate) const NAVIGATOR: &str = "supine";

/// Types that are sent or taken, for CAPABILITY.
pub(crate) const TYPES: [&str; 22] = [
    "TRANSFORM",
    "STATUS",
    "POSITION",
    "POINT",
    "POLYDATA",
    "IMAGE",
    "STRING",
    "CAPABILITY",
    "GET_TRANS",
    "GET_POSITION",
    "GET_POINT",
    "GET_POLYDATA",
    "GET_IMAGE",
    "GET_STATUS",
    "GET_STRING",
    "GET_CAPABIL",
    "STT_TRANS",
    "STP_TRANS",
    "STT_POLYDATA",
    "STP_POLYDATA",
    "STT_IMAGE",
    "STP_IMAGE",
];

/// Green, amber, red and grey, as a planner reads them; the group says the same in a word.
fn colour(state: State) -> [u8; 4] {
    match state {
        State::Ok => [0, 158, 115, 255],
        State::Predicted => [230, 159, 0, 255],
        State::Late => [213, 94, 0, 255],
        State::Stale => [128, 128, 128, 255],
    }
}

/// The time now.
pub(crate) fn now() -> Stamp {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since.map(Stamp::from_since_1970).unwrap_or_default()
}

/// The tumour as a point; a peer of version 2 is told the figures as well.
pub(crate) fn point(answer: &Answer, radius_mm: f64, frame: Frame, version: Version) -> Message {
    let item = PointItem {
        name: TUMOUR.into(),
        group: answer.state.name().into(),
        rgba: colour(answer.state),
        position: frame.place(&answer.tissue.target),
        diameter: (2.0 * radius_mm) as f32,
        owner: REGION.into(),
    };
    let message = Message::new(TUMOUR, answer.stamp, Content::Points(vec![item]));
    with_figures(message, answer, frame, version)
}

/// The tumour as a position.
pub(crate) fn position(answer: &Answer, frame: Frame, version: Version) -> Message {
    // Some peers have no room for a position without rotation.
    let rotation = Rotation::Quaternion([0.0, 0.0, 0.0, 1.0]);
    let content = Position { position: frame.place(&answer.tissue.target), rotation };
    let message = Message::new(TUMOUR, answer.stamp, Content::Position(content));
    with_figures(message, answer, frame, version)
}

/// The applicator's pose in the patient.
pub(crate) fn transform(answer: &Answer, frame: Frame, version: Version) -> Message {
    let content = Content::Transform(rows(&(frame.turn() * answer.pose)));
    with_figures(Message::new(APPLICATOR, answer.stamp, content), answer, frame, version)
}

fn rows(pose: &Pose) -> Rows {
    let (turn, shift) = (pose.rotation.to_rotation_matrix(), pose.translation.vector);
    [0, 1, 2]
        .map(|r| [turn[(r, 0)] as f32, turn[(r, 1)] as f32, turn[(r, 2)] as f32, shift[r] as f32])
}

/// Metadata, in version 2.
fn with_figures(mut message: Message, answer: &Answer, frame: Frame, version: Version) -> Message {
    if version == Version::Two {
        let vector = |v: [f32; 3]| v.map(|v| format!("{v:.3}")).join(" ");
        let within = answer.within_mm.map_or_else(|| "unknown".into(), |mm| format!("{mm:.2}"));
        let figures = [
            ("frame", frame.name().to_owned()),
            ("state", answer.state.name().to_owned()),
            ("age_ms", format!("{:.2}", answer.age_s * 1e3)),
            ("within_95_mm", within),
            ("solver_error_mm", format!("{:.4}", answer.tissue.error_mm)),
            ("moved_mm", vector(frame.out(&answer.tissue.moved))),
            ("force_n", vector(frame.out(&answer.tissue.force_n))),
            ("from_surface_mm", format!("{:.2}", answer.tissue.from_surface_mm)),
            ("from_axis_mm", format!("{:.2}", answer.tissue.from_axis_mm)),
            ("sphere_radius_mm", format!("{:.2}", answer.tool.radius_mm)),
            ("shaft_radius_mm", format!("{:.2}", answer.tool.shaft_radius_mm)),
        ];
        message.metadata = figures.map(|(key, value)| (key.to_owned(), value)).into();
        message.version = version;
        message.id = answer.number as u32;
    }
    message
}

/// How the navigator is.
pub(crate) fn status(code: StatusCode, name: &str, text: &str) -> Message {
    Message::new(NAVIGATOR, now(), Content::Status(Status::new(code, name, text)))
}

/// Text, for peers that know no STATUS.
pub(crate) fn text(text: &str) -> Message {
    Message::new(NAVIGATOR, now(), Content::Text(Text::new(text)))
}

/// The surface of the tissue, but for where it was cut from the body.
pub(crate) fn surface(
    deformation: &Deformation,
    triangles: &[[u32; 3]],
    stamp: Stamp,
    frame: Frame,
) -> Message {
    let (mesh, u) = (deformation.mesh(), deformation.displacement().values());
    let mut number = vec![u32::MAX; mesh.points().len()];
    let mut shown = PolyData::default();
    let mut moved = vec![];
    for triangle in triangles {
        let corners = triangle.map(|p| {
            let at = p as usize;
            if number[at] == u32::MAX {
                number[at] = shown.points.len() as u32;
                shown.points.push(frame.place(&(mesh.points()[at] + u[at])));
                moved.push(u[at].norm() as f32);
            }
            number[at]
        });
        shown.polygons.push(&corners);
    }
    let attribute =
        Attribute::new(AttributeOf::Points, AttributeKind::Scalars, 1, "displacement_mm", moved);
    shown.attributes.extend(attribute);
    Message::new(SURFACE, stamp, Content::PolyData(shown))
}

/// A part of the CT as it is now, HU, with the displacement of its tissue. None for a grid that an
/// image cannot say.
pub(crate) fn image(ct: &Ct, stamp: Stamp, frame: Frame) -> Option<Message> {
    let layout = layout(ct.grid(), frame)?;
    let bytes = ct.data().iter().flat_map(|hu| hu.to_le_bytes()).collect();
    let image = Image::new(layout, bytes).ok()?;
    Some(Message::new(REGION, stamp, Content::Image(image)))
}

fn layout(grid: &Grid, frame: Frame) -> Option<ImageLayout> {
    let mut size = [0; 3];
    for (to, from) in size.iter_mut().zip(grid.size()) {
        *to = u16::try_from(from).ok()?;
    }
    let first = grid.patient_from_index([0.0; 3]);
    let step = |axis: usize| {
        let mut index = [0.0; 3];
        index[axis] = 1.0;
        frame.out(&(grid.patient_from_index(index) - first))
    };
    let steps = [step(0), step(1), step(2)];
    let first = frame.place(&first).map(f64::from);
    Some(ImageLayout {
        components: 1,
        scalar: Scalar::I16,
        endian: Endian::Little,
        frame: if frame == Frame::Ras { ImageFrame::Ras } else { ImageFrame::Lps },
        size,
        steps,
        centre: ImageLayout::centre_of(first, &steps, size),
        start: [0; 3],
        extent: size,
    })
}
