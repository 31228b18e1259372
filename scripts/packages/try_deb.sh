#!/usr/bin/env bash
# Installs a package in a clean Debian root without network, uses it as a user other than root, and removes it; then
# installs its recommended packages and rehearses a grasp. Prints seconds. Usage: try_deb.sh PACKAGE
set -euo pipefail
cd "$(dirname "$0")/../.."

deb=$1
root=$(realpath -m target/packages/deb-root)
scripts/packages/clean_root.sh bookworm "$root"
cp "$deb" "$root/sdg.deb"
cp scripts/packages/first_grasp.sh "$root/first_grasp.sh"
# All files outside /var, /tmp and /home.
files() { find "$root" -xdev \( -path "$root/var/*" -o -path "$root/tmp" -o -path "$root/home" \) -prune -o -print | sort; }
inside() { unshare --mount --net --pid --fork chroot "$root" "$@"; }

files >"$root.before"
start=$(date +%s.%N)
inside dpkg --install /sdg.deb >/dev/null
# A home folder that does not exist, and a folder with a space and an umlaut.
inside bash -euc 'mkdir -p "/tmp/erste Größe"; chown nobody "/tmp/erste Größe"'
inside setpriv --reuid nobody --regid nogroup --clear-groups env HOME=/nonexistent \
    sh /first_grasp.sh sdg /usr/share/single-demo-grasp "/tmp/erste Größe" 2>&1 | tail -2
echo "deb: from installing to the grasp drawn on a photo: $(echo "$(date +%s.%N) - $start" | bc | cut -c 1-5) s"

# A command that needs MuJoCo reports this at once, in one line.
told=$(inside sdg demo --out /tmp/demo 2>&1) && { echo "deb: demo ran without MuJoCo" >&2; exit 1; }
[ "$(wc -l <<<"$told")" = 1 ] && grep -q 'libmujoco2.2.2' <<<"$told" || { echo "deb: demo without MuJoCo said: $told" >&2; exit 1; }
inside bash -euc 'man_page=/usr/share/man/man1/sdg.1.gz; gzip -t $man_page; bash -n /usr/share/bash-completion/completions/sdg'

inside dpkg --purge single-demo-grasp >/dev/null
files >"$root.after"
diff "$root.before" "$root.after" || { echo "deb: files remained, or were removed, with the package" >&2; exit 1; }
echo "deb: removed without a trace"

# With its recommended packages, as apt installs them, including the simulator.
cp /etc/resolv.conf "$root/etc/resolv.conf"
chroot "$root" apt-get update -qq
chroot "$root" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --install-recommends /sdg.deb >/dev/null
# The devices are mounted in a separate namespace: in that of the machine the mount would remain after a SIGKILL.
unshare --mount --net --pid --fork bash -euc '
    mount --bind /dev "$1/dev"
    chroot "$1" sdg rehearse --object pendulum --grasp-model "/tmp/erste Größe/pendulum.sdg" --attempts 1 --out /tmp/report
' unshare "$root" | tail -2
