#!/usr/bin/env bash
# The Python module as a wheel: made from this build tree, installed in a fresh environment without the
# build's paths, and a frame filtered and written there.
#   wheel_test.sh PYTHON BUILD
set -euo pipefail
python=$1 build=$(cd "$2" && pwd)
root=$(cd "$(dirname "$0")/../.." && pwd)
"$python" -c 'import pip, venv, numpy' 2>/dev/null || {
    echo "skipped: pip, venv or numpy is not installed (python3-pip python3-venv python3-numpy)"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$python" -m pip wheel --quiet --no-deps --no-index --wheel-dir "$folder" \
    --config-settings build="$build" "$root"
wheel=$(echo "$folder"/postchain-*-linux_*.whl)
"$python" -m venv --system-site-packages "$folder/venv"    # NumPy is the system's
"$folder/venv/bin/pip" install --quiet --no-index --no-deps "$wheel"
cd "$folder"
env -u PYTHONPATH -u LD_LIBRARY_PATH "$folder/venv/bin/python" -B "$root/tools/packaging/first_use/wheel.py" --formats
