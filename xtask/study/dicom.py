#!/usr/bin/env python3
"""How fast folders are listed and exports verified, and which planted defects are found. Needs numpy, pydicom.

  dicom.py SUPINE SERIES FIXTURE REFERENCE CHEST WORK      Markdown on stdout

SERIES: the example program of supine-dicom that exports a series unchanged. FIXTURE: the CT of the fixture patient.
REFERENCE: the folder with make_series.py and plant_defects.py. CHEST: a folder with a real series of 512 x 512 pixels.
WORK: a folder for what is made, about 1 GB.
"""
import json
import pathlib
import shutil
import subprocess
import sys
import time

import pydicom

supine, series, fixture, reference, chest, work = map(pathlib.Path, sys.argv[1:7])
FILES, SLICES, REPEATS = 10_000, 200, 5


def fresh(name):
    folder = work / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert done.returncode in (0, 4), (command, done.returncode, done.stderr)
    return done.stdout


def fastest(work_once):
    """Seconds of the fastest of several runs: the files are in the page cache from the second on."""
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        work_once()
        times.append(time.perf_counter() - start)
    return min(times)


def many_files():
    """The fixture again and again, each copy a series of its own."""
    folder = fresh("many")
    slices = [path.read_bytes() for path in sorted(fixture.iterdir())]
    for n in range(FILES):
        copy, data = divmod(n, len(slices))
        data = slices[data]
        at = data.index(b"\x20\x00\x0e\x00UI") + 8
        length = int.from_bytes(data[at - 2:at], "little")
        uid = data[at:at + length].rstrip(b"\0")[:-3] + b"%03d" % copy
        (folder / f"{n // 1000}").mkdir(exist_ok=True)
        (folder / f"{n // 1000}" / f"{n:05d}").write_bytes(data[:at] + uid.ljust(length, b"\0") + data[at + length:])
    return folder


def by_pydicom(folder):
    for path in folder.rglob("*"):
        if path.is_file():
            pydicom.dcmread(path, stop_before_pixels=True)


def long_series():
    """The real series, continued by itself to 200 slices."""
    folder = fresh("long")
    given = sorted((pydicom.dcmread(p) for p in chest.iterdir()), key=lambda d: float(d.ImagePositionPatient[2]))
    first = float(given[0].ImagePositionPatient[2])
    step = (float(given[-1].ImagePositionPatient[2]) - first) / (len(given) - 1)
    for n in range(SLICES):
        data = given[n % len(given)].copy()
        x, y, _ = data.ImagePositionPatient
        data.ImagePositionPatient = [x, y, f"{first + n * step:.6f}"]
        data.SliceLocation = f"{first + n * step:.6f}"
        data.InstanceNumber = n + 1
        data.SOPInstanceUID = f"2.25.77.{n + 1}"
        data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
        data.save_as(folder / f"{n:04d}.dcm")
    return folder


def broken(export, source=None):
    said = run(supine, "verify-export", export, "--json", "--quiet", *(["--source", source] if source else []))
    return [check["rule"].split()[0] for check in json.loads(said)["checks"] if check["passed"] is False]


def planted():
    made, export, plants = fresh("made"), work / "unchanged", fresh("plants")
    # The deformed series of that script is not needed and wants scipy.
    subprocess.run([sys.executable, reference / "make_series.py", made], capture_output=True)
    shutil.rmtree(export, ignore_errors=True)
    run(series, "copy", made / "source", export)
    assert broken(export, made / "source") == [], "the export without a defect"
    run(sys.executable, reference / "plant_defects.py", export, made / "source", plants)
    rows = [(p.name, broken(p, made / "source"), broken(p)) for p in sorted(plants.iterdir())]
    for name, found, alone in rows:
        yield f"| {name.replace('_', ' ')} | {', '.join(found) or '**none**'} | {', '.join(alone) or '-'} |"
    found, alone = (sum(bool(row[n]) for row in rows) for n in (1, 2))
    yield f"\n{found} of {len(rows)} found; without the source {alone}."


many = many_files()
listed = fastest(lambda: subprocess.run([supine, "inspect", many, "--quiet"], capture_output=True))
start = time.perf_counter()
by_pydicom(many)
beside = time.perf_counter() - start
source, export = long_series(), work / "verified"
shutil.rmtree(export, ignore_errors=True)
run(series, "copy", source, export)
verified = fastest(lambda: broken(export, source))
print(f"""
| what | time | beside |
|---|---|---|
| `supine inspect` of {FILES:,} files in {FILES // 86 + 1} series, warm | {listed:.2f} s | pydicom reads the headers in {beside:.1f} s |
| `supine verify-export --source` of {SLICES} slices of 512 x 512, warm | {verified:.2f} s | - |

Rules that each defect of the reference's `plant_defects.py` breaks, planted in an unchanged export of its series:

| defect | rules broken | without the source |
|---|---|---|""")
print("\n".join(planted()))
