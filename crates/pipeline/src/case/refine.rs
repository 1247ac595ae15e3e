//! Where a case wants the tetrahedra smaller.

use super::{CaseError, MeshFile, one_of, value};

/// Edges in the tumour when nothing else is said, mm.
const TUMOUR_EDGE_MM: f64 = 4.0;
/// Their growth away from it when nothing else is said, mm per mm.
const TUMOUR_GROWTH: f64 = 0.5;

/// Where the tetrahedra are to be smaller, as asked in a case.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RefineWish {
    /// Nowhere.
    #[default]
    Nowhere,
    /// In and around the tumour.
    Tumour {
        /// Longest edge wanted in it, mm.
        edge_mm: f64,
        /// Growth of that length with the distance from it, mm per mm.
        growth: f64,
    },
    /// Where the tumour's displacement depends on it.
    Goal,
}

impl RefineWish {
    /// Name in case files and in the summary.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Nowhere => "none",
            Self::Tumour { .. } => "tumour",
            Self::Goal => "goal",
        }
    }
}

/// The refinement that a case asks for.
///
/// # Errors
/// [`CaseError::Value`] when a number is out of range or says nothing.
pub(super) fn wish(file: &MeshFile) -> Result<RefineWish, CaseError> {
    let default = RefineWish::Tumour { edge_mm: TUMOUR_EDGE_MM, growth: TUMOUR_GROWTH };
    let choices = [("none", RefineWish::Nowhere), ("tumour", default), ("goal", RefineWish::Goal)];
    let wish = one_of("mesh.refine", file.refine.as_deref(), &choices)?;
    let given =
        [("mesh.tumour_edge", file.tumour_edge), ("mesh.tumour_growth", file.tumour_growth)];
    let RefineWish::Tumour { edge_mm, growth } = wish else {
        return match given.iter().find(|(_, v)| v.is_some()) {
            Some((key, _)) => Err(value(key, "says nothing without refine = \"tumour\"")),
            None => Ok(wish),
        };
    };
    for (key, v, range) in
        [(given[0].0, file.tumour_edge, 0.1..=50.0), (given[1].0, file.tumour_growth, 0.05..=2.0)]
    {
        if let Some(v) = v.filter(|v| !range.contains(v)) {
            let (low, high) = (range.start(), range.end());
            return Err(value(key, format!("{v} is not between {low} and {high}")));
        }
    }
    Ok(RefineWish::Tumour {
        edge_mm: file.tumour_edge.unwrap_or(edge_mm),
        growth: file.tumour_growth.unwrap_or(growth),
    })
}
