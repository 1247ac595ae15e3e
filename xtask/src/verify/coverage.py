"""How often the interval of the tumour's displacement holds the truth.

    coverage.py SUPINE WORK PATIENT=FOLDER=CT...

Of each synthetic patient the program is run with its default tissue on her CT, on that with more noise, and on her true
labels with the chest wall one voxel too far out and in. The truths beside it: her true labels, a wider sphere where
the CT allows it, a mesh of 8,000 tetrahedra, no springs at the cut, and a modulus drawn from the published ones, in either rest state. A modulus without a usable
unloaded shape is drawn again. Prints a table as Markdown.
"""

import json
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import SimpleITK as sitk

PUBLISHED_KPA = [0.3, 0.4, 0.5, 0.6, 0.8, 0.9, 1.2, 1.2, 2.0]
GRID_KPA = [0.22, 0.26, 0.3, 0.35, 0.42, 0.5, 0.65, 0.9, 1.4, 2.4, 5.0]
NOISE_HU = 20.0
VARIANTS = 200
SOFT, WALL = (1, 2, 3, 4), (5, 6, 7, 9)


def command(*words, seconds=None):
    """Whether a command ended well within the time."""
    try:
        done = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode in (0, 4)


def labels(patient, grown):
    """The true labels as soft tissue 1 and chest wall 2, the wall `grown` voxels too large within slices."""
    image = sitk.ReadImage(str(patient / "truth/labels.nrrd"))
    true = sitk.GetArrayFromImage(image)
    soft, wall = np.isin(true, SOFT), np.isin(true, WALL)
    body = soft | wall
    for _ in range(abs(grown)):
        part = wall if grown > 0 else soft
        wide = part.copy()
        for axis in (1, 2):
            for step in (-1, 1):
                wide |= np.roll(part, step, axis)
        wide &= body
        wall, soft = (wide, body & ~wide) if grown > 0 else (body & ~wide, wide)
    out = sitk.GetImageFromArray((soft + 2 * wall).astype(np.uint8))
    out.CopyInformation(image)
    return out


def noisy(ct, seed):
    reader = sitk.ImageSeriesReader()
    series = max(reader.GetGDCMSeriesIDs(str(ct)), key=lambda s: len(reader.GetGDCMSeriesFileNames(str(ct), s)))
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(ct), series))
    image = reader.Execute()
    data = sitk.GetArrayFromImage(image).astype(float)
    data += np.random.default_rng(seed).normal(0.0, NOISE_HU, data.shape)
    out = sitk.GetImageFromArray(np.clip(np.rint(data), -1024, 3071).astype(np.int16))
    out.CopyInformation(image)
    return out


def case(path, facts, ct, more=""):
    bed, tumour = facts["bed_deg"], facts["tumour"]
    path.write_text(
        f'ct = "{ct}"\nbreast = "{facts["side"]}"\ntable = {{ ap = {bed["AP"]}, lat = {bed["LAT"]} }}\n'
        f'tumour = {{ centre = {list(tumour["centre_mm"])}, radius = {tumour["radius_mm"]} }}\n{more}'
    )
    return path


def estimates(supine, work, patient, ct, facts):
    """What the program says with its default tissue, by name of the variant."""
    found = {}
    sitk.WriteImage(noisy(ct, 7), str(work / "noisy.nrrd"), True)
    wide = {"wall +1 voxel": 1, "wall -1 voxel": -1}
    for name, grown in wide.items():
        sitk.WriteImage(labels(patient, grown), str(work / f"labels{grown}.nrrd"), True)
    cases = {"own CT": (ct, ""), "noise": (work / "noisy.nrrd", "")}
    cases |= {name: (ct, f'labels = "{work}/labels{grown}.nrrd"\n') for name, grown in wide.items()}
    for n, (name, (volume, more)) in enumerate(cases.items()):
        out = work / f"out{n}"
        if not command(supine, "run", case(work / f"case{n}.toml", facts, volume, more), "--out", out, "--quiet"):
            raise SystemExit(f"the run of {work.name}, {name}, failed")
        found[name] = json.loads((out / "summary.json").read_text())
    return found


def at(mesh, place):
    """The displacement at a place of a mesh of quadratic or linear tetrahedra."""
    cells, points, u = mesh.cells_dict, mesh.points, mesh.point_data["displacement"]
    tets = cells.get("tetra10", cells.get("tetra"))
    corners = points[tets[:, :4]]
    edges = np.stack([corners[:, k] - corners[:, 0] for k in (1, 2, 3)], -1)
    rest = np.linalg.solve(edges, (place - corners[:, 0])[..., None])[..., 0]
    bary = np.c_[1 - rest.sum(1), rest]
    best = int(np.argmax(bary.min(1)))
    a, b, c, d = bary[best]
    shares = [a, b, c, d]
    if tets.shape[1] == 10:
        shares = [k * (2 * k - 1) for k in shares]
        shares += [4 * a * b, 4 * b * c, 4 * a * c, 4 * a * d, 4 * b * d, 4 * c * d]
    return np.asarray(shares) @ u[tets[best]]


def truths(supine, work, patient, facts):
    """E u over 1/E in both rest states, as arrays for interpolation."""
    sitk.WriteImage(labels(patient, 0), str(work / "true.nrrd"), True)
    roi, place = facts["roi"], np.asarray(facts["tumour"]["centre_mm"])
    centre = ",".join(str(x) for x in roi["centre_mm"])
    mesh = work / "true.vtu"
    words = ["mesh", "--labels", work / "true.nrrd", f"--centre={centre}", "--tetrahedra", 8000, "--out", mesh, "--quiet"]
    # As wide as the CT allows.
    if not any(command(supine, *words, "--radius", roi["radius_mm"] + more) for more in (12.0, 6.0, 0.0)):
        raise SystemExit(f"no true mesh of {work.name}")
    bed = facts["bed_deg"]
    curves = {}
    for rest in ("net", "unloaded"):
        rows = []
        for kpa in GRID_KPA:
            out = work / "true-u.vtu"
            words = ["solve", "--mesh", mesh, f"--table={bed['AP']},{bed['LAT']}", "--young", kpa, "--rest", rest]
            if command(supine, *words, "--cut", "free", "--out", out, "--quiet", seconds=180):
                rows.append((1.0 / kpa, kpa * at(meshio.read(out), place)))
        rows.sort(key=lambda row: row[0])
        curves[rest] = (np.array([x for x, _ in rows]), np.array([w for _, w in rows]))
    return curves


def displacement(curve, kpa):
    x, w = curve
    return np.array([np.interp(1.0 / kpa, x, w[:, k]) for k in range(3)]) / kpa


def holds(summary, truth):
    """Whether length, distance and ellipsoid hold a true displacement."""
    interval, before = summary["tumour_interval"], np.asarray(summary["tumour"]["before_mm"])
    low, high = interval["length_mm"]
    off = np.linalg.norm(truth - np.asarray(summary["tumour"]["displacement_mm"]))
    ellipsoid = interval["ellipsoid"]
    away = before + truth - np.asarray(ellipsoid["centre_mm"])
    far = sum((np.dot(a, away) / np.dot(a, a)) ** 2 for a in np.asarray(ellipsoid["semi_axes_mm"]))
    return low <= np.linalg.norm(truth) <= high, off <= interval["within_mm"], far <= 1.0


def main():
    supine, work = Path(sys.argv[1]), Path(sys.argv[2])
    random = np.random.default_rng(200)
    logs = np.log(PUBLISHED_KPA)
    patients = []
    print("| patient | run | tumour moves | 95 % interval | true (its own tissue) | held: length / distance / ellipsoid |")
    print("|---|---|---|---|---|---|")
    for words in sys.argv[3:]:
        name, folder, ct = words.split("=")
        patient, own = Path(folder), work / name
        own.mkdir(parents=True, exist_ok=True)
        facts = json.loads((patient / "patient.json").read_text())
        found = estimates(supine, own, patient, Path(ct), facts)
        rows = np.genfromtxt(patient / "truth/points_supine.csv", delimiter=",", names=True, dtype=None, encoding=None)
        moved = np.genfromtxt(patient / "truth/points_operating.csv", delimiter=",", names=True, dtype=None, encoding=None)
        place = lambda table: np.array([list(r)[1:4] for r in table if "tumour" in str(list(r)[0])][0], float)
        truth = place(moved) - place(rows)
        for variant, summary in found.items():
            low, high = summary["tumour_interval"]["length_mm"]
            words = " / ".join("yes" if x else "**no**" for x in holds(summary, truth))
            print(
                f"| {name} | {variant} | {summary['tumour']['distance_mm']:.2f} mm | {low:.2f} to {high:.2f} mm "
                f"| {np.linalg.norm(truth):.2f} mm | {words} |"
            )
        patients.append((name, found, truths(supine, own, patient, facts)))
    print()
    print("| patient | truths drawn | length held | distance held | ellipsoid held | drawn moduli, unloaded from |")
    print("|---|---|---|---|---|---|")
    total = []
    for n, (name, found, curves) in enumerate(patients):
        variants, held = list(found.values()), []
        softest = 1.0 / curves["unloaded"][0].max()
        count = VARIANTS // len(patients)
        while len(held) < count:
            kpa = float(np.exp(random.normal(logs.mean(), logs.std(ddof=1))))
            rest = ("net", "unloaded")[int(random.integers(2))]
            if rest == "unloaded" and kpa < softest:
                continue
            held.append(holds(variants[len(held) % len(variants)], displacement(curves[rest], kpa)))
        total += held
        shares = " | ".join(f"{100 * sum(h[k] for h in held) / len(held):.0f} %" for k in range(3))
        print(f"| {name} | {len(held)} | {shares} | {softest:.2f} kPa |")
    shares = " | ".join(f"**{100 * sum(h[k] for h in total) / len(total):.1f} %**" for k in range(3))
    print(f"| all | {len(total)} | {shares} | |")


main()
