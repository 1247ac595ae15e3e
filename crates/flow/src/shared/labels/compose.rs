//! Regions of a DICOM object to labels.

use super::roles::{Candidate, Outer, Plan};
use crate::Error;
use supine_dicom::{Segmentation, Structures};
use supine_exchange::Segments;
use supine_space::{Grid, Progress, Warning};
use supine_volume::{LabelMap, Volume, label};

/// The named regions of a file.
pub(super) enum Regions {
    Segmentation(Box<Segmentation>),
    Structures(Structures),
    /// Of a label map whose numbers have names.
    Segments(Box<Segments>),
}

impl Regions {
    /// All regions, in the order of the file.
    pub(super) fn candidates(&self) -> Vec<Candidate> {
        match self {
            Self::Segmentation(s) => s
                .segments()
                .iter()
                .map(|s| Candidate { name: s.name.clone(), meaning: s.meaning })
                .collect(),
            Self::Structures(s) => s
                .rois()
                .iter()
                .map(|r| Candidate { name: r.name.clone(), meaning: r.meaning() })
                .collect(),
            Self::Segments(s) => {
                s.names().map(|n| Candidate { name: n.into(), meaning: None }).collect()
            }
        }
    }

    /// The voxels of a region, by its place in the list.
    fn mask(
        &self,
        n: usize,
        grid: &Grid,
        frame_of_reference: Option<&str>,
        warnings: &mut Vec<Warning>,
    ) -> Result<Volume<bool>, Error> {
        let (mask, told) = match self {
            Self::Segmentation(s) => (s.mask(s.segments()[n].number), s.warnings().to_vec()),
            Self::Segments(s) => (s.mask(n), vec![]),
            Self::Structures(s) => {
                s.mask(&s.rois()[n], grid, frame_of_reference).map_err(Error::LabelsObject)?
            }
        };
        for warning in told {
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        Ok(mask)
    }
}

/// The labels that a plan makes of the regions, with what is uncertain.
pub(super) fn compose(
    regions: &Regions,
    plan: &Plan,
    grid: &Grid,
    frame_of_reference: Option<&str>,
    progress: Progress<'_>,
) -> Result<(LabelMap, Vec<Warning>), Error> {
    // A label map has a grid of its own, which is compared with the CT's when it is complete.
    let own = match regions {
        Regions::Segments(s) => Some(s.mask(0).grid().clone()),
        Regions::Segmentation(_) | Regions::Structures(_) => None,
    };
    let grid = own.as_ref().unwrap_or(grid);
    let mut layers = Layers::new(grid);
    let mut warnings = Vec::new();
    let mask =
        |n: usize, warnings: &mut Vec<Warning>| regions.mask(n, grid, frame_of_reference, warnings);
    match plan {
        Plan::Labels { labels, left_out } => {
            for (done, &(n, label)) in labels.iter().enumerate() {
                progress.at(done as f64 / labels.len() as f64)?;
                layers.add(&mask(n, &mut warnings)?, label);
            }
            if !left_out.is_empty() {
                let text = "regions without meaning here: ";
                warnings.push(Warning::new("regions-unused", text).names(left_out.clone()));
            }
        }
        Plan::Parts { outer, wall, warnings: told } => {
            warnings.extend(told.iter().cloned());
            let (Outer::Body(soft) | Outer::SoftTissue(soft)) = outer;
            for &n in soft {
                layers.add(&mask(n, &mut warnings)?, label::SOFT_TISSUE);
            }
            progress.at(0.4)?;
            for &n in wall {
                layers.add(&mask(n, &mut warnings)?, label::CHEST_WALL);
            }
            progress.at(0.8)?;
            layers.enclose(&mut warnings);
            if let Outer::Body(_) = outer {
                // What the body and the chest wall share is chest wall by its making.
                layers.both = 0;
            }
        }
    }
    Ok(layers.finish(warnings))
}

/// Labels being put together: the finer label stands, and chest wall before soft tissue.
struct Layers {
    labels: LabelMap,
    /// Voxels of soft tissue and chest wall at once.
    both: usize,
}

impl Layers {
    fn new(grid: &Grid) -> Self {
        Self { labels: Volume::from_fn(grid.clone(), |_| label::OUTSIDE), both: 0 }
    }

    fn add(&mut self, mask: &Volume<bool>, new: u8) {
        for (out, _) in self.labels.data_mut().iter_mut().zip(mask.data()).filter(|(_, m)| **m) {
            let (was_wall, is_wall) = (label::is_chest_wall(*out), label::is_chest_wall(new));
            if *out == label::OUTSIDE || was_wall == is_wall {
                *out = new.max(*out);
            } else {
                self.both += 1;
                if is_wall {
                    *out = new;
                }
            }
        }
    }

    /// What the chest wall encloses within a slice is chest wall: lungs, heart, spine.
    fn enclose(&mut self, warnings: &mut Vec<Warning>) {
        let [ni, nj, _] = self.labels.grid().size();
        let mut enclosed = 0;
        for slice in self.labels.data_mut().chunks_exact_mut(ni * nj) {
            let open = open_pixels(slice, ni, nj);
            for (label, _) in slice.iter_mut().zip(open).filter(|(_, open)| !open) {
                if !label::is_chest_wall(*label) {
                    *label = label::CHEST_WALL;
                    enclosed += 1;
                }
            }
        }
        let ml = self.ml(enclosed);
        if ml >= 1.0 {
            let text = format!(
                "{ml:.0} ml that the chest wall encloses in the slices, lungs and all, count as \
                 chest wall"
            );
            warnings.push(Warning::new("enclosed-by-chest-wall", text));
        }
    }

    fn ml(&self, voxels: usize) -> f64 {
        voxels as f64 * self.labels.grid().voxel_volume() / 1000.0
    }

    fn finish(self, mut warnings: Vec<Warning>) -> (LabelMap, Vec<Warning>) {
        let ml = self.ml(self.both);
        if ml >= 1.0 {
            let text = format!(
                "{ml:.0} ml are soft tissue and chest wall at once; they count as chest wall"
            );
            warnings.push(Warning::new("regions-overlap", text));
        }
        (self.labels, warnings)
    }
}

/// The pixels of a slice that are no chest wall and joined to its ends.
fn open_pixels(slice: &[u8], ni: usize, nj: usize) -> Vec<bool> {
    let mut open = vec![false; slice.len()];
    let mut stack = Vec::new();
    let at_end = |n: usize| {
        let (i, j) = (n % ni, n / ni);
        i == 0 || j == 0 || i + 1 == ni || j + 1 == nj
    };
    for n in (0..slice.len()).filter(|&n| at_end(n)) {
        stack.push(n);
        while let Some(n) = stack.pop() {
            if open[n] || label::is_chest_wall(slice[n]) {
                continue;
            }
            open[n] = true;
            let (i, j) = (n % ni, n / ni);
            if i > 0 {
                stack.push(n - 1);
            }
            if i + 1 < ni {
                stack.push(n + 1);
            }
            if j > 0 {
                stack.push(n - ni);
            }
            if j + 1 < nj {
                stack.push(n + ni);
            }
        }
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    fn layers() -> Layers {
        let spacing = Vector::repeat(10.0);
        Layers::new(&Grid::new([9, 9, 2], spacing, Point::origin(), Matrix::identity()).unwrap())
    }

    fn box_of(layers: &Layers, low: usize, high: usize) -> Volume<bool> {
        Volume::from_fn(layers.labels.grid().clone(), |[i, j, _]| {
            (low..high).contains(&i) && (low..high).contains(&j)
        })
    }

    #[test]
    fn body_minus_chest_wall_is_soft_tissue_and_what_the_wall_encloses_is_wall() {
        let mut l = layers();
        l.add(&box_of(&l, 1, 8), label::SOFT_TISSUE);
        let (outer, inner) = (box_of(&l, 2, 7), box_of(&l, 3, 6));
        // A ring that is open in the second slice.
        let ring = Volume::from_fn(l.labels.grid().clone(), |v| {
            outer.at(v) && !inner.at(v) && v != [4, 2, 1]
        });
        l.add(&ring, label::CHEST_WALL);
        let mut warnings = Vec::new();
        l.enclose(&mut warnings);
        let labels = &l.labels;
        let at = |v| labels.at(v);
        assert_eq!([at([0, 0, 0]), at([1, 1, 0]), at([2, 4, 0]), at([4, 4, 0])], [0, 1, 2, 2]);
        assert_eq!(at([4, 4, 1]), 1, "an open ring encloses nothing");
        assert!(warnings[0].to_string().starts_with("9 ml"), "{warnings:?}");
    }

    #[test]
    fn finer_labels_stand_and_chest_wall_goes_before_soft_tissue() {
        let mut l = layers();
        l.add(&box_of(&l, 4, 8), label::TUMOUR);
        l.add(&box_of(&l, 0, 5), label::CHEST_WALL);
        l.add(&box_of(&l, 0, 9), label::SOFT_TISSUE);
        let (labels, warnings) = l.finish(vec![]);
        let at = |v| labels.at(v);
        assert_eq!([at([4, 4, 0]), at([0, 0, 0]), at([7, 7, 0]), at([8, 8, 1])], [2, 2, 9, 1]);
        assert!(warnings[0].to_string().starts_with("52 ml"), "{warnings:?}");
    }
}
