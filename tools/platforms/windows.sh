#!/usr/bin/env bash
# Builds DLLs for Windows with mingw-w64 and tests them under wine, on Mesa's software renderers: the tests of chain/
# and of the guest, and hosts that are built with installed headers and import libraries alone. One frame of each
# shipped chain must have the hash that it has on Linux, and Vulkan's image must be Linux's. Everything is in
# build-windows/; a second run builds only what has changed.
# Usage: tools/platforms/windows.sh [--build]    --build: no tests
# POSTCHAIN_WINDOWS_DISPLAY is set by this script for itself.
set -euo pipefail
cd "$(dirname "$0")/../.."
root=$PWD
build=$root/build-windows
libraries=$build/libraries
toolchain=$root/tools/platforms/windows.cmake
wine=$root/tools/platforms/wine.sh
if [[ -z ${POSTCHAIN_WINDOWS_DISPLAY:-} ]]; then
    tools/install_packages.sh --windows
    # One display for all programs.
    export POSTCHAIN_WINDOWS_DISPLAY=1
    exec tests/support/with_display.sh "$root/tools/platforms/windows.sh" "$@"
fi
mkdir -p "$libraries/include" "$libraries/lib" "$libraries/share/cmake"

step() { # what command...: its output is shown if it fails
    local begin=$SECONDS name=$1
    shift
    "$@" >"$build/step.log" 2>&1 || { cat "$build/step.log"; echo "failed: $name" >&2; exit 1; }
    printf '%5d s  %s\n' $((SECONDS - begin)) "$name"
}

# Debian has no libepoxy for mingw-w64. apt verifies its source.
epoxy() (
    [[ -e $libraries/lib/pkgconfig/epoxy.pc ]] && return
    rm -rf "$build/epoxy"
    mkdir -p "$build/epoxy/lists/partial" "$build/epoxy/source"
    cd "$build/epoxy" || return
    local options
    # Where this machine has its packages from.
    apt-get indextargets --format 'deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $(REPO_URI) $(RELEASE) $(COMPONENT)' \
        'Created-By: Packages' 'Origin: Debian' 'Component: main' | sort -u >sources.list
    options=(-q -o "Dir::Etc::SourceList=$PWD/sources.list" -o Dir::Etc::SourceParts=- -o "Dir::State::Lists=$PWD/lists"
        -o APT::Sandbox::User=root)
    cat >cross.ini <<-EOF
		[binaries]
		c = 'x86_64-w64-mingw32-gcc-posix'
		ar = 'x86_64-w64-mingw32-ar'
		strip = 'x86_64-w64-mingw32-strip'
		windres = 'x86_64-w64-mingw32-windres'
		[built-in options]
		c_link_args = ['-static-libgcc']
		[host_machine]
		system = 'windows'
		cpu_family = 'x86_64'
		cpu = 'x86_64'
		endian = 'little'
	EOF
    # Not optimized, which would take minutes: a call goes through a pointer to the driver's function.
    apt-get "${options[@]}" update && apt-get "${options[@]}" source --download-only --tar-only libepoxy &&
        tar xf libepoxy_*.orig.tar.* -C source --strip-components=1 &&
        meson setup --cross-file cross.ini --prefix "$libraries" --libdir lib --buildtype plain -Dtests=false source build &&
        meson install -C build
)

# Those of the build machine, without its C library's. The loader of Vulkan is a part of the driver; its import library
# has the functions that the header declares.
headers() {
    cp -r /usr/include/glm /usr/include/vulkan /usr/include/vk_video "$libraries/include/" &&
        cp -r /usr/share/cmake/glm "$libraries/share/cmake/" &&
        { echo "LIBRARY vulkan-1.dll"; echo EXPORTS
          sed -n 's/^VKAPI_ATTR .* VKAPI_CALL \(vk[A-Za-z0-9]*\)(.*/\1/p' /usr/include/vulkan/vulkan_core.h; } >"$build/vulkan-1.def" &&
        x86_64-w64-mingw32-dlltool -d "$build/vulkan-1.def" -l "$libraries/lib/libvulkan-1.dll.a"
}

googletest() {
    [[ -e $libraries/lib/libgtest.a ]] && return
    cmake -S /usr/src/googletest -B "$build/googletest" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$toolchain" \
        -DCMAKE_BUILD_TYPE=None -DCMAKE_INSTALL_PREFIX="$libraries" &&
        cmake --build "$build/googletest" &&
        cmake --install "$build/googletest"
}

windows_libraries() {
    cmake --preset windows -DCMAKE_INSTALL_PREFIX="$build/installed" &&
        cmake --build --preset windows &&
        cmake --install "$build"
}

linux_libraries() {
    cmake -S . -B "$build/linux" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE="-O2 -DNDEBUG" \
        -DPOSTCHAIN_CORE=ON -DPOSTCHAIN_VULKAN=ON -DBUILD_TESTING=OFF -DCMAKE_INSTALL_LIBDIR=lib \
        -DCMAKE_INSTALL_PREFIX="$build/linux/installed" &&
        cmake --build "$build/linux" &&
        cmake --install "$build/linux"
}

# hosts FOLDER OPTIONS...: the examples and the sample for Vulkan, with the libraries installed in FOLDER/installed.
hosts() {
    local options=(-G Ninja -DCMAKE_BUILD_TYPE=Release -Dpostchain_DIR="$1/installed/lib/cmake/postchain" "${@:2}")
    cmake -S tests/install/program -B "$1/hosts" -DCOMPONENTS=core "${options[@]}" &&
        cmake --build "$1/hosts" --target c cpp hashes &&
        cmake -S tools/samples/vulkan -B "$1/vulkan_host" "${options[@]}" &&
        cmake --build "$1/vulkan_host"
}

# equal WHAT: whether hosts print or write the same on both systems.
equal() {
    if ! cmp "$build/linux/$1" "$build/$1"; then
        echo "$1: not as on Linux" >&2
        exit 1
    fi
    echo "$1: as on Linux"
}

step "libepoxy" epoxy
step "headers, import library of Vulkan" headers
step "GoogleTest" googletest
step "libraries and tests for Windows" windows_libraries
step "hosts for Windows" hosts "$build" -DCMAKE_TOOLCHAIN_FILE="$toolchain"
[[ ${1:-} == --build ]] && exit
step "libraries for Linux" linux_libraries
step "hosts for Linux" hosts "$build/linux"

export GALLIVM_PERF=nopt LP_NUM_THREADS=1
step "wine" "$wine" wineboot -i
for program in c cpp; do
    step "host in $program" "$wine" "$build/hosts/$program.exe"
    cat "$build/step.log"
done
"$build/linux/hosts/hashes" >"$build/linux/hashes.txt"
"$wine" "$build/hosts/hashes.exe" | tr -d '\r' >"$build/hashes.txt"
cat "$build/hashes.txt"
equal hashes.txt
"$build/linux/tools/apps/programs/postchain-programs" motion_blur,depth_of_field,fxaa >"$build/programs.spirv"
"$build/linux/vulkan_host/vulkan_host" 2 "$build/linux/vulkan.ppm" "$build/programs.spirv"
(cd "$build" && "$wine" vulkan_host/vulkan_host.exe 2 vulkan.ppm programs.spirv)
equal vulkan.ppm
step "tests" ctest --preset windows
grep -E "tests passed|Skipped|skipped" "$build/step.log"
