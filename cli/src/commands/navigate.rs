//! `supine navigate` and `supine replay`.

use crate::End;
use crate::args_navigate::{Motion, Navigate, Replay};
use crate::cli_values::Frame as FrameWord;
use crate::failure::Failure;
use crate::screen::Screen;
use serde_json::json;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use supine_flow::Observer;
use supine_navigate::{
    Counts, Error, Frame, Frames, Head, Holding, Host, Link, Patient, Recorder, Recording,
    Renewing, Settings, Start, View, pivot, registration, replay as follow_again, run, simulate,
    trajectory::Trajectory,
};
use supine_space::{Failure as Kind, Point, Pose, Progress};

pub(crate) fn navigate(args: &Navigate, screen: &Screen) -> Result<End, Failure> {
    let settings = args.tissue.settings();
    if settings.cavity_mm.is_some() && settings.contact != Holding::Pressing {
        let text = "--cavity goes with --contact pressing: tissue at a cut surface is not held";
        return Err(Failure::new(Kind::Usage, text));
    }
    let (frames, registration_mm, notes) = frames(args)?;
    let patient = Patient::open(&args.run, &settings, rayon::current_num_threads(), screen)?;
    notes.iter().for_each(|note| screen.say(note));
    let head = Head::new(&args.run, &settings, registration_mm);
    let mut record = args.record.as_deref().map(|path| Recorder::new(path, &head)).transpose()?;
    let attach = |share| screen.share("applicator", share);
    let mut follower = patient.follower(&settings, Progress::new(&attach))?;
    let mut region = follower.region(patient.ct())?;
    screen.clear();
    let link = Link {
        listen: SocketAddr::new(args.host, args.port),
        connect: args.connect.clone(),
        device: args.device.clone(),
        frame: frame(args.frame),
        frames,
        late: duration("--late", args.late)?,
    };
    let motion = args.simulate.map(|motion| moved(motion, &patient, &settings)).transpose()?;
    let live = Live {
        screen,
        motion,
        address: Mutex::default(),
        counts: Mutex::default(),
        ended: AtomicBool::new(false),
    };
    let start = Start {
        follower: &mut follower,
        region: &mut region,
        certainty: patient.certainty(registration_mm),
        radius_mm: patient.tumour_radius_mm(),
        record: record.as_mut(),
    };
    screen.say(&format!(
        "{} tetrahedra of order {}; {}; frame {}",
        patient.tetrahedra(),
        settings.order,
        certainty(&patient, registration_mm),
        link.frame.name()
    ));
    let counts = std::thread::scope(|scope| {
        scope.spawn(|| live.send());
        let counts = run(start, &link, &live);
        live.ended.store(true, Ordering::SeqCst);
        counts
    })?;
    record.map(Recorder::end).transpose()?;
    screen.result(&told(&counts), &words(&counts));
    Ok(End::Done)
}

fn certainty(patient: &Patient, registration_mm: f64) -> String {
    match patient.certainty(registration_mm).within_mm(0.0) {
        Some(mm) => format!("the tumour lies within {mm:.1} mm (95 %)"),
        None => "how sure the tumour's place is the run could not say".into(),
    }
}

pub(crate) fn replay(args: &Replay, screen: &Screen) -> Result<End, Failure> {
    let recording = Recording::read(&args.recording)?;
    let run = args.run.clone().unwrap_or_else(|| recording.head.run.clone());
    // What another thread renewed came when it came: here it comes between the steps.
    let settings = Settings { renewal: Renewing::Between, ..recording.head.settings.clone() };
    let patient = Patient::open(&run, &settings, rayon::current_num_threads(), screen)?;
    let attach = |share| screen.share("applicator", 0.2 * share);
    let mut follower = patient.follower(&settings, Progress::new(&attach))?;
    let steps = |share| screen.share("replay", share);
    let told = follow_again(&recording, &mut follower, Progress::new(&steps))?;
    let promise = match (told.promised, told.identical) {
        (true, true) => "identical to the bit, as its renewal between the steps promises",
        (true, false) => "NOT identical, although its renewal between the steps promises that",
        (false, true) => "identical to the bit, though its renewal beside the steps promises less",
        (false, false) => "recorded with renewal beside the steps: right to within both errors",
    };
    let text = format!(
        "{} answers; {promise}; largest difference {:.6} mm, {} beyond both errors",
        told.answers, told.largest_mm, told.beyond
    );
    let failure = (!told.holds())
        .then(|| Failure::coded(Kind::Check, "replay-differs", "the replay is not the recording"));
    screen.result_but(failure.as_ref(), &told, &text);
    failure.map_or(Ok(End::Done), Err)
}

/// How frames lie, the expected target registration error (mm), and what a person should know of
/// them.
fn frames(args: &Navigate) -> Result<(Frames, f64, Vec<String>), Failure> {
    let read = |path: &Path| {
        std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })
    };
    let mut notes = vec![];
    let mut to_patient = frame(args.frame).turn();
    let mut registration_mm = 0.0;
    if let Some(path) = &args.registration {
        let pairs = registration::read_fiducials(&read(path)?).map_err(Error::from)?;
        let pairs: Vec<(Point, Point)> = pairs.iter().map(registration::Fiducial::pair).collect();
        let tumour = tumour_of(&args.run)?;
        let registration = registration::Registration::new(&pairs, &tumour).map_err(Error::from)?;
        to_patient = *registration.patient_from_tracker();
        registration_mm = registration.expected_tre_mm();
        notes.push(format!(
            "registration: {} landmarks, expected error at the tumour {registration_mm:.2} mm rms (the landmarks themselves \
             fit to {:.2} mm, which says little)",
            pairs.len(),
            registration.fre_mm()
        ));
        notes.extend(registration.advice().map(|advice| format!("warning: {advice}")));
    }
    let mut from_tool = Pose::identity();
    if let Some(path) = &args.calibration {
        let poses = pivot::read_poses(&read(path)?).map_err(Error::from)?;
        let pivot = pivot::Pivot::new(&poses).map_err(Error::from)?;
        let worst = pivot.sigma_mm.iter().fold(0.0, |a: f64, b| a.max(*b));
        notes.push(format!(
            "calibration: {} poses, centre of the sphere to {worst:.2} mm (standard deviation), condition {:.1}",
            poses.len(),
            pivot.condition
        ));
        from_tool = Pose::translation(pivot.tip.x, pivot.tip.y, pivot.tip.z);
    }
    let latency = duration("--latency", args.latency)?;
    Ok((Frames { to_patient, from_tool, latency }, registration_mm, notes))
}

/// A time that an option gives in ms.
fn duration(option: &str, ms: f64) -> Result<Duration, Failure> {
    let needed = || format!("{option}: a number of ms, not below 0, is needed");
    Duration::try_from_secs_f64(ms / 1e3).map_err(|_| Failure::new(Kind::Usage, needed()))
}

/// The tumour on the table, as the run's summary has it.
fn tumour_of(run: &Path) -> Result<Point, Failure> {
    let summary = supine_flow::FinishedRun::open(run)?.summary()?;
    let tumour = summary.tumour.ok_or(Error::NoTarget)?;
    Ok(tumour.after_mm.into())
}

fn frame(word: FrameWord) -> Frame {
    match word {
        FrameWord::Lps => Frame::Lps,
        FrameWord::Ras => Frame::Ras,
    }
}

/// A motion that enters where the applicator is planned.
fn moved(motion: Motion, patient: &Patient, settings: &Settings) -> Result<Trajectory, Failure> {
    let trajectory = match motion {
        Motion::Short => Trajectory::short(),
        Motion::Long => Trajectory::long(),
    };
    let placed = patient.placed(settings)?;
    Ok(trajectory.entering(&placed))
}

/// Looks on, and sends a motion if one is asked for.
struct Live<'a> {
    screen: &'a Screen,
    motion: Option<Trajectory>,
    address: Mutex<Option<SocketAddr>>,
    counts: Mutex<Counts>,
    ended: AtomicBool,
}

/// Longest time for the last poses of a motion to be followed.
const LAST: Duration = Duration::from_secs(10);

impl Live<'_> {
    /// Waits for the address, and sends the motion to it; then the session ends.
    fn send(&self) {
        let Some(motion) = &self.motion else { return };
        let to = loop {
            if self.ended.load(Ordering::SeqCst) {
                return;
            }
            if let Some(address) = self.address.lock().ok().and_then(|held| *held) {
                break address;
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        match simulate(to, motion, &|| self.go_on()) {
            Ok(()) => self.wait_for_last(motion.rows().len() as u64),
            Err(error) => self.screen.say(&format!("the simulated tracker: {error}")),
        }
        // The last answer is looked at.
        std::thread::sleep(Duration::from_millis(300));
        self.ended.store(true, Ordering::SeqCst);
    }

    /// Waits until so many poses have come and the last of them was followed: a machine with other
    /// work is behind.
    fn wait_for_last(&self, sent: u64) {
        let begun = Instant::now();
        let is_done = |counts: &Counts| {
            counts.received >= sent && counts.followed + counts.overtaken >= counts.accepted
        };
        while self.go_on()
            && begun.elapsed() < LAST
            && !self.counts.lock().is_ok_and(|counts| is_done(&counts))
        {
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Host for Live<'_> {
    fn listening(&self, address: SocketAddr) {
        if let Ok(mut held) = self.address.lock() {
            *held = Some(address);
        }
        let what = if self.motion.is_some() { "a simulated tracker" } else { "Ctrl-C ends it" };
        self.screen.say(&format!("OpenIGTLink on {address}; {what}"));
    }

    fn view(&self, view: &View) {
        if let Ok(mut counts) = self.counts.lock() {
            *counts = view.counts;
        }
        self.screen.live(&line(view));
    }

    fn note(&self, text: &str) {
        self.screen.say(text);
    }

    fn go_on(&self) -> bool {
        Observer::go_on(self.screen) && !self.ended.load(Ordering::SeqCst)
    }
}

/// One line of how it is.
fn line(view: &View) -> String {
    let rate = view.interval.map_or(0.0, |mean| 1.0 / mean.as_secs_f64().max(1e-3));
    let Some(answer) = &view.answer else {
        return format!("{} peers; no pose yet", view.peers);
    };
    let tissue = &answer.tissue;
    let state = match &view.stale {
        Some(why) => format!("STALE ({why})"),
        None => answer.state.name().to_owned(),
    };
    let within = answer.within_mm.map_or_else(|| "?".into(), |mm| format!("{mm:.1}"));
    let [x, y, z]: [f64; 3] = tissue.target.coords.into();
    format!(
        "{state:9} tumour {x:.1} {y:.1} {z:.1} mm ±{within}, moved {:.1} mm; {:.1} mm from the axis, {:.1} from the surface; \
         {:.2} N; {rate:.0}/s, age {:.1} ms",
        tissue.moved.norm(),
        tissue.from_axis_mm,
        tissue.from_surface_mm,
        tissue.force_n.norm(),
        answer.age_s * 1e3,
    )
}

fn told(counts: &Counts) -> serde_json::Value {
    json!({
        "poses": {
            "received": counts.received, "accepted": counts.accepted, "refused": counts.refused,
            "dropped": counts.dropped, "overtaken": counts.overtaken,
        },
        "answers": { "followed": counts.followed, "predicted": counts.predicted },
    })
}

fn words(counts: &Counts) -> String {
    format!(
        "{} poses: {} accepted, {} refused, {} dropped; {} followed, {} overtaken by a newer one, {} answers were predictions",
        counts.received,
        counts.accepted,
        counts.refused,
        counts.dropped,
        counts.followed,
        counts.overtaken,
        counts.predicted
    )
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::new(error.kind(), error.to_string())
    }
}
