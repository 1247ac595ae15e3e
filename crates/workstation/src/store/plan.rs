//! The patient's own structures and doses, before and after, as the page shows them.

use serde::Serialize;
use supine_flow::{OwnObjects, Session};
use supine_volume::Volume;

/// No more isodoses are drawn.
const LINES: f64 = 6.0;
/// Steps of isodoses, times a power of ten.
const STEPS: [f64; 5] = [1.0, 2.0, 2.5, 4.0, 5.0];

/// The patient's own structures and doses.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct PlanShown {
    /// Whether what was carried is of what is given now.
    fresh: bool,
    structures: Vec<StructureShown>,
    doses: Vec<DoseShown>,
    histograms: Vec<HistogramShown>,
    /// What the user must know.
    notes: Vec<String>,
}

/// A region.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StructureShown {
    name: String,
    file: String,
    /// Its colour in its file, `#rrggbb`.
    colour: Option<String>,
    /// Before and after; nothing before it was carried.
    volume_ml: Option<[f64; 2]>,
}

/// A dose.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DoseShown {
    file: String,
    /// Before and after.
    max_gy: [Option<f64>; 2],
    /// Isodoses that are drawn, the highest first.
    levels_gy: Vec<f64>,
}

/// The dose in a structure.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct HistogramShown {
    #[serde(flatten)]
    of: supine_flow::DoseVolumeHistogram,
    /// The share beyond the grid of the dose, where it is too much for a dose to be told.
    outside: Option<f64>,
}

impl HistogramShown {
    fn of(of: &supine_flow::DoseVolumeHistogram) -> Self {
        Self { of: of.clone(), outside: of.outside() }
    }
}

/// Those that the session holds.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Plan {
    #[serde(skip)]
    objects: Option<OwnObjects>,
    #[serde(rename = "own")]
    shown: Option<PlanShown>,
}

impl Plan {
    pub(super) fn objects(&self) -> Option<&OwnObjects> {
        self.objects.as_ref()
    }

    /// Takes what the session holds.
    pub(super) fn read(&mut self, session: &Session) {
        let now = session.peek_objects();
        if self.objects != now {
            self.shown = now.as_ref().map(PlanShown::of);
            self.objects = now;
        }
    }

    /// The first dose before and after, cGy; nothing where there is none.
    pub(super) fn doses(&self) -> [Option<Volume<i16>>; 2] {
        let first = self.objects.as_ref().and_then(|plan| plan.doses().next());
        let cgy = |gy: &f32| (gy * 100.0).round().clamp(0.0, 32767.0) as i16;
        let volume =
            |dose: &Volume<f32>| dose.with_data(dose.data().iter().map(cgy).collect()).ok();
        first.map_or([None, None], |dose| [volume(dose.before), dose.after.and_then(volume)])
    }

    pub(super) fn mark_all_old(&mut self) {
        self.shown.iter_mut().for_each(|plan| plan.fresh = false);
    }
}

/// The doses of the lines that are drawn, Gy, the highest first: round steps below the largest dose
/// before.
pub(crate) fn levels_gy(plan: &OwnObjects) -> Vec<f64> {
    plan.doses().next().and_then(|dose| dose.max_gy()[0]).map_or(vec![], levels)
}

fn levels(most: f64) -> Vec<f64> {
    if !(most > 0.0 && most.is_finite()) {
        return vec![];
    }
    let power = 10f64.powf((most / LINES).log10().floor());
    let steps = STEPS.iter().chain(&[10.0]).map(|step| step * power);
    let Some(step) = steps.into_iter().find(|step| most / step <= LINES) else { return vec![] };
    let count = ((most / step).ceil() as usize).saturating_sub(1);
    // Without the last digits of a product: these numbers are names of lines.
    let tidy = |n: usize| (n as f64 * step / power * 10.0).round() / 10.0 * power;
    (1..=count).rev().map(|n| format!("{:.6}", tidy(n)).parse().unwrap_or(0.0)).collect()
}

impl PlanShown {
    fn of(plan: &OwnObjects) -> Self {
        let structures = plan.structures().map(|one| StructureShown {
            name: one.name.into(),
            file: one.file.into(),
            colour: one.colour.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}")),
            volume_ml: one.volume_ml,
        });
        let doses = plan.doses().enumerate().map(|(n, dose)| DoseShown {
            file: dose.file.into(),
            max_gy: dose.max_gy(),
            levels_gy: if n == 0 { levels_gy(plan) } else { vec![] },
        });
        let doses: Vec<DoseShown> = doses.collect();
        let mut notes = plan.notes();
        if let [first, _, ..] = doses.as_slice() {
            notes.push(format!(
                "the lines, and the dose at the pointer, are those of {}",
                first.file
            ));
        }
        Self {
            fresh: plan.is_fresh(),
            structures: structures.collect(),
            doses,
            histograms: plan.histograms().iter().map(HistogramShown::of).collect(),
            notes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn isodoses_are_round_and_few() {
        assert_eq!(levels(19.6), [16.0, 12.0, 8.0, 4.0]);
        assert_eq!(levels(50.4), [50.0, 40.0, 30.0, 20.0, 10.0]);
        assert_eq!(levels(60.0), [50.0, 40.0, 30.0, 20.0, 10.0]);
        assert_eq!(levels(0.07), [0.06, 0.04, 0.02]);
        assert!(levels(0.0).is_empty() && levels(f64::NAN).is_empty());
    }
}
