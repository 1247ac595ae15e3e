//! The graph of nodes: what each may see, what it makes, and by which key a result is known.
//!
//! A node is one file in `nodes`. Its key is a hash of its own values, of its parents' keys and of
//! the version of its method; nothing else decides what must be made again.

use crate::case_state::CaseState;
use crate::key::Key;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::any::Any;
use std::sync::Arc;

/// A node's result, whatever its type.
pub(crate) type Output = Arc<dyn Any + Send + Sync>;

/// One stage of the flow.
pub(crate) trait Node: 'static {
    /// Which node it is.
    const ID: NodeId;
    /// Version of its method: to be raised when the same inputs give other bytes. A test holds it
    /// to the bytes on the fixture.
    const METHOD: u32;
    /// Whether its result can be had back from the run's folder; else it is made again when it is
    /// needed.
    const KEPT: bool;
    /// Whether it writes its files while it runs, so that it cannot be without a folder.
    const WRITES: bool = false;
    /// Whether the nodes that rest on it know it by what it made (its facts) and not by what it was
    /// made from: another tumour that leaves the sphere as it is leaves the mesh as it is. What it
    /// makes must lie in its facts.
    const BY_VALUE: bool = false;
    /// All of the case and its files that it may see.
    type NodeInputs: Serialize;
    /// The nodes whose results it may see.
    type Parents: Parents;
    /// What it makes.
    type Out: Send + Sync + 'static;

    /// What it may see of the case.
    fn inputs(case_state: &CaseState) -> Result<Self::NodeInputs, Error>;

    /// The result when the case does not ask for the node; its parents then count for nothing.
    fn not_asked(_inputs: &Self::NodeInputs) -> Option<Self::Out> {
        None
    }

    /// Makes the result.
    fn run(
        inputs: &Self::NodeInputs,
        parents: Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Self::Out, Error>;

    /// Writes what is kept of the result.
    fn save(_out: &Self::Out, _work: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }

    /// The part of the result that the node's record holds.
    fn facts(_out: &Self::Out) -> Result<serde_json::Value, Error> {
        Ok(serde_json::Value::Null)
    }

    /// Reads back what [`Node::save`] wrote; only called where [`Node::KEPT`] says so.
    fn load(_facts: serde_json::Value, _work: &Work<'_>) -> Result<Self::Out, Error> {
        Err(Error::NotKept { node: Self::ID })
    }

    /// Memory that the result holds, bytes; what does not count is small.
    fn bytes(_out: &Self::Out) -> usize {
        0
    }
}

/// What a node sees of its parents.
pub(crate) type Outs<N> = <<N as Node>::Parents as Parents>::Outs;

/// The parents of a node, as a tuple of nodes.
pub(crate) trait Parents {
    /// Their results.
    type Outs;
    /// Which they are.
    const IDS: &'static [NodeId];
    /// Their results by type, from those in the order of [`Parents::IDS`].
    fn outs(outputs: &[Output]) -> Self::Outs;
}

/// A result by its node's type.
pub(crate) fn typed<N: Node>(output: &Output) -> Arc<N::Out> {
    let downcast = Arc::clone(output).downcast::<N::Out>();
    downcast.unwrap_or_else(|_| unreachable!("the result of {} has the type of its node", N::ID))
}

macro_rules! parents {
    ($($name:ident $n:tt),*) => {
        impl<$($name: Node),*> Parents for ($($name,)*) {
            type Outs = ($(Arc<$name::Out>,)*);
            const IDS: &'static [NodeId] = &[$($name::ID),*];
            fn outs(outputs: &[Output]) -> Self::Outs {
                ($(typed::<$name>(&outputs[$n]),)*)
            }
        }
    };
}
impl Parents for () {
    type Outs = ();
    const IDS: &'static [NodeId] = &[];
    fn outs(_: &[Output]) -> Self::Outs {}
}
parents!(A 0);
parents!(A 0, B 1);
parents!(A 0, B 1, C 2);
parents!(A 0, B 1, C 2, D 3);
parents!(A 0, B 1, C 2, D 3, E 4);
parents!(A 0, B 1, C 2, D 3, E 4, F 5);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11, M 12);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11, M 12, N 13);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11, M 12, N 13, O 14);
parents!(A 0, B 1, C 2, D 3, E 4, F 5, G 6, H 7, I 8, J 9, K 10, L 11, M 12, N 13, O 14, P 15);

/// A node whatever its types.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) id: NodeId,
    pub(crate) method: u32,
    pub(crate) kept: bool,
    pub(crate) writes: bool,
    pub(crate) by_value: bool,
    pub(crate) parents: &'static [NodeId],
    pub(crate) key: fn(&CaseState, &[Key]) -> Result<Key, Error>,
    pub(crate) asked: fn(&CaseState) -> Result<bool, Error>,
    pub(crate) run: fn(&CaseState, &[Output], &Work<'_>) -> Result<Output, Error>,
    pub(crate) save: fn(&Output, &Work<'_>) -> Result<(), Error>,
    pub(crate) facts: fn(&Output) -> Result<serde_json::Value, Error>,
    pub(crate) load: fn(serde_json::Value, &Work<'_>) -> Result<Output, Error>,
    pub(crate) bytes: fn(&Output) -> usize,
}

impl Entry {
    /// The entry of a node.
    pub(crate) const fn of<N: Node>() -> Self {
        Self {
            id: N::ID,
            method: N::METHOD,
            kept: N::KEPT,
            writes: N::WRITES,
            by_value: N::BY_VALUE,
            parents: N::Parents::IDS,
            key: key::<N>,
            asked: |case_state| Ok(N::not_asked(&N::inputs(case_state)?).is_none()),
            run: run::<N>,
            save: |out, work| N::save(&typed::<N>(out), work),
            facts: |out| N::facts(&typed::<N>(out)),
            load: |facts, work| Ok(Arc::new(N::load(facts, work)?)),
            bytes: |out| N::bytes(&typed::<N>(out)),
        }
    }
}

/// hash(name, version of the method, own values, keys of the parents); of a node that is not asked
/// for, its name and own values alone.
fn key<N: Node>(case_state: &CaseState, parents: &[Key]) -> Result<Key, Error> {
    let inputs = N::inputs(case_state)?;
    let mut hasher = blake3::Hasher::new();
    let mut add = |part: &[u8]| {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
    };
    add(N::ID.name().as_bytes());
    add(&N::METHOD.to_le_bytes());
    add(&serde_json::to_vec(&inputs)?);
    if N::not_asked(&inputs).is_none() {
        parents.iter().for_each(|parent| add(parent.as_bytes()));
    }
    Ok(hasher.finalize().to_hex().to_string())
}

fn run<N: Node>(
    case_state: &CaseState,
    parents: &[Output],
    work: &Work<'_>,
) -> Result<Output, Error> {
    let inputs = N::inputs(case_state)?;
    if let Some(out) = N::not_asked(&inputs) {
        return Ok(Arc::new(out));
    }
    work.progress.at(0.0)?;
    Ok(Arc::new(N::run(&inputs, N::Parents::outs(parents), work)?))
}
