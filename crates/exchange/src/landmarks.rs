//! Landmarks: places on the body that someone picked in each scan and in the CT, or where a scan
//! lies.

use crate::{Error, Problem, file};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::de::{self, Deserialize, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::{collections::BTreeMap, fmt, path::Path};
use supine_space::{Point, Pose};

/// Named points by frame: those of the scans, each in the frame of its scan, and those of the CT,
/// LPS; mm. Of a scan whose pose is known that instead.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Landmarks {
    points: BTreeMap<String, BTreeMap<String, Point>>,
    poses: BTreeMap<String, Pose>,
}

/// The frame of the CT.
const CT: &str = "ct";
/// Members of a file: frames, and a note for people.
const FRAMES: [&str; 4] = ["supine", "sitting", "intraop", CT];
const NOTE: &str = "note";
/// The rows of a pose are unit vectors at right angles to each other to within this.
const RIGID: f64 = 1e-3;

impl Landmarks {
    /// The frames that have points, by name: `ct`, `intraop`, `sitting`, `supine`.
    pub fn frames(&self) -> impl Iterator<Item = &str> {
        self.points.keys().map(String::as_str)
    }

    /// The points of a frame by name, mm.
    pub fn points(&self, frame: &str) -> Option<&BTreeMap<String, Point>> {
        self.points.get(frame)
    }

    /// The pose of a scan that the file gives: from its frame to that of the CT (LPS), mm.
    pub fn pose(&self, frame: &str) -> Option<Pose> {
        self.poses.get(frame).copied()
    }

    /// The points that a frame and the CT have in common, by name: where each lies in the frame,
    /// and in the CT (LPS); mm.
    pub fn pairs(&self, frame: &str) -> Vec<(Point, Point)> {
        let (Some(scan), Some(ct)) = (self.points(frame), self.points(CT)) else { return vec![] };
        scan.iter().filter_map(|(name, p)| Some((*p, *ct.get(name)?))).collect()
    }
}

/// Reads landmarks (`.json`): an object with an object `name: [x, y, z]` for each of `supine`,
/// `sitting`, `intraop` and `ct`, as far as there are; mm. For a scan a matrix of 4 rows of 4
/// numbers may stand instead, which takes its coordinates to those of the CT. A member `note` says
/// something to people.
///
/// # Errors
/// When the name ends otherwise, the file cannot be read or is malformed, a member has another
/// name, a name occurs twice, or a position is not three finite numbers.
pub fn read_landmarks(path: &Path) -> Result<Landmarks, Error> {
    let bytes = file::read(path)?;
    let landmarks = if file::has_suffix(path, ".json") {
        parse(&bytes)
    } else {
        Err(Problem::Format("landmarks as .json"))
    };
    landmarks.map_err(|p| p.of(path))
}

fn parse(bytes: &[u8]) -> Result<Landmarks, Problem> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    serde_json::from_slice(bytes).map_err(|e| Problem::Landmarks(e.to_string()))
}

impl<'de> Deserialize<'de> for Landmarks {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Frames)
    }
}

/// Takes the frames of a file.
struct Frames;

impl<'de> Visitor<'de> for Frames {
    type Value = Landmarks;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object with an object `name: [x, y, z]` for each frame")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut members: M) -> Result<Landmarks, M::Error> {
        let mut all = Landmarks::default();
        while let Some(name) = members.next_key::<String>()? {
            if name == NOTE {
                members.next_value::<IgnoredAny>()?;
            } else if FRAMES.contains(&name.as_str()) {
                if all.poses.contains_key(&name) || all.points.contains_key(&name) {
                    return Err(twice(&name));
                }
                match members.next_value()? {
                    Placed::Pose(_) if name == CT => {
                        return Err(de::Error::custom(
                            "`ct` has points, not a pose: it is the frame",
                        ));
                    }
                    Placed::Pose(pose) => drop(all.poses.insert(name, pose)),
                    Placed::Points(points) => drop(all.points.insert(name, points)),
                }
            } else {
                return Err(unknown(&name));
            }
        }
        Ok(all)
    }
}

/// What stands for a frame.
enum Placed {
    Points(BTreeMap<String, Point>),
    Pose(Pose),
}

impl<'de> Deserialize<'de> for Placed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Names)
    }
}

/// The pose of a matrix.
fn pose(rows: &[Vec<f64>]) -> Option<Pose> {
    let rows: Vec<[f64; 4]> =
        rows.iter().map(|row| row.as_slice().try_into().ok()).collect::<Option<_>>()?;
    let [a, b, c, [0.0, 0.0, 0.0, 1.0]] = rows.as_slice() else { return None };
    let turn = Matrix3::from_fn(|row, column| [a, b, c][row][column]);
    let rigid = (turn.transpose() * turn - Matrix3::identity()).amax() < RIGID;
    let shift = Translation3::new(a[3], b[3], c[3]);
    let finite = turn.iter().chain(shift.vector.iter()).all(|x| x.is_finite());
    (finite && rigid && turn.determinant() > 0.0).then(|| {
        let turn = Rotation3::from_matrix_eps(&turn, 1e-12, 100, Rotation3::identity());
        Pose::from_parts(shift, UnitQuaternion::from_rotation_matrix(&turn))
    })
}

/// Takes the points of a frame, or its pose.
struct Names;

impl<'de> Visitor<'de> for Names {
    type Value = Placed;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object `name: [x, y, z]` or a matrix of 4 rows")
    }

    fn visit_seq<S: SeqAccess<'de>>(self, mut members: S) -> Result<Placed, S::Error> {
        let mut rows: Vec<Vec<f64>> = Vec::new();
        while let Some(row) = members.next_element()? {
            rows.push(row);
        }
        let text = "a pose is 4 rows of 4 numbers, the last 0 0 0 1: a turn without scale or mirror, and a shift in mm";
        pose(&rows).map(Placed::Pose).ok_or_else(|| de::Error::custom(text))
    }

    fn visit_map<M: MapAccess<'de>>(self, mut members: M) -> Result<Placed, M::Error> {
        let mut points = BTreeMap::new();
        while let Some((name, position)) = members.next_entry::<String, Vec<f64>>()? {
            let Ok(position) = <[f64; 3]>::try_from(position) else {
                let text = format!("the position of `{}` is not three numbers", shown(&name));
                return Err(de::Error::custom(text));
            };
            if points.contains_key(&name) {
                return Err(twice(&name));
            }
            points.insert(name, position.into());
        }
        Ok(Placed::Points(points))
    }
}

/// JSON lets a name occur twice, and most readers then forget the first.
fn twice<E: de::Error>(name: &str) -> E {
    E::custom(format!("`{}` occurs twice", shown(name)))
}

/// The error of a member that is no frame.
fn unknown<E: de::Error>(name: &str) -> E {
    let unlike = |known: &&&str| strsim::damerau_levenshtein(known, &name.to_lowercase());
    let nearest = FRAMES.iter().min_by_key(unlike).unwrap_or(&CT);
    let known = FRAMES.join("`, `");
    let name = shown(name);
    E::custom(format!("`{name}` is not one of `{known}`; did you mean `{nearest}`?"))
}

/// A name as far as it can be shown.
fn shown(name: &str) -> String {
    name.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{
        "note": {"rough": ["picks"]},
        "sitting": {"notch": [1, 2, 3], "xiphoid": [4, 5.5, -6e1], "only here": [0, 0, 0]},
        "ct": {"xiphoid": [7, 8, 9], "notch": [10, 11, 12]}
    }"#;

    #[test]
    fn pairs_are_what_a_frame_and_the_ct_have_in_common() {
        let landmarks = parse(GOOD.as_bytes()).unwrap();
        assert!(landmarks.frames().eq(["ct", "sitting"]));
        assert_eq!(landmarks.points("sitting").unwrap().len(), 3);
        let at = |x: [f64; 3]| Point::from(x);
        let pairs = [
            (at([1.0, 2.0, 3.0]), at([10.0, 11.0, 12.0])),
            (at([4.0, 5.5, -60.0]), at([7.0, 8.0, 9.0])),
        ];
        assert_eq!(landmarks.pairs("sitting"), pairs);
        assert!(landmarks.pairs("supine").is_empty() && landmarks.points("supine").is_none());
        assert_eq!(parse(b"\xef\xbb\xbf{}").unwrap(), Landmarks::default());
    }

    #[test]
    fn what_are_no_landmarks_is_refused_with_its_place() {
        let refused = |text: &str| parse(text.as_bytes()).unwrap_err().to_string();
        let unknown = refused("{\n\"Siting\": {}}");
        assert!(
            unknown.contains("did you mean `sitting`?") && unknown.contains("line 2"),
            "{unknown}"
        );
        assert!(refused(r#"{"ct": {}, "ct": {}}"#).contains("`ct` occurs twice"));
        let twice = refused(r#"{"ct": {"a": [1, 2, 3], "a": [4, 5, 6]}}"#);
        assert!(twice.contains("`a` occurs twice"), "{twice}");
        assert!(refused(r#"{"ct": {"a": [1, 2]}}"#).contains("`a` is not three"));
        assert!(refused(r#"{"ct": {"a": [1, 2, 3, 4]}}"#).contains("`a` is not three"));
        assert!(refused(r#"{"ct": {"a": [1, 2, 1e999]}}"#).contains("out of range"));
        assert!(refused(r#"{"ct": {"a": [1, 2, NaN]}}"#).contains("line 1"));
        assert!(refused(r#"{"ct": 1}"#).contains("object `name: [x, y, z]`"));
        assert!(refused(r#"{"ct": [[1], [2]]}"#).contains("4 rows of 4 numbers"));
        assert!(refused("[]").contains("for each frame"));
        assert!(refused("").contains("landmarks"));
    }

    #[test]
    fn a_pose_stands_for_landmarks_when_it_is_one() {
        let turned = "[[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]";
        let of = |frame: &str, rows: &str| parse(format!("{{\"{frame}\": {rows}}}").as_bytes());
        let read = of("sitting", turned).unwrap();
        let found = read.pose("sitting").unwrap() * Point::new(1.0, 2.0, 3.0);
        assert!((found - Point::new(3.0, 7.0, 10.0)).norm() < 1e-9, "{found}");
        assert!(read.points("sitting").is_none() && read.pose("supine").is_none());
        assert!(of("ct", turned).unwrap_err().to_string().contains("not a pose"));
        for wrong in ["[[0, 1", "[[0, -2", "[[0, -1.01", "[[1e999, -1"] {
            let rows = turned.replace("[[0, -1", wrong);
            assert!(of("sitting", &rows).is_err(), "{rows}");
        }
    }

    #[test]
    fn the_landmarks_of_the_fixture_are_read() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../fixtures/patient/scans/landmarks.json");
        let landmarks = read_landmarks(&file).unwrap();
        assert!(landmarks.frames().eq(["ct", "intraop", "sitting", "supine"]));
        let pairs = landmarks.pairs("intraop");
        assert_eq!(pairs.len(), 4);
        // The picks of both are some mm off: what lies between any two of them is as long in both.
        let apart = |n: usize| [(pairs[0].0 - pairs[n].0).norm(), (pairs[0].1 - pairs[n].1).norm()];
        assert!((1..4).map(apart).all(|[scan, ct]| (scan - ct).abs() < 20.0));
        assert!(read_landmarks(Path::new("landmarks.csv")).is_err());
    }
}
