//! 3D Slicer markups, `.mrk.json`.
//!
//! Facts: the schema of 3D Slicer, `markups-schema-v1.0.3.json`: lists of control points, each
//! list in its own `coordinateSystem`.

use crate::{NamedPoint, Problem};
use serde::{Deserialize, Serialize};
use supine_space::Point;

const SCHEMA: &str = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/\
                      Markups/Resources/Schema/markups-schema-v1.0.3.json#";

/// The points of one list, LPS, mm.
#[derive(Debug)]
pub(crate) struct List {
    pub(crate) name: Option<String>,
    pub(crate) points: Vec<NamedPoint>,
}

#[derive(Serialize, Deserialize)]
struct Document {
    #[serde(rename = "@schema", default)]
    schema: String,
    markups: Vec<Markup>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup {
    #[serde(rename = "type", default)]
    kind: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    coordinate_system: Option<String>,
    coordinate_units: Option<serde_json::Value>,
    #[serde(default)]
    control_points: Vec<ControlPoint>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct ControlPoint {
    #[serde(default)]
    id: String,
    #[serde(default)]
    label: String,
    position: Option<Vec<f64>>,
    #[serde(default)]
    position_status: Option<String>,
}

/// The lists of a document; control points that were announced but never placed are left out.
pub(crate) fn parse(bytes: &[u8]) -> Result<Vec<List>, Problem> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let document: Document =
        serde_json::from_slice(bytes).map_err(|e| Problem::Json(e.to_string()))?;
    document.markups.into_iter().map(list).collect()
}

fn list(markup: Markup) -> Result<List, Problem> {
    let sign = match markup.coordinate_system.as_deref() {
        None | Some("LPS" | "1") => 1.0,
        Some("RAS" | "0") => -1.0,
        Some(other) => {
            let reason = format!("`{other}` is neither LPS nor RAS");
            return Err(Problem::field("coordinateSystem", reason));
        }
    };
    // A unit is "mm" or a coded entry ["mm", "UCUM", "millimeter"].
    let unit = markup.coordinate_units.as_ref();
    let unit = unit.and_then(|u| u.as_str().or_else(|| u.get(0)?.as_str()));
    if let Some(other) = unit.filter(|&u| u != "mm") {
        return Err(Problem::field("coordinateUnits", format!("`{other}` instead of mm")));
    }
    let mut points = Vec::new();
    for (n, point) in markup.control_points.into_iter().enumerate() {
        if !matches!(point.position_status.as_deref(), None | Some("defined")) {
            continue;
        }
        let xyz: Option<[f64; 3]> = point.position.and_then(|p| p.try_into().ok());
        let Some([x, y, z]) = xyz.filter(|p| p.iter().all(|c| c.is_finite())) else {
            let reason = "`position` is not three numbers";
            return Err(Problem::Point { number: n + 1, name: point.label, reason });
        };
        points.push(NamedPoint { name: point.label, position: Point::new(sign * x, sign * y, z) });
    }
    Ok(List { name: markup.name, points })
}

/// One list of points, LPS, mm.
pub(crate) fn compose(points: &[NamedPoint]) -> Result<String, serde_json::Error> {
    let control_points = points.iter().enumerate().map(|(n, p)| ControlPoint {
        id: (n + 1).to_string(),
        label: p.name.clone(),
        position: Some(p.position.coords.iter().copied().collect()),
        position_status: Some("defined".into()),
    });
    let markup = Markup {
        kind: "Fiducial".into(),
        name: None,
        coordinate_system: Some("LPS".into()),
        coordinate_units: Some("mm".into()),
        control_points: control_points.collect(),
    };
    let document = Document { schema: SCHEMA.into(), markups: vec![markup] };
    serde_json::to_string_pretty(&document).map(|text| text + "\n")
}
