//! What can be typed.

use crate::args_network::{Fetch, Send};
use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use supine_pipeline::Stage;

/// Gives the CT of a supine breast as it lies on the tilted operating table.
///
/// Research software: no clinical use is claimed. Lengths in mm, positions in the DICOM patient
/// frame (LPS), angles in degrees. Positive AP raises the head, positive LAT lowers the patient's
/// left side.
#[derive(Parser, Debug)]
#[command(name = "supine", version, arg_required_else_help = true, after_help = EXIT_CODES)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) common: Common,
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 the input cannot be used; 2 wrong usage; 3 the \
method failed; 4 a check failed, outputs are there; 5 an output cannot be written; 75 worth a \
retry; 130 interrupted.";

/// Options of every command.
#[derive(Args, Debug)]
pub(crate) struct Common {
    /// Number of threads [default: all cores]; the result does not depend on it
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Machine-readable result on stdout, nothing else there
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Only errors on stderr
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// More on stderr
    #[arg(long, short, global = true)]
    pub(crate) verbose: bool,
    /// No progress bar
    #[arg(long, global = true)]
    pub(crate) no_progress: bool,
}

#[derive(Subcommand, Debug)]
pub(crate) enum Command {
    /// The whole flow on the patient that comes with the program
    Demo(Demo),
    /// What is in a folder of DICOM, and whether it can be used
    Inspect(Inspect),
    /// The whole flow of a case file
    Run(Run),
    /// Labels of chest wall and soft tissue
    Segment(Segment),
    /// Tetrahedra of the soft tissue within a sphere
    Mesh(Mesh),
    /// Fewer tetrahedra of the same tissue, with the displacement carried over
    Coarsen(Coarsen),
    /// Displacement of a mesh under gravity
    Solve(Solve),
    /// A CT resampled through a deformed mesh
    Warp(Warp),
    /// Points, labels, doses, surfaces and contours carried by a finished run or a deformed mesh
    Carry(Carry),
    /// DICOM objects to an archive
    Send(Send),
    /// DICOM objects from an archive
    Fetch(Fetch),
    /// What no validator notices about an exported series
    VerifyExport(VerifyExport),
    /// The process in which TetGen runs; started by `mesh` and `run`
    #[cfg(feature = "tetgen")]
    #[command(hide = true, name = supine_pipeline::TETGEN_WORKER)]
    TetgenWorker,
    /// Completions for a shell, on stdout
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Manual pages, into a folder
    Man {
        /// The folder
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Demo {
    /// Where the results go
    #[arg(long, value_name = "DIR", default_value = "supine-demo")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Inspect {
    /// Folder or file
    pub(crate) path: PathBuf,
    /// Decode every slice too, and say whether its values can be HU
    #[arg(long)]
    pub(crate) pixels: bool,
    #[command(flatten)]
    pub(crate) accept: Accept,
}

#[derive(Args, Debug)]
pub(crate) struct Run {
    /// The case file
    pub(crate) case: PathBuf,
    /// Where the results go
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Take the patient out of all that leaves (PS3.15), as `export = { anonymise = true }` does
    #[arg(long)]
    pub(crate) anonymise: bool,
    /// End after this stage
    #[arg(long, value_name = "STAGE", value_parser = stage)]
    pub(crate) until: Option<Stage>,
    /// Redo this stage and all later ones
    #[arg(long, value_name = "STAGE", value_parser = stage)]
    pub(crate) force: Option<Stage>,
}

#[derive(Args, Debug)]
pub(crate) struct Segment {
    /// DICOM folder, NRRD or NIfTI file
    #[arg(long, value_name = "PATH")]
    pub(crate) ct: PathBuf,
    /// A case file, for its series and seeds
    #[arg(long, value_name = "CASE.toml")]
    pub(crate) case: Option<PathBuf>,
    /// Seeds (.mrk.json, .csv, .seg.nrrd, .nrrd, .nii.gz or a folder of masks), instead of the case's
    #[arg(long, value_name = "FILE")]
    pub(crate) seeds: Option<PathBuf>,
    /// Labels (.seg.nrrd, .nrrd, .nii.gz; .dcm: a DICOM segmentation of a DICOM CT)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Finer labels too: fat, gland, skin, the case's tumour; lung, bone, muscle
    #[arg(long)]
    pub(crate) tissues: bool,
    /// How far the boundary of the chest wall may be wrong, tenths of mm (.nrrd)
    #[arg(long, value_name = "FILE")]
    pub(crate) doubt: Option<PathBuf>,
    /// Skin and chest wall between the voxels: signed distances, 1/2000 mm, negative inside
    #[arg(long, value_name = "DIR")]
    pub(crate) surfaces: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Mesh {
    /// Labels (.seg.nrrd, .nrrd, .nii.gz); or --skin and --chest-wall
    #[arg(long, value_name = "FILE", required_unless_present = "skin",
          conflicts_with_all = ["skin", "chest_wall"])]
    pub(crate) labels: Option<PathBuf>,
    /// Closed surface of the body, or of its soft tissue alone (.stl, .ply, .obj; mm)
    #[arg(long, value_name = "FILE", requires = "chest_wall")]
    pub(crate) skin: Option<PathBuf>,
    /// Closed surface of the chest wall (.stl, .ply, .obj; mm)
    #[arg(long, value_name = "FILE", requires = "skin")]
    pub(crate) chest_wall: Option<PathBuf>,
    /// Frame of surfaces whose files do not say it (3D Slicer's do)
    #[arg(long, value_enum, default_value = "lps", requires = "skin")]
    pub(crate) frame: Frame,
    /// Centre of the sphere, mm (LPS)
    #[arg(long, value_name = "X,Y,Z", value_parser = three, allow_hyphen_values = true)]
    pub(crate) centre: Three,
    /// Radius of the sphere, mm
    #[arg(long, value_name = "R")]
    pub(crate) radius: f64,
    /// Number of tetrahedra
    #[arg(long, value_name = "N")]
    pub(crate) tetrahedra: NonZeroUsize,
    /// Which mesher
    #[arg(long, value_enum, default_value = "native")]
    pub(crate) mesher: Mesher,
    /// Which of several separate pieces of soft tissue in the sphere
    #[arg(long, value_enum, default_value = "largest")]
    pub(crate) piece: Piece,
    /// Finer in and around a ball: its centre and radius, mm (LPS); the number stays the one asked for
    #[arg(
        long, value_name = "X,Y,Z,R", value_parser = four, allow_hyphen_values = true,
        requires = "finer_edge"
    )]
    pub(crate) finer_in: Option<Four>,
    /// Longest edges wanted in that ball, mm
    #[arg(long, value_name = "MM", requires = "finer_in")]
    pub(crate) finer_edge: Option<f64>,
    /// Growth of that length with the distance from the ball, mm per mm
    #[arg(long, value_name = "G", default_value_t = 0.5)]
    pub(crate) finer_growth: f64,
    /// The mesh (.vtu, .msh; .feb, .inp: with the default tissue, under its weight)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
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
    /// A page on the mesh's quality with its pictures, in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) report: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Frame {
    /// Left, posterior, superior
    Lps,
    /// Right, anterior, superior
    Ras,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Piece {
    /// The largest
    Largest,
    /// The one that holds the centre
    Centre,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Mesher {
    /// Our own
    Native,
    /// CGAL (GPL), in programs built with the feature `cgal`
    Cgal,
    /// TetGen (AGPL), in programs built with the feature `tetgen`
    Tetgen,
}

impl From<Mesher> for supine_pipeline::Mesher {
    fn from(named: Mesher) -> Self {
        match named {
            Mesher::Native => Self::Native,
            Mesher::Cgal => Self::Cgal,
            Mesher::Tetgen => Self::Tetgen,
        }
    }
}

#[derive(Args, Debug)]
#[command(group(ArgGroup::new("gravity_given").required(true)))]
pub(crate) struct Solve {
    /// The mesh (.vtu, .msh) with its boundary tags
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: PathBuf,
    /// The table's tilt, degrees
    #[arg(long, value_name = "AP,LAT", group = "gravity_given", value_parser = two,
          allow_hyphen_values = true)]
    pub(crate) bed: Option<Two>,
    /// The patient sits upright
    #[arg(long, group = "gravity_given")]
    pub(crate) sitting: bool,
    /// Direction of gravity (LPS)
    #[arg(long, value_name = "X,Y,Z", group = "gravity_given", value_parser = three,
          allow_hyphen_values = true)]
    pub(crate) gravity: Option<Three>,
    /// Young's modulus, kPa
    #[arg(long, value_name = "KPA")]
    pub(crate) young: Option<f64>,
    /// Poisson's ratio
    #[arg(long, value_name = "NU")]
    pub(crate) poisson: Option<f64>,
    /// Density, kg/m³
    #[arg(long, value_name = "KG/M3")]
    pub(crate) density: Option<f64>,
    /// What the CT shape is taken for
    #[arg(long, value_enum, default_value = "net")]
    pub(crate) rest: Rest,
    /// Order of the displacement within a tetrahedron
    #[arg(long, value_name = "1|2", default_value = "2",
          value_parser = clap::value_parser!(u8).range(1..=2))]
    pub(crate) order: u8,
    /// What holds the cut
    #[arg(long, value_enum, default_value = "spring")]
    pub(crate) cut: Cut,
    /// Also how the displacement depends on the modulus: the field `displacement_per_kpa`
    #[arg(long)]
    pub(crate) sensitivity: bool,
    /// Also the displacement at both ends of an interval of moduli, kPa: the fields
    /// `displacement_low_modulus` and `displacement_high_modulus`
    #[arg(long, value_name = "LOW,HIGH", value_parser = two)]
    pub(crate) young_interval: Option<Two>,
    /// Stiffness of the springs of --cut spring, kPa/mm [default: that of the tissue beyond]
    #[arg(long, value_name = "KPA/MM")]
    pub(crate) spring: Option<f64>,
    /// The same problem for another solver (.feb, .inp), before it is solved; with --rest net
    #[arg(long, value_name = "FILE")]
    pub(crate) problem: Option<PathBuf>,
    /// The deformed mesh (.vtu, .msh)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rest {
    /// The CT shape is stress-free
    Net,
    /// The CT shape is loaded by supine gravity
    Unloaded,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Cut {
    /// Springs, for the tissue beyond
    Spring,
    /// Nothing
    Free,
    /// Everything
    Fixed,
}

#[derive(Args, Debug)]
pub(crate) struct Warp {
    /// DICOM folder, NRRD or NIfTI file
    #[arg(long, value_name = "PATH")]
    pub(crate) ct: PathBuf,
    /// Series Instance UID, when the folder holds several
    #[arg(long, value_name = "UID")]
    pub(crate) series: Option<String>,
    #[command(flatten)]
    pub(crate) accept: Accept,
    /// The deformed mesh (.vtu, .msh): CT shape with point data `displacement`
    #[arg(long, value_name = "FILE")]
    pub(crate) mesh: PathBuf,
    /// Between voxels
    #[arg(long, value_enum, default_value = "linear")]
    pub(crate) interpolation: Interpolation,
    /// Another grid of voxels this long, mm, along the CT's axes; for .nrrd, .nii and .nii.gz
    #[arg(long, value_name = "X,Y,Z", value_parser = three)]
    pub(crate) spacing: Option<Three>,
    /// Only the box of the tissue, before and after, and this much around it, mm; for files as above
    #[arg(long, value_name = "MM")]
    pub(crate) around: Option<f64>,
    /// Only slices between these positions, mm, z for axial slices; beyond the CT is air; for files as above
    #[arg(long, value_name = "FROM,TO", value_parser = two, allow_hyphen_values = true)]
    pub(crate) axial: Option<Two>,
    /// The breast's side, for a DICOM series
    #[arg(long, value_enum)]
    pub(crate) breast: Option<Breast>,
    /// Also the map as fields on the CT's grid, both ways, and its Jacobian: .nrrd and .nii.gz, in
    /// this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) fields: Option<PathBuf>,
    /// Take the patient out of the DICOM series (PS3.15)
    #[arg(long)]
    pub(crate) anonymise: bool,
    /// Also the map as DICOM registrations of the series with the CT, in this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) registration: Option<PathBuf>,
    /// A folder for a DICOM series, or a .nrrd, .nii or .nii.gz file
    #[arg(long, value_name = "DIR|FILE")]
    pub(crate) out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Interpolation {
    /// Trilinear
    Linear,
    /// Cubic convolution: sharper, keeps more of the noise
    Cubic,
    /// Lanczos-3: sharper still
    Lanczos3,
}

impl From<Interpolation> for supine_warp::Interpolation {
    fn from(named: Interpolation) -> Self {
        match named {
            Interpolation::Linear => Self::Linear,
            Interpolation::Cubic => Self::Cubic,
            Interpolation::Lanczos3 => Self::Lanczos3,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Breast {
    /// The patient's left
    Left,
    /// The patient's right
    Right,
}

#[derive(Args, Debug)]
pub(crate) struct Carry {
    /// The folder of a finished run, or a deformed mesh (.vtu, .msh with `displacement`)
    #[arg(value_name = "RUN|MESH", required_unless_present = "run", conflicts_with = "run")]
    pub(crate) from: Option<PathBuf>,
    /// What is known in the CT: points (.csv name,x,y,z in LPS mm; .mrk.json), labels or a dose
    /// (.seg.nrrd, .nrrd, .nii.gz), a closed surface (.stl, .ply, .obj), contours
    /// (.csv structure,contour,x,y,z), DICOM RT doses, structure sets and segmentations
    #[arg(value_name = "FILE", required_unless_present = "points", conflicts_with = "points")]
    pub(crate) what: Option<PathBuf>,
    /// The folder of a finished run, in place of RUN
    #[arg(long, value_name = "DIR")]
    pub(crate) run: Option<PathBuf>,
    /// Points, in place of FILE
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    /// The same on the operating table (points .csv or .mrk.json, labels .seg.nrrd, .nrrd or .nii.gz,
    /// dose .nrrd or .nii.gz, surface .stl, .ply or .obj, contours .csv); .dcm: the same kind of
    /// DICOM object, of the run's series
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// The CT before deformation (DICOM folder, NRRD or NIfTI): density for a dose; slices for contours
    /// and grid for labels, in place of the run's
    #[arg(long, value_name = "PATH")]
    pub(crate) ct: Option<PathBuf>,
    /// Series Instance UID, when the folder holds several
    #[arg(long, value_name = "UID", requires = "ct")]
    pub(crate) series: Option<String>,
    #[command(flatten)]
    pub(crate) accept: Accept,
    /// The voxels in which labels come out
    #[arg(long, value_enum, default_value = "own")]
    pub(crate) grid: CarryGrid,
    /// What a volume is taken for [default: a dose if a value is not a whole number]
    #[arg(long = "as", value_enum)]
    pub(crate) kind: Option<CarryKind>,
    /// Frame of surfaces whose files do not say it (3D Slicer's do)
    #[arg(long, value_enum, default_value = "lps")]
    pub(crate) frame: Frame,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum CarryGrid {
    /// Those of the label map
    Own,
    /// Those of the CT
    Ct,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum CarryKind {
    /// Numbers of labels, never mixed
    Labels,
    /// A dose or another quantity that can be interpolated
    Dose,
}

impl From<CarryKind> for supine_exchange::VolumeKind {
    fn from(named: CarryKind) -> Self {
        match named {
            CarryKind::Labels => Self::Labels,
            CarryKind::Dose => Self::Scalar,
        }
    }
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
    #[command(flatten)]
    pub(crate) accept: Accept,
}

/// What is accepted of a DICOM CT beyond what is safe.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct Accept {
    /// Take stored values for HU where Rescale Slope and Intercept are missing
    #[arg(long)]
    assume_hu: bool,
    /// Interpolate slices at unequal steps to equal ones
    #[arg(long)]
    equalise_steps: bool,
}

impl From<Accept> for supine_dicom::Accept {
    fn from(Accept { assume_hu, equalise_steps }: Accept) -> Self {
        Self { assume_hu, equalise_steps }
    }
}

/// Three numbers of one argument.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Three(pub(crate) [f64; 3]);

/// Four numbers of one argument.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Four(pub(crate) [f64; 4]);

/// Two numbers of one argument.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Two(pub(crate) [f64; 2]);

fn three(text: &str) -> Result<Three, String> {
    numbers(text).map(Three)
}

fn four(text: &str) -> Result<Four, String> {
    numbers(text).map(Four)
}

fn two(text: &str) -> Result<Two, String> {
    numbers(text).map(Two)
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parsed: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    parsed
        .and_then(|v| v.try_into().ok())
        .ok_or_else(|| format!("expected {N} numbers with commas between"))
}

fn stage(name: &str) -> Result<Stage, String> {
    Stage::ALL.into_iter().find(|s| s.name() == name).ok_or_else(|| {
        let names: Vec<&str> = Stage::ALL.iter().map(|s| s.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
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
    fn numbers_are_counted() {
        assert_eq!(numbers::<3>("-1, 2.5,3"), Ok([-1.0, 2.5, 3.0]));
        assert!(numbers::<3>("1,2").is_err());
        assert!(numbers::<2>("1,nan").is_err());
    }
}
