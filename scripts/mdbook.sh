#!/usr/bin/env bash
# Installs mdBook, which builds the site's pages, into target/tools; does nothing if it is installed. It is compiled without its server
# and search, which would take most of the time. It is only a build tool: its licence (MPL-2.0) is not ours.
set -euo pipefail
cd "$(dirname "$0")/.."

version=0.5.4
[ "$(target/tools/bin/mdbook --version 2>/dev/null || true)" = "mdbook v$version" ] && exit 0
echo "site: installing mdBook $version (two minutes, once)" >&2
"${CARGO:-cargo}" install --quiet --locked --no-default-features --root target/tools --target-dir target/tools/build "mdbook@$version"
rm -rf target/tools/build
