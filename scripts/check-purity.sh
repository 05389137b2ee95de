#!/usr/bin/env bash
# Holds the first invariant of ARCHITECTURE.md: no domain crate does IO or reads the clock. Looks at what each
# crate depends on (transitively, as built for users) and at its source. With --self-test it first shows that
# it finds what it looks for.
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."

domain_crates=(model dense formats markers kinematics motion-db regression posterior sparse evaluation sample-motion contacts skeleton-fit body vision multi-view background shape-fit inverse-kinematics tracking features)
impure_crate='tokio|tokio-.*|async-std|smol|mio|hyper|sqlx|sqlx-.*|tonic|tonic-.*|axum|axum-.*|reqwest|ureq|object_store'
module='(fs|env|net|process)'
impure_path="\bstd::$module\b|\bstd::\{[^;]*\b$module\b|\b(Instant|SystemTime)\b|\b(Utc|Local)::now\b"

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

self_test() {
    local dir line
    dir=$(mktemp -d)
    # shellcheck disable=SC2064 # the folder of this call
    trap "rm -rf '$dir'" EXIT
    while IFS= read -r line; do
        printf '%b\n' "$line" >"$dir/lib.rs"
        [[ -n $(impure_lines "$dir") ]] || { echo "purity self-test: did not find: $line" >&2; exit 1; }
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
        [[ -z $(impure_lines "$dir") ]] || { echo "purity self-test: wrongly found: $line" >&2; exit 1; }
    done <<'PURE'
use std::{collections::BTreeMap, fmt};
//! unlike std::fs this needs no file
use std::time::Duration;
let offset = cell::env_of(net);
#[cfg(test)]\nmod tests {\n    use std::fs;\n}
PURE
    [[ -n $(impure_dependencies queue) ]] || { echo "purity self-test: crate queue seems pure" >&2; exit 1; }
    echo "purity self-test: ok"
}

[[ ${1:-} != --self-test ]] || self_test

failed=0
for crate in "${domain_crates[@]}"; do
    dependencies=$(impure_dependencies "$crate")
    if [[ -n $dependencies ]]; then
        printf 'crate %s depends on: %s\n' "$crate" "${dependencies//$'\n'/, }" >&2
        failed=1
    fi
    lines=$(impure_lines "crates/$crate/src")
    if [[ -n $lines ]]; then
        printf 'crate %s touches files, environment, network, processes or the clock:\n%s\n' "$crate" "$lines" >&2
        failed=1
    fi
done
((failed == 0)) || exit 1
echo "purity: ${#domain_crates[@]} domain crates do no IO and read no clock"
