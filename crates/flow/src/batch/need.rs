//! What a run needs of memory, and what the machine has.
//!
//! The figures are those of whole runs of the default mesh on two threads, resident memory of the
//! process, the larger of docs/VERIFICATION.md ("Whole runs, repeated runs") and of `supine run
//! --status` on 2026-11-27; see `MEASURED`.

use crate::Error;
use crate::session::Session;
use std::path::Path;
use supine_dicom::{Accept, Depth};
use supine_exchange::is_volume_name;
use supine_space::Progress;

/// What runs were measured to hold at most: voxels of the CT, MB. A test holds [`need`] to it.
#[cfg(test)]
const MEASURED: &[(usize, f64)] = &[
    // fixture, 256 x 256 x 86; today 324
    (5_636_096, 377.0),
    // p1-net, 320 x 320 x 86
    (8_806_400, 438.0),
    // breast-flt013, 512 x 512 x 49; today 339
    (12_845_056, 598.0),
    // chest-lidc0001, 512 x 512 x 133; today 889
    (34_865_152, 1110.0),
];

/// What a run holds whatever the CT, MB: mesh, factors of the mechanics, pictures, and the threads'
/// stacks.
const FIXED_MB: f64 = 270.0;
/// For each voxel, bytes: the CT before and after, its labels, distances and fields.
const PER_VOXEL: f64 = 26.0;
/// For each tetrahedron beyond those of the default mesh, bytes, by element order: `fixture` with
/// 40,000 of order 2 held 1,341 MB (2026-11-27); those of order 1 have a seventh of its unknowns.
const PER_TETRAHEDRON: [f64; 2] = [4.0e3, 28.0e3];
/// Tetrahedra of the default mesh.
const USUAL: usize = 5000;
/// Voxels of a CT of which nothing is known before it is read: 512 x 512 x 200.
const UNKNOWN: usize = 52_428_800;
/// Voxels that a byte of a file may stand for: a volume compressed by a factor of three.
const PER_BYTE: f64 = 1.5;

/// The most that a run holds, bytes, by the voxels of its CT, its tetrahedra and their order.
pub(crate) fn need(voxels: usize, tetrahedra: usize, order: u8) -> u64 {
    let more = tetrahedra.saturating_sub(USUAL) as f64;
    let each = PER_TETRAHEDRON[usize::from(order > 1)];
    (FIXED_MB * 1e6 + PER_VOXEL * voxels as f64 + each * more) as u64
}

/// What a session's run will hold at most, bytes: from the headers of its CT.
///
/// # Errors
/// When the case names no CT.
pub(crate) fn need_of(session: &Session) -> Result<u64, Error> {
    let case = session.case();
    let path = session.case_state().path(case.ct()?);
    let voxels = voxels(&path, case.series.as_deref(), case.accept).unwrap_or(UNKNOWN);
    let order = if matches!(case.mesh.order, supine_mesh::Order::Linear) { 1 } else { 2 };
    Ok(need(voxels, case.mesh.tetrahedra, order))
}

/// Voxels of a CT, from its headers; of a volume in one file by its size.
fn voxels(path: &Path, series: Option<&str>, accept: Accept) -> Option<usize> {
    if is_volume_name(path) {
        let files = supine_exchange::volume_files(path).ok()?;
        let bytes: u64 = files.iter().filter_map(|f| Some(std::fs::metadata(f).ok()?.len())).sum();
        return Some((bytes as f64 * PER_BYTE) as usize);
    }
    let inspection = supine_dicom::inspect(path, Depth::Headers, accept, Progress::none()).ok()?;
    let asked = |uid: &str| series.is_none_or(|asked| asked == uid);
    let all = inspection.series.iter().filter(|s| asked(&s.uid));
    all.filter_map(|s| Some(s.grid.as_ref()?.size.iter().product())).max()
}

/// Memory that a program may take now without others being pushed out, bytes; none where the system
/// does not tell. Within a container no more than is left of its own limit.
pub(crate) fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let free = line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024;
    Some(within_container().map_or(free, |left| left.min(free)))
}

/// What is left of the limit of a control group, bytes.
fn within_container() -> Option<u64> {
    let read = |name: &str| {
        let text = std::fs::read_to_string(Path::new("/sys/fs/cgroup").join(name)).ok()?;
        text.trim().parse::<u64>().ok()
    };
    let (limit, used) = (read("memory.max")?, read("memory.current")?);
    let stat = std::fs::read_to_string("/sys/fs/cgroup/memory.stat").unwrap_or_default();
    // What the system keeps of files it gives back when it is asked.
    let files = stat.lines().find_map(|line| line.strip_prefix("inactive_file "));
    let files = files.and_then(|text| text.trim().parse().ok()).unwrap_or(0);
    Some(limit.saturating_sub(used.saturating_sub(files)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_run_was_measured_to_hold_more_than_it_is_given_nor_much_less() {
        for (voxels, mb) in MEASURED {
            let given = need(*voxels, USUAL, 2) as f64 / 1e6;
            assert!(given >= *mb && given < 1.3 * mb, "{voxels} voxels: {mb} MB, given {given}");
        }
    }

    #[test]
    fn more_tetrahedra_and_voxels_need_more() {
        assert!(need(1000, 40_000, 2) > need(1000, 40_000, 1));
        assert!(need(1000, 40_000, 1) > need(1000, 5000, 1));
        assert_eq!(need(1000, 100, 2), need(1000, 5000, 1));
    }

    #[test]
    fn this_machine_has_memory() {
        if cfg!(target_os = "linux") {
            assert!(available().is_some_and(|bytes| bytes > 1 << 20));
        }
    }
}
