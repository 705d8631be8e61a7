#!/usr/bin/env bash
# Makes the pictures of docs/gallery.md and of the README: for every generated scene one strip of
# sharp input, result of the chain, truth and their difference; another with a heart as aperture. Needs a build (tools/demo.sh).
# Usage: tools/gallery.sh [CHAIN] [TRUTH_SAMPLES]
# (default: paper 192; about ten minutes on 2 cores)
set -euo pipefail
cd "$(dirname "$0")/.."
chain=${1:-paper}
samples=${2:-192}
frame=3
postchain=${POSTCHAIN:-$PWD/build/tools/apps/postchain/postchain}
images=$PWD/docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$images"

# FILE.exr OUT.exr: the first three channels after (x/(1+x))^(1/2.2).
display() {
    oiiotool "$1" --ch 0,1,2 --chnames R,G,B --clamp:min=0,0,0 \
        --dup --addc 1 --div --powc 0.454545 -d float -o "$2"
}

# TEXT STRIP.jpg: PSNR of input a and result b against truth c, and the four pictures side by side;
# the difference is four times as strong, or nothing would be seen of most of it.
compare() {
    local input result
    # --diff fails where the pictures differ.
    input=$( (oiiotool --diff "$work/a.exr" "$work/c.exr" || true) | sed -n 's/.*Peak SNR = //p')
    result=$( (oiiotool --diff "$work/b.exr" "$work/c.exr" || true) | sed -n 's/.*Peak SNR = //p')
    echo "$1, PSNR against the truth in dB: input $input, result $result"
    oiiotool "$work/b.exr" "$work/c.exr" --absdiff --mulc 4 -o "$work/d.exr"
    oiiotool "$work/a.exr" --resize 480x270 "$work/b.exr" --resize 480x270 \
        "$work/c.exr" --resize 480x270 "$work/d.exr" --resize 480x270 \
        --mosaic:pad=4 4x1 -d uint8 --nosoftwareattrib --eraseattrib '.*' \
        --compression jpeg:88 -o "$2"
}

for scene in wheels poles crossing zoom still; do
    "$postchain" scene "$scene" -o "$work/$scene" --frames "$frame" --size 640x360 \
        --truth-samples "$samples"
    number=$(printf '%04d' "$frame")
    "$postchain" run "$chain" -i "$work/$scene/sharp.####.exr" \
        --camera "$work/$scene/camera.json" -o "$work/result.####.exr" --on-existing overwrite
    display "$work/$scene/sharp.$number.exr" "$work/a.exr"
    display "$work/result.$number.exr" "$work/b.exr"
    display "$work/$scene/both.$number.exr" "$work/c.exr"
    compare "$scene" "$images/$scene-strip.jpg"
    if [[ $scene == wheels ]]; then
        oiiotool "$work/a.exr" "$work/b.exr" "$work/c.exr" --mosaic:pad=4 3x1 \
            -d uint8 --nosoftwareattrib --eraseattrib '.*' --compression jpeg:90 -o "$images/wheels.jpg"
    fi
done

# FXAA on one sample per pixel, against the same frame averaged over each pixel; a part, enlarged.
printf 'postchain: 1\npasses: [fxaa]\n' > "$work/fxaa.yaml"
"$postchain" run "$work/fxaa.yaml" -i "$work/poles/gbuf.####.exr" -o "$work/fxaa.####.exr"
display "$work/poles/gbuf.$number.exr" "$work/a.exr"
display "$work/fxaa.$number.exr" "$work/b.exr"
display "$work/poles/sharp.$number.exr" "$work/c.exr"
for picture in a b c; do
    oiiotool "$work/$picture.exr" --cut 160x90+200+120 \
        --resize:filter=box 480x270 -o "$work/$picture.exr"
done
compare "fxaa on gbuf of poles (the part shown)" "$images/fxaa-strip.jpg"

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
display "$work/heart/sharp.$number.exr" "$work/a.exr"
display "$work/heart.$number.exr" "$work/b.exr"
display "$work/heart/dof.$number.exr" "$work/c.exr"
compare "still through a heart" "$images/heart-strip.jpg"
