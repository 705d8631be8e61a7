#!/usr/bin/env bash
# On a machine with a GPU: builds the core without fetching anything, runs the tests that compare
# pixels with their references on that device, then gpu_bench at each size, with the fraction of the
# device's bandwidth that each pass and step reaches. Needs CMake, Ninja, a C++20 compiler and the
# packages epoxy, GLM, GoogleTest and google-benchmark.
# Usage: tests/bench/gpu.sh [--sizes "1280x720 1920x1080 3840x2160"] [--only PART_OF_NAME]
#                           [--iterations 21] [--tests REGEX] [--jobs N]
set -euo pipefail
cd "$(dirname "$0")/../.."

sizes="1280x720 1920x1080 3840x2160"
only=""
iterations=21
tests='^(executor|conformance|elision|guest)_tests$'
jobs=$(nproc)
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
        *)
            sed -n '/^# Usage/,/^set/{/^#/p}' "$0" >&2
            exit 2
            ;;
    esac
    shift 2
done

echo "== build"
cmake --preset core -DBUILD_TESTING=ON
cmake --build --preset core -j "$jobs" --target gpu_bench guest_bench executor_tests \
    conformance_tests elision_tests guest_tests

programs=build-core/tests/bench
if "$programs/gpu_bench" --size=64x64 --iterations=1 --only=copy | grep -q "wall clock"; then
    echo "no GPU: EGL uses a software renderer; the figures below do not apply to a GPU" >&2
fi

echo "== tests on this device"
ctest --test-dir build-core --output-on-failure --no-tests=error -R "$tests"

for size in $sizes; do
    echo "== $size"
    "$programs/gpu_bench" --size="$size" --iterations="$iterations" --only="$only" --steps
done

echo "== a guest's frame on the CPU"
"$programs/guest_bench"
