//! A tracker that is none: it sends the poses of a trajectory in time, so that anybody can try a
//! session.

use crate::trajectory::Trajectory;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant, SystemTime};
use supine_openigtlink::{Content, Message, Rows, Stamp};

/// Device name of the applicator.
const DEVICE: &str = "Applicator";

/// Sends a trajectory to a session as any tracker would, until its end or until `go_on` says no.
///
/// # Errors
/// When the session cannot be reached.
pub fn simulate(
    to: SocketAddr,
    trajectory: &Trajectory,
    go_on: &dyn Fn() -> bool,
) -> std::io::Result<()> {
    let stream = TcpStream::connect(to)?;
    stream.set_nodelay(true)?;
    stream.set_nonblocking(false)?;
    let mut answers = stream.try_clone()?;
    std::thread::scope(|scope| {
        // What comes back is read, so that the session does not take this for a slow reader.
        let reading = scope.spawn(move || {
            let mut sink = [0; 4096];
            while answers.read(&mut sink).is_ok_and(|n| n > 0) {}
        });
        let sent = send(&stream, trajectory, go_on);
        let closed = stream.shutdown(std::net::Shutdown::Both);
        // The reader ends with the socket.
        let _ = reading.join();
        sent.and(closed)
    })
}

fn send(
    mut stream: &TcpStream,
    trajectory: &Trajectory,
    go_on: &dyn Fn() -> bool,
) -> std::io::Result<()> {
    const LOOK: Duration = Duration::from_millis(50);
    let epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let epoch = u32::try_from(epoch.map_or(1, |epoch| epoch.as_secs())).unwrap_or(1);
    let begun = Instant::now();
    let mut rows: Vec<_> = trajectory.rows().iter().collect();
    rows.sort_by(|a, b| a.t_send_s.total_cmp(&b.t_send_s));
    let mut bytes = vec![];
    for row in rows {
        let due = Duration::from_secs_f64(row.t_send_s.max(0.0));
        while let Some(wait) = due.checked_sub(begun.elapsed()).filter(|wait| !wait.is_zero()) {
            if !go_on() {
                return Ok(());
            }
            std::thread::sleep(wait.min(LOOK));
        }
        let pose: Rows = row.rows.map(|row| row.map(|value| value as f32));
        bytes.clear();
        let stamp = Stamp(row.stamp(epoch));
        Message::new(DEVICE, stamp, Content::Transform(pose)).write(&mut bytes);
        stream.write_all(&bytes)?;
    }
    Ok(())
}
