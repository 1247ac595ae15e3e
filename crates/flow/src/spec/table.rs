//! The one table of parameters. The case file, the options of the command line, `summary.json`, the
//! guide's table and the JSON schema are made from it.

use super::derived;
use super::parameter::row;
pub use super::parameter::{Kind, Parameter, Preset};
use Preset::{Absent, Required};
use supine_fem::Law;

/// The choice of `export.padding` that some systems need.
pub(crate) const CLIPPED: &str = "clipped";
/// What confirms that the source's frame of reference is wanted: to be typed in full.
pub(crate) const SAME_FRAME: &str = "source, although the breast has moved in it";

/// The modulus that a tissue may have, kPa: the range of [`supine_fem::Tissue::check`].
const MODULUS: Kind = Kind::Number { min: 0.001, max: 1e6 };
/// Beyond these tilts of a table, degrees, a typing error is likelier than a patient.
const TILT: Kind = Kind::Number { min: -90.0, max: 90.0 };
/// Radii of spheres within a patient, mm.
const RADIUS: Kind = Kind::Number { min: 0.1, max: 500.0 };
/// Beyond these radii of a tumour, mm, a diameter or a typing error is likelier than a breast that
/// is operated.
const TUMOUR_RADIUS: Kind = Kind::Number { min: 0.5, max: 50.0 };

/// All parameters, in the order in which they are shown.
pub static TABLE: &[Parameter] = &[
    row(
        ("ct", "ct"),
        Kind::File,
        "",
        Required,
        "the CT: DICOM folder or a file of it, .nrrd, .nii.gz or .mha",
    ),
    row(
        ("series", "series"),
        Kind::Text,
        "",
        Absent("the only one"),
        "Series Instance UID, when the folder holds several series",
    ),
    row(
        ("exclude", "exclude"),
        Kind::Names,
        "",
        Absent("none"),
        "files of the CT to leave out, by their paths below its folder",
    ),
    row(
        ("assume_hu", "assume-hu"),
        Kind::Switch,
        "",
        Preset::Switch(false),
        "take stored values for HU where Rescale Slope and Intercept are missing; air must then lie near -1000",
    ),
    row(
        ("equalise_steps", "equalise-steps"),
        Kind::Switch,
        "",
        Preset::Switch(false),
        "interpolate slices at unequal steps, or with one missing, to equal steps (up to 10 mm apart)",
    ),
    row(("breast", "breast"), Kind::Choice(&["left", "right"]), "", Required, "the patient's side"),
    row(
        ("table.ap", "table-ap"),
        TILT,
        "degrees",
        Required,
        "tilt of the table: positive raises the head",
    ),
    row(
        ("table.lat", "table-lat"),
        TILT,
        "degrees",
        Required,
        "tilt of the table: positive lowers the patient's left side",
    ),
    row(
        ("tumour.centre", "tumour-centre"),
        Kind::Point,
        "mm",
        Preset::RequiredOr("tumour.structure"),
        "centre of the tumour in the CT (LPS)",
    ),
    row(
        ("tumour.radius", "tumour-radius"),
        TUMOUR_RADIUS,
        "mm",
        Preset::RequiredOr("tumour.structure"),
        "radius of the tumour",
    ),
    row(
        ("tumour.structure", "tumour-structure"),
        Kind::Text,
        "",
        Absent("centre and radius"),
        "name of the tumour's region in a structure set: its centroid is the centre, the radius that of the sphere of its volume",
    ),
    row(
        ("tumour.file", "tumour-file"),
        Kind::File,
        "",
        Absent("centre and radius"),
        "RT structure set of the CT that holds this region",
    ),
    row(
        ("report.seen", "seen"),
        Kind::Names,
        "",
        Absent("none"),
        "warnings that the planner has looked at, as the page ticks them: the report says so",
    ),
    row(
        ("tolerance", "tolerance"),
        Kind::Number { min: 0.1, max: 50.0 },
        "mm",
        Preset::Number(2.0),
        "error of the tumour's position, at 95 % probability, up to which the verdict is green",
    ),
    row(
        ("region.centre", "centre"),
        Kind::Point,
        "mm",
        Absent("found from the breast"),
        "centre of the sphere that is modelled (LPS)",
    ),
    row(
        ("region.radius", "radius"),
        RADIUS,
        "mm",
        Absent("found from the breast"),
        "radius of the sphere that is modelled",
    ),
    row(
        ("mesh.tetrahedra", "tetrahedra"),
        Kind::Whole { min: 1, max: 2_000_000 },
        "",
        Preset::Whole(5000),
        "number of tetrahedra",
    ),
    row(
        ("mesh.order", "order"),
        Kind::Whole { min: 1, max: 2 },
        "",
        Preset::Whole(2),
        "order of the displacement within a tetrahedron: 1 linear, 2 quadratic",
    ),
    row(
        ("mesh.geometry", "geometry"),
        Kind::Choice(&["straight", "curved"]),
        "",
        Preset::Choice("straight"),
        "geometry of the elements on skin and chest wall: curved ones follow the surface between their corners (order 2, mechanics only)",
    ),
    row(
        ("mesh.mesher", "mesher"),
        Kind::Choice(&["native", "cgal", "tetgen"]),
        "",
        Preset::Choice("native"),
        "what makes the tetrahedra; cgal and tetgen in programs built with them",
    ),
    row(
        ("mesh.piece", "piece"),
        Kind::Choice(&["largest", "centre"]),
        "",
        Preset::Choice("largest"),
        "which of several separate pieces of soft tissue in the sphere: the largest, or the one that holds the centre",
    ),
    row(
        ("mesh.refine", "refine"),
        Kind::Choice(&["none", "tumour", "goal"]),
        "",
        Preset::Choice("none"),
        "where the tetrahedra are smaller: in and around the tumour, or where its displacement depends on them",
    ),
    row(
        ("mesh.tumour_edge", "tumour-edge"),
        Kind::Number { min: 0.1, max: 50.0 },
        "mm",
        Absent("4"),
        "longest edge wanted in the tumour, with refine = \"tumour\"",
    ).derived(derived::tumour_edge),
    row(
        ("mesh.tumour_growth", "tumour-growth"),
        Kind::Number { min: 0.05, max: 2.0 },
        "mm/mm",
        Absent("0.5"),
        "growth of that length with the distance from the tumour, with refine = \"tumour\"",
    ).derived(derived::tumour_growth),
    row(("tissue.young", "young"), MODULUS, "kPa", Absent("0.609"), "Young's modulus").derived(derived::young),
    row(
        ("tissue.poisson", "poisson"),
        Kind::Number { min: 0.0, max: 0.4998 },
        "",
        Preset::Number(0.45),
        "Poisson's ratio",
    ),
    row(
        ("tissue.density", "density"),
        Kind::Number { min: 1.0, max: 20_000.0 },
        "kg/m3",
        Preset::Number(1000.0),
        "density",
    ),
    row(
        ("tissue.law", "law"),
        Kind::Choice(&Law::NAMES),
        "",
        Preset::Choice(Law::NeoHookean.name()),
        "how tissue resists beyond small strain: all but neo-hookean stiffen",
    ),
    row(
        ("tissue.stiffening", "stiffening"),
        Kind::Number { min: 0.001, max: 20.0 },
        "",
        Absent("1.5"),
        "how much the shear modulus grows by unit of Q = tr C - 3 - 2 ln J at small strain, with a law that stiffens",
    ).derived(derived::stiffening),
    row(
        ("tissue.fibres", "fibres"),
        Kind::Number { min: 0.0, max: 1000.0 },
        "",
        Preset::Number(0.0),
        "Young's modulus that fibres from the chest wall to the skin add along themselves in tension, over that of the tissue; 0: none",
    ),
    row(
        ("tissue.fibre_stiffening", "fibre-stiffening"),
        Kind::Number { min: 0.001, max: 100.0 },
        "",
        Absent("1"),
        "k of the fibres, how fast they stiffen, with fibres",
    ).derived(derived::fibre_stiffening),
    row(
        ("tissue.rest", "rest"),
        Kind::Choice(&["net", "unloaded"]),
        "",
        Preset::Choice("net"),
        "rest state: net takes the CT shape as free of stress, unloaded finds the shape without gravity first",
    ).derived(derived::rest),
    row(
        ("tissue.cut", "cut"),
        Kind::Choice(&["spring", "free", "fixed"]),
        "",
        Preset::Choice("spring"),
        "what stands for the tissue beyond the sphere: springs, nothing, or everything held",
    ),
    row(
        ("tissue.spring", "spring"),
        Kind::Number { min: 0.0, max: 1e6 },
        "kPa/mm",
        Absent("that of a layer as thick as the cut"),
        "stiffness of the springs, with cut = \"spring\"",
    ),
    row(
        ("tissue.map", "map"),
        Kind::Choice(&["none", "labels", "hu"]),
        "",
        Preset::Choice("none"),
        "a modulus for each tissue, from the finer labels or from the HU between fat and gland",
    ),
    row(
        ("tissue.fat", "fat"),
        MODULUS,
        "kPa",
        Absent("in proportion"),
        "Young's modulus of fat, with a map; with `scans.sitting` the moduli say proportions, and are fitted if none is given",
    ).derived(derived::modulus::<0>),
    row(
        ("tissue.gland", "gland"),
        MODULUS,
        "kPa",
        Absent("1.5 x fat"),
        "Young's modulus of gland, with a map",
    ).derived(derived::modulus::<1>),
    row(
        ("tissue.skin", "skin"),
        MODULUS,
        "kPa",
        Absent("16 x fat"),
        "Young's modulus of skin, with a map",
    ).derived(derived::modulus::<2>),
    row(
        ("tissue.tumour", "tumour"),
        MODULUS,
        "kPa",
        Absent("6 x fat"),
        "Young's modulus of the tumour, with a map",
    ).derived(derived::modulus::<3>),
    row(
        ("tissue.young_interval", "young-interval"),
        Kind::Interval { min: 0.001, max: 1e6 },
        "kPa",
        Absent("that of published moduli, 0.23 to 2.43"),
        "interval that holds the modulus of this patient with 95 % probability",
    ),
    row(
        ("scans.sitting", "sitting"),
        Kind::File,
        "",
        Absent("the modulus is not fitted"),
        "surface scan of the patient sitting upright, arms and torso as in the CT (.ply, .stl, .obj): the modulus is fitted to it",
    ),
    row(
        ("scans.supine", "supine"),
        Kind::File,
        "",
        Absent("nothing"),
        "surface scan of the patient lying as in the CT, held against the skin of the CT",
    ),
    row(
        ("scans.intraop", "intraop"),
        Kind::File,
        "",
        Absent("nothing"),
        "surface scan of the patient on the operating table: the CT's skin, the default tissue's and the result's are held against it",
    ),
    row(
        ("scans.landmarks", "landmarks"),
        Kind::File,
        "",
        Absent("poses are searched"),
        "landmarks of the scans and the CT (.json), three or more that each scan and the CT have",
    ),
    row(
        ("scans.unit", "unit"),
        Kind::Choice(&["auto", "mm", "cm", "m", "inch"]),
        "",
        Preset::Choice("auto"),
        "unit of length of the scans and their landmarks; auto: mm or m, by the size of the scan",
    ).derived(derived::scan_unit),
    row(
        ("seeds.file", "seeds"),
        Kind::Files,
        "",
        Absent("automatic"),
        "seeds: .mrk.json, .csv, .seg.nrrd, .nrrd, .nii.gz, .mha or a folder of masks",
    ),
    row(
        ("seeds.chest_wall", "chest-wall-seeds"),
        Kind::Points,
        "mm",
        Absent("none"),
        "points in the chest wall (LPS)",
    ),
    row(
        ("seeds.soft_tissue", "soft-tissue-seeds"),
        Kind::Points,
        "mm",
        Absent("none"),
        "points in the soft tissue (LPS)",
    ),
    row(
        ("seeds.exclude", "exclude-seeds"),
        Kind::Points,
        "mm",
        Absent("none"),
        "points on what is no part of the patient (LPS)",
    ),
    row(
        ("seeds.strokes", "strokes"),
        Kind::Strokes,
        "",
        Absent("none"),
        "strokes of a brush, as the page paints them: tissue chest_wall, soft_tissue, exclude or erase; a later one counts",
    ),
    row(
        ("labels.file", "labels"),
        Kind::File,
        "",
        Absent("automatic"),
        "your own segmentation: label map, DICOM segmentation or structure set",
    ),
    row(
        ("labels.body", "body"),
        Kind::Names,
        "",
        Absent("by type, code and name"),
        "regions of that file that are the body",
    ),
    row(
        ("labels.soft_tissue", "soft-tissue"),
        Kind::Names,
        "",
        Absent("the body without the chest wall"),
        "regions of that file that are the soft tissue",
    ),
    row(
        ("labels.chest_wall", "chest-wall-regions"),
        Kind::Names,
        "",
        Absent("by type, code and name"),
        "regions of that file that are the chest wall",
    ),
    row(
        ("tissues", "tissues"),
        Kind::Switch,
        "",
        Preset::Switch(false),
        "label fat, gland, skin, tumour and implant too, for the report",
    ).derived(derived::tissues),
    row(
        ("warp.interpolation", "interpolation"),
        Kind::Choice(&["cubic", "linear", "lanczos3"]),
        "",
        Preset::Choice("cubic"),
        "between voxels: linear blurs edges and noise most, lanczos3 least, which is slow",
    ),
    row(
        ("carry.points", "points"),
        Kind::Files,
        "",
        Absent("none"),
        "points to carry along: .csv name,x,y,z or .mrk.json",
    ),
    row(("carry.dose", "dose"), Kind::Files, "", Absent("none"), "RT doses to carry along"),
    row(
        ("carry.structures", "structures"),
        Kind::Files,
        "",
        Absent("none"),
        "RT structure sets to carry along",
    ),
    row(
        ("carry.segmentation", "segmentation"),
        Kind::Files,
        "",
        Absent("none"),
        "DICOM segmentations to carry along",
    ),
    row(
        ("export.anonymise", "anonymise"),
        Kind::Switch,
        "",
        Preset::Switch(false),
        "take the patient out of all that leaves (PS3.15)",
    ),
    row(
        ("export.study", "study"),
        Kind::Choice(&["source", "new"]),
        "",
        Preset::Choice("source"),
        "the study of the exported series",
    ),
    row(
        ("export.equipment", "equipment"),
        Kind::Choice(&["supine", "scanner"]),
        "",
        Preset::Choice("supine"),
        "the equipment that the exported series names",
    ),
    row(
        ("export.frame", "frame-of-reference"),
        Kind::Choice(&["new", SAME_FRAME]),
        "",
        Preset::Choice("new"),
        "the frame of reference of the exported series",
    ),
    row(
        ("export.padding", "padding"),
        Kind::Choice(&["source", CLIPPED]),
        "",
        Preset::Choice("source"),
        "what the source has below -1024 HU, outside the reconstruction circle: as it is there, or clipped to -1024 HU",
    ),
    row(
        ("export.registration", "registrations"),
        Kind::Switch,
        "",
        Absent("true"),
        "registrations with the CT beside the exported series; not with its frame of reference",
    ).derived(derived::registration),
    row(
        ("export.structures", "regions"),
        Kind::Switch,
        "",
        Preset::Switch(true),
        "a structure set of body, chest wall, breast and tumour beside the exported series",
    ),
    row(
        ("export.pdf", "pdf"),
        Kind::Switch,
        "",
        Preset::Switch(false),
        "what the report says first, as a PDF in a DICOM object beside the exported series",
    ),
    row(
        ("export.clock", "clock"),
        Kind::Text,
        "",
        Absent("the time of the run"),
        "date and time that the exported objects bear, YYYY-MM-DD HH:MM:SS",
    ).derived(derived::clock),
];

/// The place of a key in the table.
pub(crate) fn position(key: &str) -> Option<usize> {
    TABLE.iter().position(|p| p.key == key)
}

impl Parameter {
    /// The table it stands in, if any, and its name there.
    pub fn path(&self) -> (Option<&'static str>, &'static str) {
        match self.key.split_once('.') {
            Some((table, name)) => (Some(table), name),
            None => (None, self.key),
        }
    }

    /// What is expected, in words: range, unit, choices.
    pub fn expected(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.kind {
            Kind::Switch => "true or false".into(),
            Kind::Number { min, max } => format!("a number from {min} to {max}{unit}"),
            Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
            Kind::Choice(choices) => {
                let quoted: Vec<String> = choices.iter().map(|c| format!("\"{c}\"")).collect();
                format!("one of {}", quoted.join(", "))
            }
            Kind::Text => "a text".into(),
            Kind::Point => "three numbers [x, y, z], mm".into(),
            Kind::Points => "a list of positions [[x, y, z], ...], mm".into(),
            Kind::Strokes => "a list of { tissue, radius, points }, mm".into(),
            Kind::Interval { min, max } => {
                format!("two ascending numbers from {min} to {max}{unit}")
            }
            Kind::File => "a file or folder".into(),
            Kind::Files => "a file or folder, or a list of them".into(),
            Kind::Names => "a name, or a list of names".into(),
        }
    }

    /// What holds when it is not given, in words.
    pub fn default_text(&self) -> String {
        match self.default {
            Required => "required".into(),
            Preset::RequiredOr(other) => format!("required, or `{other}`"),
            Absent(what) => what.into(),
            Preset::Switch(on) => on.to_string(),
            Preset::Number(x) => x.to_string(),
            Preset::Whole(n) => n.to_string(),
            Preset::Choice(word) => format!("\"{word}\""),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn keys_and_options_are_unique_and_defaults_fit() {
        let keys: BTreeSet<_> = TABLE.iter().map(|p| p.key).collect();
        let options: BTreeSet<_> = TABLE.iter().map(|p| p.option).collect();
        assert_eq!((keys.len(), options.len()), (TABLE.len(), TABLE.len()));
        for p in TABLE {
            let fits = match (p.default, p.kind) {
                (Required | Preset::RequiredOr(_) | Absent(_), _)
                | (Preset::Switch(_), Kind::Switch) => true,
                (Preset::Number(x), Kind::Number { min, max }) => (min..=max).contains(&x),
                (Preset::Whole(n), Kind::Whole { min, max }) => (min..=max).contains(&n),
                (Preset::Choice(word), Kind::Choice(all)) => all[0] == word,
                _ => false,
            };
            assert!(fits, "{}", p.key);
        }
    }

    #[test]
    fn the_ranges_of_the_tissue_are_those_of_the_mechanics() {
        let check = |set: &dyn Fn(&mut supine_fem::Tissue)| {
            let mut tissue = supine_fem::Tissue::default();
            set(&mut tissue);
            tissue.check().is_ok()
        };
        for (key, set) in [
            ("tissue.young", (|t, v| t.young_kpa = v) as fn(&mut supine_fem::Tissue, f64)),
            ("tissue.poisson", |t, v| t.poisson = v),
            ("tissue.density", |t, v| t.density_kg_m3 = v),
        ] {
            let Kind::Number { min, max } = TABLE[position(key).unwrap()].kind else { panic!() };
            for (value, good) in
                [(min, true), (max, true), (min - 1e-3, false), (max * 1.01, false)]
            {
                assert_eq!(check(&|t| set(t, value)), good, "{key} = {value}");
            }
        }
    }
}
