#!/usr/bin/env bash
# Makes the images of docs/quality.md and of the README: for every generated scene a sheet of sharp
# input, results of two chains, ground truth, and their differences times four; the steps of the inverse
# warp; FXAA alone; an aperture in the shape of a heart. Needs a build (tools/demo.sh).
# Usage: tools/gallery.sh [TRUTH_SAMPLES]   (default: 192; about ten minutes on 2 cores)
set -euo pipefail
cd "$(dirname "$0")/.."
samples=${1:-192}
frame=3
postchain=${POSTCHAIN:-$PWD/build/tools/apps/postchain/postchain}
images=$PWD/docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$images"
number=$(printf '%04d' "$frame")

# FILE.exr OUT.exr: the first three channels after (x/(1+x))^(1/2.2).
display() {
    oiiotool "$1" --ch 0,1,2 --chnames R,G,B --clamp:min=0,0,0 \
        --dup --addc 1 --div --powc 0.454545 -d float -o "$2"
}

# TITLE NAME...: PSNR of each image NAME.exr against truth.exr, dB.
print_psnr() {
    local title=$1 name line=""
    shift
    for name in "$@"; do
        # --diff fails if the images differ.
        line+=", $name $( (oiiotool --diff "$work/$name.exr" "$work/truth.exr" || true) |
            sed -n 's/.*Peak SNR = //p')"
    done
    echo "$title, PSNR against the ground truth in dB:${line#,}"
}

# NAME...: the difference of each to truth.exr as NAME_difference.exr, times four to make small
# differences visible.
differences() {
    local name
    for name in "$@"; do
        oiiotool "$work/$name.exr" "$work/truth.exr" --absdiff --mulc 4 -o "$work/${name}_difference.exr"
    done
}

# COLUMNSxROWS OUT.jpg NAME...: a sheet of the images NAME.exr, each 480x270.
sheet() {
    local form=$1 out=$2 name words=()
    shift 2
    for name in "$@"; do words+=("$work/$name.exr" --resize 480x270); done
    oiiotool "${words[@]}" --mosaic:pad=4 "$form" -d uint8 --nosoftwareattrib --eraseattrib '.*' \
        --compression jpeg:88 -o "$out"
}

for scene in wheels poles crossing zoom still; do
    # Also the frames before and after, which `balanced` reads.
    "$postchain" scene "$scene" -o "$work/$scene" --frames "$((frame - 1))-$((frame + 1))" \
        --size 640x360
    "$postchain" scene "$scene" -o "$work/$scene" --frames "$frame" --size 640x360 \
        --truth-samples "$samples" --on-existing overwrite
    display "$work/$scene/sharp.$number.exr" "$work/input.exr"
    display "$work/$scene/both.$number.exr" "$work/truth.exr"
    for chain in paper balanced; do
        "$postchain" run "$chain" -i "$work/$scene/sharp.####.exr" --frames "$frame" \
            --camera "$work/$scene/camera.json" -o "$work/result.####.exr" --on-existing overwrite
        display "$work/result.$number.exr" "$work/$chain.exr"
    done
    print_psnr "$scene" input paper balanced
    differences paper balanced
    sheet 3x2 "$images/$scene-sheet.jpg" input paper balanced truth paper_difference \
        balanced_difference
    [[ $scene == wheels ]] || continue
    sheet 3x1 "$images/wheels.jpg" input balanced truth
    "$postchain" run balanced -i "$work/wheels/sharp.####.exr" --frames "$frame" \
        --camera "$work/wheels/camera.json" -o "$work/result.####.exr" --on-existing overwrite \
        --no-elide --dump-stages "$work/stages"
    tools/steps_picture.py "$work/stages" "$work/wheels/sharp.$number.exr" \
        "$work/result.$number.exr" "$images/inverse-warp-steps.jpg"
done

# FXAA on one sample per pixel, against the frame averaged over each pixel; a part, enlarged.
display "$work/poles/gbuf.$number.exr" "$work/input.exr"
display "$work/poles/sharp.$number.exr" "$work/truth.exr"
for mode in search directional; do
    printf 'postchain: 1\npasses: [fxaa: {mode: %s}]\n' "$mode" > "$work/fxaa.yaml"
    "$postchain" run "$work/fxaa.yaml" -i "$work/poles/gbuf.####.exr" --frames "$frame" \
        -o "$work/result.####.exr" --on-existing overwrite
    display "$work/result.$number.exr" "$work/$mode.exr"
done
for picture in input search directional truth; do
    oiiotool "$work/$picture.exr" --cut 160x90+200+120 \
        --resize:filter=box 480x270 -o "$work/$picture.exr"
done
print_psnr "fxaa on gbuf of poles (the part shown)" input search directional
sheet 4x1 "$images/fxaa-strip.jpg" input search directional truth

# Through an aperture in the shape of a heart.
awk 'BEGIN {
    n = 256; print "P2", n, n, 255
    for (j = 0; j < n; ++j) for (i = 0; i < n; ++i) {
        x = 1.35 * (2 * (i + 0.5) / n - 1); y = 0.12 - 1.35 * (2 * (j + 0.5) / n - 1)
        print ((x * x + y * y - 1) ^ 3 <= x * x * y ^ 3 ? 255 : 0)
    }
}' > "$work/heart.pgm"
printf 'postchain: 1\npasses: [depth_of_field: {samples: 128, max_radius_px: 40}]\n' > "$work/dof.yaml"
"$postchain" scene still -o "$work/heart" --frames "$frame" --size 640x360 \
    --truth-samples "$samples" --f-stop 0.5 --aperture-image "$work/heart.pgm"
"$postchain" run "$work/dof.yaml" -i "$work/heart/sharp.####.exr" \
    --camera "$work/heart/camera.json" -o "$work/heart.####.exr"
display "$work/heart/sharp.$number.exr" "$work/input.exr"
display "$work/heart.$number.exr" "$work/result.exr"
display "$work/heart/dof.$number.exr" "$work/truth.exr"
print_psnr "still through a heart" input result
differences result
sheet 4x1 "$images/heart-strip.jpg" input result truth result_difference
