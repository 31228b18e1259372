#!/usr/bin/env bash
# Makes a Debian package, target/packages/deb/single-demo-grasp_VERSION_ARCH.deb; `make deb`. With TRY=1 the package is then installed,
# used and removed in a clean Debian root without network (needs root and mmdebstrap).
set -euo pipefail
cd "$(dirname "$0")/../.."
date=$(scripts/packages/commit_date.sh)
source scripts/packages/arch.sh

scripts/install.sh dpkg
scripts/packages/program.sh
version=$("${emulated[@]}" "$program/sdg" --version | cut -d ' ' -f 2)
out=target/packages/deb
root=$out/root-$arch
rm -rf "$root"
scripts/packages/lay_out.sh "$root/usr"
install -d "$root/DEBIAN"
cat >"$root/usr/share/doc/single-demo-grasp/copyright" <<END
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: single-demo-grasp

Files: *
Copyright: the authors of single-demo-grasp
License: Expat or Apache-2.0
 The texts lie beside this file, as LICENSE-MIT and LICENSE-APACHE.
END
cat >"$root/DEBIAN/control" <<END
Package: single-demo-grasp
Version: $version
Section: science
Priority: optional
Architecture: $arch
Depends: libc6 (>= 2.31), libgcc-s1
Recommends: libmujoco2.2.2, libegl1, libgl1-mesa-dri
Installed-Size: $(du -k -s "$root/usr" | cut -f 1)
Maintainer: single-demo-grasp <single-demo-grasp@invalid>
Description: teach a robot a grasp from one photo
 A part is photographed once, its grasp is marked on a page in the browser, and
 the program finds the part in pictures and tells the grasp: in pixels, or in
 metres with a calibrated camera, for a Franka robot or over ROS 2.
 .
 The recommended packages are for the simulated robot; nothing else needs them.
END
find "$root" -exec touch --no-dereference --date "@$date" {} +
deb=$out/single-demo-grasp_${version}_$arch.deb
SOURCE_DATE_EPOCH=$date dpkg-deb --root-owner-group -Zxz --build "$root" "$deb.new" >/dev/null
mv "$deb.new" "$deb"
rm -rf "$root"
echo "deb: $deb, $(stat -c %s "$deb") bytes"
try=try_deb
[ "$arch" = amd64 ] || try=try_$arch
[ -z "${TRY:-}" ] || scripts/packages/$try.sh "$deb"
