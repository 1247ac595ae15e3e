//! The loop that takes the newest pose and tells where the tumour is.

use crate::Error;
use crate::answer::{Answer, Certainty};
use crate::follower::Follower;
use crate::hub::{Hub, Shape};
use crate::intake::Wanted;
use crate::messages;
use crate::record::Recorder;
use crate::region::LiveRegion;
use std::sync::Arc;
use std::time::Duration;
use supine_openigtlink::StatusCode;
use supine_space::Point;

/// The solver looks so often whether the session is over.
const TICK: Duration = Duration::from_millis(200);
/// A pose that has not settled is gone on with when no newer one has come in this time: a renewed
/// factor may be there then.
const GOES_ON: Duration = Duration::from_millis(3);
/// An answer that only repeats the last one, to within this, mm, is not sent again.
const SAME_MM: f64 = 1e-6;

/// Follows poses until the session is over.
///
/// # Errors
/// When memory is short, or a recording cannot be written.
pub(crate) fn follow(
    hub: &Hub,
    follower: &mut Follower,
    certainty: Certainty,
    mut record: Option<&mut Recorder>,
) -> Result<(), Error> {
    let mut open: Option<(Wanted, Point)> = None;
    let mut number = 0;
    while !hub.is_over() {
        let patience = if open.is_some() { GOES_ON } else { TICK };
        let before = open.take();
        let Some(wanted) = hub.poses.take(patience).or(before.map(|(wanted, _)| wanted)) else {
            continue;
        };
        let begun = hub.now();
        let (tissue, deformation) = follower.follow(&wanted.pose)?;
        let now = hub.now();
        number += 1;
        let age_s = wanted.age_s + now.saturating_sub(wanted.arrived).as_secs_f64();
        let answer = Answer {
            number,
            stamp: wanted.stamp,
            pose: wanted.pose,
            tool: follower.plan().tool,
            state: hub.state(tissue.settled, age_s),
            tissue,
            within_mm: certainty.within_mm(tissue.error_mm),
            age_s,
            solve_s: now.saturating_sub(begun).as_secs_f64(),
        };
        let again = before.filter(|(before, _)| before.arrived == wanted.arrived);
        let same = |(_, target): &(Wanted, Point)| (target - tissue.target).norm() < SAME_MM;
        let repeats = !tissue.settled && again.as_ref().is_some_and(same);
        // Before the answer: who hears it and asks for the surface gets that of this answer.
        let shape = hub.shape(Shape { deformation, stamp: wanted.stamp });
        if !repeats {
            hub.publish(answer);
        }
        hub.count(|counts| {
            counts.followed += u64::from(again.is_none());
            counts.predicted += u64::from(again.is_none() && !tissue.settled);
        });
        open = (!tissue.settled).then_some((wanted, tissue.target));
        send_surface(hub, &shape);
        if let Some(record) = record.as_deref_mut() {
            record.answer(&answer)?;
        }
        follower.between()?;
    }
    Ok(())
}

fn send_surface(hub: &Hub, shape: &Shape) {
    if !hub.wanted().0 {
        return;
    }
    let mut bytes = vec![];
    messages::surface(&shape.deformation, &hub.surface, shape.stamp, hub.frame).write(&mut bytes);
    let bytes = Arc::new(bytes);
    hub.each_peer(|outbox| {
        if outbox.streams().surface {
            outbox.surface(&bytes);
        }
    });
}

/// Carries the region by the newest shape, until the session is over.
///
/// # Errors
/// When it is a shape of another mesh.
pub(crate) fn carry(hub: &Hub, region: &mut LiveRegion) -> Result<(), Error> {
    while !hub.is_over() {
        let Some(shape) = hub.region.take(TICK) else { continue };
        let ct = region.carry(&shape.deformation)?;
        let Some(message) = messages::image(ct, shape.stamp, hub.frame) else { continue };
        let mut bytes = vec![];
        message.write(&mut bytes);
        let bytes = Arc::new(bytes);
        hub.each_peer(|outbox| {
            if outbox.streams().image != crate::outbox::Images::None {
                outbox.image(&bytes);
            }
        });
    }
    Ok(())
}

/// Notices silence, and tells everybody each second how it is, until the session is over.
pub(crate) fn watch(hub: &Hub) {
    const LOOK: Duration = Duration::from_millis(5);
    const KEEP_ALIVE: Duration = Duration::from_secs(1);
    let mut told = Duration::ZERO;
    while !hub.is_over() {
        std::thread::sleep(LOOK);
        let (last, stale) = hub.last();
        if let Some(last) = last
            && stale.is_none()
            && let Some(silent) = hub.silence()
        {
            let (silent, age) = (silent.as_millis(), 1e3 * last.age_s);
            let text = format!("no pose for {silent} ms; the last one is {age:.0} ms old");
            hub.stale(StatusCode::TimedOut, "Silence", &text);
        }
        if hub.now().saturating_sub(told) >= KEEP_ALIVE {
            told = hub.now();
            let (code, name, text) = hub.state_text();
            hub.note(&messages::status(code, name, &text));
        }
    }
}
