#!/usr/bin/env bash
# Checks the Debian packages in clean systems (chroots of bookworm, nothing else is changed):
#   1. the source package builds with dpkg-buildpackage and its Build-Depends alone
#   2. lintian finds no error in source and packages
#   3. the programs of docs/library.md build with the installed packages, a C compiler and pkg-config
#      alone, and run
# Usage: tools/packaging/check_packages.sh [WORK]       keeps chroots and packages there; default: none
# Takes ten minutes on two cores, and 3 GB. Needs root, mmdebstrap, and what source_package.sh needs;
# the archive of Debian is that of this machine's apt. Without mmdebstrap or root: exit code 77.
set -euo pipefail
skip() { echo "skipped: $*"; exit 77; }
command -v mmdebstrap >/dev/null || skip "mmdebstrap is not installed"
[[ $(id -u) == 0 ]] || skip "a chroot needs root"
root=$(cd "$(dirname "$0")/../.." && pwd)
if [[ $# -ge 1 ]]; then
    mkdir -p "$1"
    work=$(cd "$1" && pwd)
else
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
fi

# A chroot with these packages, as it is after their installation; made once.
system() {
    local at=$work/$1
    [[ -e $at.made ]] && return
    rm -rf "$at"
    mmdebstrap -q --variant="$2" --include="$3" bookworm "$at"
    touch "$at.made"
}

echo "== the source package"
rm -rf "$work/source" "$work/debs"
mkdir "$work/debs"
dsc=$("$root/tools/packaging/source_package.sh" "$work/source")
depends=$(sed -n 's/^Build-Depends: //p' "$dsc" | tr -d ' ')
system builder buildd "$depends,lintian"
rm -rf "$work/builder/build"
mkdir "$work/builder/build"
cp "$work"/source/* "$work/builder/build/"
chroot "$work/builder" bash -ec 'cd /build && dpkg-source -x *.dsc tree >/dev/null && cd tree &&
    DEB_BUILD_OPTIONS=parallel=$(nproc) dpkg-buildpackage -us -uc >/build/log 2>&1 ||
    { tail -40 /build/log >&2; exit 1; }'
cp "$work"/builder/build/*.deb "$work/debs/"
ls "$work/debs"

echo "== lintian"
chroot "$work/builder" bash -ec 'cd /build && lintian --allow-root --fail-on error *.changes'

echo "== a program in C in a clean system"
system user minbase gcc,libc6-dev,pkg-config
rm -rf "$work/user/try"
mkdir "$work/user/try"
cp "$work"/debs/*.deb "$root"/tests/install/program/{host.c,text.c,frame.h} "$work/user/try/"
# The commands of docs/library.md. The context of host.c needs a driver.
sed -n '/^cc /s/ *#.*//p' "$root/docs/library.md" | sed 's/tool\.c/text.c/' >"$work/user/try/commands"
[[ -s $work/user/try/commands ]] || { echo "docs/library.md: no line 'cc ...' " >&2; exit 1; }
cp /etc/resolv.conf "$work/user/etc/" 2>/dev/null || true
chroot "$work/user" bash -ec 'cd /try
    apt-get update -q=2
    DEBIAN_FRONTEND=noninteractive apt-get install -q=2 -y --no-install-recommends ./libpostchain*.deb \
        libegl1 libgl1-mesa-dri libegl-mesa0 >/dev/null
    while read -r line; do
        echo "$line"
        bash -ec "$line"
        ./a.out
        rm a.out
    done <commands'
echo "the packages are in order"
