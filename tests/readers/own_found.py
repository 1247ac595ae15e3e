"""own_found.py OUT FOLDER: the objects of own_objects.py in FOLDER, carried into OUT/rt by a de-identified run, refer to that
run's series and registration and to each other's mapped UIDs, and keep of their names what names no one."""

import sys
from pathlib import Path

import numpy as np
import pydicom
from grids import check, slices

out, folder = map(Path, sys.argv[1:])
ct, reg = slices(out / "ct"), pydicom.dcmread(out / "registration/deformable.dcm")
dose, structures, seg = (pydicom.dcmread(out / f"rt/{name}-1.dcm") for name in ("dose", "structures", "segmentation"))
given = [pydicom.dcmread(folder / f"{name}.dcm") for name in ("dose", "structures", "segmentation")]
instances = {ds.SOPInstanceUID for ds in ct}
for ds in (dose, structures, seg):
    check(ds.PatientID == ct[0].PatientID and ds.StudyInstanceUID == ct[0].StudyInstanceUID, f"{ds.Modality}: patient or study")
    check(ds.get("FrameOfReferenceUID") == ct[0].FrameOfReferenceUID, f"{ds.Modality}: frame of reference")
check(dose.ReferencedSpatialRegistrationSequence[0].ReferencedSOPInstanceUID == reg.SOPInstanceUID, "the dose's registration")
check(dose.DoseSummationType == "PLAN" and len(dose.ReferencedRTPlanSequence) == 1, "the dose's plan")
plan = dose.ReferencedRTPlanSequence[0]
check(plan.ReferencedSOPClassUID.name == "RT Plan Storage" and plan.ReferencedSOPInstanceUID.startswith("2.25."), f"the dose's plan: {plan}")
names = [roi.ROIName for roi in structures.StructureSetROISequence]
check(names == ["PTV_50.4Gy", "ROI 2", "ROI 3", "Scar"], f"names of regions: {names}")
types = [o.RTROIInterpretedType for o in structures.RTROIObservationsSequence]
check(types == ["PTV", "MARKER", "ORGAN", ""], f"types of regions: {types}")
check([r.ROIDisplayColor for r in structures.ROIContourSequence] == [r.ROIDisplayColor for r in given[1].ROIContourSequence], "colours of regions")
kinds = [{c.ContourGeometricType for c in r.get("ContourSequence", [])} for r in structures.ROIContourSequence]
check(kinds == [{"CLOSED_PLANAR"}, {"POINT"}, {"OPEN_NONPLANAR"}, {"CLOSED_PLANAR"}], f"types of contours: {kinds}")
for roi in structures.ROIContourSequence:
    for contour in roi.get("ContourSequence", []):
        named = [i.ReferencedSOPInstanceUID for i in contour.get("ContourImageSequence", [])]
        check(set(named) <= instances, "a contour names a slice that is none of the series")
labels = [s.SegmentLabel for s in seg.SegmentSequence]
check(labels == ["Tumor", "Segment 2"], f"names of segments: {labels}")
check([s.SegmentedPropertyTypeCodeSequence[0].CodeMeaning for s in seg.SegmentSequence] == ["Breast", "Breast"], "codes of segments")
gy = dose.pixel_array * float(dose.DoseGridScaling)
print(f"names {names}, {labels}; largest dose {gy.max():.3f} Gy; voxels of segments {int(np.count_nonzero(seg.pixel_array))}")
