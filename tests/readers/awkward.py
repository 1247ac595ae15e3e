"""awkward.py SUPINE FILES TABLE PAGE [write]: every public odd file through `supine inspect --pixels`.

Each file goes alone into a folder. Decoded slices must have the HU that SimpleITK (GDCM) or pydicom
reads. The verdicts must be those of the page; `write` puts them there."""
import csv, hashlib, json, pathlib, shutil, subprocess, sys, tempfile
import numpy as np, pydicom, SimpleITK as sitk

sitk.ProcessObject.SetGlobalWarningDisplay(False)
supine, files, table, page = sys.argv[1:5]
MARK = "## The public odd files, one by one\n"


def fingerprint(hu):
    return hashlib.sha256(np.clip(np.rint(hu), -32768, 32767).astype("<i2").tobytes()).hexdigest()


def by_pydicom(path):
    data = pydicom.dcmread(path)
    return data.pixel_array * float(data.RescaleSlope) + float(data.RescaleIntercept)


# Of these codings a decoder may round otherwise: JPEG baseline, and JPEG 2000 with the irreversible wavelet.
LOSSY = ("jpeg-50", "J2KI")


def readers_of(path, slice_):
    """Which readers see the same HU in the slice; of one that does not, its range, which must be near."""
    frame = int(slice_["file"].split(" frame ")[1]) - 1 if " frame " in slice_["file"] else 0
    same, other = [], ""
    for name, read in [("SimpleITK", lambda: sitk.GetArrayFromImage(sitk.ReadImage(str(path)))),
                       ("pydicom", lambda: by_pydicom(path))]:
        try:
            hu = read()
        except Exception:  # a reader that cannot read it has no say
            continue
        hu = hu.reshape((-1,) + hu.shape[-2:])[frame]
        if fingerprint(hu) == slice_["sha256"]:
            same.append(name)
        else:
            ends = np.abs(np.array(slice_["hu_range"]) - [hu.min(), hu.max()])
            assert any(l in path.name for l in LOSSY) and ends.max() <= 2, (path.name, name, ends)
            other = f"{name} differs ({hu.min():.0f} to {hu.max():.0f} HU)"
    return " and ".join(same) or other or "no reader decodes it"


def verdict(path):
    folder = tempfile.mkdtemp()
    shutil.copy(path, folder)
    said = subprocess.run([supine, "inspect", folder, "--pixels", "--json", "--quiet"],
                          capture_output=True, text=True, timeout=60)
    shutil.rmtree(folder)
    assert said.returncode in (0, 1), (path, said.returncode, said.stderr)
    found = json.loads(said.stdout)
    for series in found["series"]:
        pixels = series["pixels"]
        if pixels["failed"]:
            return "refused: " + pixels["failed"][0], ""
        if pixels["slices"]:
            ends = [s["hu_range"] for s in pixels["slices"]]
            readers = {readers_of(path, s) for s in pixels["slices"]}
            of = f" of {len(ends)} frames" if len(ends) > 1 else ""
            low, high = min(e[0] for e in ends), max(e[1] for e in ends)
            return f"read: {low} to {high} HU{of}", "; ".join(sorted(readers))
        if series["localizers"]:
            return "left out: localizer", ""
        return "refused: " + series["reason"], ""
    for one in found["damaged"]:
        return "refused: " + one, ""
    for one in found["foreign"]:
        return "left out: " + one["reason"], ""
    return "left out: " + found["other"][0]["kind"], ""


rows, faults = [], []
for row in csv.DictReader(open(table, encoding="utf-8")):
    path = pathlib.Path(files) / row["file"]
    text, readers = verdict(path)
    text = text.replace(path.name + ": ", "").replace(path.name + " ", "").replace("|", "/")
    rows.append(f"| {row['file']} | {row['modality'] or '-'} | {text} | {readers or '-'} |")
    readable = row["suggested_outcome"].startswith("readable CT")
    if text.startswith("read") and not readable:
        faults.append(f"{row['file']}: read, though {row['suggested_outcome']}")
    if text.startswith("read") and "no reader" in readers:
        faults.append(f"{row['file']}: {readers}")

assert not faults, "\n".join(faults)
text = "\n".join(["", "| file | modality | verdict | same HU in every voxel |", "|---|---|---|---|", *rows, ""])
head, mark, standing = pathlib.Path(page).read_text(encoding="utf-8").partition(MARK)
intro, _, table_there = standing.partition("\n| file |")
if len(sys.argv) > 5:
    pathlib.Path(page).write_text(head + MARK + intro + text, encoding="utf-8")
else:
    assert "\n| file |" + table_there == text, f"{page} does not say what happens now:\n{text}"
count = sum(" read: " in row for row in rows)
print(f"{len(rows)} files, {count} read as slices")
