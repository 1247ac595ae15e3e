//! Dose and volume of every structure, where a case carries both.

use super::contours::CarriedContours;
use supine_exchange::NamedContours;
use supine_report::{DoseVolumeCurve, DoseVolumeHistogram};
use supine_space::{Grid, Point, Progress, Stopped, Warning};
use supine_volume::Volume;
use supine_warp::DoseVolume;

/// Steps of a curve.
const STEPS: usize = 120;

/// What was carried, before and after, as far as a histogram needs it.
#[derive(Debug, Default)]
pub(crate) struct Held {
    doses: Vec<(String, [Volume<f32>; 2])>,
    regions: Vec<Region>,
}

/// A structure with contours, before and after.
#[derive(Debug)]
struct Region {
    file: String,
    name: String,
    contours: [Vec<Vec<Point>>; 2],
    /// As the contours enclose, ml.
    volume_ml: [f64; 2],
}

impl Held {
    pub(crate) fn dose(&mut self, file: String, volumes: [Volume<f32>; 2]) {
        self.doses.push((file, volumes));
    }

    /// Structures as they were `given` and as they were carried.
    pub(crate) fn structures(
        &mut self,
        file: &str,
        mut given: Vec<NamedContours>,
        mut carried: CarriedContours,
    ) {
        let take = |of: &mut NamedContours| std::mem::take(&mut of.contours);
        for (n, facts) in carried.moved {
            self.regions.push(Region {
                file: file.into(),
                name: given[n].name.clone(),
                contours: [take(&mut given[n]), take(&mut carried.structures[n])],
                volume_ml: facts.volume_ml,
            });
        }
    }

    /// The histogram of every structure in every dose, before and after, in their order; those that cannot be filled are told.
    /// Slices are those of `grid`.
    ///
    /// # Errors
    /// When the user stopped.
    pub(crate) fn histograms(
        &self,
        grid: &Grid,
        progress: Progress<'_>,
    ) -> Result<(Vec<DoseVolumeHistogram>, Vec<Warning>), Stopped> {
        let (mut found, mut warnings) = (vec![], vec![]);
        let pairs = self.doses.iter().flat_map(|dose| self.regions.iter().map(move |r| (dose, r)));
        let all = (self.doses.len() * self.regions.len()) as f64;
        for (n, ((dose, volumes), region)) in pairs.enumerate() {
            progress.at(n as f64 / all)?;
            let of = |n: usize| DoseVolume::of(&volumes[n], &region.contours[n], grid);
            match (of(0), of(1)) {
                (Ok(before), Ok(after)) => found.push(histogram(dose, region, [&before, &after])),
                (Err(e), _) | (_, Err(e)) => {
                    let text = format!(": no dose-volume histogram: {e}");
                    warnings.push(Warning::new("no-histogram", "").name(&region.name).text(text));
                }
            }
        }
        Ok((found, warnings))
    }
}

fn histogram(dose: &str, region: &Region, pair: [&DoseVolume; 2]) -> DoseVolumeHistogram {
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
    let (structures, region) = (region.file.clone(), region.name.clone());
    DoseVolumeHistogram { dose: dose.into(), structures, region, step_gy, before, after }
}
