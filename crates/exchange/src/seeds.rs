//! Seeds of the segmentation, placed by the user.

use crate::{Error, NamedPoint, Problem, file, markups, points};
use std::path::Path;
use supine_space::Point;

/// Points the user placed in a tissue, LPS, mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeedPoints {
    /// In the chest wall.
    pub chest_wall: Vec<Point>,
    /// In the soft tissue.
    pub soft_tissue: Vec<Point>,
    /// In what is neither and not of the patient.
    pub exclude: Vec<Point>,
}

impl SeedPoints {
    /// The seeds a name stands for; `-` and spaces count as `_`, case does not matter.
    fn list(&mut self, name: &str) -> Option<&mut Vec<Point>> {
        let name = name.trim().to_lowercase().replace([' ', '-'], "_");
        if name.starts_with("chest_wall") {
            Some(&mut self.chest_wall)
        } else if name.starts_with("soft") {
            Some(&mut self.soft_tissue)
        } else if name.starts_with("exclude") {
            Some(&mut self.exclude)
        } else {
            None
        }
    }

    /// Adds a point by its own name, else by the names of its list.
    fn add(&mut self, number: usize, p: &NamedPoint, of: &[Option<&str>]) -> Result<(), Problem> {
        let names = std::iter::once(Some(p.name.as_str())).chain(of.iter().copied()).flatten();
        for name in names {
            if let Some(list) = self.list(name) {
                list.push(p.position);
                return Ok(());
            }
        }
        let reason = "its name begins with none of `chest_wall`, `soft_tissue`, `exclude`, nor \
                      does that of its list";
        Err(Problem::Point { number, name: p.name.clone(), reason })
    }
}

/// Reads seeds from 3D Slicer markups (`.mrk.json`) or CSV `name,x,y,z`.
///
/// The name of a point tells its tissue: `chest_wall...`, `soft_tissue...` (or `soft...`),
/// `exclude...`. If it does not, the name of its list does, or the file's name.
///
/// # Errors
/// As [`crate::read_points`]; and when a point belongs to none of the three.
pub fn read_seeds(path: &Path) -> Result<SeedPoints, Error> {
    let bytes = file::read(path)?;
    let lists = if points::is_markups(path) {
        markups::parse(&bytes)
    } else if file::has_suffix(path, ".csv") {
        points::parse_csv(&bytes).map(|points| vec![markups::List { name: None, points }])
    } else {
        Err(Problem::Format("seeds as .mrk.json or .csv"))
    };
    let stem = path.file_name().map(|n| n.to_string_lossy());
    let seeds = lists.and_then(|lists| {
        let mut seeds = SeedPoints::default();
        for list in &lists {
            for (n, p) in list.points.iter().enumerate() {
                seeds.add(n + 1, p, &[list.name.as_deref(), stem.as_deref()])?;
            }
        }
        Ok(seeds)
    });
    seeds.map_err(|p| p.of(path))
}
