#!/usr/bin/env bash
# Prints the time of the last commit in seconds, which becomes the date of all packaged files. Usage: commit_date.sh
set -euo pipefail
cd "$(dirname "$0")/../.."

git log -1 --format=%ct || {
    echo "packages: expected a git clone, whose last commit dates the files; found none in $PWD" >&2
    exit 1
}
