#!/usr/bin/env bash
# Runs a command with its own display: with_display.sh COMMAND...
# Xvfb chooses a free display number, writes it to a pipe, and ends with the command. Without -noreset
# it would restart when its last client disconnects, and refuse a client that connects just then.
set -euo pipefail
if ! command -v Xvfb >/dev/null; then
    echo "Xvfb is not installed; run tools/install_packages.sh --full" >&2
    exit 1
fi
exec 3< <(exec Xvfb -displayfd 1 -screen 0 1280x800x24 -nolisten tcp -noreset 2>/dev/null)
server=$!
trap 'kill "$server" 2>/dev/null || true' EXIT
read -r -t 60 number <&3
DISPLAY=":$number" LIBGL_ALWAYS_SOFTWARE=1 "$@"
