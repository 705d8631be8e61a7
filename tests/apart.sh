#!/usr/bin/env bash
# Parts can be left out (docs/architecture.md): in a copy of the checkout without the folders of all parts and their
# tests the command is built, and the default tests that are left pass; each part put back alone is built.
# Usage: tests/apart.sh FOLDER [CASE...]   FOLDER gets the copy and its build, and is made anew
# CASE: command (without any part), quick (the same, with the tests that need no device alone), lab, serve, view,
# blender, python, openfx, samples; default: all but quick
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
[[ $# -ge 1 ]] || { echo "usage: $0 FOLDER [CASE...]" >&2; exit 2; }
folder=$(realpath -m "$1")
shift
declare -A folders=(
    [lab]="tools/measure tools/page tests/measure tests/page tests/stability"
    [serve]="tools/service tools/page tests/service"
    [view]="tools/apps/view tests/view"
    [blender]="tools/blender tests/blender"
    [python]="tools/python tests/python"
    [openfx]="tools/openfx tests/openfx"
    [samples]="tools/samples tests/ogre"
)
declare -A targets=(
    [command]="default_tests postchain"
    [quick]="postchain config_tests io_tests run_tests metrics_tests command_tests command_more_tests"
    [samples]="postchain ogre_host"
)
cases=("$@")
[[ $# -gt 0 ]] || cases=(command lab serve view blender python openfx samples)

# The tracked files, and new ones that git does not ignore.
rm -rf "${folder:?}"
mkdir -p "$folder/all" "$folder/build"
(cd "$root" && git ls-files -z --cached --others --exclude-standard |
    tar --null --ignore-failed-read -T - -cf - 2>/dev/null) | tar -xf - -C "$folder/all"

logged() {
    "$@" >"$folder/log" 2>&1 || { tail -n 40 "$folder/log"; exit 1; }
}

for case in "${cases[@]}"; do
    echo "== $case"
    rm -rf "$folder/source"
    cp -a "$folder/all" "$folder/source"
    for other in "${!folders[@]}"; do
        for removed in ${folders[$other]}; do
            [[ " ${folders[$case]:-} " == *" $removed "* ]] || rm -rf "${folder:?}/source/$removed"
        done
    done
    testing=OFF
    [[ -z ${targets[$case]:-} ]] || testing=ON
    logged cmake -S "$folder/source" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
        -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" -DBUILD_TESTING=$testing
    # shellcheck disable=SC2086
    logged cmake --build "$folder/build" -j "$(nproc)" --target ${targets[$case]:-all}
    [[ $case == command || $case == quick ]] || continue
    libraries=$(ldd "$folder/build/tools/apps/postchain/postchain")
    for library in sqlite3 sodium prometheus glfw boost; do
        [[ $libraries != *"lib$library"* ]] || { echo "postchain links lib$library"; exit 1; }
    done
    chosen=(-LE '^full$')
    [[ $case == command ]] || chosen=(-R '^(config_tests|io_tests|metrics_tests|structure_tests|command_.*|transcript_.*)$' "${chosen[@]}")
    GALLIVM_PERF=nopt LP_NUM_THREADS=1 ctest --test-dir "$folder/build" --no-tests=error -j "$(($(nproc) + 1))" \
        "${chosen[@]}" --output-on-failure
done
