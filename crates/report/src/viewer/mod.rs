//! The page's slice viewer: the region's box before and after, with the lines on it, as data for
//! the page's script.
//!
//! All positions are LPS, mm. Nothing of it is text from the input: numbers, base64 and names of
//! this crate.

mod sheet;
mod slices;
mod surface;

use crate::{Ellipsoid, Error, Scene, palette};
use serde::Serialize;
use sheet::Sheet;
use slices::Lattice;
use std::collections::BTreeMap;
use supine_record::SphereRecord;
use supine_space::{Point, Progress, View};
use surface::Surface;

/// What the page's script reads.
#[derive(Serialize)]
struct Data<'a> {
    /// Centre of the voxel farthest to the right, to the front and to the feet.
    origin_mm: [f64; 3],
    step_mm: f64,
    /// Voxels along each axis.
    size: usize,
    /// Slices beside each other on a sheet.
    columns: usize,
    sheets: Sheets,
    /// A voxel of chest wall has this value on its sheet, ...
    whole: u8,
    /// ... and this is added where its boundary is uncertain.
    uncertain: u8,
    surface: Surface,
    views: Vec<Seen>,
    colours: BTreeMap<&'static str, String>,
    /// What the planes go through at first.
    focus_mm: [f64; 3],
    region: SphereRecord,
    tumour: Option<SphereRecord>,
    tumour_after_mm: Option<[f64; 3]>,
    tumour_within: Option<&'a Ellipsoid>,
}

/// The sheets as PNG files in base64.
#[derive(Serialize)]
struct Sheets {
    /// The CT in grey.
    before: String,
    /// The grey of the simulated CT less that of the CT, modulo 256: nothing where nothing moves,
    /// which packs better.
    change: String,
    /// The chest wall.
    wall: String,
}

/// A view as [`View`] tells it.
#[derive(Serialize)]
struct Seen {
    name: &'static str,
    axis: usize,
    right: [f64; 3],
    down: [f64; 3],
    letters: [&'static str; 4],
}

/// The viewer's data as JSON that may stand in a page's `<script>`; the chest wall is uncertain
/// where it may be wrong by more than `limit_mm`.
///
/// # Errors
/// [`Error::Picture`] when the encoder fails, [`Error::Stopped`] when the user asked to stop.
pub(crate) fn data(
    scene: &Scene<'_>,
    limit_mm: f64,
    progress: Progress<'_>,
) -> Result<String, Error> {
    let lattice = Lattice::new(scene);
    let sheet = Sheet::new(lattice.size);
    let ball = |centre: Point, radius_mm| SphereRecord { centre_mm: centre.into(), radius_mm };
    let data = Data {
        origin_mm: lattice.origin.into(),
        step_mm: lattice.step_mm,
        size: lattice.size,
        columns: sheet.columns,
        sheets: sheets(scene, limit_mm, &lattice, &sheet, progress)?,
        whole: slices::WHOLE,
        uncertain: slices::UNCERTAIN,
        surface: Surface::new(scene),
        views: View::ALL.map(seen).into(),
        colours: colours(),
        focus_mm: scene.focus().0.into(),
        region: ball(scene.sphere.centre(), scene.sphere.radius()),
        tumour: scene.tumour.map(|t| ball(t.centre(), t.radius())),
        tumour_after_mm: scene.tumour_after.map(Into::into),
        tumour_within: scene.tumour_within,
    };
    let json = serde_json::to_string(&data).map_err(askama::Error::custom)?;
    Ok(within_script(&json))
}

/// JSON that cannot end the `<script>` that it stands in, nor begin a comment: `<` occurs in
/// strings only.
fn within_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

fn sheets(
    scene: &Scene<'_>,
    limit_mm: f64,
    lattice: &Lattice,
    sheet: &Sheet,
    progress: Progress<'_>,
) -> Result<Sheets, Error> {
    let encoded = |name: &str, bytes: &[u8]| {
        sheet.base64(bytes).map_err(|source| Error::Picture { name: name.into(), source })
    };
    let before = lattice.grey(scene.ct, progress.part(0.0, 0.2))?;
    let mut change = lattice.grey(scene.deformed, progress.part(0.2, 0.4))?;
    change.iter_mut().zip(&before).for_each(|(after, before)| *after = after.wrapping_sub(*before));
    let wall = lattice.wall(scene, limit_mm, progress.part(0.4, 0.6))?;
    progress.at(0.6)?;
    let before = encoded("viewer_before", &before)?;
    progress.at(0.8)?;
    let (change, wall) = (encoded("viewer_change", &change)?, encoded("viewer_wall", &wall)?);
    Ok(Sheets { before, change, wall })
}

fn seen(view: View) -> Seen {
    Seen {
        name: view.name(),
        axis: view.axis(),
        right: view.right().into(),
        down: view.down().into(),
        letters: view.letters(),
    }
}

/// The palette's colours on slices, and the halo below lines.
fn colours() -> BTreeMap<&'static str, String> {
    let named = palette::ON_SLICES.map(|(name, rgb)| (name, palette::hex(rgb)));
    named.into_iter().chain([("halo", palette::halo())]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Phantom;
    use supine_space::{Matrix, Vector};

    #[test]
    fn the_data_are_the_same_each_time_and_small() {
        let phantom = Phantom::new(Matrix::identity(), Vector::new(2.0, 1.0, -3.0));
        let json = || data(&phantom.scene(), 2.0, Progress::none()).unwrap();
        let one = json();
        assert!(one == json());
        assert!(one.len() < 200_000, "{}", one.len());
        let read: serde_json::Value = serde_json::from_str(&one).unwrap();
        assert_eq!(read["colours"]["cut"], palette::hex(palette::CUT));
        assert_eq!(read["views"][0]["letters"], serde_json::json!(["R", "L", "A", "P"]));
    }

    #[test]
    fn the_script_reads_what_there_is() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let json = data(&phantom.scene(), 2.0, Progress::none()).unwrap();
        let read: serde_json::Value = serde_json::from_str(&json).unwrap();
        let script = [
            include_str!("../../templates/viewer/volumes.js"),
            include_str!("../../templates/viewer/lines.js"),
            include_str!("../../templates/viewer/panes.js"),
        ]
        .concat();
        let names = |object: &str| -> Vec<String> {
            let after =
                script.match_indices(object).filter(|(at, _)| !script[..*at].ends_with('.'));
            let name = |rest: &str| {
                rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
            };
            after.map(|(at, found)| name(&script[at + found.len()..])).collect()
        };
        for (object, holds) in [
            ("data.", &read),
            ("colours.", &read["colours"]),
            ("region.", &read["region"]),
            ("data.sheets.", &read["sheets"]),
            ("data.surface.", &read["surface"]),
        ] {
            let names = names(object);
            assert!(
                !names.is_empty() && names.iter().all(|name| holds.get(name).is_some()),
                "{object} {names:?}"
            );
        }
    }

    #[test]
    fn no_text_ends_the_script() {
        let json = within_script(&serde_json::to_string("a</script><!-- b").unwrap());
        assert!(!json.contains('<'), "{json}");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), "a</script><!-- b");
    }
}
