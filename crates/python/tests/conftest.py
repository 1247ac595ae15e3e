"""The synthetic patient of the fixtures, made smaller: her middle slices with pixels three times as wide, a small sphere, a coarse
mesh; and one finished run of her case."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import SimpleITK

import supine

ROOT = Path(__file__).parents[3]
CT = ROOT / "fixtures" / "patient" / "ct"


def coarser(file: Path, to: Path) -> None:
    """Writes a slice whose pixels are the means of squares of three by three; all else that it tells stays."""
    image = SimpleITK.ReadImage(str(file))
    wider = SimpleITK.BinShrink(image, [3, 3, 1])
    for key in image.GetMetaDataKeys():
        wider.SetMetaData(key, image.GetMetaData(key))
    # What was told of the slice would count more than what the image knows.
    wider.SetMetaData("0020|0032", "\\".join(f"{x:.2f}" for x in wider.GetOrigin()))
    wider.SetMetaData("0028|0030", "\\".join(f"{x:.2f}" for x in wider.GetSpacing()[:2]))
    writer = SimpleITK.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    writer.SetImageIO("GDCMImageIO")
    writer.SetFileName(str(to))
    writer.Execute(wider)


@pytest.fixture(scope="session")
def original() -> Path:
    """The CT as it is, for looking alone."""
    return CT


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the CT in `ct`: 44 slices of 85 x 85."""
    folder = tmp_path_factory.mktemp("patient")
    (folder / "ct").mkdir()
    for file in sorted(CT.iterdir())[26:70]:
        coarser(file, folder / "ct" / f"{file.name}.dcm")
    return folder


@pytest.fixture(scope="session")
def values(folder: Path) -> dict[str, Any]:
    """The values of her case."""
    return {
        "ct": folder / "ct",
        "breast": "left",
        "table": {"ap": 7.0, "lat": 5.0},
        "tumour": {"centre": (91.37, -248.09, -594.5), "radius": 9.0},
        "region": {"centre": (91.0, -235.0, -594.5), "radius": 45.0},
        "mesh": {"tetrahedra": 500, "order": 1},
    }


@pytest.fixture(scope="session")
def binary() -> str:
    """The command line that the package is held against."""
    binary = os.environ.get("SUPINE")
    if binary is None:
        pytest.skip("SUPINE names no binary to hold the package against")
    return binary


class Finished(NamedTuple):
    """A finished run, for looking alone."""

    session: supine.Session
    summary: dict[str, Any]
    out: Path


@pytest.fixture(scope="session")
def finished(values: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """Her case at noon of 2026-03-01, run to its end by the package."""
    session = supine.Session(**values, export={"clock": "2026-03-01 12:00:00"})
    out = tmp_path_factory.mktemp("finished") / "run"
    return Finished(session, session.run(out), out)
