"""Scenes with a fixed number of slots for the materials of each BSDF type.

Dr.Jit compiles the kernels again for a scene with other numbers of BSDF types, which takes longer than the rendering.
The random parts (make_train.py) have too many combinations of materials to compile for each, so all their scenes have
the same slots, and unused slots are filled with a mesh below the table.
"""

from scene import Scene

# Slots of a scene for materials of one BSDF type.
QUOTAS = dict(conductor=6, metal=6, plastic=6, coated=4, printed=6)
CONDUCTORS = ("zinc", "steel", "alu", "tin", "copper", "brass", "brassplate", "bronze")
# Materials for slots that are not used.
FILLERS = dict(
    conductor=CONDUCTORS,
    metal=[f"metal:0.{k},0.5,0.5" for k in range(1, 8)],
    plastic=[f"plastic:0.{k},0.5,0.5" for k in range(1, 8)],
    coated=[f"paint:0.{k},0.5,0.5" for k in range(1, 8)],
    printed=[f"blank:0.{k},0.5,0.5" for k in range(1, 8)],
)


def bsdf_type(name):
    """The key of QUOTAS for a material's name."""
    kind = name.split(":")[0]
    if kind in ("print", "blank"):
        return "printed"
    if kind in ("paint", "board"):
        return "coated"
    if kind == "plastic":
        return "plastic"
    return "conductor" if kind in CONDUCTORS else "metal"


def fits(names):
    """Whether a scene has slots for these materials."""
    kinds = [bsdf_type(n) for n in set(names)]
    return all(kinds.count(k) <= quota for k, quota in QUOTAS.items())


class QuotaScene(Scene):
    """A scene with the slots of QUOTAS in place of `scene.SLOTS`; its materials must fit."""

    def slots(self, names):
        out = []
        for kind, quota in QUOTAS.items():
            own = sorted(n for n in names if bsdf_type(n) == kind)
            rest = [n for n in FILLERS[kind] if n not in own][: quota - len(own)]
            out += [(n, True) for n in own]
            out += [(n, False) for n in rest]
        return out
