//! A block of tissue under a session, and a plain client.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use supine_fem::{Body, Contact, Load, Params, Tissue};
use supine_mesh::{BoundaryFace, BoundaryTag, TET_FACES, TetMesh};
use supine_navigate::gate::{Gate, Verdict};
use supine_navigate::{
    Certainty, Counts, Follower, Frame, Frames, Host, Link, LiveRegion, Plan, Recorder, Renewal,
    Start, Tool, View, facing, run,
};
use supine_openigtlink::{
    Content, HEADER_BYTES, Header, Message, PointItem, Query, Rows, Stamp, Status, Verb,
};
use supine_space::{Grid, Matrix, Point, Pose, Progress, Vector, supine};
use supine_volume::{Ct, Volume};

/// Cubes along x, y, z, and their edge, mm. The chest wall is at y = 0, skin elsewhere.
const CUBES: [usize; 3] = [8, 5, 8];
const EDGE_MM: f64 = 10.0;
/// The tumour, LPS, mm.
pub(crate) const TUMOUR: Point = Point::new(41.0, -22.0, 39.0);

/// Six tetrahedra round a diagonal of each cube.
pub(crate) fn block() -> Arc<TetMesh> {
    let [nx, ny, nz] = CUBES;
    let number = |i: usize, j: usize, k: usize| ((k * (ny + 1) + j) * (nx + 1) + i) as u32;
    let mut points = vec![];
    for k in 0..=nz {
        for j in 0..=ny {
            points.extend((0..=nx).map(|i| Point::new(i as f64, -(j as f64), k as f64) * EDGE_MM));
        }
    }
    let mut tets = vec![];
    for (i, j, k) in (0..nx * ny * nz).map(|n| (n % nx, n / nx % ny, n / (nx * ny))) {
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut at = [i, j, k];
            let mut corners = [number(i, j, k); 4];
            for (corner, axis) in order.into_iter().enumerate() {
                at[axis] += 1;
                corners[corner + 1] = number(at[0], at[1], at[2]);
            }
            let [a, b, c, d] = corners.map(|p| points[p as usize]);
            if (b - a).cross(&(c - a)).dot(&(d - a)) < 0.0 {
                corners.swap(2, 3);
            }
            tets.push(corners);
        }
    }
    let boundary = boundary(&points, &tets);
    Arc::new(TetMesh::new(points, tets, boundary).unwrap())
}

/// Faces of one tetrahedron alone.
fn boundary(points: &[Point], tets: &[[u32; 4]]) -> Vec<BoundaryFace> {
    let faces = tets.iter().flat_map(|tet| TET_FACES.map(|face| face.map(|n| tet[n])));
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let mut all: Vec<([u32; 3], [u32; 3])> = faces.map(|face| (sorted(face), face)).collect();
    all.sort_unstable();
    let single = all.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
    let tagged = single.map(|same| {
        let wall = same[0].1.iter().all(|p| points[*p as usize].y == 0.0);
        let tag = if wall { BoundaryTag::ChestWall } else { BoundaryTag::Skin };
        BoundaryFace { points: same[0].1, tag }
    });
    tagged.collect()
}

/// A ramp of HU around the block.
pub(crate) fn ct() -> Arc<Ct> {
    let (size, spacing) = ([50, 36, 50], Vector::repeat(2.0));
    let grid = Grid::new(size, spacing, Point::new(-8.0, -60.0, -8.0), Matrix::identity()).unwrap();
    Arc::new(Volume::from_fn(grid, |[i, j, k]| (i * 7 + j * 3 + k) as i16 - 200))
}

/// The applicator beside the tumour; its shaft comes from the front.
pub(crate) fn plan(contact: Contact) -> Plan {
    let outwards = Vector::new(0.0, -1.0, 0.0);
    let placed =
        Pose::from_parts((TUMOUR.coords + outwards * 22.0).into(), facing(&outwards).unwrap());
    let tool = Tool { radius_mm: 15.0, shaft_radius_mm: 5.0, shaft_mm: 150.0 };
    Plan { tool, placed, contact, cavity: None, renewal: Renewal::Between }
}

pub(crate) fn follower(contact: Contact) -> Follower {
    let body = Body::new(block(), Tissue { young_kpa: 3.0, ..Tissue::default() });
    let load = Load { ct: supine(), target: supine() };
    let none = Progress::none();
    Follower::new(&body, &load, &Params::default(), plan(contact), &TUMOUR, none).unwrap()
}

/// The CT around the tumour.
pub(crate) fn region() -> LiveRegion {
    LiveRegion::new(ct(), block(), &[], &TUMOUR).unwrap()
}

/// Says yes when it goes, also when a test fails: other threads of the test end then.
pub(crate) struct AtEnd<'a>(pub(crate) &'a AtomicBool);

impl Drop for AtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::SeqCst);
    }
}

/// Somebody who looks on until told to stop.
#[derive(Default)]
struct Looker {
    address: Mutex<Option<SocketAddr>>,
    over: AtomicBool,
    notes: Mutex<Vec<String>>,
    peers: Mutex<usize>,
}

impl Host for Looker {
    fn listening(&self, address: SocketAddr) {
        *self.address.lock().unwrap() = Some(address);
    }

    fn view(&self, view: &View) {
        *self.peers.lock().unwrap() = view.peers;
    }

    fn note(&self, text: &str) {
        self.notes.lock().unwrap().push(text.to_owned());
    }

    fn go_on(&self) -> bool {
        !self.over.load(Ordering::SeqCst)
    }
}

pub(crate) const NEVER_LATE: Duration = Duration::from_secs(3600);

pub(crate) fn link(frame: Frame) -> Link {
    let frames =
        Frames { to_patient: frame.turn(), from_tool: Pose::identity(), latency: Duration::ZERO };
    let listen = "127.0.0.1:0".parse().unwrap();
    // Stamps of the tests do not keep to time.
    Link { listen, connect: None, device: None, frame, frames, late: NEVER_LATE }
}

/// The waits of all tests end after this: what they wait for comes within a second, and much later
/// only where a machine has other work.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// Tries at something that a machine with other work may spoil by holding the test up.
pub(crate) const TRIES: usize = 10;

/// How long a tracker was silent at most, of which each pose was sent and heard of at these times.
pub(crate) fn longest_silence(poses: &[[Instant; 2]]) -> Duration {
    let silences = poses.windows(2).map(|two| two[1][1] - two[0][0]);
    silences.max().unwrap_or_default()
}

/// A session that runs.
pub(crate) struct Session<'a> {
    pub(crate) address: SocketAddr,
    looker: &'a Looker,
}

impl Session<'_> {
    pub(crate) fn client(&self) -> Client {
        Client::new(self.address)
    }

    /// Peers that are connected, as they were 0.1 s ago at most.
    pub(crate) fn peers(&self) -> usize {
        *self.looker.peers.lock().unwrap()
    }

    pub(crate) fn notes(&self) -> Vec<String> {
        self.looker.notes.lock().unwrap().clone()
    }

    /// The host has the session end.
    pub(crate) fn end(&self) {
        self.looker.over.store(true, Ordering::SeqCst);
    }
}

/// Runs a session while `work` talks to it, and gives its counts.
pub(crate) fn during(link: &Link, contact: Contact, work: impl FnOnce(&Session<'_>)) -> Counts {
    recorded(link, contact, None, work)
}

/// As [`during`], with a recording.
pub(crate) fn recorded(
    link: &Link,
    contact: Contact,
    record: Option<&mut Recorder>,
    work: impl FnOnce(&Session<'_>),
) -> Counts {
    let (mut follower, looker) = (follower(contact), Looker::default());
    let mut region = region();
    let certainty = Certainty { tissue_mm: Some(2.0), registration_mm: 0.0 };
    let (follower, region) = (&mut follower, &mut region);
    let start = Start { follower, region, certainty, radius_mm: 8.0, record };
    std::thread::scope(|scope| {
        let running = scope.spawn(|| run(start, link, &looker));
        let address = loop {
            assert!(!running.is_finished(), "the session has not begun");
            if let Some(address) = *looker.address.lock().unwrap() {
                break address;
            }
            std::thread::yield_now();
        };
        let session = Session { address, looker: &looker };
        let worked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&session)));
        session.end();
        let counts = running.join().unwrap().unwrap();
        worked.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        counts
    })
}

/// Whether something comes to be before the patience ends.
pub(crate) fn comes(mut wanted: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while !wanted() {
        if begun.elapsed() > PATIENCE {
            return false;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    true
}

/// A client that reads and writes whole messages.
pub(crate) struct Client(pub(crate) TcpStream);

impl Client {
    pub(crate) fn new(address: SocketAddr) -> Self {
        Self::on(TcpStream::connect(address).unwrap())
    }

    pub(crate) fn on(stream: TcpStream) -> Self {
        stream.set_nonblocking(false).unwrap();
        stream.set_nodelay(true).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Self(stream)
    }

    pub(crate) fn send(&mut self, message: &Message) {
        let mut bytes = vec![];
        message.write(&mut bytes);
        self.0.write_all(&bytes).unwrap();
    }

    /// A pose in the frame of the peer.
    pub(crate) fn pose(&mut self, stamp: Stamp, pose: &Pose) {
        self.send(&transform("Applicator", stamp, pose));
    }

    pub(crate) fn ask(&mut self, verb: Verb, of: &str) {
        self.send(&Message::new("", Stamp::NONE, Content::Query(Query::new(verb, of))));
    }

    /// Sends a pose and waits until the tissue has followed it.
    pub(crate) fn follow(&mut self, stamp: Stamp, pose: &Pose) -> PointItem {
        self.pose(stamp, pose);
        self.until(|message| answered(message, stamp))
    }

    /// Sends poses in the frame of the session until the answer is good: soon, but on a slow
    /// machine not with the first. The stamp of that pose.
    pub(crate) fn good_again(&mut self, frame: Frame, first: u64) -> Stamp {
        let begun = Instant::now();
        for n in first.. {
            assert!(begun.elapsed() < PATIENCE, "it does not become good");
            let item = self.follow(stamp(20 * n), &(frame.turn() * near(n)));
            if item.group.to_string() == "ok" {
                return stamp(20 * n);
            }
        }
        Stamp::NONE
    }

    /// The next message; nothing when the peer closed.
    pub(crate) fn next(&mut self) -> Option<Message> {
        let mut head = [0; HEADER_BYTES];
        self.0.read_exact(&mut head).ok()?;
        let header = Header::read(&head).unwrap();
        let mut body = vec![0; header.body as usize];
        self.0.read_exact(&mut body).ok()?;
        Some(Message::read(&header, &body).unwrap())
    }

    /// Passes over messages until one is as wanted.
    pub(crate) fn until<T>(&mut self, wanted: impl Fn(&Message) -> Option<T>) -> T {
        self.passing(wanted).1
    }

    /// As [`Client::until`]; also what was passed over.
    pub(crate) fn passing<T>(
        &mut self,
        wanted: impl Fn(&Message) -> Option<T>,
    ) -> (Vec<Message>, T) {
        let (end, mut passed) = (Instant::now() + PATIENCE, vec![]);
        loop {
            assert!(Instant::now() < end, "no such message among {passed:?}");
            let message = self.next().expect("the session closed");
            if let Some(found) = wanted(&message) {
                return (passed, found);
            }
            passed.push(message);
        }
    }

    /// What came before the answer to a question that is asked now.
    pub(crate) fn so_far(&mut self) -> Vec<Message> {
        self.ask(Verb::Get, "CAPABILITY");
        self.passing(|m| matches!(m.content, Content::Capabilities(_)).then_some(())).0
    }

    /// Leaves, and waits until the session knows.
    pub(crate) fn leave(mut self) {
        self.0.shutdown(Shutdown::Write).unwrap();
        let end = Instant::now() + PATIENCE;
        while self.next().is_some() {
            assert!(Instant::now() < end, "the session does not let go");
        }
    }
}

/// The tumour's place, if a message is one.
pub(crate) fn tumour(message: &Message) -> Option<PointItem> {
    match &message.content {
        Content::Points(items) if message.device == "Tumour" => items.first().copied(),
        _ => None,
    }
}

/// The tumour's place in balance with the pose of a stamp; on a slow machine it may be stale when
/// it is sent.
pub(crate) fn answered(message: &Message, of: Stamp) -> Option<PointItem> {
    tumour(message).filter(|item| message.stamp == of && item.group.to_string() != "predicted")
}

/// The tumour's place as it was before it became stale.
pub(crate) fn stale(message: &Message) -> Option<PointItem> {
    tumour(message).filter(|item| item.group.to_string() == "stale")
}

/// A STATUS of a name.
pub(crate) fn status(message: &Message, name: &str) -> Option<Status> {
    match &message.content {
        Content::Status(status) if status.name == name => Some(status.clone()),
        _ => None,
    }
}

/// The planned pose, shifted, LPS.
pub(crate) fn shifted(by: Vector) -> Pose {
    Pose::translation(by.x, by.y, by.z) * plan(Contact::Tied).placed
}

/// The n-th of poses that differ and lie within 2 mm of the planned one, LPS.
pub(crate) fn near(n: u64) -> Pose {
    let share = |period: u64| (n % period) as f64 / period as f64;
    shifted(Vector::new(share(7), share(5) - 0.3, share(3)))
}

/// What a session makes of a pose after the wire has rounded it.
pub(crate) fn taken(frame: Frame, pose: &Pose) -> Pose {
    let rows = rows(pose).map(|row| row.map(f64::from));
    match Gate::new(Point::origin(), f64::MAX).judge(0, Duration::ZERO, &rows) {
        Verdict::Accepted { pose, .. } => frame.turn() * pose * Pose::identity(),
        other => panic!("{other:?}"),
    }
}

pub(crate) fn transform(device: &str, stamp: Stamp, pose: &Pose) -> Message {
    Message::new(device, stamp, Content::Transform(rows(pose)))
}

pub(crate) fn rows(pose: &Pose) -> Rows {
    let matrix = pose.to_homogeneous();
    [0, 1, 2].map(|r| [0, 1, 2, 3].map(|c| matrix[(r, c)] as f32))
}

/// The stamp so many ms after a fixed time.
pub(crate) fn stamp(ms: u64) -> Stamp {
    Stamp::from_since_1970(Duration::from_millis(1_700_000_000_000 + ms))
}
