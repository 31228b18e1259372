#!/usr/bin/env bash
# Whether the libraries that other programs use are still what a release promised, by cargo-semver-checks. BASELINE is that release as
# git knows it: the newest tag v*, without one nothing is checked and that is said. Usage: semver.sh [CRATE…]
set -euo pipefail
cd "$(dirname "$0")/../.."

tools=target/packages/tools
baseline=${BASELINE:-$(git tag --list 'v*' --sort=-version:refname | head -1)}
if [ -z "$baseline" ]; then
    echo "release: interfaces not compared: no tag v* is there to compare with (0.2.0 will be the first)"
    exit 0
fi
[ -x "$tools/bin/cargo-semver-checks" ] || cargo install --quiet --debug --locked --root "$tools" cargo-semver-checks@0.51.0
crates=("$@")
[ $# -gt 0 ] || read -ra crates <<<"$(sed -n 's/^PACKAGED = //p' Makefile)"
PATH=$PWD/$tools/bin:$PATH CARGO_TARGET_DIR=target/packages/semver \
    cargo semver-checks --baseline-rev "$baseline" "${crates[@]/#/--package=sdg-}"
