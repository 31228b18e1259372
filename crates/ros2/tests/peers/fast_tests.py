"""Tests sdg ros2 against Fast DDS on loopback, with the C++ peer beside this file.

python fast_tests.py SDG FOLDER PEER
"""

import json
import pathlib
import subprocess
import sys

import node_tests
from node_tests import CAMERA, Sdg, check, image, pack, photo, teach


def main(sdg, folder, peer):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    packed = folder / "image.cdr"
    packed.write_bytes(pack(image(photo()), "sensor_msgs/msg/Image"))
    for domain, rate, is_reliable in [(51, 10, 1), (52, 10, 0), (53, 30, 1), (54, 30, 0)]:
        option = ["--reliable"] if is_reliable else []
        with Sdg(sdg, domain, f"--grasp-model={model}", f"--camera={CAMERA}", "--queue=250", *option, rmw="fastrtps") as node:
            done = subprocess.run([peer, str(domain), packed, "200", str(rate), str(is_reliable)], capture_output=True, text=True, timeout=200)
            found = json.loads(done.stdout)
            kind = "reliable" if is_reliable else "best effort"
            print(f"      {kind}, {rate} Hz: {found}", flush=True)
            if is_reliable and rate == 10:
                check(found["detections"] == 200 == found["poses"], f"reliable at 10 Hz: {found['detections']} of 200 results, {found['poses']} poses")
                check("1 found" in found["answer"], f"detect_trigger: {found['answer']}, {found['answered_ms']:.0f} ms")
            del node
    print(f"{len(node_tests.failures)} failures", flush=True)
    return bool(node_tests.failures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]))
