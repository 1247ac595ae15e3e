//! Dose and volume of every structure, where a case carries both.

use super::object::{Given, GivenObject, MovedObject, file_names};
use supine_exchange::NamedContours;
use supine_report::{DoseVolumeCurve, DoseVolumeHistogram};
use supine_space::{Grid, Progress, Stopped, Warning};
use supine_warp::DoseVolume;

/// Steps of a curve.
const STEPS: usize = 120;

/// A structure with contours, before and after.
struct Region<'a> {
    file: &'a str,
    name: &'a str,
    drawn: [&'a NamedContours; 2],
    /// As the contours enclose, ml.
    volume_ml: [f64; 2],
}

/// The histogram of every structure in every dose, before and after, in their order; those that
/// cannot be filled are told. Slices are those of `grid`.
///
/// # Errors
/// When the user stopped.
pub(crate) fn histograms(
    given: &[GivenObject],
    moved: &[MovedObject],
    grid: &Grid,
    progress: Progress<'_>,
) -> Result<(Vec<DoseVolumeHistogram>, Vec<Warning>), Stopped> {
    let names = file_names(given);
    let (mut doses, mut regions) = (vec![], vec![]);
    for ((given, moved), file) in given.iter().zip(moved).zip(&names) {
        match (&given.what, moved) {
            (Given::Dose(_), MovedObject::Dose(moved, _)) => {
                doses.push((file, [&moved.planned, &moved.carried]));
            }
            (Given::Structures(_, closed), MovedObject::Structures(carried, _)) => {
                regions.extend(carried.moved.iter().map(|(n, facts)| Region {
                    file,
                    name: &closed[*n].name,
                    drawn: [&closed[*n], &carried.structures[*n]],
                    volume_ml: facts.volume_ml,
                }));
            }
            _ => {}
        }
    }
    let (mut found, mut warnings) = (vec![], vec![]);
    let pairs = doses.iter().flat_map(|dose| regions.iter().map(move |r| (dose, r)));
    let all = (doses.len() * regions.len()) as f64;
    for (n, ((dose, volumes), region)) in pairs.enumerate() {
        progress.at(n as f64 / all)?;
        let of = |n: usize| {
            let NamedContours { contours, rule, .. } = region.drawn[n];
            DoseVolume::of(volumes[n], contours, *rule, grid)
        };
        match (of(0), of(1)) {
            (Ok(before), Ok(after)) => found.push(histogram(dose, region, [&before, &after])),
            (Err(e), _) | (_, Err(e)) => {
                let text = format!(": no dose-volume histogram: {e}");
                warnings.push(Warning::new("no-histogram", "").name(region.name).text(text));
            }
        }
    }
    Ok((found, warnings))
}

fn histogram(dose: &str, region: &Region<'_>, pair: [&DoseVolume; 2]) -> DoseVolumeHistogram {
    let most = pair.iter().map(|of| of.max_gy()).fold(0.0, f64::max);
    let step_gy = most / (STEPS - 1) as f64;
    let [before, after] = [0, 1].map(|n| DoseVolumeCurve {
        volume_ml: region.volume_ml[n],
        beyond: pair[n].beyond,
        mean_gy: pair[n].mean_gy(),
        d98_gy: pair[n].at_volume(0.98),
        d50_gy: pair[n].at_volume(0.5),
        d2_gy: pair[n].at_volume(0.02),
        max_gy: pair[n].max_gy(),
        shares: (0..STEPS).map(|step| pair[n].at_dose(step as f64 * step_gy)).collect(),
    });
    let (structures, region) = (region.file.into(), region.name.into());
    DoseVolumeHistogram { dose: dose.into(), structures, region, step_gy, before, after }
}
