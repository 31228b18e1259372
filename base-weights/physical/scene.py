"""Light and scenes for Mitsuba, path tracing and denoising.

Scenes differ only in pictures of one size and in meshes, never in a number that Dr.Jit compiles in; the lamp has one of
28 positions, and every scene has the same number of meshes. So the kernels are compiled once per lamp.
"""

import hashlib
import math
import os
from dataclasses import dataclass

import mitsuba as mi
import mitsuba_oidn as oidn
import numpy as np
from PIL import Image

import materials
import meshes
import surfaces
from camera import HEIGHT, WIDTH

PLY = os.environ.get("PHYS_PLY", "scratch/ply")
PAD = 16  # pixels rendered beyond each edge, which the distortion needs
SLOTS = 26  # materials in a scene besides table, sheet, phone and lamp

ROOMS = dict(
    soft=("overcast", "office", "window", "mixed"),
    plain=("office", "window", "mixed", "overcast", "evening"),
    sun=("window", "mixed", "overcast"),
    lamp=("evening", "office", "window"),
    glare=("office", "window"),
    dark=("evening", "window"),
    colour=("evening", "mixed"),
)
# Irradiance of the lamp relative to the room's, and half sides in mm of the lamps that a style may use.
LAMP_AMOUNT = dict(
    soft=(0.05, 0.05),
    plain=(0.1, 0.8),
    sun=(0.05, 0.05),
    lamp=(1.5, 5),
    glare=(1, 3),
    dark=(0.2, 1.5),
    colour=(0.8, 2.5),
)
LAMP_SIZE = dict(
    soft=(100, 999), plain=(45, 999), sun=(45, 999), lamp=(0, 60), glare=(0, 999), dark=(25, 120), colour=(25, 120)
)
LAMP_COLOURS = [(1, 0.6, 0.25), (0.45, 0.65, 1.0), (0.7, 1.0, 0.6), (1.0, 0.5, 0.6)]


def stream(*key):
    """A random generator that depends only on the key."""
    digest = hashlib.sha256("|".join(map(str, key)).encode()).digest()
    return np.random.default_rng(int.from_bytes(digest[:8], "little"))


def lamps():
    """Positions and half sides of 20 lamps at the side and 8 overhead, which are reflected by the table."""
    r = stream("lamps")
    side, overhead = [], []
    for k in range(20):
        a, e, d = r.uniform(0, 2 * np.pi), math.radians(r.uniform(35, 75)), r.uniform(500, 900)
        place = d * np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)])
        side.append((np.round(place), float(round([18, 28, 45, 70, 110, 170][k % 6] * r.uniform(0.9, 1.1)))))
    for k in range(8):
        a, d = r.uniform(0, 2 * np.pi), r.uniform(60, 330)
        place = np.array([d * math.cos(a), d * math.sin(a), r.uniform(700, 1000)])
        overhead.append((np.round(place), float(round(r.uniform(40, 90)))))
    return side, overhead


SIDE_LAMPS, OVERHEAD_LAMPS = lamps()


@dataclass
class Light:
    style: str
    room: np.ndarray
    turn_deg: float
    lamp_pos: np.ndarray
    lamp_half: float
    lamp_radiance: np.ndarray
    sun_direction: np.ndarray
    sun_irradiance: np.ndarray


def make_light(rng, style):
    """Room, lamp and sun of a style; the irradiance of the room on the table is about 1."""
    room = surfaces.room(rng, ROOMS[style][rng.integers(len(ROOMS[style]))])
    amount = rng.uniform(*LAMP_AMOUNT[style])
    colour = np.array([1.0, rng.uniform(0.75, 0.98), rng.uniform(0.5, 0.95)])
    if style == "colour":
        colour = np.array(LAMP_COLOURS[rng.integers(len(LAMP_COLOURS))])
    lo, hi = LAMP_SIZE[style]
    choice = OVERHEAD_LAMPS if style == "glare" else [lamp for lamp in SIDE_LAMPS if lo <= lamp[1] <= hi]
    pos, half = choice[rng.integers(len(choice))]
    distance = np.linalg.norm(pos)
    radiance = amount * distance**2 / (half * half * 4 * pos[2] / distance)
    a, e = rng.uniform(0, 2 * np.pi), math.radians(rng.uniform(18, 60))
    sun = rng.uniform(2.5, 6) if style == "sun" else 0.0
    return Light(
        style=style,
        room=room,
        turn_deg=float(rng.uniform(0, 360)),
        lamp_pos=pos,
        lamp_half=half,
        lamp_radiance=radiance * colour,
        sun_direction=-np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)]),
        sun_irradiance=sun / math.sin(e) * np.array([1, 0.95, 0.86]) + 1e-4,
    )


def write_ply(path, g):
    columns = ("x", "y", "z", "nx", "ny", "nz", "u", "v")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(g['v'])}"]
    header += [f"property float {c}" for c in columns]
    header += [f"element face {len(g['f'])}", "property list uchar int vertex_index", "end_header", ""]
    faces = np.zeros(len(g["f"]), dtype=[("count", "u1"), ("idx", "<i4", 3)])
    faces["count"], faces["idx"] = 3, g["f"]
    with open(path, "wb") as f:
        f.write("\n".join(header).encode())
        f.write(np.hstack([g["v"], g["n"], g["uv"]]).astype("<f4").tobytes())
        f.write(faces.tobytes())


def look_along(origin, target, up):
    """Pose of a rectangle that faces from `origin` to `target`."""
    z = np.asarray(target, float) - origin
    z /= np.linalg.norm(z)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, np.cross(z, x), z, origin
    return m


def table_bsdf(t):
    def picture(a, raw):
        return {"type": "bitmap", "bitmap": mi.Bitmap(np.array(a)), "raw": raw}

    def flat(v):
        return picture(np.full((8, 8, 1), v, np.float32), True)

    def upright(p):  # Mitsuba's v runs upwards
        return p.resize((surfaces.SIZE, surfaces.SIZE)).transpose(Image.FLIP_TOP_BOTTOM)

    bump = t.bump or surfaces.image(np.full((8, 8), 0.5))
    height = np.asarray(upright(bump.convert("L")), np.float32)[..., None] / 255 * float(t.bump_mm)
    colour = upright(t.colour.convert("RGB"))
    bsdf = {
        "type": "principled",
        "base_color": {"type": "bitmap", "bitmap": mi.Bitmap(np.array(colour))},
        "roughness": flat(t.rough),
        "metallic": flat(t.metallic),
        "specular": 0.4,
    }
    return {"type": "twosided", "b": {"type": "bumpmap", "t": picture(height, True), "scale": 1.0, "b": bsdf}}


class Scene:
    """Builds a scene's dictionary; its meshes are files until `render` has loaded them."""

    def __init__(self):
        os.makedirs(PLY, exist_ok=True)
        self.dict = {"type": "scene"}
        self.files = []

    def mesh(self, name, group, bsdf, **more):
        path = os.path.join(PLY, f"now{os.getpid()}_{name}.ply")
        write_ply(path, group)
        self.files.append(path)
        self.dict[name] = {"type": "ply", "filename": path, "bsdf": bsdf, **more}

    def rectangle(self, name, m, half_x, half_y, bsdf, uv=None, **more):
        v = np.array([[-half_x, -half_y, 0], [half_x, -half_y, 0], [half_x, half_y, 0], [-half_x, half_y, 0]], float)
        group = dict(
            v=v @ m[:3, :3].T + m[:3, 3],
            n=np.tile(m[:3, 2], (4, 1)),
            uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]) if uv is None else uv,
            f=np.array([[0, 1, 2], [0, 2, 3]]),
        )
        self.mesh(name, group, bsdf, **more)

    def sensor(self, cam, spp):
        w, h = WIDTH + 2 * PAD, HEIGHT + 2 * PAD
        self.dict["integrator"] = {
            "type": "aov",
            "aovs": "al:albedo,nn:sh_normal",
            "img": {"type": "path", "max_depth": 5, "rr_depth": 3},
        }
        self.dict["sensor"] = {
            "type": "perspective",
            "fov": math.degrees(2 * math.atan(w / 2 / cam.f)),
            "fov_axis": "x",
            "near_clip": 5.0,
            "far_clip": 20000.0,
            "to_world": cam.to_world,
            "film": {
                "type": "hdrfilm",
                "width": w,
                "height": h,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent", "sample_count": spp},
        }

    def light(self, light):
        turn = mi.ScalarTransform4f().rotate([0, 0, 1], light.turn_deg).rotate([1, 0, 0], 90)
        self.dict["env"] = {"type": "envmap", "bitmap": mi.Bitmap(light.room), "to_world": turn}
        self.dict["sun"] = {
            "type": "directional",
            "direction": [float(v) for v in light.sun_direction],
            "irradiance": materials.rgb(light.sun_irradiance),
        }
        pose = look_along(light.lamp_pos, np.zeros(3), np.array([0.1, 0.2, 1]))
        emitter = {"type": "area", "radiance": materials.rgb(light.lamp_radiance)}
        self.rectangle("lamp", pose, light.lamp_half, light.lamp_half, {"type": "diffuse"}, emitter=emitter)

    def table(self, rng, t):
        half = 1500.0
        a = math.radians(rng.uniform(-15, 15) + 90 * rng.integers(2))
        turn = np.array([[math.cos(a), math.sin(a)], [-math.sin(a), math.cos(a)]])
        corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
        self.rectangle(
            "table", np.eye(4), half, half, table_bsdf(t), corners / t.width_mm @ turn + rng.uniform(0, 1, 2)
        )

    def sheet(self, rng, near, visible):
        """A sheet of paper or card on the table; below the table if it is not visible."""
        w, h = [(105, 148), (74, 105), (148, 210)][rng.integers(3)]
        place = near + rng.uniform(-70, 70, 2)
        if visible:
            t = surfaces.table(rng, ["print", "white", "cardboard", "white"][rng.integers(4)])
        else:
            t = surfaces.Table(surfaces.image(np.full((8, 8, 3), 0.5)))
        m = meshes.rot("z", rng.uniform(0, 360))
        m[:3, 3] = [*place, 0.04 if visible else -50]
        self.rectangle("sheet", m, w / 2, h / 2, table_bsdf(surfaces.Table(t.colour, 0.7)))

    def phone(self, cam, phone):
        """The phone or webcam that takes the picture: it casts a shadow and is reflected by shiny faces."""
        forward = (cam.target - cam.pos) / np.linalg.norm(cam.target - cam.pos)
        right, up = cam.world_from_camera[:3, 0], cam.world_from_camera[:3, 1]
        place = cam.pos - forward * 9 + (right * 26 - up * 58 if phone else 0)
        dark = {"type": "twosided", "b": {"type": "diffuse", "reflectance": materials.rgb((0.03, 0.03, 0.035))}}
        self.rectangle("phone", look_along(place, place + forward, up), *((38, 76) if phone else (35, 20)), dark)

    def bodies(self, items, material_of):
        by_material = {}
        for body, m in items:
            for g in body.groups:
                faces = (g["v"] @ m[:3, :3].T + m[:3, 3], g["f"], g["n"] @ m[:3, :3].T, g["uv"])
                by_material.setdefault(g["mat"], []).append(faces)
        below_table = dict(
            v=np.array([[0, 0, -60], [1, 0, -60], [0, 1, -60.0]]),
            n=np.tile([0, 0, 1.0], (3, 1)),
            uv=np.zeros((3, 2)),
            f=np.array([[0, 1, 2]]),
        )
        for k, (name, is_used) in enumerate(self.slots(by_material)):
            mesh = meshes.join(by_material[name], name) if is_used else below_table
            self.mesh(f"m{k}", mesh, material_of(name))

    def slots(self, names):
        """The materials of all slots as (material, is used): those of the bodies, then others up to SLOTS."""
        out = list(dict.fromkeys([*names, *materials.ONE_OF_EACH_TYPE]))
        out += ["blank" if k % 2 else materials.FILLER for k in range(len(out), SLOTS)]
        return [(name, k < len(names)) for k, name in enumerate(out)]

    def render(self, spp, seed):
        """Linear RGB, denoised, (HEIGHT + 2 PAD, WIDTH + 2 PAD, 3)."""
        scene = mi.load_dict(self.dict)
        a = np.array(mi.render(scene, spp=spp, seed=seed)).astype(np.float32)
        for path in self.files:
            os.remove(path)
        a = np.nan_to_num(a, nan=0, posinf=50, neginf=0)
        picture = oidn.denoise(
            np.ascontiguousarray(np.minimum(a[..., :3], 60)),
            albedo=np.ascontiguousarray(np.clip(a[..., 3:6], 0, 1)),
            normal=np.ascontiguousarray(a[..., 6:9]),
            hdr=True,
            quality=oidn.Quality.Balanced,
        )
        return np.asarray(picture)
