"""What the page's canvases must hold: planes of another reader's volume, in the grey values of the page's window."""
import time
import numpy as np

# All waits end after so many ms: the longest work takes half a minute, and much longer where the machine has other work.
WAIT = 600_000


def grey(hu, window):
    """As the page's table: halves to even, as canvas data are rounded."""
    width, level = window
    return np.clip(np.rint(((hu - level) / width + 0.5) * 255), 0, 255).astype(int)


def looked_at(window):
    """Width and level of the grey values."""
    return window.page.evaluate("""() => [document.getElementById("window-width").value,
        document.getElementById("window-level").value].map(Number)""")


def check_planes(window, image, data, at):
    """Every plane through a voxel, pixel by pixel, against another reader's volume, once the page has drawn them."""
    end = time.monotonic() + WAIT / 1000
    while (wrong := wrong_planes(window, image, data, at)) and time.monotonic() < end:
        time.sleep(0.05)
    assert not wrong, wrong


def wrong_planes(window, image, data, at):
    """How many pixels of a plane through a voxel differ, by the name of its view."""
    look = looked_at(window)
    i, j, k = image.TransformPhysicalPointToIndex(at)
    planes = {"axial": data[k], "coronal": data[::-1, j], "sagittal": data[::-1, :, i]}
    wrong = {}
    for name, plane in planes.items():
        wanted, drawn = grey(plane.astype(float), look), window.pixels(name)
        if wanted.shape != drawn.shape or (wanted != drawn).any():
            wrong[name] = int(np.sum(wanted != drawn)) if wanted.shape == drawn.shape else drawn.shape
    return wrong
