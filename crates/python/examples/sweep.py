"""Fifty tilts of the table in one session, and how much faster that is than fifty runs of the command line.

    python sweep.py CT_FOLDER [--supine BINARY] [--runs 3]

Only the solve and what follows from it is done again for each tilt: the CT is read, segmented and meshed once.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
import warnings
from pathlib import Path

import supine

TUMOUR = (91.37, -248.09, -594.5)
TILTS = [(float(ap), float(lat)) for ap in range(-20, 30, 5) for lat in range(-10, 15, 5)]


def in_one_session(ct: Path) -> float:
    """Prints the tumour's way for each tilt; the seconds that all of them took."""
    begun = time.perf_counter()
    session = supine.Session(
        ct=ct, breast="left", table={"ap": 0.0, "lat": 0.0}, tumour={"centre": TUMOUR, "radius": 9.0}
    )
    for ap, lat in TILTS:
        session.set(table={"ap": ap, "lat": lat})
        x, y, z = session.movement.displacement
        print(f"AP {ap:+5.0f}, LAT {lat:+5.0f} degrees: {x:+6.2f} {y:+6.2f} {z:+6.2f} mm")
    return time.perf_counter() - begun


def by_the_command_line(binary: str, ct: Path, runs: int) -> float:
    """The seconds of one run up to the same result, the mean of several."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        centre = ", ".join(map(str, TUMOUR))
        case.write_text(
            f'ct = "{ct.resolve()}"\nbreast = "left"\n'
            f"tumour = {{ centre = [{centre}], radius = 9.0 }}\ntable = {{ ap = 0.0, lat = 0.0 }}\n"
        )
        begun = time.perf_counter()
        for run, (ap, lat) in enumerate(TILTS[:runs]):
            command: list[str | Path] = [binary, "run", case, "--out", Path(folder) / str(run)]
            command += ["--until", "points", "--set", f"table={{ap={ap},lat={lat}}}", "--quiet"]
            subprocess.run(command, check=True)
        return (time.perf_counter() - begun) / runs


def main() -> None:
    """Both, and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ct", type=Path)
    parser.add_argument("--supine", help="the binary to compare with")
    parser.add_argument("--runs", type=int, default=3, help="runs of it that are timed")
    given = parser.parse_args()
    warnings.simplefilter("ignore", supine.SupineWarning)
    ours = in_one_session(given.ct)
    print(f"{len(TILTS)} tilts in one session: {ours:.1f} s")
    if given.supine:
        one = by_the_command_line(given.supine, given.ct, given.runs)
        print(
            f"one run: {one:.1f} s, {len(TILTS)} runs: {one * len(TILTS):.0f} s, "
            f"{one * len(TILTS) / ours:.1f} times as long as in one session"
        )


if __name__ == "__main__":
    main()
