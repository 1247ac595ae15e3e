"""Writes the golden files of this folder with tools that are not ours.

Run with numpy, scipy, SimpleITK, pynrrd, nibabel, meshio and pyvista installed, in this folder.
The grid is oblique, of unequal spacing; voxel (i, j, k) has i + 10 j + 100 k - 300 HU.
"""

import gzip
import json

import meshio
import nibabel as nib
import nrrd
import numpy as np
import pyvista as pv
import SimpleITK as sitk
from scipy.spatial.transform import Rotation

DIRECTION = Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_matrix()
SPACING = np.array([0.7, 1.1, 2.5])
ORIGIN = np.array([-20.25, 5.5, 100.125])
RAS = np.diag([-1.0, -1.0, 1.0])
I, J, K = np.meshgrid(range(5), range(6), range(7), indexing="ij")
CT = (I + 10 * J + 100 * K - 300).astype(np.int16)
LABELS = np.where(I < 2, 1, np.where(J < 3, 2, np.where(K == 3, 9, 0))).astype(np.uint8)
AFFINE = np.eye(4)
AFFINE[:3, :3] = RAS @ DIRECTION @ np.diag(SPACING)
AFFINE[:3, 3] = RAS @ ORIGIN


def image(array, direction=DIRECTION):
    im = sitk.GetImageFromArray(array.transpose(2, 1, 0))
    im.SetSpacing(SPACING.tolist())
    im.SetOrigin(ORIGIN.tolist())
    im.SetDirection(direction.flatten().tolist())
    return im


def nrrd_header(space="left-posterior-superior", flip=np.eye(3)):
    return {
        "space": space,
        "space directions": (flip @ DIRECTION @ np.diag(SPACING)).T,
        "space origin": flip @ ORIGIN,
        "kinds": ["domain"] * 3,
    }


def nrrds():
    sitk.WriteImage(image(CT), "sitk.nrrd", True)
    left = DIRECTION * [1, -1, 1]
    sitk.WriteImage(image(CT, left), "sitk_left_handed.nrrd", True)
    sitk.WriteImage(image(CT.astype(np.float32)), "sitk_float.nrrd", False)
    ras = nrrd_header("right-anterior-superior", RAS) | {"encoding": "raw", "endian": "big"}
    nrrd.write("pynrrd_ras_big_raw.nrrd", CT.astype(">i4"), ras)
    las = nrrd_header("LAS", np.diag([1.0, -1.0, 1.0])) | {"encoding": "ascii"}
    nrrd.write("pynrrd_las_ascii.nrrd", CT, las)


def niftis():
    sitk.WriteImage(image(CT), "sitk.nii.gz", True)
    n = nib.Nifti1Image(CT, AFFINE)
    n.set_sform(AFFINE, 0)
    n.set_qform(AFFINE, 1)
    nib.save(n, "nibabel_qform.nii.gz")
    left = AFFINE * [1, -1, 1, 1]
    n = nib.Nifti1Image(CT, left)
    n.set_sform(left, 0)
    n.set_qform(left, 2)
    nib.save(n, "nibabel_qform_left_handed.nii.gz")
    h = nib.Nifti1Header(endianness=">")
    h.set_data_dtype(">u2")
    stored = nib.Nifti1Image((CT.astype(int) + 1024).astype(np.uint16), AFFINE, h)
    stored.set_sform(AFFINE, 4)
    stored.set_qform(None, 0)
    nib.save(stored, "scaled.nii")
    raw = bytearray(open("scaled.nii", "rb").read())
    raw[112:120] = np.array([1.0, -1024.0], ">f4").tobytes()
    with open("nibabel_sform_big_scaled.nii.gz", "wb") as f:
        f.write(gzip.compress(bytes(raw), mtime=0))
    import os

    os.remove("scaled.nii")


def metas():
    """MetaImage: compressed in one file, left-handed and plain, big-endian with a header of its own."""
    sitk.WriteImage(image(CT), "sitk.mha", True)
    sitk.WriteImage(image(CT.astype(np.float32), DIRECTION * [1, -1, 1]), "sitk_left_handed.mha", False)
    # ITK writes in the machine's order of bytes only.
    sitk.WriteImage(image(CT.astype(np.int32)), "big.mhd", False)
    raw = np.fromfile("big.raw", "<i4").astype(">i4")
    raw.tofile("big.raw")
    text = open("big.mhd").read()
    open("big.mhd", "w").write(text.replace("OrderMSB = False", "OrderMSB = True"))


def segmentations():
    """The layout of 3D Slicer: names decide; layers; cropped to the segments."""
    h = nrrd_header() | {"encoding": "gzip"}
    keys = {"Segmentation_MasterRepresentation": "Binary labelmap"}
    for n, (name, value) in enumerate([("Chest_Wall", 7), ("Soft tissue", 3), ("TUMOUR", 5)]):
        keys |= {f"Segment{n}_ID": f"Segment_{n}", f"Segment{n}_Name": name,
                 f"Segment{n}_LabelValue": str(value), f"Segment{n}_Layer": "0"}
    mapped = np.select([LABELS == 2, LABELS == 1, LABELS == 9], [7, 3, 5]).astype(np.uint8)
    nrrd.write("slicer_values.seg.nrrd", mapped, h | keys)

    layers = np.stack([mapped, np.where(LABELS == 9, 1, 0).astype(np.uint8)])
    layers[0][LABELS == 9] = 3  # the tumour lies within the soft tissue
    h4 = h | {"kinds": ["list"] + ["domain"] * 3,
              "space directions": np.vstack([[np.nan] * 3, h["space directions"]])}
    over = keys | {"Segment2_LabelValue": "1", "Segment2_Layer": "1"}
    nrrd.write("slicer_layers.seg.nrrd", layers, h4 | over)

    start = np.array([1, 0, 2])
    m = np.eye(4)
    m[:3, :3] = RAS @ h["space directions"].T
    m[:3, 3] = RAS @ ORIGIN
    geometry = ";".join(repr(float(x)) for x in m.flatten()) + ";0;4;0;5;0;6;"
    cropped = h | {"space origin": ORIGIN + h["space directions"].T @ start}
    keys["Segmentation_ConversionParameters"] = (
        f"Decimation factor|0.0|Text.&Reference image geometry|{geometry}|Text.&Smoothing factor|0.5|x")
    keys["Segmentation_ReferenceImageExtentOffset"] = "1 0 2"
    nrrd.write("slicer_cropped.seg.nrrd", mapped[1:4, 0:5, 2:6], cropped | keys)


def totalsegmentator():
    """One file of all labels: its names stand in a header extension, as XML of the form that
    TotalSegmentator writes (`--ml`)."""
    classes = {5: "liver", 92: "rib_left_1", 116: "sternum", 117: "costal_cartilages"}
    values = np.select([I == 0, I == 1, (I == 2) & (J < 2), (I == 2) & (J > 3)], [5, 92, 116, 117])
    image = nib.Nifti1Image(values.astype(np.uint8), AFFINE)
    table = "".join(
        f'<Label Key="{key}" Red="1.0" Green="0.5" Blue="0" Alpha="1"><![CDATA[{name}]]></Label>\n'
        for key, name in classes.items())
    xml = (f'<?xml version="1.0" encoding="UTF-8"?> <CaretExtension>  <Date><![CDATA[2013-07-14]]></Date>'
           f'   <VolumeInformation Index="0">   <LabelTable>\n{table}\n  </LabelTable>'
           f'  <StudyMetaDataLinkSet>  </StudyMetaDataLinkSet>  <VolumeType><![CDATA[Label]]></VolumeType>'
           f'   </VolumeInformation></CaretExtension>\n              ')
    image.header.extensions.append(nib.nifti1.Nifti1Extension(0, xml.encode()))
    nib.save(image, "totalsegmentator_ml.nii")
    with open("totalsegmentator_ml.nii", "rb") as f:
        plain = f.read()
    with open("totalsegmentator_ml.nii.gz", "wb") as f:
        f.write(gzip.compress(plain, mtime=0))
    import os

    os.remove("totalsegmentator_ml.nii")


def vectors(matrix):
    return " ".join("(" + ",".join(f"{x:.17g}" for x in row) + ")" for row in matrix)


def slicer5():
    """All keys that 3D Slicer 5 writes for segments that overlap, cropped to them."""
    start = np.array([1, 0, 2])
    steps = (DIRECTION @ np.diag(SPACING)).T
    m = np.eye(4)
    m[:3, :3] = RAS @ steps.T
    m[:3, 3] = RAS @ ORIGIN
    geometry = ";".join(f"{x:.17g}" for x in m.flatten()) + ";0;4;0;5;0;6;"
    term = "Segmentation category and type - 3D Slicer General Anatomy list"
    tissue = f"TerminologyEntry:{term}~SCT^85756007^Tissue~SCT^85756007^Tissue~^^~Anatomic codes - DICOM master list~^^~^^|"
    mass = f"TerminologyEntry:{term}~SCT^49755003^Morphologically Altered Structure~SCT^4147007^Mass~^^~^^~^^|"
    # Name, value, layer, extent in the file, tags; an empty segment keeps its place.
    segments = [
        ("Left breast", 1, 0, "0 0 0 4 0 3", "Segmentation.Status:inprogress|" + tissue),
        ("Thoracic wall", 2, 0, "1 2 0 4 0 3", "Segmentation.Status:notstarted|" + tissue),
        ("Mass", 1, 1, "0 0 1 2 1 1", mass),
        ("Segment_4", 3, 0, "0 -1 0 -1 0 -1", "Segmentation.Status:notstarted|"),
    ]
    lines = [
        "NRRD0004", "# Complete NRRD file format specification at:",
        "# http://teem.sourceforge.net/nrrd/format.html", "type: unsigned char", "dimension: 4",
        "space: left-posterior-superior", "sizes: 2 3 5 4",
        "space directions: none " + vectors(steps), "kinds: list domain domain domain",
        "encoding: gzip", "space origin: " + vectors([ORIGIN + steps.T @ start]),
    ]
    for n, (name, value, layer, extent, tags) in enumerate(segments):
        lines += [
            f"Segment{n}_Color:=0.5 0.68 0.5", f"Segment{n}_ColorAutoGenerated:=1",
            f"Segment{n}_Extent:={extent}", f"Segment{n}_ID:=Segment_{n + 1}",
            f"Segment{n}_LabelValue:={value}", f"Segment{n}_Layer:={layer}", f"Segment{n}_Name:={name}",
            f"Segment{n}_NameAutoGenerated:=0", f"Segment{n}_Tags:={tags}",
        ]
    lines += [
        "Segmentation_ContainedRepresentationNames:=Binary labelmap|Closed surface|",
        "Segmentation_ConversionParameters:=Collapse labelmaps|1|Merge the labelmaps 1 = shared.&Crop to "
        f"reference image geometry|0|Crop.&Reference image geometry|{geometry}|Image geometry.&Smoothing "
        "factor|-0.5|Smoothing factor.&",
        "Segmentation_MasterRepresentation:=Binary labelmap",
        "Segmentation_ReferenceImageExtentOffset:=" + " ".join(map(str, start)), "", "",
    ]
    voxels = np.zeros((2, 3, 5, 4), np.uint8)
    voxels[0, 0] = 1
    voxels[0, 1:] = 2
    voxels[1, 0, 1:3, 1] = 1
    data = gzip.compress(voxels.transpose(3, 2, 1, 0).tobytes(), mtime=0)
    with open("slicer5_overlap.seg.nrrd", "wb") as f:
        f.write("\n".join(lines).encode() + data)


def slicer_totalsegmentator():
    """Its extension in 3D Slicer: terms of anatomy as names, the classes' names as IDs."""
    keys = {"Segmentation_MasterRepresentation": "Binary labelmap"}
    segments = [("liver", "Liver"), ("rib_left_4", "Left rib 4"), ("lung_upper_lobe_left", "Left upper lobe of lung")]
    for n, (identifier, name) in enumerate(segments):
        keys |= {f"Segment{n}_ID": identifier, f"Segment{n}_Name": name,
                 f"Segment{n}_LabelValue": str(n + 1), f"Segment{n}_Layer": "0"}
    values = np.select([I == 0, I == 1, I == 2], [1, 2, 3]).astype(np.uint8)
    nrrd.write("slicer_totalsegmentator.seg.nrrd", values, nrrd_header() | {"encoding": "gzip"} | keys)


def markups():
    """A point list as 3D Slicer 5 saves it: no name of the list, every field of a point."""
    schema = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#"
    for system, sign in [("LPS", 1), ("RAS", -1)]:
        points = [("chest_wall-1", "defined", [sign * 50.5, sign * -201.25, -585.0]),
                  ("chest_wall-2", "defined", [sign * 40.0, sign * -200.0, -590.0]),
                  ("chest_wall-3", "undefined", [0.0, 0.0, 0.0])]
        document = {"@schema": schema, "markups": [{
            "type": "Fiducial", "coordinateSystem": system, "coordinateUnits": ["mm", "UCUM", "millimeter"],
            "locked": False, "fixedNumberOfControlPoints": False, "labelFormat": "%N-%d",
            "lastUsedControlPointNumber": 3,
            "controlPoints": [{
                "id": str(n + 1), "label": label, "description": "",
                "associatedNodeID": "vtkMRMLScalarVolumeNode1", "position": position,
                "orientation": [-1.0, -0.0, -0.0, -0.0, -1.0, -0.0, 0.0, 0.0, 1.0], "selected": True,
                "locked": False, "visibility": True, "positionStatus": status,
            } for n, (label, status, position) in enumerate(points)],
            "measurements": [],
            "display": {"visibility": True, "opacity": 1.0, "color": [0.4, 1.0, 1.0], "glyphType": "Sphere3D",
                        "glyphScale": 3.0, "snapMode": "toVisibleSurface"},
        }]}
        with open(f"slicer5_{system}.mrk.json", "w") as f:
            json.dump(document, f, indent=4)
            f.write("\n")


def meshes():
    corners = np.array([[n & 1, n >> 1 & 1, n >> 2 & 1] for n in range(8)], float) * 2
    tets = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
    faces = np.array([[0, 1, 3], [0, 3, 2], [0, 2, 6], [0, 6, 4], [0, 4, 5], [0, 5, 1],
                      [1, 3, 7], [3, 2, 7], [2, 6, 7], [6, 4, 7], [4, 5, 7], [5, 1, 7]])
    tags = np.arange(12) % 3 + 1

    def displacement(p):
        return np.stack([p[:, 0] * p[:, 1], p[:, 2] ** 2 - p[:, 0], 0.5 * p[:, 1]], 1)

    m = meshio.Mesh(corners, [("tetra", tets), ("triangle", faces)],
                    point_data={"displacement": displacement(corners)},
                    cell_data={"boundary": [np.zeros(6, int), tags]})
    m.write("meshio_zlib.vtu", compression="zlib")
    m.write("meshio_plain.vtu", compression=None)
    m.write("meshio_ascii.vtu", binary=False)

    # Quadratic: VTK itself adds the mid-side nodes of its 10-node tetrahedron.
    sides = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    points, seen = [tuple(p) for p in corners], {}

    def middle(a, b):
        key = (min(a, b), max(a, b))
        if key not in seen:
            seen[key] = len(points)
            points.append(tuple((corners[a] + corners[b]) / 2))
        return seen[key]

    t10 = [list(t) + [middle(t[a], t[b]) for a, b in sides] for t in tets]
    t6 = [list(t) + [middle(t[a], t[b]) for a, b in sides[:3]] for t in faces]
    points = np.array(points)
    cells = np.concatenate([np.concatenate([[10], t]) for t in t10] + [np.concatenate([[6], t]) for t in t6])
    grid = pv.UnstructuredGrid(cells, [24] * 6 + [22] * 12, points)
    grid.point_data["displacement"] = displacement(points)
    grid.cell_data["boundary"] = np.concatenate([np.zeros(6, int), tags])
    grid.save("pyvista_quadratic.vtu")
    grid.save("pyvista_ascii.vtu", binary=False)
    import vtk

    for encode, name in [(0, "vtk_appended_raw.vtu"), (1, "vtk_appended_base64.vtu")]:
        w = vtk.vtkXMLUnstructuredGridWriter()
        w.SetInputData(grid)
        w.SetFileName(name)
        w.SetDataModeToAppended()
        w.SetEncodeAppendedData(encode)
        w.SetHeaderTypeToUInt64() if encode else w.SetHeaderTypeToUInt32()
        w.SetByteOrderToBigEndian() if encode else w.SetByteOrderToLittleEndian()
        w.Write()


nrrds()
niftis()
metas()
segmentations()
totalsegmentator()
slicer5()
slicer_totalsegmentator()
markups()
meshes()
