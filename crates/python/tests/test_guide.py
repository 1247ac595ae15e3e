"""The Python of docs/SCRIPTING.md runs as it stands, and so do the examples."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest

import supine

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "crates" / "python" / "examples"
CASE = (
    'ct = "ct"\nbreast = "left"\ntable = { ap = 7.0, lat = 5.0 }\nregion = { centre = [91.0, -235.0, -594.5], radius = 45.0 }\n'
    "tumour = { centre = [91.37, -248.09, -594.5], radius = 9.0 }\nmesh = { tetrahedra = 500, order = 1 }\n"
)


def test_the_guide_runs_as_it_stands(
    folder: Path, values: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "SCRIPTING.md").read_text(encoding="utf-8"), re.S)
    assert len(blocks) >= 6
    (tmp_path / "ct").symlink_to(folder / "ct")
    (tmp_path / "case.toml").write_text(CASE)
    monkeypatch.chdir(tmp_path)
    # The same Python on a small region, that it takes seconds.
    small = {key: values[key] for key in ("region", "mesh")}
    made = supine.Session.__init__

    def smaller(self: supine.Session, **given: Any) -> None:
        made(self, **{**small, **given})

    monkeypatch.setattr(supine.Session, "__init__", smaller)
    names: dict[str, Any] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", supine.SupineWarning)
        for block in blocks:
            exec(compile(block, "docs/SCRIPTING.md", "exec"), names)
    assert names["summary"]["tumour"]["distance_mm"] > 0
    assert json.loads((tmp_path / "result" / "summary.json").read_text(encoding="utf-8")) == names["summary"]


def in_shell(page: str, folder: Path, binary: str, smaller: str = "") -> None:
    """Runs the shell commands of a page as they stand, where `supine` is on the path; to a batch it adds what makes the cases
    smaller."""
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.S)
    assert blocks
    path = folder / "bin"
    path.mkdir()
    supine = f'"{Path(binary).resolve()}"'
    command = f'#!/bin/sh\n[ "$1" = batch ] && exec {supine} "$@" {smaller}\nexec {supine} "$@"\n'
    (path / "supine").write_text(command)
    (path / "supine").chmod(0o755)
    environment = {**os.environ, "PATH": f"{path}{os.pathsep}{os.environ['PATH']}"}
    for block in blocks:
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=folder, env=environment, capture_output=True, encoding="utf-8")
        assert done.returncode == 0, done.stderr


def test_the_commands_of_the_scripting_guide_run_as_they_stand(folder: Path, tmp_path: Path, binary: str) -> None:
    (tmp_path / "ct").symlink_to(folder / "ct")
    (tmp_path / "case.toml").write_text(CASE)
    in_shell("SCRIPTING.md", tmp_path, binary)
    result, told = (json.loads((tmp_path / name).read_text(encoding="utf-8")) for name in ("result.json", "tilted.json"))
    assert result == json.loads((tmp_path / "result" / "summary.json").read_text(encoding="utf-8"))
    assert told["exit"] == 0 and told["tumour"]["length_mm"] != result["tumour"]["distance_mm"]
    assert not (tmp_path / "meshed" / "ct").exists()


def test_the_commands_of_the_cohort_guide_lead_to_the_page(folder: Path, tmp_path: Path, binary: str) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ct").symlink_to(folder / "ct")
    in_shell("COHORTS.md", tmp_path, binary, "--set mesh.tetrahedra=500 --set mesh.order=1")
    ended = [json.loads(line) for line in (tmp_path / "ended.jsonl").read_text(encoding="utf-8").splitlines()]
    assert {status["case"] for status in ended} == {"p001", "p002"} and all(status["exit"] == 0 for status in ended)
    page = (tmp_path / "results" / "index.html").read_text(encoding="utf-8")
    assert "runs/p002/report/axial_after.png" in page


def test_the_example_draws_the_figures(folder: Path, tmp_path: Path) -> None:
    command = [sys.executable, EXAMPLES / "paper_figures.py", folder / "ct", tmp_path, "--tetrahedra", "300"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert done.returncode == 0 and " mm (95 %: " in done.stdout, done.stderr
    for name in ("model", "before_and_after", "tissue"):
        assert (tmp_path / f"{name}.png").stat().st_size > 20_000


def test_the_sweep_tells_its_use() -> None:
    done = subprocess.run([sys.executable, EXAMPLES / "sweep.py", "--help"], capture_output=True, encoding="utf-8")
    assert done.returncode == 0 and "CT" in done.stdout, done.stderr


def test_dask_runs_a_cohort_in_which_one_fails(folder: Path, tmp_path: Path, binary: str) -> None:
    (tmp_path / "ct").symlink_to(folder / "ct")
    (tmp_path / "good.toml").write_text(CASE)
    (tmp_path / "bad.toml").write_text(CASE.replace('ct = "ct"', 'ct = "nowhere"'))
    (tmp_path / "cases.csv").write_text("name,case\ngood,good.toml\nbad,bad.toml\n")
    script = ROOT / "workflow" / "examples" / "dask_cohort.py"
    command = [sys.executable, script, "cases.csv", "results"]
    # A minute, and much longer where the machine has other work.
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, encoding="utf-8", timeout=1500)
    assert done.returncode == 0, done.stderr
    ended = {told["case"]: told for told in map(json.loads, done.stdout.splitlines())}
    assert ended["good"]["colour"] == "amber" and ended["bad"]["code"] == "input-missing", ended
    assert "nowhere" in ended["bad"]["message"] and ended["bad"]["advice"]
    # A lone run is the same, and the table has her.
    run = [binary, "run", "good.toml", "--out", "alone", "--until", "solve", "--quiet"]
    subprocess.run(run, cwd=tmp_path, check=True)
    alone, by_dask = (tmp_path / out / "mesh" / "deformed.vtu" for out in ("alone", "results/runs/good"))
    assert alone.read_bytes() == by_dask.read_bytes()
    collect = [binary, "batch", "--collect", "--out", "results"]
    subprocess.run(collect, cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "results" / "cohort.csv").read_text(encoding="utf-8").count("\ngood,flagged,0,") == 1
