"""Where the program and the fixture patient lie: `--supine` and `--patient`, or SUPINE and SUPINE_PATIENT."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from cohort import SLICES, Cohort, write_case

ROOT = Path(__file__).parents[3]


def pytest_addoption(parser):
    parser.addoption("--supine", default=os.environ.get("SUPINE", ROOT / "target/release/supine"))
    parser.addoption("--patient", default=os.environ.get("SUPINE_PATIENT", ROOT / "fixtures/patient"))


@pytest.fixture(scope="session")
def supine(request):
    """The program under test."""
    supine = Path(request.config.getoption("supine")).resolve()
    assert supine.is_file(), f"{supine} is not there: build it, or name another by --supine"
    return supine


@pytest.fixture(scope="session")
def ct(request, tmp_path_factory):
    """The CT of all patients."""
    folder = tmp_path_factory.mktemp("patient") / "ct"
    folder.mkdir()
    files = sorted((Path(request.config.getoption("patient")).resolve() / "ct").iterdir())
    for file in files[SLICES]:
        shutil.copy(file, folder)
    return folder


@pytest.fixture(scope="session")
def finished(supine, ct, tmp_path_factory):
    """The finished run of the case that all patients are made of, for looking alone."""
    folder = tmp_path_factory.mktemp("finished")
    write_case(folder, ct)
    subprocess.run([supine, "run", folder / "case.toml", "--out", folder / "run", "--threads", "1", "--quiet"], check=True)
    return folder / "run"


@pytest.fixture
def cohort(tmp_path, supine, ct, finished):
    """An empty cohort of the program under test."""
    return Cohort(tmp_path / "cohort", supine, ct, finished)
