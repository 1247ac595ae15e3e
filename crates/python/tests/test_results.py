"""What a run leaves as values in memory, runs that rest on labels of one's own, and meshes from files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
import SimpleITK
from conftest import ROOT, Finished
from rt_objects import write_dose, write_structures

import supine

pytestmark = pytest.mark.filterwarnings("ignore::supine.SupineWarning")
SCANS = ROOT / "fixtures" / "patient" / "scans"
CENTRE = (91.37, -248.09, -594.5)


def same_place(ours: supine.Volume, image: SimpleITK.Image) -> None:
    np.testing.assert_allclose(ours.origin, image.GetOrigin(), atol=1e-6)
    np.testing.assert_allclose(ours.spacing, image.GetSpacing(), atol=1e-9)
    np.testing.assert_allclose(np.ravel(ours.direction), image.GetDirection(), atol=1e-12)


def test_a_run_leaves_its_results_in_the_session(values: dict[str, Any], tmp_path: Path) -> None:
    session = supine.Session(**values)
    summary, told = session.run(tmp_path / "run"), []
    session.progress = lambda stage, share: told.append((stage, share))
    image = SimpleITK.ReadImage(str(tmp_path / "run" / "labels.seg.nrrd"))
    assert np.array_equal(session.labels.array, SimpleITK.GetArrayFromImage(image))
    assert session.tumour.distance == summary["tumour"]["distance_mm"]
    assert session.ct.size == session.deformed_ct.size and session.deformation.order == 1
    # What is held is told as begun and done, and nothing between.
    assert told and not [share for _, share in told if 0.0 < share < 1.0]


def test_the_fields_are_those_of_the_run(finished: Finished) -> None:
    fields = finished.session.fields
    for name in ("deformed_to_ct", "ct_to_deformed", "jacobian"):
        ours: supine.Volume = getattr(fields, name)
        image = SimpleITK.ReadImage(str(finished.out / "field" / f"{name}.nrrd"))
        assert ours.array.dtype == np.float32 and not ours.array.flags.writeable
        assert np.array_equal(ours.array, SimpleITK.GetArrayFromImage(image)), name
        same_place(ours, image)
        same_place(ours, ours.to_sitk())
        assert ours.to_pyvista().n_points == np.prod(ours.size)
    vectors = fields.ct_to_deformed
    assert vectors.array.shape == (*vectors.size[::-1], 3)
    again = SimpleITK.GetArrayFromImage(vectors.to_sitk())
    assert np.array_equal(again, vectors.array)
    with pytest.raises(ValueError, match="NIfTI does not tell in which axes vectors are"):
        vectors.to_nibabel()
    # The tumour moves by them.
    at = SimpleITK.Resample(
        SimpleITK.Cast(vectors.to_sitk(), SimpleITK.sitkVectorFloat64), [2, 2, 2], SimpleITK.Transform(), SimpleITK.sitkLinear, CENTRE
    )
    np.testing.assert_allclose(at[0, 0, 0], finished.session.movement.displacement, atol=0.2)


def test_points_come_as_the_summary_tells_them(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("name,x,y,z\nclip,90.0,-246.0,-595.0\nbeside,-300,0,0\n")
    session = supine.Session(**values, carry={"points": (tmp_path / "p.csv",)})
    clip, beside = session.points
    assert clip.name == "clip" and clip.before == (90.0, -246.0, -595.0) and clip.inside
    np.testing.assert_allclose(np.subtract(clip.after, clip.before), session.movement.displacement, atol=1.0)
    assert beside.after == beside.before and not beside.inside
    nipple, told = finished.session.nipple, finished.summary["nipple"]
    assert (nipple is None) == (told is None)
    if nipple is not None:
        assert list(nipple.after) == told["after_mm"] and nipple.inside
    assert finished.session.points == ()


def test_what_the_case_does_not_ask_for_is_none(finished: Finished) -> None:
    session = finished.session
    assert session.fit is session.evaluation is session.tissues is None
    assert session.carried.doses == session.carried.structures == session.carried.segments == ()


def test_what_scans_tell_is_a_value(values: dict[str, Any]) -> None:
    scans = {name: SCANS / f"{name}.ply" for name in ("sitting", "intraop")}
    # Few linear elements are too stiff where they bend: the fit takes that for a law of the tissue.
    mesh = {"tetrahedra": 1000, "order": 2}
    scans["landmarks"] = SCANS / "landmarks.json"
    session = supine.Session(**{**values, "region": None, "mesh": mesh}, scans=scans)
    fit, evaluation = session.fit, session.evaluation
    assert fit is not None and evaluation is not None
    best = fit["states"][0]
    low, high = best["interval_kpa"]
    assert low < best["young_kpa"] < high and {state["rest"] for state in fit["states"]} == {"net", "unloaded"}
    assert fit["laws"][0]["additions"] == []
    assert [surface["name"] for surface in evaluation["surfaces"]][0] == "ct"


def test_finer_tissues_are_labels(values: dict[str, Any]) -> None:
    session = supine.Session(**values, tissues=True)
    tissues, labels = session.tissues, session.labels
    assert tissues is not None and tissues.array.shape == labels.array.shape
    assert len(np.unique(tissues.array)) > len(np.unique(labels.array))
    assert np.array_equal(tissues.array == 0, labels.array == 0)


def test_own_objects_are_carried(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    of = SimpleITK.ReadImage(str(next((values["ct"]).iterdir())))
    write_dose(tmp_path / "dose.dcm", of, CENTRE)
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    heights = sorted(SimpleITK.ReadImage(str(file)).GetOrigin()[2] for file in values["ct"].iterdir())
    near = [z for z in heights if abs(z - CENTRE[2]) < 9.0]
    rings = [np.stack([CENTRE[0] + 9 * np.cos(turn), CENTRE[1] + 9 * np.sin(turn), np.full(40, z)], -1) for z in near]
    write_structures(tmp_path / "structures.dcm", of, "Boost", rings)
    carry = {
        "dose": tmp_path / "dose.dcm",
        "structures": tmp_path / "structures.dcm",
        "segmentation": finished.out / "labels.dcm",
    }
    session = supine.Session(**values, carry=carry)
    carried, movement = session.carried, session.movement
    (dose,), (boost,) = carried.doses, carried.structures
    assert dose.file == "dose.dcm" and dose.before.array.max() == pytest.approx(20.0, abs=0.5)
    assert dose.after.array.shape == dose.before.array.shape and not np.array_equal(dose.after.array, dose.before.array)
    assert (boost.file, boost.name) == ("structures.dcm", "Boost") and len(boost.before) == len(near)
    np.testing.assert_allclose(boost.before[0], rings[0], atol=1e-3)
    means = [np.concatenate(rings).mean(axis=0) for rings in (boost.before, boost.after)]
    np.testing.assert_allclose(means[1] - means[0], movement.displacement, atol=2.0)
    assert boost.volume[1] == pytest.approx(boost.volume[0], rel=0.3)
    assert [segment.file for segment in carried.segments] == ["labels.dcm"] * len(carried.segments)
    for segment in carried.segments:
        assert segment.after.array.dtype == np.bool_ and segment.after.array.shape == session.ct.array.shape
        assert np.array_equal(SimpleITK.GetArrayFromImage(segment.after.to_sitk()), segment.after.array)
    # The shared memory outlives the session.
    total = float(dose.after.array.sum())
    del session
    assert float(dose.after.array.sum()) == total > 0.0


def test_a_run_that_rests_on_labels_of_ones_own_tells_of_them(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    labels, out = finished.session.labels, tmp_path / "run"
    array = np.array(labels.array)
    array[0][array[0] == 1] = 0
    session = supine.Session(**values, labels=array, export={"clock": "2026-03-01 12:00:00"})
    case = session.case
    summary = session.run(out)
    file = out / "own_labels.nrrd"
    assert np.array_equal(SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(file))), array)
    assert Path(summary["case"]["labels"]["file"]) == file
    (told,) = [given for given in summary["inputs"] if given["role"] == "labels"]
    assert told["blake3"] and {warning["code"] for warning in summary["warnings"]} >= {"labels-uncertainty-unknown"}
    written = SimpleITK.GetArrayFromImage(SimpleITK.ReadImage(str(out / "labels.seg.nrrd")))
    assert np.array_equal(written, array) and session.verdict == summary["verdict"]
    # The session is as it was, and agrees with the folder.
    assert session.given == ("segment",) and session.case == case
    assert session.movement.distance == summary["tumour"]["distance_mm"]
    # The run can be repeated from its summary, and again into the same folder.
    again = supine.Session.read(out / "summary.json")
    assert again.given == () and np.array_equal(again.labels.array, array)
    written_at = (out / "mesh" / "rest.vtu").stat().st_mtime_ns
    assert session.run(out)["tumour"] == summary["tumour"]
    assert (out / "mesh" / "rest.vtu").stat().st_mtime_ns == written_at


def test_a_file_of_the_users_own_is_not_written_over_by_labels(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    mine = tmp_path / "run" / "own_labels.nrrd"
    mine.parent.mkdir()
    mine.write_text("mine")
    session = supine.Session(**values, labels=finished.session.labels)
    with pytest.raises(supine.SupineError, match="was not made by a run"):
        session.run(mine.parent)
    assert mine.read_text() == "mine"


def test_a_run_that_cannot_tell_what_it_rests_on_is_refused(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    given = supine.Session(**values, labels=finished.session.labels)
    given.mesh = finished.session.mesh
    with pytest.raises(supine.SupineError) as told:
        given.run(tmp_path / "run")
    assert told.value.code == "result-given" and "save what was given to a file" in told.value.message
    assert not (tmp_path / "run" / "summary.json").exists()


def test_meshes_and_displacements_come_from_files(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    session, folder = finished.session, finished.out / "mesh"
    given = supine.Session(**values)
    for path in (folder / "rest.vtu", str(folder / "rest.vtu"), folder / "deformed.vtu", supine.Mesh.read(folder / "rest.vtu")):
        given.mesh = path
        assert given.given == ("mesh",) and np.array_equal(given.mesh.points, session.mesh.points)
        assert np.array_equal(given.mesh.tags, session.mesh.tags)
        del given.mesh
    for moved in (folder / "deformed.vtu", supine.Deformation.read(folder / "deformed.vtu")):
        given.deformation = moved
        assert given.given == ("mesh", "solve")
        np.testing.assert_allclose(given.deformation.displacement, session.deformation.displacement, atol=1e-9)
        del given.deformation
    # What VTK writes is read too, and a grid in memory is told how to go.
    grid = pyvista.read(folder / "rest.vtu")
    grid.save(tmp_path / "theirs.vtu")
    given.mesh = tmp_path / "theirs.vtu"
    np.testing.assert_allclose(given.mesh.points, session.mesh.points, atol=1e-9)
    with pytest.raises(TypeError, match="can be saved as .vtu and given by its path"):
        given.mesh = grid
    with pytest.raises(TypeError, match="a displacement is a supine.Deformation, or the path"):
        given.deformation = session.mesh  # type: ignore[assignment]


def test_files_that_hold_no_mesh_say_why(values: dict[str, Any], finished: Finished, tmp_path: Path) -> None:
    given = supine.Session(**values)
    (tmp_path / "text.vtu").write_text("no mesh")
    session = finished.session
    session.mesh.to_pyvista().save(tmp_path / "untagged.vtu")
    for name, words in [("nowhere.vtu", "nowhere.vtu"), ("text.vtu", "text.vtu"), ("untagged.vtu", "boundary")]:
        with pytest.raises(supine.SupineError, match=words):
            given.mesh = tmp_path / name
    with pytest.raises(supine.SupineError, match="displacement"):
        given.deformation = finished.out / "mesh" / "rest.vtu"
    assert given.given == () and json.dumps(given.case)
