//! The commands that look at or go on from a run: `inspect`, `verify-export`, `carry`.

use crate::shared::{scratch, shared, summary};
use serde_json::Value;
use std::path::{Path, PathBuf};
use supine_tests::{Case, Outcome, files_below, source, supine};

#[test]
fn inspect_describes_the_series_as_data() {
    let said = supine(&[&"inspect", &source(), &"--json"]);
    let said = said.success("supine inspect --json");
    let value: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON and nothing else");
    assert!(value.to_string().contains("86"), "86 slices are named: {value}");
}

#[test]
fn of_two_series_in_a_folder_one_must_be_chosen() {
    let folder = scratch();
    let both = folder.path().join("both");
    std::fs::create_dir(&both).expect("the folder can be made");
    for series in [source(), shared().out.join("ct")] {
        for name in files_below(&series) {
            std::fs::copy(series.join(&name), both.join(&name)).expect("the series can be copied");
        }
    }
    let exported =
        summary(&shared().out)["export"]["series_uid"].as_str().expect("a UID").to_owned();
    let out = folder.path().join("out");
    let import = |case: &Case| {
        let case = case.write(folder.path());
        supine(&[&"run", &case, &"--out", &out, &"--until", &"import", &"--quiet"])
    };
    let case = Case::small().with_ct(&both);
    let said = import(&case);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains(&exported), "the choice is listed: {}", said.stderr);
    let chosen = |uid: &str| case.clone().with("series", &format!("'{uid}'"));
    let original =
        summary(&shared().out)["source"]["series_uid"].as_str().expect("a UID").to_owned();
    import(&chosen(&original)).success("the chosen series");
    let said = import(&chosen(&exported));
    assert!(said.stderr.contains("deformed by this program already"), "{}", said.stderr);
    let said = import(&case.with("series", "'1.2.3'"));
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("1.2.3") && said.stderr.contains(&exported), "{}", said.stderr);
}

#[test]
fn completions_and_manual_pages_come_from_the_arguments() {
    let said = supine(&[&"completions", &"bash"]).success("supine completions bash");
    assert!(said.stdout.contains("verify-export"), "{}", said.stdout);
    let folder = scratch();
    let pages = folder.path().join("man");
    supine(&[&"man", &"--out", &pages]).success("supine man");
    let pages = files_below(&pages);
    assert!(pages.iter().any(|page| page.ends_with("supine-run.1")), "{pages:?}");
    let page =
        std::fs::read_to_string(folder.path().join("man/supine-run.1")).expect("the page of run");
    for section in [
        ".SH EXAMPLES\nsupine run case.toml \\-\\-out result",
        ".SH EXIT STATUS\n0 done: the verdict is green or amber",
        ".SH FILES\n",
    ] {
        assert!(page.contains(section), "{section}: {page}");
    }
    // Each has its own, as its help has them.
    let page = std::fs::read_to_string(folder.path().join("man/supine-send.1")).expect("its page");
    assert!(page.contains("\n4 a run must not be used") && !page.contains("OUT/ct"), "{page}");
    let help = supine(&[&"help", &"send"]).success("supine help send").stdout;
    assert!(help.contains("\n  4   a run must not be used"), "{help}");
    assert_eq!(page.matches("supine send result").count(), 1, "an example once: {page}");
    assert_eq!(supine(&[&"send", &"--help"]).success("supine send --help").stdout, help);
}

fn verify(export: &Path, source: &Path) -> Outcome {
    supine(&[&"verify-export", &export, &"--source", &source])
}

#[test]
fn verify_export_passes_the_export() {
    verify(&shared().out.join("ct"), &source()).success("supine verify-export");
    let by_the_run = &summary(&shared().out)["export"]["verified"];
    let (passed, total) = (by_the_run["passed"].as_u64(), by_the_run["total"].as_u64());
    assert!(total > Some(20) && passed == total, "the run verified its export: {by_the_run}");
}

/// A copy of the exported series, spoiled.
fn spoiled(spoil: impl FnOnce(&[PathBuf])) -> tempfile::TempDir {
    let copy = scratch();
    let mut files = Vec::new();
    for name in files_below(&shared().out.join("ct")) {
        let to = copy.path().join(&name);
        std::fs::copy(shared().out.join("ct").join(&name), &to).expect("the series can be copied");
        files.push(to);
    }
    spoil(&files);
    copy
}

fn assert_found(copy: &tempfile::TempDir, what: &str) {
    let said = verify(copy.path(), &source());
    assert_eq!(said.code, Some(4), "{what}\n{}\n{}", said.stdout, said.stderr);
}

#[test]
fn verify_export_finds_a_missing_slice() {
    let copy = spoiled(|files| std::fs::remove_file(&files[40]).expect("a slice can go"));
    assert_found(&copy, "slice 40 is missing");
}

#[test]
fn verify_export_finds_slices_with_exchanged_pixels() {
    // Two slices swap their pixel data and nothing else: each file stays sound on its own.
    let copy = spoiled(|files| {
        let (a, b) = (&files[20], &files[60]);
        let (mut x, mut y) = (std::fs::read(a).expect("read"), std::fs::read(b).expect("read"));
        let pixels = 256 * 256 * 2;
        assert!(x.len() > pixels && y.len() > pixels, "the pixels are uncompressed");
        let (from_x, from_y) = (x.len() - pixels, y.len() - pixels);
        x[from_x..].swap_with_slice(&mut y[from_y..]);
        std::fs::write(a, x).expect("written");
        std::fs::write(b, y).expect("written");
    });
    assert_found(&copy, "two slices exchanged their pixels");
}

#[test]
fn verify_export_finds_the_source_passed_off_as_the_export() {
    let said = verify(&source(), &source());
    assert_eq!(said.code, Some(4), "{}\n{}", said.stdout, said.stderr);
}

/// Name and position of each row of a point list.
fn points(path: &Path) -> Vec<(String, [f64; 3])> {
    let text = std::fs::read_to_string(path).expect("the point list is read");
    let mut lines = text.lines();
    let header = lines.next().expect("there is a header");
    assert!(header.starts_with("name,x,y,z"), "{header}");
    lines
        .map(|line| {
            let mut cells = line.split(',');
            let name = cells.next().expect("a row has a name").to_owned();
            let number = |cell: Option<&str>| -> f64 {
                cell.and_then(|c| c.trim().parse().ok()).expect("a row has three numbers")
            };
            (name, [(); 3].map(|()| number(cells.next())))
        })
        .collect()
}

#[test]
fn carried_points_move_with_the_tumour() {
    let folder = scratch();
    let (given, carried) = (folder.path().join("given.csv"), folder.path().join("carried.csv"));
    // The tumour's centre as in the case, and a point deep in the chest, which is held.
    let rows = "name,x,y,z\ntumour,91.37,-248.09,-594.5\nspine,0.0,-120.0,-594.5\n";
    std::fs::write(&given, rows).expect("the points can be written");
    supine(&[&"carry", &"--run", &shared().out, &"--points", &given, &"--out", &carried])
        .success("supine carry");
    let carried = points(&carried);
    assert_eq!(carried[0].0, "tumour");
    assert_eq!(carried[1], ("spine".to_owned(), [0.0, -120.0, -594.5]));
    let summary = summary(&shared().out);
    for axis in 0..3 {
        let after = summary["tumour"]["after_mm"][axis].as_f64().expect("the tumour's place");
        assert!((carried[0].1[axis] - after).abs() < 2e-3, "{carried:?} and {summary:?}");
    }
    let moved = summary["tumour"]["distance_mm"].as_f64().expect("the tumour's way");
    assert!((0.5..30.0).contains(&moved), "the tumour moved by {moved} mm");
}

#[test]
fn a_run_and_its_mesh_are_coarsened_with_their_displacement() {
    let folder = scratch();
    let (run, coarse) = (&shared().out, folder.path().join("coarse.vtu"));
    let fine = run.join("mesh/deformed.vtu");
    let volume = |of: &Value| of["volume_ml"].as_f64().expect("a volume");
    for from in [run, &fine] {
        let said = supine(&[
            &"coarsen",
            from,
            &"--tetrahedra",
            &"800",
            &"--out",
            &coarse,
            &"--overwrite",
            &"--json",
        ]);
        let said = said.success("supine coarsen");
        let facts: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON");
        assert_eq!((&facts["tetrahedra"], &facts["displacement"]), (&800.into(), &true.into()));
        let before = facts["source_volume_ml"].as_f64().expect("a volume");
        assert!((volume(&facts) / before - 1.0).abs() < 0.02, "{facts}");
        // The coarse mesh with its displacement is one that the next command takes.
        let again = folder.path().join("again.vtu");
        supine(&[&"coarsen", &coarse, &"--tetrahedra", &"500", &"--out", &again, &"--overwrite"])
            .success("supine coarsen, again");
    }
    let said =
        supine(&[&"coarsen", &fine, &"--tetrahedra", &"5000", &"--out", &coarse, &"--overwrite"]);
    assert_eq!(said.code, Some(3), "{}", said.stderr);
    let said = supine(&[
        &"coarsen",
        &folder.path(),
        &"--tetrahedra",
        &"800",
        &"--out",
        &coarse,
        &"--overwrite",
    ]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("not the folder of a finished run"), "{}", said.stderr);
}
