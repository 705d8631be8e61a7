#!/usr/bin/env bash
# On a machine with a GPU: builds the core without fetching anything, runs the tests that compare
# pixels with their references on that device and the selftest of each pass, then gpu_bench at each
# size. A failure stops nothing: the last page says what failed and gives the figures, and is written
# to a file (docs/performance.md). Needs CMake, Ninja, a C++20 compiler and the packages epoxy, GLM and
# GoogleTest.
# Usage: tests/bench/gpu.sh [--sizes "1280x720 1920x1080 3840x2160"] [--only PART_OF_NAME]
#                           [--iterations 21] [--tests REGEX] [--jobs N] [--page gpu_page.txt]
set -euo pipefail
cd "$(dirname "$0")/../.."

sizes="1280x720 1920x1080 3840x2160"
only=""
iterations=21
tests='^(executor|conformance|elision|guest)_tests$'
jobs=$(nproc)
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
        --page) page=$2 ;;
        *)
            sed -n '/^# Usage/,/^set/{/^#/p}' "$0" >&2
            exit 2
            ;;
    esac
    shift 2
done

echo "== build"
cmake --preset core -DBUILD_TESTING=ON
failures=()
for target in gpu_bench guest_bench pass_selftest executor_tests conformance_tests elision_tests guest_tests; do
    cmake --build --preset core -j "$jobs" --target "$target" || failures+=("$target: not built")
done

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
programs=build-core/tests/bench

# log NAME COMMAND...: shows and keeps what the command prints, and its failure.
log() {
    local name=$1
    shift
    echo "== $name"
    "$@" 2>&1 | tee "$logs/$name" || failures+=("$name: exit code ${PIPESTATUS[0]}")
}

log device "$programs/gpu_bench" --size=64x64 --iterations=1 --only=copy
names=$(ctest --test-dir build-core -N -R "$tests" | sed -n 's/^ *Test *#[0-9]*: //p')
[[ -n $names ]] || failures+=("tests: none matches $tests")
for name in $names; do
    log "$name" ctest --test-dir build-core --output-on-failure -R "^$name\$"
done
log selftest "$programs/pass_selftest"
for size in $sizes; do
    log "$size" "$programs/gpu_bench" --size="$size" --iterations="$iterations" ${only:+"--only=$only"} \
        --steps
done
log "a guest's frame on the CPU" "$programs/guest_bench"

{
    echo "postchain $(git describe --always --dirty 2>/dev/null || echo "without git"), $(uname -srm)"
    head -n 1 "$logs/device"
    if grep -q "wall clock" "$logs/device"; then
        echo "NO GPU: EGL uses a software renderer; these figures do not apply to a GPU"
    fi
    echo
    for name in $names; do
        printf '%-36s %s\n' "$name" "$(grep -E 'tests? passed,' "$logs/$name" || echo "did not end")"
        grep -hE '^\[  FAILED  \] .*\(' "$logs/$name" || true
    done
    echo
    echo "== selftest of each pass (reading and writing files is left out)"
    cat "$logs/selftest"
    for size in $sizes; do
        echo
        echo "== $size"
        tail -n +2 "$logs/$size"
    done
    echo
    echo "== a guest's frame on the CPU"
    cat "$logs/a guest's frame on the CPU"
    echo
    if [[ ${#failures[@]} -eq 0 ]]; then
        echo "nothing failed"
    else
        printf 'FAILED: %s\n' "${failures[@]}"
    fi
} >"$page"
echo
cat "$page"
echo "written to $page"
[[ ${#failures[@]} -eq 0 ]]
