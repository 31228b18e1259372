#!/usr/bin/env bash
# Installs the missing Debian packages for the build and the simulator.
# Uses sudo only if not root. Called by every make target that builds; finishes in milliseconds if there is nothing to do.
set -euo pipefail

packages=(gcc libc6-dev libmujoco-dev libegl1 libgl1-mesa-dri)

if ! command -v cargo >/dev/null; then
    echo "setup: Rust is missing: install it with rustup (https://rustup.rs), or your distribution's rustc 1.95 or later" >&2
    exit 1
fi
if ! command -v dpkg-query >/dev/null; then
    echo "setup: this is not Debian; the build needs MuJoCo 2.2.2 (libmujoco.so and headers), EGL and Mesa's software" >&2
    echo "setup: renderer. Continuing without checking for them." >&2
    exit 0
fi

"$(dirname "$0")/install.sh" "${packages[@]}"
