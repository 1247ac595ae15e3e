//! Results in memory.

use crate::NodeId;
use crate::graph::Output;
use crate::key::Key;
use crate::session::plan::entry;
use std::collections::BTreeMap;
use supine_report::Warning;

/// A result that is held.
#[derive(Clone)]
pub(super) struct Cell {
    pub(super) key: Key,
    pub(super) output: Output,
    pub(super) warnings: Vec<Warning>,
    /// When it was last used, in steps of a counter.
    used: u64,
}

/// The results of a session, one per node.
#[derive(Default)]
pub(super) struct Cells {
    cells: BTreeMap<NodeId, Cell>,
    clock: u64,
}

impl Cells {
    /// The result of a node for a key.
    pub(super) fn get(&mut self, node: NodeId, key: &Key) -> Option<Cell> {
        self.clock += 1;
        let cell = self.cells.get_mut(&node).filter(|cell| cell.key == *key)?;
        cell.used = self.clock;
        Some(cell.clone())
    }

    /// The result of a node, whatever its key.
    pub(super) fn peek(&self, node: NodeId) -> Option<&Cell> {
        self.cells.get(&node)
    }

    pub(super) fn put(&mut self, node: NodeId, key: Key, output: Output, warnings: Vec<Warning>) {
        self.clock += 1;
        self.cells.insert(node, Cell { key, output, warnings, used: self.clock });
    }

    pub(super) fn remove(&mut self, node: NodeId) {
        self.cells.remove(&node);
    }

    pub(super) fn retain(&mut self, stays: impl Fn(NodeId) -> bool) {
        self.cells.retain(|node, _| stays(*node));
    }

    /// Memory of the results, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.cells.iter().map(|(node, cell)| (entry(*node).bytes)(&cell.output)).sum()
    }

    /// Drops results that were used longest ago until the rest fits; what `stays` says stays.
    pub(super) fn fit(&mut self, budget: usize, stays: impl Fn(NodeId) -> bool) {
        while self.bytes() > budget {
            let large = |node: NodeId, cell: &Cell| (entry(node).bytes)(&cell.output) > 0;
            let oldest = self
                .cells
                .iter()
                .filter(|(node, cell)| !stays(**node) && large(**node, cell))
                .min_by_key(|(_, cell)| cell.used)
                .map(|(node, _)| *node);
            match oldest {
                Some(node) => self.remove(node),
                None => return,
            }
        }
    }
}
