# The cases, what a job asks for, and the one command that all patients' rules share.

import csv
import difflib
import hashlib
import json
import os
import re
import shlex
import tomllib

OUT = config["out"].rstrip("/")
SUPINE = config["supine"]
NAME = r"[A-Za-z0-9][A-Za-z0-9._-]*"


def keys_of(schema, path=""):
    """The keys of a case file, and whether each names files; former names are left out."""
    for key, of in schema["properties"].items():
        if of.get("deprecated"):
            continue
        if "properties" in of:
            yield path + key, False
            yield from keys_of(of, f"{path}{key}.")
        else:
            yield path + key, any(one.get("format") == "path" for one in of.get("anyOf", [of]))


with open(own("schemas/case.schema.json"), encoding="utf-8") as file:
    SCHEMA = json.load(file)
KEYS = dict(keys_of(SCHEMA))
# What columns were called before.
FORMER = {key.replace("table.", "bed."): key for key in KEYS if key.startswith("table.")}
REQUIRED = {*SCHEMA["required"], *(way["oneOf"][0]["required"][0] for way in SCHEMA["allOf"])}


def from_table(folder, value):
    """Paths of a column, one or a list as JSON has it, from the folder of the table, as `supine batch` takes them."""

    def whole(path):
        return os.path.abspath(real(os.path.join(folder, os.path.expanduser(path))))

    if not value.startswith("["):
        return whole(value)
    try:
        return json.dumps([whole(path) for path in json.loads(value)])
    except (TypeError, ValueError):
        return value


def check_whole(row):
    """What a row that names no case file lacks, in words."""
    lacking = [key for key in SCHEMA["properties"] if key in REQUIRED and not any(of == key or of.startswith(key + ".") for of in row)]
    return f"it names no case file and no {', '.join(lacking)}" if lacking else ""


def read_cases(table):
    """The rows of the table of cases by name: the case file, none where the columns say all, and what other columns change in
    it. A row that cannot be used ends the plan, not a job of hours later."""
    with open(real(table), newline="", encoding="utf-8-sig") as file:
        head = file.readline()
        file.seek(0)
        # As `supine batch`: semicolons or tabs where the head has those alone.
        others = [one for one in ";\t" if one in head and "," not in head]
        reader = csv.DictReader(file, delimiter=others[0] if others else ",")
        reader.fieldnames = [FORMER.get(column, column) for column in reader.fieldnames or []]
        rows = list(reader)
    for column in reader.fieldnames:
        if column and column not in (*KEYS, "name", "case"):
            near = difflib.get_close_matches(column, [*KEYS, *FORMER], 1)
            hint = f"; did you mean {FORMER.get(near[0], near[0])}?" if near else ""
            raise WorkflowError(f"{table}: the column {column!r} is no key of a case file{hint}")
    cases = {}
    for line, row in enumerate(rows, start=2):
        row = {key: value.strip() for key, value in row.items() if key and value and value.strip()}
        name, case = row.pop("name", ""), row.pop("case", "")
        if not re.fullmatch(NAME, name):
            raise WorkflowError(f"{table}, line {line}: the name {name!r} is no name of a folder; use letters, digits, . _ -")
        if name in cases:
            raise WorkflowError(f"{table}, line {line}: {name} stands there twice; every patient needs a name of her own")
        lacking = "" if case else check_whole(row)
        if lacking:
            raise WorkflowError(f"{table}, line {line}: {name} cannot be run: {lacking}")
        folder = os.path.dirname(table)
        changes = {key: from_table(folder, value) if KEYS[key] else value for key, value in row.items()}
        cases[name] = {"case": os.path.join(folder, case) if case else None, "changes": changes}
    if not cases:
        raise WorkflowError(f"{table} holds no case")
    return cases


CASES = read_cases(config["cases"])


wildcard_constraints:
    name=NAME,


def case_of(wildcards):
    """The case file; of a row that names none an empty one, which its job writes: all values stand in the row."""
    return CASES[wildcards.name]["case"] or f"{OUT}/cases/{wildcards.name}.toml"


def there(wildcards):
    """The case file as an input of its job. One that is missing is no reason not to plan the others: its own job says so."""
    case = CASES[wildcards.name]["case"]
    return [case] if case and os.path.exists(real(case)) else []


def begin_of(wildcards):
    """What its job does first."""
    if CASES[wildcards.name]["case"]:
        return ""
    case = shlex.quote(real(case_of(wildcards)))
    return f"mkdir -p {shlex.quote(real(OUT + '/cases'))}; echo '# All values stand in the table of cases.' > {case}"


def options_of(wildcards):
    changes = CASES[wildcards.name]["changes"].items()
    return " ".join([config["options"], *(f"--set {shlex.quote(f'{key}={value}')}" for key, value in changes)])


def files_below(path, whole_folder):
    """The files that are read when a key of the case names this path: of one slice of a CT, those of its folder; of a header
    whose samples lie beside it, what is called alike."""
    if not os.path.exists(path):
        return []
    if not os.path.isdir(path):
        folder, name = os.path.split(path)
        if whole_folder and not name.lower().endswith(VOLUMES):
            return files_below(folder or ".", False)
        start = os.path.splitext(name)[0] + "."
        beside = sorted(other for other in os.listdir(folder or ".") if other.startswith(start))
        return [path, *(os.path.join(folder, other) for other in beside if other != name)]
    return sorted(os.path.join(folder, file) for folder, _, files in os.walk(path) for file in files)


VOLUMES = (".nrrd", ".nhdr", ".mha", ".mhd", ".nii", ".nii.gz")


def named_files(case, changes):
    """Key and path of each file that a case names, or a row without one."""
    values, folder = {}, os.path.dirname(case) if case else ""
    if case:
        with open(case, "rb") as file:
            values = tomllib.load(file)
    for key in (key for key, is_file in KEYS.items() if is_file):
        value = values
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        value = changes.get(key, value)
        if isinstance(value, str) and value.startswith("["):
            value = json.loads(value)
        for path in value if isinstance(value, list) else [value] if value else []:
            yield key, os.path.join(folder, os.path.expanduser(path))


def inputs_of(wildcards):
    """Tells the content of all files that a case names from what it was: sizes and times, that of the last change of the entry
    too, which no program can set back. `supine` looks at the content itself, and makes nothing anew where that is the same."""
    case = CASES[wildcards.name]
    told = hashlib.blake2b(digest_size=16)
    # What cannot be read is no reason not to plan the others, nor to leave the other files out; `supine` says what is wrong with it.
    try:
        named = list(named_files(case["case"] and real(case["case"]), case["changes"]))
    except (OSError, TypeError, ValueError):
        named = []
    for key, path in named:
        try:
            files = [(file, os.stat(file)) for file in files_below(path, key == "ct")]
        except OSError:
            files = []
        for file, at in files:
            told.update(repr((key, file, at.st_size, at.st_mtime_ns, at.st_ctime_ns)).encode())
    return told.hexdigest()


def voxels_of(name):
    """Voxels of a CT: as the configuration says, else by what lies there. A slice counts as 512 x 512, a file of a volume as
    two bytes per voxel, or one when it is compressed: rather too many than too few."""
    if config["voxels"]:
        return config["voxels"]
    case = CASES[name]
    try:
        ct = next(path for key, path in named_files(case["case"] and real(case["case"]), case["changes"]) if key == "ct")
        files = files_below(ct, True)
        if not ct.lower().endswith(VOLUMES):
            return len(files) * 512 * 512
        return sum(map(os.path.getsize, files)) // (1 if ct.lower().endswith((".nrrd", ".gz")) else 2)
    except (OSError, StopIteration, TypeError, ValueError):
        # A case that cannot be read is no reason not to plan the others; `supine` says what is wrong with it.
        return 0


with open(own("resources.csv"), newline="") as file:
    MEASURED = sorted(csv.DictReader(file), key=lambda row: int(row["voxels"]))


def measured(stage, name):
    """Peak (MB) and time (core seconds) of a stage: of the smallest measured CT that is not smaller; of one that is
    larger than all, in proportion."""
    rows = [row for row in MEASURED if row["stage"] == stage]
    voxels = voxels_of(name)
    row = next((row for row in rows if int(row["voxels"]) >= voxels), rows[-1])
    beyond = max(1.0, voxels / int(row["voxels"]))
    return float(row["memory_mb"]) * beyond, float(row["core_seconds"]) * beyond


def memory_mb(stage):
    def ask(wildcards, attempt):
        return int(measured(stage, wildcards.name)[0] * config["memory_factor"]) * attempt

    return ask


def minutes(stage):
    def ask(wildcards, attempt, threads):
        seconds = measured(stage, wildcards.name)[1] / min(threads, 2)
        return max(config["least_minutes"], int(seconds * config["time_factor"] / 60) + 1) * attempt

    return ask


# Snakemake sees only whether a job ended with 0. So the code of `supine` is sorted here: what another attempt cannot change
# (1 input, 3 method, 4 verdict) is a result like any other and stands in status/NAME.json; anything else fails the job, which
# is tried again in the same run folder and goes on where it was. Run folder and status are no outputs, which Snakemake removes
# when a job fails; its output is the code that `supine` ended with.
RUN = r"""
mkdir -p "$(dirname {params.status:q})"
rm -f {params.status:q}
{params.begin}
code=0
{SUPINE} run {params.case:q} --out {params.run:q} --status {params.status:q} --threads {threads} --no-progress \
    {params.options} >> {log:q} 2>&1 || code=$?
case $code in
    0 | 1 | 3 | 4) test -s {params.status:q} && echo $code > {output.ended:q} ;;
    *) echo "{wildcards.name}: supine ended with $code" >&2; exit $code ;;
esac
"""

# It ends with 0 whatever became of the patients, of whom it prints a line each.
COLLECT = "{SUPINE} batch --collect --out {OUT:q} > /dev/null"
