//! Connected components of a mask.

use crate::Volume;

/// Face-connected components of a mask.
#[derive(Clone, Debug)]
pub struct Components {
    /// Component of each voxel, counted from 1 in order of first voxel in memory; 0 outside.
    pub ids: Volume<u32>,
    /// Voxels of each component; entry 0 counts the outside.
    pub sizes: Vec<usize>,
}

impl Components {
    /// The component with the most voxels (the first of equals); `None` when the mask is empty.
    pub fn largest(&self) -> Option<u32> {
        let (id, _) = self
            .sizes
            .iter()
            .enumerate()
            .skip(1)
            .max_by_key(|&(id, &size)| (size, std::cmp::Reverse(id)))?;
        u32::try_from(id).ok()
    }

    /// The mask of one component.
    pub fn mask(&self, id: u32) -> Volume<bool> {
        self.ids.map(|&c| c == id)
    }
}

/// The face-connected (6-neighbour) components of `mask`.
pub fn components(mask: &Volume<bool>) -> Components {
    let grid = mask.grid();
    let size = grid.size();
    let stride = [1, size[0], size[0] * size[1]];
    let mut ids = vec![0u32; grid.len()];
    let mut sizes = vec![0usize];
    let mut stack = Vec::new();
    for seed in 0..grid.len() {
        if !mask.data()[seed] || ids[seed] != 0 {
            continue;
        }
        let id = u32::try_from(sizes.len()).unwrap_or(u32::MAX);
        let mut count = 0;
        ids[seed] = id;
        stack.push(seed);
        while let Some(n) = stack.pop() {
            count += 1;
            let voxel = grid.voxel(n);
            for a in 0..3 {
                let mut visit = |m: usize| {
                    if mask.data()[m] && ids[m] == 0 {
                        ids[m] = id;
                        stack.push(m);
                    }
                };
                if voxel[a] > 0 {
                    visit(n - stride[a]);
                }
                if voxel[a] + 1 < size[a] {
                    visit(n + stride[a]);
                }
            }
        }
        sizes.push(count);
    }
    sizes[0] = grid.len() - sizes.iter().sum::<usize>();
    Components { ids: Volume::from_parts(grid.clone(), ids), sizes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn corners_do_not_connect_and_the_largest_is_found() {
        let g = Grid::new([4, 2, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        // 1 0 1 1
        // 0 1 0 1
        let on = [true, false, true, true, false, true, false, true];
        let c = components(&Volume::new(g.unwrap(), on.to_vec()).unwrap());
        assert_eq!(c.sizes, vec![3, 1, 3, 1]);
        assert_eq!(c.largest(), Some(2));
        assert_eq!(c.mask(2).data().iter().filter(|&&m| m).count(), 3);
    }
}
