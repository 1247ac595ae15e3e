# One job per stage of a patient: each goes on in the run folder that the one before left.

# The last has no `--until`: it makes what is missing, and the summary.
END = "report"
STAGES = [*config["stages"], END]


def ended(stage):
    """What a stage leaves; that of the last is the patient's."""
    return OUT + ("/status/{name}.ended" if stage == END else "/stages/{name}." + stage)


# After an input or a method that cannot be used there is nothing to go on from: code and status are handed on to the end.
SKIP = r"""
mkdir -p "$(dirname {params.status:q})"
if [ -n "{input.before}" ]; then
    case $(cat {input.before:q}) in
        1 | 3) cp {params.before:q} {params.status:q}; cp {input.before:q} {output.ended:q}; exit 0 ;;
    esac
fi
"""

for before, stage in zip([None, *STAGES], STAGES):

    rule:
        name:
            f"stage_{stage.replace('-', '_')}"
        input:
            case=there,
            before=ended(before) if before else [],
        output:
            ended=ended(stage),
        log:
            OUT + "/logs/{name}." + stage + ".log",
        params:
            case=lambda wildcards: real(case_of(wildcards)),
            begin=begin_of,
            before=lambda wildcards, before=before: real(ended(before).format(name=wildcards.name)) + ".json" if before else "",
            status=real(OUT + ("/status/{name}.json" if stage == END else "/stages/{name}." + stage + ".json")),
            run=real(OUT + "/runs/{name}"),
            options=options_of,
            inputs=inputs_of,
            until="" if stage == END else f"--until {stage}",
        threads: config["threads"]
        resources:
            mem_mb=memory_mb(stage),
            runtime=minutes(stage),
        shell:
            SKIP + RUN.replace("{params.options}", "{params.options} {params.until}")
