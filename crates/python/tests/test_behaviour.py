"""Errors, warnings, progress, Ctrl-C, threads."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import supine


@pytest.mark.parametrize(
    ("change", "code", "place", "words"),
    [
        ({"brest": "left"}, "case-key-unknown", {}, "did you mean `breast`?"),
        ({"table": {"app": 1.0}}, "case-key-unknown", {}, "did you mean `table.ap`?"),
        ({"table": {"ap": "steep"}}, "case-value", {"key": "table.ap"}, "steep"),
        ({"table": {"ap": 700.0}}, "case-value", {"key": "table.ap"}, "700"),
        ({"breast": "lft"}, "case-value", {"key": "breast"}, "lft"),
    ],
)
def test_a_typo_is_told_as_the_command_line_tells_it(
    values: dict[str, Any], change: dict[str, Any], code: str, place: dict[str, str], words: str
) -> None:
    with pytest.raises(supine.SupineError) as told:
        supine.Session(**{**values, **change})
    assert (told.value.code, told.value.kind, told.value.exit) == (code, "input", 1)
    assert told.value.place == place and words in told.value.message


def test_a_refused_change_changes_nothing(values: dict[str, Any]) -> None:
    session = supine.Session(**values)
    before = session.case
    with pytest.raises(supine.SupineError):
        session.set(table={"ap": 3.0, "lat": 1e9})
    assert session.case == before


def test_errors_of_stages_say_where(values: dict[str, Any], tmp_path: Path) -> None:
    missing = supine.Session(**{**values, "ct": tmp_path / "nowhere"})
    with pytest.raises(supine.SupineError) as told:
        missing.labels
    assert told.value.code == "input-missing" and told.value.place["key"] == "ct"
    air = {"centre": (91.37, -400.0, -594.5), "radius": 9.0}
    with pytest.raises(supine.SupineError) as told:
        supine.Session(**{**values, "tumour": air}).tumour
    assert told.value.code in ("tumour-in-air", "tumour-outside-ct")
    incomplete = supine.Session(ct=values["ct"], breast="left")
    with pytest.raises(supine.SupineError) as told:
        incomplete.run(tmp_path / "run")
    assert told.value.code == "case-key-missing" and not (tmp_path / "run").exists()
    again = pickle.loads(pickle.dumps(told.value))
    assert (again.code, again.place, str(again)) == (told.value.code, told.value.place, str(told.value))


def test_warnings_have_codes(values: dict[str, Any]) -> None:
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        labels = supine.Session(**values).labels
        supine.Session(**values, labels=labels)
        supine.Session(**values).labels = labels
    assert {warning.filename for warning in heard} == {__file__}, "a warning is shown where the work was asked for"
    own = [warning.message for warning in heard if issubclass(warning.category, supine.SupineWarning)]
    assert "labels-uncertainty-unknown" in {w.code for w in own}, "how sure labels are that somebody gives is not known"
    assert all(w.code and w.stage and isinstance(pickle.loads(pickle.dumps(w)), supine.SupineWarning) for w in own)


TWO_PATIENTS = """
import json, sys, supine
values = json.loads(sys.argv[1])
for _ in range(2):
    session = supine.Session(**values)
    session.movement
    print(len(session.warnings))
"""


def test_each_session_tells_its_warnings_and_keeps_them(values: dict[str, Any]) -> None:
    """Of itself Python tells what came from one line only once: of a loop over patients, of the first."""
    plain = json.dumps(values, default=str)
    command = [sys.executable, "-c", TWO_PATIENTS, plain]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=True)
    first, second = map(int, done.stdout.split())
    assert first == second > 0
    assert done.stderr.count("SupineWarning: ") == first + second


def test_progress_is_told_and_may_end_the_work(values: dict[str, Any]) -> None:
    told: list[tuple[str, float]] = []
    session = supine.Session(**values, progress=lambda stage, share: told.append((stage, share)))
    session.mesh
    stages = {stage for stage, _ in told}
    assert {"import", "segment", "mesh"} <= stages
    assert all(0.0 <= share <= 1.0 for _, share in told)

    def enough(stage: str, share: float) -> None:
        raise RuntimeError(f"enough of {stage}")

    impatient = supine.Session(**values, progress=enough)
    with pytest.raises(RuntimeError, match="enough of import"):
        impatient.mesh
    impatient.progress = None
    assert np.array_equal(impatient.mesh.points, session.mesh.points)


CTRL_C = """
import os, signal, sys, threading, time, warnings
import supine
warnings.simplefilter("ignore")
# A job in the background is started with Ctrl-C ignored, and Python leaves it so.
signal.signal(signal.SIGINT, signal.default_int_handler)
session = supine.Session(ct=sys.argv[1], breast="left", table={"ap": 7, "lat": 5},
    tumour={"centre": (91.37, -248.09, -594.5), "radius": 9}, mesh={"tetrahedra": int(sys.argv[3])})
begun = []
def progress(stage, share):
    if stage == sys.argv[2] and not begun:
        begun.append(time.process_time())
        threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT)).start()
session.progress = progress
try:
    session.tumour
except KeyboardInterrupt:
    print(time.process_time() - begun[0])
def goes_on(stage, share):
    if 0 < share < 1:
        raise RuntimeError(stage)
session.progress = goes_on
try:
    session.tumour
except RuntimeError as left:
    print(left)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("stage", ["import", "prepare", "mesh", "solve"])
def test_ctrl_c_is_heard(folder: Path, original: Path, stage: str) -> None:
    # So many that the stage takes seconds, and those before it no longer than they must.
    tetrahedra = {"mesh": "60000", "solve": "8000"}.get(stage, "1000")
    # What reads the CT takes long where there is much of it.
    ct = original if stage in ("import", "prepare") else folder / "ct"
    # It takes ten seconds, and much longer where the machine has other work.
    done = subprocess.run(
        [sys.executable, "-c", CTRL_C, ct, stage, tetrahedra], capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr
    # Heard, and not when the work had ended anyway: that takes more time of processors by far. How long one waits is measured
    # elsewhere.
    worked, *left = done.stdout.split()
    assert 0.0 < float(worked) < 10.0, done.stdout
    # A fast machine has read the CT by then.
    assert left == [stage] or left and stage == "import", "what was interrupted is not left to do"


def test_python_goes_on_meanwhile_and_sessions_are_their_own(values: dict[str, Any]) -> None:
    ticks, done = 0, threading.Event()

    def work(ap: float) -> tuple[float, ...]:
        return supine.Session(**{**values, "table": {"ap": ap, "lat": 5.0}}, threads=1).movement.after

    def count() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.01)

    counter = threading.Thread(target=count)
    counter.start()
    try:
        with ThreadPoolExecutor(2) as pool:
            both = list(pool.map(work, (7.0, 20.0)))
    finally:
        done.set()
        counter.join()
    assert ticks > 10
    assert both == [work(7.0), work(20.0)] and both[0] != both[1]


def test_one_session_serves_several_threads(values: dict[str, Any]) -> None:
    session = supine.Session(**values)
    with ThreadPoolExecutor(4) as pool:
        points = list(pool.map(lambda _: session.mesh.points.ctypes.data, range(8)))
    assert len(set(points)) == 1
