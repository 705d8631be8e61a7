#!/usr/bin/env bash
# Builds test programs with sanitizers and runs them, each with its time; a finding fails its
# program.
# Usage: tests/robustness/sanitize.sh address|thread [PROGRAM ...]
# address: address and undefined behavior (preset debug); thread: races (preset thread). Without
# PROGRAM the whole suite is built and run by ctest. The logs are in build-*/sanitized/.
set -euo pipefail
cd "$(dirname "$0")/../.."

case ${1:-} in
    address) preset=debug ;;
    thread) preset=thread ;;
    *)
        echo "usage: tests/robustness/sanitize.sh address|thread [PROGRAM ...]" >&2
        exit 2
        ;;
esac
shift
jobs=${POSTCHAIN_JOBS:-$(nproc)}
build=$PWD/build-$preset

# halt_on_error: otherwise a program that continues after a finding ends with exit code 0.
export ASAN_OPTIONS=detect_leaks=1:halt_on_error=1
export UBSAN_OPTIONS=print_stacktrace=1
export TSAN_OPTIONS=suppressions=$PWD/tests/robustness/races.supp:second_deadlock_stack=1:halt_on_error=0:exitcode=66

# The sanitizer intercepts dlopen and ignores the program's run path.
export LD_LIBRARY_PATH=$build/modules${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}

cmake --preset "$preset" -DBUILD_TESTING=ON >/dev/null
if (($# == 0)); then
    cmake --build --preset "$preset" -j "$jobs"
    ctest --preset "$preset" --no-tests=error -j "$jobs"
    exit
fi
cmake --build --preset "$preset" -j "$jobs" --target "$@"
mkdir -p "$build/sanitized"
failed=0
for program in "$@"; do
    log=$build/sanitized/$program.txt
    path=$(find "$build/tests" -type f -name "$program" -perm -u+x | head -n 1)
    start=$SECONDS
    code=0
    "$path" >"$log" 2>&1 || code=$?
    passed=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) .*/\1/p' "$log")
    echo "$program: ${passed:-0} tests passed, exit code $code, $((SECONDS - start)) s"
    if ((code != 0)); then
        failed=1
        grep -m 20 -E 'ERROR|WARNING: ThreadSanitizer|SUMMARY|runtime error|FAILED' "$log" ||
            tail -n 5 "$log"
    fi
done
exit "$failed"
