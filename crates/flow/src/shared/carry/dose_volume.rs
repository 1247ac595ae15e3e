//! Dose and volume of every structure, where a case carries both.

use supine_exchange::NamedContours;
use supine_report::{DoseVolumeCurve, DoseVolumeHistogram};
use supine_space::{Grid, Progress, Stopped, Warning};
use supine_volume::Volume;
use supine_warp::DoseVolume;

/// Steps of a curve.
const STEPS: usize = 120;

/// What was carried, before and after, as far as a histogram needs it.
#[derive(Debug, Default)]
pub(crate) struct Held {
    doses: Vec<(String, [Volume<f32>; 2])>,
    structures: Vec<(String, [Vec<NamedContours>; 2])>,
}

impl Held {
    pub(crate) fn dose(&mut self, file: String, volumes: [Volume<f32>; 2]) {
        self.doses.push((file, volumes));
    }

    pub(crate) fn structures(&mut self, file: String, contours: [Vec<NamedContours>; 2]) {
        self.structures.push((file, contours));
    }

    /// The histogram of every structure in every dose, before and after, in their order; structures that enclose nothing are
    /// left out, and those that cannot be filled are told. Slices are those of `grid`.
    ///
    /// # Errors
    /// When the user stopped.
    pub(crate) fn histograms(
        &self,
        grid: &Grid,
        progress: Progress<'_>,
    ) -> Result<(Vec<DoseVolumeHistogram>, Vec<Warning>), Stopped> {
        let (mut found, mut warnings) = (vec![], vec![]);
        let all = self.doses.len() * self.structures.iter().map(|s| s.1[0].len()).sum::<usize>();
        let mut done = 0;
        for (dose_file, doses) in &self.doses {
            for (file, [before, after]) in &self.structures {
                for (before, after) in before.iter().zip(after) {
                    progress.at(f64::from(done) / all as f64)?;
                    done += 1;
                    if before.contours.iter().all(|contour| contour.len() < 3) {
                        continue;
                    }
                    let curve =
                        |dose, region: &NamedContours| DoseVolume::of(dose, &region.contours, grid);
                    let name = before.name.clone();
                    match (curve(&doses[0], before), curve(&doses[1], after)) {
                        (Ok(a), Ok(b)) => {
                            found.push(histogram((dose_file, file, name), [&a, &b]));
                        }
                        (Err(e), _) | (_, Err(e)) => {
                            let text = format!(": no dose-volume histogram: {e}");
                            warnings.push(Warning::new("no-histogram", "").name(&name).text(text));
                        }
                    }
                }
            }
        }
        Ok((found, warnings))
    }
}

fn histogram(
    (dose, structures, region): (&String, &String, String),
    pair: [&DoseVolume; 2],
) -> DoseVolumeHistogram {
    let most = pair.iter().map(|of| of.max_gy()).fold(0.0, f64::max);
    let step_gy = most / (STEPS - 1) as f64;
    let [before, after] = pair.map(|of| DoseVolumeCurve {
        volume_ml: of.volume_ml,
        beyond: of.beyond,
        mean_gy: of.mean_gy(),
        d98_gy: of.at_volume(0.98),
        d50_gy: of.at_volume(0.5),
        d2_gy: of.at_volume(0.02),
        max_gy: of.max_gy(),
        shares: (0..STEPS).map(|n| of.at_dose(n as f64 * step_gy)).collect(),
    });
    let (dose, structures) = (dose.clone(), structures.clone());
    DoseVolumeHistogram { dose, structures, region, step_gy, before, after }
}
