#!/bin/sh
# Renders the generated scenes of ordering.yaml and ordering_fxaa.yaml into FOLDER, with ground truth,
# and copies the two study files there. A scene whose camera.json exists is kept.
#
#   docs/studies/ordering_scenes.sh POSTCHAIN FOLDER [FRAMES] [SIZE] [TRUTH_SAMPLES]
set -eu
postchain=$1 folder=$2 frames=${3:-1-12} size=${4:-320x180} samples=${5:-256}
mkdir -p "$folder"
cp "$(dirname "$0")"/ordering*.yaml "$folder"
while read -r name scene; do
    [ -e "$folder/$name/camera.json" ] && continue
    # shellcheck disable=SC2086  # the scene's options are words
    "$postchain" scene $scene -o "$folder/$name" --frames "$frames" --size "$size" \
        --truth-samples "$samples" --on-existing overwrite -q </dev/null
    echo "$name"
done <<SCENES
generated_wheels wheels
generated_wheels_far wheels --focus-distance 3
generated_wheels_wide wheels --f-stop 0.7 --aperture-blades 6
generated_poles poles
generated_poles_far poles --focus-distance 8
generated_poles_f28 poles --f-stop 2.8
generated_crossing crossing
generated_crossing_near crossing --focus-distance 0.8
generated_crossing_open crossing --shutter-frames 0.9
generated_zoom zoom
generated_zoom_open zoom --f-stop 1 --shutter-frames 0.9
SCENES
