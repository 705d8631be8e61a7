#!/usr/bin/env bash
# Fails if a C++ file does not match .clang-format. To fix: clang-format -i FILE. Versions of clang-format differ in
# what they write for the same settings: the code has the form of version 14.
set -euo pipefail
cd "$(dirname "$0")/../.."
format=$(command -v clang-format-14 || command -v clang-format || true)
version=$([[ -z $format ]] || "$format" --version | grep -oE '[0-9]+' | head -n 1)
[[ $version == 14 ]] || { echo "skipped: formatting is that of clang-format 14; found: ${version:-none}"; exit 77; }
mapfile -t files < <(find chain passes shaders config tools tests -name '*.h' -o -name '*.cpp' | sort)
((${#files[@]} > 50)) || { echo "found only ${#files[@]} files"; exit 1; }
# shaders/shared is also compiled as GLSL, whose macros clang-format misreads.
mapfile -t files < <(printf '%s\n' "${files[@]}" | grep -v 'shaders/shared/')
# One process for each core: starting one takes as long as twenty files.
cores=$(nproc)
printf '%s\n' "${files[@]}" |
    xargs -d '\n' -P "$cores" -n $((${#files[@]} / cores + 1)) "$format" --dry-run -Werror
