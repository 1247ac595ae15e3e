//! The file of the case, which another program may change while the page is open.

use crate::store::Store;
use crate::workers::live::Live;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use supine_flow::CaseFile;

/// How often the file is looked at.
const OFTEN: Duration = Duration::from_secs(1);

/// Looks at the file of the case from now on, as long as there is a page.
pub(crate) fn watch(live: &Arc<Live>) {
    let live = Arc::downgrade(live);
    std::thread::spawn(move || {
        while let Some(live) = live.upgrade() {
            look(&live);
            drop(live);
            std::thread::sleep(OFTEN);
        }
    });
}

/// Takes over what another program wrote.
fn look(live: &Arc<Live>) {
    let path = |store: &Store| store.case.file().and_then(CaseFile::path).map(PathBuf::from);
    // A slow disk is waited for while nobody else waits.
    let path = live.workspace.look(path);
    let Some(text) = path.and_then(|path| std::fs::read_to_string(path).ok()) else { return };
    let is_news =
        live.workspace.look(|store| store.case.text() != Some(&text) || store.case.is_astray());
    if is_news {
        let session = live.workspace.change(|store| {
            let session = store.case.session().ok()?;
            store.take_over().then_some(session)
        });
        session.iter().for_each(|session| live.follow_case(session));
    }
}
