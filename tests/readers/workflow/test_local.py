"""Cohorts on this machine: who fails does not stop the others, what is worth a retry is tried again, and what was finished is
not made again."""

import json
import os
import shutil
import signal
import subprocess

from cohort import FIRST, LATE, RED, TYPO, comes


def test_each_patient_ends_for_herself(cohort):
    cohort.add("good", ap="6")
    cohort.add("typo", TYPO)
    cohort.add("red", RED)
    cohort.begin("red", [])
    cohort.add("killed", plan="kill")
    cohort.begin("killed", LATE)
    cohort.add("later", TYPO, plan="75")
    cohort.add("gone")
    (cohort.folder / "gone/case.toml").unlink()
    done = cohort.snakemake()
    assert done.returncode == 0
    assert cohort.codes() == {"good": 0, "typo": 1, "red": 4, "killed": 0, "later": 1, "gone": 1}
    assert cohort.status("gone")["error"]["code"] == "case-unreadable"
    assert [cohort.status(name)["status"] for name in ("good", "typo", "red")] == ["flagged", "failed", "not-usable"]
    assert cohort.status("typo")["error"]["kind"] == "input"
    assert cohort.summary("good")["position"]["bed"]["ap_deg"] == 6
    assert len(cohort.table()) == 6
    # Killed once and refused once; each was asked for twice, the others once.
    runs = [call.split()[1].split("/")[-2] for call in cohort.calls() if call.startswith("run ")]
    assert sorted(runs) == ["gone", "good", "killed", "killed", "later", "later", "red", "typo"]
    assert FIRST & cohort.made("good") == FIRST
    assert not FIRST & cohort.made("killed"), "what was finished before the kill was made again"

    before = cohort.calls()
    again = cohort.snakemake()
    assert again.returncode == 0 and "Nothing to be done" in again.stdout + again.stderr
    assert cohort.calls() == before

    # A case that was put right is the only one that is run again.
    cohort.add("typo")
    cohort.begin("typo", ["mesh"])
    assert cohort.snakemake().returncode == 0
    assert cohort.codes()["typo"] == 0
    asked = cohort.calls()[len(before):]
    assert [call.split()[0] for call in asked] == ["run", "batch"] and "typo" in asked[0]


def test_what_fails_to_the_last_stays_to_be_done_and_the_table_is_there(cohort):
    cohort.add("typo", TYPO)
    cohort.add("full", TYPO, plan="75")
    done = cohort.snakemake("--retries", "0")
    assert done.returncode != 0
    assert cohort.codes() == {"typo": 1}
    assert "typo" in {row["name"] for row in cohort.table()}
    assert cohort.snakemake().returncode == 0
    assert cohort.codes() == {"typo": 1, "full": 1}


def test_after_snakemake_was_killed_the_next_one_goes_on(cohort):
    cohort.add("good")
    # Without its report: drawing that takes seconds, in which Snakemake is killed.
    cohort.begin("good", [*LATE, "report"])
    process = subprocess.Popen(
        cohort.command("--quiet", "all"), env=cohort.environment(), cwd=cohort.folder, start_new_session=True
    )
    mesh = cohort.folder / "results/runs/good/.stages/mesh.json"
    comes(lambda: mesh.exists() or process.poll() is not None)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert mesh.exists() and not (cohort.folder / "results/runs/good/summary.json").exists()
    cohort.snakemake("--unlock")
    assert cohort.snakemake().returncode == 0
    assert cohort.codes() == {"good": 0} and not FIRST & cohort.made("good")


def test_one_job_per_stage(cohort):
    cohort.configure(per_stage=True)
    cohort.add("good")
    cohort.begin("good", LATE)
    cohort.add("typo", TYPO)
    assert cohort.snakemake().returncode == 0
    assert cohort.codes() == {"good": 0, "typo": 1}
    assert cohort.status("typo")["error"]["kind"] == "input"
    asked = [call.split() for call in cohort.calls() if call.startswith("run ")]
    stages = [call[call.index("--until") + 1] if "--until" in call else "end" for call in asked if "good/case" in call[1]]
    assert stages == ["segment", "mesh", "solve", "export", "end"]
    assert sum("typo/case" in call[1] for call in asked) == 1, "a patient whose input cannot be used was run on"
    assert not FIRST & cohort.made("good")


def test_a_changed_slice_is_seen_whatever_its_time_says(cohort):
    ct = cohort.folder / "ct"
    shutil.copytree(cohort.ct, ct)
    cohort.add("own", {"ct": json.dumps(str(ct)), **TYPO})
    cohort.add("other", TYPO)
    assert cohort.snakemake().returncode == 0
    before = cohort.calls()
    changed = sorted(ct.iterdir())[3]
    was, content = changed.stat(), bytearray(changed.read_bytes())
    content[-1] ^= 1
    changed.write_bytes(content)
    os.utime(changed, ns=(was.st_atime_ns, was.st_mtime_ns))
    assert cohort.snakemake().returncode == 0
    assert ["own/case" in call for call in cohort.calls()[len(before):] if call.startswith("run ")] == [True]
    assert "Nothing to be done" in cohort.snakemake().stderr


def test_paths_in_a_table_lead_from_its_folder(cohort):
    cohort.add("moved")
    cohort.configure(cases="tables/cases.csv")
    (cohort.folder / "tables").mkdir()
    (cohort.folder / "tables/cases.csv").write_text("name,case,ct\nmoved,../moved/case.toml,nowhere\n")
    assert cohort.snakemake().returncode == 0
    error = cohort.status("moved")["error"]
    assert (error["code"], error["place"]["file"]) == ("input-missing", str(cohort.folder / "tables/nowhere"))


def test_a_table_whose_columns_say_all_needs_no_case_file(cohort):
    head = "name;ct;breast;bed.ap;table.lat;tumour.centre;tumour.radius;region.centre;region.radius;mesh.tetrahedra;mesh.order"
    rest = "left;7;5;91.37,-248.09,-594.5;9;91.0,-235.0,-594.5;45;500;1"
    os.symlink(cohort.ct, cohort.folder / "first")
    (cohort.folder / "cases.csv").write_text(f"{head}\nwhole;first;{rest}\ngone;second;{rest}\n")
    assert cohort.snakemake().returncode == 0
    assert cohort.codes() == {"whole": 0, "gone": 1}
    assert cohort.status("gone")["error"]["place"]["file"] == str(cohort.folder / "second")
    assert "Nothing to be done" in cohort.snakemake().stderr
    slice_of = sorted((cohort.folder / "first").iterdir())[0]
    os.utime(slice_of)
    assert "patient" in cohort.snakemake("--dry-run").stdout


def test_a_table_that_cannot_be_used_is_said_before_anything_runs(cohort):
    for header, row, why in (
        ("name,ct", "a,ct", "line 2: a cannot be run: it names no case file and no breast, table, tumour"),
        ("name,case", "a/b,x.toml", "no name of a folder"),
        ("name,case", "a,x.toml\na,y.toml", "twice"),
        ("name,case,table.app", "a,x.toml,5", "'table.app' is no key of a case file; did you mean table.ap?"),
        ("name,case,bed.app", "a,x.toml,5", "'bed.app' is no key of a case file; did you mean table.ap?"),
    ):
        (cohort.folder / "cases.csv").write_text(f"{header}\n{row}\n")
        done = cohort.snakemake("--dry-run")
        assert done.returncode != 0 and why in done.stdout + done.stderr
    cohort.configure(thread=2)
    assert "'thread' was unexpected" in cohort.snakemake("--dry-run").stdout
