#!/usr/bin/env bash
# Installs packages, builds and runs tests. At its end it lists the tests that could not run, and what to install.
#   tools/test.sh         the default set: what each behavior is tested by where it lives
#   tools/test.sh --rest  the tests that the default set leaves out (label `full`); fails if one cannot run
#   tools/test.sh --full  both with each warning an error, the core preset (only chain and passes, each file compiled by
#                         itself), the address and undefined-behavior sanitizers, the thread sanitizer on the programs
#                         that have threads, and half a minute of each fuzz target (clang)
set -euo pipefail
cd "$(dirname "$0")/.."

sets=()
options=(-DBUILD_TESTING=ON)
case ${1:-} in
    "") sets=(default) ;;
    --rest) sets=(rest) ;;
    --full)
        sets=(default rest instrumented)
        options+=(-DCMAKE_COMPILE_WARNING_AS_ERROR=ON)
        ;;
    *)
        echo "usage: tools/test.sh [--rest | --full]" >&2
        exit 2
        ;;
esac

# One more than cores: many tests wait most of their time, for a watched folder or a browser. Each has
# one thread of llvmpipe (CMakePresets.json): a test alone takes an eighth less processor time.
run_tests() {
    ctest --preset "$1" --no-tests=error -j "$(($(nproc) + 1))"
}

# Prints a line for each test of the folder $1 that could not run. Fails if there is one.
list_skipped() {
    local lines
    lines=$(grep -hoE '^skipped: .*' "$1/Testing/Temporary/LastTest.log" | sort -u || true)
    [[ -z $lines ]] && return
    echo "== these tests did not run; tools/install_packages.sh --full installs what they need and this system has"
    echo "$lines"
    return 1
}

for set in "${sets[@]}"; do
    case $set in
        default)
            tools/install_packages.sh --tests
            cmake --preset release "${options[@]}"
            cmake --build --preset release -j "$(nproc)" --target default_tests
            run_tests release
            list_skipped build || true
            ;;
        rest)
            tools/install_packages.sh --full
            cmake --preset release "${options[@]}"
            cmake --build --preset release -j "$(nproc)"
            run_tests full
            list_skipped build
            ;;
        instrumented)
            cmake --preset core "${options[@]}"
            cmake --build --preset core -j "$(nproc)"
            run_tests core
            tests/robustness/sanitize.sh address
            tests/robustness/sanitize.sh thread run_tests io_tests metrics_tests
            tests/fuzz/run.sh 30
            ;;
    esac
done
if [[ ${sets[*]} == default ]]; then
    echo "== tools/test.sh --full runs the other tests:" \
        "$(ctest --preset full -N | sed -n 's/^Total Tests: //p') programs and scripts, sanitizers, fuzzing"
fi
