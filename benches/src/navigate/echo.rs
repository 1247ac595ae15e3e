//! The round trip alone: a server that answers each pose at once.

use crate::tracker::{Span, kinds, next, send, track, within};
use crate::turnaround::{Turnaround, summary};
use anyhow::{Result, ensure};
use serde_json::Value;
use std::net::TcpListener;
use supine_navigate::trajectory::Trajectory;
use supine_openigtlink::{Content, Message, PointItem};

/// Times of a part of the motion.
pub(crate) fn measure(span: &Span) -> Result<Value> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let rows = within(&Trajectory::long(), span);
    let turnaround = Turnaround::default();
    std::thread::scope(|scope| -> Result<()> {
        let serving = scope.spawn(|| serve(&listener));
        track(address, &rows, span, &turnaround)?;
        ensure!(serving.join().is_ok_and(|served| served.is_ok()), "the echo ended early");
        Ok(())
    })?;
    let mut told = summary(turnaround.times_ms());
    told["rows"] = kinds(&rows);
    Ok(told)
}

/// Answers one peer until it is gone: a message of the kind and size of a session's answer.
fn serve(listener: &TcpListener) -> Result<()> {
    let (mut stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    let item = PointItem {
        name: "Tumour".into(),
        group: "ok".into(),
        rgba: [0; 4],
        position: [0.0; 3],
        diameter: 18.0,
        owner: "".into(),
    };
    while let Some(pose) = next(&mut stream)? {
        let answer = Message::new("Tumour", pose.stamp, Content::Points(vec![item]));
        if send(&mut stream, &answer).is_err() {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pose_comes_back() {
        let told = measure(&Span { from_s: 20.0, lasts_s: 1.2 }).unwrap();
        let n = told["n"].as_u64().unwrap();
        assert!(n > 50, "{told}");
        assert_eq!(told["rows"]["accept"].as_u64(), Some(n));
        assert!(told["median_ms"].as_f64().unwrap() > 0.0);
    }
}
