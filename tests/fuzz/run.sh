#!/usr/bin/env bash
# Builds the fuzz targets with clang and runs each for SECONDS (default 30) from its corpus.
# Usage: tests/fuzz/run.sh [SECONDS [TARGET ...]]. Exit 1 on a find; its input is kept in
# build-fuzz/finds/TARGET-*. Several minutes' work grows build-fuzz/corpus, not the repository's.
set -euo pipefail
cd "$(dirname "$0")/../.."

seconds=${1:-30}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || {
    echo "usage: tests/fuzz/run.sh [SECONDS [TARGET ...]]" >&2
    exit 2
}
shift $(($# > 0 ? 1 : 0))
# The longest input of each target, bytes; every corpus file fits.
declare -A max_len=([chain]=4096 [camera]=4096 [profile]=8192 [sequence]=256 [exr]=20000)
targets=("$@")
((${#targets[@]} > 0)) || targets=(chain camera profile sequence exr)
for target in "${targets[@]}"; do
    [[ -n ${max_len[$target]:-} ]] || {
        echo "tests/fuzz/run.sh: no target $target; there are: ${!max_len[*]}" >&2
        exit 2
    }
done

tools/install_packages.sh --fuzz
cmake --preset fuzz
cmake --build --preset fuzz -j "$(nproc)"

build=$PWD/build-fuzz
mkdir -p "$build/finds" "$build/log"
failed=0
for target in "${targets[@]}"; do
    mkdir -p "$build/corpus/$target"
    log=$build/log/$target.txt
    code=0
    "$build/tests/fuzz/fuzz_$target" "$build/corpus/$target" "tests/fuzz/corpus/$target" \
        -max_total_time="$seconds" -max_len="${max_len[$target]}" -rss_limit_mb=2048 \
        -malloc_limit_mb=512 -timeout=20 -print_final_stats=1 \
        -artifact_prefix="$build/finds/$target-" >"$log" 2>&1 || code=$?
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -n 1)
    if ((code == 0)); then
        echo "$target: ${runs:-0} executions, no find"
    else
        failed=1
        echo "$target: a find after ${runs:-some} executions (log: $log)"
        grep -E 'ERROR|SUMMARY|runtime error|broken promise|Test unit written' "$log" || tail "$log"
    fi
done
exit "$failed"
