//! What points on the applicator's surface buy: the motion of the probes after path 1, against a
//! finer quadratic solution with points on the surface.

use crate::reference::{Reference, rows};
use crate::{SETTLED, SPHERE, STEPS, pose};
use anyhow::Result;
use ndarray::Array2;
use serde_json::{Value, json};
use std::sync::Arc;
use supine_fem::{Applicator, Body, Contact, Insertion, Load, Params, snapped};
use supine_mesh::{Edges, Locator, Order};
use supine_space::{Point, Progress, Vector};

/// Probes nearer to the centre of the sphere, where it begins, do not count, mm.
const NEAR_MM: f64 = 24.0;
/// The mesh of the truth.
const TRUE: &str = "12k";

/// Error of the probes' motion with the mesh as it is and with points moved onto the sphere: root
/// mean square (mm), largest (mm), nodes in the sphere.
pub(crate) fn measure(
    reference: &Reference,
    body: &Body,
    load: &Load,
    params: &Params,
) -> Result<Value> {
    let points: Array2<f64> = reference.open("probes")?.by_name("pts")?;
    let points: Vec<Point> = rows(&points).into_iter().map(Point::from).collect();
    let fine = Arc::new(reference.mesh(TRUE)?);
    let finer = Params { order: Order::Quadratic, ..*params };
    let onto =
        |body: &Body, params: &Params| snapped(body, load, params, &SPHERE, Progress::none());
    let (fine, _) = onto(&Body { mesh: fine.clone(), ..body.clone() }, &finer)?;
    let (truth, _) = motion(&Body { mesh: fine.clone(), ..body.clone() }, load, &finer, &points)?;
    let (moved_mesh, moved) = onto(body, params)?;
    let error = |body: &Body| -> Result<Value> {
        let (found, nodes) = motion(body, load, params, &points)?;
        let far = |n: &usize| (truth[*n].0 - SPHERE.centre).norm() > NEAR_MM;
        let off = (0..points.len()).filter(far).map(|n| (found[n].1 - truth[n].1).norm());
        let off: Vec<f64> = off.collect();
        let square = off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64;
        Ok(json!([square.sqrt(), off.into_iter().fold(0.0, f64::max), nodes]))
    };
    let (ragged, exact) = (error(body)?, error(&Body { mesh: moved_mesh, ..body.clone() })?);
    Ok(json!({ "moved": moved, "ragged": ragged, "exact": exact }))
}

/// Where each point lies in the tilted breast and how path 1 moves it, mm; and the nodes in the
/// sphere.
fn motion(
    body: &Body,
    load: &Load,
    params: &Params,
    points: &[Point],
) -> Result<(Vec<(Point, Vector)>, usize)> {
    let (mut applicator, _) = Applicator::attach(
        body,
        load,
        params,
        &Insertion::new(&SPHERE, Contact::Tied),
        Progress::none(),
    )?;
    let before = applicator.deformation()?;
    applicator.settle(&pose("1", STEPS)?, SETTLED, Progress::none())?;
    let after = applicator.deformation()?;
    let (edges, locator) = (Edges::new(&body.mesh), Locator::new(body.mesh.clone()));
    let of = |p: &Point| {
        let place = locator.nearest(p);
        let [before, after] = [&before, &after]
            .map(|u| u.displacement().at(&body.mesh, &edges, place.tet, place.weights));
        (p + before, after - before)
    };
    Ok((points.iter().map(of).collect(), applicator.coupled_nodes()))
}
