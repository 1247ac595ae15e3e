//! The stages of a run, in order.

/// A stage of a run. The order is the order of the flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Read the CT.
    Import,
    /// Label chest wall and soft tissue.
    Segment,
    /// Find or check the sphere.
    Region,
    /// Label the finer tissues for the report, when the case asks for them.
    Tissues,
    /// Fill the soft tissue in the sphere with tetrahedra.
    Mesh,
    /// Displace them under the table's gravity.
    Solve,
    /// Resample the CT.
    Warp,
    /// Write the series.
    Export,
    /// Carry the patient's own doses, structures and segmentations.
    Carry,
    /// Write the report.
    Report,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; 10] = [
        Self::Import,
        Self::Segment,
        Self::Region,
        Self::Tissues,
        Self::Mesh,
        Self::Solve,
        Self::Warp,
        Self::Export,
        Self::Carry,
        Self::Report,
    ];

    /// Name on the command line, in logs and in `summary.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Import => "import",
            Self::Segment => "segment",
            Self::Region => "region",
            Self::Tissues => "tissues",
            Self::Mesh => "mesh",
            Self::Solve => "solve",
            Self::Warp => "warp",
            Self::Export => "export",
            Self::Carry => "carry",
            Self::Report => "report",
        }
    }

    /// Whether redoing this stage makes another one stale: itself and all later ones, but that
    /// nothing except the report rests on the finer tissues.
    pub(crate) fn spoils(self, other: Self) -> bool {
        let rests = self != Self::Tissues || matches!(other, Self::Tissues | Self::Report);
        other >= self && rests
    }

    /// What the run leaves from this stage, relative to the output folder.
    pub(crate) fn products(self) -> &'static [&'static str] {
        match self {
            Self::Import | Self::Region => &[],
            Self::Segment => &[
                "labels.seg.nrrd",
                "labels.dcm",
                "labels-doubt.nrrd",
                ".stages/surfaces",
                ".stages/implants.nrrd",
            ],
            Self::Tissues => &["tissues.seg.nrrd"],
            Self::Mesh => &["mesh/rest.vtu"],
            Self::Solve => &["mesh/deformed.vtu"],
            Self::Warp => &[".stages/warped.nrrd", "field", "points.csv"],
            Self::Export => &["ct", "ct.nrrd", "registration"],
            Self::Carry => &["rt"],
            Self::Report => &["report", "summary.json"],
        }
    }
}

impl std::fmt::Display for Stage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
