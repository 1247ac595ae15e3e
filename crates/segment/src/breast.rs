//! The breast in the labels: where it ends, its highest point, and the sphere that holds it.
//!
//! Seen from the front, the breast is the mound of soft tissue of one side between the midline and
//! the front of the armpit: what faces the side more than the front is the fat of armpit, arm and
//! flank.

use crate::Error;
use crate::front::{Axis, Front};
use crate::other_side::Compared;
use supine_space::{Grid, Point, Side, Sphere, Vector, Warning};
use supine_volume::{
    LabelMap, Volume, gaussian, largest_radius, median, quantile, sample_trilinear_at,
};

// Chosen, not measured, unless a reason is given.
/// The mound is looked for at this scale, mm: about half the radius of a small breast.
const MOUND_MM: f64 = 30.0;
/// The breast ends where the thickness has fallen to this share between the rest and its peak.
const RIM_SHARE: f32 = 0.15;
/// Straight towards the head by this much more: there a breast runs out into the fat before the
/// armpit without an edge. Measured: by eye the middles of the breasts of chest-lidc0001 lie at
/// half the height of fold and upper border; with 0.15 the regions' lay 9 (left) and 6 mm (right)
/// higher, with 0.22 3 mm, with 0.35 4 mm lower. On phantoms it moves by 2 mm.
const RIM_SHARE_UP: f32 = 0.22;
/// Directions in which the rim is looked for.
const RAYS: usize = 72;
/// Step along them, mm.
const STEP_MM: f64 = 2.0;
/// Where the skin falls back by more than this between neighbours of the map, it faces the front
/// no more, mm.
const STEEP_MM: f64 = 12.0;
/// No rim lies farther from the middle, mm: the fat of the armpit can go on to the shoulder.
const FARTHEST_MM: f64 = 90.0;
/// How near to its middle the tumour of a breast lies (standard deviation), mm.
const TUMOUR_MM: f64 = 75.0;
/// Share of the rim that the sphere holds: single rays run on into armpit and flank.
const HELD: f64 = 0.8;
/// The sphere holds the breast up to its rim and this much more, mm: what is left of its thickness
/// at the rim runs out over about 17 mm, and the cut is to lie 15 mm beyond.
const MARGIN_MM: f64 = 32.0;
/// Where the slices end the margin may shrink to this before the sphere is moved, mm.
const MIN_MARGIN_MM: f64 = 15.0;
/// The sphere stays this far from the first and last slice, mm.
const CLEAR_MM: f64 = 1.0;
/// The highest point is not looked for this close to the first and last slice, mm.
const ENDS_MM: f64 = 20.0;
/// What lies this close to the first and last slice tells whether they cut the breast, mm.
const EDGE_MM: f64 = 8.0;
/// What has more than this share of its greatest thickness there goes on beyond them. Measured: 1.4
/// to 1.5 at the raised right arm of breast-lidc0314, which on every second or third slice made the
/// larger mound.
const GOES_ON: f64 = 0.9;
/// Least thickness of a breast at its peak, mm.
const MIN_MM: f32 = 12.0;
/// Least height of a breast over the tissue around it, which is as thin as this share of that
/// side's, mm; the fat of a flat chest varies less.
const MIN_RISE_MM: f32 = 6.0;
const FLAT_SHARE: f64 = 0.25;
/// A nipple lies where the breast has this share of its greatest thickness; a tube beside the
/// breast of breast-rider0109, at 0.55, is none.
const NIPPLE_SHARE: f64 = 0.7;

/// A side with less than this share of the other breast's thickness there has no breast. Measured:
/// 0.81 to 1.24 between the sides of four real CTs and four synthetic patients; 0.39 at most where
/// a breast of these was taken off to 9 mm, but for chest-cmb01068, where the other is hardly a
/// breast.
pub(crate) const MISSING_SHARE: f64 = 0.45;

const FLAT: &str =
    "no mound of soft tissue stands in front of the chest wall; the fat of the armpit is none";

/// The breast of one side.
#[derive(Clone, Debug)]
pub struct Breast {
    pub(crate) side: Side,
    /// Middle of its soft tissue.
    centre: Point,
    /// The skin along its rim.
    rim: Vec<Point>,
    /// Greatest thickness at the first and last slice, as a share of that at the top.
    pub(crate) at_ends: f64,
    /// Height of the mound over the tissue around it, mm.
    pub(crate) rise_mm: f64,
    /// Thickness of the soft tissue about its place as a share of that about the other breast;
    /// `None` without another breast.
    pub(crate) share_of_other: Option<f64>,
    /// Thickness of its tissue as seen from the front, as a share of its greatest; one row along y.
    shares: Volume<f32>,
    axis: Axis,
}

impl Breast {
    /// The breast of that side; the mound next to the tumour's centre when that is known, since
    /// elsewhere the tissue may be thicker: in an arm beside the chest, in the armpit, on the
    /// belly.
    ///
    /// # Errors
    /// [`Error::NoBreast`] when the labels hold none there, [`Error::BreastMissing`] when they hold
    /// one on the other side only.
    pub fn find(labels: &LabelMap, side: Side, tumour: Option<Point>) -> Result<Self, Error> {
        let why = "there is no chest wall in the labels";
        let front = Front::new(labels).ok_or(Error::NoBreast { side, why })?;
        let breast = Self::in_front(&front, side, tumour);
        let Some(compared) = Compared::new(&front, side, breast.as_ref().ok(), tumour) else {
            return breast;
        };
        if compared.share() < MISSING_SHARE {
            let Compared { own_mm, other_mm, at } = compared;
            return Err(Error::BreastMissing { side, own_mm, other_mm, at: at.coords.into() });
        }
        Ok(Self { share_of_other: Some(compared.share()), ..breast? })
    }

    /// The mound of one side. A raised arm and the shoulder may make the largest one, which goes on
    /// at the end of the CT: then a breast is what stands no less high, farther from that end, and
    /// is whole.
    pub(crate) fn in_front(
        front: &Front,
        side: Side,
        tumour: Option<Point>,
    ) -> Result<Self, Error> {
        let mound = Self::mound(front, side, tumour, &|_| true)?;
        if tumour.is_some() || mound.at_ends <= GOES_ON {
            return Ok(mound);
        }
        let grid = front.smooth.grid();
        let (rows, far) = (grid.size()[2], (FARTHEST_MM / grid.spacing()[2]) as usize);
        let first = grid.voxel_at(&mound.centre).is_some_and(|v| 2 * v[2] < rows);
        let beyond = |n: usize| {
            let row = grid.voxel(n)[2];
            if first { row >= far } else { row + far < rows }
        };
        let other = Self::mound(front, side, None, &beyond);
        let whole = |other: &Self| other.at_ends < GOES_ON && other.rise_mm >= mound.rise_mm;
        Ok(other.ok().filter(whole).unwrap_or(mound))
    }

    /// The largest mound of one side among the places that `counts` knows, or that next to the
    /// tumour.
    fn mound(
        front: &Front,
        side: Side,
        tumour: Option<Point>,
        counts: &dyn Fn(usize) -> bool,
    ) -> Result<Self, Error> {
        let fail = |why: &'static str| Error::NoBreast { side, why };
        let grid = front.smooth.grid();
        let thick: Vec<f32> =
            front.smooth.data().iter().zip(&front.facing).map(|(mm, share)| mm * share).collect();
        let own: Vec<usize> = (0..grid.len())
            .filter(|&n| {
                let x = grid.centre(grid.voxel(n)).x;
                (x - front.axis.x) * side.sign() > 0.0 && front.facing[n] > 0.0
            })
            .collect();
        let mut known: Vec<f32> = own.iter().map(|&n| front.thickness.data()[n]).collect();
        known.retain(|&mm| mm > 0.0);
        let highest = own.iter().map(|&n| thick[n]).fold(0.0, f32::max);
        let rest = median(&mut known).unwrap_or(0.0).min(0.5 * highest);
        let mut mound = front.smooth.map(|_| 0.0);
        for &n in &own {
            mound.data_mut()[n] = (thick[n] - rest * front.facing[n]).max(0.0);
        }
        let middle =
            summit(&mound, tumour, counts).ok_or(fail("the CT shows nothing of that side"))?;
        let near = |n: usize| (grid.centre(grid.voxel(n)) - middle).norm() <= FARTHEST_MM;
        let rows = grid.size()[2];
        let from_end = |n: usize| grid.voxel(n)[2].min(rows - 1 - grid.voxel(n)[2]);
        let highest = |from: usize, to: usize| {
            let there = own.iter().filter(|&&n| near(n) && (from..to).contains(&from_end(n)));
            there.map(|&n| thick[n]).fold(0.0, f32::max)
        };
        let within = |mm: f64| (mm / grid.spacing()[2]) as usize;
        let top = highest(within(ENDS_MM), rows);
        let rise = top - quantile(&mut known, FLAT_SHARE).unwrap_or(0.0);
        if top < MIN_MM {
            return Err(fail(
                "the soft tissue in front of the chest wall is too thin for a breast",
            ));
        }
        if rise < MIN_RISE_MM {
            return Err(fail(FLAT));
        }
        let (centre, rim) = outline(front, &mound, middle, top - rest).ok_or(fail(FLAT))?;
        let at_ends = f64::from(highest(0, within(EDGE_MM)) / top);
        let mut shares = front.smooth.map(|_| 0.0);
        for &n in own.iter().filter(|&&n| near(n)) {
            shares.data_mut()[n] = front.smooth.data()[n] / top;
        }
        let (rise_mm, axis) = (f64::from(rise), front.axis);
        Ok(Self { side, centre, rim, at_ends, rise_mm, share_of_other: None, shares, axis })
    }

    /// Thickness of the breast before or behind a point, as a share of its greatest; 0 beside the
    /// breast, and where the point faces the armpit.
    pub(crate) fn share_at(&self, p: &Point) -> f64 {
        let grid = self.shares.grid();
        let at = Point::new(p.x, grid.origin().y, p.z);
        // The place beside it is as near, where the body ends between the two.
        let beside =
            [-1.0, 0.0, 1.0].map(|step| at + Vector::new(step * grid.spacing()[0], 0.0, 0.0));
        let share = |p: &Point| grid.voxel_at(p).map_or(0.0, |v| f64::from(self.shares.at(v)));
        let highest = beside.iter().map(share).fold(0.0, f64::max);
        if self.axis.facing(p) > 0.0 { highest } else { 0.0 }
    }

    /// Whether a nipple may lie there.
    pub(crate) fn may_bear(&self, skin: &Point) -> bool {
        self.share_at(skin) >= NIPPLE_SHARE
    }

    /// Middle of its soft tissue, LPS, mm.
    pub fn centre(&self) -> Point {
        self.centre
    }

    /// Distance from the middle that eight tenths of the rim do not exceed, mm.
    pub(crate) fn reach(&self) -> f64 {
        let mut away: Vec<f64> = self.rim.iter().map(|p| (p - self.centre).norm()).collect();
        quantile(&mut away, HELD).unwrap_or(0.0)
    }

    /// Sphere for the simulation: the breast and 15 mm, and the tumour and 15 mm, kept clear of the
    /// first and last slice and of tissue at the sides of the volume. On a CT too short or too
    /// narrow for that it reaches less far beyond the breast, and where even the breast is too long
    /// for it the sphere is moved along the body, or away from the side; what was done at a side is
    /// told.
    ///
    /// # Errors
    /// [`Error::NoRegion`] when no sphere within the volume can hold the tumour.
    pub fn region(
        &self,
        labels: &LabelMap,
        tumour: Option<Sphere>,
    ) -> Result<(Sphere, Option<Warning>), Error> {
        let fail = |why: String| Error::NoRegion { side: self.side, why };
        let mut needed = Ball { centre: self.centre, radius: self.reach() };
        if let Some(t) = tumour {
            needed = enclosing(needed, Ball { centre: t.centre(), radius: t.radius() });
        }
        let along = keep_clear(labels.grid(), needed);
        let Ball { centre, radius } = clear_of_sides(labels, needed.radius, along);
        let sphere = Sphere::new(centre, radius).map_err(|e| fail(e.to_string()))?;
        match tumour {
            Some(t) if sphere.signed_distance(&t.centre()) + t.radius() > 0.0 => {
                Err(fail(format!(
                    "the tumour at {:.1?} mm does not fit into a sphere of {radius:.0} mm that \
                     stays within the slices; give the region, or a CT that reaches farther",
                    t.centre().coords.as_slice()
                )))
            }
            _ => Ok((sphere, fitted(along, sphere))),
        }
    }
}

/// Where the map has the middle of the highest mound, or of that next to the tumour, among the
/// places that `counts` knows.
fn summit(
    mound: &Volume<f32>,
    tumour: Option<Point>,
    counts: &dyn Fn(usize) -> bool,
) -> Option<Point> {
    let grid = mound.grid();
    let spread = gaussian(mound, [MOUND_MM, 0.0, MOUND_MM]);
    let value = |n: usize| {
        let off = tumour.map_or(Vector::zeros(), |t| grid.centre(grid.voxel(n)) - t);
        let away = off.x.hypot(off.z) / TUMOUR_MM;
        f64::from(spread.data()[n]) * (-0.5 * away * away).exp()
    };
    let best =
        (0..grid.len()).filter(|&n| counts(n)).max_by(|&a, &b| value(a).total_cmp(&value(b)))?;
    Some(grid.centre(grid.voxel(best)))
}

/// Middle of the mound's tissue, and the skin along its rim; `height` is that of its peak, mm.
fn outline(
    front: &Front,
    mound: &Volume<f32>,
    from: Point,
    height: f32,
) -> Option<(Point, Vec<Point>)> {
    let grid = mound.grid();
    let (mut sum, mut area, mut rim) = (Vector::zeros(), 0.0, Vec::new());
    for ray in 0..RAYS {
        let (sin, cos) = (std::f64::consts::TAU * ray as f64 / RAYS as f64).sin_cos();
        let low = height * (RIM_SHARE + RIM_SHARE_UP * sin.max(0.0) as f32);
        let mut last: Option<Point> = None;
        for step in 0..(FARTHEST_MM / STEP_MM) as usize {
            let away = step as f64 * STEP_MM;
            let at = from + Vector::new(away * cos, 0.0, away * sin);
            let place = grid.voxel_at(&at).and_then(|v| front.places[grid.offset(v)]);
            let Some([skin, half]) = place.filter(|_| sample_trilinear_at(mound, &at) > low) else {
                break;
            };
            if last.is_some_and(|last| (skin.y - last.y).abs() > STEEP_MM) {
                break;
            }
            // A ray's share of the area grows with the distance.
            sum += (away + 0.5 * STEP_MM) * half.coords;
            area += away + 0.5 * STEP_MM;
            last = Some(skin);
        }
        rim.extend(last);
    }
    (!rim.is_empty()).then(|| (Point::from(sum / area), rim))
}

/// A sphere on the way to its final size, LPS, mm; it may have no radius yet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ball {
    centre: Point,
    radius: f64,
}

/// The smallest sphere round two.
fn enclosing(a: Ball, b: Ball) -> Ball {
    let way = b.centre - a.centre;
    let away = way.norm();
    if away + b.radius <= a.radius {
        return a;
    }
    if away + a.radius <= b.radius {
        return b;
    }
    let radius = 0.5 * (away + a.radius + b.radius);
    Ball { centre: a.centre + way * ((radius - a.radius) / away), radius }
}

/// The sphere of that radius and the margin: with less margin, then moved along the slices' normal,
/// then smaller, where the slices end.
fn keep_clear(grid: &Grid, Ball { centre, radius: needed }: Ball) -> Ball {
    let normal: Vector = grid.direction().column(2).into();
    let depth = normal.dot(&(centre - grid.origin()));
    let length = (grid.size()[2] - 1) as f64 * grid.spacing()[2];
    let needed = (needed + MIN_MARGIN_MM).min(0.5 * length - CLEAR_MM);
    let moved = depth.min(length - needed - CLEAR_MM).max(needed + CLEAR_MM);
    let radius = (needed - MIN_MARGIN_MM + MARGIN_MM).min(moved.min(length - moved) - CLEAR_MM);
    Ball { centre: centre + normal * (moved - depth), radius }
}

/// The sphere clear of the tissue at the sides of the volume; air may lie beyond them. With less
/// margin, then moved as little as will do, at last wholly into the volume.
fn clear_of_sides(labels: &LabelMap, needed: f64, ball: Ball) -> Ball {
    let fits = |centre: Point| largest_radius(labels, centre).unwrap_or(f64::INFINITY);
    if fits(ball.centre) >= ball.radius {
        return ball;
    }
    let within = beside(labels.grid(), needed, ball);
    let (way, least) = (within.centre - ball.centre, (needed + MIN_MARGIN_MM).min(ball.radius));
    let steps = (way.norm() / STEP_MM).ceil().max(1.0);
    let moved = |step: usize| ball.centre + way * (step as f64 / steps);
    (0..=steps as usize)
        .map(|step| Ball { centre: moved(step), radius: fits(moved(step)).min(ball.radius) })
        .find(|moved| moved.radius >= least)
        .unwrap_or(within)
}

/// The sphere within the sides of the volume, where it leaves them: with less margin, then moved,
/// then smaller.
fn beside(grid: &Grid, needed: f64, ball: Ball) -> Ball {
    [0, 1].into_iter().fold(ball, |Ball { centre, radius }, axis| {
        let along: Vector = grid.direction().column(axis).into();
        let depth = along.dot(&(centre - grid.origin()));
        let length = (grid.size()[axis] - 1) as f64 * grid.spacing()[axis];
        let within = |reach: f64| depth - reach >= CLEAR_MM && depth + reach <= length - CLEAR_MM;
        if within(radius) {
            return Ball { centre, radius };
        }
        let least = (needed + MIN_MARGIN_MM).min(radius).min(0.5 * length - CLEAR_MM);
        let moved = depth.min(length - least - CLEAR_MM).max(least + CLEAR_MM);
        let radius = radius.min(moved.min(length - moved) - CLEAR_MM);
        Ball { centre: centre + along * (moved - depth), radius }
    })
}

/// Says that a sphere had to be fitted into the sides of the volume.
fn fitted(wanted: Ball, sphere: Sphere) -> Option<Warning> {
    let moved = (sphere.centre() - wanted.centre).norm();
    let smaller = wanted.radius - sphere.radius();
    (moved >= 0.5 || smaller >= 0.5).then(|| {
        let done = [(moved, "moved by"), (smaller, "made smaller by")]
            .into_iter()
            .filter(|(mm, _)| *mm >= 0.5)
            .map(|(mm, what)| format!("{what} {mm:.0} mm"));
        let text = format!(
            "the CT ends beside the breast: to stay within it the region was {}; tissue beside the region is held by springs, \
             as at every cut",
            done.collect::<Vec<_>>().join(" and ")
        );
        Warning::new("region-at-the-side", text)
            .value("moved_mm", moved)
            .value("smaller_mm", smaller)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Matrix;
    use supine_volume::label;

    const BREAST: Point = Point::new(70.0, -80.0, 120.0);

    /// A round chest from z = 0 to `length`, mm: a breast, and farther up a larger mound.
    fn chest(length: usize) -> LabelMap {
        let grid = Grid::new(
            [100, 90, length / 4 + 1],
            Vector::new(3.0, 3.0, 4.0),
            Point::new(-150.0, -160.0, 0.0),
            Matrix::identity(),
        )
        .unwrap();
        let other = Point::new(90.0, -75.0, 320.0);
        Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let radius = p.x.hypot(p.y);
            if radius < 100.0 {
                label::CHEST_WALL
            } else if radius < 108.0 || (p - BREAST).norm() < 60.0 || (p - other).norm() < 70.0 {
                label::SOFT_TISSUE
            } else {
                label::OUTSIDE
            }
        })
    }

    #[test]
    fn the_mound_next_to_the_tumour_is_the_breast() {
        let labels = chest(440);
        let of = |tumour| Breast::find(&labels, Side::Left, tumour).unwrap().centre;
        assert!((of(None).z - 320.0).abs() < 4.0, "{}", of(None));
        for off in [Vector::zeros(), Vector::new(30.0, 10.0, 40.0), Vector::new(-30.0, 0.0, -30.0)]
        {
            let centre = of(Some(BREAST + off));
            assert!((centre.z - BREAST.z).abs() < 4.0, "{centre}");
            assert!((centre.x - BREAST.x).abs() < 8.0, "{centre}");
        }
    }

    #[test]
    fn a_raised_arm_of_the_other_side_is_not_what_the_breast_is_compared_with() {
        // The larger mound of `chest`, at the height of an arm, on the right alone; two equal
        // breasts.
        let grid = chest(440).grid().clone();
        let mirrored = |p: &Point| Point::new(-p.x, p.y, p.z);
        let arm = Point::new(-90.0, -75.0, 320.0);
        let labels = LabelMap::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let near = |p: &Point| (p - BREAST).norm() < 60.0;
            match p.x.hypot(p.y) {
                r if r < 100.0 => label::CHEST_WALL,
                r if r < 108.0 => label::SOFT_TISSUE,
                _ if near(&p) || near(&mirrored(&p)) => label::SOFT_TISSUE,
                _ if (p - arm).norm() < 75.0 => label::SOFT_TISSUE,
                _ => label::OUTSIDE,
            }
        });
        for tumour in [None, Some(BREAST), Some(BREAST + Vector::new(-30.0, 10.0, 25.0))] {
            let share = Breast::find(&labels, Side::Left, tumour).unwrap().share_of_other;
            assert!((0.9..1.1).contains(&share.unwrap()), "{share:?} {tumour:?}");
        }
    }

    #[test]
    fn on_a_short_ct_the_margin_shrinks_before_the_sphere_moves() {
        let tumour = Sphere::new(BREAST, 5.0).unwrap();
        let of = |length| {
            let labels = chest(length);
            let breast = Breast::find(&labels, Side::Left, Some(BREAST)).unwrap();
            (breast.reach(), breast.at_ends, breast.region(&labels, Some(tumour)).unwrap().0)
        };
        let (reach, at_ends, whole) = of(440);
        assert!((whole.radius() - reach - MARGIN_MM).abs() < 1e-9 && at_ends < 0.2);
        let (_, _, less) = of(208);
        assert!((less.centre() - whole.centre()).norm() < 2.0, "{less:?}");
        assert!((less.radius() - (208.0 - less.centre().z - CLEAR_MM)).abs() < 1e-6, "{less:?}");
        let (reach, at_ends, moved) = of(188);
        assert!(moved.centre().z < less.centre().z - 3.0, "{moved:?}");
        assert!((moved.radius() - reach - MIN_MARGIN_MM).abs() < 1e-6, "{moved:?}");
        assert!(at_ends < 0.7);
        // It ends where the breast is thickest.
        assert!(Breast::find(&chest(120), Side::Left, Some(BREAST)).unwrap().at_ends > 0.9);
    }

    #[test]
    fn the_fat_of_the_armpit_is_no_breast_and_none_of_the_breast_beside_it() {
        let labels = chest(240);
        let breast = Breast::find(&labels, Side::Left, None).unwrap();
        // An arm that joins the chest at the side, thicker than the breast and up to the last
        // slice.
        let axilla = |p: &Point| (p - Point::new(120.0, 40.0, 240.0)).norm() < 75.0;
        let with_arm = |labels: &LabelMap| {
            let grid = labels.grid().clone();
            LabelMap::from_fn(grid.clone(), |v| {
                let outside = labels.at(v) == label::OUTSIDE && axilla(&grid.centre(v));
                if outside { label::SOFT_TISSUE } else { labels.at(v) }
            })
        };
        let beside = Breast::find(&with_arm(&labels), Side::Left, None).unwrap();
        let off = beside.centre - breast.centre;
        assert!(off.norm() < 10.0, "{} {}", beside.centre, breast.centre);
        let grid = labels.grid().clone();
        let flat = LabelMap::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let skin = p.x.hypot(p.y) < 116.0;
            if skin { labels.at(v).max(label::SOFT_TISSUE) } else { label::OUTSIDE }
        });
        let error = Breast::find(&with_arm(&flat), Side::Left, None).unwrap_err();
        assert!(error.to_string().contains("armpit"), "{error}");
    }

    #[test]
    fn the_middle_is_not_drawn_up_by_fat_that_runs_out_towards_the_armpit() {
        let labels = chest(240);
        let grid = labels.grid().clone();
        let runs_out = |p: &Point| {
            let up = p.z - BREAST.z;
            (p.x - BREAST.x).hypot(p.y - BREAST.y) < 40.0 - 0.2 * up && up > 0.0
        };
        let fat = LabelMap::from_fn(grid.clone(), |v| {
            let outside = labels.at(v) == label::OUTSIDE && runs_out(&grid.centre(v));
            if outside { label::SOFT_TISSUE } else { labels.at(v) }
        });
        let of = |labels| Breast::find(labels, Side::Left, None).unwrap().centre.z;
        let (alone, fat) = (of(&labels), of(&fat));
        assert!((alone - BREAST.z).abs() < 5.0 && fat - alone < 2.5, "{alone} {fat}");
    }

    #[test]
    fn a_sphere_is_moved_no_farther_than_the_tissue_at_the_side_asks_for() {
        // Tissue lies at the left side of the volume in the upper slices only.
        let size = [100, 90, 61];
        let grid = Grid::new(
            size,
            Vector::new(3.0, 3.0, 4.0),
            Point::new(-150.0, -160.0, 0.0),
            Matrix::identity(),
        );
        let labels = LabelMap::from_fn(grid.unwrap(), |v| {
            let side = v[0] + 1 == size[0] && v[2] > 45;
            if side { label::SOFT_TISSUE } else { label::OUTSIDE }
        });
        let ball = Ball { centre: Point::new(90.0, -30.0, 110.0), radius: 70.0 };
        assert_eq!(clear_of_sides(&labels, 50.0, ball), ball);
        let near = Ball { centre: Point::new(90.0, -30.0, 150.0), radius: 70.0 };
        let less = clear_of_sides(&labels, 30.0, near);
        assert!(less.centre == near.centre && (60.0..70.0).contains(&less.radius), "{less:?}");
        let moved = clear_of_sides(&labels, 55.0, near);
        assert!(moved.centre.x < near.centre.x && moved.centre.x > 70.0, "{moved:?}");
        assert!(moved.radius >= 69.9, "{moved:?}");
    }

    #[test]
    fn the_smallest_sphere_round_two() {
        let ball = |x: f64, y: f64, radius| Ball { centre: Point::new(x, y, 0.0), radius };
        let a = ball(0.0, 0.0, 10.0);
        assert_eq!(enclosing(a, ball(1.0, 0.0, 2.0)), a);
        assert_eq!(enclosing(ball(0.0, 0.0, 1.0), ball(0.0, 0.0, 2.0)).radius, 2.0);
        let Ball { centre, radius } = enclosing(a, ball(0.0, 20.0, 4.0));
        assert!((centre - Point::new(0.0, 7.0, 0.0)).norm() < 1e-12 && radius == 17.0);
    }

    #[test]
    fn a_sphere_that_leaves_the_side_of_the_volume_is_moved_into_it() {
        let grid = Grid::new(
            [200, 150, 100],
            Vector::new(1.0, 1.0, 3.0),
            Point::new(-100.0, -100.0, 0.0),
            Matrix::identity(),
        )
        .unwrap();
        let inside = Ball { centre: Point::new(0.0, -30.0, 150.0), radius: 60.0 };
        assert_eq!(beside(&grid, 40.0, inside), inside);
        let left = Ball { centre: Point::new(60.0, -30.0, 150.0), radius: 70.0 };
        let Ball { centre, radius } = beside(&grid, 40.0, left);
        assert!(
            (radius - 55.0).abs() < 1e-9 && (centre.x - 43.0).abs() < 1e-9,
            "{centre} {radius}"
        );
        let told = fitted(left, Sphere::new(centre, radius).unwrap()).unwrap().to_string();
        assert!(told.contains("moved by 17 mm and made smaller by 15 mm"), "{told}");
        assert!(fitted(inside, Sphere::new(inside.centre, 60.0).unwrap()).is_none());
    }
}
