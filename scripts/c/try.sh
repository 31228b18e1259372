#!/usr/bin/env bash
# Installs the C library in a clean Debian root with a C compiler, compiles two small programs against it, and uses them without network
# and not as root: model S is taught the pendulum and detects it. Prints seconds. `make capi TRY=1`. Usage: try.sh FOLDER (of `make capi`)
set -euo pipefail
cd "$(dirname "$0")/../.."

root=$(realpath -m target/packages/capi-root)
scripts/packages/clean_root.sh bookworm "$root" gcc,libc6-dev,pkg-config,netpbm
mkdir -p "$root/opt/sources"
cp crates/capi/tests/{teach.c,detect.c,ppm.h} "$root/opt/sources"
cp -r datasets/demonstrations/pendulum "$root/opt/photo"
inside() { unshare --mount --net --pid --fork chroot "$root" "$@"; }

start=$(date +%s.%N)
cp -r "$1/." "$root/usr/local"
inside ldconfig
inside sh -euc 'cd /opt/sources
for program in teach detect; do cc -o "/usr/local/bin/$program" "$program.c" $(pkg-config --cflags --libs sdg); done'
inside setpriv --reuid nobody --regid nogroup --clear-groups env HOME=/nonexistent sh -euc 'cd /tmp
teach /opt/photo/image.png /opt/photo/annotation.json S 0 - 0 pendulum.sdg
pngtopnm /opt/photo/image.png > photo.ppm
detect pendulum.sdg - 0 photo.ppm | head -1' | python3 -c 'import json, sys; print("capi:", json.loads(sys.stdin.readline())[0]["grasp"])'
echo "capi: from installing to the grasp on a photo, two programs compiled between: $(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"
