//! Whether a tumour can be where it was said to be, by the CT alone.

use rayon::prelude::*;
use supine_space::{Failure, Point, Side, Sphere};
use supine_volume::Ct;

// Chosen, not measured, unless a reason is given.
/// Less than this is air or lung, HU: fat is above -150, and half a voxel of air beside it above
/// this.
const AIR_HU: f64 = -300.0;
/// The highest value that a CT of 12 bits can hold, HU.
const DENSEST_HU: f64 = 3071.0;
/// The mean is taken over this radius at most, mm: a clip or a bubble must not decide.
const CORE_MM: f64 = 3.0;
/// More than this is the patient or her table, HU.
const BODY_HU: i16 = -200;
/// The middle of the body is looked for this far from the tumour along the body, mm.
const SLAB_MM: f64 = 30.0;
/// Every so many voxels along i and j count for the middle.
const STRIDE: usize = 2;
/// A tumour farther than this from the middle lies on that side, mm: a field of view that cuts one
/// flank moves the middle by half of what it cuts.
const SIDE_MM: f64 = 25.0;

/// Where a tumour lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TumourPlace {
    /// Mean of the CT about its centre, HU.
    pub mean_hu: f64,
    /// The patient's side it lies on; none near the middle of the body.
    pub side: Option<Side>,
}

/// Why a tumour cannot be there.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum TumourPlaceError {
    /// Not in the volume.
    #[error("its centre {centre:.1?} mm lies outside the CT, {}{hint}", extent(from, to))]
    OutsideCt {
        /// LPS, mm.
        centre: [f64; 3],
        /// Lowest corner of the CT, mm.
        from: [f64; 3],
        /// Highest corner, mm.
        to: [f64; 3],
        /// What may have happened.
        hint: &'static str,
    },
    /// Not in tissue.
    #[error(
        "its centre {centre:.1?} mm lies in air or lung ({mean_hu:.0} HU, tissue is above {AIR_HU}){hint}"
    )]
    InAir {
        /// LPS, mm.
        centre: [f64; 3],
        /// Mean about it, HU.
        mean_hu: f64,
        /// What may have happened.
        hint: &'static str,
    },
    /// Denser than tissue, bone and contrast.
    #[error(
        "the mean of the CT about its centre is {mean_hu:.0} HU, more than any tissue or bone has: are the values of the CT in HU, \
         and is its byte order right?"
    )]
    NoTissue {
        /// Mean about it, HU.
        mean_hu: f64,
    },
    /// In the other half of the body.
    #[error(
        "it lies on the patient's {found}, {away_mm:.0} mm from the middle of her body; the case says {asked}: correct \
         `breast` or the centre (LPS: x grows towards the patient's left)"
    )]
    OtherSide {
        /// Where it is.
        found: Side,
        /// Where it should be.
        asked: Side,
        /// How far from the middle, mm.
        away_mm: f64,
    },
}

impl TumourPlaceError {
    /// What the user gave is wrong.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

fn extent(from: &[f64; 3], to: &[f64; 3]) -> String {
    let axis = |n: usize| format!("{} from {:.0} to {:.0}", ["x", "y", "z"][n], from[n], to[n]);
    format!("which reaches {}, {}, {} mm", axis(0), axis(1), axis(2))
}

const RAS: &str = "; with the signs of x and y turned it would lie in tissue: was it given in RAS? Positions are LPS";
const CHECK: &str = "; correct the centre (LPS, mm)";

/// Checks that a tumour's centre lies in tissue of the CT and, where a side is asked, not in the
/// other half of the body.
///
/// The middle of the body is the median x of all that is denser than -200 HU within 30 mm along the
/// body.
///
/// # Errors
/// [`TumourPlaceError`] when its centre lies outside the CT, in air or lung (mean HU about it below
/// -300), in what no CT shows of a body (above 3071), or more than 25 mm beyond the middle of the body.
pub fn tumour_place(
    ct: &Ct,
    tumour: Sphere,
    side: Option<Side>,
) -> Result<TumourPlace, TumourPlaceError> {
    let centre = tumour.centre();
    let radius = tumour.radius().min(CORE_MM);
    let hint = || {
        let turned = Point::new(-centre.x, -centre.y, centre.z);
        let tissue = mean_hu(ct, turned, radius).is_some_and(|hu| hu > AIR_HU);
        if tissue { RAS } else { CHECK }
    };
    let at = centre.coords.into();
    let Some(mean_hu) = mean_hu(ct, centre, radius) else {
        let [from, to] = corners(ct);
        return Err(TumourPlaceError::OutsideCt { centre: at, from, to, hint: hint() });
    };
    if mean_hu < AIR_HU {
        return Err(TumourPlaceError::InAir { centre: at, mean_hu, hint: hint() });
    }
    if mean_hu > DENSEST_HU {
        return Err(TumourPlaceError::NoTissue { mean_hu });
    }
    let beyond = middle(ct, centre).map(|middle| centre.x - middle);
    let half = beyond
        .filter(|x| x.abs() > SIDE_MM)
        .map(|x| if x > 0.0 { Side::Left } else { Side::Right });
    match (half, side) {
        (Some(found), Some(asked)) if found != asked => {
            let away_mm = beyond.unwrap_or_default().abs();
            Err(TumourPlaceError::OtherSide { found, asked, away_mm })
        }
        _ => Ok(TumourPlace { mean_hu, side: half }),
    }
}

/// Mean about a place, HU; none outside the volume.
fn mean_hu(ct: &Ct, centre: Point, radius: f64) -> Option<f64> {
    let here = ct.at(ct.grid().voxel_at(&centre)?);
    let ball = Sphere::new(centre, radius).ok()?;
    let Some((start, part)) = ct.grid().around(&ball) else { return Some(here.into()) };
    let voxels = (0..part.len()).map(|n| {
        let voxel = part.voxel(n);
        [0, 1, 2].map(|a| voxel[a] + start[a])
    });
    let inside = voxels.filter(|v| ball.contains(&ct.grid().centre(*v)));
    let (count, sum) =
        inside.fold((0, 0.0), |(count, sum), v| (count + 1, sum + f64::from(ct.at(v))));
    Some(if count == 0 { here.into() } else { sum / f64::from(count) })
}

/// Lowest and highest x, y and z of voxel centres.
fn corners(ct: &Ct) -> [[f64; 3]; 2] {
    let last = ct.grid().size().map(|n| n - 1);
    let corner = |n: usize| ct.grid().centre([0, 1, 2].map(|a| last[a] * (n >> a & 1)));
    let axis = |a: usize| (0..8).map(move |n| corner(n)[a]);
    let low = [0, 1, 2].map(|a| axis(a).fold(f64::INFINITY, f64::min));
    [low, [0, 1, 2].map(|a| axis(a).fold(f64::NEG_INFINITY, f64::max))]
}

/// x of the middle of the body near a place.
fn middle(ct: &Ct, centre: Point) -> Option<f64> {
    let grid = ct.grid();
    let [ni, nj, nk] = grid.size();
    let mut all: Vec<f64> = (0..nk)
        .into_par_iter()
        .flat_map_iter(|k| {
            let rows = (0..nj).step_by(STRIDE);
            rows.flat_map(move |j| (0..ni).step_by(STRIDE).map(move |i| [i, j, k]))
        })
        .filter(|v| ct.at(*v) > BODY_HU)
        .map(|v| grid.centre(v))
        .filter(|p| (p.z - centre.z).abs() <= SLAB_MM)
        .map(|p| p.x)
        .collect();
    supine_volume::median(&mut all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Vector};
    use supine_volume::Volume;

    /// A body 300 mm wide about x = 10, in which `cut` mm of its right are not shown.
    fn body(cut: f64) -> Ct {
        let (spacing, origin) = (Vector::new(3.0, 3.0, 5.0), Point::new(-200.0 + cut, -150.0, 0.0));
        let size = [(400.0 - cut) as usize / 3, 100, 40];
        let grid = Grid::new(size, spacing, origin, Matrix::identity()).unwrap();
        Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            if ((p.x - 10.0) / 150.0).hypot(p.y / 110.0) < 1.0 { 20 } else { -1000 }
        })
    }

    fn at(x: f64, y: f64) -> Sphere {
        Sphere::new(Point::new(x, y, 100.0), 8.0).unwrap()
    }

    #[test]
    fn the_side_is_that_of_the_body_and_not_of_the_axes() {
        for cut in [0.0, 90.0] {
            let ct = body(cut);
            let side = |x: f64| tumour_place(&ct, at(x, -60.0), None).unwrap().side;
            assert_eq!(side(80.0), Some(Side::Left));
            assert_eq!(side(-60.0), Some(Side::Right));
        }
        let ct = body(0.0);
        assert_eq!(tumour_place(&ct, at(20.0, -60.0), Some(Side::Right)).unwrap().side, None);
        let wrong = tumour_place(&ct, at(-60.0, -60.0), Some(Side::Left)).unwrap_err();
        let told = wrong.to_string();
        assert!(told.starts_with("it lies on the patient's right, "), "{told}");
        let TumourPlaceError::OtherSide { away_mm, .. } = wrong else { panic!("{told}") };
        assert!((away_mm - 70.0).abs() < 5.0, "{told}");
        assert!(told.contains("the case says left"), "{told}");
    }

    #[test]
    fn outside_and_in_air_it_is_told_where_the_ct_is_and_what_may_be_wrong() {
        let ct = body(0.0);
        let told = |x, y| tumour_place(&ct, at(x, y), None).unwrap_err().to_string();
        let outside = told(500.0, 0.0);
        assert!(outside.contains("x from -200 to 196") && outside.contains("correct"), "{outside}");
        assert!(told(0.0, -140.0).contains("in air or lung (-1000 HU"));
        assert!(told(-60.0, 300.0).contains("outside the CT"));
        let ras = tumour_place(&body(60.0), at(-146.0, 20.0), None).unwrap_err().to_string();
        assert!(ras.contains("was it given in RAS"), "{ras}");
    }

    #[test]
    fn values_that_are_no_hu_are_told() {
        let swapped = body(0.0).map(|hu| hu.swap_bytes());
        let told = tumour_place(&swapped, at(80.0, -60.0), None).unwrap_err().to_string();
        assert!(told.contains("byte order"), "{told}");
    }
}
