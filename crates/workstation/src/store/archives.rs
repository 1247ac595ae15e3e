//! Archives, and what became of what was sent to them.

use serde::Serialize;
use supine_dicom_network::Node;

/// Archives, as the page is told.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Archives {
    /// Those that were named at the start.
    nodes: Vec<NodeShown>,
    sent: Option<SentShown>,
}

#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct NodeShown {
    id: String,
    name: String,
    /// `AET@HOST:PORT`.
    address: String,
}

/// What became of what was sent.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct SentShown {
    pub(crate) to: String,
    pub(crate) text: String,
    pub(crate) ok: bool,
}

impl Archives {
    pub(crate) fn name(&mut self, nodes: &[Node]) {
        let shown = nodes.iter().enumerate().map(|(n, node)| {
            let (address, id) = (node.to_string(), n.to_string());
            let name = address.split('@').next().unwrap_or_default().to_owned();
            NodeShown { id, name, address }
        });
        self.nodes = shown.collect();
    }

    /// Sending has begun or ended; nothing while it goes on, or of another case.
    pub(crate) fn set_sent(&mut self, sent: Option<SentShown>) {
        self.sent = sent;
    }
}
