"""igtl_pyigtl.py PORT CT FIELD X Y Z: pyigtl as tracker and viewer of a session in RAS.

Sends poses of the applicator about X Y Z (LPS, mm), its shaft from the front, and prints one line of JSON for each answer: its stamp
and place as pyigtl decodes them. Before, with the applicator 150 mm away, it asks for the image and compares it with the CT (a folder
of slices) that SimpleITK samples where the field leads (`deformed_to_ct.nrrd` of the run).
"""

import itertools
import json
import sys
import time

import numpy as np
import pyigtl
import SimpleITK as sitk
from grids import check, series_by_itk

EPOCH = 1_700_000_000
# What is waited for comes within a second, and much later where the machine has other work.
PATIENCE_S = 120.0
# From LPS to RAS and back: from the left, the tool's own frame stays.
TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
# So far from the planned applicator tissue lies as the run has it, mm.
FAR_MM = 50.0

port, ct, field = int(sys.argv[1]), sys.argv[2], sys.argv[3]
place = np.array(sys.argv[4:7], float)
client = pyigtl.OpenIGTLinkClient(port=port)


class Query(pyigtl.messages.MessageBase):
    """A message of a header alone; pyigtl has no class for it."""

    def __init__(self, kind):
        super().__init__(timestamp=EPOCH, device_name="")
        self._message_type, self._valid_message = kind, True


def pose(at):
    """The sphere's centre at a place, LPS, the shaft along -y."""
    matrix = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
    matrix[:3, 3] = at
    return matrix


def until(device, wanted):
    """The next message of a device that is as wanted."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        message = client.wait_for_message(device, timeout=1.0)
        if message is not None and wanted(message):
            return message
    check(False, f"no {device} as wanted came within {PATIENCE_S} s")


numbers = itertools.count(1)


def follow(at):
    """Sends a pose and waits until the tissue has come to rest. Where the machine has other work the answer may be stale before
    it is read: then the pose is sent again, 1 um aside, for those that are equal are not followed."""
    end = time.monotonic() + PATIENCE_S
    while True:
        number = next(numbers)
        stamp, near = EPOCH + number / 4, at + np.array([1e-3 * number, 0.0, 0.0])
        client.send_message(pyigtl.TransformMessage(TURN @ pose(near), timestamp=stamp, device_name="Applicator"))
        settled = lambda point: abs(point.timestamp - stamp) < 1e-6 and point.groups != ["predicted"]
        point = until("Tumour", settled)
        if point.groups == ["ok"]:
            return point
        check(time.monotonic() < end, f"no answer was good within {PATIENCE_S} s")


def corners(image):
    """Places of all voxels of a message's image in LPS, [k, j, i, 3]."""
    check(image.world_coordinate_system == "ras", f"the image says {image.world_coordinate_system}")
    k, j, i = np.indices(image.image.shape)
    index = np.stack([i, j, k, np.ones_like(i)], -1)
    return (index @ (TURN @ image.ijk_to_world_matrix).T)[..., :3]


def compare(image, tumour):
    """The image against the CT where the field leads."""
    check(image.image.shape == (128, 128, 128) and image.image.dtype == np.int16, f"{image.image.shape}")
    at = corners(image)
    centre = at.reshape(-1, 3).mean(0)
    check(np.abs(centre - tumour).max() < 0.6, f"the image is about {centre}, the tumour at {tumour}")
    grid = sitk.Image(*(int(n) for n in image.image.shape[::-1]), sitk.sitkInt16)
    grid.SetOrigin(at[0, 0, 0].tolist())
    steps = np.array([at[0, 0, 1], at[0, 1, 0], at[1, 0, 0]]) - at[0, 0, 0]
    check(np.allclose(np.abs(steps).sum(1), 1.0, atol=1e-4), f"steps {steps}")
    grid.SetDirection(steps.T.ravel().tolist())
    back = sitk.ReadImage(field, sitk.sitkVectorFloat64)
    way = np.linalg.norm(sitk.GetArrayFromImage(sitk.Resample(back, grid)), axis=-1)
    leads = sitk.DisplacementFieldTransform(back)
    source = series_by_itk(ct)
    far = np.linalg.norm(at - place, axis=-1) > FAR_MM
    # Moved tissue, away from the air, in which fields differ.
    made = sitk.Resample(source, grid, leads, sitk.sitkLinear, -1000.0, sitk.sitkFloat64)
    body = sitk.BinaryErode(made > -300, [4, 4, 4])
    counted = far & (way > 0.5) & (sitk.GetArrayFromImage(body) > 0)
    check(counted.sum() > 50_000, f"only {counted.sum()} voxels can be compared")
    off = lambda other: np.abs(sitk.GetArrayFromImage(other).astype(float) - image.image)[counted]
    here = off(made)
    print(f"{counted.sum()} voxels: mean {here.mean():.2f} HU, 95 % {np.percentile(here, 95):.1f} HU", file=sys.stderr)
    check(here.mean() < 2.0, f"SimpleITK has other voxels: {here.mean():.2f} HU apart on average")
    # Half a voxel to any side fits worse.
    for axis in range(3):
        for step in (-0.5, 0.5):
            shifted = sitk.Image(grid)
            shifted.SetOrigin((at[0, 0, 0] + step * np.eye(3)[axis]).tolist())
            beside = off(sitk.Resample(source, shifted, leads, sitk.sitkLinear, -1000.0, sitk.sitkFloat64)).mean()
            print(f"axis {axis}, {step:+} mm: {beside:.2f} HU", file=sys.stderr)
            check(beside > 1.5 * here.mean(), f"{step} mm along axis {axis} the image fits as well: {beside:.2f} HU")


away = follow(place + [0.0, -150.0, 0.0])
client.send_message(Query("GET_IMAGE"))
image = until("Region", lambda image: abs(image.timestamp - away.timestamp) < 1e-6)
compare(image, (TURN[:3, :3] @ np.array(away.positions[0])))
for step in range(1, 6):
    point = follow(place + np.array([1.0, 0.5, -1.0]) * 0.5 * step)
    check(point.names == ["Tumour"] and point.diameters[0] > 0, f"{point.names} {point.diameters}")
    print(json.dumps({"stamp": point.timestamp, "at": [float(v) for v in point.positions[0]]}))
client.stop()
