//! Which side the patient lies on: where the table is, and where her lungs are denser.
//!
//! Gravity gathers blood and closes air spaces in the part of the lung that lies lowest. Measured
//! on eight patients on their backs (four real): 26 to 89 HU per 100 mm denser towards the back, 16
//! at most to a side; and 237 to 788 cm³ of table behind them, none in front. Each lung counts
//! beside its own mean: an effusion or a collapse makes one denser than the other (33 to a side on
//! a real CT, 0.5 so).

use crate::Error;
use crate::body::{Body, flag};
use crate::frame::Frame;
use rayon::prelude::*;
use supine_record::QualityCheck;
use supine_space::{Posture, Warning};
use supine_volume::{Ct, Parts};

// The limits lie between the figures measured above; where none is named they were chosen, not
// measured.
/// Material outside the patient above this is table, cushion or clothes, HU.
const TABLE_HU: i16 = -500;
/// It starts this far off the patient, mm.
const OFF_MM: f32 = 6.0;
/// A table cups the patient: what lies this far in front of her back's lowest place still counts
/// as behind her, mm.
const CUP_MM: f32 = 30.0;
/// Least volume of a table, cm³ (measured: 237 and more), and how many times more must lie on its
/// side than behind her.
const TABLE_CM3: f64 = 100.0;
const TIMES: f64 = 4.0;
/// Lung: values below, so that vessels and partial volume do not count, HU.
const LUNG_HU: i16 = -600;
/// Lung within the patient: a cushion beside her may hold as much air.
const INNER: u8 = flag::LUNG | flag::BODY;
/// Lungs this much denser to one side tell that she lies on it, HU per 100 mm (measured on the
/// back: 16 at most to a side, 26 and more towards the back).
const DENSER: f64 = 20.0;
/// Lungs this much denser towards the back contradict a table in front, HU per 100 mm.
const CONTRARY: f64 = 10.0;

/// What speaks for a posture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PostureSigns {
    /// How she is taken to lie.
    taken: Posture,
    /// Material beside the patient: in front, behind, at her left, at her right, cm³.
    table_cm3: [f64; 4],
    /// How much denser the lungs become towards the back and towards the left, HU per 100 mm.
    pub(crate) denser: [f64; 2],
}

impl PostureSigns {
    /// # Errors
    /// [`Error::LiesOtherwise`] when table and lungs say that she lies on another side than is
    /// taken.
    pub(crate) fn check(
        ct: &Ct,
        frame: &Frame,
        body: &Body,
        taken: Posture,
    ) -> Result<Self, Error> {
        let (table_cm3, denser) = (table(ct, frame, body), denser(ct, frame, body));
        let signs = Self { taken, table_cm3, denser };
        let Some(side) = Side::of(taken) else { return Ok(signs) };
        match Side::ALL.into_iter().find(|on| *on != side && signs.lies_on(*on, side)) {
            Some(on) => Err(Error::LiesOtherwise { on: on.name(), taken: side.name() }),
            None => Ok(signs),
        }
    }

    /// Whether table and lungs say that she lies on a side and not on the one that is taken.
    fn lies_on(&self, on: Side, taken: Side) -> bool {
        let (table, denser) = (self.table(on), self.denser_towards(taken));
        let below = table > TABLE_CM3 && table > TIMES * self.table(taken);
        below
            && if on == taken.opposite() {
                denser < CONTRARY
            } else {
                self.denser_towards(on) > DENSER.max(denser)
            }
    }

    /// cm³.
    fn table(&self, side: Side) -> f64 {
        self.table_cm3[side as usize]
    }

    /// HU per 100 mm.
    fn denser_towards(&self, side: Side) -> f64 {
        let [to_back, to_left] = self.denser;
        match side {
            Side::Front => -to_back,
            Side::Back => to_back,
            Side::Left => to_left,
            Side::Right => -to_left,
        }
    }

    /// What was measured; nothing of a patient who is upright. Table and lungs refuse together
    /// only.
    pub(crate) fn checks(&self) -> Vec<QualityCheck> {
        let Some(side) = Side::of(self.taken) else { return Vec::new() };
        let [table_opposite, table_across, lungs, lungs_across] = side.checks();
        let [one, other] = side.across();
        let limit = TABLE_CM3.max(TIMES * self.table(side));
        let (towards, across) = (self.denser_towards(side), self.denser_towards(one).abs());
        vec![
            QualityCheck::at_most(table_opposite, self.table(side.opposite()), "cm³")
                .refuses_jointly(limit),
            QualityCheck::at_most(table_across, self.table(one).max(self.table(other)), "cm³")
                .refuses_jointly(limit),
            QualityCheck::at_least(lungs, towards, "HU per 100 mm")
                .warns(-DENSER)
                .refuses_jointly(CONTRARY),
            QualityCheck::at_most(lungs_across, across, "HU per 100 mm")
                .warns(2.0 * DENSER.max(towards))
                .refuses_jointly(DENSER.max(towards)),
        ]
    }

    /// The lungs alone do not refuse: disease makes them denser too.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let side = Side::of(self.taken)?;
        let [one, other] = side.across();
        let (towards, across) = (self.denser_towards(side), self.denser_towards(one));
        let (on, by) = if towards < -DENSER && -towards > across.abs() {
            (side.opposite(), -towards)
        } else if across.abs() > 2.0 * DENSER && across.abs() > 2.0 * towards {
            (if across > 0.0 { one } else { other }, across.abs())
        } else {
            return None;
        };
        let text = format!(
            "the lungs are denser {} ({by:.0} HU per 100 mm), as in a patient who lies on that side: \
             check that she {} and that the image is not flipped",
            on.place(),
            self.taken.told()
        );
        Some(Warning::new("lung-density", text))
    }
}

/// A side of the patient, in the order of the volumes of [`PostureSigns`].
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Front,
    Back,
    Left,
    Right,
}

impl Side {
    const ALL: [Self; 4] = [Self::Front, Self::Back, Self::Left, Self::Right];

    /// The side on which one lies; none of one who is upright.
    fn of(posture: Posture) -> Option<Self> {
        match posture {
            Posture::Supine => Some(Self::Back),
            Posture::Prone => Some(Self::Front),
            Posture::LeftSide => Some(Self::Left),
            Posture::RightSide => Some(Self::Right),
            Posture::Upright => None,
        }
    }

    fn opposite(self) -> Self {
        match self {
            Self::Front => Self::Back,
            Self::Back => Self::Front,
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// The two sides across.
    fn across(self) -> [Self; 2] {
        match self {
            Self::Front | Self::Back => [Self::Left, Self::Right],
            Self::Left | Self::Right => [Self::Back, Self::Front],
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left side",
            Self::Right => "right side",
        }
    }

    fn place(self) -> &'static str {
        match self {
            Self::Front => "in front",
            Self::Back => "at the back",
            Self::Left => "at the left",
            Self::Right => "at the right",
        }
    }

    /// What is measured of a patient who lies on it: table opposite and across, lungs towards it
    /// and across.
    fn checks(self) -> [&'static str; 4] {
        const BESIDE: &str = "table or cloth at one side of the patient";
        const ASIDE: &str = "lungs denser towards one side";
        const ALONG: &str = "table or cloth in front of or behind the patient";
        const FORTH: &str = "lungs denser towards front or back";
        match self {
            Self::Back => {
                let table = "table or cloth in front of the patient";
                [table, BESIDE, "lungs denser towards the back", ASIDE]
            }
            Self::Front => {
                let table = "table or cloth behind the patient";
                [table, BESIDE, "lungs denser towards the front", ASIDE]
            }
            Self::Left => {
                let table = "table or cloth at the right of the patient";
                [table, ALONG, "lungs denser towards the left", FORTH]
            }
            Self::Right => {
                let table = "table or cloth at the left of the patient";
                [table, ALONG, "lungs denser towards the right", FORTH]
            }
        }
    }
}

/// Volume of the material beside the patient: in front, behind, at her left, at her right, cm³.
fn table(ct: &Ct, frame: &Frame, body: &Body) -> [f64; 4] {
    let plane = frame.plane();
    let voxels: Vec<[usize; 4]> = (0..frame.size[2])
        .into_par_iter()
        .map(|k| {
            let (hu, flags) = (&ct.data()[k * plane..(k + 1) * plane], body.flags_slice(frame, k));
            let place = |n: usize| {
                let [x, y] = frame.position(n);
                [frame.back, frame.left].map(|d| x * d[0] + y * d[1])
            };
            let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
            for n in (0..plane).filter(|&n| flags[n] & flag::BODY != 0) {
                let p = place(n);
                low = [0, 1].map(|a| low[a].min(p[a]));
                high = [0, 1].map(|a| high[a].max(p[a]));
            }
            let mut out = [0; 4];
            if low[0] > high[0] {
                return out;
            }
            let table = |n: &usize| flags[*n] & flag::BODY == 0 && hu[*n] > TABLE_HU;
            for n in (0..plane).filter(table).filter(|&n| body.field[n]) {
                let [back, left] = place(n);
                // What lies at a corner is on no side.
                if (low[1]..=high[1]).contains(&left) {
                    out[0] += usize::from(back < low[0] - OFF_MM);
                    out[1] += usize::from(back > high[0] - CUP_MM);
                } else if (low[0]..=high[0] - CUP_MM).contains(&back) {
                    out[2] += usize::from(left > high[1] + OFF_MM);
                    out[3] += usize::from(left < low[1] - OFF_MM);
                }
            }
            out
        })
        .collect();
    [0, 1, 2, 3].map(|a| voxels.iter().map(|v| v[a]).sum::<usize>() as f64 * frame.voxel_cm3())
}

/// Slope of the lungs' HU towards the back and the left within each piece of lung of each slice,
/// per 100 mm, by least squares.
fn denser(ct: &Ct, frame: &Frame, body: &Body) -> [f64; 2] {
    let sums: Vec<[f64; 5]> =
        (0..frame.size[2]).into_par_iter().map(|k| moments(ct, frame, body, k)).collect();
    let [bb, ll, bl, bh, lh] = [0, 1, 2, 3, 4].map(|a| sums.iter().map(|s| s[a]).sum::<f64>());
    let det = bb * ll - bl * bl;
    if det <= 0.0 {
        return [0.0; 2];
    }
    [100.0 * (bh * ll - lh * bl) / det, 100.0 * (lh * bb - bh * bl) / det]
}

/// Sums of squares and products of place (back, left) and HU over the lungs of a slice: bb, ll, bl,
/// bh, lh.
fn moments(ct: &Ct, frame: &Frame, body: &Body, k: usize) -> [f64; 5] {
    let [ni, nj, _] = frame.size;
    let (start, flags) = (k * frame.plane(), body.flags_slice(frame, k));
    let hu = &ct.data()[start..start + frame.plane()];
    let pieces = Parts::new([ni, nj, 1], |n| flags[n] & INNER == INNER && hu[n] < LUNG_HU);
    let value = |n: usize| {
        let [x, y] = frame.position(n);
        let at = |d: [f32; 2]| f64::from(x * d[0] + y * d[1]);
        [at(frame.back), at(frame.left), f64::from(hu[n].max(-1024))]
    };
    let mut means = vec![[0.0; 3]; pieces.voxels.len()];
    for (run, part) in pieces.iter() {
        for v in run.voxels().map(value) {
            means[part] = [0, 1, 2].map(|a| means[part][a] + v[a] / pieces.voxels[part] as f64);
        }
    }
    let mut sums = [0.0; 5];
    for (run, part) in pieces.iter() {
        for v in run.voxels().map(value) {
            let [b, l, h] = [0, 1, 2].map(|a| v[a] - means[part][a]);
            let add = [b * b, l * l, b * l, b * h, l * h];
            sums = [0, 1, 2, 3, 4].map(|a| sums[a] + add[a]);
        }
    }
    sums
}
