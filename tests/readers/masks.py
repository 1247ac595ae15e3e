"""Masks as TotalSegmentator leaves them, made from the true labels of the fixture: a folder of one
file a class, empty ones among them, and one file of all classes with their names in the header."""

import gzip
import struct
import sys
from pathlib import Path

import numpy as np
import SimpleITK as sitk

truth = sitk.ReadImage(sys.argv[1])
folder = Path(sys.argv[2])
MUSCLE, BONE, LUNG = 5, 6, 7
labels = sitk.GetArrayFromImage(truth)
x = truth.GetOrigin()[0] + truth.GetSpacing()[0] * np.arange(labels.shape[2])
y = truth.GetOrigin()[1] + truth.GetSpacing()[1] * np.arange(labels.shape[1])
left = np.broadcast_to(x > 0, labels.shape)
bone = labels == BONE
where = np.nonzero(bone)
middle = np.broadcast_to((y < y[where[1]].mean())[None, :, None], labels.shape)
front = np.broadcast_to((y < np.percentile(y[where[1]], 60))[None, :, None], labels.shape)
sternum = bone & front & np.broadcast_to(np.abs(x) < 15, labels.shape)
breast = sitk.BinaryErode(truth <= 4, [1, 1, 0]) & (truth >= 1) & (truth <= 4)
breast = (sitk.GetArrayFromImage(breast) > 0) & middle
masks = {
    "spleen": np.zeros_like(bone),
    "lung_upper_lobe_left": (labels == LUNG) & left,
    "lung_upper_lobe_right": (labels == LUNG) & ~left,
    "rib_left_4": bone & left & ~sternum,
    "rib_left_12": np.zeros_like(bone),
    "rib_right_4": bone & ~left & ~sternum,
    "sternum": sternum,
    "pectoralis_major_left": (labels == MUSCLE) & front & left,
    "pectoralis_major_right": (labels == MUSCLE) & front & ~left,
    "breast": breast,
}
(folder / "segmentations").mkdir()
whole = np.zeros(labels.shape, np.uint8)
table = ""
for key, (name, mask) in enumerate(masks.items(), 1):
    image = sitk.GetImageFromArray(mask.astype(np.uint8))
    image.CopyInformation(truth)
    sitk.WriteImage(image, str(folder / "segmentations" / f"{name}.nii.gz"))
    whole[mask] = key
    table += f'<Label Key="{key}" Red="1" Green="0" Blue="0" Alpha="1"><![CDATA[{name}]]></Label>\n'
(folder / "segmentations" / "statistics.json").write_text("{}")

image = sitk.GetImageFromArray(whole)
image.CopyInformation(truth)
plain = folder / "plain.nii"
sitk.WriteImage(image, str(plain))
data = bytearray(plain.read_bytes())
plain.unlink()
xml = ('<?xml version="1.0" encoding="UTF-8"?> <CaretExtension> <VolumeInformation Index="0"> '
       f"<LabelTable>\n{table}</LabelTable> </VolumeInformation></CaretExtension>\n   ").encode()
size = -(-(8 + len(xml)) // 16) * 16
data[108:112] = struct.pack("<f", 352 + size)
extension = struct.pack("<ii", size, 0) + xml.ljust(size - 8, b"\0")
data = data[:348] + b"\1\0\0\0" + extension + data[352:]
(folder / "ml.nii.gz").write_bytes(gzip.compress(bytes(data)))
