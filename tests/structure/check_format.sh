#!/usr/bin/env bash
# Fails if a C++ file does not match .clang-format. To fix: clang-format -i FILE.
set -euo pipefail
cd "$(dirname "$0")/../.."
mapfile -t files < <(find chain passes shaders config tools tests -name '*.h' -o -name '*.cpp' | sort)
((${#files[@]} > 50)) || { echo "found only ${#files[@]} files"; exit 1; }
# shaders/shared is also compiled as GLSL, whose macros clang-format misreads.
mapfile -t files < <(printf '%s\n' "${files[@]}" | grep -v 'shaders/shared/')
clang-format --dry-run -Werror "${files[@]}"
