//! The nodes of the flow, by name.

/// A node of the flow; what the command line calls a stage. The order is one in which they can be
/// made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum NodeId {
    /// The CT.
    Import,
    /// What exports may say of the CT's series.
    Source,
    /// The patient's own doses, structures and segmentations, held against the CT.
    Objects,
    /// The tumour, held against the CT.
    Tumour,
    /// The CT made ready: seeds can then be set and changed without starting over.
    Prepare,
    /// Labels of chest wall and soft tissue.
    Segment,
    /// The labels as a DICOM segmentation.
    LabelsObject,
    /// The sphere, found or checked.
    Region,
    /// Labels of the finer tissues, when the case asks for them.
    Tissues,
    /// Tetrahedra of the soft tissue in the sphere.
    Mesh,
    /// A modulus for each tetrahedron, when the case asks for it.
    Moduli,
    /// The modulus that fits the scans, when the case names some.
    Fit,
    /// Their displacement under the table's gravity.
    Solve,
    /// The CT on the table.
    Warp,
    /// Points carried along.
    Points,
    /// A scan on the operating table held against the result, when the case names one.
    Evaluation,
    /// How sure the tumour's place is.
    Interval,
    /// The patient's own doses, structures and segmentations where the tissue carries them.
    MovedObjects,
    /// The exported series.
    Export,
    /// The map as fields on the voxels of the CT around what moves.
    Fields,
    /// The pictures of the report.
    Pictures,
    /// Registrations of the series with the CT.
    Registration,
    /// Body, chest wall, breast and tumour on the series.
    Structures,
    /// The patient's own doses, structures and segmentations on the series.
    Carry,
    /// The report.
    Report,
    /// What the report says first, as a PDF beside the series.
    ReportObject,
}

impl NodeId {
    /// All nodes, in an order in which they can be made.
    pub const ALL: [Self; 26] = [
        Self::Import,
        Self::Source,
        Self::Objects,
        Self::Tumour,
        Self::Prepare,
        Self::Segment,
        Self::LabelsObject,
        Self::Region,
        Self::Tissues,
        Self::Mesh,
        Self::Moduli,
        Self::Fit,
        Self::Solve,
        Self::Warp,
        Self::Points,
        Self::Evaluation,
        Self::Interval,
        Self::MovedObjects,
        Self::Export,
        Self::Fields,
        Self::Pictures,
        Self::Registration,
        Self::Structures,
        Self::Carry,
        Self::Report,
        Self::ReportObject,
    ];

    /// Name on the command line, in logs and in `summary.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Import => "import",
            Self::Source => "source",
            Self::Objects => "objects",
            Self::Tumour => "tumour",
            Self::Prepare => "prepare",
            Self::Segment => "segment",
            Self::LabelsObject => "labels-object",
            Self::Region => "region",
            Self::Tissues => "tissues",
            Self::Mesh => "mesh",
            Self::Moduli => "moduli",
            Self::Fit => "fit",
            Self::Solve => "solve",
            Self::Interval => "interval",
            Self::Warp => "warp",
            Self::Export => "export",
            Self::Fields => "fields",
            Self::Points => "points",
            Self::Evaluation => "evaluation",
            Self::MovedObjects => "moved-objects",
            Self::Pictures => "pictures",
            Self::Registration => "registration",
            Self::Structures => "structures",
            Self::Carry => "carry",
            Self::Report => "report",
            Self::ReportObject => "report-object",
        }
    }

    /// What to do about a warning of it, in general: what is to be looked at, and what changes it.
    pub fn advice(self) -> &'static str {
        match self {
            Self::Import | Self::Source | Self::Prepare => {
                "look at the CT where the message says; export it again from the archive if it is wrong there"
            }
            Self::Objects | Self::Carry | Self::MovedObjects => {
                "look at the object beside the CT, in the page or where it was made, before it is used"
            }
            Self::Tumour => {
                "look at the tumour's place in the report; `tumour` in the case moves it"
            }
            Self::Segment | Self::LabelsObject | Self::Tissues | Self::Structures => {
                "look at the labels there, in the report or the page; seeds or strokes correct them"
            }
            Self::Region => "look at the sphere in the report; `region` in the case sets another",
            Self::Mesh => {
                "look at the mesh in the report; `mesh.tetrahedra` or another `region` makes another"
            }
            Self::Moduli | Self::Solve => {
                "look at the figures of the mechanics in the report; `tissue` in the case says what the tissue is taken for"
            }
            Self::Fit | Self::Evaluation => {
                "look at the scan on the model in the report; `scans` in the case names its unit and landmarks"
            }
            Self::Interval => "take the interval for what it says; scans of the patient narrow it",
            Self::Warp | Self::Fields | Self::Points | Self::Export | Self::Registration => {
                "look at the exported CT there before it is used"
            }
            Self::Pictures | Self::Report | Self::ReportObject => {
                "look at the report before it is passed on"
            }
        }
    }

    /// The node of a name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|id| id.name() == name)
    }

    /// Its place in [`NodeId::ALL`].
    pub(crate) fn place(self) -> usize {
        self as usize
    }
}

impl std::fmt::Display for NodeId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
