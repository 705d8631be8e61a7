#!/usr/bin/env bash
# mypy over the examples, with the module's stub.
#   types_test.sh PYTHON BUILD
set -euo pipefail
"$1" -c 'import mypy' 2>/dev/null || { echo "skipped: mypy is not installed (python3-mypy)"; exit 77; }
root=$(cd "$(dirname "$0")/../.." && pwd)
cache=$(mktemp -d)
trap 'rm -rf "$cache"' EXIT
check() { MYPYPATH=$2/python "$1" -m mypy --cache-dir="$cache" --check-untyped-defs "${@:3}"; }
check "$1" "$2" --disable-error-code=import "$root"/tools/python/examples/*.py
# It sees a wrong argument.
printf 'import postchain\npostchain.inspect("a.exr", watch=True)\npostchain.Chain(1.5)\n' >"$cache/wrong.py"
! check "$1" "$2" "$cache/wrong.py" >"$cache/found"
[[ $(grep -c "error:" "$cache/found") == 2 ]] || { cat "$cache/found"; exit 1; }
