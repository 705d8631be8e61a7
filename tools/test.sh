#!/usr/bin/env bash
# Installs packages, builds and runs tests. At its end it lists the tests that could not run, and what to install.
#   tools/test.sh              the default set: what each behavior of the command and the lab is tested by where it lives
#   tools/test.sh --part PART  all tests of a part (tools/CMakeLists.txt): lab, serve, view, blender, python or
#                              openfx
#   tools/test.sh --rest       the tests that the default set leaves out, those of all parts among them; fails if one
#                              cannot run
#   tools/test.sh --full       both with each warning an error, the core preset (only chain and passes, each file
#                              compiled by itself), the address and undefined-behavior sanitizers, the thread sanitizer
#                              on the programs that have threads, and half a minute of each fuzz target (clang)
set -euo pipefail
cd "$(dirname "$0")/.."

sets=()
options=(-DBUILD_TESTING=ON)
part=
case "${1:-} ${2:-}" in
    " ") sets=(default) ;;
    "--part lab" | "--part serve" | "--part view" | "--part blender" | "--part python" | \
        "--part openfx")
        sets=(part)
        part=$2
        ;;
    "--rest ") sets=(rest) ;;
    "--full ")
        sets=(default rest instrumented)
        options+=(-DCMAKE_COMPILE_WARNING_AS_ERROR=ON)
        ;;
    *)
        echo "usage: tools/test.sh [--part PART | --rest | --full]   PART: lab, serve, view, blender, python, openfx" >&2
        exit 2
        ;;
esac
# Switches on the parts that are named and the others off. Scenes for most tests are rendered by the lab.
build_parts() {
    local name
    for name in lab serve view blender python openfx; do
        [[ " lab $* " == *" $name "* ]] && options+=("-DPOSTCHAIN_${name^^}=ON") || options+=("-DPOSTCHAIN_${name^^}=OFF")
    done
}

# One more than cores: many tests wait most of their time, for a watched folder or a browser. Each has
# one thread of llvmpipe (CMakePresets.json): a test alone takes an eighth less processor time.
run_tests() {
    ctest --preset "$1" --no-tests=error -j "$(($(nproc) + 1))" "${@:2}"
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
            tools/install_packages.sh lab --tests
            build_parts
            cmake --preset release "${options[@]}"
            cmake --build --preset release -j "$(nproc)" --target default_tests
            run_tests release
            list_skipped build || true
            ;;
        part)
            tools/install_packages.sh --full
            build_parts "$part"
            cmake --preset release "${options[@]}"
            cmake --build --preset release -j "$(nproc)" --target "tests_of_$part"
            run_tests every -L "^$part\$"
            list_skipped build || true
            ;;
        rest)
            tools/install_packages.sh --full
            build_parts serve view blender python openfx
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
    cat <<'END'
== Not run. A changed parameter, option or message also changes what these expect:
     --part view, openfx, python, serve   their transcripts and records; tools/update_expected.sh PART renews them
     --rest                               conformance_tests_more: each parameter has an effect
   A change of pixels: --rest. The rest of all parts: --rest; of one: --part PART
END
fi
