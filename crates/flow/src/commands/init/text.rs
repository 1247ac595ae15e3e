//! The text of a case file that is begun: comments from the table of parameters.

use super::Init;
use super::tumour::Found;
use crate::folder::whole;
use crate::spec::{Parameter, Preset, TABLE, quoted};
use std::path::Path;
use supine_dicom::SeriesSummary;
use supine_space::{Posture, Side};

/// What a new case file says.
#[derive(Debug)]
pub(super) struct Page<'a> {
    pub(super) given: &'a Init,
    pub(super) series: &'a [SeriesSummary],
    pub(super) chosen: Option<String>,
    pub(super) posture: Posture,
    pub(super) breast: Option<Side>,
    pub(super) breast_proposed: bool,
    pub(super) tumour: &'a Found,
}

const HEAD: &str = "\
# A case of supine. Fill in the lines marked FILL IN (take `# FILL IN: ` away), then:
#   supine check THIS_FILE
#   supine run THIS_FILE --out RESULT
# Lengths are mm, positions are of the DICOM patient frame (LPS): x to the patient's left, y to her back, z to her head.
# Paths lead from this file's folder. Numbers have a decimal point: 7.5, not 7,5.
";

/// Keys that are written out before the optional ones.
const FIRST: [&str; 8] = [
    "ct",
    "series",
    "breast",
    "table.ap",
    "table.lat",
    "tumour.centre",
    "tumour.radius",
    "tumour.structure",
];

impl Page<'_> {
    pub(super) fn text(&self) -> String {
        let mut text = HEAD.to_owned();
        self.ct(&mut text);
        if self.posture != Posture::Supine {
            let (what, word) = (help("position"), self.posture.name());
            text += &format!("\n# {what}; as its Patient Position tells\nposition = \"{word}\"\n");
        }
        self.breast(&mut text);
        text += &format!(
            "\n# {}\n# {} (AP); {} (LAT)\n# FILL IN: table = {{ ap = 7.0, lat = 5.0 }}\n",
            "tilt of the operating table, degrees",
            help("table.ap"),
            help("table.lat")
        );
        self.tumour(&mut text);
        text +=
            "\n# ---- What follows has a default, which holds until its `# ` is taken away ----\n";
        let told = |key: &str| key == "position" && self.posture != Posture::Supine;
        let first = |key: &str| FIRST.contains(&key) || key == "tumour.file" || told(key);
        let rest = TABLE.iter().filter(|p| !first(p.key));
        rest.for_each(|parameter| text += &optional(parameter));
        text
    }

    fn ct(&self, text: &mut String) {
        *text += &format!("\n# {}\nct = {}\n", help("ct"), self.path(&self.given.ct));
        match (&self.chosen, self.series) {
            (Some(uid), _) => {
                *text +=
                    &format!("# {}: the only usable one\nseries = \"{uid}\"\n", help("series"));
            }
            (None, [_, _, ..]) => {
                *text += &format!("# {}; FILL IN: choose one\n", help("series"));
                for SeriesSummary { uid, description, slices } in self.series {
                    let description: String =
                        description.chars().filter(|c| !c.is_control()).collect();
                    *text += &format!("# series = \"{uid}\"   # {slices} slices, {description}\n");
                }
            }
            _ => {}
        }
    }

    fn breast(&self, text: &mut String) {
        let what = help("breast");
        *text += &match (self.breast, self.breast_proposed) {
            (Some(side), false) => format!("\n# {what}\nbreast = \"{side}\"\n"),
            (Some(side), true) => format!(
                "\n# {what}; proposed because the tumour lies there: CHECK\nbreast = \"{side}\"\n"
            ),
            (None, _) => format!("\n# {what}\n# FILL IN: breast = \"left\"\n"),
        };
    }

    fn tumour(&self, text: &mut String) {
        *text += "\n";
        *text += &match self.tumour {
            Found::Region { name, file, sphere, .. } => format!(
                "# {}\n# now: centre [{}] mm, radius {:.1} mm\ntumour = {{ structure = {}, file = {} }}\n",
                help("tumour.structure"),
                numbers(sphere.centre().coords.into()),
                sphere.radius(),
                quoted(name),
                self.path(file)
            ),
            Found::Place { centre, radius } => {
                let (mark, radius) = match radius {
                    Some(radius) => ("", format!("{radius:?}")),
                    None => ("# FILL IN the radius: ", "10.0".into()),
                };
                let centre = numbers(centre.coords.into());
                let what = format!("{}; {}, mm", help("tumour.centre"), help("tumour.radius"));
                format!("# {what}\n{mark}tumour = {{ centre = [{centre}], radius = {radius} }}\n")
            }
            Found::Nothing => format!(
                "# {}; {}, mm: as the planning system shows them for a CT taken head first, supine;\n\
                 # or the region of a structure set: tumour = {{ structure = \"GTV\", file = \"RS.dcm\" }}\n\
                 # FILL IN: tumour = {{ centre = [91.4, -248.1, -594.5], radius = 9.0 }}\n",
                help("tumour.centre"),
                help("tumour.radius")
            ),
        };
    }

    /// A path as it is written in the file: from its folder where it lies below.
    fn path(&self, path: &Path) -> String {
        let path = whole(path);
        let out = whole(&self.given.out);
        let below = out.parent().and_then(|folder| path.strip_prefix(folder).ok());
        let below = below.filter(|below| !below.as_os_str().is_empty());
        quoted(&below.unwrap_or(&path).to_string_lossy())
    }
}

fn help(key: &str) -> &'static str {
    TABLE.iter().find(|p| p.key == key).map_or("", |p| p.help)
}

fn numbers([x, y, z]: [f64; 3]) -> String {
    format!("{x:.2}, {y:.2}, {z:.2}")
}

/// A key that need not be given: its help, what it may be, and its line.
fn optional(parameter: &Parameter) -> String {
    let Parameter { key, help, .. } = parameter;
    let (line, default) = match parameter.default {
        Preset::Absent(what) => (parameter.example(), format!(" (default: {what})")),
        _ => (parameter.default_text(), String::new()),
    };
    format!("\n# {help}: {}{default}\n# {key} = {line}\n", parameter.expected())
}
