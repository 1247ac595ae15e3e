//! The grid of a NRRD header in LPS, mm.

use super::header::Header;
use crate::Problem;
use supine_space::{Grid, Matrix, Point, Vector};

/// Where the samples lie.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) grid: Grid,
    /// Values per voxel.
    pub(super) layers: usize,
    /// Whether the axis without a direction comes first.
    pub(super) layers_first: bool,
}

/// The grid of three spatial axes, and a fourth axis, first or last, of values per voxel.
pub(super) fn layout(header: &Header) -> Result<Layout, Problem> {
    let to_lps = to_lps(header)?;
    let sizes = sizes(header)?;
    let directions = directions(header, sizes.len())?;
    let spatial: Vec<usize> = (0..sizes.len()).filter(|&a| directions[a].is_some()).collect();
    let (layers, layers_first) = match (sizes.len(), spatial.as_slice()) {
        (3, [0, 1, 2]) => (1, false),
        (4, [1, 2, 3]) => (sizes[0], true),
        (4, [0, 1, 2]) => (sizes[3], false),
        _ => {
            let reason = "expected three axes with a direction, and at most one without, which is \
                          the first or the last";
            return Err(Problem::field("space directions", reason));
        }
    };
    if layers == 0 {
        return Err(Problem::field("sizes", "an axis has no samples"));
    }
    let columns: Vec<Vector> =
        directions.iter().flatten().map(|d| d.component_mul(&to_lps)).collect();
    let spacing = Vector::from_fn(|a, _| columns[a].norm());
    let direction = Matrix::from_fn(|r, c| columns[c][r] / spacing[c]);
    let origin = vector(header.required("space origin")?, "space origin")?;
    let origin = Point::from(origin.component_mul(&to_lps));
    let size = [sizes[spatial[0]], sizes[spatial[1]], sizes[spatial[2]]];
    let grid = Grid::new(size, spacing, origin, direction)?;
    Ok(Layout { grid, layers, layers_first })
}

/// Signs that turn a vector of the file's frame into LPS.
fn to_lps(header: &Header) -> Result<Vector, Problem> {
    if let Some(units) = header.field("space units")
        && !units.split_whitespace().all(|u| matches!(u.trim_matches('"'), "mm" | "" | "???"))
    {
        return Err(Problem::field("space units", format!("`{units}` instead of \"mm\"")));
    }
    let Some(space) = header.field("space") else {
        let reason = "is missing, so that left and right of the patient are not known: add the \
                      line `space: left-posterior-superior` if the file is in LPS";
        return Err(Problem::field("space", reason));
    };
    match space.to_ascii_lowercase().as_str() {
        "left-posterior-superior" | "lps" => Ok(Vector::new(1.0, 1.0, 1.0)),
        "right-anterior-superior" | "ras" => Ok(Vector::new(-1.0, -1.0, 1.0)),
        "left-anterior-superior" | "las" => Ok(Vector::new(1.0, -1.0, 1.0)),
        _ => {
            let reason = format!(
                "`{space}` is not an anatomical frame of three axes: expected \
                 left-posterior-superior, right-anterior-superior or left-anterior-superior"
            );
            Err(Problem::field("space", reason))
        }
    }
}

fn sizes(header: &Header) -> Result<Vec<usize>, Problem> {
    let text = header.required("sizes")?;
    let sizes: Result<Vec<usize>, _> = text.split_whitespace().map(str::parse).collect();
    let sizes = sizes.map_err(|_| Problem::field("sizes", format!("`{text}` are not counts")))?;
    let dimension = header.required("dimension")?;
    if dimension.parse() != Ok(sizes.len()) {
        let reason = format!("{} numbers for dimension {dimension}", sizes.len());
        return Err(Problem::field("sizes", reason));
    }
    Ok(sizes)
}

/// One vector, or none, for each axis.
fn directions(header: &Header, axes: usize) -> Result<Vec<Option<Vector>>, Problem> {
    let name = "space directions";
    let Some(mut rest) = header.field(name) else {
        let reason = "is missing: `spacings` alone do not say which way the axes point";
        return Err(Problem::field(name, reason));
    };
    let mut directions = Vec::new();
    while !rest.is_empty() && directions.len() <= axes {
        if let Some(after) = rest.strip_prefix("none") {
            directions.push(None);
            rest = after.trim_start();
        } else {
            let end = rest.find(')').ok_or_else(|| Problem::field(name, "a `)` is missing"))?;
            directions.push(Some(vector(&rest[..=end], name)?));
            rest = rest[end + 1..].trim_start();
        }
    }
    if directions.len() != axes {
        let reason = format!("{} entries for {axes} axes", directions.len());
        return Err(Problem::field(name, reason));
    }
    Ok(directions)
}

/// A vector written as `(x,y,z)`.
fn vector(text: &str, field: &'static str) -> Result<Vector, Problem> {
    let wrong = || {
        let shown: String = text.chars().take(40).collect();
        Problem::field(field, format!("`{shown}` is not a vector (x,y,z)"))
    };
    let inner = text.trim().strip_prefix('(').and_then(|t| t.strip_suffix(')'));
    let numbers: Vec<f64> = inner
        .ok_or_else(wrong)?
        .split(',')
        .map(|n| n.trim().parse())
        .collect::<Result<_, _>>()
        .map_err(|_| wrong())?;
    let xyz: [f64; 3] = numbers.try_into().map_err(|_| wrong())?;
    Ok(xyz.into())
}
