//! A patient on the page of a cohort.

use super::{Figures, PICTURES, Patient};
use crate::words::{capital, count, directions, fixed};
use crate::{Ended, RunError};
use supine_record::ModulusOrigin;

/// A patient as the template sees her.
pub(super) struct Card<'a> {
    /// Her place on the page.
    pub(super) anchor: String,
    pub(super) name: &'a str,
    /// `good`, `check`, `stop` or `none`: the class that colours the verdict.
    pub(super) class: &'static str,
    /// How the run ended, as its file says it.
    pub(super) word: &'static str,
    pub(super) headline: &'static str,
    /// How far the tumour moves.
    pub(super) moves: String,
    pub(super) reasons: &'a [String],
    pub(super) error: Option<&'a RunError>,
    /// Where a failure lies.
    pub(super) place: String,
    pub(super) facts: Vec<(&'static str, String)>,
    /// Address, text in its place, caption.
    pub(super) pictures: Vec<(String, String, &'static str)>,
    /// Address of the report.
    pub(super) report: Option<String>,
    /// Codes, with a space between.
    pub(super) codes: String,
    /// What the page is sorted by: verdict, displacement, room, modulus, seconds; empty where there
    /// is none.
    pub(super) keys: [String; 5],
}

impl<'a> Card<'a> {
    pub(super) fn of(patient: &'a Patient) -> Self {
        let (status, figures) = (&patient.status, patient.figures.as_ref());
        let run = patient.run.as_deref().map(address);
        let picture = |(file, caption): &(&str, &'static str)| {
            let run = run.as_ref().filter(|_| patient.pictures.contains(file))?;
            let text = format!("{caption}, axial, of {}", status.case);
            Some((format!("{run}/report/{file}"), text, *caption))
        };
        let tumour = status.tumour.as_ref();
        let key = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
        Self {
            anchor: anchor(&status.case),
            name: &status.case,
            class: class(status.status),
            word: status.status.word(),
            headline: headline(status.status),
            moves: moves(patient),
            reasons: if status.error.as_ref().is_some_and(|e| e.exit != 4) {
                &[]
            } else {
                &status.reasons
            },
            // A verdict that is not good enough has its reasons.
            error: status.error.as_ref().filter(|error| error.exit != 4),
            place: status.error.as_ref().map(place).unwrap_or_default(),
            facts: figures.map(|figures| facts(patient, figures)).unwrap_or_default(),
            pictures: PICTURES.iter().filter_map(picture).collect(),
            report: run.as_ref().map(|run| format!("{run}/report/index.html")),
            codes: patient.codes.join(" "),
            keys: [
                rank(status.status).to_string(),
                key(tumour.map(|tumour| tumour.length_mm)),
                key(tumour.and_then(|tumour| tumour.within_mm)),
                key(figures.map(|figures| figures.young_kpa)),
                key(Some(status.seconds)),
            ],
        }
    }
}

/// The class that colours it.
pub(super) fn class(status: Ended) -> &'static str {
    match status {
        Ended::Usable => "good",
        Ended::Flagged => "check",
        Ended::NotUsable => "stop",
        Ended::Failed | Ended::Stopped | Ended::Partial => "none",
    }
}

/// How it ended, for people.
pub(super) fn headline(status: Ended) -> &'static str {
    match status {
        Ended::Usable => "Green: usable",
        Ended::Flagged => "Amber: look before use",
        Ended::NotUsable => "Red: do not use",
        Ended::Failed => "Failed: no result",
        Ended::Stopped => "Stopped: no result",
        Ended::Partial => "Ended early, as asked: no verdict",
    }
}

/// What wants a look first.
pub(super) fn rank(status: Ended) -> u8 {
    match status {
        Ended::Failed => 0,
        Ended::NotUsable => 1,
        Ended::Stopped => 2,
        Ended::Partial => 3,
        Ended::Flagged => 4,
        Ended::Usable => 5,
    }
}

fn moves(patient: &Patient) -> String {
    let Some(tumour) = &patient.status.tumour else {
        return match patient.figures {
            Some(_) => "The case names no tumour.".into(),
            None => String::new(),
        };
    };
    let length = fixed(tumour.length_mm, 1);
    match (tumour.interval_mm, tumour.level) {
        (Some([low, high]), Some(level)) => format!(
            "The tumour moves {length} mm ({} %: {} to {} mm)",
            fixed(100.0 * level, 0),
            fixed(low, 1),
            fixed(high, 1)
        ),
        _ => format!("The tumour moves {length} mm; how sure that is, is not known"),
    }
}

fn facts(patient: &Patient, f: &Figures) -> Vec<(&'static str, String)> {
    let mut facts = Vec::new();
    if let Some(tumour) = &patient.status.tumour {
        facts.push(("Direction", capital(&directions(tumour.displacement_mm))));
        if let Some(mm) = tumour.within_mm {
            facts.push(("Known within", format!("{} mm", fixed(mm, 1))));
        }
    }
    let known = f.young_known.as_ref().map(|([low, high], origin)| {
        let from = match origin {
            ModulusOrigin::Literature => "not measured",
            ModulusOrigin::Scans => "by the scans",
            ModulusOrigin::Given => "as given",
        };
        format!(" ({} to {}, {from})", fixed(*low, 2), fixed(*high, 2))
    });
    let modulus = format!("{} kPa{}, {}", fixed(f.young_kpa, 2), known.unwrap_or_default(), f.rest);
    facts.push(("Modulus, rest state", modulus));
    let [ap, lat] = f.table_deg.map(|deg| fixed(deg, 1));
    facts.push(("Breast, table", format!("{}, AP {ap}°, LAT {lat}°", f.breast)));
    let [i, j, k] = f.size;
    let [x, y, z] = f.spacing_mm.map(|mm| fixed(mm, 2));
    facts.push(("CT", format!("{i} × {j} × {k}, {x} × {y} × {z} mm")));
    facts.push((
        "Mesh",
        format!(
            "{} tetrahedra, {} nodes, from {}°, mean radius ratio {}, {} ml",
            count(f.tetrahedra),
            count(f.nodes),
            fixed(f.min_dihedral_deg, 1),
            fixed(f.mean_radius_ratio, 2),
            fixed(f.volume_ml, 0)
        ),
    ));
    facts.push((
        "Mechanics",
        format!(
            "smallest det F {}, residual {:.0e}, {} folded voxels",
            fixed(f.min_det_f, 2),
            f.residual,
            count(f.folded_voxels)
        ),
    ));
    if let Some(scan) = &f.scan {
        let [rms, p95] = [scan.rms_mm, scan.p95_mm].map(|mm| fixed(mm, 1));
        facts.push(("Scan near the tumour", format!("{rms} mm rms, 95 % within {p95} mm")));
    }
    let memory = patient.status.peak_memory_mb.map(|mb| format!(", {} MB", fixed(mb, 0)));
    let seconds = fixed(patient.status.seconds, 1);
    facts.push(("Time, memory", format!("{seconds} s{}", memory.unwrap_or_default())));
    facts
}

/// Where a failure lies, in words.
fn place(error: &RunError) -> String {
    let place = &error.place;
    let file = place.file.as_ref().map(|file| file.display().to_string());
    let key = place.key.as_ref().map(|key| format!("key {key}"));
    let stage = place.stage.as_ref().map(|stage| format!("stage {stage}"));
    [stage, key, file].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// A place on the page, made of a name.
pub(super) fn anchor(name: &str) -> String {
    format!("case-{}", address(name).replace('%', "_").replace('/', "-"))
}

/// A relative path as an address: all but letters, digits and a few marks in percent.
pub(super) fn address(path: &str) -> String {
    let mut out = String::new();
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out += &format!("%{byte:02X}");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cohort::tests::{failed, finished};

    #[test]
    fn a_failed_case_says_where_and_what_to_do_and_has_no_figures() {
        let patient = Patient::new(failed("p 2"), None);
        let card = Card::of(&patient);
        assert_eq!((card.class, card.anchor.as_str()), ("none", "case-p_202"));
        assert_eq!(card.error.unwrap().advice.as_deref(), Some("did you mean `left`?"));
        assert_eq!(card.place, "key breast");
        assert!(card.facts.is_empty() && card.pictures.is_empty() && card.report.is_none());
    }

    #[test]
    fn a_card_links_to_what_is_there() {
        let mut patient = finished("Ö 1");
        patient.run = Some("runs/Ö 1".into());
        patient.pictures = vec!["axial_after.png"];
        let card = Card::of(&patient);
        assert_eq!(card.report.as_deref(), Some("runs/%C3%96%201/report/index.html"));
        assert_eq!(card.pictures.len(), 1);
        assert_eq!(card.pictures[0].0, "runs/%C3%96%201/report/axial_after.png");
        assert_eq!(card.moves, "The tumour moves 3.7 mm (95 %: 1.1 to 8.2 mm)");
    }
}
