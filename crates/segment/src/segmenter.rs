//! A CT made ready: seeds can be set and changed without starting over.

use crate::body::{Body, flag};
use crate::find_body::find_body;
use crate::frame::Frame;
use crate::info::Counts;
use crate::paint::Outline;
use crate::posture::Posture;
use crate::quality_check::QualityCheck;
use crate::radial_map::{RadialMap, Rays};
use crate::scan::Scan;
use crate::seeds::{self, Constraints};
use crate::segmentation::Segmentation;
use crate::shell::{self, Shell};
use crate::wall::Search;
use crate::{
    Error, Info, Params, Seeds, bones, confidence, contents, hounsfield, implant, info, muscle,
    whole_chest,
};
use std::sync::Arc;
use supine_space::{Progress, Warning};
use supine_volume::{Ct, LabelMap, SeedKind, Surfaces, Volume, label};

/// All that the segmentation of one CT rests on but the seeds.
pub struct Segmenter {
    /// Implants are filled with fat.
    ct: Arc<Ct>,
    params: Params,
    frame: Frame,
    body: Body,
    posture: Posture,
    /// What was measured of the values.
    checks: Vec<QualityCheck>,
    rays: Rays,
    shell: Shell,
    search: Search,
}

/// The search reaches at least this far beyond the highest seed, mm. Chosen, not measured.
const BEYOND_SEED_MM: f32 = 5.0;

impl Segmenter {
    /// Makes a CT ready. The seeds among the parameters are not looked at.
    ///
    /// The slices (k) must be within 20 degrees of axial; their rows and columns may run in any
    /// direction. Values are HU; padding may have any value below -1024. Do not crop the CT before.
    ///
    /// # Errors
    /// When the slices are not axial, no body, lungs or ribs are found, half of the chest is missing, fat and muscle cannot be
    /// told apart, a parameter is out of range, or the callback asked to stop.
    pub fn new(ct: Arc<Ct>, params: &Params, progress: Progress<'_>) -> Result<Self, Error> {
        params.check()?;
        let frame = Frame::new(ct.grid())?;
        let mut checks = hounsfield::check(&ct, &frame)?;
        let mut body = find_body(&ct, &frame, params, progress.part(0.0, 0.4))?;
        checks.extend([whole_chest::check(&frame, &body)?]);
        let posture = Posture::check(&ct, &frame, &body)?;
        let ct = implant::as_fat(ct, &frame, &mut body);
        let bone_hu = params.bone_hu as f32;
        bones::mark_bones(&ct, &frame, bone_hu, &mut body, progress.part(0.4, 0.5))?;
        let rays = Rays::new(&frame, bones::axis(&frame, &body)?);
        let scan = Scan { ct: &ct, frame: &frame, body: &body, rays: &rays };
        let shell = shell::shell(scan, progress.part(0.5, 0.8))?;
        let wide = (params.reach_mm as f32, params.weights);
        let search = Search::new(scan, &shell, wide, progress.part(0.8, 1.0))?;
        Ok(Self { ct, params: params.clone(), frame, body, posture, checks, rays, shell, search })
    }

    /// Soft tissue and chest wall as the seeds want them.
    ///
    /// # Errors
    /// When a seed lies where it cannot be, two seeds exclude each other, lung lies outside the wall, or the
    /// callback asked to stop.
    pub fn segment(
        &self,
        seeds: &Seeds,
        progress: Progress<'_>,
    ) -> Result<(Segmentation, Info), Error> {
        let scan = self.scan();
        let shell = &self.shell.radius;
        let marks = seeds::marks(scan, seeds)?;
        let constraints = Constraints::new(scan, &marks, shell)?;
        let reach = constraints.highest_mm() + BEYOND_SEED_MM;
        let wider = (reach > self.search.reach_mm())
            .then(|| {
                let wide = (reach, self.params.weights);
                Search::new(scan, &self.shell, wide, progress.part(0.0, 0.4))
            })
            .transpose()?;
        let search = wider.as_ref().unwrap_or(&self.search);
        let wall = search.solve(scan, shell, &constraints, progress.part(0.4, 0.9))?;
        let outline = Outline::new(scan, shell.plus(&wall.height));
        let mut labels = outline.paint();
        let (muscle, levels) = (&search.muscle, search.levels);
        muscle::add_beyond(&outline, muscle, levels, shell, &constraints, &mut labels);
        let contents = contents::settle(&outline, &self.shell.ribless, &mut labels)?;
        seeds::stamp(scan, &mut labels, &marks);
        let mut error = confidence::error(scan, &self.shell, &wall, &constraints);
        for &(ray, mm) in &contents.off {
            error.values[ray] = error.values[ray].max(mm);
        }
        let warnings = self.seed_warnings(seeds, &wall.height)?;
        progress.at(1.0)?;
        let ribless = self.shell.ribless.iter().filter(|&&r| r).count();
        let counts = Counts { ribless_slices: ribless, seeds_used: marks.len() };
        let mut info = info::info(&self.params, scan, levels, &wall, counts);
        info.warnings.extend(self.posture.warning());
        info.warnings.extend(contents.warnings());
        info.warnings.extend(warnings);
        info.checks.extend(contents.checks());
        info.checks.splice(0..0, self.checks.iter().cloned().chain(self.posture.checks()));
        let outline = outline.into_radius();
        Ok((Segmentation { labels: Arc::new(labels), outline, error, levels }, info))
    }

    /// What points among the seeds did to the wall (its height over the shell), beside the wall without seeds.
    fn seed_warnings(&self, seeds: &Seeds, height: &RadialMap) -> Result<Vec<Warning>, Error> {
        let points = [SeedKind::ChestWall, SeedKind::SoftTissue].map(|kind| seeds.points(kind));
        if points.iter().all(|points| points.is_empty()) {
            return Ok(Vec::new());
        }
        let (scan, shell) = (self.scan(), &self.shell.radius);
        let none = Constraints::new(scan, &[], shell)?;
        let without = self.search.solve(scan, shell, &none, Progress::none())?;
        let (without, with) = (shell.plus(&without.height), shell.plus(height));
        let walls = seeds::Walls { without: &without, with: &with };
        Ok(seeds::warnings(scan, self.search.levels, &walls, seeds))
    }

    /// The uncertainty of the wall: how far the boundary of the chest wall may be wrong in what [`Self::segment`] made of this
    /// CT: the error that 9 of 10 such places do not exceed, tenths of mm (255: 25.5 mm or more),
    /// on the voxels of the patient within 3 mm of the boundary; 0 elsewhere.
    pub fn uncertainty(&self, made: &Segmentation) -> Volume<u8> {
        confidence::map(self.scan(), &made.outline, &made.error)
    }

    /// Skin and chest wall of what [`Self::segment`] made of this CT, known between the voxels:
    /// their signs are its labels.
    ///
    /// # Errors
    /// When the callback asked to stop.
    pub fn surfaces(&self, made: &Segmentation, progress: Progress<'_>) -> Result<Surfaces, Error> {
        progress.at(0.0)?;
        let outline = Outline::new(self.scan(), made.outline.clone());
        let surfaces = outline.surfaces(&made.labels, self.params.skin_hu as f32, made.levels);
        progress.at(1.0)?;
        Ok(surfaces)
    }

    /// The breast implants that were found, as [`supine_volume::label::IMPLANT`] on the CT's grid;
    /// `None` when there are none.
    pub fn implants(&self) -> Option<LabelMap> {
        let implant = |f: u8| if f & flag::IMPLANT != 0 { label::IMPLANT } else { label::OUTSIDE };
        let found = self.body.flags.iter().any(|f| f & flag::IMPLANT != 0);
        let map = || self.ct.with_data(self.body.flags.iter().map(|&f| implant(f)).collect());
        found.then(map).and_then(Result::ok)
    }

    fn scan(&self) -> Scan<'_> {
        Scan { ct: &self.ct, frame: &self.frame, body: &self.body, rays: &self.rays }
    }
}

impl std::fmt::Debug for Segmenter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Segmenter").field("grid", self.ct.grid()).finish_non_exhaustive()
    }
}
