//! Label maps and DICOM segmentations.

use super::{CarryDone, Job, LabelVolume, SegmentVolume};
use crate::commands::{input, usage};
use crate::{Error, NodeId};
use supine_exchange::{LabelLayers, write_label_layers};
use supine_space::Warning;
use supine_warp::{Origins, Params, carry_labels};

/// A label whose volume changes by more than this share is told.
const TOLD_CHANGE: f64 = 0.05;

/// Says that a label has another volume after it was carried.
fn other_volume(label: &LabelVolume) -> Option<Warning> {
    let LabelVolume { number, name, before_ml, after_ml, .. } = label;
    let change = after_ml / before_ml - 1.0;
    let name = name.as_ref().map_or(String::new(), |name| format!(" (\"{name}\")"));
    (*before_ml > 0.0 && change.abs() > TOLD_CHANGE).then(|| {
        let text = format!(
            "label {number}{name} has {before_ml:.2} ml in the CT and {after_ml:.2} ml after it was carried ({:+.0} %): each \
             voxel takes the label of one place, by which small regions lose; where the volume counts, carry contours",
            100.0 * change
        );
        Warning::new("label-volume-changed", text)
    })
}

impl Job<'_> {
    /// Label maps, on their own voxels or on those of the CT.
    pub(super) fn labels(&self, given: &LabelLayers) -> Result<CarryDone, Error> {
        let own = given.grid().ok_or_else(|| input("the file holds no label map"))?;
        self.warn_beside(own);
        let grid = if self.given.ct_grid { self.grid(self.ct()?.as_ref())? } else { own.clone() };
        let params = Params::default();
        // A voxel of the label map reaches so far beyond the faces of the mesh.
        let layer_mm = own.spacing().norm().min(params.collar_mm);
        let carried = self.gather.work(NodeId::Carry, |progress| {
            let part = progress.part(0.0, 0.8);
            let origins = Origins::new(&grid, &self.deformation, &params, layer_mm, part)?;
            let part = progress.part(0.8, 1.0);
            let layers = given.layers.iter().map(|layer| carry_labels(layer, &origins, part));
            Ok(given.with_layers(layers.collect::<Result<_, _>>()?))
        })?;
        self.gather.work(NodeId::Export, |progress| {
            write_label_layers(&carried, self.out(), progress).map_err(Error::product)
        })?;
        let (before, after) = (given.volumes_ml(), carried.volumes_ml());
        let labels = before.iter().map(|(&(layer, number), &before_ml)| {
            let known = given.names.iter().find(|(l, n, _)| (*l, *n) == (layer, number));
            let after_ml = after.get(&(layer, number)).copied().unwrap_or(0.0);
            let name = known.map(|(.., name)| name.clone());
            LabelVolume { layer, number, name, before_ml, after_ml }
        });
        let labels: Vec<LabelVolume> = labels.collect();
        self.gather.warn_all(NodeId::Carry, labels.iter().filter_map(other_volume));
        Ok(CarryDone::Labels { out: self.out().into(), labels })
    }

    /// Segments, on the voxels of the CT, as a segmentation of the exported one.
    pub(super) fn segments(&self) -> Result<CarryDone, Error> {
        if !self.to_dicom() {
            return Err(usage(
                "a DICOM segmentation is carried into one: name a .dcm file (or save it as .seg.nrrd first)",
            ));
        }
        let context = self.context(self.ct()?.as_ref())?;
        let (ct, _) = context.exported().ok_or(Error::NoSeries)?;
        let done = self.gather.work(NodeId::Carry, |progress| {
            self.with(&context).segmentation(&self.given.what, self.out(), ct.grid(), progress)
        })?;
        self.gather.warn_all(NodeId::Carry, done.warnings);
        let segments = done.given.segments().iter().zip(done.carried.regions);
        let segments =
            segments.map(|(segment, region)| SegmentVolume { number: segment.number, region });
        Ok(CarryDone::Segments {
            out: self.out().into(),
            segments: segments.collect(),
            instance_uid: done.written.instance_uid,
            warnings: self.gather.warnings(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_that_loses_is_told_with_both_volumes() {
        let label = |before_ml, after_ml| {
            let name = Some("clip".into());
            other_volume(&LabelVolume { layer: 0, number: 3, name, before_ml, after_ml })
        };
        let told = label(3.05, 2.72).unwrap().to_string();
        assert!(
            told.contains("label 3 (\"clip\") has 3.05 ml") && told.contains("2.72 ml"),
            "{told}"
        );
        assert!(
            told.contains("(-11 %)") && label(3.05, 3.0).is_none() && label(0.0, 0.0).is_none()
        );
    }
}
