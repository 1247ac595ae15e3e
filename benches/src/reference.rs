//! The reference data of the mechanics, and what is measured of a process.

#[path = "cost.rs"]
mod cost;

use anyhow::{Context, Result, bail};
pub(crate) use cost::{cpu_s, memory_mb};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;
use std::fs::File;
use std::path::PathBuf;
use supine_mesh::{BoundaryFace, BoundaryTag, Order, TetMesh};
use supine_space::{Point, TablePose, Vector};

/// The folder of the reference's arrays.
pub(crate) struct Reference(pub(crate) PathBuf);

impl Reference {
    pub(crate) fn open(&self, name: &str) -> Result<NpzReader<File>> {
        let path = self.0.join(format!("{name}.npz"));
        let file = File::open(&path).with_context(|| path.display().to_string())?;
        Ok(NpzReader::new(file)?)
    }

    /// The stored fields of a mesh, if there are any.
    pub(crate) fn fields(&self, mesh: &str, order: Order) -> Result<Option<NpzReader<File>>> {
        let name = format!("fields_{mesh}_P{}", order.number());
        let stored = self.0.join(format!("{name}.npz")).is_file();
        if stored { self.open(&name).map(Some) } else { Ok(None) }
    }

    pub(crate) fn mesh(&self, name: &str) -> Result<TetMesh> {
        let mut file = self.open(&format!("mesh_{name}"))?;
        let nodes: Array2<f64> = file.by_name("nodes")?;
        let tets: Array2<i32> = file.by_name("tets")?;
        let tris: Array2<i32> = file.by_name("tris")?;
        let tags: Array1<i8> = file.by_name("tags")?;
        let corner = |n: i32| u32::try_from(n).context("a node below 0");
        let tet = |t: usize| -> Result<[u32; 4]> {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| corner(tets[(t, k)]));
            Ok([a?, b?, c?, d?])
        };
        let face = |f: usize| -> Result<BoundaryFace> {
            let [a, b, c] = [0, 1, 2].map(|k| corner(tris[(f, k)]));
            // The arrays number the tags 1 chest wall, 2 skin, 3 cut.
            let tag = match tags[f] {
                1 => BoundaryTag::ChestWall,
                2 => BoundaryTag::Skin,
                3 => BoundaryTag::Cut,
                other => bail!("tag {other}"),
            };
            Ok(BoundaryFace { points: [a?, b?, c?], tag })
        };
        let tets = (0..tets.nrows()).map(tet).collect::<Result<_>>()?;
        let faces = (0..tris.nrows()).map(face).collect::<Result<_>>()?;
        Ok(TetMesh::new(rows(&nodes).into_iter().map(Point::from).collect(), tets, faces)?)
    }
}

/// The order of that number.
pub(crate) fn order(number: &str) -> Result<Order> {
    match number {
        "1" => Ok(Order::Linear),
        "2" => Ok(Order::Quadratic),
        other => bail!("order {other} is neither 1 nor 2"),
    }
}

/// Gravity on the reference's table.
pub(crate) fn tilt() -> Vector {
    TablePose { ap_deg: 7.0, lat_deg: 5.0 }.gravity()
}

pub(crate) fn rows(array: &Array2<f64>) -> Vec<[f64; 3]> {
    array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect()
}
