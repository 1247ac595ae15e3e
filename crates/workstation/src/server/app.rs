//! What all routes of the server see.

use crate::workspace::Workspace;
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

/// What all routes see.
#[derive(Clone)]
pub(crate) struct App {
    pub(crate) workspace: Arc<Workspace>,
    pub(crate) token: Arc<str>,
    /// Sockets that are open.
    pub(crate) links: Arc<AtomicUsize>,
}
