#!/usr/bin/env bash
# Installs the packages that the command needs and builds it: build/tools/apps/postchain/postchain. Builds
# all of the component `command`, for `cmake --install build --component command`.
# Usage: tools/build_command.sh
set -euo pipefail
cd "$(dirname "$0")/.."
tools/install_packages.sh
cmake --preset release -DBUILD_TESTING=OFF
cmake --build --preset release -j "$(nproc)" --target postchain postchain_manuals \
    postchain_blender
