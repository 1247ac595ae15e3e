//! The file of the case, which another program may change while the page is open.

use crate::Error;
use crate::workspace::{OpenCase, Workspace};
use std::path::PathBuf;
use std::sync::{Arc, Weak};
use std::time::Duration;
use supine_flow::{CaseFile, Session, Spec};

/// How often the file is looked at.
const OFTEN: Duration = Duration::from_secs(1);

/// Keys that name the CT: with another one all is another case, perhaps another patient's.
const CT: [&str; 2] = ["ct", "series"];

/// What the file says, compared with what is open.
enum Said {
    Same,
    Other(Box<Spec>),
    /// Nothing that could be taken over, and why.
    Unusable(String),
}

impl Workspace {
    /// Looks at the file of the case from now on, until the workspace is gone.
    pub(crate) fn look_at_the_file(self: &Arc<Self>) {
        let workspace = Arc::downgrade(self);
        std::thread::spawn(move || {
            while let Some(()) = look(&workspace) {
                std::thread::sleep(OFTEN);
            }
        });
    }
}

/// Takes over what another program wrote; nothing once the workspace is gone.
fn look(workspace: &Weak<Workspace>) -> Option<()> {
    let workspace = workspace.upgrade()?;
    let (path, astray) = {
        let held = workspace.held();
        let case = held.state.case.as_ref();
        let astray = case.is_some_and(|case| case.astray.is_some());
        (held.case.as_ref().and_then(CaseFile::path).map(PathBuf::from), astray)
    };
    // A slow disk is waited for while nobody else waits.
    let text = path.and_then(|path| std::fs::read_to_string(path).ok());
    let differs = |held: &OpenCase| held.case.as_ref().map(CaseFile::text) != text.as_deref();
    if text.is_some() && (differs(&workspace.held()) || astray) {
        let session = workspace.change(|held| {
            let session = held.session.clone()?;
            held.take_over(&session).then_some(session)
        });
        session.iter().for_each(|session| workspace.follow_case(session));
    }
    Some(())
}

impl OpenCase {
    /// Takes over what another program wrote into the file of the case; whether the case is another
    /// one since.
    pub(crate) fn take_over(&mut self, session: &Arc<Session>) -> bool {
        match self.said(session) {
            Said::Same => {
                let was_astray =
                    self.state.case.as_mut().is_some_and(|case| case.astray.take().is_some());
                if was_astray {
                    self.mark_as(session);
                }
                false
            }
            Said::Other(spec) => {
                self.edited.clear();
                let taken = self.use_spec(session, *spec).is_ok();
                self.show_case();
                taken
            }
            Said::Unusable(why) => {
                self.mark_all_old();
                if let Some(case) = &mut self.state.case {
                    case.astray = Some(why);
                }
                false
            }
        }
    }

    fn said(&mut self, session: &Session) -> Said {
        let Some(case) = &mut self.case else { return Said::Same };
        let Some(path) = case.path() else { return Said::Same };
        let there =
            CaseFile::open(path).and_then(|there| Ok((there.text() == case.text(), there.spec()?)));
        let names_another = |spec: &Spec| {
            let given = session.spec();
            CT.iter().any(|key| given.get(key) != spec.get(key))
        };
        match there {
            Ok((true, _)) => Said::Same,
            Ok((false, spec)) if names_another(&spec) => {
                Said::Unusable("It names another CT now.".into())
            }
            Ok(_) => match case.reread() {
                Ok(Some(spec)) => Said::Other(Box::new(spec)),
                Ok(None) => Said::Same,
                Err(error) => Said::Unusable(Error::from(error).to_string()),
            },
            Err(error) => Said::Unusable(Error::from(error).to_string()),
        }
    }
}
