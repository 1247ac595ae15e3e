"""A small cohort in a folder, and Snakemake on it."""

import csv
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
SNAKEFILE = HERE.parents[2] / "workflow/Snakefile"
# The middle slices of the fixture patient, which hold the breast: 256 x 256 each.
SLICES = slice(26, 70)
VOXELS = 44 * 256 * 256
# A small sphere with few linear tetrahedra: seconds on one core.
CASE = {
    "breast": '"left"',
    "table": "{ ap = 7.0, lat = 5.0 }",
    "tumour": "{ centre = [91.37, -248.09, -594.5], radius = 9.0 }",
    "region": "{ centre = [91.0, -235.0, -594.5], radius = 45.0 }",
    "mesh": "{ tetrahedra = 500, order = 1 }",
}
# A key that does not exist: the input cannot be used, 1.
TYPO = {"tumour": "{ center = [91.37, -248.09, -594.5], radius = 9.0 }"}
# A tumour within the chest wall: the verdict is red, 4.
RED = {"tumour": "{ centre = [81.8, -222.0, -612.5], radius = 9.0 }"}
# The mesh and what it rests on: what was kept when a run was killed after its mesh.
FIRST = {"segment", "region", "mesh"}
# What a run that begins by another's end lacks, `begin`, where it is to be killed after its mesh: labels and mesh, and so much after
# them that the kill comes before the end. Not the region: with the labels it would have all made again.
LATE = ("segment", "mesh", "solve", "export", "fields", "structures")
# All waits end after so many seconds: a cohort takes a minute, and much longer where the machine has other work.
PATIENCE = 1500


def write_case(folder, ct, changes=()):
    """A case file: what differs from the case above."""
    case = {"ct": json.dumps(str(ct)), **CASE, **dict(changes)}
    (folder / "case.toml").write_text("".join(f"{key} = {value}\n" for key, value in case.items()))


def comes(wanted):
    """Whether something comes to be before the patience ends."""
    end = time.monotonic() + PATIENCE
    while not wanted():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


class Cohort:
    def __init__(self, folder, supine, ct, finished):
        self.folder, self.supine, self.ct, self.finished = folder, supine, ct, finished
        self.snakefile, self.rows = SNAKEFILE, {}
        (folder / "plan").mkdir(parents=True)
        self.configure()

    def configure(self, **keys):
        keys = {"threads": 1, "voxels": VOXELS, "supine": str(HERE / "failing_supine.sh"), **keys}
        (self.folder / "config.yaml").write_text(json.dumps(keys))

    def add(self, name, changes=(), plan=None, ap=""):
        """A patient: what differs in her case file, what happens to her, and the tilt that the table of cases gives her."""
        (self.folder / name).mkdir(exist_ok=True)
        write_case(self.folder / name, self.ct, changes)
        self.rows[name] = f"{name},{name}/case.toml,{ap}\n"
        (self.folder / "cases.csv").write_text("name,case,table.ap\n" + "".join(self.rows.values()))
        if plan:
            (self.folder / "plan" / name).write_text(plan)

    def begin(self, name, stages):
        """Makes her run folder that of a finished run without these stages and its summary: what holds for her is there, the report
        with its pictures too, which are the dearest by far."""
        run = self.folder / "results/runs" / name
        shutil.copytree(self.finished, run, ignore=shutil.ignore_patterns("summary.json", "log.jsonl"), dirs_exist_ok=True)
        for stage in stages:
            (run / f".stages/{stage}.json").unlink()

    def command(self, *more, profile="local"):
        own = ["--snakefile", self.snakefile, "--workflow-profile", self.snakefile.parent / "profiles" / profile]
        place = ["--directory", self.folder, "--configfile", self.folder / "config.yaml"]
        return [sys.executable, "-B", "-m", "snakemake", *map(str, [*own, *place, *more])]

    def environment(self):
        # Snakemake keeps copies of its sources in the home folder otherwise.
        own = {"FAIL": str(self.folder), "FAIL_SUPINE": str(self.supine), "XDG_CACHE_HOME": str(self.folder / "cache")}
        return os.environ | own

    def snakemake(self, *more, profile="local", inside=list, environment=()):
        """Runs Snakemake to its end; what it said."""
        environment = self.environment() | dict(environment)
        command = inside(self.command(*more, profile=profile))
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, cwd=self.folder)
        print(done.stdout, done.stderr)
        return done

    def status(self, name):
        return json.loads((self.folder / f"results/status/{name}.json").read_text())

    def codes(self):
        """The exit code that each patient ended with."""
        files = (self.folder / "results/status").glob("*.ended")
        return {file.stem: int(file.read_text()) for file in files}

    def summary(self, name):
        return json.loads((self.folder / f"results/runs/{name}/summary.json").read_text())

    def made(self, name):
        """Stages of a run that its last call made, in place of finding them made."""
        return {stage["name"] for stage in self.summary(name)["run"]["stages"] if not stage["cached"]}

    def table(self):
        with open(self.folder / "results/cohort.csv", newline="") as file:
            return list(csv.DictReader(file))

    def calls(self):
        """What `supine` was asked for, line by line."""
        file = self.folder / "calls"
        return file.read_text().splitlines() if file.exists() else []
