#!/usr/bin/env bash
# Makes an OCI image for users, target/packages/image/single-demo-grasp-VERSION-amd64.oci.tar: the system of the Slurm
# image, and in /usr the contents of the packages; the user is not root, and the working folder is /data. Then programs
# run in the unpacked image as for a user, without network; if the machine allows no namespaces, this step is skipped
# with a message. `make image`.
set -euo pipefail
cd "$(dirname "$0")/../.."
# lay_out.sh needs it; without it the build of the program would be in vain.
scripts/packages/commit_date.sh >/dev/null
source scripts/packages/arch.sh

if [ "$arch" != amd64 ]; then
    echo "image: expected ARCH=amd64, found ARCH=$arch: the system's packages are configured on this machine" >&2
    exit 2
fi
scripts/packages/program.sh
version=$("$program/sdg" --version | cut -d ' ' -f 2)
out=$(realpath -m target/packages/image)
work=$out/work
layout=$out/layout
rm -rf "$work"
mkdir -p "$work/layer/data"

scripts/oci_system.sh "$layout" "$version" "$work"
scripts/packages/lay_out.sh "$work/layer/usr"
# User and group are numbers, because the image has no account. `--user` accepts any number, so everyone may write to the folder.
chmod 1777 "$work/layer/data"
tar --create --owner=0 --group=0 --numeric-owner --sort=name --file "$work/sdg.tar" -C "$work/layer" usr data
umoci raw add-layer --image "$layout:$version" "$work/sdg.tar"
umoci config --image "$layout:$version" --config.user 1000:1000 --config.workingdir /data --config.env HOME=/data \
    --config.entrypoint /usr/bin/sdg --config.cmd --help
image=$out/single-demo-grasp-$version-$arch.oci.tar
tar --create --file "$image.new" -C "$layout" .
mv "$image.new" "$image"
echo "image: $image, $(stat -c %s "$image") bytes"

if ! unshare --mount --net --pid --fork true 2>/dev/null; then
    echo "image: not used: this machine allows no namespaces" >&2
    exit 0
fi
umoci unpack --image "$layout:$version" "$work/bundle" >/dev/null
# Checks the configuration with which a container is started.
config=$work/bundle/config.json
[ "$(python3 -c 'import json, sys; process = json.load(open(sys.argv[1]))["process"]; print(process["user"]["uid"], process["cwd"], process["args"][0])' "$config")" = \
    "1000 /data /usr/bin/sdg" ]
start=$(date +%s.%N)
unshare --mount --net --pid --fork bash -euc '
    mount -t proc proc "$1/proc"
    mount --bind /dev "$1/dev"
    in_image() { chroot --userspec 1000:1000 "$1" /usr/bin/env --chdir /data HOME=/data "${@:2}"; }
    cp scripts/packages/first_grasp.sh "$1/first_grasp.sh"
    in_image "$1" sh /first_grasp.sh /usr/bin/sdg /usr/share/single-demo-grasp /data | tail -1
    seconds() { echo "$(date +%s.%N) - $2" | bc | cut -c 1-5; }
    echo "image: from starting to the grasp drawn on a photo: $(seconds "$@") s"
    in_image "$1" /usr/bin/sdg rehearse --object pendulum --grasp-model pendulum.sdg --attempts 1 --out report | tail -1
    # The page, over the loopback interface.
    ip link set lo up
    in_image "$1" cp /usr/share/single-demo-grasp/pendulum/image.png photo.png
    in_image "$1" timeout 60 /usr/bin/sdg annotate --no-browser --json photo.png >"$1/data/address" &
    for _ in $(seq 250); do [ ! -s "$1/data/address" ] || break; sleep 0.2; done
    [ -s "$1/data/address" ] || { echo "image: annotate has not printed its address in 50 s" >&2; exit 1; }
    python3 - "$1/data/address" <<"END"
import json, sys, urllib.request
address = json.load(open(sys.argv[1]))
page = urllib.request.urlopen(address["url"], timeout=10)
print("image: the page answers:", page.status, len(page.read()), "bytes")
END
    kill %1
' unshare "$work/bundle/rootfs" "$start"
rm -rf "$work"
