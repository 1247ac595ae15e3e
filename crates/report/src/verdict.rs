//! Whether a result may be used: what a planner reads first.

use crate::summary::{
    Colour, Evaluation, Reason, Summary, TissueFit, TumourInterval, Verdict, Warning,
};
use crate::tg132;
use crate::words::{count, fixed};
use supine_record::{ModulusOrigin, STRUCTURED_MM, UncertaintySource};

/// How far off the tumour's place may be for green unless another distance is asked for, mm.
pub const TOLERANCE_MM: f64 = 2.0;
/// Tissue squeezed this near to the tumour's surface counts as near it, mm.
const NEAR_MM: f64 = 20.0;
/// Below this det F the law of the tissue is out of its depth.
const SQUEEZED: f64 = 0.3;
/// A displacement below this is none, mm.
const HELD_MM: f64 = 0.005;
/// Uncertain places of the wall that move the tumour by less are not told one by one, mm.
const LITTLE_MM: f64 = 0.1;
/// Warnings whose reason the verdict gives in words of its own.
const TOLD: [&str; 6] = [
    "tumour-in-chest-wall",
    "tumour-in-lung",
    "squeezed-tissue",
    "overlapping-voxels",
    "fit-misfit",
    "rest-state-open",
];
/// Warnings that say nothing of where the tumour is: notes beside the verdict.
const NOTES: [&str; 16] = [
    "dose-not-computed-anew",
    "dose-without-plan",
    "interval-rough",
    "labels-uncertainty-unknown",
    "letters-replaced",
    "names-taken-out",
    "no-preamble",
    "other-series-left-out",
    "padding-as-air",
    "patient-not-identified",
    "pixel-data-too-long",
    "rescale-type-unspecified",
    // Stray points of a scan: some 25 in most.
    "scan-islands",
    "source-ill-formed",
    // Where it cuts the region, `region-truncated` says so.
    "truncated-field",
    "uids-from-file-header",
];
/// A displacement may lie this far outside its interval, mm and as a share: the interval is without
/// the fade at the cut.
const OUTSIDE_MM: f64 = 0.1;
const OUTSIDE: f64 = 0.05;
/// Share of the moved voxels from which on folds spoil a result.
const FOLDED: f64 = 1e-3;

/// The verdict on a run, when the tumour's place has to be known within so many mm.
pub fn verdict(summary: &Summary, tolerance_mm: f64) -> Verdict {
    let mut reasons = [failures(summary), tumour(summary), tissue(summary, tolerance_mm)].concat();
    let places = wall(summary);
    reasons.extend(warnings(summary, places.len()));
    reasons.extend(places);
    for reason in &mut reasons {
        reason.seen = summary.warnings.iter().any(|warning| warning.seen && is_of(reason, warning));
    }
    let effect = |reason: &Reason| reason.effect_mm.unwrap_or(-1.0);
    reasons.sort_by(|a, b| b.colour.cmp(&a.colour).then(effect(b).total_cmp(&effect(a))));
    let colour = reasons.first().map_or(Colour::Green, |worst| worst.colour);
    Verdict { colour, tolerance_mm, dose: None, reasons }
}

fn reason(colour: Colour, code: &str, message: impl Into<String>) -> Reason {
    let (code, message) = (code.into(), message.into());
    Reason { colour, code, message, effect_mm: None, place_mm: None, seen: false }
}

/// Whether a reason is what a warning says.
fn is_of(reason: &Reason, warning: &Warning) -> bool {
    let own_words = TOLD.contains(&reason.code.as_str());
    reason.code == warning.code && (own_words || reason.message.starts_with(&warning.message))
}

/// What is wrong with the exported files or the map.
fn failures(summary: &Summary) -> Vec<Reason> {
    let mut reasons = Vec::new();
    let folded = summary.warp.folded_voxels;
    if folded > 0 {
        let text = format!("The simulated tissue folds over itself in {} voxels.", count(folded));
        let many = folded as f64 > FOLDED * summary.warp.moved_voxels as f64;
        let colour = if many { Colour::Red } else { Colour::Amber };
        // Where it folds the fields do not lead back.
        let effect_mm = summary.warp.forward_then_backward.as_ref().map(|fields| fields.max_mm);
        reasons.push(Reason { effect_mm, ..reason(colour, "folded-map", text) });
    }
    reasons.extend(outside(summary));
    match summary.export.as_ref().map(|export| &export.verified) {
        None => {
            reasons.push(reason(Colour::Amber, "not-exported", "No DICOM series was exported."))
        }
        Some(checks) if checks.passed < checks.total => {
            let failed = checks.total - checks.passed;
            let text = format!("{failed} of {} checks of the exported files failed.", checks.total);
            reasons.push(reason(Colour::Red, "failed-check", text));
        }
        Some(checks) if checks.total == 0 => {
            let text = "The exported files were not checked.";
            reasons.push(reason(Colour::Amber, "not-checked", text));
        }
        Some(_) => {}
    }
    reasons
}

/// Measures of the table of TG-132 that lie outside their tolerance, but for folds.
fn outside(summary: &Summary) -> Vec<Reason> {
    let Some(agreement) = &summary.agreement else { return Vec::new() };
    let skin = agreement.skin.as_ref().filter(|skin| !tg132::is_skin_within(skin));
    let skin = skin.map(|skin| {
        let text = format!(
            "The skin of the exported CT lies {} mm from that of the simulated tissue in the mean, at most {} mm; near {} of {} \
             places there is none.",
            fixed(skin.mean_mm, 1),
            fixed(skin.max_mm, 1),
            count(skin.lost),
            count(skin.places)
        );
        let effect_mm = Some(skin.mean_mm);
        Reason { effect_mm, ..reason(Colour::Amber, "skins-apart", text) }
    });
    let fields = summary.warp.forward_then_backward.as_ref();
    let fields = fields.filter(|fields| !tg132::is_consistent(fields, agreement)).map(|fields| {
        let text = format!(
            "The displacement fields do not lead back to where one began: {} mm are left in the worst place, {} mm are tolerated.",
            fixed(fields.max_mm, 2),
            fixed(agreement.voxel_mm, 2)
        );
        let effect_mm = Some(fields.max_mm);
        Reason { effect_mm, ..reason(Colour::Amber, "fields-inconsistent", text) }
    });
    skin.into_iter().chain(fields).collect()
}

/// What is wrong with the tumour's place.
fn tumour(summary: &Summary) -> Vec<Reason> {
    let mut reasons = Vec::new();
    let Some(ball) = &summary.position.tumour else { return reasons };
    let mut red = |code, text: String, place: [f64; 3]| {
        reasons.push(Reason { place_mm: Some(place), ..reason(Colour::Red, code, text) });
    };
    let said = |code: &str| summary.warnings.iter().any(|warning| warning.code == code);
    if said("tumour-in-lung") {
        let text = "The tumour's centre lies in lung: the centre or the breast is wrong.";
        red("tumour-in-lung", text.into(), ball.centre_mm);
    } else if said("tumour-in-chest-wall") {
        let text = "The tumour's centre lies in what was taken for chest wall, which does not move \
                    (0.0 mm): look at the chest wall there, or correct the centre.";
        red("tumour-in-chest-wall", text.into(), ball.centre_mm);
    } else if held(summary) && level(summary) {
        let text = "The table is as level as the scanner's (AP 0, LAT 0): nothing is simulated.";
        reasons.push(reason(Colour::Amber, "table-level", text));
    } else if held(summary) {
        let text = "The tumour does not move (0.0 mm): it lies outside the simulated tissue or is \
                    held by the chest wall.";
        red("tumour-held", text.into(), ball.centre_mm);
    }
    let (min, [x, y, z]) = (summary.solve.min_det_f, summary.solve.min_det_f_mm);
    let [a, b, c] = ball.centre_mm;
    let apart = ((x - a).powi(2) + (y - b).powi(2) + (z - c).powi(2)).sqrt() - ball.radius_mm;
    if min < SQUEEZED {
        let text = format!(
            "Tissue {} mm from the tumour is squeezed to {} of its volume without load: its law does not \
             hold there.",
            fixed(apart.max(0.0), 0),
            fixed(min, 2)
        );
        let colour = if apart < NEAR_MM { Colour::Red } else { Colour::Amber };
        let place_mm = Some([x, y, z]);
        reasons.push(Reason { place_mm, ..reason(colour, "squeezed-tissue", text) });
    }
    reasons
}

/// Whether the tumour takes no part in the deformation.
pub fn held(summary: &Summary) -> bool {
    summary.tumour.as_ref().is_some_and(|tumour| tumour.distance_mm < HELD_MM)
}

/// Whether the operating table lies as the scanner's.
fn level(summary: &Summary) -> bool {
    let table = &summary.position.table;
    table.ap_deg == 0.0 && table.lat_deg == 0.0
}

/// What is not known of the tissue, and whether the tumour's place is known well enough.
fn tissue(summary: &Summary, tolerance_mm: f64) -> Vec<Reason> {
    let Some(moves) = summary.tumour.as_ref().filter(|_| !held(summary)) else {
        return Vec::new();
    };
    let Some(interval) = &summary.tumour_interval else {
        let text = "The uncertainty of the tumour position could not be computed.";
        return vec![reason(Colour::Red, "no-interval", text)];
    };
    let mut reasons = Vec::new();
    let [low, high] = interval.length_mm;
    let room = OUTSIDE_MM + OUTSIDE * moves.distance_mm;
    if moves.distance_mm < low - room || moves.distance_mm > high + room {
        let text = format!(
            "The displacement shown, {} mm, lies outside its own interval ({} to {} mm): the modulus of the case is none of \
             those that count as possible. Give the interval that holds it, tissue.young_interval.",
            fixed(moves.distance_mm, 1),
            fixed(low, 1),
            fixed(high, 1)
        );
        reasons.push(reason(Colour::Red, "outside-interval", text));
    }
    // One source alone can do more than all: with the other rest state soft tissue is ruled out.
    let of = |source: UncertaintySource| {
        let share = interval.shares.iter().find(|share| share.source == source);
        share.map(|share| share.within_mm.min(interval.within_mm))
    };
    if interval.modulus.origin == ModulusOrigin::Literature {
        let [low, high] = interval.modulus.young_kpa;
        let text = format!(
            "The stiffness of this breast was not measured. With the moduli published of other patients \
             ({} to {} kPa) the tumour lies up to {} mm from the place shown.",
            fixed(low, 2),
            fixed(high, 2),
            fixed(of(UncertaintySource::Modulus).unwrap_or(0.0), 1)
        );
        let effect_mm = of(UncertaintySource::Modulus);
        reasons.push(Reason { effect_mm, ..reason(Colour::Amber, "tissue-is-a-guess", text) });
    }
    reasons.extend(summary.fit.iter().flat_map(fit));
    reasons.extend(on_the_table(summary, interval, tolerance_mm));
    reasons.extend(too_wide(interval, tolerance_mm));
    reasons
}

/// A scan on the table with fewer points near the tumour shows nothing there.
pub const FEW_POINTS: usize = 20;
/// A scan farther off the torso than this, mm rms, is of another posture or patient: 0.4 mm on
/// synthetic patients.
pub const TORSO_MM: f64 = 1.5;

/// How far the skin near the tumour was seen on the table from where the run has it, mm rms; `None`
/// where it was not.
pub fn seen_near_mm(evaluation: &Evaluation) -> Option<f64> {
    let run = evaluation.surfaces.iter().find(|surface| surface.name == "run")?;
    let shown = run.near.points >= FEW_POINTS && evaluation.torso_mm <= TORSO_MM;
    shown.then_some(run.near.rms_mm)
}

/// What speaks against a prediction of which nothing was seen on the table, or which was seen to be
/// off.
fn on_the_table(summary: &Summary, interval: &TumourInterval, tolerance_mm: f64) -> Option<Reason> {
    let Some(near_mm) = summary.evaluation.as_ref().and_then(seen_near_mm) else {
        let text = "This is a prediction: nothing was seen on the table. A surface scan there (scans.intraop) that agrees with it \
                    is what it takes for green.";
        return Some(reason(Colour::Amber, "not-seen-on-table", text));
    };
    let run = summary.evaluation.iter().flat_map(|seen| &seen.surfaces);
    let breast_mm = run.filter(|s| s.name == "run").map(|s| s.breast.rms_mm).fold(0.0, f64::max);
    let (off_mm, may_mm) = (near_mm.max(breast_mm), interval.within_mm.min(tolerance_mm));
    (off_mm > may_mm).then(|| {
        let text = format!(
            "The scan on the table lies {} mm rms off the result near the tumour and {} mm on the breast: {} mm are expected.",
            fixed(near_mm, 1),
            fixed(breast_mm, 1),
            fixed(may_mm, 1)
        );
        Reason { effect_mm: Some(off_mm), ..reason(Colour::Amber, "table-scan-apart", text) }
    })
}

/// That the tumour's place is not known as well as is asked for, mm.
pub fn too_wide(interval: &TumourInterval, tolerance_mm: f64) -> Option<Reason> {
    (interval.within_mm > tolerance_mm).then(|| {
        let text = format!(
            "The tumour's place is known to {} mm only; {} mm are asked for.",
            fixed(interval.within_mm, 1),
            fixed(tolerance_mm, 1)
        );
        let effect_mm = Some(interval.within_mm);
        Reason { effect_mm, ..reason(Colour::Amber, "interval-too-wide", text) }
    })
}

/// What speaks against a modulus that was fitted.
fn fit(fit: &TissueFit) -> Vec<Reason> {
    let best = fit.best();
    let mut reasons = Vec::new();
    if !fit.additions().is_empty() {
        let words: Vec<String> =
            fit.additions().iter().map(supine_record::Addition::words).collect();
        let text = format!(
            "The scan of the sitting patient speaks against plain tissue; the run goes on with the law that fits it best: {}.",
            words.join(", ")
        );
        reasons.push(reason(Colour::Amber, "law-by-scan", text));
    }
    if best.structured_mm > STRUCTURED_MM {
        let whereabouts = best.farthest.map_or(String::new(), |far| {
            let side = if far.off_mm > 0.0 { "outside" } else { "inside" };
            format!(
                " At the worst place the scan lies {} mm {side} of it.",
                fixed(far.off_mm.abs(), 1)
            )
        });
        let text = format!(
            "{} the model's skin lies {} mm rms off the scan of the sitting patient, more than noise explains: no law that was tried \
             describes this breast.{whereabouts}",
            if fit.additions().is_empty() { "With plain tissue" } else { "With that law too" },
            fixed(best.misfit_mm, 1)
        );
        let place_mm = best.farthest.map(|far| far.place_mm);
        reasons.push(Reason { place_mm, ..reason(Colour::Amber, "fit-misfit", text) });
    }
    if let (Some(other), false) = (fit.states.get(1), fit.decided) {
        let text = format!(
            "The scan does not tell the rest state: {} with {} kPa and {} with {} kPa fit about as well.",
            best.rest,
            fixed(best.young_kpa, 2),
            other.rest,
            fixed(other.young_kpa, 2)
        );
        reasons.push(reason(Colour::Amber, "rest-state-open", text));
    }
    reasons
}

/// Uncertain places of the chest wall.
fn wall(summary: &Summary) -> Vec<Reason> {
    let Some(uncertainty) = &summary.segmentation.uncertainty else { return Vec::new() };
    let counts = |effect: Option<f64>| effect.is_some_and(|mm| mm >= LITTLE_MM);
    let told = uncertainty.patches.iter().filter(|patch| counts(patch.effect_mm)).map(|patch| {
        let effect = patch
            .effect_mm
            .map_or(String::new(), |mm| format!(": {} mm at the tumour", fixed(mm, 1)));
        let text = format!(
            "The chest wall is uncertain by {} mm over {} cm² ({}){effect}.",
            fixed(patch.error_mm, 0),
            fixed(patch.area_cm2, 1),
            patch.place
        );
        let (effect_mm, place_mm) = (patch.effect_mm, Some(patch.centre_mm));
        Reason { effect_mm, place_mm, ..reason(Colour::Amber, "uncertain-place", text) }
    });
    told.collect()
}

/// What was warned of that says nothing of where the tumour is.
pub(crate) fn notes(summary: &Summary) -> Vec<&str> {
    let notes = summary.warnings.iter().filter(|w| NOTES.contains(&w.code.as_str()));
    notes.map(|warning| warning.message.as_str()).collect()
}

/// What the stages warned of.
fn warnings(summary: &Summary, places: usize) -> Vec<Reason> {
    // A single uncertain place is told with where it lies.
    let single = places == 1
        && summary.segmentation.uncertainty.as_ref().is_some_and(|u| u.patches.len() == 1);
    let apart = |code: &str| {
        TOLD.contains(&code) || NOTES.contains(&code) || (single && code == "uncertain-wall")
    };
    let told = summary.warnings.iter().filter(|warning| !apart(&warning.code));
    let amber = |warning: &Warning| Reason {
        place_mm: warning.place_mm,
        ..reason(Colour::Amber, &warning.code, &warning.message)
    };
    let with_effect = |warning: &Warning| match (warning.code.as_str(), together_mm(summary)) {
        ("uncertain-wall", Some(mm)) => {
            let text = format!(
                "{}; all of it is worth {} mm at the tumour",
                warning.message,
                fixed(mm, 1)
            );
            Reason { effect_mm: Some(mm), message: text, ..amber(warning) }
        }
        _ => amber(warning),
    };
    told.map(with_effect).collect()
}

/// What all uncertain places of the wall together may do to the tumour, mm; `None` where it is not
/// known.
fn together_mm(summary: &Summary) -> Option<f64> {
    let patches = &summary.segmentation.uncertainty.as_ref()?.patches;
    patches.iter().map(|patch| patch.effect_mm).sum()
}

#[cfg(test)]
#[path = "verdict_tests.rs"]
mod tests;
