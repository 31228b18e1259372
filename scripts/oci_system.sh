#!/usr/bin/env bash
# A new OCI layout whose image TAG has Debian with the packages that simulation runs on: mmdebstrap makes the system, umoci the
# image; no daemon. Usage: oci_system.sh LAYOUT TAG WORK-FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."

layout=$1 tag=$2 work=$3
scripts/install.sh mmdebstrap umoci
rm -rf "$layout" "$layout.tar"
mkdir -p "$work" "$(dirname "$layout")"
# As Debian of this machine has it, with its sources; packages' documentation and manual pages are left out.
mmdebstrap --quiet --variant=minbase --include=libmujoco2.2.2,libegl1,libgl1-mesa-dri,ca-certificates \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    --aptopt='APT::Install-Recommends "false"' bookworm "$work/system.tar"
umoci init --layout "$layout"
umoci new --image "$layout:$tag"
umoci raw add-layer --image "$layout:$tag" "$work/system.tar"
rm "$work/system.tar"
