#!/usr/bin/env bash
# Installs what building and running Marey needs and this machine lacks: a C compiler and linker, the programs of
# a PostgreSQL server, and ffmpeg, which reads videos. Does nothing, quickly, where all is there. Never starts a
# server.
set -euo pipefail

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

has_server() {
    command -v initdb >/dev/null && command -v postgres >/dev/null && return
    local dir
    for dir in /usr/lib/postgresql/*/bin /usr/pgsql-*/bin /usr/libexec/postgresql*; do
        [[ -x $dir/initdb && -x $dir/postgres ]] && return
    done
    command -v pg_config >/dev/null && [[ -x $(pg_config --bindir)/initdb ]]
}

command -v cargo >/dev/null ||
    die "no Rust toolchain (cargo) found: install one with rustup, then run this again"

packages=()
command -v cc >/dev/null || packages+=(gcc libc6-dev)
has_server || packages+=(postgresql)
command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null || packages+=(ffmpeg)
((${#packages[@]})) || exit 0

if ! command -v apt-get >/dev/null; then
    say "this machine lacks: ${packages[*]}; it is not Debian, so please install them yourself:"
    say "  Fedora: dnf install gcc postgresql-server ffmpeg-free   Arch:  pacman -S gcc postgresql ffmpeg"
    say "  Alpine: apk add build-base postgresql ffmpeg            macOS: xcode-select --install; brew install postgresql ffmpeg"
    exit 1
fi

as_root=()
if ((EUID != 0)); then
    command -v sudo >/dev/null || die "missing ${packages[*]}: run as root: apt-get install ${packages[*]}"
    as_root=(sudo)
fi

# Debian's package would make a cluster of its own and start it; Marey keeps a private one.
config=/etc/postgresql-common/createcluster.conf
if [[ ${packages[*]} == *postgresql* && ! -e $config ]]; then
    "${as_root[@]}" mkdir -p "${config%/*}"
    printf 'create_main_cluster = false\n' | "${as_root[@]}" tee "$config" >/dev/null
    say "wrote $config, so that no system-wide cluster is made"
fi

say "installing ${packages[*]}"
install=(env DEBIAN_FRONTEND=noninteractive apt-get install -yqq --no-install-recommends
    -o Dpkg::Options::=--force-confold "${packages[@]}")
# A machine with fresh package lists needs no update; one without them gets it on the first failure.
"${as_root[@]}" "${install[@]}" >/dev/null 2>&1 </dev/null || {
    "${as_root[@]}" apt-get update -qq </dev/null
    "${as_root[@]}" "${install[@]}" </dev/null
}
has_server || die "installed postgresql, but found no initdb and postgres program afterwards"
