"""The structures of a real patient (FOLDER/rtss.dcm), carried by a known map.

`real_structures.py make FOLDER` writes FOLDER/ct, a CT of the slices they were drawn on (a body in air), and
FOLDER/run/mesh/deformed.vtu, which moves the tumour bed. `real_structures.py check FOLDER` looks at FOLDER/run/structures.dcm."""

import sys
from pathlib import Path

import numpy as np
import pydicom
from bead import common, pixels, save, write_mesh
from grids import check, slices
from PIL import Image, ImageDraw
from pydicomrt.rs import check_rtstruct_iod

mode, folder = sys.argv[1], Path(sys.argv[2])
drawn = pydicom.dcmread(folder / "rtss.dcm")
SIZE, STEP = 256, 2.1484
CENTRE, WAY, REACH = np.array([111.0, -311.0, -10.0]), np.array([4.0, 6.0, 3.0]), 35.0


def displacement(points):
    square = ((points - CENTRE) ** 2).sum(-1) / REACH**2
    return np.clip(1 - square, 0, None)[..., None] ** 2 * WAY


def contours(structures, number):
    """Corners of the closed contours of a region."""
    for roi in structures.ROIContourSequence:
        if roi.ReferencedROINumber == number:
            closed = [c for c in roi.get("ContourSequence", []) if c.ContourGeometricType == "CLOSED_PLANAR"]
            return [np.array(c.ContourData, float).reshape(-1, 3) for c in closed]
    return []


def middle(found):
    """Of the solid of contours, weighted by area, holes taken out; and the area."""
    area, first = 0.0, np.zeros(3)
    for p in found:
        q = np.roll(p, -1, 0)
        twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
        area += abs(twice.sum()) / 2
        first += abs(twice.sum()) / 2 * np.append(((p + q)[:, :2] * twice[:, None]).sum(0) / (3 * twice.sum()), p[0, 2])
    return first / area, area


def filled(p):
    """Places 0.5 mm apart within a contour."""
    low = p[:, :2].min(0) - 1
    mask = Image.new("1", tuple(int(n) for n in np.ceil((p[:, :2].max(0) - low + 1) / 0.5)))
    ImageDraw.Draw(mask).polygon([tuple(c) for c in (p[:, :2] - low) / 0.5], fill=1)
    rows, columns = np.nonzero(np.array(mask))
    return np.column_stack([low[0] + 0.5 * columns, low[1] + 0.5 * rows, np.full(len(rows), p[0, 2])])


def make():
    body = contours(drawn, next(r.ROINumber for r in drawn.StructureSetROISequence if r.ROIName == "BODY"))
    heights = sorted({p[0, 2] for p in body})
    origin = np.array([-275.0, -530.0])
    (folder / "ct").mkdir()
    for k, z in enumerate(heights):
        mask = Image.new("1", (SIZE, SIZE))
        for p in body:
            if p[0, 2] == z:
                ImageDraw.Draw(mask).polygon([tuple(c) for c in (p[:, :2] - origin) / STEP], fill=1)
        ds = common("1.2.840.10008.5.1.4.1.1.2", 1000 + k, "CT")
        for keyword in ("SpecificCharacterSet", "PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID"):
            setattr(ds, keyword, drawn.get(keyword, ""))
        ds.FrameOfReferenceUID = drawn.StructureSetROISequence[0].ReferencedFrameOfReferenceUID
        ds.SeriesInstanceUID, ds.SeriesNumber, ds.InstanceNumber, ds.AcquisitionNumber = "1.2.826.0.1.3680043.10.99.77", 2, k + 1, 1
        ds.ImageType, ds.PatientPosition, ds.KVP, ds.SliceThickness = ["ORIGINAL", "PRIMARY", "AXIAL"], "HFS", "120", 3
        ds.ImagePositionPatient = [*(f"{v:g}" for v in origin), f"{z:g}"]
        ds.RescaleIntercept, ds.RescaleSlope, ds.RescaleType = -1024, 1, "HU"
        pixels(ds, 16, True)
        ds.Rows = ds.Columns = SIZE
        ds.PixelSpacing = [STEP, STEP]
        ds.PixelData = np.where(np.array(mask), 1024, 24).astype("<i2").tobytes()
        save(ds, folder / f"ct/{k:03}.dcm")
    write_mesh(folder / "run/mesh/deformed.vtu", CENTRE, [14] * 3, [2.5] * 3, displacement)


def look():
    ct, found = slices(folder / "run/ct"), pydicom.dcmread(folder / "run/structures.dcm")
    named = [[(r.ROINumber, r.ROIName) for r in s.StructureSetROISequence] for s in (found, drawn)]
    check(named[0] == named[1], f"names: {named}")
    kinds = [{o.ReferencedROINumber: o.RTROIInterpretedType for o in s.RTROIObservationsSequence} for s in (found, drawn)]
    check(kinds[0] == kinds[1], f"types: {kinds}")
    colours = [{r.ReferencedROINumber: r.get("ROIDisplayColor") for r in s.ROIContourSequence} for s in (found, drawn)]
    check(colours[0] == colours[1], f"colours: {colours}")
    heights = {ds.SOPInstanceUID: str(ds.ImagePositionPatient[2].original_string) for ds in ct}
    for roi in found.ROIContourSequence:
        for contour in roi.get("ContourSequence", []):
            z = heights[contour.ContourImageSequence[0].ReferencedSOPInstanceUID]
            check({v.original_string for v in contour.ContourData[2::3]} == {z}, "z of a contour")
            check(len(contour.ContourData) == 3 * contour.NumberOfContourPoints, "corners of a contour")
    moved = []
    for number, name in named[0]:
        before, after = contours(drawn, number), contours(found, number)
        check(bool(before) == bool(after), f"{name}: {len(before)} contours became {len(after)}")
        if not before:
            continue
        reaches = min(np.linalg.norm(p - CENTRE, axis=1).min() for p in before) < REACH
        if not reaches and not name == "BODY":
            same = len(before) == len(after) and all(np.abs(a - b).max() < 1e-3 for a, b in zip(before, after))
            check(same, f"{name} is not as it was drawn")
            continue
        (a, area), (b, grown) = middle(before), middle(after)
        moved.append(name)
        print(f"{name}: middle moved by {np.round(b - a, 2)} mm, area {area:.0f} to {grown:.0f} mm2 in all slices")
        if name == "Scar":
            check(grown / area > 0.85, f"{name}: {grown:.0f} of {area:.0f} mm2 are left of a thin structure that slants")
        if name == "Tumor Bed":
            solid = np.concatenate([filled(p) for p in before])
            gradient = np.stack([(displacement(solid + e) - displacement(solid - e)) / 0.02 for e in 0.01 * np.eye(3)], -1)
            det = np.linalg.det(np.eye(3) + gradient)
            known = (det[:, None] * (solid + displacement(solid))).sum(0) / det.sum()
            print(f"  the known map: {np.round(known - a, 2)} mm, volume by {det.mean():.4f}")
            off = np.abs(b - known)
            check(off[:2].max() < 0.3 and off[2] < 0.5, f"{name}: middle at {b}, {known} by the known map")
            check(abs(grown / area / det.mean() - 1) < 0.02, f"{name}: {grown / area}, {det.mean()} by the known map")
    check("Tumor Bed" in moved and "Heart" not in moved, f"moved: {moved}")
    said = check_rtstruct_iod(found)
    check(said["result"], f"pydicomRT: {said['content']}")


make() if mode == "make" else look()
