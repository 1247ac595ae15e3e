"""What is asked of Kubernetes, and that it works in a container that sees the volume and nothing else."""

import shutil

from cohort import SNAKEFILE, TYPO
from kubernetes_api import Kubernetes


def test_a_cohort_on_kubernetes(cohort, tmp_path):
    volume = cohort.folder
    cohort.add("good", TYPO)
    cohort.add("later", TYPO, plan="75")
    # The sources are sent from the working folder, so that they lie below it.
    shutil.copytree(SNAKEFILE.parent, volume / "workflow")
    cohort.snakefile = volume / "workflow/Snakefile"
    own = ["--default-storage-prefix", volume, "--kubernetes-persistent-volumes", f"cohort:{volume}",
           "--container-image", "site/supine:1", "--seconds-between-status-checks", "1"]
    with Kubernetes(tmp_path / "kubernetes", cohort.environment()) as kubernetes:
        done = cohort.snakemake(*own, profile="kubernetes", environment=kubernetes.environment)
    for log in (tmp_path / "kubernetes").glob("*.log"):
        print(log.read_text())
    assert done.returncode == 0
    assert cohort.codes() == {"good": 1, "later": 1}
    assert len(cohort.table()) == 2
    pods = [job["spec"]["template"]["spec"] for job in kubernetes.jobs]
    assert len(pods) == 3
    for pod in pods:
        assert pod["containers"][0]["image"] == "site/supine:1"
        assert pod["volumes"][1]["persistentVolumeClaim"]["claimName"] == "cohort"
    asked = sorted(int(pod["containers"][0]["resources"]["requests"]["memory"][:-1]) for pod in pods)
    assert asked[0] == asked[1] and asked[2] == 2 * asked[0]
