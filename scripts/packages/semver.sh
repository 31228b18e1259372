#!/usr/bin/env bash
# Checks with cargo-semver-checks that the interfaces of the libraries for other programs are compatible with a release. BASELINE is the
# git revision of that release, by default the newest tag v* before HEAD; without one nothing is checked, with a message. Usage: semver.sh [CRATE…]
set -euo pipefail
cd "$(dirname "$0")/../.."

tools=target/packages/tools
# Not a tag of HEAD, which is the release to be compared.
baseline=${BASELINE:-$(git tag --list 'v*' --no-contains HEAD --sort=-version:refname | head -1)}
if [ -z "$baseline" ]; then
    echo "release: interfaces not compared: there is no earlier tag v* to compare with (0.2.0 will be the first)"
    exit 0
fi
[ -x "$tools/bin/cargo-semver-checks" ] || env -u CARGO_TARGET_DIR cargo install --quiet --debug --locked --root "$tools" cargo-semver-checks@0.51.0
crates=("$@")
[ $# -gt 0 ] || read -ra crates <<<"$(sed -n 's/^PACKAGED = //p' Makefile)"
PATH=$PWD/$tools/bin:$PATH CARGO_TARGET_DIR=target/packages/semver \
    cargo semver-checks --baseline-rev "$baseline" "${crates[@]/#/--package=sdg-}"
