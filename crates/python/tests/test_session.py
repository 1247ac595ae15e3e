"""The package as users install it: values, changes, what they give themselves, and the command line's bytes."""

from __future__ import annotations

import json
import subprocess
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK
from conftest import Finished

import supine

warnings.simplefilter("ignore", supine.SupineWarning)


@pytest.fixture(scope="module")
def session(finished: Finished) -> supine.Session:
    """One that has everything."""
    return finished.session


def series(folder: Path) -> SimpleITK.Image:
    reader = SimpleITK.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


def same_place(ours: supine.Volume, image: SimpleITK.Image) -> None:
    np.testing.assert_allclose(ours.origin, image.GetOrigin(), atol=1e-6)
    np.testing.assert_allclose(ours.spacing, image.GetSpacing(), atol=1e-9)
    np.testing.assert_allclose(np.ravel(ours.direction), image.GetDirection(), atol=1e-12)


def test_a_series_is_read_as_simpleitk_reads_it(original: Path) -> None:
    ours, image = supine.read_ct(original), series(original)
    assert np.array_equal(ours.array, SimpleITK.GetArrayFromImage(image))
    assert ours.array.dtype == np.int16
    same_place(ours, image)


def test_arrays_share_the_sessions_memory_and_cannot_be_changed(session: supine.Session) -> None:
    mesh, deformation = session.mesh, session.deformation
    arrays = {
        "ct": lambda: session.ct.array,
        "labels": lambda: session.labels.array,
        "deformed": lambda: session.deformed_ct.array,
        "points": lambda: session.mesh.points,
        "tets": lambda: session.mesh.tets,
        "displacement": lambda: session.deformation.displacement,
    }
    for name, get in arrays.items():
        one, other = get(), get()
        assert not one.flags.owndata and one.flags.c_contiguous, name
        assert one.ctypes.data == other.ctypes.data, f"{name} was copied"
        with pytest.raises(ValueError):
            one[:] = 0
    assert mesh.points.shape[1:] == (3,) and mesh.tets.shape[1:] == (4,)
    assert set(mesh.tags) == {1, 2, 3} and len(mesh.tags) == len(mesh.faces)
    assert np.array_equal(deformation.mesh.tets, mesh.tets)
    assert deformation.order == 1 and len(deformation.displacement) == len(mesh.points)
    volume = np.linalg.det(mesh.points[mesh.tets[:, 1:]] - mesh.points[mesh.tets[:, :1]]) / 6
    assert (volume > 0).all()


def test_arrays_outlive_their_session(values: dict[str, Any]) -> None:
    session = supine.Session(**values)
    labels = session.labels.array
    sums = int(labels.sum())
    del session
    assert int(labels.sum()) == sums > 0


def test_the_tumours_way_says_how_sure_it_is(session: supine.Session) -> None:
    tumour = session.tumour
    np.testing.assert_allclose(
        np.subtract(tumour.after, tumour.before), tumour.displacement, atol=1e-9
    )
    assert tumour.interval is not None and tumour.interval.young_origin == "literature"
    low, high = tumour.interval.length
    assert low < tumour.distance < high and "95 %" in str(tumour)
    assert session.movement.displacement == tumour.displacement
    assert session.movement.interval is None


def test_the_same_bytes_as_the_command_line(
    finished: Finished, folder: Path, binary: str, tmp_path: Path
) -> None:
    session, summary, ours = finished
    case = tmp_path / "case.toml"
    case.write_text(
        f'ct = "{folder / "ct"}"\nbreast = "left"\ntable = {{ ap = 7.0, lat = 5.0 }}\n'
        "tumour = { centre = [91.37, -248.09, -594.5], radius = 9.0 }\n"
        "region = { centre = [91.0, -235.0, -594.5], radius = 45.0 }\n"
        "mesh = { tetrahedra = 500, order = 1 }\nexport = { clock = '2026-03-01 12:00:00' }\n"
    )
    done = subprocess.run([binary, "run", case, "--out", tmp_path / "theirs", "--json"], capture_output=True)
    assert done.returncode in (0, 4), done.stderr.decode()
    theirs = tmp_path / "theirs"
    assert summary["verdict"] == json.loads(done.stdout)["verdict"]
    files = {p.relative_to(theirs) for p in theirs.rglob("*") if p.is_file()}
    assert files == {p.relative_to(ours) for p in ours.rglob("*") if p.is_file()}
    for file in sorted(files):
        if file.parts[0] == ".stages" or file.name == "log.jsonl":
            continue  # They tell when and how long.
        one, other = ours / file, theirs / file
        if file.name == "summary.json":
            told = [json.loads(path.read_text(encoding="utf-8")) for path in (one, other)]
            [of.pop("run") for of in told]
            assert told[0] == told[1]
        else:
            assert one.read_bytes() == other.read_bytes(), file
    image = series(ours / "ct")
    assert np.array_equal(SimpleITK.GetArrayFromImage(image), session.deformed_ct.array)
    same_place(session.deformed_ct, image)


def test_a_changed_session_equals_a_new_one(values: dict[str, Any]) -> None:
    session = supine.Session(**values)
    before = session.deformed_ct.array
    stale = session.set(table={"ap": 20.0})
    assert "solve" in stale and "segment" not in stale and "mesh" not in stale
    assert session.case["table"] == {"ap": 20.0, "lat": 5.0}
    after = session.deformed_ct.array
    anew = supine.Session(**{**values, "table": {"ap": 20.0, "lat": 5.0}})
    assert np.array_equal(after, anew.deformed_ct.array)
    assert not np.array_equal(after, before)
    assert session.movement == anew.movement


def test_a_case_file_is_a_session_too(folder: Path, values: dict[str, Any], session: supine.Session) -> None:
    case = folder / "case.toml"
    case.write_text('ct = "ct"\nbreast = "left"\ntable = { ap = 7.0, lat = 5.0 }\n')
    rest = {key: values[key] for key in ("tumour", "region", "mesh")}
    read = supine.Session.read(case, **rest)
    assert np.array_equal(read.deformation.displacement, session.deformation.displacement)


def test_what_one_session_made_another_takes(values: dict[str, Any], session: supine.Session) -> None:
    memory = supine.Session(**{**values, "ct": session.ct})
    assert memory.given == ("import",)
    assert np.array_equal(memory.labels.array, session.labels.array)
    assert np.array_equal(memory.deformed_ct.array, session.deformed_ct.array)

    # Labels are voxels; the surfaces between them, which the mesher prefers, are not known of them.
    labels = session.labels
    labelled = supine.Session(**values, labels=labels)
    assert np.array_equal(labelled.labels.array, labels.array)
    assert abs(len(labelled.mesh.tets) - 500) < 100
    assert np.linalg.norm(np.subtract(labelled.movement.after, session.movement.after)) < 0.5

    meshed = supine.Session(**values)
    meshed.mesh = session.mesh
    assert np.array_equal(meshed.deformation.displacement, session.deformation.displacement)
    assert np.array_equal(meshed.deformed_ct.array, session.deformed_ct.array)

    moved = supine.Session(**values)
    moved.deformation = session.deformation
    assert moved.given == ("mesh", "solve")
    assert np.array_equal(moved.deformed_ct.array, session.deformed_ct.array)
    shift = np.zeros_like(session.deformation.displacement)
    moved.deformation = supine.Deformation(session.mesh, shift, 1)
    assert moved.movement.distance == 0.0
    del moved.deformation
    assert moved.given == () and moved.movement == session.movement


def test_what_cannot_be_taken_says_why(values: dict[str, Any], session: supine.Session) -> None:
    given = supine.Session(**values)
    labels = session.labels
    with pytest.raises(supine.SupineError) as told:
        beside = tuple(x + 0.4 * step for x, step in zip(labels.origin, labels.spacing))
        given.labels = supine.Volume(labels.array, beside, labels.spacing, labels.direction)
    assert told.value.code == "labels-unusable" and told.value.place == {"key": "labels.file"}
    mesh = session.mesh
    with pytest.raises(supine.SupineError, match="flat or inverted") as told:
        given.mesh = supine.Mesh(mesh.points, mesh.tets[:, [1, 0, 2, 3]], mesh.faces, mesh.tags)
    with pytest.raises(supine.SupineError, match="other shapes"):
        given.mesh = supine.Mesh(mesh.points, mesh.tets, mesh.faces, mesh.tags[1:])
    with pytest.raises(supine.SupineError, match="tag 7"):
        given.mesh = supine.Mesh(mesh.points, mesh.tets, mesh.faces, np.full_like(mesh.tags, 7))
    with pytest.raises(supine.SupineError, match="fit neither"):
        given.deformation = supine.Deformation(mesh, np.zeros((3, 3)), 1)
    with pytest.raises(supine.SupineError, match="spacing"):
        given.ct = supine.Volume(session.ct.array, spacing=(1.0, 1.0, 0.0))
    with pytest.raises(ValueError, match="round it"):
        given.ct = supine.Volume(session.ct.array + 0.5)
    assert given.given == ()


def test_an_own_mesh_lies_in_the_tissue_or_is_refused_with_the_reading_that_fits(
    session: supine.Session, values: dict[str, Any]
) -> None:
    taking, mesh = supine.Session(**values), session.mesh
    for factors, hint in (((-1, -1, 1), "if it is in RAS"), (0.001, "if it is in metres"), (0.1, "in centimetres")):
        with pytest.raises(supine.SupineError, match=hint):
            taking.mesh = supine.Mesh(mesh.points * factors, mesh.tets, mesh.faces, mesh.tags)
    assert taking.given == ()
    beside = mesh.points + (0, -12, 0)
    with pytest.warns(supine.SupineWarning, match="of the given mesh lie in the soft tissue"):
        taking.mesh = supine.Mesh(beside, mesh.tets, mesh.faces, mesh.tags)


def test_an_own_displacement_is_in_its_order_unit_and_axes_or_that_is_said(
    session: supine.Session, values: dict[str, Any]
) -> None:
    quadratic = supine.Session(**{**values, "mesh": {"tetrahedra": 500, "order": 2}}).deformation
    taking, mesh, right = supine.Session(**values), quadratic.mesh, quadratic.displacement
    count = len(mesh.points)
    # In the order in which a file of quadratic tetrahedra has them: those of the first tetrahedron first.
    ends = np.sort(mesh.tets[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]].reshape(-1, 2), axis=1)
    unique, first = np.unique(ends, axis=0, return_index=True)
    assert len(unique) == len(right) - count
    other = np.concatenate([right[:count], right[count:][np.argsort(first)]])
    with pytest.raises(supine.SupineError, match="sorted by the edge's"):
        taking.deformation = supine.Deformation(mesh, other, 2)
    with pytest.raises(ValueError, match="order is 1"):
        taking.deformation = supine.Deformation(mesh, right, 1)
    torn = np.zeros_like(mesh.points)
    torn[0] = 40.0
    with pytest.raises(supine.SupineError, match="inside out"):
        taking.deformation = supine.Deformation(mesh, torn, 1)
    assert taking.given == ()
    for wrong, said in ((0.001 * right, "not in metres"), (right * (-1, -1, 1), "is it in RAS?")):
        with pytest.warns(supine.SupineWarning, match=said):
            taking.deformation = supine.Deformation(mesh, wrong, 2)
    with warnings.catch_warnings():
        warnings.simplefilter("error", supine.SupineWarning)
        taking.deformation = quadratic
    assert np.array_equal(taking.deformation.displacement, right)
