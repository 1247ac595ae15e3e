//! What the page is told: one object, whole, after each change, made of what the store holds.

use crate::store::Store;
use crate::store::adjacent::Adjacent;
use crate::store::archives::Archives;
use crate::store::case::OpenCase;
use crate::store::display::DisplayShown;
use crate::store::folder::Folder;
use crate::store::plan::Plan;
use crate::store::previews::Previews;
use crate::store::results::Results;
use crate::store::unsaved::Unsaved;
use crate::store::work::Work;
use serde::Serialize;

/// All that the page shows, but the voxels: of each owner what it does not keep to itself.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct State<'a> {
    version: &'static str,
    #[serde(flatten)]
    folder: &'a Folder,
    #[serde(flatten)]
    unsaved: &'a Unsaved,
    #[serde(flatten)]
    case: &'a OpenCase,
    #[serde(flatten)]
    adjacent: &'a Adjacent,
    #[serde(flatten)]
    work: &'a Work,
    #[serde(flatten)]
    previews: &'a Previews,
    #[serde(flatten)]
    display: DisplayShown<'a>,
    #[serde(flatten)]
    plan: &'a Plan,
    #[serde(flatten)]
    results: &'a Results,
    #[serde(flatten)]
    archives: &'a Archives,
}

impl<'a> From<&'a Store> for State<'a> {
    fn from(store: &'a Store) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            folder: &store.folder,
            unsaved: &store.unsaved,
            case: &store.case,
            adjacent: &store.adjacent,
            work: &store.work,
            previews: &store.previews,
            display: store.display.shown(),
            plan: &store.plan,
            results: &store.results,
            archives: &store.archives,
        }
    }
}

#[cfg(test)]
#[path = "state_types.rs"]
mod types;
