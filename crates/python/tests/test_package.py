"""What others make of the values, and the package's types."""

from __future__ import annotations

import inspect
import subprocess
import sys
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import pyvista
import write_parameters

import supine

HERE = Path(__file__).parent


@pytest.fixture
def volume() -> supine.Volume:
    turned = ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    # From air to bone: what a CT in one file has to hold.
    array = np.arange(-1000, 1400, 100, dtype=np.int16).reshape(2, 3, 4)
    return supine.Volume(array, (10.0, -20.0, 30.0), (0.5, 1.5, 2.5), turned)


def test_others_find_each_voxel_where_it_is(volume: supine.Volume) -> None:
    image, nifti, grid = volume.to_sitk(), volume.to_nibabel(), volume.to_pyvista()
    points = np.asarray(grid.points)
    for k, j, i in np.ndindex(2, 3, 4):
        lps = volume.affine @ (i, j, k, 1)
        np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((i, j, k)), lps[:3])
        np.testing.assert_allclose(nifti.affine @ (i, j, k, 1), lps * (-1, -1, 1, 1))
        assert image[i, j, k] == nifti.dataobj[i, j, k] == volume.array[k, j, i]
        n = i + 4 * (j + 3 * k)
        np.testing.assert_allclose(points[n], lps[:3], atol=1e-6)
        assert grid.point_data["values"][n] == volume.array[k, j, i]
    again = supine.Volume.from_sitk(image)
    assert np.array_equal(again.array, volume.array)
    assert (again.origin, again.spacing, again.direction) == (volume.origin, volume.spacing, volume.direction)


def test_nifti_files_read_back(volume: supine.Volume, tmp_path: Path) -> None:
    volume.to_nibabel().to_filename(tmp_path / "v.nii.gz")
    read = nibabel.load(tmp_path / "v.nii.gz")
    np.testing.assert_allclose(read.affine, np.diag([-1, -1, 1, 1]) @ volume.affine)
    ours = supine.read_ct(tmp_path / "v.nii.gz")
    assert np.array_equal(ours.array, volume.array)
    np.testing.assert_allclose(ours.affine, volume.affine, atol=1e-6)


def test_a_mesh_is_pyvistas(values: dict[str, Any]) -> None:
    deformation = supine.Session(**values).deformation
    grid = deformation.to_pyvista()
    assert isinstance(grid, pyvista.UnstructuredGrid) and grid.n_cells == len(deformation.mesh.tets)
    cells = grid.compute_cell_sizes(length=False, area=False)["Volume"]
    assert (cells > 0).all()
    warped = grid.warp_by_vector("displacement")
    np.testing.assert_allclose(warped.points, deformation.points, atol=1e-4)


def test_the_keywords_are_those_of_the_table() -> None:
    told = f"run {write_parameters.FILE.parents[2] / 'tests' / 'write_parameters.py'} again"
    assert write_parameters.FILE.read_text(encoding="utf-8") == write_parameters.main(), told


@pytest.fixture(scope="session")
def mypy() -> list[str]:
    """The checker of types. What it finds of numpy and others, half a minute's work, stays with the environment they are in."""
    cache = Path(sys.prefix) / "mypy"
    return [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(cache), "--config-file", str(HERE.parent / "pyproject.toml")]


def test_types_hold(mypy: list[str]) -> None:
    own = [HERE.parent / "python" / "supine", HERE.parent / "examples"]
    done = subprocess.run([*mypy, *own], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def functions(of: object) -> Iterator[Any]:
    """All that a class has of its own and that can be called, or a function."""
    for member in vars(of).values() if inspect.isclass(of) else [of]:
        found = [member.fget, member.fset, member.fdel] if isinstance(member, property) else [getattr(member, "__func__", member)]
        yield from filter(inspect.isfunction, found)


def test_hints_of_types_can_be_read() -> None:
    """As pydantic, typeguard and documentation do."""
    seen = 0
    for name in supine.__all__:
        public = getattr(supine, name)
        for of in functions(public):
            seen += len(typing.get_type_hints(of))
        if inspect.isclass(public):
            seen += len(typing.get_type_hints(public))
    assert seen > 100
    hints = typing.get_type_hints(supine.Session.mesh.fget)
    assert hints == {"return": supine.Mesh}
    (values,) = typing.get_args(typing.get_type_hints(supine.Session.__init__)["values"])
    assert typing.get_type_hints(values)["breast"] == typing.Literal["left", "right"] | None
    assert all(typing.get_type_hints(table) for table in vars(sys.modules[values.__module__]).values() if typing.is_typeddict(table))


WITHOUT_OTHERS = """
import sys
for name in ("nibabel", "pyvista", "SimpleITK"):
    sys.modules[name] = None
import typing, supine
assert "numpy" not in sys.modules
print(typing.get_type_hints(supine.Volume.to_sitk), typing.get_type_hints(supine.Session.labels.fset))
"""


def test_hints_need_none_of_the_libraries_that_one_may_do_without() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT_OTHERS], capture_output=True, text=True)
    assert done.returncode == 0 and "Any" in done.stdout, done.stderr


WRONG = """
import supine
session = supine.Session(breast="lft")
session.mesh.points + "a"
supine.Session(table={"app": 1.0})
"""


def test_types_find_a_typo(mypy: list[str], tmp_path: Path) -> None:
    (tmp_path / "wrong.py").write_text(WRONG)
    done = subprocess.run([*mypy, tmp_path / "wrong.py"], capture_output=True, text=True)
    assert done.returncode == 1 and done.stdout.count("error:") == 3, done.stdout
