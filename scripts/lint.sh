#!/usr/bin/env bash
# Formatting, the layers of the crates (directions, and purity of the domain), references, and clippy with warnings denied.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/phase.sh "formatting" cargo fmt --all --check
scripts/phase.sh "layers" scripts/check-layers.sh --self-test
scripts/phase.sh "references" scripts/check-references.sh --self-test
scripts/phase.sh "clippy" cargo clippy --release --locked --workspace --all-targets -- -D warnings
