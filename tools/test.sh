#!/usr/bin/env bash
# Installs packages, builds and runs the tests of the release preset. --full adds the tests that repeat a
# part of others (label `full`), the core preset (only chain and passes, each file compiled by itself), the
# address and undefined-behavior sanitizers, the thread sanitizer on the programs that have threads, and half a
# minute of each fuzz target (clang).
# Usage: tools/test.sh [--full]
set -euo pipefail
cd "$(dirname "$0")/.."

full=false
case ${1:-} in
    "") ;;
    --full) full=true ;;
    *)
        echo "usage: tools/test.sh [--full]" >&2
        exit 2
        ;;
esac

tools/install_packages.sh --tests

build_and_test() {
    echo "== preset $1"
    cmake --preset "$1" -DBUILD_TESTING=ON
    cmake --build --preset "$1" -j "$(nproc)"
    # One more than cores: many tests wait most of their time, for a watched folder or a browser. Each has
    # one thread of llvmpipe (CMakePresets.json): a test alone takes an eighth less processor time.
    ctest --preset "$1" --no-tests=error -j "$(($(nproc) + 1))"
}

build_and_test release
if $full; then
    ctest --preset full --no-tests=error -j "$(($(nproc) + 1))"
    build_and_test core
    tests/robustness/sanitize.sh address
    tests/robustness/sanitize.sh thread run_tests io_tests metrics_tests
    tests/fuzz/run.sh 30
fi
