#!/usr/bin/env python3
"""The chest wall of real CTs against contours read by eye. Needs numpy, scipy, scikit-image, SimpleITK.

  walls.py BENCH_WALLS SCORER_FOLDER WORK NAME=CT=CONTOURS...

Segments every CT with the default weights of the search, with each weight halved and doubled, with weights that no CT supports,
and with one seed at the worst clear place; and all slices, every second and third, and means of two. Prints tables in Markdown:
each CT with the weights that do best on the others; how many places lie within the error that is claimed for them, and how many
of those far off are called uncertain; what the seed mends; and what is said of the breasts on fewer slices. SCORER_FOLDER holds
score_contours.py.
"""
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import binary_fill_holes
from scipy.spatial import cKDTree

DEFAULT = {"fat": 0.35, "muscle": 0.5, "muscle_hu": 9, "edge": 4, "jump": 1.2, "lung": 0.3}
WRONG = {"soft": "0.1,0.5,9,1,2.5,0.3", "hungry": "0.35,2,30,1,1.2,0", "stiff": "0.35,0.5,9,0.5,4,0.3"}
WALL = (2, 3, 4, 5)
UNCERTAIN_MM = 2.5
FAR_MM = 2
# A breast with less than this share of the other's thickness is told, per cent.
UNEVEN = 60
BINS = ((0, 0.8), (0.8, 1.2), (1.2, 2), (2, 3), (3, 5), (5, 26))


def settings():
    """Each weight alone halved and doubled."""
    out = {"default": DEFAULT}
    for key in DEFAULT:
        for factor in (0.5, 2):
            out[f"{key} x {factor}"] = {**DEFAULT, key: DEFAULT[key] * factor}
    return {name: ",".join(str(v) for v in weights.values()) for name, weights in out.items()}


def read(path):
    image = sitk.ReadImage(str(path))
    return sitk.GetArrayFromImage(image), image.GetOrigin(), image.GetSpacing()


def places(scorer, contours, folder, name):
    """Of every point of the contours: x, y, z, signed distance (mm, + the wall lies too far out), class, claimed error (mm), and
    the outward normal."""
    labels, origin, spacing = read(folder / f"{name}.nrrd")
    claimed = read(folder / f"{name}-error.nrrd")[0]
    rows = []
    for piece in json.loads(Path(contours).read_text())["slices"]:
        k = round((piece["z"] - origin[2]) / spacing[2])
        wall = binary_fill_holes(np.isin(labels[k], WALL))
        j, i = np.nonzero(claimed[k])
        near = cKDTree(np.stack([origin[0] + spacing[0] * i, origin[1] + spacing[1] * j], 1))
        for line in piece["wall"]:
            points = scorer.sample(line["points"])
            off = scorer.signed(wall, points, origin, spacing)
            at = near.query(points)[1]
            along = np.gradient(points, axis=0)
            normal = np.stack([along[:, 1], -along[:, 0]], 1) / np.linalg.norm(along, axis=1)[:, None]
            middle = np.array([np.median(points[:, 0]), points[:, 1].max() + 60])
            normal *= np.sign(np.sum(normal * (points - middle), 1))[:, None]
            clear = np.full(len(points), line["class"] == "clear")
            z = np.full(len(points), piece["z"])
            rows.append(np.column_stack([points, z, off, clear, claimed[k][j, i][at] / 10, normal]))
    return np.concatenate(rows)


def figures(rows):
    clear, unclear = rows[rows[:, 4] > 0, 3], rows[rows[:, 4] == 0, 3]
    away = np.abs(clear)
    mean, far = np.abs(unclear).mean(), np.percentile(np.abs(unclear), 95)
    return (f"{away.mean():.2f} / {np.percentile(away, 95):.2f} / {away.max():.1f} | {clear.mean():+.2f} | "
            f"{mean:.2f} / {far:.2f}"), away.mean() + 0.3 * mean


def within(rows):
    """Share of the places within their claimed error, by claim."""
    cells = []
    for low, high in BINS:
        of = rows[(rows[:, 5] >= low) & (rows[:, 5] < high)]
        share = np.mean(np.abs(of[:, 3]) <= of[:, 5]) if len(of) >= 40 else np.nan
        cells.append(f"{100 * share:.0f} % of {len(of)}" if len(of) >= 40 else "-")
    return " | ".join(cells) + f" | {100 * np.mean(np.abs(rows[:, 3]) <= rows[:, 5]):.1f} %"


def share(of, within):
    return f"{100 * np.mean(within):.1f} %" if of.any() else "-"


def classes(rows):
    """Of clear and unclear parts: the share within the claim, the share called uncertain; of places that are far off: the same."""
    off, clear, claim = np.abs(rows[:, 3]), rows[:, 4] > 0, rows[:, 5]
    cells = [share(part, off[part] <= claim[part]) for part in (clear, ~clear)]
    cells += [share(part, claim[part] > UNCERTAIN_MM) for part in (clear, ~clear)]
    far = off > FAR_MM
    return " | ".join(cells + [f"{share(far, claim[far] > UNCERTAIN_MM)} of {far.sum()}", f"{claim[clear].mean():.2f}"])


def phases(bench, name, ct):
    """What is said of both breasts on fewer slices, in one row."""
    told = subprocess.run([bench, ct, ".", "PHASES"], check=True, capture_output=True, text=True).stdout
    words = [line.split("\t") for line in told.splitlines()]
    sides = [w for _, _, w in words]
    shares = [float(w.rstrip(" %")) for w in sides if w.endswith("%")]
    least = f"{min(shares):.0f} %" if shares else "-"
    # Without the figures: what they say once.
    others = sorted({w.split(": ")[1] for w in sides if w.startswith(("CT refused", "cut"))})
    return (f"| {name} | {len(words) // 2} | {sum(w.startswith('no breast') for w in sides)} | "
            f"{sum(s < UNEVEN for s in shares)} | {least} | "
            f"{sum(w.startswith(('CT refused', 'cut')) for w in sides)} {'; '.join(others)} |")


def main():
    bench, scorers, work, *given = sys.argv[1:]
    sys.path.insert(0, scorers)
    import score_contours as scorer
    cts = [part.split("=") for part in given]
    runs = {**settings(), **WRONG}
    rows = {}
    for name, ct, contours in cts:
        folder = Path(work) / name
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run([bench, ct, folder, *(f"{n}:{w}" for n, w in runs.items())], check=True)
        rows[name] = {n: places(scorer, contours, folder, n) for n in runs}
    cost = {name: {n: figures(rows[name][n])[1] for n in settings()} for name in rows}
    print("| CT | clear mean / 95 % / max | bias | unclear mean / 95 % | weights that do best on the others | with these: clear | bias"
          " | unclear |\n|---|---|---|---|---|---|---|---|")
    for name in rows:
        others = [o for o in rows if o != name]
        best = min(settings(), key=lambda n: sum(cost[o][n] / cost[o]["default"] for o in others))
        print(f"| {name} | {figures(rows[name]['default'])[0]} | {best} | {figures(rows[name][best])[0]} |")
    heads = " | ".join(f"{low} to {high}" for low, high in BINS)
    print(f"\n| CT | {heads} mm | all |\n|---|" + "---|" * (len(BINS) + 1))
    for name in rows:
        print(f"| {name} | {within(rows[name]['default'])} |")
    print(f"| all | {within(np.concatenate([r['default'] for r in rows.values()]))} |")
    for wrong in WRONG:
        print(f"| all, wrong weights ({wrong}) | {within(np.concatenate([r[wrong] for r in rows.values()]))} |")
    print("\n| CT | within the claim: clear | unclear | called uncertain: clear | unclear | more than 2 mm off | mean claim, clear |"
          "\n|---|---|---|---|---|---|---|")
    for name in rows:
        print(f"| {name} | {classes(rows[name]['default'])} |")
    print(f"| all | {classes(np.concatenate([r['default'] for r in rows.values()]))} |")
    print("\n| CT | worst clear place (x, y, z) | off | seed | within 15 mm: before mean / max | after mean / max |\n|---|---|---|---|---|---|")
    for name, ct, contours in cts:
        seeded(scorer, bench, Path(work) / name, (name, ct, contours), rows[name]["default"])
    print("\n| CT | ways | no breast | told as after an operation | least thickness against the other side | refused otherwise |"
          "\n|---|---|---|---|---|---|")
    for name, ct, _ in cts:
        print(phases(bench, name, ct))


def seeded(scorer, bench, folder, ct, rows):
    clear = rows[rows[:, 4] > 0]
    worst = clear[np.argmax(np.abs(clear[:, 3]))]
    kind, side = ("soft", 1.5) if worst[3] > 0 else ("wall", -1.5)
    seed = worst[:2] + side * worst[6:8]
    place = f"SEED:{kind},{seed[0]:.2f},{seed[1]:.2f},{worst[2]:.2f}"
    weights = "seeded:" + ",".join(str(v) for v in DEFAULT.values())
    subprocess.run([bench, ct[1], folder, weights, place], check=True)
    after = places(scorer, ct[2], folder, "seeded")

    def near(rows):
        at = (np.hypot(*(rows[:, :2] - worst[:2]).T) < 15) & (rows[:, 2] == worst[2])
        return f"{np.abs(rows[at, 3]).mean():.2f} / {np.abs(rows[at, 3]).max():.1f}"

    x, y, z, off = worst[:4]
    print(f"| {ct[0]} | {x:.0f}, {y:.0f}, {z:.0f} | {off:+.1f} mm | {kind} | {near(rows)} | {near(after)} |")


if __name__ == "__main__":
    main()
