//! What all routes of the server see.

use crate::navigation::follow::Following;
use crate::workers::jobs::Jobs;
use crate::workers::live::Live;
use crate::workers::open::Opener;
use crate::workspace::Workspace;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

/// What all routes see.
#[derive(Clone)]
pub(crate) struct App {
    pub(crate) workspace: Arc<Workspace>,
    pub(crate) live: Arc<Live>,
    pub(crate) jobs: Arc<Jobs>,
    pub(crate) opener: Arc<Opener>,
    pub(crate) following: Arc<Following>,
    pub(crate) token: Arc<str>,
    /// Sockets that are open.
    pub(crate) links: Arc<AtomicUsize>,
}
