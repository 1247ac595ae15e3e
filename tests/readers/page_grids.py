"""The page shows the grid's own planes, voxel by voxel, on unusual grids: feet first, flipped, coronal, tilted, long.

page_grids.py SUPINE FOLDER: makes small series in FOLDER, which must not exist, opens each in the page, and compares what its
canvases hold with planes cut from SimpleITK's array; which axis is shown where follows from SimpleITK's directions and how
radiologists look at a patient, not from the server. A leaning stack must be refused. Ends with 0 when all is as it must be.
"""
import base64, json, os, signal, subprocess, sys, time
import numpy as np
import pydicom
import SimpleITK as sitk
from playwright.sync_api import sync_playwright
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

SUPINE, FOLDER = sys.argv[1:3]
# All waits end after so many ms: each takes a moment, and much longer where the machine has other work.
WAIT = 300_000
X, Y, Z = np.eye(3)
# Columns and rows, and their spacings, differ: a picture turned over its diagonal is seen.
SIZE, SPACING, CENTRE = (64, 48, 40), (0.7, 0.9, 1.5), np.array([12.3, -45.6, -312.4])
# By convention: the axis of LPS at right angles, then axis and sign to the right and downwards. From the feet, from the
# patient's left, from the front.
VIEWS = {"axial": (2, (0, 1), (1, 1)), "sagittal": (0, (1, 1), (2, -1)), "coronal": (1, (0, 1), (2, -1))}
LETTERS = ("RL", "AP", "FH")
# Rotations: 8 degrees about x, and 25 degrees about an axis that is none of the patient's.
TILT, SKEW = (np.array(sitk.VersorTransform(list(about), np.radians(turn)).GetMatrix()).reshape(3, 3)
              for about, turn in ((X, 8), (X + 2 * Y + 3 * Z, 25)))
# Directions of a row and of a column, Patient Position, size, and how many mm each slice is shifted along its columns.
SERIES = {
    "head_first": (X, Y, "HFS", SIZE, 0),
    "feet_first": (-X, Y, "FFS", SIZE, 0),
    "flipped_rows": (X, -Y, "HFS", SIZE, 0),
    "turned": (-X, -Y, "HFS", SIZE, 0),
    "swapped": (Y, X, "HFS", SIZE, 0),
    "coronal": (X, -Z, "HFS", SIZE, 0),
    "sagittal": (Y, -Z, "HFS", SIZE, 0),
    "sagittal_from_behind": (-Y, -Z, "FFS", SIZE, 0),
    "tilted": (TILT @ X, TILT @ Y, "HFS", SIZE, 0),
    "skew_feet_first": (SKEW @ -X, SKEW @ Y, "FFS", SIZE, 0),
    "long": (X, Y, "HFS", (64, 64, 600), 0),
    "gantry": (TILT @ X, TILT @ Y, "HFS", SIZE, SPACING[2] * np.tan(np.radians(8))),
}


def places(row, column, size, shift):
    """LPS of every voxel [k, j, i]."""
    i, j, k = (np.arange(n) - (n - 1) / 2 for n in size)
    step = SPACING[2] * np.cross(row, column) + shift * column
    return CENTRE + k[:, None, None, None] * step + j[:, None, None] * SPACING[1] * column + i[:, None] * SPACING[0] * row


def voxels(at, rng):
    """HU that vary smoothly with some noise, but for a bright ball near the corner that lies left, front, head; its place."""
    waves = rng.normal(size=(8, 3)) / 15
    hu = 900 * np.cos(at @ waves.T + rng.uniform(0, 6.28, 8)).mean(-1) - 350 + rng.integers(-60, 60, at.shape[:3])
    ends = np.array(list(np.ndindex(2, 2, 2))) * (np.array(at.shape[:3]) - 1)
    corner = max(ends, key=lambda end: at[tuple(end)] @ (X - Y + Z))
    place = at[tuple(np.where(corner == 0, 8, corner - 8))]
    hu = np.clip(hu, -1000, 900).astype(int)
    hu[np.linalg.norm(at - place, axis=-1) < 4.5] = 3000
    return hu, place


def write(name):
    """A series, its files in no order; the places to look at: one within, near the far corner, the marker."""
    row, column, position, size, shift = SERIES[name]
    rng = np.random.default_rng(len(name))
    hu, marker = voxels(at := places(row, column, size, shift), rng)
    series, study, frame = (generate_uid() for _ in range(3))
    os.makedirs(f"{FOLDER}/{name}")
    for k, number in enumerate(rng.permutation(size[2]).tolist()):
        one = pydicom.Dataset()
        one.file_meta = pydicom.dataset.FileMetaDataset()
        one.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        one.SOPClassUID, one.SOPInstanceUID, one.Modality = CTImageStorage, generate_uid(), "CT"
        one.StudyInstanceUID, one.SeriesInstanceUID, one.FrameOfReferenceUID = study, series, frame
        one.PatientName, one.PatientID, one.SeriesDescription, one.PatientPosition = "Grid", "G", name, position
        one.ImageType, one.InstanceNumber = ["ORIGINAL", "PRIMARY", "AXIAL"], number + 1
        one.ImagePositionPatient = [f"{x:.6f}" for x in at[k, 0, 0]]
        one.ImageOrientationPatient = [f"{x:.9f}" for x in (*row, *column)]
        one.PixelSpacing, one.RescaleSlope, one.RescaleIntercept = [SPACING[1], SPACING[0]], 1, -1024
        one.Columns, one.Rows, one.SamplesPerPixel, one.PhotometricInterpretation = size[0], size[1], 1, "MONOCHROME2"
        one.BitsAllocated, one.BitsStored, one.HighBit, one.PixelRepresentation = 16, 16, 15, 0
        one.PixelData = (hu[k] + 1024).astype("<u2").tobytes()
        one.save_as(f"{FOLDER}/{name}/{number:04}.dcm", enforce_file_format=True)
    return at[size[2] // 3, size[1] // 4, size[0] // 2 + 3], 2 * CENTRE - marker, marker


def turned(name):
    """The series as SimpleITK reads it, its axes put in the order of LPS, each the nearest, and made to grow as they do."""
    image = sitk.ReadImage(sitk.ImageSeriesReader.GetGDCMSeriesFileNames(f"{FOLDER}/{name}"))
    axes = np.abs(np.array(image.GetDirection()).reshape(3, 3)).argmax(1)
    image = sitk.PermuteAxes(image, axes.tolist())
    return sitk.Flip(image, (np.array(image.GetDirection())[::4] < 0).tolist())


def plane(image, view, voxel):
    """HU of a view's plane through a voxel of a turned image, row by row."""
    normal, (_, right), (_, down) = VIEWS[view]
    # The array is [z, y, x]: what is left of it has the axis downwards first in all three views.
    return sitk.GetArrayViewFromImage(image).take(voxel[normal], 2 - normal)[::down, ::right].astype(float)


# What is written on the lines of each view since they were cleared: word, and place as a share of the view.
LISTEN = """(() => {
    const written = window.written = {}, pen = CanvasRenderingContext2D.prototype, {clearRect, fillText} = pen;
    pen.clearRect = function (...all) { written[this.canvas.parentElement?.id] = []; return clearRect.apply(this, all); };
    pen.fillText = function (word, x, y) {
        const {a, d} = this.getTransform(), {width, height} = this.canvas;
        written[this.canvas.parentElement?.id]?.push([word, a * x / width, d * y / height]);
        return fillText.call(this, word, x, y); }; })()"""
VIEWS_TOLD = """() => import("/js/state.js").then(({now}) => now().server.views)"""
WHOLE = """() => import("/js/state.js").then(({now}) => {
    const {voxels: {ct}, crosshair} = now(); return ct && ct.arrived === ct.voxels.length && crosshair !== null; })"""
DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
PIXELS = """(view) => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
    const canvas = document.querySelector(`#view-${view} canvas.voxels`), pen = canvas.getContext("2d");
    const {data} = pen.getImageData(0, 0, canvas.width, canvas.height);
    const text = Array.from(data, (byte) => String.fromCharCode(byte)).join("");
    done([btoa(text), canvas.width, canvas.height, pen.isContextLost()]); })))"""


def pixels(page, view):
    """What a view's canvas holds. One that the browser took away is empty until the page has painted it again."""
    end = time.monotonic() + WAIT / 1000
    while True:
        text, width, height, lost = page.evaluate(PIXELS, view)
        drawn = np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)
        if not lost and drawn[..., 3].any() or time.monotonic() > end:
            break
        page.wait_for_timeout(50)
    coloured = (drawn[..., :3] != drawn[..., :1]).any(-1)
    assert not coloured.any(), f"{view}: {coloured.sum()} pixels are not grey, the first {drawn[coloured][0]}"
    assert (drawn[..., 3] == 255).all(), f"{view}: {(drawn[..., 3] != 255).sum()} pixels are translucent; lost: {lost}"
    return drawn[..., 0]


def check_planes(page, name, image, place, look):
    """Each view's plane through a place, pixel by pixel; a table of greys rounds halves to even, as canvas data are rounded."""
    snaps, end = int(name in ("tilted", "skew_feet_first")), time.monotonic() + WAIT / 1000
    # Twice on a tilted grid: the crosshair snaps to a voxel after each field, and the last one moves what the first ones gave.
    moves = [*zip(("place-L", "place-P", "place-S"), place.round(1))] * (1 + snaps)
    wanted = [*zip(("window-width", "window-level"), look), *moves]
    while True:
        for field, value in wanted:
            page.locator(f"#{field}").fill(str(value))
            page.locator(f"#{field}").press("Enter")
        # Fields are drawn with the next frame: until then they show where the crosshair was.
        page.evaluate(DRAWN)
        at = [float(page.locator(f"#place-{a}").input_value()) for a in "LPS"]
        voxel, asked = (np.array(image.TransformPhysicalPointToIndex(list(p))) for p in (at, place))
        # Where the machine has other work a frame may fall between a field and its Enter, and show the old place again.
        if np.abs(voxel - asked).max() <= snaps or time.monotonic() > end:
            break
    assert np.abs(voxel - asked).max() <= snaps, f"{name}: the crosshair is at {at}, not {place}"
    for view in VIEWS:
        hu = plane(image, view, voxel.tolist())
        right = np.clip(np.rint(((hu - look[1]) / look[0] + 0.5) * 255), 0, 255)
        drawn = pixels(page, view)
        end = time.monotonic() + WAIT / 1000
        # Where the machine has other work the page may draw a frame later.
        while (right.shape != drawn.shape or (right != drawn).any()) and time.monotonic() < end:
            page.wait_for_timeout(50)
            drawn = pixels(page, view)
        assert right.shape == drawn.shape, f"{name} {view}: {drawn.shape} pixels, not {right.shape}"
        assert (right == drawn).all(), f"{name} {view} at {at}: {np.sum(right != drawn)} of {right.size} pixels differ"


def check_sides(page, name):
    """The letters as told and as drawn; and the marker, put left, front, head without any reader, is seen on their sides."""
    told = {view["name"]: view["letters"] for view in page.evaluate(VIEWS_TOLD)}
    for view, (_, *sides) in VIEWS.items():
        letters = [letter for axis, sign in sides for letter in LETTERS[axis][::sign]]
        assert told[view] == letters, f"{name} {view}: told are {told[view]}, not {letters}"
        white = pixels(page, view) == 255
        y, x = (np.mean(n) > size / 2 for n, size in zip(np.nonzero(white), white.shape))
        seen = [letters[int(x)], letters[2 + int(y)]]
        assert set(seen) <= set("LAH"), f"{name} {view}: the marker, left, front, head, is seen at {seen}"
        short = [one for one in page.evaluate("() => window.written")[f"view-{view}"] if len(one[0]) == 1]
        drawn = [way(short, key=lambda one: one[n])[0] for n in (1, 2) for way in (min, max)]
        assert len(short) == 4 and drawn == letters, f"{name} {view}: drawn are {short}, not {letters}"


def check_restored(page):
    """A canvas that the browser took away and gave back empty is painted again."""
    for view in VIEWS:
        before = pixels(page, view)
        page.evaluate("""(view) => { for (const canvas of document.querySelectorAll(`#view-${view} canvas`)) {
            canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
            canvas.dispatchEvent(new Event("contextrestored")); } }""", view)
        assert (pixels(page, view) == before).all(), f"{view}: not painted again"


def check_series(page, name, looks):
    card = page.locator(".card")
    card.wait_for()
    if name == "gantry":
        why = card.inner_text()
        assert "not usable" in why and "(gantry tilt)" in why and "8.00 degrees" in why, why
        assert card.get_by_role("button").count() == 0, "a leaning stack can be opened"
        return
    card.get_by_role("button", name="Open").click()
    page.wait_for_function(WHOLE)
    image = turned(name)
    # The page's own window; one of finer steps; one in which the marker alone is white.
    for place, look in zip(looks, ((400, 40), (700, -300), (2000, 0))):
        check_planes(page, name, image, place, look)
    check_sides(page, name)
    check_restored(page)


def check(browser, name):
    looks = write(name)
    server = subprocess.Popen([SUPINE, "open", f"{FOLDER}/{name}", "--no-browser", "--json"], stdout=subprocess.PIPE, text=True)
    try:
        text = ""
        while "}" not in text:
            text += server.stdout.readline() or sys.exit(f"{name}: the server ended")
        page = browser.new_page()
        page.set_default_timeout(WAIT)
        page.add_init_script(LISTEN)
        page.goto(json.loads(text)["address"])
        check_series(page, name, looks)
        page.close()
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=WAIT / 1000) == 0, f"{name}: the server did not end well"
    finally:
        server.kill()


if __name__ == "__main__":
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", timeout=WAIT,
                                             args=["--no-sandbox", "--disable-3d-apis", "--disable-dev-shm-usage"])
        for name in SERIES:
            check(browser, name)
        browser.close()
