#!/bin/sh
# Makes the folder in which ordering.yaml and ordering_fxaa.yaml run: renders the generated scenes with
# ground truth, links the path-traced ones, renders `gbuf` of the test set with Blender, and copies the
# study files with the scenes that are there. Existing files are kept; run it again after more ground
# truth was rendered.
#
#   docs/studies/ordering_scenes.sh POSTCHAIN FOLDER [DATA [TEST]]
#
# DATA: folder with wheels, flagpole and crossing (docs/scenes.md). TEST: the folder that
# tools/research/cycles/dataset.py writes.
# SIZE and TRUTH_SAMPLES change the small generated scenes; LARGE=0 leaves out those of 1920x1080.
set -eu
postchain=$1 folder=$2 data=${3:-} test=${4:-}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$folder"
render() {  # NAME SIZE SAMPLES SCENE...
    name=$1 size=$2 samples=$3
    shift 3
    [ -e "$folder/$name/sharp.0003.exr" ] && return
    "$postchain" scene "$@" -o "$folder/$name" --frames 2 --size "$size" \
        --truth-samples "$samples" --on-existing overwrite -q </dev/null
    "$postchain" scene "$@" -o "$folder/$name" --frames 1-3 --size "$size" --on-existing overwrite -q \
        </dev/null
    echo "$name"
}
small=${SIZE:-320x180} samples=${TRUTH_SAMPLES:-256}
render generated_zoom "$small" "$samples" zoom
render generated_poles "$small" "$samples" poles
render generated_wheels "$small" "$samples" wheels
render generated_wheels_wide "$small" "$samples" wheels --f-stop 0.5 --aperture-blades 6
render generated_crossing "$small" "$samples" crossing
render generated_crossing_near "$small" "$samples" crossing --focus-distance 0.8
if [ "${LARGE:-1}" != 0 ]; then
    render generated_zoom_1080 1920x1080 64 zoom --f-stop 0.7
    render generated_poles_1080 1920x1080 64 poles --f-stop 0.7
fi
for scene in ${data:+wheels flagpole crossing}; do
    [ -e "$folder/$scene" ] || ln -s "$(realpath "$data/$scene")" "$folder/$scene"
done
for scene in ${test:+meadow glass canopy night acrobat whip facade rain}; do
    [ -e "$test/$scene/both.0011.exr" ] || { echo "$scene: no ground truth yet" >&2; continue; }
    [ -e "$folder/$scene" ] || ln -s "$(realpath "$test/$scene")" "$folder/$scene"
    [ -e "$folder/${scene}_gbuf/gbuf.0011.exr" ] || {
        blender -b --factory-startup --python-exit-code 1 -P "$here/../../tools/research/cycles/render.py" -- \
            "$scene" "$folder/${scene}_gbuf" --size 640x360 --kinds gbuf --frames 11 >/dev/null
        echo "${scene}_gbuf"
    }
done
# A scene is two lines of a study: "- {name: ..." and the one with its camera.
for study in "$here"/ordering*.yaml; do
    awk -v folder="$folder" '
        /^  - {name: / { first = $0; next }
        first != "" {
            camera = $0
            sub(/.*camera: /, "", camera)
            sub(/[,}].*/, "", camera)
            if ((getline line < (folder "/" camera)) > 0) print first "\n" $0
            else print camera ": not there; the scene is left out" >"/dev/stderr"
            first = ""
            next
        }
        { print }' "$study" >"$folder/$(basename "$study")"
done
