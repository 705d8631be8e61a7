#!/usr/bin/env bash
# On a machine with a GPU: builds the core without fetching anything, runs the selftest of each pass and the
# tests that compare pixels with their references on that device, then gpu_bench at each size. If the core
# has Vulkan, its tests too, and gpu_bench with the same plans in Vulkan. A failure stops nothing. The page
# says what failed and gives the figures (docs/performance.md). It is written anew after each stage: a
# driver that hangs loses none of the earlier ones. Needs CMake, Ninja, a C++20 compiler and the packages
# epoxy, GLM and GoogleTest; for Vulkan those of tools/install_packages.sh --tests.
# Usage: tests/bench/gpu.sh [--sizes "1280x720 1920x1080 3840x2160"] [--only PART_OF_NAME]
#                           [--iterations 21] [--tests REGEX] [--jobs N] [--limit SECONDS_OF_A_TEST]
#                           [--page gpu_page.txt]
set -euo pipefail
cd "$(dirname "$0")/../.."

sizes="1280x720 1920x1080 3840x2160"
only=""
iterations=21
tests='^(executor|motion_blur|fxaa|depth_of_field|joint_blur|conformance|elision|layers|guest)_tests(_rest|_more)?$'
jobs=$(nproc)
limit=900
page=gpu_page.txt
while [[ $# -gt 0 ]]; do
    if [[ $# -lt 2 ]]; then
        sed -n '/^# Usage/,/^set/{/^#/p}' "$0" >&2
        exit 2
    fi
    case $1 in
        --sizes) sizes=$2 ;;
        --only) only=$2 ;;
        --iterations) iterations=$2 ;;
        --tests) tests=$2 ;;
        --jobs) jobs=$2 ;;
        --limit) limit=$2 ;;
        --page) page=$2 ;;
        *)
            sed -n '/^# Usage/,/^set/{/^#/p}' "$0" >&2
            exit 2
            ;;
    esac
    shift 2
done

programs=build-core/tests/bench
failures=()
stages=()
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT

write_page() {
    {
        echo "postchain $(git describe --always --dirty 2>/dev/null || echo "without git"), $(uname -srm)"
        if grep -q "wall clock" "$logs/device" 2>/dev/null; then
            echo "NO GPU: EGL uses a software renderer; these figures do not apply to a GPU"
        fi
        for stage in "${stages[@]}"; do
            echo
            echo "== $stage"
            cat "$logs/$stage"
        done
        echo
        if [[ ${#failures[@]} -eq 0 ]]; then
            echo "nothing failed${1:-}"
        else
            printf 'FAILED: %s\n' "${failures[@]}"
        fi
    } >"$page"
}

# stage NAME COMMAND...: shows what the command prints, and writes it and its failure to the page.
stage() {
    local name=$1
    shift
    echo "== $name"
    stages+=("$name")
    "$@" 2>&1 | tee "$logs/$name" || failures+=("$name: exit code ${PIPESTATUS[0]}")
    write_page ", up to here"
}

run_tests() {
    ctest --test-dir build-core -j "$jobs" --timeout "$limit" --output-on-failure --no-tests=error -R "$1" |
        grep -vE '^\[( RUN  |       OK |-----|=====)|^ +Start ' || return "${PIPESTATUS[0]}"
}

echo "== build"
cmake --preset core -DBUILD_TESTING=ON
vulkan=()
if ctest --test-dir build-core -N -R '^vulkan_tests$' | grep ' #' >/dev/null; then vulkan=(vulkan_tests); fi
for target in gpu_bench guest_bench pass_selftest "${vulkan[@]}" $(ctest --test-dir build-core -N -R "$tests" |
    sed -nE 's/^ *Test *#[0-9]+: (.*_tests(_more)?)(_rest)?$/\1/p' | sort -u); do
    cmake --build --preset core -j "$jobs" --target "$target" || failures+=("$target: not built")
done

stage device "$programs/gpu_bench" --size=64x64 --iterations=1 --only=copy
stage "selftest of each pass" timeout "$limit" "$programs/pass_selftest"
stage tests run_tests "$tests"
bench() {
    timeout "$limit" "$programs/gpu_bench" --size="$1" --iterations="$iterations" \
        ${only:+"--only=$only"} --steps "${@:2}"
}
for size in $sizes; do stage "$size" bench "$size"; done
if [[ ${#vulkan[@]} -gt 0 ]]; then
    stage "tests of Vulkan" run_tests '^vulkan_tests(_rest)?$'
    for size in $sizes; do stage "$size in Vulkan" bench "$size" --vulkan; done
fi
stage "a guest's frame on the CPU" "$programs/guest_bench"
write_page
echo
cat "$page"
echo "written to $page"
[[ ${#failures[@]} -eq 0 ]]
