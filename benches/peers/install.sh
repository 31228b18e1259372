#!/usr/bin/env bash
# Installs the peers that we are compared with into a folder: install.sh FOLDER. Does nothing if they are installed.
# torch is installed without its CUDA packages: see without_cuda.py.
set -euo pipefail

folder=$1
peers=$(cd "$(dirname "$0")" && pwd)
stamp=$(cat "$peers/requirements.txt" "$peers/without_cuda.py" "$0" | cksum)
if [ "$(cat "$folder/installed" 2>/dev/null || true)" = "$stamp" ]; then
    exit 0
fi

packages=()
python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3-venv)
command -v nm >/dev/null || packages+=(binutils)
if [ ${#packages[@]} -gt 0 ]; then
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    echo "bench: installing ${packages[*]}" >&2
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
fi

echo "bench: installing the peers into $folder (once; about 0.9 GB to fetch, 2 GB on disk)" >&2
rm -rf "$folder"
python3 -m venv "$folder"
# Every needed package is listed with its version; --no-deps leaves out the packages that torch would add for CUDA.
"$folder/bin/pip" install --quiet --disable-pip-version-check --no-deps --requirement "$peers/requirements.txt"
site_packages=$("$folder/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
"$folder/bin/python" "$peers/without_cuda.py" "$site_packages"
"$folder/bin/python" -c 'import torch, torchvision, onnxruntime, openvino, cv2; torch.zeros(2, 2) @ torch.zeros(2, 2)'
echo "$stamp" >"$folder/installed"
