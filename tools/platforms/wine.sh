#!/usr/bin/env bash
# Runs a program for Windows: wine.sh PROGRAM ARGUMENTS... CMake calls it for the tests. Without a display the program
# gets one of its own, because WGL of wine is GLX.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$here/../../build-windows" && pwd)
export WINEPREFIX=$build/wine WINEARCH=win64 WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe,winedbg.exe=d"
export WINEPATH="$build/libraries/bin;$build/bin"
export LIBGL_ALWAYS_SOFTWARE=1
if [[ -z ${DISPLAY:-} ]]; then
    exec "$here/../../tests/support/with_display.sh" wine "$@"
fi
exec wine "$@"
