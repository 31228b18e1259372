#!/usr/bin/env bash
# Makes a Debian system without any file of this project. Usage: clean_root.sh RELEASE FOLDER [PACKAGE,PACKAGE…]
set -euo pipefail

"$(dirname "$0")/../install.sh" mmdebstrap
# Not through a mount, as of /dev.
rm -rf --one-file-system "$2"
mmdebstrap --quiet --variant=minbase --aptopt='APT::Install-Recommends "false"' ${3:+--include="$3"} "$1" "$2"
