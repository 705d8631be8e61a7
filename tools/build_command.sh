#!/usr/bin/env bash
# Installs the packages that the command and its parts need, and builds these: build/tools/apps/postchain/postchain, for
# `cmake --install build --component command`; likewise the component of each PART.
# Usage: tools/build_command.sh [PART...]   PART: lab, serve, view, blender, openfx (docs/architecture.md)
set -euo pipefail
cd "$(dirname "$0")/.."
declare -A targets=(
    [lab]="postchain_lab postchain_lab_manuals" [serve]="postchain_serve postchain_serve_manuals"
    [view]="postchain_view_program postchain_view_program_manuals" [blender]=postchain_blender [openfx]=postchain_openfx
)
tools/install_packages.sh "$@"
options=(-DBUILD_TESTING=OFF)
wanted=(postchain postchain_manuals)
for part in "${!targets[@]}"; do
    built=OFF
    if [[ " $* " == *" $part "* ]]; then
        built=ON
        wanted+=(${targets[$part]})
    fi
    options+=("-DPOSTCHAIN_${part^^}=$built")
done
cmake --preset release "${options[@]}" -DPOSTCHAIN_PYTHON=OFF
cmake --build --preset release -j "$(nproc)" --target "${wanted[@]}"
