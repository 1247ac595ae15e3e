"""The modulus by scans of the synthetic patients, as Markdown.

fit.py SUPINE WORK NAME=PATIENT=CT ...
Needs numpy, scipy, SimpleITK. Whatever is random begins at a stated seed.
"""
import json, os, subprocess, sys, tarfile, time
import numpy as np
import SimpleITK as sitk
from scipy.spatial import cKDTree

SOFT, WALL = (1, 2, 3, 4), (5, 6, 7, 9)
DRAWS = 50
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))  # of a VTK quadratic tetrahedron


def read(path):
    with open(path) as f:
        return json.load(f)


def supine(*arguments):
    done = subprocess.run([SUPINE, *arguments, "--quiet", "--json"], capture_output=True, text=True)
    return done.returncode, json.loads(done.stdout)


def points(path):
    rows = [line.split(",") for line in open(path).read().splitlines()[1:] if line]
    return {r[0]: np.array([float(x) for x in r[1:4]]) for r in rows}


def errors(patient, out, pose="operating"):
    """Tumour, mean and 95 % of the fiducials, mm."""
    listed = os.path.join(out, "scored.csv")
    carry = [SUPINE, "carry", "--run", out, "--points", f"{patient}/truth/points_supine.csv", "--out", listed, "--quiet"]
    subprocess.run(carry, check=True)
    ours, truth = points(listed), points(f"{patient}/truth/points_{pose}.csv")
    off = {n: np.linalg.norm(ours[n] - truth[n]) for n in truth}
    marks = [d for n, d in off.items() if n.startswith("f")]
    return off["tumour"] if "tumour" in off else off[next(iter(off))], np.mean(marks), np.percentile(marks, 95)


def case(name, patient, ct, folder, tissue, scans, labels=None):
    facts = read(f"{patient}/patient.json")
    text = f'ct = "{os.path.abspath(ct)}"\nbreast = "{facts["side"]}"\n'
    text += f'table = {{ ap = {facts["bed_deg"]["AP"]}, lat = {facts["bed_deg"]["LAT"]} }}\n'
    text += f'tumour = {{ centre = {facts["tumour"]["centre_mm"]}, radius = {facts["tumour"]["radius_mm"]} }}\n'
    if labels:
        text += f'labels = "{labels}"\nregion = {{ centre = {facts["roi"]["centre_mm"]}, radius = {facts["roi"]["radius_mm"]} }}\n'
    if scans:
        text += f'scans = {{ sitting = "{scans}/sitting.ply", supine = "{scans}/supine.ply", intraop = "{scans}/intraop.ply", landmarks = "{scans}/landmarks.json" }}\n'
    text += tissue
    path = os.path.join(folder, f"{name}.toml")
    with open(path, "w") as f:
        f.write(text)
    return path


def true_labels(patient, folder):
    image = sitk.ReadImage(f"{patient}/truth/labels.nrrd")
    fine = sitk.GetArrayFromImage(image)
    made = np.zeros_like(fine)
    made[np.isin(fine, SOFT)], made[np.isin(fine, WALL)] = 1, 2
    out = sitk.GetImageFromArray(made)
    out.CopyInformation(image)
    path = os.path.join(folder, "true.nrrd")
    sitk.WriteImage(out, path)
    return path


def ply(path):
    """Points and normals of a binary PLY of floats."""
    raw = open(path, "rb").read()
    end = raw.index(b"end_header\n") + 11
    head = [line.split() for line in raw[:end].decode().splitlines()]
    count = {w[1]: int(w[2]) for w in head if w[:1] == ["element"]}
    names = [w[2] for w in head if w[:2] == ["property", "float"]]
    table = np.frombuffer(raw, "<f4", count["vertex"] * len(names), end).reshape(-1, len(names)).astype(float)
    if "nx" in names:
        at = names.index("nx")
        return table[:, :3], table[:, at : at + 3]
    start = end + 4 * count["vertex"] * len(names)
    faces = np.frombuffer(raw, np.dtype([("n", "u1"), ("v", "<i4", 3)]), count["face"], start)["v"]
    v = table[:, :3]
    across = np.cross(v[faces[:, 1]] - v[faces[:, 0]], v[faces[:, 2]] - v[faces[:, 0]])
    normals = np.stack([np.bincount(faces.ravel(), np.repeat(across[:, k], 3), len(v)) for k in range(3)], 1)
    return v, normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def write_ply(path, p, n):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(p)}\n"
    head += "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz")) + "end_header\n"
    with open(path, "wb") as f:
        f.write(head.encode() + np.hstack([p, n]).astype("<f4").tobytes())


def true_skin(patient):
    """Samples of the true skin sitting and their normals, LPS."""
    truth = np.load(f"{patient}/truth/displacement.npz")
    nodes, tets = truth["nodes"] + truth["u_sitting"], truth["tets"]
    faces = {}
    for corners in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)):
        mids = [4 + next(k for k, e in enumerate(EDGES) if set(e) == {corners[a], corners[b]}) for a, b in ((0, 1), (1, 2), (2, 0))]
        for t in tets:
            key = tuple(sorted(t[list(corners)]))
            if faces.pop(key, None) is None:
                faces[key] = t[list(corners) + mids]
    six = nodes[np.array(list(faces.values()))]
    samples, normals = [], []
    steps = 6
    for i in range(steps):
        for j in range(steps - i):
            a, b = (i + 1 / 3) / steps, (j + 1 / 3) / steps
            c = 1 - a - b
            w = np.array([a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * c * a])
            da = np.array([4 * a - 1, 0, 1 - 4 * c, 4 * b, -4 * b, 4 * (c - a)])
            db = np.array([0, 4 * b - 1, 1 - 4 * c, 4 * a, 4 * (c - b), -4 * a])
            samples.append(np.einsum("fkx,k->fx", six, w))
            across = np.cross(np.einsum("fkx,k->fx", six, da), np.einsum("fkx,k->fx", six, db))
            normals.append(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12))
    return np.concatenate(samples), np.concatenate(normals)


def perturbed(patient, scans, skin, folder, seed):
    """Another scan of the same patient: on the true skin, with other noise, other holes, fewer points, another pose."""
    rng = np.random.default_rng(seed)
    p, n = ply(f"{scans}/sitting.ply")
    to_patient = np.array(read(f"{patient}/truth/scan_transforms.json")["sitting"]["patient_from_scan"])
    p, n = p @ to_patient[:3, :3].T + to_patient[:3, 3], n @ to_patient[:3, :3].T
    tree, normals = cKDTree(skin[0]), skin[1]
    far, at = tree.query(p)
    normal = normals[at] * np.sign((normals[at] * n).sum(1))[:, None]
    off = (normal * (p - skin[0][at])).sum(1)
    on = far < 3
    p[on] -= normal[on] * off[on][:, None]
    keep = rng.random(len(p)) < 0.8
    for _ in range(3):
        keep &= np.linalg.norm(p - p[rng.integers(len(p))], axis=1) > rng.uniform(8, 20)
    p, n, on = p[keep], n[keep], on[keep]
    waves, phase = rng.normal(size=(80, 3)) / 12, rng.uniform(0, 2 * np.pi, 80)
    smooth = np.cos(p @ waves.T + phase).sum(1) * np.sqrt(2 / 80)
    noise = 0.22 * rng.normal(size=len(p)) + 0.28 * smooth
    p = p + n * (noise * on)[:, None]
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    shift = rng.uniform(-300, 300, 3)
    write_ply(f"{folder}/sitting.ply", p @ q.T + shift, n @ q.T)
    marks = read(f"{scans}/landmarks.json")
    move = lambda m: (q @ (to_patient[:3, :3] @ np.array(m) + to_patient[:3, 3]) + shift + rng.normal(size=3) * 2).tolist()
    own = {"sitting": {k: move(v) for k, v in marks["sitting"].items()}, "ct": marks["ct"]}
    with open(f"{folder}/landmarks.json", "w") as f:
        json.dump(own, f)


def chosen(found):
    return found["fit"]["states"][0]


def patients():
    for word in sys.argv[3:]:
        name, patient, ct = word.split("=")
        folder = os.path.abspath(os.path.join(WORK, name))
        os.makedirs(folder, exist_ok=True)
        if os.path.exists(f"{patient}/scans.tar.xz"):
            tarfile.open(f"{patient}/scans.tar.xz").extractall(folder)
            scans = f"{folder}/scans"
        else:
            scans = os.path.abspath(f"{patient}/scans")
        yield name, os.path.abspath(patient), ct, folder, scans


def fitted():
    print("| patient | labels | modulus (95 %), kPa | error | rest state (evidence) | misfit, mm | fit, s | tumour / fiducials mean / 95 %, mm | with the default tissue |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, patient, ct, folder, scans in patients():
        truth = read(f"{patient}/truth/truth.json")
        for own in (True, False):
            labels = None if own else true_labels(patient, folder)
            key = "own" if own else "true"
            out = f"{folder}/{key}"
            fit = case(key, patient, ct, folder, "", scans, labels)
            code, found = supine("run", fit, "--out", out, "--force", "fit")
            assert code in (0, 4), found
            state, record = chosen(found), found["fit"]
            seconds = next(s["seconds"] for s in found["run"]["stages"] if s["name"] == "fit")
            young = truth.get("E_kPa")
            error = f"{100 * (state['young_kpa'] / young - 1):+.1f} %" if isinstance(young, (int, float)) else "no single one"
            right = state["rest"] == truth["rest_state"]
            rest = f"{state['rest']}, {'right' if right else 'wrong'}" if record["decided"] else f"not decided, {state['rest']} taken"
            ours = errors(patient, out)
            plain = f"{folder}/{key}-default"
            supine("run", case(f"{key}-default", patient, ct, folder, "", None, labels), "--out", plain)
            other = errors(patient, plain)
            tell = lambda e: " / ".join(f"{x:.2f}" for x in e)
            low, high = state["interval_kpa"]
            print(f"| {name} | {key} | {state['young_kpa']:.3f} ({low:.3f} to {high:.3f}) | {error} | {rest} ({record['evidence']:.0f}) | "
                  f"{state['misfit_mm']:.2f} | {seconds:.1f} | {tell(ours)} | {tell(other)} |", flush=True)


def paper():
    print("\nThe same with the paper's own choices, rest state `net` and 12,000 linear tetrahedra, and with the tissues told apart "
          "(`map = \"labels\"`, proportions of the method), and with the cut held otherwise than by springs:\n")
    print("| patient | how | modulus, kPa | misfit, mm | tumour / fiducials mean / 95 %, mm |")
    print("|---|---|---|---|---|")
    ways = {"paper": 'tissue = { rest = "net" }\nmesh = { tetrahedra = 12000, order = 1 }\n',
            "tissues": 'tissue = { map = "labels" }\n',
            "true tissues": None,
            "cut free": 'tissue = { cut = "free" }\n',
            "cut fixed": 'tissue = { cut = "fixed" }\n'}
    for name, patient, ct, folder, scans in patients():
        moduli = read(f"{patient}/truth/truth.json").get("E_kPa")
        for way, tissue in ways.items():
            if tissue is None:
                if not isinstance(moduli, dict):
                    continue
                fat, gland, skin = (moduli[k] for k in ("fat", "gland", "skin"))
                tissue = f'tissue = {{ map = "labels", fat = {fat}, gland = {gland}, skin = {skin}, tumour = {gland} }}\n'
            out = f"{folder}/{way}"
            code, found = supine("run", case(way, patient, ct, folder, tissue, scans), "--out", out, "--force", "fit")
            if code not in (0, 4):
                print(f"| {name} | {way} | {found['error']['message']} | | |", flush=True)
                continue
            state = chosen(found)
            print(f"| {name} | {way} | {state['young_kpa']:.3f}, {state['rest']} | {state['misfit_mm']:.2f} | "
                  f"{' / '.join(f'{x:.2f}' for x in errors(patient, out))} |", flush=True)


def held():
    print("\nThe scan on the operating table, its pose from the torso, own segmentation: distance from the skin near the tumour (20 mm), "
          "mean / rms / 95 % / largest, and rms on the whole breast, beside the error of the tumour:\n")
    print("| patient | skin of | near the tumour, mm | breast, mm | tumour, mm |")
    print("|---|---|---|---|---|")
    for name, patient, ct, folder, scans in patients():
        found = read(f"{folder}/own/summary.json")
        off = {"run": errors(patient, f"{folder}/own")[0], "default": errors(patient, f"{folder}/own-default")[0], "ct": float("nan")}
        truth = points(f"{patient}/truth/points_operating.csv"), points(f"{patient}/truth/points_supine.csv")
        off["ct"] = np.linalg.norm(truth[0]["tumour"] - truth[1]["tumour"])
        for s in found["evaluation"]["surfaces"]:
            near = " / ".join(f"{s['near'][k]:.2f}" for k in ("mean_mm", "rms_mm", "p95_mm", "max_mm"))
            print(f"| {name} | {s['name']} | {near} | {s['breast']['rms_mm']:.2f} | {off[s['name']]:.2f} |", flush=True)


def apart(pose, truth, centre):
    """Distance at a point, mm, and angle, degrees, of two poses from a scan's frame to the patient's."""
    pose, truth = np.array(pose), np.array(truth)
    there = np.linalg.inv(truth) @ np.append(centre, 1)
    off = np.linalg.norm((pose @ there)[:3] - centre)
    turn = pose[:3, :3] @ truth[:3, :3].T
    return f"{off:.2f}, {np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))):.2f}"


def posed():
    print("\nPose of each scan beside the true one: mm at the middle of the region, degrees. Own segmentation; the sitting one in the "
          "rest state that was taken:\n")
    print("| patient | sitting | lying | on the operating table |")
    print("|---|---|---|---|")
    for name, patient, ct, folder, scans in patients():
        truth = read(f"{patient}/truth/scan_transforms.json")
        centre = np.array(read(f"{patient}/patient.json")["roi"]["centre_mm"])
        found = read(f"{folder}/own/summary.json")
        poses = chosen(found), found["fit"]["supine"], found["evaluation"]
        off = [apart(p["patient_from_scan"], truth[k]["patient_from_scan"], centre) for p, k in zip(poses, ("sitting", "supine", "intraop"))]
        print(f"| {name} | {' | '.join(off)} |", flush=True)


def coverage():
    print(f"\n{DRAWS} scans of each homogeneous patient, each on the true skin with noise, holes, points and pose of its own, in the "
          "true rest state. The interval also holds what is common to all of these scans (chest wall, mesh), so that it must hold more "
          "than 95 % of them; \"scan alone\" is the part of it that the scan makes, about the mean of the moduli:\n")
    print("| patient | labels | modulus: mean error, standard deviation | widest interval | holds the truth | scan alone holds the mean |")
    print("|---|---|---|---|---|---|")
    for name, patient, ct, folder, scans in patients():
        truth = read(f"{patient}/truth/truth.json")
        young = truth.get("E_kPa")
        if not isinstance(young, (int, float)):
            continue
        skin = true_skin(patient)
        for key in ("own", "true"):
            labels = true_labels(patient, folder) if key == "true" else None
            ratios, alone, held, widths = [], [], 0, []
            draw = f"{folder}/draw"
            os.makedirs(draw, exist_ok=True)
            for seed in range(DRAWS):
                perturbed(patient, scans, skin, draw, seed)
                tissue = f'tissue = {{ rest = "{truth["rest_state"]}" }}\n'
                tissue += 'scans = { sitting = "draw/sitting.ply", landmarks = "draw/landmarks.json" }\n'
                path = case(f"{key}-draw", patient, ct, folder, tissue, None, labels)
                code, found = supine("fit", path, "--out", f"{folder}/{key}-draws")
                assert code == 0, found
                state = chosen(found)
                low, high = state["interval_kpa"]
                ratios.append(state["young_kpa"] / young)
                alone.append(1.96 * np.hypot(state["parts"]["scan"], state["parts"]["posture"]))
                widths.append(max(high / state["young_kpa"] - 1, 1 - low / state["young_kpa"]))
                held += low <= young <= high
            off = np.log(ratios)
            inside = np.sum(np.abs(off - off.mean()) <= alone)
            print(f"| {name} | {key} | {100 * (np.mean(ratios) - 1):+.1f} %, {100 * np.std(ratios):.1f} % | ±{100 * max(widths):.1f} % | "
                  f"{held} of {DRAWS} | {inside} of {DRAWS} |", flush=True)


if __name__ == "__main__":
    SUPINE, WORK = sys.argv[1:3]
    fitted()
    paper()
    held()
    posed()
    coverage()
