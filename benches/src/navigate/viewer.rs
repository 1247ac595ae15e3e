//! A peer that is streamed the image.

use crate::tracker::{connect, next, send};
use crate::turnaround::Turnaround;
use anyhow::{Result, ensure};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use supine_openigtlink::{Content, Message, Query, Stamp, Start, Verb};

/// Receives images in a thread of its own until it is told to end.
pub(crate) struct Viewer {
    stream: TcpStream,
    receiving: JoinHandle<Result<Vec<(Instant, u64)>>>,
}

impl Viewer {
    /// Connects and asks for all images.
    pub(crate) fn start(to: SocketAddr) -> Result<Self> {
        let mut stream = connect(to)?;
        let mut images = stream.try_clone()?;
        let ask = Query::new(Verb::Start(Start::Plain), "IMAGE");
        send(&mut stream, &Message::new("", Stamp::NONE, Content::Query(ask)))?;
        let receiving = std::thread::spawn(move || {
            let mut came = vec![];
            while let Some(message) = next(&mut images)? {
                if matches!(message.content, Content::Image(_)) {
                    came.push((Instant::now(), message.stamp.0));
                }
            }
            Ok(came)
        });
        Ok(Self { stream, receiving })
    }

    /// Ends, and gives when images were complete and of which pose each was.
    pub(crate) fn end(self) -> Result<Vec<(Instant, u64)>> {
        // The receiver ends with the connection; the session may have closed it already.
        let _ = self.stream.shutdown(Shutdown::Both);
        let came = self.receiving.join();
        ensure!(came.is_ok(), "the viewer ended early");
        came.unwrap_or_else(|_| Ok(vec![]))
    }
}

/// Images a second between the first and the last, and how long each took from its pose being sent,
/// ms.
pub(crate) fn told(came: &[(Instant, u64)], turnaround: &Turnaround) -> (f64, Vec<f64>) {
    let span = match (came.first(), came.last()) {
        (Some((first, _)), Some((last, _))) => last.duration_since(*first),
        _ => Duration::ZERO,
    };
    let rate = came.len().saturating_sub(1) as f64 / span.as_secs_f64().max(1e-9);
    let took = |(at, stamp): &(Instant, u64)| {
        Some(at.duration_since(turnaround.sent(*stamp)?).as_secs_f64() * 1e3)
    };
    (rate, came.iter().filter_map(took).collect())
}
