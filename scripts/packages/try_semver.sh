#!/usr/bin/env bash
# Shows that semver.sh finds a break: compares sdg-geometry at HEAD with itself, then with a copy in which a public function has another
# name. It works in a separate worktree. Usage: try_semver.sh
set -euo pipefail
cd "$(dirname "$0")/../.."

tools=$(realpath -m target/packages/tools)
tree=$(mktemp -d)
trap 'git worktree remove --force "$tree"' EXIT
git worktree add --quiet --detach "$tree"
mkdir -p "$tree/target/packages" "$tools"
ln -s "$tools" "$tree/target/packages/tools"
cd "$tree"
BASELINE=HEAD scripts/packages/semver.sh geometry
git grep -lz 'upper_median' -- crates/geometry | xargs -0 sed -i 's/\bupper_median\b/middle_value/g'
if BASELINE=HEAD scripts/packages/semver.sh geometry >report.txt 2>&1; then
    echo "semver: a public function was renamed, and nothing was found" >&2
    exit 1
fi
grep -q upper_median report.txt || { cat report.txt >&2; exit 1; }
grep -m 3 -E 'FAIL|upper_median' report.txt
echo "semver: the renamed function is found"
