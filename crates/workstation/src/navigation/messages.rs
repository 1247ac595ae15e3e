//! What a navigation says, in messages, and what the page is told of it: frames are LPS, all
//! numbers finite.

use crate::navigation::region;
use serde::Serialize;
use supine_openigtlink::{Content, Message, PointItem, Rows, Stamp, Status, StatusCode};
use supine_space::{Matrix, Point, Vector};
use supine_volume::Ct;

/// Device names of the navigator.
const APPLICATOR: &str = "Applicator";
const TUMOUR: &str = "Tumour";
/// And of the CT that it carries.
pub(crate) const REGION: &str = "Region";
/// Farther from the origin nothing of a patient lies, mm.
const FARTHEST: f64 = 10_000.0;
/// Largest diameter of a tumour, mm.
const LARGEST: f64 = 400.0;
/// How far the product of a rotation and its transpose may be off the unit matrix: its numbers are
/// short ones.
const RIGID: f64 = 0.005;
/// More of a text is not shown, letters.
const TEXT: usize = 300;
/// The state that has no new pose behind it.
pub(crate) const STALE: &str = "stale";

/// Where applicator and tumour are. Places and directions LPS, lengths mm.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct AnswerShown {
    /// `ok`, `predicted` or `stale`.
    pub(crate) state: &'static str,
    pub(crate) age_ms: Option<f64>,
    /// The tumour lies within this distance with a probability of 95 %.
    pub(crate) within_mm: Option<f64>,
    pub(crate) moved_mm: Option<f64>,
    pub(crate) from_surface_mm: Option<f64>,
    pub(crate) from_axis_mm: Option<f64>,
    pub(crate) force_n: Option<f64>,
    pub(crate) solver_error_mm: Option<f64>,
    pub(crate) tumour: [f64; 3],
    pub(crate) radius_mm: f64,
    /// Radii of the applicator's sphere and shaft.
    pub(crate) sphere_radius_mm: Option<f64>,
    pub(crate) shaft_radius_mm: Option<f64>,
    /// Where the tumour is without the applicator.
    pub(crate) rest: Option<[f64; 3]>,
    /// Centre of the sphere, and where the shaft points, of length 1.
    pub(crate) centre: [f64; 3],
    pub(crate) axis: [f64; 3],
    /// Of the pose, s since 1970; None: it has none.
    pub(crate) stamp: Option<f64>,
    /// Which pose it is of, exactly.
    #[serde(skip)]
    pub(crate) of: (Stamp, u32),
}

/// A message as far as it matters here.
#[derive(Debug)]
pub(crate) enum Heard {
    /// A pose and the tumour's place that goes with it.
    Answer(Box<AnswerShown>),
    /// The CT around the tumour as it is.
    Region(Box<Ct>),
    /// How the navigator is.
    Status { text: String, mood: Mood },
    /// It is of no use: why.
    Nonsense(String),
    /// It says nothing yet, or nothing that is shown.
    Nothing,
}

/// How the navigator is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mood {
    Well,
    /// Something is wrong: the text says what.
    Trouble,
    /// It is still so.
    Still,
    Ended,
}

/// Puts together what comes in two messages.
#[derive(Debug, Default)]
pub(crate) struct Ear {
    /// The last pose, with what tells to which answer it belongs.
    pose: Option<(Stamp, u32, Placed)>,
}

/// Where the applicator is, LPS, mm.
#[derive(Clone, Copy, Debug)]
struct Placed {
    centre: Point,
    /// Where its shaft points, of length 1.
    axis: Vector,
}

/// From a peer's frame to LPS; the way back is the same.
#[derive(Clone, Copy, Debug)]
enum Frame {
    Lps,
    Ras,
}

impl Frame {
    fn of(message: &Message) -> Result<Self, String> {
        match value(message, "frame") {
            Some("LPS") => Ok(Self::Lps),
            Some("RAS") => Ok(Self::Ras),
            Some(_) => Err("its frame is neither LPS nor RAS".into()),
            None => Err("it does not say its frame".into()),
        }
    }

    /// diag(-1, -1, 1) for RAS, from the left.
    fn to_lps(self, [x, y, z]: [f64; 3]) -> Vector {
        match self {
            Self::Lps => Vector::new(x, y, z),
            Self::Ras => Vector::new(-x, -y, z),
        }
    }
}

impl Ear {
    /// What a message says.
    pub(crate) fn hear(&mut self, message: &Message) -> Heard {
        let heard = match &message.content {
            Content::Transform(rows) if message.device == APPLICATOR => {
                // One that is wrong must not leave the one before for the next place.
                self.pose = None;
                placed(message, rows).map(|placed| {
                    self.pose = Some((message.stamp, message.id, placed));
                    Heard::Nothing
                })
            }
            Content::Points(points) if message.device == TUMOUR => {
                self.answer(message, points).map(|answer| Heard::Answer(Box::new(answer)))
            }
            Content::Image(image) if message.device == REGION => {
                region::read(image).map(|ct| Heard::Region(Box::new(ct)))
            }
            Content::Status(status) => Ok(status_of(status)),
            _ => Ok(Heard::Nothing),
        };
        heard.unwrap_or_else(Heard::Nonsense)
    }

    fn answer(&self, message: &Message, points: &[PointItem]) -> Result<AnswerShown, String> {
        let named = points.iter().find(|point| point.name.to_string() == TUMOUR);
        let point = named.ok_or("no point of it is the tumour")?;
        let state = match point.group.to_string().as_str() {
            "ok" => "ok",
            "predicted" => "predicted",
            "late" => "late",
            STALE => STALE,
            _ => return Err("its state is none of ok, predicted, late and stale".into()),
        };
        let frame = Frame::of(message)?;
        let tumour = place(frame, point.position).ok_or("the tumour\u{2019}s place is no place")?;
        let diameter = f64::from(point.diameter);
        if !(diameter > 0.0 && diameter <= LARGEST) {
            return Err("the tumour\u{2019}s diameter is no size".into());
        }
        let of_this =
            self.pose.filter(|(stamp, id, _)| (*stamp, *id) == (message.stamp, message.id));
        let (.., placed) = of_this.ok_or("the applicator\u{2019}s pose does not come with it")?;
        let moved = triple(message, "moved_mm")?.map(|moved| frame.to_lps(moved));
        let stamp = message.stamp.since_1970().map(|since| since.as_secs_f64());
        Ok(AnswerShown {
            state,
            age_ms: number(message, "age_ms")?,
            within_mm: number(message, "within_95_mm")?,
            moved_mm: moved.map(|moved| moved.norm()),
            from_surface_mm: number(message, "from_surface_mm")?,
            from_axis_mm: number(message, "from_axis_mm")?,
            force_n: triple(message, "force_n")?.map(|force| Vector::from(force).norm()),
            solver_error_mm: number(message, "solver_error_mm")?,
            tumour: tumour.coords.into(),
            radius_mm: 0.5 * diameter,
            sphere_radius_mm: number(message, "sphere_radius_mm")?,
            shaft_radius_mm: number(message, "shaft_radius_mm")?,
            rest: moved.map(|moved| (tumour - moved).coords.into()),
            centre: placed.centre.coords.into(),
            axis: placed.axis.into(),
            stamp,
            of: (message.stamp, message.id),
        })
    }
}

/// A STATUS. `Waiting` and `Stale` are said again each second.
fn status_of(status: &Status) -> Heard {
    let mood = match (status.code, status.name.as_str()) {
        (StatusCode::ShuttingDown, _) => Mood::Ended,
        (StatusCode::Ok, _) | (_, "Waiting") => Mood::Well,
        (_, "Stale") => Mood::Still,
        _ => Mood::Trouble,
    };
    Heard::Status { text: status.text.chars().take(TEXT).collect(), mood }
}

/// The pose of the applicator: its origin is the centre of the sphere, its shaft runs along -z.
fn placed(message: &Message, rows: &Rows) -> Result<Placed, String> {
    let frame = Frame::of(message)?;
    let column = |n: usize| rows.map(|row| row.get(n).copied().unwrap_or(f32::NAN));
    let centre = place(frame, column(3)).ok_or("the applicator\u{2019}s place is no place")?;
    let axes = [0, 1, 2].map(|n| frame.to_lps(column(n).map(f64::from)));
    let turn = Matrix::from_columns(&axes);
    let off = (turn.transpose() * turn - Matrix::identity()).abs().max();
    // NaN is not below the bound.
    if !(off < RIGID && turn.determinant() > 0.0) {
        return Err("the applicator\u{2019}s pose is not rigid".into());
    }
    let [_, _, z] = axes;
    Ok(Placed { centre, axis: -z.normalize() })
}

fn place(frame: Frame, given: [f32; 3]) -> Option<Point> {
    let place = Point::from(frame.to_lps(given.map(f64::from)));
    (place.coords.norm() < FARTHEST).then_some(place)
}

fn value<'a>(message: &'a Message, key: &str) -> Option<&'a str> {
    message.metadata.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
}

/// A number of the metadata: None where it is not there or not known.
fn number(message: &Message, key: &str) -> Result<Option<f64>, String> {
    match value(message, key) {
        None | Some("unknown") => Ok(None),
        Some(text) => finite(text, key).map(Some),
    }
}

/// Three numbers of it, with a space between them.
fn triple(message: &Message, key: &str) -> Result<Option<[f64; 3]>, String> {
    let Some(text) = value(message, key) else { return Ok(None) };
    let all: Vec<f64> =
        text.split(' ').take(4).map(|one| finite(one, key)).collect::<Result<_, _>>()?;
    let three =
        <[f64; 3]>::try_from(all).map_err(|_| format!("its {key} has not three numbers"))?;
    Ok(Some(three))
}

fn finite(text: &str, key: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| format!("its {key} is no number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(device: &str, frame: &str, content: Content) -> Message {
        let mut message = Message::new(device, Stamp(7 << 32), content);
        message.metadata =
            vec![("frame".into(), frame.into()), ("moved_mm".into(), "1 2 2".into())];
        message
    }

    fn pose(frame: &str, rows: Rows) -> Message {
        message(APPLICATOR, frame, Content::Transform(rows))
    }

    fn point(frame: &str, position: [f32; 3], group: &str) -> Message {
        let item = PointItem {
            name: TUMOUR.into(),
            group: group.into(),
            position,
            diameter: 18.0,
            ..PointItem::default()
        };
        message(TUMOUR, frame, Content::Points(vec![item]))
    }

    const UPRIGHT: Rows = [[1.0, 0.0, 0.0, 10.0], [0.0, 1.0, 0.0, 20.0], [0.0, 0.0, 1.0, 30.0]];

    fn answer(ear: &mut Ear, message: &Message) -> AnswerShown {
        match ear.hear(message) {
            Heard::Answer(answer) => *answer,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn ras_becomes_lps_from_the_left_and_the_shaft_points_along_minus_z() {
        // A quarter turn about x: the tool's z is the patient's -y in RAS, posterior: +y in LPS.
        let rows = [[1.0, 0.0, 0.0, 10.0], [0.0, 0.0, -1.0, 20.0], [0.0, 1.0, 0.0, 30.0]];
        let mut ear = Ear::default();
        assert!(matches!(ear.hear(&pose("RAS", rows)), Heard::Nothing));
        let told = answer(&mut ear, &point("RAS", [-1.0, 2.0, 3.0], "ok"));
        assert_eq!((told.centre, told.tumour), ([-10.0, -20.0, 30.0], [1.0, -2.0, 3.0]));
        assert_eq!(told.axis, [0.0, -1.0, 0.0]);
        assert_eq!((told.moved_mm, told.rest), (Some(3.0), Some([2.0, 0.0, 1.0])));
        assert_eq!((told.radius_mm, told.stamp, told.within_mm), (9.0, Some(7.0), None));
    }

    #[test]
    fn nonsense_is_said_and_leaves_no_pose_behind() {
        let mut ear = Ear::default();
        ear.hear(&pose("LPS", UPRIGHT));
        let place = [1.0, 2.0, 3.0];
        answer(&mut ear, &point("LPS", place, "stale"));
        let mut worded = point("LPS", place, "ok");
        worded.metadata.push(("age_ms".into(), "NaN".into()));
        let mut two = point("LPS", place, "ok");
        two.metadata[1].1 = "1 2".into();
        let mut silent = point("LPS", place, "ok");
        silent.metadata.clear();
        for wrong in [
            worded,
            two,
            silent,
            point("MNI", place, "ok"),
            point("LPS", [f32::NAN; 3], "ok"),
            point("LPS", [1e9; 3], "ok"),
            point("LPS", place, "perhaps"),
            message(TUMOUR, "LPS", Content::Points(vec![])),
        ] {
            assert!(matches!(ear.hear(&wrong), Heard::Nonsense(_)), "{wrong:?}");
        }
        answer(&mut ear, &point("LPS", place, "ok"));
        // A mirror image, a scaled pose, none: the pose before does not count.
        let mirror = UPRIGHT.map(|[x, y, z, t]| [-x, y, z, t]);
        let large = UPRIGHT.map(|[x, y, z, t]| [1.01 * x, y, z, t]);
        for rows in [mirror, large, [[f32::NAN; 4]; 3]] {
            ear.hear(&pose("LPS", UPRIGHT));
            assert!(matches!(ear.hear(&pose("LPS", rows)), Heard::Nonsense(_)), "{rows:?}");
            assert!(matches!(ear.hear(&point("LPS", place, "ok")), Heard::Nonsense(_)));
        }
    }

    #[test]
    fn a_place_with_the_pose_of_another_answer_is_none() {
        let mut ear = Ear::default();
        ear.hear(&pose("LPS", UPRIGHT));
        let later = Message { stamp: Stamp(8 << 32), ..point("LPS", [0.0; 3], "ok") };
        assert!(matches!(ear.hear(&later), Heard::Nonsense(_)));
    }
}
