//! The whole flow: the list of nodes, one file each, in an order in which they can be made.

mod carry;
mod evaluation;
mod export;
mod fields;
mod fit;
mod fit_by_law;
mod fit_scans;
mod import;
mod interval;
mod labels_object;
mod law;
mod mesh;
mod moduli;
mod moved_objects;
mod objects;
mod pictures;
mod points;
mod prepare;
mod region;
mod registration;
mod report;
mod report_object;
mod segment;
mod solve;
mod source;
mod structures;
mod tissues;
mod tumour;
mod warp;

pub(crate) use carry::Carry;
pub(crate) use evaluation::Evaluation;
pub(crate) use export::Export;
pub(crate) use fields::Fields;
pub(crate) use fit::{Fit, Fitted};
pub(crate) use fit_scans::Scans;
pub(crate) use import::{Import, Imported};
pub(crate) use interval::{Interval, coarser};
pub(crate) use labels_object::LabelsObject;
pub(crate) use law::Law;
pub(crate) use mesh::{Mesh, Meshed};
pub(crate) use moduli::{ByTissue, Moduli, tissue_map};
pub(crate) use moved_objects::{Moved, MovedObjects};
pub(crate) use objects::Objects;
pub(crate) use pictures::Pictures;
pub(crate) use points::{Points, not_carried, refuse_nowhere};
pub(crate) use prepare::{Prepare, Prepared};
pub(crate) use region::{Chosen, Region, beyond_region};
pub(crate) use registration::Registration;
pub(crate) use report::Report;
pub(crate) use report_object::ReportObject;
pub(crate) use segment::{Segment, Segmented, check_seeds};
pub(crate) use solve::{Solve, Solved};
pub(crate) use source::Source;
pub(crate) use structures::Structures;
pub(crate) use tissues::{Labelled, Tissues};
pub(crate) use tumour::Tumour;
pub(crate) use warp::{Warp, beyond_field};

use crate::graph::Entry;

/// All nodes, in the order of [`crate::NodeId`].
pub(crate) static NODES: &[Entry] = &[
    Entry::of::<Import>(),
    Entry::of::<Source>(),
    Entry::of::<Objects>(),
    Entry::of::<Tumour>(),
    Entry::of::<Prepare>(),
    Entry::of::<Segment>(),
    Entry::of::<LabelsObject>(),
    Entry::of::<Region>(),
    Entry::of::<Tissues>(),
    Entry::of::<Mesh>(),
    Entry::of::<Moduli>(),
    Entry::of::<Fit>(),
    Entry::of::<Solve>(),
    Entry::of::<Warp>(),
    Entry::of::<Points>(),
    Entry::of::<Evaluation>(),
    Entry::of::<Interval>(),
    Entry::of::<MovedObjects>(),
    Entry::of::<Export>(),
    Entry::of::<Fields>(),
    Entry::of::<Pictures>(),
    Entry::of::<Registration>(),
    Entry::of::<Structures>(),
    Entry::of::<Carry>(),
    Entry::of::<Report>(),
    Entry::of::<ReportObject>(),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NodeId;

    #[test]
    fn the_list_is_in_the_order_of_the_names_and_parents_come_first() {
        assert_eq!(NODES.len(), NodeId::ALL.len());
        for (n, entry) in NODES.iter().enumerate() {
            assert_eq!((entry.id.place(), NodeId::ALL[n]), (n, entry.id));
            assert!(entry.parents.iter().all(|parent| parent.place() < n), "{}", entry.id);
        }
    }

    /// The arrows of the flow, those left out that go the way of others.
    fn drawing() -> String {
        let mut lines = vec!["```mermaid".to_string(), "flowchart TD".into()];
        for entry in NODES {
            let parents = entry.parents.iter();
            let shown = parents.filter(|&&parent| {
                let others = entry.parents.iter().filter(|other| **other != parent);
                !others.copied().any(|other| rests_on(other, parent))
            });
            lines.extend(shown.map(|parent| format!("  {parent} --> {}", entry.id)));
        }
        lines.join("\n") + "\n```\n"
    }

    fn rests_on(node: NodeId, on: NodeId) -> bool {
        let parents = NODES[node.place()].parents;
        parents.iter().any(|&parent| parent == on || rests_on(parent, on))
    }

    #[test]
    fn the_drawing_of_the_architecture_is_the_graph() {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/ARCHITECTURE.md");
        let page = std::fs::read_to_string(page).unwrap();
        assert!(page.contains(&drawing()), "docs/ARCHITECTURE.md must hold:\n{}", drawing());
    }
}
