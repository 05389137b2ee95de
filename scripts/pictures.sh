#!/usr/bin/env bash
# The README's pictures: docs/pictures/. Needs ffmpeg, and for the last one Blender (apt-get install blender python3-numpy).
# Nothing in them is filmed or recorded: motion, body and video are drawn.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$PWD/docs/pictures
scripts=$PWD/scripts
target=${CARGO_TARGET_DIR:-$PWD/target}/release
work=$(mktemp -d /var/tmp/marey-pictures.XXXXXX)
chmod 755 "$work"
trap 'kill %1 2>/dev/null && wait; rm -rf "$work"' EXIT
mkdir -p "$out"

scripts/phase.sh "build" cargo build --release --locked -p marey
cargo run --release --locked -p evaluation --example picture -- "$out/points-to-body.svg"
cargo run --release --locked -p tests --example drawn_capture -- "$work/capture" 720 60

cd "$work"
"$target/marey" up --listen 127.0.0.1:0 >up.log &
until grep -q Ctrl-C up.log; do sleep 0.2; kill -0 %1; done
"$target/marey" upload walk capture/calib.toml capture/cam*.mp4 capture/plates/
run=$("$target/marey" run walk --watch | sed -n 's/^run //p')
"$target/marey" results "$run" -o results/ >/dev/null

# one moment, from three of the cameras
cut="select='eq(n,20)',crop=iw*0.62:ih*0.8:iw*0.22:ih*0.13,scale=333:-2"
ffmpeg -v error -y -i results/overlay_cam01.mp4 -i results/overlay_cam02.mp4 -i results/overlay_cam05.mp4 \
    -filter_complex "[0]$cut[a];[1]$cut[b];[2]$cut[c];[a][b][c]hstack=3" -frames:v 1 -q:v 3 "$out/outline-over-video.jpg"

if command -v blender >/dev/null; then
    blender --background --factory-startup --python "$scripts/render-in-blender.py" -- results/body.glb render.png >blender.log ||
        { cat blender.log >&2; exit 1; }
    ffmpeg -v error -y -f lavfi -i color=0xf6f7f9:s=1000x440 -i render.png -filter_complex overlay -frames:v 1 \
        -q:v 3 "$out/walk-in-blender.jpg"
else
    echo "pictures: no Blender here: $out/walk-in-blender.jpg stays as it is" >&2
fi
