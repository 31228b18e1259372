# Functions of the tests in QEMU, for bash scripts in the repository's root: Debian's stock kernel boots from an initramfs. No root,
# no disk image. The kernel stays in target/kernel.

# Debian has depmod and modprobe in folders that are only in root's PATH.
PATH=$PATH:/usr/sbin:/sbin
scripts/install.sh qemu-system-x86 busybox-static cpio kmod
qemu_kernel=${CARGO_TARGET_DIR:-target}/kernel

# Debian's current kernel, or an older one that was already downloaded.
if [ ! -e "$qemu_kernel/done" ]; then
    qemu_package=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: \(linux-image-[0-9][^ ]*-amd64\)$/\1/p' | head -1)
    [ -n "$qemu_package" ] || { echo "$0: apt has no linux-image-amd64; run apt-get update" >&2; exit 1; }
    rm -rf "$qemu_kernel"
    mkdir -p "$qemu_kernel"
    (cd "$qemu_kernel" && apt-get download -qq "$qemu_package") ||
        { echo "$0: cannot download $qemu_package; run apt-get update" >&2; exit 1; }
    dpkg-deb -x "$qemu_kernel"/linux-image-*.deb "$qemu_kernel"
    rm "$qemu_kernel"/*.deb
    depmod -b "$qemu_kernel" "$(ls "$qemu_kernel/lib/modules")"
    touch "$qemu_kernel/done"
fi
qemu_release=$(ls "$qemu_kernel/lib/modules")

# initramfs_root FOLDER MODULE…: an empty root with busybox, whose init loads these modules and those that they need, in this order, and
# then does what this function reads from its standard input. A MODULE can be followed by its parameters ("vivid n_devs=1").
initramfs_root() {
    rm -rf "$1"
    mkdir -p "$1"/{bin,dev,proc,sys,tmp,modules}
    cp /bin/busybox "$1/bin/"
    local module file parameters
    for module in "${@:2}"; do
        parameters=${module#"${module%% *}"}
        modprobe -d "$qemu_kernel" -S "$qemu_release" --show-depends "${module%% *}" |
            sed -n -e "\$ s/ *$/$parameters/" -e 's/^insmod //p'
    done | awk '!seen[$1]++' | while read -r file parameters; do
        cp "$file" "$1/modules/"
        echo "$(basename "$file") $parameters"
    done >"$1/modules/order"
    {
        cat <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t devtmpfs dev /dev
cd /modules
while read -r module parameters; do
    insmod "$module" $parameters || echo "cannot load $module"
done <order
INIT
        cat
        echo "poweroff -f"
    } >"$1/init"
    chmod +x "$1/init"
}

# boot SECONDS FOLDER OPTION…: starts the kernel with this root, and prints the machine's output.
boot() {
    (cd "$2" && find . | cpio --quiet -o -H newc | gzip -1) >"$2.gz"
    timeout "$1" qemu-system-x86_64 -nographic -no-reboot -nic none -kernel "$qemu_kernel/boot/vmlinuz-$qemu_release" -initrd "$2.gz" \
        -append "console=ttyS0 quiet panic=-1 no_timer_check" "${@:3}" </dev/null 2>&1 | tr -d '\r'
}
