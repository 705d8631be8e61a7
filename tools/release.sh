#!/usr/bin/env bash
# Makes the files of a release from the commit, and installs and uses each once in a system without anything else.
# Usage: tools/release.sh [--folder FOLDER] [--work FOLDER] [PART...]       default: all parts, in this order
#   debian12, debian13  Debian packages with their source package: built in a chroot with Build-Depends alone, without
#                       errors of lintian; used by programs in C, the command, the module,
#                       the OpenFX plugin and the service
#   wheel12, wheel13    the Python module as a wheel with the libraries that it loads, from the build of debian12 or
#                       debian13; used in a virtual environment
#   addon               the Blender add-on from the build of debian12: used as add-on in Debian 12's Blender, and as
#                       extension (Blender 4.2 and later) in Debian 13's
#   windows             headers, DLLs, import libraries and a sample; the sample is built and used under wine
#   image               container image of the service, from the packages of debian12
#   sums                SHA256SUMS
# --folder (default: release/VERSION) gets the files, and in logs/ what each part printed, with its first use.
# --work (default: build-release) keeps chroots of several GB and builds; a second run downloads and builds less.
# Needs root, mmdebstrap, dpkg-dev, cmake, systemd-container, buildah, and podman with runc to run the image in a
# container. windows needs g++-mingw-w64-x86-64-posix and wine. A part that lacks something prints `skipped: WHY`. Exit
# code 1: a part failed; 77: none failed, and some were skipped.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
first_use=$root/tools/packaging/first_use
version=$(sed -n 's/^project(postchain VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
folder=$root/release/$version
work=$root/build-release
parts=(debian12 debian13 wheel12 wheel13 addon windows image sums)
usage() { echo "usage: $0 [--folder FOLDER] [--work FOLDER] [PART...]   (${parts[*]})" >&2; exit 2; }
skip() { echo "skipped: $*"; exit 77; }
fail() { echo "$*" >&2; exit 1; }
declare -A suite=([12]=bookworm [13]=trixie)

# made NAME VALUE: whether NAME in $work was made with this value; `touch_made` notes it.
made() { [[ -e $work/$1.made && $(<"$work/$1.made") == "$2" ]]; }
touch_made() { echo "$2" >"$work/$1.made"; }

# needs PART: the result of another part, of this commit.
needs() { [[ $(head -n 1 "$folder/logs/$1.log" 2>/dev/null) == "$commit" ]] && [[ -e $folder/logs/$1.done ]] ||
    skip "needs the part $1 of this commit"; }

# bootstrap DEBIAN NAME VARIANT PACKAGES: a system in $work/DEBIAN/NAME, made once.
bootstrap() {
    local name=$1/$2
    made "$name" "$4" && return
    rm -rf --one-file-system "${work:?}/$name" "$work/$name.made"
    mkdir -p "$work/$1"
    mmdebstrap -q --variant="$3" ${4:+--include="$4"} "${suite[$1]}" "$work/$name"
    touch_made "$name" "$4"
}

# bare DEBIAN NAME [PACKAGES]: a minimal system that has been used for nothing, in $work/DEBIAN/NAME, with an empty
# folder /try. It resolves names as this machine.
bare() {
    local at=$work/$1/$2
    rm -rf --one-file-system "$at"
    bootstrap "$1" "minimal${3:+-${3//,/-}}" minbase "${3:-}"
    cp -a --reflink=auto "$work/$1/minimal${3:+-${3//,/-}}" "$at"
    cp /etc/resolv.conf "$at/etc/" 2>/dev/null || true
    mkdir "$at/try"
}

# inside ROOT COMMAND: bash runs it in /try, or in the folder in `at`, of the system. Its processes and mounts end with
# it.
inside() {
    unshare --mount --pid --fork --kill-child bash -ec '
        mount -t proc proc "$1/proc"
        exec chroot "$1" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive \
            bash -ec "cd \"\$0\"; $3" "$2"' - "$1" "${at:-/try}" "$2"
}

begin() { echo "== $*"; }

install_apt='apt-get update -q=2; apt-get install -q=2 -y --no-install-recommends'

debian() {
    local at builder=$work/$1/builder source depends
    command -v systemd-nspawn >/dev/null || skip "systemd-container is not installed"
    begin "the source package"
    rm -rf "$work/$1/source"
    source=$(tools/packaging/source_package.sh "$work/$1/source")
    depends=$(sed -n 's/^Build-Depends: //p' "$source" | tr -d ' ')
    begin "packages, in a system with the build dependencies alone"
    bootstrap "$1" builder buildd "$depends,lintian"
    if ! made "$1/builder/build" "$commit"; then
        rm -rf "$builder/build"
        mkdir "$builder/build"
        cp "$work/$1"/source/* "$builder/build/"
        at=/build inside "$builder" "dpkg-source -x *.dsc tree >/dev/null; cd tree
            DEB_BUILD_OPTIONS=parallel=$(nproc) dpkg-buildpackage -us -uc >/build/log 2>&1" ||
            { tail -n 40 "$builder/build/log" >&2; exit 1; }
        touch_made "$1/builder/build" "$commit"
    fi
    begin "lintian"
    at=/build inside "$builder" "lintian --allow-root --fail-on error *.changes"
    rm -rf "$folder/debian-$1"
    mkdir -p "$folder/debian-$1" "$folder/source"
    cp "$builder"/build/*.deb "$folder/debian-$1/"
    cp "$work/$1"/source/* "$folder/source/"

    begin "first use: the packages in a bare Debian $1"
    bare "$1" use
    cp "$folder/debian-$1"/*.deb tests/install/program/{host.c,text.c,*.h} "$first_use/packages.sh" \
        "$work/$1/use/try/"
    # The commands of docs/library.md.
    sed -n '/^cc /s/ *#.*//p' docs/library.md | sed 's/tool\.c/text.c/' >"$work/$1/use/try/commands"
    [[ -s $work/$1/use/try/commands ]] || fail "docs/library.md: no line 'cc ...'"
    inside "$work/$1/use" ./packages.sh
    rm -rf --one-file-system "${work:?}/$1/use"

    begin "first use: the OpenFX plugin in a bare Debian $1"
    bare "$1" use
    cp "$folder/debian-$1"/postchain-openfx_*.deb "$first_use"/openfx.{sh,py} "$work/$1/use/try/"
    inside "$work/$1/use" ./openfx.sh
    rm -rf --one-file-system "${work:?}/$1/use"

    begin "first use: the service in Debian $1, booted by systemd"
    bare "$1" service systemd-sysv,curl
    cp "$folder/debian-$1"/{postchain_,postchain-lab_,postchain-serve_,postchain-service_}*.deb "$first_use/service.sh" "$work/$1/service/try/"
    inside "$work/$1/service" "$install_apt --download-only ./*.deb libgl1-mesa-dri libegl-mesa0 >/dev/null"
    cat >"$work/$1/service/etc/systemd/system/first-use.service" <<-UNIT
		[Unit]
		After=basic.target
		SuccessAction=exit-force
		FailureAction=exit-force
		[Service]
		Type=oneshot
		WorkingDirectory=/try
		ExecStart=/try/service.sh
		StandardOutput=append:/try/log
		StandardError=append:/try/log
		TimeoutStartSec=900
		[Install]
		WantedBy=multi-user.target
	UNIT
    ln -s /etc/systemd/system/first-use.service "$work/$1/service/etc/systemd/system/multi-user.target.wants/"
    # A machine that systemd has not booted has no service that registers containers.
    local options=() code=0
    [[ -d /run/systemd/system ]] || options=(--register=no --keep-unit)
    SYSTEMD_NSPAWN_UNIFIED_HIERARCHY=1 systemd-nspawn -q "${options[@]}" --private-network --console=pipe \
        -D "$work/$1/service" --boot >"$work/$1/boot.log" 2>&1 </dev/null || code=$?
    cat "$work/$1/service/try/log"
    grep -q '^the service was installed' "$work/$1/service/try/log" ||
        fail "the service failed in its container ($code); its console: $work/$1/boot.log"
    rm -rf --one-file-system "${work:?}/$1/service"
}
debian12() { debian 12; }
debian13() { debian 13; }

wheel() {
    needs "debian$1"
    begin "a wheel from the build of debian$1"
    rm -rf "$work/$1/builder/wheel"
    mkdir "$work/$1/builder/wheel"
    cp /etc/resolv.conf "$work/$1/builder/etc/" 2>/dev/null || true
    cp "$first_use/wheel.py" "$work/$1/builder/wheel/"
    at=/build/tree inside "$work/$1/builder" "$install_apt python3-pip python3-venv patchelf >/dev/null
        python3 -m pip wheel --no-deps --no-index --wheel-dir /wheel --config-settings build=build \
            --config-settings libraries=yes . >/wheel/log 2>&1 || { cat /wheel/log; exit 1; }"
    rm -f "$folder"/postchain-*-"${tags[$1]}"-*.whl
    cp "$work/$1"/builder/wheel/*.whl "$folder/"
    local file
    file=$(basename "$work/$1"/builder/wheel/*.whl)
    begin "first use: pip install . in the system of the build"
    at=/build/tree inside "$work/$1/builder" "rm -rf /wheel/venv
        python3 -m venv --system-site-packages /wheel/venv
        /wheel/venv/bin/pip install --no-deps --no-index --config-settings build=build .
        /wheel/venv/bin/python /wheel/wheel.py --formats"
    begin "first use: the wheel in a virtual environment of a bare Debian $1"
    bare "$1" use
    cp "$folder/$file" "$first_use/wheel.py" "$work/$1/use/try/"
    inside "$work/$1/use" "$install_apt python3-venv python3-numpy libegl1 libopengl0 libegl-mesa0 libgl1-mesa-dri >/dev/null
        python3 -m venv --system-site-packages venv
        venv/bin/pip install --no-index ./$file
        venv/bin/python wheel.py"
    rm -rf --one-file-system "${work:?}/$1/use"
}
declare -A tags=([12]=cp311 [13]=cp313)
wheel12() { wheel 12; }
wheel13() { wheel 13; }

addon() {
    needs debian12
    local zip=$folder/postchain_blender-$version.zip
    cp "$work/12/builder/build/tree/build/tools/blender/postchain_blender.zip" "$zip"
    begin "first use: the zip as add-on in the Blender of a bare Debian 12"
    use_addon 12 "$zip" addon
    begin "first use: the zip as extension in the Blender of a bare Debian 13"
    use_addon 13 "$zip" extension
}
use_addon() { # DEBIAN FILE KIND: with the command of the packages
    needs "debian$1"
    bare "$1" use
    cp "$2" "$first_use/addon.py" "$folder/debian-$1"/postchain_*.deb "$work/$1/use/try/"
    inside "$work/$1/use" "$install_apt ./*.deb blender libgl1-mesa-dri libegl-mesa0 >/dev/null
        blender -b --factory-startup --python-exit-code 1 --python addon.py -- $3 '$(basename "$2")' $version"
    rm -rf --one-file-system "${work:?}/$1/use"
}

windows() {
    command -v x86_64-w64-mingw32-gcc-posix >/dev/null || skip "g++-mingw-w64-x86-64-posix is not installed"
    local name=postchain-$version-windows-x86_64 at=$work/windows
    begin "headers, DLLs and import libraries"
    tools/platforms/windows.sh --build
    rm -rf "$at"
    mkdir -p "$at/$name/sample" "$at/use"
    cmake --install build-windows --prefix "$at/$name" --strip
    cp build-windows/libraries/bin/libepoxy*.dll "$at/$name/bin/"
    cp build-windows/libraries/lib/libepoxy.dll.a "$at/$name/lib/"
    x86_64-w64-mingw32-strip "$at/$name"/bin/libepoxy*.dll
    cp tests/install/program/{host.c,*.h} "$at/$name/sample/"
    cp LICENSE "$at/$name/"
    cp /usr/share/doc/libepoxy-dev/copyright "$at/$name/LICENSE.libepoxy"
    (cd "$at" && rm -f "$folder/$name.zip" && cmake -E tar cf "$folder/$name.zip" --format=zip "$name")
    begin "first use: the sample, built with the zip alone and run under wine"
    (cd "$at/use" && cmake -E tar xf "$folder/$name.zip")
    (cd "$at/use/$name" && x86_64-w64-mingw32-gcc-posix -std=c11 -Iinclude sample/host.c -o bin/host.exe -Llib \
        -lpostchain -lpostchain_plan -lopengl32)
    command -v wine >/dev/null || skip "wine is not installed"
    (cd "$at/use/$name/bin" && WINEPREFIX=$at/wine WINEARCH=win64 WINEDEBUG=-all LIBGL_ALWAYS_SOFTWARE=1 \
        WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d" "$root/tests/support/with_display.sh" wine host.exe)
}

image() {
    needs debian12
    command -v buildah >/dev/null || skip "buildah is not installed"
    local name=localhost/postchain:$version file=$folder/postchain-$version-image.tar.gz container
    export BUILDAH_ISOLATION=chroot
    local storage=(--root "$work/containers" --runroot "$work/containers.run" --storage-driver vfs)
    begin "an image of the packages, on a minimal Debian 12 in place of the registry's"
    bare 12 base
    rmdir "$work/12/base/try"
    # Downloads, and this machine's names.
    find "$work"/12/base/var/{lib/apt/lists,cache/apt,log} -type f -delete
    rm -f "$work"/12/base/etc/{resolv.conf,hostname}
    tar -C "$work/12/base" -c . | gzip -1 >"$work/12/base.tar.gz"
    rm -rf --one-file-system "${work:?}/12/base"
    container=$(buildah "${storage[@]}" from scratch)
    buildah "${storage[@]}" add -q "$container" "$work/12/base.tar.gz" /
    buildah "${storage[@]}" commit -q --rm "$container" localhost/postchain-base
    buildah "${storage[@]}" bud -q --format docker --build-arg BASE=localhost/postchain-base -t "$name" \
        -f tools/packaging/service/Containerfile "$folder/debian-12"
    rm -f "$file"
    buildah "${storage[@]}" push -q "$name" "docker-archive:${file%.gz}:$name"
    gzip "${file%.gz}"
    rm -rf "$work/containers" "$work/containers.run"
    begin "first use: the image"
    # With a loopback of its own. All its processes and mounts end with it.
    unshare --net --mount --pid --fork --kill-child --mount-proc bash -ec 'ip link set lo up; exec "$@"' - \
        "$first_use/image.sh" "$file" "$name" "$work/image"
    rm -rf "$work/image"
}

sums() {
    local log
    for log in "$folder"/logs/*.log; do
        [[ $log == */sums.log || $(head -n 1 "$log") == "$commit" ]] ||
            fail "$log is of another commit; make that part again"
    done
    (cd "$folder" && find . -type f ! -path './logs/*' ! -name SHA256SUMS -printf '%P\n' | LC_ALL=C sort |
        xargs -d '\n' sha256sum >SHA256SUMS && sha256sum --quiet -c SHA256SUMS)
    (cd "$folder" && find . -type f ! -path './logs/*' -printf '%10s  %P\n' | sort -k 2)
}

while [[ ${1:-} == --* ]]; do
    [[ $# -ge 2 ]] || usage
    case $1 in
        --folder) folder=$(realpath -m "$2") ;;
        --work) work=$(realpath -m "$2") ;;
        *) usage ;;
    esac
    shift 2
done
(($# > 0)) || set -- "${parts[@]}"
for part in "$@"; do
    [[ " ${parts[*]} " == *" $part "* ]] || usage
done
[[ -z $(git status --porcelain) ]] || fail "the tree has changes or new files; commit or remove them: git status"
[[ $(id -u) == 0 ]] || skip "a chroot needs root"
command -v mmdebstrap >/dev/null || skip "mmdebstrap is not installed"
commit="postchain $version, commit $(git rev-parse HEAD)"
mkdir -p "$folder/logs" "$work"
failed=() skipped=()
for part in "$@"; do
    start=$SECONDS
    rm -f "$folder/logs/$part.done"
    # Not in a condition, in which `set -e` would not hold.
    set +e
    (set -e; echo "$commit"; echo "== $part"; "$part") 2>&1 | tee "$folder/logs/$part.log"
    code=${PIPESTATUS[0]}
    set -e
    case $code in
        0) touch "$folder/logs/$part.done"; echo "== $part: done in $((SECONDS - start)) s" | tee -a "$folder/logs/$part.log" ;;
        77) skipped+=("$part") ;;
        *) failed+=("$part"); echo "== $part: failed; log: $folder/logs/$part.log" ;;
    esac
done
((${#failed[@]} == 0)) || fail "failed: ${failed[*]}"
((${#skipped[@]} == 0)) || { echo "skipped: ${skipped[*]}"; exit 77; }
