#!/usr/bin/env bash
# Runs a command with a display of its own: with_display.sh COMMAND...
# Xvfb chooses a free number, writes it to a pipe, and ends with the command. Without -noreset it
# starts anew when its last client leaves, and a client that comes just then is refused.
set -euo pipefail
if ! command -v Xvfb >/dev/null; then
    echo "Xvfb is not installed: tools/install_packages.sh --tests" >&2
    exit 1
fi
exec 3< <(exec Xvfb -displayfd 1 -screen 0 1280x800x24 -nolisten tcp -noreset 2>/dev/null)
server=$!
trap 'kill "$server" 2>/dev/null || true' EXIT
read -r -t 60 number <&3
DISPLAY=":$number" LIBGL_ALWAYS_SOFTWARE=1 "$@"
