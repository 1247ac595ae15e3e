"""What may be given, in which forms, and what is refused in words."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import SimpleITK
from conftest import Finished

import supine

pytestmark = pytest.mark.filterwarnings("ignore::supine.SupineWarning")
FORMS = (list, tuple, np.asarray)
CENTRE = (91.37, -248.09, -594.5)


@pytest.fixture(scope="module")
def session(finished: Finished) -> supine.Session:
    """One that has everything."""
    return finished.session


@pytest.mark.parametrize("form", FORMS)
def test_numbers_come_in_sequences_of_any_kind(form: Callable[[Any], Any]) -> None:
    session = supine.Session(
        tumour={"centre": form(CENTRE), "radius": 9},
        region={"centre": form([91, -235, -594]), "radius": np.float32(45.0)},
        tissue={"young_interval": form([0.3, 2.0])},
        seeds={"chest_wall": form([form([1.0, 2.0, 3.0]), form([4.0, 5.0, 6.0])])},
    )
    case = session.case
    assert case["tumour"]["centre"] == list(CENTRE) and case["region"]["centre"] == [91.0, -235.0, -594.0]
    assert case["tissue"]["young_interval"] == [0.3, 2.0]
    assert case["seeds"]["chest_wall"] == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]


@pytest.mark.parametrize("form", (list, tuple))
def test_names_and_files_come_in_sequences_of_any_kind(form: Callable[[Any], Any]) -> None:
    strokes = form([{"tissue": "erase", "points": form([form((1.0, 2.0, 3.0))]), "radius": 3.0}])
    session = supine.Session(exclude=form(["a", "b"]), carry={"dose": form([Path("a.dcm"), "b.dcm"])}, seeds={"strokes": strokes})
    assert session.case["exclude"] == ["a", "b"] and session.case["carry"]["dose"] == ["a.dcm", "b.dcm"]
    assert session.case["seeds"]["strokes"][0]["points"] == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize("form", FORMS)
def test_volumes_lie_where_sequences_of_any_kind_say(values: dict[str, Any], session: supine.Session, form: Callable[[Any], Any]) -> None:
    ct = session.ct
    assert all(isinstance(of, tuple) for of in (ct.origin, ct.spacing, ct.direction, *ct.direction, session.region[0]))
    rows = form([form(row) for row in ct.direction])
    given = supine.Session(**{**values, "ct": supine.Volume(ct.array, form(ct.origin), form(ct.spacing), rows)}).ct
    assert (given.origin, given.spacing, given.direction) == (ct.origin, ct.spacing, ct.direction)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"table": {"ap": float("nan")}}, "table.ap"),
        ({"table": {"ap": np.float32("inf")}}, "table.ap"),
        ({"table": {"ap": 10**400}}, "table.ap"),
        ({"tumour": {"centre": (1.0, float("inf"), 3.0)}}, "tumour.centre"),
        ({"tumour": {"centre": np.array([1.0, np.nan, 3.0])}}, "tumour.centre"),
        ({"seeds": {"chest_wall": np.full((2, 3), np.nan)}}, "seeds.chest_wall"),
        ({"tissue": {"young_interval": (0.3, float("inf"))}}, "tissue.young_interval"),
        ({"series": float("nan")}, "series"),
    ],
)
def test_numbers_of_a_case_are_finite(values: dict[str, Any], change: dict[str, Any], key: str) -> None:
    session = supine.Session(**values)
    for take in (supine.Session, session.set):
        with pytest.raises(supine.SupineError, match=f"`{key}`: .* is not a finite number; leave the key out") as told:
            take(**change)
        assert (told.value.code, told.value.kind, told.value.place) == ("case-value", "input", {"key": key})


@pytest.mark.parametrize("wrong", [object(), {1, 2}, b"ct", "name\udc80"])
def test_what_is_no_value_of_a_case_is_told_with_its_key(wrong: Any) -> None:
    with pytest.raises(supine.SupineError, match="`series`: ") as told:
        supine.Session(series=wrong)
    assert told.value.code == "case-value"


@pytest.mark.parametrize("threads", [0, -1, 2.5, 2.0, True, "2", 2000, float("nan")])
def test_threads_are_a_number_of_them(values: dict[str, Any], tmp_path: Path, threads: Any) -> None:
    words = "threads is a whole number from 1 to 1024, not .*; leave it out for all cores"
    case = tmp_path / "case.toml"
    case.write_text('breast = "left"\n')
    for make in (lambda: supine.Session(**values, threads=threads), lambda: supine.Session.read(case, threads=threads)):
        with pytest.raises((TypeError, ValueError), match=words):
            make()


def test_arrays_hold_what_the_flow_can_hold(values: dict[str, Any], session: supine.Session) -> None:
    given, ct, labels, mesh = supine.Session(**values), session.ct, session.labels, session.mesh
    moved = session.deformation.displacement

    def with_one(array: Any, value: float) -> Any:
        other = np.array(array, dtype=np.float64)
        other[tuple(0 for _ in other.shape)] = value
        return other

    def mesh_of(**change: Any) -> supine.Mesh:
        arrays = {"points": mesh.points, "tets": mesh.tets, "faces": mesh.faces, "tags": mesh.tags}
        return supine.Mesh(**{**arrays, **change})

    for name, wrong, words in [
        ("ct", supine.Volume(with_one(ct.array, np.nan)), r"1 are NaN or infinite, the first at \[0, 0, 0\]"),
        ("ct", supine.Volume(with_one(ct.array, 40000)), "from -32768 to 32767, and 40000 is none: round it"),
        ("ct", supine.Volume(ct.array.astype(str)), "HU of a CT are numbers, not of the type"),
        ("ct", supine.Volume(ct.array, direction=(1, 0, 0, 0, 1, 0, 0, 0, 1)), "direction of a volume is three rows"),  # type: ignore[arg-type]
        ("ct", supine.Volume(ct.array, origin=(1.0, 2.0)), "origin of a volume is three numbers"),  # type: ignore[arg-type]
        ("labels", supine.Volume(with_one(labels.array, np.inf)), "labels are finite numbers"),
        ("labels", supine.Volume(with_one(labels.array, 0.5)), "labels are whole numbers from 0 to 10, and 0.5 is none"),
        ("labels", supine.Volume(with_one(labels.array, 42)), "from 0 to 10, and 42 is none"),
        ("labels", supine.Volume(with_one(labels.array, -1)), "from 0 to 10, and -1 is none"),
        ("mesh", mesh_of(points=with_one(mesh.points, np.nan)), "points of a mesh are finite numbers"),
        ("mesh", mesh_of(tets=with_one(mesh.tets, -1)), "tetrahedra of a mesh are whole numbers from 0"),
        ("mesh", mesh_of(tets=with_one(mesh.tets, 1.5)), "and 1.5 is none"),
        ("mesh", mesh_of(tags=np.full(len(mesh.tags), 257)), "tags of a mesh are whole numbers from 0 to 255"),
        ("mesh", mesh_of(points=mesh.points.ravel()), "points of a mesh are an array of 2 dimensions"),
        ("deformation", supine.Deformation(mesh, with_one(moved, np.nan), 1), "vectors of a displacement are finite numbers"),
    ]:
        with pytest.raises(ValueError, match=words):
            setattr(given, name, wrong)
    with pytest.raises(supine.SupineError, match="origin .* is not finite"):
        given.ct = supine.Volume(ct.array, origin=(0.0, 0.0, float("nan")))
    assert given.given == ()


def test_a_slip_in_a_name_is_told_with_what_was_meant(session: supine.Session) -> None:
    whole = session.case
    for name, words in [
        ("tumor", "did you mean `tumour`"),
        ("lables", "did you mean `labels`"),
        ("tumour", r"change it by session.set\(tumour=...\)"),
        ("breast", r"change it by session.set\(breast=...\)"),
        ("verdict", "cannot be set"),
        ("run", "cannot be set"),
        ("nothing_like_it", "no attribute `nothing_like_it`"),
    ]:
        with pytest.raises(AttributeError, match=words):
            setattr(session, name, 3)
    with pytest.raises(TypeError, match="cannot be called"):
        session.progress = 3  # type: ignore[assignment]
    for keyword, meant in [("theads", "threads"), ("progres", "progress"), ("fodler", "folder"), ("tumor", "tumour")]:
        with pytest.raises(supine.SupineError, match=f"unknown key `{keyword}`: did you mean `{meant}`"):
            supine.Session(**{keyword: 1})
    assert session.case == whole


def test_a_case_is_changed_by_its_session_alone(session: supine.Session) -> None:
    case: Any = session.case
    for change in (
        lambda: case.__setitem__("table", 3),
        lambda: case["table"].__setitem__("app", 3),
        lambda: case["table"].update(ap=3),
        lambda: case.__delitem__("table"),
        lambda: setattr(case, "table", 3),
    ):
        with pytest.raises(TypeError, match=r"by session.set\(...\)"):
            change()
    with pytest.raises(AttributeError, match=r"write case\['table'\]"):
        case.table.app = 3
    with pytest.raises(AttributeError, match="did you mean `table`"):
        case.tabel
    for own in (copy.deepcopy(case), pickle.loads(pickle.dumps(case))):
        own["table"]["ap"] = 3
        assert own != case and type(own) is dict
    assert supine.Session(**case).case == case


def test_values_say_how_others_of_them_are_made(session: supine.Session) -> None:
    for value, name, words in [
        (session.ct, "spaceing", "a Volume has no attribute `spaceing`: did you mean `spacing`"),
        (session.ct, "spacing", r"make another, dataclasses.replace\(it, spacing=...\)"),
        (session.movement, "distanc", "did you mean `distance`"),
    ]:
        with pytest.raises(AttributeError, match=words):
            setattr(value, name, 3)


def test_a_session_is_not_copied_and_its_results_are(session: supine.Session, values: dict[str, Any]) -> None:
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match=r"cannot be copied or pickled: make another .* supine.Session\(\*\*session.case\)"):
            make(session)
    volume, deformation = session.labels, session.deformation
    for again in (copy.copy(volume), copy.deepcopy(volume), pickle.loads(pickle.dumps(volume))):
        assert np.array_equal(again.array, volume.array) and again.origin == volume.origin
    for other in (copy.copy(deformation), copy.deepcopy(deformation), pickle.loads(pickle.dumps(deformation))):
        assert np.array_equal(other.displacement, deformation.displacement)
        assert np.array_equal(other.mesh.faces, deformation.mesh.faces)
    fields = pickle.loads(pickle.dumps(session.fields))
    assert np.array_equal(fields.jacobian.array, session.fields.jacobian.array)
    # What comes back is as good as what went.
    given = supine.Session(**values, labels=pickle.loads(pickle.dumps(volume)))
    assert np.array_equal(given.labels.array, volume.array)
    for tumour in (session.tumour, session.movement):
        assert copy.copy(tumour) == copy.deepcopy(tumour) == pickle.loads(pickle.dumps(tumour)) == tumour


FORK = """
import os, supine
session = supine.Session(breast="left")
child = os.fork()
if child == 0:
    try:
        session.labels
    except RuntimeError as error:
        print(error, flush=True)
    os._exit(0)
os.waitpid(child, 0)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
def test_a_session_is_not_waited_for_in_a_forked_process() -> None:
    """As multiprocessing forks them: the threads of the session stay behind."""
    done = subprocess.run([sys.executable, "-c", FORK], capture_output=True, encoding="utf-8", timeout=300)
    assert "hand session.case over, and make another there, supine.Session(**case)" in done.stdout, done.stderr


def test_an_image_may_go_before_its_volume() -> None:
    volume = supine.Volume.from_sitk(SimpleITK.Image([64, 64, 64], SimpleITK.sitkInt16) + 7)
    others = [SimpleITK.Image([64, 64, 64], SimpleITK.sitkInt16) + n for n in range(4)]
    assert (volume.array == 7).all() and len(others) == 4


def test_labels_and_ct_come_as_images_of_other_libraries(values: dict[str, Any], session: supine.Session) -> None:
    labels, given = session.labels, supine.Session(**values)
    nifti = labels.to_nibabel()
    for image in (
        labels.to_sitk(),
        SimpleITK.Cast(labels.to_sitk(), SimpleITK.sitkFloat64),
        nifti,
        nibabel.as_closest_canonical(nifti),
        nibabel.Nifti1Image(np.asarray(nifti.dataobj)[..., None].astype(np.float32), nifti.affine),
        labels.array,
        labels.array.astype(float),
    ):
        given.labels = image
        assert given.given == ("segment",) and np.array_equal(given.labels.array, labels.array)
        del given.labels
    for ct in (session.ct.to_sitk(), session.ct.to_nibabel()):
        taken = supine.Session(**{**values, "ct": ct})
        assert taken.given == ("import",) and np.array_equal(taken.ct.array, session.ct.array)
        np.testing.assert_allclose(taken.ct.affine, session.ct.affine, atol=1e-5)
    given = supine.Session(**values, labels=labels.array)
    assert np.array_equal(given.labels.array, labels.array)
    given.set(labels=None)
    assert given.given == ()


def test_images_that_do_not_say_where_they_lie_are_refused(values: dict[str, Any], session: supine.Session) -> None:
    given, array = supine.Session(**values), session.labels.array
    nameless = nibabel.Nifti1Image(array.T, None)
    metres = session.labels.to_nibabel()
    metres.header.set_xyzt_units("meter")
    mirrored = session.labels.to_nibabel()
    mirrored.set_qform(mirrored.affine @ np.diag([-1.0, 1.0, 1.0, 1.0]), code=1)

    class Image:
        """As ITK has them."""

        GetSpacing = GetOrigin = GetDirection = None

    for wrong, error, words in [
        (nameless, ValueError, "does not say which way its axes point"),
        (metres, ValueError, "is in meters: give it one in mm"),
        (mirrored, ValueError, "sform and qform of the image contradict"),
        (nibabel.Nifti1Image(np.zeros((3, 4, 5, 2), np.uint8), np.eye(4)), ValueError, r"shape \(3, 4, 5, 2\)"),
        (SimpleITK.Image([4, 4], SimpleITK.sitkUInt8), ValueError, "2 dimensions and 1 numbers"),
        (SimpleITK.Image([4, 4, 4], SimpleITK.sitkVectorUInt8, 3), ValueError, "3 dimensions and 3 numbers"),
        (array.transpose(2, 1, 0), ValueError, r"indexed \[k, j, i\], .*: transpose it"),
        (array[1:], ValueError, "for another grid give a supine.Volume"),
        (Image(), TypeError, r"is not known: give supine.Volume\(array, origin, spacing, direction\)"),
        ("labels.nrrd", TypeError, r"a file is named by session.set\(labels=...\)"),
        (3, TypeError, "an image of SimpleITK or nibabel, not a int"),
    ]:
        with pytest.raises(error, match=words):
            given.labels = wrong
    with pytest.raises(TypeError, match="does not say where its voxels lie"):
        given.ct = session.ct.array  # type: ignore[assignment]
    assert given.given == ()
