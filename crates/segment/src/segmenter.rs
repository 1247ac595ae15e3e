//! A CT made ready: seeds can be set and changed without starting over.

use crate::body::{Body, flag};
use crate::denoise::quiet;
use crate::find_body::find_body;
use crate::frame::Frame;
use crate::info::Counts;
use crate::levels::Levels;
use crate::orientation::Orientation;
use crate::paint::Outline;
use crate::posture::PostureSigns;
use crate::radial_map::{RadialMap, Rays};
use crate::scan::Scan;
use crate::seeds::{self, Constraints};
use crate::segmentation::Segmentation;
use crate::shell::{self, Shell};
use crate::slice_tissue::SliceTissue;
use crate::wall::{Search, Wall};
use crate::{
    Error, Info, Params, Seeds, bones, confidence, contents, devices, free_border, hounsfield,
    implant, info, whole_chest,
};
use std::sync::Arc;
use supine_record::QualityCheck;
use supine_space::{Progress, Warning};
use supine_volume::{Ct, Field, LabelMap, SeedKind, Surfaces, Volume, label};

/// All that the segmentation of one CT rests on but the seeds.
pub struct Segmenter {
    /// Implants and devices are filled with fat.
    ct: Arc<Ct>,
    /// The same with less noise.
    quiet: Arc<Ct>,
    params: Params,
    frame: Frame,
    body: Body,
    /// What was measured of the CT as a whole, and what is to be told of it.
    checks: Vec<QualityCheck>,
    warnings: Vec<Warning>,
    rays: Rays,
    shell: Shell,
    search: Search,
    /// The wall without seeds.
    free: Wall,
    /// What the borders of muscle rest on.
    tissue: SliceTissue,
}

/// The search reaches at least this far beyond the highest seed, mm. Chosen, not measured.
const BEYOND_SEED_MM: f32 = 5.0;

impl Segmenter {
    /// Makes a CT ready. The seeds among the parameters are not looked at.
    ///
    /// The slices (k) must be within 20 degrees of axial; their rows and columns may run in any
    /// direction. Values are HU; padding may have any value below -1024. `field` is that of the CT.
    /// Do not crop the CT before.
    ///
    /// # Errors
    /// When the slices are not axial, no body, lungs or ribs are found, half of the chest is
    /// missing, fat and muscle cannot be told apart, a parameter is out of range, or the callback
    /// asked to stop.
    pub fn new(
        ct: Arc<Ct>,
        field: &Field,
        params: &Params,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        params.check()?;
        let frame = Frame::new(ct.grid())?;
        let mut checks = hounsfield::check(&ct, &frame)?;
        let mut body = find_body(&ct, field, (&frame, params), progress.part(0.0, 0.4))?;
        checks.extend(whole_chest::check(&frame, &body, field)?);
        let posture = PostureSigns::check(&ct, &frame, &body, params.posture)?;
        let orientation = Orientation::check(&ct, &frame, &body)?;
        checks.extend(posture.checks().into_iter().chain(orientation.checks()));
        let warnings = posture.warning().into_iter().chain(orientation.warnings()).collect();
        let ct = implant::as_fat(ct, &frame, &mut body);
        let ct = devices::as_fat(ct, &frame, &mut body);
        let bone_hu = params.bone_hu as f32;
        let quiet = quiet(&ct, &frame, &body);
        let levels = Levels::of_body(&quiet, &frame, &body);
        bones::mark_bones(&quiet, &frame, (bone_hu, levels), &mut body, progress.part(0.4, 0.5))?;
        let rays = Rays::new(&frame, bones::axis(&frame, &body)?);
        let scan = Scan { ct: &quiet, frame: &frame, body: &body, rays: &rays };
        let shell = shell::shell(scan, levels, progress.part(0.5, 0.8))?;
        let wide = (params.reach_mm as f32, params.weights);
        let search = Search::new(scan, &shell, wide, progress.part(0.8, 0.95))?;
        let none = Constraints::new(scan, &[], &shell.radius)?;
        let free = search.solve(scan, &shell.radius, &none, progress.part(0.95, 1.0))?;
        let (params, found) = (params.clone(), search.found());
        let tissue = SliceTissue::new(frame.size[2], found.levels, found.below);
        Ok(Self {
            ct,
            quiet,
            params,
            frame,
            body,
            checks,
            warnings,
            rays,
            shell,
            search,
            free,
            tissue,
        })
    }

    /// Soft tissue and chest wall as the seeds want them.
    ///
    /// # Errors
    /// When a seed lies where it cannot be, two seeds exclude each other, lung lies outside the
    /// wall, or the callback asked to stop.
    pub fn segment(
        &self,
        seeds: &Seeds,
        progress: Progress<'_>,
    ) -> Result<(Segmentation, Info), Error> {
        let scan = self.scan();
        let marks = seeds::marks(scan, seeds)?;
        let bent = seeds::bent(scan, &marks, &self.shell.radius)?;
        let bent = bent.map(|radius| Shell { radius, ..self.shell.clone() });
        let shell = bent.as_ref().unwrap_or(&self.shell);
        let constraints = Constraints::new(scan, &marks, &shell.radius)?;
        let reach = (constraints.highest_mm() + BEYOND_SEED_MM).max(self.search.reach_mm());
        let anew = (bent.is_some() || reach > self.search.reach_mm())
            .then(|| {
                Search::new(scan, shell, (reach, self.params.weights), progress.part(0.0, 0.4))
            })
            .transpose()?;
        let search = anew.as_ref().unwrap_or(&self.search);
        let wall = if constraints.bind_nothing() {
            self.free.clone()
        } else {
            search.solve(scan, &shell.radius, &constraints, progress.part(0.4, 0.9))?
        };
        let outline = Outline::new(scan, shell.radius.plus(&wall.height));
        let mut labels = outline.paint();
        let muscle = search.found();
        let other = (!self.tissue.is_of(&muscle.levels, muscle.below))
            .then(|| SliceTissue::new(self.frame.size[2], muscle.levels, muscle.below));
        let of_ct = (&muscle, other.as_ref().unwrap_or(&self.tissue));
        free_border::add_beyond(&outline, of_ct, &shell.radius, &constraints, &mut labels);
        let contents = contents::settle(&outline, &shell.ribless, &mut labels)?;
        let excluded = seeds::stamp(scan, &mut labels, &marks);
        let mut error = confidence::error(scan, shell, &wall, &constraints);
        for &(ray, mm) in &contents.off {
            error.values[ray] = error.values[ray].max(mm);
        }
        progress.at(1.0)?;
        let ribless = shell.ribless.iter().filter(|&&r| r).count();
        let counts = Counts { ribless_slices: ribless, seeds_used: marks.len() };
        let mut info = info::info(&self.params, scan, search.levels, &wall, counts);
        info.warnings.extend(self.warnings.iter().cloned());
        info.warnings.extend(contents.warnings());
        info.warnings.extend(excluded);
        info.warnings.extend(self.seed_warnings(seeds, outline.radius()));
        info.checks.splice(0..0, self.checks.iter().cloned());
        info.checks.extend(contents.checks());
        let levels = search.levels;
        let outline = outline.into_radius();
        Ok((Segmentation { labels: Arc::new(labels), outline, error, levels }, info))
    }

    /// What points among the seeds did to the wall (its radius), beside the wall without seeds.
    fn seed_warnings(&self, seeds: &Seeds, with: &RadialMap) -> Vec<Warning> {
        let points = [SeedKind::ChestWall, SeedKind::SoftTissue].map(|kind| seeds.points(kind));
        if points.iter().all(|points| points.is_empty()) {
            return Vec::new();
        }
        let without = self.shell.radius.plus(&self.free.height);
        let walls = seeds::Walls { without: &without, with };
        seeds::warnings(self.scan(), self.search.levels, &walls, seeds)
    }

    /// The uncertainty of the wall: how far the boundary of the chest wall may be wrong in what
    /// [`Self::segment`] made of this CT: the error that 19 of 20 such places do not exceed, tenths
    /// of mm (255: 25.5 mm or more), on the voxels of the patient within 3 mm of the boundary; 0
    /// elsewhere.
    pub fn uncertainty(&self, made: &Segmentation) -> Volume<u8> {
        confidence::map(self.scan(), &made.outline, &made.error, &made.labels)
    }

    /// Skin and chest wall of what [`Self::segment`] made of this CT, known between the voxels:
    /// their signs are its labels.
    ///
    /// # Errors
    /// When the callback asked to stop.
    pub fn surfaces(&self, made: &Segmentation, progress: Progress<'_>) -> Result<Surfaces, Error> {
        progress.at(0.0)?;
        let Self { ct, params, frame, body, rays, .. } = self;
        let scan = Scan { ct, frame, body, rays };
        let outline = Outline::new(scan, made.outline.clone());
        let surfaces = outline.surfaces(&made.labels, params.skin_hu as f32, made.levels);
        progress.at(1.0)?;
        Ok(surfaces)
    }

    /// The breast implants and the devices under the skin that were found, as
    /// [`supine_volume::label::IMPLANT`] on the CT's grid; `None` when there are none.
    pub fn implants(&self) -> Option<LabelMap> {
        let implant = |f: u8| if f & flag::IMPLANT != 0 { label::IMPLANT } else { label::OUTSIDE };
        let has_implant = self.body.flags.iter().any(|f| f & flag::IMPLANT != 0);
        let map = || self.ct.with_data(self.body.flags.iter().map(|&f| implant(f)).collect());
        has_implant.then(map).and_then(Result::ok)
    }

    /// Voxels of the CT.
    pub fn voxels(&self) -> usize {
        self.ct.grid().len()
    }

    fn scan(&self) -> Scan<'_> {
        Scan { ct: &self.quiet, frame: &self.frame, body: &self.body, rays: &self.rays }
    }
}

impl std::fmt::Debug for Segmenter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Segmenter").field("grid", self.ct.grid()).finish_non_exhaustive()
    }
}
