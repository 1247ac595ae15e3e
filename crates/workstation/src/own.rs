//! The patient's own structures and doses, before and after, as the page shows them.

use crate::draw::voxels::Voxels;
use crate::state::{HistogramShown, OwnDoseShown, OwnShown, OwnStructureShown};
use crate::workspace::OpenCase;
use std::sync::Arc;
use supine_flow::{OwnObjects, Session};
use supine_volume::Volume;

/// No more isodoses are drawn.
const LINES: f64 = 6.0;
/// Steps of isodoses, times a power of ten.
const STEPS: [f64; 5] = [1.0, 2.0, 2.5, 4.0, 5.0];

/// Both sides of the doses as volumes that the page may fetch: `dose` and `dose-deformed`.
const SIDES: [&str; 2] = ["dose", "dose-deformed"];

impl OpenCase {
    /// Shows the objects that the session holds, where they are others than before.
    pub(crate) fn show_own(&mut self, session: &Session) {
        let now = session.peek_objects();
        if self.own == now {
            return;
        }
        self.state.own = now.as_ref().map(shown);
        for (n, id) in SIDES.into_iter().enumerate() {
            let dose = now.as_ref().and_then(|own| side(own, n == 1));
            match dose {
                Some(dose) => self.show(id, Voxels::Dose(Arc::new(dose)), true),
                None => self.hide(id),
            }
        }
        self.own = now;
    }
}

/// The first dose, cGy; nothing where there is none.
fn side(own: &OwnObjects, after: bool) -> Option<Volume<i16>> {
    let first = own.doses().next()?;
    let first = if after { first.after? } else { first.before };
    let cgy = |gy: &f32| (gy * 100.0).round().clamp(0.0, 32767.0) as i16;
    first.with_data(first.data().iter().map(cgy).collect()).ok()
}

/// The doses of the lines that are drawn, Gy, the highest first: round steps below the largest dose
/// before.
pub(crate) fn levels_gy(own: &OwnObjects) -> Vec<f64> {
    own.doses().next().and_then(|dose| dose.max_gy()[0]).map_or(vec![], levels)
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

fn shown(own: &OwnObjects) -> OwnShown {
    let structures = own.structures().map(|one| OwnStructureShown {
        name: one.name.into(),
        file: one.file.into(),
        colour: one.colour.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}")),
        volume_ml: one.volume_ml,
    });
    let doses = own.doses().enumerate().map(|(n, dose)| OwnDoseShown {
        file: dose.file.into(),
        max_gy: dose.max_gy(),
        levels_gy: if n == 0 { levels_gy(own) } else { vec![] },
    });
    let doses: Vec<OwnDoseShown> = doses.collect();
    let mut notes = own.notes();
    if let [first, _, ..] = doses.as_slice() {
        notes.push(format!("the lines, and the dose at the pointer, are those of {}", first.file));
    }
    OwnShown {
        fresh: own.is_fresh(),
        structures: structures.collect(),
        doses,
        histograms: own.histograms().iter().map(HistogramShown::of).collect(),
        notes,
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
