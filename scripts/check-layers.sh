#!/usr/bin/env bash
# Holds the first invariants of ARCHITECTURE.md. Every crate says in its Cargo.toml which layer it is of:
#
#   [package.metadata.marey]
#   layer = "domain"
#
# This looks at what may depend on what, and at the purity of the domain crates: none does IO or reads the clock, in its own
# source or in a crate that it depends on (transitively, as built for users). With --self-test it first shows that it finds
# what it looks for. Needs a Rust toolchain, bash and awk.
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."

impure_crate='tokio|tokio-.*|async-std|smol|mio|hyper|sqlx|sqlx-.*|tonic|tonic-.*|axum|axum-.*|reqwest|ureq|object_store'
module='(fs|env|net|process)'
impure_path="\bstd::$module\b|\bstd::\{[^;]*\b$module\b|\b(Instant|SystemTime)\b|\b(Utc|Local)::now\b"

# Prints `NAME LAYER FOLDER` of the crates whose manifests are given; the layer is `-` where there is none.
layers() {
    awk '
        function flush() { if (name != "") print name, (layer == "" ? "-" : layer), folder }
        FNR == 1 { flush(); name = layer = section = ""; folder = FILENAME; sub(/\/[^\/]*$/, "", folder) }
        /^\[/ { section = $0; sub(/[ \t]*(#.*)?$/, "", section) }
        { value = $0; sub(/^[^=]*=[ \t]*"/, "", value); sub(/".*/, "", value) }
        section == "[package]" && /^name[ \t]*=/ { name = value }
        section == "[package.metadata.marey]" && /^layer[ \t]*=/ { layer = value }
        END { flush() }' "$@"
}

# Prints what is wrong: crates without a layer, and dependencies that point the wrong way. LAYERS as `layers` prints them;
# TREE and DEV_TREE: `cargo tree` of every crate, direct dependencies only, with depths as prefixes.
wrong_directions() {
    awk '
        FILENAME == ARGV[1] {
            layer[$1] = $2
            if ($2 !~ /^(domain|edge|service|program|test)$/)
                print "crate " $1 " (" $3 ") has layer " $2 ", expected domain, edge, service, program or test"
            next
        }
        # domain <- edge <- service <- program; services know nothing of each other; tests know everything
        function may(from, to, is_dev) {
            if (from == "test") return 1
            if (is_dev) return to != "program" && (to != "service" || from == "program")
            if (to == "test") return 0
            if (from == "domain") return to == "domain"
            if (from == "edge") return to == "domain" || to == "edge"
            if (from == "service") return to == "domain" || to == "edge"
            return 1
        }
        { depth = substr($1, 1, 1); name = substr($1, 2) }
        depth == "0" { from = name; next }
        depth == "1" && (from in layer) && (name in layer) && from != name {
            is_dev = FILENAME == ARGV[3]
            if (!may(layer[from], layer[name], is_dev))
                print "crate " from " (" layer[from] ") depends on " name " (" layer[name] ")" (is_dev ? " for its tests" : "")
        }' "$1" "$2" "$3"
}

# Prints the forbidden crates that CRATE depends on.
impure_dependencies() {
    local tree
    tree=$(cargo tree --quiet --locked --package "$1" --edges normal --prefix none --format '{p}')
    cut -d' ' -f1 <<<"$tree" | sort -u | grep -Ex "$impure_crate" || true
}

# Prints the code of FILE line by line: comments and test modules blank, a `use` of several lines on its last.
code_of() {
    awk '
        {
            text = $0
            sub(/\/\/.*/, "", text)
            # an inline test module closes a file; one in a file of its own is left out by its name
            if (after_cfg_test && text ~ /^mod .*\{/) exit
            after_cfg_test = text ~ /^#\[cfg\(test\)\]/ || (after_cfg_test && text ~ /^[ \t]*$/)
            if (pending != "" || text ~ /^[ \t]*(pub )?use /) {
                pending = pending text
                text = pending
                if (text !~ /;/) { print ""; next }
                pending = ""
            }
            print text
        }' "$1"
}

# Prints `FILE:LINE:CODE` of each forbidden path in the crate folder DIR.
impure_lines() {
    local file
    find "$1" -name '*.rs' ! -name tests.rs ! -path "$1/tests/*" | sort | while IFS= read -r file; do
        code_of "$file" | grep -nE "$impure_path" | sed "s|^|$file:|" || true
    done
}

failed_self_test() {
    echo "layers self-test: $*" >&2
    exit 1
}

test_purity() {
    local dir=$1 line
    while IFS= read -r line; do
        printf '%b\n' "$line" >"$dir/lib.rs"
        [[ -n $(impure_lines "$dir") ]] || failed_self_test "did not find: $line"
    done <<'IMPURE'
use std::fs;
let text = std::fs::read_to_string(path)?;
use std::{\n    collections::BTreeMap,\n    env,\n};
pub use std::{fs::File, io::Read};
let start = std::time::Instant::now();
use std::time::SystemTime;
use std::net::TcpStream;
std::process::exit(1);
let now = chrono::Utc::now();
#[cfg(test)]\nmod tests;\nuse std::fs;
IMPURE
    while IFS= read -r line; do
        printf '%b\n' "$line" >"$dir/lib.rs"
        [[ -z $(impure_lines "$dir") ]] || failed_self_test "wrongly found: $line"
    done <<'PURE'
use std::{collections::BTreeMap, fmt};
//! unlike std::fs this needs no file
use std::time::Duration;
let offset = cell::env_of(net);
#[cfg(test)]\nmod tests {\n    use std::fs;\n}
PURE
    [[ -n $(impure_dependencies queue) ]] || failed_self_test "crate queue seems pure"
}

test_directions() {
    local dir=$1 name layer wrong found
    mkdir -p "$dir/manifests"
    for layer in domain edge service program test; do
        for name in "a-$layer" "b-$layer"; do
            mkdir -p "$dir/manifests/$name"
            printf '[package]\nname = "%s"\n\n[package.metadata.marey] # its place\nlayer = "%s"\n\n[dependencies]\nlayer = "1"\n' \
                "$name" "$layer" >"$dir/manifests/$name/Cargo.toml"
        done
    done
    layers "$dir"/manifests/*/Cargo.toml >"$dir/layers"
    [[ $(wc -l <"$dir/layers") -eq 10 ]] || failed_self_test "did not read all manifests"
    # every pair of layers, as a dependency and as one of tests
    for layer in domain edge service program test; do
        printf '0a-%s v0.0.0 (/a)\n' "$layer"
        printf "1b-%s v0.0.0 (/b)\n" domain edge service program test
        printf '1serde v1.0.0\n'
    done >"$dir/tree"
    wrong=$(wrong_directions "$dir/layers" "$dir/tree" /dev/null | wc -l)
    # domain: 4 of 5, edge: 3, service: 3, program: only test
    [[ $wrong -eq 11 ]] || failed_self_test "found $wrong wrong dependencies, expected 11"
    wrong=$(wrong_directions "$dir/layers" /dev/null "$dir/tree" | wc -l)
    # domain, edge and service: service and program; program: program
    [[ $wrong -eq 7 ]] || failed_self_test "found $wrong wrong dependencies of tests, expected 7"
    for found in "domain edge" "domain test" "edge service" "service service" "service program"; do
        printf '0a-%s v0.0.0 (/a)\n1b-%s v0.0.0 (/b)\n' $found >"$dir/tree"
        [[ -n $(wrong_directions "$dir/layers" "$dir/tree" /dev/null) ]] || failed_self_test "did not find: $found"
    done
    for found in "- a" "core b"; do
        echo "x $found" >"$dir/layers"
        [[ -n $(wrong_directions "$dir/layers" /dev/null /dev/null) ]] || failed_self_test "did not find layer: $found"
    done
    printf '[package]\nname = "x"\n' >"$dir/manifests/a-domain/Cargo.toml"
    [[ $(layers "$dir/manifests/a-domain/Cargo.toml") == "x - "* ]] || failed_self_test "did not miss a layer"
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [[ ${1:-} == --self-test ]]; then
    mkdir "$work/purity" "$work/directions"
    test_purity "$work/purity"
    test_directions "$work/directions"
    echo "layers self-test: ok"
fi

failed=0
layers crates/*/Cargo.toml services/*/Cargo.toml tests/Cargo.toml >"$work/layers"
direct_dependencies() {
    cargo tree --quiet --locked --workspace --all-features --target all --depth 1 --edges "$1" --prefix depth --format '{p}'
}
direct_dependencies normal,build >"$work/tree"
direct_dependencies dev >"$work/dev-tree"
wrong=$(wrong_directions "$work/layers" "$work/tree" "$work/dev-tree")
if [[ -n $wrong ]]; then
    printf 'dependencies point the wrong way:\n%s\n' "$wrong" >&2
    failed=1
fi

domain_crates=$(awk '$2 == "domain" { print $1, $3 }' "$work/layers")
# What computes is optimised, and cargo warns of a name in [profile] that is no crate, but not of one that is missing.
while read -r crate _; do
    if ! grep -qxF "[profile.release.package.$crate]" Cargo.toml; then
        echo "crate $crate (domain) has no [profile.release.package.$crate] in Cargo.toml: it would not be optimised" >&2
        failed=1
    fi
done <<<"$domain_crates"
while read -r crate folder; do
    dependencies=$(impure_dependencies "$crate")
    if [[ -n $dependencies ]]; then
        printf 'crate %s depends on: %s\n' "$crate" "${dependencies//$'\n'/, }" >&2
        failed=1
    fi
    lines=$(impure_lines "$folder/src")
    if [[ -n $lines ]]; then
        printf 'crate %s touches files, environment, network, processes or the clock:\n%s\n' "$crate" "$lines" >&2
        failed=1
    fi
done <<<"$domain_crates"
((failed == 0)) || exit 1
printf 'layers: %d crates point the right way; %d domain crates do no IO and read no clock\n' \
    "$(wc -l <"$work/layers")" "$(wc -l <<<"$domain_crates")"
