"""bead_found.py FOLDER: what independent readers find of the phantom of bead.py after FOLDER/run was made of it: the bead is
where its mesh moved it, in FOLDER/run/ct, FOLDER/run/registration, FOLDER/run/dose.dcm and FOLDER/run/structures.dcm.

By SimpleITK, pydicom, pydicomRT and plastimatch. Leaves FOLDER/run/dose16.dcm, the dose in 16 bits, for dciodvfy, which does not
take 32."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK as sitk
from bead import AFTER, BEFORE, PEAK, RADIUS, STEP, WAY, displacement, place, places
from grids import check, series_by_itk, slices
from pydicomrt.dose import check_rtdose_iod
from pydicomrt.reg import check_deformable_reg_iod, check_spatial_reg_iod
from pydicomrt.rs import check_rtstruct_iod

folder = Path(sys.argv[1])
run = folder / "run"
before, after = place(BEFORE), place(AFTER)
source, ct = slices(folder / "ct"), slices(run / "ct")
frames = [source[0].FrameOfReferenceUID, ct[0].FrameOfReferenceUID]
instances = {ds.SOPInstanceUID for ds in ct}
check(frames[0] != frames[1], "the deformed CT keeps the frame of reference")


def near(name, found, meant, tolerance):
    off = np.abs(np.asarray(found, float) - meant).max()
    print(f"{name}: {np.round(found, 4)}, {off:.2g} off")
    check(off <= tolerance, f"{name}: {found}, {meant} meant")


def brightest(image):
    values = sitk.GetArrayFromImage(image)
    index = np.unravel_index(values.argmax(), values.shape)[::-1]
    return image.TransformIndexToPhysicalPoint([int(i) for i in index])


def common(ds, modality):
    """What every object has to say."""
    check(ds.Modality == modality and ds.FrameOfReferenceUID == frames[1], f"{modality}: modality or frame of reference")
    check(str(ds.PatientName) == "Muster^Änne" and ds.StudyInstanceUID == ct[0].StudyInstanceUID, f"{modality}: patient or study")
    check("DEFORMED" in ds.SeriesDescription or "CHEST WALL ONLY" in ds.SeriesDescription, f"{modality}: {ds.SeriesDescription}")
    check(ds.SeriesInstanceUID not in {source[0].SeriesInstanceUID, ct[0].SeriesInstanceUID}, f"{modality}: the series")


# The CT.
deformed, undeformed = series_by_itk(run / "ct"), series_by_itk(folder / "ct")
near("bead in the CT, mm", brightest(undeformed), before, 1e-3)
near("bead in the deformed CT, mm", brightest(deformed), after, 1e-3)

# The deformable registration, from its bytes.
reg = pydicom.dcmread(run / "registration/deformable.dcm")
common(reg, "REG")
check((reg.BodyPartExamined, reg.Laterality) == ("BREAST", "L"), "the side of the registration")
item = reg.DeformableRegistrationSequence[0]
check(item.SourceFrameOfReferenceUID == frames[0], "the registration leads elsewhere than to the CT")
check({r.ReferencedSOPInstanceUID for r in item.ReferencedImageSequence} == {ds.SOPInstanceUID for ds in source}, "images of the registration")
for matrix in (item.PreDeformationMatrixRegistrationSequence, item.PostDeformationMatrixRegistrationSequence):
    check((np.array(matrix[0].FrameOfReferenceTransformationMatrix, float).reshape(4, 4) == np.eye(4)).all(), "a matrix besides the grid")
grid = item.DeformableRegistrationGridSequence[0]
nx, ny, nz = grid.GridDimensions
vectors = np.frombuffer(grid.VectorGridData, "<f4").reshape(nz, ny, nx, 3).astype(float)
field = sitk.GetImageFromArray(vectors, isVector=True)
field.SetOrigin([float(v) for v in grid.ImagePositionPatient])
field.SetSpacing([float(v) for v in grid.GridResolution])
for axis in range(3):
    # Beyond the grid nothing moves: it ends on vectors that are 0.
    check((np.take(vectors, [0, -1], axis) == 0).all(), f"vectors at the border of axis {axis}")
transform = sitk.DisplacementFieldTransform(field)
near("the deformed bead by the registration, mm", transform.TransformPoint(after.tolist()), before, 1e-4)
# A place of the tissue in the CT, from where it went.
way = [off for off in np.random.default_rng(1).uniform(-12, 12, (500, 3))]
there = [before + off + displacement(before + off) for off in way]
back = np.array([transform.TransformPoint(p.tolist()) for p in there])
off = np.linalg.norm(back - before - np.array(way), axis=1)
print(f"500 places by the registration: {off.mean():.3f} mm off the known map in the mean, {off.max():.3f} mm at most")
check(off.mean() < 0.2 and off.max() < 0.8, "the registration is off the known map")
warped = sitk.Resample(undeformed, deformed, transform, sitk.sitkLinear, -1000.0, sitk.sitkFloat64)
near("bead in the CT resampled by the registration, mm", brightest(warped), after, 1e-3)
difference = np.abs(sitk.GetArrayFromImage(warped) - sitk.GetArrayFromImage(deformed)).mean()
print(f"the CT resampled by the registration: {difference:.3f} HU off the deformed CT in the mean")
check(difference < 0.5, f"the registration gives another CT: {difference} HU")
wrong = sitk.Resample(deformed, undeformed, transform, sitk.sitkLinear, -1000.0, sitk.sitkFloat64)
check(np.abs(np.array(brightest(wrong)) - before).max() > 1, "the wrong way round it fits as well")

# The rigid one.
rigid = pydicom.dcmread(run / "registration/chest-wall.dcm")
common(rigid, "REG")
check([r.FrameOfReferenceUID for r in rigid.RegistrationSequence] == frames[::-1], "frames of the rigid registration")
check("CHEST WALL ONLY" in rigid.RegistrationSequence[0].MatrixRegistrationSequence[0].FrameOfReferenceTransformationComment, "its comment")

# The dose.
dose = pydicom.dcmread(run / "dose.dcm")
common(dose, "RTDOSE")
given = pydicom.dcmread(folder / "dose.dcm")
check((dose.DoseUnits, dose.DoseType, dose.DoseSummationType) == ("GY", "PHYSICAL", "PLAN"), "what the dose means")
check(dose.ReferencedRTPlanSequence == given.ReferencedRTPlanSequence, "the plan of the dose")
check(dose.SpatialTransformOfDose == "NON_RIGID" and "not recalculated" in dose.DoseComment, "it does not say that it was carried")
check(dose.ReferencedSpatialRegistrationSequence[0].ReferencedSOPInstanceUID == reg.SOPInstanceUID, "the registration of the dose")
check(dose.ImageType[0] == "DERIVED" and "DERIVED" in dose.DerivationDescription, "it does not say DERIVED")
check(dose.BitsAllocated == 32 and dose.PixelRepresentation == 0, "bits of the dose")
stored = np.frombuffer(dose.PixelData, "<u4").reshape(int(dose.NumberOfFrames), dose.Rows, dose.Columns)
gy = stored * float(dose.DoseGridScaling)
k, j, i = np.unravel_index(gy.argmax(), gy.shape)
start, (down, across) = np.array(dose.ImagePositionPatient, float), [float(v) for v in dose.PixelSpacing]
near("largest dose, mm", start + [i * across, j * down, float(dose.GridFrameOffsetVector[k])], after, 1e-3)
near("largest dose, Gy", [gy.max()], PEAK, 2e-6)
check(dose.GridFrameOffsetVector[0] == 0 and (np.diff([float(v) for v in dose.GridFrameOffsetVector]) > 0).all(), "offsets of its planes")
# What the registration makes of the dose that was given, by another interpolation of the same map.
old = sitk.GetImageFromArray(np.frombuffer(given.PixelData, "<u2").reshape(gy.shape)[::-1] * float(given.DoseGridScaling))
old.CopyInformation(undeformed)
new = sitk.GetArrayFromImage(sitk.Resample(old, old, transform, sitk.sitkLinear, 0.0, sitk.sitkFloat64))
print(f"the dose resampled by the registration: {np.abs(new - gy).max():.4f} Gy off at most, {np.abs(new - gy).mean():.6f} Gy in the mean")
check(np.abs(new - gy).max() < 1.0 and np.abs(new - gy).mean() < 3e-3, "dose and registration differ")
# And what the known map makes of the known dose: where the tissue of each voxel was, by fixed point.
at = places()
was = at.copy()
for _ in range(200):
    was = at - displacement(was)
known = PEAK * np.exp(-((was - before) ** 2).sum(-1) / 200)
print(f"the dose by the known map: {np.abs(known - gy).max():.4f} Gy off at most, {np.abs(known - gy).mean():.6f} Gy in the mean")
check(np.abs(known - gy).max() < 0.3 and np.abs(known - gy).mean() < 5e-3, "the dose is not what the known map makes of it")
twin = pydicom.dcmread(run / "dose.dcm")
scaling = f"{gy.max() / 65535 * 1.0001:.6e}"
twin.BitsAllocated = twin.BitsStored = 16
twin.HighBit, twin.DoseGridScaling = 15, scaling
twin.PixelData = np.rint(gy / float(scaling)).astype("<u2").tobytes()
twin.save_as(run / "dose16.dcm", enforce_file_format=True)

# The structures.
structures, drawn = pydicom.dcmread(run / "structures.dcm"), pydicom.dcmread(folder / "structures.dcm")
common(structures, "RTSTRUCT")
rois = structures.StructureSetROISequence
check([(r.ROINumber, r.ROIName) for r in rois] == [(r.ROINumber, r.ROIName) for r in drawn.StructureSetROISequence], "names of regions")
check(all(r.ReferencedFrameOfReferenceUID == frames[1] and r.ROIGenerationAlgorithm == "AUTOMATIC" for r in rois), "frames of regions")
check([o.RTROIInterpretedType for o in structures.RTROIObservationsSequence] == ["CTV", "ORGAN", "ORGAN"], "types of regions")
clip, empty, far = structures.ROIContourSequence
check([r.ROIDisplayColor for r in structures.ROIContourSequence] == [[250, 20 * n, 0] for n in (1, 2, 3)], "colours of regions")
check("ContourSequence" not in empty, "the empty region has contours")
heights = {ds.SOPInstanceUID: [v.original_string for v in ds.ImagePositionPatient] for ds in ct}
volume, first = 0.0, np.zeros(3)
points = [c for c in clip.ContourSequence if c.ContourGeometricType == "POINT"]
check(len(points) == 1 and points[0].NumberOfContourPoints == 1, "the point of the region")
near("point of the region, mm", points[0].ContourData, after, 1e-3)
(wire,) = [c for c in clip.ContourSequence if c.ContourGeometricType == "OPEN_NONPLANAR"]
drawn_wire = np.array(next(c for c in drawn.ROIContourSequence[0].ContourSequence if c.ContourGeometricType == "OPEN_PLANAR").ContourData, float).reshape(-1, 3)
# The mesh follows the known way within its blocks.
near("line of the region, mm", np.array(wire.ContourData, float).reshape(-1, 3), drawn_wire + displacement(drawn_wire), 0.15)
for contour in clip.ContourSequence:
    if contour.ContourGeometricType != "CLOSED_PLANAR":
        continue
    texts = [v.original_string for v in contour.ContourData]
    z = heights[contour.ContourImageSequence[0].ReferencedSOPInstanceUID][2]
    check(set(texts[2::3]) == {z}, f"z of a contour is not {z}: {set(texts[2::3])}")
    p = np.array(texts, float).reshape(-1, 3)
    check(len(p) == contour.NumberOfContourPoints and (p[0] != p[-1]).any(), "corners of a contour")
    q = np.roll(p, -1, 0)
    twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    part = abs(twice.sum()) / 2 * STEP[2]
    volume += part
    first += part * np.append(((p + q)[:, :2] * twice[:, None]).sum(0) / (3 * twice.sum()), p[0, 2])
middle = first / volume
# What the known map makes of the ball.
solid = np.stack(np.meshgrid(*[np.linspace(-RADIUS, RADIUS, 60)] * 3), -1).reshape(-1, 3)
solid = before + solid[(solid**2).sum(-1) < RADIUS**2]
gradient = np.stack([(displacement(solid + e) - displacement(solid - e)) / 0.02 for e in 0.01 * np.eye(3)], -1)
det = np.linalg.det(np.eye(3) + gradient)
meant = (det[:, None] * (solid + displacement(solid))).sum(0) / det.sum()
near("middle of the region across the slices, mm", middle[:2], meant[:2], 0.15)
# The solid ends between slices: which of them still meet its ends shifts the middle.
near("middle of the region along z, mm", middle[2:], meant[2], 0.2 * STEP[2])
ml = 4 / 3 * np.pi * RADIUS**3 * det.mean() / 1000
near("volume of the region, ml", [volume / 1000], ml, 0.04 * ml)
same = [[list(c.ContourData) for c in roi.ContourSequence] for roi in (far, drawn.ROIContourSequence[2])]
check(same[0] == same[1], "what did not move has other contours")
check(all(c.ContourImageSequence[0].ReferencedSOPInstanceUID in instances for c in far.ContourSequence), "slices of what did not move")

# pydicomRT's own checks; it takes every contour for a closed one with a slice (PS3.3 C.8.8.6 does not).
clip.ContourSequence = [c for c in clip.ContourSequence if c.ContourGeometricType == "CLOSED_PLANAR"]
for iod, ds in ((check_rtdose_iod, dose), (check_rtstruct_iod, structures), (check_deformable_reg_iod, reg), (check_spatial_reg_iod, rigid)):
    said = iod(ds)
    check(said["result"], f"{iod.__name__}: {said['content']}")


def plastimatch(*words):
    said = subprocess.run(["plastimatch", "convert", *map(str, words)], capture_output=True, text=True)
    check(said.returncode == 0, f"plastimatch {words}: {said.stdout} {said.stderr}")


plastimatch("--input", run / "dose.dcm", "--output-dose-img", folder / "dose.nrrd")
image = sitk.ReadImage(str(folder / "dose.nrrd"))
near("largest dose by plastimatch, mm", brightest(image), after, 1e-3)
near("largest dose by plastimatch, Gy", [sitk.GetArrayFromImage(image).max()], PEAK, 1e-4)
plastimatch("--input", run / "structures.dcm", "--referenced-ct", run / "ct", "--output-prefix", folder / "masks")
name, = [f for f in (folder / "masks").iterdir() if "Clip" in f.name or "H" in f.name]
image = sitk.ReadImage(str(name))
inside = np.argwhere(sitk.GetArrayFromImage(image) > 0)[:, ::-1].mean(0)
near("middle of the region by plastimatch, mm", image.TransformContinuousIndexToPhysicalPoint(inside.tolist()), middle, 0.2)
