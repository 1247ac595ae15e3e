#!/usr/bin/env python3
"""Variants of a CT with known labels: other noise, kernel, slices, tube voltage, shape. Needs numpy, scipy, SimpleITK.

  variants.py PATIENT CT OUT     one folder OUT/NAME per variant: ct.nrrd, and for a patient with truth
                                 truth/labels.nrrd and patient.json, as the scoring script reads them
  variants.py --list             the names

PATIENT: folder with patient.json and truth/labels.nrrd, or `-` for a CT without truth. CT: folder of one DICOM series.
Randomness from fixed seeds: the same variants on every machine.
"""
import json
import os
import sys

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import binary_dilation, gaussian_filter, map_coordinates
from volumes import read

AIR, TOP = -1024, 3071
SOFT, WALL = (1, 2, 3, 4), (5, 6, 7, 9)  # values of the truth
FAT, GLAND = 1, 3


class Case:
    """HU and truth as arrays (z, y, x), with the grid and the sphere that is scored."""

    def __init__(self, hu, truth, spacing, origin, sphere):
        self.hu, self.truth, self.spacing, self.origin, self.sphere = hu, truth, spacing, origin, sphere

    def but(self, **change):
        return Case(**{**vars(self), **change})

    def blurred(self, fwhm_mm):
        """Within the slices."""
        sigma = fwhm_mm / 2.3548
        return gaussian_filter(self.hu, (0, sigma / self.spacing[1], sigma / self.spacing[0]))


def noisy(case, sigma, seed=5):
    """White noise, blurred by half a pixel in the slice as a kernel does, of the asked deviation."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=case.hu.shape), (0, 0.5, 0.5))
    return case.but(hu=case.hu + (sigma / noise.std() * noise).astype(np.float32))


def sharp(case):
    return case.but(hu=case.hu + 0.8 * (case.hu - case.blurred(2.0)))


def thick(case):
    """Every second slice, as thick as two: a quarter of each neighbour."""
    padded = np.pad(case.hu, ((1, 1), (0, 0), (0, 0)), mode="edge")
    hu = (0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:])[::2]
    x, y, z = case.spacing
    return case.but(hu=hu, truth=None if case.truth is None else case.truth[::2], spacing=(x, y, 2 * z))


def shifted(case, mm=2.0):
    """Sampled on a grid 2 mm further along every axis."""
    step = [mm / s for s in reversed(case.spacing)]
    at = np.meshgrid(*[np.arange(n, dtype=np.float32) + d for n, d in zip(case.hu.shape, step)], indexing="ij")
    return pulled(case, at).but(origin=tuple(o + mm for o in case.origin))


def pulled(case, at):
    """Sampled at other places. The truth is interpolated as shares of soft tissue and wall: nearest voxels would be half a
    voxel off."""
    sample = lambda values: map_coordinates(values.astype(np.float32), at, order=1, mode="nearest")
    truth = None
    if case.truth is not None:
        soft, wall = sample(np.isin(case.truth, SOFT)), sample(np.isin(case.truth, WALL))
        truth = np.select([(wall >= soft) & (soft + wall >= 0.5), soft + wall >= 0.5], [WALL[0], SOFT[0]]).astype(np.uint8)
    return case.but(hu=sample(case.hu), truth=truth)


def voltage(case, fat, muscle, bone):
    """Other tube voltage: fat, muscle and bone (-100, 50, 700 HU) come out at other values."""
    return case.but(hu=np.interp(case.hu, [AIR, -100, 50, 700, TOP], [AIR, fat, muscle, bone, bone + TOP - 700]).astype(np.float32))


def scaled(case, x, y, z):
    """A larger or smaller patient."""
    by = np.array([x, y, z])
    sphere = None if case.sphere is None else (by * case.sphere[0], case.sphere[1] * float(by.min()))
    spacing = tuple(by * case.spacing)
    return case.but(spacing=spacing, origin=tuple(by * case.origin), sphere=sphere)


def bent(case, amplitude=7.0, wave=70.0, seed=9):
    """Another shape: a smooth random displacement."""
    rng = np.random.default_rng(seed)
    shape, spacing = case.hu.shape, case.spacing[::-1]
    here = np.meshgrid(*[np.arange(n, dtype=np.float32) for n in shape], indexing="ij")
    index = [g * s / wave + 1 for g, s in zip(here, spacing)]
    at = []
    for axis in range(3):
        coarse = rng.normal(size=[int(n * s / wave) + 4 for n, s in zip(shape, spacing)])
        move = map_coordinates(coarse, index, order=3, mode="nearest")
        at.append(here[axis] + (amplitude / 2 / spacing[axis] * move).astype(np.float32))
    return pulled(case, at)


def mirrored(case):
    """Left and right exchanged."""
    nx, sx = case.hu.shape[2], case.spacing[0]
    last = case.origin[0] + (nx - 1) * sx
    sphere = None
    if case.sphere is not None:
        centre = np.array(case.sphere[0])
        centre[0] = -centre[0]
        sphere = (centre, case.sphere[1])
    truth = None if case.truth is None else case.truth[:, :, ::-1]
    return case.but(hu=case.hu[:, :, ::-1], truth=truth, origin=(-last, *case.origin[1:]), sphere=sphere)


def dense(case):
    """Gland grown by 6 mm into the fat around it: a dense breast."""
    if case.truth is None:
        return None
    reach = [max(1, round(6.0 / s)) for s in reversed(case.spacing)]
    ball = np.ones([2 * r + 1 for r in reach], bool)
    grid = np.meshgrid(*[np.linspace(-1, 1, 2 * r + 1) for r in reach], indexing="ij")
    ball &= sum(g * g for g in grid) <= 1.01
    grown = binary_dilation(case.truth == GLAND, ball) & (case.truth == FAT)
    # Soft edges, and the noise that was there.
    share = gaussian_filter(grown.astype(np.float32), [0.6 / s for s in reversed(case.spacing)]) * (case.truth == FAT)
    return case.but(hu=case.hu + share * 138.0, truth=np.where(grown, GLAND, case.truth))


VARIANTS = {
    "as it is": lambda c: c,
    "noise +20 HU": lambda c: noisy(c, 20.0),
    "noise +40 HU": lambda c: noisy(c, 40.0),
    "soft kernel": lambda c: c.but(hu=c.blurred(2.8)),
    "sharp kernel": sharp,
    "slices twice as thick": thick,
    "grid shifted by 2 mm": shifted,
    "80 kV": lambda c: voltage(c, -118.0, 58.0, 950.0),
    "140 kV": lambda c: voltage(c, -92.0, 46.0, 600.0),
    "small patient (0.87)": lambda c: scaled(c, 0.87, 0.87, 0.87),
    "large patient (1.15)": lambda c: scaled(c, 1.15, 1.15, 1.08),
    "bent (7 mm)": bent,
    "bent otherwise (7 mm)": lambda c: bent(c, seed=23),
    "mirrored": mirrored,
    "dense gland": dense,
}
# Same patient, same anatomy: how far the boundary moves is repeatability.
REPEATS = ["noise +20 HU", "slices twice as thick", "grid shifted by 2 mm"]


def load(patient, folder):
    image = read(folder)
    hu = np.clip(sitk.GetArrayFromImage(image), AIR, TOP).astype(np.float32)
    truth, sphere = None, None
    if patient != "-":
        truth = sitk.GetArrayFromImage(sitk.ReadImage(os.path.join(patient, "truth/labels.nrrd")))
        with open(os.path.join(patient, "patient.json")) as f:
            roi = json.load(f)["score_roi"]
        sphere = (np.array(roi["centre_mm"]), roi["radius_mm"])
    return Case(hu, truth, image.GetSpacing(), image.GetOrigin(), sphere)


def save(case, folder):
    os.makedirs(os.path.join(folder, "truth"), exist_ok=True)
    hu = np.clip(np.round(case.hu), AIR, TOP).astype(np.int16)
    for values, name in [(hu, "ct.nrrd"), (case.truth, "truth/labels.nrrd")]:
        if values is not None:
            image = sitk.GetImageFromArray(np.ascontiguousarray(values))
            image.SetSpacing([float(s) for s in case.spacing])
            image.SetOrigin([float(o) for o in case.origin])
            sitk.WriteImage(image, os.path.join(folder, name))
    if case.sphere is not None:
        roi = {"centre_mm": [float(c) for c in case.sphere[0]], "radius_mm": float(case.sphere[1])}
        with open(os.path.join(folder, "patient.json"), "w") as f:
            json.dump({"score_roi": roi}, f)


def main():
    if sys.argv[1:] == ["--list"]:
        print(json.dumps({"variants": list(VARIANTS), "repeats": REPEATS}))
        return
    patient, ct, out = sys.argv[1:]
    base = load(patient, ct)
    for name, make in VARIANTS.items():
        folder = os.path.join(out, name)
        if not os.path.isdir(folder):
            made = make(base)
            if made is not None:
                save(made, folder + ".part")
                os.rename(folder + ".part", folder)


if __name__ == "__main__":
    main()
