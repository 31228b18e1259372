#!/usr/bin/env bash
# Makes a new OCI layout with an image TAG of Debian and the packages for simulation: mmdebstrap makes the system, umoci the image,
# without a daemon. Usage: oci_system.sh LAYOUT TAG WORK-FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."

layout=$1 tag=$2 work=$3
scripts/install.sh mmdebstrap umoci
rm -rf "$layout" "$layout.tar"
mkdir -p "$work" "$(dirname "$layout")"
# With the Debian release and sources of this machine, without the packages' documentation and manual pages.
mmdebstrap --quiet --variant=minbase --include=libmujoco2.2.2,libegl1,libgl1-mesa-dri,ca-certificates \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    --aptopt='APT::Install-Recommends "false"' bookworm "$work/system.tar"
umoci init --layout "$layout"
umoci new --image "$layout:$tag"
umoci raw add-layer --image "$layout:$tag" "$work/system.tar"
rm "$work/system.tar"
