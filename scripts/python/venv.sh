#!/usr/bin/env bash
# Makes a virtual environment with the given packages; does nothing if it has them: venv.sh FOLDER PACKAGE[==VERSION] …
set -euo pipefail

folder=$1
shift
# An environment works only in the folder and with the Python for which it was made.
stamp() { echo "$(realpath -m "$folder") $(python3 -V 2>/dev/null) $*"; }
if [ "$(cat "$folder/installed" 2>/dev/null || true)" = "$(stamp "$@")" ] && "$folder/bin/python" -c '' 2>/dev/null; then
    exit 0
fi
python3 -c 'import ensurepip, venv' 2>/dev/null || "$(dirname "$0")/../install.sh" python3-venv
rm -rf "$folder"
python3 -m venv "$folder"
"$folder/bin/pip" install --quiet --disable-pip-version-check "$@"
stamp "$@" >"$folder/installed"
