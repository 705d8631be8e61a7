#!/bin/sh
# sequence.sh POSTCHAIN OPENFX_COMPARE: 24 frames of a generated scene by every shipped chain.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/out"
"$1" scene wheels -o "$folder/in" --size 96x54 --frames 1-24 --truth-samples 0 --device software
"$2" "$folder/in/sharp.####.exr" "$folder/in/camera.json" 1-24 "$folder/out" balanced best dof_first fast paper
