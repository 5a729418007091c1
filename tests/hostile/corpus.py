"""Small, whole files of every kind, which the cases spoil: what the program itself makes of a tiny lab,
and what others make (ray files, pictures, meshes)."""

import json
import shutil
import struct
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/judges"), str(ROOT / "bridges/judges")]
import exr  # noqa: E402
from judge_environment import write_hdr  # noqa: E402
from judge_pictures import write_png  # noqa: E402
from judge_rays import disc_rays, write_tm25  # noqa: E402

RIG = """[rig]
kind = "lensless"
delta_m = 0.25
[filter]
spacing_m = 0.02
"""
LAB = f"""[lab]
driver = "sim"
seed = 5
{RIG}[lamp]
kind = "square"
side_m = 0.06
depth_m = 0.03
radiance = 1000
[camera]
pitch_m = 0.01
width = 32
height = 24
bits = 12
black_dn = 100
saturation_dn = 4000
gain_dn_per_e = 0.5
responsivity_e_per_s_per_w_m2 = [1000]
min_exposure_s = 1e-4
max_exposure_s = 10
[stage]
min_m = [-0.1, -0.1]
max_m = [0.1, 0.1]
speed_m_per_s = 10
settle_s = 0
[errors.photon_noise]
[errors.read_noise]
rms_dn = 2
"""
PLAN = f"""[plan]
unit = "lm"
dark_repeats = 1
{RIG}[grid]
width = 2
height = 2
[lattice]
width = 8
height = 8
ds_m = 0.02
[exposure]
min_s = 0.01
max_s = 3
ratio = 4
relevant_share = 0.01
[reference]
every = 4
max_drift = 0.05
[warm_up]
window_s = 10
interval_s = 1
"""
SENSOR_LAB = LAB.replace(
    "side_m = 0.06\ndepth_m = 0.03\nradiance = 1000", "side_m = 1\nradiance = 15000"
)
SENSOR_PLAN = """[plan]
kind = "sensor"
[exposure]
min_s = 0.00115
max_s = 0.162
levels = 12
pairs = 1
[warm_up]
window_s = 10
interval_s = 1
"""
SCENE = """[camera]
position = [0, -3, 1.5]
look_at = [0, 0, 0.5]
width = 8
height = 6
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[material]]
name = "tiles"
albedo = [0.5, 0.5, 0.5]
texture = "t.png"
[[mesh]]
file = "m.obj"
[[mesh]]
file = "m.ply"
material = "grey"
[[mesh]]
file = "m.gltf"
position = [1, 0, 0]
[[quad]]
corner = [-2, -2, 0]
edge_u = [4, 0, 0]
edge_v = [0, 4, 0]
material = "tiles"
[[box]]
size = [0.3, 0.3, 0.3]
position = [-1, 0, 0.2]
rotate_deg = [0, 0, 30]
material = "grey"
[[view]]
name = "above"
position = [0, 0, 3]
look_at = [0, 0, 0]
up = [0, 1, 0]
"""
LIT = SCENE + """[[luminaire]]
file = "x.lf.exr"
position = [0, 0, 2]
look_at = [0, 0, 0]
up = [0, 1, 0]
[[light]]
kind = "sphere"
radius = 0.1
radiance = [1, 1, 1]
position = [1, 1, 2]
[environment]
file = "sky.hdr"
face_size = 8
"""
SMALL = """[camera]
position = [0, -3, 1.5]
look_at = [0, 0, 0.5]
width = 8
height = 6
[[material]]
name = "grey"
albedo = [0.5, 0.5, 0.5]
[[quad]]
corner = [-2, -2, 0]
edge_u = [4, 0, 0]
edge_v = [0, 4, 0]
material = "grey"
[[luminaire]]
file = "x.lf.exr"
position = [0, 0, 2]
look_at = [0, 0, 0]
up = [0, 1, 0]
"""
PATH = """frames_per_s = 2
[[camera]]
t_s = 0
position = [0, -3, 1.5]
look_at = [0, 0, 0.5]
[[camera]]
t_s = 0.5
position = [0.5, -3, 1.5]
look_at = [0, 0, 0.5]
vertical_fov_deg = 50
[[luminaire]]
name = "luminaire 1"
[[luminaire.key]]
t_s = 0
position = [0, 0, 2]
rotate_deg = [180, 0, 0]
scale = 1
[[luminaire.key]]
t_s = 0.5
position = [0, 0.1, 2]
rotate_deg = [170, 0, 0]
scale = 2
"""
FAR = SCENE + """[[luminaire]]
model = "area"
distribution = "lamp.ies"
position = [0, 0, 2]
rotate_deg = [180, 0, 0]
colour = [1, 0.5, 0.25]
[[luminaire]]
model = "linear"
distribution = "lamp.ldt"
size = [0, 0.5]
position = [1, 0, 2]
look_at = [1, 0, 0]
up = [0, 1, 0]
[[luminaire]]
model = "point"
distribution = "lamp.xml"
position = [0, 1, 2]
scale = 2
"""
OBJ = """mtllib m.mtl
o thing
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0.5 0.5 1
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
usemtl m
f 1/1/1 2/2/1 3/3/1 4/1/1
f 1/1 2/2 5/3
f 2 3 5
"""
MTL = "newmtl m\nKd 0.5 0.4 0.3\nKs 0.1 0.1 0.1\nNs 20\nmap_Kd t.png\n"
PLY = """ply
format ascii 1.0
comment made by hand
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face 2
property list uchar int vertex_indices
end_header
0 0 0 0 0 1
1 0 0 0 0 1
1 1 0 0 0 1
0 1 0 0 0 1
3 0 1 2
3 0 2 3
"""
PROBE = """[probe]
kind = "mirror-ball"
azimuth_deg = 30
reflectance = [0.68]
margin_px = 2
[camera]
gain_dn_per_e = 1
saturation_dn = 60000
black_dn = 0
read_noise_dn = 1
[rim]
centre_px = [40, 40]
radius_px = 30
[[exposure]]
file = "short.exr"
exposure_s = 0.001
[[exposure]]
file = "long.exr"
exposure_s = 0.03
"""
BUDGET = """[uncertainty]
shutter_jitter_s = 1e-6
stage_m = 1e-5
density = 0.002
stray_share = 0.001
smallest_spot_m = 0.01
[[radiance]]
u_m = [0, 0]
s_m = [0.01, 0.01]
[[irradiance]]
p_m = [0, 0, 1]
"""
ASK = """[certificate]
number = "2026-0042"
laboratory = "Lighting Laboratory"
address = "1 Bench Street"
customer = "Lamps Ltd"
lamp = "Square lamp"
condition = "as it was delivered, after an hour of burning"
[[point]]
name = "desk"
position_m = [0.1, 0, 1]
[[plane]]
name = "wall"
centre_m = [0, 0, 1]
width_m = 1
height_m = 1
columns = 5
rows = 4
[[eye]]
name = "at the desk"
eye_m = [0.3, 0, 1]
line_of_sight = [-0.3, 0, -1]
fields_of_view_mrad = [100]
background_cd_per_m2 = 40
opening_m = [0.06, 0.06]
[[line]]
name = "across"
from_m = [-0.2, 0, 1]
to_m = [0.2, 0, 1]
points = 5
[quality]
responsivity = "camera.csv"
lamp_spectrum = "lamp.csv"
sensor_calibration = "q.cal.json"
"""
SPECTRUM = "400, 0.1\n500, 0.5\n560, 1\n600, 0.6\n700, 0.1\n"
IES = """IESNA:LM-63-2002
[TEST] 1
[MANUFAC] made by hand
TILT=NONE
1 -1 1 3 4 1 2 0.1 0.2 0
1 1 50
0 45 90
0 90 180 270
900 500 100 910 400 90
920 300 80 930 200 70
"""
TM33 = """<?xml version="1.0"?>
<IESTM33-22><Version>1.1</Version><Header><Description>made by hand</Description></Header>
<Emitter><Quantity>1</Quantity><InputWattage>9</InputWattage><LuminousData><LuminousIntensity>
<IntData h="0" v="0">10</IntData><IntData h="0" v="90">1</IntData>
<IntData h="180" v="0">10</IntData><IntData h="180" v="90">2</IntData>
</LuminousIntensity></LuminousData></Emitter></IESTM33-22>
"""
LDT = "\n".join(
    "made by hand,3,0,4,90,3,45,R,L,N,F,2024,600,300,50,500,200,0,0,0,0,100,80,1,0,1,1,LED,1000,3000,80,25".split(",")
    + ["0.5"] * 10 + "0 90 180 270 0 45 90 900 500 100 900 400 90 900 300 80 900 200 70".split() + [""]
)  # fmt: skip
JOBS = {
    "merge": ("s", "o.meas.exr", 3, ""),
    "reconstruct": ("x.meas.exr", "o.lf.exr", 3, '[options]\nsigma = "o.sigma.lf.exr"\n'),
    "preprocess": ("x.lf.exr", "o.tab.exr", 2, ""),
}


def job_toml(verb):
    source, output, shards, options = JOBS[verb]
    return f'[job]\nverb = "{verb}"\ninput = "{source}"\noutput = "{output}"\nshards = {shards}\n{options}'


def write_gltf(folder):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], "<f4")
    uv = np.array([[0, 0], [1, 0], [0, 1]], "<f4")
    data = corners.tobytes() + uv.tobytes() + struct.pack("<3H", 0, 1, 2) + b"\0\0"
    (folder / "m.bin").write_bytes(data)
    view = lambda at, size: {"buffer": 0, "byteOffset": at, "byteLength": size}  # noqa: E731
    root = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1]}, {"mesh": 0, "translation": [0, 0, 0.1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.1}}],
        "textures": [{"source": 0}], "images": [{"uri": "t.png"}],
        "buffers": [{"uri": "m.bin", "byteLength": len(data)}],
        "bufferViews": [view(0, 36), view(36, 24), view(60, 6)],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
    }  # fmt: skip
    (folder / "m.gltf").write_text(json.dumps(root))


def write_foreign(folder):
    random = np.random.default_rng(7)
    for name, text in {
        "lab.toml": LAB, "plan.toml": PLAN, "sensor.lab.toml": SENSOR_LAB, "sensor.plan.toml": SENSOR_PLAN,
        "bare.toml": SCENE, "lit.toml": LIT, "far.toml": FAR, "path.toml": PATH, "m.obj": OBJ, "m.mtl": MTL, "m.ply": PLY, "probe.toml": PROBE,
        "lamp.ies": IES, "lamp.ldt": LDT, "lamp.xml": TM33, "budget.toml": BUDGET, "ask.toml": ASK, "lamp.csv": SPECTRUM,
        "camera.csv": SPECTRUM.replace("0.5", "0.4"), "small.toml": SMALL, "o.toml": SCENE.replace('"m.ply"', '"m.obj"').replace('"m.gltf"', '"m.obj"'),
        **{f"{verb}.job.toml": job_toml(verb) for verb in JOBS},
    }.items():  # fmt: skip
        (folder / name).write_text(text)
    write_gltf(folder)
    write_png(folder / "t.png", random.integers(0, 255, (8, 8, 3), np.uint8))
    scene = np.outer(np.linspace(0.02, 1, 48), np.linspace(0.05, 1, 48))[:, :, None] * [1, 0.8, 0.6]
    for name, exposure in [("a", 0.1), ("b", 0.4), ("c", 1.6)]:
        codes = 255 * np.clip(exposure * scene, 0, 1) ** (1 / 2.2)
        write_png(folder / f"{name}.png", codes.astype(np.uint8))
    write_hdr(folder / "sky.hdr", np.exp(random.normal(0, 1, (8, 16, 3))))
    write_tm25(folder / "r.tm25ray", *disc_rays(400, 0.02, 2, random))
    y, x = np.mgrid[:80, :80]
    ball = np.where((x - 40) ** 2 + (y - 40) ** 2 < 900, 3e5 * (1 + 0.3 * np.sin(x / 3)), 4e4)
    for name, exposure in [("short", 0.001), ("long", 0.03)]:
        frame = np.minimum(ball * exposure, 60000).astype(np.float32)
        exr.write(folder / f"{name}.exr", [exr.Part("", {c: frame for c in "RGB"})])


# What the program makes, in order.
MADE = [
    "capture plan.toml s --lab lab.toml",
    "capture sensor.plan.toml q --lab sensor.lab.toml",
    "merge s -o x.meas.exr",
    "reconstruct x.meas.exr -o x.lf.exr --sigma x.sigma.lf.exr",
    "preprocess x.lf.exr -o x.tab.exr",
    "export x.lf.exr -o x.gldf --plane-step 45 --angle-step 15",
    "export x.lf.exr -o x.dat --rays 300",
    "export x.lf.exr -o x.ltrf --rays 300",
    "export x.lf.exr -o x.speos.ray --rays 300",
    "export x.lf.exr -o lt.txt --format lighttools-text --rays 300",
    "calibrate sensor q -o q.cal.json",
    "calibrate flat-field q -o q.flat.exr",
    "calibrate response a.png b.png c.png --exposure 0.1 0.4 1.6 -o r.cal.json --samples 200",
    "merge a.png b.png c.png --exposure 0.1 0.4 1.6 --calibration r.cal.json -o stack.exr",
    "sky -o sky.exr --latitude 48 --date 2024-06-21 --height 32",
    "sky -o day --latitude 48 --date 2024-06-21 --height 32 --day --frames 2",
    "filter print --spacing 4mm --dpi 100 -o f",
    "render lit.toml -o groups.exr --spp 2 --shadows none --light-groups",
    "export x.lf.exr -o lamp.glb",
]
CACHED = "render small.toml -o small.exr --estimator volume --shadows none"


def make(folder, run):
    """Fills the folder; run(words) runs the program in it and returns its answer."""
    write_foreign(folder)
    for line in MADE + [CACHED]:
        if line == CACHED:
            (folder / "cache").mkdir(mode=0o700)
        answer = run(line.split() + ["--quiet"])
        if answer.get("exit") != 0:
            raise RuntimeError(f"luxfield {line}: {answer}")
    # As a capture leaves it that was interrupted: not sealed.
    shutil.copytree(folder / "s", folder / "u")
    (folder / "u" / "manifest.json").unlink()
    journal = (folder / "u" / "journal.jsonl").read_bytes().splitlines(keepends=True)
    (folder / "u" / "journal.jsonl").write_bytes(b"".join(journal[:-3]))
