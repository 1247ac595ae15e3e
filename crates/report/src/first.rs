//! What a planner reads first: the verdict, how far the tumour moves, how sure that is, and where
//! to look.

use crate::canvas::Rgb;
use crate::palette;
use crate::place::at;
use crate::summary::{Colour, Reason, Summary, TumourInterval, UncertainPatch, WallUncertainty};
use crate::tables::Table;
use crate::verdict::{held, seen_near_mm};
use crate::words::{capital, directions, fixed, triple};
use supine_record::{DoseTolerance, ModulusOrigin, UncertaintySource};

/// What stands above everything.
pub(crate) const BANNER: &str = "DERIVED, SIMULATED IMAGES. Not acquired, research software. Compare with the source CT \
                                 before any use.";
/// What is shown, and in which frame.
pub(crate) const ABOUT: &str = "CT of the patient on her back, moved by simulation to the tilt of the operating table. \
                                Positions in mm in the patient frame LPS of the CT (x to the patient's left, y to the \
                                back, z to the head).";
/// Heading of what the result must not be used for.
pub(crate) const NOT_FOR: &str = "Must not be used for";
/// The colours in the first pictures.
pub(crate) const LEGEND: [(Rgb, &str); 3] = [
    (palette::BEFORE, "tumour, estimated nipple in the CT"),
    (palette::AFTER, "on the operating table"),
    (palette::REGION, "region (dashed)"),
];
/// The further ones in the slice viewer.
pub(crate) const VIEWER_LEGEND: [(Rgb, &str); 3] = [
    (palette::CHEST_WALL, "chest wall, white where uncertain"),
    (palette::SKIN, "mesh's skin"),
    (palette::CUT, "cut: the end of what is simulated"),
];
/// The grey of the pictures.
pub(crate) const WINDOW: &str = "CT window \u{2212}200 to 200 HU";

/// Number of columns of the uncertain places before those of the seeds.
pub(crate) const BEFORE_SEEDS: usize = 5;
/// Title of the uncertain places.
pub(crate) const PLACES: &str = "Uncertain places of the chest wall";

/// The first screen.
#[derive(Debug)]
pub(crate) struct First {
    /// Which breast it is about, and where.
    pub(crate) title: String,
    /// `good`, `check` or `stop`: the class that colours the verdict.
    pub(crate) class: &'static str,
    /// In three words.
    pub(crate) headline: String,
    /// Why, a line each, with the place to look at as the viewer reads it.
    pub(crate) reasons: Vec<(String, Option<String>)>,
    /// How far the tumour moves.
    pub(crate) moves: String,
    /// With which probability and why.
    pub(crate) sure: String,
    /// What each source of uncertainty does.
    pub(crate) shares: Option<Table>,
    /// The uncertain places of the chest wall.
    pub(crate) places: Option<Table>,
    /// Their middles as the viewer reads them, by row.
    pub(crate) middles: Vec<String>,
}

impl First {
    pub(crate) fn new(s: &Summary) -> Self {
        let class = match s.verdict.colour {
            Colour::Green => "good",
            Colour::Amber => "check",
            Colour::Red => "stop",
        };
        Self {
            title: format!("{} breast on the operating table", capital(&s.position.breast)),
            class,
            headline: headline(s),
            reasons: s.verdict.reasons.iter().map(told).collect(),
            moves: moves(s),
            sure: sure(s),
            shares: shares(s),
            places: places(s),
            middles: patches(s).into_iter().map(|patch| at(patch.centre_mm)).collect(),
        }
    }
}

/// The verdict in a few words, its colour before a colon: `Amber: look before use`.
pub fn headline(s: &Summary) -> String {
    match s.verdict.colour {
        Colour::Green => green(s),
        Colour::Amber => "Amber: look before use".into(),
        Colour::Red => "Red: do not use".into(),
    }
}

/// Within the tolerance, and on what that rests.
fn green(s: &Summary) -> String {
    let given = s.tumour_interval.as_ref().map(|interval| &interval.modulus);
    given.filter(|modulus| modulus.origin == ModulusOrigin::Given).map_or(
        "Green: within the tolerance".into(),
        |modulus| {
            let [low, high] = modulus.young_kpa.map(|kpa| fixed(kpa, 2));
            format!("Green: within the tolerance, if the modulus is {low} to {high} kPa as the case says")
        },
    )
}

/// A reason with what it is worth at the tumour and its place.
fn told(reason: &Reason) -> (String, Option<String>) {
    let place = reason.place_mm.map(|place| format!(" Look at {} mm.", triple(place, 1)));
    (reason.told() + &place.unwrap_or_default(), reason.place_mm.map(at))
}

/// How far the tumour moves, with its interval.
pub fn moves(s: &Summary) -> String {
    let Some(m) = &s.tumour else { return "The case names no tumour.".into() };
    if held(s) {
        return "The tumour does not move.".into();
    }
    let Some(interval) = &s.tumour_interval else {
        return format!(
            "The tumour moves {} mm; how sure that is, is not known.",
            fixed(m.distance_mm, 1)
        );
    };
    let [low, high] = interval.length_mm.map(|mm| fixed(mm, 1));
    let level = fixed(100.0 * interval.level, 0);
    format!("The tumour moves {} mm ({level} %: {low} to {high} mm)", fixed(m.distance_mm, 1))
}

fn sure(s: &Summary) -> String {
    let (Some(m), Some(interval)) = (&s.tumour, &s.tumour_interval) else { return String::new() };
    let level = fixed(100.0 * interval.level, 0);
    format!(
        "{}. With {level} % probability its centre lies within {} mm of the place shown; {} mm are asked for{}. The white \
         ellipse holds it as likely.",
        capital(&directions(m.displacement_mm)),
        fixed(interval.within_mm, 1),
        fixed(s.verdict.tolerance_mm, 1),
        s.verdict.dose.as_ref().map_or(String::new(), so_that)
    )
}

/// Why that tolerance, where it was asked as dose.
fn so_that(dose: &DoseTolerance) -> String {
    format!(
        ", so that the dose {} mm from the applicator's centre is right to {} %",
        fixed(dose.at_mm, 1),
        fixed(dose.percent, 0)
    )
}

fn shares(s: &Summary) -> Option<Table> {
    let interval = s.tumour_interval.as_ref()?;
    let modulus = &interval.modulus;
    let [low, high] = modulus.young_kpa.map(|kpa| fixed(kpa, 2));
    // Pairs of soft tissue and unloaded state that cannot be are among no draws of all sources.
    let more = interval.shares.iter().any(|share| share.within_mm > interval.within_mm);
    let title = match more {
        true => {
            "What makes it uncertain, each alone; together less, as soft tissue and the unloaded state exclude each other"
        }
        false => "What makes it uncertain, each alone",
    };
    let mut t = Table::list(title, &["Source", "Tumour moves, mm", "Off by up to, mm"]);
    for share in &interval.shares {
        use UncertaintySource as Of;
        let source = match (share.source, modulus.origin) {
            (Of::Modulus, ModulusOrigin::Literature) => {
                format!("Modulus: not measured, {low} to {high} kPa as in nine published patients")
            }
            (Of::Modulus, ModulusOrigin::Scans) => {
                format!("Modulus: {low} to {high} kPa by the scans")
            }
            (Of::Modulus, ModulusOrigin::Given) => format!("Modulus: {low} to {high} kPa as given"),
            (Of::RestState, _) => rest_state(interval),
            (Of::Tissues, _) => "Tissues: gland, skin and tumour in proportion to fat".into(),
            (Of::ChestWall, _) => "Chest wall: its place in the CT".into(),
            (Of::Region, _) => "Region: the tissue beyond its sphere".into(),
            (Of::Mesh, _) => "Mesh: its coarseness".into(),
            (Of::Law, _) => law(s),
            (Of::Arms, _) => arms(s),
            (Of::Breath, _) => "Breath".into(),
        };
        let [low, high] = share.length_mm.map(|mm| fixed(mm, 1));
        t.rows.push(vec![source, format!("{low} to {high}"), fixed(share.within_mm, 1)]);
    }
    Some(t)
}

/// What is known of the law of the tissue.
fn law(s: &Summary) -> String {
    match s.fit.as_ref().map_or(0, |fit| fit.laws.len()) {
        0 => "Law: how breasts resist, and how they hang on the chest wall".into(),
        n => format!(
            "Law: what {n} laws held against the scan leave open, and what none of them says"
        ),
    }
}

/// What is known of the arms.
fn arms(s: &Summary) -> String {
    let word = s.case.get("posture").and_then(|posture| posture.get("arms"));
    let seen = s.evaluation.as_ref().and_then(seen_near_mm);
    match (seen, word.and_then(|word| word.as_str())) {
        (Some(_), _) => "Arms: as far as the scan on the table lets them".into(),
        (None, Some("moved")) => "Arms: moved since the CT".into(),
        (None, _) => "Arms: not known whether they lie as in the CT".into(),
    }
}

fn rest_state(interval: &TumourInterval) -> String {
    let Some(other) = &interval.other_rest else {
        return match interval.modulus.origin {
            ModulusOrigin::Scans => "Rest state: by the scans, or as the case says".into(),
            ModulusOrigin::Literature | ModulusOrigin::Given => {
                "Rest state: as given with the modulus".into()
            }
        };
    };
    if other.displacement_mm.is_some() {
        return "Rest state: net or unloaded".into();
    }
    let from = interval.modulus.softest_unloaded_kpa;
    let from = from.map_or(String::new(), |kpa| format!(", from {} kPa on", fixed(kpa, 2)));
    format!(
        "Rest state: {} has no shape at this modulus; it counts with stiffer ones{from}",
        other.rest
    )
}

/// The uncertain places of the chest wall, what moves the tumour most first.
fn patches(s: &Summary) -> Vec<&UncertainPatch> {
    s.segmentation.uncertainty.iter().flat_map(WallUncertainty::ranked).collect()
}

/// The uncertain places of the chest wall with seeds to copy.
fn places(s: &Summary) -> Option<Table> {
    let title = format!(
        "{PLACES}. Pairs of seeds, each moved to the boundary that you see, make a place sure"
    );
    let mut t = Table::list(
        &title,
        &[
            "Where",
            "Middle (LPS), mm",
            "Area",
            "May be off by",
            "At the tumour",
            "Pairs",
            "Seeds to copy into the case file",
        ],
    );
    for (n, patch) in patches(s).into_iter().enumerate() {
        t.rows.push(vec![
            format!("{}: {}", n + 1, patch.place),
            triple(patch.centre_mm, 1),
            format!("{} cm²", fixed(patch.area_cm2, 1)),
            format!("{} mm", fixed(patch.error_mm, 0)),
            patch.effect_mm.map_or("not known".into(), |mm| format!("{} mm", fixed(mm, 2))),
            patch.seeds_mm.len().to_string(),
            seed_line(&patch.seeds_mm),
        ]);
    }
    (!t.rows.is_empty()).then_some(t)
}

/// More pairs than this nobody sets one by one.
const MOST_PAIRS: usize = 24;
/// What is said instead.
const PAINT: &str = "too large for points: paint chest wall and soft tissue on both sides of the boundary, as a segmentation, and \
                     name it as seeds.file";

/// `seeds = { chest_wall = [[1.0, 2.0, 3.0]], soft_tissue = [[1.0, -6.0, 3.0]] }`, with hyphens
/// that TOML reads; empty without pairs.
fn seed_line(pairs: &[[[f64; 3]; 2]]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    if pairs.len() > MOST_PAIRS {
        return PAINT.into();
    }
    let point = |p: [f64; 3]| format!("[{}]", p.map(|x| format!("{x:.1}")).join(", "));
    let side = |n: usize| pairs.iter().map(|pair| point(pair[n])).collect::<Vec<_>>().join(", ");
    format!("seeds = {{ chest_wall = [{}], soft_tissue = [{}] }}", side(0), side(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::Movement;
    use crate::summary::tests::example;

    #[test]
    fn the_seeds_stand_in_the_last_columns() {
        let places = First::new(&example()).places.unwrap();
        let [pairs, seeds] = places.head[BEFORE_SEEDS..] else { panic!("{:?}", places.head) };
        assert!(pairs == "Pairs" && seeds.starts_with("Seeds") && places.title.starts_with(PLACES));
        assert!(places.rows[0][0].starts_with("1: "));
    }

    #[test]
    fn no_displacement_stands_without_its_interval() {
        let first = First::new(&example());
        assert!(first.moves.contains("3.7 mm (95 %: 1.1 to 8.2 mm)"), "{}", first.moves);
        assert!(
            first.sure.contains("4.6 mm") && first.sure.contains("patient's left"),
            "{}",
            first.sure
        );
        assert_eq!(first.shares.unwrap().rows.len(), 4);
        let mut summary = example();
        summary.tumour_interval = None;
        assert!(First::new(&summary).moves.contains("not known"));
    }

    #[test]
    fn what_is_held_has_no_interval() {
        let mut summary = example();
        summary.tumour = Some(Movement::new([40.0, -30.0, 10.0], [40.0, -30.0, 10.0]));
        summary.tumour_interval = None;
        let first = First::new(&summary);
        assert_eq!((first.moves.as_str(), first.sure.as_str()), ("The tumour does not move.", ""));
        assert!(first.shares.is_none());
    }

    #[test]
    fn a_rest_state_without_a_shape_is_no_agreement() {
        let mut interval = example().tumour_interval.unwrap();
        interval.modulus.softest_unloaded_kpa = Some(0.649);
        if let Some(other) = &mut interval.other_rest {
            other.displacement_mm = None;
        }
        let told = rest_state(&interval);
        assert!(told.contains("no shape at this modulus") && told.contains("0.65 kPa"), "{told}");
    }

    #[test]
    fn green_by_an_interval_of_the_case_says_so() {
        let mut summary = example();
        if let Some(interval) = &mut summary.tumour_interval {
            (interval.modulus.origin, interval.modulus.young_kpa) =
                (ModulusOrigin::Given, [0.8, 1.0]);
        }
        summary.verdict.colour = Colour::Green;
        let first = First::new(&summary);
        assert!(
            first.headline.contains("if the modulus is 0.80 to 1.00 kPa"),
            "{}",
            first.headline
        );
    }

    #[test]
    fn seeds_can_be_copied_into_a_case_file() {
        let places = First::new(&example()).places.unwrap();
        let line = places.rows[0].last().unwrap();
        assert_eq!(
            line,
            "seeds = { chest_wall = [[55.0, -10.0, 31.0], [62.0, -10.0, 31.0]], \
             soft_tissue = [[55.0, -14.0, 31.0], [62.0, -14.0, 31.0]] }"
        );
    }
}
