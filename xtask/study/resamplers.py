"""Carrying a CT through a deformed mesh with other programs, one thread.

python resamplers.py WORKLOAD.npz CT.npy RUNS

WORKLOAD: shape, spacing, origin, rest (mm), disp (mm), tets; axes along those of the CT. VTK: the CT shape's coordinates
probed on the voxels of the box of the deformed mesh, then the CT probed there. SimpleITK: its warp with a dense
displacement field that it is given ready made, over the box and over the whole volume. One line of JSON: median CPU
milliseconds, and the share of the mesh's voxels in which SimpleITK differs from VTK.
"""

import json
import sys
import time

import numpy as np
import SimpleITK as sitk
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy


def cpu_ms(work, runs):
    taken = []
    for _ in range(runs):
        start = time.process_time()
        result = work()
        taken.append(1e3 * (time.process_time() - start))
    return result, float(np.median(taken))


def tetrahedra(points, tets, rest):
    grid, at, cells = vtk.vtkUnstructuredGrid(), vtk.vtkPoints(), vtk.vtkCellArray()
    at.SetDataTypeToDouble()
    at.SetData(numpy_to_vtk(points, deep=1))
    offsets = np.arange(0, 4 * len(tets) + 1, 4, dtype=np.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(tets.ravel().astype(np.int64), deep=1))
    grid.SetPoints(at)
    grid.SetCells(vtk.VTK_TETRA, cells)
    values = numpy_to_vtk(rest, deep=1)
    values.SetName("rest")
    grid.GetPointData().AddArray(values)
    return grid


def voxels(size, spacing, origin, values=None):
    image = vtk.vtkImageData()
    image.SetDimensions(*map(int, size))
    image.SetSpacing(*spacing)
    image.SetOrigin(*origin)
    if values is not None:
        image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=0))
    return image


def probe(at, source):
    filter_ = vtk.vtkProbeFilter()
    filter_.SetInputData(at)
    filter_.SetSourceData(source)
    filter_.Update()
    return filter_.GetOutput().GetPointData()


def with_vtk(mesh, box, ct, size, spacing, origin):
    """Values and CT places of the voxels of the box that lie in the mesh."""
    mesh.Modified()
    found = probe(box, mesh)
    inside = vtk_to_numpy(found.GetArray("vtkValidPointMask")).astype(bool)
    rest = np.ascontiguousarray(vtk_to_numpy(found.GetArray("rest"))[inside])
    places, at = vtk.vtkPolyData(), vtk.vtkPoints()
    at.SetDataTypeToDouble()
    at.SetData(numpy_to_vtk(rest, deep=0))
    places.SetPoints(at)
    values = vtk_to_numpy(probe(places, ct).GetScalars())
    return inside, rest, values.copy()


def with_itk(ct, field):
    warp = sitk.WarpImageFilter()
    warp.SetInterpolator(sitk.sitkLinear)
    warp.SetOutputParameteresFromImage(field)
    warp.SetEdgePaddingValue(-1000.0)
    warp.SetNumberOfThreads(1)
    return warp.Execute(ct, field)


def itk_image(array, spacing, origin, vectors):
    image = sitk.GetImageFromArray(array, isVector=vectors)
    image.SetSpacing([float(s) for s in spacing])
    image.SetOrigin([float(o) for o in origin])
    return image


def main():
    workload, ct, runs = np.load(sys.argv[1]), np.load(sys.argv[2]), int(sys.argv[3])
    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    vtk.vtkSMPTools.Initialize(1)
    spacing, origin, rest = (workload[k] for k in ("spacing", "origin", "rest"))
    size, moved = np.array(ct.shape[::-1]), rest + workload["disp"]
    index = (moved - origin) / spacing
    low = np.clip(np.floor(index.min(0)).astype(int), 0, size - 1)
    high = np.minimum(np.ceil(index.max(0)).astype(int) + 1, size)
    corner = origin + low * spacing
    mesh, box = tetrahedra(moved, workload["tets"], rest), voxels(high - low, spacing, corner)
    source = voxels(size, spacing, origin, ct)
    told = {}
    (inside, places, values), told["vtk_ms"] = cpu_ms(lambda: with_vtk(mesh, box, source, size, spacing, origin), runs)

    shape = tuple((high - low)[::-1])
    inside = inside.reshape(shape)
    k, j, i = np.nonzero(inside)
    here = np.stack([i, j, k], 1) * spacing + corner
    field = np.zeros((*shape, 3))
    field[inside] = places - here
    image = itk_image(ct, spacing, origin, False)
    small = itk_image(field, spacing, corner, True)
    result, told["itk_box_ms"] = cpu_ms(lambda: with_itk(image, small), runs)
    told["itk_differs"] = float((sitk.GetArrayViewFromImage(result)[inside] != values).mean())
    dense = np.zeros((*ct.shape, 3))
    dense[tuple(slice(a, b) for a, b in zip(low[::-1], high[::-1]))] = field
    large = itk_image(dense, spacing, origin, True)
    del dense, field
    _, told["itk_whole_ms"] = cpu_ms(lambda: with_itk(image, large), 1)
    print(json.dumps(told))


if __name__ == "__main__":
    main()
