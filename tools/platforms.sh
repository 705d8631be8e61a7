#!/usr/bin/env bash
# Builds and tests the commit on other platforms; the part of the release check (CONTRIBUTING.md) that
# tools/test.sh does not do.
# Usage: tools/platforms.sh [--cache FOLDER] PLATFORM... | all
#   bookworm, trixie   Debian 12, 13: tools/demo.sh and tools/test.sh, the commands of the README, in a minimal chroot
#                      with each warning an error, then tools/frame_hashes.sh
#   clang              everything, on this system with clang++, each warning an error
#   windows            the libraries as DLLs by mingw-w64, their tests and hosts under wine (tools/platforms/windows.sh)
# FOLDER (default: ~/.cache/postchain) keeps what was downloaded, the chroots as the last run left them, and their
# logs, 6 GB for each release of Debian. A chroot needs root and debootstrap. Its mirror is MIRROR, or this machine's
# if that is Debian, or debootstrap's. A platform that cannot run prints `skipped: WHY`; if no platform failed, the
# script then ends with 77.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
cache=${XDG_CACHE_HOME:-$HOME/.cache}/postchain

# A platform is a function of its name below, which fails if the platform does, and skips by `skip WHY`.
platforms=(bookworm trixie clang windows)
skip() {
    echo "skipped: $platform: $*"
    exit 77
}

usage() {
    echo "usage: tools/platforms.sh [--cache FOLDER] PLATFORM... | all   (${platforms[*]})" >&2
    exit 2
}

# timed NAME COMMAND...: runs COMMAND and prints its time.
timed() {
    local start=$SECONDS
    echo "== $platform: $1"
    "${@:2}"
    echo "== $platform: $1: $((SECONDS - start)) s"
}

# The mirror of this machine's apt, if it serves Debian.
debian_mirror() {
    local mirror=${MIRROR:-}
    if [[ -z $mirror ]] && command -v apt-get >/dev/null; then
        mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' 'Component: main' |
            grep -v security | head -n 1 || true)
    fi
    echo "$mirror"
}

# in_chroot FOLDER COMMAND...: runs COMMAND in /postchain of the chroot, in the environment of a new login. Its mounts
# and processes end with it.
in_chroot() {
    unshare --mount --pid --fork --kill-child bash -ec '
        mount -t proc proc "$1/proc"
        mount --rbind /dev "$1/dev"
        mount --bind "$2" "$1/var/cache/apt/archives"
        exec chroot "$1" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin \
            bash -ec "cd /postchain && exec \"\$@\"" - "${@:3}"' - "$1" "$cache/packages" "${@:2}"
}

# debian SUITE: the README's commands in a minimal system.
debian() {
    local suite=$1 folder=$cache/$1
    [[ $(id -u) == 0 ]] || skip "a chroot needs root"
    command -v debootstrap >/dev/null || skip "debootstrap is not installed"
    mkdir -p "$cache/packages/partial"
    if [[ ! -e $cache/$suite-minimal.made ]]; then
        rm -rf "$cache/$suite-minimal"
        # git and ca-certificates: a clone and its test have them.
        timed "a minimal system" debootstrap --variant=minbase --include=git,ca-certificates \
            "$suite" "$cache/$suite-minimal" $(debian_mirror)
        touch "$cache/$suite-minimal.made"
    fi
    rm -rf --one-file-system "$folder"
    cp -a --reflink=auto "$cache/$suite-minimal" "$folder"
    # Downloads use this machine's resolver and its settings of apt, such as a proxy.
    cp /etc/resolv.conf "$folder/etc/" 2>/dev/null || true
    if command -v apt-config >/dev/null; then
        apt-config dump | grep -E '^Acquire::(https?|ftp|Check-|Retries)' >"$folder/etc/apt/apt.conf.d/90downloads" ||
            true
    fi
    git clone -q --depth 1 "file://$root" "$folder/postchain"
    timed "packages of the build" in_chroot "$folder" tools/install_packages.sh lab serve view python openfx
    in_chroot "$folder" cmake --preset release -DBUILD_TESTING=OFF -DCMAKE_COMPILE_WARNING_AS_ERROR=ON
    timed tools/demo.sh in_chroot "$folder" tools/demo.sh
    timed tools/test.sh in_chroot "$folder" tools/test.sh
    # Each platform filters the frames that the first one rendered: only the filters are compared.
    local frames=$folder/postchain/out/frames other
    mkdir -p "$frames"
    cp "$cache"/frames/* "$frames/" 2>/dev/null || true
    in_chroot "$folder" tools/frame_hashes.sh | tee "$cache/$platform.frames"
    mkdir -p "$cache/frames"
    cp "$frames"/{sharp.*.exr,camera.json} "$cache/frames/"
    for other in "$cache"/*.frames; do
        cmp -s "$other" "$cache/$platform.frames" ||
            echo "== $platform: its frames differ from those of $(basename "$other" .frames)"
    done
}
bookworm() { debian bookworm; }
trixie() { debian trixie; }

clang() {
    tools/install_packages.sh --full
    cmake --preset clang -DBUILD_TESTING=ON
    timed "the build" cmake --build --preset clang -j "$(nproc)"
}

windows() { timed "DLLs and their tests" tools/platforms/windows.sh; }

[[ ${1:-} == --cache && $# -ge 2 ]] && cache=$(realpath -m "$2") && shift 2
(($# > 0)) || usage
[[ $* == all ]] && set -- "${platforms[@]}"
for platform in "$@"; do
    [[ " ${platforms[*]} " == *" $platform "* ]] || usage
done
mkdir -p "$cache"
rm -rf "$cache/frames" "$cache"/*.frames
failed=()
skipped=()
for platform in "$@"; do
    # Not in a condition, in which `set -e` would not hold.
    set +e
    (set -e; "$platform") 2>&1 | tee "$cache/$platform.log"
    code=${PIPESTATUS[0]}
    set -e
    case $code in
        0) echo "== $platform: passed" ;;
        77) skipped+=("$platform") ;;
        *) failed+=("$platform") ;;
    esac
done
if ((${#failed[@]} > 0)); then
    echo "failed: ${failed[*]}; logs: $cache/PLATFORM.log"
    exit 1
fi
((${#skipped[@]} == 0)) || exit 77
