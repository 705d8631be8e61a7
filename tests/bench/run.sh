#!/usr/bin/env bash
# All figures in one run: each pass per megapixel and tap, bytes per pixel, the longest dispatches, CPU time
# of each step, a guest's frame on the CPU, the whole chain against oiiotool's copy, memory of a long run against a
# short one, start-up. Needs a configured build with tests.
# Usage: tests/bench/run.sh [arguments of sequence_bench]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cmake --build "$here/../../build" --target benches
programs=$(cd "$here/../../build/tests/bench" && pwd)
"$programs/gpu_bench"
"$programs/bytes_table" paper balanced fast
"$programs/bytes_table" --halves paper balanced fast
"$programs/longest_dispatch"
"$programs/steps_bench" --steps
"$programs/guest_bench"
"$here/sequence_bench.py" "$@"
