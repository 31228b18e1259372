#!/usr/bin/env bash
# Tests Video4Linux 2 cameras without a camera and without root: QEMU boots Debian's stock kernel from an initramfs with the test
# binary of crates/camera/tests/v4l.rs, the driver vivid, and a USB camera that the test itself simulates over USB/IP.
# Kernel and initramfs stay in target/v4l.
set -euo pipefail
cd "$(dirname "$0")/.."
# Debian has depmod and modprobe in folders that are only in root's PATH.
PATH=$PATH:/usr/sbin:/sbin

scripts/install.sh qemu-system-x86 busybox-static cpio kmod
target=${CARGO_TARGET_DIR:-target}
work=$target/v4l
mkdir -p "$work"

# Debian's current kernel, or an older one that was already downloaded.
if [ ! -e "$work/kernel/done" ]; then
    package=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*-amd64\)$/\1/p' | head -1)
    [ -n "$package" ] || { echo "test-v4l: apt has no linux-image-amd64; run apt-get update" >&2; exit 1; }
    rm -rf "$work/kernel" "$work"/*.deb
    (cd "$work" && apt-get download -qq "$package") || { echo "test-v4l: cannot download $package; run apt-get update" >&2; exit 1; }
    dpkg-deb -x "$work"/linux-image-*.deb "$work/kernel"
    rm "$work"/*.deb
    depmod -b "$work/kernel" "$(ls "$work/kernel/lib/modules")"
    touch "$work/kernel/done"
fi
kernel=$(ls "$work/kernel/lib/modules")

# The binary's path is the last word of cargo's line "Executable tests/main.rs (PATH)".
built=$(${CARGO:-cargo} test --release --locked -p sdg-camera --test camera --no-run 2>&1) || { echo "$built" >&2; exit 1; }
binary=$(sed -n 's/.*Executable tests\/main.rs (\(.*\))$/\1/p' <<<"$built")

root=$work/root
rm -rf "$root"
mkdir -p "$root"/{bin,dev,proc,sys,tmp,modules}
cp /bin/busybox "$root/bin/"
cp "$binary" "$root/bin/v4l-test"
# The libraries of the binary, at the paths where it looks for them.
ldd "$binary" | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    cp -L "$library" "$root$library"
done
for module in vivid uvcvideo vhci-hcd; do
    modprobe -d "$work/kernel" -S "$kernel" --show-depends "$module" | sed -n 's/^insmod \([^ ]*\).*/\1/p'
done | awk '!seen[$0]++' >"$work/modules"
while read -r module; do
    cp "$module" "$root/modules/"
    basename "$module"
done <"$work/modules" >"$root/modules/order"

cat >"$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
cd /modules
while read -r module; do
    parameters=
    # One node that captures, like a webcam.
    [ "$module" != vivid.ko ] || parameters="n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0"
    insmod "$module" $parameters || echo "cannot load $module"
done <order
/bin/v4l-test v4l:: --ignored --test-threads 1 --nocapture
echo "v4l-test ended with $?"
poweroff -f
INIT
chmod +x "$root/init"
(cd "$root" && find . | cpio --quiet -o -H newc | gzip -1) >"$work/initramfs.gz"

# Not KVM, which is missing or broken in many virtual machines; without it the boot also takes only seconds.
timeout 120 qemu-system-x86_64 -accel tcg -m 512 -smp 2 -nographic -no-reboot -nic none -kernel "$work/kernel/boot/vmlinuz-$kernel" \
    -initrd "$work/initramfs.gz" -append "console=ttyS0 quiet panic=-1" </dev/null 2>&1 | tr -d '\r' | tee "$work/log" |
    sed -n '/running [0-9]* test/,$p'
grep -q '^v4l-test ended with 0$' "$work/log" || { echo "test-v4l: failed; the virtual machine's output is in $work/log" >&2; exit 1; }
