"""Searches the rendered pictures for the random parts with the program. Usage: search_train.py RENDERED SDG

RENDERED has the folders of make_train.py, SDG is the program. Writes FOLDER/found.jsonl with all
detections of `sdg detect --all --json` in the pictures, accepted and refused by model S. pack_train.py makes
crops at these poses, too. A folder that has `found.jsonl` is skipped.
"""

import argparse
import glob
import os
import subprocess
import tempfile

TAUGHT = (0, 4)  # exit statuses of `sdg teach` with which it has written a model
SEARCHED = (0, 3)  # exit statuses of `sdg detect` with which it has searched all pictures


def search(folder, sdg):
    """Teaches the part from its demonstration and searches the folder's pictures for it."""
    with tempfile.TemporaryDirectory() as scratch:
        model = os.path.join(scratch, "part.sdg")
        demo = f"{folder}/demo.jpg:{folder}/demo.json"
        teach = [sdg, "teach", "--model", "shape", "--demo", demo, "--out", model, "--seed", "1"]
        made = subprocess.run(teach, capture_output=True, text=True)
        if made.returncode not in TAUGHT:
            print(folder, made.stderr[-200:], flush=True)
            return
        pictures = sorted(glob.glob(os.path.join(folder, "mixed_*.jpg")))
        detect = [sdg, "detect", "--grasp-model", model, "--json", "--all", *pictures]
        found = subprocess.run(detect, capture_output=True, text=True)
        if found.returncode not in SEARCHED:
            print(folder, found.stderr[-200:], flush=True)
            return
    out = os.path.join(folder, "found.jsonl")
    # Renamed when complete, so an interrupted run leaves no incomplete file.
    with open(out + ".tmp", "w") as file:
        file.write(found.stdout)
    os.replace(out + ".tmp", out)


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("rendered")
    args.add_argument("sdg")
    args = args.parse_args()
    for folder in sorted(glob.glob(os.path.join(args.rendered, "r_*"))):
        is_rendered = os.path.exists(os.path.join(folder, "pairs.json"))
        if is_rendered and not os.path.exists(os.path.join(folder, "found.jsonl")):
            search(folder, args.sdg)


if __name__ == "__main__":
    main()
