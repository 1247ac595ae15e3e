# One job per patient.


rule patient:
    input:
        case=there,
    output:
        ended=OUT + "/status/{name}.ended",
    log:
        OUT + "/logs/{name}.log",
    params:
        case=lambda wildcards: real(case_of(wildcards)),
        begin=begin_of,
        status=real(OUT + "/status/{name}.json"),
        run=real(OUT + "/runs/{name}"),
        options=options_of,
        inputs=inputs_of,
    threads: config["threads"]
    resources:
        mem_mb=memory_mb("run"),
        runtime=minutes("run"),
    shell:
        RUN
