# The table and the index page of all patients.


rule cohort:
    localrule: True
    input:
        expand(OUT + "/status/{name}.ended", name=CASES),
    output:
        table=local(OUT + "/cohort.csv"),
        page=local(OUT + "/index.html"),
    shell:
        COLLECT
