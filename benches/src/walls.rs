//! The chest wall of one CT as several weights of its search make it: `bench-walls CT OUT
//! [NAME:FAT,MUSCLE,HU,EDGE,JUMP,LUNG]... [SEED:wall|soft,X,Y,Z] [PHASES]`.
//!
//! Writes OUT/NAME.nrrd (labels) and OUT/NAME-error.nrrd (the error that 19 of 20 places do not
//! exceed, tenths of mm) for each; `default` without any. A seed (LPS, mm) goes with all of them.
//! `PHASES` instead: what is said of both breasts on every second and third slice, from each slice
//! on, and on means of two; a line each on stdout: the way, the side, and the thickness beside the
//! other breast in per cent or why there is none.
#![expect(clippy::print_stdout, reason = "a measurement tells its result")]

use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::sync::Arc;
use supine_exchange::{write_labels, write_tenths};
use supine_segment::{Breast, BreastPlace, Params, Segmenter, Weights, check_region};
use supine_space::{Grid, Point, Progress, Side, Sphere, Vector};
use supine_volume::{Ct, Field, LabelMap, Seeds};

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let [ct, out, rest @ ..] = &given[..] else { anyhow::bail!("bench-walls CT OUT ...") };
    let input = supine_flow::read_ct(Path::new(ct), &Default::default(), Progress::none())?;
    let (field, ct, out) = (input.field(), Arc::new(input.ct), Path::new(out));
    if rest.iter().any(|text| text == "PHASES") {
        return phases(&ct, &field);
    }
    let (mut wanted, mut seeds) = (Vec::new(), Seeds::default());
    for text in rest {
        let (name, value) = text.split_once(':').context("NAME:VALUES")?;
        match name {
            "SEED" => add(&mut seeds, value)?,
            name => wanted.push((name, weights(value)?)),
        }
    }
    if wanted.is_empty() {
        wanted.push(("default", Weights::default()));
    }
    for (name, weights) in wanted {
        let params = Params { weights, ..Params::default() };
        let segmenter = Segmenter::new(ct.clone(), &field, &params, Progress::none())?;
        let (made, _) = segmenter.segment(&seeds, Progress::none())?;
        write_labels(&made.labels, &out.join(format!("{name}.nrrd")), Progress::none())?;
        let error = segmenter.uncertainty(&made);
        write_tenths(&error, &out.join(format!("{name}-error.nrrd")), Progress::none())?;
    }
    Ok(())
}

/// What is said of both breasts on each way to take fewer slices.
fn phases(ct: &Ct, field: &Field) -> Result<()> {
    for step in 1..=3 {
        for from in 0..step {
            let every = thinned(ct, (from, step), |slices, n| slices[0][n])?;
            told(&format!("every {step} from {from}"), every, field)?;
        }
    }
    for from in 0..2 {
        let mean = |slices: &[&[i16]], n: usize| {
            (f32::from(slices[0][n]) / 2.0 + f32::from(slices[1][n]) / 2.0).floor() as i16
        };
        told(&format!("pairs from {from}"), thinned(ct, (from, 2), mean)?, field)?;
    }
    Ok(())
}

/// The CT of whole groups of so many slices, `value`d pixel by pixel.
fn thinned(
    ct: &Ct,
    (from, step): (usize, usize),
    value: impl Fn(&[&[i16]], usize) -> i16,
) -> Result<Ct> {
    let ([ni, nj, nk], old) = (ct.grid().size(), ct.grid());
    let slices: Vec<&[i16]> = ct.data().chunks(ni * nj).skip(from).collect();
    let groups = slices.chunks_exact(step);
    ensure!(groups.len() > 0, "{nk} slices are too few");
    let spacing = old.spacing();
    let spacing = Vector::new(spacing[0], spacing[1], spacing[2] * step as f64);
    let size = [ni, nj, groups.len()];
    let grid = Grid::new(size, spacing, old.centre([0, 0, from]), *old.direction())?;
    let data = groups.flat_map(|group| (0..ni * nj).map(|n| value(group, n)).collect::<Vec<_>>());
    Ok(Ct::new(grid, data.collect())?)
}

/// Tells what is said of both breasts of a CT.
fn told(way: &str, ct: Ct, field: &Field) -> Result<()> {
    let ct = Arc::new(ct);
    let made = Segmenter::new(ct.clone(), field, &Params::default(), Progress::none())
        .and_then(|segmenter| Ok(segmenter.segment(&Seeds::default(), Progress::none())?.0));
    for side in [Side::Left, Side::Right] {
        let words = match &made {
            Ok(made) => breast(&ct, &made.labels, side, field),
            Err(error) => format!("CT refused: {error}"),
        };
        println!("{way}\t{side}\t{words}");
    }
    Ok(())
}

/// The thickness about the breast of a side in per cent of the other's, or why there is no such
/// breast.
fn breast(ct: &Ct, labels: &LabelMap, side: Side, field: &Field) -> String {
    let breast = match Breast::find(labels, side, None) {
        Ok(breast) => breast,
        Err(error) => return format!("no breast: {error}"),
    };
    let place =
        |region: Sphere| BreastPlace { region, side, breast: Some(&breast), uncertainty: None };
    // Small, so that what lies round the breast refuses nothing.
    let checked =
        Sphere::new(breast.centre(), 20.0).ok().map(|r| check_region(ct, field, labels, &place(r)));
    let checks = match checked {
        Some(Ok(checked)) => checked.checks,
        Some(Err(error)) => return format!("cut: {error}"),
        None => Vec::new(),
    };
    let share = checks.iter().find(|check| check.what.ends_with("against the other side"));
    share.map_or("alone".to_owned(), |share| format!("{:.0} %", share.value))
}

fn weights(text: &str) -> Result<Weights> {
    let [fat, muscle, muscle_hu, edge, jump, lung] = numbers(text)?;
    Ok(Weights { fat, muscle, muscle_hu, edge, jump, lung })
}

fn add(seeds: &mut Seeds, text: &str) -> Result<()> {
    let (kind, place) = text.split_once(',').context("a kind and a place")?;
    let point = Point::from(numbers(place)?.map(f64::from));
    ensure!(["wall", "soft"].contains(&kind), "no kind of seed: {kind}");
    let points = if kind == "wall" { &mut seeds.chest_wall } else { &mut seeds.soft_tissue };
    points.push(point);
    Ok(())
}

fn numbers<const N: usize>(text: &str) -> Result<[f32; N]> {
    let values = text.split(',').map(str::parse).collect::<Result<Vec<f32>, _>>()?;
    values.try_into().ok().with_context(|| format!("{N} numbers, not {text}"))
}
