"""What is measured: a case of the wanted number of slices, the peers' pages, the meshes. All of it lies in the work folder."""

import functools
import http.server
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import numpy as np
import pydicom

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent.parent / "crates" / "workstation" / "page"
# Of a view of the workstation in a window of 1280x800.
WIDE, HIGH = 496, 357
PEERS = {"slices": ["vtk", "niivue", "cornerstone"], "mesh": ["vtk", "three", "niivue", "ours"]}
MESHES = {"10k": (51, 100), "100k": (159, 316)}


def stretched(case, slices, work):
    """The case with its CT brought to that many slices, each a copy of the nearest one; 0 leaves it alone."""
    text = case.read_text()
    source = case.parent / re.search(r'^ct = "(.*)"', text, re.M)[1]
    to = work / f"case-{slices}"
    if slices == 0:
        return case
    if (to / "case.toml").exists():
        return to / "case.toml"
    shutil.rmtree(to, ignore_errors=True)
    (to / "ct").mkdir(parents=True)
    files = [pydicom.dcmread(path) for path in sorted(source.iterdir()) if path.is_file()]
    files.sort(key=lambda file: float(file.ImagePositionPatient[2]))
    low, high = (float(files[n].ImagePositionPatient[2]) for n in (0, -1))
    step = (high - low) / (slices - 1)
    series = pydicom.uid.generate_uid()
    for n in range(slices):
        file = files[round(n * (len(files) - 1) / (slices - 1))]
        file.ImagePositionPatient[2] = f"{low + n * step:.6f}"
        file.SliceThickness = f"{step:.6f}"
        file.SliceLocation = file.ImagePositionPatient[2]
        file.InstanceNumber = n + 1
        file.SeriesInstanceUID = series
        file.SOPInstanceUID = file.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
        file.save_as(to / "ct" / f"{n + 1:04}.dcm")
    (to / "case.toml").write_text(re.sub(r'^ct = ".*"', 'ct = "ct"', text, flags=re.M))
    return to / "case.toml"


class Supine:
    """The program itself with the case open; its CT is given to the peers, so all show the same voxels."""

    def __init__(self, program, case):
        self.process = subprocess.Popen([program, "open", str(case), "--no-browser", "--json"], stdout=subprocess.PIPE, text=True)
        lines = ""
        while '"address"' not in lines or "}" not in lines:
            line = self.process.stdout.readline()
            if not line:
                raise SystemExit("supine has ended without an address")
            lines += line
        self.address = json.loads(lines)["address"]
        self.origin, self.token = self.address.split("/#")

    def read(self, path):
        request = urllib.request.Request(self.origin + path, headers={"Authorization": f"Bearer {self.token}"})
        return urllib.request.urlopen(request).read()

    def write_volume(self, site):
        """Once the CT is read and the segmenter has been made ready beside: that work would run into the first figures."""
        for _ in range(600):
            state = json.loads(self.read("/api/state"))
            volume = next((one for one in state["volumes"] if one["id"] == "ct"), None)
            if volume and (state.get("live") or {}).get("segmenter") != "preparing":
                break
            time.sleep(0.5)
        else:
            raise SystemExit(f"the case does not get ready: {state['problem'] or state['phase']}")
        (site / "volume.raw").write_bytes(self.read(f"/api/volume/ct/{volume['key']}"))
        (site / "volume.json").write_text(json.dumps({"size": volume["size"], "spacing": volume["spacing_mm"]}))
        return volume["size"]

    def stop(self):
        self.process.terminate()
        self.process.wait()


def write_mesh(site, name):
    """A ball with bumps, closed and wound outwards."""
    rings, around = MESHES[name]
    polar, azimuth = np.meshgrid(np.linspace(0.01, np.pi - 0.01, rings), np.arange(around) * 2 * np.pi / around, indexing="ij")
    radius = 85 + 9 * np.sin(5 * azimuth) * np.sin(polar) ** 2 + 6 * np.cos(7 * polar)
    points = radius[..., None] * np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    ring, at = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a, b = ring * around + at, ring * around + (at + 1) % around
    triangles = np.stack([a, a + around, b, b, a + around, b + around], axis=-1)
    (site / f"{name}.points").write_bytes(points.astype("<f4").tobytes())
    (site / f"{name}.triangles").write_bytes(triangles.astype("<u4").tobytes())
    return triangles.size // 3


def install(work):
    """The peers, of the locked versions, unless they are there."""
    to = work / "npm"
    lock = HERE / "package-lock.json"
    done = to / "installed.json"
    if not (done.exists() and done.read_bytes() == lock.read_bytes()):
        to.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(HERE / name, to)
        # No package's own scripts are run.
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"], cwd=to, check=True,
                       stdout=sys.stderr)
        shutil.copy(lock, done)
    return to / "node_modules"


def write_pages(modules, site):
    for kind, peers in PEERS.items():
        for peer in peers:
            name = f"{peer}-{kind}"
            subprocess.run(
                [modules / ".bin" / "esbuild", HERE / "peers" / f"{name}.js", "--bundle", "--minify", "--format=esm", "--log-level=error",
                 f"--outfile={site / name}.js"], env={**os.environ, "NODE_PATH": str(modules)}, check=True)
            html = (HERE / "page.html").read_text()
            for word, text in (("NAME", name), ("KIND", kind), ("WIDE", str(WIDE)), ("HIGH", str(HIGH))):
                html = html.replace(word, text)
            (site / f"{name}.html").write_text(html)


def versions():
    return {name.split("/")[-1]: version for name, version in json.loads((HERE / "package.json").read_text())["devDependencies"].items()}


class Files(http.server.SimpleHTTPRequestHandler):
    """The site; below /page/ the workstation's own modules."""

    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".js": "text/javascript"}

    def translate_path(self, path):
        site, self.directory = self.directory, str(PAGE.parent) if path.startswith("/page/") else self.directory
        found = super().translate_path(path)
        self.directory = site
        return found

    def log_message(self, *_):
        pass


def serve(site):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, directory=str(site)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}"
