#!/usr/bin/env bash
# Installs a wheel in a clean root of the oldest supported Debian release, with that release's Python and numpy, and uses it without
# network and not as root: the command, and the package. A wheel for arm64 is used under qemu. Prints seconds. Usage: try_wheel.sh WHEEL
set -euo pipefail
cd "$(dirname "$0")/../.."

wheel=$1
root=$(realpath -m target/packages/wheel-root)
script='
import sys, sdg
model = sdg.GraspModel.load(sys.argv[1])
print("wheel: the same model from Python:", model.detect(sdg.read_picture(sys.argv[2])).best.grasp)
'
case $wheel in
    *_aarch64.whl)
        [ "$(uname -m)" = aarch64 ] || exec scripts/packages/try_wheel_arm64.sh "$wheel" "$script"
        ;;
esac
scripts/packages/clean_root.sh bullseye "$root" python3-pip,python3-numpy
cp "$wheel" "$root/opt"
cp scripts/packages/first_grasp.sh "$root/first_grasp.sh"
cp -r datasets/demonstrations "$root/opt/photos"
inside() { unshare --mount --net --pid --fork chroot "$root" "$@"; }
as_nobody() { unshare --mount --net --pid --fork chroot --userspec nobody:nogroup "$root" /usr/bin/env HOME=/nonexistent "$@"; }

start=$(date +%s.%N)
inside pip3 install --quiet --no-index "/opt/$(basename "$wheel")"
inside bash -euc 'mkdir -p "/tmp/erste Größe"; chown nobody "/tmp/erste Größe"'
as_nobody sh /first_grasp.sh sdg /opt/photos "/tmp/erste Größe" 2>&1 | tail -1
echo "wheel: from installing to the grasp drawn on a photo, $(inside python3 --version): $(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"
as_nobody python3 -c "$script" "/tmp/erste Größe/pendulum.sdg" /opt/photos/pendulum/image.png
