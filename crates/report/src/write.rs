//! The report's folder.

use crate::encoded::{EncodedRow, encoded};
use crate::files::{builder, replace_folder};
use crate::{Error, Mesh, PatientIdentity, Scene, Shown, Summary, html, pictures, viewer};
use std::path::{Path, PathBuf};
use supine_mesh::TetMesh;
use supine_space::{Point, Progress, Vector, Warning};

/// All pictures of a report, encoded, with their captions and tables.
#[derive(Debug)]
pub struct Pictures {
    pub(crate) rows: Vec<EncodedRow>,
    /// The slice viewer's data, JSON.
    viewer: String,
    /// What the pictures could not show.
    pub warnings: Vec<Warning>,
}

impl Pictures {
    /// Memory that they hold, bytes.
    pub fn bytes(&self) -> usize {
        let pictures = self.rows.iter().flat_map(|row| &row.pictures);
        pictures.map(|picture| picture.png.len()).sum::<usize>() + self.viewer.len()
    }
}

/// Draws all pictures of a report and makes the slices of its viewer. They rest on nothing that is
/// exported, so that they can be drawn meanwhile.
///
/// # Errors
/// [`Error::Picture`] when the encoder fails, [`Error::Stopped`] when the user asked to stop.
pub fn draw(
    shown: &Shown<'_>,
    scene: &Scene<'_>,
    progress: Progress<'_>,
) -> Result<Pictures, Error> {
    let rows = pictures::rows(shown, scene, progress.part(0.0, 0.6))?;
    let rows = encoded(rows, progress.part(0.6, 0.8))?;
    let limit_mm = pictures::uncertain_mm(shown);
    let viewer = viewer::data(scene, limit_mm, progress.part(0.8, 1.0))?;
    Ok(Pictures { rows, viewer, warnings: missing(scene) })
}

/// Writes `dir/index.html`, self-contained, and its pictures as `dir/*.png`; the files, relative to
/// `dir`: `index.html`, then the pictures.
///
/// Everything is written into a temporary folder beside `dir`, which then takes the place of
/// `dir`. Nothing in it differs from run to run of the same case.
///
/// # Errors
/// [`Error::Write`] when the folder cannot be written, [`Error::Page`] when the page cannot be
/// made, [`Error::Stopped`] when the user asked to stop. `dir` is then as it was.
pub fn write(
    (summary, whose): (&Summary, Option<&PatientIdentity>),
    pictures: &Pictures,
    dir: &Path,
    progress: Progress<'_>,
) -> Result<Vec<PathBuf>, Error> {
    let page = html::page(summary, whose, &pictures.rows, &pictures.viewer)?;
    progress.at(0.5)?;
    write_folder(&page, &pictures.rows, dir)
}

/// Writes `dir/index.html`, a page on a mesh alone, and its pictures as `dir/*.png`, as [`write()`]
/// does.
///
/// # Errors
/// As [`write()`].
pub fn write_mesh(
    mesh: &TetMesh,
    facts: &Mesh,
    warnings: &[Warning],
    dir: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let middle =
        mesh.points().iter().map(|p| p.coords).sum::<Vector>() / mesh.points().len() as f64;
    let rows = pictures::of_mesh(mesh, facts, &Point::from(middle), progress.part(0.0, 0.6))?;
    let rows = encoded(rows.into(), progress.part(0.6, 0.95))?;
    let page = html::mesh_page(facts, warnings, &rows)?;
    write_folder(&page, &rows, dir)?;
    Ok(())
}

/// The page and its pictures in a temporary folder that then takes the place of `dir`; the files,
/// relative to it.
fn write_folder(page: &str, rows: &[EncodedRow], dir: &Path) -> Result<Vec<PathBuf>, Error> {
    let parent = dir.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = |source| Error::Write { path: dir.to_path_buf(), source };
    std::fs::create_dir_all(parent).map_err(fail)?;
    let fresh = builder(0o777).tempdir_in(parent).map_err(fail)?;
    let mut files = Vec::new();
    let pictures = rows.iter().flat_map(|row| &row.pictures);
    let pictures = pictures.map(|p| (format!("{}.png", p.name), p.png.as_slice()));
    let pages = std::iter::once(("index.html".to_string(), page.as_bytes()));
    for (name, bytes) in pages.chain(pictures) {
        std::fs::write(fresh.path().join(&name), bytes).map_err(fail)?;
        files.push(PathBuf::from(name));
    }
    replace_folder(fresh, dir).map_err(fail)?;
    Ok(files)
}

/// What the pictures could not show.
fn missing(scene: &Scene<'_>) -> Vec<Warning> {
    let lost = scene.tumour.is_some() && scene.tumour_after.is_none();
    let text = "the tumour's place on the operating table is not known: it is not drawn";
    lost.then(|| Warning::new("tumour-place-unknown", text)).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Phantom;
    use crate::summary::tests::example;
    use supine_space::{Matrix, Point, Sphere, Vector};

    fn drawn(scene: &Scene<'_>, progress: Progress<'_>) -> Result<Pictures, Error> {
        draw(&(&example()).into(), scene, progress)
    }

    fn report(dir: &Path) -> Vec<PathBuf> {
        let phantom = Phantom::new(Matrix::identity(), Vector::new(2.0, 1.0, -3.0));
        let mut scene = phantom.scene();
        scene.tumour = Some(Sphere::new(Point::new(5.0, -10.0, 4.0), 8.0).unwrap());
        scene.tumour_after = Some(Point::new(7.0, -9.0, 1.0));
        let pictures = drawn(&scene, Progress::none()).unwrap();
        write((&example(), None), &pictures, dir, Progress::none()).unwrap()
    }

    #[test]
    fn a_report_is_the_same_each_time_and_replaces_the_old_one() {
        let root = tempfile::tempdir().unwrap();
        let (a, b) = (root.path().join("a"), root.path().join("b"));
        let files = report(&a);
        std::fs::create_dir(&b).unwrap();
        std::fs::write(b.join("stale.png"), "old").unwrap();
        assert_eq!(report(&b), files);
        for file in &files {
            let read = |dir: &Path| std::fs::read(dir.join(file)).unwrap();
            assert!(read(&a) == read(&b), "{}", file.display());
        }
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 2, "nothing temporary is left");
        let mut names: Vec<PathBuf> =
            std::fs::read_dir(&b).unwrap().map(|f| f.unwrap().file_name().into()).collect();
        let mut told = files.clone();
        names.sort_unstable();
        told.sort_unstable();
        assert_eq!(told, names);
        stands_alone(&std::fs::read_to_string(a.join("index.html")).unwrap(), files.len() - 1);
    }

    fn stands_alone(page: &str, pictures: usize) {
        for foreign in
            ["http:", "https:", "<link", "@import", "import(", "fetch(", "url(", "javascript:"]
        {
            assert!(!page.contains(foreign), "{foreign}");
        }
        let scripts = ["<script>", "<script type=\"application/json\" id=\"viewer-data\">"];
        assert_eq!(scripts.map(|tag| page.matches(tag).count()), [1, 1]);
        assert_eq!([page.matches("<script").count(), page.matches("</script").count()], [2, 2]);
        let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:;";
        assert!(page.contains(policy));
        viewer_data(page);
        assert_eq!(page.matches("src=\"data:image/png;base64,").count(), pictures);
        assert_eq!(page.matches("src=").count(), pictures);
        assert!(page.contains("&#60;script&#62;alert("), "the input's name is escaped");
        assert!(page.contains("Det F &#60; 0.3 in 2 tetrahedra &#38; more"));
        for (seconds, text) in [("9.5", "total_seconds"), ("901", "peak_memory")] {
            assert!(!page.contains(&format!(">{seconds}<")) && !page.contains(text));
        }
    }

    /// What the page's script reads.
    fn viewer_data(page: &str) -> serde_json::Value {
        let (_, from) = page.split_once("id=\"viewer-data\">").unwrap();
        let (json, _) = from.split_once("</script>").unwrap();
        let data: serde_json::Value = serde_json::from_str(json).unwrap();
        assert!(!data["sheets"]["before"].as_str().unwrap().is_empty());
        data
    }

    #[test]
    fn no_name_ends_the_script_and_every_doubtful_place_can_be_shown() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let mut summary = example();
        summary.points[0].name = "</script><script>alert(1)</script>\u{202e}tfel".into();
        let pictures = drawn(&phantom.scene(), Progress::none()).unwrap();
        let page = html::page(&summary, None, &pictures.rows, &pictures.viewer).unwrap();
        assert_eq!([page.matches("<script").count(), page.matches("</script").count()], [2, 2]);
        assert!(page.contains("data-at=\"30.0,-25.0,0.0\">&#60;/script&#62;"));
        assert!(!page.contains('\u{202e}') && page.contains("\u{27e8}U+202E\u{27e9}tfel"));
        assert!(page.contains("data-at=\"55.0,-12.0,31.0\">Show<"));
        assert_eq!(viewer_data(&page)["focus_mm"], serde_json::json!(crate::phantom::MARKER));
    }

    #[test]
    fn stopped_or_refused_it_leaves_nothing() {
        let root = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let scene = phantom.scene();
        let dir = root.path().join("report");
        {
            let sink = |share: f64| share < 0.5;
            let error = drawn(&scene, Progress::new(&sink)).unwrap_err();
            assert!(matches!(error, Error::Stopped(_)), "{error}");
        }
        let pictures = drawn(&scene, Progress::none()).unwrap();
        let sink = |share: f64| share < 0.5;
        let error = write((&example(), None), &pictures, &dir, Progress::new(&sink)).unwrap_err();
        assert!(matches!(error, Error::Stopped(_)), "{error}");
        assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 0);
        std::fs::write(root.path().join("file"), "").unwrap();
        let inside = root.path().join("file").join("report");
        let error = write((&example(), None), &pictures, &inside, Progress::none()).unwrap_err();
        assert!(error.to_string().contains("report"), "{error}");
    }

    #[test]
    fn an_unknown_place_of_the_tumour_is_said() {
        let phantom = Phantom::new(Matrix::identity(), Vector::zeros());
        let mut scene = phantom.scene();
        assert!(missing(&scene).is_empty());
        scene.tumour = Some(Sphere::new(Point::origin(), 8.0).unwrap());
        assert_eq!(missing(&scene).len(), 1);
    }
}
