//! Which region of a file is which part of the patient.

use supine_dicom::Meaning;
use supine_space::Warning;
use supine_volume::label;

/// Names of regions, as the user gives them; several are joined.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct RegionNames {
    /// The whole patient within her skin; soft tissue is what the chest wall leaves of it.
    pub body: Vec<String>,
    /// All between skin and chest wall, instead of the body.
    pub soft_tissue: Vec<String>,
    /// The chest wall with all it encloses.
    pub chest_wall: Vec<String>,
}

impl RegionNames {
    /// Whether any name is given.
    pub(crate) fn given(&self) -> bool {
        *self != Self::default()
    }
}

/// Why the regions cannot be told apart.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum RegionNameError {
    /// Nothing is called so.
    #[error(
        "no region is the {part} by its code, type or name; there are {}; name it: labels = {{ \
         file = ..., {key} = \"...\" }}",
        quoted(found)
    )]
    NotFound {
        /// The part, in words.
        part: &'static str,
        /// Key of the case file.
        key: &'static str,
        /// All names in the file.
        found: Vec<String>,
    },
    /// Several are.
    #[error(
        "several regions could be the {part}: {}; name one, or a list to join: labels = {{ file = \
         ..., {key} = \"...\" }}",
        quoted(found)
    )]
    Ambiguous {
        /// The part, in words.
        part: &'static str,
        /// Key of the case file.
        key: &'static str,
        /// Their names.
        found: Vec<String>,
    },
    /// A name that is not there, or not once.
    #[error(
        "`{key}` names {asked:?}, which {times} region(s) of the file are called; there are {}",
        quoted(found)
    )]
    Named {
        /// Key of the case file.
        key: &'static str,
        /// The name.
        asked: String,
        /// How many regions have it.
        times: usize,
        /// All names in the file.
        found: Vec<String>,
    },
    /// Two ways to say the same.
    #[error("`body` and `soft_tissue` exclude each other: name one of them")]
    BodyAndSoftTissue,
    /// Names for a file that has no named regions.
    #[error(
        "the labels of this file have no names, only numbers (those of docs/CONVENTIONS.md): leave \
         the names away, or give a file with names: .seg.nrrd, DICOM, or NIfTI with a table of labels"
    )]
    Nameless,
}

fn quoted(names: &[String]) -> String {
    /// Names told in one message.
    const TOLD: usize = 20;
    let mut quoted: Vec<String> = names.iter().take(TOLD).map(|n| format!("{n:?}")).collect();
    if names.len() > TOLD {
        quoted.push(format!("{} more", names.len() - TOLD));
    }
    quoted.join(", ")
}

/// A region that may be a part.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) name: String,
    pub(super) meaning: Option<Meaning>,
}

/// What is made of the regions, which are named by their places in the list.
#[derive(Debug, PartialEq)]
pub(super) enum Plan {
    /// Every region is a label of ours.
    Labels { labels: Vec<(usize, u8)>, left_out: Vec<String> },
    /// Body or soft tissue, and chest wall.
    Parts { outer: Outer, wall: Vec<usize>, warnings: Vec<Warning> },
}

/// What reaches to the skin.
#[derive(Debug, PartialEq)]
pub(super) enum Outer {
    Body(Vec<usize>),
    SoftTissue(Vec<usize>),
}

/// A part and how it is recognised. Names in small letters and digits only.
struct Role {
    part: &'static str,
    key: &'static str,
    meaning: Meaning,
    names: &'static [&'static str],
    /// Names that mostly mean it, told in a warning.
    loose: &'static [&'static str],
}

const BODY: Role = Role {
    part: "body",
    key: "body",
    meaning: Meaning::Body,
    names: &[
        "body",
        "external",
        "patient",
        "outline",
        "bodyoutline",
        "patientoutline",
        "bodycontour",
        "outercontour",
        "externalcontour",
        "bodyexternal",
        "externalbody",
    ],
    loose: &["skin"],
};
const SOFT_TISSUE: Role = Role {
    part: "soft tissue",
    key: "soft_tissue",
    meaning: Meaning::Label(label::SOFT_TISSUE),
    names: &["softtissue", "softtissues"],
    loose: &["breast"],
};
const CHEST_WALL: Role = Role {
    part: "chest wall",
    key: "chest_wall",
    meaning: Meaning::Label(label::CHEST_WALL),
    names: &["chestwall", "thoracicwall", "thoraxwall"],
    loose: &["ribcage", "thoraciccage", "thorax", "ribs"],
};

/// Small letters and digits of a name.
fn squashed(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect()
}

/// The same without words for a side.
fn without_side(name: &str) -> String {
    let lower = name.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphanumeric());
    words.filter(|w| !matches!(*w, "l" | "r" | "lt" | "rt" | "left" | "right")).collect()
}

/// Our label of that name; case, `_` and `-` do not matter.
fn label_of(name: &str) -> Option<u8> {
    let name = squashed(name);
    label::ALL.iter().find(|(_, known, _)| squashed(known) == name).map(|(n, ..)| *n)
}

/// Decides which regions are used.
pub(super) fn plan(candidates: &[Candidate], names: &RegionNames) -> Result<Plan, RegionNameError> {
    if !names.body.is_empty() && !names.soft_tissue.is_empty() {
        return Err(RegionNameError::BodyAndSoftTissue);
    }
    let once =
        |wanted| candidates.iter().filter(|c| label_of(&c.name) == Some(wanted)).count() == 1;
    // Fat and muscle among nothing but labels of ours are the finer ones, which fill the parts.
    let all_known = candidates.iter().all(|c| label_of(&c.name).is_some());
    let fine = all_known && once(label::FAT) && once(label::MUSCLE);
    if !names.given() && (once(label::SOFT_TISSUE) && once(label::CHEST_WALL) || fine) {
        let known = |(n, c): (usize, &Candidate)| label_of(&c.name).map(|label| (n, label));
        let left = candidates.iter().filter(|c| label_of(&c.name).is_none());
        return Ok(Plan::Labels {
            labels: candidates.iter().enumerate().filter_map(known).collect(),
            left_out: left.map(|c| c.name.clone()).collect(),
        });
    }
    let mut warnings = Vec::new();
    let mut pick = |role: &Role, given: &[String]| {
        let picked = pick(candidates, role, given)?;
        if let (Some((n, true)), true) = (picked.first(), given.is_empty()) {
            let text = format!(
                " is taken for the {}; name another one in the case file if it is not",
                role.part
            );
            let name = candidates[*n].name.as_str();
            warnings
                .push(Warning::new("region-by-loose-name", "the region ").name(name).text(text));
        }
        Ok(picked.into_iter().map(|(n, _)| n).collect::<Vec<_>>())
    };
    let outer = if !names.soft_tissue.is_empty() {
        Outer::SoftTissue(pick(&SOFT_TISSUE, &names.soft_tissue)?)
    } else {
        match pick(&BODY, &names.body) {
            Err(RegionNameError::NotFound { .. }) => match pick(&SOFT_TISSUE, &[]) {
                // The body is what files have.
                Err(RegionNameError::NotFound { .. }) => return Err(not_found(candidates, &BODY)),
                soft => Outer::SoftTissue(soft?),
            },
            body => Outer::Body(body?),
        }
    };
    let wall = pick(&CHEST_WALL, &names.chest_wall)?;
    Ok(Plan::Parts { outer, wall, warnings })
}

fn not_found(candidates: &[Candidate], role: &Role) -> RegionNameError {
    let names = candidates.iter().map(|c| c.name.clone()).collect();
    RegionNameError::NotFound { part: role.part, key: role.key, found: names }
}

/// The regions of a part, with whether their name is only a loose one: those the user names, else
/// the one by its code or type, else by name.
fn pick(
    candidates: &[Candidate],
    role: &Role,
    given: &[String],
) -> Result<Vec<(usize, bool)>, RegionNameError> {
    let mut picked = Vec::new();
    for asked in given {
        let same = |c: &Candidate| c.name.trim().to_lowercase() == asked.trim().to_lowercase();
        let places: Vec<usize> = (0..candidates.len()).filter(|&n| same(&candidates[n])).collect();
        let [place] = places[..] else {
            let names = candidates.iter().map(|c| c.name.clone()).collect();
            let (asked, times) = (asked.clone(), places.len());
            return Err(RegionNameError::Named { key: role.key, asked, times, found: names });
        };
        picked.push((place, false));
    }
    if !picked.is_empty() {
        return Ok(picked);
    }
    let is = |list: &[&str], name: &str| list.contains(&name);
    let ranks: [&dyn Fn(&Candidate) -> bool; 3] =
        [&|c| c.meaning == Some(role.meaning), &|c| is(role.names, &squashed(&c.name)), &|c| {
            is(role.loose, &squashed(&c.name)) || is(role.names, &without_side(&c.name))
        }];
    for (rank, belongs) in ranks.iter().enumerate() {
        let places: Vec<usize> =
            (0..candidates.len()).filter(|&n| belongs(&candidates[n])).collect();
        match places[..] {
            [] => {}
            [place] => return Ok(vec![(place, rank == 2)]),
            _ => {
                let names = places.iter().map(|&n| candidates[n].name.clone()).collect();
                return Err(RegionNameError::Ambiguous {
                    part: role.part,
                    key: role.key,
                    found: names,
                });
            }
        }
    }
    Err(not_found(candidates, role))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str]) -> Vec<Candidate> {
        names.iter().map(|n| Candidate { name: (*n).into(), meaning: None }).collect()
    }

    fn automatic(names: &[&str]) -> Result<Plan, RegionNameError> {
        plan(&named(names), &RegionNames::default())
    }

    fn parts(plan: Plan) -> (Outer, Vec<usize>, usize) {
        match plan {
            Plan::Parts { outer, wall, warnings } => (outer, wall, warnings.len()),
            Plan::Labels { .. } => panic!("{plan:?}"),
        }
    }

    #[test]
    fn usual_names_are_recognised() {
        for (names, outer, wall, warnings) in [
            (vec!["Heart", "BODY", "Chest Wall"], Outer::Body(vec![1]), 2, 0),
            (vec!["ChestWall", "External", "Skin"], Outer::Body(vec![1]), 0, 0),
            (vec!["Skin", "thoracic-wall"], Outer::Body(vec![0]), 1, 1),
            (vec!["Soft_Tissue", "Ribs"], Outer::SoftTissue(vec![0]), 1, 1),
            (vec!["ChestWall_L", "patient outline"], Outer::Body(vec![1]), 0, 1),
            (vec!["Breast", "Chestwall"], Outer::SoftTissue(vec![0]), 1, 1),
        ] {
            let found = parts(automatic(&names).unwrap());
            assert_eq!(found, (outer, vec![wall], warnings), "{names:?}");
        }
    }

    #[test]
    fn codes_and_types_go_before_names() {
        let mut regions = named(&["Body", "Segment_1", "Segment_2"]);
        regions[1].meaning = Some(Meaning::Label(label::CHEST_WALL));
        regions[2].meaning = Some(Meaning::Body);
        let (outer, wall, _) = parts(plan(&regions, &RegionNames::default()).unwrap());
        assert_eq!((outer, wall), (Outer::Body(vec![2]), vec![1]));
    }

    #[test]
    fn our_own_names_are_labels_as_in_a_label_map() {
        let plan = automatic(&["soft tissue", "Heart", "Chest_Wall", "skin", "Tumour"]).unwrap();
        let labels = vec![(0, 1), (2, 2), (3, 8), (4, 9)];
        assert_eq!(plan, Plan::Labels { labels, left_out: vec!["Heart".into()] });
    }

    #[test]
    fn our_finer_labels_alone_are_labels_and_those_of_others_are_not() {
        let plan = automatic(&["lung", "bone", "muscle", "fat", "gland", "skin"]).unwrap();
        assert!(matches!(plan, Plan::Labels { labels, .. } if labels.len() == 6));
        let found = parts(automatic(&["Body", "Fat", "Muscle", "Chest wall"]).unwrap());
        assert_eq!(found, (Outer::Body(vec![0]), vec![3], 0));
    }

    #[test]
    fn what_is_missing_or_ambiguous_lists_the_names() {
        let text = automatic(&["BODY", "Heart"]).unwrap_err().to_string();
        assert!(text.contains("chest wall") && text.contains("\"BODY\", \"Heart\""), "{text}");
        assert!(text.contains("chest_wall = "), "{text}");
        let text = automatic(&["Ribs"]).unwrap_err().to_string();
        assert!(text.contains("no region is the body") && text.contains("body = "), "{text}");
        let text = automatic(&["Body", "ChestWall_L", "ChestWall_R"]).unwrap_err().to_string();
        assert!(text.contains("several") && text.contains("\"ChestWall_R\""), "{text}");
        let text = automatic(&["Body", "External", "Chestwall"]).unwrap_err().to_string();
        assert!(text.contains("could be the body: \"Body\", \"External\""), "{text}");
    }

    #[test]
    fn the_user_decides() {
        let regions = named(&["Body", "External", "Ribs", "Pectoralis", "Ribs"]);
        let name = |n: &str| vec![n.to_owned()];
        let names = RegionNames {
            body: name(" external"),
            chest_wall: name("PECTORALIS"),
            ..RegionNames::default()
        };
        let found = parts(plan(&regions, &names).unwrap());
        assert_eq!(found, (Outer::Body(vec![1]), vec![3], 0));
        let twice = RegionNames { chest_wall: name("Ribs"), ..names.clone() };
        let text = plan(&regions, &twice).unwrap_err().to_string();
        assert!(text.contains("`chest_wall`") && text.contains("2 region(s)"), "{text}");
        let none = RegionNames { chest_wall: name("Wall"), ..names.clone() };
        let text = plan(&regions, &none).unwrap_err().to_string();
        assert!(text.contains("0 region(s)") && text.contains("\"Pectoralis\""), "{text}");
        let both = RegionNames { soft_tissue: name("Body"), ..names };
        assert_eq!(plan(&regions, &both), Err(RegionNameError::BodyAndSoftTissue));
    }
}
