#!/usr/bin/env bash
# Installs the packages that building postchain needs, on Debian 12 (bookworm) and 13 (trixie): those of the command, and
# of each PART that is named. With --tests also those of the default tests; with --full those of all parts and tests, of
# sanitizers and fuzzing; with --windows those of tools/platforms.sh windows. Does nothing if all are installed, and on a
# system without dpkg, for which it prints the list.
# Usage: tools/install_packages.sh [PART...] [--tests | --full | --windows]   PART: lab, serve, view, python, blender,
# openfx
set -euo pipefail

packages=(
    g++ cmake ninja-build pkg-config
    libepoxy-dev libegl-dev libegl-mesa0 libgl1-mesa-dri libglm-dev
    libopenexr-dev libopenimageio-dev libopencolorio-dev openimageio-tools libpng-dev zlib1g-dev
    libdeflate-dev
    libyaml-dev nlohmann-json3-dev libcli11-dev libspdlog-dev libseccomp-dev
)
declare -A parts=(
    [lab]="libboost-dev"
    [serve]="libboost-dev libsqlitecpp-dev libsodium-dev prometheus-cpp-dev curl"
    [view]="libglfw3-dev libimgui-dev libfontconfig-dev"
    [python]="pybind11-dev python3-dev python3-numpy"
    [blender]=""
    [openfx]=""
)
mode=
for word in "$@"; do
    if [[ $word == --full ]]; then
        for part in "${!parts[@]}"; do packages+=(${parts[$part]}); done
    fi
    case $word in
        --tests | --full | --windows) mode=$word ;;
        *)
            [[ -v parts[$word] ]] || {
                echo "usage: tools/install_packages.sh [PART...] [--tests | --full | --windows]   PART: ${!parts[*]}" >&2
                exit 2
            }
            packages+=(${parts[$word]})
            ;;
    esac
done
case $mode in
    --tests | --full)
        packages+=(
            libgtest-dev libgmock-dev mold clang-format glslang-tools spirv-tools
            glslang-dev libvulkan-dev mesa-vulkan-drivers vulkan-validationlayers python3
            libspirv-cross-c-shared-dev
        )
        ;;
esac
if [[ $mode == --full ]]; then
    packages+=(
        dpkg-dev file libogre-1.12-dev xvfb xdotool fonts-noto-core slurmctld slurmd slurm-client munge prometheus
        python3-openimageio python3-pytest python3-matplotlib sqlite3
        python3-mypy python3-pip python3-venv
        chromium chromium-driver nginx-light caddy blender valgrind
        clang
    )
    # The sanitizers and libFuzzer of Debian's clang. Debian 12 has no package without a version.
    if [[ $(. /etc/os-release && echo "${VERSION_CODENAME:-}") == bookworm ]]; then
        packages+=(libclang-rt-14-dev)
    else
        packages+=(libclang-rt-dev)
    fi
fi
if [[ $mode == --windows ]]; then
    packages+=(
        g++-mingw-w64-x86-64-posix meson googletest wine wine64 xvfb
        glslang-dev glslang-tools spirv-tools libvulkan-dev mesa-vulkan-drivers
    )
fi
if ! command -v dpkg-query >/dev/null; then
    echo "this system has no dpkg; postchain needs what Debian 13 has in these packages: ${packages[*]}" >&2
    exit 0
fi
missing=()
for package in "${packages[@]}"; do
    status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
    [[ $status == "install ok installed" ]] || missing+=("$package")
done
((${#missing[@]} == 0)) && exit 0
echo "installing: ${missing[*]}"
as_root=()
if [[ $(id -u) != 0 ]]; then
    as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -q
"${as_root[@]}" apt-get install -q -y --no-install-recommends "${missing[@]}"
