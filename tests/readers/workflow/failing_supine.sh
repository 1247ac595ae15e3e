#!/bin/sh
# supine as it is where machines fail: what $FAIL/plan/NAME says happens to the patient of that name, once; each call is noted
# in $FAIL/calls. `kill`: killed, with the process that called it, as soon as the mesh is kept. `75`: no result now.
name=$(basename "$(dirname -- "$2")")
echo "$*" >> "$FAIL/calls"
plan=$(cat "$FAIL/plan/$name" 2> /dev/null)
if [ "$1" = run ] && [ -n "$plan" ]; then
    rm "$FAIL/plan/$name"
    [ "$plan" = kill ] || exit "$plan"
    "$FAIL_SUPINE" "$@" &
    until [ -e "$4/.stages/mesh.json" ]; do
        kill -0 $! 2> /dev/null || exit 70
        sleep 0.02
    done
    # The folder of the run is free when the process is gone, and not before.
    kill -KILL $!
    wait $! 2> /dev/null
    kill -KILL $$
fi
exec "$FAIL_SUPINE" "$@"
