//! The report's tables, as text.

use crate::words::{capital, count, directions, fixed, triple};
use crate::{Mesh, Movement, QualityCheck, Summary, Tissues, VolumeChange, WallUncertainty};
use supine_record::{DenseFate, RestState};
use supine_space::Posture;

/// A table of text; the template escapes it.
#[derive(Debug)]
pub(crate) struct Table {
    pub(crate) title: String,
    /// Names of the columns; none for a table of facts.
    pub(crate) head: Vec<&'static str>,
    /// Cells by row; the first names the row.
    pub(crate) rows: Vec<Vec<String>>,
}

impl Table {
    fn facts(title: &str) -> Self {
        Self { title: title.into(), head: Vec::new(), rows: Vec::new() }
    }

    pub(crate) fn list(title: &str, head: &[&'static str]) -> Self {
        Self { title: title.into(), head: head.to_vec(), rows: Vec::new() }
    }

    /// Whether the last column holds hashes.
    pub(crate) fn hashed(&self) -> bool {
        self.head.last() == Some(&"BLAKE3")
    }

    fn row(&mut self, name: &str, value: String) {
        self.rows.push(vec![name.into(), value]);
    }
}

/// What a planner must know.
pub(crate) fn key(s: &Summary) -> Table {
    let mut t = Table::facts("At a glance");
    let position = &s.position.table;
    t.row(
        "Operating table",
        format!(
            "AP {}°: {}; LAT {}°: {}",
            fixed(position.ap_deg, 1),
            turned(position.ap_deg, "head raised", "head lowered"),
            fixed(position.lat_deg, 1),
            turned(position.lat_deg, "patient's left side lowered", "patient's right side lowered"),
        ),
    );
    t.row("Gravity, LPS", triple(position.gravity, 3));
    if let Some(m) = &s.tumour {
        t.row("Tumour moves", moves(m));
        t.row("Tumour, before", place(m.before_mm));
        t.row("Tumour, after", place(m.after_mm));
    }
    if let Some(interval) = &s.tumour_interval {
        let [low, high] = interval.length_mm.map(|mm| fixed(mm, 1));
        t.row("95 % interval", format!("{low} to {high} mm"));
    }
    if let Some(m) = &s.nipple {
        t.row("Nipple (estimated) moves", moves(m));
    }
    t.row("Largest displacement", format!("{} mm", fixed(s.solve.max_displacement_mm, 1)));
    let tissue = &s.parameters.tissue;
    t.row(
        "Tissue",
        format!(
            "Young's modulus {}{} with rest state “{}” ({}); {} elements. A modulus holds for \
             its rest state and elements only.",
            kpa(tissue.young_kpa),
            if tissue.moduli.is_some() { " in the mean, by tissue," } else { "" },
            tissue.rest,
            rest(tissue.rest),
            order(tissue.order),
        ),
    );
    let j = s.local_volume();
    t.row(
        "Local volume change",
        format!(
            "{} to {} (det F of the tissue from the CT to the table; 1 is none)",
            fixed(j.min, 2),
            fixed(j.max, 2)
        ),
    );
    t
}

/// A modulus, to the digits that were given or four of a mean.
fn kpa(modulus: f64) -> String {
    format!("{} kPa", (modulus * 1e4).round() / 1e4)
}

/// A movement in words. Exactly nothing is no result of the mechanics: the point took no part.
fn moves(m: &Movement) -> String {
    if m.distance_mm == 0.0 {
        return "not at all: it is held, or lies outside what is simulated".into();
    }
    format!("{} mm: {}", fixed(m.distance_mm, 1), directions(m.displacement_mm))
}

fn turned(angle: f64, positive: &str, negative: &str) -> String {
    match angle {
        a if a > 0.0 => positive.into(),
        a if a < 0.0 => negative.into(),
        _ => "level".into(),
    }
}

fn rest(state: RestState) -> &'static str {
    match state {
        RestState::Net => "the CT shape is taken as free of stress",
        RestState::Unloaded => "the stress-free shape was sought",
    }
}

fn order(order: u8) -> &'static str {
    if order == 2 { "quadratic" } else { "linear" }
}

fn place(p: [f64; 3]) -> String {
    format!("{} mm", triple(p, 1))
}

fn sizes<T: ToString>(values: [T; 3]) -> String {
    values.map(|v| v.to_string()).join(" × ")
}

/// The stages: parameters and results.
pub(crate) fn stages(s: &Summary) -> Vec<Table> {
    vec![position(s), tissue(s), ct(s), segmentation(s), mesh(s), solve(s), warp(s)]
        .into_iter()
        .chain(export(s))
        .collect()
}

fn position(s: &Summary) -> Table {
    let mut t = Table::facts("Position");
    let position = &s.position.table;
    t.row("Table, AP", format!("{}° (positive raises the head)", fixed(position.ap_deg, 1)));
    let lat = fixed(position.lat_deg, 1);
    t.row("Table, LAT", format!("{lat}° (positive lowers the patient's left side)"));
    t.row("Gravity, LPS", triple(position.gravity, 4));
    if let Some(b) = &s.position.tumour {
        t.row("Tumour radius", format!("{} mm", fixed(b.radius_mm, 1)));
    }
    for (name, m) in [("Tumour", &s.tumour), ("Nipple, estimated,", &s.nipple)] {
        if let Some(m) = m {
            movement(&mut t, name, m);
        }
    }
    if let Some(interval) = &s.tumour_interval {
        let [low, high] = interval.length_mm.map(|mm| fixed(mm, 2));
        let level = fixed(100.0 * interval.level, 0);
        t.row("Tumour displacement, interval", format!("{low} to {high} mm ({level} %)"));
    }
    t
}

fn movement(t: &mut Table, name: &str, m: &Movement) {
    t.row(&format!("{name} before"), place(m.before_mm));
    t.row(&format!("{name} after"), place(m.after_mm));
    let text = format!("{}, {} mm", place(m.displacement_mm), fixed(m.distance_mm, 2));
    t.row(&format!("{name} displacement"), text);
}

fn tissue(s: &Summary) -> Table {
    let mut t = Table::facts("Tissue and region");
    let p = &s.parameters;
    t.row("Young's modulus", kpa(p.tissue.young_kpa));
    for state in s.fit.iter().flat_map(|fit| &fit.states) {
        let [low, high] = state.interval_kpa.map(|e| fixed(e, 3));
        let text = format!(
            "{} kPa (95 %: {low} to {high}); scan {} mm rms off on the breast, leaning {}° beyond scans.lean (0: upright)",
            fixed(state.young_kpa, 3),
            fixed(state.misfit_mm, 2),
            fixed(state.lean_deg, 1)
        );
        t.row(&format!("Fitted to the scans, {}", state.rest), text);
        let [scan, posture, tissues, mesh, wall, misfit] =
            state.parts.all().map(|part| fixed(100.0 * part, 1));
        let text = format!(
            "scan {scan} %, posture {posture} %, tissues {tissues} %, mesh {mesh} %, chest wall {wall} %, misfit {misfit} % (standard deviations)"
        );
        t.row("Its interval is made of", text);
        if let Some(by) = &state.tissues {
            let of = |n: f64, [low, high]: [f64; 2]| {
                format!("{} times (95 %: {} to {})", fixed(n, 2), fixed(low, 2), fixed(high, 2))
            };
            let (gland, skin) = (of(by.gland, by.gland_interval), of(by.skin, by.skin_interval));
            let text = format!("gland {gland}, skin {skin} as stiff as fat");
            t.row("Fitted moduli of the tissues", text);
        }
    }
    for law in s.fit.iter().flat_map(|fit| &fit.laws) {
        let text = format!(
            "{}; scan {} mm rms off on the breast{}; evidence against it {}; probability {} %",
            law.words(),
            fixed(law.misfit_mm, 2),
            law.table_mm.map_or(String::new(), |mm| format!(", {} on the table", fixed(mm, 2))),
            fixed(law.against, 1),
            fixed(100.0 * law.probability, 0)
        );
        t.row(&format!("Held against the scan, {}", law.rest), text);
    }
    if let Some(one) = s.fit.as_ref().and_then(|fit| fit.one_modulus.as_ref()) {
        let [kpa, mm] = [fixed(one.young_kpa, 3), fixed(one.misfit_mm, 2)];
        let text = format!(
            "{kpa} kPa; scan {mm} mm rms off on the breast; evidence {} (above 10: for one modulus, below -10: for those by tissue)",
            fixed(one.evidence, 1)
        );
        t.row("One modulus instead", text);
    }
    if let Some(evidence) = s.fit.as_ref().and_then(|fit| fit.evidence) {
        t.row(
            "Evidence for the first of them",
            format!("{} (above 10 decides)", fixed(evidence, 1)),
        );
    }
    if let Some(supine) = s.fit.as_ref().and_then(|fit| fit.supine.as_ref()) {
        t.row("Scan lying, off the skin of the CT", format!("{} mm rms", fixed(supine.rms_mm, 2)));
    }
    if let Some(m) = &p.tissue.moduli {
        let [fat, gland, skin, tumour] =
            [m.fat_kpa, m.gland_kpa, m.skin_kpa, m.tumour_kpa].map(|e| fixed(e, 2));
        let by = if m.map == "hu" { "between fat and gland by HU" } else { "by label" };
        let text = format!("fat {fat}, gland {gland}, skin {skin}, tumour {tumour} kPa, {by}");
        t.row("By tissue", text);
        let [min, max] = [m.min_kpa, m.max_kpa].map(|e| fixed(e, 2));
        t.row("Of the tetrahedra", format!("{min} to {max} kPa; the modulus above is their mean"));
    }
    t.row("Rest state", p.tissue.rest.to_string());
    t.row("Poisson's ratio", p.tissue.poisson.to_string());
    t.row("Density", format!("{} kg/m³", p.tissue.density_kg_m3));
    law(s, &mut t);
    t.row("Elements", order(p.tissue.order).into());
    t.row("At the cut", p.tissue.cut.to_string());
    t.row("Region centre", place(p.region.centre_mm));
    let source = if p.region.proposed { "proposed by the tool" } else { "given" };
    t.row("Region radius", format!("{} mm, {source}", fixed(p.region.radius_mm, 1)));
    t
}

/// Rows on how the tissue resists beyond small strain, and on what acts on its boundary.
fn law(s: &Summary, t: &mut Table) {
    let p = &s.parameters;
    if let Some(stiffening) = p.tissue.stiffening {
        t.row("Law", format!("{}, stiffening {stiffening}", p.tissue.law));
    }
    if let Some(fibres) = p.tissue.fibres {
        let k = p.tissue.fibre_stiffening.map(|k| format!(", stiffening {k}"));
        let text = format!("{fibres} times the modulus, in tension{}", k.unwrap_or_default());
        match p.tissue.fibre_direction {
            Some(along) => t.row("Fibres", format!("{text}, along {}", place(along))),
            None => t.row("Fibres from wall to skin", text),
        }
    }
    if let Some(wall) = &p.tissue.sliding {
        let slid = s.solve.sliding.map(|slid| {
            format!(
                " around {}; the tissue slid by up to {} mm",
                place(slid.centre_mm),
                fixed(slid.most_mm, 1)
            )
        });
        let text = format!(
            "slides at {} kPa/mm within {} mm{}",
            wall.stiffness_kpa_mm,
            wall.radius_mm,
            slid.unwrap_or_default()
        );
        t.row("On the chest wall", text);
    }
    if let Some(skin) = &p.tissue.skin {
        let text = format!(
            "{} mm of {} kPa, stretched to {}",
            skin.thickness_mm, skin.young_kpa, skin.stretch
        );
        t.row("Skin as a membrane", text);
    }
}

fn ct(s: &Summary) -> Table {
    let mut t = Table::facts("CT");
    t.row("Voxels", sizes(s.ct.size));
    t.row("Spacing", format!("{} mm", sizes(s.ct.spacing_mm.map(|v| format!("{v:.3}")))));
    t.row("First voxel", place(s.ct.origin_mm));
    t.row("Slices", count(s.ct.slices));
    let position =
        if s.ct.patient_position.is_empty() { "not said" } else { &s.ct.patient_position };
    t.row("Patient position", position.into());
    let taken = s.case.get("position").and_then(|word| Posture::named(word.as_str()?));
    if let Some(taken) = taken.filter(|taken| *taken != Posture::Supine) {
        t.row("Gravity", format!("as of a patient who {}", taken.told()));
    }
    t.row("Files left out", count(s.ct.left_out.len()));
    t
}

fn segmentation(s: &Summary) -> Table {
    let mut t = Table::facts("Segmentation");
    let hu = |x: Option<f64>| {
        x.map_or_else(|| "labels were given".into(), |x| format!("{} HU", fixed(x, 0)))
    };
    t.row("Fat", hu(s.segmentation.fat_hu));
    t.row("Muscle", hu(s.segmentation.muscle_hu));
    t.row("Soft tissue in the region", format!("{} ml", fixed(s.segmentation.soft_tissue_ml, 0)));
    t.row("Chest wall in the region", format!("{} ml", fixed(s.segmentation.chest_wall_ml, 0)));
    if let Some(uncertainty) = &s.segmentation.uncertainty {
        t.row("Uncertain boundary", uncertain(uncertainty));
    }
    if let Some(tissues) = &s.segmentation.tissues {
        t.row("Breast density", density(tissues));
    }
    t
}

/// `18 % of gland in gland and fat`.
fn density(tissues: &Tissues) -> String {
    let none = || "neither gland nor fat in the region".into();
    tissues
        .density_percent
        .map_or_else(none, |d| format!("{} % of gland in gland and fat", fixed(d, 0)))
}

/// How near the case was to a warning or refusal; none when nothing was measured.
pub(crate) fn quality_checks(quality_checks: &[QualityCheck]) -> Option<Table> {
    let mut t = Table::list(
        "How near a warning or refusal the whole case was. * refuses only together with another one",
        &["Measured", "Figure", "Warns", "Refuses"],
    );
    for check in quality_checks {
        let limit = |limit: Option<f64>| match limit {
            Some(limit) if check.at_most => format!("above {}", figure(limit, &check.unit)),
            Some(limit) => format!("below {}", figure(limit, &check.unit)),
            None => "\u{2013}".into(),
        };
        let star = if check.jointly { " *" } else { "" };
        t.rows.push(vec![
            capital(&check.what),
            figure(check.value, &check.unit),
            limit(check.warns),
            limit(check.refuses) + star,
        ]);
    }
    (!t.rows.is_empty()).then_some(t)
}

/// A figure with its unit: one decimal where it is small.
fn figure(value: f64, unit: &str) -> String {
    let decimals = usize::from(value.abs() < 9.95 && value.fract().abs() > 1e-9);
    format!("{} {unit}", fixed(value, decimals))
}

/// How much there is of each tissue.
pub(crate) fn tissues(tissues: &Tissues) -> Table {
    let mut t = Table::list(
        "Volumes, and means of the CT",
        &["Tissue", "In the region, ml", "Mean there, HU", "In the whole CT, ml"],
    );
    for v in tissues.volumes.iter().filter(|v| v.whole_ct_ml > 0.0) {
        let mean = v.mean_hu.map_or_else(|| "\u{2013}".into(), |hu| fixed(hu, 0));
        let decimals = usize::from(v.region_ml < 9.95);
        t.rows.push(vec![
            capital(&v.name),
            fixed(v.region_ml, decimals),
            mean,
            fixed(v.whole_ct_ml, 0),
        ]);
    }
    t
}

/// How the volume of each structure changes; none when nothing is known of it.
pub(crate) fn volumes(changes: &[VolumeChange]) -> Option<Table> {
    let mut t = Table::list(
        "Volumes in the CT and on the operating table, of what lies in the mesh",
        &["Structure", "CT, ml", "Table, ml", "Change", "det F: 1 %, 99 %", "det F: range"],
    );
    for c in changes {
        let decimals = if c.before_ml < 99.5 { 2 } else { 1 };
        let [before, after] = [c.before_ml, c.after_ml].map(|ml| fixed(ml, decimals));
        let (j, percent) = (&c.jacobian, 100.0 * (c.after_ml / c.before_ml - 1.0));
        t.rows.push(vec![
            capital(&c.structure),
            before,
            after,
            format!("{} %", fixed(percent, 2)),
            format!("{}, {}", fixed(j.p01, 2), fixed(j.p99, 2)),
            format!("{} to {}", fixed(j.min, 2), fixed(j.max, 2)),
        ]);
    }
    (!t.rows.is_empty()).then_some(t)
}

/// `12.5 of 180 cm² may be off by more than 2.5 mm; largest: 7.8 cm², upper outer quadrant`.
fn uncertain(uncertainty: &WallUncertainty) -> String {
    let (bad, all) = (fixed(uncertainty.uncertain_cm2, 1), fixed(uncertainty.boundary_cm2, 0));
    let limit = fixed(uncertainty.limit_mm, 1);
    let largest = uncertainty.patches.first().map_or_else(String::new, |p| {
        format!("; largest: {} cm², {}", fixed(p.area_cm2, 1), p.place)
    });
    format!("{bad} of {all} cm² may be off by more than {limit} mm{largest}")
}

fn mesh(s: &Summary) -> Table {
    let m = &s.mesh;
    let mut t = shape(m);
    let asked = &s.parameters.mesh;
    t.row("Mesher", asked.mesher.clone());
    match asked.refine.as_str() {
        "tumour" => t.row("Finer", "in and around the tumour".into()),
        "goal" => t.row("Finer", "where the tumour's displacement depends on it".into()),
        _ => {}
    }
    if let Some(c) = &m.curved {
        let [mean, max] = [c.mean_mm, c.max_mm].map(|d| fixed(d, 2));
        let nodes =
            format!("{} nodes of the elements by {mean} mm (at most {max})", count(c.nodes));
        t.row("Curved", format!("{nodes}; {} short of their surface", count(c.shortened)));
    }
    t.row("Unknowns", count(m.unknowns));
    t
}

/// What is said of any mesh.
pub(crate) fn shape(m: &Mesh) -> Table {
    let mut t = Table::facts("Mesh");
    t.row("Tetrahedra", format!("{} (asked: {})", count(m.tetrahedra), count(m.asked)));
    t.row("Points", count(m.points));
    let (low, high) = (fixed(m.min_dihedral_deg, 1), fixed(m.max_dihedral_deg, 1));
    t.row("Dihedral angles", format!("{low}° to {high}°"));
    let (low, mean) = (fixed(m.min_radius_ratio, 2), fixed(m.mean_radius_ratio, 2));
    t.row("Radius ratio", format!("{low} smallest, {mean} mean (1 is best)"));
    let off = 100.0 * (m.volume_ml / m.source_volume_ml - 1.0);
    let (volume, source) = (fixed(m.volume_ml, 1), fixed(m.source_volume_ml, 1));
    t.row("Volume", format!("{volume} ml; what it follows {source} ml ({off:+.2} %)"));
    let areas = [m.skin_mm2, m.chest_wall_mm2, m.cut_mm2].map(|a| fixed(a / 100.0, 0));
    t.row("Skin, chest wall, cut", format!("{} cm²", areas.join(", ")));
    if m.joined_patches > 0 {
        t.row(
            "Patches smaller than a face",
            format!("{}, given their neighbour's tag", m.joined_patches),
        );
    }
    for fit in &m.surfaces {
        let d = &fit.distance;
        let figures = [d.mean_mm, d.p95_mm, d.max_mm].map(|d| fixed(d, 2));
        let [mean, p95, max] = figures;
        let name = format!("Distance, {}", fit.tag.replace('_', " "));
        t.row(&name, format!("{mean} mm mean, {p95} for 95 %, {max} largest"));
    }
    t
}

/// The worst tetrahedra.
pub(crate) fn worst(m: &Mesh) -> Table {
    let mut t = Table::list(
        "Worst tetrahedra",
        &["Number", "Middle, mm (LPS)", "Dihedral angles", "Radius ratio"],
    );
    for w in &m.worst {
        let (low, high) = (fixed(w.min_dihedral_deg, 1), fixed(w.max_dihedral_deg, 1));
        t.rows.push(vec![
            w.tet.to_string(),
            triple(w.place_mm, 1),
            format!("{low}° to {high}°"),
            fixed(w.radius_ratio, 2),
        ]);
    }
    t
}

fn solve(s: &Summary) -> Table {
    let mut t = Table::facts("Mechanics");
    let m = &s.solve;
    let steps = if m.load_steps == 1 {
        "1 load step".into()
    } else {
        format!("{} load steps", m.load_steps)
    };
    t.row("Newton iterations", format!("{} in {steps}", m.iterations));
    t.row("Indefinite tangents", m.indefinite.to_string());
    t.row("Residual", format!("{:.1e} of the load", m.residual));
    t.row("Largest displacement", format!("{} mm", fixed(m.max_displacement_mm, 2)));
    if let Some(k) = m.spring_kpa_mm {
        t.row("Springs at the cut, mean stiffness", format!("{} kPa/mm", fixed(k, 4)));
    }
    if let Some(mm) = m.reload_error_mm {
        t.row("CT shape missed when the unloaded shape is loaded again", format!("{mm:.1e} mm"));
    }
    t
}

fn warp(s: &Summary) -> Table {
    let mut t = Table::facts("Warp");
    let w = &s.warp;
    t.row("Interpolation", s.parameters.interpolation.clone());
    t.row("Fade at the cut", format!("{} mm", fixed(w.fade_mm, 1)));
    t.row("Voxels resampled", count(w.moved_voxels));
    t.row("Voxels vacated (air)", count(w.vacated_voxels));
    t.row("Voxels folded", count(w.folded_voxels));
    let whole = w.dense.iter().filter(|thing| thing.fate == DenseFate::Whole).count();
    if !w.dense.is_empty() {
        let text = format!("{} found, {whole} moved whole", w.dense.len());
        t.row("Clips, wires and other dense things", text);
    }
    if let Some(c) = &w.forward_then_backward {
        let [mean, p99, max] = [c.mean_mm, c.p99_mm, c.max_mm].map(|d| fixed(d, 3));
        let text = format!("{mean} mm off in the mean, {p99} mm at 99 %, {max} mm at most");
        t.row("Forward, then back by the fields", text);
    }
    t
}

fn export(s: &Summary) -> Option<Table> {
    let e = s.export.as_ref()?;
    let mut t = Table::facts("Exported series");
    t.row("Folder", format!("{}/, {} files", e.folder, count(e.files)));
    t.row("Series Description", e.series_description.clone());
    t.row("Series UID", e.series_uid.clone());
    t.row("Frame of Reference UID", e.frame_of_reference_uid.clone());
    t.row("Checks", format!("{} of {} passed", e.verified.passed, e.verified.total));
    if let Some(r) = &e.registration {
        let [x, y, z] = r.spacing_mm.map(|mm| format!("{mm:.2}"));
        let off = [r.error.mean_mm, r.error.p99_mm, r.error.max_mm].map(|mm| format!("{mm:.3}"));
        let text = format!(
            "{}/, vectors {x} x {y} x {z} mm apart; between them {} mm off the map in the mean, {} \
             mm at 99 %, {} mm at most",
            r.folder, off[0], off[1], off[2]
        );
        t.row("Registrations", text);
    }
    Some(t)
}

/// The points that were carried along.
pub(crate) fn points(s: &Summary) -> Option<Table> {
    let mut t = Table::list(
        "Points carried along",
        &["Name", "CT, mm", "Operating table, mm", "Moves, mm"],
    );
    for p in &s.points {
        let m = Movement::new(p.before_mm, p.after_mm);
        let moves =
            if p.inside { fixed(m.distance_mm, 1) } else { "outside the region: not moved".into() };
        t.rows.push(vec![p.name.clone(), triple(p.before_mm, 1), triple(p.after_mm, 1), moves]);
    }
    (!t.rows.is_empty()).then_some(t)
}

/// The doses, structures and segments that were carried along.
pub(crate) fn carried(s: &Summary) -> Option<Table> {
    let mut t = Table::list(
        "Dose and structures carried along",
        &["File", "What", "CT", "Operating table"],
    );
    let mut row = |file: &str, what: &str, pair: [String; 2]| {
        let [before, after] = pair;
        t.rows.push(vec![file.to_owned(), what.to_owned(), before, after]);
    };
    for object in &s.carried {
        if let Some(gy) = object.max_gy {
            row(&object.file, "largest dose", gy.map(|gy| format!("{} Gy", fixed(gy, 2))));
        }
        if let Some(mj) = object.energy_mj {
            row(&object.file, "energy imparted", mj.map(|mj| format!("{} mJ", fixed(mj, 1))));
        }
        for region in &object.regions {
            let ml = [region.before_ml, region.after_ml].map(|ml| format!("{} ml", fixed(ml, 2)));
            row(&object.file, &region.name, ml);
        }
    }
    (!t.rows.is_empty()).then_some(t)
}

/// What was read, left out and written.
pub(crate) fn files(s: &Summary) -> Vec<Table> {
    let mut inputs = Table::list("Read", &["What", "Form", "Files", "BLAKE3"]);
    for i in &s.inputs {
        let role = if i.role == "ct" { "CT".into() } else { capital(&i.role) };
        let row = vec![role, i.form.clone(), count(i.files), i.blake3.clone()];
        inputs.rows.push(row);
    }
    let mut left_out = Table::list("Not used", &["File", "Reason"]);
    left_out.rows = s.ct.left_out.iter().map(|l| vec![l.file.clone(), l.reason.clone()]).collect();
    let mut outputs = Table::list("Written", &["Path", "BLAKE3"]);
    outputs.rows = s.outputs.iter().map(|o| vec![o.path.clone(), o.blake3.clone()]).collect();
    [inputs, left_out, outputs].into_iter().filter(|t| !t.rows.is_empty()).collect()
}
