//! What a session keeps does not grow.

use crate::support::{AtEnd, Client, during, link, near, stamp};
use std::io::{ErrorKind, Read};
use std::sync::atomic::{AtomicBool, Ordering};
use supine_fem::Contact;
use supine_navigate::Frame;
use supine_openigtlink::{Start, Verb};

/// What allocators and sockets may keep, MB.
const MOST_MB: u64 = 20;

/// Memory of this process that is in use, MB; none on systems that do not tell it so.
fn resident_mb() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib / 1024)
}

/// Sends so many poses in groups; the last of each is waited for.
fn send(client: &mut Client, first: u64, count: u64) {
    const GROUP: u64 = 50;
    for from in (first..first + count).step_by(GROUP as usize) {
        (from..from + GROUP - 1).for_each(|n| client.pose(stamp(20 * n), &near(n)));
        client.follow(stamp(20 * (from + GROUP - 1)), &near(from + GROUP - 1));
    }
}

#[test]
fn five_thousand_poses_leave_nothing_behind() {
    // Where tests share a process the others' memory counts as well.
    let alone = std::env::var_os("NEXTEST_EXECUTION_MODE").is_some_and(|m| m == "process-per-test");
    let counts = during(&link(Frame::Lps), Contact::Tied, |session| {
        let (mut client, over) = (session.client(), AtomicBool::new(false));
        let mut viewer = session.client();
        for of in ["IMAGE", "POLYDATA"] {
            viewer.ask(Verb::Start(Start::Plain), of);
        }
        viewer.so_far();
        viewer.0.set_read_timeout(Some(std::time::Duration::from_millis(100))).unwrap();
        std::thread::scope(|scope| {
            let _at_end = AtEnd(&over);
            scope.spawn(|| {
                let mut piece = vec![0; 1 << 20];
                while !over.load(Ordering::SeqCst) {
                    match viewer.0.read(&mut piece) {
                        Ok(0) => break,
                        Ok(_) => {}
                        Err(error) => {
                            let waits = [ErrorKind::WouldBlock, ErrorKind::TimedOut];
                            assert!(waits.contains(&error.kind()), "{error}");
                        }
                    }
                }
            });
            send(&mut client, 1, 200);
            let before = resident_mb();
            send(&mut client, 201, 5000);
            let after = resident_mb();
            if let (true, Some(before), Some(after)) = (alone, before, after) {
                assert!(after <= before + MOST_MB, "{before} MB before, {after} MB after");
            }
        });
    });
    assert_eq!((counts.received, counts.accepted), (5200, 5200));
    let known = counts.followed + counts.overtaken;
    assert!(known >= 5200 && known - counts.predicted <= 5200, "{counts:?}");
}
