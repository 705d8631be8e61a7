#!/usr/bin/env bash
# First use of the package postchain-openfx in this folder, in a minimal system as root that has no other package of
# postchain: renders without a GL driver, which must end in a message on the node, and with the recommended one.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
library=/usr/OFX/Plugins/postchain.ofx.bundle/Contents/Linux-x86-64/postchain.ofx
apt-get update -q=2
apt-get install -q=2 -y ./postchain-openfx_*.deb >/dev/null
apt-get install -q=2 -y --no-install-recommends python3 >/dev/null
set -x
__EGL_VENDOR_LIBRARY_FILENAMES=/no/such.json python3 openfx.py "$library" "install a driver with EGL"
python3 openfx.py "$library"
