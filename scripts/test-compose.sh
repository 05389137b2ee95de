#!/usr/bin/env bash
# Brings the compose stack up on a port of its own, runs the tests of tests/tests/compose.rs against it and takes
# it down again. Needs a Docker engine: scripts/docker-engine.sh lends one.
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf 'compose: %s\n' "$*" >&2; }

# On Debian the program built here goes into the image, and stand-ins for the base images can be made of the same
# release; elsewhere the image builds its own program, on images from a registry.
postgres=15
export MAREY_BINARIES=build MAREY_DEBIAN=bookworm
# shellcheck disable=SC1091 # the machine's own
case $(. /etc/os-release && echo "${ID:-}-${VERSION_CODENAME:-}") in
debian-bookworm) MAREY_BINARIES=prebuilt ;;
debian-trixie) MAREY_BINARIES=prebuilt MAREY_DEBIAN=trixie postgres=17 ;;
esac
export MAREY_POSTGRES=$postgres-$MAREY_DEBIAN

if [[ $MAREY_BINARIES == prebuilt ]]; then
    scripts/phase.sh "build marey" cargo build --release --locked -p marey
    install -D "${CARGO_TARGET_DIR:-target}/release/marey" dist/marey
fi
# Built before the stack is up, and then run as they are.
built=$(mktemp)
CARGO_TERM_COLOR=never scripts/phase.sh "build the tests" \
    cargo test --release --locked --workspace --test compose --no-run 2>&1 | tee "$built" >&2
tests=$(sed -n 's/^ *Executable .*compose.*(\(.*\))$/\1/p' "$built")
rm -f "$built"
[[ -x $tests ]] || { say "cargo did not say where the compose tests are"; exit 1; }
scripts/docker-base-images.sh "$MAREY_DEBIAN" "$postgres"

# A name and a port of its own: another stack on this machine is not touched.
project=marey-test-$$
export MAREY_VERSION=test MAREY_PORT=0
MAREY_BOOTSTRAP_KEY=mk_$(od -An -N16 -tx1 /dev/urandom | tr -d ' \n')
export MAREY_BOOTSTRAP_KEY
if docker compose version >/dev/null 2>&1; then compose=(docker compose); else compose=(docker-compose); fi
compose+=(--project-name "$project" --file deploy/compose.yaml)

scripts/phase.sh "build the image" docker build --quiet --file deploy/Dockerfile --tag "marey:$MAREY_VERSION" \
    --build-arg "BINARIES=$MAREY_BINARIES" --build-arg "DEBIAN=$MAREY_DEBIAN" . >/dev/null

take_down() {
    local status=$?
    trap - EXIT
    if ((status)); then "${compose[@]}" ps >&2 || true; "${compose[@]}" logs --no-color --tail 60 >&2 || true; fi
    "${compose[@]}" down --volumes --remove-orphans --timeout 10 >/dev/null 2>&1 || say "could not take $project down"
    exit "$status"
}
trap take_down EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

is_healthy() {
    local container
    for container in $("${compose[@]}" ps --quiet "$1"); do
        [[ $(docker inspect --format '{{.State.Health.Status}}' "$container") == healthy ]] || return 1
    done
    [[ -n ${container:-} ]]
}
bring_up() {
    "${compose[@]}" up --detach --no-build
    local service deadline=$((SECONDS + 120))
    for service in gateway motion-index reconstruction; do
        until is_healthy "$service"; do
            ((SECONDS < deadline)) || { say "$service is not healthy after 120 s"; return 1; }
            sleep 0.5
        done
    done
}
start=$SECONDS
bring_up
address=$("${compose[@]}" port gateway 8080)
say "the stack is up after $((SECONDS - start)) s, its gateway at $address"

export MAREY_COMPOSE_URL=http://$address MAREY_COMPOSE_KEY=$MAREY_BOOTSTRAP_KEY MAREY_COMPOSE_COMMAND="${compose[*]}"
# One after the other: they share the stack and change how many replicas it has.
scripts/phase.sh "tests against the stack" "$tests" --test-threads=1
