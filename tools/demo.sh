#!/usr/bin/env bash
# Installs the packages it needs, builds, renders the scene `wheels` with its ground truth, filters it
# with two chains, compares both with the ground truth and prints where images and report are.
# Usage: tools/demo.sh [FOLDER]   (default: out/demo)
set -euo pipefail
folder=$(realpath -m "${1:-out/demo}")
cd "$(dirname "$0")/.."

tools/build_command.sh lab blender
postchain=$PWD/build/tools/apps/postchain/postchain

mkdir -p "$folder/wheels" "$folder/balanced" "$folder/paper"
echo "== rendering 8 frames of wheels and their ground truth"
"$postchain" scene wheels -o "$folder/wheels" --frames 1-8 --size 400x225 --truth both \
    --truth-samples 200 --on-existing overwrite
for chain in balanced paper; do
    echo "== filtering with $chain"
    "$postchain" run "$chain" -i "$folder/wheels/sharp.####.exr" \
        --camera "$folder/wheels/camera.json" -o "$folder/$chain/wheels.####.exr" \
        --png --on-existing overwrite
done

# The rendered frames as PNG too, with the same display transform (x/(1+x))^(1/2.2).
for frame in "$folder"/wheels/sharp.*.exr; do
    oiiotool "$frame" --ch 0,1,2 --chnames R,G,B --clamp:min=0,0,0 \
        --dup --addc 1 --div --powc 0.454545 -d uint8 -o "${frame%.exr}.png"
done

echo "== comparing both with the ground truth"
"$postchain" ab balanced paper -i "$folder/wheels/sharp.####.exr" \
    --camera "$folder/wheels/camera.json" -r "$folder/wheels/both.####.exr" \
    -o "$folder/report" --on-existing overwrite

echo
echo "rendered:                      $folder/wheels/sharp.0001.png ... sharp.0008.png"
echo "filtered, inverse warp:        $folder/balanced/wheels.0001.png ... wheels.0008.png"
echo "filtered, the 2013 report:     $folder/paper/wheels.0001.png ... wheels.0008.png"
echo "report on the two:             $folder/report/index.html   (open it in a browser)"
echo "Each EXR file is beside its PNG, with a JSON sidecar that records the run."
