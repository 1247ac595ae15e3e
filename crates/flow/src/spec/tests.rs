//! The case file as people write it.

use super::*;
use supine_mesh::Order;
use supine_space::Side;

const MINIMAL: &str = "ct = 'ct'\nbreast = 'left'\ntable = { ap = 7.0, lat = 5.0 }\n\
                       tumour = { centre = [1.0, 2.0, 3.0], radius = 10.0 }\n";

fn read(text: &str) -> Result<Case, CaseError> {
    let spec = Spec::from_text(text, "/cases")?;
    spec.check_complete()?;
    spec.case()
}

fn with(line: &str) -> Result<Case, CaseError> {
    read(&format!("{MINIMAL}{line}\n"))
}

#[test]
fn four_keys_suffice() {
    let case = read(MINIMAL).unwrap();
    assert_eq!(case.breast, Some(Side::Left));
    assert_eq!(case.mesh.order, Order::Quadratic);
    assert!((case.tissue.young_kpa - 0.609).abs() < 1e-12);
    assert_eq!(case.ct.as_deref(), Some(Path::new("ct")), "as typed; the session knows the folder");
    assert!(read(&MINIMAL.replace("7.0", "7")).is_ok(), "whole numbers are numbers");
}

#[test]
fn what_is_missing_is_named() {
    for (taken, key) in
        [("ct", "ct"), ("breast", "breast"), ("table", "table.ap"), ("tumour", "tumour.centre")]
    {
        let kept: Vec<&str> = MINIMAL.lines().filter(|l| !l.starts_with(taken)).collect();
        let error = read(&kept.join("\n")).unwrap_err().to_string();
        assert!(error.starts_with(&format!("`{key}` is missing")), "{error}");
    }
    let error = read("ct = 'ct'\n").unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines[0], "`breast`, `table.ap`, `tumour.centre` are missing; add");
    assert!(lines[1].starts_with("  breast = \"left\"   # the patient's side"), "{error}");
    assert!(lines[2].contains("table = { ap = 7.0, lat = 5.0 }") && lines.len() == 4, "{error}");
    let half = MINIMAL.replace(", lat = 5.0", "");
    assert!(read(&half).unwrap_err().to_string().contains("`table.lat` is missing"));
}

#[test]
fn halves_of_tables_are_named_at_once_with_lines_to_put_in_their_place() {
    let half = MINIMAL.replace(", lat = 5.0", "").replace(", radius = 10.0", "");
    let error = read(&half.replace("breast = 'left'\n", "")).unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines[0], "`breast`, `table.lat`, `tumour.radius` are missing; add");
    assert!(lines[2].starts_with("  table = { ap = 7.0, lat = 5.0 }   # in place of"), "{error}");
    assert!(
        lines[3].starts_with("  tumour = { centre = [1.0, 2.0, 3.0], radius = 9.0 }"),
        "{error}"
    );
    assert_eq!(lines.len(), 4, "{error}");
    let added: String = lines[1..].iter().map(|line| format!("{line}\n")).collect();
    assert!(read(&format!("ct = 'ct'\n{added}")).is_ok(), "the lines make a case: {added}");
    let drawn = "ct = 'ct'\nbreast = 'left'\ntable = { ap = 7, lat = 5 }\n\
                 tumour = { structure = 'GTV \"a\"' }\nregion = { radius = 90 }\n";
    let error = read(drawn).unwrap_err().to_string();
    assert!(error.starts_with("`tumour.file`, `region.centre` are missing"), "{error}");
    assert!(error.contains("tumour = { structure = 'GTV \"a\"', file = 'file.dcm' }"), "{error}");
}

#[test]
fn what_people_type_by_habit_is_explained() {
    let told = |line: &str| {
        let key = line.split(' ').next().unwrap();
        let kept: Vec<&str> = MINIMAL.lines().filter(|l| !l.starts_with(key)).collect();
        read(&format!("{}\n{line}\n", kept.join("\n"))).unwrap_err().to_string()
    };
    for (line, words) in [
        ("table = { ap = 7,0, lat = 5,0 }", "decimal point: 7.0, not 7,0"),
        (
            "table = { ap = \"7,0\", lat = 5.0 }",
            "`table.ap`: \"7,0\" is not a number from -180 to 180 degrees; numbers",
        ),
        ("tumour = { centre = [91,4, -248,1, -594,5], radius = 9.0 }", "decimal point"),
        ("ct = \"C:\\data\\ct\"", "single quotation marks"),
        ("ct = \"C:\\new\\tct\"", "single quotation marks"),
        ("ct = '~other/ct'", "only `~/` stands for your home"),
    ] {
        assert!(told(line).contains(words), "{line}: {}", told(line));
    }
    if cfg!(not(windows)) {
        let text = told("ct = 'C:\\data\\ct'");
        assert!(text.contains("that is a path of Windows"), "{text}");
    }
}

#[test]
fn a_path_may_begin_at_home_where_there_is_one() {
    let of = |home: Option<&str>| hint::path_of("~/labels.nrrd", home.map(PathBuf::from));
    assert_eq!(of(Some("/users/ms")), Path::new("/users/ms/labels.nrrd"));
    for none in [None, Some("")] {
        assert!(!hint::usable(of(none).to_str().unwrap()), "it cannot be used");
    }
    // Whatever home who tests has, and if none.
    let home = std::env::var_os("HOME").filter(|home| !home.is_empty());
    let read = with("labels = '~/labels.nrrd'").ok().map(|case| case.labels.unwrap().file);
    assert_eq!(read, home.map(|home| Path::new(&home).join("labels.nrrd")));
}

#[test]
fn labels_are_a_file_or_a_file_with_names() {
    let labels = |text: &str| with(text).unwrap().labels.unwrap();
    let plain = labels("labels = 'l.seg.nrrd'");
    assert!(plain.file.ends_with("l.seg.nrrd") && plain.names == Default_::default());
    let named = labels("labels = { file = 'rs.dcm', body = 'Ext', chest_wall = ['A', 'B'] }");
    assert_eq!(named.names.body, ["Ext"]);
    assert_eq!(named.names.chest_wall, ["A", "B"]);
    let error = with("labels = { file = 'x', chestwall = 'A' }").unwrap_err().to_string();
    assert!(error.contains("`labels.chest_wall`"), "{error}");
    assert!(with("labels = { body = 'A' }").unwrap_err().to_string().contains("`labels.file`"));
}

type Default_ = crate::shared::RegionNames;

#[test]
fn seeds_are_files_and_points_together() {
    let seeds = with("seeds = { file = ['a.csv', 'masks'], exclude = [[1, 2, 3]] }").unwrap().seeds;
    assert_eq!((seeds.files.len(), seeds.points.len()), (2, 1));
    assert_eq!(with("seeds = 'a.csv'").unwrap().seeds.files.len(), 1);
}

#[test]
fn moduli_by_tissue_are_kpa_or_proportions() {
    let stiffness = |text: &str| {
        let case = with(&format!("tissue = {{ {text} }}")).unwrap();
        assert_eq!(case.tissues, case.stiffness.is_some());
        case.stiffness
    };
    assert_eq!(stiffness("map = 'none'"), None);
    let given = stiffness("map = 'labels', fat = 0.5, gland = 2.2").unwrap();
    assert_eq!((given.mean_kpa, given.map), (None, StiffnessMap::Labels));
    assert_eq!(given.kpa[..2], [0.5, 2.2]);
    let proportions = stiffness("map = 'hu', young = 0.8").unwrap();
    assert_eq!((proportions.mean_kpa, proportions.kpa[0]), (Some(0.8), 1.0));
    assert!((given.kpa[2] / given.kpa[0] - proportions.kpa[2]).abs() < 1e-12);
}

#[test]
fn each_bad_value_names_its_key() {
    for (line, key) in [
        ("mesh = { tetrahedra = 0 }", "mesh.tetrahedra"),
        ("mesh = { order = 3 }", "mesh.order"),
        ("mesh = { order = 1, geometry = 'curved' }", "mesh.geometry"),
        ("mesh = { sides = 'curved' }", "mesh.geometry"),
        ("mesh = { mesher = 'magic' }", "mesh.mesher"),
        ("mesh = { refine = 'tumor' }", "mesh.refine"),
        ("mesh = { refine = 'tumour', tumour_edge = 0 }", "mesh.tumour_edge"),
        ("mesh = { refine = 'goal', tumour_growth = 0.3 }", "mesh.tumour_growth"),
        ("warp = { interpolation = 'spline' }", "warp.interpolation"),
        ("tissue = { poisson = 0.5 }", "tissue.poisson"),
        ("tissue = { map = 'label' }", "tissue.map"),
        ("tissue = { gland = 2.0 }", "tissue.map"),
        ("tissue = { map = 'labels', gland = 2.0 }", "tissue.fat"),
        ("tissue = { map = 'labels', fat = 0.5, young = 0.6 }", "tissue.young"),
        ("tissue = { map = 'hu', fat = 0.5, skin = -1 }", "tissue.skin"),
        ("tissue = { young_interval = [0.9, 0.4] }", "tissue.young_interval"),
        ("tissue = { young_interval = [0.4, 0.6] }", "tissue.young_interval"),
        ("tissue = { young = 3.0, young_interval = [0.4, 0.9] }", "tissue.young_interval"),
        ("tissue = { rest = 'nett' }", "tissue.rest"),
        ("tissue = { cut = 'sprung' }", "tissue.cut"),
        ("tissue = { stiffening = 2.0 }", "tissue.stiffening"),
        ("tissue = { fibre_stiffening = 2.0 }", "tissue.fibre_stiffening"),
        ("tissue = { fibre_direction = [1, 0, 0] }", "tissue.fibre_direction"),
        ("tissue = { fibres = 1.0, fibre_direction = [0, 0, 0] }", "tissue.fibre_direction"),
        ("tissue = { law = 'gent', stiffening = 0.0 }", "tissue.stiffening"),
        ("wall = { shear = 0.1 }", "wall.shear"),
        ("wall = { hold = 'sliding', radius = 0.0 }", "wall.radius"),
        ("skin = { thickness = 2.0 }", "skin.thickness"),
        ("dose = { at = 20.0 }", "dose.at"),
        ("skin = { young = 90.0, stretch = 0.9 }", "skin.stretch"),
        ("tissue = { spring = -1.0 }", "tissue.spring"),
        ("tissue = { cut = 'free', spring = 0.1 }", "tissue.spring"),
        ("region = { centre = [0, 0, 0], radius = -1 }", "region.radius"),
        ("export = { frame = 'source' }", "export.frame"),
        ("tisue = { young = 1.0 }", "tissue"),
        ("seeds = { chest_wall = [[1, 2]] }", "seeds.chest_wall"),
    ] {
        let error = with(line).unwrap_err().to_string();
        assert!(error.contains(&format!("`{key}`")), "{line}: {error}");
    }
    let error = read(&MINIMAL.replace("breast", "brest")).unwrap_err().to_string();
    assert!(error.contains("`breast`"), "{error}");
    let error = read(&MINIMAL.replace("ap = 7.0", "ap = 700.0")).unwrap_err().to_string();
    assert!(error.contains("`table.ap`") && error.contains("-180 to 180"), "{error}");
}

/// The canonical form makes the same case again, and names every key that a case gives.
#[test]
fn the_canonical_form_makes_the_same_case() {
    for line in [
        "",
        "series = '1.2'\nexclude = ['2-01.dcm']\nassume_hu = true\nequalise_steps = true\ntissues = true",
        "region = { centre = [1, 2, 3.5], radius = 90 }\nmesh = { tetrahedra = 900, geometry = 'curved' }",
        "mesh = { refine = 'tumour', tumour_edge = 3.5, order = 1 }",
        "mesh = { refine = 'goal' }\ntissue = { cut = 'free', rest = 'unloaded', young = 0.4 }",
        "tissue = { map = 'labels', fat = 0.5, skin = 9, spring = 0.1 }",
        "tissue = { map = 'hu', young = 0.7, young_interval = [0.3, 2] }",
        "seeds = { file = 'x.csv', chest_wall = [[1, 2, 3]], exclude = [[4, 5, 6]] }",
        "labels = { file = 'rs.dcm', body = 'B', chest_wall = ['C', 'D'] }",
        "carry = { points = 'p.csv', dose = ['a', 'b'], structures = 's', segmentation = 'g' }",
        "export = { anonymise = true, study = 'new', equipment = 'scanner', registration = false }",
        "export = { frame = 'source, although the breast has moved in it' }",
        "export = { structures = false, pdf = true }",
        "warp = { interpolation = 'linear' }",
        "position = 'prone'",
        "wall = { hold = 'sliding' }\nskin = { young = 90.0 }",
        "wall = { hold = 'sliding', shear = 0.0, radius = 40.0, centre = [1, 2, 3] }\nskin = { young = 9.0, thickness = 2.0, stretch = 1.1 }",
    ] {
        let case = with(line).unwrap();
        let again = Spec::from_canonical(case.canonical(), "").unwrap().case().unwrap();
        assert_eq!(again, case, "{line}");
    }
}

#[test]
fn the_schema_has_every_key() {
    let schema = case_schema();
    for p in TABLE {
        let (table, name) = p.path();
        let found = match table {
            None => &schema["properties"][name],
            Some(table @ ("seeds" | "labels")) => {
                &schema["properties"][table]["anyOf"][1]["properties"][name]
            }
            Some(table) => &schema["properties"][table]["properties"][name],
        };
        assert!(found["description"].is_string(), "{}", p.key);
        assert!(guide_table().contains(&format!("| `{}` |", p.key)));
    }
    assert_eq!(schema["required"], serde_json::json!(["ct", "breast", "tumour"]));
    let ways = serde_json::json!([{ "required": ["table"] }, { "required": ["bed"] }]);
    assert_eq!(schema["allOf"][0]["oneOf"], ways);
    let none = |a: &str, b: &str| serde_json::json!({ "anyOf": [{ "required": [a] }, { "required": [b] }] });
    assert_eq!(
        schema["properties"]["tumour"]["oneOf"],
        serde_json::json!([
            { "required": ["centre", "radius"], "not": none("structure", "file") },
            { "required": ["structure", "file"], "not": none("centre", "radius") },
        ]),
        "a sphere or a region, never half of each"
    );
}

#[test]
fn the_guide_holds_the_table() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/PLANNERS_GUIDE.md");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(&guide_table()), "docs/PLANNERS_GUIDE.md must hold:\n{}", guide_table());
}

#[test]
fn the_canonical_form_says_every_key_that_applies() {
    let given = [
        "series = '1.2'\nassume_hu = true\nregion = { centre = [1.0, 2.0, 3.0], radius = 50.0 }\ntissues = true",
        "[mesh]\nrefine = 'tumour'\ntumour_edge = 3.0\ntumour_growth = 0.4",
        "[tissue]\nspring = 0.01\nyoung = 0.5\nyoung_interval = [0.4, 0.9]",
        "[tissue]\nlaw = 'exponential'\nstiffening = 2.0\nfibres = 0.5\nfibre_stiffening = 2.0\nfibre_direction = [0.0, 1.0, 0.0]",
        "[wall]\nhold = 'sliding'\ncentre = [1.0, 2.0, 3.0]\n[skin]\nyoung = 90.0",
        "[tissue]\nmap = 'labels'\nfat = 0.5\ngland = 1.0\nskin = 9.0\ntumour = 3.0",
        "[seeds]\nfile = 'a.csv'\nchest_wall = [[1.0, 2.0, 3.0]]\nsoft_tissue = [[1.0, 2.0, 9.0]]\nexclude = [[9.0, 2.0, 3.0]]\n\
         strokes = [{ tissue = 'exclude', radius = 6.0, points = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]] }]",
        "[labels]\nfile = 'l.nrrd'\nbody = 'b'\nsoft_tissue = 's'\nchest_wall = 'c'",
        "exclude = '2-01.dcm'\nreport = { seen = 'fade-0123' }",
        "[scans]\nsitting = 't.ply'\nsupine = 's.ply'\nintraop = 'i.ply'\nlandmarks = 'l.json'\nunit = 'm'",
        "export = { clock = '2026-03-01 12:00:00' }",
        "dose = { tolerance = 10.0 }",
        "[carry]\npoints = 'p.csv'\ndose = 'd.dcm'\nstructures = 's.dcm'\nsegmentation = 'g.dcm'",
    ];
    let mut cases: Vec<_> =
        given.iter().map(|line| with(line).unwrap().canonical().clone()).collect();
    let drawn = "tumour = { structure = 'GTV', file = 'RS.dcm' }";
    cases.push(Spec::from_text(drawn, "").unwrap().case().unwrap().canonical().clone());
    for p in TABLE {
        let pointer = format!("/{}", p.key.replace('.', "/"));
        let held = |case: &serde_json::Map<String, Json>| {
            Json::Object(case.clone()).pointer(&pointer).is_some()
        };
        assert!(cases.iter().any(held), "`{}` is in no canonical form", p.key);
    }
}

/// What a key says reaches the typed case: a row that nothing reads would be shown as if it had
/// been obeyed.
#[test]
fn every_key_reaches_the_case() {
    let beside = |key: &str| match key.split_once('.') {
        Some(("region", _)) => "region = { centre = [1.0, 2.0, 3.0], radius = 50.0 }",
        Some(("mesh", "tumour_edge" | "tumour_growth")) => "mesh = { refine = 'tumour' }",
        Some(("tissue", "fat" | "gland" | "skin" | "tumour")) => {
            "tissue = { map = 'labels', fat = 0.3 }"
        }
        Some(("tissue", "stiffening")) => "tissue = { law = 'gent' }",
        Some(("dose", "at")) => "dose = { tolerance = 10.0 }",
        Some(("tissue", "fibre_stiffening" | "fibre_direction")) => "tissue = { fibres = 2.0 }",
        Some(("wall", "shear" | "radius" | "centre")) => "wall = { hold = 'sliding' }",
        Some(("skin", "thickness" | "stretch")) => "skin = { young = 90.0 }",
        Some(("labels", _)) => "labels = { file = 'l.nrrd' }",
        Some(("scans", _)) => "scans = { sitting = 's.ply', intraop = 'i.ply' }",
        _ => "",
    };
    for parameter in TABLE {
        let before = with(beside(parameter.key)).unwrap();
        let mut spec =
            Spec::from_text(&format!("{MINIMAL}\n{}", beside(parameter.key)), "").unwrap();
        let other = match parameter.kind {
            Kind::Switch => (parameter.default != Preset::Switch(true)).into(),
            Kind::Number { min, .. } => min.max(0.37).into(),
            Kind::Whole { .. } => 1.into(),
            Kind::Choice(words) => words[words.len() - 1].into(),
            Kind::Text | Kind::File | Kind::Files | Kind::Names => "other".into(),
            Kind::Point => vec![4.0, 5.0, 6.0].into(),
            Kind::Points => serde_json::json!([[4.0, 5.0, 6.0]]),
            Kind::Strokes => {
                serde_json::json!([{ "tissue": "exclude", "radius": 6.0, "points": [[1.0, 2.0, 3.0]] }])
            }
            Kind::Interval { .. } => vec![0.5, 0.7].into(),
        };
        let other = match parameter.key {
            "export.clock" => "2026-03-01 14:05:00".into(),
            "skin.stretch" => 1.5.into(),
            "export.registration" => false.into(),
            // Programs are built with the native mesher alone.
            "mesh.mesher" => continue,
            _ => other,
        };
        if parameter.key.starts_with("tumour.") {
            continue;
        }
        spec.set(parameter.key, &other).unwrap();
        if spec.case().unwrap().without_canonical() == before.without_canonical() {
            assert!(is_asked(parameter.key), "nothing reads `{}`", parameter.key);
        }
    }
}

/// Whether a node asks the case for the value of a key as it stands.
fn is_asked(key: &str) -> bool {
    let nodes = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/nodes");
    let sources = std::fs::read_dir(nodes).unwrap().map(|entry| entry.unwrap().path());
    let asks = ["number", "names"].map(|of| format!(".{of}(\"{key}\")"));
    sources
        .map(|path| std::fs::read_to_string(path).unwrap())
        .any(|source| asks.iter().any(|asked| source.contains(asked.as_str())))
}

#[test]
fn a_modulus_is_fitted_or_given_but_not_both() {
    let sitting = "scans = { sitting = 't.ply' }";
    let both = with(sitting).unwrap().fit_scans().unwrap().states.clone();
    assert_eq!(both.len(), 2);
    let one = with(&format!("{sitting}\ntissue = {{ rest = 'net' }}")).unwrap();
    assert_eq!(one.fit_scans().unwrap().states, [supine_fem::RestState::Net]);
    for tissue in ["young = 0.5", "young_interval = [0.4, 0.9]"] {
        let text = format!("{sitting}\ntissue = {{ {tissue} }}");
        assert!(with(&text).unwrap_err().to_string().contains("scans.sitting"), "{tissue}");
    }
    for alone in ["supine = 's.ply'", "landmarks = 'l.json'", "intraop = 'i.ply', supine = 's.ply'"]
    {
        let told = with(&format!("scans = {{ {alone} }}")).unwrap_err().to_string();
        assert!(told.contains("scans.sitting"), "{told}");
    }
    // Moduli of tissues are proportions then.
    let by = |keys: &str| {
        let case = with(&format!("{sitting}\ntissue = {{ map = 'labels'{keys} }}")).unwrap();
        case.stiffness.unwrap()
    };
    let given = by(", fat = 0.5, gland = 2.0");
    assert!(given.given && given.mean_kpa == Some(0.609) && given.kpa[1] / given.kpa[0] == 4.0);
    assert!(!by("").given);
    // A scan of the result says nothing of the modulus.
    let held = with("scans = { intraop = 'i.ply' }\ntissue = { young = 0.5 }").unwrap();
    assert!(held.fit_scans().is_none() && held.tissue.young_kpa == 0.5);
}

/// The workflow knows by it which keys there are and which of them name files.
#[test]
fn the_schema_that_the_workflow_has_is_that_of_the_program() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workflow/schemas/case.schema.json");
    let kept: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert_eq!(kept, case_schema(), "supine schema case > workflow/schemas/case.schema.json");
}

#[test]
fn arms_and_breath_are_what_a_case_says_of_them() {
    let posture = |text: &str| Spec::from_text(text, "").unwrap().case().unwrap().posture;
    let of = |arms_moved, breathing_mm| PostureSpec { arms_moved, breathing_mm };
    assert_eq!(posture(""), of(0.5, 2.0));
    assert_eq!(posture("posture = { arms = 'as in the CT', breathing = 0 }"), of(0.0, 0.0));
    assert_eq!(posture("posture = { arms = 'moved' }"), of(1.0, 2.0));
    assert_eq!(posture("posture = { arms = 'unknown', breathing = 3.5 }"), of(0.5, 3.5));
}

#[test]
fn laws_are_held_against_a_scan_where_the_case_names_none() {
    let laws = |more: &str| {
        let text = format!("scans = {{ sitting = \"s.ply\" }}\n{more}");
        Spec::from_text(&text, "").unwrap().case().unwrap().fit_scans().unwrap().laws
    };
    assert!(laws("") && laws("tissue = { rest = 'net' }"));
    let summary = "tissue = { law = 'neo-hookean', map = 'none' }\nwall = { hold = 'held' }";
    assert!(laws(summary), "the defaults as a summary has them");
    let unwanted = "scans = { sitting = \"s.ply\", laws = false }";
    let unwanted = Spec::from_text(unwanted, "").unwrap().case().unwrap();
    assert!(!unwanted.fit_scans().unwrap().laws);
    for own in [
        "tissue = { law = 'gent', stiffening = 0.3 }",
        "tissue = { fibres = 1.0 }",
        "tissue = { map = 'hu' }",
        "wall = { hold = 'sliding' }",
        "skin = { young = 30.0 }",
    ] {
        assert!(!laws(own), "{own}");
    }
}

#[test]
fn a_patient_who_is_said_to_lean_back_bears_gravity_towards_her_back() {
    let case = |text: &str| Spec::from_text(text, "").unwrap().case();
    let leans = case("scans = { sitting = 's.ply', lean = 30.0 }").unwrap();
    let load = leans.load_of_sitting();
    let [x, y, z]: [f64; 3] = load.target.into();
    assert!(x.abs() < 1e-12 && (y - 0.5).abs() < 1e-12 && z < -0.8, "{load:?}");
    assert_eq!(leans.number("scans.lean"), Some(30.0));
    let upright = case("scans = { sitting = 's.ply' }").unwrap().load_of_sitting();
    assert!((upright.target - supine_space::sitting()).norm() < 1e-12);
    let told = case("scans = { intraop = 's.ply', lean = 30.0 }").unwrap_err().to_string();
    assert!(told.contains("scans.sitting"), "{told}");
}

#[test]
fn a_tolerance_of_the_dose_is_one_of_the_place() {
    let of = |text: &str| Spec::from_text(text, "").unwrap().case().unwrap();
    let mm = |text: &str| of(text).tolerance.mm();
    assert!((mm("") - 2.0).abs() < 1e-12 && (mm("tolerance = 0.7") - 0.7).abs() < 1e-12);
    let dose = "dose = { tolerance = 10.0 }";
    assert!((mm(dose) - 17.5 * (1.0 - 1.1f64.powf(-1.0 / 3.0))).abs() < 1e-12);
    assert!(mm("dose = { tolerance = 10.0, at = 25.0 }") > mm(dose));
    assert!((mm(&format!("tolerance = 0.3\n{dose}")) - 0.3).abs() < 1e-12);
    // What was not asked is not shown as if it had been.
    assert!(of(dose).number("tolerance").is_none() && of("").number("dose.at").is_none());
}
