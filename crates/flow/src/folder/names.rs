//! The names of all files of a run's folder. Nobody else knows one.

use crate::NodeId;

/// The summary: the last file of a run.
pub(super) const SUMMARY: &str = "summary.json";
/// The finished result that a run is replacing, until the run is finished itself.
pub(super) const PREVIOUS: &str = "previous";
/// What lay where the run writes and was not written by this program.
pub(super) const SET_ASIDE: &str = "set-aside";
/// What happened, line by line.
pub(super) const LOG: &str = "log.jsonl";
/// Records of the nodes, and what only the program reads.
pub(super) const RECORDS: &str = ".stages";
/// Held while somebody works in the folder.
pub(super) const LOCK: &str = ".stages/lock";
/// The version of the folder's layout.
pub(super) const FORMAT: &str = ".stages/format";
/// That a later run into the folder failed, before or after it began to replace the finished
/// result.
pub(super) const FAILED: &str = ".stages/failed.json";
/// What the folder beside that of a de-identified run is called after it. Whoever has it can tell
/// who the patient was, so that it never lies in the folder that is passed on.
pub(super) const BESIDE: &str = "-reidentification";
/// What takes the patient out of exports, in that folder.
pub(super) const SECRET: &str = "anonymise.key";
/// The case of a de-identified run, whose summary names no files, in that folder.
pub(super) const CASE: &str = "case.json";
/// What was sent to archives from the folder and from that of its CT, as it is noted there.
pub(super) const SENT: [&str; 2] = [".supine-sent", "ct/.supine-sent"];
/// Where both lay before.
pub(super) const WITHIN: &str = ".stages";

/// What the folder of a cohort holds: the folders of the runs,
pub(super) const RUNS: &str = "runs";
/// how each ended,
pub(super) const STATUS: &str = "status";
/// a table and a page of all,
pub(super) const TABLE: &str = "cohort.csv";
/// see there,
pub(super) const PAGE: &str = "index.html";
/// and what is held while somebody works in it.
pub(super) const COHORT_LOCK: &str = "status/.lock";

/// Labels of the user's own that were given in memory, for the case to name; no run writes over
/// them.
pub(super) const OWN_LABELS: &str = "own_labels.nrrd";

/// Files and folders that nodes leave: node, what it calls it, path.
pub(super) const ARTIFACTS: &[(NodeId, &str, &str)] = &[
    (NodeId::Segment, "labels", "labels.seg.nrrd"),
    (NodeId::Segment, "uncertainty", "labels-uncertainty.nrrd"),
    (NodeId::Segment, "surfaces", ".stages/surfaces"),
    (NodeId::Segment, "implants", ".stages/implants.nrrd"),
    (NodeId::LabelsObject, "labels", "labels.dcm"),
    (NodeId::Tissues, "labels", "tissues.seg.nrrd"),
    (NodeId::Mesh, "mesh", "mesh/rest.vtu"),
    (NodeId::Mesh, "curved", ".stages/curved.vtu"),
    (NodeId::Solve, "deformed", "mesh/deformed.vtu"),
    (NodeId::Fields, "deformed_to_ct", "field/deformed_to_ct.nrrd"),
    (NodeId::Fields, "transform", "field/deformed_to_ct.mat"),
    (NodeId::Fields, "ct_to_deformed", "field/ct_to_deformed.nrrd"),
    (NodeId::Fields, "jacobian", "field/jacobian.nrrd"),
    (NodeId::Points, "points", "points.csv"),
    (NodeId::Fit, "sitting", "scans/sitting.csv"),
    (NodeId::Fit, "table", "scans/modulus.csv"),
    (NodeId::Evaluation, "intraop", "scans/intraop.csv"),
    (NodeId::Evaluation, "table", "scans/evaluation.csv"),
    (NodeId::Export, "series", "ct"),
    (NodeId::Export, "volume", "ct.nrrd"),
    (NodeId::Registration, "registrations", "registration"),
    (NodeId::Structures, "structures", "structures.dcm"),
    (NodeId::Carry, "objects", "rt"),
    (NodeId::Report, "report", "report"),
    (NodeId::ReportObject, "document", "report.dcm"),
];

/// What the version before left and this one does not.
pub(super) const FORMER: &[&str] = &[
    "labels-doubt.nrrd",
    ".stages/warped.nrrd",
    ".stages/segment.json",
    ".stages/tissues.json",
    ".stages/mesh.json",
    ".stages/solve.json",
    ".stages/warp.json",
    ".stages/export.json",
    ".stages/carry.json",
    ".stages/report.json",
];

/// The path of what a node leaves, relative to the folder.
pub(super) fn path_of(node: NodeId, artifact: &str) -> &'static str {
    let row = ARTIFACTS.iter().find(|(n, name, _)| (*n, *name) == (node, artifact));
    row.map_or_else(
        || unreachable!("{node} leaves no {artifact}: name it in the table of artifacts"),
        |(_, _, path)| path,
    )
}

/// All that a node leaves, relative to the folder.
pub(super) fn paths_of(node: NodeId) -> impl Iterator<Item = &'static str> {
    ARTIFACTS.iter().filter(move |(n, ..)| *n == node).map(|(_, _, path)| *path)
}

/// Everything that a run may write over.
pub(super) fn all() -> impl Iterator<Item = &'static str> {
    ARTIFACTS.iter().map(|(_, _, path)| *path).chain(["field", "mesh", "scans", SUMMARY, PREVIOUS])
}
