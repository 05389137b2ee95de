#!/usr/bin/env bash
# phase.sh NAME COMMAND...: runs COMMAND and says how long it took and how it ended.
set -euo pipefail
name=$1
shift
printf '\n=== %s\n' "$name" >&2
start=$SECONDS status=0
"$@" || status=$?
if ((status)); then
    printf '=== %s: FAILED with status %d after %d s\n' "$name" "$status" $((SECONDS - start)) >&2
else
    printf '=== %s: ok in %d s\n' "$name" $((SECONDS - start)) >&2
fi
exit "$status"
