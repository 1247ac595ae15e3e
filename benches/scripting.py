"""What the Python package costs and saves beside the command line, as Markdown.

    python scripting.py --supine BINARY --case CASE --cohort CASE ... --wheel WHEEL

The wheel must be installed in this Python and built like the binary.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

RUNS = 5
TILTS = [(float(ap), float(lat)) for ap in range(-20, 30, 5) for lat in range(-10, 15, 5)]

SCRIPT = """
import sys, warnings, supine
warnings.simplefilter("ignore")
supine.Session.read(sys.argv[1]).run(sys.argv[2])
"""

CTRL_C = """
import os, signal, sys, threading, time, warnings, supine
warnings.simplefilter("ignore")
sent = []
def kill():
    sent.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
def progress(stage, share):
    if stage == sys.argv[2] and not begun:
        begun.append(1)
        threading.Timer(0.1, kill).start()
begun = []
session = supine.Session.read(sys.argv[1], progress=progress)
try:
    session.run(sys.argv[3])
    print("nan")
except KeyboardInterrupt:
    print(1000 * (time.monotonic() - sent[0]))
"""


def measured(command: list[str | Path]) -> tuple[float, float, float]:
    """Wall time of a command and its processors' time, s, and its largest resident memory, MB."""
    begun = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 4):
        raise SystemExit(f"{command} failed")
    return time.perf_counter() - begun, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e6


def seconds(command: list[str | Path]) -> tuple[float, float]:
    """Wall time of a command, s, and its largest resident memory, MB."""
    wall, _, memory = measured(command)
    return wall, memory


def whole_runs(binary: str, case: Path, folder: Path) -> str:
    """Whole runs by both in turns, so that both meet the same load."""
    theirs, ours = [], []
    for n in range(RUNS):
        theirs.append(measured([binary, "run", case, "--out", folder / f"cli{n}", "--quiet"]))
        ours.append(measured([sys.executable, "-c", SCRIPT, case, folder / f"python{n}"]))
        shutil.rmtree(folder / f"cli{n}")
        shutil.rmtree(folder / f"python{n}")
    memory = [max(mb for *_, mb in runs) for runs in (theirs, ours)]
    text = ""
    for which, what in enumerate(("a whole run, cold", "its processors' time")):
        cli, python = (statistics.median(run[which] for run in runs) for runs in (theirs, ours))
        text += f"| {what} (median of {RUNS}) | {cli:.2f} s, {memory[0]:.0f} MB | {python:.2f} s, {memory[1]:.0f} MB |"
        text += f" {100 * (python / cli - 1):+.1f} % |\n"
    return text


def sweep(binary: str, case: Path, folder: Path) -> str:
    """Tilts of the table in one session, and by one run of the command line each."""
    import supine

    begun = time.perf_counter()
    session = supine.Session.read(case)
    for ap, lat in TILTS:
        session.set(table={"ap": ap, "lat": lat})
        session.movement
    ours = time.perf_counter() - begun
    some = TILTS[:: len(TILTS) // RUNS][:RUNS]
    begun = time.perf_counter()
    for n, (ap, lat) in enumerate(some):
        tilt = f"table={{ap={ap},lat={lat}}}"
        command: list[str | Path] = [binary, "run", case, "--out", folder / f"tilt{n}", "--set", tilt]
        seconds([*command, "--until", "points", "--quiet"])
    theirs = (time.perf_counter() - begun) / len(some) * len(TILTS)
    return (
        f"| the tumour at {len(TILTS)} tilts | {theirs:.0f} s ({len(some)} runs measured) | {ours:.1f} s in one session |"
        f" {theirs / ours:.1f} times as fast |\n"
    )


def ctrl_c(case: Path, folder: Path) -> str:
    """From the signal to the exception, in each stage that takes a while."""
    told = []
    for stage in ("import", "prepare", "segment", "mesh", "solve", "interval", "warp", "export", "report"):
        command = [sys.executable, "-c", CTRL_C, case, stage, folder / f"stopped-{stage}"]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        told.append((float(done.stdout), stage))
    worst, stage = max((t for t in told if t[0] == t[0]), default=(float("nan"), "none"))
    return f"| from Ctrl-C to the exception, worst of {len(told)} stages | | {worst:.0f} ms ({stage}) | |\n"


def batch(binary: str, cases: list[Path], folder: Path) -> str:
    """Several patients one after the other, at once, and again."""
    alone = sum(
        seconds([binary, "run", case, "--out", folder / f"alone{n}", "--quiet"])[0]
        for n, case in enumerate(cases)
    )
    command: list[str | Path] = [binary, "batch", *cases, "--out", folder / "cohort", "--quiet"]
    at_once, memory = seconds(command)
    again, _ = seconds(command)
    return (
        f"\n| {len(cases)} patients | time |\n|---|---|\n| `supine run` one after the other | {alone:.1f} s |\n"
        f"| `supine batch` | {at_once:.1f} s, {memory:.0f} MB |\n| the same again: nothing to do | {again:.2f} s |\n"
    )


def main() -> None:
    """All tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--supine", required=True)
    parser.add_argument("--case", type=Path, required=True)
    parser.add_argument("--cohort", type=Path, nargs="+", required=True)
    parser.add_argument("--wheel", type=Path, required=True)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = "| | command line | Python | |\n|---|---|---|---|\n"
        text += whole_runs(given.supine, given.case, folder)
        text += sweep(given.supine, given.case, folder)
        text += ctrl_c(given.case, folder)
        text += f"| size of the binary and of the wheel | {Path(given.supine).stat().st_size / 1e6:.1f} MB |"
        text += f" {given.wheel.stat().st_size / 1e6:.1f} MB | |\n"
        text += batch(given.supine, given.cohort, folder)
    print(text)


if __name__ == "__main__":
    main()
