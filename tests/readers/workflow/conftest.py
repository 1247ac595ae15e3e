"""Where the program and the fixture patient lie: `--supine` and `--patient`, or SUPINE and SUPINE_PATIENT."""

import os
from pathlib import Path

import pytest
from cohort import Cohort

ROOT = Path(__file__).parents[3]


def pytest_addoption(parser):
    parser.addoption("--supine", default=os.environ.get("SUPINE", ROOT / "target/release/supine"))
    parser.addoption("--patient", default=os.environ.get("SUPINE_PATIENT", ROOT / "fixtures/patient"))


@pytest.fixture
def cohort(tmp_path, request):
    """An empty cohort of the program under test."""
    supine = Path(request.config.getoption("supine")).resolve()
    patient = Path(request.config.getoption("patient")).resolve()
    assert supine.is_file(), f"{supine} is not there: build it, or name another by --supine"
    return Cohort(tmp_path / "cohort", supine, patient / "ct")
