//! Changes of the case: each is checked, on disk and told before the next.

use crate::Error;
use crate::desk::{Desk, Held};
use crate::open::{run_command, shown_case};
use crate::roots::name_of;
use serde::Deserialize;
use supine_flow::NodeId;
use supine_flow::spec::Edit;

/// Changes that the page asks for, and the state that it saw.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Edits {
    revision: u64,
    edits: Vec<OneEdit>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OneEdit {
    key: String,
    value: serde_json::Value,
}

/// The state that a page saw when it asked.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Seen {
    revision: u64,
}

/// A file for a new case.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveAs {
    dir: String,
    name: String,
}

/// Which way in the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Back,
    Forth,
}

impl Desk {
    /// Makes changes of the case.
    ///
    /// # Errors
    /// [`Error::Old`] when it was changed since the page looked; when a value does not fit, or the file cannot be written.
    pub(crate) fn edit(&self, asked: Edits) -> Result<(), Error> {
        let edit = |edit: OneEdit| Edit { key: edit.key, value: edit.value };
        let edits: Vec<Edit> = asked.edits.into_iter().map(edit).collect();
        self.change_case(asked.revision, |held| {
            let spec = held.case.as_mut().ok_or(Error::Nothing)?.edit(&edits)?;
            Ok(Some(spec))
        })
    }

    /// Takes a change back, or makes it again.
    ///
    /// # Errors
    /// As [`Self::edit`].
    pub(crate) fn history(&self, seen: Seen, way: Way) -> Result<(), Error> {
        self.change_case(seen.revision, |held| {
            let case = held.case.as_mut().ok_or(Error::Nothing)?;
            Ok(if way == Way::Back { case.undo()? } else { case.redo()? })
        })
    }

    fn change_case(
        &self,
        seen: u64,
        change: impl FnOnce(&mut Held) -> Result<Option<supine_flow::Spec>, Error>,
    ) -> Result<(), Error> {
        self.change(|held| {
            let session = held.session.clone().ok_or(Error::Nothing)?;
            if held.state.revision != seen {
                return Err(Error::Old);
            }
            if let Some(spec) = change(held)? {
                let stale = session.set_all(spec)?;
                held.state.revision += 1;
                // What was written is not of this case any more.
                held.state.result = None;
                held.mark(&stale);
                held.show_results(&session);
            }
            held.show_case();
            Ok(())
        })
    }

    /// Puts a new case into a file.
    ///
    /// # Errors
    /// When the folder was not given out, the name is none, there is such a file, or it cannot be written.
    pub(crate) fn save_as(&self, asked: &SaveAs) -> Result<(), Error> {
        let SaveAs { dir, name } = asked;
        if !name.ends_with(".toml") {
            return Err(Error::Request("a case file's name ends with .toml".into()));
        }
        self.change(|held| {
            let path = held.roots.path_of(dir, name)?;
            held.case.as_mut().ok_or(Error::Nothing)?.save_as(&path)?;
            held.show_case();
            Ok(())
        })
    }
}

impl Held {
    /// Shows the case as it is now, and the command that does the same.
    pub(crate) fn show_case(&mut self) {
        let (Some(case), Some(session)) = (&self.case, &self.session) else { return };
        let region = self.state.case.as_ref().and_then(|case| case.region);
        let mut shown = shown_case(session, case);
        // What was proposed stays on the screen.
        shown.region = shown.region.or(region);
        if let Some(path) = case.path() {
            self.state.command = run_command(&name_of(path));
        }
        self.state.case = Some(shown);
    }

    /// Marks the stages whose results are of what was given before.
    fn mark(&mut self, stale: &[NodeId]) {
        let is_stale = |name: &str| stale.iter().any(|node| node.name() == name);
        for stage in self.state.stages.iter_mut().filter(|stage| stage.state != "running") {
            match (is_stale(stage.name), stage.state) {
                (true, _) => stage.state = "stale",
                (false, "stale") => stage.state = "done",
                _ => {}
            }
        }
    }
}
