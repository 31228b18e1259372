"""Keeps only the crates of a CycloneDX file that are in the program. Usage: keep_linked.py FILE <names, one line `NAME vVERSION` each.

cargo-cyclonedx lists all possible dependencies of the whole workspace, with the features of all members.
"""

import json
import sys

linked = {tuple(line.split()[:2]) for line in sys.stdin if line.strip()}
with open(sys.argv[1], encoding="utf-8") as file:
    bom = json.load(file)
bom["components"] = [part for part in bom["components"] if (part["name"], "v" + part["version"]) in linked]
program = bom["metadata"]["component"]
kept = {part["bom-ref"] for part in bom["components"]} | {program["bom-ref"]}
missing = linked - {(part["name"], "v" + part["version"]) for part in bom["components"]} - {(program["name"], "v" + program["version"])}
if missing:
    sys.exit(f"release: not listed by cargo-cyclonedx: {sorted(missing)}")
bom["dependencies"] = [
    {**entry, "dependsOn": [ref for ref in entry.get("dependsOn", []) if ref in kept]}
    for entry in bom.get("dependencies", [])
    if entry["ref"] in kept
]
with open(sys.argv[1], "w", encoding="utf-8") as file:
    json.dump(bom, file, indent=1)
