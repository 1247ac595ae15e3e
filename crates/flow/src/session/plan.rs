//! What has to be done: found from keys, what is held and what is kept.

use crate::case_state::CaseState;
use crate::folder::{Record, RunFolder};
use crate::graph::Entry;
use crate::key::Key;
use crate::nodes::NODES;
use crate::{Error, NodeId};
use std::collections::{BTreeMap, BTreeSet};

/// What is done with a node.
#[derive(Clone, Debug)]
pub(super) enum Step {
    /// Its result is held in memory.
    Held,
    /// Its result lies in the folder and nobody needs it now.
    Kept(Record),
    /// Its result is read from the folder.
    Load(Record),
    /// Its result is held in memory and is written to the folder.
    Write,
    /// Its result is made; with a record when it was made before and only its value is not kept.
    Make(Option<Record>),
}

/// All steps that targets need, in an order in which they can be done.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) steps: BTreeMap<NodeId, Step>,
    pub(super) keys: Keys,
}

/// The keys of nodes, as far as they are known: not of those that rest on a node that is known by
/// its value and has none yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Keys {
    known: BTreeMap<NodeId, Key>,
    /// By what those that rest on a node know it: its key, or the hash of its value.
    shown: BTreeMap<NodeId, Key>,
    asked: BTreeMap<NodeId, bool>,
}

/// By what a result is known to those that rest on it, if it is there: for nodes that are known by
/// their value.
pub(super) type Shown<'a> = &'a (dyn Fn(NodeId, &Key) -> Option<Key> + Sync);

/// The hash of a value.
pub(super) fn hash_of_value(facts: &serde_json::Value) -> Option<Key> {
    let text = serde_json::to_vec(facts).ok()?;
    Some(format!("value {}", blake3::hash(&text).to_hex()))
}

pub(super) fn entry(node: NodeId) -> &'static Entry {
    &NODES[node.place()]
}

impl Keys {
    /// Keys of the wanted nodes and all they rest on.
    ///
    /// # Errors
    /// What was not given.
    pub(super) fn of(
        case_state: &CaseState,
        wanted: &BTreeSet<NodeId>,
        shown: Shown<'_>,
    ) -> Result<Self, Error> {
        let mut keys = Self::default();
        for &node in wanted {
            keys.add(case_state, node, shown)?;
        }
        Ok(keys)
    }

    fn add(&mut self, case_state: &CaseState, node: NodeId, shown: Shown<'_>) -> Result<(), Error> {
        let entry = entry(node);
        if let Some(given) = case_state.given.get(&node) {
            self.asked.insert(node, true);
            self.known.insert(node, given.clone());
            self.shown.insert(node, given.clone());
            return Ok(());
        }
        let asked = (entry.asked)(case_state)?;
        self.asked.insert(node, asked);
        let parents: &[NodeId] = if asked { entry.parents } else { &[] };
        let parents: Option<Vec<Key>> =
            parents.iter().map(|p| self.shown.get(p).cloned()).collect();
        let Some(parents) = parents else { return Ok(()) };
        let key = (entry.key)(case_state, &parents)?;
        let by = if entry.by_value { shown(node, &key) } else { Some(key.clone()) };
        by.and_then(|by| self.shown.insert(node, by));
        self.known.insert(node, key);
        Ok(())
    }

    /// The key of a node, if it is known.
    pub(super) fn get(&self, node: NodeId) -> Option<&Key> {
        self.known.get(&node)
    }

    /// By what those that rest on a node know it, if that is known.
    pub(super) fn shown(&self, node: NodeId) -> Option<&Key> {
        self.shown.get(&node)
    }

    /// By what a node knows its parents.
    pub(super) fn shown_parents(&self, case_state: &CaseState, node: NodeId) -> Vec<Key> {
        self.parents(case_state, node).iter().filter_map(|p| self.shown.get(p).cloned()).collect()
    }

    /// The first node that must be made before the keys of all others are known.
    pub(super) fn open(&self, forced: &BTreeSet<NodeId>) -> Option<NodeId> {
        let by_value = self.known.keys().copied().filter(|&node| entry(node).by_value);
        let open = |node: &NodeId| forced.contains(node) || !self.shown.contains_key(node);
        by_value.filter(|node| self.asked[node]).find(open)
    }

    /// The parents whose results a node needs.
    pub(super) fn parents(&self, case_state: &CaseState, node: NodeId) -> &'static [NodeId] {
        let made = !case_state.given.contains_key(&node) && self.asked[&node];
        if made { entry(node).parents } else { &[] }
    }
}

/// The nodes that some targets rest on, themselves included; what is given rests on nothing, and
/// neither does what is not asked for.
pub(super) fn ancestors(
    case_state: &CaseState,
    targets: &[NodeId],
) -> Result<BTreeSet<NodeId>, Error> {
    let mut ancestors = BTreeSet::new();
    let mut open = targets.to_vec();
    while let Some(node) = open.pop() {
        if !ancestors.insert(node) || case_state.given.contains_key(&node) {
            continue;
        }
        if (entry(node).asked)(case_state)? {
            open.extend(entry(node).parents);
        }
    }
    Ok(ancestors)
}

/// The node and all that rest on it.
pub(super) fn descendants(node: NodeId) -> BTreeSet<NodeId> {
    let mut descendants = BTreeSet::from([node]);
    for later in NODES.iter() {
        if later.parents.iter().any(|parent| descendants.contains(parent)) {
            descendants.insert(later.id);
        }
    }
    descendants
}

/// What is there when a plan is made.
pub(super) struct Known<'a> {
    pub(super) folder: Option<&'a RunFolder>,
    /// Made in any case.
    pub(super) forced: &'a BTreeSet<NodeId>,
    /// Whether memory has a node's result for a key.
    pub(super) held: &'a (dyn Fn(NodeId, &Key) -> bool + Sync),
    pub(super) shown: Shown<'a>,
    /// Whose values are needed in memory.
    pub(super) values: BTreeSet<NodeId>,
}

impl Plan {
    /// What the targets need, all of whose keys are known.
    pub(super) fn new(
        case_state: &CaseState,
        targets: &[NodeId],
        known: &Known<'_>,
    ) -> Result<Self, Error> {
        let &Known { folder, forced, held, shown, ref values } = known;
        let wanted = ancestors(case_state, targets)?;
        let keys = Keys::of(case_state, &wanted, shown)?;
        let mut values = values.clone();
        if folder.is_none() {
            // Without a folder a result that nobody holds is no result.
            values.extend(targets);
        }
        let mut steps = BTreeMap::new();
        for &node in wanted.iter().rev() {
            let key = keys.get(node).ok_or(Error::NotKept { node })?;
            let fresh = !forced.contains(&node);
            let record = folder.and_then(|folder| folder.result(node, key)).filter(|_| fresh);
            let given = case_state.given.contains_key(&node);
            let step = match (held(node, key) && fresh, record) {
                (true, record) if given || folder.is_none() || record.is_some() => Step::Held,
                (true, None) if !entry(node).writes => Step::Write,
                (_, Some(record)) if !values.contains(&node) => Step::Kept(record),
                (_, Some(record)) if entry(node).kept => Step::Load(record),
                (_, record) => Step::Make(record),
            };
            if let Step::Make(_) = step {
                values.extend(keys.parents(case_state, node));
            }
            steps.insert(node, step);
        }
        Ok(Self { steps, keys })
    }
}
