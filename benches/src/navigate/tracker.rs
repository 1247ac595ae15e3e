//! What sends the poses in time and reads the answers.

use crate::turnaround::Turnaround;
use anyhow::{Result, ensure};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::{Duration, Instant};
use supine_navigate::trajectory::{Expect, Row, Trajectory};
use supine_openigtlink::{Content, HEADER_BYTES, Header, Message, Rows, Stamp};

/// When the motion begins, s since 1970: stamps are of the tracker's clock, which need not be ours.
const EPOCH_S: u32 = 1_700_000_000;
/// After the last pose answers are waited for so long.
const REST: Duration = Duration::from_millis(500);

/// A connection of a peer.
pub(crate) fn connect(to: SocketAddr) -> Result<TcpStream> {
    let stream = TcpStream::connect(to)?;
    stream.set_nodelay(true)?;
    Ok(stream)
}

/// The next message, with when it was complete; nothing when the other side has closed.
pub(crate) fn next(stream: &mut TcpStream) -> Result<Option<Message>> {
    let mut head = [0; HEADER_BYTES];
    if stream.read_exact(&mut head).is_err() {
        return Ok(None);
    }
    let header = Header::read(&head)?;
    let mut body = vec![0; usize::try_from(header.body)?];
    if stream.read_exact(&mut body).is_err() {
        return Ok(None);
    }
    Ok(Some(Message::read(&header, &body)?))
}

/// Sends a message in one write.
pub(crate) fn send(stream: &mut TcpStream, message: &Message) -> Result<()> {
    let mut bytes = vec![];
    message.write(&mut bytes);
    Ok(stream.write_all(&bytes)?)
}

/// A part of a motion, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub(crate) from_s: f64,
    pub(crate) lasts_s: f64,
}

impl Span {
    /// From when on, s, and for how many minutes.
    pub(crate) fn read(from: &str, minutes: &str) -> Result<Self> {
        Ok(Self { from_s: from.parse()?, lasts_s: 60.0 * minutes.parse::<f64>()? })
    }

    fn holds(&self, row: &Row) -> bool {
        (self.from_s..self.from_s + self.lasts_s).contains(&row.t_send_s)
    }
}

/// The rows of a motion that are sent within a span, in the order in which they are.
pub(crate) fn within(motion: &Trajectory, span: &Span) -> Vec<Row> {
    let mut rows: Vec<Row> = motion.rows().iter().filter(|row| span.holds(row)).cloned().collect();
    rows.sort_by(|a, b| a.t_send_s.total_cmp(&b.t_send_s));
    rows
}

/// How many rows there are of each kind.
pub(crate) fn kinds(rows: &[Row]) -> Value {
    let mut counts: BTreeMap<Expect, u64> = BTreeMap::new();
    rows.iter().for_each(|row| *counts.entry(row.expect).or_default() += 1);
    let of = |kinds: &[Expect]| kinds.iter().filter_map(|kind| counts.get(kind)).sum::<u64>();
    json!({
        "accept": of(&[Expect::Accept]),
        "drop": of(&[Expect::Duplicate, Expect::Old]),
        "refuse": of(&[Expect::NotFinite, Expect::NotRigid, Expect::Far]),
    })
}

/// Sends rows in time and notes when the answer to each has been read. An answer of last time that
/// is shown as stale is none.
pub(crate) fn track(
    to: SocketAddr,
    rows: &[Row],
    span: &Span,
    turnaround: &Turnaround,
) -> Result<()> {
    let mut stream = connect(to)?;
    let mut answers = stream.try_clone()?;
    std::thread::scope(|scope| {
        let reading = scope.spawn(|| -> Result<()> {
            while let Some(message) = next(&mut answers)? {
                let Content::Points(items) = &message.content else { continue };
                if items.iter().all(|item| item.group.to_string() != "stale") {
                    turnaround.answers(message.stamp.0);
                }
            }
            Ok(())
        });
        let sent = send_all(&mut stream, rows, span, turnaround);
        std::thread::sleep(REST);
        // The reader ends with the connection.
        let closed = stream.shutdown(Shutdown::Both);
        let read = reading.join();
        sent?;
        closed?;
        ensure!(read.is_ok_and(|read| read.is_ok()), "an answer could not be read");
        Ok(())
    })
}

fn send_all(
    stream: &mut TcpStream,
    rows: &[Row],
    span: &Span,
    turnaround: &Turnaround,
) -> Result<()> {
    let begun = Instant::now();
    let mut bytes = vec![];
    for row in rows {
        let due = Duration::from_secs_f64((row.t_send_s - span.from_s).max(0.0));
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
        let stamp = Stamp(row.stamp(EPOCH_S));
        let pose: Rows = row.rows.map(|row| row.map(|value| value as f32));
        bytes.clear();
        Message::new("Tracker", stamp, Content::Transform(pose)).write(&mut bytes);
        turnaround.sends(stamp.0);
        stream.write_all(&bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_motion_has_the_rows_that_its_description_counts() {
        let motion = Trajectory::long();
        let all = kinds(&within(&motion, &Span::read("0", "11").unwrap()));
        assert_eq!(all, json!({ "accept": 34_815, "drop": 316, "refuse": 300 }));
        let half = within(&motion, &Span::read("20", "5").unwrap());
        assert!(half.iter().all(|row| (20.0..320.0).contains(&row.t_send_s)));
        assert!(half.is_sorted_by(|a, b| a.t_send_s <= b.t_send_s));
        assert!(half.len() > 17_000, "{}", half.len());
    }
}
