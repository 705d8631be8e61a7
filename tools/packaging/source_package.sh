#!/usr/bin/env bash
# Makes the Debian source package of the commit: postchain_VERSION.dsc and .tar.xz in FOLDER, from which
# dpkg-buildpackage builds the packages of cpack. debian/ is made of tools/packaging/debian.
# Usage: tools/packaging/source_package.sh FOLDER ["NAME <ADDRESS>"] [OPTION of dpkg-source]...
# "NAME <ADDRESS>": the maintainer.
# Needs git, cmake, dpkg-dev.
set -euo pipefail
[[ $# -ge 1 ]] || { echo "usage: $0 FOLDER [\"NAME <ADDRESS>\"] [OPTION of dpkg-source]..." >&2; exit 2; }
mkdir -p "$1"
out=$(cd "$1" && pwd)
cd "$(dirname "$0")/../.."
git rev-parse -q --verify HEAD >/dev/null ||
    { echo "$0: $PWD is not a git checkout; its commit is what is packed" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
version=$(sed -n 's/^project(postchain VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
tree=$work/postchain-$version
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
git archive --prefix="postchain-$version/" HEAD | tar -x -C "$work"
mkdir -p "$tree/debian/source"
cp "$tree"/tools/packaging/debian/{rules,copyright} "$tree/debian/"
cp "$tree/tools/packaging/debian/source.lintian-overrides" "$tree/debian/source/lintian-overrides"
echo "3.0 (native)" >"$tree/debian/source/format"
cmake -D OUT="$tree/debian" \
    -D MAINTAINER="${2:-The authors of postchain <postchain@postchain.invalid>}" \
    -P "$tree/tools/packaging/debian.cmake"
(cd "$work" && dpkg-source "${@:3}" -b "postchain-$version" >/dev/null)
mv "$work"/postchain_* "$out/"
echo "$out/postchain_$version.dsc"
