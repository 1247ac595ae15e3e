#!/bin/sh
#SBATCH --array=1-1000%200 --cpus-per-task=2 --mem=3300 --time=20
name=$(sed -n "${SLURM_ARRAY_TASK_ID}p" names.txt)
supine run "$name/case.toml" --out "results/runs/$name" --status "results/status/$name.json" --threads 2
