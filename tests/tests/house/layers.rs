//! Arrows point only to lower layers, never sideways (docs/ARCHITECTURE.md).

use std::collections::{BTreeMap, BTreeSet};
use supine_tests::{metadata, root};

/// The layer of each package of the workspace. Nothing may depend on the house itself.
const LAYERS: [(&str, i8); 26] = [
    ("supine-features", BENEATH),
    ("supine-space", 0),
    ("supine-record", 1),
    ("supine-volume", 1),
    ("supine-mesh", 1),
    ("supine-dicom", 2),
    ("supine-exchange", 2),
    ("supine-segment", 2),
    ("supine-tetrahedralise", 2),
    ("supine-tetrahedralise-cgal", 2),
    ("supine-tetrahedralise-tetgen", 2),
    ("supine-fem", 2),
    ("supine-warp", 2),
    ("supine-register", 2),
    ("supine-openigtlink", 2),
    ("supine-personalise", 3),
    ("supine-report", 3),
    ("supine-dicom-network", 3),
    ("supine-flow", 4),
    ("supine-navigate", 5),
    ("supine-workstation", 5),
    ("supine", 6),
    ("supine-python", 6),
    ("supine-tests", HOUSE),
    ("supine-benches", HOUSE),
    ("xtask", HOUSE),
];

/// Chooses the features of foreign crates for every package and holds nothing itself.
const BENEATH: i8 = -1;

/// Tests and chores: above everything.
const HOUSE: i8 = 7;

/// All that the command line may use: it is a view on the flow and calls no method itself.
const FRONT: (&str, [&str; 8]) = (
    "supine",
    [
        "supine-features",
        "supine-flow",
        "supine-space",
        "supine-dicom-network",
        "supine-navigate",
        "supine-workstation",
        // Which it hands to the flow where it was built with them.
        "supine-tetrahedralise-cgal",
        "supine-tetrahedralise-tetgen",
    ],
);

/// What a table and a list of arrows (user, used) get wrong, in words.
fn faults(layers: &BTreeMap<&str, i8>, packages: &[&str], arrows: &[(&str, &str)]) -> Vec<String> {
    let mut faults = Vec::new();
    for package in packages.iter().filter(|p| !layers.contains_key(**p)) {
        faults.push(format!("{package} has no layer: give it one in tests/tests/house/layers.rs"));
    }
    for gone in layers.keys().filter(|l| !packages.contains(l)) {
        faults.push(format!("{gone} has a layer but is no package of the workspace"));
    }
    for (user, used) in arrows {
        if let (Some(from), Some(to)) = (layers.get(user), layers.get(used))
            && to >= from
        {
            faults.push(format!("{user} (L{from}) may not depend on {used} (L{to})"));
        }
    }
    faults
}

#[test]
fn the_command_line_calls_no_method() {
    let (front, allowed) = FRONT;
    let packages = metadata().workspace_packages();
    let names: Vec<&str> = packages.iter().map(|p| p.name.as_str()).collect();
    let package = packages.iter().find(|p| p.name == front).expect("the command line is a package");
    // Its tests may look at files with the readers of lower crates.
    let normal = package.dependencies.iter().filter(|d| format!("{:?}", d.kind) == "Normal");
    let used = normal.map(|d| d.name.as_str());
    let own: Vec<&str> = used.filter(|name| names.contains(name)).collect();
    assert!(own.contains(&"supine-flow"), "{own:?}");
    let more: Vec<&&str> = own.iter().filter(|name| !allowed.contains(name)).collect();
    assert!(more.is_empty(), "{front} may not depend on {more:?}");
}

#[test]
fn arrows_point_only_to_lower_layers() {
    let packages: Vec<&str> =
        metadata().workspace_packages().iter().map(|p| p.name.as_str()).collect();
    let mut arrows = Vec::new();
    for package in metadata().workspace_packages() {
        // Normal, build and dev dependencies alike.
        for dependency in &package.dependencies {
            if packages.contains(&dependency.name.as_str()) {
                arrows.push((package.name.as_str(), dependency.name.as_str()));
            }
        }
    }
    assert!(arrows.len() > 10, "the workspace's own dependencies were found: {arrows:?}");
    let faults = faults(&LAYERS.into_iter().collect(), &packages, &arrows);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// What the figure leaves out: features, and the types that all share.
const NOT_DRAWN: [&str; 5] = ["features", "space", "record", "volume", "mesh"];

#[test]
fn the_figure_of_the_crates_is_what_their_manifests_say() {
    let short = |name: &str| match name {
        "supine" => "cli".to_owned(),
        name => name.trim_start_matches("supine-").to_owned(),
    };
    let packages = metadata().workspace_packages();
    let is_drawn = |name: &str| {
        let layer = LAYERS.iter().find(|(package, _)| *package == name);
        layer.is_some_and(|(_, layer)| *layer != HOUSE)
            && !NOT_DRAWN.contains(&short(name).as_str())
    };
    let mut wanted = BTreeSet::new();
    for package in packages.iter().filter(|package| is_drawn(&package.name)) {
        let normal = package.dependencies.iter().filter(|d| format!("{:?}", d.kind) == "Normal");
        for used in normal.filter(|used| is_drawn(&used.name)) {
            wanted.insert(format!("  {} --> {}", short(&package.name), short(&used.name)));
        }
    }
    let page = std::fs::read_to_string(root().join("docs/ARCHITECTURE.md")).expect("the page");
    let figure = page.split("```mermaid").nth(1).and_then(|rest| rest.split("```").next());
    let lines = figure.expect("a figure").lines().filter(|line| line.contains("-->"));
    let drawn: BTreeSet<String> = lines.map(String::from).collect();
    assert_eq!(drawn, wanted);
}

#[test]
fn the_rule_sees_what_it_forbids() {
    let layers = BTreeMap::from([("space", 0), ("fem", 2), ("warp", 2), ("gone", 3)]);
    let packages = ["space", "fem", "warp", "new"];
    let found = faults(&layers, &packages, &[("fem", "space"), ("fem", "warp"), ("space", "fem")]);
    assert_eq!(
        found,
        [
            "new has no layer: give it one in tests/tests/house/layers.rs",
            "gone has a layer but is no package of the workspace",
            "fem (L2) may not depend on warp (L2)",
            "space (L0) may not depend on fem (L2)",
        ]
    );
}
