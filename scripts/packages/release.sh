#!/usr/bin/env bash
# Makes all files of a release in target/packages/release/VERSION: packages, wheel, image, zip, the list of crates in the program
# (CycloneDX), SHA256SUMS. Nothing is published: docs/releasing.md describes the steps before and after. `make release`.
set -euo pipefail
cd "$(dirname "$0")/../.."

version=$(sed -n '/^\[workspace.package\]/,/^version/s/^version = "\(.*\)"/\1/p' Cargo.toml)

if [ -z "${DIRTY:-}" ] && [ -n "$(git status --porcelain)" ]; then
    echo "release: expected a clean working tree, so that the commit identifies the sources; found changes (git status); DIRTY=1 builds anyway" >&2
    exit 1
fi
# At most twenty lines per version.
awk '/^## / { version = $0; lines = 0 } /^- / && ++lines > 20 { print "release: CHANGELOG.md: " version " has more than 20 lines"; exit 1 }' CHANGELOG.md >&2
scripts/packages/semver.sh

export AUDITABLE=1
for arch in amd64 arm64; do
    ARCH=$arch scripts/packages/deb.sh
    ARCH=$arch scripts/packages/tarball.sh
    ARCH=$arch scripts/packages/wheel.sh
done
scripts/packages/image.sh
scripts/packages/windows.sh

out=target/packages/release/$version
rm -rf "$out"
mkdir -p "$out"
cp target/packages/deb/*_"$version"_*.deb target/packages/tarball/*-"$version"-*.tar.xz target/packages/image/*-"$version"-*.oci.tar \
    target/packages/windows/*-"$version"-*.zip target/packages/wheel/single_demo_grasp-"$version"-*.whl "$out"
scripts/packages/sbom.sh "$out/single-demo-grasp-$version.cdx.json"
(cd "$out" && sha256sum -- * >SHA256SUMS && sha256sum --check --quiet SHA256SUMS)
echo "release: $out"
(cd "$out" && ls -l | awk 'NR > 1 { print $5, $9 }')
