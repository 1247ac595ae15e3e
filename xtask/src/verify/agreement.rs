//! Our solutions against every stored field of the reference, and their convergence to the finest.

use super::mechanics::Mechanics;
use super::number;
use super::plot::{Line, Panel, svg};
use anyhow::{Result, bail, ensure};
use serde_json::Value;
use std::fmt::Write;

const AGREEMENT_TEXT: &str = include_str!("agreement.md");
const LAWS_TEXT: &str = include_str!("laws.md");
const BOUNDARIES_TEXT: &str = include_str!("boundaries.md");
const CONVERGENCE_TEXT: &str = include_str!("convergence.md");
/// Relative residual of the solutions that are compared node by node.
const TOLERANCE: f64 = 1e-10;
/// Largest nodal difference that counts as agreement, mm: where the problem is well conditioned,
/// and where softness or the way through the unloaded shape amplifies rounding.
const CLOSE_MM: f64 = 1e-8;
const SOFT_MM: f64 = 1e-6;
/// Of the derivative by the modulus, as a share of its largest value.
const SLOPE: f64 = 1e-6;
/// The stored fields, and how near ours must be.
const FIELDS: [(&str, f64); 11] = [
    ("net_tilt", CLOSE_MM),
    ("net_sit", CLOSE_MM),
    ("net_sit_E0.3", SOFT_MM),
    ("net_sit_E2.0", CLOSE_MM),
    ("net_sit_dxdE", SLOPE),
    ("net_tilt_cutfixed", CLOSE_MM),
    ("net_sit_cutfixed", CLOSE_MM),
    ("hetero_net_sit", CLOSE_MM),
    ("unl_X", SOFT_MM),
    ("unl_tilt", SOFT_MM),
    ("unl_sit", SOFT_MM),
];
/// Meshes and orders that fields are stored for.
const STORED: [(&str, u8); 4] = [("1.6k", 1), ("1.6k", 2), ("12k", 1), ("12k", 2)];
/// Which of them lack a field.
const LACKING: [(&str, u8, &[&str]); 2] = [
    ("12k", 1, &["hetero_net_sit"]),
    (
        "12k",
        2,
        &[
            "net_sit_E0.3",
            "net_sit_E2.0",
            "net_sit_dxdE",
            "net_tilt_cutfixed",
            "net_sit_cutfixed",
            "hetero_net_sit",
            "unl_sit",
        ],
    ),
];

/// Laws that stiffen, as `fixtures/fem/make_laws.py` gave them to felupe.
const LAWS: [&[&str]; 3] = [&["exponential", "1.5"], &["gent", "0.5"], &["fibres", "2"]];
/// Boundaries, as `fixtures/fem/make_surfaces.py` gave them to jax.
const BOUNDARIES: [&[&str]; 5] = [&["wall"], &["skin"], &["both"], &["soft"], &["both_soft"]];
const OTHER_FIELDS: [&str; 5] = ["net_tilt", "net_sit", "unl_X", "unl_tilt", "unl_sit"];

/// Text and table of the laws that stiffen.
pub(super) fn laws(mechanics: &Mechanics<'_>) -> Result<String> {
    Ok(format!("{LAWS_TEXT}{}", beside(mechanics, &LAWS)?))
}

/// Text and table of the boundaries.
pub(super) fn boundaries(mechanics: &Mechanics<'_>) -> Result<String> {
    Ok(format!("{BOUNDARIES_TEXT}{}", beside(mechanics, &BOUNDARIES)?))
}

/// A row for each field of each of these, beside the neo-Hookean solid on a wall that holds.
fn beside(mechanics: &Mechanics<'_>, others: &[&[&str]]) -> Result<String> {
    let mut rows = String::new();
    for field in OTHER_FIELDS {
        let plain = mechanics.own("1.6k", 2, field, TOLERANCE)?;
        for other in others {
            let name = format!("`{}` {}", other[0], other[1..].concat());
            let name = name.trim();
            let Ok(own) = mechanics.otherwise(other, field, TOLERANCE) else {
                writeln!(rows, "| {name} | `{field}` | refused | - | - | - |")?;
                continue;
            };
            let off = match own["off"].as_f64() {
                None => "not stored".to_owned(),
                Some(off) if off <= SOFT_MM => format!("{off:.1e}"),
                Some(off) => bail!("{name} {field} is {off:.1e} off"),
            };
            let [steps, plainly] = [&own, &plain].map(|told| told["iterations"].to_string());
            let [cost, plain_cost] = [number(&own, "/cpu_s")?, number(&plain, "/cpu_s")?];
            let times = cost / plain_cost;
            writeln!(
                rows,
                "| {name} | `{field}` | {off} | {steps} ({plainly}) | {cost:.3} | {times:.2} |"
            )?;
        }
    }
    Ok(rows)
}

/// Text and table of the agreement.
pub(super) fn agreement(mechanics: &Mechanics<'_>) -> Result<String> {
    let mut page = String::from(AGREEMENT_TEXT);
    for (field, near) in FIELDS {
        write!(page, "| `{field}` | {near:.0e} |")?;
        for (mesh, order) in STORED {
            if LACKING.iter().any(|(m, o, f)| (*m, *o) == (mesh, order) && f.contains(&field)) {
                page.push_str(" not stored |");
                continue;
            }
            let off = number(&mechanics.own(mesh, order, field, TOLERANCE)?, "/off")?;
            ensure!(off <= near, "{field} on {mesh}, order {order}, is {off:.1e} off");
            write!(page, " {off:.1e} |")?;
        }
        page.push('\n');
    }
    write!(page, "| `app` | {CLOSE_MM:.0e} |")?;
    for (mesh, order) in STORED {
        let told = mechanics.applied(mesh, order, &["stored"])?;
        let (off, fields) = (number(&told, "/off")?, number(&told, "/stored")?);
        ensure!(off <= CLOSE_MM, "applicator on {mesh}, order {order}, is {off:.1e} off");
        write!(page, " {off:.1e} ({fields}) |")?;
    }
    page.push('\n');
    Ok(page)
}

const QUADRATIC: &[&str] = &["1.6k", "5k", "12k"];
/// Elements and meshes of the convergence, coarse first.
///
/// Error by the number of unknowns n: on straight meshes of a curved body h² for both orders in the
/// end, h³ for quadratic elements while the body's outline is not what limits; h as n^(-1/3).
const SERIES: [Series; 3] = [
    Series {
        name: "linear",
        order: 1,
        curved: false,
        meshes: &["1.6k", "5k", "12k", "40k"],
        theory: 2.0 / 3.0,
    },
    Series { name: "quadratic", order: 2, curved: false, meshes: QUADRATIC, theory: 1.0 },
    Series { name: "quadratic, curved", order: 2, curved: true, meshes: QUADRATIC, theory: 1.0 },
];
const POSES: [&str; 2] = ["tilt", "sit"];
const PLOT: &str = "plots/mechanics-accuracy.svg";

/// Elements of one kind on ever finer meshes.
struct Series {
    name: &'static str,
    order: u8,
    /// They follow skin and chest wall.
    curved: bool,
    meshes: &'static [&'static str],
    /// Power of the unknowns with which the error should fall.
    theory: f64,
}

/// One solution.
struct Point {
    mesh: &'static str,
    unknowns: f64,
    seconds: f64,
    rms_mm: f64,
    max_mm: f64,
}

impl Point {
    fn of(mesh: &'static str, told: &Value) -> Result<Self> {
        let n = |key: &str| number(told, &format!("/{key}"));
        let (unknowns, seconds) = (n("unknowns")?, n("cpu_s")?);
        let (rms_mm, max_mm) = (n("probes_mm/0")?, n("probes_mm/1")?);
        Ok(Self { mesh, unknowns, seconds, rms_mm, max_mm })
    }
}

/// Text, tables and plots of the convergence.
pub(super) fn convergence(mechanics: &Mechanics<'_>) -> Result<String> {
    let shown = format!("![Error against unknowns and against seconds]({PLOT})");
    let mut page = CONVERGENCE_TEXT.replace("{plot}", &shown);
    let (mut by_size, mut by_time) = (Vec::new(), Vec::new());
    for (p, pose) in POSES.into_iter().enumerate() {
        for (s, series) in SERIES.iter().enumerate() {
            let field = format!("net_{pose}");
            let solve = |mesh: &&'static str| {
                let told = if series.curved {
                    mechanics.curved(mesh, &field, 1e-9)
                } else {
                    mechanics.own(mesh, series.order, &field, 1e-9)
                };
                Point::of(mesh, &told?)
            };
            let points = series.meshes.iter().map(solve).collect::<Result<Vec<_>>>()?;
            rows(&mut page, (pose, series), &points)?;
            let line = |x: fn(&Point) -> f64| Line {
                name: format!("{}, {pose}", series.name),
                colour: s,
                dashed: p == 1,
                points: points.iter().map(|p| [x(p), p.rms_mm]).collect(),
            };
            by_size.push(line(|p| p.unknowns));
            by_time.push(line(|p| p.seconds));
        }
    }
    let error = "error at the probes, rms, mm";
    let panels = [
        Panel { title: "Convergence", axes: ["unknowns", error], lines: by_size },
        Panel {
            title: "Accuracy per second",
            axes: ["CPU seconds of a cold solution", error],
            lines: by_time,
        },
    ];
    super::write_plot(mechanics.bench, PLOT, &svg(&panels))?;
    Ok(page)
}

fn rows(page: &mut String, (pose, series): (&str, &Series), points: &[Point]) -> Result<()> {
    let Series { name, theory, .. } = series;
    for (n, p) in points.iter().enumerate() {
        let slope =
            |before: &Point| (before.rms_mm / p.rms_mm).ln() / (p.unknowns / before.unknowns).ln();
        let slopes = match n.checked_sub(1).map(|n| &points[n]) {
            Some(before) => format!("{:.2} ({theory:.2})", slope(before)),
            None => "-".into(),
        };
        writeln!(
            page,
            "| {pose} | {name} | {} | {} | {:.3} / {:.3} | {slopes} | {:.3} |",
            p.mesh, p.unknowns, p.rms_mm, p.max_mm, p.seconds
        )?;
    }
    Ok(())
}
