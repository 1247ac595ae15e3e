//! The page in the browser: a folder of DICOM, a case or a run is opened, looked at and worked on,
//! on one's own machine.
//!
//! A server on loopback hands out the page and the voxels, and tells of each change; the page cuts
//! the slices. The method lies in the flow's session.
//!
//! Data flows one way: a request begins work or changes the store; workers report to the store;
//! what the page is told is made of the store alone. The files by layer, each using only those
//! named before it in its row and those of the rows below:
//!
//! - `server`: `guard`, `doors`, `browser`, `app`, `link`, `routes`
//! - `workers`: `reporter`, `objects`, `tilt`, `live`, `jobs`, `edit`, `carry`, `file_watch`, `run`,
//!   `open`, `send`, `picture`, `patient`
//! - the store behind its lock: `workspace`
//! - what the page is told: `store/state`
//! - `store`: `unsaved`, `folder`, `adjacent`, `case`, `work`, `previews`, `plan`, `display`,
//!   `results`, `archives`, and `mod` with what concerns several of them
//! - `navigation`, which knows nothing of these: `region`, `messages`, `follow`
//! - `draw`, nor does this: `planes`, `surface`, `cut`, `contours`, `lines`, `voxels`, `body`
//! - words and paths: `names`, `error`, `roots`
//!
//! ```no_run
//! use supine_workstation::{Host, Open, open};
//!
//! /// Prints where the page is; Ctrl-C ends it.
//! struct Terminal;
//!
//! impl Host for Terminal {
//!     fn address(&self, address: &str) {
//!         println!("{address}");
//!     }
//!     fn no_browser(&self, why: &str) {
//!         eprintln!("open the address yourself: {why}");
//!     }
//!     fn go_on(&self) -> bool {
//!         true
//!     }
//! }
//!
//! # fn main() -> Result<(), supine_workstation::Error> {
//! let given = Open {
//!     path: "patient".into(),
//!     look_through: true,
//!     port: 0,
//!     browser: true,
//!     nodes: vec![],
//!     threads: 0,
//!     start: None,
//!     unsaved: None,
//! };
//! open(&given, &Terminal)?;
//! # Ok(())
//! # }
//! ```

#![expect(
    clippy::disallowed_methods,
    reason = "edge crate: files, sockets and the clock of the page"
)]

mod draw;
mod error;
mod names;
mod navigation;
mod roots;
mod server;
mod store;
mod workers;
mod workspace;

pub use error::Error;

use navigation::follow::Following;
use server::app::App;
use server::browser;
use server::doors::{Doors, Guest};
use server::routes::router;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use supine_dicom_network::Node;
use supine_flow::Start;
use tokio::net::TcpListener;
use workers::file_watch;
use workers::jobs::Jobs;
use workers::live::Live;
use workers::open::Opener;
use workspace::Workspace;

/// How often is asked whether the program may go on.
const LOOK: Duration = Duration::from_millis(200);
/// Without a page for so long the program ends.
const ALONE: Duration = Duration::from_secs(12 * 3600);

/// What is asked.
#[derive(Clone, Debug)]
pub struct Open {
    /// A folder, a case file, or the folder of a run. All that the page may see lies in this
    /// folder, or beside this file.
    pub path: PathBuf,
    /// Whether a folder is looked through at once; else the user chooses one below it.
    pub look_through: bool,
    /// The port on loopback; 0: any that is free.
    pub port: u16,
    /// Whether the browser is opened.
    pub browser: bool,
    /// Archives that results may be sent to by a click: `AET@HOST:PORT`.
    pub nodes: Vec<Node>,
    /// Threads of the work; 0: all cores.
    pub threads: usize,
    /// When and by which command it began: exported objects bear it.
    pub start: Option<Start>,
    /// Where changes of cases that no file holds are kept; without one they are not.
    pub unsaved: Option<PathBuf>,
}

/// The user's own folder for [`Open::unsaved`]; none where the system names no place.
pub fn unsaved_folder() -> Option<PathBuf> {
    store::unsaved::usual_folder()
}

/// Who started it.
pub trait Host {
    /// The page is there: at this address, which bears its key.
    fn address(&self, address: &str);
    /// The browser could not be opened.
    fn no_browser(&self, why: &str);
    /// Whether to go on.
    fn go_on(&self) -> bool;
}

/// Serves the page until the host ends it, or nobody has looked for twelve hours.
///
/// # Errors
/// When there is nothing at the path, or no port.
pub fn open(given: &Open, host: &dyn Host) -> Result<(), Error> {
    let path = given.path.canonicalize().map_err(|e| Error::unreadable(&given.path, e))?;
    let workspace = Workspace::new(root(&path))?;
    let following = Arc::<Following>::default();
    let live = Live::new(Arc::clone(&workspace), Arc::clone(&following));
    let jobs = Jobs::new(Arc::clone(&workspace), Arc::clone(&live));
    let opener = Arc::new(Opener {
        jobs: Arc::clone(&jobs),
        following: Arc::clone(&following),
        threads: given.threads,
        start: given.start.clone(),
    });
    let port = |source| Error::Port { port: given.port, source };
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(port)?;
    let served = runtime.block_on(async {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, given.port)).await.map_err(port)?;
        let token = token()?;
        let address =
            format!("http://127.0.0.1:{}/#{token}", listener.local_addr().map_err(port)?.port());
        let links = Arc::<AtomicUsize>::default();
        workspace.change(|store| {
            store.archives.name(&given.nodes);
            store.keep_unsaved(given.unsaved.clone());
        });
        opener.start(&path, given.look_through)?;
        file_watch::watch(&live);
        let app = App {
            workspace,
            live,
            jobs: Arc::clone(&jobs),
            opener,
            following: Arc::clone(&following),
            token: token.into(),
            links: Arc::clone(&links),
        };
        host.address(&address);
        // The file is there as long as the page.
        let _page = given.browser.then(|| browser::open(&address)).transpose();
        if let Err(why) = &_page {
            host.no_browser(&why.to_string());
        }
        tokio::select! {
            served = async {
                let app = router(app).into_make_service_with_connect_info::<Guest>();
                axum::serve(Doors::new(listener), app).await
            } => served.map_err(port),
            () = ended(host, &links) => Ok(()),
        }
    });
    following.leave();
    jobs.close();
    // What still reads for a page that is gone is not waited for.
    runtime.shutdown_timeout(LOOK);
    served
}

/// The folder below which the page may see files: what was opened, or the folder around it where
/// that is one file, one series or one run, for results must not lie within these.
fn root(path: &Path) -> &Path {
    let many = path.is_dir() && !roots::is_run(path) && !roots::holds_dicom(path);
    if many { path } else { path.parent().unwrap_or(path) }
}

/// 32 bytes that nobody guesses, in hexadecimal digits.
fn token() -> Result<String, Error> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|e| Error::Random(e.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

async fn ended(host: &dyn Host, links: &AtomicUsize) {
    let mut seen = Instant::now();
    while host.go_on() {
        if links.load(Ordering::SeqCst) > 0 {
            seen = Instant::now();
        } else if seen.elapsed() > ALONE {
            return;
        }
        tokio::time::sleep(LOOK).await;
    }
}

#[cfg(test)]
mod tests {
    use super::root;

    #[test]
    fn results_of_a_series_a_run_or_a_case_go_beside_it() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in ["series", "run", "many/series"] {
            std::fs::create_dir_all(at(folder)).unwrap();
        }
        for file in ["series/a.dcm", "run/summary.json", "many/series/a.dcm", "case.toml"] {
            std::fs::write(at(file), "").unwrap();
        }
        for beside in ["series", "run", "case.toml"] {
            assert_eq!(root(&at(beside)), dir.path(), "{beside}");
        }
        assert_eq!(root(&at("many")), at("many"));
    }
}
