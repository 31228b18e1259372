#!/usr/bin/env bash
# Kills commands in QEMU while they write to a disk whose power is then cut: Linux's dm-flakey drops the writes that had not arrived.
# `flakey.sh KILLS [COMMAND…]`: names of `endurance crash`. The machine sees this one's files read-only, except target/endurance, where
# the log is; a later call continues an earlier one. FLAKEY_SECS: maximum time.
set -euo pipefail
cd "$(dirname "$0")/../.."
. scripts/qemu.sh
scripts/install.sh dmsetup e2fsprogs python3

target=$(realpath "${CARGO_TARGET_DIR:-target}")
work=$target/endurance
mkdir -p "$work/flakey"
root=$work/flakey/root
truncate -s 128M "$work/flakey/disk"
initramfs_root "$root" virtio_pci virtio_blk ext4 dm-flakey 9p 9pnet_virtio <<INIT
mkdir /host
mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288,cache=loose,ro host /host
mount -t 9p -o trans=virtio,version=9p2000.L,msize=524288 work "/host$work"
mount -t tmpfs tmp /host/tmp
mount --bind /proc /host/proc
mount --bind /sys /host/sys
mount --bind /dev /host/dev
ip link set lo up
chroot /host /bin/sh -c 'cd "$PWD" && PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    "$target/release/endurance" --sdg "$target/release/sdg" crash --kills $1 --flakey /dev/vda ${*:2}'
echo "endurance ended with \$?"
INIT

# Not KVM, which is missing or broken in many virtual machines.
boot "${FLAKEY_SECS:-36000}" "$root" -accel tcg -cpu max -m 4G -smp 2 -drive "file=$work/flakey/disk,if=virtio,format=raw" \
    -virtfs local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap \
    -virtfs "local,path=$work,mount_tag=work,security_model=none" | tee "$work/flakey/output" || true
grep -q '^endurance ended with 0$' "$work/flakey/output" || {
    echo "flakey: failed; the virtual machine's output is in $work/flakey/output" >&2
    exit 1
}
