//! The side that asks.

use crate::wire::{Answer, Request};
use std::io::{Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;
use supine_mesh::{BoundaryFace, MeshError, TetMesh};
use supine_space::{Failure, Point, Progress, Stopped};

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Largest volume of a tetrahedron, mm³.
    pub max_volume_mm3: f64,
    /// Largest ratio of a tetrahedron's circumscribed radius to its shortest edge.
    pub max_ratio: f64,
    /// Smallest dihedral angle aimed at, degrees; TetGen does not promise it.
    pub min_dihedral_deg: f64,
    /// Points that may be added inside: TetGen can go on for ever.
    pub max_points: usize,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            max_volume_mm3: 100.0,
            max_ratio: 1.2,
            min_dihedral_deg: 12.0,
            max_points: 1_000_000,
        }
    }
}

impl Params {
    /// TetGen's own words: a surface (p) kept as it is (Y), counted from 0 (z), quietly (Q).
    fn switches(&self) -> String {
        let Self { max_volume_mm3, max_ratio, min_dihedral_deg, max_points } = self;
        format!("pYzQq{max_ratio}/{min_dihedral_deg}a{max_volume_mm3:.6}S{max_points}")
    }
}

/// The worker is looked at this often.
const LOOK: Duration = Duration::from_millis(20);
/// Looks after which a worker that has not ended is ended: ten minutes.
const PATIENCE: usize = 30_000;
/// Looks after which about 2/3 of the work is done.
const EXPECTED: f64 = 100.0;

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The worker cannot be started.
    #[error("the process for TetGen cannot be started ({0}); use the native mesher")]
    Start(std::io::Error),
    /// The worker died or gave up.
    #[error(
        "TetGen ended without a mesh ({how}): it does so on surfaces that it takes for crossing \
         themselves; ask for another count, or use the native mesher"
    )]
    Died {
        /// How it ended and its last words.
        how: String,
    },
    /// The worker did not come to an end.
    #[error(
        "TetGen did not come to an end in {minutes} minutes and was stopped; ask for another \
         count, or use the native mesher"
    )]
    Endless {
        /// Time it was given.
        minutes: u64,
    },
    /// What the worker made is not a mesh.
    #[error("TetGen made a broken mesh ({0}); ask for another count, or use the native mesher")]
    Broken(#[from] MeshError),
}

impl Error {
    /// The kind of failure: where no worker could be started for want of memory or processes
    /// another try may help; all else but a stop is a failure of the method.
    pub fn kind(&self) -> Failure {
        use std::io::ErrorKind as Kind;
        match self {
            Self::Stopped(_) => Failure::Stopped,
            Self::Start(error) => match error.kind() {
                Kind::OutOfMemory | Kind::WouldBlock | Kind::ResourceBusy => Failure::Retry,
                _ => Failure::Method,
            },
            _ => Failure::Method,
        }
    }
}

/// Fills a closed surface (points in LPS, mm) with tetrahedra; its triangles and tags are kept.
///
/// `worker` starts a program that calls [`crate::work`]. The progress is an estimate: TetGen does
/// not tell how far it is.
///
/// # Errors
/// When the worker cannot be started, dies, gives up or does not end, or the progress callback says
/// stop; the worker is then ended.
pub fn fill(
    points: &[Point],
    faces: &[BoundaryFace],
    params: &Params,
    worker: &mut Command,
    progress: Progress<'_>,
) -> Result<TetMesh, Error> {
    progress.at(0.0)?;
    let request = Request {
        points: points.iter().flat_map(|p| [p.x, p.y, p.z]).collect(),
        faces: faces.iter().flat_map(|f| f.points).collect(),
        tags: faces.iter().map(|f| f.tag.number()).collect(),
        switches: params.switches(),
    };
    let (status, answer, words) = ask(worker, &request.bytes(), progress)?;
    let died = |how: String| Error::Died { how };
    if !status.success() {
        let last = words.lines().map(str::trim).rfind(|line| !line.is_empty());
        return Err(died(last.map_or(status.to_string(), |last| format!("{status}: {last}"))));
    }
    let answer = Answer::read(&answer).ok_or_else(|| died("its answer is cut short".into()))?;
    let mesh = answer.mesh()?;
    progress.at(1.0)?;
    Ok(mesh)
}

/// How the worker ended, its answer and what it said.
fn ask(
    worker: &mut Command,
    request: &[u8],
    progress: Progress<'_>,
) -> Result<(ExitStatus, Vec<u8>, String), Error> {
    worker.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = worker.spawn().map_err(Error::Start)?;
    let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        // A worker that dies early closes its end; how it died is told by its status.
        scope.spawn(move || stdin.map(|mut pipe| pipe.write_all(request)));
        let answer = scope.spawn(move || drained(stdout));
        let words = scope.spawn(move || drained(stderr));
        let status = watch(&mut child, progress);
        if status.is_err() {
            // It may just have ended by itself; either way its pipes close and the threads end.
            let _ended = child.kill().and_then(|()| child.wait());
        }
        let answer = answer.join().unwrap_or_default();
        let words = words.join().unwrap_or_default();
        Ok((status?, answer, String::from_utf8_lossy(&words).into_owned()))
    })
}

/// All that comes through a pipe until it closes.
fn drained(pipe: Option<impl Read>) -> Vec<u8> {
    let mut bytes = Vec::new();
    // What came before an error counts; an answer cut short is found when it is read.
    let _read = pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
    bytes
}

/// Waits for the end of the worker.
fn watch(child: &mut Child, progress: Progress<'_>) -> Result<ExitStatus, Error> {
    for look in 0..PATIENCE {
        progress.at(1.0 - (-(look as f64) / EXPECTED).exp())?;
        if let Some(status) = child.try_wait().map_err(Error::Start)? {
            // A key that stops the program may reach the worker first.
            progress.at(1.0)?;
            return Ok(status);
        }
        std::thread::sleep(LOOK);
    }
    Err(Error::Endless { minutes: (LOOK * PATIENCE as u32).as_secs() / 60 })
}
