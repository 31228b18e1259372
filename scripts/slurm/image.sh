#!/usr/bin/env bash
# Makes an OCI image with sdg and the Debian packages that it needs (scripts/oci_system.sh), in target/oci (a layout) and, for Apptainer
# and others, in target/oci.tar. Then the program is run from the unpacked image in namespaces without network; if those are not
# allowed, this step is skipped with a message.
set -euo pipefail
cd "$(dirname "$0")/../.."

target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
sdg=$(realpath "${SDG:-$target/release/sdg}")
work=$target/oci-work
layout=$target/oci
rm -rf "$work"
mkdir -p "$work/layer/usr/local/bin"

scripts/oci_system.sh "$layout" sdg "$work"
cp "$sdg" "$work/layer/usr/local/bin/sdg"
# Everyone may run it, also if it was built and copied under a umask of 077.
chmod -R u=rwX,go=rX "$work/layer"
tar --create --owner=0 --group=0 --file "$work/sdg.tar" -C "$work/layer" usr
umoci raw add-layer --image "$layout:sdg" "$work/sdg.tar"
umoci config --image "$layout:sdg" --config.entrypoint /usr/local/bin/sdg --config.cmd --help
tar --create --file "$layout.tar" -C "$layout" .
echo "image: $layout:sdg and $layout.tar ($(du -sh "$layout" | cut -f 1))"

if ! unshare --mount --net --pid --fork true 2>/dev/null; then
    echo "not run: this machine allows no namespaces" >&2
    exit 0
fi
umoci unpack --image "$layout:sdg" "$work/bundle"
root=$work/bundle/rootfs
mkdir -p "$root/run-test"
# Including the part that needs MuJoCo and EGL: a unit of an evaluation, in a network namespace without any network.
unshare --mount --net --pid --fork bash -euc '
    mount --bind /dev "$1/dev"
    mount -t proc proc "$1/proc"
    [ "$(ls /sys/class/net | grep -vc "^lo$" || true)" = 0 ] || [ "$(ip -o link 2>/dev/null | grep -vc " lo:" || true)" = 0 ]
    chroot "$1" /usr/local/bin/sdg evaluate --models S --objects rod_end --attempts 1 --views 1 --scenes 1 \
        --out /run-test --unit teach-S-rod_end grasp-S-rod_end --json
' unshare "$root"
echo "the image runs units without network"
