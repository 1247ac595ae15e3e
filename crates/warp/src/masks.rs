//! Masks carried along: the voxels of one structure.

use crate::coverage::Window;
use crate::origins::{there, volume};
use crate::{Origin, Origins};
use supine_space::{Grid, Point, Progress, Stopped};
use supine_volume::{Volume, distance_mm, sample_trilinear};

/// Voxels beside a mask between which it is interpolated.
const MARGIN: usize = 2;
/// Longest distance that is told from a longer one, mm.
const FAR_MM: f32 = 1e3;

/// A mask after deformation, on the grid of `origins`. Voxels that the tissue left, and places
/// outside the mask's grid, do not hold.
///
/// Within the tissue, those voxels hold whose tissue lies deepest in the mask by the signed
/// distance to its boundary, interpolated linearly (shape-based interpolation: Raya and Udupa, IEEE
/// Trans Med Imaging 9 (1990) 32), and as many of them as the mask interpolated linearly weighs. So
/// the volume is that of the carried structure to within a voxel: the nearest voxels lose or double
/// part of a slice wherever the motion crosses the middle between two, and any fixed level thins
/// out what is thin.
///
/// Air beside the skin does not take the place of what stays.
///
/// # Errors
/// [`Stopped`].
pub fn carry_mask(
    mask: &Volume<bool>,
    origins: &Origins,
    progress: Progress<'_>,
) -> Result<Volume<bool>, Stopped> {
    let (grid, same) = (origins.grid(), mask.grid() == origins.grid());
    let nearest = |p: Point| mask.grid().voxel_at(&p).is_some_and(|voxel| mask.at(voxel));
    let here = |voxel: [usize; 3]| if same { mask.at(voxel) } else { nearest(grid.centre(voxel)) };
    let mut held = volume(grid, progress.part(0.0, 0.3), here)?;
    let Some((start, part)) = origins.moving() else { return Ok(held) };
    let end = [0, 1, 2].map(|a| start[a] + part.grid().size()[a]);
    let shape = Shape::of(mask, same.then_some(Window { first: *start, end }));
    let whole = |within: [usize; 3]| [0, 1, 2].map(|a| start[a] + within[a]);
    let verdict = |within: [usize; 3]| {
        let voxel = whole(within);
        let centre = grid.centre(voxel);
        let held = match part.at(within) {
            Origin::Here => here(voxel),
            Origin::Vacated => false,
            Origin::BesideVacated(to) => nearest(there(centre, to)),
            Origin::Beside(to) => nearest(there(centre, to)) || here(voxel),
            Origin::Tissue(to) => {
                let at = shape.as_ref().and_then(|shape| shape.at(&there(centre, to)));
                return at.map_or(Verdict::No, |(weight, depth)| Verdict::Perhaps(weight, depth));
            }
        };
        if held { Verdict::Yes } else { Verdict::No }
    };
    let verdicts = volume(part.grid(), progress.part(0.3, 1.0), verdict)?;
    let offset = |n: usize| grid.offset(whole(part.grid().voxel(n)));
    for (n, verdict) in verdicts.data().iter().enumerate() {
        held.data_mut()[offset(n)] = matches!(verdict, Verdict::Yes);
    }
    deepest(verdicts.data()).into_iter().for_each(|n| held.data_mut()[offset(n)] = true);
    Ok(held)
}

/// Whether a voxel holds.
#[derive(Clone, Copy)]
enum Verdict {
    No,
    Yes,
    /// By the mask interpolated there (0 to 1), and the signed distance, mm, negative inside.
    Perhaps(f32, f32),
}

/// The undecided voxels that lie deepest, as many as all of them weigh.
fn deepest(verdicts: &[Verdict]) -> Vec<usize> {
    let mut open = Vec::new();
    let mut weight = 0.0;
    for (n, verdict) in verdicts.iter().enumerate() {
        if let Verdict::Perhaps(share, depth) = verdict {
            weight += f64::from(*share);
            open.push((*depth, n));
        }
    }
    open.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    open.truncate(weight.round() as usize);
    open.into_iter().map(|(_, n)| n).collect()
}

/// A mask between its voxels.
struct Shape {
    /// 1 where it holds.
    weight: Volume<f32>,
    /// To the boundary, halfway between voxels that hold and others, mm; negative inside.
    distance: Volume<f32>,
}

impl Shape {
    /// The part of a mask that is not empty, within a box that is asked about.
    fn of(mask: &Volume<bool>, within: Option<Window>) -> Option<Self> {
        let (start, grid) = part(mask, within)?;
        let at = |v: [usize; 3]| mask.at([0, 1, 2].map(|a| v[a] + start[a]));
        let held = Volume::from_fn(grid.clone(), at);
        let outside = distance_mm(&held);
        let inside = distance_mm(&held.map(|held| !held));
        let signed = |n: usize| (outside.data()[n].min(FAR_MM)) - inside.data()[n].min(FAR_MM);
        let distance = Volume::from_fn(grid.clone(), |v| signed(grid.offset(v)));
        Some(Self { weight: held.map(|&held| f32::from(held)), distance })
    }

    /// Interpolated mask and distance; `None` where no voxel beside the place holds.
    fn at(&self, place: &Point) -> Option<(f32, f32)> {
        self.weight.grid().voxel_at(place)?;
        let index = self.weight.grid().index_from_patient(place);
        let weight = sample_trilinear(&self.weight, index);
        (weight > 0.0).then(|| (weight, sample_trilinear(&self.distance, index)))
    }
}

/// The box of the voxels that hold with [`MARGIN`] voxels on all sides, cut to the box `within` and
/// as many.
fn part(mask: &Volume<bool>, within: Option<Window>) -> Option<([usize; 3], Grid)> {
    let grid = mask.grid();
    let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
    for (n, _) in mask.data().iter().enumerate().filter(|(_, held)| **held) {
        let voxel = grid.voxel(n);
        low = [0, 1, 2].map(|a| low[a].min(voxel[a]));
        high = [0, 1, 2].map(|a| high[a].max(voxel[a]));
    }
    if let Some(Window { first, end }) = within {
        low = [0, 1, 2].map(|a| low[a].max(first[a]));
        high = [0, 1, 2].map(|a| high[a].min(end[a] - 1));
    }
    if (0..3).any(|a| low[a] > high[a]) {
        return None;
    }
    let start = low.map(|n| n.saturating_sub(MARGIN));
    let size = [0, 1, 2].map(|a| (high[a] + MARGIN).min(grid.size()[a] - 1) + 1 - start[a]);
    grid.crop(start, size).ok().map(|part| (start, part))
}
