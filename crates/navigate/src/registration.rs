//! The tracker's frame brought onto the patient's by points that are known in both.
//!
//! What counts is not how well the points fit ([`Registration::fre_mm`]) but how far off the tumour
//! may be ([`Registration::expected_tre_mm`]): the two are not correlated (Fitzpatrick, Proc. SPIE
//! 7261, 2009, doi 10.1117/12.813601).

use crate::trajectory::{TableError, table};
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use std::{collections::BTreeSet, fmt};
use supine_space::{Matrix, Point, Pose, Vector};

/// Points nearer than this to their line, mm (rms), fix no turn about it: a point is found to about
/// 1 mm.
const OFF_LINE_MM: f64 = 2.0;
/// Nor do those nearer than this share of their spread along it.
const OFF_LINE_SHARE: f64 = 0.02;
/// No point of a tracker or a CT is farther from the origin, mm.
const FARTHEST_MM: f64 = 1e6;
/// The turn is open when it changes the fit by less than this share.
const OPEN: f64 = 1e-6;
/// A mirror image is taken for one when the points fit it better than themselves by this factor,
/// and themselves no better than this, mm (rms).
const MIRRORED: (f64, f64) = (2.0, 5.0);
/// What to say of three points.
const THREE: &str = "with three fiducials neither a wrong one nor a mirrored set shows: use four or more, not in one plane";

/// Why fiducials give no registration. Fiducials are counted from 1.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum RegistrationError {
    /// Fewer than three.
    #[error(
        "{0} fiducials fix no pose: three are the least, four or more not in one plane are wanted"
    )]
    TooFew(usize),
    /// A coordinate is not finite or farther than 1 km from the origin.
    #[error(
        "the {frame} position of fiducial {number} is {position:?}: give finite coordinates in mm within 1 km"
    )]
    Position {
        /// Which fiducial.
        number: usize,
        /// In which frame.
        frame: Frame,
        /// The position, mm.
        position: [f64; 3],
    },
    /// The target is not finite or farther than 1 km from the origin.
    #[error(
        "the target lies at {0:?}: give finite coordinates in mm within 1 km, in the patient's frame"
    )]
    Target([f64; 3]),
    /// All lie on a line, or at one place.
    #[error(
        "the {frame} positions of the fiducials lie on a line (rms {off_mm:.2} mm off it, {along_mm:.1} mm along it), so that the turn about it is open; fiducial {number} is the farthest off it: add one at least 20 mm to its side"
    )]
    Collinear {
        /// In which frame.
        frame: Frame,
        /// Rms distance from the line, mm.
        off_mm: f64,
        /// Rms distance from the middle along the line, mm.
        along_mm: f64,
        /// Which fiducial is the farthest off the line.
        number: usize,
    },
    /// They fit a mirror image.
    #[error(
        "the fiducials fit a mirror image (rms {mirrored_mm:.2} mm) and not themselves (rms {fre_mm:.2} mm): one of the frames has an axis with the wrong sign"
    )]
    Mirrored {
        /// Rms distance when one set is mirrored, mm.
        mirrored_mm: f64,
        /// Rms distance as they are, mm.
        fre_mm: f64,
    },
    /// The two sets have so little in common that any turn is as good.
    #[error(
        "the tracker's and the patient's positions have no shape in common (rms {fre_mm:.1} mm): check which fiducial is which"
    )]
    Unlike {
        /// Rms distance at best, mm.
        fre_mm: f64,
    },
    /// The table of fiducials cannot be read.
    #[error("table of fiducials: {0}")]
    Table(#[from] TableError),
    /// A name stands for two fiducials, or for none.
    #[error(
        "table of fiducials, line {line}: the name `{name}` is empty or was there before; give each fiducial its own"
    )]
    Name {
        /// Counted from 1, the header included.
        line: u64,
        /// The name, as far as it can be shown.
        name: String,
    },
}

/// The frame of a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame {
    /// The tracker's.
    Tracker,
    /// The patient's, LPS.
    Patient,
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tracker => "tracker's",
            Self::Patient => "patient's",
        })
    }
}

/// A point that is known in both frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Fiducial {
    /// What it is called.
    pub name: String,
    /// Where the tracker found it, in the tracker's frame, mm.
    pub tracker: Point,
    /// Where it lies in the patient, LPS, mm.
    pub patient: Point,
}

impl Fiducial {
    /// Its positions as [`Registration::new`] takes them: in the tracker's frame and in the
    /// patient's.
    pub fn pair(&self) -> (Point, Point) {
        (self.tracker, self.patient)
    }
}

/// From the tracker's frame to the patient's.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    patient_from_tracker: Pose,
    residuals_mm: Vec<f64>,
    fre_mm: f64,
    fle_mm: f64,
    expected_tre_mm: f64,
    shape: Spread,
}

impl Registration {
    /// The pose that brings fiducials (tracker's frame, patient's frame) onto each other with the
    /// least sum of squares, and what error is to be expected at a `target` in the patient; mm.
    ///
    /// Source: Kabsch, Acta Cryst. A 32, 1976; with the sign that keeps it a turn, Umeyama, IEEE
    /// PAMI 13, 1991.
    ///
    /// # Errors
    /// When there are fewer than three, a coordinate is not finite or beyond 1 km, they lie on a
    /// line in one of the frames, one set is the mirror image of the other, or the sets have
    /// nothing in common.
    pub fn new(fiducials: &[(Point, Point)], target: &Point) -> Result<Self, RegistrationError> {
        if fiducials.len() < 3 {
            return Err(RegistrationError::TooFew(fiducials.len()));
        }
        if !near(target) {
            return Err(RegistrationError::Target(target.coords.into()));
        }
        let tracker: Vec<Point> = fiducials.iter().map(|(tracker, _)| *tracker).collect();
        let patient: Vec<Point> = fiducials.iter().map(|(_, patient)| *patient).collect();
        let from = Spread::new(&tracker, Frame::Tracker)?;
        let to = Spread::new(&patient, Frame::Patient)?;
        let patient_from_tracker = align(fiducials, &from, &to)?;
        let off =
            |(tracker, patient): &(Point, Point)| (patient_from_tracker * tracker - patient).norm();
        let residuals_mm: Vec<f64> = fiducials.iter().map(off).collect();
        let count = fiducials.len() as f64;
        let fre_mm = rms(&residuals_mm);
        let fle_mm = fre_mm / (1.0 - 2.0 / count).sqrt();
        let expected_tre_mm = fle_mm * to.tre_share(target);
        Ok(Self { patient_from_tracker, residuals_mm, fre_mm, fle_mm, expected_tre_mm, shape: to })
    }

    /// Takes the tracker's frame to the patient's (LPS), mm.
    pub fn patient_from_tracker(&self) -> &Pose {
        &self.patient_from_tracker
    }

    /// How far apart each fiducial is in the two frames, mm; in their order.
    pub fn residuals_mm(&self) -> &[f64] {
        &self.residuals_mm
    }

    /// Fiducial registration error: rms of the residuals, mm; says nothing of that at the tumour.
    pub fn fre_mm(&self) -> f64 {
        self.fre_mm
    }

    /// Fiducial localisation error: how far off a fiducial is found, rms in space, mm, from
    /// <FRE²> = (1 - 2/N) <FLE²>.
    pub fn fle_mm(&self) -> f64 {
        self.fle_mm
    }

    /// Target registration error to be expected at the target, rms, mm.
    pub fn expected_tre_mm(&self) -> f64 {
        self.expected_tre_mm
    }

    /// Target registration error to be expected at a place in the patient (LPS, mm), rms, mm:
    /// <TRE²> = <FLE²>/N (1 + 1/3 Σ d²/f²) over the principal axes of the fiducials, with d the
    /// distance of the place from the axis and f the rms distance of the fiducials.
    ///
    /// First order; holds for errors of the fiducials that are independent and alike in all
    /// directions. Those of points on skin that moves are neither.
    ///
    /// Source: Fitzpatrick, West, Maurer, IEEE Trans. Med. Imaging 17, 1998.
    pub fn tre_mm(&self, place: &Point) -> f64 {
        self.fle_mm * self.shape.tre_share(place)
    }

    /// What would make it better: with three fiducials, more of them.
    pub fn advice(&self) -> Option<&'static str> {
        (self.residuals_mm.len() == 3).then_some(THREE)
    }
}

/// How points are spread.
#[derive(Clone, Debug, PartialEq)]
struct Spread {
    count: f64,
    centre: Point,
    /// Principal axes as columns.
    axes: Matrix,
    /// Mean squares of the distances from these, mm².
    from_axes: [f64; 3],
}

impl Spread {
    /// # Errors
    /// When a position is not finite or too far away, or all lie on a line.
    fn new(points: &[Point], frame: Frame) -> Result<Self, RegistrationError> {
        if let Some(index) = points.iter().position(|point| !near(point)) {
            let position = points[index].coords.into();
            return Err(RegistrationError::Position { number: index + 1, frame, position });
        }
        let count = points.len() as f64;
        let centre = Point::from(points.iter().map(|point| point.coords).sum::<Vector>() / count);
        let scatter: Matrix = points.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let axes = scatter.symmetric_eigen().eigenvectors;
        let mean = |axis: usize| {
            points.iter().map(|point| beside(&axes, axis, &(point - centre))).sum::<f64>() / count
        };
        let spread = Self { count, centre, axes, from_axes: [mean(0), mean(1), mean(2)] };
        spread.off_line(points, frame).map_or(Ok(spread), Err)
    }

    /// The error if all points lie on a line: that axis from which they are the least far.
    fn off_line(&self, points: &[Point], frame: Frame) -> Option<RegistrationError> {
        let line = (0..3).min_by(|a, b| self.from_axes[*a].total_cmp(&self.from_axes[*b]))?;
        let off = |point: &Point| beside(&self.axes, line, &(point - self.centre));
        let off_mm = self.from_axes[line].sqrt();
        let along_mm = (self.mean_square() - self.from_axes[line]).max(0.0).sqrt();
        if off_mm >= OFF_LINE_MM && off_mm >= OFF_LINE_SHARE * along_mm {
            return None;
        }
        let farthest =
            (0..points.len()).max_by(|a, b| off(&points[*a]).total_cmp(&off(&points[*b])));
        let number = farthest? + 1;
        Some(RegistrationError::Collinear { frame, off_mm, along_mm, number })
    }

    /// Mean square of the distances from the centre, mm²: each counts for two of the three axes.
    fn mean_square(&self) -> f64 {
        self.from_axes.iter().sum::<f64>() / 2.0
    }

    /// Expected error at a place over that of a fiducial, both rms: see [`Registration::tre_mm`].
    fn tre_share(&self, place: &Point) -> f64 {
        let from_centre = place - self.centre;
        let ratio = |axis: usize| beside(&self.axes, axis, &from_centre) / self.from_axes[axis];
        ((1.0 + (ratio(0) + ratio(1) + ratio(2)) / 3.0) / self.count).sqrt()
    }
}

/// Square of the distance from an axis through the origin, mm².
fn beside(axes: &Matrix, axis: usize, place: &Vector) -> f64 {
    axes.column(axis).cross(place).norm_squared()
}

/// The pose of least squares.
fn align(
    fiducials: &[(Point, Point)],
    from: &Spread,
    to: &Spread,
) -> Result<Pose, RegistrationError> {
    let product = |(a, b): &(Point, Point)| (a - from.centre) * (b - to.centre).transpose();
    let products: Matrix = fiducials.iter().map(product).sum();
    let svd = products.svd(true, true);
    // Both factors were asked for.
    let (u, v_t) = svd.u.zip(svd.v_t).unwrap_or((Matrix::identity(), Matrix::identity()));
    let sign = (u * v_t).determinant().signum();
    let [first, second, third]: [f64; 3] = svd.singular_values.into();
    // Sum of the squares that is left, for a turn and for a turn with mirror.
    let apart = (from.mean_square() + to.mean_square()) * to.count;
    let left =
        |sign: f64| ((apart - 2.0 * (first + second + sign * third)) / to.count).max(0.0).sqrt();
    let (fre_mm, mirrored_mm) = (left(sign), left(-sign));
    if sign < 0.0 && mirrored_mm * MIRRORED.0 < fre_mm && fre_mm > MIRRORED.1 {
        return Err(RegistrationError::Mirrored { mirrored_mm, fre_mm });
    }
    if second + sign * third <= OPEN * first || first <= OPEN * apart {
        return Err(RegistrationError::Unlike { fre_mm });
    }
    let turn =
        v_t.transpose() * Matrix::from_diagonal(&Vector::new(1.0, 1.0, sign)) * u.transpose();
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    let shift = to.centre.coords - turn * from.centre.coords;
    Ok(Pose::from_parts(Translation3::from(shift), turn))
}

fn near(point: &Point) -> bool {
    point.iter().all(|coordinate| coordinate.abs() <= FARTHEST_MM)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Reads fiducials: a table of comma-separated values with the header
/// `name,tracker_x,tracker_y,tracker_z,patient_x,patient_y,patient_z`, mm, the patient's in LPS.
/// The columns may stand in any order; others are passed over.
///
/// # Errors
/// When the header lacks a column, a line has another number of fields, a field is no finite
/// number, or a name is empty or stands twice; the line is named.
pub fn read_fiducials(text: &str) -> Result<Vec<Fiducial>, RegistrationError> {
    let columns = ["tracker_x", "tracker_y", "tracker_z", "patient_x", "patient_y", "patient_z"];
    let (mut fiducials, mut names) = (Vec::new(), BTreeSet::new());
    for line in table::read(text, Some("name"), columns)? {
        if line.label.is_empty() || !names.insert(line.label.clone()) {
            let name = line.label.chars().take(40).collect();
            return Err(RegistrationError::Name { line: line.number, name });
        }
        let [x, y, z, u, v, w] = line.values;
        fiducials.push(Fiducial {
            name: line.label,
            tracker: Point::new(x, y, z),
            patient: Point::new(u, v, w),
        });
    }
    Ok(fiducials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::SplitMix;

    /// Six places round a breast, LPS, mm, and what each is found off by in the tracker's frame,
    /// mm. The results are those of another program.
    const FIXED: [[f64; 6]; 6] = [
        [0.0, -60.0, 0.0, 0.3, -0.2, 0.1],
        [70.0, -20.0, 10.0, -0.4, 0.1, 0.2],
        [-50.0, -25.0, 5.0, 0.2, 0.3, -0.3],
        [10.0, -30.0, 65.0, 0.1, -0.4, 0.2],
        [15.0, -35.0, -70.0, -0.3, 0.2, -0.1],
        [95.0, 10.0, -15.0, 0.1, 0.0, -0.1],
    ];

    fn target() -> Point {
        Point::new(20.0, -10.0, 8.0)
    }

    fn tracker_from_patient() -> Pose {
        let turn = Vector::new(10.0, -20.0, 35.0) * 1.0_f64.to_radians();
        Pose::new(Vector::new(120.0, -45.0, -1500.0), turn)
    }

    fn places() -> Vec<Point> {
        FIXED.map(|[x, y, z, ..]| Point::new(x, y, z)).to_vec()
    }

    /// Places found with errors.
    fn found(places: &[Point], off: impl FnMut(usize) -> Vector) -> Vec<(Point, Point)> {
        let offs: Vec<Vector> = (0..places.len()).map(off).collect();
        let pair = |(place, off): (&Point, Vector)| (tracker_from_patient() * place + off, *place);
        places.iter().zip(offs).map(pair).collect()
    }

    fn fixed() -> Vec<(Point, Point)> {
        found(&places(), |k| Vector::from_column_slice(&FIXED[k][3..]))
    }

    fn same(ours: f64, theirs: f64) -> bool {
        (ours - theirs).abs() < 1e-6
    }

    #[test]
    fn the_errors_of_fixed_data_are_those_of_another_program() {
        let registration = Registration::new(&fixed(), &target()).unwrap();
        assert!(same(registration.fre_mm(), 0.367_802), "{}", registration.fre_mm());
        assert!(same(registration.fle_mm(), 0.450_463), "{}", registration.fle_mm());
        assert!(same(registration.expected_tre_mm(), 0.193_780));
        assert!(same(registration.tre_mm(&target()), 0.193_780));
        let centre = Point::from(places().iter().map(|p| p.coords).sum::<Vector>() / 6.0);
        assert!(same(registration.tre_mm(&centre), 0.183_901));
        assert!(same(registration.tre_mm(&(centre + Vector::x() * 100.0)), 0.327_606));
        let place = registration.patient_from_tracker() * (tracker_from_patient() * target());
        assert!(same((place - target()).norm(), 0.055_100), "{}", (place - target()).norm());
        assert!(same(rms(registration.residuals_mm()), registration.fre_mm()));
        assert_eq!(registration.advice(), None);
    }

    #[test]
    fn errors_of_many_trials_are_those_of_the_formulas() {
        const TRIALS: usize = 2_000;
        let mut draws = SplitMix::new(11);
        // 1 mm rms in space.
        let sd = 1.0 / 3.0_f64.sqrt();
        let (mut fre, mut tre) = (Vec::new(), Vec::new());
        let mut share = 0.0;
        for _ in 0..TRIALS {
            let pairs = found(&places(), |_| Vector::from(draws.normals()) * sd);
            let registration = Registration::new(&pairs, &target()).unwrap();
            let place = registration.patient_from_tracker() * (tracker_from_patient() * target());
            fre.push(registration.fre_mm().powi(2));
            tre.push((place - target()).norm_squared());
            share = registration.shape.tre_share(&target());
        }
        assert!((share - 0.4302).abs() < 5e-5, "{share}");
        let mean = |x: &[f64]| x.iter().sum::<f64>() / TRIALS as f64;
        let error = |x: &[f64]| {
            let m = mean(x);
            (x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / TRIALS as f64 / TRIALS as f64).sqrt()
        };
        for (squares, formula) in [(&fre, 1.0 - 2.0 / 6.0), (&tre, share * share)] {
            let (off, error) = (mean(squares) - formula, error(squares));
            assert!(off.abs() < 3.0 * error, "{formula} off {off} standard error {error}");
            assert!(error < 0.03 * formula, "{error}");
        }
        // The errors are not correlated: standard error 1/sqrt(n).
        let (f, t) = (mean(&fre), mean(&tre));
        let joint = fre.iter().zip(&tre).map(|(a, b)| (a - f) * (b - t)).sum::<f64>();
        let correlation = joint / (error(&fre) * error(&tre)) / (TRIALS as f64).powi(2);
        assert!(correlation.abs() < 3.0 / (TRIALS as f64).sqrt(), "{correlation}");
    }

    #[test]
    fn exact_fiducials_give_the_pose() {
        let mut draws = SplitMix::new(12);
        for count in [3, 4, 9] {
            for _ in 0..200 {
                let place = |_| Point::from(Vector::from(draws.normals()) * 60.0);
                let places: Vec<Point> = (0..count).map(place).collect();
                let pairs = found(&places, |_| Vector::zeros());
                let registration = match Registration::new(&pairs, &target()) {
                    Ok(registration) => registration,
                    Err(RegistrationError::Collinear { .. }) if count == 3 => continue,
                    Err(error) => panic!("{error}"),
                };
                let both = registration.patient_from_tracker() * tracker_from_patient();
                assert!(both.rotation.angle() < 1e-7, "{both}");
                assert!((both * target() - target()).norm() < 1e-6);
                assert!(registration.fre_mm() < 1e-6);
            }
        }
    }

    #[test]
    fn three_fiducials_are_enough_and_more_are_advised() {
        let registration = Registration::new(&fixed()[..3], &target()).unwrap();
        assert!(registration.advice().is_some_and(|advice| advice.contains("four")));
        // For a localisation error of 1 mm, by another program.
        let share = registration.expected_tre_mm() / registration.fle_mm();
        assert!((share - 0.762).abs() < 5e-4, "{share}");
        let four = Registration::new(&fixed()[..4], &target()).unwrap();
        assert!((four.expected_tre_mm() / four.fle_mm() - 0.595).abs() < 5e-4);
        assert_eq!(four.advice(), None);
        assert_eq!(Registration::new(&fixed()[..2], &target()), Err(RegistrationError::TooFew(2)));
    }

    #[test]
    fn a_mirrored_set_is_refused_and_not_mirrored() {
        let mirrored: Vec<_> =
            fixed().iter().map(|(a, b)| (Point::new(a.x, a.y, -a.z), *b)).collect();
        let error = Registration::new(&mirrored, &target()).unwrap_err();
        let RegistrationError::Mirrored { mirrored_mm, fre_mm } = error else { panic!("{error}") };
        assert!(same(mirrored_mm, 0.367_802) && fre_mm > 10.0, "{mirrored_mm} {fre_mm}");
        // RAS for LPS is a turn, no mirror: it cannot show.
        let turned: Vec<_> =
            fixed().iter().map(|(a, b)| (Point::new(-a.x, -a.y, a.z), *b)).collect();
        let registration = Registration::new(&turned, &target()).unwrap();
        assert!(same(registration.fre_mm(), 0.367_802));
    }

    #[test]
    fn a_set_in_a_plane_gives_a_turn_whatever_its_errors() {
        let mut draws = SplitMix::new(13);
        let plane: Vec<Point> = places().iter().map(|p| Point::new(p.x, p.y, 0.0)).collect();
        let mut signs = [0; 2];
        for _ in 0..200 {
            let mut pairs = found(&plane, |_| Vector::from(draws.normals()) * 0.5);
            pairs.iter_mut().for_each(|pair| pair.1 += Vector::from(draws.normals()) * 0.5);
            let registration = Registration::new(&pairs, &target()).unwrap();
            let both = registration.patient_from_tracker() * tracker_from_patient();
            assert!(both.rotation.angle() < 0.1 && registration.fre_mm() < 3.0);
            let middle = |side: fn(&(Point, Point)) -> Point| {
                pairs.iter().map(|pair| side(pair).coords).sum::<Vector>() / 6.0
            };
            let (a, b) = (middle(|p| p.0), middle(|p| p.1));
            let products: Matrix =
                pairs.iter().map(|p| (p.0.coords - a) * (p.1.coords - b).transpose()).sum();
            signs[usize::from(products.determinant() < 0.0)] += 1;
        }
        assert!(signs.iter().all(|count| *count > 20), "both signs occur: {signs:?}");
    }

    #[test]
    fn fiducials_on_a_line_are_refused_with_the_frame_and_the_reason() {
        let line = |off: f64| -> Vec<Point> {
            let at = |k: usize| {
                Point::new(30.0 * k as f64, -20.0 * k as f64, if k == 2 { off } else { 0.0 })
            };
            (0..5).map(at).collect()
        };
        let refused = |pairs: &[(Point, Point)]| Registration::new(pairs, &target()).unwrap_err();
        let on_line = found(&line(1.0), |_| Vector::zeros());
        let error = refused(&on_line);
        assert!(
            matches!(error, RegistrationError::Collinear { frame: Frame::Tracker, number: 3, .. }),
            "{error:?}"
        );
        let text = error.to_string();
        assert!(text.contains("tracker's") && text.contains("fiducial 3"), "{text}");
        let good = found(&places()[..5], |_| Vector::zeros());
        let mixed: Vec<_> = good.iter().zip(&on_line).map(|(a, b)| (a.0, b.1)).collect();
        assert!(refused(&mixed).to_string().contains("patient's positions"));
        assert!(Registration::new(&found(&line(20.0), |_| Vector::zeros()), &target()).is_ok());
        // Far enough off for their length and not for what a point is found to; and the other way
        // round.
        for (length, off) in [(5.0, 1.5), (400.0, 8.0)] {
            let places =
                [[0.0, 0.0, 0.0], [length, off, 0.0], [2.0 * length, 0.0, 0.0]].map(Point::from);
            let error = refused(&found(&places, |_| Vector::zeros()));
            assert!(matches!(error, RegistrationError::Collinear { .. }), "{error}");
        }
        let one_place = vec![(Point::origin(), Point::origin()); 4];
        assert!(matches!(refused(&one_place), RegistrationError::Collinear { .. }));
    }

    #[test]
    fn positions_that_are_none_are_refused_with_their_number() {
        for wrong in [f64::NAN, f64::INFINITY, -2e6, f64::MAX] {
            let mut pairs = fixed();
            pairs[3].1.y = wrong;
            let error = Registration::new(&pairs, &target()).unwrap_err();
            assert!(error.to_string().contains("patient's position of fiducial 4"), "{error}");
            let far = Point::new(wrong, 0.0, 0.0);
            let error = Registration::new(&fixed(), &far).unwrap_err();
            assert!(matches!(error, RegistrationError::Target(_)), "{error}");
        }
    }

    #[test]
    fn sets_that_have_nothing_in_common_are_refused() {
        // Ends of three axes, and a triangle each corner of which stands for both ends of one:
        // every product cancels.
        let corners = [[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [0.0, 60.0, 0.0]];
        let end = |k: usize| Vector::ith(k / 2, if k.is_multiple_of(2) { 50.0 } else { -50.0 });
        let pair = |k: usize| (tracker_from_patient() * Point::from(end(k)), corners[k / 2].into());
        let pairs: Vec<_> = (0..6).map(pair).collect();
        let error = Registration::new(&pairs, &target()).unwrap_err();
        assert!(matches!(error, RegistrationError::Unlike { .. }), "{error:?}");
    }

    const TABLE: &str = "name,tracker_x,tracker_y,tracker_z,patient_x,patient_y,patient_z\n\
        notch,1,2,3,4,5,6\nleft clavicle,-1.5,0,1e2,7,8,9\n";

    #[test]
    fn fiducials_are_read_from_a_table() {
        let fiducials = read_fiducials(TABLE).unwrap();
        assert_eq!(fiducials.len(), 2);
        assert_eq!(fiducials[1].name, "left clavicle");
        let pair = (Point::new(-1.5, 0.0, 100.0), Point::new(7.0, 8.0, 9.0));
        assert_eq!(fiducials[1].pair(), pair);
        assert_eq!(read_fiducials(TABLE.lines().next().unwrap()), Ok(vec![]));
    }

    #[test]
    fn what_is_no_table_of_fiducials_is_refused_with_its_line() {
        let refused = |from: &str, to: &str| {
            read_fiducials(&TABLE.replace(from, to)).unwrap_err().to_string()
        };
        assert!(refused("tracker_y", "tracker_v").contains("`tracker_y` 0 times"));
        assert!(refused("7,8,9", "7,8").contains("line 3 has 6 fields"));
        let number = refused("1e2", "1e999");
        assert!(number.contains("line 3") && number.contains("tracker_z"), "{number}");
        assert!(refused("left clavicle", "notch").contains("line 3: the name `notch`"));
        assert!(refused("left clavicle", "").contains("line 3: the name ``"));
    }
}
