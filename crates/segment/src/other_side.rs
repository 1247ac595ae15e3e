//! The soft tissue of one side beside that of the other: whether a breast was taken off.

use crate::Breast;
use crate::front::Front;
use supine_space::{Point, Side};

/// The sides are compared within this of the breast's middle and of the place on the other side
/// that mirrors it, mm.
const COMPARED_MM: f64 = 30.0;

/// The soft tissue of one side against that about the breast of the other, mm.
pub(crate) struct Compared {
    pub(crate) own_mm: f64,
    pub(crate) other_mm: f64,
    /// Where the side's own breast should be.
    pub(crate) at: Point,
}

impl Compared {
    /// The other breast is looked for about the place that mirrors the tumour, or this breast:
    /// elsewhere a raised arm may stand higher. A breast found without a tumour may be an arm
    /// itself; then the highest mound of the other side counts too, and of the two the one that
    /// speaks for a breast. `None` without a mound on the other side.
    pub(crate) fn new(
        front: &Front,
        side: Side,
        breast: Option<&Breast>,
        tumour: Option<Point>,
    ) -> Option<Self> {
        let opposite = if side == Side::Left { Side::Right } else { Side::Left };
        let of = |about: Option<Point>| {
            let other = Breast::in_front(front, opposite, about.map(|p| front.axis.mirrored(p)));
            let other = other.ok()?.centre();
            let at = front.axis.mirrored(other);
            let [own_mm, other_mm] = [thickness_at(front, &at)?, thickness_at(front, &other)?];
            Some(Self { own_mm, other_mm, at })
        };
        let about = breast.map(Breast::centre).or(tumour);
        let highest = if tumour.is_none() { of(None) } else { None };
        let mirrored = about.and_then(|at| of(Some(at)));
        highest.into_iter().chain(mirrored).max_by(|a, b| a.share().total_cmp(&b.share()))
    }

    pub(crate) fn share(&self) -> f64 {
        self.own_mm / self.other_mm
    }
}

/// Mean thickness of the soft tissue that faces the front about a place, mm; `None` when nothing
/// does.
fn thickness_at(front: &Front, at: &Point) -> Option<f64> {
    let grid = front.smooth.grid();
    let (mut sum, mut weight) = (0.0, 0.0);
    for n in 0..grid.len() {
        let off = grid.centre(grid.voxel(n)) - at;
        if off.x.hypot(off.z) <= COMPARED_MM {
            sum += f64::from(front.facing[n] * front.smooth.data()[n]);
            weight += f64::from(front.facing[n]);
        }
    }
    (weight > 0.0).then(|| sum / weight)
}
