#!/usr/bin/env bash
# Uses a wheel for arm64 under qemu with Debian 11's Python and numpy for arm64, without network and not as root, as try_wheel.sh does on a
# machine of the same kind, which calls this. pip checks on this machine that the wheel suits that Python, and unpacks it.
# Usage: try_wheel_arm64.sh WHEEL SCRIPT
set -euo pipefail
cd "$(dirname "$0")/../.."
ARCH=arm64 source scripts/packages/arch.sh

wheel=$(realpath "$1")
script=$2
root=$(realpath -m target/packages/arm64-wheel-root)
scripts/install.sh mmdebstrap qemu-user-static
rm -rf "$root"
# No program of this root runs while it is made, so the kernel needs no support for arm64.
mmdebstrap --quiet --variant=extract --skip=check/qemu --architectures=arm64 --include=python3,python3-numpy,libgcc-s1 bullseye "$root" 2>/dev/null
packages=$root/opt/packages
mkdir -p "$packages" "$root/tmp"
scripts/python/venv.sh target/python/build maturin==1.16.0
start=$(date +%s.%N)
target/python/build/bin/python -m pip install --quiet --no-index --no-deps --only-binary :all: --target "$packages" \
    --platform "manylinux_2_31_$machine" --implementation cp --python-version 3.9 --abi abi3 "$wheel"
# A home folder that does not exist, and a folder with a space and an umlaut.
folder="$root/tmp/erste Größe"
mkdir -p "$folder"
chmod 755 "$root"
chown nobody "$folder"
# Debian's alternatives, which give BLAS its name, are set by programs that did not run here.
libraries=$(printf '%s:' "$root"/usr/lib/aarch64-linux-gnu/{blas,lapack})
cat >"$root/python" <<END
#!/bin/sh
exec env LD_LIBRARY_PATH="$libraries" PYTHONPATH="$packages" qemu-aarch64-static -L "$root" "$root/usr/bin/python3.9" "\$@"
END
cat >"$root/sdg" <<END
#!/bin/sh
exec "$root/python" "$packages/bin/sdg" "\$@"
END
chmod 755 "$root/python" "$root/sdg"
as_nobody() { unshare --net setpriv --reuid nobody --regid nogroup --clear-groups env HOME=/nonexistent "$@"; }
as_nobody sh scripts/packages/first_grasp.sh "$root/sdg" datasets/demonstrations "$folder" 2>&1 | tail -1
echo "wheel for arm64: from installing to the grasp drawn on a photo, $("$root/python" --version) under qemu: \
$(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"
as_nobody "$root/python" -c "$script" "$folder/pendulum.sdg" datasets/demonstrations/pendulum/image.png
