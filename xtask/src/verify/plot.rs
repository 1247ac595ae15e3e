//! Plots with logarithmic axes as SVG.

use std::fmt::Write;

/// One plot.
pub(super) struct Panel {
    pub(super) title: &'static str,
    /// What lies along x and along y, with units.
    pub(super) axes: [&'static str; 2],
    pub(super) lines: Vec<Line>,
}

/// Points joined by a line.
pub(super) struct Line {
    pub(super) name: String,
    /// Place in [`COLOURS`].
    pub(super) colour: usize,
    pub(super) dashed: bool,
    /// x and y, above 0.
    pub(super) points: Vec<[f64; 2]>,
}

/// Told apart without red and green: Okabe and Ito 2008.
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#666666"];
/// Of a panel, and of the drawing in it: left, top, right and bottom margin.
const SIZE: [f64; 2] = [650.0, 400.0];
const MARGIN: [f64; 4] = [70.0, 40.0, 200.0, 55.0];
/// The legend stands beside the drawing, a line below the other.
const LEGEND_GAP: f64 = 14.0;
const LEGEND_STEP: f64 = 17.0;

/// The panels side by side.
pub(super) fn svg(panels: &[Panel]) -> String {
    let [width, height] = [SIZE[0] * panels.len() as f64, SIZE[1]];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for (n, panel) in panels.iter().enumerate() {
        let _ = writeln!(svg, "<g transform=\"translate({} 0)\">", n as f64 * SIZE[0]);
        panel.draw(&mut svg);
        svg += "</g>\n";
    }
    svg + "</svg>\n"
}

/// The powers of ten between which one coordinate of all points lies, and where a value of it is
/// drawn.
struct Axis {
    from: f64,
    to: f64,
    start: f64,
    end: f64,
}

impl Axis {
    fn new(lines: &[Line], k: usize) -> Self {
        let logs = || lines.iter().flat_map(|l| &l.points).map(|p| p[k].log10());
        let from = logs().fold(f64::INFINITY, f64::min);
        let to = logs().fold(f64::NEG_INFINITY, f64::max);
        let [left, top, right, bottom] = MARGIN;
        let (start, end) = if k == 0 { (left, SIZE[0] - right) } else { (SIZE[1] - bottom, top) };
        // To the next mark, so that no point lies on the frame.
        Self { from: mark(from - 0.05, f64::floor), to: mark(to + 0.05, f64::ceil), start, end }
    }

    fn at(&self, log: f64) -> f64 {
        self.start + (self.end - self.start) * (log - self.from) / (self.to - self.from)
    }

    /// Values that are marked: 1, 2 and 5 times powers of ten.
    fn marks(&self) -> impl Iterator<Item = f64> + '_ {
        let decades = self.from.floor() as i32..=self.to.ceil() as i32;
        let all = decades.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
        all.filter(|v| (self.from - 1e-9..=self.to + 1e-9).contains(&v.log10()))
    }
}

/// The nearest mark (as a logarithm) in one direction.
fn mark(log: f64, towards: fn(f64) -> f64) -> f64 {
    let (decade, part) = (log.floor(), log - log.floor());
    let marks = [0.0, 2f64.log10(), 5f64.log10(), 1.0];
    let up = towards(0.5) > 0.5;
    let nearest = if up {
        marks.into_iter().find(|m| *m >= part)
    } else {
        marks.into_iter().rev().find(|m| *m <= part)
    };
    decade + nearest.unwrap_or(0.0)
}

impl Panel {
    fn draw(&self, svg: &mut String) {
        let [x, y] = [0, 1].map(|k| Axis::new(&self.lines, k));
        let middle = (x.start + x.end) / 2.0;
        let _ = writeln!(
            svg,
            "<text x=\"{middle}\" y=\"22\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>\n\
             <text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            self.title,
            SIZE[1] - 12.0,
            self.axes[0],
            (y.start + y.end) / 2.0,
            self.axes[1],
        );
        for mark in x.marks() {
            let at = x.at(mark.log10());
            rule(svg, [at, y.start], [at, y.end]);
            // Long numbers along a wide axis would touch.
            let decade = (mark.log10() - mark.log10().round()).abs() < 1e-9;
            if x.to - x.from > 3.0 && !decade {
                continue;
            }
            let _ = writeln!(
                svg,
                "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                y.start + 17.0,
                short(mark)
            );
        }
        for mark in y.marks() {
            let at = y.at(mark.log10());
            rule(svg, [x.start, at], [x.end, at]);
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                x.start - 6.0,
                at + 4.0,
                short(mark)
            );
        }
        for (n, line) in self.lines.iter().enumerate() {
            line.draw(svg, &x, &y);
            line.name(svg, [x.end + LEGEND_GAP, y.end + LEGEND_STEP * (n + 1) as f64]);
        }
    }
}

impl Line {
    /// Colour, width and dashes.
    fn stroke(&self) -> String {
        let dash = if self.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        format!("stroke=\"{}\" stroke-width=\"2\"{dash}", COLOURS[self.colour])
    }

    fn draw(&self, svg: &mut String, x: &Axis, y: &Axis) {
        let (colour, stroke) = (COLOURS[self.colour], self.stroke());
        let at = |p: &[f64; 2]| [x.at(p[0].log10()), y.at(p[1].log10())];
        let path: Vec<String> =
            self.points.iter().map(at).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(svg, "<polyline points=\"{}\" fill=\"none\" {stroke}/>", path.join(" "));
        for [x, y] in self.points.iter().map(at) {
            let _ =
                writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>");
        }
    }

    /// Its name after a piece of it, the baseline beginning there.
    fn name(&self, svg: &mut String, [left, base]: [f64; 2]) {
        let (middle, end, stroke) = (base - 4.0, left + 26.0, self.stroke());
        let _ = writeln!(
            svg,
            "<line x1=\"{left}\" y1=\"{middle}\" x2=\"{end}\" y2=\"{middle}\" {stroke}/>\n\
             <text x=\"{}\" y=\"{base}\">{}</text>",
            end + 6.0,
            self.name
        );
    }
}

/// A line of the grid.
fn rule(svg: &mut String, from: [f64; 2], to: [f64; 2]) {
    let _ = writeln!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#dddddd\"/>",
        from[0], from[1], to[0], to[1]
    );
}

/// A mark's value in few characters.
fn short(value: f64) -> String {
    let value = (value * 1e6).round() / 1e6;
    if value >= 1000.0 { format!("{}k", value / 1000.0) } else { value.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_reaches_from_mark_to_mark_beyond_all_points() {
        let points = vec![[0.011, 3.0], [40.0, 0.9]];
        let lines = [Line { name: String::new(), colour: 0, dashed: false, points }];
        let [x, y] = [0, 1].map(|k| Axis::new(&lines, k));
        let ends = |axis: &Axis| [axis.from, axis.to].map(|log| 10f64.powf(log));
        let near =
            |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-9);
        // 0.01 would be nearer to the first point than the margin.
        assert!(near(ends(&x), [0.005, 50.0]), "{:?}", ends(&x));
        assert!(near(ends(&y), [0.5, 5.0]), "{:?}", ends(&y));
        assert_eq!(y.marks().map(short).collect::<Vec<_>>(), ["0.5", "1", "2", "5"]);
        assert!((x.at(x.from) - MARGIN[0]).abs() < 1e-9 && (y.at(y.to) - MARGIN[1]).abs() < 1e-9);
    }
}
