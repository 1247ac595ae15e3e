//! Tables and picture of live navigation.

use crate::verify::number;
use crate::verify::plot::{Line, Panel, svg};
use anyhow::{Context, Result};
use serde_json::Value;
use std::fmt::Write;

const TEXT: &str = include_str!("../navigate.md");
const TIMES: &str = "| mesh | answers | median ms | 95 % | 99 % | 99.9 % | largest | predictions | overtaken | load before / after |\n\
                     |---|---|---|---|---|---|---|---|---|---|\n";
const COUNTS: &str = "\n| mesh | tetrahedra | poses sent: to take / drop / refuse | the session took / dropped / refused | \
                      memory MB, after 5 s / at the end |\n|---|---|---|---|---|\n";

/// One measurement of times.
pub(super) struct Loop {
    pub(super) name: String,
    /// What `bench-navigate` prints.
    pub(super) told: Value,
    /// The machine's load, before and after.
    pub(super) load: [f64; 2],
}

/// All that was measured.
pub(super) struct Report {
    pub(super) echo: Loop,
    pub(super) loops: Vec<Loop>,
    pub(super) accuracy: Value,
    pub(super) drift: Value,
}

impl Report {
    /// Text and tables; `plot` is where the picture lies among the documents.
    pub(super) fn page(&self, plot: &str, minutes: f64) -> Result<String> {
        let mut page = format!("{TEXT}\nThe loops went over {minutes} of 10 minutes.\n\n{TIMES}");
        for one in std::iter::once(&self.echo).chain(&self.loops) {
            page += &one.times()?;
        }
        write!(page, "\n![Share of answers against their time]({plot})\n{COUNTS}")?;
        for one in &self.loops {
            page += &one.counts()?;
        }
        for one in &self.loops {
            page += &one.images()?;
        }
        page += &self.places()?;
        Ok(page)
    }

    /// How right the places are.
    fn places(&self) -> Result<String> {
        let a = |key: &str| number(&self.accuracy, &format!("/{key}"));
        let d = |key: &str| number(&self.drift, &format!("/{key}"));
        if a("compared")? == 0.0 {
            return Ok("\nThe applicator acted at no pose: no place was compared.\n".into());
        }
        Ok(format!(
            "\nPlaces of the first loop at {} poses, evenly along those at which the applicator acts (the tumour moved by up to {:.1} \
             mm), against a new solution to a relative residual of 1e-8 each: largest difference **{:.4} mm**, largest error told \
             with an answer {:.4} mm; {} lie beyond what was told, at worst by {:.4} mm; the recording followed once more without a clock: {:.4} mm. Of what \
             the live pictures (128³ voxels of 1 mm) show at these poses 99.9 % lies within {:.3} mm of where a new warp has it, all \
             within **{:.3} mm**; a picture takes {:.1} ms, 99 % {:.1}, at most {:.0} (one of 30 poses, nothing beside it).\n\n\
             {} steps of the motion and back to the start (the tumour moved by up to {:.1} mm, {} answers were predictions): the \
             place differs by **{:.1e} mm**; both errors told are {:.4} mm together.\n",
            a("compared")?,
            a("moved_mm")?,
            a("live_mm")?,
            a("bound_mm")?,
            a("beyond")?,
            a("excess_mm")?,
            a("again_mm")?,
            a("pictures/off_mm/0")?,
            a("pictures/off_mm/1")?,
            a("pictures/took_ms/0")?,
            a("pictures/took_ms/1")?,
            a("pictures/took_ms/2")?,
            d("steps")?,
            d("moved_mm")?,
            d("predicted")?,
            d("drift_mm")?,
            d("bound_mm")?,
        ))
    }

    /// Histograms of the times.
    pub(super) fn plot(&self) -> String {
        let shown = std::iter::once(&self.echo).chain(self.loops.iter().take(3));
        let line = |(n, one): (usize, &Loop)| {
            let bins = one.told["histogram"].as_array().map_or(&[][..], Vec::as_slice);
            let point = |bin: &Value| Some([bin[0].as_f64()?, 100.0 * bin[1].as_f64()?]);
            Line {
                name: one.name.clone(),
                // S = 0 is grey.
                colour: if n == 0 { 3 } else { n - 1 },
                dashed: n == 0,
                points: bins.iter().filter_map(point).collect(),
            }
        };
        svg(&[Panel {
            title: "From a pose to its place",
            axes: ["ms, ten bins a decade", "% of the answers"],
            lines: shown.enumerate().map(line).collect(),
        }])
    }
}

impl Loop {
    fn number(&self, key: &str) -> Result<f64> {
        number(&self.told, &format!("/{key}")).with_context(|| self.name.clone())
    }

    /// Its line of the table of times.
    fn times(&self) -> Result<String> {
        let n = |key: &str| self.number(key);
        let counted = |pointer: &str| {
            let count = self.told.pointer(pointer).and_then(Value::as_u64);
            count.map_or_else(String::new, |count| count.to_string())
        };
        Ok(format!(
            "| {} | {} | **{:.2}** | {:.2} | {:.2} | {:.2} | {:.1} | {} | {} | {:.1} / {:.1} |\n",
            self.name,
            n("n")?,
            n("median_ms")?,
            n("p95_ms")?,
            n("p99_ms")?,
            n("p999_ms")?,
            n("largest_ms")?,
            counted("/session/answers/predicted"),
            counted("/session/poses/overtaken"),
            self.load[0],
            self.load[1],
        ))
    }

    /// Its line of the table of counts and memory.
    fn counts(&self) -> Result<String> {
        let n = |key: &str| self.number(key);
        Ok(format!(
            "| {} | {} | {} / {} / {} | {} / {} / {} | {:.0} / {:.0} |\n",
            self.name,
            n("tetrahedra")?,
            n("rows/accept")?,
            n("rows/drop")?,
            n("rows/refuse")?,
            n("session/poses/accepted")?,
            n("session/poses/dropped")?,
            n("session/poses/refused")?,
            n("memory_mb/0")?,
            n("memory_mb/1")?,
        ))
    }

    /// What a viewer got, if there was one.
    fn images(&self) -> Result<String> {
        if self.told.get("images").is_none() {
            return Ok(String::new());
        }
        let n = |key: &str| self.number(&format!("images/{key}"));
        Ok(format!(
            "\nImages of 128 x 128 x 128 voxels streamed meanwhile: {} of them, **{:.1} a second**; from the pose that one shows until it \
             is read: median {:.0} ms, 95 % {:.0} ms, largest {:.0} ms.\n",
            n("n")?,
            n("rate")?,
            n("median_ms")?,
            n("p95_ms")?,
            n("largest_ms")?,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn told(extra: Value) -> Value {
        let mut told = json!({
            "n": 1000, "median_ms": 3.0, "p95_ms": 4.0, "p99_ms": 5.0, "p999_ms": 6.0, "largest_ms": 7.0,
            "histogram": [[3.16, 0.75], [5.0, 0.25]], "tetrahedra": 1581, "memory_mb": [100.0, 101.0],
            "rows": { "accept": 9, "drop": 2, "refuse": 1 },
        });
        if let (Value::Object(all), Value::Object(more)) = (&mut told, extra) {
            all.extend(more);
        }
        told
    }

    fn report() -> Report {
        let session = json!({
            "session": {
                "poses": { "accepted": 9, "dropped": 2, "refused": 1, "overtaken": 4 },
                "answers": { "predicted": 3 },
            },
            "images": { "n": 50, "rate": 12.0, "median_ms": 80.0, "p95_ms": 90.0, "largest_ms": 99.0 },
        });
        let one =
            |name: &str, extra| Loop { name: name.into(), told: told(extra), load: [0.5, 1.5] };
        Report {
            echo: one("S = 0", json!({})),
            loops: vec![one("1581 quadratic", session)],
            accuracy: json!({
                "compared": 20, "moved_mm": 5.0, "live_mm": 0.01, "bound_mm": 0.02, "beyond": 0, "again_mm": 0.01,
                "excess_mm": 0.0,
                "pictures": { "off_mm": [0.05, 0.09], "took_ms": [11.0, 20.0, 90.0] },
            }),
            drift: json!({
                "steps": 10_000, "moved_mm": 5.0, "predicted": 0, "drift_mm": 1e-4, "bound_mm": 0.02,
            }),
        }
    }

    #[test]
    fn the_page_has_all_figures_in_tables_of_equal_width() {
        let page = report().page("pictures/x.svg", 10.0).unwrap();
        assert!(
            page.contains(
                "| S = 0 | 1000 | **3.00** | 4.00 | 5.00 | 6.00 | 7.0 |  |  | 0.5 / 1.5 |"
            )
        );
        assert!(page.contains("| 1581 quadratic | 1581 | 9 / 2 / 1 | 9 / 2 / 1 | 100 / 101 |"));
        assert!(page.contains("**12.0 a second**"));
        assert!(page.contains("**1.0e-4 mm**"), "{page}");
        let tables = page.split("\n\n").filter(|part| part.starts_with('|'));
        for table in tables {
            let widths: Vec<usize> = table.lines().map(|line| line.matches('|').count()).collect();
            assert!(widths.iter().all(|width| *width == widths[0]), "{table}");
        }
    }

    #[test]
    fn a_figure_that_is_missing_is_named() {
        let mut report = report();
        report.loops[0].told["p99_ms"] = Value::Null;
        let error = format!("{:#}", report.page("x.svg", 10.0).unwrap_err());
        assert!(error.contains("1581 quadratic") && error.contains("p99_ms"), "{error}");
    }

    #[test]
    fn the_picture_names_every_loop() {
        let svg = report().plot();
        assert!(svg.contains("S = 0") && svg.contains("1581 quadratic"), "{svg}");
    }
}
