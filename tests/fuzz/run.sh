#!/usr/bin/env bash
# Builds the fuzz targets with clang and runs each for SECONDS (default 30), starting from the
# repository's corpus, the shipped chains and profiles, and earlier finds. After each call the found
# corpus is reduced to the smallest inputs that reach the same code.
# Usage: tests/fuzz/run.sh [SECONDS [TARGET ...]]
# Exits with 1 on a find; its input is kept in build-fuzz/finds/TARGET-*. The found corpus is in
# build-fuzz/corpus, not in the repository.
set -euo pipefail
cd "$(dirname "$0")/../.."

# The longest input of each target in bytes; every corpus file fits.
declare -A max_len=([chain]=4096 [camera]=4096 [profile]=8192 [sequence]=256 [exr]=20000
    [picture]=10000 [request]=6000)
all=(chain camera profile sequence exr picture request)
build=$PWD/build-fuzz

seconds=${1:-30}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || {
    echo "usage: tests/fuzz/run.sh [SECONDS [TARGET ...]]" >&2
    exit 2
}
shift $(($# > 0 ? 1 : 0))
targets=("$@")
((${#targets[@]} > 0)) || targets=("${all[@]}")
for target in "${targets[@]}"; do
    [[ -n ${max_len[$target]:-} ]] || {
        echo "tests/fuzz/run.sh: unknown target $target; known are: ${all[*]}" >&2
        exit 2
    }
done

tools/install_packages.sh --full
cmake --preset fuzz
cmake --build --preset fuzz -j "${POSTCHAIN_JOBS:-$(nproc)}"

# Keeps six callers per allocation (a known leak is recognized by its third), and a small quarantine
# of freed memory. Finds are analyzed with more.
export ASAN_OPTIONS=malloc_context_size=6:quarantine_size_mb=4${ASAN_OPTIONS:+:$ASAN_OPTIONS}
limits=(-rss_limit_mb=2048 -malloc_limit_mb=512 -timeout=20)
mkdir -p "$build/finds" "$build/log"
failed=0
for target in "${targets[@]}"; do
    fuzzer=$build/tests/fuzz/fuzz_$target
    corpus=$build/corpus/$target
    log=$build/log/$target.txt
    mkdir -p "$corpus"
    seeds=("tests/fuzz/corpus/$target")
    [[ ! -d config/${target}s ]] || seeds+=("config/${target}s")
    code=0
    "$fuzzer" "$corpus" "${seeds[@]}" -max_total_time="$seconds" \
        -max_len="${max_len[$target]}" "${limits[@]}" -print_final_stats=1 \
        -artifact_prefix="$build/finds/$target-" >"$log" 2>&1 || code=$?
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -n 1)
    # Without final statistics: the last line of progress.
    [[ -n $runs ]] || runs=$(sed -n 's/^#\([0-9]*\).*/\1/p' "$log" | tail -n 1)
    if ((code == 0)); then
        echo "$target: ${runs:-0} executions, no find"
    else
        failed=1
        echo "$target: a find after ${runs:-some} executions (log: $log)"
        grep -E 'ERROR|SUMMARY|runtime error|broken promise|Test unit written' "$log" || tail "$log"
    fi
    # Inputs whose coverage the repository's corpus already has are not kept.
    rm -rf "$corpus.merged"
    mkdir "$corpus.merged"
    for folder in "${seeds[@]}"; do cp -a "$folder/." "$corpus.merged/"; done
    if "$fuzzer" -merge=1 "$corpus.merged" "$corpus" "${limits[@]}" >>"$log" 2>&1; then
        for folder in "${seeds[@]}"; do
            for seed in "$folder"/*; do rm -f "$corpus.merged/${seed##*/}"; done
        done
        kept=$(find "$corpus.merged" -type f | wc -l)
        echo "$target: $(find "$corpus" -type f | wc -l) inputs found, $kept kept"
        rm -rf "$corpus"
        mv "$corpus.merged" "$corpus"
    else
        echo "$target: the corpus could not be reduced and is kept unchanged (log: $log)"
        rm -rf "$corpus.merged"
    fi
done
exit "$failed"
