#!/usr/bin/env bash
# Tests Video4Linux 2 cameras without a camera and without root: QEMU boots Debian's stock kernel from an initramfs with the test
# binary of crates/camera/tests/v4l.rs, the driver vivid, and a USB camera that the test itself simulates over USB/IP.
set -euo pipefail
cd "$(dirname "$0")/.."
work=${CARGO_TARGET_DIR:-target}/v4l
mkdir -p "$work"
. scripts/qemu.sh

# The binary's path is the last word of cargo's line "Executable tests/main.rs (PATH)".
built=$(${CARGO:-cargo} test --release --locked -p sdg-camera --test camera --no-run 2>&1) || { echo "$built" >&2; exit 1; }
binary=$(sed -n 's/.*Executable tests\/main.rs (\(.*\))$/\1/p' <<<"$built")

root=$work/root
# One node of vivid that captures, like a webcam.
initramfs_root "$root" "vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0" uvcvideo vhci-hcd <<'INIT'
/bin/v4l-test v4l:: --ignored --test-threads 1 --nocapture
echo "v4l-test ended with $?"
INIT
cp "$binary" "$root/bin/v4l-test"
# The libraries of the binary, at the paths where it looks for them.
ldd "$binary" | grep -o '/[^ ]*' | while read -r library; do
    mkdir -p "$root$(dirname "$library")"
    cp -L "$library" "$root$library"
done

# Not KVM, which is missing or broken in many virtual machines; without it the boot also takes only seconds.
boot 120 "$root" -accel tcg -m 512 -smp 2 | tee "$work/log" | sed -n '/running [0-9]* test/,$p' || true
grep -q '^v4l-test ended with 0$' "$work/log" || { echo "test-v4l: failed; the virtual machine's output is in $work/log" >&2; exit 1; }
