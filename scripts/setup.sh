#!/usr/bin/env bash
# Checks Rust's version, and installs the missing Debian packages for the build and, if apt has them, for the simulator.
# Uses sudo only if not root. Called by every make target that builds; finishes in milliseconds if there is nothing to do.
set -euo pipefail
cd "$(dirname "$0")/.."

build=(gcc libc6-dev)
simulator=(libmujoco-dev libegl1 libgl1-mesa-dri)

expected=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
if ! command -v cargo >/dev/null; then
    echo "setup: Rust is missing: install it with rustup (https://rustup.rs), or your distribution's rustc $expected or later" >&2
    exit 1
fi
found=$(${CARGO:-cargo} --version | cut -d ' ' -f 2)
if ! printf '%s\n' "$expected" "$found" | sort --version-sort --check=quiet; then
    echo "setup: expected Rust $expected or later, found cargo $found: run rustup update, or install Rust with rustup (https://rustup.rs)" >&2
    exit 1
fi
if ! command -v dpkg-query >/dev/null; then
    echo "setup: this is not Debian: the build needs a C compiler; simulation needs MuJoCo 2.2.2, EGL and Mesa's software" >&2
    echo "setup: renderer at run time. Continuing without checking for them." >&2
    exit 0
fi

# Whether apt has the simulator, or has no lists of packages yet. Without this check every run would update the lists.
may_have_simulator() {
    dpkg-query -W libmujoco-dev >/dev/null 2>&1 || apt-cache show libmujoco-dev >/dev/null 2>&1 ||
        ! compgen -G '/var/lib/apt/lists/*_main_*_Packages*' >/dev/null
}
# Together, so that a new machine updates the lists once.
if may_have_simulator && scripts/install.sh "${build[@]}" "${simulator[@]}"; then
    exit 0
fi
scripts/install.sh "${build[@]}"
echo "setup: ${simulator[*]} could not be installed: sdg is built without them and does not simulate" >&2
