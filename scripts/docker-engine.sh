#!/usr/bin/env bash
# docker-engine.sh COMMAND...: runs COMMAND where a Docker engine answers. Where none does, installs Debian's,
# starts one of our own (own data root, socket and state), and stops it when COMMAND has ended, however it ended.
set -euo pipefail

say() { printf 'engine: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

# A client that can build: an old one has BuildKit inside, a newer one needs its buildx plugin.
choose_client() {
    local candidate major
    for candidate in $(type -ap docker); do
        major=$("$candidate" --version | sed -n 's/^Docker version \([0-9]*\)\..*/\1/p')
        if ((${major:-0} < 23)) || "$candidate" buildx version >/dev/null 2>&1; then
            PATH=$(dirname "$candidate"):$PATH
            return
        fi
    done
    return 1
}
has_compose() { docker compose version >/dev/null 2>&1 || command -v docker-compose >/dev/null; }
engine_answers() { docker info >/dev/null 2>&1; }

install_packages() {
    local packages=() name
    command -v apt-get >/dev/null || die "no Docker engine answers, and this is not Debian: please start one"
    ((EUID == 0)) || die "no Docker engine answers: start one, or run this as root, which installs and starts one"
    command -v dockerd >/dev/null || packages+=(docker.io iptables)
    has_compose || packages+=(docker-compose)
    apt_get update
    # separate packages since Debian 13
    for name in docker-cli docker-buildx; do
        if ! choose_client && [[ -n $(apt-cache madison "$name") ]]; then packages+=("$name"); fi
    done
    ((${#packages[@]})) || die "found no docker client that can build (its buildx plugin is missing)"
    say "installing ${packages[*]}"
    apt_get install --no-install-recommends "${packages[@]}"
}
apt_get() { DEBIAN_FRONTEND=noninteractive apt-get -yqq "$@" </dev/null >/dev/null; }

if ! choose_client || ! has_compose || { ! engine_answers && ! command -v dockerd >/dev/null; }; then
    install_packages
    hash -r
    choose_client || die "found no docker client that can build, even after the installation"
fi
export PATH DOCKER_BUILDKIT=1 COMPOSE_DOCKER_CLI_BUILD=1

# The installation may have started the system's own engine: then that one serves.
if engine_answers; then exec "$@"; fi
((EUID == 0)) || die "no Docker engine answers: start one, or run this as root, which starts one"

# Images and build cache outlive the engine; everything else is gone with it.
data_root=${MAREY_ENGINE_ROOT:-${XDG_CACHE_HOME:-$HOME/.cache}/marey/engine}
mkdir -p "$data_root"
exec 9>"$data_root.lock"
flock --nonblock 9 || { say "another run uses $data_root, waiting"; flock 9; }

# Short, since the path of a socket may have 107 bytes.
state=$(mktemp -d /tmp/marey-engine.XXXXXX)
export DOCKER_HOST=unix://$state/docker.sock
had_bridge=$([[ -e /sys/class/net/docker0 ]] && echo yes || echo no)
# In a session of its own, since COMMAND still needs it after a Ctrl-C at the terminal to clean up; and told to stop
# when this script dies, even of a SIGKILL.
setsid setpriv --pdeathsig TERM dockerd --data-root "$data_root" --exec-root "$state/exec" --pidfile "$state/pid" \
    --host "$DOCKER_HOST" --storage-driver overlay2 >"$state/log" 2>&1 9>&- </dev/null &
engine=$!

# shellcheck disable=SC2317 # called by the trap
stop_engine() {
    trap - EXIT
    # no container outlives the engine that was started for this run
    docker ps --quiet 2>/dev/null | xargs -r docker kill >/dev/null 2>&1 || true
    kill "$engine" 2>/dev/null || true
    wait "$engine" 2>/dev/null || true
    if [[ $had_bridge == no ]] && command -v ip >/dev/null; then ip link delete docker0 2>/dev/null || true; fi
    umount "$state"/exec/netns/* 2>/dev/null || true
    rm -rf "$state"
}
trap stop_engine EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

for _ in $(seq 150); do
    engine_answers && break
    kill -0 "$engine" 2>/dev/null || { tail -n 20 "$state/log" >&2; die "dockerd did not start"; }
    sleep 0.2
done
engine_answers || { tail -n 20 "$state/log" >&2; die "dockerd did not answer within 30 s"; }
say "started an engine of our own, data in $data_root"
# what a killed run left behind
{ docker container prune --force && docker volume prune --force && docker image prune --force; } >/dev/null

# In the foreground: a Ctrl-C reaches COMMAND too, which takes down what it built before the engine goes.
status=0
"$@" 9>&- || status=$?
exit "$status"
