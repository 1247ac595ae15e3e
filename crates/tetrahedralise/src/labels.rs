//! What each voxel around the region counts as: outside air, soft tissue or chest wall.

use crate::{Error, Info, Piece};
use supine_space::{Grid, Sphere, Warning};
use supine_volume::{Components, Region, Volume, components, label};

/// What a voxel counts as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Air outside the body.
    Air,
    /// Soft tissue that is meshed.
    Soft,
    /// The rigid chest wall and all it encloses.
    Wall,
}

/// Pockets of air in the soft tissue larger than this are worth a warning, mm³.
const POCKET_MM3: f64 = 100.0;
/// Dropped soft tissue larger than this share of the whole, and than a pocket, is worth a warning.
const DROPPED_SHARE: f64 = 0.002;

/// The voxels in the box of the region's sphere and `margin_mm` around it, as far as the label map
/// goes, cleaned: the soft tissue in the sphere is one face-connected `piece`, and air is only that
/// outside the body.
///
/// Air that meets mostly chest wall is lung or trachea and counts as chest wall; air enclosed by
/// soft tissue counts as soft tissue.
pub(crate) fn kinds(
    region: &Region,
    piece: Piece,
    margin_mm: f64,
    info: &mut Info,
) -> Result<Volume<Kind>, Error> {
    let grid = crop(region.labels().grid(), region.sphere(), margin_mm)?;
    let mut kinds = read(region, grid)?;
    drop_islands(&mut kinds, region.sphere(), piece, info)?;
    let air = components(&kinds.map(|&k| k == Kind::Air));
    enclose_air(&mut kinds, &air, info);
    Ok(kinds)
}

/// The part of the grid that holds the sphere's box and a margin.
fn crop(grid: &Grid, sphere: Sphere, margin_mm: f64) -> Result<Grid, Error> {
    let wider = Sphere::new(sphere.centre(), sphere.radius() + margin_mm);
    let part = wider.ok().and_then(|wider| grid.around(&wider));
    part.map(|(_, part)| part).ok_or(Error::Beside)
}

fn read(region: &Region, grid: Grid) -> Result<Volume<Kind>, Error> {
    let labels = region.labels();
    let first = labels.grid().index_from_patient(&grid.origin()).map(|x| x.round() as usize);
    let mut data = Vec::with_capacity(grid.len());
    let [ni, nj, nk] = grid.size();
    for k in 0..nk {
        for j in 0..nj {
            let row = labels.grid().offset([first[0], first[1] + j, first[2] + k]);
            for (i, &value) in labels.data()[row..row + ni].iter().enumerate() {
                data.push(match value {
                    label::OUTSIDE => Kind::Air,
                    l if label::is_soft_tissue(l) => Kind::Soft,
                    l if label::is_chest_wall(l) => Kind::Wall,
                    label => {
                        let voxel = [first[0] + i, first[1] + j, first[2] + k];
                        return Err(Error::UnknownLabel { label, voxel });
                    }
                });
            }
        }
    }
    Ok(Volume::new(grid, data)?)
}

/// Keeps one piece of soft tissue inside the sphere; others become what they touch most.
fn drop_islands(
    kinds: &mut Volume<Kind>,
    sphere: Sphere,
    piece: Piece,
    info: &mut Info,
) -> Result<(), Error> {
    let grid = kinds.grid().clone();
    let reach = sphere.radius() + grid.spacing().max();
    let centre = sphere.centre();
    let mut inside = kinds.map(|&k| k == Kind::Soft);
    let [ni, nj, nk] = grid.size();
    for k in 0..nk {
        for j in 0..nj {
            let (row, step) = (grid.centre([0, j, k]), grid.spacing()[0]);
            let axis = grid.direction().column(0).into_owned();
            let offset = grid.offset([0, j, k]);
            for i in 0..ni {
                let p = row + axis * (step * i as f64);
                inside.data_mut()[offset + i] &= (p - centre).norm_squared() <= reach * reach;
            }
        }
    }
    let islands = components(&inside);
    let at_centre = || {
        let voxel = grid.voxel_at(&centre).map(|v| islands.ids.at(v));
        voxel.filter(|&id| id != 0).ok_or(Error::NotAtCentre)
    };
    let kept = match (piece, islands.largest()) {
        (_, None) => return Ok(()),
        (Piece::Largest, Some(largest)) => largest,
        (Piece::Centre, Some(_)) => at_centre()?,
    };
    info.dropped_components = islands.sizes.len() - 2;
    if info.dropped_components == 0 {
        return Ok(());
    }
    let contacts = contacts(&islands, kinds);
    let mut dropped = 0usize;
    for (n, &id) in islands.ids.data().iter().enumerate() {
        if id != 0 && id != kept {
            let [air, _, wall] = contacts[id as usize].faces;
            kinds.data_mut()[n] = if wall > air { Kind::Wall } else { Kind::Air };
            dropped += 1;
        }
    }
    info.dropped_volume_mm3 = dropped as f64 * grid.voxel_volume();
    let share = dropped as f64 / islands.sizes[kept as usize] as f64;
    if share > DROPPED_SHARE && info.dropped_volume_mm3 > POCKET_MM3 {
        let text = format!(
            "{} separate pieces of soft tissue in the region, {:.1} cm³ in all, were left out of \
             the mesh",
            info.dropped_components,
            info.dropped_volume_mm3 / 1000.0
        );
        let cm3 = info.dropped_volume_mm3 / 1000.0;
        info.warnings.push(Warning::new("pieces-left-out", text).value("volume_cm3", cm3));
    }
    Ok(())
}

/// Leaves as air only what lies outside the body.
fn enclose_air(kinds: &mut Volume<Kind>, air: &Components, info: &mut Info) {
    if air.sizes.len() <= 2 {
        return;
    }
    let contacts = contacts(air, kinds);
    let outside = (1..contacts.len()).max_by_key(|&id| {
        let [_, soft, _] = contacts[id].faces;
        (contacts[id].border, soft, std::cmp::Reverse(id))
    });
    let mut becomes = vec![Kind::Air; contacts.len()];
    let (mut pockets, mut largest) = (0.0, 0usize);
    for id in 1..contacts.len() {
        let [_, soft, wall] = contacts[id].faces;
        if Some(id) == outside || (contacts[id].border && soft >= wall) {
            continue;
        }
        becomes[id] = if soft >= wall { Kind::Soft } else { Kind::Wall };
        if soft >= wall {
            pockets += air.sizes[id] as f64 * kinds.grid().voxel_volume();
            largest = largest.max(air.sizes[id]);
        }
    }
    for (kind, &id) in kinds.data_mut().iter_mut().zip(air.ids.data()) {
        if id != 0 {
            *kind = becomes[id as usize];
        }
    }
    if largest as f64 * kinds.grid().voxel_volume() > POCKET_MM3 {
        let text = format!(
            "pockets of air in the soft tissue, {:.2} cm³ in all, are meshed as soft tissue",
            pockets / 1000.0
        );
        let cm3 = pockets / 1000.0;
        info.warnings.push(Warning::new("air-meshed", text).value("volume_cm3", cm3));
    }
}

/// What a component touches.
#[derive(Clone, Copy, Debug, Default)]
struct Contact {
    /// Voxel faces shared with air, soft tissue and chest wall that are not of the component.
    faces: [usize; 3],
    /// Whether it reaches the border of the box.
    border: bool,
}

fn contacts(parts: &Components, kinds: &Volume<Kind>) -> Vec<Contact> {
    let size = kinds.grid().size();
    let stride = [1, size[0], size[0] * size[1]];
    let (ids, kinds) = (parts.ids.data(), kinds.data());
    let mut contacts = vec![Contact::default(); parts.sizes.len()];
    for (row, here) in ids.chunks(size[0]).enumerate() {
        let (start, [j, k]) = (row * size[0], [row % size[1], row / size[1]]);
        let mut meet = |n: usize, m: usize| {
            if ids[n] != ids[m] {
                contacts[ids[n] as usize].faces[kinds[m] as usize] += 1;
                contacts[ids[m] as usize].faces[kinds[n] as usize] += 1;
            }
        };
        (start + 1..start + size[0]).for_each(|n| meet(n - 1, n));
        for (at, stride) in [(j, stride[1]), (k, stride[2])] {
            if at > 0 {
                (start..start + size[0]).for_each(|n| meet(n - stride, n));
            }
        }
        if [(j, size[1]), (k, size[2])].iter().any(|&(at, size)| at == 0 || at + 1 == size) {
            here.iter().for_each(|&id| contacts[id as usize].border = true);
        }
        for end in [0, size[0] - 1] {
            contacts[here[end] as usize].border = true;
        }
    }
    contacts
}
