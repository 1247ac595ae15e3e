"""The same on a Slurm of one node, by Snakemake and by the script for those without an engine."""

import re

import pytest
from cohort import LATE, SNAKEFILE, TYPO, comes
from slurm import NoNamespaces, Slurm


def array(cohort, slurm):
    """What has become of each patient by the script of an array; the program is called by its name."""
    (cohort.folder / "names.txt").write_text("".join(f"{name}\n" for name in cohort.rows))
    (cohort.folder / "bin").mkdir()
    (cohort.folder / "bin/supine").symlink_to(cohort.supine)
    for name in cohort.rows:
        (cohort.folder / f"results/status/{name}.json").unlink()
    way = f"ALL,PATH={cohort.folder}/bin:/usr/bin:/bin"
    script = SNAKEFILE.parent / "examples/slurm_array.sh"
    slurm.ask("sbatch", f"--array=1-{len(cohort.rows)}", f"--export={way}", f"--chdir={cohort.folder}", str(script))
    assert comes(lambda: not slurm.ask("squeue", "--noheader")), "the array does not end"
    return {name: cohort.status(name)["exit"] for name in cohort.rows}


@pytest.fixture
def slurm(tmp_path):
    try:
        with Slurm(tmp_path / "slurm") as running:
            yield running
    except NoNamespaces as why:
        pytest.skip(str(why))


def test_a_cohort_on_slurm(cohort, slurm):
    cohort.add("good")
    cohort.begin("good", ["mesh", "export"])
    cohort.add("typo", TYPO)
    cohort.add("killed", plan="kill")
    cohort.begin("killed", LATE)
    # The profile waits as long as a busy cluster wants it to.
    soon = ["--slurm-init-seconds-before-status-checks", "1", "--seconds-between-status-checks", "1", "--latency-wait", "5"]
    done = cohort.snakemake(*soon, profile="slurm", inside=slurm.inside)
    jobs = slurm.ask("squeue", "--states=all", "--noheader", "--sort=i", "--format=%T %m %l %k").splitlines()
    again = array(cohort, slurm)
    assert done.returncode == 0
    assert cohort.codes() == {"good": 0, "typo": 1, "killed": 0}
    assert len(cohort.table()) == 3
    print("\n".join(jobs))
    assert sorted(job.split()[0] for job in jobs) == ["COMPLETED"] * 3 + ["FAILED"]
    # Memory and time of the second attempt are twice those of the first.
    asked = [re.search(r"(\d+)M (\S+)", job).groups() for job in jobs if job.endswith("killed")]
    assert int(asked[1][0]) == 2 * int(asked[0][0])
    assert "segment" not in cohort.made("killed")
    assert again == {"good": 0, "typo": 1, "killed": 0}
    assert not {"mesh", "export"} & cohort.made("good"), "what Snakemake had finished was made again"
