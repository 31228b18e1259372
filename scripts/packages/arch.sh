# Names of packages for ARCH (amd64 by default, or arm64), and the command that runs its programs on this machine; to be sourced.
#   arch      Debian's name          machine  the kernel's
#   triple    Rust's                 program  the folder of the packaged program
#   emulated  a command before the program: qemu, if this machine is of another kind

arch=${ARCH:-amd64}
case $arch in
    amd64) machine=x86_64 ;;
    arm64) machine=aarch64 ;;
    *)
        echo "packages: expected ARCH=amd64 or ARCH=arm64, found ARCH=$arch" >&2
        exit 2
        ;;
esac
triple=$machine-unknown-linux-gnu
program=target/packages/program/$arch
emulated=()
if [ "$(uname -m)" != "$machine" ]; then
    # The C library of that machine, unless QEMU_LD_PREFIX gives another one.
    scripts/install.sh qemu-user-static "libc6-$arch-cross"
    emulated=(env "QEMU_LD_PREFIX=${QEMU_LD_PREFIX:-/usr/$machine-linux-gnu}" "qemu-$machine-static")
fi
