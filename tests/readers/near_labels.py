"""near_labels.py A B DICE: soft tissue and chest wall of two label maps overlap by at least DICE."""

import sys

import numpy as np
import SimpleITK as sitk

a, b = (sitk.GetArrayFromImage(sitk.ReadImage(path)) for path in sys.argv[1:3])
for label in (1, 2):
    dice = 2 * np.count_nonzero((a == label) & (b == label)) / (
        np.count_nonzero(a == label) + np.count_nonzero(b == label))
    assert dice >= float(sys.argv[3]), (label, dice)
