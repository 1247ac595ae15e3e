//! The patient's own doses, structures and segmentations, beside the exported series they then belong to.

use super::export::Exported;
use super::import::Imported;
use crate::bench::{Bench, Done, Made};
use crate::rt::{
    Company, DOSE_NOTE, Kind, Wanted, carry_lines, carry_named_contours, carry_segments,
    carry_with_totals, closed_contours, write_carried_dose, write_carried_segments,
    write_carried_structures,
};
use crate::store::{Hashed, Store, form, hash_of};
use crate::{Case, RunError, Stage};
use std::path::Path;
use supine_mesh::{Displacement, TetMesh};
use supine_report::{CarriedObject, Input};
use supine_space::Progress;
use supine_volume::Ct;

/// What was carried, in the order of the case.
pub(crate) type Carried = Done<(), Vec<CarriedObject>>;

/// The mesh, and its displacement as the solver gave it.
type Map<'a> = (&'a TetMesh, &'a Displacement);

/// Refuses objects that cannot be carried before the long work is done.
pub(crate) fn check(case: &Case, input: &Imported) -> Result<(), RunError> {
    if case.carried.is_empty() {
        return Ok(());
    }
    let (Some((source, _)), Some(outward)) = (&input.input.dicom, &input.outward) else {
        return Err(RunError::NoSeries);
    };
    let company = Company::ahead(source, outward);
    for Wanted { kind, path } in &case.carried {
        hashed(*kind, path)?;
        match kind {
            Kind::Dose => company.dose(path).map(drop),
            Kind::Structures => company.structures(path).map(drop),
            Kind::Segmentation => company.segmentation(path, input.input.ct.grid()).map(drop),
        }?;
    }
    Ok(())
}

/// The files that are carried, for the summary.
pub(crate) fn inputs(case: &Case) -> Result<Vec<Input>, RunError> {
    let input = |Wanted { kind, path }: &Wanted| {
        let Hashed { files, blake3 } = hashed(*kind, path)?;
        Ok(Input { role: kind.name().into(), form: form(path), files, blake3 })
    };
    case.carried.iter().map(input).collect()
}

fn hashed(kind: Kind, path: &Path) -> Result<Hashed, RunError> {
    let missing = |source| RunError::Missing { role: kind.key(), path: path.into(), source };
    hash_of(path).map_err(missing)
}

pub(crate) fn carry(
    bench: &mut Bench<'_>,
    case: &Case,
    (input, map): (&Imported, Map<'_>),
    export: &Exported,
) -> Result<Carried, RunError> {
    let mut decided = String::new();
    for wanted in &case.carried {
        decided +=
            &format!("{} {}\n", wanted.kind.name(), hashed(wanted.kind, &wanted.path)?.blake3);
    }
    bench.stage(
        Stage::Carry,
        &[&export.key, &decided],
        |_, _| Ok(()),
        |store, progress| {
            let mut made = Made { product: (), facts: Vec::new(), warnings: Vec::new() };
            if case.carried.is_empty() {
                return Ok(made);
            }
            let before = input.input.dicom.as_ref().map(|(source, _)| source);
            let run = store.path("ct")?;
            let run = run.parent().unwrap_or(&run);
            let company = Company::of(run, before, progress.part(0.0, 0.1))?;
            let job = Job { company: &company, ct: &input.input.ct, map, store };
            for (n, wanted) in case.carried.iter().enumerate() {
                let share = |n: usize| 0.1 + 0.9 * n as f64 / case.carried.len() as f64;
                let progress = progress.part(share(n), share(n + 1));
                let same = case.carried[..=n].iter().filter(|w| w.kind == wanted.kind).count();
                let file = format!("rt/{}-{same}.dcm", wanted.kind.name());
                let (object, warnings) = job.one(wanted, file, progress)?;
                made.warnings.extend(warnings.iter().map(|w| format!("{}: {w}", object.file)));
                made.facts.push(object);
            }
            Ok(made)
        },
    )
}

struct Job<'a> {
    company: &'a Company,
    /// Before deformation.
    ct: &'a Ct,
    map: Map<'a>,
    store: &'a Store,
}

impl Job<'_> {
    /// Carries an object into `file`; doubts with it.
    fn one(
        &self,
        wanted: &Wanted,
        file: String,
        progress: Progress<'_>,
    ) -> Result<(CarriedObject, Vec<String>), RunError> {
        let (path, out) = (&wanted.path, self.store.path(&file)?);
        let kind = wanted.kind.name().into();
        let mut object = CarriedObject {
            kind,
            file,
            instance_uid: String::new(),
            max_gy: None,
            energy_mj: None,
            regions: vec![],
        };
        let warnings = match wanted.kind {
            Kind::Dose => self.dose(path, &out, &mut object, progress)?,
            Kind::Structures => self.structures(path, &out, &mut object, progress)?,
            Kind::Segmentation => self.segmentation(path, &out, &mut object, progress)?,
        };
        Ok((object, warnings))
    }

    fn dose(
        &self,
        path: &Path,
        out: &Path,
        object: &mut CarriedObject,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, RunError> {
        let (dose, doubts) = self.company.dose(path)?;
        let given = dose.volume();
        let (carried, totals) = carry_with_totals(given, Some(self.ct), self.map, progress)?;
        let written = write_carried_dose(&carried, &dose, self.company, out)?;
        object.instance_uid = written.object.instance_uid;
        let most = |gy: &[f32]| f64::from(gy.iter().copied().fold(f32::MIN, f32::max));
        object.max_gy = Some([given, &carried].map(|dose| most(dose.data())));
        object.energy_mj = totals.energy_mj;
        let warnings = std::iter::once(DOSE_NOTE.to_owned()).chain(doubts);
        Ok(warnings.chain(written.warnings).collect())
    }

    fn structures(
        &self,
        path: &Path,
        out: &Path,
        object: &mut CarriedObject,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, RunError> {
        let (structures, mut warnings) = self.company.structures(path)?;
        let (given, left_out) = closed_contours(&structures);
        warnings.extend(left_out);
        let carried = carry_named_contours(&given, self.ct.grid(), self.map, progress)?;
        let lines = carry_lines(&structures, self.map)?;
        let written = write_carried_structures(&carried, lines, &structures, self.company, out)?;
        object.instance_uid = written.object.instance_uid;
        object.regions = carried.regions();
        warnings.extend(written.warnings);
        Ok(warnings)
    }

    fn segmentation(
        &self,
        path: &Path,
        out: &Path,
        object: &mut CarriedObject,
        progress: Progress<'_>,
    ) -> Result<Vec<String>, RunError> {
        let grid = self.ct.grid();
        let (given, mut warnings) = self.company.segmentation(path, grid)?;
        let carried = carry_segments(&given, grid, self.map, progress)?;
        let (written, more) = write_carried_segments(&carried, &given, self.company, out)?;
        object.instance_uid = written.instance_uid;
        object.regions = carried.regions;
        warnings.extend(more);
        Ok(warnings)
    }
}
