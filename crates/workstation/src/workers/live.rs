//! What goes on beside the work that was asked for: labels follow the seeds, the table is tilted
//! live, and the CT is made ready for a brush.

use crate::Error;
use crate::navigation::follow::Following;
use crate::store::previews::Readiness;

use crate::workers::objects;
use crate::workers::reporter::Reporter;
use crate::workers::tilt::{self, Frames, PreviewRequest, TiltWish};
use crate::workspace::Workspace;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use supine_flow::{Freshness, Lane, LiveTilt, NodeId, Request, Session};

/// What is wanted beside the work, the most urgent last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Wish {
    /// The CT made ready, so that labels can follow.
    Prepare,
    /// The table tilted.
    Tilt,
    /// Labels of the seeds that are given now.
    Labels,
}

/// What goes on; of each kind of wish the newest counts.
pub(crate) struct Live {
    pub(crate) workspace: Arc<Workspace>,
    following: Arc<Following>,
    wanted: Mutex<Wanted>,
    /// The preview of the table, kept as long as it is of what is open.
    tilt: Mutex<Option<LiveTilt>>,
}

#[derive(Default)]
struct Wanted {
    tasks: BTreeMap<Wish, Task>,
    /// What is being done, and how to end it.
    doing: Option<(Wish, Arc<AtomicBool>)>,
}

enum Task {
    Prepare(Arc<Session>),
    Tilt(TiltWish),
    Labels(Arc<Session>),
}

impl Wanted {
    /// Ends what is less urgent, and what a newer wish has made pointless.
    fn interrupt(&self, by: Wish) {
        if let Some((doing, stop)) = &self.doing {
            let again = *doing == by && by == Wish::Labels;
            if *doing < by || again {
                stop.store(true, Ordering::SeqCst);
            }
        }
    }
}

impl Live {
    pub(crate) fn new(workspace: Arc<Workspace>, following: Arc<Following>) -> Arc<Self> {
        let (wanted, tilt) = (Mutex::default(), Mutex::default());
        Arc::new(Self { workspace, following, wanted, tilt })
    }

    fn wanted(&self) -> MutexGuard<'_, Wanted> {
        self.wanted.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn kept_tilt(&self) -> MutexGuard<'_, Option<LiveTilt>> {
        self.tilt.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the making ready: other work does the same with more threads.
    pub(crate) fn make_way(&self) {
        self.wanted().interrupt(Wish::Tilt);
    }

    /// Ends all of it.
    pub(crate) fn end(&self) {
        let mut wanted = self.wanted();
        wanted.tasks.clear();
        if let Some((_, stop)) = &wanted.doing {
            stop.store(true, Ordering::SeqCst);
        }
    }

    /// Lets the preview go, with the CT that it holds.
    pub(crate) fn drop_preview(&self) {
        *self.kept_tilt() = None;
    }

    /// Labels that are looked at follow the case, and so do objects that it carries along.
    pub(crate) fn follow_case(self: &Arc<Self>, session: &Arc<Session>) {
        if session.peek_labels().is_some_and(|(_, of)| of == Freshness::Stale) {
            self.workspace.change(|store| store.previews.labels_begin());
            self.want(Wish::Labels, Task::Labels(Arc::clone(session)));
        } else if !session.case().carried.is_empty() && !session.is_fresh(NodeId::Objects) {
            self.prepare(session);
        }
    }

    /// Makes a session's CT ready for labels that follow.
    pub(crate) fn prepare(self: &Arc<Self>, session: &Arc<Session>) {
        self.want(Wish::Prepare, Task::Prepare(Arc::clone(session)));
    }

    /// Tilts the table for a page.
    pub(crate) fn tilt(self: &Arc<Self>, asked: PreviewRequest, to: &Frames) {
        let Ok(session) = self.workspace.look(|store| store.case.session()) else { return };
        self.want(Wish::Tilt, Task::Tilt(TiltWish { session, asked, to: to.clone() }));
    }

    fn want(self: &Arc<Self>, wish: Wish, task: Task) {
        let mut wanted = self.wanted();
        wanted.tasks.insert(wish, task);
        wanted.interrupt(wish);
        if wanted.doing.is_none() {
            wanted.doing = Some((wish, Arc::default()));
            let live = Arc::clone(self);
            std::thread::spawn(move || live.work());
        }
    }

    /// Does what is wanted until nothing is.
    fn work(&self) {
        loop {
            let (wish, task, stop) = {
                let mut wanted = self.wanted();
                let Some((wish, task)) = wanted.tasks.pop_last() else {
                    wanted.doing = None;
                    return;
                };
                let stop = Arc::<AtomicBool>::default();
                wanted.doing = Some((wish, Arc::clone(&stop)));
                (wish, task, stop)
            };
            let report = Reporter::new(Arc::clone(&self.workspace), stop, true);
            // What fails here must not end the following of seeds for ever.
            let work = std::panic::AssertUnwindSafe(|| self.make(&task, &report));
            let done = std::panic::catch_unwind(work).unwrap_or(Err(Error::Broken));
            let labels = (wish == Wish::Labels).then_some(done);
            self.workspace.change(|store| {
                // A newer stroke may be waiting.
                store.previews.end(labels, self.wanted().tasks.contains_key(&Wish::Labels));
            });
        }
    }

    fn make(&self, task: &Task, report: &Reporter) -> Result<(), Error> {
        match task {
            Task::Labels(session) => make_labels(session, report),
            Task::Tilt(wish) => tilt::preview(&mut self.kept_tilt(), wish, &self.following, report),
            Task::Prepare(session) => {
                make_ready(session, report)?;
                // The table comes next.
                if session.is_fresh(NodeId::Region) {
                    tilt::keep(&mut self.kept_tilt(), session, report)?;
                }
                Ok(())
            }
        }
    }
}

fn make_ready(session: &Session, report: &Reporter) -> Result<(), Error> {
    objects::read(session, report, Lane::Live);
    if !session.is_fresh(NodeId::Prepare) {
        make_segmenter(session, report)?;
    }
    if session.is_fresh(NodeId::Segment) && session.peek_surfaces().is_none() {
        let request = Request { observer: report, lane: Lane::Live, ..Request::default() };
        session.surfaces(&request)?;
        report.change(|store| store.show_results(session));
    }
    Ok(())
}

fn make_segmenter(session: &Session, report: &Reporter) -> Result<(), Error> {
    let show = |ready: Readiness| report.change(|store| store.previews.set_segmenter(ready));
    show(Readiness::Preparing);
    let request = Request { observer: report, lane: Lane::Live, ..Request::default() };
    let done = session.update(&[NodeId::Prepare], &request);
    show(match &done {
        Ok(()) => Readiness::Ready,
        Err(supine_flow::Error::Stopped) => Readiness::None,
        Err(_) => Readiness::Failed,
    });
    Ok(done?)
}

/// The labels first, for somebody looks at them; then what is known of their border.
fn make_labels(session: &Session, report: &Reporter) -> Result<(), Error> {
    let request = Request { observer: report, lane: Lane::Live, ..Request::default() };
    session.labels(&request)?;
    report.change(|store| {
        store.previews.labels_made();
        store.show_results(session);
    });
    session.surfaces(&request)?;
    if has_breast(session) {
        session.update(&[NodeId::Region], &request)?;
    }
    report.change(|store| store.show_results(session));
    Ok(())
}

/// Whether side and tumour are known, and so the region.
pub(crate) fn has_breast(session: &Session) -> bool {
    session.case().breast.is_some() && session.tumour_sphere().is_some()
}
