"""segmentation.py SOURCE SEG LABELS [SHARE ML,ML...]: highdicom sees our labels in the DICOM segmentation, slice by
slice of the source that it names, and the colours that the label map has. SHARE of the voxels of a label
may differ, none without it; the segments hold exactly ML."""

import sys

import highdicom
import numpy as np
import SimpleITK as sitk
from grids import by_pydicom, check, check_same_grid, of_itk, slices

source, segmentation, labels = sys.argv[1:4]
SHARE = float(sys.argv[4]) if len(sys.argv) > 4 else 0.0
VOLUMES = [float(ml) for ml in sys.argv[5].split(",")] if len(sys.argv) > 5 else []
image = sitk.ReadImage(labels)
ours = of_itk(image)
check_same_grid("labels against CT", ours, by_pydicom(source))
seg = highdicom.seg.segread(segmentation)
ct = slices(source)
for keyword in ("PatientID", "PatientName", "StudyInstanceUID", "FrameOfReferenceUID"):
    check(seg[keyword].value == ct[0][keyword].value, f"{keyword} is not the source's")
for keyword in ("SOPInstanceUID", "SeriesInstanceUID", "SeriesNumber"):
    check(seg[keyword].value != ct[0][keyword].value, f"{keyword} is the source's")

# Number and colour by name, from the keys of the label map.
keys = {k: image.GetMetaData(k) for k in image.GetMetaDataKeys()}
named = {v: k[: -len("Name")] for k, v in keys.items() if k.startswith("Segment") and k.endswith("_Name")}
instances = [s.SOPInstanceUID for s in ct]
segments = {n: seg.get_segment_description(n) for n in seg.segment_numbers}
check({s.segment_label for s in segments.values()} == set(named), f"segments {segments}, keys {named}")
for number, segment in segments.items():
    key = named[segment.segment_label]
    seen = seg.get_pixels_by_source_instance(instances, segment_numbers=[number], assert_missing_frames_are_empty=True)
    value = int(keys[key + "LabelValue"])
    differ = np.count_nonzero((seen[..., 0] > 0) != (ours[0] == value))
    if VOLUMES:
        ml = np.count_nonzero(seen) * np.prod(image.GetSpacing()) / 1000
        check(abs(ml - VOLUMES[number - 1]) < 1e-6, f"{segment.segment_label}: {ml} ml, not {VOLUMES[number - 1]}")
    there = np.count_nonzero(ours[0] == value)
    check(differ <= SHARE * there, f"{segment.segment_label}: {differ} of {there} voxels differ")
    seen = highdicom.color.CIELabColor.from_dicom_value(segment.RecommendedDisplayCIELabValue).to_rgb()
    meant = [round(255 * float(v)) for v in keys[key + "Color"].split()]
    # highdicom takes the white of sRGB (D65), the standard that of ICC profiles (D50).
    check(np.abs(np.subtract(seen, meant)).max() <= 8, f"{segment.segment_label}: colour {seen}, not {meant}")
    category, kind = segment.segmented_property_category, segment.segmented_property_type
    print(f"{number} {segment.segment_label}: {category.meaning}, {kind.meaning}, {int((ours[0] == value).sum())} voxels")
    check(kind.scheme_designator == "SCT", f"{segment.segment_label} has no SNOMED code")
