#!/usr/bin/env bash
# References that code and documents make must lead somewhere: every docs/NAME.md, every docs/NAME.md#section
# and every `crates/…` or `services/…` path that is named exists, nothing refers to documents or numberings
# that are not in the repository, and comments that name a paper say where docs/papers.md has it. With --self-test
# it first shows that it finds what it looks for.
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")/.."

# Short names of papers and sections of notes that only their authors have; docs/papers.md is what may be named.
dangling='method(\.md)? §|design(\.md)? §|\bmends? [0-9]|\bMM (eq\.|§)|\bIK eq\.|\bIBIK\b'
dangling+='|\bLR(-zh)?,? (eq\.|table|[0-9])|\bLR-zh\b|\(LR\)|\b[Tt]he Chinese paper\b'

# A comment that names a paper: `(Baran and Popović 2007`, `Prati et al. 2003`, `Ericson, 2005`.
citation='//.*\b[A-Z][^ .]+( et al\.)?,? (19[5-9]|20[0-2])[0-9]\b'

# Prints the anchors of the headings of a Markdown file.
anchors() {
    sed -nE 's/^#+ +//p' "$1" | tr '[:upper:]' '[:lower:]' | sed -E 's/[^[:alnum:] _-]//g; s/ /-/g'
}

# Prints `FILE:LINE:REFERENCE` of each reference of the files given that leads nowhere.
broken() {
    local file line reference page section
    {
        grep -nHoE '\bdocs/[a-z-]+\.md(#[a-z0-9-]+)?' "$@" || true
        # links between documents name their neighbours without the folder
        grep -nHoE '\]\(([a-z-]+\.md)?#[a-z0-9-]+\)' "$@" | grep -E '(^|/)docs/[a-z-]+\.md:' |
            sed -E 's|^(.*docs/)([a-z-]+\.md)(:[0-9]+:)\]\(#(.*)\)$|\1\2\3docs/\2#\4|; s|\]\((.*)\)$|docs/\1|' || true
    } | while IFS=: read -r file line reference; do
        page=${reference%%#*} section=${reference#"$page"}
        if [[ ! -f $page ]]; then
            echo "$file:$line: $page does not exist"
        elif [[ -n $section ]] && ! anchors "$page" | grep -qxF -- "${section#\#}"; then
            echo "$file:$line: $page has no section $section"
        fi
    done
}

# Prints `FILE:LINE:PATH` of each path of code in backticks that does not exist.
missing() {
    local file line path
    (grep -nHoE '`(crates|services|scripts|migrations|proto|deploy)/[a-z0-9_/.-]+`' "$@" || true) | tr -d '`' |
        while IFS=: read -r file line path; do
            [[ -e $path ]] || echo "$file:$line: $path does not exist"
        done
}

# Prints each line of the files given that refers to what is not in the repository.
without_document() {
    grep -nHE "$dangling" "$@" | sed 's/$/   <- refers to no document of the repository; see docs\/papers.md/' || true
}

# Prints each line of a Rust file that names a paper by its year, where the whole file leads to none of docs/papers.md.
unanchored() {
    local file
    (grep -lE "$citation" "$@" || true) | (grep -E '\.rs$' || true) | while IFS= read -r file; do
        grep -qF 'docs/papers.md' "$file" ||
            grep -nHE "$citation" "$file" | sed 's/$/   <- names a paper without its section of docs\/papers.md/'
    done
}

# Prints all that is wrong with the files given.
wrong() {
    broken "$@"
    missing "$@"
    without_document "$@"
    unanchored "$@"
}

self_test() {
    local dir line
    dir=$(mktemp -d)
    # shellcheck disable=SC2064 # the folder of this call
    trap "rm -rf '$dir'" EXIT
    while IFS= read -r line; do
        printf '%s\n' "$line" >"$dir/lib.rs"
        [[ -n $(wrong "$dir/lib.rs") ]] ||
            { echo "references self-test: did not find: $line" >&2; exit 1; }
    done <<'WRONG'
/// see docs/no-such-page.md
/// (docs/papers.md#no-such-section, eq. 3)
/// The frame of the root: method §2, mend 1.
/// A Parzen density (MM eq. 15)
/// (LR eq. 4-10)
/// LR-zh, table 1
/// table 1 of Mousas et al. (LR)
/// Frames a second that the Chinese paper prints
/// see `crates/no-such-crate/src/lib.rs`
/// Heat from the bones (Baran and Popović 2007, section 4)
//! darker colours (Prati et al. 2003)
WRONG
    printf '/// (Chai 2005; docs/papers.md#local-regression, eq. 10; docs/papers.md; `crates/model`)\n' >"$dir/lib.rs"
    [[ -z $(wrong "$dir/lib.rs") ]] ||
        { echo "references self-test: found something in a right reference" >&2; exit 1; }
}

[[ ${1:-} == --self-test ]] && self_test

mapfile -t files < <(git ls-files '*.rs' '*.md' '*.proto' '*.sql' '*.toml' '*.sh' ':!scripts/check-references.sh')
found=$(wrong "${files[@]}")
if [[ -n $found ]]; then
    printf '%s\n' "$found" >&2
    exit 1
fi
echo "references: all lead somewhere"
