#!/usr/bin/env bash
# Runs tests of a build with counters and prints the blocks of chain/, passes/, config/, tools/sequence and
# tools/service that none of them runs, with a table by folder: tests/coverage/blocks.py.
# Usage: tests/coverage.sh [--rest] [OPTIONS OF CTEST ...]   --rest: all tests; without it the default set
# Not counted: processes that end by a signal or by _exit(), which write no counters. These are runs that a test
# kills, and the service's processes for images and previews, which are confined and may write no file.
set -euo pipefail
cd "$(dirname "$0")/.."

chosen=(--label-exclude '^(full|serve|view|blender|python|openfx)$')
target=(--target default_tests)
packages="lab serve view python --tests"
if [[ ${1:-} == --rest ]]; then
    shift
    chosen=()
    target=()
    packages=--full
fi
# shellcheck disable=SC2086
tools/install_packages.sh $packages
cmake --preset coverage -DBUILD_TESTING=ON
cmake --build --preset coverage -j "$(nproc)" "${target[@]}"
find build-coverage -name '*.gcda' -delete
failed=0
ctest --preset coverage --no-tests=error -j "$(($(nproc) + 1))" "${chosen[@]}" "$@" || failed=$?
/usr/bin/python3 -B tests/coverage/blocks.py build-coverage
exit "$failed"
