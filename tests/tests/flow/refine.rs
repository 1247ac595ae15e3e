//! Meshes that are finer where it counts, and the page on a mesh.

use crate::shared::{run, scratch, shared, summary};
use serde_json::Value;
use supine_tests::{Case, supine};

#[test]
fn a_mesh_for_the_tumours_displacement_has_the_same_number_and_nearly_the_same_result() {
    let folder = scratch();
    let plain = summary(&shared().out);
    let asked = plain["parameters"]["mesh"]["tetrahedra"].clone();
    let mesh = format!("{{ tetrahedra = {asked}, refine = \"goal\" }}");
    let case = Case::small().with("mesh", &mesh).write(folder.path());
    let out = folder.path().join("out");
    shared().begin(&out);
    run(&case, &out, 2).success("supine run");
    let goal = summary(&out);
    assert_eq!(goal["parameters"]["mesh"]["refine"], "goal");
    assert_eq!(goal["mesh"]["tetrahedra"], asked);
    assert_ne!(goal["mesh"]["points"], plain["mesh"]["points"], "it is another mesh");
    for axis in 0..3 {
        let place = |s: &Value| s["tumour"]["after_mm"][axis].as_f64().expect("a place");
        assert!((place(&goal) - place(&plain)).abs() < 2.0, "axis {axis}");
    }
    let page = std::fs::read_to_string(out.join("report/index.html")).expect("a report");
    assert!(page.contains("where the tumour&#39;s displacement depends on it"));
}

#[test]
fn a_mesh_alone_has_its_page() {
    let folder = scratch();
    let out = folder.path().join("mesh.vtu");
    let report = folder.path().join("page");
    let labels = shared().out.join("labels.seg.nrrd");
    let region = &summary(&shared().out)["parameters"]["region"];
    let centre: Vec<f64> = (0..3).filter_map(|a| region["centre_mm"][a].as_f64()).collect();
    let [x, y, z] = centre[..] else { panic!("{region}") };
    let radius = region["radius_mm"].to_string();
    let said = supine(&[
        &"mesh",
        &"--labels",
        &labels,
        &format!("--centre={x},{y},{z}"),
        &"--radius",
        &radius,
        &"--tetrahedra",
        &"2000",
        &"--refine",
        &"tumour",
        &format!("--tumour-centre={x},{},{z}", y + 5.0),
        &"--tumour-radius",
        &"6",
        &"--tumour-edge",
        &"4",
        &"--report",
        &report,
        &"--out",
        &out,
        &"--json",
    ]);
    let said = said.success("supine mesh");
    let facts: Value = serde_json::from_str(&said.stdout).expect("stdout is JSON");
    assert_eq!(facts["tetrahedra"], 2000);
    let angles = facts["dihedral_angles"].as_array().expect("a histogram");
    let counted: u64 = angles.iter().filter_map(Value::as_u64).sum();
    assert_eq!((angles.len(), counted), (36, 12_000));
    let page = std::fs::read_to_string(report.join("index.html")).expect("a page");
    assert!(page.contains("DERIVED") && page.contains("Worst tetrahedra"));
    for picture in ["mesh_front", "mesh_back", "axial_mesh_quality", "mesh_histograms"] {
        assert!(report.join(format!("{picture}.png")).is_file(), "{picture}");
    }
    // The old name says the new one.
    let said = supine(&[
        &"mesh",
        &"--labels",
        &labels,
        &"--centre=0,0,0",
        &"--radius=50",
        &"--tetrahedra=2000",
        &"--finer-edge=4",
        &"--out",
        &out,
    ]);
    assert_eq!(said.code, Some(2), "{}", said.stderr);
    assert!(said.stderr.contains("--tumour-edge"), "{}", said.stderr);
}
