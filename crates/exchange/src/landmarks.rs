//! Landmarks: places on the body that someone picked in each scan and in the CT.

use crate::{Error, Problem, file};
use serde::de::{self, Deserialize, Deserializer, IgnoredAny, MapAccess, Visitor};
use std::{collections::BTreeMap, fmt, path::Path};
use supine_space::Point;

/// Named points by frame: those of the scans, each in the frame of its scan, and those of the CT, LPS; mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Landmarks(BTreeMap<String, BTreeMap<String, Point>>);

/// The frame of the CT.
const CT: &str = "ct";
/// Members of a file: frames, and a note for people.
const FRAMES: [&str; 4] = ["supine", "sitting", "intraop", CT];
const NOTE: &str = "note";

impl Landmarks {
    /// The frames that have points, by name: `ct`, `intraop`, `sitting`, `supine`.
    pub fn frames(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// The points of a frame by name, mm.
    pub fn points(&self, frame: &str) -> Option<&BTreeMap<String, Point>> {
        self.0.get(frame)
    }

    /// The points that a frame and the CT have in common, by name: where each lies in the frame, and in the CT (LPS); mm.
    pub fn pairs(&self, frame: &str) -> Vec<(Point, Point)> {
        let (Some(scan), Some(ct)) = (self.points(frame), self.points(CT)) else { return vec![] };
        scan.iter().filter_map(|(name, p)| Some((*p, *ct.get(name)?))).collect()
    }
}

/// Reads landmarks (`.json`): an object with an object `name: [x, y, z]` for each of `supine`, `sitting`, `intraop` and `ct`, as far
/// as there are; mm. A member `note` says something to people.
///
/// # Errors
/// When the name ends otherwise, the file cannot be read or is malformed, a member has another name, a name
/// occurs twice, or a position is not three finite numbers.
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
        let mut frames = BTreeMap::new();
        while let Some(name) = members.next_key::<String>()? {
            if name == NOTE {
                members.next_value::<IgnoredAny>()?;
            } else if FRAMES.contains(&name.as_str()) {
                let Points(points) = members.next_value()?;
                insert(&mut frames, name, points)?;
            } else {
                return Err(unknown(&name));
            }
        }
        Ok(Landmarks(frames))
    }
}

/// The points of a frame.
struct Points(BTreeMap<String, Point>);

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Names).map(Self)
    }
}

/// Takes the points of a frame.
struct Names;

impl<'de> Visitor<'de> for Names {
    type Value = BTreeMap<String, Point>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object `name: [x, y, z]`")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut members: M) -> Result<Self::Value, M::Error> {
        let mut points = BTreeMap::new();
        while let Some((name, position)) = members.next_entry::<String, Vec<f64>>()? {
            let Ok(position) = <[f64; 3]>::try_from(position) else {
                let text = format!("the position of `{}` is not three numbers", shown(&name));
                return Err(de::Error::custom(text));
            };
            insert(&mut points, name, position.into())?;
        }
        Ok(points)
    }
}

/// JSON lets a name occur twice, and most readers then forget the first.
fn insert<T, E: de::Error>(map: &mut BTreeMap<String, T>, name: String, value: T) -> Result<(), E> {
    if map.contains_key(&name) {
        return Err(E::custom(format!("`{}` occurs twice", shown(&name))));
    }
    map.insert(name, value);
    Ok(())
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
        assert!(refused(r#"{"ct": [1, 2, 3]}"#).contains("object `name: [x, y, z]`"));
        assert!(refused("[]").contains("for each frame"));
        assert!(refused("").contains("landmarks"));
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
