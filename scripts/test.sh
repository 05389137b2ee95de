#!/usr/bin/env bash
# Every test: those of the workspace, then those against the compose stack where a Docker engine answers
# (MAREY_TEST_COMPOSE=auto; always: an engine is started if need be; never). Closes with what ran and what was skipped.
set -euo pipefail
cd "$(dirname "$0")/.."
compose=${MAREY_TEST_COMPOSE:-auto}

log=$(mktemp)
trap 'rm -f "$log"' EXIT
failed=()
# Keeps going after a failure, so that one run tells everything.
phase() {
    local name=$1
    scripts/phase.sh "$@" 2>&1 | tee -a "$log" || failed+=("$name")
}

scripts/phase.sh "set-up" scripts/setup.sh
# The pages' client in Python needs a package from PyPI; where there is no Python for it, that example is skipped.
python=$(realpath -m "${CARGO_TARGET_DIR:-target}")/python
if ! python3 -c 'import websockets.asyncio' 2>/dev/null; then
    [[ -x $python/bin/pip ]] || python3 -m venv "$python" >/dev/null || true
    "$python/bin/pip" install --quiet websockets 2>/dev/null || true
    export PATH="$python/bin:$PATH"
fi
phase "tests of the workspace" cargo test --release --locked --workspace --no-fail-fast \
    -- --show-output
case $compose in
auto) if docker info >/dev/null 2>&1; then compose=always; else compose=never; fi ;;
always | never) ;;
*) echo "MAREY_TEST_COMPOSE is '$compose', not auto, always or never" >&2; exit 2 ;;
esac
if [[ $compose == always ]]; then phase "tests in compose" scripts/docker-engine.sh scripts/test-compose.sh; fi

# A test that cannot run here says `skipped: NAME: WHY` and passes.
skipped=$(grep -o 'skipped: .*' "$log" | sort || true)
num_skipped=$(grep -c . <<<"$skipped" || true)
# the first phase had no compose stack, the second one did
if [[ $compose == always ]]; then skipped=$(grep -v ': no compose stack' <<<"$skipped" || true); fi

echo
if [[ -n $skipped ]]; then printf 'Not run on this machine:\n%s\n\n' "$skipped"; fi
awk -v quiet="$num_skipped" -v skipped="$(grep -c . <<<"$skipped" || true)" '
    # test result: ok. 12 passed; 0 failed; 0 ignored; …
    /^test result: / { for (i = 3; i <= NF; i++) { if ($i == "passed;") p += $(i-1); if ($i == "failed;") f += $(i-1) } }
    END { printf "%d passed, %d failed, %d skipped\n", p - quiet, f, skipped }' "$log"
if ((${#failed[@]})); then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
