//! Label maps carried along.

use crate::{Origin, Origins, origins::there};
use supine_space::{Point, Progress, Stopped};
use supine_volume::Volume;

/// A label map after deformation, on the grid of `origins`: each voxel has the label that is
/// nearest to where its tissue was. Labels are never mixed. Voxels that the tissue left, and places
/// outside the label map, get `T::default()`.
///
/// Air beside the skin does not take the place of what stays.
///
/// # Errors
/// [`Stopped`].
pub fn carry_labels<T: Copy + Default + PartialEq + Send + Sync>(
    labels: &Volume<T>,
    origins: &Origins,
    progress: Progress<'_>,
) -> Result<Volume<T>, Stopped> {
    let same = labels.grid() == origins.grid();
    let nearest =
        |p: Point| labels.grid().voxel_at(&p).map_or_else(T::default, |voxel| labels.at(voxel));
    origins.volume(progress, |voxel, origin| {
        let centre = origins.grid().centre(voxel);
        let here = || if same { labels.at(voxel) } else { nearest(centre) };
        match origin {
            Origin::Here => here(),
            Origin::Vacated => T::default(),
            Origin::Tissue(to) | Origin::BesideVacated(to) => nearest(there(centre, to)),
            Origin::Beside(to) => {
                let arriving = nearest(there(centre, to));
                if arriving == T::default() { here() } else { arriving }
            }
        }
    })
}
