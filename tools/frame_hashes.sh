#!/usr/bin/env bash
# Prints the SHA-1 of the pixels of a generated frame, and of this frame through each shipped chain. The same lines on
# two machines mean that they compute the same bits (docs/platforms.md).
# Usage: tools/frame_hashes.sh [POSTCHAIN [FOLDER]]
# POSTCHAIN: the command (default: that of build/). FOLDER gets the frames (default: out/frames). If it has sharp.*.exr
# and camera.json, such as those of another machine, these are filtered. Needs oiiotool.
set -euo pipefail
postchain=$(realpath "${1:-$(dirname "$0")/../build/tools/apps/postchain/postchain}")
folder=$(realpath -m "${2:-$(dirname "$0")/../out/frames}")
cd "$(dirname "$0")/.."
mkdir -p "$folder"
[[ -e $folder/camera.json ]] ||
    "$postchain" scene wheels -q -o "$folder" --frames 1-3 --size 320x180
frames=("$folder/sharp.0002.exr")
for file in config/chains/*.yaml; do
    chain=$(basename "$file" .yaml)
    "$postchain" run "$chain" -q -i "$folder/sharp.####.exr" --frames 2 --camera "$folder/camera.json" \
        -o "$folder/$chain.####.exr" --device software --on-existing overwrite
    frames+=("$folder/$chain.0002.exr")
done
for frame in "${frames[@]}"; do
    printf '%-10s %s\n' "$(basename "$frame" .0002.exr)" "$(oiiotool --hash "$frame" | sed -n 's/^ *SHA-1: *//p')"
done
