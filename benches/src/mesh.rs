//! Time of the mesher beside CGAL's with the same surfaces and rims, on one label map:
//! `bench-mesh LABELS X,Y,Z RADIUS N FOLDER`, JSON on stdout, meshes in the folder.
#![expect(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "a measurement reads the clock and tells its result"
)]

use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use supine_exchange::{read_labels, write_vtu};
use supine_flow::{Effort, by_edge_length};
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise::{Domain, Params};
use supine_tetrahedralise_cgal::{Params as Cgal, Solid, tetrahedralise};
use supine_volume::Region;

/// How near CGAL's count must come, as those who need a number would ask, in so many meshes.
const NEAR: f64 = 0.002;
const TRIES: usize = 8;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    ensure!(words.len() == 5, "bench-mesh LABELS X,Y,Z RADIUS N FOLDER");
    let centre: Vec<f64> = words[1].split(',').map(str::parse).collect::<Result<_, _>>()?;
    let [x, y, z] = centre[..] else { anyhow::bail!("{} are not three numbers", words[1]) };
    let sphere = Sphere::new(Point::new(x, y, z), words[2].parse()?)?;
    let (tetrahedra, folder) = (words[3].parse()?, Path::new(&words[4]));
    let labels = read_labels(Path::new(&words[0]), Progress::none())?;
    let region = Region::new(Arc::new(labels), sphere)?;
    let start = Instant::now();
    let domain = Domain::new(&region, &Params::default(), Progress::none())?;
    let fields_s = start.elapsed().as_secs_f64();
    let (native, _) = domain.mesh(tetrahedra, Progress::none())?;
    let native_s = start.elapsed().as_secs_f64();
    let asked = (tetrahedra, Effort { tries: TRIES, near: NEAR });
    let shell = domain.shell(tetrahedra, Progress::none())?;
    let beyond = |p: &Point| domain.beyond(p);
    let solid = Solid { beyond: &beyond, sphere: region.sphere(), rims: &shell.rims };
    let cgal =
        by_edge_length(domain.volume_mm3(), asked, Progress::none(), |edge_mm, progress| {
            let made = tetrahedralise(&solid, &Cgal { edge_mm, ..Cgal::default() }, progress);
            made.map_err(|e| supine_flow::Error::Fill { kind: e.kind(), source: e.into() })
        })?;
    let count = cgal.mesh.tets().len();
    let best = cgal.tries.iter().find(|t| t.tetrahedra == count).context("no try")?;
    write_vtu(&native, None, &folder.join("native.vtu"))?;
    write_vtu(&cgal.mesh, None, &folder.join("cgal.vtu"))?;
    // The rims that CGAL is given are not counted.
    let searched: f64 = cgal.tries.iter().map(|t| t.seconds).sum();
    let result = serde_json::json!({
        "volume_mm3": native.total_volume(),
        "native_s": native_s,
        "cgal_once_s": fields_s + best.seconds,
        "cgal_search_s": fields_s + searched,
        "cgal_runs": cgal.tries.len(),
        "cgal_edge_mm": best.edge_mm,
    });
    println!("{result}");
    Ok(())
}
