//! How little the surface of the wall looks like the outer end of muscle, ray by ray.

use crate::aggregate::Costs;
use crate::band::{LOWEST_MM, STEP_MM};
use crate::levels::Levels;
use crate::radial_map::RadialMap;

/// From muscle to fat within this distance on both sides, mm: what is missing of it counts in full.
const EDGE_MM: f32 = 2.0;
/// Fat inside and dense tissue outside are summed from one distance to the other, mm, and count
/// this much per mm.
const NEAR_MM: [f32; 2] = [1.0, 5.0];
const FAT_INSIDE: f32 = 0.3;
const DENSE_OUTSIDE: f32 = 0.15;

/// 0 where muscle ends at the surface (its height over the shell, mm) and fat begins; 1 where
/// nothing ends; up to 3 where it is the wrong way round. `hu` are the values along the rays.
pub(crate) fn misfit(hu: &Costs, levels: Levels, height: &RadialMap) -> RadialMap {
    let steps = |mm: f32| (mm / STEP_MM) as usize;
    let [from, to] = NEAR_MM.map(steps);
    RadialMap::from_fn(height.slices(), |k, p| {
        // Half muscle where nothing is known.
        let muscle = |v: &f32| if v.is_nan() { 0.5 } else { levels.likeness(*v) };
        let ray = hu.ray(k, p);
        let last = ray.len() - 1;
        let here = (((height.at(k, p) - LOWEST_MM) / STEP_MM).round().max(0.0) as usize).min(last);
        let (inside, outside) =
            (|n: usize| here.saturating_sub(n), |n: usize| (here + n).min(last));
        let edge = steps(EDGE_MM);
        let fall = muscle(&ray[inside(edge)]) - muscle(&ray[outside(edge)]);
        let fat: f32 = ray[inside(to)..inside(from)].iter().map(|v| 1.0 - muscle(v)).sum();
        let dense: f32 = ray[outside(from)..outside(to)].iter().map(muscle).sum();
        1.0 - fall + STEP_MM * (FAT_INSIDE * fat + DENSE_OUTSIDE * dense)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radial_map::RAYS;

    #[test]
    fn a_surface_at_the_end_of_muscle_fits_and_one_in_fat_or_in_muscle_does_not() {
        let levels = Levels { fat: -100.0, muscle: 50.0 };
        let end = 60;
        let hu = Costs::new(1, 120, |_, out| {
            for (n, hu) in out.iter_mut().enumerate() {
                *hu = if n % 120 < end { 50.0 } else { -100.0 };
            }
        });
        let at = |mm: f32| {
            let height = LOWEST_MM + STEP_MM * end as f32 + mm;
            misfit(&hu, levels, &RadialMap::new(1, height)).values[RAYS / 2]
        };
        assert!(at(0.0) < 0.05, "{}", at(0.0));
        assert!(at(3.0) > 1.1 && at(14.0) > 2.0 && at(-14.0) > 1.5, "{} {}", at(14.0), at(-14.0));
    }
}
