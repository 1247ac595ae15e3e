//! What can be typed. Options of parameters come from the table of `supine-flow`, by [`Given`].

use crate::args_batch::{Batch, BatchCase};
use crate::args_navigate::{Navigate, Replay};
use crate::args_network::{Fetch, Send};
use crate::cli_values::{
    BreastSide, CarryGrid, CarryKind, Frame, LogFormat, Numbers, Schema, stages,
};
use crate::examples;
use crate::parameters::{Given, Keys};
use clap::{ArgGroup, Args, Parser, Subcommand};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use supine_flow::NodeId;
use supine_flow::commands::{self, run::Change};

/// Gives the CT of a supine breast as it lies on the tilted operating table.
///
/// Research software: no clinical use is claimed. Lengths in mm, positions in the DICOM patient
/// frame (LPS), angles in degrees. Positive AP raises the head, positive LAT lowers the patient's
/// left side.
#[derive(Parser, Debug)]
#[command(name = "supine", version, arg_required_else_help = true, disable_help_subcommand = true)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) common: Common,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The most threads that anybody may ask for: each of many thousands takes memory and hands others
/// no work.
const MOST_THREADS: usize = 1024;

/// A number of threads.
fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.parse::<NonZeroUsize>().map_err(|error| error.to_string())?;
    if number.get() > MOST_THREADS {
        return Err(format!("at most {MOST_THREADS}; more than there are processors gain nothing"));
    }
    Ok(number)
}

/// Options of every command.
#[derive(Args, Debug)]
#[command(next_help_heading = "Common options")]
pub(crate) struct Common {
    /// Number of threads [default: all cores]; the result does not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print the result as JSON on stdout, nothing else there
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Print only errors on stderr
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Say on stderr when each stage begins and ends, and the code of each warning
    #[arg(long, short, global = true)]
    pub(crate) verbose: bool,
    /// Show no progress bar
    #[arg(long, global = true)]
    pub(crate) no_progress: bool,
    /// How to say things on stderr; `json`: one object a line
    #[arg(
        long,
        global = true,
        value_name = "FORMAT",
        default_value = "text",
        hide_default_value = true
    )]
    pub(crate) log: LogFormat,
    /// Write the stages over time, with the memory, into this file: a trace that Perfetto
    /// (ui.perfetto.dev) opens
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) profile: Option<PathBuf>,
}

#[derive(Subcommand, Debug)]
pub(crate) enum Command {
    /// Run the whole flow on the patient that comes with the program
    Demo(Demo),
    /// Open a page in the browser: look at a CT, its segmentation and the deformed CT
    Open(Open),
    /// Tell what is in a folder of DICOM, and whether it can be used
    Inspect(Inspect),
    /// Write a commented case file for a CT
    Init(Init),
    /// Tell whether a case can be run, and what a run would do
    Check(Check),
    /// Run the whole flow of a case file
    Run(Run),
    /// Run many cases, and show them in one table and on one page
    Batch(Batch),
    /// One case of a batch; started by `batch`
    #[command(hide = true)]
    BatchCase(BatchCase),
    /// Fit Young's modulus to the surface scans of a case
    Fit(Fit),
    /// Label chest wall and soft tissue
    Segment(Segment),
    /// Divide the soft tissue within a sphere into tetrahedra
    Mesh(Mesh),
    /// Make fewer tetrahedra of the same tissue and carry the displacement over
    Coarsen(Coarsen),
    /// Find the displacement of a mesh under gravity
    Solve(Solve),
    /// Resample a CT through a deformed mesh
    Warp(Warp),
    /// Carry points, labels, doses, surfaces and contours by a finished run or a deformed mesh
    Carry(Carry),
    /// Follow the tumour live under the applicator, by OpenIGTLink
    Navigate(Box<Navigate>),
    /// Follow the poses of a recorded session once more, and compare
    Replay(Replay),
    /// Send DICOM objects to an archive
    Send(Send),
    /// Fetch DICOM objects from an archive
    Fetch(Fetch),
    /// Check of an exported series what no validator notices
    VerifyExport(VerifyExport),
    /// Print where the result of a run came from, as W3C PROV-JSON
    Provenance {
        /// The folder of a run
        run: PathBuf,
    },
    /// Print the JSON schema of a case file, of summary.json or of a status
    Schema {
        /// Of what
        of: Schema,
    },
    /// The process in which TetGen runs; started by `mesh` and `run`
    #[cfg(feature = "tetgen")]
    #[command(hide = true, name = crate::meshers::TETGEN_WORKER)]
    TetgenWorker,
    /// Print the help of a command; `help case`: every key of the case file
    Help {
        /// A command, or `case`
        topic: Option<String>,
    },
    /// Print completions for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write manual pages into a folder
    Man {
        /// The folder
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

/// Names the keys of a command.
macro_rules! keys {
    ($name:ident, $keys:expr $(, $rest:ident = $value:expr)*) => {
        #[derive(Clone, Debug)]
        pub(crate) struct $name;
        impl Keys for $name {
            const KEYS: &'static [&'static str] = $keys;
            $(const $rest: keys!(@ $rest) = $value;)*
        }
    };
    (@ TILT) => { bool };
    (@ REQUIRED) => { &'static [&'static str] };
    (@ RENAMED) => { &'static [(&'static str, &'static str)] };
}

keys!(AcceptKeys, commands::dicom::KEYS);
keys!(
    SegmentKeys,
    commands::segment::KEYS,
    REQUIRED = &["ct"],
    RENAMED = &[("doubt", "--uncertainty")]
);
keys!(
    MeshKeys,
    commands::mesh::KEYS,
    REQUIRED = &["region.centre", "region.radius", "mesh.tetrahedra"],
    TILT = true,
    RENAMED = &[
        ("finer-in", "--refine tumour --tumour-centre X,Y,Z --tumour-radius R"),
        ("finer-edge", "--tumour-edge"),
        ("finer-growth", "--tumour-growth"),
    ]
);
keys!(SolveKeys, commands::solve::KEYS, TILT = true);
keys!(WarpKeys, commands::warp::KEYS, REQUIRED = &["ct"]);
keys!(CarryKeys, commands::carry::KEYS);

/// The page is served on loopback alone (127.0.0.1), and its address bears a key: who has the
/// address sees the patient, so hand it to nobody. Of the disk it sees what lies in the folder, or
/// beside the file. Ctrl-C ends it, as do twelve hours without a page. From another machine: `ssh
/// -L 9000:127.0.0.1:PORT HOST` with `--port PORT --no-browser`, then the address with 9000 for the
/// port.
#[derive(Args, Debug)]
pub(crate) struct Open {
    /// A folder of DICOM, which is looked through, a case file, or the folder of a run [default:
    /// the list of this folder]
    pub(crate) path: Option<PathBuf>,
    /// The port [default: any that is free]
    #[arg(long, value_name = "N")]
    pub(crate) port: Option<std::num::NonZeroU16>,
    /// Print the address and open no browser
    #[arg(long)]
    pub(crate) no_browser: bool,
    /// An archive that results can be sent to from the page; may be given several times
    #[arg(long, value_name = "AET@HOST:PORT")]
    pub(crate) node: Vec<supine_dicom_network::Node>,
}

#[derive(Args, Debug)]
pub(crate) struct Demo {
    /// Where the results go
    #[arg(long, value_name = "DIR", default_value = "supine-demo")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::INSPECT)]
pub(crate) struct Inspect {
    /// Folder or file
    pub(crate) path: PathBuf,
    /// Decode every slice too, and say whether its values can be HU
    #[arg(long)]
    pub(crate) pixels: bool,
    #[command(flatten)]
    pub(crate) given: Given<AcceptKeys>,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::INIT)]
pub(crate) struct Init {
    /// The CT: DICOM folder or a file of it, .nrrd, .nii.gz or .mha
    pub(crate) ct: PathBuf,
    /// RT structure set of the CT that holds the tumour
    #[arg(long, value_name = "RS.dcm")]
    pub(crate) structures: Option<PathBuf>,
    /// The tumour's region in the structure set; without one, a list of points (.mrk.json, .csv)
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) tumour: Option<String>,
    /// Radius of a tumour that is given by a point, mm
    #[arg(long = "tumour-radius", value_name = "MM", value_parser = radius)]
    pub(crate) radius: Option<f64>,
    /// The patient's side [default: that on which the tumour lies]
    #[arg(long, value_enum)]
    pub(crate) breast: Option<BreastSide>,
    /// The case file
    #[arg(long, value_name = "FILE", default_value = "case.toml")]
    pub(crate) out: PathBuf,
    /// Replace a case file that is there already
    #[arg(long)]
    pub(crate) overwrite: bool,
}

/// A radius in the words and the range of the case file.
fn radius(text: &str) -> Result<f64, String> {
    let mut spec = supine_flow::Spec::new("");
    spec.set_typed("tumour.radius", text).map_err(|e| e.to_string())?;
    text.trim().parse().map_err(|e| format!("{e}"))
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::CHECK)]
pub(crate) struct Check {
    /// The case file, or the summary.json of a run
    pub(crate) case: PathBuf,
    /// Another value for a key of the case, as for `run`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) changes: Vec<Change>,
    /// List the stages that a run into this folder would do
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::RUN)]
pub(crate) struct Run {
    /// The case file, or the summary.json of a run
    pub(crate) case: PathBuf,
    /// Where the results go
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Another value for a key of the case, as the case file has it or as a bare word: table.ap=5,
    /// 'table={ap=5,lat=2}', breast=left, 'exclude=["2-01.dcm"]'; a table sets each of its keys
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) changes: Vec<Change>,
    /// Take the patient out of all that leaves (PS3.15), as `export = { anonymise = true }` does
    #[arg(long)]
    pub(crate) anonymise: bool,
    /// End after this stage
    #[arg(long, value_name = "STAGE", value_parser = stages())]
    pub(crate) until: Option<NodeId>,
    /// Redo this stage and all that rest on it
    #[arg(long, value_name = "STAGE", value_parser = stages())]
    pub(crate) force: Option<NodeId>,
    /// Replace the finished result of another case in this folder; without, that is refused
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Repeat a summary.json although files that its run read have changed since; without, that is
    /// refused
    #[arg(long)]
    pub(crate) inputs_changed: bool,
    /// End with exit code 4 unless the verdict is green
    #[arg(long)]
    pub(crate) deny_warnings: bool,
    /// Tell at the end, however it ends, in this small JSON file for workflow engines: `supine
    /// schema status`
    #[arg(long, value_name = "FILE")]
    pub(crate) status: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Fit {
    /// The case file, or the summary.json of a run; it names scans = { sitting = … }
    pub(crate) case: PathBuf,
    /// Where the results go: a folder in which `run` goes on
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Another value for a key of the case, as for `run`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) changes: Vec<Change>,
    /// Replace the finished result of another case in this folder; without, that is refused
    #[arg(long)]
    pub(crate) overwrite: bool,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::SEGMENT)]
pub(crate) struct Segment {
    #[command(flatten)]
    pub(crate) given: Given<SegmentKeys>,
    /// A case file, for what is not given here
    #[arg(long, value_name = "CASE.toml")]
    pub(crate) case: Option<PathBuf>,
    /// Labels (.seg.nrrd, .nrrd, .nii.gz, .mha; .dcm: a DICOM segmentation of a DICOM CT)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
    /// How far the boundary of the chest wall may be wrong, tenths of mm (.nrrd)
    #[arg(long, value_name = "FILE")]
    pub(crate) uncertainty: Option<PathBuf>,
    /// Skin and chest wall between the voxels, for `mesh --surfaces`: signed distances, 1/2000 mm
    #[arg(long, value_name = "DIR")]
    pub(crate) surfaces: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Mesh {
    /// Labels (.seg.nrrd, .nrrd, .nii.gz, .mha); or --skin and --chest-wall
    #[arg(long, value_name = "FILE", required_unless_present = "skin",
          conflicts_with_all = ["skin", "chest_wall"])]
    pub(crate) labels: Option<PathBuf>,
    /// What `segment --surfaces` wrote beside the labels: the mesh then follows it between the
    /// voxels
    #[arg(long, value_name = "DIR", requires = "labels")]
    pub(crate) surfaces: Option<PathBuf>,
    /// Closed surface of the body, or of its soft tissue alone (.stl, .ply, .obj; mm)
    #[arg(long, value_name = "FILE", requires = "chest_wall")]
    pub(crate) skin: Option<PathBuf>,
    /// Closed surface of the chest wall (.stl, .ply, .obj; mm)
    #[arg(long, value_name = "FILE", requires = "skin")]
    pub(crate) chest_wall: Option<PathBuf>,
    /// Frame of surfaces whose files do not say it (3D Slicer's do)
    #[arg(long, value_enum, default_value = "lps", requires = "skin")]
    pub(crate) frame: Frame,
    #[command(flatten)]
    pub(crate) given: Given<MeshKeys>,
    /// The mesh (.vtu, .msh; .feb, .inp: with the default tissue, under its weight)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
    /// A page on the mesh's quality with its pictures, in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Coarsen {
    /// A mesh (.vtu, .msh) with its boundary tags: coarsened on its own surface; or the folder of a
    /// finished run: meshed again from its labels, nearer to the patient
    #[arg(value_name = "MESH|RUN")]
    pub(crate) from: PathBuf,
    /// Number of tetrahedra
    #[arg(long, value_name = "N")]
    pub(crate) tetrahedra: NonZeroUsize,
    /// The coarse mesh (.vtu, .msh, .feb, .inp)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
    /// A page on the mesh's quality with its pictures, in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Args, Debug)]
#[command(group(ArgGroup::new("target").args(["table", "sitting", "gravity"]).required(true)))]
pub(crate) struct Solve {
    /// The mesh (.vtu, .msh) with its boundary tags
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: PathBuf,
    /// The patient sits upright
    #[arg(long)]
    pub(crate) sitting: bool,
    /// Direction of gravity (LPS)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) gravity: Option<Numbers<3>>,
    #[command(flatten)]
    pub(crate) given: Given<SolveKeys>,
    /// Also how the displacement depends on the modulus: the field `displacement_per_kpa`
    #[arg(long)]
    pub(crate) sensitivity: bool,
    /// The same problem for another solver (.feb, .inp), before it is solved; with --rest net
    #[arg(long, value_name = "FILE")]
    pub(crate) problem: Option<PathBuf>,
    /// The deformed mesh (.vtu, .msh); with an interval of moduli also the fields
    /// `displacement_low_modulus` and `displacement_high_modulus`
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::WARP)]
pub(crate) struct Warp {
    #[command(flatten)]
    pub(crate) given: Given<WarpKeys>,
    /// The deformed mesh (.vtu, .msh): CT shape with point data `displacement`
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: PathBuf,
    /// Another grid of voxels this long, mm, along the CT's axes; for .nrrd, .nii, .nii.gz and .mha
    #[arg(long, value_name = "X,Y,Z")]
    pub(crate) spacing: Option<Numbers<3>>,
    /// Only the box of the tissue, before and after, and this much around it, mm; for files as
    /// above
    #[arg(long, value_name = "MM")]
    pub(crate) around: Option<f64>,
    /// Only slices between these positions, mm, z for axial slices; beyond the CT is air; for files
    /// as above
    #[arg(long, value_name = "FROM,TO", allow_hyphen_values = true)]
    pub(crate) axial: Option<Numbers<2>>,
    /// Also the map as fields on the voxels of the CT around what moves, both ways, and its
    /// Jacobian: .nrrd and .nii.gz, and as a transform of ITK (.mat), in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) fields: Option<PathBuf>,
    /// Also the map as DICOM registrations of the series with the CT, in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) registration: Option<PathBuf>,
    /// A folder for a DICOM series, or a .nrrd, .nii, .nii.gz or .mha file
    #[arg(long, value_name = "DIR|FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
}

#[derive(Args, Debug)]
#[command(after_long_help = examples::CARRY)]
pub(crate) struct Carry {
    /// The folder of a finished run, or a deformed mesh (.vtu, .msh with `displacement`)
    #[arg(value_name = "RUN|MESH", required_unless_present = "run", conflicts_with = "run")]
    pub(crate) from: Option<PathBuf>,
    /// What is known in the CT: points (.csv name,x,y,z in LPS mm; .mrk.json), labels or a dose
    /// (.seg.nrrd, .nrrd, .nii.gz, .mha), a closed surface (.stl, .ply, .obj), contours
    /// (.csv structure,contour,x,y,z), DICOM RT doses, structure sets and segmentations
    #[arg(value_name = "FILE", required_unless_present = "points", conflicts_with = "points")]
    pub(crate) what: Option<PathBuf>,
    /// The folder of a finished run, in place of RUN
    #[arg(long, value_name = "DIR")]
    pub(crate) run: Option<PathBuf>,
    /// Points, in place of FILE
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    /// The same on the operating table (points .csv or .mrk.json, labels .seg.nrrd, .nrrd, .nii.gz
    /// or .mha, dose .nrrd, .nii.gz or .mha, surface .stl, .ply or .obj, contours .csv); .dcm: the
    /// same kind of DICOM object, of the run's series
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) over: Over,
    /// The voxels in which labels come out
    #[arg(long, value_enum, default_value = "own")]
    pub(crate) grid: CarryGrid,
    /// What a volume is taken for [default: a dose if a value is not a whole number]
    #[arg(long = "as", value_enum)]
    pub(crate) kind: Option<CarryKind>,
    /// Frame of surfaces whose files do not say it (3D Slicer's do)
    #[arg(long, value_enum, default_value = "lps")]
    pub(crate) frame: Frame,
    #[command(flatten)]
    pub(crate) given: Given<CarryKeys>,
}

#[derive(Args, Debug)]
pub(crate) struct Over {
    /// Replace files that are there already; without, that is refused
    #[arg(long)]
    pub(crate) overwrite: bool,
}

#[derive(Args, Debug)]
pub(crate) struct VerifyExport {
    /// The exported series
    pub(crate) dir: PathBuf,
    /// The series it was made from; without it much cannot be checked
    #[arg(long, value_name = "DIR")]
    pub(crate) source: Option<PathBuf>,
    /// Expect a study of its own (`export = { study = "new" }`)
    #[arg(long)]
    pub(crate) new_study: bool,
    /// Expect the scanner as the equipment (`export = { equipment = "scanner" }`)
    #[arg(long)]
    pub(crate) keep_equipment: bool,
    /// Expect the source's frame of reference
    #[arg(long)]
    pub(crate) same_frame: bool,
    /// Expect values below -1024 HU to be clipped (`export = { padding = "clipped" }`)
    #[arg(long)]
    pub(crate) clip_padding: bool,
    #[command(flatten)]
    pub(crate) given: Given<AcceptKeys>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_tilt_beyond_its_range_is_refused_in_the_words_of_the_case_file() {
        let words = ["supine", "solve", "--mesh=m.vtu", "--out=d.vtu", "--table=900,5"];
        let told = Cli::try_parse_from(words).unwrap_err().to_string();
        assert!(told.contains("--table"), "{told}");
        let mut case = supine_flow::Spec::new("");
        let said = case.set("table.ap", &900.into()).unwrap_err().to_string();
        assert!(told.contains(&said), "{told} without {said}");
    }
}
