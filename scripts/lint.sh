#!/usr/bin/env bash
# Formatting, clippy with warnings denied, and the purity of the domain crates.
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/phase.sh "formatting" cargo fmt --all --check
scripts/phase.sh "purity of the domain crates" scripts/check-purity.sh --self-test
scripts/phase.sh "clippy" cargo clippy --release --locked --workspace --all-targets -- -D warnings
