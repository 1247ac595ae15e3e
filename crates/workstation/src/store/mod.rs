//! What is open, as plain data. Each owner below has its own fields and is changed by its own
//! methods; what concerns several of them goes by the methods of [`Store`]. The store starts
//! nothing and waits for nothing but the disk.

pub(crate) mod adjacent;
pub(crate) mod archives;
pub(crate) mod case;
pub(crate) mod display;
pub(crate) mod folder;
pub(crate) mod plan;
pub(crate) mod previews;
pub(crate) mod results;
pub(crate) mod state;
pub(crate) mod unsaved;
pub(crate) mod work;

use crate::Error;
use crate::names::rerun_command;
use crate::roots::{Listing, Roots};
use adjacent::{Adjacent, AdjacentObject};
use archives::Archives;
use case::{Change, OnDisk, OpenCase};
use display::Display;
use folder::Folder;
use plan::Plan;
use previews::{Previews, Readiness};
use results::Results;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_flow::commands::dicom::Inspection;
use supine_flow::{CaseFile, NodeId, Session, Spec, Summary, Warning};
use supine_volume::Ct;
use unsaved::{Draft, Unsaved};
use work::Work;

/// What is open.
pub(crate) struct Store {
    /// What may be seen.
    pub(crate) roots: Roots,
    pub(crate) folder: Folder,
    pub(crate) unsaved: Unsaved,
    pub(crate) case: OpenCase,
    pub(crate) adjacent: Adjacent,
    pub(crate) work: Work,
    pub(crate) previews: Previews,
    pub(crate) display: Display,
    pub(crate) results: Results,
    plan: Plan,
    pub(crate) archives: Archives,
}

impl Store {
    pub(crate) fn new(roots: Roots) -> Self {
        let mut case = OpenCase::default();
        case.set_command("supine open".into());
        Self {
            roots,
            folder: Folder::default(),
            unsaved: Unsaved::default(),
            case,
            adjacent: Adjacent::default(),
            work: Work::default(),
            previews: Previews::default(),
            display: Display::default(),
            results: Results::default(),
            plan: Plan::default(),
            archives: Archives::default(),
        }
    }

    /// Keeps what no file holds in a folder from now on, and offers what is there.
    pub(crate) fn keep_unsaved(&mut self, dir: Option<PathBuf>) {
        self.unsaved.keep_in(dir, &self.roots);
    }

    /// What a folder holds.
    ///
    /// # Errors
    /// When it does not lie below the root, or cannot be read.
    pub(crate) fn list(&mut self, dir: &str) -> Result<Listing, Error> {
        self.unsaved.refresh(&self.roots);
        self.roots.list(dir)
    }

    /// A folder was looked through.
    pub(crate) fn inspected(&mut self, path: &Path, found: &Inspection) {
        self.folder.inspected(self.roots.name(path), found);
    }

    /// Throws away what was kept of a case.
    ///
    /// # Errors
    /// When it is not offered.
    pub(crate) fn discard(&mut self, id: &str) -> Result<(), Error> {
        self.unsaved.take(id)?.1.end();
        self.unsaved.refresh(&self.roots);
        Ok(())
    }

    /// The CT of a case is being read: what was open before is closed.
    pub(crate) fn reading(
        &mut self,
        session: &Session,
        file: &CaseFile,
        draft: Option<Draft>,
        command: String,
    ) {
        self.case.begin(session, file, draft, command);
        self.work.clear(&session.case());
        self.display.clear();
        self.archives.set_sent(None);
        (self.adjacent, self.previews) = (Adjacent::default(), Previews::default());
        (self.results, self.plan) = (Results::default(), Plan::default());
        self.unsaved.refresh(&self.roots);
    }

    /// It was read; `adjacent` lies beside it.
    pub(crate) fn opened(
        &mut self,
        session: &Arc<Session>,
        file: CaseFile,
        ct: &Arc<Ct>,
        adjacent: Vec<AdjacentObject>,
    ) {
        self.display.show_ct(ct);
        self.case.opened(session, file);
        self.show_results(session);
        self.adjacent.found(adjacent);
        self.adjacent.follow(session);
    }

    /// The work that was asked for has ended; the session that is open then.
    pub(crate) fn end(&mut self, done: Result<(), Error>) -> Option<Arc<Session>> {
        if self.case.give_up() {
            self.unsaved.refresh(&self.roots);
        }
        let failed = self.work.end(done);
        let session = self.case.session().ok()?;
        // What was there before work that was given up is there still.
        if !failed {
            self.mark(&session);
        }
        (!self.work.is_closed()).then_some(session)
    }

    /// Shows what the session holds.
    pub(crate) fn show_results(&mut self, session: &Session) {
        if session.is_fresh(NodeId::Prepare) {
            self.previews.set_segmenter(Readiness::Ready);
        }
        self.plan.read(session);
        self.display.read(session, &self.plan);
        self.results.read(session);
        self.previews.compare(session);
        self.case.show_spheres(session);
    }

    /// Shows what a run left; `case`: what it is of, where that was not changed since.
    pub(crate) fn show_run(&mut self, path: &Path, case: Option<String>, summary: &Summary) {
        self.results.show_run(path, case, summary);
        let is_saved = self.case.file().is_some_and(|file| file.path().is_some());
        if !is_saved && summary.run.case_folder.is_some() {
            self.case.set_command(rerun_command(path));
        }
        self.show_ticks();
    }

    /// A stage warns of something.
    pub(crate) fn warn(&mut self, node: NodeId, warning: &Warning) {
        if self.work.warn(node, warning) {
            self.show_ticks();
        }
    }

    /// Changes the case; `seen`: the revision that the user saw. First whether it is another one
    /// since, which what another program wrote into its file can make it too.
    ///
    /// # Errors
    /// [`Error::Old`] when it was changed since; when a value does not fit, or the file cannot be
    /// written.
    pub(crate) fn change_case(&mut self, seen: u64, change: Change) -> (bool, Result<(), Error>) {
        // What another program wrote meanwhile is seen first.
        let taken_over = self.take_over();
        let done = if self.case.revision() == seen { self.make(change) } else { Err(Error::Old) };
        (taken_over || done.is_ok(), done)
    }

    fn make(&mut self, change: Change) -> Result<(), Error> {
        if let Some(spec) = self.case.change(change)? {
            self.use_spec(spec)?;
        }
        self.show_case();
        Ok(())
    }

    /// Takes over what another program wrote into the file of the case; whether the case is another
    /// one since.
    pub(crate) fn take_over(&mut self) -> bool {
        match self.case.on_disk() {
            OnDisk::Same => {
                if self.case.set_astray(None)
                    && let Ok(session) = self.case.session()
                {
                    self.mark(&session);
                }
                false
            }
            OnDisk::Other(spec) => {
                let taken = self.use_spec(*spec).is_ok();
                self.show_case();
                taken
            }
            OnDisk::Unusable(why) => {
                // Nothing that is shown but the CT is known to be of what the file says.
                self.display.mark_all_old();
                self.work.mark_all_old();
                self.results.mark_all_old();
                self.plan.mark_all_old();
                self.case.set_astray(Some(why));
                false
            }
        }
    }

    /// The case says something else now: what is of the case before is marked.
    fn use_spec(&mut self, spec: Spec) -> Result<(), Error> {
        self.case.use_spec(spec, self.unsaved.dir())?;
        self.previews.try_again();
        let session = self.case.session()?;
        self.mark(&session);
        Ok(())
    }

    /// Marks what is shown as of the case, or of the case before.
    fn mark(&mut self, session: &Session) {
        // A run keeps what it has written in its folder alone.
        let is_old_run = self.results.mark_run(self.case.text());
        let is_old =
            |node: &NodeId| session.is_stale(*node) || (is_old_run && !session.is_fresh(*node));
        let old: Vec<NodeId> = NodeId::ALL.into_iter().filter(is_old).collect();
        self.work.mark(&old, session);
        self.show_results(session);
    }

    /// Puts a new case into a file.
    ///
    /// # Errors
    /// When the folder was not given out, the name is none, there is such a file, or it cannot be
    /// written.
    pub(crate) fn save_as(&mut self, dir: &str, name: &str) -> Result<(), Error> {
        let path = self.roots.path_of(dir, name)?;
        self.case.save_as(&path)?;
        self.show_case();
        Ok(())
    }

    fn show_case(&mut self) {
        self.case.refresh();
        if let Ok(session) = self.case.session() {
            self.adjacent.follow(&session);
        }
        self.show_ticks();
    }

    /// Shows which warnings are ticked.
    fn show_ticks(&mut self) {
        if let Ok(session) = self.case.session() {
            self.work.show_ticks(&session);
        }
    }
}
