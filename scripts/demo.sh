#!/usr/bin/env bash
# demo.sh [DIR]: builds Marey and lets it show what it does, on drawn trials or on the ASF/AMC(.zst) or BVH files of DIR. Results
# go into a new folder marey-demo; fails if anything falls short.
set -euo pipefail
# A relative DIR is meant from where the caller stands.
data=${1:+$(realpath -- "$1")}
cd "$(dirname "$0")/.."
scripts/setup.sh
scripts/phase.sh "build marey" cargo build --release --locked -p marey
exec "${CARGO_TARGET_DIR:-target}/release/marey" demo ${data:+--data "$data"}
