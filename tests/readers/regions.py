"""regions.py SOURCE LABELS FOLDER: the labels as other programs export them: `seg.dcm` by highdicom
(body and chest wall in codes, names in German), `rtss.dcm` by pydicom (contours round the pixels)."""

import sys
from pathlib import Path

import highdicom
import numpy as np
import SimpleITK as sitk
from grids import slices
from pydicom.sr.codedict import codes
from structures import write_structures

SOFT, WALL = 1, 2

source, labels, folder = sys.argv[1:]
ct = slices(source)
array = sitk.GetArrayFromImage(sitk.ReadImage(labels))
body, wall = array > 0, array == WALL


def description(number, name, category, kind):
    return highdicom.seg.SegmentDescription(
        number, name, category, kind, highdicom.seg.SegmentAlgorithmTypeValues.MANUAL
    )


def write_segmentation(path):
    segments = [
        description(1, "Umriss", codes.SCT.AnatomicalStructure, codes.SCT.EntireBody),
        description(2, "Brustwand", codes.SCT.AnatomicalStructure, codes.SCT.ChestWall),
    ]
    seg = highdicom.seg.Segmentation(
        ct, np.stack([body, wall], -1), highdicom.seg.SegmentationTypeValues.BINARY, segments,
        highdicom.UID(), 77, highdicom.UID(), 1, "nobody", "hand", "1", "0", content_label="LABELS",
    )
    seg.save_as(path)


def outlines(mask):
    """Closed chains of pixel corners (row, column) round a mask, inside on one side."""
    padded = np.pad(mask, 1)
    ends = {}

    def edges(inside, outside, start, end):
        for j, i in np.argwhere(inside & ~outside):
            ends.setdefault((j + start[0], i + start[1]), []).append((j + end[0], i + end[1]))

    edges(mask, padded[:-2, 1:-1], (0, 0), (0, 1))
    edges(mask, padded[1:-1, 2:], (0, 1), (1, 1))
    edges(mask, padded[2:, 1:-1], (1, 1), (1, 0))
    edges(mask, padded[1:-1, :-2], (1, 0), (0, 0))
    chains = []
    while ends:
        start = at = next(iter(ends))
        chain = []
        while True:
            chain.append(at)
            following = ends[at].pop()
            if not ends[at]:
                del ends[at]
            at = following
            if at == start:
                break
        chains.append(np.array(chain) - 0.5)
    return chains


def contours(mask):
    drawn = []
    for header, plane in zip(ct, mask, strict=True):
        origin = np.array(header.ImagePositionPatient, float)
        row, column = np.array(header.ImageOrientationPatient, float).reshape(2, 3)
        down, across = (float(s) for s in header.PixelSpacing)
        for chain in outlines(plane):
            points = origin + chain[:, 1:] * across * row + chain[:, :1] * down * column
            drawn.append((header, "CLOSED_PLANAR", points))
    return drawn


write_segmentation(Path(folder) / "seg.dcm")
regions = [("Patient Outline", "EXTERNAL", contours(body)), ("CHEST_WALL", "", contours(wall)), ("Heart", "ORGAN", [])]
write_structures(Path(folder) / "rtss.dcm", ct, regions)
