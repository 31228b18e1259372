"""Grasps over ROS 2 in a cell simulated by MuJoCo (example ros2_cell), compared with the same attempts in one process.

python grasp_tests.py SDG FOLDER CELL ATTEMPTS [PART ...]
python grasp_tests.py call DOMAIN: calls /sdg/grasp once.
"""

import json
import pathlib
import subprocess
import sys
import threading
import time

from cyclone import Client, Peer, make, pack, unpack
from node_tests import CAMERA, REPOSITORY, Sdg, check, failures

WORKCELL = REPOSITORY / "datasets/workcell/workcell.toml"
PARTS = ["pendulum", "rod_end", "key", "housing"]
SPEED = 0.6


def grasp(peer, timeout=180.0):
    client = Client(peer.participant, "/sdg/grasp", "sdg_interfaces/Grasp", "", "srv")
    time.sleep(2.0)
    request = pack(make("sdg_interfaces/msg/GraspRequest", speed=SPEED), "sdg_interfaces/msg/GraspRequest")
    answer, secs = client.call(request, timeout)
    return (unpack(answer, "sdg_interfaces/msg/GraspResponse") if answer else None), secs


def over_ros(sdg, cell, model, part, seed, domain):
    """Whether the answer says that the part is held, whether the part was lifted in the cell, and the text of the
    answer."""
    simulated = subprocess.Popen([cell, part, str(seed), str(domain), "cyclonedds"], stdout=subprocess.PIPE, text=True)
    said = []
    reader = threading.Thread(target=lambda: said.extend(simulated.stdout), daemon=True)
    reader.start()
    try:
        time.sleep(2.0)
        with Sdg(sdg, domain, f"--grasp-model={model}", f"--camera={CAMERA}", f"--workcell={WORKCELL}", "--base-frame=panda_link0", "--allow-motion") as node:
            answer, secs = grasp(Peer(domain))
            time.sleep(0.5)
    finally:
        simulated.terminate()
        simulated.wait(10)
        reader.join(5)
    lifted = sum("lifted" in line for line in said) > sum("down" in line for line in said)
    held = bool(answer and answer.success)
    if held:
        check(answer.step == "hold", f"the last step of a grasp is hold, found {answer.step}")
    # Without an answer, the node's lines give the reason.
    words = f"{answer.step}: {answer.message}" if answer else f"no answer in {secs:.0f} s; the node said {node.lines[-4:]}"
    return held, lifted, words


def in_process(sdg, model, part, seed):
    done = subprocess.run([sdg, "grasp", "--robot=sim", f"--from=sim:{part}?seed={seed}", f"--grasp-model={model}", f"--workcell={WORKCELL}",
                           f"--speed={SPEED}", "--json", "--yes"], capture_output=True, text=True)
    lines = done.stdout.splitlines()
    return bool(lines) and json.loads(lines[-1])["held"]


def heights(part):
    for file in (REPOSITORY / "datasets/objects" / part).glob("*.json"):
        told = json.loads(file.read_text())
        if "mark_height_m" in told:
            return [f"--mark-height-mm={told['mark_height_m'] * 1e3}", f"--grasp-height-mm={told['grasp_height_m'] * 1e3}"]
    raise FileNotFoundError(part)


def main(sdg, folder, cell, attempts, parts):
    counted = [0, 0]
    for part in parts:
        demonstration = REPOSITORY / "datasets/demonstrations" / part
        model = folder / f"{part}-grasp.sdg"
        if not model.exists():
            subprocess.run([sdg, "teach", "--model=S", f"--demo={demonstration}/image.png:{demonstration}/annotation.json", f"--camera={CAMERA}",
                            *heights(part), f"--out={model}"], check=True, stderr=subprocess.DEVNULL)
        for seed in range(1, attempts + 1):
            held, lifted, words = over_ros(sdg, cell, model, part, seed, 60 + seed % 20)
            beside = in_process(sdg, model, part, seed)
            counted[0] += held and lifted
            counted[1] += beside
            print(f"      {part} {seed}: over ROS 2 {'held' if held else words}{'' if held == lifted else ', which the cell denies'}; "
                  f"in process {'held' if beside else 'not held'}", flush=True)
    total = attempts * len(parts)
    check(counted[0] >= counted[1] - 2 * total / 40, f"{counted[0]} of {total} held over ROS 2, {counted[1]} in process")
    return bool(failures)


if __name__ == "__main__":
    if sys.argv[1] == "call":
        answer, secs = grasp(Peer(int(sys.argv[2])))
        print(f"{answer.step}: {answer.message} ({secs:.1f} s)" if answer else "no answer")
        sys.exit(not (answer and answer.success))
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    sys.exit(main(sys.argv[1], folder, sys.argv[3], int(sys.argv[4]), sys.argv[5:] or PARTS))
