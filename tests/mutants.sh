#!/usr/bin/env bash
# Puts one fault at a time into the code and prints which tests fail: tests/mutants/run.py.
# Usage: tests/mutants.sh [NAME ...]
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install_packages.sh lab serve view python openfx --tests
[[ -f build/build.ninja ]] || cmake --preset release -DBUILD_TESTING=ON
exec /usr/bin/python3 -B tests/mutants/run.py "$@"
