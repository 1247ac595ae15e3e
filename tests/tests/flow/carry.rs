//! `supine carry` on the shared run: every kind of thing, known by its ending and content.

use crate::shared::{scratch, shared, summary};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use supine_tests::{Outcome, readers_python, source, supine, supine_command};

/// Where the tumour was and where it is, LPS, mm.
fn tumour() -> [[f64; 3]; 2] {
    let summary = summary(&shared().out);
    let place = |of: &Value| [0, 1, 2].map(|a| of[a].as_f64().expect("a coordinate"));
    [place(&summary["position"]["tumour"]["centre_mm"]), place(&summary["tumour"]["after_mm"])]
}

/// Carries a file with the shared run; what the program says about it.
fn carry(what: &Path, out: &Path, more: &[&str]) -> Value {
    let mut words: Vec<&dyn AsRef<std::ffi::OsStr>> =
        vec![&"carry", &shared().out, &what, &"--out", &out, &"--overwrite", &"--json"];
    words.extend(more.iter().map(|word| word as &dyn AsRef<std::ffi::OsStr>));
    let said = supine(&words).success("supine carry");
    serde_json::from_str(&said.stdout).expect("stdout is JSON and nothing else")
}

fn off(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Two numbers, before and after.
fn pair(of: &Value) -> [f64; 2] {
    [0, 1].map(|n| of[n].as_f64().expect("a number"))
}

#[test]
fn markups_in_ras_are_carried_and_come_back_in_lps() {
    let folder = scratch();
    let (given, out) = (folder.path().join("given.mrk.json"), folder.path().join("out.mrk.json"));
    let [[x, y, z], after] = tumour();
    let markups = serde_json::json!({ "markups": [{
        "type": "Fiducial", "coordinateSystem": "RAS", "coordinateUnits": "mm",
        "controlPoints": [{ "id": "1", "label": "T", "position": [-x, -y, z] }],
    }] });
    std::fs::write(&given, markups.to_string()).expect("the markups are written");
    let facts = carry(&given, &out, &[]);
    assert_eq!((&facts["kind"], &facts["carried"]), (&"points".into(), &1.into()));
    let text = std::fs::read_to_string(&out).expect("the result is there");
    let result: Value = serde_json::from_str(&text).expect("it is JSON");
    let list = &result["markups"][0];
    assert_eq!(list["coordinateSystem"], "LPS");
    let found = [0, 1, 2].map(|a| list["controlPoints"][0]["position"][a].as_f64().expect("x"));
    assert!(off(found, after) < 1e-3, "{found:?} instead of {after:?}");
}

#[test]
fn labels_keep_their_volumes() {
    let folder = scratch();
    let labels = shared().out.join("labels.seg.nrrd");
    for (name, grid) in [("out.seg.nrrd", "own"), ("out.nii.gz", "ct")] {
        let out = folder.path().join(name);
        let facts = carry(&labels, &out, &["--grid", grid]);
        assert_eq!(facts["kind"], "labels");
        let rows = facts["labels"].as_array().expect("labels");
        assert_eq!(rows.len(), 2, "{facts}");
        for row in rows {
            let [before, after] = [&row["before_ml"], &row["after_ml"]].map(|v| v.as_f64());
            let (before, after) = (before.expect("a volume"), after.expect("a volume"));
            assert!((after / before - 1.0).abs() < 0.01, "{row}");
            // The chest wall is held, the soft tissue is not.
            assert_eq!(row["number"] == 2, (after - before).abs() < 1e-9, "{row}");
        }
        assert!(out.is_file());
    }
}

#[test]
fn a_dose_is_carried_with_its_totals() {
    let folder = scratch();
    let (given, out) = (folder.path().join("dose.nrrd"), folder.path().join("out.nii.gz"));
    let [centre, _] = tumour();
    let (n, step) = (21, 2.0);
    let mut text = format!(
        "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: {n} {n} {n}\n\
         space directions: ({step},0,0) (0,{step},0) (0,0,{step})\nkinds: domain domain domain\n\
         encoding: ascii\nspace origin: ({},{},{})\n\n",
        centre[0] - 20.0,
        centre[1] - 20.0,
        centre[2] - 20.0
    );
    for voxel in 0..n * n * n {
        let at = [voxel % n, voxel / n % n, voxel / (n * n)].map(|v| f64::from(v) * step - 20.0);
        let square: f64 = at.iter().map(|x| x * x).sum();
        writeln!(text, "{:.4}", 50.0 * (-square / 50.0).exp()).expect("a string takes it");
    }
    std::fs::write(&given, text).expect("the dose is written");
    let ct = source();
    let facts = carry(&given, &out, &["--ct", ct.to_str().expect("a path in UTF-8")]);
    assert_eq!(facts["kind"], "dose");
    let [before, after] = pair(&facts["integral_gy_ml"]);
    let exact = 50.0 * (50.0 * std::f64::consts::PI).powf(1.5) / 1000.0;
    assert!((before / exact - 1.0).abs() < 0.01, "{before} for {exact}");
    assert!((after / before - 1.0).abs() < 0.1, "{facts}");
    let [energy, _] = pair(&facts["energy_mj"]);
    assert!((0.85..1.1).contains(&(energy / before)), "soft tissue: {facts}");
    assert!(facts["warnings"][0].as_str().expect("a warning").contains("not computed anew"));
    // Without the CT there is no mass, and it says so.
    let facts = carry(&given, &out, &[]);
    assert_eq!(facts["energy_mj"], Value::Null);
    assert!(facts["warnings"][1].as_str().expect("a warning").contains("--ct"), "{facts}");
    // Far from the patient, as one in metres is.
    let text = std::fs::read_to_string(&given).expect("the dose");
    let [near, far] = [-20.0, 9980.0].map(|off| format!("space origin: ({},", centre[0] + off));
    assert!(text.contains(&near), "{near}");
    std::fs::write(&given, text.replace(&near, &far)).expect("the dose is written");
    let facts = carry(&given, &out, &[]);
    let first = facts["warnings"][0].as_str().expect("a warning");
    assert!(first.contains("does not reach what was simulated"), "{facts}");
    let difference = text.replace("\n50.0000\n", "\n-50.0000\n");
    assert!(difference != text, "the middle is there");
    std::fs::write(&given, difference).expect("the dose is written");
    let warnings = carry(&given, &out, &[])["warnings"].to_string();
    assert_eq!(warnings.matches("goes down to -50.00 Gy").count(), 1, "{warnings}");
}

#[test]
fn a_surface_round_the_tumour_moves_with_it() {
    let folder = scratch();
    let (given, out) = (folder.path().join("box.obj"), folder.path().join("out.stl"));
    let [centre, after] = tumour();
    let mut text = "# SPACE=LPS\n".to_owned();
    for n in 0..8 {
        let [x, y, z] = [0, 1, 2].map(|a| centre[a] + if n >> a & 1 == 1 { 5.0 } else { -5.0 });
        writeln!(text, "v {x} {y} {z}").expect("a string takes it");
    }
    for [a, b, c, d] in
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    {
        writeln!(text, "f {} {} {} {}", a + 1, b + 1, c + 1, d + 1).expect("a string takes it");
    }
    std::fs::write(&given, text).expect("the surface is written");
    let facts = carry(&given, &out, &[]);
    assert_eq!((&facts["kind"], &facts["moved_points"]), (&"surface".into(), &8.into()));
    assert!((facts["before_ml"].as_f64().expect("a volume") - 1.0).abs() < 1e-9);
    assert!((0.8..1.25).contains(&facts["after_ml"].as_f64().expect("a volume")), "{facts}");
    let most = facts["max_displacement_mm"].as_f64().expect("a length");
    assert!((most - off(centre, after)).abs() < 3.0, "{facts}");
    // What is written is a surface that can be carried again.
    let again = carry(&out, &folder.path().join("again.ply"), &[]);
    assert_eq!(again["warnings"], serde_json::json!([]));
}

#[test]
fn contours_come_out_in_the_slices_of_the_run() {
    let folder = scratch();
    let (given, out) = (folder.path().join("ctv.csv"), folder.path().join("out.csv"));
    let [centre, after] = tumour();
    let mut text = "structure,contour,x,y,z\n".to_owned();
    let radius = 8.0f64;
    let slices = (-3..=3).map(|n| f64::from(n) * 2.5);
    for (contour, dz) in slices.enumerate() {
        let r = (radius * radius - dz * dz).sqrt();
        for n in 0..60 {
            let (s, c) = (f64::from(n) * std::f64::consts::TAU / 60.0).sin_cos();
            let (x, y) = (centre[0] + r * c, centre[1] + r * s);
            writeln!(text, "CTV,{},{x},{y},{}", contour + 1, centre[2] + dz)
                .expect("a string takes it");
        }
    }
    std::fs::write(&given, text).expect("the contours are written");
    let facts = carry(&given, &out, &[]);
    assert_eq!(facts["kind"], "contours");
    let ctv = &facts["structures"][0];
    assert_eq!((&ctv["name"], &ctv["moved"]), (&"CTV".into(), &true.into()));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) / 1000.0;
    let before = ctv["before_ml"].as_f64().expect("a volume");
    assert!((before / exact - 1.0).abs() < 0.04, "{before} ml for {exact}");
    let rows = std::fs::read_to_string(&out).expect("the result is there");
    let mut sum = [0.0; 3];
    let mut corners = 0.0;
    for row in rows.lines().skip(1) {
        for (a, cell) in row.split(',').skip(2).enumerate() {
            sum[a] += cell.parse::<f64>().expect("a coordinate");
        }
        corners += 1.0;
    }
    let mean = sum.map(|s| s / corners);
    assert!(off(mean, after) < 1.0, "{mean:?}, the tumour at {after:?}");
}

#[test]
fn a_structure_set_is_carried_as_the_fields_say() {
    let folder = scratch();
    let (given, out) = (folder.path().join("rtss"), folder.path().join("out.csv"));
    let [centre, _] = tumour();
    let place = centre.map(|c| c.to_string()).join(",");
    let ball = [place, "12".into()].map(PathBuf::from);
    let drawn = [source(), given.clone()].into_iter().chain(ball.clone());
    readers_python("draw.py", drawn).success("draw.py");
    let facts = carry(&given, &out, &[]);
    assert_eq!(facts["kind"], "contours");
    let said = facts["warnings"].to_string();
    // The registration of the run knows the frame of reference it was drawn in.
    assert!(said.contains("CTV\\\": 1 points") && !said.contains("frame of reference"), "{said}");
    let [ctv, spine] = [0, 1].map(|n| &facts["structures"][n]);
    assert_eq!((&ctv["name"], &ctv["moved"]), (&"CTV".into(), &true.into()));
    let ml = ["before_ml", "after_ml"].map(|key| ctv[key].as_f64().expect("a volume"));
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 1.2f64.powi(3);
    assert!((ml[0] / exact - 1.0).abs() < 0.02, "{} ml for {exact}", ml[0]);
    // What lies behind the breast comes out as it was drawn.
    assert_eq!((&spine["name"], &spine["moved"]), (&"Spine".into(), &false.into()));
    assert_eq!(
        (&spine["before_ml"], &spine["contours"][0]),
        (&spine["after_ml"], &spine["contours"][1])
    );
    let told = [shared().out.clone(), out.clone()].into_iter().chain(ball);
    let told = told.chain(ml.map(|ml| ml.to_string().into()));
    readers_python("carried.py", told).success("carried.py");
    // The CT that it was drawn on has its frame of reference, the simulated one has another.
    let by_the_run = std::fs::read(&out).expect("the result is there");
    let ct = source();
    let facts = carry(&given, &out, &["--ct", ct.to_str().expect("a path in UTF-8")]);
    assert!(!facts["warnings"].to_string().contains("frame of reference"), "{facts}");
    assert!(std::fs::read(&out).expect("the result is there") == by_the_run, "the same slices");
    let other = shared().out.join("ct");
    let out = folder.path().join("other.csv");
    let said = supine(&[&"carry", &shared().out, &given, &"--ct", &other, &"--out", &out]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("is not the CT that the run was made from"), "{}", said.stderr);
}

#[test]
fn the_map_goes_out_as_fields_that_itk_takes() {
    let folder = scratch();
    let [out, fields] = ["out.nrrd", "fields"].map(|name| folder.path().join(name));
    let mesh = shared().out.join("mesh/deformed.vtu");
    let said = supine(&[
        &"warp",
        &"--ct",
        &source(),
        &"--mesh",
        &mesh,
        &"--out",
        &out,
        &"--fields",
        &fields,
        // As the other program does.
        &"--interpolation",
        &"linear",
        &"--json",
    ]);
    let said = said.success("supine warp --fields");
    let facts: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON and nothing else");
    let mm = |name: &str| facts["forward_then_backward"][name].as_f64().expect("a length");
    assert!(mm("mean_mm") < 0.01 && mm("p99_mm") < 0.1, "{facts}");
    let text = tumour().map(|p| p.map(|c| c.to_string()).join(","));
    // A minus is no option.
    let points = text.map(PathBuf::from);
    let arguments = [fields].into_iter().chain(points).chain([source(), out]);
    readers_python("map.py", arguments).success("map.py");
}

#[test]
fn what_cannot_be_carried_is_refused() {
    let folder = scratch();
    let [odd, out] = ["odd.txt", "out.csv"].map(|name| folder.path().join(name));
    std::fs::write(&odd, "nothing").expect("the file is written");
    let run = &shared().out;
    let said = supine(&[&"carry", run, &odd, &"--out", &out]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(
        said.stderr.contains("odd.txt") && said.stderr.contains(".mrk.json"),
        "{}",
        said.stderr
    );
    let said = supine(&[&"carry", &"--run", run, run, &odd, &"--out", &out]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    let contours = folder.path().join("c.csv");
    std::fs::write(&contours, "structure,contour,x,y,z\nA,1,0,0,0\n").expect("it is written");
    let mesh = run.join("mesh/deformed.vtu");
    let said = supine(&[&"carry", &mesh, &contours, &"--out", &out]);
    assert_eq!(said.code, Some(2), "a mesh alone has no slices: {}", said.stderr);
    let said = supine(&[&"carry", &run.join("mesh/rest.vtu"), &contours, &"--out", &out]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("displacement"), "{}", said.stderr);
    let points = folder.path().join("p.csv");
    let text = "name,x,y,z\nmarker 3,91.4,-248.1,-594.5\n";
    std::fs::write(&points, text).expect("it is written");
    // The planner's own file, and a file of the run.
    for (what, out) in [(&points, &points), (&points, &run.join("points.csv"))] {
        let said = supine(&[&"carry", run, what, &"--out", out]);
        assert_eq!(said.code, Some(2), "{}", said.stderr);
    }
    assert_eq!(std::fs::read_to_string(&points).expect("it is there"), text);
    // The only CT of a planner.
    let ct = folder.path().join("ct.nrrd");
    std::fs::write(&ct, "a CT").expect("it is written");
    let mesh = run.join("mesh/deformed.vtu");
    for words in [&["segment"][..], &["warp", "--mesh", mesh.to_str().expect("a path")]] {
        let mut all: Vec<&dyn AsRef<std::ffi::OsStr>> = words.iter().map(|w| w as _).collect();
        all.extend([&"--ct" as _, &ct as _, &"--out" as _, &ct as &dyn AsRef<std::ffi::OsStr>]);
        let said = supine(&all);
        assert!(said.code == Some(2) && said.stderr.contains("would be lost"), "{}", said.stderr);
    }
    // The mesh of another run in this one's folder, or what passes for it.
    let copy = folder.path().join("copy");
    for name in ["mesh", "ct"] {
        std::fs::create_dir_all(copy.join(name)).expect("it is made");
    }
    for name in ["summary.json", "mesh/deformed.vtu"] {
        std::fs::copy(run.join(name), copy.join(name)).expect("it is copied");
    }
    let inner = folder.path().join("inner.csv");
    std::fs::write(&inner, "name,x,y,z\nclip,90,-240,-590\n").expect("it is written");
    let carried = folder.path().join("carried.csv");
    let whole = supine(&[&"carry", &copy, &inner, &"--out", &carried]);
    assert_eq!(whole.code, Some(0), "{}", whole.stderr);
    std::fs::copy(run.join("mesh/rest.vtu"), copy.join("mesh/deformed.vtu")).expect("it is copied");
    let by_other = folder.path().join("by_other.csv");
    let said = supine(&[&"carry", &copy, &inner, &"--out", &by_other]);
    let told = said.stderr.contains("is not what the run wrote");
    assert!(said.code == Some(1) && told, "{}", said.stderr);
    // Another CT's series or fields among the run's results.
    for (option, place) in
        [("--out", "ct"), ("--fields", "field"), ("--registration", "registration")]
    {
        let (among, elsewhere) = (run.join(place), folder.path().join("series"));
        let mut command = supine_command();
        command.arg("warp").arg("--mesh").arg(&mesh).arg("--ct").arg(&ct).arg(option).arg(&among);
        if option != "--out" {
            command.arg("--out").arg(&elsewhere);
        }
        let said = Outcome::of(&mut command);
        assert!(
            said.code == Some(2) && said.stderr.contains("a result of the run"),
            "{}",
            said.stderr
        );
    }
    std::fs::write(&points, "name,x,y,z\nmarker 3,1e30,0,0\n").expect("it is written");
    let said = supine(&[&"carry", run, &points, &"--out", &out]);
    assert_eq!(said.code, Some(1), "{}", said.stderr);
    assert!(said.stderr.contains("marker 3") && said.stderr.contains("1e30"), "{}", said.stderr);
    assert!(!out.exists());
}
