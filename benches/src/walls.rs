//! The chest wall of one CT as several weights of its search make it: `bench-walls CT OUT [NAME:FAT,MUSCLE,HU,EDGE,JUMP,LUNG]...
//! [SEED:wall|soft,X,Y,Z]`.
//!
//! Writes OUT/NAME.nrrd (labels) and OUT/NAME-error.nrrd (the error that 19 of 20 places do not exceed, tenths of mm) for each;
//! `default` without any. A seed (LPS, mm) goes with all of them.

use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::sync::Arc;
use supine_exchange::{write_labels, write_tenths};
use supine_segment::{Params, Segmenter, Weights};
use supine_space::{Point, Progress};
use supine_volume::Seeds;

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let [ct, out, rest @ ..] = &given[..] else { anyhow::bail!("bench-walls CT OUT ...") };
    let input = supine_flow::read_ct(Path::new(ct), &Default::default(), Progress::none())?;
    let (field, ct, out) = (input.field(), Arc::new(input.ct), Path::new(out));
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
