"""The Python of docs/SCRIPTING.md runs as it stands, and so do the examples."""

from __future__ import annotations

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


def test_the_guide_runs_as_it_stands(folder: Path, values: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "SCRIPTING.md").read_text(encoding="utf-8"), re.S)
    assert len(blocks) >= 6
    (folder / "case.toml").write_text(
        'ct = "ct"\nbreast = "left"\nbed = { ap = 7.0, lat = 5.0 }\nregion = { centre = [91.0, -235.0, -594.5], radius = 45.0 }\n'
        "tumour = { centre = [91.37, -248.09, -594.5], radius = 9.0 }\nmesh = { tetrahedra = 500, order = 1 }\n"
    )
    monkeypatch.chdir(folder)
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
    assert names["summary"]["tumour"]["distance_mm"] > 0 and (folder / "result" / "summary.json").is_file()


@pytest.mark.parametrize("script", ["paper_figures.py", "sweep.py"])
def test_examples_tell_their_use(script: str) -> None:
    done = subprocess.run([sys.executable, EXAMPLES / script, "--help"], capture_output=True, text=True)
    assert done.returncode == 0 and "CT" in done.stdout, done.stderr
