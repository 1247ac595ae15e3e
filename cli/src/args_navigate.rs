//! What can be typed about navigation.

use crate::cli_values::{Frame, Numbers};
use clap::{Args, ValueEnum};
use std::net::IpAddr;
use std::path::PathBuf;
use supine_navigate::{Holding, Renewing, Settings};

/// The tumour followed live under the applicator, by OpenIGTLink.
///
/// Starts from the operating position of a finished run. Trackers send TRANSFORM messages, to this
/// program or, with `--connect`, from their own server; everybody who is connected is sent the
/// tumour's place as POINT with the stamp of the pose. The origin of a pose is the centre of the
/// applicator's sphere (see `--calibration`), its shaft runs along -z. The newest pose wins; poses
/// that are no rigid motion, far away or frozen are refused and the last result is marked stale.
///
/// Without `--registration` poses are in the patient's own frame, which `--frame` names. Messages
/// do not say their frame and peers do not convert: 3D Slicer takes all as RAS. Listens on loopback
/// alone unless `--host` says otherwise: whoever connects is served. Research software: no clinical
/// use is claimed.
#[derive(Args, Debug)]
pub(crate) struct Navigate {
    /// The folder of a finished run
    pub(crate) run: PathBuf,
    /// Address to listen on
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub(crate) host: IpAddr,
    /// Port to listen on; 0: any that is free
    #[arg(long, value_name = "N", default_value_t = 18944)]
    pub(crate) port: u16,
    /// Connect to the tracker's own server as well
    #[arg(long, value_name = "HOST:PORT")]
    pub(crate) connect: Option<String>,
    /// Device whose poses count [default: the first that sends]
    #[arg(long, value_name = "NAME")]
    pub(crate) device: Option<String>,
    /// Frame of what is sent, and of poses without a registration
    #[arg(long, value_enum, default_value = "lps")]
    pub(crate) frame: Frame,
    /// Landmarks in the tracker's frame and in the patient's: CSV `name,tracker_x,…,patient_z`, mm,
    /// LPS
    #[arg(long, value_name = "CSV", conflicts_with = "simulate")]
    pub(crate) registration: Option<PathBuf>,
    /// Poses of the marker while the sphere turned in a cup: CSV with 12 numbers a line, as
    /// TRANSFORM has them
    #[arg(long, value_name = "CSV", conflicts_with = "simulate")]
    pub(crate) calibration: Option<PathBuf>,
    /// Latency that the maker of the tracker states, ms
    #[arg(long, value_name = "MS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) latency: f64,
    /// Results for poses older than this are late, ms
    #[arg(long, value_name = "MS", default_value_t = 200.0, allow_negative_numbers = true)]
    pub(crate) late: f64,
    /// Keep poses and results in a new file, for `supine replay`
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Send the poses of a motion of 20 s or of 10 minutes, with what goes wrong with trackers, to
    /// try it
    #[arg(long, value_name = "MOTION", num_args = 0..=1, default_missing_value = "short")]
    pub(crate) simulate: Option<Motion>,
    #[command(flatten)]
    pub(crate) tissue: TissueArgs,
}

/// Applicator, contact and mesh.
#[derive(Args, Debug)]
pub(crate) struct TissueArgs {
    /// Tetrahedra of the mesh that follows
    #[arg(long, value_name = "N", default_value_t = 1581)]
    pub(crate) tetrahedra: usize,
    /// Order of its elements
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(crate) order: u8,
    /// How tissue is held to the applicator [default: tied; with --cavity pressing]
    #[arg(long, value_enum)]
    pub(crate) contact: Option<ContactWord>,
    /// Diameter of the sphere, mm
    #[arg(long, value_name = "MM", default_value_t = 40.0)]
    pub(crate) diameter: f64,
    /// Diameter of the shaft, mm
    #[arg(long, value_name = "MM", default_value_t = 12.0)]
    pub(crate) shaft: f64,
    /// Planned centre of the sphere on the table, LPS, mm [default: beside the tumour on the way
    /// in; in the middle of a cavity]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) at: Option<Numbers<3>>,
    /// Direction from which the shaft comes, LPS [default: from the skin nearest to the tumour]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) from: Option<Numbers<3>>,
    /// The tumour has been cut out with so much tissue around it, mm
    #[arg(long, value_name = "MM")]
    pub(crate) cavity: Option<f64>,
    /// When the factor of the stiffness is renewed
    #[arg(long, value_enum, default_value = "beside")]
    pub(crate) renewal: RenewalWord,
}

#[derive(Args, Debug)]
pub(crate) struct Replay {
    /// What `supine navigate --record` wrote
    pub(crate) recording: PathBuf,
    /// The folder of the run, where it is elsewhere now
    #[arg(long, value_name = "DIR")]
    pub(crate) run: Option<PathBuf>,
}

/// A motion to try it with.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Motion {
    /// 20 s
    Short,
    /// 10 minutes
    Long,
}

/// How tissue is held.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ContactWord {
    /// Without friction; tissue lifts off
    Pressing,
    /// Without friction; tissue is held in tension too, as by a suture
    Sliding,
    /// Tissue follows the applicator from its planned place on
    Tied,
}

/// When the factor is renewed.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum RenewalWord {
    /// In another thread: quick
    Beside,
    /// Between two steps: a replay gives the same bits
    Between,
}

impl TissueArgs {
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            tetrahedra: self.tetrahedra,
            order: self.order,
            contact: match (self.contact, self.cavity) {
                (Some(ContactWord::Pressing), _) | (None, Some(_)) => Holding::Pressing,
                (Some(ContactWord::Sliding), _) => Holding::Sliding,
                (Some(ContactWord::Tied), _) | (None, None) => Holding::Tied,
            },
            radius_mm: 0.5 * self.diameter,
            shaft_radius_mm: 0.5 * self.shaft,
            at_mm: self.at.map(|at| at.0),
            from: self.from.map(|from| from.0),
            cavity_mm: self.cavity,
            renewal: match self.renewal {
                RenewalWord::Beside => Renewing::Beside,
                RenewalWord::Between => Renewing::Between,
            },
            ..Settings::default()
        }
    }
}
