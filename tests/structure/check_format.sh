#!/usr/bin/env bash
# Fails when a C++ file is not as .clang-format wants it. To fix: clang-format -i FILE.
set -euo pipefail
cd "$(dirname "$0")/../.."
mapfile -t files < <(find chain passes shaders config tools tests -name '*.h' -o -name '*.cpp' | sort)
((${#files[@]} > 50)) || { echo "found only ${#files[@]} files"; exit 1; }
# shaders/shared is compiled as GLSL too, where clang-format's ideas of macros do not hold.
mapfile -t files < <(printf '%s\n' "${files[@]}" | grep -v 'shaders/shared/')
clang-format --dry-run -Werror "${files[@]}"
