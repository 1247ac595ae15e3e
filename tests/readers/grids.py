"""Volumes as independent readers see them, in one form that can be compared.

A volume is an array [k, j, i] and a 4 x 4 affine that takes (i, j, k, 1) to LPS, mm.
"""

import sys
from pathlib import Path

import highdicom
import numpy as np
import pydicom
import SimpleITK as sitk


def affine(origin, steps):
    """The affine of an origin and the three steps along i, j, k."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(steps, float).T
    matrix[:3, 3] = origin
    return matrix


def slices(folder):
    """The data sets of a folder, sorted along the slice normal; position by position, no names."""
    found = [pydicom.dcmread(f) for f in sorted(Path(folder).rglob("*")) if f.is_file()]
    row, column = np.array(found[0].ImageOrientationPatient, float).reshape(2, 3)
    normal = np.cross(row, column)
    return sorted(found, key=lambda d: np.dot(normal, np.array(d.ImagePositionPatient, float)))


def by_pydicom(folder):
    found = slices(folder)
    row, column = np.array(found[0].ImageOrientationPatient, float).reshape(2, 3)
    down, across = (float(s) for s in found[0].PixelSpacing)
    positions = np.array([d.ImagePositionPatient for d in found], float)
    step = (positions[-1] - positions[0]) / (len(found) - 1)
    hu = [d.pixel_array * float(d.RescaleSlope) + float(d.RescaleIntercept) for d in found]
    return np.array(hu), affine(positions[0], [row * across, column * down, step])


def by_highdicom(folder):
    volume = highdicom.get_volume_from_series(slices(folder))
    # Its axes are slice, row, column; the slice axis may run either way.
    k, j, i = (volume.affine[:3, a] for a in range(3))
    array, origin = volume.array, volume.affine[:3, 3]
    if np.dot(k, np.cross(i, j)) < 0:
        array, origin, k = array[::-1], origin + k * (array.shape[0] - 1), -k
    return array.astype(float), affine(origin, [i, j, k])


def of_itk(image):
    direction = np.array(image.GetDirection()).reshape(3, 3)
    steps = (direction * np.array(image.GetSpacing())).T
    return sitk.GetArrayFromImage(image), affine(image.GetOrigin(), steps)


def series_by_itk(folder):
    series = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    check(len(series) == 1, f"SimpleITK sees {len(series)} series in {folder}")
    names = sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), series[0])
    return sitk.ReadImage(names, sitk.sitkFloat64)


def by_itk(folder):
    return of_itk(series_by_itk(folder))


def in_tissue(back, jacobian):
    """Where the vectors of `deformed_to_ct` (a SimpleITK image) are those of tissue, and not of the air round it into which they
    are led on: those that lead to a place between eight voxels of the mesh, where `jacobian`, on the same grid, is not 1."""
    v = sitk.GetArrayFromImage(back).astype(float)
    direction = np.array(back.GetDirection()).reshape(3, 3)
    k, j, i = np.indices(v.shape[:3])
    at = np.stack([k, j, i], -1) + (v @ direction / np.array(back.GetSpacing()))[..., ::-1]
    low, moved = np.floor(at).astype(int), sitk.GetArrayFromImage(jacobian) != 1
    inside = ((low >= 0) & (low + 1 < moved.shape)).all(-1)
    low = np.where(inside[..., None], low, 0)
    for corner in np.ndindex(2, 2, 2):
        inside &= moved[tuple(np.moveaxis(low + corner, -1, 0))]
    return inside & v.any(-1)


def origins(back, where):
    """Where the tissue of some voxels of a backward field came from, LPS, mm, one row each."""
    vectors, matrix = of_itk(back)
    k, j, i = np.nonzero(where)
    return np.c_[i, j, k, np.ones(len(i))] @ matrix[:3].T + vectors[where]


def cubic(image, points):
    """HU of an image at points (LPS, mm) by cubic convolution (Keys 1981, a = -1/2), held within the 64 voxels around."""
    values, matrix = of_itk(image)
    at = (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
    size = np.array(values.shape)[::-1]
    at = np.clip(at, 0, size - 1)
    cell = np.minimum(at.astype(int), size - 2)
    t = at - cell
    near = [np.clip(cell + n, 0, size - 1) for n in (-1, 0, 1, 2)]
    far = [np.abs(t - n) for n in (-1, 0, 1, 2)]
    keys = [np.where(x < 1, (1.5 * x - 2.5) * x * x + 1, ((-0.5 * x + 2.5) * x - 4) * x + 2) for x in far]
    total, low, high = 0.0, np.full(len(at), np.inf), np.full(len(at), -np.inf)
    for c in range(4):
        for b in range(4):
            for a in range(4):
                value = values[near[c][:, 2], near[b][:, 1], near[a][:, 0]]
                total = total + keys[c][:, 2] * keys[b][:, 1] * keys[a][:, 0] * value
                low, high = np.minimum(low, value), np.maximum(high, value)
    return np.clip(total, low, high)


def ghost_ml(made, meant):
    """Volume that is tissue in `made` and air in `meant`, two SimpleITK images on one grid: a ghost of the breast, mL."""
    made_hu, meant_hu = (sitk.GetArrayViewFromImage(image) for image in (made, meant))
    return ((made_hu > -300) & (meant_hu < -700)).sum() * np.prod(meant.GetSpacing()) / 1000


def check(holds, what):
    """Ends the script when something does not hold."""
    if not holds:
        sys.exit(f"{Path(sys.argv[0]).name}: {what}")


def check_same_grid(name, a, b, tolerance=1e-5):
    """Same shape, and all corners of the grids within the tolerance, mm."""
    (array_a, affine_a), (array_b, affine_b) = a, b
    check(array_a.shape[:3] == array_b.shape[:3], f"{name}: {array_a.shape} and {array_b.shape}")
    ends = np.array([[i, j, k, 1] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
    ends[:, :3] *= np.array(array_a.shape[2::-1]) - 1
    off = np.abs(ends @ affine_a.T - ends @ affine_b.T).max()
    check(off <= tolerance, f"{name}: the corners of the grids differ by {off:.3g} mm")


def check_same(name, a, b):
    """Same grid and the same number in every voxel."""
    check_same_grid(name, a, b)
    differ = int(np.count_nonzero(a[0] != b[0]))
    check(differ == 0, f"{name}: {differ} of {a[0].size} voxels differ")
