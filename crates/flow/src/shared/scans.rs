//! The scans of a case, with poses to begin from.

use crate::Error;
use crate::inputs::InputFile;
use crate::nodes::Scans;
use crate::work::Work;
use supine_exchange::{Landmarks, LengthUnit, ScanFile, read_landmarks, read_scan};
use supine_mesh::Scan;
use supine_register::{
    Aligned, Params, Rigid, Scaled, Skin, Start, align, by_landmarks, candidates, signed_distances,
};
use supine_report::ScanFit;
use supine_space::{Pose, Progress, Sphere, Warning};

/// Landmarks this far from those of the CT after the best pose are of another point, mm rms: rough
/// picks were 3 to 6 mm off.
const LANDMARKS_MM: f64 = 20.0;
/// Poses that are followed when no landmark tells.
const POSES: usize = 3;
/// A scan of a patient who lies as in the CT lies this near to its skin, mm rms; 0.35 mm on
/// synthetic patients.
const SUPINE_MM: f64 = 1.5;
/// A scanner that measures so much too large or too small is told: 0.1 % is what a right one comes
/// to.
const SCALE: f64 = 0.005;
/// The mirror image of a mirrored scan fits the skin so much better, as a share of the objective.
const MIRRORED: f64 = 0.5;
/// Reach of the loss, mm.
const REACH_MM: [f64; 2] = [20.0, 4.0];
/// Distance up to which the lying scan is held against the skin, mm.
const WITHIN_MM: f64 = 10.0;

/// What was read.
pub(crate) struct ReadScans {
    pub(crate) sitting: Scan,
    /// Poses of the sitting scan to begin from.
    pub(crate) poses: Vec<Pose>,
    /// How the lying scan fits the skin.
    pub(crate) supine: Option<ScanFit>,
}

/// Reads the scans, finds poses of the sitting one, and holds the lying one against the skin.
///
/// # Errors
/// When a file cannot be read, landmarks contradict the scan, or a scan lies nowhere on the skin.
pub(crate) fn read_scans(
    scans: &Scans,
    skin: &Skin,
    region: Sphere,
    work: &Work<'_>,
) -> Result<ReadScans, Error> {
    let landmarks = landmarks(scans.landmarks.as_ref())?;
    let shape = Rigid {
        points: skin.points().to_vec(),
        triangles: skin.triangles().to_vec(),
        weights: front(skin),
    };
    let on = Onto { unit: scans.unit, landmarks: &landmarks, shape: &shape, region };
    let supine = match &scans.supine {
        Some(file) => Some(on.supine(file, work)?),
        None => None,
    };
    let read = PosedScan::read(&scans.sitting, ("sitting", scans.unit), &landmarks, work)?;
    let poses = on.poses(&read, work.progress.part(0.15, 0.3))?;
    Ok(ReadScans { sitting: read.scan, poses, supine })
}

/// The landmarks of a case; none without a file.
pub(crate) fn landmarks(file: Option<&InputFile>) -> Result<Landmarks, Error> {
    let Some(file) = file else { return Ok(Landmarks::default()) };
    let read = read_landmarks(&file.path).map_err(|e| Error::file("scans.landmarks", e))?;
    file.check_unchanged()?;
    Ok(read)
}

/// A scan as it was read, and in which unit.
pub(crate) struct SeenScan {
    pub(crate) posed: PosedScan,
    pub(crate) file: ScanFile,
}

impl SeenScan {
    /// Reads a scan by its name among the landmarks and the unit of its file, where that is stated.
    ///
    /// # Errors
    /// When it cannot be read, or its landmarks contradict those of the CT.
    pub(crate) fn read(
        file: &InputFile,
        (frame, unit): (&str, Option<&'static str>),
        landmarks: &Landmarks,
    ) -> Result<Self, Error> {
        let unit = LengthUnit::ALL.into_iter().find(|u| Some(u.name()) == unit);
        let (scan, found) = read_scan(&file.path, unit).map_err(|e| Error::file(file.key, e))?;
        file.check_unchanged()?;
        let seen = |pose| Self { posed: PosedScan { scan, pose }, file: found.clone() };
        if let Some(pose) = landmarks.pose(frame) {
            return Ok(seen(Some(pose)));
        }
        if landmarks.points(frame).is_none() {
            return Ok(seen(None));
        }
        let pairs = landmarks.pairs(frame).into_iter();
        let pairs: Vec<_> = pairs.map(|(own, ct)| (own * found.unit.mm(), ct)).collect();
        let fitted = by_landmarks(&pairs).map_err(|e| Error::Fit(e.into()))?;
        if fitted.rms_mm > LANDMARKS_MM {
            return Err(Error::Landmarks { frame: frame.into(), rms_mm: fitted.rms_mm });
        }
        Ok(seen(Some(fitted.pose)))
    }
}

/// A scan in a frame of its own, mm.
pub(crate) struct PosedScan {
    pub(crate) scan: Scan,
    /// Its pose as the landmarks' file gives it, or as the landmarks say roughly; none without.
    pub(crate) pose: Option<Pose>,
}

impl PosedScan {
    /// Reads a scan by its name among the landmarks and the unit of its file, where that is stated.
    ///
    /// # Errors
    /// When it cannot be read, or its landmarks contradict those of the CT.
    pub(crate) fn read(
        file: &InputFile,
        named: (&str, Option<&'static str>),
        landmarks: &Landmarks,
        work: &Work<'_>,
    ) -> Result<Self, Error> {
        let seen = SeenScan::read(file, named, landmarks)?;
        work.warn_all(seen.file.info.warnings);
        Ok(seen.posed)
    }
}

/// What scans are brought onto.
struct Onto<'a> {
    unit: Option<&'static str>,
    landmarks: &'a Landmarks,
    shape: &'a Rigid,
    region: Sphere,
}

impl Onto<'_> {
    /// Poses to begin from: the one that is known, or those that a search finds.
    fn poses(&self, read: &PosedScan, progress: Progress<'_>) -> Result<Vec<Pose>, Error> {
        if let Some(pose) = read.pose {
            return Ok(vec![pose]);
        }
        let ranked = candidates(&read.scan, self.shape, &[], progress)?;
        Ok(ranked.into_iter().take(POSES).map(|(_, pose)| pose).collect())
    }

    /// The lying scan on the skin.
    fn supine(&self, file: &InputFile, work: &Work<'_>) -> Result<ScanFit, Error> {
        let read = PosedScan::read(file, ("supine", self.unit), self.landmarks, work)?;
        let (poses, scan) = (self.poses(&read, work.progress.part(0.0, 0.15))?, &read.scan);
        let params = Params {
            centre: self.region.centre(),
            reach_mm: REACH_MM,
            iterations: 40,
            pose: true,
            prior_mm2: 0.0,
            counts: None,
        };
        let pose = poses.first().copied().unwrap_or_else(Pose::identity);
        let start = Start { pose, values: vec![] };
        let aligned = align(scan, self.shape, &start, &params, Progress::none());
        let aligned = aligned.map_err(|e| Error::Fit(e.into()))?;
        let posed = supine_register::Posed::new(self.shape, &[]);
        let distances =
            signed_distances(scan, &aligned.pose, &posed, &self.shape.weights, WITHIN_MM);
        let rms_mm = distances.within(&self.region).spread().rms_mm;
        if rms_mm > SUPINE_MM {
            let text = format!(
                "the scan of the lying patient lies {rms_mm:.1} mm rms off the skin of the CT at the breast: it is of another shape \
                 than the CT's (arms, breathing, bra), mirrored, or of another patient"
            );
            work.warn(Warning::new("supine-scan-apart", text));
        }
        self.check_side(scan, &aligned, &params)?;
        let scale = self.scale(scan, &aligned, &params)?;
        if (scale - 1.0).abs() > SCALE {
            let text = format!(
                "the scan of the lying patient is {:.1} % {} than the skin of the CT: if the scanner measures so, the modulus is off \
                 by several times as much; state the right unit or have the scanner calibrated",
                100.0 * (scale - 1.0).abs(),
                if scale > 1.0 { "larger" } else { "smaller" }
            );
            work.warn(Warning::new("scan-scale", text));
        }
        let patient_from_scan = aligned.pose.to_homogeneous().transpose().into();
        Ok(ScanFit { rms_mm, scale, patient_from_scan })
    }
}

impl Onto<'_> {
    /// How many times as large as the skin of the CT a scan is.
    fn scale(&self, scan: &Scan, found: &Aligned, params: &Params<'_>) -> Result<f64, Error> {
        let shape = Scaled::new(self.shape, self.region.centre());
        let start = Start { pose: found.pose, values: vec![0.0] };
        let params = Params { reach_mm: [REACH_MM[1]; 2], ..*params };
        let rescaled = align(scan, &shape, &start, &params, Progress::none());
        Ok(1.0 + rescaled.map_err(|e| Error::Fit(e.into()))?.values[0])
    }

    /// That a scan is not the mirror image of the patient.
    fn check_side(&self, scan: &Scan, found: &Aligned, params: &Params<'_>) -> Result<(), Error> {
        let posed = scan.moved(&found.pose);
        let (low, high) = posed.bounds();
        let middle = low.x + high.x;
        let over = |x: f64, y: f64, z: f64| supine_space::Point::new(middle - x, y, z);
        let points = posed.points().iter().map(|p| over(p.x, p.y, p.z)).collect();
        let turned = posed.normals().iter().map(|n| supine_space::Vector::new(-n.x, n.y, n.z));
        let Ok((mirrored, _)) = Scan::new(points, Some(turned.collect()), vec![]) else {
            return Ok(());
        };
        let start = Start { pose: Pose::identity(), values: vec![] };
        match align(&mirrored, self.shape, &start, params, Progress::none()) {
            Ok(other) if other.objective_mm2 < MIRRORED * found.objective_mm2 => {
                Err(Error::Mirrored)
            }
            _ => Ok(()),
        }
    }
}

/// The skin that a scanner sees: not the back.
fn front(skin: &Skin) -> Vec<f64> {
    let y = skin.points().iter().map(|p| p.y);
    let (low, high) = y.fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
    let back = low + supine_personalise::BACK_SHARE * (high - low);
    skin.points().iter().map(|p| if p.y < back { 1.0 } else { 0.0 }).collect()
}
