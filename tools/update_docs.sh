#!/usr/bin/env bash
# Writes the documents that the command makes from its tables: docs/parameters.md,
# config/chain.schema.json and the table in docs/camera_metadata.md.
# Usage: tools/update_docs.sh [COMMAND]   (default: build/tools/apps/postchain/postchain)
set -euo pipefail
command=$(realpath "${1:-$(dirname "$0")/../build/tools/apps/postchain/postchain}")
cd "$(dirname "$0")/.."

"$command" schema > config/chain.schema.json
{
    cat <<'END'
# Parameters

Made by `postchain passes --markdown` (`tools/update_docs.sh`); a test checks that it is up to date.
Keys are those of a [chain file](chain_file.md) and of `--set`. What the passes do with them:
[motion blur](motion_blur.md), [FXAA](fxaa.md), [depth of field](depth_of_field.md).

END
    "$command" passes --markdown
} > docs/parameters.md

table=$("$command" inspect --camera-metadata)
{
    sed '/^| attribute | writer |/,$d' docs/camera_metadata.md
    printf '%s\n' "$table"
} > docs/camera_metadata.md.new
mv docs/camera_metadata.md.new docs/camera_metadata.md
