"""fields.py SOURCE RUN: numpy, given the source CT and our field, makes our warped CT, and SimpleITK, given the field as an image
and as a transform, no ghost of the breast where it was; the fields are a part of the CT's grid at whose border nothing moves; they undo each
other, as well as the summary says; the Jacobian is that of the field."""

import json
import sys
from pathlib import Path

import meshio
import numpy as np
import SimpleITK as sitk
from grids import check, cubic, ghost_ml, in_tissue, of_itk, origins, series_by_itk

source, run = sys.argv[1], Path(sys.argv[2])
ct, warped = series_by_itk(source), series_by_itk(run / "ct")
names = ("deformed_to_ct.nrrd", "ct_to_deformed.nrrd", "jacobian.nrrd")
back, forth, jacobian = (sitk.ReadImage(str(run / "field" / name)) for name in names)
for name, field in (("deformed_to_ct", back), ("ct_to_deformed", forth)):
    check(field.GetNumberOfComponentsPerPixel() == 3, f"{name} has no three components")
    check(np.isfinite(sitk.GetArrayViewFromImage(field)).all(), f"{name} is not finite")


def transform(field):
    return sitk.DisplacementFieldTransform(sitk.Cast(field, sitk.sitkVectorFloat64))


# One part of the CT's grid, and nothing moves at its border.
first = np.array(ct.TransformPhysicalPointToContinuousIndex(back.GetOrigin()))
check(np.abs(first - first.round()).max() < 1e-4, f"the fields begin between voxels: {first}")
voxels, all_voxels = np.prod(back.GetSize()), np.prod(ct.GetSize())
print(f"{back.GetSize()} of {ct.GetSize()} voxels: {voxels / all_voxels:.1%}")
check(voxels < 0.3 * all_voxels, f"{voxels} voxels of {all_voxels}: the fields are not cropped")
for name, field, rest in (("deformed_to_ct", back, 0), ("ct_to_deformed", forth, 0), ("jacobian", jacobian, 1)):
    check(field.GetSize() == back.GetSize() and np.allclose(field.GetOrigin(), back.GetOrigin()), f"{name} lies elsewhere")
    for axis in range(3):
        check((np.take(sitk.GetArrayViewFromImage(field), [0, -1], axis) == rest).all(), f"{name} at the border of axis {axis}")

# The warped CT anew: HU_deformed(x) = HU(x + v(x)), by cubic convolution in numpy.
grid = sitk.Resample(warped, back, sitk.Transform(), sitk.sitkNearestNeighbor)
way = np.linalg.norm(sitk.GetArrayFromImage(back), axis=-1)
moved = (way > 0.2) & in_tissue(back, jacobian)
off = np.abs(cubic(ct, origins(back, moved)) - sitk.GetArrayFromImage(grid)[moved])
share = np.mean(off <= 1.5)
print(f"{moved.sum()} voxels moved, largest way {way.max():.2f} mm; {share:.4%} equal, 99th percentile {np.percentile(off, 99):.1f} HU")
check(moved.sum() > 10_000, f"only {moved.sum()} voxels moved")
check(0.5 < way.max() < 60, f"largest way {way.max():.2f} mm")
check(share > 0.999, f"numpy makes the same volume of {share:.2%} of the moved voxels only")

# The same over the whole volume, by the field alone and by the transform of ITK: where the breast was is air.
read = sitk.ReadTransform(str(run / "field/deformed_to_ct.mat"))
for name, leads in (("field", transform(back)), ("transform", read)):
    made = sitk.Resample(ct, warped, leads, sitk.sitkLinear, -1000.0, sitk.sitkFloat64)
    ghost, without = ghost_ml(made, warped), ghost_ml(ct, warped)
    print(f"by the {name}: ghost of {ghost:.4f} ml; without it {without:.2f} ml")
    check(without > 0.3, "the breast left nothing to see a ghost in")
    check(ghost < 0.05, f"the {name} leaves a ghost of {ghost:.3f} ml")
for _ in range(200):
    x = ct.TransformContinuousIndexToPhysicalPoint(np.random.default_rng(_).uniform(0, ct.GetSize()).tolist())
    check(np.allclose(read.TransformPoint(x), transform(back).TransformPoint(x), atol=1e-6), f"the transform leads elsewhere at {x}")

# There and back again, at voxels of the operating pose that came from somewhere inside.
positions, steps = of_itk(back)
rng = np.random.default_rng(10)
chosen = rng.choice(np.argwhere(moved), 2000, replace=False)
there, here = transform(back), transform(forth)
errors = []
for k, j, i in chosen:
    x = back.TransformIndexToPhysicalPoint((int(i), int(j), int(k)))
    errors.append(np.linalg.norm(np.subtract(here.TransformPoint(there.TransformPoint(x)), x)))
middle, high = np.percentile(errors, [50, 90])
print(f"there and back: median {middle:.3f} mm, 90th percentile {high:.3f} mm")
check(middle < 0.05, f"the fields do not undo each other: median {middle:.3f} mm")

# Points of the skin, far from where the displacement fades: the nodes of the mesh know where they go.
mesh = meshio.read(run / "mesh/deformed.vtu")
kinds, faces = mesh.cell_data["boundary"][1].ravel(), mesh.cells[1].data
skin, cut = (np.unique(faces[kinds == tag]) for tag in (1, 3))
apart = np.linalg.norm(mesh.points[skin][:, None] - mesh.points[cut][None], axis=-1).min(1)
skin = skin[apart > 25]
told = mesh.points[skin] + mesh.point_data["displacement"][skin]
off = np.linalg.norm([here.TransformPoint(p) for p in mesh.points[skin]] - told, axis=-1)
print(f"{len(skin)} points of the skin: {off.mean():.3f} mm off in the mean, {off.max():.3f} at most")
check(len(skin) > 50 and off.mean() < 0.03 and off.max() < 0.15, f"points of the skin go {off.max():.3f} mm beside where they go")


def sampled(field, at):
    """Trilinear samples at continuous indices (k, j, i), and where all eight neighbours are moved voxels."""
    low = np.floor(at).astype(int)
    inside = ((low >= 0) & (low + 1 < field.shape[:3])).all(-1)
    low, share, total, whole = low[inside], (at - np.floor(at))[inside], 0.0, True
    for corner in np.ndindex(2, 2, 2):
        value = field[tuple((low + corner).T)]
        total = total + value * np.where(corner, share, 1 - share).prod(-1, keepdims=True)
        whole = whole & value.any(-1)
    return total[whole], np.flatnonzero(inside)[whole]


# Forward from every voxel that moves, and back: the figures of the summary.
told = json.loads((run / "summary.json").read_text())["warp"]["forward_then_backward"]
forward, backward = (sitk.GetArrayFromImage(field).astype(float) for field in (forth, back))
moving = np.argwhere(forward.any(-1) & (sitk.GetArrayFromImage(jacobian) != 1))
u = forward[tuple(moving.T)]
direction = np.array(forth.GetDirection()).reshape(3, 3)
steps = (u @ direction / np.array(forth.GetSpacing()))[:, ::-1]
# Of the map alone, as far as it is told from the air into which the vectors are led on.
v, chosen = sampled(backward * in_tissue(back, jacobian)[..., None], moving + steps)
off = np.linalg.norm(u[chosen] + v, axis=-1)
found = {"voxels": len(off), "mean_mm": off.mean(), "p99_mm": np.percentile(off, 99), "max_mm": off.max()}
print(f"forward, then backward: {found}; the summary: {told}")
check(0.8 < found["voxels"] / told["voxels"] <= 1, f"{told['voxels']} voxels in the summary, {len(off)} here")
for key in ("mean_mm", "p99_mm"):
    check(abs(found[key] - told[key]) < 1e-3, f"{key} of the summary is {told[key]}, here {found[key]}")
check(found["max_mm"] < told["max_mm"] + 1e-5, f"max_mm of the summary is {told['max_mm']}, here {found['max_mm']}")
check(told["voxels"] > 10_000 and told["max_mm"] < 0.3, f"the fields do not undo each other: {told}")

# det of the gradient of x -> x + u(x) on the CT's grid, by differences.
ours = of_itk(jacobian)[0]
theirs = sitk.GetArrayFromImage(sitk.DisplacementFieldJacobianDeterminant(forth))
check(ours.shape == theirs.shape, f"the Jacobian has the shape {ours.shape}, the field {theirs.shape}")
inside = np.linalg.norm(sitk.GetArrayFromImage(forth), axis=-1) > 0.2
off = np.abs(ours - theirs)[inside]
print(f"Jacobian {ours.min():.3f} to {ours.max():.3f}; median difference to differences of the field {np.median(off):.4f}")
check(ours.min() > 0, f"the map folds: Jacobian {ours.min():.3f}")
check(np.median(off) < 0.005, f"the Jacobian is not that of the field: median difference {np.median(off):.3f}")
