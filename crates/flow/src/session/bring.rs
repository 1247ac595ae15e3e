//! Bringing results up to date: in one go, or in two where a node is known by its value.

use super::execute::{Job, Run};
use super::plan::{Keys, Known, Plan, Shown, Step, ancestors, descendants, entry, hash_of_value};
use super::{Lane, Observer, Request, Session, lock};
use crate::case_state::CaseState;
use crate::folder::RunFolder;
use crate::key::Key;
use crate::shared::told;
use crate::{Error, NodeId};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use supine_report::{Link, Warning};

impl Session {
    /// Brings nodes up to date, and gives the results of those in `values`.
    pub(crate) fn bring(
        &self,
        targets: &[NodeId],
        values: &[NodeId],
        request: &Request<'_>,
    ) -> Result<Run, Error> {
        match request.lane {
            Lane::Final => {
                let folder = lock(&self.folder);
                self.bring_into(folder.as_ref(), targets, values, request)
            }
            Lane::Live => {
                let mine = self.newest.fetch_add(1, Ordering::SeqCst) + 1;
                let newest = Newest { lane: &self.newest, mine, observer: request.observer };
                let request = Request { observer: &newest, ..*request };
                self.bring_into(None, targets, values, &request)
            }
        }
    }

    fn bring_into(
        &self,
        folder: Option<&RunFolder>,
        targets: &[NodeId],
        values: &[NodeId],
        request: &Request<'_>,
    ) -> Result<Run, Error> {
        let case_state = self.secured(folder)?;
        let values: BTreeSet<NodeId> = values.iter().copied().collect();
        let mut forced = request.force.map(descendants).unwrap_or_default();
        let mut run = Run::default();
        loop {
            let pool = self.pool_of(request.lane);
            let open = pool.install(|| {
                let wanted = ancestors(&case_state, targets)?;
                let shown = |node, key: &Key| self.shown(folder, node, key);
                Ok::<_, Error>(Keys::of(&case_state, &wanted, &shown)?.open(&forced))
            })?;
            let pass = Pass {
                case_state: &case_state,
                folder,
                pool,
                targets: first_targets(targets, open),
                values: values.clone(),
                forced: &forced,
                open,
                quiet: run.done.keys().copied().collect(),
            };
            let now = self.pass(&pass, request)?;
            forced.retain(|node| !now.done.contains_key(node));
            for (node, done) in now.done {
                run.done.entry(node).or_insert(done);
            }
            run.outputs = now.outputs;
            if open.is_none() {
                break;
            }
        }
        let stays = |node: NodeId| case_state.given.contains_key(&node) || values.contains(&node);
        lock(&self.cells).fit(self.budget, stays);
        Ok(run)
    }

    fn pass(&self, pass: &Pass<'_>, request: &Request<'_>) -> Result<Run, Error> {
        let Pass { case_state, folder, pool, forced, .. } = *pass;
        let held = |node, key: &Key| lock(&self.cells).get(node, key).is_some();
        let shown = |node, key: &Key| self.shown(folder, node, key);
        let known = Known { folder, forced, held: &held, shown: &shown, values: pass.values() };
        let plan = pool.install(|| Plan::new(case_state, &pass.targets, &known))?;
        if let Some(folder) = folder {
            self.refuse_overlap(folder.root())?;
            folder.renew()?;
            let gone = stale(case_state, folder, &plan, &shown);
            folder.retire(&gone)?;
            for node in gone {
                let aside = folder.clear(node)?;
                tell_aside(node, &aside, case_state.case.export.anonymise, request.observer);
            }
        }
        let job = Job {
            case_state,
            plan: &plan,
            folder,
            cells: &self.cells,
            pool,
            observer: request.observer,
            // The second pass may need what the first one has.
            drops: request.drops && pass.open.is_none(),
            stays: known
                .values
                .iter()
                .chain(case_state.given.keys())
                .chain(&self.holds)
                .copied()
                .collect(),
            clock: self.start.as_ref().map(|start| &start.clock),
            meter: self.meter,
            quiet: pass.quiet.clone(),
            failed: AtomicBool::new(false),
        };
        self.meter.within(|| job.run())
    }

    /// By what a result is known to those that rest on it, for nodes that are known by their value:
    /// if it is there.
    pub(super) fn shown(&self, folder: Option<&RunFolder>, node: NodeId, key: &Key) -> Option<Key> {
        if let Some(cell) = lock(&self.cells).get(node, key) {
            return hash_of_value(&(entry(node).facts)(&cell.output).ok()?);
        }
        hash_of_value(&folder?.result(node, key)?.facts)
    }

    /// What was given, with the secret of the folder, where the case takes the patient out.
    fn secured(&self, folder: Option<&RunFolder>) -> Result<Arc<CaseState>, Error> {
        let case_state = self.case_state();
        if !case_state.case.export.anonymise || case_state.secret.is_some() {
            return Ok(case_state);
        }
        let secret = match folder {
            Some(folder) => folder.secret()?,
            None => crate::shared::random()?,
        };
        self.change(|case_state| {
            case_state.secret.get_or_insert(secret);
        });
        Ok(self.case_state())
    }

    /// The keys of results and of what they were made from, in the order of the nodes.
    pub(crate) fn chain(&self, targets: &[NodeId]) -> Result<Vec<Link>, Error> {
        let case_state = self.case_state();
        let wanted = ancestors(&case_state, targets)?;
        let folder = lock(&self.folder);
        let shown = |node, key: &Key| self.shown(folder.as_ref(), node, key);
        let keys = Keys::of(&case_state, &wanted, &shown)?;
        let link = |&node: &NodeId| {
            let key = keys.get(node)?.clone();
            let value = keys.shown(node).filter(|shown| **shown != key).cloned();
            let parents = keys.shown_parents(&case_state, node);
            Some(Link { stage: node.name().into(), key, value, parents })
        };
        Ok(wanted.iter().filter_map(link).collect())
    }
}

/// What is done in one go.
struct Pass<'a> {
    case_state: &'a CaseState,
    folder: Option<&'a RunFolder>,
    pool: &'a rayon::ThreadPool,
    targets: Vec<NodeId>,
    values: BTreeSet<NodeId>,
    forced: &'a BTreeSet<NodeId>,
    /// The node whose value must be known before the rest can be planned.
    open: Option<NodeId>,
    /// Done in a pass before.
    quiet: BTreeSet<NodeId>,
}

impl Pass<'_> {
    /// Whose results must be in memory after it.
    fn values(&self) -> BTreeSet<NodeId> {
        let wanted = |node: &NodeId| self.open.is_none() || self.targets.contains(node);
        self.values.iter().copied().filter(wanted).collect()
    }
}

/// The targets that can be planned while the value of a node is open: that node, and those that do
/// not rest on it.
fn first_targets(targets: &[NodeId], open: Option<NodeId>) -> Vec<NodeId> {
    let Some(open) = open else { return targets.to_vec() };
    let later = descendants(open);
    let now = targets.iter().copied().filter(|node| !later.contains(node));
    now.chain([open]).collect()
}

/// The nodes of which the folder holds what will go: those that are made anew, and all that the
/// case no longer leads to.
fn stale(
    case_state: &CaseState,
    folder: &RunFolder,
    plan: &Plan,
    shown: Shown<'_>,
) -> BTreeSet<NodeId> {
    let is_stale = |node: &NodeId| match plan.steps.get(node) {
        Some(Step::Make(None) | Step::Write) => true,
        Some(_) => false,
        None => {
            let keys = ancestors(case_state, &[*node])
                .and_then(|wanted| Keys::of(case_state, &wanted, shown));
            match keys.as_ref().map(|keys| keys.get(*node)) {
                Ok(Some(key)) => folder.result(*node, key).is_none(),
                Ok(None) => rests_on_made(*node, plan),
                Err(_) => false,
            }
        }
    };
    NodeId::ALL.into_iter().filter(is_stale).collect()
}

/// Says where something is now that this program did not write, or that was changed since.
fn tell_aside(
    node: NodeId,
    moved: &[std::path::PathBuf],
    anonymise: bool,
    observer: &dyn Observer,
) {
    for path in moved {
        let leave = "; they may name the patient, and leave this folder for that of the re-identification when the run is finished";
        let text = format!(
            "files that this program did not write, or that were changed since, lay where results are written: they are in {} \
             now{}",
            path.display(),
            if anonymise { leave } else { "" }
        );
        observer.warning(node, &told(node, &supine_space::Warning::new("set-aside", text), false));
    }
}

/// Whether a node whose key is not known yet rests on one that is made anew, by more than its
/// value.
fn rests_on_made(node: NodeId, plan: &Plan) -> bool {
    let by_key = entry(node).parents.iter().copied().filter(|&parent| !entry(parent).by_value);
    by_key.into_iter().any(|parent| {
        matches!(plan.steps.get(&parent), Some(Step::Make(None))) || rests_on_made(parent, plan)
    })
}

/// Ends work of the live lane that a newer question has made pointless.
struct Newest<'a> {
    lane: &'a AtomicU64,
    mine: u64,
    observer: &'a dyn Observer,
}

impl Observer for Newest<'_> {
    fn begin(&self, node: NodeId) {
        self.observer.begin(node);
    }

    fn share(&self, node: NodeId, share: f64) {
        self.observer.share(node, share);
    }

    fn found(&self, node: NodeId, text: &str) {
        self.observer.found(node, text);
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        self.observer.warning(node, warning);
    }

    fn end(&self, node: NodeId, seconds: f64, cached: bool) {
        self.observer.end(node, seconds, cached);
    }

    fn go_on(&self) -> bool {
        self.lane.load(Ordering::SeqCst) == self.mine && self.observer.go_on()
    }
}
