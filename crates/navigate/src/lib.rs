//! The tumour followed live under the applicator: poses in, places out.
//!
//! A session ([`run`]) starts from the operating position of a finished run ([`Patient`]). Trackers
//! and viewers speak OpenIGTLink with it. A pose goes through the [`gate`] (is it one?), the clocks
//! (how old is it?) and the registration; the newest is followed by the tissue ([`Follower`]); the
//! tumour's place goes to all peers with the stamp, the age and the error. Nothing queues: of each
//! kind the newest is kept.
//!
//! One thread reads each peer, one writes to it, one solves, one carries the CT around the tumour,
//! one watches for silence.
//!
//! ```
//! use supine_navigate::Tool;
//! use supine_space::{Point, Pose};
//!
//! // The shaft runs along the z axis of the applicator, here also that of the patient.
//! let pose = Pose::translation(10.0, 0.0, 0.0);
//! assert_eq!(Tool::from_axis_mm(&pose, &Point::new(13.0, 4.0, 50.0)), 5.0);
//! ```

#![expect(
    clippy::disallowed_methods,
    reason = "edge crate: sockets, files, and the clock of the poses"
)]

mod answer;
pub mod clock;
mod departure;
mod error;
mod follower;
mod frame;
pub mod gate;
mod hub;
mod intake;
mod messages;
mod outbox;
mod patient;
mod peer;
pub mod pivot;
mod record;
mod region;
pub mod registration;
mod replay;
mod session;
mod settings;
mod simulate;
mod slot;
mod solver;
mod tool;
pub mod trajectory;
mod wire;

pub use answer::{Answer, Certainty, Followed, State};
pub use error::Error;
pub use follower::{Follower, Plan, Renewal};
pub use frame::Frame;
pub use hub::Counts;
pub use intake::Frames;
pub use patient::Patient;
pub use record::{Head, Line, Recorder, Recording};
pub use region::{LiveRegion, SPACING_MM, VOXELS};
pub use replay::{Replayed, replay};
pub use session::{Host, Link, Start, View, run};
pub use settings::{Holding, Renewing, Settings};
pub use simulate::simulate;
pub use tool::{Tool, facing};
