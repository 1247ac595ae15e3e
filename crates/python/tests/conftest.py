"""The synthetic patient of the fixtures, made smaller: her middle slices, a small sphere, a coarse mesh."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[3]
CT = ROOT / "fixtures" / "patient" / "ct"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the CT in `ct`."""
    folder = tmp_path_factory.mktemp("patient")
    (folder / "ct").mkdir()
    for file in sorted(CT.iterdir())[26:70]:
        shutil.copy(file, folder / "ct" / file.name)
    return folder


@pytest.fixture(scope="session")
def values(folder: Path) -> dict[str, Any]:
    """The values of her case."""
    return {
        "ct": folder / "ct",
        "breast": "left",
        "bed": {"ap": 7.0, "lat": 5.0},
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
