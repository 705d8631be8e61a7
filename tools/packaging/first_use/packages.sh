#!/usr/bin/env bash
# First use of the Debian packages in this folder, in a minimal system as root: installs all but the service, which
# first_use/service.sh installs; builds the programs of docs/library.md with a C compiler and pkg-config alone; filters
# a generated scene by the command and by the Python module. The OpenFX plugin is used by first_use/openfx.sh.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
rm -f postchain-service_*.deb
apt-get update -q=2
apt-get install -q=2 -y --no-install-recommends ./*.deb libgl1-mesa-dri libegl-mesa0 gcc libc6-dev pkg-config >/dev/null
dpkg-query -W -f '${Package} ${Version} ${Installed-Size} KiB\n' '*postchain*'
. /etc/os-release
[[ $(dpkg-query -W -f '${Version}' postchain) == *+deb$VERSION_ID ]] ||
    { echo "the version of postchain does not end in +deb$VERSION_ID" >&2; exit 1; }

while read -r line; do  # the context of host.c needs a driver
    echo "+ $line"
    bash -ec "$line"
    ./a.out
    rm a.out
done <commands

set -x
postchain --version
postchain scene wheels -o render --size 160x90 --frames 1-2 --truth-samples 16 --device software
postchain run balanced -i 'render/sharp.####.exr' --camera render/camera.json -o 'out/wheels.####.exr' --mkdir --png \
    --device software
postchain diff 'render/both.####.exr' 'render/sharp.####.exr' --metric flip
postchain diff 'render/both.####.exr' 'out/wheels.####.exr' --metric flip --fail-above flip=0.2
python3 -W ignore - <<'PYTHON'
import postchain

shot = next(iter(postchain.frames("render/sharp.####.exr", camera="render/camera.json")))
color = postchain.Chain("fast").run(shot.frame, before=shot.before, after=shot.after)
print("python3-postchain", postchain.__version__, color.shape, postchain.diff("render/both.0001.exr", color)["flip"])
PYTHON
postchain-view --help | head -n 3
